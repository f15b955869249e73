//! Light straight from emitters.

mod adapt;
mod before_walls;
mod border;
mod cover;
mod emitter;
mod light_parts;
mod light_tree;
mod lights;
mod multipole;
mod panel;
mod smooth;

pub(crate) use adapt::divide_coarse;
pub(crate) use adapt::{DirectField, Limits, SPREAD_SHARE};
pub(crate) use border::CONTRAST_TOLERANCE;
pub(crate) use light_parts::{LightParts, Shooting, common_ratio};
pub(crate) use lights::Lights;
pub(crate) use smooth::agreement;
