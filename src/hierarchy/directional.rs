//! Directional tables: how much area or power a cluster shows along a direction.
//!
//! The quantity is `f(r) = Σ_j w_j (S_j·r)+` over area vectors `S_j` with weights `w_j` (1 for area, the radiosity for
//! power): ProjectArea and ProjectPower of the paper, eqs 8 and 10. Since `(x)+ = (x + |x|)/2`, it splits into half of
//! the linear part `r·P`, `P = Σ w S`, which is exact, and half of the even part `g(r) = Σ w |S·r|`.
//! From the moments `P`, `W_a = Σ w |S_a|` and `M = Σ w S Sᵀ / |S|`, with `T = Σ w |S| = tr M` and r a unit vector:
//!
//! * `g ≤ Σ_a W_a |r_a|`: together with P this is exactly the six faces of the paper (eqs 5–10), whose powers along
//!   ±a are `(W_a ± P_a)/2`;
//! * `g ≤ √(T · rᵀMr)` by Cauchy and Schwarz: exact for planes of any tilt;
//! * `g ≥ |r·P|` and `g ≥ rᵀMr`: a sum is no longer than its parts, and |cos| ≥ cos²;
//! * `g ≈ 3/16 T + 15/16 rᵀMr`: the second-order spherical harmonics of |cos|, right on average.
//!
//! The same moments hold light that arrives: with `S_j` replaced by the vector irradiances (eq. 14) `f(n)` is the
//! irradiance of a face of normal n (eq. 15), for all links at once.

use glam::{Vec3, Vec4};

use super::Channels;

/// How the moments are read. The method of the settings, without `exact`, which does not read moments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// Spherical harmonics between the bounds.
    Bounded,
    /// The paper's six faces.
    SixFace,
    /// The vector sum alone (eq. 4).
    Single,
    /// A quarter of the total in every direction.
    Isotropic,
}

/// One number of a moment: a scalar, or RGB with a fourth channel (see `Tables`).
pub trait Quantity:
    Copy
    + Default
    + std::ops::Add<Output = Self>
    + std::ops::AddAssign
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<f32, Output = Self>
{
    /// Component-wise magnitude.
    fn magnitude(self) -> Self;
    /// Component-wise square root of the product of two values that are not negative.
    fn geometric_mean(self, other: Self) -> Self;
    /// Component-wise smaller.
    fn lower_of(self, other: Self) -> Self;
    /// Component-wise larger.
    fn upper_of(self, other: Self) -> Self;
    /// Component-wise `1 / (1/x + 1/limit)`: about x while it is small, never above the limit. Both not negative.
    fn saturated(self, limit: Self) -> Self;
}

impl Quantity for f32 {
    fn magnitude(self) -> Self {
        self.abs()
    }
    fn geometric_mean(self, other: Self) -> Self {
        (self * other).max(0.0).sqrt()
    }
    fn lower_of(self, other: Self) -> Self {
        self.min(other)
    }
    fn upper_of(self, other: Self) -> Self {
        self.max(other)
    }
    fn saturated(self, limit: Self) -> Self {
        self * limit / (self + limit).max(f32::MIN_POSITIVE)
    }
}

impl Quantity for Vec4 {
    fn magnitude(self) -> Self {
        self.abs()
    }
    fn geometric_mean(self, other: Self) -> Self {
        (self * other).max(Self::ZERO).sqrt()
    }
    fn lower_of(self, other: Self) -> Self {
        self.min(other)
    }
    fn upper_of(self, other: Self) -> Self {
        self.max(other)
    }
    fn saturated(self, limit: Self) -> Self {
        self * limit / (self + limit).max(Self::splat(f32::MIN_POSITIVE))
    }
}

/// Moments of a set of weighted vectors; additive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments<Q> {
    /// `P = Σ w S`, by axis.
    pub linear: [Q; 3],
    /// `W = Σ w |S|` component by component.
    pub absolute: [Q; 3],
    /// `M = Σ w S Sᵀ / |S|`: xx, yy, zz, xy, xz, yz.
    pub quadratic: [Q; 6],
}

