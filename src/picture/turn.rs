//! How rays from the eye go on at mirrors, gloss and glass.

use glam::{Vec2, Vec3};

use super::surface::Surface;
use crate::scene::{Gloss, LobeValue, reflected, reflected_by_pane, refracted};

impl Surface {
    /// The normal by which a ray is mirrored: that of the smooth surface where the ray then leaves the flat one.
    fn mirror_normal(&self, direction: Vec3) -> Vec3 {
        let is_seen = self.normal.dot(direction) < 0.0;
        let leaves = || reflected(direction, self.normal).dot(self.flat_normal) > 0.0;
        match is_seen && leaves() {
            true => self.normal,
            false => self.flat_normal,
        }
    }

    /// Where a mirror sends a ray.
    pub(super) fn mirrored(&self, direction: Vec3) -> Vec3 {
        reflected(direction, self.mirror_normal(direction))
    }

    /// The lobe of gloss about a ray.
    pub(super) fn lobe(&self, roughness: f32, direction: Vec3) -> Lobe {
        Lobe {
            gloss: Gloss::new(roughness),
            normal: self.mirror_normal(direction),
            flat_normal: self.flat_normal,
            to: -direction,
        }
    }

    /// Where glass sends a ray: in the mirrored direction and behind the surface, with the parts by channel.
    pub(super) fn through_glass(
        &self,
        direction: Vec3,
        index: f32,
        is_thin: bool,
        filter: Vec3,
    ) -> [(Vec3, Vec3); 2] {
        let normal = self.mirror_normal(direction);
        let (onward, part) = if is_thin {
            (
                Some(direction),
                reflected_by_pane(-normal.dot(direction), index),
            )
        } else {
            let index = if self.is_back { 1.0 / index } else { index };
            refracted(direction, normal, index)
        };
        let is_behind = |onward: &Vec3| onward.dot(self.flat_normal) < 0.0;
        let (onward, behind) = match onward.filter(is_behind) {
            Some(onward) => (onward, (1.0 - part) * filter),
            None => (direction, Vec3::ZERO),
        };
        [
            (reflected(direction, normal), Vec3::splat(part)),
            (onward, behind),
        ]
    }
}

/// Gloss as seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lobe {
    gloss: Gloss,
    normal: Vec3,
    flat_normal: Vec3,
    /// Towards the eye.
    to: Vec3,
}

impl Lobe {
    /// A direction, the value over the density there, and the density.
    pub(super) fn sample(&self, square: Vec2) -> Option<(Vec3, f32, f32)> {
        let (direction, weight) = self.gloss.sample(self.normal, self.to, square)?;
        let is_above = direction.dot(self.flat_normal) > 0.0;
        let density = self.gloss.value(self.normal, self.to, direction).density;
        is_above.then_some((direction, weight, density))
    }

    /// What is reflected from a direction.
    pub(super) fn toward(&self, direction: Vec3) -> LobeValue {
        match direction.dot(self.flat_normal) > 0.0 {
            true => self.gloss.value(self.normal, self.to, direction),
            false => LobeValue {
                value: 0.0,
                density: 0.0,
            },
        }
    }
}
