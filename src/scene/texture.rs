//! Textures: linear RGB pixels, repeated, looked up bilinearly.

use glam::{Vec2, Vec3};

/// A decoded picture in linear RGB. Row 0 is the top, so `v` = 1 is the top edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// File name as the material gives it.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// `width · height` pixels, row by row from the top.
    pub pixels: Vec<Vec3>,
}

impl Texture {
    /// Bilinear value at a texture coordinate, repeated outside 0…1. A coordinate that is not finite reads as 0.
    pub fn sample(&self, uv: Vec2) -> Vec3 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let x = uv.x.rem_euclid(1.0) * self.width as f32 - 0.5;
        let y = (1.0 - uv.y).rem_euclid(1.0) * self.height as f32 - 0.5;
        let (column, row) = (x.floor(), y.floor());
        let (fx, fy) = (x - column, y - row);
        let pixel = |dx: i64, dy: i64| {
            let i = (column as i64 + dx).rem_euclid(i64::from(self.width)) as usize;
            let j = (row as i64 + dy).rem_euclid(i64::from(self.height)) as usize;
            self.pixels[j * self.width as usize + i]
        };
        let top = pixel(0, 0).lerp(pixel(1, 0), fx);
        let bottom = pixel(0, 1).lerp(pixel(1, 1), fx);
        top.lerp(bottom, fy)
    }
}
