//! Plain data handed out: what a solve shows and tells of itself.

mod inspection;
mod snapshot;

pub use inspection::{InspectedLink, Inspection, PathNode, Place, Subject};
pub use snapshot::{ClusterBox, DisplayMesh, Snapshot, StepReport, VertexLight};
