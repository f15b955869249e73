//! The light of each lamp by itself, on the links of the last step.
//!
//! Light is linear in its sources, so that the light of a scene is the sum of that of its lamps. Each is solved as by a
//! relighting under that lamp alone; what the bounds and the convergence of single solves leave over, mostly below a
//! thousandth, is shared out, so that the parts add up to the light of the last step.

use glam::Vec3;

use super::{
    Cancel, LampLight, Solver,
    direct::{LightKind, Shooting},
    output::Lamp,
};
use crate::{hierarchy::Hierarchy, scene::Appearance};

impl Solver {
    /// The light of each lamp: of each material that emits, of the sky and of the sun, in this order. They add up to the light
    /// of the present snapshot. The solve itself is left as it was. `None` when cancelled.
    pub fn light_by_lamp(&mut self, cancel: &Cancel) -> Option<Vec<LampLight>> {
        let whole = self.snapshot.clone();
        let lamps = self.lamps();
        if let [lamp] = lamps[..] {
            return Some(vec![LampLight {
                lamp,
                irradiance: whole.light.irradiance.clone(),
                emission: whole.mesh.emission.clone(),
            }]);
        }
        let (linked, leaves) = (self.linked.irradiance.clone(), self.leaves.clone());
        let appearances = self.relighting.appearances.clone();
        let parts: Option<Vec<LampLight>> = lamps
            .into_iter()
            .map(|lamp| self.light_of(lamp, &appearances, cancel))
            .collect();
        // Back to all lamps; no ray is shot for it.
        self.direct.light_only(None);
        let fields = self.direct.emitters_mut();
        let shooting = Shooting {
            scene: &self.scene,
            hierarchy: &self.hierarchy,
            rays: &self.rays,
            seed: self.settings.seed,
            cancel: &Cancel::default(),
        };
        let shot = self.relighting.mix_direct(fields, shooting, &appearances);
        self.ray_count += shot.unwrap_or_default();
        self.hierarchy.paint(&self.scene, &appearances);
        self.relighting.appearances = appearances;
        (self.linked.irradiance, self.leaves) = (linked, leaves);
        self.pull();
        self.relighting.forget_solved();
        self.snapshot = whole;
        let mut parts = parts?;
        share_out(&mut parts, &self.snapshot.light.irradiance);
        Some(parts)
    }

    /// The sources of the present light.
    fn lamps(&self) -> Vec<Lamp> {
        let mut materials: Vec<usize> = emitting(&self.hierarchy)
            .map(|triangle| self.scene.triangles[triangle].material.index())
            .collect();
        materials.sort_unstable();
        materials.dedup();
        let outside = [(LightKind::Sky, Lamp::Sky), (LightKind::Sun, Lamp::Sun)]
            .into_iter()
            .filter(|(kind, _)| self.direct.has(*kind))
            .map(|(_, lamp)| lamp);
        materials
            .into_iter()
            .map(Lamp::Material)
            .chain(outside)
            .collect()
    }

    /// The light of one lamp; `None` when cancelled.
    fn light_of(
        &mut self,
        lamp: Lamp,
        appearances: &[Appearance],
        cancel: &Cancel,
    ) -> Option<LampLight> {
        self.direct.light_only(Some(match lamp {
            Lamp::Material(_) => LightKind::Emitters,
            Lamp::Sky => LightKind::Sky,
            Lamp::Sun => LightKind::Sun,
        }));
        let alone = |(material, appearance): (usize, &Appearance)| match lamp {
            Lamp::Material(emitting) if emitting == material => *appearance,
            Lamp::Material(_) | Lamp::Sky | Lamp::Sun => Appearance {
                emission: Vec3::ZERO,
                ..*appearance
            },
        };
        let alone: Vec<Appearance> = appearances.iter().enumerate().map(alone).collect();
        // What was solved last had other light from outside.
        self.relighting.forget_light();
        self.relight(&alone, cancel)?;
        Some(LampLight {
            lamp,
            irradiance: self.snapshot.light.irradiance.clone(),
            emission: self.snapshot.mesh.emission.clone(),
        })
    }
}

/// Triangles whose patches emit.
fn emitting(hierarchy: &Hierarchy) -> impl Iterator<Item = usize> + '_ {
    let patches = &hierarchy.patches[hierarchy.active_patches()];
    let emitting = patches.iter().filter(|patch| patch.emission != Vec3::ZERO);
    emitting.map(|patch| patch.triangle.index())
}

/// Scale the parts so that they add up to the whole at each vertex, by channel.
fn share_out(parts: &mut [LampLight], whole: &[Vec3]) {
    for (vertex, &whole) in whole.iter().enumerate() {
        let sum: Vec3 = parts.iter().map(|part| part.irradiance[vertex]).sum();
        let factor = whole / sum;
        let factor = Vec3::select(sum.cmpgt(Vec3::ZERO), factor, Vec3::ONE);
        if factor.is_finite() {
            for part in parts.iter_mut() {
                part.irradiance[vertex] *= factor;
            }
        }
    }
}
