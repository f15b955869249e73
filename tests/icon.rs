//! The icon: a corner of three walls under a small light, drawn here. The file must be what is drawn.
//! `UPDATE_SNAPSHOTS=1 cargo test --test icon` writes it anew.

use std::path::Path;

use glam::{DVec2, DVec3};
use image::{Rgba, RgbaImage};

const SIDE: u32 = 256;
/// Rows and columns of samples of a pixel.
const SAMPLES: u32 = 4;
/// Where the light hangs, in the unit cube before the corner at the origin.
const LIGHT: DVec3 = DVec3::new(0.62, 0.72, 0.62);
/// Radius of the light as it is drawn, in pictures.
const LIGHT_RADIUS: f64 = 0.055;

/// Reflectance of the walls on x = 0, y = 0 and z = 0.
const WALLS: [DVec3; 3] = [
    DVec3::new(0.86, 0.34, 0.22),
    DVec3::new(0.84, 0.82, 0.78),
    DVec3::new(0.24, 0.52, 0.80),
];

/// The picture's place of a point of the cube, seen along its diagonal: −1…1, y up.
fn projected(point: DVec3) -> DVec2 {
    let right = DVec3::new(1.0, 0.0, -1.0) / 2_f64.sqrt();
    let up = DVec3::new(-1.0, 2.0, -1.0) / 6_f64.sqrt();
    DVec2::new(point.dot(right), point.dot(up)) * 1.17
}

/// The wall behind a place of the picture, and where it is met.
fn met(place: DVec2) -> Option<(usize, DVec3)> {
    let place = place / 1.17;
    let right = DVec3::new(1.0, 0.0, -1.0) / 2_f64.sqrt();
    let up = DVec3::new(-1.0, 2.0, -1.0) / 6_f64.sqrt();
    let origin = right * place.x + up * place.y;
    // Along the diagonal, the farthest of the three planes is the one behind.
    let wall = (0..3).min_by(|a, b| origin[*a].total_cmp(&origin[*b]))?;
    let point = origin - DVec3::splat(origin[wall]);
    (point.max_element() <= 1.0).then_some((wall, point))
}

/// Light at a point of a wall: straight from the lamp, and once from each other wall's middle.
fn lit(wall: usize, point: DVec3) -> DVec3 {
    let towards = LIGHT - point;
    let direct = towards[wall] / towards.length().powi(3);
    let mut light = DVec3::splat(0.34 * direct);
    for other in (0..3).filter(|other| *other != wall) {
        // Colour bleeds near the edge that two walls share.
        light += WALLS[other] * 0.22 * (-3.0 * point[other]).exp();
    }
    WALLS[wall] * (light + DVec3::splat(0.03))
}

/// Colour and coverage of a place of the picture.
fn sample(place: DVec2) -> (DVec3, f64) {
    let to_light = (place - projected(LIGHT)).length();
    if to_light < LIGHT_RADIUS {
        return (DVec3::new(1.0, 0.97, 0.86), 1.0);
    }
    match met(place) {
        Some((wall, point)) => {
            let glow = 0.5 * (-(to_light - LIGHT_RADIUS) / 0.07).exp();
            (lit(wall, point) + DVec3::new(1.0, 0.9, 0.6) * glow, 1.0)
        }
        None => (DVec3::ZERO, 0.0),
    }
}

fn pixel(x: u32, y: u32) -> Rgba<u8> {
    let (mut color, mut coverage) = (DVec3::ZERO, 0.0);
    for index in 0..SAMPLES * SAMPLES {
        let offset = |step: u32| (f64::from(step) + 0.5) / f64::from(SAMPLES);
        let across = (f64::from(x) + offset(index % SAMPLES)) / f64::from(SIDE);
        let down = (f64::from(y) + offset(index / SAMPLES)) / f64::from(SIDE);
        let (light, covers) = sample(DVec2::new(2.0 * across - 1.0, 1.0 - 2.0 * down));
        // Soft shoulder, so that the lamp's surroundings keep their colour.
        color += light.map(|x| x / (1.0 + 0.35 * x) * 1.35).min(DVec3::ONE) * covers;
        coverage += covers;
    }
    let mean = color / f64::max(coverage, 1.0);
    let byte = |linear: f64| (linear.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8;
    let alpha = (coverage / f64::from(SAMPLES * SAMPLES) * 255.0).round() as u8;
    Rgba([byte(mean.x), byte(mean.y), byte(mean.z), alpha])
}

#[test]
fn the_icon_is_what_is_drawn_here() {
    let drawn = RgbaImage::from_fn(SIDE, SIDE, pixel);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/vecrad.png");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        drawn.save(&path).expect("the folder can be written");
    }
    let stored = image::open(&path).expect("the icon is there").into_rgba8();
    assert_eq!(stored.dimensions(), drawn.dimensions());
    // Powers are rounded differently by different mathematics libraries.
    let near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= 1;
    assert!(stored.as_raw().iter().zip(drawn.as_raw()).all(near));
    let bytes = std::fs::metadata(&path).expect("it was read").len();
    assert!(bytes < 50_000, "{bytes}");
}
