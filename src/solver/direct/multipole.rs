//! The light of many far emitters: moments that give the irradiance at a point, and its error.
//!
//! At a point whose unit normal is n, an emitter of radiosity B and area vector S at the place x from there gives `B
//! (S·−x)+ (n·x)+ / (π |x|⁴)`. Emitters that all face the point and lie above its horizon need no clamping, and the sum
//! over them is expanded about the centre of their power: to the first order in the place for each area vector and
//! colour, and to the second for their sum, which counts as spread alike for all directions. Where some face away,
//! directional moments as those of clusters bound the projected power.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::{Mat3, Vec3, Vec4};

use super::emitter::Emitter;
use crate::{
    hierarchy::{Moments, Reading},
    solver::places::Receiver,
    transport::luminance,
};

/// Distance in radii up to which the expansion is not used. Smaller, and its error estimate is wrong; larger, and cuts
/// have more nodes.
const NEAREST: f32 = 1.5;

/// Error of the expansion, relative to the irradiance, in multiples of `(spread/distance)² · radius/distance`: the
/// omitted terms of the third order have coefficients of up to this size. Smaller, and the error of a cut exceeds its
/// tolerance; larger, and cuts have more nodes than needed.
const TRUNCATION: f32 = 8.0;

/// Height over the plane of the emitters, in frame units, up to which a point lies in it: single precision resolves
/// less than half of that at the rim of the frame, and shadow rays begin ten times as far off. Smaller, and points
/// beside many lamps in one ceiling evaluate each of them; larger, and surfaces just before an emitter stay dark.
const RESOLUTION: f32 = 1e-5;

/// The light of some emitters from afar.
#[derive(Clone, Copy, Debug)]
pub(super) struct Multipole {
    pub(super) extent: Extent,
    pub(super) expansion: Expansion,
}

/// Bounds of some emitters, and of their normals: all that a walk over a tree reads of most nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// Centre of the power (luminance).
    centre: Vec3,
    /// Radius of a sphere about the centre that contains all emitters.
    radius: f32,
    /// Luminance of the power.
    pub(super) power: f32,
    /// Error of the expansion, relative to the irradiance, times the cube of the distance.
    truncation: f32,
    /// The normals of all emitters lie within this angle of the axis, radians; π for any normals.
    axis: Vec3,
    angle: f32,
    /// Sine and cosine of the angle.
    sin_cos: (f32, f32),
    /// Largest distance of emitters from the plane through the centre with the axis as normal.
    thickness: f32,
}

/// Moments of the light of some emitters.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expansion {
    /// Mean of `e eᵀ` over the power (luminance), with e the position relative to the centre.
    second: Mat3,
    /// Moments of `B S`.
    directional: Moments<Vec4>,
    /// `Σ B S_a e_b`.
    first: [[Vec4; 3]; 3],
}

/// The geometry of a multipole relative to a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sight {
    /// The centre relative to the point, and its squared distance.
    separation: Vec3,
    squared: f32,
    /// One over the distance.
    per_distance: f32,
    /// Height of the centre over the horizon of the point.
    height: f32,
    /// Largest cosines at the emitters and at the point, at most 1.
    most_cosines: [f32; 2],
    /// Whether all emitters lie above the horizon and face the point.
    is_whole: bool,
}

impl Multipole {
    /// The multipole of one emitter.
    pub(crate) fn of(emitter: &Emitter) -> Self {
        let centre = emitter.corners.iter().sum::<Vec3>() / 3.0;
        let outwards = emitter.corners.map(|corner| corner - centre);
        // The second moment of a triangle is a twelfth of the sum over its corners.
        let second = outwards.map(|e| outer(e, e)).into_iter().sum::<Mat3>() * (1.0 / 12.0);
        let axis = emitter.normal;
        let lengths = outwards.map(Vec3::length);
        let extent = Extent {
            centre,
            radius: lengths.into_iter().fold(0.0, f32::max),
            power: luminance(emitter.radiosity) * emitter.area,
            truncation: 0.0,
            axis,
            angle: 0.0,
            sin_cos: (0.0, 1.0),
            thickness: 0.0,
        }
        .expanded(&second);
        let expansion = Expansion {
            second,
            directional: Moments::of(axis * emitter.area, emitter.radiosity),
            first: [[Vec4::ZERO; 3]; 3],
        };
        Self { extent, expansion }
    }

