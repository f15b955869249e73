//! Generated textures: tiles, planks of colour, abstract paintings. 8-bit sRGB values, as a PNG file would hold.

use glam::{Vec2, Vec3};

use crate::scene::{Texture, linear_from_srgb};

/// A texture from sRGB colours in 0…1 at points of the unit square, v upwards.
fn painted(name: &str, [width, height]: [u32; 2], colour: impl Fn(Vec2) -> Vec3) -> Texture {
    let size = Vec2::new(width as f32, height as f32);
    let pixels = (0..height)
        .flat_map(|row| (0..width).map(move |column| (column, row)))
        .map(|(column, row)| {
            let centre = Vec2::new(column as f32 + 0.5, row as f32 + 0.5) / size;
            let encoded = colour(Vec2::new(centre.x, 1.0 - centre.y));
            encoded.map(|x| linear_from_srgb((x.clamp(0.0, 1.0) * 255.0).round() / 255.0))
        })
        .collect();
    Texture {
        name: name.to_owned(),
        width,
        height,
        pixels,
        ..Texture::default()
    }
}

/// A value in 0…1 that looks random, for each cell of a lattice.
fn speckle(cell: Vec2) -> f32 {
    ((cell.x * 12.9898 + cell.y * 78.233).sin() * 43_758.547)
        .abs()
        .fract()
}

/// Stone slabs, four by four, in two tones with joints.
pub(super) fn stone_tiles(name: &str, light: Vec3, dark: Vec3) -> Texture {
    painted(name, [128, 128], |at| {
        let cell = (at * 4.0).floor();
        let inside = (at * 4.0).fract();
        let base = if (cell.x + cell.y) as i32 % 2 == 0 {
            light
        } else {
            dark
        };
        let to_edge = inside.min(Vec2::ONE - inside).min_element();
        let grain = 0.03 * (speckle((at * 64.0).floor()) - 0.5);
        if to_edge < 0.03 {
            dark * 0.7
        } else {
            base * (0.94 + 0.12 * speckle(cell)) + Vec3::splat(grain)
        }
    })
}

/// Floorboards along v, eight side by side, each of two lengths.
pub(super) fn planks(name: &str) -> Texture {
    painted(name, [128, 128], |at| {
        let board = (at.x * 8.0).floor();
        let along = at.y + 0.37 * speckle(Vec2::new(board, 3.0));
        let cell = Vec2::new(board, (along * 2.0).floor().rem_euclid(2.0));
        let joint = (at.x * 8.0)
            .fract()
            .min((along * 2.0).rem_euclid(1.0) * 4.0);
        let grain = (40.0 * at.x + 3.0 * (5.0 * at.y + 7.0 * speckle(cell)).sin()).sin();
        let wood = Vec3::new(0.68, 0.52, 0.36) * (0.85 + 0.25 * speckle(cell) + 0.03 * grain);
        if joint < 0.05 { wood * 0.6 } else { wood }
    })
}

/// Wallpaper: broad stripes with a small figure on every other one.
pub(super) fn wallpaper(name: &str) -> Texture {
    let (ground, stripe, figure) = (
        Vec3::new(0.78, 0.8, 0.74),
        Vec3::new(0.68, 0.74, 0.68),
        Vec3::new(0.52, 0.62, 0.54),
    );
    painted(name, [96, 96], |at| {
        let column = (at.x * 6.0).floor() as i32;
        let inside = Vec2::new((at.x * 6.0).fract(), (at.y * 6.0).fract()) - Vec2::splat(0.5);
        let petals = 0.24 + 0.1 * (5.0 * inside.y.atan2(inside.x)).cos();
        match column % 2 {
            0 => ground,
            _ if inside.length() < petals => figure,
            _ => stripe,
        }
    })
}

/// A woven rug: a border around diamonds.
pub(super) fn rug(name: &str) -> Texture {
    let (ground, thread, border) = (
        Vec3::new(0.5, 0.13, 0.12),
        Vec3::new(0.85, 0.7, 0.45),
        Vec3::new(0.14, 0.18, 0.32),
    );
    painted(name, [64, 96], |at| {
        let edge = at.min(Vec2::ONE - at) * Vec2::new(2.0, 3.0);
        let diamond = ((at.x * 4.0).fract() - 0.5).abs() + ((at.y * 6.0).fract() - 0.5).abs();
        match edge.min_element() {
            e if e < 0.16 => border,
            e if e < 0.22 => thread,
            _ if (diamond - 0.36).abs() < 0.06 => thread,
            _ if diamond < 0.18 => border,
            _ => ground,
        }
    })
}

/// A landscape at dusk: sky, sun, hills one before the other.
pub(super) fn landscape(name: &str) -> Texture {
    painted(name, [128, 96], |at| {
        let sky = Vec3::new(0.95, 0.62, 0.35).lerp(Vec3::new(0.25, 0.38, 0.62), at.y);
        let sun = (at - Vec2::new(0.68, 0.6)).length() < 0.09;
        let mut colour = if sun { Vec3::new(1.0, 0.9, 0.65) } else { sky };
        for layer in 0..4 {
            let k = layer as f32;
            let ridge = 0.52 - 0.12 * k
                + 0.06 * (at.x * (5.0 + 2.0 * k) + 1.7 * k).sin()
                + 0.03 * (at.x * (13.0 - k) + k).sin();
            if at.y < ridge {
                colour = Vec3::new(0.42, 0.4, 0.5).lerp(Vec3::new(0.08, 0.16, 0.12), k / 3.0);
            }
        }
        colour
    })
}

/// Rectangles of pure colour between black bars.
pub(super) fn rectangles(name: &str) -> Texture {
    let (columns, rows) = ([0.0, 0.22, 0.7, 1.0], [0.0, 0.3, 0.78, 1.0]);
    let colours = [
        Vec3::new(0.93, 0.91, 0.85),
        Vec3::new(0.8, 0.13, 0.1),
        Vec3::new(0.1, 0.22, 0.6),
        Vec3::new(0.95, 0.78, 0.12),
    ];
    let pattern = [[2, 0, 0], [0, 1, 0], [0, 0, 3]];
    painted(name, [96, 96], |at| {
        let bar = |lines: [f32; 4], x: f32| lines[1..3].iter().any(|l| (x - l).abs() < 0.018);
        if bar(columns, at.x) || bar(rows, at.y) {
            return Vec3::splat(0.06);
        }
        let place = |lines: [f32; 4], x: f32| lines[1..3].iter().filter(|&&l| x > l).count();
        colours[pattern[place(rows, at.y)][place(columns, at.x)]]
    })
}

/// Rings of colour around several centres.
pub(super) fn rings(name: &str) -> Texture {
    painted(name, [128, 96], |at| {
        let at = at * Vec2::new(4.0, 3.0);
        let cell = at.floor();
        let radius = ((at.fract() - Vec2::splat(0.5)).length() * 9.0).floor();
        let hue = 6.3 * speckle(cell + Vec2::splat(radius * 0.37));
        Vec3::new(hue.sin(), (hue + 2.1).sin(), (hue + 4.2).sin()) * 0.38 + Vec3::splat(0.5)
    })
}

/// A bright panel with soft bars, for a light.
pub(super) fn light_panel(name: &str) -> Texture {
    painted(name, [32, 32], |at| {
        let wave = 0.5 + 0.5 * (at.x * 4.0 * std::f32::consts::TAU).cos();
        Vec3::new(1.0, 0.93, 0.8) * (0.55 + 0.45 * wave)
    })
}
