//! Reproducible random numbers, low-discrepancy points, and the maps from the unit square to surfaces and directions.

use glam::{DVec3, Vec2, Vec3};

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
        unit(self.next_u32())
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

/// Point `index` of the van der Corput sequence in base 2, scrambled by nested permutations (Owen 1995): 0 (included) to 1
/// (excluded). Of the points `k n` to `(k + 1) n - 1`, where n is a power of 2, one lies in each n-th part.
pub fn low_discrepancy_1d(index: u32, scramble: u32) -> f32 {
    unit(permuted(index, scramble).reverse_bits())
}

/// Point `index` of the first two dimensions of the sequence of Sobol' (1967), scrambled by nested permutations, in the unit
/// square. Of the points `k n` to `(k + 1) n - 1`, where n is a power of 2, one lies in each rectangle of area 1/n whose
/// sides are powers of 2 and that stands in their grid.
pub fn sobol_2d(index: u32, scramble: [u32; 2]) -> Vec2 {
    // Direction numbers are the rows of Pascal's triangle modulo 2.
    let (mut second, mut direction, mut left) = (0, 1_u32 << 31, index);
    while left != 0 {
        second ^= direction * (left & 1);
        direction ^= direction >> 1;
        left >>= 1;
    }
    Vec2::new(
        low_discrepancy_1d(index, scramble[0]),
        low_discrepancy_1d(second.reverse_bits(), scramble[1]),
    )
}

/// The same numbers in another order: a nested permutation, so that the points `k n` to `(k + 1) n - 1`, where n is a power
/// of 2, stay together.
pub fn shuffled(index: u32, scramble: u32) -> u32 {
    permuted(index.reverse_bits(), scramble).reverse_bits()
}

/// A permutation of the numbers in which each bit depends on the lower ones only (the hash of Laine and Karras, "Stratified
/// Sampling for Stochastic Transparency", 2011).
fn permuted(number: u32, scramble: u32) -> u32 {
    const FACTORS: [u32; 4] = [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6];
    FACTORS
        .into_iter()
        .fold(number.wrapping_add(scramble), |x, factor| {
            x ^ x.wrapping_mul(factor)
        })
}

/// The upper bits as a number from 0 (included) to 1 (excluded).
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// What makes one use of the low-discrepancy points differ from another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shuffle {
    /// Shift of [`low_discrepancy_2d`].
    pub shift: Vec2,
    /// Scramble of [`low_discrepancy_1d`].
    pub scramble: u32,
    /// Shift of these, 0 (included) to 1 (excluded).
    pub offset: f32,
}

impl Shuffle {
    /// The place of a point on a line, 0 (included) to 1 (excluded).
    pub fn place(&self, index: u32) -> f32 {
        let at = low_discrepancy_1d(index, self.scramble) + self.offset;
        if at < 1.0 { at } else { at - 1.0 }
    }

    /// The next one of a stream.
    pub fn next(random: &mut Random) -> Self {
        Self {
            shift: random.uniform_2d(),
            scramble: random.next_u32(),
            offset: 0.0,
        }
    }
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

/// Uniform directions to a triangle from a point: its spherical triangle, set up once (Arvo, "Stratified Sampling of
/// Spherical Triangles", 1995).
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    /// Unit directions to the corners.
    corners: [Vec3; 3],
    /// Cosine of the arc from the first corner to the second.
    first_arc: f32,
    /// Sine and cosine of the angle at the first corner.
    first_angle: [f32; 2],
    /// The angle at the first corner.
    angle: f32,
    /// Steradian, above 0.
    solid_angle: f32,
}

impl SphericalTriangle {
    /// Smaller solid angles are seen alike from all sides: points uniform over the area do as well.
    const LEAST: f64 = 0.01;

    /// Of a triangle seen from a point; `None` where it is seen edge-on, or is small.
    pub fn new(point: Vec3, corners: [Vec3; 3]) -> Option<Self> {
        // Solid angles are small differences of angles.
        let [a, b, c] = corners.map(|corner| (corner - point).as_dvec3().normalize_or_zero());
        let across = |from: DVec3, to: DVec3| from.cross(to).try_normalize();
        let (ab, bc, ca) = (across(a, b)?, across(b, c)?, across(c, a)?);
        let angle = |one: DVec3, next: DVec3| (-one.dot(next)).clamp(-1.0, 1.0).acos();
        let alpha = angle(ab, ca);
        let solid_angle = alpha + angle(ab, bc) + angle(bc, ca) - std::f64::consts::PI;
        (solid_angle > Self::LEAST).then_some(Self {
            corners: [a, b, c].map(|corner| corner.as_vec3()),
            first_arc: a.dot(b) as f32,
            first_angle: [alpha.sin() as f32, alpha.cos() as f32],
            angle: alpha as f32,
            solid_angle: solid_angle as f32,
        })
    }

