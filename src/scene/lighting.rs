//! Light that is asked for beside what a scene brings along: a sky, a sun, materials that become lamps.

use std::{path::PathBuf, sync::Arc};

use glam::Vec3;

use super::{
    Environment, HosekSky, Scene, Sky, SkyPicture, Sun, Texture, UpAxis, Warning, WarningKind,
    suggestion::closest,
};

/// Light that is asked for. What is not asked for is as the scene has it. Sky and sun stand by the scene's up axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// The sky. Where none is asked for, and neither a surface nor the scene's own sky or sun gives light, it is the
    /// default one.
    pub sky: Option<SkySource>,
    /// The sun.
    pub sun: Option<SunSource>,
    /// Whether the sky is switched off, whichever it is.
    pub is_sky_off: bool,
    /// Whether the sun is switched off, whichever it is.
    pub is_sun_off: bool,
    /// Materials with another emission.
    pub lamps: Vec<Lamp>,
    /// Files that it was read from.
    pub files: Vec<PathBuf>,
    /// What was noticed while it was read.
    pub warnings: Vec<Warning>,
}

/// A sky that is asked for; radiance in W·sr⁻¹·m⁻², linear RGB, finite and at least 0.
#[derive(Clone, Debug, PartialEq)]
pub enum SkySource {
    /// No sky.
    Dark,
    /// The same radiance from all directions.
    Uniform(Vec3),
    /// A clear or hazy day about the place of the sun; see [`HosekSky`]. Dark while there is no sun above the horizon.
    Hosek {
        /// 1 in clean air, 3 on a clear day, 10 in haze.
        turbidity: f32,
        /// Factor on its radiance.
        scale: Vec3,
    },
    /// An equirectangular picture.
    Picture {
        /// Radiance; the top row is straight up, the middle is south.
        picture: Arc<Texture>,
        /// The file that it was read from.
        file: Option<PathBuf>,
        /// Factor on its radiance.
        scale: Vec3,
        /// Clockwise turn as seen from above, degrees.
        rotation: f32,
    },
}

/// A sun that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SunSource {
    /// No sun.
    Dark,
    /// A disc.
    Disc {
        /// Clockwise from north as seen from above, degrees; see [`Sun::towards`].
        azimuth: f32,
        /// Above the horizon, degrees; the sun may shine from below.
        elevation: f32,
        /// Irradiance of a surface that faces it, W/m², linear RGB, finite and at least 0.
        irradiance: Vec3,
        /// Angular diameter, degrees; above 0 and below 180.
        diameter: f32,
    },
}

/// A material that emits.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Name of the material; all materials of this name are meant.
    pub material: String,
    /// Emitted radiance in place of its own (`Ke`), W·sr⁻¹·m⁻², linear RGB, finite and at least 0; multiplies `map_Ke`.
    pub radiance: Vec3,
}

impl Lighting {
    /// The scene with this light. Names of lamps that no material has become warnings.
    pub fn apply(&self, scene: Scene) -> Scene {
        let mut scene = self.with_lamps(scene);
        scene.files.extend(self.files.iter().cloned());
        scene.warnings.extend(self.warnings.iter().cloned());
        let environment = self.environment(&scene);
        let sun = environment.sun.map(|sun| sun.place(scene.up));
        if let Some([_, elevation]) = sun
            && elevation < 0.0
        {
            scene.warnings.push(Warning {
                kind: WarningKind::Light,
                message: format!(
                    "the sun is {:.1}° below the horizon, so it shines from below",
                    -elevation
                ),
                count: 1,
                place: None,
            });
        }
        scene.in_environment(environment)
    }

    /// A sentence about the first lamp whose material the scene does not have.
    pub fn misnamed(&self, scene: &Scene) -> Option<String> {
        let is_there = |lamp: &&Lamp| scene.materials.iter().any(|m| m.name == lamp.material);
        let lamp = self.lamps.iter().find(|lamp| !is_there(lamp))?;
        let names = || {
            scene
                .materials
                .iter()
                .map(|material| material.name.as_str())
        };
        let named: Vec<String> = names()
            .filter(|name| !name.is_empty())
            .take(5)
            .map(|name| format!("'{name}'"))
            .collect();
        let hint = match closest(&lamp.material, names()) {
            Some(name) => format!("; did you mean '{name}'?"),
            None if named.is_empty() => "; the scene's material has no name".to_owned(),
            None => format!("; the scene has {}", named.join(", ")),
        };
        Some(format!("no material is named '{}'{hint}", lamp.material))
    }

