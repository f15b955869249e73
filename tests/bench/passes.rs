//! The time of passes over a whole scene: reading, building trees, sweeping over links.

#![expect(
    clippy::unwrap_used,
    reason = "a bench that cannot begin fails by panicking"
)]

use std::{hint::black_box, path::Path, sync::Arc, time::Duration};

use criterion::{BenchmarkGroup, Criterion, Throughput, measurement::WallTime};
use vecrad::{
    geometry::RayTree,
    hierarchy::{Hierarchy, PatchTree},
    scene::{Scene, SceneOptions, builtin::builtin, read_scene, write_obj},
    solver::{Cancel, SolveSettings, Solver},
};

/// Runs of each measurement: as few as Criterion takes, since each is long.
const RUNS: usize = 10;

/// Angle at which edges are creases, degrees; any will do here.
const CREASE: f32 = 30.0;

fn main() {
    let mut criterion = Criterion::default()
        .sample_size(RUNS)
        .warm_up_time(Duration::from_secs(1))
        .configure_from_args();
    let scene = room("room-42879");
    reading(&mut criterion, &scene);
    building(&mut criterion, &scene);
    sweeping(&mut criterion);
    criterion.final_summary();
}

fn room(name: &str) -> Arc<Scene> {
    Arc::new(builtin(name, &SceneOptions::default()).unwrap().unwrap())
}

/// Bytes per second of an OBJ file, from a disk in memory where there is one.
fn reading(criterion: &mut Criterion, scene: &Scene) {
    let folder = tempfile::tempdir_in(Path::new("/dev/shm"))
        .or_else(|_| tempfile::tempdir())
        .unwrap();
    let path = folder.path().join("room.obj");
    write_obj(scene, &path).unwrap();
    let mut group = criterion.benchmark_group("reading");
    group.throughput(Throughput::Bytes(path.metadata().unwrap().len()));
    group.bench_function("OBJ", |bencher| {
        bencher.iter(|| black_box(read_scene(&path, &SceneOptions::default()).unwrap()));
    });
    group.finish();
}

/// Triangles per second of each tree.
fn building(criterion: &mut Criterion, scene: &Scene) {
    let mut group = criterion.benchmark_group("building");
    group.throughput(Throughput::Elements(scene.triangles.len() as u64));
    group.bench_function("tree of patches", |bencher| {
        bencher.iter(|| black_box(PatchTree::build(scene, None, &|| false)));
    });
    group.bench_function("hierarchy", |bencher| {
        bencher.iter(|| black_box(Hierarchy::new(scene, CREASE)));
    });
    group.bench_function("tree for rays", |bencher| {
        bencher.iter(|| black_box(RayTree::new(scene)));
    });
    group.finish();
}

/// Links per second where light is solved anew on those that there are, and where leaves gather for their vertices.
fn sweeping(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sweeping");
    group.sample_size(20);
    for name in ["room-1022", "cornell", "room-42879"] {
        let cancel = Cancel::default();
        let mut solver = Solver::new(room(name), SolveSettings::draft(), None, &cancel).unwrap();
        while !solver.step(&cancel).unwrap().is_final {}
        sweeps(&mut group, name, &mut solver);
        group.throughput(Throughput::Elements(solver.links().len() as u64));
        group.bench_function(format!("gather for leaves/{name}"), |bencher| {
            bencher.iter(|| black_box(solver.finish_relighting(&cancel).unwrap()));
        });
    }
    group.finish();
}

/// The first material is painted darker and as it was in turn; each time the light converges anew. Every sweep reads
/// every link once.
fn sweeps(group: &mut BenchmarkGroup<'_, WallTime>, name: &str, solver: &mut Solver) {
    let cancel = Cancel::default();
    let usual = solver.appearances().to_vec();
    let mut dark = usual.clone();
    dark[0].reflectance *= 0.5;
    let sweeps: u32 = [&dark, &usual]
        .iter()
        .map(|requested| solver.relight(requested, &cancel).unwrap().report.sweeps)
        .sum();
    group.throughput(Throughput::Elements(
        solver.links().len() as u64 * u64::from(sweeps),
    ));
    group.bench_function(format!("sweep over links/{name}"), |bencher| {
        bencher.iter(|| {
            for requested in [&dark, &usual] {
                black_box(solver.relight(requested, &cancel).unwrap());
            }
        });
    });
    group.throughput(Throughput::Elements(1));
    let mut dimmed = usual.clone();
    for appearance in &mut dimmed {
        appearance.emission *= 0.5;
    }
    let mut changes = [&dimmed, &usual].into_iter().cycle();
    group.bench_function(format!("dim all lights/{name}"), |bencher| {
        bencher.iter(|| {
            let requested = changes.next().unwrap_or(&usual);
            black_box(solver.relight(requested, &cancel).unwrap());
        });
    });
}
