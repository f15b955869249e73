//! What rays pass through: panes and what is cut out of surfaces.
//!
//! Whether a ray that must meet one surface meets a pane is decided by chance, with the share of the rays that the pane
//! does not let through. The decision is a hash of the ray and the triangle, so it is the same in whatever order triangles
//! are tried, and on any thread.

use glam::{Vec2, Vec3};

use super::barycentric;
use crate::scene::{Cutout, Scene};

/// The triangles of a scene that light passes through.
pub(super) struct Panes {
    /// By triangle: index into `list`, or [`Self::OPAQUE`].
    numbers: Vec<u32>,
    list: Vec<Pane>,
    /// As in the scene.
    cutouts: Vec<Cutout>,
    /// Whether some pane colours what passes.
    is_coloured: bool,
}

/// A triangle that light passes through.
struct Pane {
    corners: [Vec3; 3],
    /// What passes where it is not cut out, by channel, 0…1.
    transmission: Vec3,
    /// Index into the cut-outs, and the texture coordinates of the corners.
    cutout: Option<(u32, [Vec2; 3])>,
}

impl Panes {
    const OPAQUE: u32 = u32::MAX;

    /// Those of a scene; `None` where nothing passes through anything.
    pub(super) fn of(scene: &Scene) -> Option<Box<Self>> {
        if !scene.is_see_through() {
            return None;
        }
        let mut panes = Self {
            numbers: vec![Self::OPAQUE; scene.triangles.len()],
            list: Vec::new(),
            cutouts: scene.cutouts.clone(),
            is_coloured: false,
        };
        for id in scene.triangle_ids() {
            let Some(see_through) = scene.see_through(id) else {
                continue;
            };
            let transmission = see_through.transmission;
            panes.numbers[id.index()] = panes.list.len() as u32;
            panes.is_coloured |= transmission != Vec3::splat(transmission.x);
            let cutout = scene.material(id).cutout;
            panes.list.push(Pane {
                corners: scene.corners(id),
                transmission,
                cutout: cutout.and_then(|id| Some((id.0, see_through.cutout?.1))),
            });
        }
        (!panes.list.is_empty()).then(|| Box::new(panes))
    }

    /// Whether some pane colours what passes.
    pub(super) fn is_coloured(&self) -> bool {
        self.is_coloured
    }

    /// Whether light passes through a triangle.
    pub(super) fn has(&self, triangle: u32) -> bool {
        self.numbers[triangle as usize] != Self::OPAQUE
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        let cutouts = self.cutouts.iter().map(Cutout::memory_bytes);
        size_of_val(self.numbers.as_slice())
            + size_of_val(self.list.as_slice())
            + cutouts.sum::<usize>()
    }

    fn pane(&self, triangle: u32) -> Option<&Pane> {
        self.list.get(self.numbers[triangle as usize] as usize)
    }

    /// Whether a triangle is there at a point of it, and not cut out.
    pub(super) fn is_there(&self, triangle: u32, point: Vec3) -> bool {
        let cutout = self
            .pane(triangle)
            .and_then(|pane| Some((pane, pane.cutout?)));
        cutout.is_none_or(|(pane, (cutout, [a, b, c]))| {
            let at = barycentric(point, pane.corners);
            self.cutouts[cutout as usize].has_at(a * at.x + b * at.y + c * at.z)
        })
    }

    /// What passes through a triangle at a point of it, by channel, 0…1.
    pub(super) fn passing(&self, triangle: u32, point: Vec3) -> Vec3 {
        match self.pane(triangle) {
            None => Vec3::ZERO,
            Some(_) if !self.is_there(triangle, point) => Vec3::ONE,
            Some(pane) => pane.transmission,
        }
    }

    /// Whether a ray meets a triangle at a point of it.
    pub(super) fn meets(&self, triangle: u32, point: Vec3, [origin, direction]: [Vec3; 2]) -> bool {
        let Some(pane) = self.pane(triangle) else {
            return true;
        };
        let share = mean(pane.transmission);
        self.is_there(triangle, point)
            && (share <= 0.0 || chance(origin, direction, triangle) >= share)
    }
}

/// Mean of the channels: the share of rays that pass.
pub(super) fn mean(transmission: Vec3) -> f32 {
    transmission.element_sum() / 3.0
}

/// A number in 0…1 for a ray and a triangle.
pub(super) fn chance(origin: Vec3, direction: Vec3, triangle: u32) -> f32 {
    let bits = origin.to_array().into_iter().chain(direction.to_array());
    let hash = bits
        .map(f32::to_bits)
        .chain([triangle])
        .fold(0x9e37_79b9_7f4a_7c15, |hash: u64, word| {
            mixed(hash ^ u64::from(word))
        });
    (hash >> 40) as f32 / (1u64 << 24) as f32
}

/// The finaliser of SplitMix64 (Steele, Lea & Flood 2014).
fn mixed(mut word: u64) -> u64 {
    word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ (word >> 31)
}