    /// A unit direction from a point of the unit square.
    pub fn direction(&self, square: Vec2) -> Vec3 {
        let [a, b, c] = self.corners;
        let [sin_alpha, cos_alpha] = self.first_angle;
        let (s, t) = (square.x * self.solid_angle - self.angle).sin_cos();
        let u = t - cos_alpha;
        let v = s + sin_alpha * self.first_arc;
        let below = (v * s + u * t) * sin_alpha;
        let cos_arc = if below.abs() > f32::MIN_POSITIVE {
            (((v * t - u * s) * cos_alpha - v) / below).clamp(-1.0, 1.0)
        } else {
            1.0
        };
        // The corner that cuts off the wanted part of the area, on the arc from the first to the third.
        let towards = |from: Vec3, to: Vec3| (to - from * to.dot(from)).normalize_or_zero();
        let cut = a * cos_arc + towards(a, c) * (1.0 - cos_arc * cos_arc).max(0.0).sqrt();
        let height = 1.0 - square.y * (1.0 - cut.dot(b));
        (b * height + towards(b, cut) * (1.0 - height * height).max(0.0).sqrt()).normalize_or(b)
    }
}

/// Cosine-weighted direction about a unit normal from a point of the unit square; its density is cos θ / π.
pub fn cosine_direction(normal: Vec3, square: Vec2) -> Vec3 {
    let radius = square.x.sqrt();
    let (sin, cos) = (square.y * std::f32::consts::TAU).sin_cos();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let height = (1.0 - square.x).max(0.0).sqrt();
    (tangent * (radius * cos) + bitangent * (radius * sin) + normal * height).normalize_or(normal)
}

