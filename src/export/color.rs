//! From linear radiance to bytes on a screen: exposure, tone curve, sRGB encoding.
//!
//! The viewport's last shader pass does the same, so that an exported vertex has the colour that is seen.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::scene::{srgb_byte, srgb_from_linear};

/// How radiance above the range of the display is brought into it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ToneMap {
    /// Cut off at 1.
    None,
    /// Khronos PBR Neutral: leaves colours below about 0.8 nearly as they are and rolls off what is brighter.
    #[default]
    Neutral,
}

impl ToneMap {
    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Neutral => "Khronos PBR Neutral",
        }
    }

    /// Bring a colour of finite, not negative channels towards 0…1.
    pub fn apply(self, color: Vec3) -> Vec3 {
        match self {
            Self::None => color,
            Self::Neutral => neutral(color),
        }
    }
}

/// How linear radiance becomes a displayed colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ColorOptions {
    /// Exposure in stops: radiance is multiplied by 2 to this power.
    pub exposure_ev: f32,
    /// Tone curve.
    pub tone_map: ToneMap,
}

impl ColorOptions {
    /// Linear radiance times exposure; 0 where it is negative or not a number, finite always.
    pub fn exposed(&self, radiance: Vec3) -> Vec3 {
        (radiance * self.exposure_ev.exp2()).map(|x| if x > 0.0 { x.min(f32::MAX) } else { 0.0 })
    }

    /// The sRGB bytes that show a radiance.
    pub fn encode(&self, radiance: Vec3) -> [u8; 3] {
        self.mapped(radiance).to_array().map(srgb_byte)
    }

    /// The sRGB values that show a radiance, 0…1.
    pub fn displayed(&self, radiance: Vec3) -> Vec3 {
        self.mapped(radiance)
            .clamp(Vec3::ZERO, Vec3::ONE)
            .map(srgb_from_linear)
    }

    fn mapped(&self, radiance: Vec3) -> Vec3 {
        self.tone_map.apply(self.exposed(radiance))
    }
}

/// Khronos PBR Neutral tone curve; takes any colour of finite, not negative channels into 0…1.
fn neutral(color: Vec3) -> Vec3 {
    /// Brightness from which the curve is not linear.
    const START: f32 = 0.8 - 0.04;
    /// How fast bright colours turn white.
    const DESATURATION: f32 = 0.15;
    // Far above white the channels are alike anyway, and a square of such numbers would overflow.
    let color = color.min(Vec3::splat(1e15));
    let smallest = color.min_element();
    let offset = if smallest < 0.08 {
        smallest - 6.25 * smallest * smallest
    } else {
        0.04
    };
    let color = color - offset;
    let peak = color.max_element();
    if peak < START {
        return color.max(Vec3::ZERO);
    }
    let room = 1.0 - START;
    let new_peak = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    (color * (new_peak / peak)).lerp(Vec3::splat(new_peak), white)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::linear_from_srgb;

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        let options = ColorOptions {
            exposure_ev: 0.0,
            tone_map: ToneMap::None,
        };
        for byte in 0..=255_u8 {
            let linear = linear_from_srgb(f32::from(byte) / 255.0);
            assert_eq!(options.encode(Vec3::splat(linear)), [byte; 3]);
        }
    }

    #[test]
    fn exposure_of_one_stop_doubles() {
        let options = ColorOptions {
            exposure_ev: 1.0,
            ..ColorOptions::default()
        };
        assert_eq!(options.exposed(Vec3::splat(0.25)), Vec3::splat(0.5));
    }

    #[test]
    fn neutral_stays_in_range_and_never_falls() {
        let mut last = 0.0;
        for step in 0..400 {
            let value = 1e-3 * 1.1_f32.powi(step);
            let mapped = neutral(Vec3::splat(value)).x;
            assert!(
                (0.0..=1.0).contains(&mapped) && mapped >= last,
                "{value}: {mapped}"
            );
            last = mapped;
        }
    }

    #[test]
    fn what_is_not_a_colour_becomes_black() {
        let options = ColorOptions::default();
        assert_eq!(options.encode(Vec3::splat(f32::NAN)), [0; 3]);
        assert_eq!(options.encode(Vec3::splat(-1.0)), [0; 3]);
    }
}
