//! Plane mirrors, and the images in them.
//!
//! A plane mirror shows the scene at its mirrored place. The reflection is an isometry, so whatever holds between a point and
//! what it sees holds between the point and an image, or, which is the same, between the image of the point and what is there;
//! only that the ray between both must pass the mirror. Mirrors show images of mirrors: these are chains of reflections.

use std::{collections::HashMap, sync::Arc};

use glam::{Mat3, Vec3};

use super::{Hit, Passage, RayTree, panes::chance};
use crate::scene::{Scene, Specular, TriangleId, luminance};

/// Most mirrors whose images are followed. Fewer, and rooms of mirrors are taken for diffuse; more take time for each.
const MOST_MIRRORS: usize = 8;

/// Most images. Fewer leave out what facing mirrors show of each other; more take time for each.
const MOST_IMAGES: usize = 32;

/// Images that are weaker than this part of what they show are left out. Larger darkens rooms with facing mirrors; smaller
/// takes time.
const LEAST_WEIGHT: f32 = 0.02;

/// Mirrors smaller than this part of the area of the scene have no images. Larger leaves out mirrors that light shows; smaller
/// takes time for those that it does not, and for every facet of a curved one.
const LEAST_SHARE: f32 = 2e-4;

/// Part of a ray's light below which it ends between mirrors.
const LEAST_LEFT: f32 = 1e-3;

/// Steps within which normals (of unit length) and distances (in frame units) are those of one plane.
const PLANE_STEPS: [f32; 2] = [1e-4, 1e-3];

/// The plane mirrors of a scene.
pub struct Mirrors {
    list: Vec<Mirror>,
    /// By triangle: index into `list`, or [`Self::NONE`].
    of_triangle: Vec<u32>,
    images: Vec<Arc<Image>>,
}

/// A plane mirror.
#[derive(Clone, Debug)]
struct Mirror {
    /// Unit normal of the fronts of its triangles.
    normal: Vec3,
    /// Of the plane from the origin, along the normal.
    distance: f32,
    is_two_sided: bool,
    /// What it reflects, of what rays meet.
    reflectance: Vec3,
    /// The part of the rays that it reflects as a mirror; of the others it is diffuse.
    mirrored_part: f32,
    area: f32,
    /// Box about its triangles.
    min: Vec3,
    max: Vec3,
}

/// An image of the scene in one mirror after another.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Its place in the list of images.
    index: u32,
    /// The mirrors on the way from the point that sees the image.
    legs: Vec<u32>,
    /// From places of the scene to those of the image: a rotation, with a reflection where the legs are odd, and a shift.
    turn: Mat3,
    shift: Vec3,
    /// What arrives of its light, by channel.
    reflectance: Vec3,
}

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
}

impl Mirrors {
    const NONE: u32 = u32::MAX;

    /// Those of a scene; `None` where there is none.
    pub(super) fn of(scene: &Scene) -> Option<Box<Self>> {
        let mirrors =
            |id: &TriangleId| matches!(scene.material(*id).specular, Some(Specular::Mirror { .. }));
        if !scene.triangle_ids().any(|id| mirrors(&id)) {
            return None;
        }
        let area: f32 = scene
            .surfaces
            .iter()
            .map(|surface| surface.area_vector.length())
            .sum();
        let mut planes: HashMap<([i64; 4], u32, bool), usize> = HashMap::new();
        let mut list: Vec<(Mirror, Vec<TriangleId>)> = Vec::new();
        for id in scene.triangle_ids().filter(mirrors) {
            let Some(mirror) = Mirror::of(scene, id) else {
                continue;
            };
            let material = scene.triangles[id.index()].material.0;
            let key = (mirror.plane(), material, mirror.is_two_sided);
            let index = *planes.entry(key).or_insert(list.len());
            match list.get_mut(index) {
                Some((known, triangles)) => {
                    known.join(&mirror);
                    triangles.push(id);
                }
                None => list.push((mirror, vec![id])),
            }
        }
        list.retain(|(mirror, _)| mirror.area >= LEAST_SHARE * area);
        list.sort_by(|(a, _), (b, _)| b.area.total_cmp(&a.area));
        list.truncate(MOST_MIRRORS);
        if list.is_empty() {
            return None;
        }
        let mut of_triangle = vec![Self::NONE; scene.triangles.len()];
        for (index, (_, triangles)) in list.iter().enumerate() {
            for id in triangles {
                of_triangle[id.index()] = index as u32;
            }
        }
        let list: Vec<Mirror> = list.into_iter().map(|(mirror, _)| mirror).collect();
        Some(Box::new(Self {
            images: images(&list),
            list,
            of_triangle,
        }))
    }

    /// The images, the strongest first.
    pub fn images(&self) -> &[Arc<Image>] {
        &self.images
    }

