//! Rays over plane mirrors.

use glam::Vec3;

use super::{
    mirrors::Image,
    panes::chance,
    rays::{Hit, Passage, RayTree},
};
use crate::scene::TriangleId;

/// Part of a ray's light below which it ends between mirrors. Larger darkens rooms of mirrors; smaller takes time in them.
const LEAST_LEFT: f32 = 1e-3;

/// Mirrors on the way of a ray at most: between two that reflect everything it would never end. Fewer darken rooms of such
/// mirrors; more take time in them.
const MOST_REFLECTIONS: u32 = 256;

/// A ray after the mirrors on its way.
#[derive(Clone, Copy, Debug)]
pub struct Followed {
    /// What it meets.
    pub hit: Option<Hit>,
    /// Where its last part starts.
    pub origin: Vec3,
    /// Unit direction of its last part.
    pub direction: Vec3,
    /// Length of its parts before that.
    pub length: f32,
    /// By what its light is to be multiplied, by channel.
    pub tint: Vec3,
    /// How many mirrors reflected it.
    pub reflections: u32,
}

impl RayTree {
    /// What a ray meets first, be it a mirror, with its tint.
    pub fn met(&self, origin: Vec3, direction: Vec3, from: Option<TriangleId>) -> Followed {
        let hit = self.closest(origin, direction, from);
        Followed {
            hit,
            origin,
            direction,
            length: 0.0,
            tint: self.tint(origin, direction, from, hit),
            reflections: 0,
        }
    }

    /// Follow a ray to a surface that does not reflect it as a mirror. Where a mirror is diffuse as well, chance decides.
    pub fn followed(&self, origin: Vec3, direction: Vec3, from: Option<TriangleId>) -> Followed {
        let Some(mirrors) = self.mirrors() else {
            return self.met(origin, direction, from);
        };
        let (mut origin, mut direction, mut from) = (origin, direction, from);
        let (mut tint, mut length, mut reflections) = (Vec3::ONE, 0.0, 0);
        loop {
            let hit = self.closest(origin, direction, from);
            tint *= self.tint(origin, direction, from, hit);
            let met = hit.and_then(|hit| Some((hit, mirrors.met(hit.triangle, direction)?.1)));
            if let Some((hit, mirror)) = met {
                let part = mirror.mirrored_part;
                let reflects = part >= 1.0 || chance(origin, direction, !hit.triangle.0) < part;
                let is_left = tint.max_element() > LEAST_LEFT && reflections < MOST_REFLECTIONS;
                if reflects && is_left {
                    reflections += 1;
                    origin += direction * hit.distance;
                    direction = mirror.reflected(direction);
                    from = Some(hit.triangle);
                    tint *= mirror.reflectance / part;
                    length += hit.distance;
                    continue;
                }
                tint *= match reflects {
                    true => 0.0,
                    false => 1.0 / (1.0 - part),
                };
            }
            return Followed {
                hit,
                origin,
                direction,
                length,
                tint,
                reflections,
            };
        }
    }

    /// What passes from a point to one of the scene over all mirrors of an image, by channel, beside what they take, with
    /// the length of the way to what blocks. The triangles are those of both ends.
    pub fn passage_over(
        &self,
        image: &Image,
        from: Vec3,
        to: Vec3,
        [start, end]: [Option<TriangleId>; 2],
    ) -> Passage {
        let seen = image.place(to);
        let direction = (seen - from).normalize_or_zero();
        match self.over_mirrors(image, from, direction, from.distance(seen), start) {
            Err(blocked) => blocked,
            Ok(leg) => leg.and(self.passage(leg.origin, to, [leg.from, end])),
        }
    }

    /// As [`Self::passage_over`], out of the scene in a direction of it.
    pub fn passage_outward_over(
        &self,
        image: &Image,
        from: Vec3,
        direction: Vec3,
        start: Option<TriangleId>,
    ) -> Passage {
        let seen = image.direction(direction);
        match self.over_mirrors(image, from, seen, f32::INFINITY, start) {
            Err(blocked) => blocked,
            Ok(leg) => leg.and(self.passage_outward(leg.origin, direction, leg.from)),
        }
    }

    /// What a ray meets behind all mirrors of the image, with its tint; `None` where it misses one.
    pub fn met_over(
        &self,
        image: &Image,
        from: Vec3,
        direction: Vec3,
        start: Option<TriangleId>,
    ) -> Option<Followed> {
        let leg = self
            .over_mirrors(image, from, direction, f32::INFINITY, start)
            .ok()?;
        let last = self.met(leg.origin, image.source_direction(direction), leg.from);
        Some(Followed {
            length: leg.length,
            tint: leg.tint * last.tint,
            reflections: image.legs.len() as u32,
            ..last
        })
    }

    /// The last mirror on the way of a ray; what it is blocked by if it misses one, or if that lies further than `until`.
    fn over_mirrors(
        &self,
        image: &Image,
        from: Vec3,
        direction: Vec3,
        until: f32,
        start: Option<TriangleId>,
    ) -> Result<Leg, Passage> {
        let mut leg = Leg {
            origin: from,
            from: start,
            length: 0.0,
            tint: Vec3::ONE,
        };
        let mut direction = direction;
        for &expected in &image.legs {
            let hit = self.closest(leg.origin, direction, leg.from);
            let blocked = |end: f32| Passage {
                transmittance: Vec3::ZERO,
                end,
            };
            let Some(hit) = hit else {
                return Err(blocked(until));
            };
            let mirrors = self.mirrors();
            let met = mirrors.and_then(|mirrors| mirrors.met(hit.triangle, direction));
            let end = leg.length + hit.distance;
            let Some((_, mirror)) = met.filter(|(index, _)| *index == expected && end < until)
            else {
                return Err(blocked(end));
            };
            leg.tint *= self.tint(leg.origin, direction, leg.from, Some(hit));
            leg.origin += direction * hit.distance;
            leg.from = Some(hit.triangle);
            leg.length = end;
            direction = mirror.reflected(direction);
        }
        Ok(leg)
    }
}

