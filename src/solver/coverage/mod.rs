//! Closures: which part of a view lit surfaces fill, and the rays that find it.

mod closure;
mod prober;

pub(crate) use closure::{Closure, Closures};
pub(crate) use prober::closures;
