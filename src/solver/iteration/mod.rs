//! Light over links: gathered, pushed, pulled, until it settles.

mod anderson;
mod balance;
mod gather;
mod iterate;

pub(crate) use anderson::Anderson;
pub(crate) use iterate::CEILING_SLACK;
