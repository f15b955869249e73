//! Inspections agree with the displayed light.

use std::sync::Arc;

use super::*;
use crate::{
    geometry::{Random, cosine_direction},
    scene::{SceneOptions, Sides, builtin},
    solver::{Cancel, SolveSettings, Solver},
};

fn solved(name: &str, settings: SolveSettings) -> Solver {
    let options = SceneOptions {
        sides: Sides::One,
        ..SceneOptions::default()
    };
    let scene = builtin::builtin(name, &options)
        .expect("the scene is valid")
        .expect("the scene is known");
    let mut solver =
        Solver::new(Arc::new(scene), settings, None, &Cancel::default()).expect("nobody cancels");
    while !solver
        .step(&Cancel::default())
        .expect("nobody cancels")
        .is_final
    {}
    solver
}

fn inspect_leaf(solver: &Solver, leaf: usize) -> Inspection {
    let element = &solver.hierarchy.mesh.elements[leaf];
    // The query names the patch: the leaf must be found by the point.
    let node = NodeId(solver.hierarchy.clusters.len() as u32 + element.patch);
    let point = element.centroid;
    let inspection = solver.inspect(&Subject::Element { node, point });
    inspection.expect("the patch exists")
}

#[test]
fn links_of_a_leaf_add_to_the_displayed_light() {
    let solver = solved("cornell", SolveSettings::draft());
    assert!(solver.leaves.len() > 100);
    for light in solver.leaves.iter().step_by(7) {
        let inspection = inspect_leaf(&solver, light.element as usize);
        let expected = light.centre.color();
        // Sums of some hundred terms in another order.
        let slack = 1e-3 * expected.max_element() + 1e-9;
        assert!(
            (inspection.linked - expected).abs().max_element() <= slack,
            "element {}: {} instead of {expected}",
            light.element,
            inspection.linked
        );
        assert!((inspection.row_sum - light.centre.form_factor_sum()).abs() <= 1e-3);
        let ordered = inspection
            .links
            .is_sorted_by(|a, b| strength(a) >= strength(b));
        assert!(ordered, "the strongest come first");
        let errors: f32 = inspection.links.iter().map(|link| link.error).sum();
        let bound = inspection.error_bound;
        assert!(0.0 < bound && bound <= errors * 1.001, "{bound}, {errors}");
    }
}

/// Irradiance (luminance) of a leaf from what surfaces send over links, by rays, and its standard error.
fn gathered_by_rays(solver: &Solver, leaf: usize) -> (f32, f32) {
    let hierarchy = &solver.hierarchy;
    let (patch, from) = (hierarchy.patch_of(leaf), &hierarchy.mesh.elements[leaf]);
    let mut random = Random::new(17, leaf as u64);
    let mut one = || {
        let direction = cosine_direction(patch.normal, random.uniform_2d());
        let Some(hit) = (solver.rays).closest(from.centroid, direction, Some(patch.triangle))
        else {
            return 0.0;
        };
        let point = from.centroid + direction * hit.distance;
        let met = hierarchy.patch_met(hit.triangle, direction);
        let leaf = met.and_then(|patch| hierarchy.mesh.leaf_at(patch, point));
        leaf.map_or(0.0, |leaf| luminance(solver.linked.power.elements[leaf]))
    };
    let found: Vec<f32> = (0..2048).map(|_| one()).collect();
    let count = found.len() as f32;
    let mean = found.iter().sum::<f32>() / count;
    let squares = found
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f32>();
    (mean, (squares / count / count).sqrt())
}

#[test]
fn the_bound_of_a_leaf_holds_what_rays_find_and_is_tight() {
    for name in ["cornell", "room-1022"] {
        let solver = solved(name, SolveSettings::draft());
        let (mut held, mut count, mut widths) = (0, 0, Vec::new());
        for light in solver.leaves.iter().step_by(solver.leaves.len() / 100) {
            let inspection = inspect_leaf(&solver, light.element as usize);
            let (truth, noise) = gathered_by_rays(&solver, light.element as usize);
            let shown = luminance(light.centre);
            count += 1;
            held += usize::from((shown - truth).abs() <= inspection.error_bound + 3.0 * noise);
            widths.push(inspection.error_bound / shown.max(f32::MIN_POSITIVE));
        }
        assert!(held * 100 >= count * 95, "{name}: {held} of {count}");
        widths.sort_by(f32::total_cmp);
        let median = widths[widths.len() / 2];
        assert!(median < 0.5, "{name}: the bound is {median} of the light");
    }
}

