//! A tree gives the light of its emitters, and samples them in proportion to it.

use glam::Vec3;

use super::*;
use crate::{
    geometry::Random,
    scene::{MaterialId, TriangleId},
    solver::direct::panel::panels,
};

/// Lamps that share no corners, each of up to two triangles.
#[derive(Default)]
struct Lamps(Vec<Emitter>);

impl Lamps {
    fn triangle(&mut self, corners: [Vec3; 3], radiosity: Vec4) {
        let number = 4 * self.0.len() as u32;
        self.face([0, 1, 2].map(|corner| number + corner), corners, radiosity);
    }

    fn face(&mut self, vertices: [u32; 3], corners: [Vec3; 3], radiosity: Vec4) {
        let [a, b, c] = corners;
        let area_vector = (b - a).cross(c - a) * 0.5;
        let number = self.0.len() as u32;
        self.0.push(Emitter {
            vertices,
            corners,
            normal: area_vector.normalize_or_zero(),
            area: area_vector.length(),
            triangle: TriangleId(number),
            material: MaterialId(0),
            radiosity,
            texture: Vec3::ONE,
        });
    }

    /// A square with this edge length about a centre, facing a direction.
    fn square(&mut self, centre: Vec3, normal: Vec3, edge: f32, radiosity: Vec4) {
        let (u, v) = normal.any_orthonormal_pair();
        let (u, v) = (u * (edge * 0.5), v * (edge * 0.5));
        let corner = |a: f32, b: f32| centre + u * a + v * b;
        let [a, b, c, d] =
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| corner(x, y));
        let first = 4 * self.0.len() as u32;
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let places = corners.map(|corner| [a, b, c, d][corner]);
            self.face(
                corners.map(|corner| first + corner as u32),
                places,
                radiosity,
            );
        }
    }

    fn tree(&self) -> LightTree {
        let (emitters, panels) = panels(&self.0);
        LightTree::new(&emitters, &panels)
    }
}

/// A ceiling of `n` by `n` lamps of a centimetre over 10 by 10 metres, red and blue ones in turn.
fn ceiling(n: usize) -> Lamps {
    let mut lamps = Lamps::default();
    for (x, y) in (0..n).flat_map(|x| (0..n).map(move |y| (x, y))) {
        let at = |x: usize| (x as f32 + 0.5) * 10.0 / n as f32;
        let radiosity = match (x + y) % 2 {
            0 => Vec4::new(5.0, 1.0, 0.5, 0.0),
            _ => Vec4::new(0.2, 1.0, 8.0, 0.0),
        };
        lamps.square(Vec3::new(at(x), at(y), 3.0), Vec3::NEG_Z, 0.01, radiosity);
    }
    lamps
}

/// Round lamps of 288 faces each about random points.
fn bulbs(count: usize) -> Lamps {
    let (mut lamps, mut random) = (Lamps::default(), Random::new(1, 0));
    for _ in 0..count {
        let mut uniform = || random.uniform();
        let centre = Vec3::new(10.0 * uniform(), 10.0 * uniform(), 2.0 + uniform());
        // Rings of quads, and two caps.
        let on = |ring: usize, step: usize| {
            let (height, turn) = (
                (ring as f32 * 0.1 * std::f32::consts::PI).sin_cos(),
                (step as f32 * std::f32::consts::PI / 8.0).sin_cos(),
            );
            centre + Vec3::new(height.0 * turn.1, height.0 * turn.0, height.1) * 0.05
        };
        for (ring, step) in (0..10).flat_map(|ring| (0..16).map(move |step| (ring, step))) {
            let [a, b, c, d] = [
                on(ring, step),
                on(ring + 1, step),
                on(ring + 1, step + 1),
                on(ring, step + 1),
            ];
            if ring < 9 {
                lamps.triangle([a, b, c], Vec4::splat(3.0));
            }
            if ring > 0 {
                lamps.triangle([a, c, d], Vec4::splat(3.0));
            }
        }
    }
    lamps
}

/// Sheets that emit on both sides.
fn sheets() -> Lamps {
    let mut lamps = Lamps::default();
    for (x, y) in (0..20).flat_map(|x| (0..20).map(move |y| (x, y))) {
        let centre = Vec3::new(x as f32 * 0.5, y as f32 * 0.5, 2.5);
        lamps.square(centre, Vec3::Z, 0.1, Vec4::new(1.0, 2.0, 3.0, 0.0));
        lamps.square(centre, Vec3::NEG_Z, 0.1, Vec4::new(3.0, 2.0, 1.0, 0.0));
    }
    lamps
}

/// Separate small faces of all colours and directions.
fn swarm(count: usize) -> Lamps {
    let (mut lamps, mut random) = (Lamps::default(), Random::new(2, 0));
    for _ in 0..count {
        let mut vector = || Vec3::from_array([(); 3].map(|()| random.uniform()));
        let centre = vector() * Vec3::new(10.0, 10.0, 3.0);
        let normal = (vector() - 0.5).normalize_or(Vec3::X);
        lamps.square(centre, normal, 0.02, vector().powf(4.0).extend(0.0));
    }
    lamps
}

/// Places on the surfaces of a room about the lamps, and inside it.
fn receivers(count: usize) -> Vec<Receiver> {
    let mut random = Random::new(3, 0);
    let mut receivers = Vec::new();
    for number in 0..count {
        let mut vector = || Vec3::from_array([(); 3].map(|()| random.uniform()));
        let (mut point, mut normal) = (vector(), vector() - 0.5);
        if number % 4 > 0 {
            let axis = number % 3;
            let side = if vector().x < 0.5 { 0.0 } else { 1.0 };
            point[axis] = side;
            normal = Vec3::ZERO;
            normal[axis] = 1.0 - 2.0 * side;
        }
        receivers.push(Receiver {
            point: point * Vec3::new(10.0, 10.0, 3.1),
            normal: normal.normalize_or(Vec3::Z),
            triangle: TriangleId(u32::MAX),
        });
    }
    receivers
}

