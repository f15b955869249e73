//! The inside of a room, as far as the display must know it.

use glam::Vec3;

use super::even_direction;
use crate::{
    geometry::RayTree,
    viewer::{
        camera::Camera,
        view::{ViewMode, ViewSettings},
    },
};

/// A box about the free space of a room, in frame units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interior {
    /// Lower corner.
    pub min: Vec3,
    /// Upper corner.
    pub max: Vec3,
}

/// Rays around a place. Fewer miss walls at the ends of long rooms.
const DIRECTIONS: usize = 128;
/// Share of them that must end on a surface: an open box ends five of six. Less, and a place between two houses, or under
/// a pergola, is a room; more, and a room with a wide opening is none.
const LEAST_SHARE: f32 = 0.75;
/// Share of the rays on each side of an axis that go through windows and doors. Less, and what lies behind a window
/// belongs to the room; more, and its own ends do not.
const OUTSIDE: f32 = 0.02;
/// The box ends this far before the walls, in frame units, so that these lie outside.
const MARGIN: f32 = 0.2;

impl Interior {
    /// Share of the way from the middle of the box to its sides, from which on a surface that faces it is a wall of the
    /// room. Smaller, and things that stand before the room are drawn; larger, and slanted walls of an open side have
    /// slits.
    pub const WALL: f32 = 0.9;

    /// The room about some places in it; `None` where most rays from there meet nothing.
    pub(super) fn about(rays: &RayTree, places: &[Vec3]) -> Option<Self> {
        let ends: Vec<Vec3> = places
            .iter()
            .flat_map(|&place| (0..DIRECTIONS).map(move |index| (place, index)))
            .filter_map(|(place, index)| {
                let direction = even_direction(index, DIRECTIONS);
                let hit = rays.closest(place, direction, None)?;
                Some(place + direction * hit.distance)
            })
            .collect();
        let asked = places.len() * DIRECTIONS;
        if (ends.len() as f32) < LEAST_SHARE * asked as f32 {
            return None;
        }
        let outside = (OUTSIDE * ends.len() as f32) as usize;
        let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let mut along: Vec<f32> = ends.iter().map(|end| end[axis]).collect();
            along.sort_by(f32::total_cmp);
            min[axis] = along[outside] + MARGIN;
            max[axis] = along[along.len() - 1 - outside] - MARGIN;
        }
        min.cmplt(max).all().then_some(Self { min, max })
    }

    /// Whether a point lies in it.
    pub fn holds(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Whether it is looked into from outside, so that what stands before it is not drawn.
    pub fn is_looked_into(&self, camera: &Camera, view: &ViewSettings) -> bool {
        let shows_walls = !view.see_through || view.mode == ViewMode::FaceOrientation;
        let is_outside = camera.orthographic || !self.holds(camera.eye());
        is_outside && !shows_walls
    }

    /// Whether a surface at a point is a wall of the room, seen from the side of the room: it is drawn though it may stand
    /// before the box. `normal` points towards the viewer.
    pub fn is_wall(&self, point: Vec3, normal: Vec3) -> bool {
        let (middle, half) = ((self.min + self.max) * 0.5, (self.max - self.min) * 0.5);
        normal.dot(middle - point) > Self::WALL * normal.abs().dot(half)
    }

    /// How far along a ray of unit direction it is entered: 0 from inside; `None` where it is passed by.
    pub fn entered(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        let inverse = direction.recip();
        let (a, b) = ((self.min - origin) * inverse, (self.max - origin) * inverse);
        let entered = a.min(b).max_element().max(0.0);
        (entered <= a.max(b).min_element()).then_some(entered)
    }

    /// Whether a surface at a point is not drawn, since it stands before the room on the way from a camera that looks into
    /// it. `normal` points towards the viewer.
    pub fn hides(&self, camera: &Camera, point: Vec3, normal: Vec3) -> bool {
        let (origin, direction) = match camera.orthographic {
            true => (point + camera.backward() * 1e5, -camera.backward()),
            false => (camera.eye(), (point - camera.eye()).normalize_or_zero()),
        };
        let entered = self.entered(origin, direction);
        let is_before = entered.is_some_and(|entered| entered >= (point - origin).length());
        is_before && !self.is_wall(point, normal)
    }
}
