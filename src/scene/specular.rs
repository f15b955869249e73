//! What the specular part of materials means for their diffuse part and for what passes.

use glam::Vec3;

use super::{Material, Scene, Specular, ranges::limited_reflectance};

impl Material {
    /// Whether it is glass.
    pub fn is_glass(&self) -> bool {
        matches!(self.specular, Some(Specular::Glass { .. }))
    }

    /// What mirrors, gloss and glass reflect of light from all directions, of what rays meet, by channel, 0…1.
    pub fn diffused_specular(&self) -> Vec3 {
        let Some(specular) = self.specular else {
            return Vec3::ZERO;
        };
        let part = match self.is_glass() {
            // What glass reflects is met, as what it lets pass is not.
            true => (1.0 - self.opacity) / self.met_share().max(f32::MIN_POSITIVE),
            false => self.share_of_met(),
        };
        (specular.mean_reflectance() * part).min(Vec3::ONE)
    }

    /// Bring what mirrors and gloss reflect into its range: with the diffuse part at most 1 in each channel, both scaled alike.
    /// Whether that changed the diffuse part.
    pub(super) fn limit_specular(&mut self) -> bool {
        let Some(specular) = self.specular.filter(|_| !self.is_glass()) else {
            return false;
        };
        let color = limited_reflectance(specular.color(), 1.0);
        let most = (self.reflectance + color).max_element().max(1.0);
        self.reflectance /= most;
        let color = color / most;
        self.specular = (color != Vec3::ZERO).then(|| specular.with_color(color));
        most > 1.0
    }
}

impl Scene {
    /// Whether some surface mirrors, glosses or refracts.
    pub fn has_specular(&self) -> bool {
        self.materials
            .iter()
            .any(|material| material.specular.is_some())
    }

    /// A copy whose glass lets nothing pass; `None` where there is no glass.
    pub fn with_solid_glass(&self) -> Option<Self> {
        if !self.materials.iter().any(Material::is_glass) {
            return None;
        }
        let mut copy = self.clone();
        for material in copy
            .materials
            .iter_mut()
            .filter(|material| material.is_glass())
        {
            material.opacity = 1.0;
        }
        Some(copy)
    }
}
