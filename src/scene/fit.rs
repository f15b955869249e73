//! The frame that fits a scene, and its corners in that frame.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Face, Frame, SceneBuilder, SizeClasses};

/// Largest extent of a scene, in multiples of the root of its area, that its frame fits. Usual rooms have less than 1, a
/// corridor 3; above, it is far surroundings, or a stray vertex, that make a scene large.
const LARGEST_EXTENT: f64 = 4.0;

impl SceneBuilder {
    /// The frame that fits the corners in use.
    pub(super) fn frame(&self) -> Frame {
        let corners = self
            .faces
            .par_iter()
            .map(|face| face.corners.map(|corner| self.positions[corner as usize]));
        let (min, max) = corners
            .map(|[a, b, c]| (a.min(b).min(c), a.max(b).max(c)))
            .reduce(
                || (DVec3::MAX, DVec3::MIN),
                |a, b| (a.0.min(b.0), a.1.max(b.1)),
            );
        let extent = (max - min).max_element();
        let frame = Frame::fitting(min, max);
        let sizes = self.sizes_of_reflecting_faces();
        let classes = SizeClasses::new(sizes.iter().map(|&(squared, area, _)| (squared, area)));
        let detail = LARGEST_EXTENT * classes.area.sqrt();
        frame.focused(extent, detail, || {
            let fine = sizes
                .into_iter()
                .filter(|(squared, ..)| classes.is_fine(*squared));
            median(fine.map(|(_, _, centroid)| centroid).collect())
        })
    }

    /// Squared longest edge, area and centroid of all faces that do not emit, or of all where all do, in world units.
    fn sizes_of_reflecting_faces(&self) -> Vec<(f64, f64, DVec3)> {
        let emits = |face: &Face| self.materials[face.material.index()].emission != Vec3::ZERO;
        let all_emit = self.faces.iter().all(emits);
        let chosen = self
            .faces
            .par_iter()
            .filter(|face| all_emit || !emits(face));
        chosen
            .map(|face| {
                let [a, b, c] = face.corners.map(|corner| self.positions[corner as usize]);
                let squares = [a - b, b - c, c - a].map(DVec3::length_squared);
                let longest = squares.into_iter().fold(0.0, f64::max);
                let area = 0.5 * (b - a).cross(c - a).length();
                (longest, area, (a + b + c) / 3.0)
            })
            .collect()
    }

    /// Merge corners that fall on the same frame position; returns the positions and where each old one went.
    pub(super) fn weld(&self, frame: &Frame) -> (Vec<Vec3>, Vec<u32>) {
        let place = |corner: u32| {
            // Adding 0 turns -0 into 0, so that both have the same bits.
            frame.from_world(self.positions[corner as usize]) + 0.0
        };
        let first_equal = self.first_equal(place);
        let mut positions = Vec::new();
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut corner_of = number.clone();
        for corner in self.faces.iter().flat_map(|face| face.corners) {
            let number = &mut number[first_equal[corner as usize] as usize];
            if *number == u32::MAX {
                *number = positions.len() as u32;
                positions.push(place(corner));
            }
            corner_of[corner as usize] = *number;
        }
        (positions, corner_of)
    }

    /// By corner: the first one in the same place, bit by bit.
    fn first_equal(&self, place: impl Fn(u32) -> Vec3 + Sync) -> Vec<u32> {
        let mut places: Vec<([u32; 3], u32)> = (0..self.positions.len() as u32)
            .into_par_iter()
            .map(|corner| (place(corner).to_array().map(f32::to_bits), corner))
            .collect();
        places.par_sort_unstable();
        let mut first_equal = vec![0; places.len()];
        for equal in places.chunk_by(|a, b| a.0 == b.0) {
            for &(_, corner) in equal {
                first_equal[corner as usize] = equal[0].1;
            }
        }
        first_equal
    }
}

/// The median of some points by coordinate, zero of none.
fn median(mut points: Vec<DVec3>) -> DVec3 {
    let middle = points.len() / 2;
    let coordinate = |axis: usize| {
        let (_, point, _) =
            points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
        point[axis]
    };
    match middle {
        0 => points.first().copied().unwrap_or_default(),
        _ => DVec3::from_array([0, 1, 2].map(coordinate)),
    }
}
