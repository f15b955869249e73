//! Lightmaps: the light of a solve in one picture over all lit sides of the surfaces of a scene, and a GLB that shows it.
//!
//! Sides that lie about flat and hang together become charts (`charts`), which are laid flat (`flatten`) and packed into a
//! square of texels (`pack`, `layout`), unless the file's own texture coordinates already lay everything out (`own`). Every
//! texel that a chart touches has a place on it (`texels`), which the picture pass lights by rays; texels about charts take
//! the light of their neighbours (`padding`), so that bilinear lookups near seams find light, and `seams` tells how well it
//! fits there. The light leaves as irradiance (`images`) and on the triangles of the scene (`meshes`, `glb`).

mod bake;
mod charts;
mod flatten;
mod glb;
mod images;
mod layout;
mod meshes;
mod own;
mod pack;
mod padding;
mod seams;
mod sides;
mod texels;

pub use bake::{Lightmap, LightmapFacts, LightmapRequest, bake_lightmap};
pub use layout::LayoutError;
