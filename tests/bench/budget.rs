//! Where a solve spends its time: rays, nanoseconds of processor time per ray, and processor time by phase, for the presets
//! on scenes of many kinds.
//!
//! `cargo bench --bench budget` measures all, which takes long; names of scenes and presets choose some of them, as in
//! `cargo bench --bench budget -- gallery office draft`. Each is solved once.

#![expect(
    clippy::unwrap_used,
    reason = "a bench that cannot begin fails by panicking"
)]

use std::{
    env,
    sync::Arc,
    time::{Duration, Instant},
};

use vecrad::{
    scene::{SceneOptions, builtin::builtin},
    solver::{Cancel, Phase, SolveSettings, Solver},
};

/// The scenes: small, smooth, of large faces, of unconnected ones, large; then those furnished as people model them.
const SCENES: [&str; 8] = [
    "cornell",
    "room-42879",
    "gallery",
    "soup",
    "room-1m",
    "living-room",
    "office",
    "carriage",
];

/// A name, and what makes its settings.
type Preset = (&'static str, fn() -> SolveSettings);

const PRESETS: [Preset; 3] = [
    ("draft", SolveSettings::draft),
    ("normal", SolveSettings::normal),
    ("final", SolveSettings::finest),
];

fn main() {
    let arguments: Vec<String> = env::args().skip(1).collect();
    // Cargo names the flag where benches are to be measured, not where they are only to be tried.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let is_chosen = |names: &[&str], name: &'static str| {
        let named = |name: &&str| arguments.iter().any(|argument| argument == name);
        named(&name) || !names.iter().any(named)
    };
    let preset_names = PRESETS.map(|(name, _)| name);
    println!("| scene | preset | phase | processor | elapsed | rays | per ray |");
    println!("|---|---|---|---:|---:|---:|---:|");
    for scene in SCENES.into_iter().filter(|name| is_chosen(&SCENES, name)) {
        for (preset, settings) in PRESETS {
            if is_chosen(&preset_names, preset) {
                for row in budget(scene, settings()) {
                    println!("| {scene} | {preset} {row}");
                }
            }
        }
    }
}

/// Processor time of all threads so far; `None` where the system is not asked for it.
fn processor_time() -> Option<Duration> {
    #[cfg(unix)]
    {
        use nix::time::{ClockId, clock_gettime};

        let time = clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID).unwrap();
        Some(time.into())
    }
    #[cfg(not(unix))]
    None
}

/// What a part of a solve takes.
#[derive(Clone, Copy, Default)]
struct Cost {
    processor: Option<Duration>,
    elapsed: Duration,
    rays: u64,
}

impl Cost {
    fn add(&mut self, other: Self) {
        self.processor = other
            .processor
            .map(|processor| processor + self.processor.unwrap_or_default());
        self.elapsed += other.elapsed;
        self.rays += other.rays;
    }

    fn row(&self, name: &str) -> String {
        let seconds = |time: Duration| format!("{:.3} s", time.as_secs_f64());
        let per_ray = self
            .processor
            .filter(|_| self.rays > 0)
            .map(|processor| format!("{:.0} ns", 1e9 * processor.as_secs_f64() / self.rays as f64));
        format!(
            "| {name} | {} | {} | {} | {} |",
            self.processor.map(seconds).unwrap_or_default(),
            seconds(self.elapsed),
            self.rays,
            per_ray.unwrap_or_default()
        )
    }
}

/// Clocks at one moment, and the rays shot until then.
struct Moment {
    processor: Option<Duration>,
    wall: Instant,
    rays: u64,
}

impl Moment {
    fn now(rays: u64) -> Self {
        Self {
            processor: processor_time(),
            wall: Instant::now(),
            rays,
        }
    }

    fn until(&self, end: &Self) -> Cost {
        let processor = end.processor.zip(self.processor);
        Cost {
            processor: processor.map(|(end, begin)| end - begin),
            elapsed: end.wall.duration_since(self.wall),
            rays: end.rays - self.rays,
        }
    }
}

/// Rows of a solve by phase, over all its steps.
fn budget(scene: &str, settings: SolveSettings) -> Vec<String> {
    let begin = Moment::now(0);
    let scene = Arc::new(builtin(scene, &SceneOptions::default()).unwrap().unwrap());
    let made = Moment::now(0);
    let cancel = Cancel::default();
    let mut solver = Solver::new(scene, settings, None, &cancel).unwrap();
    let mut prepared = Moment::now(0);
    let mut is_first = true;
    let mut costs = [Cost::default(); Phase::ALL.len()];
    let end = loop {
        let mut begun: Vec<(Phase, Moment)> = Vec::new();
        let report = solver.step_in_phases(&cancel, &mut |phase, rays| {
            begun.push((phase, Moment::now(rays)));
        });
        let report = report.unwrap();
        if std::mem::take(&mut is_first) {
            prepared.rays = begun[0].1.rays;
        }
        let end = Moment::now(report.shadow_rays);
        let ends = begun.iter().skip(1).map(|(_, moment)| moment);
        for ((phase, moment), end) in begun.iter().zip(ends.chain([&end])) {
            costs[*phase as usize].add(moment.until(end));
        }
        // They are counted apart from those of the light.
        costs[Phase::Estimate as usize].rays = report.estimated_error.map_or(0, |error| error.rays);
        if report.is_final {
            break end;
        }
    };
    let mut rows = vec![
        begin.until(&made).row("scene"),
        made.until(&prepared).row("preparation"),
    ];
    let phases = Phase::ALL.iter().zip(costs);
    rows.extend(phases.map(|(phase, cost)| cost.row(&format!("{phase:?}"))));
    let mut all = made.until(&end);
    all.rays += costs[Phase::Estimate as usize].rays;
    rows.push(all.row("all"));
    rows
}