    /// The environment of a scene in W·sr⁻¹·m⁻²: its own with what is asked for in its place.
    pub fn environment(&self, scene: &Scene) -> Environment {
        let own = (*scene.environment).clone().scaled(scene.radiance_unit);
        let has_own_sun = !own.is_default && own.sun.is_some();
        let own_sky = if own.is_default { Sky::Dark } else { own.sky };
        let sun = self.sun.map_or(own.sun, |sun| sun.sun(scene.up));
        let environment = Environment {
            sky: match &self.sky {
                _ if self.is_sky_off => Sky::Dark,
                Some(sky) => sky.sky(scene.up, sun),
                None => own_sky,
            },
            sun: sun.filter(|_| !self.is_sun_off),
            is_default: false,
        };
        let is_asked_for = self.sky.is_some() || self.is_sky_off;
        if !is_asked_for && !has_own_sun && environment.sky.is_dark() && !scene.has_emitter() {
            environment.with_default_sky()
        } else {
            environment
        }
    }

    fn with_lamps(&self, scene: Scene) -> Scene {
        if self.lamps.is_empty() {
            return scene;
        }
        let mut appearances = scene.appearances();
        for lamp in &self.lamps {
            let materials = scene.materials.iter().zip(&mut appearances);
            for (_, appearance) in materials.filter(|(material, _)| material.name == lamp.material)
            {
                appearance.emission = lamp.radiance / scene.radiance_unit;
            }
        }
        let mut lit = scene.relit(&appearances);
        if let Some(message) = self.misnamed(&scene) {
            lit.warnings.push(Warning {
                kind: WarningKind::MaterialMissing,
                message: message.replace(char::is_control, "\u{fffd}"),
                count: 1,
                place: None,
            });
        }
        lit
    }
}

impl SkySource {
    /// A sky that a scene has, asked for; `unit` is the scene's [`Scene::radiance_unit`].
    pub fn of(sky: &Sky, up: UpAxis, unit: f32) -> Self {
        match sky {
            Sky::Dark => Self::Dark,
            Sky::Uniform(radiance) => Self::Uniform(*radiance * unit),
            Sky::Picture(sky) => Self::Picture {
                picture: sky.picture.clone(),
                file: None,
                scale: sky.scale * unit,
                rotation: sky.rotation(up),
            },
        }
    }

    /// The factor on its radiance, or the radiance itself; of no sky there is none.
    pub fn scale_mut(&mut self) -> Option<&mut Vec3> {
        match self {
            Self::Dark => None,
            Self::Uniform(scale) | Self::Hosek { scale, .. } | Self::Picture { scale, .. } => {
                Some(scale)
            }
        }
    }

    fn sky(&self, up: UpAxis, sun: Option<Sun>) -> Sky {
        match self {
            Self::Dark => Sky::Dark,
            Self::Uniform(radiance) => Sky::Uniform(*radiance),
            Self::Hosek { turbidity, scale } => {
                let place = sun.map(|sun| sun.place(up));
                let sky = place
                    .and_then(|[azimuth, elevation]| HosekSky::new(*turbidity, azimuth, elevation));
                sky.map_or(Sky::Dark, |sky| {
                    Sky::Picture(SkyPicture::new(Arc::new(sky.picture), *scale, up, 0.0))
                })
            }
            Self::Picture {
                picture,
                scale,
                rotation,
                ..
            } => Sky::Picture(SkyPicture::new(picture.clone(), *scale, up, *rotation)),
        }
    }
}

impl SunSource {
    /// Irradiance of a surface that faces the sun where nobody says how much, W/m²: about three times what the default
    /// sky gives to open ground, π. Much less, and shadows are faint; much more, and they are black beside the light.
    pub const IRRADIANCE: f32 = 10.0;

    /// A sun that a scene has, asked for; `unit` is the scene's [`Scene::radiance_unit`].
    pub fn of(sun: &Sun, up: UpAxis, unit: f32) -> Self {
        let [azimuth, elevation] = sun.place(up);
        Self::Disc {
            azimuth: azimuth.rem_euclid(360.0),
            elevation,
            irradiance: sun.irradiance * unit,
            diameter: sun.diameter.to_degrees(),
        }
    }

