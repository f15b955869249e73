//! Pictures of the sky from files: equirectangular, HDR or EXR, with linear radiance.

use std::path::{Path, PathBuf};

use super::{
    Texture, Warning, WarningKind,
    texture::{RadianceError, RadiancePicture},
};

/// A picture of the sky as it was read.
#[derive(Clone, Debug)]
pub struct SkyFile {
    /// Radiance, linear, finite and not negative; the top row is straight up.
    pub picture: Texture,
    /// What was corrected, and what looks wrong.
    pub warnings: Vec<Warning>,
}

/// Why there is no picture of the sky.
#[derive(Debug, thiserror::Error)]
pub enum SkyError {
    /// There is no such file.
    #[error("there is no such picture of the sky: {}", .0.display())]
    NotFound(PathBuf),
    /// It cannot be decoded.
    #[error("cannot read the picture of the sky: {reason}: {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why, a clause.
        reason: String,
    },
    /// Its pixels are bytes, which are no radiance.
    #[error("the picture of the sky has no linear radiance; save it as HDR or EXR: {}", .0.display())]
    NotLinear(PathBuf),
}

/// Read a picture of the sky. Pixels that are negative or not finite become 0.
///
/// # Errors
/// When there is no file, or none with linear radiance.
pub fn read_sky(path: &Path) -> Result<SkyFile, SkyError> {
    if !path.exists() {
        return Err(SkyError::NotFound(path.to_owned()));
    }
    let name = path.file_name().unwrap_or(path.as_os_str());
    let name = name.to_string_lossy();
    let read = Texture::read_radiance(path, &name).map_err(|error| match error {
        RadianceError::NotLinear => SkyError::NotLinear(path.to_owned()),
        RadianceError::Unreadable(reason) => SkyError::Unreadable {
            path: path.to_owned(),
            reason,
        },
    })?;
    Ok(SkyFile {
        warnings: warnings(&read, &name.replace(char::is_control, "\u{fffd}")),
        picture: read.texture,
    })
}

fn warnings(read: &RadiancePicture, name: &str) -> Vec<Warning> {
    let warning = |message: String, count| Warning {
        kind: WarningKind::Light,
        message,
        count,
        place: None,
    };
    let mut warnings = Vec::new();
    if read.corrected > 0 {
        let message =
            format!("sky {name}: a pixel that is negative, infinite or not a number became 0");
        warnings.push(warning(message, read.corrected));
    }
    let [width, height] = read.size;
    if width != 2 * height {
        warnings.push(warning(
            format!(
                "sky {name}: its {width} x {height} pixels were stretched over all directions; an equirectangular picture \
                 is twice as wide as high"
            ),
            1,
        ));
    }
    if read
        .texture
        .pixels
        .iter()
        .all(|pixel| pixel.max_element() <= 0.0)
    {
        warnings.push(warning(format!("sky {name}: it is black"), 1));
    }
    warnings
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use image::{ImageBuffer, Rgb, RgbImage, Rgba};

    use super::*;

    fn sentences(read: &SkyFile) -> String {
        let all: Vec<String> = read.warnings.iter().map(ToString::to_string).collect();
        all.join("\n")
    }

    #[test]
    fn radiance_is_read_as_it_is_and_bad_pixels_are_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.exr");
        // An alpha of 0 hides nothing.
        let mut picture = ImageBuffer::from_pixel(4, 2, Rgba([0.5f32, 100.0, 0.25, 0.0]));
        picture.save(&path).unwrap();
        let read = read_sky(&path).unwrap();
        assert_eq!(read.picture.pixels, [Vec3::new(0.5, 100.0, 0.25); 8]);
        assert_eq!(sentences(&read), "");
        picture.put_pixel(1, 0, Rgba([f32::NAN, 1.0, 1.0, 1.0]));
        picture.put_pixel(2, 0, Rgba([1.0, -1.0, f32::INFINITY, 1.0]));
        picture.put_pixel(3, 1, Rgba([1e30, 1.0, 1.0, 1.0]));
        picture.save(&path).unwrap();
        let read = read_sky(&path).unwrap();
        assert_eq!(read.picture.pixels[1], Vec3::new(0.0, 1.0, 1.0));
        assert_eq!(read.picture.pixels[2], Vec3::X);
        assert!(read.picture.pixels[7].is_finite());
        assert!(
            sentences(&read).contains("became 0 (2 times)"),
            "{}",
            sentences(&read)
        );
    }

    #[test]
    fn pictures_of_other_shapes_and_black_ones_are_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sky.hdr");
        let black = ImageBuffer::from_pixel(4, 4, Rgb([0.0f32; 3]));
        black.save(&path).unwrap();
        let text = sentences(&read_sky(&path).unwrap());
        assert!(
            text.contains("4 x 4") && text.contains("it is black"),
            "{text}"
        );
    }

    #[test]
    fn bytes_and_broken_files_get_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        RgbImage::new(4, 2).save(at("sky.png")).unwrap();
        std::fs::write(at("sky.exr"), b"v/1\x01broken").unwrap();
        for (name, sentence) in [
            ("sky.png", "save it as HDR or EXR"),
            ("sky.exr", "cannot read the picture of the sky"),
            ("none.hdr", "no such picture of the sky"),
        ] {
            let error = read_sky(&at(name)).unwrap_err().to_string();
            assert!(error.contains(sentence) && error.ends_with(name), "{error}");
        }
    }
}
