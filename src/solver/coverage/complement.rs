//! Coverage under an even sky: what the sky does not fill is covered.
//!
//! The visible fraction of a sky that is equally bright in all directions and the coverage add to 1. Two independent
//! estimates of them do not, so light would be made or lost where both are noisy, and white surfaces multiply that. So
//! one gives the other: the coverage at each vertex and of each leaf is the complement of the sky's share there. An error
//! of that share then cancels, as far as surfaces are as bright as the sky.

use super::hemisphere::{HemisphereCoverage, SkyShare};
use crate::hierarchy::Hierarchy;

/// The parts of all hemispheres that an even sky fills.
#[derive(Clone, Debug)]
pub(crate) struct SkyShares {
    /// Radiosity of a surface of the radiance of the sky (luminance), W/m².
    pub(crate) radiosity: f32,
    /// By vertex.
    pub(crate) vertices: Vec<SkyShare>,
    /// By element; of interest for leaves only.
    pub(crate) elements: Vec<SkyShare>,
}

/// The coverage that follows from the shares of the sky.
#[derive(Clone, Debug, Default)]
pub(super) struct Complement {
    /// By element; of interest for leaves only.
    pub(super) elements: Vec<HemisphereCoverage>,
    /// By vertex.
    pub(super) vertices: Vec<HemisphereCoverage>,
}

impl Complement {
    /// The complement of these shares; `probed` gives the coverage of an element as rays estimate it.
    pub(super) fn new(
        hierarchy: &Hierarchy,
        sky: &SkyShares,
        probed: impl Fn(usize) -> HemisphereCoverage,
    ) -> Self {
        let mesh = &hierarchy.mesh;
        let elements = sky
            .elements
            .iter()
            .enumerate()
            .map(|(element, &share)| {
                let probed = probed(element);
                probed.beside_sky(share, probed.lit(), sky.radiosity)
            })
            .collect();
        // What is lit of the surfaces about a vertex: the mean over its leaves outside solids.
        let mut lit = vec![(0.0f32, 0.0f32); sky.vertices.len()];
        for leaf in mesh.active_leaves() {
            let probed = probed(leaf);
            if probed == HemisphereCoverage::INSIDE_SOLID {
                continue;
            }
            for vertex in mesh.elements[leaf].vertices {
                let sum = &mut lit[vertex as usize];
                *sum = (sum.0 + probed.lit(), sum.1 + 1.0);
            }
        }
        let vertices = sky
            .vertices
            .iter()
            .zip(lit)
            .map(|(&share, (sum, count))| {
                let lit = if count > 0.0 { sum / count } else { 1.0 };
                HemisphereCoverage::ENCLOSED.beside_sky(share, lit, sky.radiosity)
            })
            .collect();
        Self { elements, vertices }
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.elements.as_slice()) + size_of_val(self.vertices.as_slice())
    }
}
