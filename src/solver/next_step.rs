//! How far the next step goes: its number, its tolerances, and the memory that it may take.

use super::{Solver, budget::Budget, limits::Limits, schedule::next_step};

impl Solver {
    /// The number of the next step.
    pub(super) fn next_step(&self) -> u32 {
        let (step_count, elements) = (
            self.settings.step_count(),
            self.hierarchy.mesh.elements.len(),
        );
        // Links that stay need no steps on their way.
        if self.linked.is_limited(elements) && self.step < step_count {
            return step_count;
        }
        next_step(self.step, step_count, self.linked.link_count(), elements)
    }

    /// The memory limit, and the memory beside the mesh and its light.
    pub(super) fn budget(&self) -> Budget {
        let others = self.rays.memory_bytes()
            + self.coverage.memory_bytes()
            + size_of_val(self.leaves.as_slice())
            + size_of_val(self.vertex_factors.as_slice())
            + self.relighting.memory_bytes()
            + self
                .estimator
                .as_ref()
                .map_or(0, |estimator| estimator.memory_bytes(&self.rays))
            + self.snapshot.memory_bytes();
        Budget {
            limit: self.memory_limit,
            others: others as u64,
        }
    }

    /// Tolerances and limits of a step of this threshold scale.
    pub(super) fn limits(&self, threshold_scale: f32) -> Limits {
        let most = self.budget().most_elements(self.surfaces(), &self.linked);
        Limits::new(&self.settings, &self.hierarchy, threshold_scale, most)
    }
}
