//! Flags of the light beside what a scene brings along: sky, sun, lamps; and their values.

use std::{path::PathBuf, str::FromStr, sync::Arc};

use anyhow::{Result, bail};
use clap::Args;
use glam::Vec3;

use super::{
    LoadError, UsageError,
    values::{at_least_zero, number},
};
use crate::scene::{HosekSky, Lamp, Lighting, SkySource, Sun, SunSource, read_sky};

/// Flags of [`Lighting`].
#[derive(Clone, Debug, Args)]
pub struct LightFlags {
    /// Light from all around: none, its radiance, or an equirectangular picture
    #[arg(
        long,
        value_name = "none|R,G,B|FILE|hosek=T",
        allow_hyphen_values = true,
        help = "Light from all around [default: that of the scene; radiance 1 where nothing else emits]: none; radiance in \
                W·sr⁻¹·m⁻², linear R,G,B or one number; a picture of radiance, .hdr or .exr, equirectangular, its top row up, \
                its middle south (+Z, or -Y where +Z is up); or hosek=TURBIDITY, a clear (2 to 4) or hazy (to 10) day by \
                Hosek and Wilkie about the place of --sun, black below the horizon, in cd/m² over 683",
        help_heading = "Light"
    )]
    pub sky: Option<SkyFlag>,
    /// Factor on the radiance of the sky
    #[arg(
        long,
        value_name = "F",
        value_parser = at_least_zero,
        requires = "sky",
        allow_hyphen_values = true,
        help = "Factor on the radiance of the sky [default: 1]",
        help_heading = "Light"
    )]
    pub sky_scale: Option<f32>,
    /// Turn of the picture of the sky
    #[arg(
        long,
        value_name = "DEGREES",
        value_parser = number,
        requires = "sky",
        allow_hyphen_values = true,
        help = "Turn of the picture of the sky, clockwise as seen from above [default: 0]",
        help_heading = "Light"
    )]
    pub sky_rotation: Option<f32>,
    /// Place of the sun
    #[arg(
        long,
        value_name = "none|AZIMUTH,ELEVATION",
        allow_hyphen_values = true,
        help = "A sun at this place, or none [default: that of the scene], in degrees: AZIMUTH clockwise from north as seen \
                from above (north is -Z, or +Y where +Z is up; east is +X), ELEVATION above the horizon",
        help_heading = "Light"
    )]
    pub sun: Option<SunFlag>,
    /// Irradiance by the sun
    #[arg(
        long,
        value_name = "E|R,G,B",
        value_parser = color,
        requires = "sun",
        allow_hyphen_values = true,
        help = format!(
            "Irradiance by the sun of a surface square to it, W/m², one number or linear R,G,B [default: {}, about three \
             times what a sky of radiance 1 gives to open ground; with --sky hosek that of its air]",
            SunSource::IRRADIANCE
        ),
        help_heading = "Light"
    )]
    pub sun_irradiance: Option<Vec3>,
    /// Angular diameter of the sun
    #[arg(
        long,
        value_name = "DEGREES",
        value_parser = diameter,
        requires = "sun",
        allow_hyphen_values = true,
        help = format!(
            "Angular diameter of the sun, 0.001 to 90; the larger, the softer its shadows [default: {}]",
            Sun::DEGREES
        ),
        help_heading = "Light"
    )]
    pub sun_diameter: Option<f32>,
    /// A material that emits
    #[arg(
        long,
        value_name = "NAME=R,G,B",
        help = "Let the material of this name emit this radiance in W·sr⁻¹·m⁻², one number or linear R,G,B, in place of its \
                Ke; may be given several times",
        help_heading = "Light"
    )]
    pub emit: Vec<LampFlag>,
}

