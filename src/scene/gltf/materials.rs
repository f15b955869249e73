//! From the materials of a glTF file to those of a scene.
//!
//! Metal and roughness become mirrors and gloss, as `Pm` and `Pr` of MTL files do; what is so rough that its lobe is nearly
//! that of a diffuse surface is diffuse, so that vertices can show it. Transmission is glass: thin without a volume. Unlit
//! materials reflect what they show. Emission is radiance, W·sr⁻¹·m⁻² for candela per square metre.

use std::collections::HashMap;

use glam::{Vec3, Vec4};

use super::buffers::Buffers;
use super::document::{Document, Material as Stated, SpecularGlossiness, TextureInfo};
use super::pictures::{Alpha, Pictures, Shown, Use};
use super::placement::Placement;
use super::printable;
use super::remarks::Remarks;
use crate::scene::bsdf::Specular;
use crate::scene::color::linear_from_srgb;
use crate::scene::mtl_specular::{DIELECTRIC, MOST_INDEX};
use crate::scene::warning::WarningLog;
use crate::scene::{
    CutoutId, Material, MaterialId, SceneBuilder, SceneOptions, Sides, TextureId,
    WarningKind::{self, SeeThrough, TextureMissing, Unsupported},
};

/// Reflectance where the file gives no material.
const DEFAULT_REFLECTANCE: Vec3 = Vec3::splat(0.5);

/// Painted roughness from which reflection counts as diffuse. A smaller one takes their highlights from satin surfaces; a
/// larger one leaves rough metal to lobes, which vertices cannot show.
const DIFFUSE_ROUGHNESS: f32 = 0.9;

/// Where the colours of faces come from, beside their material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Look {
    /// Nowhere: textures are taken by their means.
    Plain,
    /// Textures.
    Textured,
    /// The vertices; textures are taken by their means.
    Painted,
}

/// A material of the scene with what its faces need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    pub(super) id: MaterialId,
    /// How its textures lie, where it has any.
    pub(super) placement: Option<Placement>,
}

/// The materials that faces have.
#[derive(Debug)]
pub(super) struct Materials<'a> {
    document: &'a Document,
    options: &'a SceneOptions,
    pictures: Pictures<'a>,
    slots: HashMap<(Option<usize>, Look), Slot>,
    remarks: Remarks,
    /// Pictures that are missing or broken.
    log: WarningLog,
}

/// What reflects, before gloss is told from it.
struct Base {
    color: Vec3,
    /// The same with the mean of its texture.
    mean: Vec3,
    texture: Option<TextureId>,
    cutout: Option<CutoutId>,
    opacity: f32,
}

impl<'a> Materials<'a> {
    pub(super) fn new(document: &'a Document, options: &'a SceneOptions) -> Self {
        Self {
            document,
            options,
            pictures: Pictures::new(document),
            slots: HashMap::new(),
            remarks: Remarks::default(),
            log: WarningLog::default(),
        }
    }

    /// The set of texture coordinates that a material asks for first, if it has a texture that can be shown.
    pub(super) fn texture_set(&self, index: Option<usize>) -> Option<u32> {
        let stated = index.and_then(|index| self.document.materials.get(index))?;
        let info = base_texture(stated).or(stated.emissive_texture.as_deref())?;
        Some(Placement::of(self.document, info).set)
    }

    /// Whether its colour has a texture.
    pub(super) fn has_base_texture(&self, index: Option<usize>) -> bool {
        let stated = index.and_then(|index| self.document.materials.get(index));
        stated.is_some_and(|stated| base_texture(stated).is_some())
    }

    /// The name of a material in messages.
    fn name(&self, index: Option<usize>) -> String {
        let stated = index.and_then(|index| self.document.materials.get(index));
        match (index, stated.map(|stated| stated.name.as_str())) {
            (Some(index), Some("")) => format!("material {index}"),
            (_, Some(name)) => printable(name),
            _ => String::new(),
        }
    }

    /// The material of faces, made when the first of them asks for it.
    pub(super) fn slot(
        &mut self,
        index: Option<usize>,
        look: Look,
        buffers: &Buffers,
        builder: &mut SceneBuilder,
    ) -> Slot {
        if let Some(slot) = self.slots.get(&(index, look)) {
            return *slot;
        }
        let stated = index.and_then(|index| self.document.materials.get(index));
        let slot = match stated {
            Some(stated) => {
                let name = self.name(index);
                let mut reading = Reading {
                    materials: self,
                    name,
                    look,
                    buffers,
                    builder,
                };
                reading.define(stated)
            }
            None => {
                // What is painted states its reflectance.
                let reflectance = match look {
                    Look::Painted => Vec3::ONE,
                    Look::Plain | Look::Textured => DEFAULT_REFLECTANCE,
                };
                let material = Material::plain("", reflectance, Vec3::ZERO);
                Slot {
                    id: builder.push_material(material),
                    placement: None,
                }
            }
        };
        self.slots.insert((index, look), slot);
        slot
    }

