//! The baselines: path-traced baking at vertices, and stochastic Jacobi radiosity. Each goes on in passes of twice the
//! work done so far until it has enough samples or the time is over, and is measured between passes, off the clock.

use std::{
    sync::{Arc, atomic::Ordering},
    time::{Duration, Instant},
};

use super::session::{Session, Truth};
use crate::{
    geometry::RayTree,
    metrics::{Measurement, Runner, Trajectory, grouped},
    reference::{BakePoint, JacobiSettings, StochasticJacobi, VertexBake},
    scene::{Scene, TriangleId},
    solver::{DisplayMesh, VertexLight},
};

/// Elements of stochastic Jacobi radiosity: few arrive early, many blur less.
pub(super) const JACOBI_ELEMENTS: [u32; 2] = [10_000, 80_000];

/// Rays at the emitters in the first pass, as a share of the elements: less is noise only.
const FIRST_RAYS: f32 = 0.5;

/// Something that gets better pass by pass.
trait Contestant: Send {
    /// One more pass; `false` when cancelled on the way.
    fn pass(&mut self, cancel: &(dyn Fn() -> bool + Sync)) -> bool;

    /// Whether it may go on.
    fn has_more(&self) -> bool;

    /// Whether it ends by itself, so that a limit that comes before cuts it short.
    fn has_end(&self) -> bool;

    /// How it stands; step and time are for the caller to fill in.
    fn measure(&self, truth: &Truth) -> Option<Measurement>;
}

/// Path tracing at the vertices of a mesh. The mesh is given away: no time counts for it.
pub(super) fn bake(
    session: &mut Session<'_>,
    scene: &Arc<Scene>,
    truth: &Truth,
    mesh: &DisplayMesh,
) -> Trajectory {
    let points = bake_points(mesh);
    let seed = session.arguments.setting_flags.settings().seed;
    let label = format!(
        "path-traced bake, {} vertices",
        grouped(points.len() as u64)
    );
    repeat(session, scene, &label, Runner::Bake, |session| {
        let begin = Instant::now();
        let rays = session.pool.install(|| RayTree::new(scene));
        let bake = VertexBake::new(scene, &rays, &points, seed);
        let baking = Baking {
            bake,
            scene,
            mesh,
            most_samples: session.arguments.runs.max_spp,
        };
        race(session, truth, baking, begin.elapsed())
    })
}

/// Stochastic Jacobi radiosity on about so many elements, or one for each triangle where these are more.
pub(super) fn jacobi(
    session: &mut Session<'_>,
    scene: &Arc<Scene>,
    truth: &Truth,
    element_count: u32,
) -> Trajectory {
    let seed = session.arguments.setting_flags.settings().seed;
    let settings = JacobiSettings {
        element_count,
        seed,
    };
    let mut elements = 0;
    let title = "stochastic Jacobi";
    let mut run = repeat(session, scene, title, Runner::Jacobi, |session| {
        let begin = Instant::now();
        let solution = session.pool.install(|| {
            StochasticJacobi::new(scene.clone(), Arc::new(RayTree::new(scene)), settings)
        });
        elements = solution.element_count();
        race(session, truth, Shooting::new(solution), begin.elapsed())
    });
    run.label = format!("{title}, {} elements", grouped(elements as u64));
    run
}