impl LightFlags {
    /// The light that the flags ask for, pictures read.
    ///
    /// # Errors
    /// When the picture of the sky cannot be read, or the flags do not go together.
    pub fn lighting(&self) -> Result<Lighting> {
        let mut lighting = Lighting {
            lamps: self.emit.iter().map(|lamp| lamp.0.clone()).collect(),
            ..Lighting::default()
        };
        let mut irradiance = Vec3::splat(SunSource::IRRADIANCE);
        let scale = Vec3::splat(self.sky_scale.unwrap_or(1.0));
        lighting.sky = match &self.sky {
            Some(SkyFlag::Dark) => Some(SkySource::Dark),
            Some(SkyFlag::Uniform(radiance)) => Some(SkySource::Uniform(*radiance * scale)),
            Some(SkyFlag::File(path)) => {
                let read = read_sky(path).map_err(LoadError::from)?;
                lighting.files.push(path.clone());
                lighting.warnings.extend(read.warnings);
                Some(SkySource::Picture {
                    picture: Arc::new(read.picture),
                    file: Some(path.clone()),
                    scale,
                    rotation: self.sky_rotation.unwrap_or(0.0),
                })
            }
            Some(SkyFlag::Hosek(turbidity)) => {
                irradiance = self.hosek(*turbidity)?.sun_irradiance;
                Some(SkySource::Hosek {
                    turbidity: *turbidity,
                    scale,
                })
            }
            None => None,
        };
        lighting.sun = self.sun.map(|sun| self.sun(sun, irradiance));
        Ok(lighting)
    }

    /// The sky about the place of the sun.
    fn hosek(&self, turbidity: f32) -> Result<HosekSky> {
        if self.sky_rotation.is_some() {
            let message = "--sky-rotation turns pictures; the place of the sun turns --sky hosek";
            bail!(UsageError(message.to_owned()));
        }
        let sky = match self.sun {
            Some(SunFlag::Place { azimuth, elevation }) => {
                HosekSky::new(turbidity, azimuth, elevation)
            }
            _ => None,
        };
        sky.ok_or_else(|| {
            let message =
                "--sky hosek needs --sun AZIMUTH,ELEVATION with the sun above the horizon";
            UsageError(message.to_owned()).into()
        })
    }

    fn sun(&self, place: SunFlag, irradiance: Vec3) -> SunSource {
        match place {
            SunFlag::Dark => SunSource::Dark,
            SunFlag::Place { azimuth, elevation } => SunSource::Disc {
                azimuth,
                elevation,
                irradiance: self.sun_irradiance.unwrap_or(irradiance),
                diameter: self.sun_diameter.unwrap_or(Sun::DEGREES),
            },
        }
    }
}

/// `--sky`
#[derive(Clone, Debug, PartialEq)]
pub enum SkyFlag {
    /// No sky.
    Dark,
    /// Radiance.
    Uniform(Vec3),
    /// A picture.
    File(PathBuf),
    /// A clear day of this turbidity.
    Hosek(f32),
}

impl FromStr for SkyFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::Dark);
        }
        if let Some(turbidity) = text.strip_prefix("hosek=") {
            return match number(turbidity)? {
                turbidity if (1.0..=10.0).contains(&turbidity) => Ok(Self::Hosek(turbidity)),
                _ => Err("the turbidity must be within 1 and 10".to_owned()),
            };
        }
        // Whatever looks like numbers is meant as such.
        if text
            .split(',')
            .all(|part| part.trim().parse::<f32>().is_ok())
        {
            return color(text).map(Self::Uniform);
        }
        let path = PathBuf::from(text);
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if !path.exists() && extension != "hdr" && extension != "exr" {
            return Err(
                "expected none, R,G,B, a picture .hdr or .exr, or hosek=TURBIDITY".to_owned(),
            );
        }
        Ok(Self::File(path))
    }
}

/// `--sun`
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SunFlag {
    /// No sun.
    Dark,
    /// A place in the sky, degrees.
    Place {
        /// Clockwise from north.
        azimuth: f32,
        /// Above the horizon.
        elevation: f32,
    },
}

