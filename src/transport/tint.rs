//! Tint: what coloured panes make of the light of a link.
//!
//! The visibility of a link is one number for all colours, as nearly all links need no more. Where panes are coloured, each
//! link has a tint beside it: by channel, what passes over the mean of the channels.

use glam::Vec3;

use super::PairSampler;
use crate::{geometry::Random, hierarchy::NodeId};

/// Rays that estimate the tint of a pair with coloured panes between; a quarter of them where those show no colour. Fewer
/// leave spots of colour and miss small panes; more cost time in scenes with coloured panes.
const TINT_RAYS: u32 = 16;

impl PairSampler<'_> {
    /// What coloured panes make of the light of a source, by channel, 1 on average; and the number of rays.
    pub fn tint(&self, source: NodeId, receiver: NodeId, random: &mut Random) -> (Vec3, u32) {
        let (source, receiver) = (self.source(source), self.receiver(receiver));
        let is_grey = |sum: Vec3| sum == Vec3::splat(sum.x);
        let (mut arrived, mut rays) = (Vec3::ZERO, 0);
        while rays < TINT_RAYS / 4 || rays < TINT_RAYS && !is_grey(arrived) {
            rays += 1;
            if let Some((candidate, weight, passing)) = self.pair(&source, &receiver, random) {
                arrived += passing * (weight * candidate.light);
            }
        }
        let mean = arrived.element_sum() / 3.0;
        if mean > 0.0 && !is_grey(arrived) {
            (arrived / mean, rays)
        } else {
            (Vec3::ONE, rays)
        }
    }
}
