//! State shared by all runs of a report: scenes, references, threads, limits, progress, and whether to stop.

use std::{
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use anyhow::{Context as _, Result};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::ReportArguments;
use crate::{
    cli::{
        Outcome, load, load::light, output::say, progress::Progress, report::core_count,
        watched::watched,
    },
    geometry::RayTree,
    metrics::{ErrorMeasures, MeshLookup, ReferenceFacts, measure_error},
    reference::{PathSettings, PathTracer, ReferencePoint},
    scene::{Lighting, Scene, builtin::room_of},
    solver::{Cancel, DisplayMesh, VertexLight},
    worker::RunOptions,
};

/// Time of a run where none is given: enough for 2 % on most scenes, and still minutes for a whole report.
const USUAL_TIME_LIMIT: Duration = Duration::from_secs(60);

/// Where a scene comes from.
pub(super) enum Source {
    /// An OBJ or glTF file.
    File(PathBuf),
    /// A built-in scene.
    Builtin(String),
    /// The built-in room in so many triangles.
    Room(u32),
}

/// A report in the making.
pub(super) struct Session<'a> {
    /// Arguments of the command.
    pub(super) arguments: &'a ReportArguments,
    /// Set by Ctrl+C.
    pub(super) interrupted: Arc<AtomicBool>,
    /// Baselines run here; the solver has its own of the same size.
    pub(super) pool: Arc<ThreadPool>,
    /// Light that is asked for.
    lighting: Lighting,
    progress: Progress,
    /// Whether a limit that the user gave ended a solver run.
    is_cut_short: bool,
}

/// The reference of a scene.
pub(super) struct Truth {
    /// Random points with their light.
    pub(super) points: Vec<ReferencePoint>,
    /// Its description.
    pub(super) facts: ReferenceFacts,
}

impl<'a> Session<'a> {
    /// A session without runs.
    pub(super) fn new(
        arguments: &'a ReportArguments,
        interrupted: Arc<AtomicBool>,
    ) -> Result<Self> {
        let threads = arguments.limits.threads.map_or(0, usize::from);
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("baseline-{index}"))
            .build()
            .context("cannot start the threads of the baselines")?;
        Ok(Self {
            arguments,
            interrupted,
            pool: Arc::new(pool),
            lighting: arguments.scene_flags.lighting()?,
            progress: Progress::new(arguments.quiet),
            is_cut_short: false,
        })
    }

    /// Whether Ctrl+C was pressed.
    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// Limits of each solver run.
    pub(super) fn run_options(&self) -> RunOptions {
        let limits = &self.arguments.limits;
        RunOptions {
            threads: limits.threads.map_or(0, usize::from),
            time_limit: Some(self.time_limit()),
            memory_limit: limits.memory_limit.map(|mebibytes| mebibytes << 20),
            gives_way: false,
        }
    }

    /// Limit of each run.
    pub(super) fn time_limit(&self) -> Duration {
        self.arguments.limits.time_limit.unwrap_or(USUAL_TIME_LIMIT)
    }

    /// Threads in use.
    pub(super) fn thread_count(&self) -> usize {
        let given = self.arguments.limits.threads.map(usize::from);
        given.unwrap_or_else(core_count)
    }

    /// A solver run ended before its settings did.
    pub(super) fn note_cut(&mut self) {
        let limits = &self.arguments.limits;
        self.is_cut_short |= limits.time_limit.is_some() || limits.memory_limit.is_some();
    }

    /// Say on the progress line what goes on.
    pub(super) fn say(&mut self, text: String) {
        self.progress.say(text);
    }

    /// Keep the progress line alive.
    pub(super) fn tick(&mut self) {
        self.progress.show();
    }

    /// Run something in the pool, and cancel it when its time is over or Ctrl+C is pressed.
    ///
    /// # Errors
    /// A clause that says how it panicked.
    pub(super) fn watch<T: Send>(
        &mut self,
        job: impl FnOnce(&Cancel) -> T + Send,
    ) -> Result<T, String> {
        let (begin, limit) = (Instant::now(), self.time_limit());
        let (pool, interrupted) = (self.pool.clone(), self.interrupted.clone());
        let is_over = || begin.elapsed() >= limit || interrupted.load(Ordering::Relaxed);
        watched(&pool, job, || {
            self.tick();
            is_over()
        })
    }

    /// How it ended.
    pub(super) fn finish(mut self) -> Outcome {
        self.progress.finish();
        if self.is_interrupted() || self.is_cut_short {
            Outcome::StoppedEarly
        } else {
            Outcome::Done
        }
    }

    /// Read or make a scene, its warnings to standard error.
    pub(super) fn load(&mut self, source: &Source) -> Result<Arc<Scene>> {
        let options = self.arguments.scene_flags.options();
        let lighting = &self.lighting;
        let scene = match source {
            Source::File(path) => load(Some(path), None, &options, lighting)?,
            Source::Builtin(name) => load(None, Some(name), &options, lighting)?,
            Source::Room(triangles) => {
                light(room_of(*triangles as usize).finish(&options)?, lighting)?
            }
        };
        for warning in &scene.warnings {
            say(format_args!("warning: {warning}"));
        }
        Ok(Arc::new(scene))
    }

    /// Trace the reference of a scene; `None` when interrupted.
    pub(super) fn trace(&mut self, scene: &Arc<Scene>) -> Option<Arc<Truth>> {
        self.say(format!("{}: tracing the reference", scene.name));
        let begin = Instant::now();
        let settings = PathSettings {
            samples_per_pass: self.arguments.reference,
            seed: self.arguments.setting_flags.settings().seed,
            ..PathSettings::default()
        };
        let traced = self.pool.install(|| {
            let rays = Arc::new(RayTree::new(scene));
            let mut tracer = PathTracer::new(scene.clone(), rays, settings);
            let cancel = || self.interrupted.load(Ordering::Relaxed);
            tracer.pass(&cancel).then(|| tracer.result())
        })?;
        let light: Vec<_> = traced.points.iter().map(|p| Some(p.radiance())).collect();
        let noise = measure_error(&light, &traced.points).map_or(0.0, |error| error.noise_floor);
        Some(Arc::new(Truth {
            facts: ReferenceFacts {
                surfaces: traced.surfaces,
                points: traced.points.len(),
                samples: traced.samples,
                noise_floor: noise,
                seconds: begin.elapsed().as_secs_f64(),
            },
            points: traced.points,
        }))
    }
}

impl Truth {
    /// Error of a mesh with light at its vertices.
    pub(super) fn measure_mesh(
        &self,
        scene: &Scene,
        mesh: &DisplayMesh,
        light: &VertexLight,
    ) -> Option<ErrorMeasures> {
        let lookup = MeshLookup::new(scene, mesh);
        measure_error(&lookup.radiance(light, &self.points), &self.points)
    }

    /// Error of irradiance that is known at the points themselves.
    pub(super) fn measure_irradiance(
        &self,
        irradiance: &[Option<glam::Vec3>],
    ) -> Option<ErrorMeasures> {
        let radiance = |(point, irradiance): (&ReferencePoint, &Option<glam::Vec3>)| {
            irradiance.map(|irradiance| {
                ReferencePoint {
                    irradiance,
                    ..*point
                }
                .radiance()
            })
        };
        let measured: Vec<_> = self.points.iter().zip(irradiance).map(radiance).collect();
        measure_error(&measured, &self.points)
    }
}
