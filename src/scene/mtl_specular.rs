//! What the statements of an MTL file say of mirrors, gloss and glass.

use glam::Vec3;

use super::bsdf::{Specular, roughness_of_exponent};
use super::mtl::MtlMaterial;

/// Exponents from which a highlight is a mirror.
pub(super) const MIRROR_EXPONENT: f32 = 1000.0;

/// Reflectance of what is no metal and states a roughness but no colour: that of common plastics, paints and woods.
pub(super) const DIELECTRIC: f32 = 0.04;

/// Index of refraction of glass that states none.
const GLASS_INDEX: f32 = 1.5;

/// Largest index of refraction: no clear matter has more.
pub(super) const MOST_INDEX: f32 = 4.5;

/// Reflection in preferred directions, beside a diffuse part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shine {
    pub(super) specular: Specular,
    /// The part of the diffuse reflectance that is left: metal has none.
    pub(super) diffuse: f32,
}

impl MtlMaterial {
    /// The glass that the material is, if it is any: by `illum` 6 and 7 the surface of a solid, by 4 and 9 a pane. Many
    /// programs write these by habit, so an index of 1 is none, and panes must also be transparent or state their index.
    pub(super) fn glass(&self) -> Option<Specular> {
        let stated = self.index.filter(|index| index.is_finite() && *index > 0.0);
        let is_transparent = self.opacity().is_some();
        let is_thin = match self.model? {
            4 | 9 if is_transparent || stated.is_some() => true,
            6 | 7 => false,
            _ => return None,
        };
        if !is_transparent && stated == Some(1.0) {
            return None;
        }
        let index = stated.unwrap_or(GLASS_INDEX).clamp(1.0, MOST_INDEX);
        Some(Specular::Glass { index, is_thin })
    }

    /// Mirror or gloss, where the diffuse colour is this.
    pub(super) fn shine(&self, diffuse: Vec3) -> Option<Shine> {
        let is_painted = self.roughness.is_some() || self.metalness.is_some();
        let metal = self.metalness.unwrap_or(0.0);
        let metal = if metal.is_finite() {
            metal.clamp(0.0, 1.0)
        } else {
            0.0
        };
        // The models without highlights.
        if matches!(self.model, Some(0 | 1)) && !is_painted {
            return None;
        }
        let otherwise = if is_painted { DIELECTRIC } else { 0.0 };
        let color = self.specular.unwrap_or(Vec3::splat(otherwise));
        let reflectance = color.lerp(diffuse, metal);
        let roughness = match (self.roughness, self.exponent) {
            // Painted roughness is the square root of that of the lobe (Burley, "Physically Based Shading at Disney", 2012).
            (Some(painted), _) => painted * painted,
            (None, _) if matches!(self.model, Some(3 | 5 | 8)) => 0.0,
            (None, Some(exponent)) if exponent >= MIRROR_EXPONENT => 0.0,
            (None, exponent) => roughness_of_exponent(exponent.unwrap_or(0.0)),
        };
        Some(Shine {
            specular: Specular::of_roughness(reflectance, roughness)?,
            diffuse: 1.0 - metal,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{mtl::read_mtl, warning::WarningLog};

    fn material(text: &str) -> MtlMaterial {
        let text = format!("newmtl a\n{text}\n");
        let materials = read_mtl(text.as_bytes(), "", &mut WarningLog::default());
        materials.unwrap().remove(0)
    }

    #[test]
    fn mirrors_and_gloss_are_told_by_model_exponent_and_roughness() {
        let shine = |text: &str| material(text).shine(Vec3::new(0.8, 0.4, 0.2));
        let reflectance = Vec3::splat(0.5);
        for text in [
            "Ks 0.5\nillum 3",
            "illum 5\nKs 0.5\nNs 10",
            "Ks 0.5\nNs 1000",
            "Ks 0.5\nPr 0",
        ] {
            let mirror = Specular::Mirror { reflectance };
            assert_eq!(
                shine(text).map(|shine| shine.specular),
                Some(mirror),
                "{text}"
            );
        }
        for (text, expected) in [
            ("Ks 0.5", 1.0),
            ("Ks 0.5\nNs 198\nillum 2", 0.1),
            ("Ks 0.5\nillum 3\nPr 0.5", 0.25),
        ] {
            let Some(Specular::Gloss { roughness, .. }) = shine(text).map(|shine| shine.specular)
            else {
                panic!("{text}: no gloss");
            };
            assert!((roughness - expected).abs() < 1e-6, "{text}: {roughness}");
        }
        for text in [
            "",
            "illum 5",
            "Ks 0 0 0\nNs 900",
            "Ks 0.5\nillum 1",
            "Ks -1",
            "Ks nan",
        ] {
            assert_eq!(shine(text), None, "{text}");
        }
        // Metal has its colour in the lobe.
        let metal = shine("Pm 1\nPr 0.3\nKs 0.5").expect("metal");
        assert_eq!(
            (metal.diffuse, metal.specular.color()),
            (0.0, Vec3::new(0.8, 0.4, 0.2))
        );
        let plastic = shine("Pr 0.3").expect("plastic");
        assert_eq!(
            (plastic.diffuse, plastic.specular.color()),
            (1.0, Vec3::splat(0.04))
        );
    }

    #[test]
    fn glass_is_told_by_model_where_it_is_no_habit() {
        for (text, expected) in [
            ("illum 7", Some((1.5, false))),
            ("illum 6\nNi 1.33", Some((1.33, false))),
            ("illum 4\nNi 1.5\nd 0.1", Some((1.5, true))),
            ("illum 9\nTr 0.9", Some((1.5, true))),
            ("illum 4\nTf 1 1 1\nNi 1.00", None),
            ("illum 4", None),
            ("illum 2\nNi 1.5\nd 0.2", None),
            ("illum 7\nNi 1", None),
            ("illum 7\nNi nan", Some((1.5, false))),
        ] {
            let glass = expected.map(|(index, is_thin)| Specular::Glass { index, is_thin });
            assert_eq!(material(text).glass(), glass, "{text}");
        }
    }
}
