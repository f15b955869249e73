//! Charts: sides that hang together, of one material, and lie about flat.

use std::collections::VecDeque;

use super::{
    flatten::{Flat, flatten},
    sides::{Neighbours, Side},
};
use crate::scene::Scene;

/// Cosine of the largest angle between the normal of a side and that of the largest one of its chart. Larger angles stretch
/// texels; smaller ones make many charts of curved surfaces, each with its seam.
const CONE: f32 = 0.8;

/// Sides laid flat side by side.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    /// Of the list of all sides.
    pub(super) sides: Vec<u32>,
    /// How they lie.
    pub(super) flat: Flat,
}

/// Charts that hold every side once; no two sides of one lie over each other.
pub(super) fn charts(
    scene: &Scene,
    sides: &[Side],
    neighbours: &Neighbours,
    proceed: &dyn Fn() -> Option<()>,
) -> Option<Vec<Chart>> {
    let mut seeds: Vec<u32> = (0..sides.len() as u32).collect();
    let area = |side: &u32| sides[*side as usize].area(scene);
    seeds.sort_by(|a, b| area(b).total_cmp(&area(a)));
    let mut is_free = vec![true; sides.len()];
    let mut charts = Vec::new();
    for seed in seeds {
        while is_free[seed as usize] {
            proceed()?;
            let mut grown = grow(scene, sides, neighbours, seed, &mut is_free);
            let (flat, rejected) = flatten(scene, sides, &grown);
            // They come to charts of their own; the first one, the seed, never does.
            for side in rejected {
                is_free[side as usize] = true;
            }
            grown.retain(|side| !is_free[*side as usize]);
            charts.push(Chart { sides: grown, flat });
        }
    }
    Some(charts)
}

/// The free sides that hang together with a seed and look about the same way, the seed first; free no more.
fn grow(
    scene: &Scene,
    sides: &[Side],
    neighbours: &Neighbours,
    seed: u32,
    is_free: &mut [bool],
) -> Vec<u32> {
    let of = |side: u32| sides[side as usize];
    let (normal, material) = (of(seed).normal(scene), of(seed).material(scene));
    let mut grown = vec![seed];
    let mut queue = VecDeque::from([seed]);
    is_free[seed as usize] = false;
    while let Some(side) = queue.pop_front() {
        for (_, other) in neighbours.about(side) {
            let is_alike = of(other).normal(scene).dot(normal) >= CONE
                && of(other).material(scene) == material;
            if is_free[other as usize] && is_alike {
                is_free[other as usize] = false;
                grown.push(other);
                queue.push_back(other);
            }
        }
    }
    grown
}
