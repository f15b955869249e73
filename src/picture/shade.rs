//! Rays from the eye, through what they pass and over mirrors, gloss and glass, to what they show.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::{
    Subject,
    film::{Sample, Unlit},
    sampler::Chances,
    surface::{LitScene, Surface},
    turn::Lobe,
};
use crate::{
    geometry::Hit,
    scene::{Sky, Specular, TriangleId, luminance},
};

/// Surfaces that a ray passes through at most. Fewer, and leaves behind leaves are black; more take time.
const MOST_PASSED: u32 = 64;

/// What passes below which a ray ends. Larger is seen behind many panes; smaller takes time.
const LEAST_PASSING: f32 = 1e-3;

/// What arrives below which one of several rays goes on by chance, for all of them. Larger is noisy in glass; smaller follows
/// many rays that show little.
const BY_CHANCE: f32 = 0.05;

/// Mirrors, gloss and glass on the way of a ray at most; the last one counts as diffuse. Fewer darken facing mirrors and what
/// lies behind glass; more take time there.
const MOST_TURNS: u32 = 24;

/// Gloss on the way of a ray at most; the next one counts as diffuse. Fewer blur what gloss shows of gloss; more are noisy.
const MOST_BLURS: u32 = 2;

/// Rays of the first gloss on the way of a ray. Fewer leave grain on rough metal; more take time there.
const GLOSS_RAYS: u32 = 4;

/// A surface that a ray from the eye shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    pub(super) surface: Surface,
    /// The part of its radiance that arrives, by channel.
    part: Vec3,
    /// The part of its emission that counts of that: gloss samples emitters as well.
    emitting: f32,
    /// Length of the way from the eye.
    length: f32,
    /// Whether gloss lies between.
    is_blurred: bool,
    /// Whether what it reflects in other ways counts as diffuse.
    is_matt: bool,
}

/// What a ray from the eye shows.
#[derive(Clone, Debug, Default)]
pub(super) struct Sight {
    surfaces: Vec<Shown>,
    /// Radiance from outside that arrives.
    outside: Vec3,
    /// Radiance of lamps and the sun that gloss reflects.
    highlights: Vec3,
    unlit: Unlit,
    /// Rays that are still to be followed.
    pending: Vec<Leg>,
}

/// A ray of a way from the eye.
#[derive(Clone, Copy, Debug)]
struct Leg {
    origin: Vec3,
    direction: Vec3,
    from: Option<TriangleId>,
    passing: Vec3,
    length: f32,
    turns: u32,
    blurs: u32,
    /// Roughness of the gloss on its way: what lies behind seems as rough at least (Kaplanyan and Dachsbacher, "Path Space
    /// Regularization for Holistic and Robust Light Transport", 2013).
    roughness: f32,
    /// Where gloss chose its direction, nothing or one plane mirror lying between.
    chosen: Option<Chosen>,
}

/// A direction that gloss chose.
#[derive(Clone, Copy, Debug)]
struct Chosen {
    /// Density of the choice, 1/sr.
    density: f32,
    /// Length of the way since.
    length: f32,
    is_mirrored: bool,
}

/// What a ray meets, as the eye sees it.
enum Met {
    /// It is looked through.
    Nothing,
    Back,
    Surface(Surface),
}

/// What rays from the eye see.
#[derive(Clone, Copy)]
pub(super) struct Seen<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) lit: &'a LitScene<'a>,
}

impl Sight {
    /// Follow a ray.
    pub(super) fn follow(
        &mut self,
        seen: Seen<'_>,
        origin: Vec3,
        direction: Vec3,
        mut chances: Chances,
    ) {
        self.surfaces.clear();
        (self.outside, self.highlights) = (Vec3::ZERO, Vec3::ZERO);
        self.unlit = Unlit::default();
        self.pending.clear();
        self.pending.push(Leg {
            origin,
            direction,
            from: None,
            passing: Vec3::ONE,
            length: 0.0,
            turns: 0,
            blurs: 0,
            roughness: 0.0,
            chosen: None,
        });
        while let Some(leg) = self.pending.pop() {
            self.follow_leg(seen, leg, &mut chances);
        }
    }

