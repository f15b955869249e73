//! Plane mirrors, and the images in them.
//!
//! A plane mirror shows the scene at its mirrored place. The reflection is an isometry, so whatever holds between a point and
//! what it sees holds between the point and an image, or, which is the same, between the image of the point and what is there;
//! only that the ray between both must pass the mirror. Mirrors show images of mirrors: these are chains of reflections.

use std::{collections::HashMap, sync::Arc};

use glam::{Mat3, Vec2, Vec3};

use crate::scene::{Scene, Specular, TriangleId, luminance, reflected};

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
pub(super) struct Mirror {
    /// Unit normal of the fronts of its triangles.
    normal: Vec3,
    /// Of the plane from the origin, along the normal.
    distance: f32,
    is_two_sided: bool,
    /// What it reflects, of what rays meet.
    pub(super) reflectance: Vec3,
    /// The part of the rays that it reflects as a mirror; of the others it is diffuse.
    pub(super) mirrored_part: f32,
    area: f32,
    /// A rectangle about its triangles: its lowest and highest places along `across`.
    min: Vec2,
    max: Vec2,
    /// Two unit vectors in its plane, at a right angle.
    across: [Vec3; 2],
}

/// An image of the scene in one mirror after another.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Its place in the list of images.
    index: u32,
    /// The mirrors on the way from the point that sees the image.
    pub(super) legs: Vec<u32>,
    /// From places of the scene to those of the image: a rotation, with a reflection where the legs are odd, and a shift.
    turn: Mat3,
    shift: Vec3,
    /// What arrives of its light, by channel.
    reflectance: Vec3,
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
    pub(super) fn met(&self, triangle: TriangleId, direction: Vec3) -> Option<(u32, &Mirror)> {
        let index = self.of_triangle[triangle.index()];
        let mirror = self.list.get(index as usize)?;
        let is_front = mirror.normal.dot(direction) < 0.0;
        (is_front || mirror.is_two_sided).then_some((index, mirror))
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
        let across = <[Vec3; 2]>::from(normal.any_orthonormal_pair());
        let [a, b, c] = corners.map(|corner| places_along(across, corner));
        Some(Self {
            normal,
            distance: (corners[0] + corners[1] + corners[2]).dot(normal) / 3.0,
            is_two_sided: scene.triangles[id.index()].two_sided,
            reflectance,
            mirrored_part: mirrored / (mirrored + diffuse).max(f32::MIN_POSITIVE),
            area: area_vector.length(),
            min: a.min(b).min(c),
            max: a.max(b).max(c),
            across,
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
        for corner in other.corners() {
            let place = places_along(self.across, corner);
            self.min = self.min.min(place);
            self.max = self.max.max(place);
        }
    }

    /// Of the rectangle about it.
    fn corners(&self) -> [Vec3; 4] {
        let [u, v] = self.across;
        let (min, max) = (self.min, self.max);
        let foot = self.distance * self.normal;
        [
            [min.x, min.y],
            [max.x, min.y],
            [max.x, max.y],
            [min.x, max.y],
        ]
        .map(|[x, y]| foot + x * u + y * v)
    }

    pub(super) fn reflected(&self, direction: Vec3) -> Vec3 {
        reflected(direction, self.normal)
    }
}

fn places_along(axes: [Vec3; 2], point: Vec3) -> Vec2 {
    Vec2::from(axes.map(|axis| point.dot(axis)))
}

/// A mirror on the way to an image, where the mirrors before it show it: light passes it as a window.
#[derive(Clone)]
struct Window {
    normal: Vec3,
    distance: f32,
    is_two_sided: bool,
    corners: [Vec3; 4],
}

impl Window {
    fn of(mirror: &Mirror, before: &Image) -> Self {
        let corners = mirror.corners().map(|corner| before.place(corner));
        let normal = before.direction(mirror.normal);
        Self {
            normal,
            distance: corners[0].dot(normal),
            is_two_sided: mirror.is_two_sided,
            corners,
        }
    }

    /// Whether some of another window lies before it, and whether some lies behind it.
    fn sides_of(&self, other: &Self) -> [bool; 2] {
        let heights = other.corners.map(|at| at.dot(self.normal) - self.distance);
        let least = PLANE_STEPS[1];
        [
            heights.map(|height| height > least),
            heights.map(|height| height < -least),
        ]
        .map(|corners| corners.contains(&true))
    }
}

/// Whether a straight line may pass all windows in this order, each from the side that reflects. A line passes a plane once:
/// of all windows before one some must lie before it, and of all after it some behind it.
fn may_be_passed(windows: &[Window]) -> bool {
    windows.iter().enumerate().all(|(index, window)| {
        let passes = |front: usize| {
            let sides = |other: &Window| window.sides_of(other);
            let (earlier, later) = (&windows[..index], &windows[index + 1..]);
            earlier.iter().all(|other| sides(other)[front])
                && later.iter().all(|other| sides(other)[1 - front])
        };
        passes(0) || window.is_two_sided && passes(1)
    })
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
    let (mut all, mut last) = (Vec::new(), vec![(none, Vec::new())]);
    while !last.is_empty() && all.len() < MOST_IMAGES {
        let longer = |(image, windows): &(Image, Vec<Window>)| -> Vec<(Image, Vec<Window>)> {
            let with = |(index, mirror)| {
                let windows = [windows.as_slice(), &[Window::of(mirror, image)]].concat();
                may_be_passed(&windows).then(|| (image.in_mirror(index, mirror), windows))
            };
            mirrors.iter().enumerate().filter_map(with).collect()
        };
        last = last.iter().flat_map(longer).collect();
        last.retain(|(image, _)| luminance(image.reflectance) >= LEAST_WEIGHT);
        last.truncate(8 * MOST_IMAGES);
        all.extend(last.iter().map(|(image, _)| image.clone()));
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
        let [x, y, z] = Vec3::AXES.map(|axis| axis.reflect(normal));
        let reflection = Mat3::from_cols(x, y, z);
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
}
