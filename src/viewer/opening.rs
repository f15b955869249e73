//! The default viewpoint: the direction that sees farthest into the scene.
//!
//! A room with an open side is looked into through it, instead of at its back. Scenes that look alike from everywhere
//! get the usual view from the front, right and above.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::camera::Camera;
use crate::{geometry::RayTree, scene::Scene};

/// Directions around the scene that are tried.
const DIRECTIONS: usize = 8;
/// Heights above the horizon that are tried, in radians.
const PITCHES: [f32; 2] = [0.08, 0.35];
/// Rays on a side of the picture.
const RAYS: usize = 24;
/// How much farther than the usual view another must see. Less, and views change on a whim; more, and open sides go
/// unnoticed.
const ADVANTAGE: f32 = 1.15;

/// The view of a whole scene that sees farthest into it.
pub fn deepest_view(scene: &Scene, rays: &RayTree, min: Vec3, max: Vec3) -> Camera {
    let framed = |yaw, pitch| {
        let mut camera = Camera {
            yaw,
            pitch,
            ..Camera::default()
        };
        camera.frame_box(min, max, 1.0);
        camera
    };
    let usual = framed(Camera::default().yaw, Camera::default().pitch);
    let mut best = (ADVANTAGE * mean_depth(scene, rays, &usual), usual);
    for pitch in PITCHES {
        for step in 0..DIRECTIONS {
            let camera = framed(step as f32 / DIRECTIONS as f32 * TAU, pitch);
            let depth = mean_depth(scene, rays, &camera);
            if depth > best.0 {
                best = (depth, camera);
            }
        }
    }
    best.1
}

/// How far behind the front of the scene's sphere rays end, on average over those that meet something.
/// Backs of one-sided faces are looked through, as in the window.
fn mean_depth(scene: &Scene, rays: &RayTree, camera: &Camera) -> f32 {
    let (mut depth, mut count) = (0.0, 0_u32);
    for row in 0..RAYS {
        for column in 0..RAYS {
            let place = |index: usize| (index as f32 + 0.5) / RAYS as f32 * 2.0 - 1.0;
            let ndc = Vec2::new(place(column), place(row));
            let (origin, direction) = camera.ray(ndc, 1.0);
            if let Some(distance) = first_front(scene, rays, origin, direction) {
                depth += distance - camera.distance;
                count += 1;
            }
        }
    }
    // Measured from the front of a sphere around the frame, so that it is positive.
    if count > 0 {
        100.0 + depth / count as f32
    } else {
        0.0
    }
}

/// Distance to the first face that shows.
fn first_front(scene: &Scene, rays: &RayTree, origin: Vec3, direction: Vec3) -> Option<f32> {
    const MOST_LAYERS: usize = 8;
    let (mut from, mut walked) = (None, 0.0);
    for _ in 0..MOST_LAYERS {
        let hit = rays.closest(origin + direction * walked, direction, from)?;
        walked += hit.distance;
        let index = hit.triangle.index();
        let faces_us = scene.surfaces[index].area_vector.dot(direction) < 0.0;
        if faces_us || scene.triangles[index].two_sided {
            return Some(walked);
        }
        from = Some(hit.triangle);
    }
    None
}
