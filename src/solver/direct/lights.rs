//! Direct light at points: irradiance from the emitters, from the sky, or from the sun, by exact form factors.
//!
//! The unoccluded irradiance of the emitters is exact, that of many far ones together nearly so (see `light_tree`).
//! Shadow rays only estimate its visible fraction (see `shooting`).

use std::{f32::consts::PI, sync::Arc};

use glam::{Vec3, Vec4};

use super::{
    emitter::Emitter,
    light_tree::{Arriving, LightTree},
    panel::panels,
    sky::SkyTree,
    sky_guide::SkyGuide,
    sun::SunDisc,
};
use crate::{
    geometry::Image,
    hierarchy::{Hierarchy, Reading},
    scene::{MaterialId, Scene, Sky, Sun, TriangleId},
    solver::{Direct, places::Receiver},
    transport::luminance,
};

/// A kind of light that is sampled; as a number, its place among the kinds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightKind {
    Emitters,
    Sky,
    Sun,
}

/// What gives the light.
#[derive(Clone, Debug)]
pub(super) enum Source {
    Emitters(LightTree),
    Sky(SkyTree, Guidance),
    Sun(SunDisc),
}

/// Where places that see little of the sky see it.
#[derive(Clone, Debug)]
pub(super) enum Guidance {
    /// Nothing was learnt yet.
    Unknown,
    /// No place needs a guide, or none is known.
    None,
    Known(SkyGuide),
}

/// The light of one kind that is sampled: that of all emitters, of the sky, or of the sun.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    pub(super) source: Source,
    /// Largest radiosity by channel, or largest irradiance from outside: no irradiance can be larger.
    brightest: Vec4,
    /// Patches whose emission is sampled; empty for light from outside.
    is_sampled: Vec<bool>,
    /// The image in which this light is seen, where it comes over mirrors.
    pub(super) image: Option<Arc<Image>>,
}

impl Lights {
    /// The active emitting patches of a hierarchy; `None` if there are none, or if emission is linked.
    pub(super) fn of_emitters(scene: &Scene, hierarchy: &Hierarchy, mode: Direct) -> Option<Self> {
        let is_sampled: Vec<bool> = hierarchy
            .patches
            .iter()
            .enumerate()
            .map(|(index, patch)| {
                let is_seen = hierarchy.active_patches().contains(&index);
                is_seen && patch.emission != Vec3::ZERO && mode != Direct::Linked
            })
            .collect();
        let sampled = (0..is_sampled.len()).filter(|&patch| is_sampled[patch]);
        let emitters: Vec<Emitter> = sampled
            .flat_map(|patch| hierarchy.emitting_parts(patch))
            .map(|part| Emitter::new(scene, hierarchy, part))
            .collect();
        (!emitters.is_empty()).then(|| Self::of(&emitters, is_sampled))
    }

    fn of(emitters: &[Emitter], is_sampled: Vec<bool>) -> Self {
        let (emitters, panels) = panels(emitters);
        Self {
            brightest: brightest(&emitters),
            source: Source::Emitters(LightTree::new(&emitters, &panels)),
            is_sampled,
            image: None,
        }
    }

    /// The sky; `None` if it is dark. With a reading its unoccluded irradiance is that of a directional table.
    pub(super) fn of_sky(sky: &Sky, reading: Option<Reading>) -> Option<Self> {
        let tree = SkyTree::new(sky, reading)?;
        Some(Self {
            brightest: tree.brightest(),
            source: Source::Sky(tree, Guidance::Unknown),
            is_sampled: Vec::new(),
            image: None,
        })
    }

    /// The sun; `None` if it is dark. The reading as in [`Self::of_sky`].
    pub(super) fn of_sun(sun: &Sun, reading: Option<Reading>) -> Option<Self> {
        let disc = SunDisc::new(sun, reading)?;
        Some(Self {
            brightest: disc.brightest(),
            source: Source::Sun(disc),
            is_sampled: Vec::new(),
            image: None,
        })
    }

    /// The same light as an image shows it.
    pub(super) fn in_image(&self, image: &Arc<Image>) -> Self {
        let mut source = self.source.clone();
        if let Source::Sky(_, guidance) = &mut source {
            *guidance = Guidance::None;
        }
        Self {
            source,
            brightest: self.brightest * image.reflectance().extend(1.0),
            is_sampled: Vec::new(),
            image: Some(image.clone()),
        }
    }

    /// Whether it comes over mirrors.
    pub(super) fn is_mirrored(&self) -> bool {
        self.image.is_some()
    }

