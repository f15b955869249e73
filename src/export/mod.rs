//! Files of the lit scene and of reports: one format a file, and the colours they share.

mod color;
mod glb;
mod mesh;
mod mesh_format;
mod obj;
mod parts;
mod plot;
mod ply;
mod table;

pub(crate) use glb::container as glb_container;

pub use color::{ColorOptions, ToneMap};
pub use mesh::{LitMesh, MeshOptions};
pub use mesh_format::{MeshFormat, UnknownMeshFormat};
pub use plot::{Curve, CurvePlot};
pub use table::write_csv;
