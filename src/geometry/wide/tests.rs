use std::f32::consts::TAU;

use glam::Vec3;

use super::*;
use crate::geometry::Random;

const ALL: Reach = Reach {
    from: 0.0,
    until: f32::MAX,
    except: [u32::MAX; 2],
};

fn in_cube(random: &mut Random) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|_| 2.0 * random.uniform() - 1.0))
}

/// What is on a ray, in order of number.
fn all_met(tree: &Tree, ray: &Ray, reach: Reach) -> Vec<(u32, u32, bool)> {
    let mut found = Vec::new();
    tree.each(ray, reach, |met| {
        found.push((met.triangle, met.distance.to_bits(), met.is_back));
        true
    });
    found.sort_unstable();
    found
}

/// The same without boxes.
fn all_met_by_trial(tree: &Tree, ray: &Ray, reach: Reach) -> Vec<(u32, u32, bool)> {
    let lanes = tree.leaves.iter().flat_map(|four| {
        let met = four.lanes_met(ray);
        let lanes = (0..4).filter(move |lane| met & 1 << lane != 0);
        lanes.map(move |lane| (four.number(lane), four.met(lane, ray)))
    });
    let mut found: Vec<(u32, u32, bool)> = lanes
        .filter(|&(number, (distance, _))| {
            !reach.except.contains(&number) && (reach.from..=reach.until).contains(&distance)
        })
        .map(|(number, (distance, is_back))| (number, distance.to_bits(), is_back))
        .collect();
    found.sort_unstable();
    found
}

/// The nearest on a ray, the lowest number of those that are as near.
fn nearest(tree: &Tree, ray: &Ray) -> Option<(f32, u32)> {
    let mut best: Option<(f32, u32)> = None;
    tree.nearest_first(ray, ALL, |met| {
        let found = (met.distance, met.triangle);
        if best.is_none_or(|best| found < best) {
            best = Some(found);
        }
        best.map_or(f32::MAX, |best| best.0)
    });
    best
}

/// Triangles of all sizes and shapes: scattered, flat in a plane across an axis, needles, points, twins.
fn soup(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    for index in 0..count {
        let middle = in_cube(random) * 50.0;
        let size = 50.0 * 10f32.powf(-5.0 * random.uniform());
        let mut corners = [0, 1, 2].map(|_| middle + in_cube(random) * size);
        match index % 8 {
            0 => {
                let axis = random.below(3) as usize;
                let at = corners[0][axis].round();
                corners = corners.map(|mut corner| {
                    corner[axis] = at;
                    corner
                });
            }
            1 => corners[2] = corners[0].lerp(corners[1], 0.5) + in_cube(random) * size * 1e-6,
            2 if index > 100 => corners = triangles[index - 100],
            3 if index > 100 => corners[0] = triangles[index - 100][1],
            4 => corners = corners.map(Vec3::round),
            5 if index % 40 == 5 => corners = [corners[0]; 3],
            _ => {}
        }
        triangles.push(corners);
    }
    triangles
}

/// Rays from everywhere: at random, along axes, through corners and edges, within planes.
fn hostile_ray(random: &mut Random, triangles: &[[Vec3; 3]], index: usize) -> Ray {
    let [a, b, c] = triangles[random.below(triangles.len() as u32) as usize];
    let origin = match index % 3 {
        0 => in_cube(random) * 60.0,
        1 => in_cube(random) * 3000.0,
        _ => triangles[random.below(triangles.len() as u32) as usize][0],
    };
    let target = match index / 3 % 4 {
        0 => a,
        1 => a.lerp(b, random.uniform()),
        2 => a.lerp(b, random.uniform()).lerp(c, random.uniform()),
        _ => in_cube(random) * 50.0,
    };
    let along_axis = |random: &mut Random| {
        let mut direction = Vec3::ZERO;
        direction[random.below(3) as usize] = 1.0;
        direction * if random.below(2) == 0 { 1.0 } else { -1.0 }
    };
    match index / 12 % 4 {
        // Along an axis through a corner, with zeros of either sign.
        0 => {
            let direction = along_axis(random);
            Ray::new(a - direction * 70.0 * random.uniform(), direction)
        }
        // Within the plane of the triangle, along an edge.
        1 => Ray::new(a - (b - a) * 3.0, (b - a).normalize_or(Vec3::X)),
        2 => {
            let mut direction = (target - origin).normalize_or(Vec3::Y);
            direction[random.below(3) as usize] = if random.below(2) == 0 { 0.0 } else { -0.0 };
            Ray::new(origin, direction.normalize_or(Vec3::Z))
        }
        _ => Ray::new(origin, (target - origin).normalize_or(Vec3::X)),
    }
}