impl<Q: Quantity> Moments<Q> {
    /// Moments of one vector. A zero vector has none.
    pub fn of(vector: Vec3, weight: Q) -> Self {
        let mut moments = Self::default();
        moments.add(vector, weight);
        moments
    }

    /// Add one vector.
    pub fn add(&mut self, vector: Vec3, weight: Q) {
        let length = vector.length();
        if length <= 0.0 {
            return;
        }
        let unit = vector / length;
        let components = vector.to_array();
        for (axis, &component) in components.iter().enumerate() {
            self.linear[axis] += weight * component;
            self.absolute[axis] += weight * component.abs();
        }
        let products = [
            vector.x * unit.x,
            vector.y * unit.y,
            vector.z * unit.z,
            vector.x * unit.y,
            vector.x * unit.z,
            vector.y * unit.z,
        ];
        for (sum, product) in self.quadratic.iter_mut().zip(products) {
            *sum += weight * product;
        }
    }

    /// Add light along a unit direction, of which the share `spread` comes from the half-space about it: its linear part
    /// is that of the direction, its even part alike for all faces.
    pub fn add_spread(&mut self, direction: Vec3, strength: Q, spread: f32) {
        let before = self.linear;
        self.add(direction, strength * (1.0 - spread));
        let components = direction.to_array();
        for axis in 0..3 {
            self.linear[axis] = before[axis] + strength * components[axis];
        }
        if spread > 0.0 {
            self.add_isotropic(strength * (0.5 * spread));
        }
    }

    /// Add light that comes alike from everywhere and gives each face the irradiance `value`, or power or area that
    /// shows alike everywhere.
    pub fn add_isotropic(&mut self, value: Q) {
        for axis in 0..3 {
            self.absolute[axis] += value * 2.0;
            self.quadratic[axis] += value * (4.0 / 3.0);
        }
    }

    /// Add all of another set.
    pub fn merge(&mut self, other: &Self) {
        for (a, b) in self.linear.iter_mut().zip(other.linear) {
            *a += b;
        }
        for (a, b) in self.absolute.iter_mut().zip(other.absolute) {
            *a += b;
        }
        for (a, b) in self.quadratic.iter_mut().zip(other.quadratic) {
            *a += b;
        }
    }

    /// `T = Σ w |S|`: total area, power or irradiance.
    pub fn total(&self) -> Q {
        self.quadratic[0] + self.quadratic[1] + self.quadratic[2]
    }

    /// The sums along the six box normals, +x −x +y −y +z −z: A_k and P_k of eqs 7 and 9.
    pub fn six_faces(&self) -> [Q; 6] {
        let mut faces = [Q::default(); 6];
        for axis in 0..3 {
            faces[2 * axis] = (self.absolute[axis] + self.linear[axis]) * 0.5;
            faces[2 * axis + 1] = (self.absolute[axis] - self.linear[axis]) * 0.5;
        }
        faces
    }

    /// `r·P` for a unit direction.
    fn linear_part(&self, unit: Vec3) -> Q {
        self.linear[0] * unit.x + self.linear[1] * unit.y + self.linear[2] * unit.z
    }

    /// `Σ_a W_a |r_a|`.
    fn absolute_part(&self, unit: Vec3) -> Q {
        let size = unit.abs();
        self.absolute[0] * size.x + self.absolute[1] * size.y + self.absolute[2] * size.z
    }

    /// `rᵀ M r`.
    fn quadratic_part(&self, unit: Vec3) -> Q {
        let m = &self.quadratic;
        m[0] * (unit.x * unit.x)
            + m[1] * (unit.y * unit.y)
            + m[2] * (unit.z * unit.z)
            + (m[3] * (unit.x * unit.y) + m[4] * (unit.x * unit.z) + m[5] * (unit.y * unit.z)) * 2.0
    }

