//! The tests, one by one.

use std::{f64::consts::PI, sync::Arc};

use glam::{DVec3, Vec2, Vec3};

use super::{
    super::{claim::Claim, light::power_by_side, lit::Lit},
    Check, Deviations, Law, ONE_REFLECTANCE, Verdict,
    measures::material_name,
    survey::arrival,
    table::per_cent,
};
use crate::{
    geometry::{RayTree, low_discrepancy_2d, triangle_point},
    reference::ReferencePoint,
    scene::{Environment, MaterialId, Placement, Scene, Sky, TriangleId},
    solver::Cancel,
};

/// Lamps that are lit alone; of more, several together.
const MOST_LAMPS: usize = 8;

/// Part of the points that may be without light in a copy: on faces that touch others within the rounding of coordinates.
/// Much larger, and lost faces go unnoticed.
const MOST_UNMATCHED: f64 = 0.02;

/// Part of the points that must be free of black backs for their light to tell about the scene.
const LEAST_FREE: f64 = 0.1;

/// Points of all surfaces at which pictures of what emits are looked up: a small bright part of one of a few is known to a
/// thousandth.
const EMISSION_POINTS: f64 = (1u32 << 20) as f64;

/// Points of each triangle at least.
const LEAST_EMISSION_POINTS: f64 = 64.0;

/// How far above a surface its counterpart in a copy is looked for, frame units: more than rounding, less than thin things.
const LOOKUP_HEIGHT: f32 = 2e-3;

/// Why a test has no verdict.
pub(super) enum Trouble {
    /// It was told to stop.
    Stopped,
    /// It says nothing about this scene; why.
    NotApplicable(String),
}

/// What a test found.
#[derive(Default)]
pub(super) struct Finding {
    pub(super) claim: Option<Claim>,
    pub(super) deviations: Option<Deviations>,
    pub(super) remarks: Vec<String>,
    pub(super) is_cut_short: bool,
}

/// A test in progress.
pub(super) struct Trial<'a> {
    check: &'a Check,
    cancel: &'a Cancel,
    pub(super) finding: Finding,
}

/// Something that gives light.
#[derive(Clone, Copy, PartialEq)]
enum Lamp {
    Material(MaterialId),
    Sky,
    Sun,
}

impl<'a> Trial<'a> {
    pub(super) fn new(check: &'a Check, cancel: &'a Cancel) -> Self {
        Self {
            check,
            cancel,
            finding: Finding::default(),
        }
    }

    pub(super) fn test(&mut self, law: &Law) -> Result<Verdict, Trouble> {
        match law {
            Law::EvenLight => self.even_light(),
            Law::MeanLight => self.mean_light(),
            Law::Copy { placement, .. } => self.copy(placement),
            Law::Superposition => self.superposition(),
        }
    }

    fn even_light(&mut self) -> Result<Verdict, Trouble> {
        let Check {
            subject,
            survey,
            rays,
            everywhere,
            ..
        } = self.check;
        let even = Arc::new(subject.scene.evenly_lit());
        let sees_backs = survey
            .sees_backs(&even, rays, everywhere, subject.settings.seed, self.cancel)
            .ok_or(Trouble::Stopped)?;
        let free: Vec<ReferencePoint> = everywhere
            .iter()
            .zip(sees_backs)
            .filter_map(|(point, sees)| (!sees).then_some(*point))
            .collect();
        let (all, free_count) = (everywhere.len(), free.len());
        if (free_count as f64) < LEAST_FREE * all as f64 {
            let share = 100 * (all - free_count) / all.max(1);
            return Err(Trouble::NotApplicable(format!(
                "{share} % of the surface sees black backs of one-sided faces; --sides two has none"
            )));
        }
        if free_count < all {
            self.finding.remarks.push(format!(
                "{} of {all} points see black backs of one-sided faces and do not count",
                all - free_count
            ));
        }
        let lit = self.light(&even)?;
        let expected = vec![Some(Vec3::splat(PI as f32 * even.radiance_unit)); free_count];
        self.compare(&free, &expected, &lit.irradiance(&free))
    }

