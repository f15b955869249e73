//! The solve as a value: [`Solver::new`], [`Solver::step`], [`Solver::snapshot`].
//! No threads of its own, no channel, no clock, no global.
//!
//! A step lowers the threshold, divides elements where linear interpolation of the light errs, refines the existing
//! links, iterates gathering and pushing until the light converges, and gathers once more for the vertices.

mod accuracy;
mod budget;
mod by_lamp;
mod cancel;
mod coverage;
mod direct;
mod estimate;
mod iteration;
mod limits;
mod next_step;
mod omission;
mod output;
mod places;
mod plan;
mod queries;
mod refine;
mod relight;
mod relighting;
mod schedule;
mod settings;
mod shown;
mod state;
mod sums;
mod textures;
mod vertices;

pub use cancel::Cancel;
pub use omission::{Keep, Omission};
pub use output::{
    ClusterBox, DirectLights, DisplayMesh, ErrorPoint, EstimatedError, InspectedLink, Inspection,
    LIGHT_KINDS, Lamp, LampLight, LightSampler, LitPoint, Note, Obstacle, Omitted, PathNode, Phase,
    PhaseObserver, PhaseTimes, Place, Relit, SampledLight, Shadow, Snapshot, StepReport, Subject,
    VertexLight,
};
pub use settings::{Direct, Method, Oracle, Push, SolveSettings};
pub use state::Solver;