    /// Follow a ray to where it ends or turns.
    fn follow_leg(&mut self, seen: Seen<'_>, mut leg: Leg, chances: &mut Chances) {
        for _ in 0..MOST_PASSED {
            let mean = leg.passing.element_sum() / 3.0;
            let rays = seen.lit.rays;
            let Some(hit) = rays.closest_shown(leg.origin, leg.direction, leg.from) else {
                match seen.outside(leg.direction) {
                    Some(radiance) => self.outside += leg.passing * radiance,
                    None => self.unlit.background += mean,
                }
                return;
            };
            leg.length += hit.distance;
            if let Some(chosen) = &mut leg.chosen {
                chosen.length += hit.distance;
            }
            match seen.met(&leg, hit) {
                Met::Nothing => {}
                Met::Back => {
                    self.unlit.back += mean;
                    return;
                }
                Met::Surface(surface) => {
                    if !self.show(seen, &mut leg, surface, hit, chances) {
                        return;
                    }
                }
            }
            leg.origin += leg.direction * hit.distance;
            leg.from = Some(hit.triangle);
        }
    }

    /// Show a surface on the way of a ray. Whether something passes straight on.
    fn show(
        &mut self,
        seen: Seen<'_>,
        leg: &mut Leg,
        surface: Surface,
        hit: Hit,
        chances: &mut Chances,
    ) -> bool {
        let passed = seen.passed(hit.triangle);
        let part = leg.passing * (1.0 - passed.element_sum() / 3.0);
        let specular = surface
            .specular
            .filter(|_| leg.turns < MOST_TURNS && !seen.subject.is_unlit);
        let is_blurred = leg.blurs > 0;
        // Behind gloss, light passes straight through glass, as it does where gloss samples emitters.
        let specular = specular.filter(|specular| match specular {
            Specular::Mirror { .. } => true,
            Specular::Gloss { .. } => leg.blurs < MOST_BLURS,
            Specular::Glass { .. } => !is_blurred,
        });
        let emitting = match leg.chosen {
            Some(chosen) => {
                let Chosen {
                    density, length, ..
                } = chosen;
                let lit = seen.lit;
                lit.share_of_ray(&surface, leg.direction, density, length)
            }
            // The few lamps that gloss sees over curved mirrors would be specks.
            None if is_blurred => 0.0,
            None => 1.0,
        };
        self.surfaces.push(Shown {
            surface,
            part,
            emitting,
            length: leg.length,
            is_blurred,
            is_matt: specular.is_none(),
        });
        let material = seen.lit.scene.material(hit.triangle);
        let mut onward = *leg;
        (onward.origin, onward.from) = (surface.position, Some(hit.triangle));
        onward.turns += 1;
        onward.chosen = None;
        let color = part * material.share_of_met();
        match specular {
            None => {}
            Some(Specular::Mirror { reflectance }) => {
                onward.direction = surface.mirrored(leg.direction);
                let is_first = |chosen: &Chosen| !chosen.is_mirrored;
                let is_plane = seen.lit.rays.follows(hit.triangle);
                let chosen = leg.chosen.filter(is_first).filter(|_| is_plane);
                onward.chosen = chosen.map(|chosen| Chosen {
                    is_mirrored: true,
                    ..chosen
                });
                onward.passing = color * reflectance;
                self.go_on(onward, chances);
            }
            Some(Specular::Gloss {
                reflectance,
                roughness,
            }) => {
                let roughness = roughness.hypot(leg.roughness).min(1.0);
                let lobe = surface.lobe(roughness, leg.direction);
                let count = if is_blurred { 1 } else { GLOSS_RAYS };
                let color = color * reflectance / count as f32;
                onward.blurs += 1;
                onward.roughness = roughness;
                for _ in 0..count {
                    self.highlights += color * seen.highlights(&surface, &lobe, chances);
                    if let Some((direction, weight, density)) = lobe.sample(chances.square()) {
                        onward.direction = direction;
                        onward.passing = color * weight;
                        onward.chosen = Some(Chosen {
                            density,
                            length: 0.0,
                            is_mirrored: false,
                        });
                        self.go_on(onward, chances);
                    }
                }
            }
            Some(Specular::Glass { index, is_thin }) => {
                let glass = leg.passing * (1.0 - material.opacity);
                let ways = surface.through_glass(leg.direction, index, is_thin, material.filter);
                for (direction, part) in ways {
                    onward.direction = direction;
                    onward.passing = glass * part;
                    self.go_on(onward, chances);
                }
                return false;
            }
        }
        leg.passing *= passed;
        leg.passing.max_element() >= LEAST_PASSING
    }

