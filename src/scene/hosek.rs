//! The sky of a clear or hazy day: Hosek & Wilkie, "An Analytic Model for Full Spectral Sky-Dome Radiance" (2012), for
//! black ground; and the sun through the same air: Preetham, Shirley & Smits, "A Practical Analytic Model for Daylight"
//! (1999), without ozone and vapour.
//!
//! Radiance and irradiance are weighted by the eye: times 683 lm/W they are cd/m² and lx.

use glam::Vec3;
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};

use super::Texture;

/// Rows of the picture: 0.7°, less than the brightness about the sun varies over.
const ROWS: u32 = 256;

/// Irradiance by the sun outside the air.
const OUTSIDE_AIR: f32 = 195.0;

/// Wavelengths that stand for red, green and blue, micrometres.
const WAVELENGTHS: [f32; 3] = [0.615, 0.55, 0.465];

/// A sky and the strength of its sun.
#[derive(Clone, Debug, PartialEq)]
pub struct HosekSky {
    /// Equirectangular radiance, linear sRGB; the top row is straight up, the middle is south; black below the horizon.
    pub picture: Texture,
    /// Irradiance of a surface that faces the sun, linear sRGB.
    pub sun_irradiance: Vec3,
}

impl HosekSky {
    /// Under a sun `azimuth` clockwise from north and `elevation` above the horizon, 0 to 90, both in degrees. The
    /// `turbidity` is 1 in clean air, 3 on a clear day, 10 in haze. Nothing where one of them is out of its range.
    pub fn new(turbidity: f32, azimuth: f32, elevation: f32) -> Option<Self> {
        let parameters = SkyParams {
            elevation: elevation.to_radians(),
            turbidity,
            albedo: [0.0; 3],
        };
        let state = SkyState::new(&parameters).ok()?;
        let toward = |azimuth: f32, elevation: f32| {
            let (east, north) = azimuth.to_radians().sin_cos();
            let (height, along) = elevation.to_radians().sin_cos();
            Vec3::new(east * along, north * along, height)
        };
        let sun = toward(azimuth, elevation);
        let columns = 2 * ROWS;
        let pixel = |index: u32| {
            let degrees = 180.0 / ROWS as f32;
            let [column, row] = [index % columns, index / columns].map(|at| at as f32 + 0.5);
            let from_zenith = row * degrees;
            if from_zenith >= 90.0 {
                return Vec3::ZERO;
            }
            let direction = toward(column * degrees, 90.0 - from_zenith);
            radiance(
                &state,
                from_zenith.to_radians(),
                direction.angle_between(sun),
            )
        };
        let picture = Texture {
            name: format!("hosek={turbidity}"),
            width: columns,
            height: ROWS,
            pixels: (0..columns * ROWS).map(pixel).collect(),
            ..Texture::default()
        };
        Some(Self {
            picture,
            sun_irradiance: sun_irradiance(turbidity, elevation),
        })
    }
}

/// Radiance at an angle from the zenith and from the sun, both in radians.
fn radiance(state: &SkyState, from_zenith: f32, from_sun: f32) -> Vec3 {
    let [red, green, blue] = [Channel::R, Channel::G, Channel::B]
        .map(|channel| state.radiance(from_zenith, from_sun, channel).max(0.0));
    Vec3::new(red, green, blue)
}

/// What molecules and haze leave of the sun.
fn sun_irradiance(turbidity: f32, elevation: f32) -> Vec3 {
    let from_zenith = 90.0 - elevation;
    let mass = 1.0
        / (from_zenith.to_radians().cos().max(0.0) + 0.15 * (93.885 - from_zenith).powf(-1.253));
    let haze = (0.046_08 * turbidity - 0.045_86).max(0.0);
    let passed = WAVELENGTHS.map(|wavelength| {
        let depth = 0.008_735 * wavelength.powf(-4.08) + haze * wavelength.powf(-1.3);
        OUTSIDE_AIR * (-mass * depth).exp()
    });
    Vec3::from_array(passed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_has_its_published_values() {
        // Another implementation with data of its own, sunsky of Mitsuba 3.9, has 106.750 times less.
        for ([turbidity, elevation, azimuth, height], expected) in [
            (
                [3.0, 45.0, 0.0, 90.0],
                [0.020_241_82, 0.034_448_74, 0.070_028_57],
            ),
            (
                [3.0, 45.0, 0.0, 5.0],
                [0.176_922_04, 0.228_987_74, 0.278_454],
            ),
            (
                [3.0, 45.0, 180.0, 5.0],
                [0.106_311_33, 0.159_082_83, 0.214_249_6],
            ),
            (
                [2.0, 10.0, 90.0, 40.0],
                [0.016_071_91, 0.028_473_54, 0.045_296_37],
            ),
            (
                [6.5, 70.0, 0.0, 90.0],
                [0.156_664_45, 0.173_250_82, 0.199_039_03],
            ),
            (
                [6.5, 70.0, 180.0, 5.0],
                [0.086_075_05, 0.119_211_87, 0.166_282_28],
            ),
        ] {
            let parameters = SkyParams {
                elevation: f32::to_radians(elevation),
                turbidity,
                albedo: [0.0; 3],
            };
            let state = SkyState::new(&parameters).expect("all is in range");
            // Azimuths count from the sun's.
            let [sun, at] =
                [(0.0, elevation), (azimuth, height)].map(|(azimuth, height): (f32, f32)| {
                    let (sin, cos) = azimuth.to_radians().sin_cos();
                    let (up, along) = height.to_radians().sin_cos();
                    Vec3::new(sin * along, cos * along, up)
                });
            let from_zenith = (90.0 - height).to_radians();
            let found = radiance(&state, from_zenith, at.angle_between(sun));
            let ratio = found / Vec3::from_array(expected) / 106.75;
            assert!((ratio - 1.0).abs().max_element() < 1e-3, "{ratio}");
        }
    }

    #[test]
    fn the_picture_is_bright_about_the_sun_and_black_below() {
        let sky = HosekSky::new(3.0, 90.0, 30.0).expect("all is in range");
        let picture = &sky.picture;
        // A quarter of 512 columns from north to east, and 60° of 256 rows from the zenith.
        let at = |column: usize, row: usize| picture.pixels[row * 512 + column].y;
        let sun = at(128, 85);
        for (column, row) in [(128, 60), (100, 85), (156, 85), (384, 85)] {
            assert!(sun > 1.3 * at(column, row), "{column} {row}");
        }
        let ground = &picture.pixels[512 * 128..];
        assert!(ground.iter().all(|&pixel| pixel == Vec3::ZERO));
        assert!(
            picture.pixels[..512 * 128]
                .iter()
                .all(|pixel| pixel.min_element() > 0.0)
        );
    }

    #[test]
    fn the_sun_fades_and_reddens_as_it_sets() {
        // About 100,000 lx on a clear day; 4,000 or so before sunset.
        let noon = sun_irradiance(3.0, 60.0) * 683.0;
        assert!(noon.y > 9e4 && noon.y < 1.1e5 && noon.x > noon.z, "{noon}");
        let evening = sun_irradiance(3.0, 3.0) * 683.0;
        assert!(
            evening.y < 0.1 * noon.y && evening.x > 3.0 * evening.z,
            "{evening}"
        );
        assert!(sun_irradiance(10.0, 0.0).is_finite());
    }

    #[test]
    fn what_the_model_does_not_know_is_refused() {
        for (turbidity, elevation) in [(0.5, 30.0), (11.0, 30.0), (3.0, -1.0), (3.0, 91.0)] {
            assert_eq!(HosekSky::new(turbidity, 0.0, elevation), None);
        }
    }
}
