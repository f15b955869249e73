//! The estimated error over the surfaces, from that at random points: where the light is too bright, and where too dark.
//!
//! A single point tells little but the noise of its rays. So the points are divided in halves again and again, by the
//! direction in which their surface faces and by their position, and the error that is shown begins with the mean over all
//! points: whatever the mean of a half differs from that of both is added as far as noise does not explain it. This is the
//! shrinkage of wavelet coefficients (Donoho and Johnstone, "Ideal spatial adaptation by wavelet shrinkage", 1994) with
//! the non-negative garrote (Breiman, "Better subset regression using the nonnegative garrote", 1995) in place of a
//! threshold: a difference d of standard error σ is kept by the factor max(0, 1 − λ²σ²/d²), and with λ² = 2 ln n no noise
//! among n differences is expected to pass.

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    scene::Frame,
    solver::{DisplayMesh, ErrorPoint},
};

/// Fewest points of a half. Fewer, and their spread does not tell their noise: with four, what is shown of noise alone is
/// twice as much. More, and errors of small surfaces are lost among others.
const FEWEST_POINTS: usize = 8;

/// How far apart, in frame units, points count that face opposite directions: as the ends of the scene. Smaller, and a
/// wall is one with what stands before it; larger, and walls far apart are one.
const OPPOSITE: f32 = Frame::EXTENT as f32;

/// The estimated error at a place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PooledError {
    /// Error of the luminance of the reflected radiance, relative to the root mean square of the true light over all
    /// points; positive where it is too bright, 0 where none is told from noise.
    pub error: f32,
    /// The same relative to the mean light that is shown on the surfaces that it is a mean over; 0 where there is none.
    pub of_local: f32,
    /// Number of points of the smallest part of the surfaces whose error is told from that of the others; 0 where noise
    /// explains it all.
    pub points: u32,
}

/// A half of the points of its parent, or all.
#[derive(Clone, Copy, Debug)]
struct Node {
    pooled: PooledError,
    split: Option<Split>,
}

/// Where a node is divided in halves, which lie beside each other in the list.
#[derive(Clone, Copy, Debug)]
struct Split {
    axis: usize,
    /// Points below this belong to the first half.
    at: f32,
    first: u32,
}

/// The estimated error over the surfaces.
#[derive(Clone, Debug, Default)]
pub struct ErrorMap {
    /// Parents before their halves; none without points.
    nodes: Vec<Node>,
}

