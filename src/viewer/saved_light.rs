//! Sky and sun as the sidecar has them.

use std::path::{Path, PathBuf};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::scene::{Lighting, SkyError, SkySource, SunSource, read_sky};

/// Sky and sun, as far as they are not left to the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SavedLight {
    /// The sky.
    #[serde(skip_serializing_if = "Option::is_none")]
    sky: Option<SavedSky>,
    /// The sun.
    #[serde(skip_serializing_if = "Option::is_none")]
    sun: Option<SavedSun>,
}

/// A sky, and whether it is switched on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
struct SavedSky {
    on: bool,
    #[serde(flatten)]
    source: Option<SavedSkySource>,
}

/// What a sky is; colours are those of [`SkySource`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SavedSkySource {
    Uniform([f32; 3]),
    Hosek {
        turbidity: f32,
        scale: [f32; 3],
    },
    Picture {
        /// From the folder of the scene, where it lies in there.
        file: PathBuf,
        scale: [f32; 3],
        rotation: f32,
    },
}

/// A sun, and whether it is switched on; numbers are those of [`SunSource`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedSun {
    on: bool,
    #[serde(flatten)]
    disc: Option<SavedDisc>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct SavedDisc {
    azimuth: f32,
    elevation: f32,
    irradiance: [f32; 3],
    diameter: f32,
}

impl SavedLight {
    /// Of the light of a scene in a folder.
    pub fn of(lighting: &Lighting, folder: &Path) -> Self {
        let sky = match &lighting.sky {
            None if !lighting.is_sky_off => None,
            sky => Some(SavedSky {
                on: !lighting.is_sky_off && *sky != Some(SkySource::Dark),
                source: sky.as_ref().and_then(|sky| saved_sky(sky, folder)),
            }),
        };
        let sun = match lighting.sun {
            None if !lighting.is_sun_off => None,
            sun => Some(SavedSun {
                on: !lighting.is_sun_off && sun != Some(SunSource::Dark),
                disc: sun.and_then(saved_disc),
            }),
        };
        Self { sky, sun }
    }

    /// Whether nothing is saved.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// One sentence about the first value out of its range.
    ///
    /// # Errors
    /// Where there is one.
    pub fn check(&self) -> Result<(), String> {
        let within =
            |name: &str, value: f32, low: f32, high: f32| match (low..=high).contains(&value) {
                true => Ok(()),
                false => Err(format!(
                    "{name} is {value}, but must be a number within {low} and {high}"
                )),
            };
        let at_least_zero = |name: &str, color: [f32; 3]| match color
            .into_iter()
            .find(|value| !(0.0..=f32::MAX).contains(value))
        {
            None => Ok(()),
            Some(value) => Err(format!(
                "{name} is {value}, but must be a number of at least 0"
            )),
        };
        match self.sky.as_ref().and_then(|sky| sky.source.as_ref()) {
            None => {}
            Some(SavedSkySource::Uniform(radiance)) => at_least_zero("sky.uniform", *radiance)?,
            Some(SavedSkySource::Hosek { turbidity, scale }) => {
                within("sky.hosek.turbidity", *turbidity, 1.0, 10.0)?;
                at_least_zero("sky.hosek.scale", *scale)?;
            }
            Some(SavedSkySource::Picture {
                scale, rotation, ..
            }) => {
                at_least_zero("sky.picture.scale", *scale)?;
                within("sky.picture.rotation", *rotation, -360.0, 360.0)?;
            }
        }
        if let Some(disc) = self.sun.as_ref().and_then(|sun| sun.disc.as_ref()) {
            within("sun.azimuth", disc.azimuth, -360.0, 360.0)?;
            within("sun.elevation", disc.elevation, -90.0, 90.0)?;
            within("sun.diameter", disc.diameter, 0.001, 90.0)?;
            at_least_zero("sun.irradiance", disc.irradiance)?;
        }
        Ok(())
    }

    /// Light of a scene in a folder: what is asked for goes before what was saved.
    ///
    /// # Errors
    /// Where the picture of the sky is asked of a file that cannot be read.
    pub fn under(&self, asked: &Lighting, folder: &Path) -> Result<Lighting, SkyError> {
        let mut lighting = asked.clone();
        if let (None, Some(sun)) = (asked.sun, &self.sun) {
            lighting.is_sun_off = !sun.on;
            lighting.sun = sun.disc.as_ref().map(|disc| SunSource::Disc {
                azimuth: disc.azimuth,
                elevation: disc.elevation,
                irradiance: Vec3::from_array(disc.irradiance),
                diameter: disc.diameter,
            });
        }
        if let (None, Some(sky)) = (&asked.sky, &self.sky) {
            lighting.is_sky_off = !sky.on;
            lighting.sky = match &sky.source {
                None => None,
                Some(SavedSkySource::Uniform(radiance)) => {
                    Some(SkySource::Uniform(Vec3::from_array(*radiance)))
                }
                Some(SavedSkySource::Hosek { turbidity, scale }) => Some(SkySource::Hosek {
                    turbidity: *turbidity,
                    scale: Vec3::from_array(*scale),
                }),
                Some(SavedSkySource::Picture {
                    file,
                    scale,
                    rotation,
                }) => {
                    let path = folder.join(file);
                    let read = read_sky(&path)?;
                    lighting.files.push(path.clone());
                    lighting.warnings.extend(read.warnings);
                    Some(SkySource::Picture {
                        picture: read.picture.into(),
                        file: Some(path),
                        scale: Vec3::from_array(*scale),
                        rotation: *rotation,
                    })
                }
            };
        }
        Ok(lighting)
    }
}

