//! Reproducible random numbers, low-discrepancy points, and the maps from the unit square to surfaces and directions.

use glam::{Vec2, Vec3};

/// A small counter-based generator (PCG's output permutation over a 64-bit state).
/// Streams are made from any two numbers, so that a value depends on what is sampled and never on which thread does.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

impl Random {
    /// The stream that belongs to a seed and to what is sampled.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = Self {
            state: mix(seed ^ mix(stream.wrapping_add(0x9e37_79b9_7f4a_7c15))),
        };
        random.next_u32();
        random
    }

    /// Uniform in all 32-bit numbers.
    pub fn next_u32(&mut self) -> u32 {
        self.state = self
            .state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let word = ((self.state >> ((self.state >> 59) + 5)) ^ self.state)
            .wrapping_mul(12_605_985_483_714_917_081);
        (word >> 43) as u32 ^ (word >> 11) as u32
    }

    /// Uniform in 0 (included) to 1 (excluded).
    pub fn uniform(&mut self) -> f32 {
        (self.next_u32() >> 8) as f32 * (1.0 / 16_777_216.0)
    }

    /// Uniform in the unit square.
    pub fn uniform_2d(&mut self) -> Vec2 {
        Vec2::new(self.uniform(), self.uniform())
    }

    /// Uniform in 0…`count`-1; `count` at least 1.
    pub fn below(&mut self, count: u32) -> u32 {
        ((u64::from(self.next_u32()) * u64::from(count)) >> 32) as u32
    }
}

/// A bijective scrambling of 64 bits (the finaliser of SplitMix64).
fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Point `index` of the R2 sequence (Roberts 2018), shifted by `shift` on the torus; in the unit square.
pub fn low_discrepancy_2d(index: u32, shift: Vec2) -> Vec2 {
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let n = f64::from(index) + 1.0;
    let point = Vec2::new((n * STEP[0]).fract() as f32, (n * STEP[1]).fract() as f32) + shift;
    (point - point.floor()).min(Vec2::splat(1.0 - f32::EPSILON))
}

/// Barycentric coordinates of an area-uniform point of a triangle from a point of the unit square
/// (the low-distortion map of Heitz 2019).
pub fn triangle_point(square: Vec2) -> Vec3 {
    let (mut u, mut v) = (square.x, square.y);
    if v > u {
        u *= 0.5;
        v -= u;
    } else {
        v *= 0.5;
        u -= v;
    }
    Vec3::new(u, v, 1.0 - u - v)
}

/// Cosine-weighted direction about a unit normal from a point of the unit square; its density is cos θ / π.
pub fn cosine_direction(normal: Vec3, square: Vec2) -> Vec3 {
    let radius = square.x.sqrt();
    let (sin, cos) = (square.y * std::f32::consts::TAU).sin_cos();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let height = (1.0 - square.x).max(0.0).sqrt();
    (tangent * (radius * cos) + bitangent * (radius * sin) + normal * height).normalize_or(normal)
}