impl FromStr for SunFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "none" {
            return Ok(Self::Dark);
        }
        let expected = || "expected none or AZIMUTH,ELEVATION in degrees".to_owned();
        let (azimuth, elevation) = text.split_once(',').ok_or_else(expected)?;
        let [azimuth, elevation] = [azimuth, elevation].map(|angle| number(angle.trim()));
        let (Ok(azimuth), Ok(elevation)) = (azimuth, elevation) else {
            return Err(expected());
        };
        if elevation.abs() > 90.0 {
            return Err("the elevation must be within -90 and 90".to_owned());
        }
        Ok(Self::Place { azimuth, elevation })
    }
}

/// `--emit`
#[derive(Clone, Debug, PartialEq)]
pub struct LampFlag(Lamp);

impl FromStr for LampFlag {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        // Names may hold the sign.
        let (material, radiance) = text
            .rsplit_once('=')
            .ok_or_else(|| "expected NAME=R,G,B".to_owned())?;
        Ok(Self(Lamp {
            material: material.to_owned(),
            radiance: color(radiance)?,
        }))
    }
}

/// One number for all channels, or three: finite and at least 0.
fn color(text: &str) -> Result<Vec3, String> {
    let channels: Vec<f32> = text
        .split(',')
        .map(|channel| at_least_zero(channel.trim()))
        .collect::<Result<_, _>>()?;
    match channels[..] {
        [grey] => Ok(Vec3::splat(grey)),
        [red, green, blue] => Ok(Vec3::new(red, green, blue)),
        _ => Err("expected one number or R,G,B".to_owned()),
    }
}

