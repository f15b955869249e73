//! vecrad lights an OBJ or glTF scene by extended vector-based radiosity and shows the light while it is being computed.
//!
//! The method is that of Sun, Gong and Pan, "Extended Vector-Based Radiosity": a volume cluster is treated as its
//! bounding box with six power vectors and six area vectors, links carry a vector irradiance, and each face takes its
//! share by its own normal. The rooms of this library, each importing only from those before it:
//!
//! * [`scene`]: what is lit;
//! * [`geometry`]: area vectors, exact polygon irradiance, sampling, rays;
//! * [`sampling`]: random points of surfaces and emitters;
//! * [`hierarchy`]: clusters, patches, elements and their directional tables;
//! * [`transport`]: node pairs, that is kernel, link, oracle and refinement;
//! * [`solver`]: one progressive step after the other, as a value without threads, clocks or globals;
//! * [`mod@reference`]: the truth by other means, sharing no transport code;
//! * [`metrics`]: error measures and reports;
//! * [`experiments`]: suites of runs, on omissions, stability and growth with size;
//! * [`export`] writes files;
//! * [`picture`]: pictures by rays from the eye over the light of a solve;
//! * [`lightmap`]: that light in one picture over all surfaces, with the mesh that shows it;
//! * [`worker`]: the solver thread;
//! * `viewer`: the window and its pictures;
//! * [`cli`]: flags to settings, headless commands.

#![forbid(unsafe_code)]

pub mod cli;
pub mod experiments;
pub mod export;
pub mod geometry;
pub mod hierarchy;
pub mod lightmap;
pub mod metrics;
pub mod picture;
pub mod reference;
pub mod sampling;
pub mod scene;
pub mod solver;
pub mod transport;
#[cfg(feature = "viewer")]
pub mod viewer;
pub mod worker;
