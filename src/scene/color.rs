//! Linear RGB: its luminance, and its sRGB encoding (IEC 61966-2-1).

use glam::Vec3;

/// Luminance of the channels of linear RGB (Rec. 709).
pub const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of linear RGB (Rec. 709).
pub fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(LUMINANCE)
}

/// sRGB encoding of a linear value of at least 0, continued above 1.
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// The 8-bit sRGB code of a linear value, which is clamped to 0…1.
pub fn srgb_byte(linear: f32) -> u8 {
    (srgb_from_linear(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// Linear value of an sRGB encoding of at least 0, continued above 1.
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for byte in 0..=255_u8 {
            assert_eq!(srgb_byte(linear_from_srgb(f32::from(byte) / 255.0)), byte);
        }
        assert!((linear_from_srgb(1.0) - 1.0).abs() < 1e-6);
        assert!((linear_from_srgb(188.0 / 255.0) - 0.5029).abs() < 1e-4);
    }
}