    /// Its kind.
    pub(super) fn kind(&self) -> LightKind {
        match self.source {
            Source::Emitters(_) => LightKind::Emitters,
            Source::Sky(..) => LightKind::Sky,
            Source::Sun(_) => LightKind::Sun,
        }
    }

    /// A receiver as the light sees it.
    pub(super) fn facing(&self, receiver: &Receiver) -> Receiver {
        match &self.image {
            None => *receiver,
            Some(image) => Receiver {
                point: image.source_of(receiver.point),
                normal: image.source_direction(receiver.normal),
                ..*receiver
            },
        }
    }

    /// Whether it comes from outside the scene.
    pub(super) fn is_outside(&self) -> bool {
        !matches!(self.source, Source::Emitters(_))
    }

    /// As [`SkyTree::even_radiosity`]; `None` for other light.
    pub(super) fn even_radiosity(&self) -> Option<f32> {
        match &self.source {
            Source::Sky(sky, _) if !self.is_mirrored() => sky.even_radiosity(),
            Source::Sky(..) | Source::Emitters(_) | Source::Sun(_) => None,
        }
    }

    /// The emitters; none for light from outside.
    fn emitters(&self) -> &[Emitter] {
        match &self.source {
            Source::Emitters(tree) => &tree.emitters,
            Source::Sky(..) | Source::Sun(_) => &[],
        }
    }

    /// The emitters for whose materials `emission` gives an emitted radiance, with that radiance times their texture.
    pub(super) fn repainted(&self, emission: impl Fn(MaterialId) -> Option<Vec3>) -> Self {
        let emitters: Vec<Emitter> = self
            .emitters()
            .iter()
            .filter_map(|emitter| {
                let emission = emission(emitter.material)? * emitter.texture;
                let radiosity = (emission * PI).extend(0.0);
                Some(Emitter {
                    radiosity,
                    ..*emitter
                })
            })
            .collect();
        let repainted = Self::of(&emitters, self.is_sampled.clone());
        match &self.image {
            None => repainted,
            Some(image) => repainted.in_image(image),
        }
    }

    /// The irradiance, bounded by the largest radiosity: with many emitters behind each other, few rays estimate their
    /// visibility badly.
    pub(super) fn bounded(&self, irradiance: Vec4) -> Vec4 {
        irradiance.min(self.brightest)
    }

    /// Largest radiosity of an emitter by channel.
    pub(super) fn brightest(&self) -> Vec4 {
        self.brightest
    }

    /// Whether the emission of a patch is sampled, and so must not be linked.
    pub(crate) fn is_sampled(&self, patch: usize) -> bool {
        self.is_sampled.get(patch) == Some(&true)
    }

    /// The triangles of the emitters.
    pub(super) fn triangles(&self) -> impl Iterator<Item = TriangleId> + '_ {
        self.emitters().iter().map(|emitter| emitter.triangle)
    }

    /// Luminance of the mean irradiance if all light arrives: the power of the emitters per area of the scene, at most
    /// the largest radiosity.
    pub(super) fn mean_power(&self, hierarchy: &Hierarchy) -> f32 {
        let tree = match &self.source {
            Source::Emitters(tree) => tree,
            Source::Sky(sky, _) => return luminance(sky.mean_irradiance()),
            Source::Sun(sun) => return luminance(sun.mean_irradiance()),
        };
        let power = |emitter: &Emitter| f64::from(luminance(emitter.radiosity) * emitter.area);
        let sum: f64 = tree.emitters.iter().map(power).sum();
        let mean = (sum / hierarchy.importance.area.max(f64::MIN_POSITIVE)) as f32;
        mean.min(luminance(self.brightest))
    }

    /// The patches that are sampled.
    pub(crate) fn sampled_patches(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.is_sampled.len()).filter(|&patch| self.is_sampled[patch])
    }

    /// Unoccluded irradiance at a receiver, W/m²; the other arguments as in [`LightTree::unoccluded`].
    pub(super) fn unoccluded(
        &self,
        receiver: &Receiver,
        scale: Option<f32>,
        cut: &mut Vec<Arriving>,
    ) -> Vec4 {
        let receiver = &self.facing(receiver);
        let light = match &self.source {
            Source::Emitters(tree) => tree.unoccluded(receiver, scale, cut),
            Source::Sky(sky, _) => sky.unoccluded(receiver.normal, cut),
            Source::Sun(sun) => sun.unoccluded(receiver.normal, cut),
        };
        match &self.image {
            None => light,
            Some(image) => light * image.reflectance().extend(1.0),
        }
    }
}

/// Largest radiosity by channel.
fn brightest(emitters: &[Emitter]) -> Vec4 {
    emitters
        .iter()
        .fold(Vec4::ZERO, |most, emitter| most.max(emitter.radiosity))
}
