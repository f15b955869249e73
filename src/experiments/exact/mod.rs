//! Light that is known in closed form, at points and as means: the analytical cases of CIE 171:2006, pairs of plates and
//! discs, and closed scenes.
//!
//! A [`Case`] is a scene and what is expected of it; every figure may be off by the error that is asked for, or else by
//! `epsilon` of the settings it is solved with, 0.5 % at the normal preset and 0.2 % at the finest.

mod cie;
mod closed;
mod pairs;
mod points;
mod table;

pub use table::{Row, exact_markdown};

use std::{sync::Arc, time::Instant};

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::{claim::Claim, light::mean_where, lit::Lit};
use crate::{
    metrics::MeshLookup,
    reference::ReferencePoint,
    scene::{BuildError, Environment, Scene, SceneBuilder, SceneOptions, Sides, Sky, TriangleId},
    solver::{Cancel, SolveSettings},
};

/// The origin of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// Analytical cases of CIE 171:2006.
    Cie171,
    /// Two surfaces in black surroundings.
    Pairs,
    /// Light that is the same everywhere, or on average, in closed scenes.
    Closed,
}

impl Group {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cie171 => "cie171",
            Self::Pairs => "pairs",
            Self::Closed => "closed",
        }
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    /// World coordinates.
    position: DVec3,
    /// Unit normal of the side that is lit.
    normal: DVec3,
}

/// A quantity of light.
#[derive(Clone, Debug, PartialEq)]
enum Figure {
    /// Irradiance at a point, W/m².
    IrradianceAt(Spot),
    /// Radiance that leaves a point, W·sr⁻¹·m⁻².
    RadianceAt(Spot),
    /// Mean irradiance of the surfaces of a material, W/m².
    MeanOf(&'static str),
    /// Mean irradiance of all surfaces, W/m².
    MeanOfAll,
    /// The part of it that was reflected before.
    MeanIndirect,
}

/// A figure that is known.
#[derive(Clone, Debug, PartialEq)]
struct Expected {
    /// Its name in tables.
    name: String,
    figure: Figure,
    value: f64,
}

/// A scene whose light is known.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its origin.
    pub group: Group,
    /// Its name; unique.
    pub name: String,
    /// The closed form, in a sentence.
    pub basis: &'static str,
    scene: SceneBuilder,
    /// Radiance of a uniform sky.
    sky: f32,
    expected: Vec<Expected>,
}

/// Why a case found nothing.
#[derive(Debug, thiserror::Error)]
enum Trouble {
    /// It was told to stop.
    #[error("stopped before the end")]
    Stopped,
    /// Its scene cannot be lit.
    #[error(transparent)]
    Build(#[from] BuildError),
}

/// The outcome of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Its origin.
    pub group: Group,
    /// Its name.
    pub case: String,
    /// Its closed form.
    pub basis: &'static str,
    /// All figures; none where it did not finish.
    pub claims: Vec<Claim>,
    /// Why it did not finish.
    pub failure: Option<String>,
    /// Time that it took.
    pub seconds: f64,
}

impl Outcome {
    /// Whether it finished and all its figures are met.
    pub fn holds(&self) -> bool {
        self.failure.is_none() && self.claims.iter().all(Claim::holds)
    }
}

impl Case {
    /// Solve it with these settings on the threads of the caller's pool.
    pub fn run(&self, settings: &SolveSettings, cancel: &Cancel) -> Outcome {
        let begin = Instant::now();
        let (claims, failure) = match self.claims(settings, cancel) {
            Ok(claims) => (claims, None),
            Err(trouble) => (Vec::new(), Some(trouble.to_string())),
        };
        self.outcome(claims, failure, begin.elapsed().as_secs_f64())
    }

    /// Its outcome where it ended by a panic.
    pub fn failed(&self, failure: String, seconds: f64) -> Outcome {
        self.outcome(Vec::new(), Some(failure), seconds)
    }

    fn outcome(&self, claims: Vec<Claim>, failure: Option<String>, seconds: f64) -> Outcome {
        Outcome {
            group: self.group,
            case: self.name.clone(),
            basis: self.basis,
            claims,
            failure,
            seconds,
        }
    }

