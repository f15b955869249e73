//! Light over links: gathered, pushed and pulled until it converges.

mod anderson;
mod balance;
mod gather;
mod iterate;
mod light;
mod surroundings;

pub(crate) use anderson::Anderson;
pub(crate) use balance::balance;
pub(crate) use iterate::{CEILING_SLACK, Iteration, iterate, iteration_bytes};
pub(crate) use light::LinkedLight;
pub(crate) use surroundings::surroundings;
