//! Faces that can be lit: others are dropped, counted by reason and named with the line of the first.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::builder::Skipped;
use super::coplanar::Overlaps;
use super::overlay::{self, DOUBLED};
use super::{Face, Frame, SceneBuilder};

/// Area below this fraction of the squared longest edge counts as zero: the rounding of decimal digits in a file
/// leaves about 1e-16, a needle of aspect one in a million has 1e-6.
const DEGENERATE_AREA: f64 = 1e-12;

impl SceneBuilder {
    /// Remove faces with bad indices, non-finite corners or no area.
    pub(super) fn drop_unusable_faces(&mut self) -> Vec<Skipped> {
        let positions = std::mem::take(&mut self.positions);
        let material_count = self.materials.len().max(1);
        let skipped = self.drop_faces(|_, face| unusable(face, &positions, material_count));
        self.positions = positions;
        skipped
    }

    /// Remove faces that shrink to a line or a point in the frame's single precision.
    pub(super) fn drop_vanished_faces(&mut self, frame: &Frame, corner_of: &[u32]) -> Vec<Skipped> {
        let positions = std::mem::take(&mut self.positions);
        let skipped = self.drop_faces(|_, face| {
            let [a, b, c] = face.corners.map(|corner| corner_of[corner as usize]);
            let area = frame.area_vector(face.corners.map(|corner| positions[corner as usize]));
            // Of areas whose square underflows there is no direction either.
            let vanished = a == b || b == c || c == a || area.length() == 0.0;
            vanished.then_some("too small next to the size of the scene")
        });
        self.positions = positions;
        skipped
    }

    /// Remove faces with the corners of another one that look the same way, so that the shells of both are as one; returns
    /// which of the others lie over each other.
    pub(super) fn drop_repeated_faces(
        &mut self,
        corner_of: &[u32],
        positions: &[Vec3],
    ) -> Overlaps {
        loop {
            let corners: Vec<[u32; 3]> = self
                .faces
                .iter()
                .map(|face| face.corners.map(|corner| corner_of[corner as usize]))
                .collect();
            let overlaps = Overlaps::of(&corners, positions);
            let repeated = overlay::repeated(&overlaps, &corners, |face, other| {
                self.goes_before(other, face) && self.may_cover(face, other)
            });
            if repeated.is_empty() {
                return overlaps;
            }
            let skipped = self.drop_faces(|index, _| {
                let is_repeated = repeated.binary_search(&(index as u32)).is_ok();
                is_repeated.then_some(DOUBLED)
            });
            self.doubled_faces += skipped.iter().map(|skipped| skipped.count).sum::<usize>();
        }
    }

    /// Remove the faces for which there is a reason, count them by reason, and keep objects at their first faces. The
    /// reason is asked for by the place among the faces and the face.
    fn drop_faces(
        &mut self,
        reason: impl Fn(usize, &Face) -> Option<&'static str> + Sync,
    ) -> Vec<Skipped> {
        let mut skipped: Vec<Skipped> = Vec::new();
        let faces = self.faces.par_iter().enumerate();
        if !faces
            .clone()
            .any(|(index, face)| reason(index, face).is_some())
        {
            return skipped;
        }
        let (mut index, mut kept) = (0, 0);
        let objects = &mut self.objects;
        let mut next_object = 0;
        self.faces.retain(|face| {
            while objects
                .get(next_object)
                .is_some_and(|object| object.1 <= index)
            {
                objects[next_object].1 = kept;
                next_object += 1;
            }
            index += 1;
            let Some(reason) = reason(index - 1, face) else {
                kept += 1;
                return true;
            };
            match skipped.iter_mut().find(|known| known.reason == reason) {
                Some(known) => known.count += 1,
                None => skipped.push(Skipped {
                    reason,
                    count: 1,
                    line: face.line,
                }),
            }
            false
        });
        for object in &mut objects[next_object..] {
            object.1 = kept;
        }
        for skipped in &skipped {
            self.warn_of_skipped("a face", skipped);
        }
        skipped
    }
}

/// Why a face cannot be used, if it cannot.
fn unusable(face: &Face, positions: &[DVec3], material_count: usize) -> Option<&'static str> {
    if face
        .corners
        .iter()
        .any(|&corner| corner as usize >= positions.len())
    {
        return Some("vertex index out of range");
    }
    if face.material.index() >= material_count {
        return Some("material index out of range");
    }
    let [a, b, c] = face.corners.map(|corner| positions[corner as usize]);
    if !(a.is_finite() && b.is_finite() && c.is_finite()) {
        return Some("a corner is not a finite number");
    }
    is_degenerate([a, b, c]).then_some("no area")
}

/// Whether a triangle has no area but for rounding.
pub(super) fn is_degenerate([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    let area = (b - a).cross(c - a).length();
    // Written so that a NaN from overflow counts as degenerate, too.
    !(area > DEGENERATE_AREA * longest && area.is_finite())
}