fn diameter(text: &str) -> Result<f32, String> {
    number(text).and_then(|degrees| match (0.001..=90.0).contains(&degrees) {
        true => Ok(degrees),
        false => Err("must be within 0.001 and 90".to_owned()),
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use image::{ImageBuffer, Rgb};

    use super::*;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        light: LightFlags,
    }

    fn lighting(arguments: &[&str]) -> Result<Lighting, String> {
        let line = Line::try_parse_from([&["test"], arguments].concat());
        let line = line.map_err(|error| error.to_string())?;
        line.light.lighting().map_err(|error| error.to_string())
    }

    #[test]
    fn skies_are_read_by_number_and_by_file() {
        let sky = |arguments: &[&str]| lighting(arguments).unwrap().sky;
        assert_eq!(sky(&[]), None);
        assert_eq!(sky(&["--sky", "none"]), Some(SkySource::Dark));
        let uniform = |r, g, b| Some(SkySource::Uniform(Vec3::new(r, g, b)));
        assert_eq!(sky(&["--sky", "2"]), uniform(2.0, 2.0, 2.0));
        let scaled = ["--sky", "1,2, 3", "--sky-scale", "0.5"];
        assert_eq!(sky(&scaled), uniform(0.5, 1.0, 1.5));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.hdr");
        ImageBuffer::from_pixel(4, 2, Rgb([1.0f32; 3]))
            .save(&path)
            .unwrap();
        let name = path.to_str().unwrap();
        let found =
            lighting(&["--sky", name, "--sky-rotation", "-30", "--sky-scale", "2"]).unwrap();
        assert_eq!(found.files, std::slice::from_ref(&path));
        let Some(SkySource::Picture {
            picture,
            scale,
            rotation,
            file,
        }) = found.sky
        else {
            panic!("no picture");
        };
        assert_eq!(
            (scale, rotation, picture.width),
            (Vec3::splat(2.0), -30.0, 4)
        );
        assert_eq!(file, Some(path));
    }

    #[test]
    fn a_clear_day_has_a_sun_of_its_own_strength() {
        let sun = ["--sky", "hosek=3", "--sun", "120,40"];
        let found = lighting(&sun).unwrap();
        let Some(SunSource::Disc { irradiance, .. }) = found.sun else {
            panic!("no sun");
        };
        assert_eq!(
            irradiance,
            HosekSky::new(3.0, 120.0, 40.0).unwrap().sun_irradiance
        );
        let scale = Vec3::ONE;
        let turbidity = 3.0;
        assert_eq!(found.sky, Some(SkySource::Hosek { turbidity, scale }));
        let weak = lighting(&[&sun[..], &["--sun-irradiance", "2"]].concat()).unwrap();
        assert!(matches!(
            weak.sun,
            Some(SunSource::Disc {
                irradiance: Vec3 { x: 2.0, .. },
                ..
            })
        ));
    }

    #[test]
    fn suns_have_a_place_a_strength_and_a_size() {
        let sun = |arguments: &[&str]| lighting(arguments).unwrap().sun;
        assert_eq!(sun(&["--sun", "none"]), Some(SunSource::Dark));
        let usual = SunSource::Disc {
            azimuth: -135.0,
            elevation: 45.5,
            irradiance: Vec3::splat(SunSource::IRRADIANCE),
            diameter: Sun::DEGREES,
        };
        assert_eq!(sun(&["--sun", "-135,45.5"]), Some(usual));
        let arguments = [
            "--sun",
            "0,-5",
            "--sun-irradiance",
            "3,2,1",
            "--sun-diameter",
            "4",
        ];
        let Some(SunSource::Disc {
            irradiance,
            diameter,
            ..
        }) = sun(&arguments)
        else {
            panic!("no sun");
        };
        assert_eq!((irradiance, diameter), (Vec3::new(3.0, 2.0, 1.0), 4.0));
    }

    #[test]
    fn lamps_are_named_materials() {
        let found = lighting(&["--emit", "neon=1=4,5,6", "--emit", "bulb=2"]).unwrap();
        let names: Vec<&str> = found.lamps.iter().map(|lamp| &*lamp.material).collect();
        assert_eq!(names, ["neon=1", "bulb"]);
        assert_eq!(found.lamps[0].radiance, Vec3::new(4.0, 5.0, 6.0));
    }

    #[test]
    fn what_makes_no_sense_gets_a_sentence() {
        for (arguments, sentence) in [
            (&["--sky", "-1,1,1"][..], "must be at least 0"),
            (&["--sky", "inf"], "not a number"),
            (&["--sky", "nan,1,1"], "not a number"),
            (&["--sky", "1,1"], "expected one number or R,G,B"),
            (&["--sky", "blue"], "expected none, R,G,B, a picture"),
            (&["--sky", "missing.hdr"], "no such picture of the sky"),
            (&["--sky", "hosek=11", "--sun", "0,9"], "within 1 and 10"),
            (&["--sky", "hosek=3"], "needs --sun AZIMUTH,ELEVATION"),
            (&["--sky", "hosek=3", "--sun", "none"], "needs --sun"),
            (&["--sky", "hosek=3", "--sun", "0,-1"], "above the horizon"),
            (
                &["--sky", "hosek=3", "--sun", "0,9", "--sky-rotation", "5"],
                "the place of the sun turns",
            ),
            (&["--sky-scale", "2"], "--sky"),
            (&["--sky", "1", "--sky-scale", "-2"], "must be at least 0"),
            (&["--sky", "1", "--sky-scale", "inf"], "not a number"),
            (&["--sky-rotation", "2"], "--sky"),
            (&["--sun", "90"], "expected none or AZIMUTH,ELEVATION"),
            (&["--sun", "90,x"], "expected none or AZIMUTH,ELEVATION"),
            (&["--sun", "0,91"], "must be within -90 and 90"),
            (&["--sun-irradiance", "3"], "--sun"),
            (
                &["--sun", "0,9", "--sun-irradiance", "-3"],
                "must be at least 0",
            ),
            (
                &["--sun", "0,9", "--sun-irradiance", "1,inf,1"],
                "not a number",
            ),
            (
                &["--sun", "0,9", "--sun-diameter", "0"],
                "must be within 0.001 and 90",
            ),
            (&["--sun-diameter", "1"], "--sun"),
            (&["--emit", "lamp"], "expected NAME=R,G,B"),
            (&["--emit", "lamp=-1"], "must be at least 0"),
        ] {
            let error = lighting(arguments).unwrap_err();
            assert!(error.contains(sentence), "{arguments:?}: {error}");
        }
    }
}