/// Of a picture without a file there is nothing to save.
fn saved_sky(sky: &SkySource, folder: &Path) -> Option<SavedSkySource> {
    match sky {
        SkySource::Dark => None,
        SkySource::Uniform(radiance) => Some(SavedSkySource::Uniform(radiance.to_array())),
        SkySource::Hosek { turbidity, scale } => Some(SavedSkySource::Hosek {
            turbidity: *turbidity,
            scale: scale.to_array(),
        }),
        SkySource::Picture {
            file,
            scale,
            rotation,
            ..
        } => {
            // Whole, or beside the scene: the next window may start in another folder.
            let file = std::path::absolute(file.as_ref()?).ok()?;
            let folder = std::path::absolute(folder).ok();
            let beside = folder.and_then(|folder| Some(file.strip_prefix(folder).ok()?.to_owned()));
            Some(SavedSkySource::Picture {
                file: beside.unwrap_or(file),
                scale: scale.to_array(),
                rotation: *rotation,
            })
        }
    }
}

fn saved_disc(sun: SunSource) -> Option<SavedDisc> {
    match sun {
        SunSource::Dark => None,
        SunSource::Disc {
            azimuth,
            elevation,
            irradiance,
            diameter,
        } => Some(SavedDisc {
            azimuth,
            elevation,
            irradiance: irradiance.to_array(),
            diameter,
        }),
    }
}

#[cfg(test)]
mod tests {
    use image::{ImageBuffer, Rgb};

    use super::*;

    const SUN: SunSource = SunSource::Disc {
        azimuth: 120.0,
        elevation: 35.0,
        irradiance: Vec3::new(3.0, 2.0, 1.0),
        diameter: 2.0,
    };

    fn again(lighting: &Lighting, folder: &Path) -> Lighting {
        let saved = SavedLight::of(lighting, folder);
        let text = toml::to_string_pretty(&saved).expect("plain values");
        let read: SavedLight = toml::from_str(&text).expect("our own text");
        assert_eq!(read, saved, "{text}");
        read.check().expect("values in range");
        let read = read.under(&Lighting::default(), folder);
        read.expect("the picture is there")
    }

    #[test]
    fn sky_and_sun_survive_their_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("sky.hdr");
        let picture = ImageBuffer::from_pixel(4, 2, Rgb([1.0f32; 3]));
        picture.save(&file).expect("it can be written");
        let skies = [
            None,
            Some(SkySource::Uniform(Vec3::new(0.5, 0.75, 1.0))),
            Some(SkySource::Hosek {
                turbidity: 3.0,
                scale: Vec3::splat(0.5),
            }),
            Some(SkySource::Picture {
                picture: read_sky(&file).expect("a picture").picture.into(),
                file: Some(file),
                scale: Vec3::X,
                rotation: -30.0,
            }),
        ];
        for (sky, is_off) in skies.iter().flat_map(|sky| [(sky, false), (sky, true)]) {
            for sun in [None, Some(SUN)] {
                let lighting = Lighting {
                    sky: sky.clone(),
                    sun,
                    is_sky_off: is_off,
                    is_sun_off: is_off,
                    ..Lighting::default()
                };
                let mut read = again(&lighting, folder.path());
                read.files.clear();
                assert_eq!(read, lighting);
            }
        }
    }

    #[test]
    fn a_picture_is_found_where_scene_and_picture_went_together() {
        let folder = tempfile::tempdir().expect("a folder");
        let saved = |path: &Path| {
            let sky = SkySource::Picture {
                picture: Default::default(),
                file: Some(path.to_owned()),
                scale: Vec3::ONE,
                rotation: 0.0,
            };
            match saved_sky(&sky, folder.path()) {
                Some(SavedSkySource::Picture { file, .. }) => file,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(
            saved(&folder.path().join("maps/sky.hdr")),
            Path::new("maps/sky.hdr")
        );
        assert!(saved(Path::new("elsewhere.hdr")).is_absolute());
    }

    #[test]
    fn what_is_asked_for_goes_before_what_was_saved() {
        let folder = Path::new("");
        let saved = SavedLight::of(
            &Lighting {
                sky: Some(SkySource::Uniform(Vec3::X)),
                is_sky_off: true,
                sun: Some(SUN),
                ..Lighting::default()
            },
            folder,
        );
        let asked = Lighting {
            sky: Some(SkySource::Uniform(Vec3::Y)),
            ..Lighting::default()
        };
        let found = saved.under(&asked, folder).expect("no picture");
        assert_eq!((found.sky, found.is_sky_off), (asked.sky, false));
        assert_eq!(found.sun, Some(SUN));
    }

    #[test]
    fn values_out_of_range_are_one_sentence() {
        for (text, sentence) in [
            (
                "sky = { on = true, uniform = [1.0, -2.0, 1.0] }",
                "sky.uniform is -2, but must be a number of at least 0",
            ),
            (
                "sky = { on = true, hosek = { turbidity = 20.0, scale = [1.0, 1.0, 1.0] } }",
                "sky.hosek.turbidity is 20, but must be a number within 1 and 10",
            ),
            (
                "sun = { on = true, azimuth = nan, elevation = 3.0, irradiance = [1.0, 1.0, 1.0], diameter = 1.0 }",
                "sun.azimuth is NaN, but must be a number within -360 and 360",
            ),
        ] {
            let saved: SavedLight = toml::from_str(text).expect(text);
            assert_eq!(saved.check(), Err(sentence.to_owned()));
        }
    }
}