    /// What was noticed.
    pub(super) fn into_log(self) -> WarningLog {
        let mut log = self.log;
        self.remarks.tell(&mut log);
        log
    }

    /// Say something of a material.
    pub(super) fn remark(&mut self, kind: WarningKind, what: &'static str, name: &str) {
        self.remarks.add(kind, what, name);
    }
}

/// The texture of what a material reflects.
fn base_texture(stated: &Stated) -> Option<&TextureInfo> {
    match &stated.extensions.specular_glossiness {
        Some(older) => older.diffuse_texture.as_deref(),
        None => stated.pbr_metallic_roughness.base_color_texture.as_deref(),
    }
}

/// One material on its way in.
struct Reading<'r, 'a> {
    materials: &'r mut Materials<'a>,
    name: String,
    look: Look,
    buffers: &'r Buffers<'r>,
    builder: &'r mut SceneBuilder,
}

impl Reading<'_, '_> {
    fn define(&mut self, stated: &Stated) -> Slot {
        let base_info = base_texture(stated);
        let base = self.base(stated, base_info);
        let (emission, emission_texture) = self.emission(stated, base_info);
        let (diffuse, specular) = self.shine(stated, &base);
        let glass = self.glass(stated, &base);
        let is_glass = glass.is_some();
        let material = Material {
            name: self.name.clone(),
            reflectance: base.color * diffuse,
            emission,
            reflectance_texture: base.texture,
            emission_texture,
            opacity: base.opacity * (1.0 - glass.map_or(0.0, |(_, share)| share)),
            filter: if is_glass { base.mean } else { Vec3::ONE },
            cutout: base.cutout,
            specular: glass.map_or(specular, |(glass, _)| Some(glass)),
            sides: match stated.double_sided {
                // Exporters write it for all materials: then shells tell.
                true => Sides::Auto,
                false => Sides::One,
            },
        };
        if material.is_see_through() && !self.materials.options.is_opaque {
            self.remark(SeeThrough, "transparent materials");
        }
        let has_pictures = material.has_pictures() && self.look == Look::Textured;
        let shown = base_info.or(stated.emissive_texture.as_deref());
        let placement = shown.filter(|_| has_pictures);
        Slot {
            placement: placement.map(|info| Placement::of(self.materials.document, info)),
            id: self.builder.push_material(material),
        }
    }

    /// The colour, what is cut out of it, and how much of it is there.
    fn base(&mut self, stated: &Stated, info: Option<&TextureInfo>) -> Base {
        let factor = match &stated.extensions.specular_glossiness {
            Some(older) => older.diffuse_factor,
            None => stated.pbr_metallic_roughness.base_color_factor,
        };
        let factor = Vec4::from_array(factor.map(|channel| channel as f32));
        let (color, opacity) = (factor.truncate(), factor.w);
        let cutoff = stated.alpha_cutoff as f32;
        let (meaning, is_mask) = match stated.alpha_mode.as_str() {
            "MASK" => (
                Alpha::CutBelow((cutoff / opacity.max(f32::MIN_POSITIVE)).to_bits()),
                true,
            ),
            "BLEND" => (Alpha::Seen, false),
            _ => (Alpha::Ignored, false),
        };
        let shown = info.and_then(|info| self.picture(info, Use::Reflects(meaning)));
        let alpha = shown.map_or(1.0, |shown| shown.alpha);
        let opacity = match meaning {
            Alpha::Ignored => 1.0,
            _ if is_mask => match alpha > 0.0
                && (shown.is_some_and(|shown| shown.cutout.is_some()) || opacity >= cutoff)
            {
                true => 1.0,
                false => 0.0,
            },
            _ => opacity.clamp(0.0, 1.0) * alpha,
        };
        let mean = shown.map_or(Vec3::ONE, |shown| shown.color);
        let is_textured = self.look == Look::Textured;
        Base {
            color: if is_textured { color } else { color * mean },
            mean: color * mean,
            texture: shown
                .and_then(|shown| shown.texture)
                .filter(|_| is_textured),
            cutout: shown.and_then(|shown| shown.cutout).filter(|_| is_textured),
            opacity,
        }
    }