#[test]
fn a_path_leads_from_the_root_through_nested_boxes() {
    let solver = solved("cornell", SolveSettings::draft());
    let base = solver.hierarchy.clusters.len();
    let leaf = solver.leaves[solver.leaves.len() / 2].element as usize;
    let inspection = inspect_leaf(&solver, leaf);
    let path = &inspection.path;
    assert_eq!(path[0].place.node, Hierarchy::ROOT);
    assert_eq!(path[path.len() - 1].place.node.index(), base + leaf);
    // Corners of divided elements are midpoints, rounded.
    let slack = Vec3::splat(1e-4);
    for pair in path.windows(2) {
        let (above, below) = (pair[0].place, pair[1].place);
        assert!(
            solver
                .hierarchy
                .children(above.node)
                .contains(&below.node.0)
        );
        assert!(above.min.cmple(below.min + slack).all());
        assert!(above.max.cmpge(below.max - slack).all());
        assert!(pair[0].area >= pair[1].area * 0.999);
        assert_eq!(pair[0].level + 1, pair[1].level);
    }
    for node in path {
        let [least, most] = node.power_bounds;
        let value = luminance(
            solver
                .linked
                .kernel(&solver.hierarchy, Some(Reading::Bounded))
                .projected_power(node.place.node, node.main_direction),
        );
        let slack = 1e-4 * most + 1e-9;
        assert!(least <= value + slack && value <= most + slack, "{node:?}");
        assert!(node.power.is_finite() && node.power >= 0.0);
    }
    let receivers = inspection.links.iter().map(|link| link.receiver.node);
    for receiver in receivers {
        assert!(path.iter().any(|node| node.place.node == receiver));
    }
}

#[test]
fn form_factors_in_an_enclosed_scene_add_to_one() {
    let solver = solved("furnace", SolveSettings::normal());
    let leaves: Vec<usize> = solver.hierarchy.mesh.leaves().collect();
    let mut sum = 0.0;
    for &leaf in &leaves {
        let row = inspect_leaf(&solver, leaf).row_sum;
        assert!((row - 1.0).abs() < 0.1, "element {leaf}: {row}");
        sum += row;
    }
    let mean = sum / leaves.len() as f32;
    assert!((mean - 1.0).abs() < 0.02, "{mean}");
}

#[test]
fn a_cluster_receives_over_its_own_links_and_those_above() {
    let solver = solved("cornell", SolveSettings::draft());
    for index in 0..solver.hierarchy.clusters.len() {
        let node = NodeId(index as u32);
        let inspection = solver.inspect(&Subject::Cluster(node)).expect("it exists");
        let count: u32 = inspection.path.iter().map(|node| node.link_count).sum();
        assert_eq!(inspection.links.len(), count as usize);
        let last = inspection.path.last().map(|last| last.place.node);
        assert_eq!(last, Some(node));
        assert!(inspection.linked.is_finite() && inspection.linked.min_element() >= 0.0);
        // A cluster receives a part of the light of its leaves.
        assert!(
            inspection.row_sum < 1.2,
            "cluster {index}: {}",
            inspection.row_sum
        );
    }
    let missing = NodeId(solver.hierarchy.clusters.len() as u32);
    assert!(solver.inspect(&Subject::Cluster(missing)).is_none());
}

#[test]
fn figures_of_clusters_count_senders_and_the_power_of_sampled_lamps() {
    let solver = solved("cornell", SolveSettings::draft());
    assert!(solver.direct.emitters().is_some(), "the lamp is sampled");
    let boxes = &solver.snapshot.clusters;
    let clusters = solver.hierarchy.clusters.len();
    let sent: u32 = boxes.iter().map(|shown| shown.source_count).sum();
    let of_clusters = solver.linked.links.all().iter();
    let expected = of_clusters
        .filter(|link| link.source.index() < clusters)
        .count();
    assert_eq!(sent as usize, expected);
    let emitted: f32 = solver
        .hierarchy
        .patches
        .iter()
        .map(|patch| luminance((patch.emission * PI).extend(0.0)) * patch.area)
        .sum();
    let reflected = luminance(solver.linked.power.clusters[0].total());
    assert!((boxes[0].power - emitted - reflected).abs() <= 1e-3 * boxes[0].power);
    // The lamp faces down, and nothing emits upwards.
    let linked = solver.linked.power.clusters[0].six_faces().map(luminance);
    let added: Vec<f32> = boxes[0]
        .face_power
        .iter()
        .zip(linked)
        .map(|(a, b)| a - b)
        .collect();
    let slack = 1e-3 * boxes[0].power;
    assert!(
        (added.iter().sum::<f32>() - emitted).abs() < slack,
        "{added:?}"
    );
    assert!(
        added.iter().filter(|part| **part > slack).count() == 1,
        "{added:?}"
    );
}
