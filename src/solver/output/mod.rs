//! Plain data handed out: what a solve shows and tells of itself.

mod inspection;
mod omitted;
mod relit;
mod snapshot;
mod step_report;

pub use inspection::{InspectedLink, Inspection, PathNode, Place, Subject};
pub use omitted::Omitted;
pub use relit::Relit;
pub use snapshot::{ClusterBox, DisplayMesh, Snapshot, VertexLight};
pub use step_report::StepReport;
