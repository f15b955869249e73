//! Direct light: irradiance straight from emitters, from the sky and from the sun.

mod adapt;
mod before_walls;
mod border;
mod control;
mod emitter;
mod explore;
mod field;
mod fields;
mod first_light;
mod interpolation;
mod light_parts;
mod light_tree;
mod lights;
mod multipole;
mod noise;
mod openings;
mod panel;
mod point_lights;
mod samples;
mod scale;
mod shooting;
mod sky;
mod sky_guide;
mod smooth;
mod sun;
mod surfaces;
mod tally;
mod vertex_samples;

pub(crate) use adapt::divide_coarse;
pub(crate) use border::SPREAD_SHARE;
pub(crate) use field::DirectField;
pub(crate) use fields::{DirectFields, PointLight};
pub(crate) use light_parts::{LightParts, Shooting, common_ratio};
pub(crate) use lights::LightKind;
pub(crate) use scale::Surroundings;
pub(crate) use surfaces::Surfaces;