    /// Whether a triangle is of a mirror whose images are followed.
    pub fn has(&self, triangle: TriangleId) -> bool {
        self.of_triangle[triangle.index()] != Self::NONE
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.of_triangle.as_slice())
            + size_of_val(self.list.as_slice())
            + self.images.len() * size_of::<Image>()
    }

    /// The mirror that a ray meets on the side that reflects.
    fn met(&self, triangle: TriangleId, direction: Vec3) -> Option<(u32, &Mirror)> {
        let index = self.of_triangle[triangle.index()];
        let mirror = self.list.get(index as usize)?;
        let is_front = mirror.normal.dot(direction) < 0.0;
        (is_front || mirror.is_two_sided).then_some((index, mirror))
    }

    /// Follow a ray to a surface that does not reflect it as a mirror. Where a mirror is diffuse as well, chance decides.
    pub fn follow(
        &self,
        rays: &RayTree,
        origin: Vec3,
        direction: Vec3,
        from: Option<TriangleId>,
    ) -> Followed {
        let (mut origin, mut direction, mut from) = (origin, direction, from);
        let (mut tint, mut length) = (Vec3::ONE, 0.0);
        loop {
            let hit = rays.closest(origin, direction, from);
            tint *= rays.tint(origin, direction, from, hit);
            let met = hit.and_then(|hit| Some((hit, self.met(hit.triangle, direction)?.1)));
            if let Some((hit, mirror)) = met {
                let part = mirror.mirrored_part;
                let reflects = part >= 1.0 || chance(origin, direction, !hit.triangle.0) < part;
                if reflects && tint.max_element() > LEAST_LEFT {
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
            };
        }
    }
}

impl Mirror {
    /// One triangle; `None` where it has no normal.
    fn of(scene: &Scene, id: TriangleId) -> Option<Self> {
        let area_vector = scene.surfaces[id.index()].area_vector;
        let normal = area_vector.try_normalize()?;
        let corners = scene.corners(id);
        let material = scene.material(id);
        let share = material.share_of_met();
        let reflectance = material.specular?.color() * share;
        let [mirrored, diffuse] = [reflectance, material.reflectance * share].map(luminance);
        Some(Self {
            normal,
            distance: (corners[0] + corners[1] + corners[2]).dot(normal) / 3.0,
            is_two_sided: scene.triangles[id.index()].two_sided,
            reflectance,
            mirrored_part: mirrored / (mirrored + diffuse).max(f32::MIN_POSITIVE),
            area: area_vector.length(),
            min: corners[0].min(corners[1]).min(corners[2]),
            max: corners[0].max(corners[1]).max(corners[2]),
        })
    }

    /// Its plane, rounded.
    fn plane(&self) -> [i64; 4] {
        let [x, y, z] = (self.normal / PLANE_STEPS[0]).to_array();
        [x, y, z, self.distance / PLANE_STEPS[1]].map(|value| value.round() as i64)
    }

    /// Take in another part of it.
    fn join(&mut self, other: &Self) {
        let share = other.area / (self.area + other.area);
        self.normal = self
            .normal
            .lerp(other.normal, share)
            .normalize_or(self.normal);
        self.distance += (other.distance - self.distance) * share;
        self.area += other.area;
        self.min = self.min.min(other.min);
        self.max = self.max.max(other.max);
    }

    fn reflected(&self, direction: Vec3) -> Vec3 {
        (direction - 2.0 * direction.dot(self.normal) * self.normal).normalize_or(-direction)
    }

    /// Whether some of a box may be seen in it.
    fn shows(&self, other: &Self) -> bool {
        let (middle, half) = ((other.min + other.max) * 0.5, (other.max - other.min) * 0.5);
        let reach = half.dot(self.normal.abs());
        let height = middle.dot(self.normal) - self.distance;
        let least = PLANE_STEPS[1];
        height + reach > least || self.is_two_sided && height - reach < -least
    }
}

/// The images of a scene in its mirrors, the strongest first.
fn images(mirrors: &[Mirror]) -> Vec<Arc<Image>> {
    let none = Image {
        index: 0,
        legs: Vec::new(),
        turn: Mat3::IDENTITY,
        shift: Vec3::ZERO,
        reflectance: Vec3::ONE,
    };
    let (mut all, mut last) = (Vec::new(), vec![none]);
    while !last.is_empty() && all.len() < MOST_IMAGES {
        let longer = |image: &Image| -> Vec<Image> {
            let numbered = mirrors.iter().enumerate();
            let follows = numbered.filter(|(index, mirror)| match image.legs.last() {
                None => true,
                Some(&leg) => {
                    let before = &mirrors[leg as usize];
                    leg as usize != *index && before.shows(mirror) && mirror.shows(before)
                }
            });
            follows
                .map(|(index, mirror)| image.in_mirror(index, mirror))
                .collect()
        };
        last = last.iter().flat_map(longer).collect();
        last.retain(|image| luminance(image.reflectance) >= LEAST_WEIGHT);
        last.truncate(8 * MOST_IMAGES);
        all.extend_from_slice(&last);
    }
    all.sort_by(|a, b| luminance(b.reflectance).total_cmp(&luminance(a.reflectance)));
    all.truncate(MOST_IMAGES);
    let numbered = all.into_iter().zip(0..);
    numbered
        .map(|(image, index)| Arc::new(Image { index, ..image }))
        .collect()
}