/// Direction about a unit normal from a point of the unit square; all of the hemisphere are equally likely.
pub fn hemisphere_direction(normal: Vec3, square: Vec2) -> Vec3 {
    let height = square.x;
    let radius = (1.0 - height * height).max(0.0).sqrt();
    let (sin, cos) = (square.y * std::f32::consts::TAU).sin_cos();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    (tangent * (radius * cos) + bitangent * (radius * sin) + normal * height).normalize_or(normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: u32 = 50_000;

    /// Standard error of the mean of numbers in 0…1, at most `0.5/√COUNT`, four times.
    const TOLERANCE: f32 = 0.01;

    fn mean(of: impl Fn(&mut Random) -> Vec3) -> Vec3 {
        let mut random = Random::new(42, 7);
        (0..COUNT).map(|_| of(&mut random)).sum::<Vec3>() / COUNT as f32
    }

    #[test]
    fn each_part_of_a_line_has_one_of_as_many_points() {
        for scramble in [0, 1, 0xdead_beef] {
            for count in [2_u32, 8, 64, 1024] {
                for first in [0, count, 5 * count] {
                    let mut parts: Vec<u32> = (first..first + count)
                        .map(|index| {
                            let at = low_discrepancy_1d(index, scramble);
                            assert!((0.0..1.0).contains(&at));
                            (at * count as f32) as u32
                        })
                        .collect();
                    parts.sort_unstable();
                    assert!(parts.into_iter().eq(0..count), "{count} from {first}");
                }
            }
        }
    }

    #[test]
    fn each_rectangle_has_one_of_as_many_points() {
        const COUNT: u32 = 64;
        for (scramble, order) in [([0, 0], 0), ([7, 0xdead_beef], 9)] {
            for block in [0, 1, 1000] {
                let points: Vec<Vec2> = (0..COUNT)
                    .map(|index| sobol_2d(shuffled(block * COUNT + index, order), scramble))
                    .collect();
                for columns in [1, 2, 4, 8, 16, 32, 64] {
                    let rows = COUNT / columns;
                    let cell = |point: &Vec2| {
                        let [column, row] =
                            [point.x * columns as f32, point.y * rows as f32].map(|at| at as u32);
                        row * columns + column
                    };
                    let mut cells: Vec<u32> = points.iter().map(cell).collect();
                    cells.sort_unstable();
                    assert!(cells.into_iter().eq(0..COUNT), "{columns} columns");
                }
            }
        }
    }

    #[test]
    fn random_numbers_are_uniform() {
        let mut random = Random::new(1, 2);
        let mut bins = [0_u32; 16];
        for _ in 0..COUNT {
            let x = random.uniform();
            assert!((0.0..1.0).contains(&x));
            bins[(x * 16.0) as usize] += 1;
        }
        // χ² of 15 degrees of freedom exceeds 37.7 once in a thousand.
        let expected = f64::from(COUNT) / 16.0;
        let chi_squared: f64 = bins
            .iter()
            .map(|&n| (f64::from(n) - expected).powi(2) / expected)
            .sum();
        assert!(chi_squared < 37.7, "{chi_squared}");
        assert!((0..1000).all(|_| random.below(3) < 3));
        assert_eq!(random.below(1), 0);
    }

    #[test]
    fn streams_of_neighbours_are_unrelated() {
        let products = |step: u64| {
            let sum: f32 = (0..10_000)
                .map(|i| {
                    let [a, b] = [i, i + step].map(|stream| Random::new(0, stream).uniform() - 0.5);
                    a * b
                })
                .sum();
            sum / 10_000.0
        };
        // Products of independent numbers scatter by 1/12, their mean by 1/1200.
        for step in [1, 2, 1 << 32] {
            assert!(products(step).abs() < 4.0 / 1200.0, "{step}");
        }
        let [mut a, mut b] = [Random::new(3, 4), Random::new(3, 4)];
        assert!((0..10).all(|_| a.next_u32() == b.next_u32()));
    }

    #[test]
    fn low_discrepancy_points_fill_the_square_evenly() {
        let shift = Vec2::new(0.9, 0.3);
        let mut bins = [0_u32; 64];
        for index in 0..6400 {
            let point = low_discrepancy_2d(index, shift);
            assert!(point.min_element() >= 0.0 && point.max_element() < 1.0);
            bins[(point.x * 8.0) as usize * 8 + (point.y * 8.0) as usize] += 1;
        }
        // 100 a cell; random points would scatter by 10.
        assert!(bins.iter().all(|n| n.abs_diff(100) < 8), "{bins:?}");
    }

    #[test]
    fn triangle_points_are_uniform() {
        let first = mean(|random| triangle_point(random.uniform_2d()));
        assert!(
            (first - Vec3::splat(1.0 / 3.0)).abs().max_element() < TOLERANCE,
            "{first}"
        );
        // E[u²] = 1/6 for a uniform point of a triangle.
        let second = mean(|random| triangle_point(random.uniform_2d()).powf(2.0));
        assert!(
            (second - Vec3::splat(1.0 / 6.0)).abs().max_element() < TOLERANCE,
            "{second}"
        );
    }

    #[test]
    fn cosine_directions_lean_to_the_normal() {
        let normal = Vec3::new(0.48, -0.6, 0.64);
        let sum = mean(|random| {
            let direction = cosine_direction(normal, random.uniform_2d());
            assert!((direction.length() - 1.0).abs() < 1e-5 && direction.dot(normal) > -1e-6);
            direction
        });
        // The mean of a cosine-weighted direction is 2/3 of the normal.
        assert!(
            (sum - normal * (2.0 / 3.0)).length() < 1.5 * TOLERANCE,
            "{sum}"
        );
    }

    #[test]
    fn directions_to_a_triangle_are_uniform() {
        let corners = [
            Vec3::new(0.2, 0.1, 0.4),
            Vec3::new(1.5, -0.3, 0.5),
            Vec3::new(0.1, 1.2, 0.3),
        ];
        let seen = SphericalTriangle::new(Vec3::ZERO, corners).unwrap();
        // The solid angle by Van Oosterom and Strackee.
        let [a, b, c] = corners.map(|corner| corner.normalize_or_zero());
        let below = 1.0 + a.dot(b) + b.dot(c) + c.dot(a);
        let expected = 2.0 * a.dot(b.cross(c)).abs().atan2(below);
        assert!((seen.solid_angle - expected).abs() < 1e-5);
        // Every direction meets the triangle; their mean is the irradiance vector over the solid angle.
        let inward = [a.cross(b), b.cross(c), c.cross(a)];
        let mean = mean(|random| {
            let direction = seen.direction(random.uniform_2d());
            assert!((direction.length() - 1.0).abs() < 1e-5);
            assert!(inward.iter().all(|side| side.dot(direction) > -1e-5));
            direction
        });
        let edges = [[a, b], [b, c], [c, a]].map(|[from, to]| {
            from.cross(to).normalize_or_zero() * (0.5 * from.dot(to).clamp(-1.0, 1.0).acos())
        });
        let vector = edges.into_iter().sum::<Vec3>() / seen.solid_angle;
        assert!(mean.distance(vector) < TOLERANCE, "{mean} {vector}");
    }

    #[test]
    fn triangles_seen_edge_on_or_from_afar_have_no_solid_angle() {
        let corners = [Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.0)];
        assert!(SphericalTriangle::new(Vec3::new(3.0, 0.5, 0.0), corners).is_none());
        assert!(SphericalTriangle::new(Vec3::new(0.5, 0.5, 20.0), corners).is_none());
        assert!(SphericalTriangle::new(Vec3::X, corners).is_none());
        assert!(SphericalTriangle::new(Vec3::new(0.8, 0.8, 0.1), corners).is_some());
    }
}
