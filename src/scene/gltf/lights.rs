//! The lights of `KHR_lights_punctual` as surfaces and as a sun, since light comes from these alone.
//!
//! A point becomes a small sphere of the same intensity; a spot such a sphere in a black tube that ends its cone where it
//! should; the brightest directional light the sun. Candela count as W/sr and lux as W/m². Scale of nodes changes none of
//! them.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::document::{Cone, Document, Light};
use super::meshes::MAX_TRIANGLES;
use super::nodes::Placed;
use super::printable;
use super::shapes::{ring, small_sphere};
use crate::scene::listed::{MOST_LISTED, listed};
use crate::scene::warning::WarningLog;
use crate::scene::{Material, SceneBuilder, Sides, Sun, WarningKind, luminance};

/// Radius of a lamp relative to the diagonal of the scene: a bulb in a room. A larger one softens shadows, a smaller one
/// loses digits.
const RADIUS: f64 = 1.0 / 500.0;

/// Radius of a lamp at most, relative to the distance to the nearest surface, so that no lamp reaches into one …
const LARGEST: f64 = 0.25;

/// … and at least, relative to the diagonal of the scene: single precision must tell its corners apart.
const SMALLEST: f64 = 1e-5;

/// Triangles and lamps, multiplied, up to which distances are measured. More take seconds.
const MOST_DISTANCES: usize = 1 << 30;

/// Corners of tubes. Fewer show in the rim of a cone, more cost time.
const CORNERS: usize = 16;

/// Angles from their axis between which cones end, radians: tubes would be longer or flatter than single precision tells.
const NARROWEST_CONE: f64 = 0.01;
const WIDEST_CONE: f64 = 1.5;

/// The part of a tube's radius that its bulb has at least: a smaller one is too bright for its size …
const SMALLEST_BULB: f64 = 0.05;

/// … and at most: a larger one makes an edge so soft that most of a beam is half shadow, which takes many times the rays.
const LARGEST_BULB: f64 = 0.4;

/// A light where it stands.
struct Lamp<'a> {
    light: &'a Light,
    name: String,
    place: DVec3,
    /// Unit vector in which it shines.
    direction: DVec3,
    /// W/sr, or W/m² of a directional one.
    intensity: Vec3,
}

impl<'a> Lamp<'a> {
    fn of(document: &'a Document, placed: &Placed) -> Option<Self> {
        let named = placed.node.extensions.light.as_ref()?.light;
        let light = document.extensions.lights.lights.get(named)?;
        let color = light
            .color
            .map(|channel| (channel * light.intensity) as f32);
        let intensity = Vec3::from_array(color).max(Vec3::ZERO);
        let names = [&light.name, &placed.node.name];
        let name = names.into_iter().find(|name| !name.is_empty());
        let place = placed.world.translation;
        let is_bright = intensity.is_finite() && intensity != Vec3::ZERO && place.is_finite();
        is_bright.then_some(Self {
            light,
            name: name.map_or_else(|| format!("light {named}"), |name| printable(name)),
            place,
            direction: (placed.world.matrix3 * DVec3::NEG_Z)
                .try_normalize()
                .unwrap_or(DVec3::NEG_Z),
            intensity,
        })
    }
}

/// Add the lamps of a scene that has its faces already; returns its sun.
pub(super) fn add_lights(
    document: &Document,
    placed: &[Placed],
    builder: &mut SceneBuilder,
    log: &mut WarningLog,
) -> Option<Sun> {
    let lamps: Vec<Lamp> = placed
        .iter()
        .filter_map(|placed| Lamp::of(document, placed))
        .collect();
    let (mut suns, mut lamps): (Vec<Lamp>, Vec<Lamp>) = lamps
        .into_iter()
        .partition(|lamp| lamp.light.kind == "directional");
    let unknown = lamps.len();
    lamps.retain(|lamp| matches!(lamp.light.kind.as_str(), "point" | "spot"));
    if lamps.len() < unknown {
        let message = "lights of a type that glTF does not know were left out";
        log.note_times(WarningKind::Light, message, unknown - lamps.len(), "", 0);
    }
    let faces_left = MAX_TRIANGLES.saturating_sub(builder.faces.len());
    let most = faces_left / small_sphere(1.0).len();
    if lamps.len() > most {
        let message = "lights were left out, since the scene would have too many triangles";
        log.note_times(WarningKind::Light, message, lamps.len() - most, "", 0);
        lamps.truncate(most);
    }
    place_lamps(&lamps, builder);
    suns.sort_by(|a, b| luminance(b.intensity).total_cmp(&luminance(a.intensity)));
    let (sun, others) = suns.split_first()?;
    if !others.is_empty() {
        let names = listed(others.iter().map(|lamp| lamp.name.as_str()), MOST_LISTED);
        let message = format!(
            "only '{}', the brightest directional light, is the sun; left out: {names}",
            sun.name
        );
        log.note_times(WarningKind::Light, &message, others.len(), "", 0);
    }
    Some(Sun {
        direction: -sun.direction.as_vec3(),
        irradiance: sun.intensity,
        diameter: Sun::DEGREES.to_radians(),
    })
}