    fn mean_light(&mut self) -> Result<Verdict, Trouble> {
        if let Some(why) = self.check.survey.opening() {
            return Err(Trouble::NotApplicable(why));
        }
        let (scene, survey) = (&self.check.subject.scene, &self.check.survey);
        let shines = |triangle: TriangleId| {
            let emits = scene.surfaces[triangle.index()].emission != Vec3::ZERO;
            let is_lit_from_it = |is_back| !survey.is_apart(triangle, is_back);
            emits && (is_lit_from_it(false) || is_lit_from_it(true))
        };
        let emission = (!scene.triangle_ids().any(shines)).then_some(Vec3::ONE);
        if emission.is_some() {
            let remark = "nothing within emits, so all of it does here";
            self.finding.remarks.push(remark.to_owned());
        }
        let painted = Arc::new(scene.with_one_reflectance(ONE_REFLECTANCE, emission));
        let lit = self.light(&painted)?;
        // What absorbs light, by the part of it that is met.
        let weight = |triangle: TriangleId, is_back: bool| {
            let opacity = painted.surfaces[triangle.index()].opacity;
            let counts = !survey.is_apart(triangle, is_back);
            if counts { f64::from(opacity) } else { 0.0 }
        };
        let areas = painted.surfaces.iter().map(|surface| surface.area_vector);
        let whole: f64 = areas.map(|area| f64::from(area.length())).sum();
        let (mut power, mut area) = (DVec3::ZERO, 0.0);
        for triangle in painted.triangle_ids() {
            let surface = &painted.surfaces[triangle.index()];
            let own = f64::from(surface.area_vector.length());
            let emission = mean_emission(&painted, triangle, own / whole);
            let sides = 1 + usize::from(painted.triangles[triangle.index()].two_sided);
            for is_back in [false, true].into_iter().take(sides) {
                area += own * weight(triangle, is_back);
                if !survey.is_apart(triangle, is_back) {
                    power += emission * (PI * own);
                }
            }
        }
        let arriving = power_by_side(&lit.snapshot, |triangle, is_back| {
            DVec3::splat(weight(triangle, is_back))
        });
        let mean =
            |power: DVec3| power.element_sum() / 3.0 / area * f64::from(painted.radiance_unit);
        let expected = mean(power) / (1.0 - f64::from(ONE_REFLECTANCE));
        let limit = self.check.limit();
        let claim = Claim::near(
            "mean E of what encloses light",
            expected,
            mean(arriving),
            limit,
        );
        let verdict = verdict(&claim, "the mean irradiance", "");
        self.finding.claim = Some(claim);
        Ok(verdict)
    }

    fn copy(&mut self, placement: &Placement) -> Result<Verdict, Trouble> {
        let own = self.own()?;
        let subject = &self.check.subject;
        let up = subject.scene.up;
        let options = placement.options(subject.options, up);
        let copy = placement.faces(subject.faces.clone(), up).finish(&options);
        let copy = copy.map_err(|error| Trouble::NotApplicable(format!("the copy: {error}")))?;
        let lighting = placement.lighting(&subject.scene, &subject.lighting);
        let copy = Arc::new(lighting.apply(copy));
        let lit = self.light(&copy)?;
        let points = &self.check.points;
        let rays = RayTree::new(&copy);
        let there: Vec<Option<ReferencePoint>> = points
            .iter()
            .map(|point| counterpart(&subject.scene, point, placement, &copy, &rays))
            .collect();
        let known: Vec<ReferencePoint> = there.iter().copied().flatten().collect();
        let mut light = lit.irradiance(&known).into_iter();
        let found: Vec<Option<Vec3>> = there
            .iter()
            .map(|point| point.and_then(|_| light.next().flatten()))
            .collect();
        self.compare(points, own, &found)
    }

    fn superposition(&mut self) -> Result<Verdict, Trouble> {
        let scene = &self.check.subject.scene;
        let lamps = lamps(scene);
        if lamps.len() < 2 {
            let why = match lamps.len() {
                0 => "there is no light",
                _ => "there is one lamp only",
            };
            return Err(Trouble::NotApplicable(why.to_owned()));
        }
        let own = self.own()?;
        let points = &self.check.points;
        let groups = lamps.len().min(MOST_LAMPS);
        let mut sum = vec![Some(Vec3::ZERO); points.len()];
        for group in 0..groups {
            let lit: Vec<Lamp> = lamps.iter().copied().skip(group).step_by(groups).collect();
            let lit = self.light(&Arc::new(lit_by(scene, &lit)))?;
            for (sum, part) in sum.iter_mut().zip(lit.irradiance(points)) {
                *sum = sum.zip(part).map(|(sum, part)| sum + part);
            }
        }
        let name = |lamp: &Lamp| match *lamp {
            Lamp::Material(material) => material_name(scene, material),
            Lamp::Sky => "the sky".to_owned(),
            Lamp::Sun => "the sun".to_owned(),
        };
        self.finding.remarks.push(if lamps.len() > MOST_LAMPS {
            format!("{} lamps in {groups} groups", lamps.len())
        } else {
            let names: Vec<String> = lamps.iter().map(name).collect();
            format!("lamps: {}", names.join(", "))
        });
        self.compare(points, own, &sum)
    }