#[test]
fn the_tree_finds_what_a_test_of_all_triangles_finds() {
    for count in [1, 2, 4, 5, 9, 100, 1000] {
        let mut random = Random::new(1, count as u64);
        let triangles = soup(&mut random, count);
        let tree = Tree::new(&triangles);
        let mut met = 0;
        for index in 0..4000 {
            let ray = hostile_ray(&mut random, &triangles, index);
            let reach = match index % 5 {
                0 => Reach {
                    from: 1e-4,
                    until: 100.0 * random.uniform(),
                    except: [random.below(count as u32), random.below(count as u32)],
                },
                _ => ALL,
            };
            let found = all_met(&tree, &ray, reach);
            let wanted = all_met_by_trial(&tree, &ray, reach);
            let context = || format!("{count} {index} {} {}", ray.origin, ray.direction);
            assert_eq!(found, wanted, "{}", context());
            met += found.len();
            let by_trial = all_met_by_trial(&tree, &ray, ALL);
            let first = by_trial
                .iter()
                .map(|&(number, distance, _)| (f32::from_bits(distance), number));
            let first = first.min_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(nearest(&tree, &ray), first, "{}", context());
        }
        assert!(met > 500, "{count}: {met}");
    }
}

#[test]
fn every_triangle_is_in_the_tree_once() {
    let mut random = Random::new(2, 0);
    for count in [0, 1, 3, 8, 33, 5000] {
        let triangles = soup(&mut random, count);
        let tree = Tree::new(&triangles);
        let numbers = tree
            .leaves
            .iter()
            .flat_map(|four| (0..4).map(|lane| four.number(lane)));
        let mut numbers: Vec<u32> = numbers.filter(|&number| number != u32::MAX).collect();
        numbers.sort_unstable();
        assert!(numbers.into_iter().eq(0..count as u32), "{count}");
    }
}

/// A sphere of triangles about a point, its corners moved at random by a part of the radius.
fn ball(random: &mut Random, middle: Vec3, radius: f32, moved: f32) -> Vec<[Vec3; 3]> {
    const RINGS: usize = 24;
    let mut corners = Vec::new();
    for ring in 0..=RINGS {
        let (height, width) = (std::f32::consts::PI * ring as f32 / RINGS as f32).sin_cos();
        for place in 0..RINGS {
            let (sine, cosine) = (TAU * place as f32 / RINGS as f32).sin_cos();
            let unit = Vec3::new(height * cosine, height * sine, width);
            corners.push(middle + radius * (unit + in_cube(random) * moved));
        }
    }
    // One corner at each pole.
    let corner = |ring: usize, place: usize| match ring {
        0 => corners[0],
        RINGS => corners[RINGS * RINGS],
        _ => corners[ring * RINGS + place % RINGS],
    };
    let mut triangles = Vec::new();
    for (ring, place) in (0..RINGS).flat_map(|ring| (0..RINGS).map(move |place| (ring, place))) {
        let [a, b] = [place, place + 1].map(|place| corner(ring, place));
        let [c, d] = [place, place + 1].map(|place| corner(ring + 1, place));
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    triangles
}

#[test]
fn no_ray_leaves_a_closed_mesh() {
    for (seed, middle, radius) in [
        (0, Vec3::ZERO, 50.0),
        (1, Vec3::new(40.0, -30.0, 20.0), 1.0),
        (2, Vec3::new(49.0, 3.0, -48.0), 0.01),
        (3, Vec3::ZERO, 1e-5),
        (4, Vec3::new(3000.0, 0.0, 7.0), 400.0),
    ] {
        let mut random = Random::new(3, seed);
        let triangles = ball(&mut random, middle, radius, 0.02);
        let tree = Tree::new(&triangles);
        let inside = |random: &mut Random| middle + in_cube(random) * 0.3 * radius;
        for index in 0..20_000 {
            let origin = if index % 4 == 0 {
                middle
            } else {
                inside(&mut random)
            };
            let [a, b, c] = triangles[random.below(triangles.len() as u32) as usize];
            let target = match index % 3 {
                0 => a,
                1 => a.lerp(b, random.uniform()),
                _ => a.lerp(c, 0.5),
            };
            let mut direction = (target - origin).normalize_or(Vec3::X);
            if index % 7 == 0 {
                direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][index % 3] * Vec3::new(1.0, 1.0, -1.0);
            }
            let is_open = tree.each(&Ray::new(origin, direction), ALL, |_| false);
            assert!(!is_open, "{seed} {index}: {origin} {direction}");
        }
    }
}

