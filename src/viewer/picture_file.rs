//! Pictures as the bytes of files.

use std::{io::Cursor, path::Path};

use image::{DynamicImage, ImageFormat};

/// Why a picture does not become a file.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// Radiance is asked for, and there is none.
    #[error("this graphics adapter draws no linear pictures; save a PNG instead")]
    NoRadiance,
    /// The format is unknown or does not take it.
    #[error(transparent)]
    Format(#[from] image::ImageError),
}

/// The bytes of a picture file of this name; `.exr` takes the radiance, anything else the display colours.
///
/// # Errors
/// See [`EncodeError`].
pub fn encode(
    display: DynamicImage,
    radiance: Option<DynamicImage>,
    path: &Path,
) -> Result<Vec<u8>, EncodeError> {
    let format = ImageFormat::from_path(path)?;
    let picture = match (format, radiance) {
        (ImageFormat::OpenExr, Some(radiance)) => radiance,
        (ImageFormat::OpenExr, None) => return Err(EncodeError::NoRadiance),
        _ => display,
    };
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format)?;
    Ok(bytes.into_inner())
}