    /// Irradiance of the scene itself.
    fn own(&mut self) -> Result<&'a [Option<Vec3>], Trouble> {
        let check = self.check;
        if check.own.get().is_none() {
            let lit = self.light(&check.subject.scene)?;
            let light = (lit.irradiance(&check.points), lit.is_full);
            check.own.get_or_init(|| light);
        }
        let (own, is_full) = check.own.get().ok_or(Trouble::Stopped)?;
        self.finding.is_cut_short |= is_full;
        Ok(own)
    }

    fn light(&mut self, scene: &Arc<Scene>) -> Result<Lit, Trouble> {
        let lit = (self.check.light)(scene, self.cancel).ok_or(Trouble::Stopped)?;
        self.finding.is_cut_short |= lit.is_full;
        Ok(lit)
    }

    /// Compare light at points.
    fn compare(
        &mut self,
        points: &[ReferencePoint],
        expected: &[Option<Vec3>],
        found: &[Option<Vec3>],
    ) -> Result<Verdict, Trouble> {
        let scene = &self.check.subject.scene;
        let deviations = Deviations::of(scene, points, expected, found)
            .ok_or_else(|| Trouble::NotApplicable("no light falls on its surfaces".to_owned()))?;
        let claim = Claim {
            quantity: format!("E at {} points", deviations.points),
            expected: deviations.expected,
            found: deviations.found,
            deviation: deviations.trimmed_rms,
            allowed: self.check.limit(),
        };
        let (lost, all) = (deviations.unmatched as f64, points.len() as f64);
        let verdict = if lost > MOST_UNMATCHED * all {
            let share = 100.0 * lost / all;
            Verdict::Fails(format!("no light is found at {share:.0} % of the points"))
        } else {
            verdict(&claim, "the irradiance", &deviations.remark())
        };
        self.finding.remarks.insert(0, deviations.remark());
        self.finding.claim = Some(claim);
        self.finding.deviations = Some(deviations);
        Ok(verdict)
    }
}

fn verdict(claim: &Claim, what: &str, remark: &str) -> Verdict {
    if claim.holds() {
        return Verdict::Holds;
    }
    let [off, most] = [claim.deviation, claim.allowed].map(per_cent);
    let colon = if remark.is_empty() { "" } else { ": " };
    Verdict::Fails(format!(
        "{what} is off by {off}, more than {most}{colon}{remark}"
    ))
}

/// Emitted radiance of a triangle, the mean over all of it, which takes a part of the area of the scene. Pictures are looked
/// up at points, more closely than for the means that solves begin with.
fn mean_emission(scene: &Scene, triangle: TriangleId, part: f64) -> DVec3 {
    let emission = scene.surfaces[triangle.index()].emission.as_dvec3();
    if emission == DVec3::ZERO || !scene.is_textured(triangle) {
        return emission;
    }
    let count = (part * EMISSION_POINTS).max(LEAST_EMISSION_POINTS) as u32;
    let at = |index: u32| {
        let at = triangle_point(low_discrepancy_2d(index, Vec2::ZERO));
        (scene.emission_at(triangle, at) * scene.opacity_at(triangle, at)).as_dvec3()
    };
    (0..count).map(at).sum::<DVec3>() / f64::from(count)
}

/// All that gives light in a scene.
fn lamps(scene: &Scene) -> Vec<Lamp> {
    let mut emits = vec![false; scene.materials.len()];
    for (triangle, surface) in scene.triangles.iter().zip(&scene.surfaces) {
        emits[triangle.material.index()] |= surface.emission != Vec3::ZERO;
    }
    let materials = (0..).map(MaterialId).zip(emits);
    let mut lamps: Vec<Lamp> = materials
        .filter_map(|(material, emits)| emits.then_some(Lamp::Material(material)))
        .collect();
    let environment = &scene.environment;
    lamps.extend((!environment.sky.is_dark()).then_some(Lamp::Sky));
    let has_sun = environment
        .sun
        .is_some_and(|sun| sun.irradiance != Vec3::ZERO);
    lamps.extend(has_sun.then_some(Lamp::Sun));
    lamps
}

/// The scene with only some of its lamps on.
fn lit_by(scene: &Scene, lamps: &[Lamp]) -> Scene {
    let mut appearances = scene.appearances();
    for (material, appearance) in (0..).map(MaterialId).zip(&mut appearances) {
        if !lamps.contains(&Lamp::Material(material)) {
            appearance.emission = Vec3::ZERO;
        }
    }
    let mut lit = scene.relit(&appearances);
    let all = &scene.environment;
    lit.environment = Arc::new(Environment {
        sky: match lamps.contains(&Lamp::Sky) {
            true => all.sky.clone(),
            false => Sky::Dark,
        },
        sun: all.sun.filter(|_| lamps.contains(&Lamp::Sun)),
        is_default: all.is_default,
    });
    lit
}

/// The same point of a copy; `None` where another surface is nearer, or none is there.
fn counterpart(
    scene: &Scene,
    point: &ReferencePoint,
    placement: &Placement,
    copy: &Scene,
    rays: &RayTree,
) -> Option<ReferencePoint> {
    let world = placement.point(scene.frame.to_world(point.position), scene.up);
    let normal = placement
        .direction(point.normal.as_dvec3(), scene.up)
        .as_vec3();
    let above = copy.frame.from_world(world) + normal * LOOKUP_HEIGHT;
    let hit = rays.closest_shown(above, -normal, None)?;
    let is_near = (hit.distance - LOOKUP_HEIGHT).abs() < 0.5 * LOOKUP_HEIGHT;
    let found = arrival(copy, above, -normal, hit)?;
    (is_near && found.normal.dot(normal) > 0.99).then_some(found)
}