/// Run as often as asked for and keep median times.
fn repeat(
    session: &mut Session<'_>,
    scene: &Scene,
    label: &str,
    runner: Runner,
    mut run: impl FnMut(&mut Session<'_>) -> Race,
) -> Trajectory {
    let trajectory = |race: Race| Trajectory {
        label: label.to_owned(),
        runner,
        settings: None,
        repeats: 1,
        is_cut_short: race.is_cut_short,
        points: race.points,
    };
    let mut runs = Vec::new();
    for _ in 0..session.arguments.runs.repeats {
        if session.is_interrupted() {
            break;
        }
        session.say(format!("{}: {label}", scene.name));
        runs.push(trajectory(run(session)));
    }
    let mut merged = Trajectory::median(runs).unwrap_or_else(|| trajectory(Race::default()));
    merged.is_cut_short |= session.is_interrupted();
    merged
}

/// How a contestant fared.
#[derive(Default)]
struct Race {
    points: Vec<Measurement>,
    /// Whether the time limit came before its end.
    is_cut_short: bool,
}

/// Pass after pass until it is done, its time is over, or someone interrupts.
fn race(
    session: &mut Session<'_>,
    truth: &Truth,
    mut contestant: impl Contestant,
    prepared: Duration,
) -> Race {
    let (limit, mut spent) = (session.time_limit(), prepared);
    let mut points = Vec::new();
    while contestant.has_more() && spent < limit && !session.is_interrupted() {
        let begin = Instant::now();
        let interrupted = &session.interrupted;
        let left = limit.saturating_sub(spent);
        let cancel = || interrupted.load(Ordering::Relaxed) || begin.elapsed() > left;
        let is_whole = session.pool.install(|| contestant.pass(&cancel));
        spent += begin.elapsed();
        if !is_whole {
            break;
        }
        if let Some(measured) = contestant.measure(truth) {
            points.push(Measurement {
                step: points.len() as u32 + 1,
                time_s: spent.as_secs_f64(),
                ..measured
            });
        }
        session.tick();
    }
    Race {
        points,
        is_cut_short: contestant.has_end() && contestant.has_more(),
    }
}

/// A bake of some mesh.
struct Baking<'a> {
    bake: VertexBake<'a>,
    scene: &'a Scene,
    mesh: &'a DisplayMesh,
    most_samples: u32,
}

impl Contestant for Baking<'_> {
    fn pass(&mut self, cancel: &(dyn Fn() -> bool + Sync)) -> bool {
        let done = self.bake.samples();
        let samples = done.max(1).min(self.most_samples - done);
        self.bake.pass(samples, cancel)
    }

    fn has_more(&self) -> bool {
        self.bake.samples() < self.most_samples
    }

    fn has_end(&self) -> bool {
        true
    }

    fn measure(&self, truth: &Truth) -> Option<Measurement> {
        let light = VertexLight {
            irradiance: self.bake.irradiance(),
            ..VertexLight::default()
        };
        Some(Measurement {
            step: 0,
            time_s: 0.0,
            epsilon: None,
            samples: Some(self.bake.samples()),
            rays: self.bake.ray_count(),
            links: 0,
            elements: self.mesh.positions.len() as u64,
            memory_bytes: self.bake.memory_bytes() as u64,
            error: truth.measure_mesh(self.scene, self.mesh, &light)?,
        })
    }
}

/// A vertex of a display mesh belongs to whichever of its triangles comes last: they lie on one smooth surface.
fn bake_points(mesh: &DisplayMesh) -> Vec<BakePoint> {
    let mut triangle_of = vec![0; mesh.positions.len()];
    for (vertices, &triangle) in mesh.indices.iter().zip(&mesh.triangle_of) {
        for &vertex in vertices {
            triangle_of[vertex as usize] = triangle;
        }
    }
    let places = mesh.positions.iter().zip(&mesh.normals);
    places
        .zip(triangle_of)
        .map(|((&position, &normal), triangle)| BakePoint {
            position,
            normal,
            triangle: TriangleId(triangle),
        })
        .collect()
}

/// Stochastic Jacobi radiosity.
struct Shooting {
    solution: StochasticJacobi,
    /// Rays of the next pass at the emitters: as many as all passes before.
    emitted_rays: u32,
    is_first: bool,
}

impl Shooting {
    fn new(solution: StochasticJacobi) -> Self {
        Self {
            emitted_rays: (solution.element_count() as f32 * FIRST_RAYS).ceil() as u32,
            solution,
            is_first: true,
        }
    }
}

impl Contestant for Shooting {
    fn pass(&mut self, cancel: &(dyn Fn() -> bool + Sync)) -> bool {
        let is_whole = self.solution.pass(self.emitted_rays, cancel);
        if !std::mem::take(&mut self.is_first) {
            self.emitted_rays = self.emitted_rays.saturating_mul(2);
        }
        is_whole
    }

    fn has_more(&self) -> bool {
        self.emitted_rays < u32::MAX
    }

    fn has_end(&self) -> bool {
        false
    }

    fn measure(&self, truth: &Truth) -> Option<Measurement> {
        Some(Measurement {
            step: 0,
            time_s: 0.0,
            epsilon: None,
            samples: None,
            rays: self.solution.ray_count(),
            links: 0,
            elements: self.solution.element_count() as u64,
            memory_bytes: self.solution.memory_bytes() as u64,
            error: truth.measure_irradiance(&self.solution.irradiance(&truth.points))?,
        })
    }
}