impl Image {
    /// What this image shows of a mirror.
    fn in_mirror(&self, index: usize, mirror: &Mirror) -> Self {
        let mut legs = self.legs.clone();
        legs.push(index as u32);
        let normal = mirror.normal;
        let axes = [Vec3::X, Vec3::Y, Vec3::Z];
        let reflection = axes.map(|axis| axis - 2.0 * axis.dot(normal) * normal);
        let reflection = Mat3::from_cols(reflection[0], reflection[1], reflection[2]);
        Self {
            index: 0,
            legs,
            turn: self.turn * reflection,
            shift: self.turn * (2.0 * mirror.distance * normal) + self.shift,
            reflectance: self.reflectance * mirror.reflectance,
        }
    }

    /// Its place in the list of images.
    pub fn index(&self) -> u32 {
        self.index
    }

    /// Whether it is seen in one mirror.
    pub fn is_single(&self) -> bool {
        self.legs.len() == 1
    }

    /// What arrives of its light, by channel, 0…1.
    pub fn reflectance(&self) -> Vec3 {
        self.reflectance
    }

    /// Where a place of the scene is seen.
    pub fn place(&self, point: Vec3) -> Vec3 {
        self.turn * point + self.shift
    }

    /// The direction that a direction of the scene has in the image.
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        self.turn * direction
    }

    /// The place of the scene that is seen at a place.
    pub fn source_of(&self, place: Vec3) -> Vec3 {
        self.turn.transpose() * (place - self.shift)
    }

    /// The direction of the scene that is seen in a direction.
    pub fn source_direction(&self, direction: Vec3) -> Vec3 {
        self.turn.transpose() * direction
    }

    /// What passes from a point to one of the scene over all mirrors, by channel, beside what they take, with the length of
    /// the way to what blocks. The triangles are those of both ends.
    pub fn passage(
        &self,
        rays: &RayTree,
        from: Vec3,
        to: Vec3,
        [start, end]: [Option<TriangleId>; 2],
    ) -> Passage {
        let seen = self.place(to);
        let direction = (seen - from).normalize_or_zero();
        match self.over_mirrors(rays, from, direction, from.distance(seen), start) {
            Err(blocked) => blocked,
            Ok(leg) => {
                let last = rays.passage(leg.origin, to, [leg.from, end]);
                Passage {
                    transmittance: leg.tint * last.transmittance,
                    end: leg.length + last.end,
                }
            }
        }
    }

    /// As [`Self::passage`], out of the scene in a direction of it.
    pub fn passage_outward(
        &self,
        rays: &RayTree,
        from: Vec3,
        direction: Vec3,
        start: Option<TriangleId>,
    ) -> Passage {
        let seen = self.direction(direction);
        match self.over_mirrors(rays, from, seen, f32::INFINITY, start) {
            Err(blocked) => blocked,
            Ok(leg) => {
                let last = rays.passage_outward(leg.origin, direction, leg.from);
                Passage {
                    transmittance: leg.tint * last.transmittance,
                    end: leg.length + last.end,
                }
            }
        }
    }

    /// What a ray meets behind all mirrors of the image, with its tint; `None` where it misses one.
    pub fn met(
        &self,
        rays: &RayTree,
        from: Vec3,
        direction: Vec3,
        start: Option<TriangleId>,
    ) -> Option<Followed> {
        let leg = self
            .over_mirrors(rays, from, direction, f32::INFINITY, start)
            .ok()?;
        let direction = self.source_direction(direction);
        let hit = rays.closest(leg.origin, direction, leg.from);
        Some(Followed {
            hit,
            origin: leg.origin,
            direction,
            length: leg.length,
            tint: leg.tint * rays.tint(leg.origin, direction, leg.from, hit),
        })
    }

    /// The last mirror on the way of a ray; what it is blocked by if it misses one, or if that lies further than `until`.
    fn over_mirrors(
        &self,
        rays: &RayTree,
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
        for &expected in &self.legs {
            let hit = rays.closest(leg.origin, direction, leg.from);
            let blocked = |end: f32| Passage {
                transmittance: Vec3::ZERO,
                end,
            };
            let Some(hit) = hit else {
                return Err(blocked(until));
            };
            let mirrors = rays.mirrors();
            let met = mirrors.and_then(|mirrors| mirrors.met(hit.triangle, direction));
            let end = leg.length + hit.distance;
            let Some((_, mirror)) = met.filter(|(index, _)| *index == expected && end < until)
            else {
                return Err(blocked(end));
            };
            leg.tint *= rays.tint(leg.origin, direction, leg.from, Some(hit));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Random,
        scene::{Material, SceneBuilder, SceneOptions, Sides},
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
        assert!(lengths.clone().eq([1, 1, 2, 2, 3, 3, 4, 4]) || lengths.count() >= 4);
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
                let passage = image.passage(&rays, from, to, [None; 2]);
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
        let followed = mirrors.follow(&rays, Vec3::ZERO, direction, None);
        let hit = followed.hit.expect("closed");
        assert!(!mirrors.has(hit.triangle) && followed.length > 0.0);
        let reflections = followed.tint.x.log(0.75).round();
        assert!((followed.tint.x - 0.75f32.powf(reflections)).abs() < 1e-5);
    }
}