impl ErrorMap {
    /// Pool the errors at points.
    pub fn new(points: &[ErrorPoint]) -> Self {
        let mut map = Self::default();
        if points.is_empty() {
            return map;
        }
        let mut points = points.to_vec();
        // As many differences as there can be halves, and the mean of all.
        let differences = (points.len() / FEWEST_POINTS).max(1);
        let threshold_square = 2.0 * (differences as f32).ln();
        let all = Sample::of(&points);
        let variance = all.variance.max(all.doubt.powi(2));
        let kept = all.mean * garrote(all.mean, variance, threshold_square);
        let root = pooled(kept, &all, if kept == 0.0 { 0 } else { all.count });
        map.nodes.push(Node {
            pooled: root,
            split: None,
        });
        map.divide(0, &mut points, threshold_square);
        map
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The error at a place of a surface that faces the direction of this unit normal.
    pub fn at(&self, position: Vec3, normal: Vec3) -> PooledError {
        let place = place(position, normal);
        let Some(mut node) = self.nodes.first() else {
            return PooledError::default();
        };
        while let Some(split) = node.split {
            let second = usize::from(place[split.axis] >= split.at);
            node = &self.nodes[split.first as usize + second];
        }
        node.pooled
    }

    /// The error at each vertex of a mesh, in per cent of the root mean square of the true light; 0 on emitters, whose
    /// light is not estimated.
    pub fn percent_at_vertices(&self, mesh: &DisplayMesh) -> Vec<f32> {
        let places = mesh.positions.par_iter().zip(&mesh.normals);
        let vertices = places.zip(&mesh.emission);
        let percent = |((position, normal), emission): ((&Vec3, &Vec3), &Vec3)| {
            let reflects = *emission == Vec3::ZERO;
            100.0 * f32::from(u8::from(reflects)) * self.at(*position, *normal).error
        };
        vertices.map(percent).collect()
    }

    /// Largest error of any place, without its sign, in per cent likewise.
    pub fn largest_percent(&self) -> f32 {
        let leaves = self.nodes.iter().filter(|node| node.split.is_none());
        100.0 * leaves.fold(0.0, |most: f32, node| most.max(node.pooled.error.abs()))
    }

    /// Divide a node, as far as there are points for it.
    fn divide(&mut self, index: usize, points: &mut [ErrorPoint], threshold_square: f32) {
        if points.len() < 2 * FEWEST_POINTS {
            return;
        }
        let axis = widest_axis(points);
        let along = |point: &ErrorPoint| place(point.position, point.normal)[axis];
        points.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let places: Vec<f32> = points.iter().map(along).collect();
        let Some(middle) = dividing_index(&places) else {
            return;
        };
        let at = places[middle];
        let (low, high) = points.split_at_mut(middle);
        let halves = [Sample::of(low), Sample::of(high)];
        let difference = halves[1].mean - halves[0].mean;
        let spread = halves[0].variance + halves[1].variance;
        let variance = spread.max((halves[1].doubt - halves[0].doubt).powi(2));
        let kept = difference * garrote(difference, variance, threshold_square);
        let parent = self.nodes[index].pooled;
        let count = (low.len() + high.len()) as f32;
        // The mean over both stays that of the parent.
        let shares = [-(high.len() as f32) / count, low.len() as f32 / count];
        let first = self.nodes.len() as u32;
        for (sample, share) in halves.iter().zip(shares) {
            let told = if kept == 0.0 {
                parent.points
            } else {
                sample.count
            };
            self.nodes.push(Node {
                pooled: pooled(parent.error + share * kept, sample, told),
                split: None,
            });
        }
        self.nodes[index].split = Some(Split { axis, at, first });
        self.divide(first as usize, low, threshold_square);
        self.divide(first as usize + 1, high, threshold_square);
    }
}

/// The mean error of some points.
struct Sample {
    mean: f32,
    /// Square of the standard error of the mean, by how much the points differ.
    variance: f32,
    /// By how much it differs from the mean by either set of rays, which have noise that all points have in common.
    doubt: f32,
    /// Mean light shown.
    light: f32,
    count: u32,
}

impl Sample {
    fn of(points: &[ErrorPoint]) -> Self {
        let count = points.len().max(1) as f32;
        let errors = || points.iter().map(ErrorPoint::error);
        let mean = errors().sum::<f32>() / count;
        let squares = errors().map(|error| (error - mean).powi(2)).sum::<f32>();
        Self {
            mean,
            variance: squares / (count * (count - 1.0).max(1.0)),
            doubt: points
                .iter()
                .map(|point| 0.5 * (point.errors[0] - point.errors[1]))
                .sum::<f32>()
                / count,
            light: points.iter().map(|point| point.light).sum::<f32>() / count,
            count: points.len() as u32,
        }
    }
}

fn pooled(error: f32, sample: &Sample, points: u32) -> PooledError {
    PooledError {
        error,
        of_local: match sample.light > 0.0 {
            true => error / sample.light,
            false => 0.0,
        },
        points,
    }
}

/// The part that is kept of a difference with this square of its standard error, 0…1.
fn garrote(difference: f32, variance: f32, threshold_square: f32) -> f32 {
    let noise = threshold_square * variance;
    (1.0 - noise / (difference * difference).max(f32::MIN_POSITIVE)).max(0.0)
}

/// The coordinates by which points are divided: position and direction.
fn place(position: Vec3, normal: Vec3) -> [f32; 6] {
    let (p, n) = (position, normal * (0.5 * OPPOSITE));
    [p.x, p.y, p.z, n.x, n.y, n.z]
}

/// The coordinate in which points are furthest apart.
fn widest_axis(points: &[ErrorPoint]) -> usize {
    let mut low = [f32::INFINITY; 6];
    let mut high = [f32::NEG_INFINITY; 6];
    for point in points {
        for (axis, at) in place(point.position, point.normal).into_iter().enumerate() {
            low[axis] = low[axis].min(at);
            high[axis] = high[axis].max(at);
        }
    }
    let extent = |axis: &usize| high[*axis] - low[*axis];
    (0..6)
        .max_by(|a, b| extent(a).total_cmp(&extent(b)))
        .unwrap_or(0)
}

/// Where sorted coordinates are divided: in the middle, or at a gap that is so much wider as it is off the middle. `None`
/// where all are the same.
fn dividing_index(places: &[f32]) -> Option<usize> {
    let worth = |&index: &usize| {
        let gap = places[index] - places[index - 1];
        gap * index.min(places.len() - index) as f32
    };
    (FEWEST_POINTS..=places.len() - FEWEST_POINTS)
        .max_by(|a, b| worth(a).total_cmp(&worth(b)))
        .filter(|index| worth(index) > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Random;

    const SIDE: f32 = 50.0;

    /// Points of two walls that face each other, and their errors with noise of this deviation.
    fn points(count: usize, noise: f32, error: impl Fn(Vec3) -> f32) -> Vec<ErrorPoint> {
        let mut random = Random::new(7, 1);
        let mut uniform = || random.uniform() - 0.5;
        let mut point = |index: usize| {
            let x = if index.is_multiple_of(2) { -SIDE } else { SIDE };
            let position = Vec3::new(x, 2.0 * SIDE * uniform(), 2.0 * SIDE * uniform());
            ErrorPoint {
                position,
                normal: -Vec3::X * x.signum(),
                light: 0.5,
                errors: [(); 2].map(|()| error(position) + noise * 12f32.sqrt() * uniform()),
            }
        };
        (0..count).map(&mut point).collect()
    }

    #[test]
    fn noise_shows_nothing() {
        let mut shown = 0.0;
        for seed in 0..20 {
            let mut random = Random::new(seed, 9);
            let mut points = points(512, 0.0, |_| 0.0);
            for error in points.iter_mut().flat_map(|point| &mut point.errors) {
                *error = random.uniform() - 0.5;
            }
            shown += ErrorMap::new(&points).largest_percent() / 20.0;
        }
        // Of single points it is 20: 100 times the root of 1/24.
        assert!(shown < 2.0, "{shown}");
    }

    #[test]
    fn an_error_shows_where_it_is_with_its_sign() {
        let error = |at: Vec3| match (at.x < 0.0, at.y < 0.0) {
            (true, true) => 0.2,
            (false, _) => -0.1,
            _ => 0.0,
        };
        let map = ErrorMap::new(&points(1024, 0.1, error));
        for (y, z) in [(-40.0, -30.0), (-20.0, 10.0), (20.0, -10.0), (40.0, 30.0)] {
            for x in [-SIDE, SIDE] {
                let place = Vec3::new(x, y, z);
                let found = map.at(place, -Vec3::X * x.signum());
                assert!(
                    (found.error - error(place)).abs() < 0.03,
                    "{place} {found:?}"
                );
                assert!((found.of_local - 2.0 * found.error).abs() < 1e-6);
                assert!(found.points > 0 && found.points < 1024);
            }
        }
    }

    #[test]
    fn an_error_everywhere_is_that_of_all_points() {
        let map = ErrorMap::new(&points(256, 0.1, |_| 0.05));
        let found = map.at(Vec3::X * SIDE, -Vec3::X);
        assert!((found.error - 0.05).abs() < 0.02, "{found:?}");
        assert_eq!(found.points, 256);
    }

    #[test]
    fn few_points_or_none_tell_nothing() {
        assert!(ErrorMap::new(&[]).is_empty());
        assert_eq!(
            ErrorMap::default().at(Vec3::ZERO, Vec3::X),
            PooledError::default()
        );
        let alike = vec![points(1, 0.0, |_| 0.3)[0]; 40];
        let map = ErrorMap::new(&alike);
        assert_eq!(map.nodes.len(), 1, "points in one place are not divided");
        assert!((map.largest_percent() - 30.0).abs() < 1e-3);
    }
}
