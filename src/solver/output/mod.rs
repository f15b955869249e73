//! Plain data that a solve hands out: snapshots, reports, inspections, omissions.

mod direct_lights;
mod estimated_error;
mod inspection;
mod lamp;
mod note;
mod omitted;
mod phases;
mod relit;
mod snapshot;
mod step_report;

pub use direct_lights::{DirectLights, LIGHT_KINDS, LightSampler, LitPoint, SampledLight, Shadow};
pub use estimated_error::{ErrorPoint, EstimatedError};
pub use inspection::{InspectedLink, Inspection, PathNode, Place, Subject};
pub use lamp::{Lamp, LampLight};
pub use note::{Note, Obstacle};
pub use omitted::Omitted;
pub use phases::{Phase, PhaseObserver, PhaseTimes};
pub use relit::Relit;
pub use snapshot::{ClusterBox, DisplayMesh, Snapshot, VertexLight};
pub use step_report::StepReport;
