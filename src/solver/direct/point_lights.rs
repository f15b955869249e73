//! Direct light at points apart from the mesh, shared with pictures.

use std::{
    fmt::{self, Debug},
    ops::Range,
    sync::Arc,
};

use glam::{Vec3, Vec4};

use super::{fields::DirectFields, lights::Lights, samples::DirectLight, shooting::Shot};
use crate::{
    geometry::{RayTree, Shuffle},
    hierarchy::Channels as _,
    solver::{
        output::{DirectLights, LightSampler, LitPoint, SampledLight},
        places::Receiver,
    },
};

/// The lights of a solve.
struct PointLights {
    lights: Vec<Arc<Lights>>,
    rays: Arc<RayTree>,
}

impl DirectFields {
    /// The light of all fields as it is now, with what shadows it.
    pub(crate) fn shared(&self, rays: &Arc<RayTree>) -> Arc<dyn DirectLights> {
        let lights = self.lights().cloned().collect();
        let rays = rays.clone();
        Arc::new(PointLights { lights, rays })
    }
}

impl Debug for PointLights {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lights = &self.lights;
        formatter
            .debug_struct("PointLights")
            .field("lights", lights)
            .finish_non_exhaustive()
    }
}

impl DirectLights for PointLights {
    fn sampler(&self) -> Box<dyn LightSampler + '_> {
        let parts = self.lights.iter().map(|lights| Part {
            lights,
            shot: Shot::default(),
            exact: Vec4::ZERO,
            normal: None,
        });
        Box::new(Sampler {
            rays: &self.rays,
            parts: parts.collect(),
        })
    }

    fn has_emitters(&self) -> bool {
        self.lights.iter().any(|lights| !lights.is_outside())
    }
}

/// See [`LightSampler`].
struct Sampler<'a> {
    rays: &'a RayTree,
    parts: Vec<Part<'a>>,
}

/// One kind of light, at the present point.
struct Part<'a> {
    lights: &'a Lights,
    shot: Shot,
    /// Unoccluded irradiance, and the normal that it is for.
    exact: Vec4,
    normal: Option<Vec3>,
}

impl LightSampler for Sampler<'_> {
    fn light(&mut self, point: &LitPoint, samples: Range<u32>, shuffle: Shuffle) -> SampledLight {
        let receiver = Receiver {
            point: point.position,
            normal: point.normal,
            triangle: point.triangle,
        };
        let mut light = SampledLight::default();
        for part in &mut self.parts {
            // Light from outside depends on the normal alone.
            let is_known = part.lights.is_outside() && part.normal == Some(point.normal);
            if !is_known {
                part.exact = part.lights.unoccluded(&receiver, None, &mut part.shot.cut);
                part.normal = Some(point.normal);
            }
            light.unoccluded += part.exact.color();
        }
        if self.rays.is_clear() {
            return light;
        }
        let visible = visible(point.expected, light.unoccluded).extend(1.0);
        for part in &mut self.parts {
            if part.exact == Vec4::ZERO {
                continue;
            }
            let shadow = &mut light.shadows[part.lights.kind() as usize];
            let mut light = DirectLight::expected(part.exact);
            let (shot, rays) = (&mut part.shot, samples.clone());
            part.lights
                .shoot_at(self.rays, &receiver, rays, shuffle, shot, &mut light);
            // What little of an image is seen does not follow from what is seen of all light.
            let irradiance = match part.lights.is_mirrored() {
                true => light.irradiance(),
                false => light.irradiance_near(visible, samples.len() as u32),
            };
            let blocked = &shot.blocked;
            shadow.missing += (part.exact - irradiance).color();
            shadow.variance += light.error().powi(2);
            let sharpness = blocked.sharpness / blocked.count.max(1) as f32;
            shadow.sharpness = shadow.sharpness.max(sharpness);
        }
        light
    }
}

/// The part of the unoccluded light that is visible where this much is expected, by colour, 0…1.
fn visible(expected: Vec3, unoccluded: Vec3) -> Vec3 {
    let part = |expected: f32, all: f32| {
        if all > 0.0 {
            (expected / all).clamp(0.0, 1.0)
        } else {
            1.0
        }
    };
    Vec3::new(
        part(expected.x, unoccluded.x),
        part(expected.y, unoccluded.y),
        part(expected.z, unoccluded.z),
    )
}
