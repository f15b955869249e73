//! Light straight from emitters.

mod adapt;
mod before_walls;
mod bend;
mod border;
mod cover;
mod emitter;
mod field;
mod light_parts;
mod light_tree;
mod lights;
mod multipole;
mod noise;
mod panel;
mod samples;
mod smooth;
mod surfaces;

pub(crate) use adapt::divide_coarse;
pub(crate) use border::SPREAD_SHARE;
pub(crate) use field::DirectField;
pub(crate) use light_parts::{LightParts, Shooting, common_ratio};
pub(crate) use lights::Lights;
pub(crate) use surfaces::Surfaces;