    fn claims(&self, settings: &SolveSettings, cancel: &Cancel) -> Result<Vec<Claim>, Trouble> {
        let lit = Lit::new(self.finished()?, settings, None, cancel).ok_or(Trouble::Stopped)?;
        let values = self.expected.iter().map(|known| known.value);
        let largest = values.fold(0.0, f64::max);
        let claim = |known: &Expected| {
            let is_some = known.value > 0.0;
            Claim::within(
                known.name.clone(),
                known.value,
                lit.value(&known.figure),
                if is_some { known.value } else { largest },
                f64::from(settings.error.unwrap_or(settings.epsilon)),
            )
        };
        Ok(self.expected.iter().map(claim).collect())
    }

    /// Its scene, one-sided and under its sky.
    fn finished(&self) -> Result<Arc<Scene>, BuildError> {
        let scene = self
            .scene
            .clone()
            .finish(&SceneOptions::with_sides(Sides::One))?;
        Ok(Arc::new(if self.sky > 0.0 {
            scene.in_environment(Environment {
                sky: Sky::Uniform(Vec3::splat(self.sky)),
                ..Environment::default()
            })
        } else {
            scene
        }))
    }
}

impl Lit {
    /// A figure (red); NaN where no surface is.
    fn value(&self, figure: &Figure) -> f64 {
        let light = &self.snapshot.light;
        let mean = |values: &[Vec3], counts: &dyn Fn(TriangleId) -> bool| {
            mean_where(&self.snapshot.mesh, values, counts).x
        };
        let found = match *figure {
            Figure::IrradianceAt(spot) => self
                .at(spot)
                .map_or(f64::NAN, |point| f64::from(point.irradiance.x)),
            Figure::RadianceAt(spot) => self
                .at(spot)
                .map_or(f64::NAN, |point| f64::from(point.radiance().x)),
            Figure::MeanOf(name) => {
                let is_it = |id| self.scene.material(id).name == name;
                mean(&light.irradiance, &is_it)
            }
            Figure::MeanOfAll => mean(&light.irradiance, &|_| true),
            Figure::MeanIndirect => {
                let pairs = light.irradiance.iter().zip(&light.direct);
                let indirect: Vec<Vec3> = pairs.map(|(all, direct)| *all - *direct).collect();
                mean(&indirect, &|_| true)
            }
        };
        found * f64::from(self.scene.radiance_unit)
    }

    /// The point at a spot with the irradiance there.
    fn at(&self, spot: Spot) -> Option<ReferencePoint> {
        let point = points::find(&self.scene, spot)?;
        let lookup = MeshLookup::new(&self.scene, &self.snapshot.mesh);
        let found = lookup.irradiance(&self.snapshot.light, &[point]);
        let irradiance = found.into_iter().next().flatten()?;
        Some(ReferencePoint {
            irradiance,
            ..point
        })
    }
}

/// All cases.
pub fn exact_cases() -> Vec<Case> {
    let mut cases = cie::cases();
    cases.extend(pairs::cases());
    cases.extend(closed::cases());
    cases
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn names_are_unlike_and_points_lie_on_surfaces() {
        let cases = exact_cases();
        let names: HashSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
        assert_eq!(names.len(), cases.len());
        for case in &cases {
            assert!(!case.expected.is_empty(), "{}", case.name);
            let scene = case.finished().expect("it has faces");
            for known in &case.expected {
                if let Figure::IrradianceAt(spot) | Figure::RadianceAt(spot) = known.figure {
                    let found = points::find(&scene, spot);
                    assert!(found.is_some(), "{}: {}", case.name, known.name);
                }
            }
        }
    }

    #[test]
    fn a_cancelled_case_does_not_hold() {
        let cancel = Cancel::default();
        cancel.cancel();
        let outcome = exact_cases()[0].run(&SolveSettings::draft(), &cancel);
        assert!(!outcome.holds());
        assert_eq!(outcome.failure.as_deref(), Some("stopped before the end"));
    }
}