    /// Emitted radiance, and its texture, where that lies as the one of the colour does.
    fn emission(
        &mut self,
        stated: &Stated,
        base_info: Option<&TextureInfo>,
    ) -> (Vec3, Option<TextureId>) {
        let strength = stated.extensions.emissive_strength.as_ref();
        let strength = strength.map_or(1.0, |strength| strength.emissive_strength);
        let radiance = stated
            .emissive_factor
            .map(|channel| (channel * strength) as f32);
        let radiance = Vec3::from_array(radiance);
        let Some(info) = stated
            .emissive_texture
            .as_deref()
            .filter(|_| radiance != Vec3::ZERO)
        else {
            return (radiance, None);
        };
        let Some(shown) = self.picture(info, Use::Emits) else {
            return (radiance, None);
        };
        let place = |info| Placement::of(self.materials.document, info);
        let is_apart = base_info.is_some_and(|base| place(base) != place(info));
        if self.look == Look::Textured && !is_apart {
            return (radiance, shown.texture);
        }
        if is_apart {
            self.remark(
                Unsupported,
                "the emissive texture lies otherwise than that of the colour, so its mean is used for these materials",
            );
        }
        (radiance * shown.color, None)
    }

    /// The part of the colour that is diffuse, and what is reflected in preferred directions.
    fn shine(&mut self, stated: &Stated, base: &Base) -> (Vec3, Option<Specular>) {
        if stated.extensions.unlit.is_some() {
            self.remark(
                Unsupported,
                "unlit materials have their light in their colours; here they reflect these as diffuse surfaces",
            );
            return (Vec3::ONE, None);
        }
        if let Some(older) = &stated.extensions.specular_glossiness {
            return self.glossiness(older);
        }
        let painted = &stated.pbr_metallic_roughness;
        let means = self.means(painted.metallic_roughness_texture.as_deref());
        let metal = share(painted.metallic_factor) * means.z;
        let roughness = share(painted.roughness_factor) * means.y;
        if roughness >= DIFFUSE_ROUGHNESS {
            return (Vec3::ONE, None);
        }
        let index = stated.extensions.ior.as_ref().map(|ior| ior.ior as f32);
        let dielectric = match index {
            Some(index) if index >= 1.0 => ((index - 1.0) / (index + 1.0)).powi(2),
            _ => DIELECTRIC,
        };
        let reflectance = Vec3::splat(dielectric).lerp(base.mean, metal);
        let specular = Specular::of_roughness(reflectance, roughness * roughness);
        (Vec3::splat(1.0 - metal), specular)
    }

    /// The same of the older description.
    fn glossiness(&mut self, older: &SpecularGlossiness) -> (Vec3, Option<Specular>) {
        let info = older.specular_glossiness_texture.as_deref();
        let mean = self.means(info).map(linear_from_srgb);
        let color = Vec3::from_array(older.specular_factor.map(share)) * mean;
        let roughness = 1.0 - share(older.glossiness_factor);
        let diffuse = Vec3::splat(1.0 - color.max_element());
        match roughness >= DIFFUSE_ROUGHNESS {
            true => (diffuse, None),
            false => (
                diffuse,
                Specular::of_roughness(color, roughness * roughness),
            ),
        }
    }

    /// The glass that it is, if any, and how much of it.
    fn glass(&mut self, stated: &Stated, base: &Base) -> Option<(Specular, f32)> {
        let transmission = stated.extensions.transmission.as_ref()?;
        let means = self.means(transmission.transmission_texture.as_deref());
        let share = share(transmission.transmission_factor) * means.x;
        if share <= 0.0 || base.opacity <= 0.0 {
            return None;
        }
        let index = stated.extensions.ior.as_ref().map_or(1.5, |ior| ior.ior);
        let volume = stated.extensions.volume.as_ref();
        let glass = Specular::Glass {
            index: (index as f32).clamp(1.0, MOST_INDEX),
            is_thin: volume.is_none_or(|volume| volume.thickness_factor <= 0.0),
        };
        Some((glass, share))
    }

    /// Means of the channels of a texture of numbers, 1 without it.
    fn means(&mut self, info: Option<&TextureInfo>) -> Vec3 {
        let shown = info.and_then(|info| self.picture(info, Use::Numbers));
        if shown.is_some() {
            self.remark(
                Unsupported,
                "textures of roughness, metal, gloss and transmission are taken by their means in these materials",
            );
        }
        shown.map_or(Vec3::ONE, |shown| shown.numbers)
    }

    /// A picture; a missing or broken one is a warning.
    fn picture(&mut self, info: &TextureInfo, purpose: Use) -> Option<Shown> {
        let (name, shown) = self
            .materials
            .pictures
            .read(info, purpose, self.buffers, self.builder);
        match shown {
            Ok(shown) => Some(shown),
            Err(reason) => {
                let said = format!("texture '{name}' {reason}; the plain colour is used");
                self.materials.log.note(TextureMissing, &said, "", 0);
                None
            }
        }
    }

    fn remark(&mut self, kind: WarningKind, what: &'static str) {
        self.materials.remarks.add(kind, what, &self.name);
    }
}

/// A factor within 0…1; 1 where it is no number.
fn share(factor: f64) -> f32 {
    if factor.is_nan() {
        return 1.0;
    }
    factor.clamp(0.0, 1.0) as f32
}