    /// The multipole of the emitters of both.
    pub(super) fn merged(&self, other: &Self) -> Self {
        let [one, two] = [&self.extent, &other.extent];
        let power = one.power + two.power;
        let share = match two.power / power {
            share if share.is_finite() => share,
            _ => 0.5,
        };
        let centre = one.centre.lerp(two.centre, share);
        let (axis, angle) = enclosing_cone((one.axis, one.angle), (two.axis, two.angle));
        let mut extent = Extent {
            centre,
            radius: 0.0,
            power,
            truncation: 0.0,
            axis,
            angle,
            sin_cos: angle.sin_cos(),
            thickness: 0.0,
        };
        let mut expansion = Expansion {
            second: Mat3::ZERO,
            directional: Moments::default(),
            first: [[Vec4::ZERO; 3]; 3],
        };
        for (part, share) in [(self, 1.0 - share), (other, share)] {
            let Self {
                extent: of,
                expansion: part,
            } = part;
            let shift = of.centre - centre;
            extent.radius = extent.radius.max(of.radius + shift.length());
            let tilt = of.radius * axis.cross(of.axis).length();
            let thickness = of.thickness + shift.dot(axis).abs() + tilt;
            extent.thickness = extent.thickness.max(thickness);
            expansion.second += (part.second + outer(shift, shift)) * share;
            expansion.directional.merge(&part.directional);
            for a in 0..3 {
                for b in 0..3 {
                    expansion.first[a][b] +=
                        part.first[a][b] + part.directional.linear[a] * shift[b];
                }
            }
        }
        let extent = extent.expanded(&expansion.second);
        Self { extent, expansion }
    }
}

impl Extent {
    /// With the error of an expansion of this second moment.
    fn expanded(mut self, second: &Mat3) -> Self {
        self.truncation = TRUNCATION * trace(second) * self.radius;
        self
    }

    /// Its geometry relative to a receiver; `None` if it certainly gives no light there.
    #[inline]
    pub(super) fn sight(&self, receiver: &Receiver) -> Option<Sight> {
        let separation = self.centre - receiver.point;
        let height = separation.dot(receiver.normal);
        if height <= -self.radius {
            return None;
        }
        let squared = separation.length_squared();
        let distance = squared.sqrt();
        // Heights of the receiver over the planes of the emitters, which are tilted by up to the angle.
        let along = -separation.dot(self.axis);
        let (sin, cos) = self.sin_cos;
        let [most, least] = if self.angle <= 0.0 {
            [along + self.thickness, along - self.thickness]
        } else {
            let across = (squared - along * along).max(0.0).sqrt();
            let is_narrow = self.angle < FRAC_PI_2;
            let slack = self.thickness + self.radius * if is_narrow { sin } else { 1.0 };
            let most = match along >= distance * cos {
                true => distance,
                false => along * cos + across * sin,
            };
            let least = match is_narrow {
                true => along * cos - across * sin - slack,
                false => -distance,
            };
            [most + slack, least]
        };
        if most <= RESOLUTION {
            return None;
        }
        let per_distance = 1.0 / distance;
        let cosine = |height: f32| (height * per_distance).min(1.0);
        Some(Sight {
            separation,
            squared,
            per_distance,
            height,
            most_cosines: [cosine(most), cosine(height + self.radius)],
            is_whole: least >= 0.0 && height >= self.radius,
        })
    }