/// A ray at a mirror.
struct Leg {
    origin: Vec3,
    from: Option<TriangleId>,
    /// Of the way so far.
    length: f32,
    tint: Vec3,
}

impl Leg {
    /// What passes on the way so far and on the rest of it.
    fn and(&self, rest: Passage) -> Passage {
        Passage {
            transmittance: self.tint * rest.transmittance,
            end: self.length + rest.end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Random,
        scene::{Material, Scene, SceneBuilder, SceneOptions, Sides, Specular},
    };

    /// A box of 2 x 2 x 2 about the origin, seen from inside, whose walls of lowest x and highest z are mirrors.
    fn scene() -> Scene {
        let mut builder = SceneBuilder::default();
        let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.5), Vec3::ONE));
        let mirror = builder.push_material(Material {
            specular: Some(Specular::Mirror {
                reflectance: Vec3::splat(0.75),
            }),
            ..Material::plain("mirror", Vec3::ZERO, Vec3::ZERO)
        });
        let at = |corner: u32| {
            let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
            glam::DVec3::new(sign(0), sign(1), sign(2))
        };
        for corner in 0..8 {
            builder.push_position(at(corner));
        }
        for (corners, is_mirror) in [
            ([0, 2, 6, 4], true),
            ([1, 5, 7, 3], false),
            ([0, 4, 5, 1], false),
            ([2, 3, 7, 6], false),
            ([0, 1, 3, 2], false),
            ([4, 6, 7, 5], true),
        ] {
            let [a, b, c, d] = corners;
            let material = if is_mirror { mirror } else { wall };
            builder.push_triangle([a, b, c], material);
            builder.push_triangle([a, c, d], material);
        }
        let options = SceneOptions::with_sides(Sides::Two);
        builder.finish(&options).expect("six faces")
    }

    #[test]
    fn images_lie_where_mirrors_show_them() {
        let scene = scene();
        let rays = RayTree::new(&scene);
        let mirrors = rays.mirrors().expect("two");
        // One in each, and one in both in either order; a third reflection cannot come.
        let lengths = mirrors.images().iter().map(|image| image.legs.len());
        assert!(lengths.eq([1, 1, 2, 2]));
        let frame = &scene.frame;
        let point = frame.from_world(glam::DVec3::new(0.25, 0.5, 0.75));
        for image in mirrors.images() {
            let seen = image.place(point);
            assert!(image.source_of(seen).distance(point) < 1e-4);
            let unit = Vec3::new(0.6, 0.0, 0.8);
            assert!(image.source_direction(image.direction(unit)).distance(unit) < 1e-6);
        }
        let first = &mirrors.images()[0];
        let world = frame.to_world(first.place(point));
        let expected = [(-2.25, 0.75), (0.25, 1.25)];
        assert!(
            expected
                .iter()
                .any(|(x, z)| { (world.x - x).abs() < 1e-4 && (world.z - z).abs() < 1e-4 }),
            "{world}"
        );
    }

    #[test]
    fn rays_over_mirrors_end_where_they_are_aimed() {
        let scene = scene();
        let rays = RayTree::new(&scene);
        let mirrors = rays.mirrors().expect("two");
        let mut random = Random::new(1, 2);
        let mut passed = [0; 3];
        for _ in 0..2000 {
            let mut inside = || {
                let at = [(); 3].map(|()| f64::from(random.uniform()) * 1.8 - 0.9);
                scene.frame.from_world(glam::DVec3::from_array(at))
            };
            let (from, to) = (inside(), inside());
            for image in mirrors.images().iter().filter(|image| image.legs.len() < 3) {
                let passage = rays.passage_over(image, from, to, [None; 2]);
                if passage.transmittance == Vec3::ZERO {
                    continue;
                }
                passed[image.legs.len()] += 1;
                // A ray that is mirrored by what it meets comes to the same place.
                let direction = (image.place(to) - from).normalize_or_zero();
                let (mut origin, mut direction, mut start) = (from, direction, None);
                for _ in &image.legs {
                    let hit = rays.closest(origin, direction, start).expect("closed");
                    origin += direction * hit.distance;
                    let mirror = mirrors.met(hit.triangle, direction).expect("a mirror").1;
                    direction = mirror.reflected(direction);
                    start = Some(hit.triangle);
                }
                let nearest = origin + direction * (to - origin).dot(direction);
                assert!(nearest.distance(to) < 1e-3, "{nearest} {to}");
            }
        }
        // In a convex room each mirror shows all of it, and two at a right angle show it once more between them.
        assert_eq!(passed[1], 4000);
        assert!(passed[2] > 1900 && passed[2] < 2100, "{passed:?}");
    }

    #[test]
    fn followed_rays_lose_what_mirrors_take() {
        let scene = scene();
        let rays = RayTree::new(&scene);
        let mirrors = rays.mirrors().expect("two");
        let direction = Vec3::new(-0.8, 0.36, 0.48).normalize_or_zero();
        let followed = rays.followed(Vec3::ZERO, direction, None);
        let hit = followed.hit.expect("closed");
        assert!(!mirrors.has(hit.triangle) && followed.length > 0.0);
        let reflections = followed.tint.x.log(0.75).round();
        assert!((followed.tint.x - 0.75f32.powf(reflections)).abs() < 1e-5);
    }
}