fn place_lamps(lamps: &[Lamp], builder: &mut SceneBuilder) {
    let finite = || {
        builder
            .positions
            .iter()
            .filter(|position| position.is_finite())
    };
    let (least, most) = finite().fold((DVec3::MAX, DVec3::MIN), |(least, most), &position| {
        (least.min(position), most.max(position))
    });
    let diagonal = (most - least).length();
    if lamps.is_empty() || !(diagonal > 0.0 && diagonal.is_finite()) {
        return;
    }
    let is_measured = lamps.len().saturating_mul(builder.faces.len()) <= MOST_DISTANCES;
    let radii: Vec<f64> = lamps
        .iter()
        .map(|lamp| match is_measured {
            true => RADIUS * diagonal.min(LARGEST / RADIUS * nearest(builder, lamp.place)),
            false => RADIUS * diagonal,
        })
        .map(|radius| radius.max(SMALLEST * diagonal))
        .collect();
    for (lamp, radius) in lamps.iter().zip(radii) {
        builder
            .objects
            .push((lamp.name.as_str().into(), builder.faces.len()));
        match lamp.light.kind.as_str() {
            "spot" => add_spot(lamp, radius, builder),
            _ => add_point(lamp, radius, builder),
        }
    }
}

/// A sphere with the intensity of the light.
fn add_point(lamp: &Lamp, radius: f64, builder: &mut SceneBuilder) {
    push(builder, lamp, &small_sphere(radius), sphere_factor(radius));
}

/// A sphere, and the tube that it shines out of.
fn add_spot(lamp: &Lamp, radius: f64, builder: &mut SceneBuilder) {
    let axis = lamp.direction;
    let tube = Tube::of(&lamp.light.spot, radius);
    let mut bulb = small_sphere(tube.bulb);
    // What faces away from all of the cone would only light the tube.
    let away = -tube.outer.sin();
    bulb.retain(|[a, b, c]| (*b - *a).cross(*c - *a).normalize_or_zero().dot(axis) > away);
    push(builder, lamp, &bulb, sphere_factor(tube.bulb));
    let rim = ring(axis, CORNERS, tube.radius);
    let next = |corner: usize| (corner + 1) % CORNERS;
    let [bottom, top] = [-tube.bulb, tube.length].map(|height| axis * height);
    let tube: Vec<[DVec3; 3]> = (0..CORNERS)
        .flat_map(|corner| {
            let [a, b] = [rim[corner], rim[next(corner)]].map(|corner| corner + bottom);
            let [c, d] = [rim[corner], rim[next(corner)]].map(|corner| corner + top);
            [[bottom, a, b], [a, b, d], [a, d, c]]
        })
        .collect();
    push(builder, lamp, &tube, 0.0);
}

/// By what an intensity is multiplied for the radiance of a small sphere: its mean intensity is the radiance times a quarter
/// of its surface.
fn sphere_factor(radius: f64) -> f32 {
    let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a).length();
    let surface: f64 = small_sphere(radius).into_iter().map(area).sum();
    (4.0 / surface) as f32
}

/// A black tube about the axis of a spot, closed behind the bulb at the place of the light. From within the inner cone all
/// of the bulb is seen through its end, from outside the outer one nothing, unless the edge of the cone is too soft or too
/// sharp for that.
struct Tube {
    /// Angle from the axis at which the cone ends, radians.
    outer: f64,
    radius: f64,
    /// From the middle of the bulb to the end.
    length: f64,
    /// Radius of the bulb.
    bulb: f64,
}

impl Tube {
    /// No wider than twice a radius, and no longer before its bulb.
    fn of(cone: &Cone, radius: f64) -> Self {
        let outer = cone.outer_cone_angle.clamp(NARROWEST_CONE, WIDEST_CONE);
        let inner = cone.inner_cone_angle.clamp(0.0, outer);
        // A bulb of radius b just clears the rim in a direction where the distance of the rim from the line through the
        // middle of the bulb, R cos - L sin, is b; it is just hidden where that is -b.
        let bulb = (outer.tan() - inner.tan()) / (outer.cos().recip() + inner.cos().recip());
        let rim = inner.tan() + bulb * inner.cos().recip();
        let length = radius / rim.max(0.5);
        let radius = length * rim;
        let share = (bulb / rim).clamp(SMALLEST_BULB, LARGEST_BULB);
        Self {
            outer,
            radius,
            length,
            bulb: radius * share,
        }
    }
}

/// Add triangles about the place of a lamp whose radiance is its intensity times a factor.
fn push(builder: &mut SceneBuilder, lamp: &Lamp, triangles: &[[DVec3; 3]], factor: f32) {
    let material = builder.push_material(Material {
        sides: Sides::One,
        ..Material::plain(&lamp.name, Vec3::ZERO, lamp.intensity * factor)
    });
    for triangle in triangles {
        let corners = triangle.map(|corner| builder.push_position(lamp.place + corner));
        builder.push_triangle(corners, material);
    }
}

/// Distance from a point to the nearest face.
fn nearest(builder: &SceneBuilder, point: DVec3) -> f64 {
    let faces = builder.faces.par_iter();
    let distances = faces.map(|face| {
        let corners = face
            .corners
            .map(|corner| builder.positions[corner as usize] - point);
        distance_to_triangle(corners)
    });
    distances.reduce(|| f64::INFINITY, f64::min)
}

/// Distance from the origin to a triangle; infinite where that is not finite.
fn distance_to_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let edges = [[a, b], [b, c], [c, a]];
    // Before the face, or nearest to an edge.
    let is_before = edges
        .iter()
        .all(|[from, to]| normal.dot((*to - *from).cross(-*from)) >= 0.0);
    let squared = if is_before && normal != DVec3::ZERO {
        a.dot(normal).powi(2) / normal.length_squared()
    } else {
        let to_edge = |[from, to]: [DVec3; 2]| {
            let along = to - from;
            let length = along.length_squared().max(f64::MIN_POSITIVE);
            (from + along * (-from.dot(along) / length).clamp(0.0, 1.0)).length_squared()
        };
        edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
    };
    if squared.is_finite() {
        squared.sqrt()
    } else {
        f64::INFINITY
    }
}