    /// The projection `f` along a unit direction; at least 0.
    pub fn project(&self, unit: Vec3, reading: Reading) -> Q {
        let linear = self.linear_part(unit);
        let value = match reading {
            Reading::Bounded => {
                let quadratic = self.quadratic_part(unit);
                let total = self.total();
                let upper = total
                    .geometric_mean(quadratic)
                    .lower_of(self.absolute_part(unit));
                let even = (total * (3.0 / 16.0) + quadratic * (15.0 / 16.0)).lower_of(upper);
                (even.upper_of(linear.magnitude()).upper_of(quadratic) + linear) * 0.5
            }
            Reading::SixFace => (self.absolute_part(unit) + linear) * 0.5,
            Reading::Single => linear,
            Reading::Isotropic => self.total() * 0.25,
        };
        value.upper_of(Q::default())
    }

    /// The bounded projection for a receiver that is seen over a range of directions about a unit direction: of the even
    /// part, the share `spread` is replaced by its mean over all directions, half of the total.
    pub fn project_spread(&self, unit: Vec3, spread: f32) -> Q {
        let linear = self.linear_part(unit);
        let even = self.project(unit, Reading::Bounded) * 2.0 - linear;
        let value = (even * (1.0 - spread) + self.total() * (0.5 * spread) + linear) * 0.5;
        value.upper_of(Q::default())
    }

    /// Lower and upper bound of `f` along a unit direction.
    pub fn bounds(&self, unit: Vec3) -> (Q, Q) {
        let linear = self.linear_part(unit);
        let quadratic = self.quadratic_part(unit);
        let least = linear.magnitude().upper_of(quadratic);
        let most = self
            .total()
            .geometric_mean(quadratic)
            .lower_of(self.absolute_part(unit));
        let half = |even: Q| ((even + linear) * 0.5).upper_of(Q::default());
        (half(least), half(most.upper_of(least)))
    }
}

