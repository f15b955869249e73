//! Pictures back from the adapter: display colours, and linear radiance.

use std::{sync::mpsc, time::Duration};

use glam::Vec4;
use image::{Rgb32FImage, RgbaImage};

use super::{Gpu, Target};

/// Longest wait for the adapter. A large picture on a software adapter takes seconds; more means that it is gone.
const PATIENCE: Duration = Duration::from_secs(120);

/// Why a picture did not come back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the graphics adapter did not hand the picture over: {0}")]
pub struct ReadError(String);

impl Target {
    /// The display picture, sRGB-encoded.
    ///
    /// # Errors
    /// When the device is lost or out of memory.
    pub fn read_display(&self, gpu: &Gpu) -> Result<RgbaImage, ReadError> {
        let bytes = read_texture(gpu, self.display(), 4)?;
        let [width, height] = self.size();
        RgbaImage::from_raw(width, height, bytes).ok_or_else(|| ReadError("wrong size".to_owned()))
    }

    /// The linear picture without its exposure, as radiance.
    ///
    /// # Errors
    /// When the device is lost or out of memory, or the adapter has no linear pictures.
    pub fn read_linear(&self, gpu: &Gpu, exposure_factor: f32) -> Result<Rgb32FImage, ReadError> {
        let pixels = self.read_pixels(gpu)?;
        let [width, height] = self.size();
        let scale = 1.0 / exposure_factor;
        let floats = pixels
            .iter()
            .flat_map(|pixel| (pixel.truncate() * scale).to_array())
            .collect();
        Rgb32FImage::from_raw(width, height, floats)
            .ok_or_else(|| ReadError("wrong size".to_owned()))
    }

    /// The linear picture as it was drawn, exposed, row by row. Alpha is the part of a pixel that is light.
    pub(super) fn read_pixels(&self, gpu: &Gpu) -> Result<Vec<Vec4>, ReadError> {
        if gpu.linear_format != super::LINEAR_FORMAT {
            return Err(ReadError("it cannot draw linear pictures".to_owned()));
        }
        let bytes = read_texture(gpu, self.linear(), 8)?;
        let pixel = |bytes: &[u8]| {
            let channel = |at: usize| f32_from_half(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
            Vec4::from_array([0, 2, 4, 6].map(channel))
        };
        Ok(bytes.chunks_exact(8).map(pixel).collect())
    }
}

/// The rows of a texture without padding. Waits for the adapter.
fn read_texture(
    gpu: &Gpu,
    texture: &wgpu::Texture,
    pixel_bytes: u32,
) -> Result<Vec<u8>, ReadError> {
    Readback::begin(gpu, texture, pixel_bytes).wait(gpu)
}

/// A texture on its way back.
pub(super) struct Readback {
    buffer: wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
    mapped: mpsc::Receiver<Result<(), wgpu::BufferAsyncError>>,
    /// Bytes of a row, without and with padding.
    row: [u32; 2],
}

impl Readback {
    /// Ask for the texture as it is after what was submitted so far.
    pub(super) fn begin(gpu: &Gpu, texture: &wgpu::Texture, pixel_bytes: u32) -> Self {
        let (width, height) = (texture.width(), texture.height());
        let row = width * pixel_bytes;
        let stride = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture read back"),
            size: u64::from(stride) * u64::from(height),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(stride),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        let submission = gpu.queue.submit([encoder.finish()]);
        let (sender, mapped) = mpsc::channel();
        buffer
            .slice(..)
            .map_async(wgpu::MapMode::Read, move |outcome| {
                // Nobody waits after a time-out.
                let _ = sender.send(outcome);
            });
        Self {
            buffer,
            submission,
            mapped,
            row: [row, stride],
        }
    }

    /// The rows, if they are there.
    pub(super) fn poll(&self, gpu: &Gpu) -> Option<Result<Vec<u8>, ReadError>> {
        if let Err(error) = gpu.device.poll(wgpu::PollType::Poll) {
            return Some(Err(failure(gpu, &error)));
        }
        match self.mapped.try_recv() {
            Ok(outcome) => Some(self.rows(gpu, outcome)),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(error) => Some(Err(failure(gpu, &error))),
        }
    }

    /// Wait for the rows.
    pub(super) fn wait(self, gpu: &Gpu) -> Result<Vec<u8>, ReadError> {
        gpu.device
            .poll(wgpu::PollType::Wait {
                submission_index: Some(self.submission.clone()),
                timeout: Some(PATIENCE),
            })
            .map_err(|error| failure(gpu, &error))?;
        let outcome = self
            .mapped
            .recv_timeout(PATIENCE)
            .map_err(|error| failure(gpu, &error))?;
        self.rows(gpu, outcome)
    }

    /// The rows without padding.
    fn rows(
        &self,
        gpu: &Gpu,
        outcome: Result<(), wgpu::BufferAsyncError>,
    ) -> Result<Vec<u8>, ReadError> {
        outcome.map_err(|error| failure(gpu, &error))?;
        let mapped = self
            .buffer
            .slice(..)
            .get_mapped_range()
            .map_err(|error| failure(gpu, &error))?;
        let [row, stride] = self.row.map(|bytes| bytes as usize);
        let rows = mapped.chunks_exact(stride);
        Ok(rows.flat_map(|padded| &padded[..row]).copied().collect())
    }
}

/// The first error of the device, or this error.
fn failure(gpu: &Gpu, error: &dyn std::fmt::Display) -> ReadError {
    let said = gpu.complaint.get().cloned();
    ReadError(said.unwrap_or_else(|| error.to_string()))
}

/// The value of a half float.
fn f32_from_half(half: u16) -> f32 {
    let sign = if half & 0x8000 == 0 { 1.0 } else { -1.0 };
    let exponent = i32::from((half >> 10) & 0x1f);
    let fraction = f32::from(half & 0x3ff) / 1024.0;
    match exponent {
        0 => sign * fraction * 2_f32.powi(-14),
        31 => sign * if fraction > 0.0 { 0.0 } else { f32::MAX },
        _ => sign * (1.0 + fraction) * 2_f32.powi(exponent - 15),
    }
}

#[cfg(test)]
mod tests {
    use super::f32_from_half;

    #[test]
    fn half_floats_are_read() {
        let cases = [
            (0x0000, 0.0),
            (0x3c00, 1.0),
            (0xc000, -2.0),
            (0x3555, 0.333_251_95),
            (0x7bff, 65504.0),
            (0x0001, 5.960_464_5e-8),
        ];
        for (half, expected) in cases {
            assert_eq!(
                f32_from_half(half).to_bits(),
                f32::to_bits(expected),
                "{half:#x}"
            );
        }
    }
}
