use std::sync::Arc;

use super::*;
use crate::{
    geometry::{Random, cosine_direction},
    scene::{SkyPicture, SkySample, Texture, UpAxis},
};

fn random_normal(random: &mut Random) -> Vec3 {
    let unit = Vec3::from_array([(); 3].map(|()| 2.0 * random.uniform() - 1.0));
    unit.try_normalize().unwrap_or(Vec3::Y)
}

/// A picture that is bright in a few pixels, and varies elsewhere.
fn picture() -> Sky {
    let (width, height) = (64, 32);
    let pixel = |index: u32| match index {
        700 | 701 => Vec3::new(300.0, 200.0, 100.0),
        _ => Vec3::new(index as f32 / 2048.0, 0.5, (index % 64) as f32 / 64.0),
    };
    let texture = Texture {
        name: String::new(),
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
        ..Texture::default()
    };
    Sky::Picture(SkyPicture::new(
        Arc::new(texture),
        Vec3::ONE,
        UpAxis::Y,
        0.0,
    ))
}

#[test]
fn a_uniform_sky_gives_every_surface_the_same_irradiance() {
    let sky = Sky::Uniform(Vec3::new(1.0, 2.0, 0.0));
    let tree = SkyTree::new(&sky, None).unwrap();
    let (mut random, mut cut) = (Random::new(1, 0), Vec::new());
    for normal in Vec3::AXES
        .into_iter()
        .chain((0..500).map(|_| random_normal(&mut random)))
    {
        let found = tree.unoccluded(normal, &mut cut) / PI;
        let error = (found - Vec4::new(1.0, 2.0, 0.0, 0.0)).abs().max_element();
        assert!(error < 1e-4, "{found} for {normal}");
    }
    let brightest = tree.brightest() / PI;
    assert!((brightest.y - 2.0).abs() < 1e-4);
    assert!((tree.mean_irradiance().x / PI - 1.0).abs() < 1e-4);
}

#[test]
fn a_picture_gives_the_irradiance_of_its_radiance() {
    let sky = picture();
    let tree = SkyTree::new(&sky, None).unwrap();
    let (mut random, mut cut) = (Random::new(2, 0), Vec::new());
    let all = sky_samples(&sky);
    for _ in 0..20 {
        let normal = random_normal(&mut random);
        let expected: Vec3 = all
            .iter()
            .map(|s| s.radiance * s.solid_angle * s.direction.dot(normal).max(0.0))
            .sum();
        let found = tree.unoccluded(normal, &mut cut);
        let error = (found.truncate() - expected).abs().max_element();
        assert!(
            error < 4e-3 * expected.max_element(),
            "{found} for {expected}"
        );
    }
}

fn sky_samples(sky: &Sky) -> Vec<SkySample> {
    match sky {
        Sky::Picture(picture) => picture.samples(LEAST_SAMPLES),
        _ => Vec::new(),
    }
}

#[test]
fn rays_are_distributed_by_radiance_and_have_even_weights() {
    let tree = SkyTree::new(&picture(), None).unwrap();
    let (mut random, mut cut) = (Random::new(3, 0), Vec::new());
    for _ in 0..10 {
        let normal = random_normal(&mut random);
        let whole = luminance(tree.unoccluded(normal, &mut cut));
        let total = cut.last().unwrap().until;
        assert!((total / whole - 1.0).abs() < 1e-4);
        // The mean of the weights is 1, and so is that over a part of the sky relative to its share.
        let axis = random_normal(&mut random);
        let (mut sum, mut squares, mut part, count) = (0.0, 0.0, 0.0, 4000);
        for ray in 0..count {
            let at = (ray as f32 + random.uniform()) / count as f32 * total;
            let (chosen, share, place) = Arriving::choose(&cut, at);
            let Target::Node(node) = cut[chosen].target else {
                unreachable!()
            };
            let square = random.uniform_2d();
            let Some(ray) = tree.aim(node as usize, share, normal, place, square) else {
                continue;
            };
            assert!(ray.direction.dot(normal) >= 0.0);
            sum += ray.weight;
            squares += ray.weight * ray.weight;
            part += if ray.direction.dot(axis) > 0.0 {
                ray.weight
            } else {
                0.0
            };
        }
        let (mean, squares) = (sum / count as f32, squares / count as f32);
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        assert!(squares < 1.2, "{squares}");
        let expected: f32 = sky_samples(&picture())
            .iter()
            .filter(|s| s.direction.dot(axis) > 0.0)
            .map(|s| {
                let radiance = luminance(s.radiance.extend(0.0));
                radiance * s.solid_angle * s.direction.dot(normal).max(0.0)
            })
            .sum();
        let (found, expected) = (part / count as f32, expected / whole);
        assert!((found - expected).abs() < 0.03, "{found} for {expected}");
    }
}

#[test]
fn a_table_reads_a_uniform_sky_as_a_cluster_around_the_scene() {
    let sky = Sky::Uniform(Vec3::ONE);
    let (mut random, mut cut) = (Random::new(4, 0), Vec::new());
    for _ in 0..50 {
        let normal = cosine_direction(Vec3::Y, random.uniform_2d());
        let read = |reading| {
            let tree = SkyTree::new(&sky, Some(reading)).unwrap();
            tree.unoccluded(normal, &mut Vec::new()).x / PI
        };
        // The faces of the paper add up on slanted surfaces.
        let faces = normal.abs().element_sum();
        assert!((read(Reading::SixFace) - faces).abs() < 7e-3);
        assert!((read(Reading::Bounded) - 1.0).abs() < 7e-3);
        let exact = SkyTree::new(&sky, None).unwrap();
        assert!((exact.unoccluded(normal, &mut cut).x / PI - 1.0).abs() < 1e-4);
    }
}

#[test]
fn each_leaf_holds_its_directions_and_has_three_neighbours() {
    for sky in [Sky::Uniform(Vec3::ONE), picture()] {
        let tree = SkyTree::new(&sky, None).unwrap();
        for (index, node) in tree.nodes.iter().enumerate() {
            if node.first_child != 0 {
                continue;
            }
            let leaf = index as u32;
            let [a, b, c] = node.path;
            assert_eq!(tree.leaf_towards((a + b + c) * 7.0), leaf);
            assert_eq!(tree.leaf_towards(a * 0.8 + b * 0.1 + c * 0.1), leaf);
            let around = tree.neighbours(leaf);
            assert!(!around.contains(&leaf));
            assert!(around[0] != around[1] && around[1] != around[2] && around[2] != around[0]);
        }
    }
}
