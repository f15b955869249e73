//! The plan of a solve: the parts that this scene does not need, and why.
//!
//! It is made once from the scene, between loading and solving. Its decisions are data that the other rooms obey:
//! omitted patches are inactive in the tree, the ray tree of a clear scene occludes nothing, and so on. In the order of
//! the list:
//!
//! | name | omitted | where | error |
//! |---|---|---|---|
//! | `unlit` | patches | no chain of patches that face each other leads to an emitter | none: they stay dark |
//! | `rays` | the ray tree and all rays | no triangle has parts of the scene on both sides | none: no ray would be occluded |
//! | `elements` | elements, links | as `rays`: light has no shadows, so its interpolation error is known | within the tolerances |
//! | `clusters` | links of clusters | as `rays`, and few patches: all pairs of them are exact and cheap | within the tolerances |
//! | `outside` | the sky and the sun | none of many rays from all surfaces leaves the scene | what comes through a gap that these rays miss |
//!
//! `elements` and `clusters` apply to the default method and oracle only, since the others are chosen to be studied.
//! Under a sky or a sun all patches count as lit, and what stands before any patch occludes.
//!
//! Considered and not omitted, since the gain is small: rays of single pairs whose shaft is empty, clusters of small
//! scenes with shadows, and
//! * channels of grey scenes: all channels of a quantity are one vector in one register. A sweep over links between elements
//!   takes 0.7 to 0.8 of the time with one channel, 0.6 with links repacked for it, and all sweeps of a solve take 3 to
//!   6 % of its time: the rest is geometry, which has no colour;
//! * links of black sources: form factors of all sources must add to the coverage, and these links are few, since they are
//!   judged by the ambient radiosity alone: a twentieth of the links and a hundredth of the rays where the blocks or the
//!   floor of the Cornell box are black;
//! * tables of clusters with one normal or along the axes: at most a sixth of the clusters in rooms and soups, and so a
//!   fiftieth of the memory.
//!
//! Loading omits further parts, whatever `--keep` says; they are listed after the plan.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::{Cancel, Method, Omission, Oracle, SolveSettings, output::Omitted};
use crate::{
    geometry::{Random, RayTree, cosine_direction, triangle_point},
    hierarchy::{Hierarchy, Patch, PatchTree, SheetSides},
    scene::{ActiveMaterials, Scene},
};

/// Rays that are to find a gap through which a surface sees the sky. Fewer, and the sky is omitted behind small windows;
/// more take time in closed rooms.
const OUTSIDE_RAYS: u32 = 65_536;

/// Most patches of a scene that is solved without clusters: their pairs are fewer than the links of usual scenes.
/// Smaller, and rooms with openings probe their coverage by rays, which at 160 patches takes a sixth more time and has
/// a fifth more error; larger, and there are too many pairs: a sphere of 320 patches would take a quarter more time.
const FEW_PATCHES: usize = 256;

impl Omitted {
    /// The parts that a solve of a scene would omit, without solving it. `None` when cancelled.
    pub fn of(scene: &Scene, settings: &SolveSettings, cancel: &Cancel) -> Option<Vec<Self>> {
        let active = ActiveMaterials::default();
        let sheets = SheetSides::of(scene, &mut None);
        let is_cancelled = || cancel.is_cancelled();
        let (plan, _) = Plan::make(scene, sheets.as_ref(), settings, active, &is_cancelled)?;
        Some(Arc::unwrap_or_clone(plan.omitted))
    }
}

/// Decisions for a scene, which the solve obeys.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    /// Nothing occludes: no ray is needed.
    pub(super) is_clear: bool,
    /// The patches enclose each other, so that the form factors of each add to 1.
    pub(super) is_enclosed: bool,
    /// Elements are divided only where linear interpolation of the light errs.
    pub(super) follows_light: bool,
    /// Only elements are linked.
    pub(super) is_by_patch: bool,
    /// The sky or the sun gives light, and some surface sees it.
    pub(super) sees_outside: bool,
    /// Materials that count as emitting or reflecting, beside those that do.
    active: ActiveMaterials,
    /// The list of omissions.
    pub(super) omitted: Arc<Vec<Omitted>>,
}

