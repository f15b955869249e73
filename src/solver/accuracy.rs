//! The estimated error of `Solver`, and the end of a solve by the error that is asked for.

use std::sync::Arc;

use super::{
    Cancel, EstimatedError, Note, Obstacle, Phase, PhaseObserver, Solver, StepReport,
    direct::Surfaces,
    estimate::{self, ErrorEstimator},
    settings::FINEST_THRESHOLD,
};

impl Solver {
    /// Whether an error is as small as was asked for.
    pub(super) fn is_error_reached(&self, estimated: EstimatedError) -> bool {
        let wanted = self.settings.error;
        wanted.is_some_and(|wanted| estimated.is_within(wanted))
    }

    /// Whether the solve ends with a step as fine as the settings ask, or goes on to the error that is asked for. Notes
    /// where that error cannot be reached.
    pub(super) fn ends_with(&mut self, estimated: EstimatedError, report: &mut StepReport) -> bool {
        let Some(wanted) = self.settings.error else {
            return true;
        };
        if self.is_error_reached(estimated) {
            return true;
        }
        let advances = self
            .estimator
            .as_mut()
            .is_some_and(|estimator| estimator.advances(estimated));
        let obstacle = match () {
            () if self.is_full => Obstacle::Memory,
            () if advances && report.epsilon > FINEST_THRESHOLD => return false,
            () if estimated.trimmed_rms <= f64::from(wanted) => Obstacle::Noise,
            () => Obstacle::Mesh,
        };
        report
            .notes
            .push(Note::ErrorNotReached { wanted, obstacle });
        true
    }

    /// Renew the snapshot, and estimate the error of its light.
    pub(super) fn show_and_estimate(
        &mut self,
        step: u32,
        cancel: &Cancel,
        begin: PhaseObserver<'_>,
    ) -> Option<EstimatedError> {
        begin(Phase::Display, self.ray_count);
        self.show(step, cancel)?;
        begin(Phase::Estimate, self.ray_count);
        self.estimate_error(cancel)
    }

    /// Estimate the error of the light shown; the snapshot gets it by point.
    pub(super) fn estimate_error(&mut self, cancel: &Cancel) -> Option<EstimatedError> {
        let (scene, rays) = (&self.scene, &self.rays);
        let shown = estimate::Shown {
            scene,
            settings: &self.settings,
            appearances: &self.relighting.appearances,
            surfaces: Surfaces::new(&self.hierarchy, &self.direct),
            sees_outside: self.plan.sees_outside,
            irradiance: &self.snapshot.light.irradiance,
            solve_rays: self.ray_count,
            cancel,
        };
        let seed = self.settings.seed;
        let estimator = self
            .estimator
            .get_or_insert_with(|| ErrorEstimator::new(scene, &self.hierarchy, rays, seed));
        let estimate = estimator.estimate(shown)?;
        self.snapshot.errors = Arc::new(estimate.points);
        Some(estimate.figures)
    }
}