#[test]
fn distances_are_exact_on_huge_triangles() {
    let far = 1e5;
    let corners = [
        Vec3::new(-far, 0.1, -far),
        Vec3::new(0.3 * far, 0.1, 2.0 * far),
        Vec3::new(far, 0.1, -far),
    ];
    let tree = Tree::new(&[corners]);
    let mut random = Random::new(4, 0);
    for _ in 0..1000 {
        let origin = in_cube(&mut random) * 50.0;
        let mut direction = in_cube(&mut random).normalize_or(Vec3::Y);
        direction.y = (0.1 - origin.y).signum() * direction.y.abs().max(0.01);
        let direction = direction.normalize_or(Vec3::Y);
        let found = nearest(&tree, &Ray::new(origin, direction)).unwrap().0;
        let wanted = (f64::from(0.1f32) - f64::from(origin.y)) / f64::from(direction.y);
        let error = (f64::from(found) - wanted).abs() / wanted;
        assert!(error < 1e-7, "{origin} {direction}: {found} {wanted}");
    }
}

#[test]
fn a_deep_tree_needs_no_deep_stack() {
    // Each triangle lies within the box of the next, which is a third larger; rays along the diagonal are in all boxes.
    let triangles: Vec<[Vec3; 3]> = (0..300)
        .map(|index| {
            let size = 1e-4 * 1.05f32.powi(index);
            [Vec3::X, Vec3::Y, Vec3::Z].map(|corner| corner * size)
        })
        .collect();
    let tree = Tree::new(&triangles);
    let ray = Ray::new(Vec3::splat(-1.0), Vec3::ONE.normalize_or_zero());
    assert_eq!(all_met(&tree, &ray, ALL).len(), triangles.len());
    assert_eq!(nearest(&tree, &ray).unwrap().1, 0);
}

#[test]
fn the_stack_gives_back_what_it_holds_in_order() {
    let entry = |near: usize| Entry::new(near as f32, Child::new_node(near));
    let mut stack = Stack::new();
    for near in 0..100 {
        stack.push(entry(near));
    }
    for near in (0..100).rev() {
        assert_eq!(stack.pop().unwrap().child.node(), near);
    }
    assert!(stack.pop().is_none());
    for near in [7, 3, 9, 5] {
        stack.push(entry(near));
    }
    stack.sort_from(1);
    for near in [3, 5, 9, 7] {
        assert_eq!(stack.pop().unwrap().near, near as f32);
    }
}

#[test]
fn rays_that_are_not_numbers_meet_nothing() {
    let mut random = Random::new(5, 0);
    let tree = Tree::new(&soup(&mut random, 200));
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut vector = Vec3::new(0.1, 0.2, 0.3);
            vector[axis] = wrong;
            for (origin, direction) in [(vector, Vec3::X), (Vec3::ZERO, vector)] {
                assert_eq!(nearest(&tree, &Ray::new(origin, direction)), None);
            }
        }
    }
    assert_eq!(nearest(&tree, &Ray::new(Vec3::ZERO, Vec3::ZERO)), None);
}