impl Moments<Vec4> {
    /// The sum of the area vectors of what sends, square frame units.
    pub fn area_vector(&self) -> Vec3 {
        Vec3::from_array(self.linear.map(Channels::area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    fn random_vector(random: &mut Random) -> Vec3 {
        Vec3::new(
            random.uniform() - 0.5,
            random.uniform() - 0.5,
            random.uniform() - 0.5,
        )
    }

    fn truth(vectors: &[Vec3], unit: Vec3) -> f32 {
        vectors.iter().map(|vector| vector.dot(unit).max(0.0)).sum()
    }

    fn moments(vectors: &[Vec3]) -> Moments<f32> {
        let mut sum = Moments::default();
        for &vector in vectors {
            sum.add(vector, 1.0);
        }
        sum
    }

    /// Rounding of a sum of some hundred terms in single precision.
    const ROUNDING: f32 = 1e-4;

    #[test]
    fn bounds_hold_the_truth_and_the_value_for_random_clusters_and_directions() {
        for seed in 0..500 {
            let mut random = Random::new(seed, 0);
            let count = 1 + random.below(40) as usize;
            let vectors: Vec<Vec3> = (0..count).map(|_| random_vector(&mut random)).collect();
            let sum = moments(&vectors);
            let unit = random_vector(&mut random).normalize_or(Vec3::X);
            let (lower, upper) = sum.bounds(unit);
            let exact = truth(&vectors, unit);
            let slack = ROUNDING * sum.total();
            assert!(
                lower <= exact + slack && exact <= upper + slack,
                "seed {seed}: {lower} {exact} {upper}"
            );
            let value = sum.project(unit, Reading::Bounded);
            assert!(
                lower <= value + slack && value <= upper + slack,
                "seed {seed}: {lower} {value} {upper}"
            );
        }
    }

    #[test]
    fn six_faces_are_an_upper_bound_and_exact_along_the_axes() {
        for seed in 0..500 {
            let mut random = Random::new(seed, 1);
            let vectors: Vec<Vec3> = (0..10).map(|_| random_vector(&mut random)).collect();
            let sum = moments(&vectors);
            let slack = ROUNDING * sum.total();
            let unit = random_vector(&mut random).normalize_or(Vec3::X);
            assert!(
                sum.project(unit, Reading::SixFace) >= truth(&vectors, unit) - slack,
                "seed {seed}"
            );
            for axis in [
                Vec3::X,
                Vec3::NEG_X,
                Vec3::Y,
                Vec3::NEG_Y,
                Vec3::Z,
                Vec3::NEG_Z,
            ] {
                let value = sum.project(axis, Reading::SixFace);
                assert!(
                    (value - truth(&vectors, axis)).abs() <= slack,
                    "seed {seed} {axis}"
                );
            }
        }
    }

    #[test]
    fn six_faces_are_exact_for_axis_aligned_vectors() {
        for seed in 0..200 {
            let mut random = Random::new(seed, 2);
            let vectors: Vec<Vec3> = (0..12)
                .map(|_| Vec3::AXES[random.below(3) as usize] * (random.uniform() - 0.5))
                .collect();
            let unit = random_vector(&mut random).normalize_or(Vec3::X);
            let (value, exact) = (
                moments(&vectors).project(unit, Reading::SixFace),
                truth(&vectors, unit),
            );
            assert!(
                (value - exact).abs() <= ROUNDING,
                "seed {seed}: {value} {exact}"
            );
        }
    }

    #[test]
    fn bounded_is_exact_for_a_plane_of_any_tilt() {
        for seed in 0..200 {
            let mut random = Random::new(seed, 3);
            let normal = random_vector(&mut random);
            let vectors: Vec<Vec3> = (0..5).map(|_| normal * random.uniform()).collect();
            let unit = random_vector(&mut random).normalize_or(Vec3::X);
            let (value, exact) = (
                moments(&vectors).project(unit, Reading::Bounded),
                truth(&vectors, unit),
            );
            assert!(
                (value - exact).abs() <= ROUNDING,
                "seed {seed}: {value} {exact}"
            );
        }
    }

    #[test]
    fn opposite_faces_cancel_in_single_and_not_in_six_face() {
        let sum = moments(&[Vec3::X, Vec3::NEG_X]);
        assert_eq!(sum.project(Vec3::X, Reading::Single), 0.0);
        assert_eq!(sum.project(Vec3::X, Reading::SixFace), 1.0);
        assert_eq!(sum.project(Vec3::X, Reading::Bounded), 1.0);
    }

    #[test]
    fn bounded_is_right_on_average_for_a_random_soup_where_six_faces_give_half_more() {
        let (mut bounded, mut six_face, mut exact) = (0.0, 0.0, 0.0);
        for seed in 0..500 {
            let mut random = Random::new(seed, 4);
            // Points of the cube's inside alone would prefer its diagonals.
            let mut direction = || loop {
                let vector = random_vector(&mut random);
                if vector.length() < 0.5 {
                    return vector;
                }
            };
            let vectors: Vec<Vec3> = (0..20).map(|_| direction()).collect();
            let unit = direction().normalize_or(Vec3::X);
            let sum = moments(&vectors);
            bounded += sum.project(unit, Reading::Bounded);
            six_face += sum.project(unit, Reading::SixFace);
            exact += truth(&vectors, unit);
        }
        assert!((bounded / exact - 1.0).abs() < 0.02, "{}", bounded / exact);
        assert!(
            (six_face / exact - 1.5).abs() < 0.05,
            "{}",
            six_face / exact
        );
    }

    #[test]
    fn empty_cluster_shows_nothing() {
        let empty = Moments::<f32>::default();
        for reading in [
            Reading::Bounded,
            Reading::SixFace,
            Reading::Single,
            Reading::Isotropic,
        ] {
            assert_eq!(empty.project(Vec3::X, reading), 0.0);
        }
        assert_eq!(Moments::of(Vec3::ZERO, 1.0f32), empty);
    }

    #[test]
    fn a_cluster_is_the_sum_of_its_children() {
        let mut random = Random::new(9, 5);
        let vectors: Vec<Vec3> = (0..40).map(|_| random_vector(&mut random)).collect();
        let mut merged = moments(&vectors[..17]);
        merged.merge(&moments(&vectors[17..]));
        let whole = moments(&vectors);
        for (a, b) in merged.quadratic.iter().zip(whole.quadratic) {
            assert!((a - b).abs() <= ROUNDING);
        }
        for (a, b) in merged.six_faces().iter().zip(whole.six_faces()) {
            assert!((a - b).abs() <= ROUNDING);
        }
    }
}