    /// Approximate error of the irradiance (luminance) by an expansion; infinite where that is not used.
    #[inline]
    pub(super) fn error(&self, expansion: &Expansion, sight: &Sight) -> f32 {
        if sight.squared <= NEAREST * NEAREST * self.radius * self.radius {
            return f32::INFINITY;
        }
        let per_distance = sight.per_distance;
        let most = self.most_irradiance(sight);
        let truncation = self.truncation * per_distance * per_distance * per_distance;
        if sight.is_whole {
            return most * truncation;
        }
        let towards = -sight.separation * per_distance;
        let (least_shown, most_shown) = expansion.directional.bounds(towards);
        let unknown =
            luminance(most_shown - least_shown) * sight.most_cosines[1] / (PI * sight.squared);
        // Without terms of first and second order, and clamped at the horizon.
        let ratio = self.radius * per_distance;
        most * (truncation + ratio) + unknown
    }

    /// Upper bound of the unoccluded irradiance (luminance), if all emitters were as far away as the centre.
    #[inline]
    pub(super) fn most_irradiance(&self, sight: &Sight) -> f32 {
        let [of_emitters, of_receiver] = sight.most_cosines;
        let per_area = sight.per_distance * sight.per_distance * FRAC_1_PI;
        self.power * of_emitters * of_receiver * per_area
    }

    /// Whether a point is further away than the diameter.
    pub(super) fn is_far(&self, sight: &Sight) -> bool {
        sight.squared > (2.0 * self.radius).powi(2)
    }
}

impl Expansion {
    /// Unoccluded irradiance at a receiver with this unit normal, W/m².
    pub(super) fn irradiance(&self, sight: &Sight, normal: Vec3) -> Vec4 {
        let (y, height) = (sight.separation, sight.height);
        let scale = 1.0 / (PI * sight.squared * sight.squared);
        if !sight.is_whole {
            let distance = sight.squared.sqrt();
            let shown = self.directional.project(-y / distance, Reading::Bounded);
            return shown * (distance * height.max(0.0) * scale);
        }
        let over = 1.0 / sight.squared;
        let (of_y, of_normal) = (self.second * y, self.second * normal);
        let factor =
            height - 4.0 * normal.dot(of_y) * over - 2.0 * height * trace(&self.second) * over
                + 12.0 * height * y.dot(of_y) * over * over;
        let towards = y * factor + of_normal - of_y * (4.0 * height * over);
        let sideways = normal - y * (4.0 * height * over);
        let mut sum = Vec4::ZERO;
        for a in 0..3 {
            let weights = sideways * y[a];
            sum += self.directional.linear[a] * towards[a]
                + self.first[a][0] * weights.x
                + self.first[a][1] * weights.y
                + self.first[a][2] * weights.z
                + self.first[a][a] * height;
        }
        (-sum * scale).max(Vec4::ZERO)
    }
}

fn outer(a: Vec3, b: Vec3) -> Mat3 {
    Mat3::from_cols(a * b.x, a * b.y, a * b.z)
}

fn trace(matrix: &Mat3) -> f32 {
    matrix.x_axis.x + matrix.y_axis.y + matrix.z_axis.z
}

/// The narrowest cone about two, each given by its unit axis and half its angle.
fn enclosing_cone(one: (Vec3, f32), other: (Vec3, f32)) -> (Vec3, f32) {
    let (wide, narrow) = if one.1 >= other.1 {
        (one, other)
    } else {
        (other, one)
    };
    let cross = wide.0.cross(narrow.0);
    let between = cross.length().atan2(wide.0.dot(narrow.0));
    if between + narrow.1 <= wide.1 {
        return wide;
    }
    let angle = 0.5 * (between + wide.1 + narrow.1);
    if angle >= PI || angle.is_nan() {
        return (wide.0, PI);
    }
    let turn = angle - wide.1;
    let side = (narrow.0 - wide.0 * wide.0.dot(narrow.0)).normalize_or_zero();
    let axis = (wide.0 * turn.cos() + side * turn.sin()).normalize_or(wide.0);
    (axis, angle)
}