impl Plan {
    /// The plan of a scene and the tree of its active patches; `None` when cancelled. The plan also holds when the
    /// `active` materials emit or reflect.
    pub(super) fn make(
        scene: &Scene,
        sheets: Option<&SheetSides>,
        settings: &SolveSettings,
        active: ActiveMaterials,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<(Self, PatchTree)> {
        let may_omit = |omission| !settings.keep.has(omission);
        let mut plan = Self {
            active,
            ..Self::default()
        };
        let mut tree = PatchTree::build(scene, sheets, cancelled)?;
        let is_dark_outside = scene.environment.is_dark();
        if may_omit(Omission::Unlit) && is_dark_outside {
            tree = plan.omit_unlit(scene, sheets, tree, cancelled)?;
        }
        let is_clear = || {
            let is_clear_outside =
                is_dark_outside || tree.is_enclosed(scene) || tree.is_open(scene);
            // Mirrors show what no surface faces.
            is_clear_outside && !scene.has_specular() && tree.is_clear(scene)
        };
        if may_omit(Omission::Rays) && is_clear() {
            // The paper's methods are chosen to be studied, so nothing of them is omitted.
            let is_exact_wanted =
                settings.oracle == Oracle::Interval && settings.method == Method::Bounded;
            let has_few = tree.active_patches().len() <= FEW_PATCHES;
            plan.is_clear = true;
            plan.is_enclosed = tree.is_enclosed(scene);
            plan.follows_light = is_exact_wanted && may_omit(Omission::Elements);
            plan.is_by_patch = is_exact_wanted && has_few && may_omit(Omission::Clusters);
            plan.note_clear(scene, &tree);
        }
        Arc::make_mut(&mut plan.omitted).extend(omitted_by_loading(scene));
        Some((plan, tree))
    }

    /// Find whether any surface sees the sky or the sun, by rays where there is an occluder. Returns the rays shot.
    pub(super) fn probe_outside(
        &mut self,
        scene: &Scene,
        hierarchy: &Hierarchy,
        rays: &RayTree,
        settings: &SolveSettings,
    ) -> u64 {
        if scene.environment.is_dark() {
            return 0;
        }
        if settings.keep.has(Omission::Outside) || hierarchy.active_patches().is_empty() {
            self.sees_outside = true;
            return 0;
        }
        if self.is_clear {
            self.sees_outside = !self.is_enclosed;
        } else {
            self.sees_outside = sees_outside(scene, hierarchy, rays, settings.seed);
        }
        if !self.sees_outside {
            self.note(
                Omission::Outside,
                1,
                "the sky and the sun".to_owned(),
                "no ray from any surface leaves the scene",
                "what comes through a gap that one ray in 65,536 does not find",
            );
        }
        // Where a surface sees the outside, the first rays tell so.
        if self.is_clear || self.sees_outside {
            0
        } else {
            u64::from(OUTSIDE_RAYS)
        }
    }

    /// Deactivate the patches that no light can reach. Returns the tree without them; `None` when cancelled.
    fn omit_unlit(
        &mut self,
        scene: &Scene,
        sheets: Option<&SheetSides>,
        tree: PatchTree,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<PatchTree> {
        let lit = tree.lit(scene, &self.active);
        // Without any light nothing is omitted.
        if lit.iter().all(|&is_lit| is_lit) || !lit.contains(&true) {
            return Some(tree);
        }
        let dark: Vec<bool> = lit.into_iter().map(|is_lit| !is_lit).collect();
        let patches = || tree.patches.iter().zip(&dark).filter(|(_, dark)| **dark);
        let emits = |patch: &Patch| patch.emission != Vec3::ZERO;
        let unseen = patches().filter(|(patch, _)| emits(patch)).count();
        self.note(
            Omission::Unlit,
            patches().count(),
            format!(
                "{} of {} sides of triangles take no part",
                patches().count(),
                tree.patches.len()
            ),
            "no chain of surfaces that face each other leads from an emitter to them",
            "nothing changes: they stay dark",
        );
        if unseen > 0 {
            self.note(
                Omission::Unlit,
                unseen,
                format!("{unseen} emitting sides light nothing"),
                "no surface in front of them faces them",
                "nothing changes: their own emission is displayed",
            );
        }
        tree.without(scene, sheets, &dark, cancelled)
    }

    /// Whether the inactive patches of a hierarchy stay dark if these materials are active, too. If so, the plan holds
    /// for them from now on.
    pub(super) fn holds_for(
        &mut self,
        scene: &Scene,
        hierarchy: &Hierarchy,
        active: &ActiveMaterials,
    ) -> bool {
        let is_whole = hierarchy.active_patches().len() == hierarchy.patches.len();
        if is_whole || self.active.covers(active) {
            return true;
        }
        let all = self.active.joined(active);
        let side = |patch: &Patch| 2 * patch.triangle.index() + usize::from(patch.is_back);
        let mut is_active = vec![false; 2 * scene.triangles.len()];
        for patch in &hierarchy.patches[hierarchy.active_patches()] {
            is_active[side(patch)] = true;
        }
        let Some(tree) = PatchTree::build(scene, None, &|| false) else {
            return false;
        };
        let mut lit = tree.lit(scene, &all).into_iter().zip(&tree.patches);
        let holds = lit.all(|(is_lit, patch)| !is_lit || is_active[side(patch)]);
        if holds {
            self.active = all;
        }
        holds
    }

    /// List the omissions of a scene without occlusion.
    fn note_clear(&mut self, scene: &Scene, tree: &PatchTree) {
        let (triangles, active) = (scene.triangles.len(), tree.active_patches().len());
        let exception = if self.is_enclosed || self.is_by_patch {
            ""
        } else {
            ", except those that estimate the coverage of hemispheres"
        };
        self.note(
            Omission::Rays,
            triangles,
            format!("the ray tree of {triangles} triangles and every ray{exception}"),
            "all lit surfaces lie on one side of each triangle's plane, so nothing can stand between two of them",
            "light differs by no more than the noise of those rays",
        );
        if self.follows_light {
            self.note(
                Omission::Elements,
                active,
                format!("elements of {active} patches where light varies linearly, and links between them"),
                "nothing casts a shadow, and unoccluded form factors between elements are known exactly",
                "light differs by no more than the tolerances of mesh and links",
            );
        }
        if self.is_by_patch {
            self.note(
                Omission::Clusters,
                tree.clusters.len(),
                format!(
                    "links of clusters, of which there would be {}",
                    tree.clusters.len()
                ),
                "there are so few patches, without occlusion, that all pairs of them can be linked",
                "light differs by no more than the tolerance of links",
            );
        }
    }

    /// Add an omission to the list.
    fn note(
        &mut self,
        omission: Omission,
        count: usize,
        what: String,
        reason: &str,
        bound: &'static str,
    ) {
        Arc::make_mut(&mut self.omitted).push(Omitted {
            name: omission.name(),
            count: count as u64,
            what,
            reason: reason.to_owned(),
            bound,
        });
    }
}

/// Whether any of many cosine-weighted rays from all surfaces leaves the scene.
fn sees_outside(scene: &Scene, hierarchy: &Hierarchy, rays: &RayTree, seed: u64) -> bool {
    // Rays by area: of a patch all that fall between the area before it and after it.
    let patches = &hierarchy.patches[hierarchy.active_patches()];
    let mut until = Vec::with_capacity(patches.len());
    let mut area = 0.0;
    for patch in patches {
        area += f64::from(patch.area);
        until.push(area);
    }
    (0..OUTSIDE_RAYS).into_par_iter().any(|ray| {
        let at = (f64::from(ray) + 0.5) / f64::from(OUTSIDE_RAYS) * area;
        let patch = until
            .partition_point(|&until| until <= at)
            .min(patches.len() - 1);
        let patch = &patches[patch];
        let mut random = Random::new(seed, u64::from(ray));
        let [a, b, c] = scene.corners(patch.triangle);
        let place = triangle_point(random.uniform_2d());
        let point = a * place.x + b * place.y + c * place.z;
        let direction = cosine_direction(patch.normal, random.uniform_2d());
        rays.transmittance_outward(point, direction, Some(patch.triangle)) != Vec3::ZERO
    })
}

/// The parts that loading omitted already.
fn omitted_by_loading(scene: &Scene) -> Vec<Omitted> {
    // Count the backs.
    let backs = scene
        .triangles
        .iter()
        .filter(|face| !face.two_sided)
        .count();
    // Name, count, description, reason and effect of each.
    let entries = [
        (
            "backs",
            backs,
            "backs of triangles",
            "they belong to closed shells or have a twin that faces the other way, or --sides one was requested",
            "nothing changes: no view is from the inside",
        ),
        (
            "doubles",
            scene.doubled_faces,
            "triangles",
            "each lies on another one that faces the same way",
            "the light would count twice",
        ),
        (
            "constant-textures",
            scene.omitted_textures.constant_textures,
            "textures of one colour",
            "all their pixels on faces are alike, so the materials have that colour instead",
            "nothing changes but rounding",
        ),
        (
            "unused-textures",
            scene.omitted_textures.unused_textures,
            "textures",
            "no face uses them",
            "nothing changes",
        ),
    ];
    let found = entries.into_iter().filter(|entry| entry.1 > 0);
    found
        .map(|(name, count, what, reason, bound)| Omitted {
            name,
            count: count as u64,
            what: format!("{count} {what}"),
            reason: reason.to_owned(),
            bound,
        })
        .collect()
}