    fn sun(self, up: UpAxis) -> Option<Sun> {
        match self {
            Self::Dark => None,
            Self::Disc {
                azimuth,
                elevation,
                irradiance,
                diameter,
            } => Some(Sun {
                direction: Sun::towards(azimuth, elevation, up),
                irradiance,
                diameter: diameter.to_radians(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, SceneBuilder, SceneOptions};

    /// One triangle of a material.
    fn scene(name: &str, emission: f32) -> Scene {
        let mut builder = SceneBuilder::default();
        let material = Material::plain(name, Vec3::splat(0.5), Vec3::splat(emission));
        let material = builder.push_material(material);
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|corner| builder.push_position(corner));
        builder.push_triangle(corners, material);
        builder.finish(&SceneOptions::default()).expect("a face")
    }

    fn sentences(scene: &Scene) -> String {
        let all: Vec<String> = scene.warnings.iter().map(ToString::to_string).collect();
        all.join("\n")
    }

    fn sun(elevation: f32) -> Option<SunSource> {
        Some(SunSource::Disc {
            azimuth: 90.0,
            elevation,
            irradiance: Vec3::ONE,
            diameter: Sun::DEGREES,
        })
    }

    #[test]
    fn the_default_sky_lights_what_nothing_else_does() {
        let plain = Lighting::default();
        let dark = scene("wall", 0.0);
        assert!(sentences(&dark).contains("the result is black"));
        let lit = plain.apply(dark.clone());
        assert_eq!(*lit.environment, Environment::default_sky());
        let text = sentences(&lit);
        assert!(
            text.contains("uniform sky of radiance 1") && !text.contains("black"),
            "{text}"
        );
        assert!(plain.apply(scene("lamp", 1.0)).environment.is_dark());
        // It goes with a sun, and can be turned off.
        let sunny = Lighting {
            sun: sun(30.0),
            ..plain.clone()
        };
        let lit = sunny.apply(dark.clone());
        assert!(lit.environment.is_default && lit.environment.sun.is_some());
        let none = Lighting {
            sky: Some(SkySource::Dark),
            ..plain.clone()
        };
        assert!(sentences(&none.apply(dark)).contains("the result is black"));
        // Asked for anew, it stays the default.
        assert!(plain.apply(lit).environment.is_default);
    }

    #[test]
    fn what_is_asked_for_replaces_the_scenes_own() {
        let own = Environment {
            sky: Sky::Uniform(Vec3::X),
            sun: Some(Sun {
                direction: Vec3::Y,
                irradiance: Vec3::ONE,
                diameter: 0.01,
            }),
            is_default: false,
        };
        let scene = scene("wall", 0.0).in_environment(own.clone());
        assert_eq!(*Lighting::default().apply(scene.clone()).environment, own);
        let sky = Lighting {
            sky: Some(SkySource::Uniform(Vec3::Z)),
            ..Lighting::default()
        };
        let lit = sky.apply(scene.clone());
        assert_eq!(lit.environment.sky, Sky::Uniform(Vec3::Z));
        assert_eq!(lit.environment.sun, own.sun);
        let night = Lighting {
            sky: Some(SkySource::Dark),
            sun: Some(SunSource::Dark),
            ..Lighting::default()
        };
        assert!(night.apply(scene).environment.is_dark());
    }

    #[test]
    fn a_sun_below_the_horizon_is_said() {
        for (elevation, is_said) in [(-3.0, true), (0.0, false), (90.0, false)] {
            let lighting = Lighting {
                sun: sun(elevation),
                ..Lighting::default()
            };
            let text = sentences(&lighting.apply(scene("wall", 0.0)));
            assert_eq!(text.contains("3.0° below the horizon"), is_said, "{text}");
        }
    }

    #[test]
    fn a_named_material_becomes_a_lamp() {
        let lamp = |material: &str| Lighting {
            lamps: vec![Lamp {
                material: material.to_owned(),
                radiance: Vec3::X,
            }],
            ..Lighting::default()
        };
        for emission in [0.0, 3.0, 1e-20] {
            let lit = lamp("bulb").apply(scene("bulb", emission));
            let radiance = lit.surfaces[0].emission * lit.radiance_unit;
            assert!(
                (radiance - Vec3::X).abs().max_element() < 1e-6,
                "{radiance}"
            );
            assert!(lit.environment.is_dark() && lit.warnings.is_empty());
        }
        let wall = scene("wall", 0.0);
        let sentence = lamp("wal").misnamed(&wall).expect("it is misspelt");
        assert_eq!(sentence, "no material is named 'wal'; did you mean 'wall'?");
        assert!(sentences(&lamp("wal").apply(wall.clone())).contains(&sentence));
        let sentence = lamp("xyz").misnamed(&wall).expect("it is not there");
        assert!(sentence.ends_with("the scene has 'wall'"), "{sentence}");
        assert_eq!(lamp("wall").misnamed(&wall), None);
    }
}
