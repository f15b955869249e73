//! The time of single calls of a solve: form factors, shadow rays, directional tables, the oracle.
//!
//! Each measurement goes over many cases in turn, so that branches are as hard to foresee as they are in a solve.

#![expect(
    clippy::unwrap_used,
    reason = "a bench that cannot begin fails by panicking"
)]

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput};
use glam::{Vec3, Vec4};
use vecrad::{
    geometry::{
        Random, RayTree, irradiance_vector, outline_irradiance, point_irradiance, triangle_point,
    },
    hierarchy::{Hierarchy, NodeId, Reading, Tables},
    scene::{Scene, SceneOptions, TriangleId, builtin::builtin},
    transport::{Estimate, Judge, Kernel, PairSampler, PatchSums},
};

/// Cases of each measurement.
const CASES: usize = 1024;

/// Angle at which edges are creases, degrees; any will do here.
const CREASE: f32 = 30.0;

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    polygons(&mut criterion);
    for name in ["cornell", "room-42879", "gallery", "soup", "room-1m"] {
        rays(&mut criterion, name, &scene(name));
    }
    pairs(&mut criterion, &scene("room-42879"));
    criterion.final_summary();
}

fn scene(name: &str) -> Scene {
    builtin(name, &SceneOptions::default()).unwrap().unwrap()
}

fn point_in_ball(random: &mut Random) -> Vec3 {
    loop {
        let point = Vec3::from_array([0, 1, 2].map(|_| 2.0 * random.uniform() - 1.0));
        if (1e-4..=1.0).contains(&point.length_squared()) {
            return point;
        }
    }
}

/// A unit normal and a triangle as it is seen from the origin, front towards it.
type View = (Vec3, [Vec3; 3]);

/// A triangle of about unit size at a random place, this many units away.
fn view(random: &mut Random, distance: f32) -> View {
    let middle = point_in_ball(random).normalize_or(Vec3::X) * distance;
    let [a, b, c] = [0, 1, 2].map(|_| middle + point_in_ball(random));
    let looks_away = (b - a).cross(c - a).dot(a) > 0.0;
    let normal = point_in_ball(random).normalize_or(Vec3::Z);
    (normal, if looks_away { [a, c, b] } else { [a, b, c] })
}

/// Views of which so many corners lie above the horizon.
fn views(distance: f32, above: std::ops::RangeInclusive<usize>) -> Vec<View> {
    let mut random = Random::new(1, 0);
    let all = std::iter::repeat_with(|| view(&mut random, distance));
    let wanted = all.filter(|(normal, corners)| {
        let corners = corners.iter();
        above.contains(&corners.filter(|corner| corner.dot(*normal) > 0.0).count())
    });
    wanted.take(CASES).collect()
}

