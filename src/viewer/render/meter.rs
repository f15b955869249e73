//! The picture as an exposure meter sees it: a small one of luminances, drawn beside the one that is shown.

use super::{
    DEPTH_FORMAT, Gpu, ReadError,
    readback::Readback,
    target::{depth_attachment, texture},
};

/// Bits of a float: every adapter draws these, not every one draws floats.
pub(super) const METER_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Pixels on the longer side of the small picture. Fewer miss small lit places; more take longer to draw and to read
/// back, and change the exposure by less than it is rounded to.
const LONGER_SIDE: u32 = 256;

/// Textures of the meter.
pub(super) struct MeterTarget {
    pub(super) luminance: wgpu::Texture,
    luminance_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl MeterTarget {
    /// A small picture as wide and as high as one of this size, in proportion.
    pub(super) fn new(gpu: &Gpu, size: [u32; 2]) -> Self {
        let longer = size[0].max(size[1]).max(1);
        let size = size.map(|side| (side * LONGER_SIDE.min(longer) / longer).max(1));
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let readable = usage | wgpu::TextureUsages::COPY_SRC;
        let luminance = texture(gpu, "meter", size, METER_FORMAT, 1, readable);
        let depth = texture(gpu, "meter depth", size, DEPTH_FORMAT, 1, usage);
        let whole = wgpu::TextureViewDescriptor::default();
        Self {
            luminance_view: luminance.create_view(&whole),
            depth_view: depth.create_view(&whole),
            luminance,
        }
    }

    /// Begin drawing over nothing.
    pub(super) fn begin<'e>(&self, encoder: &'e mut wgpu::CommandEncoder) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("meter"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.luminance_view,
                resolve_target: None,
                depth_slice: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(depth_attachment(&self.depth_view)),
            ..Default::default()
        })
    }
}

/// A metered picture on its way back from the adapter.
pub struct Metering(Readback);

impl Metering {
    pub(super) fn begin(gpu: &Gpu, target: &MeterTarget) -> Self {
        Self(Readback::begin(gpu, &target.luminance, 4))
    }

    /// The picture, if it is there.
    pub fn poll(&self, gpu: &Gpu) -> Option<Result<Metered, ReadError>> {
        let bytes = self.0.poll(gpu)?;
        Some(bytes.map(|bytes| Metered::from_bits(&bytes)))
    }

    /// Wait for the picture.
    ///
    /// # Errors
    /// When the device is lost or out of memory.
    pub fn wait(self, gpu: &Gpu) -> Result<Metered, ReadError> {
        let bytes = self.0.wait(gpu)?;
        Ok(Metered::from_bits(&bytes))
    }
}

/// Luminances of the pixels of a picture, in W/(sr·m²) before emission scale and exposure. Pixels without light are left
/// out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metered {
    /// Of surfaces that show more reflected light than light of their own.
    pub reflected: Vec<f32>,
    /// Of lamps.
    pub emitted: Vec<f32>,
}

impl Metered {
    /// Twin of `fs_meter` in mesh_pass.wgsl.
    fn from_bits(bytes: &[u8]) -> Self {
        let mut metered = Self::default();
        for bytes in bytes.chunks_exact(4) {
            let luminance = f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            if luminance > 0.0 && luminance.is_finite() {
                metered.reflected.push(luminance);
            } else if luminance < 0.0 && luminance.is_finite() {
                metered.emitted.push(-luminance);
            }
        }
        metered
    }
}