    /// Follow a ray later; by chance where little of it arrives.
    fn go_on(&mut self, mut leg: Leg, chances: &mut Chances) {
        let most = leg.passing.max_element();
        if most <= 0.0 {
            return;
        }
        if most < BY_CHANCE {
            let chance = most / BY_CHANCE;
            if chances.choice().0 as f32 >= chance {
                return;
            }
            leg.passing /= chance;
        }
        self.pending.push(leg);
    }

    /// The surface of which most arrives that is reflected, and the length of the way to it.
    pub(super) fn main_surface(&self) -> Option<(&Surface, f32)> {
        let weight = |shown: &&Shown| luminance(shown.surface.reflectance * shown.part);
        let sharp = self.surfaces.iter().filter(|shown| !shown.is_blurred);
        let lit = sharp.filter(|shown| weight(shown) > 0.0);
        let main = lit.max_by(|a, b| weight(a).total_cmp(&weight(b)));
        main.map(|shown| (&shown.surface, shown.length))
    }

    /// What is seen where the surfaces get this irradiance.
    pub(super) fn sample(
        &self,
        seen: Seen<'_>,
        mut irradiance: impl FnMut(&Surface) -> Vec3,
    ) -> Sample {
        let (mut reflected, mut emitted) = (self.highlights, self.outside);
        for shown in &self.surfaces {
            let surface = &shown.surface;
            let reflectance = match shown.is_matt {
                true => seen.lit.reflectance(surface),
                false => surface.reflectance,
            };
            if reflectance != Vec3::ZERO {
                let radiance = reflectance * FRAC_1_PI * irradiance(surface);
                reflected += shown.part * radiance.max(Vec3::ZERO);
            }
            emitted += shown.part * surface.emission * shown.emitting;
        }
        Sample {
            radiance: reflected + emitted,
            is_source: luminance(emitted) > luminance(reflected),
            unlit: self.unlit,
        }
    }
}

impl Seen<'_> {
    /// Radiance from outside; `None` where the background is seen instead.
    fn outside(&self, direction: Vec3) -> Option<Vec3> {
        let environment = &self.lit.scene.environment;
        match &environment.sky {
            Sky::Dark => None,
            _ if environment.is_default => None,
            sky => Some(sky.radiance(direction)),
        }
    }

    /// What the eye sees of what a ray meets. What it looks through itself, mirrors show.
    fn met(&self, leg: &Leg, hit: Hit) -> Met {
        let (normal, is_back) = self.lit.side(hit.triangle, leg.direction);
        let position = leg.origin + leg.direction * hit.distance;
        let hidden = self.subject.hidden.filter(|_| leg.turns == 0);
        if hidden.is_some_and(|hides| hides(position, normal)) {
            return Met::Nothing;
        }
        match self.lit.surface(leg.origin, leg.direction, hit) {
            Some(surface) => Met::Surface(surface),
            None if is_back && !self.subject.shows_backs => Met::Nothing,
            None => Met::Back,
        }
    }

    /// The part of the light that passes through a triangle where it is not cut out.
    fn passed(&self, triangle: TriangleId) -> Vec3 {
        match self.lit.rays.is_see_through(triangle) {
            true => self.lit.scene.material(triangle).transmission(),
            false => Vec3::ZERO,
        }
    }

    /// What gloss reflects from the sun, from a point of an emitter, and from one of its image in each mirror, as radiance; its
    /// colour apart.
    fn highlights(&self, surface: &Surface, lobe: &Lobe, chances: &mut Chances) -> Vec3 {
        let mut sum = Vec3::ZERO;
        self.lit.arriving_from_lamps(
            surface.as_start(),
            |direction| lobe.toward(direction),
            || chances.choice(),
            |arriving| sum += arriving.light,
        );
        sum
    }
}