#[test]
fn a_cut_gives_the_light_of_all_emitters_by_colour() {
    for (name, lamps) in [
        ("ceiling", ceiling(50)),
        ("bulbs", bulbs(20)),
        ("sheets", sheets()),
        ("swarm", swarm(3000)),
    ] {
        let tree = lamps.tree();
        let (mut cut, mut sizes, mut worst, mut squares) = (Vec::new(), 0, 0.0_f32, 0.0);
        let receivers = receivers(400);
        for receiver in &receivers {
            let found = tree.unoccluded(receiver, None, &mut cut);
            sizes += cut.len();
            let parts = tree.emitters.iter().map(|emitter| {
                let part = point_irradiance(receiver.point, receiver.normal, emitter.corners);
                (emitter.radiosity * part).as_dvec4()
            });
            let exact = parts.sum::<glam::DVec4>().as_vec4();
            let scale = exact.max_element().max(f32::MIN_POSITIVE);
            let error = (found - exact).abs().max_element() / scale;
            worst = worst.max(error);
            squares += error * error;
        }
        let (count, size) = (receivers.len(), sizes / receivers.len());
        let typical = (squares / count as f32).sqrt();
        println!(
            "{name}: {} emitters, cut {size}, {typical} {worst}",
            lamps.0.len()
        );
        assert!(typical < 4e-3 && worst < 6e-3, "{name}: {typical} {worst}");
    }
}

#[test]
fn cuts_hardly_grow_with_the_number_of_lamps() {
    let size = |n: usize| {
        let (tree, mut cut) = (ceiling(n).tree(), Vec::new());
        // The number of near lamps of a place beside them grows with their density.
        let receivers: Vec<Receiver> = receivers(200)
            .into_iter()
            .filter(|receiver| receiver.point.z < 2.0)
            .collect();
        let sizes = receivers.iter().map(|receiver| {
            tree.unoccluded(receiver, None, &mut cut);
            cut.len()
        });
        sizes.sum::<usize>() / receivers.len()
    };
    let (hundreds, thousands) = (size(20), size(80));
    println!("{hundreds} {thousands}");
    assert!(thousands < 4 * hundreds, "{hundreds} {thousands}");
}

#[test]
fn emitters_are_picked_by_the_light_that_they_give() {
    for lamps in [ceiling(30), bulbs(4), swarm(1000)] {
        let tree = lamps.tree();
        for receiver in receivers(20) {
            let mut cut = Vec::new();
            tree.unoccluded(&receiver, None, &mut cut);
            for part in cut.iter().step_by(7) {
                let Target::Node(node) = part.target else {
                    continue;
                };
                let node_of = &tree.nodes[node as usize];
                let light = |emitter: usize| tree.exact(emitter, &receiver).map_or(0.0, luminance);
                let all: f32 = (node_of.start..node_of.end)
                    .map(|at| light(at as usize))
                    .sum();
                if all <= 0.0 {
                    continue;
                }
                const COUNT: u32 = 2000;
                let places = (0..COUNT).map(|place| (place as f32 + 0.5) / COUNT as f32);
                let mean = places
                    .map(|place| {
                        let (emitter, by_area) = tree.pick(part.target, &receiver, place);
                        assert!((node_of.start..node_of.end).contains(&(emitter as u32)));
                        let of = &tree.emitters[emitter];
                        let power = luminance(of.radiosity) * of.area;
                        by_area * light(emitter) / power
                    })
                    .sum::<f32>()
                    / COUNT as f32;
                let found = mean * node_of.extent.power;
                // Light of children that count as giving none is lost.
                let slack = 0.02 * all + 1e-3 * cut[cut.len() - 1].until;
                assert!((found - all).abs() <= slack, "{found} {all}");
            }
        }
    }
}

#[test]
fn every_emitter_is_in_one_leaf_and_panels_are_whole() {
    for lamps in [Lamps::default(), ceiling(1), ceiling(7), bulbs(2), sheets()] {
        let tree = lamps.tree();
        assert_eq!(tree.emitters.len(), lamps.0.len());
        let mut next = 0;
        for (index, node) in tree.nodes.iter().enumerate() {
            assert!(node.start < node.end);
            if tree.is_leaf(index) {
                assert_eq!(node.start, next);
                next = node.end;
            } else {
                let [first, second] = tree.children(index).map(|child| &tree.nodes[child]);
                assert_eq!((first.start, first.end), (node.start, second.start));
                assert_eq!(second.end, node.end);
            }
        }
        assert_eq!(next as usize, lamps.0.len());
        let mut next = 0;
        for panel in &tree.panels {
            assert_eq!(panel.emitters.start, next);
            next = panel.emitters.end;
        }
    }
}

#[test]
fn thousands_of_emitters_in_one_place_make_no_deep_tree() {
    let mut lamps = Lamps::default();
    for _ in 0..5000 {
        lamps.square(Vec3::Z, Vec3::NEG_Z, 0.1, Vec4::ONE);
    }
    let tree = lamps.tree();
    let mut cut = Vec::new();
    let receiver = Receiver {
        point: Vec3::ZERO,
        normal: Vec3::Z,
        triangle: TriangleId(u32::MAX),
    };
    let found = luminance(tree.unoccluded(&receiver, None, &mut cut));
    let one = point_irradiance(Vec3::ZERO, Vec3::Z, lamps.0[0].corners)
        + point_irradiance(Vec3::ZERO, Vec3::Z, lamps.0[1].corners);
    assert!((found / (5000.0 * one) - 1.0).abs() < 1e-3);
}
