//! The figures of a step: counts, energy balance and row sums.

use std::f32::consts::PI;

use glam::Vec3;

use crate::{
    hierarchy::{Channels as _, Hierarchy},
    solver::{
        Note, StepReport, direct::Surfaces, iteration::LinkedLight, sums::area_total,
        vertices::LeafLight,
    },
};

/// Fill in the figures that follow from links and light.
pub(crate) fn fill(
    report: &mut StepReport,
    surfaces: Surfaces<'_>,
    linked: &LinkedLight,
    leaves: &[LeafLight],
) {
    let hierarchy = surfaces.hierarchy;
    report.links = linked.link_count() as u64;
    report.nodes = hierarchy.node_count() as u64;
    report.elements = leaves.len() as u64;
    report.vertices = hierarchy.mesh.vertices.len() as u64;
    report.energy_balance = energy_balance(surfaces, linked);
    report.diffused_share = diffused_share(surfaces, linked);
    fill_row_sums(report, hierarchy, linked);
}

/// Smallest part of the reflected power that is told of.
const LEAST_TOLD: f64 = 0.005;

/// Note how much light curved mirrors, gloss and glass send.
pub(crate) fn note_diffused(report: &mut StepReport) {
    let share = report.diffused_share;
    if share >= LEAST_TOLD {
        report.notes.push(Note::Diffused { share });
    }
}

/// Part of the reflected power that is specular but counts as diffuse.
fn diffused_share(surfaces: Surfaces<'_>, linked: &LinkedLight) -> f64 {
    let hierarchy = surfaces.hierarchy;
    if !hierarchy.has_diffused() {
        return 0.0;
    }
    let power = |of: &(dyn Fn(usize) -> Vec3 + Sync)| {
        area_total(hierarchy, |leaf| {
            of(leaf).extend(0.0) * linked.total(surfaces, leaf)
        })
    };
    let all = power(&|leaf| hierarchy.reflectance_of(leaf));
    let diffuse = power(&|leaf| hierarchy.diffuse_reflectance_of(leaf));
    if all > 0.0 { 1.0 - diffuse / all } else { 0.0 }
}

/// Note that the memory limit prevented finer links or elements.
pub(crate) fn note_full(report: &mut StepReport) {
    report.is_full = true;
    report.notes.push(Note::MemoryLimit);
}

/// Power that arrives at all leaves relative to the emitted and reflected power and that from outside.
fn energy_balance(surfaces: Surfaces<'_>, linked: &LinkedLight) -> f64 {
    let hierarchy = surfaces.hierarchy;
    let arrived = area_total(hierarchy, |leaf| linked.total(surfaces, leaf));
    let sent = area_total(hierarchy, |leaf| {
        let mirrored = hierarchy.mirrored_by(leaf);
        let reflectance = (hierarchy.reflectance_of(leaf) + mirrored).extend(0.0);
        let emitted = (hierarchy.emission_of(leaf) * PI).extend(0.0);
        let outside = surfaces.direct.outside_irradiance(hierarchy, leaf);
        reflectance * linked.total(surfaces, leaf) + emitted + outside
    });
    if sent > 0.0 { arrived / sent } else { 1.0 }
}

/// Fill in the sums of form factors: the irradiance of leaves if every radiosity were 1.
fn fill_row_sums(report: &mut StepReport, hierarchy: &Hierarchy, linked: &LinkedLight) {
    let (mut least, mut most) = (f32::INFINITY, 0.0f32);
    let (mut sum, mut whole) = (0.0f64, 0.0f64);
    let elements = &hierarchy.mesh.elements;
    let seen = |leaf: &usize| !elements[*leaf].is_inside_solid();
    for leaf in hierarchy.mesh.active_leaves().filter(seen) {
        let row = linked.irradiance[leaf].form_factor_sum();
        least = least.min(row);
        most = most.max(row);
        let area = f64::from(elements[leaf].area_vector.length());
        sum += f64::from(row) * area;
        whole += area;
    }
    report.row_sum_min = least.min(most);
    report.row_sum_max = most;
    report.row_sum_mean = (sum / whole.max(f64::MIN_POSITIVE)) as f32;
}