fn polygons(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("form factor");
    group.throughput(Throughput::Elements(CASES as u64));
    for (name, views) in [
        ("near", views(2.0, 3..=3)),
        ("touching", views(0.5, 3..=3)),
        ("far", views(1e3, 3..=3)),
        ("across the horizon", views(1.5, 1..=2)),
        ("below the horizon", views(2.0, 0..=0)),
    ] {
        group.bench_function(BenchmarkId::new("point", name), |bencher| {
            bencher.iter(|| -> f32 {
                let views = black_box(&views).iter();
                views
                    .map(|&(normal, corners)| point_irradiance(Vec3::ZERO, normal, corners))
                    .sum()
            });
        });
    }
    let near = views(2.0, 3..=3);
    group.bench_function(BenchmarkId::new("vector", "near"), |bencher| {
        bencher.iter(|| -> Vec3 {
            let views = black_box(&near).iter();
            views
                .map(|&(_, corners)| irradiance_vector(Vec3::ZERO, corners))
                .sum()
        });
    });
    let corner = |at: usize| {
        let (sine, cosine) = (at as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
        Vec3::new(cosine, sine, 2.0)
    };
    let octagon: Vec<[Vec3; 2]> = (0..8).map(|at| [corner(at + 1), corner(at)]).collect();
    let mut random = Random::new(2, 0);
    let points: Vec<Vec3> = (0..CASES).map(|_| point_in_ball(&mut random)).collect();
    group.bench_function(BenchmarkId::new("outline", "octagon"), |bencher| {
        bencher.iter(|| -> f32 {
            let points = black_box(&points).iter();
            points
                .map(|&point| outline_irradiance(point, Vec3::Z, &octagon))
                .sum()
        });
    });
    group.finish();
}

/// Between points of triangles that are each as likely, however small: what blocks a segment at all, and what a ray from
/// its start meets first.
fn rays(criterion: &mut Criterion, name: &str, scene: &Scene) {
    let rays = RayTree::new(scene);
    let mut random = Random::new(3, 0);
    let mut end = || {
        let triangle = TriangleId(random.below(scene.triangles.len() as u32));
        let [a, b, c] = scene.corners(triangle);
        let at = triangle_point(random.uniform_2d());
        (a * at.x + b * at.y + c * at.z, triangle)
    };
    let segments: Vec<_> = (0..CASES).map(|_| [end(), end()]).collect();
    let mut group = criterion.benchmark_group("rays");
    group.throughput(Throughput::Elements(CASES as u64));
    group.bench_function(BenchmarkId::new("occluded", name), |bencher| {
        bencher.iter(|| {
            let segments = black_box(&segments).iter();
            let blocked = segments.filter(|[(from, first), (to, second)]| {
                rays.occluded(*from, *to, [Some(*first), Some(*second)])
            });
            blocked.count()
        });
    });
    group.bench_function(BenchmarkId::new("closest", name), |bencher| {
        bencher.iter(|| -> f32 {
            let segments = black_box(&segments).iter();
            let hits = segments.filter_map(|[(from, first), (to, _)]| {
                rays.closest(*from, (to - from).normalize_or(Vec3::X), Some(*first))
            });
            hits.map(|hit| hit.distance).sum()
        });
    });
    group.finish();
}

/// Tables, links and the oracle on random pairs of nodes, clusters and elements alike.
fn pairs(criterion: &mut Criterion, scene: &Scene) {
    let hierarchy = Hierarchy::new(scene, CREASE);
    let tables = Tables::new(&hierarchy, |element| {
        let reflectance = hierarchy.patch_of(element).reflectance;
        reflectance.extend(1.0)
    });
    let kernel = Kernel {
        hierarchy: &hierarchy,
        tables: &tables,
        reading: Some(Reading::Bounded),
        image: None,
    };
    let mut random = Random::new(4, 0);
    let mut node = |count: usize| NodeId(random.below(count as u32));
    let (all, clusters) = (hierarchy.node_count(), hierarchy.clusters.len());
    let pairs: Vec<[NodeId; 2]> = (0..CASES).map(|_| [node(all), node(all)]).collect();
    let seen: Vec<(NodeId, Vec3)> = (0..CASES)
        .map(|_| (node(clusters), hierarchy.centroid(node(all))))
        .collect();
    tables_and_links(criterion, kernel, &seen);
    let (areas, powers, rays) = (
        PatchSums::of_area(&hierarchy, &tables),
        PatchSums::of_power(&hierarchy, &tables),
        RayTree::new(scene),
    );
    let sampler = PairSampler {
        hierarchy: &hierarchy,
        tables: &tables,
        areas: &areas,
        powers: &powers,
        rays: &rays,
        image: None,
    };
    oracle_and_visibility(criterion, kernel, sampler, &pairs);
}

fn tables_and_links(criterion: &mut Criterion, kernel: Kernel<'_>, seen: &[(NodeId, Vec3)]) {
    let mut group = criterion.benchmark_group("tables");
    group.throughput(Throughput::Elements(CASES as u64));
    for reading in [Reading::Bounded, Reading::SixFace, Reading::Single] {
        let name = format!("{reading:?}");
        group.bench_function(BenchmarkId::new("project", name), |bencher| {
            bencher.iter(|| -> Vec4 {
                let seen = black_box(seen).iter();
                seen.map(|&(node, point)| {
                    let unit = point.normalize_or(Vec3::X);
                    kernel.tables.clusters[node.index()].project(unit, reading)
                })
                .sum()
            });
        });
    }
    group.bench_function("vector irradiance", |bencher| {
        bencher.iter(|| -> Vec4 {
            let seen = black_box(seen).iter();
            seen.map(|&(source, point)| kernel.vector_irradiance(source, point).strength)
                .sum()
        });
    });
    group.finish();
}

fn oracle_and_visibility(
    criterion: &mut Criterion,
    kernel: Kernel<'_>,
    sampler: PairSampler<'_>,
    pairs: &[[NodeId; 2]],
) {
    let mut group = criterion.benchmark_group("oracle");
    group.throughput(Throughput::Elements(CASES as u64));
    for (name, estimate) in [
        ("interval", Estimate::Interval),
        ("samples", Estimate::Samples(8)),
    ] {
        let judge = Judge {
            kernel,
            estimate,
            ambient: 0.1,
            sampler,
        };
        group.bench_function(name, |bencher| {
            let mut random = Random::new(5, 0);
            bencher.iter(|| {
                for &[source, receiver] in black_box(pairs) {
                    black_box(judge.judge(source, receiver, &mut random));
                }
            });
        });
    }
    group.bench_function("visibility by two rays", |bencher| {
        let mut random = Random::new(6, 0);
        bencher.iter(|| {
            for &[source, receiver] in black_box(pairs) {
                black_box(sampler.visibility(source, receiver, 2, &mut random));
            }
        });
    });
    group.finish();
}
