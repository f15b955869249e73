//! How the tree over the sky grows: its octants are halved until each leaf is small and its radiance even.

use std::{cmp::Ordering, collections::BinaryHeap, ops::Range};

use glam::{Vec3, Vec4};

use super::{Node, SkyTree, octants};
use crate::{scene::SkySample, transport::luminance};

/// Halvings of each octant at least: 2,048 leaves of 5°. Fewer, and rays are stratified less and guided beside small
/// openings; more, and horizons have more leaves.
const LEAST_HALVINGS: u32 = 8;

/// Power that a leaf of one radiance may misplace, as a share of the sky's. Smaller makes more leaves; larger blurs the
/// shadows of bright spots.
const MISPLACED_SHARE: f32 = 5e-5;

/// Most leaves. More take time at every horizon; fewer blur the shadows of rich skies.
const MOST_LEAVES: usize = 16_384;

/// A leaf that may be halved.
struct Candidate {
    node: usize,
    samples: Range<usize>,
    halvings: u32,
    /// Power that it misplaces; infinite where it is too large.
    misplaced: f32,
}

impl SkyTree {
    /// Halve the octants until each leaf is small enough and its samples are alike. `radiosity` gives that of a leaf
    /// with some samples.
    pub(super) fn grown(
        samples: &mut [SkySample],
        radiosity: impl Fn([Vec3; 3], &[SkySample]) -> Vec4,
    ) -> Self {
        let power =
            |sample: &SkySample| luminance(sample.radiance.extend(0.0)) * sample.solid_angle;
        let tolerated = MISPLACED_SHARE * samples.iter().map(power).sum::<f32>();
        let mut tree = Self {
            nodes: Vec::new(),
            neighbours: Vec::new(),
            table: None,
            width: 0.0,
        };
        let mut pending = BinaryHeap::new();
        let candidate = |node: usize, samples: &[SkySample], from: Range<usize>, halvings: u32| {
            let solid_angle: f32 = samples.iter().map(|sample| sample.solid_angle).sum();
            let mean = samples.iter().map(power).sum::<f32>() / solid_angle.max(f32::MIN_POSITIVE);
            let misplaced = samples
                .iter()
                .map(|sample| (power(sample) - mean * sample.solid_angle).abs())
                .sum();
            let is_large = halvings < LEAST_HALVINGS;
            Candidate {
                node,
                samples: from,
                halvings,
                misplaced: if is_large { f32::INFINITY } else { misplaced },
            }
        };
        // The octants, along the curve around one pole and then around the other.
        let mut start = 0;
        for octant in octants() {
            let count = part(&mut samples[start..], |sample| {
                octant
                    .iter()
                    .all(|corner| corner.dot(sample.direction) >= 0.0)
            });
            let range = start..start + count;
            start = range.end;
            let own = &samples[range.clone()];
            pending.push(candidate(tree.nodes.len(), own, range, 0));
            tree.nodes.push(Node::leaf(octant, radiosity(octant, own)));
        }
        // Halves, the worst leaf first.
        while let Some(Candidate {
            node,
            samples: range,
            halvings,
            misplaced,
        }) = pending.pop()
        {
            if misplaced <= tolerated || tree.nodes.len() >= 2 * MOST_LEAVES {
                break;
            }
            let [left, apex, right] = tree.nodes[node].path;
            let middle = (left + right).normalize_or(apex);
            let plane = apex.cross(middle);
            let halving = plane * plane.dot(left).signum();
            let own = &mut samples[range.clone()];
            let count = part(own, |sample| halving.dot(sample.direction) >= 0.0);
            let first = tree.nodes.len();
            tree.nodes[node].first_child = first as u32;
            tree.nodes[node].halving = halving;
            let (one, other) = (
                range.start..range.start + count,
                range.start + count..range.end,
            );
            for (path, range) in [([left, middle, apex], one), ([apex, middle, right], other)] {
                let own = &samples[range.clone()];
                let child = candidate(tree.nodes.len(), own, range, halvings + 1);
                tree.nodes.push(Node::leaf(path, radiosity(path, own)));
                pending.push(child);
            }
        }
        tree
    }
}

/// Move the samples for which a condition holds to the front. Returns their number.
fn part(samples: &mut [SkySample], is_first: impl Fn(&SkySample) -> bool) -> usize {
    let mut count = 0;
    for index in 0..samples.len() {
        if is_first(&samples[index]) {
            samples.swap(index, count);
            count += 1;
        }
    }
    count
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_power = self.misplaced.total_cmp(&other.misplaced);
        by_power.then(other.node.cmp(&self.node))
    }
}
