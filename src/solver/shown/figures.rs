//! The figures of a step: counts, energy balance and row sums.

use crate::{
    solver::{
        Solver, StepReport,
        sums::{area_sum, mean},
    },
    transport::luminance,
};

impl Solver {
    /// Fill in what can be read off the state after a step.
    pub(crate) fn fill(&self, report: &mut StepReport) {
        report.links = self.links.len() as u64;
        report.nodes = self.hierarchy.node_count() as u64;
        report.elements = self.leaves.len() as u64;
        report.vertices = self.hierarchy.mesh.vertices.len() as u64;
        report.shadow_rays = self.ray_count;
        report.memory_bytes = self.memory_bytes();
        report.energy_balance = self.energy_balance();
        report.estimated_error = self.estimated_error();
        self.fill_row_sums(report);
        if self.is_out_of_memory() {
            report.is_full = true;
            report.notes.push(
                "the memory limit is reached; refinement stops here with what fits".to_owned(),
            );
        }
    }

    /// Power that arrives at all leaves relative to power that left: emission and reflection.
    fn energy_balance(&self) -> f64 {
        let arrived = area_sum(&self.hierarchy, |leaf| {
            self.linked[leaf] + self.direct_of(leaf)
        });
        let sent = area_sum(&self.hierarchy, |leaf| {
            let reflectance = self.hierarchy.reflectance_of(leaf).extend(0.0);
            let emitted = (self.hierarchy.emission_of(leaf) * std::f32::consts::PI).extend(0.0);
            reflectance * (self.linked[leaf] + self.direct_of(leaf)) + emitted
        });
        let sum = sent.element_sum();
        if sum > 0.0 {
            arrived.element_sum() / sum
        } else {
            1.0
        }
    }

    /// Root mean square over the area of the sum of link errors, relative to the mean irradiance.
    fn estimated_error(&self) -> f32 {
        let sum: f64 = self
            .leaves
            .iter()
            .map(|leaf| {
                let element = &self.hierarchy.mesh.elements[leaf.element as usize];
                let measure = self.hierarchy.importance.measure(element.patch as usize);
                let area = element.area_vector.length() * measure;
                f64::from(area) * f64::from(leaf.error).powi(2)
            })
            .sum();
        let mean = mean(&self.hierarchy, |leaf| {
            self.linked[leaf] + self.direct_of(leaf)
        });
        let reference = f64::from(luminance(mean));
        let root = (sum / self.hierarchy.importance.area.max(f64::MIN_POSITIVE)).sqrt();
        if reference > 0.0 {
            (root / reference) as f32
        } else {
            0.0
        }
    }

    /// Sums of form factors: what leaves receive when everything sends 1.
    fn fill_row_sums(&self, report: &mut StepReport) {
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        let (mut sum, mut whole) = (0.0f64, 0.0f64);
        let elements = &self.hierarchy.mesh.elements;
        let seen = |leaf: &usize| !elements[*leaf].is_inside_solid();
        for leaf in self.hierarchy.mesh.active_leaves().filter(seen) {
            let row = self.linked[leaf].w;
            least = least.min(row);
            most = most.max(row);
            let area = f64::from(elements[leaf].area_vector.length());
            sum += f64::from(row) * area;
            whole += area;
        }
        report.row_sum_min = least.min(most);
        report.row_sum_max = most;
        report.row_sum_mean = (sum / whole.max(f64::MIN_POSITIVE)) as f32;
    }
}
