//! How bright what each element sees is.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{gather::LinkedClusters, light::LinkedLight};
use crate::{
    hierarchy::{Channels as _, Tables, luminance},
    solver::{Cancel, SolveSettings, direct::Surfaces, sums},
};

/// By element, the mean luminance of the irradiance of all that is seen from there, relative to that of the scene: one
/// sweep over the links, of irradiance instead of radiosity. Where nothing is seen the element's own counts. `None` when
/// cancelled.
pub(crate) fn surroundings(
    linked: &LinkedLight,
    surfaces: Surfaces<'_>,
    settings: &SolveSettings,
    cancel: &Cancel,
) -> Option<Vec<f32>> {
    let direct = surfaces.direct_of_leaves();
    let surfaces = surfaces.knowing(&direct);
    let hierarchy = surfaces.hierarchy;
    let total = |leaf: usize| linked.total(surfaces, leaf);
    let mean = sums::scale(hierarchy, total).max(f32::MIN_POSITIVE);
    let own = |leaf: usize| luminance(total(leaf)) / mean;
    let mut tables = Tables::default();
    tables.pull(hierarchy, |leaf| {
        let share = linked.power.elements[leaf].active_share();
        Vec3::splat(own(leaf) * share).extend(share)
    });
    let linked_clusters = LinkedClusters::new(hierarchy, &linked.links);
    let seen = linked.gather(hierarchy, &tables, &linked_clusters, settings, cancel)?;
    let elements = seen.into_par_iter().enumerate();
    let of = |(element, seen): (usize, Vec4)| {
        let filled = seen.form_factor_sum();
        match hierarchy.mesh.elements[element].is_leaf() && filled < 1.0 {
            true => seen.x + (1.0 - filled) * own(element),
            false => seen.x / filled.max(1.0),
        }
    };
    Some(elements.map(of).collect())
}
