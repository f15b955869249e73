//! The plan of a solve: what this scene does not need, and why.
//!
//! Made once, between loading and solving, by looking at the scene. What is decided here is data that the rooms obey:
//! the tree holds no patch that is left out, the ray tree of a clear scene blocks nothing, and so on.
//! In the order of the list:
//!
//! | name | left out | where | harm |
//! |---|---|---|---|
//! | `unlit` | patches | no chain of patches that face each other leads to an emitter | none: they stay as dark as they are |
//! | `rays` | the ray tree and all rays | no triangle has parts of the scene on both sides | none: no ray would be blocked |
//! | `elements` | elements, links | as `rays`: light has no shadows, and bends only where it is seen to | that of the tolerances |
//! | `clusters` | links of clusters | as `rays`, and few patches: all pairs of them are exact and cheap | that of the tolerances |
//!
//! The last two are for the default method and oracle: whoever asks for others wants to see what they do.
//!
//! Looked at and not left out, since it does not pay: rays of single pairs whose shaft is empty, clusters of small scenes
//! with shadows, and
//! * channels of grey scenes: all channels of a quantity are one vector in one register. A sweep over links between elements
//!   takes 0.7 to 0.8 of the time with one channel, 0.6 with links packed anew for it, and all sweeps of a solve are 3 to
//!   6 % of it: the rest is geometry, which has no colour;
//! * links of black sources: form factors of all sources must add to the coverage, and since they are judged by little light
//!   they are few, a twentieth of the links and a hundredth of the rays where the blocks or the floor of the Cornell box are
//!   black;
//! * tables of clusters with one normal or along the axes: a sixth of the clusters in rooms and soups at most, and so a
//!   fiftieth of the memory.
//!
//! Beside these, some things are left out by loading, whatever is kept; they are listed after the plan.

use std::sync::Arc;

use super::{Cancel, Method, Omission, Oracle, SolveSettings, output::Omitted};
use crate::{
    hierarchy::{Hierarchy, Patch, PatchTree, SheetSides},
    scene::{ActiveMaterials, Scene},
};

/// Patches of a scene that is solved patch by patch, at most: their pairs are fewer than the links of usual scenes.
/// Fewer, and open rooms probe coverage by rays, at 160 patches for a sixth more time and a fifth more error; more, and
/// all pairs are too many: a sphere of 320 patches would take a quarter more time.
const FEW_PATCHES: usize = 256;

impl Omitted {
    /// What a solve of a scene would leave out: the plan alone, without the solve. `None` when cancelled.
    pub fn of(scene: &Scene, settings: &SolveSettings, cancel: &Cancel) -> Option<Vec<Self>> {
        let active = ActiveMaterials::default();
        let sheets = SheetSides::of(scene, &mut None);
        let is_cancelled = || cancel.is_cancelled();
        let (plan, _) = Plan::make(scene, sheets.as_ref(), settings, active, &is_cancelled)?;
        Some(Arc::unwrap_or_clone(plan.omitted))
    }
}

/// What a solve obeys.
#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    /// Nothing blocks: there is no ray to shoot.
    pub(super) is_clear: bool,
    /// The patches fill the view of each other, so that form factors add to 1.
    pub(super) is_enclosed: bool,
    /// Elements are divided where light bends, and nowhere else.
    pub(super) follows_light: bool,
    /// Only elements exchange light.
    pub(super) is_by_patch: bool,
    /// Materials that it is made for as if they emitted or reflected.
    active: ActiveMaterials,
    /// The list.
    pub(super) omitted: Arc<Vec<Omitted>>,
}

impl Plan {
    /// Look at a scene, and plant the tree that is needed; `None` when cancelled. What is left out need not be added where
    /// the active materials emit or reflect.
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
        if may_omit(Omission::Unlit) {
            tree = plan.omit_unlit(scene, sheets, tree, cancelled)?;
        }
        if may_omit(Omission::Rays) && tree.is_clear(scene) {
            // Who asks for the paper's way wants to see what it does.
            let is_exact_wanted =
                settings.oracle == Oracle::Interval && settings.method == Method::Bounded;
            let has_few = tree.active_patches().len() <= FEW_PATCHES;
            plan.is_clear = true;
            plan.is_enclosed = tree.is_closed(scene);
            plan.follows_light = is_exact_wanted && may_omit(Omission::Elements);
            plan.is_by_patch = is_exact_wanted && has_few && may_omit(Omission::Clusters);
            plan.note_clear(scene, &tree);
        }
        Arc::make_mut(&mut plan.omitted).extend(omitted_by_loading(scene));
        Some((plan, tree))
    }

    fn omit_unlit(
        &mut self,
        scene: &Scene,
        sheets: Option<&SheetSides>,
        tree: PatchTree,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Option<PatchTree> {
        let lit = tree.lit(scene, &self.active);
        // Without any light there is nothing to spare.
        if lit.iter().all(|&is_lit| is_lit) || !lit.contains(&true) {
            return Some(tree);
        }
        let dark: Vec<bool> = lit.into_iter().map(|is_lit| !is_lit).collect();
        let patches = || tree.patches.iter().zip(&dark).filter(|(_, dark)| **dark);
        let emits = |patch: &Patch| patch.emission != glam::Vec3::ZERO;
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
            "nothing changes: they are as dark with it",
        );
        if unseen > 0 {
            self.note(
                Omission::Unlit,
                unseen,
                format!("{unseen} emitting sides light nothing"),
                "no surface lies before them that faces them",
                "nothing changes: they shine as they are",
            );
        }
        tree.without(scene, sheets, &dark, cancelled)
    }

    /// Whether what was left out of a hierarchy stays dark where these materials are active, too. If so, the plan holds
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

    /// List what is left out where nothing blocks.
    fn note_clear(&mut self, scene: &Scene, tree: &PatchTree) {
        let (triangles, active) = (scene.triangles.len(), tree.active_patches().len());
        let exception = if self.is_enclosed || self.is_by_patch {
            ""
        } else {
            ", but for those that look how open the scene is"
        };
        self.note(
            Omission::Rays,
            triangles,
            format!("the ray tree of {triangles} triangles and every ray{exception}"),
            "all that is lit lies on one side of each triangle's plane, so nothing can stand between two surfaces",
            "light differs by no more than the noise of those rays",
        );
        if self.follows_light {
            self.note(
                Omission::Elements,
                active,
                format!("elements of {active} patches where light does not bend, and links between them"),
                "nothing casts a shadow, and between elements in full view form factors are known exactly",
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
                "there are so few patches, all in full view, that all pairs of them can be linked",
                "light differs by no more than the tolerance of links",
            );
        }
    }

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

/// What the reader of the scene left out already.
fn omitted_by_loading(scene: &Scene) -> Vec<Omitted> {
    // Count it.
    let backs = scene
        .triangles
        .iter()
        .filter(|face| !face.two_sided)
        .count();
    // What it is called and why it is not needed.
    let entries = [
        (
            "backs",
            backs,
            "backs of triangles",
            "they belong to closed shells or have a twin that looks the other way, or --sides one was asked for",
            "nothing changes: nobody is inside",
        ),
        (
            "doubles",
            scene.doubled_faces,
            "triangles",
            "each lies on another one that looks the same way",
            "light would be there twice",
        ),
        (
            "constant-textures",
            scene.omitted_textures.constant_textures,
            "textures of one colour",
            "where faces show them all their pixels are alike, so the materials have that colour instead",
            "nothing changes but rounding",
        ),
        (
            "unused-textures",
            scene.omitted_textures.unused_textures,
            "textures",
            "no face shows them",
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
