//! Direct light: irradiance straight from emitters.

mod adapt;
mod before_walls;
mod border;
mod emitter;
mod field;
mod interpolation;
mod light_parts;
mod light_tree;
mod lights;
mod multipole;
mod noise;
mod panel;
mod samples;
mod smooth;
mod surfaces;
mod vertex_samples;

pub(crate) use adapt::divide_coarse;
pub(crate) use border::SPREAD_SHARE;
pub(crate) use field::DirectField;
pub(crate) use light_parts::{LightParts, Shooting, common_ratio};
pub(crate) use lights::Lights;
pub(crate) use surfaces::Surfaces;
