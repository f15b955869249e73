//! A lightmap is made, and leaves as pictures.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;
use image::ImageResult;
use serde::Serialize;

use super::{
    images,
    layout::{Layout, LayoutError, PADDING},
    padding::pad,
    seams::{lookup, seam_error},
    sides::Side,
    texels::Texels,
};
use crate::{
    export::MeshOptions,
    picture::{TexelGrid, TexelLight, TexelSource, light_texels},
    scene::TriangleId,
    solver::Cancel,
};

/// What a lightmap is made of.
#[derive(Clone, Copy)]
pub struct LightmapRequest<'a> {
    /// The scene and its light.
    pub source: TexelSource<'a>,
    /// Texels for a unit of the scene's file, above 0; nothing for as many as fit a picture of the usual size.
    pub texels_per_unit: Option<f64>,
}

/// A lightmap.
pub struct Lightmap {
    pub(super) sides: Vec<Side>,
    pub(super) layout: Layout,
    /// Irradiance, W/m², row by row from the top; 0 where there is no surface nor padding.
    pub(super) irradiance: Vec<Vec3>,
    facts: LightmapFacts,
}

/// What is known of a lightmap.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LightmapFacts {
    /// Width and height in texels.
    pub side: u32,
    /// Texels for a unit of the scene's file, but for charts that have fewer.
    pub texels_per_unit: f64,
    /// "file" or "unwrapped": where its texture coordinates come from.
    pub coordinates: &'static str,
    /// Charts, or islands of the file's coordinates.
    pub charts: usize,
    /// Charts with fewer texels.
    pub limited_charts: usize,
    /// Texels that show a surface.
    pub texels: usize,
    /// By how much light differs from one side of smooth seams to the other, root mean square relative to the light there;
    /// nothing without such seams.
    pub seam_error: Option<f64>,
    /// By how much it differs from the light at vertices, likewise over all texels.
    pub beside_vertices: f64,
}

/// Lay out the lit sides of a scene and light their texels. `told` hears the part that is done, 0…1.
///
/// # Errors
/// Where there are too many charts, or it is cancelled.
pub fn bake_lightmap(
    request: &LightmapRequest<'_>,
    told: &(dyn Fn(f32) + Sync),
    cancel: &Cancel,
) -> Result<Lightmap, LayoutError> {
    let scene = request.source.scene;
    let sides = Side::all(scene);
    let scale = scene.frame.scale;
    let density = request
        .texels_per_unit
        .map(|wanted| (wanted / scale).clamp(f64::from(f32::MIN_POSITIVE), 1e30) as f32);
    let layout = Layout::new(scene, &sides, density, &|| cancel.proceed())?;
    let texels = Texels::new(scene, &sides, &layout);
    let grid = TexelGrid {
        size: [layout.side; 2],
        spacing: layout.density.recip(),
        place: &|at| texels.place(at),
    };
    let light = light_texels(&request.source, &grid, told, cancel).ok_or(LayoutError::Cancelled)?;
    let TexelLight {
        mut irradiance,
        beside_vertices,
    } = light;
    let lit = irradiance.iter().flatten().count();
    pad(&mut irradiance, layout.side as usize, PADDING);
    let irradiance: Vec<Vec3> = irradiance
        .into_iter()
        .map(Option::unwrap_or_default)
        .collect();
    let facts = LightmapFacts {
        side: layout.side,
        texels_per_unit: f64::from(layout.density) * scale,
        coordinates: if layout.is_own { "file" } else { "unwrapped" },
        charts: layout.chart_count,
        limited_charts: layout.limited,
        texels: lit,
        seam_error: seam_error(&layout.seams, &irradiance, layout.side),
        beside_vertices,
    };
    Ok(Lightmap {
        sides,
        layout,
        irradiance,
        facts,
    })
}

impl Lightmap {
    /// What is known of it.
    pub fn facts(&self) -> &LightmapFacts {
        &self.facts
    }

    /// Irradiance, W/m², row by row from the top, as it is for the scene in its own units of radiance.
    pub fn irradiance(&self) -> &[Vec3] {
        &self.irradiance
    }

    /// What a bilinear lookup of its irradiance finds at a point of a side of a triangle, W/m²; `None` for a side that is not lit.
    /// `barycentric` sums to 1.
    pub fn lookup(&self, triangle: TriangleId, is_back: bool, barycentric: Vec3) -> Option<Vec3> {
        let key = |side: &Side| (side.triangle, side.is_back);
        let wanted = (triangle, is_back);
        let number = self.sides.binary_search_by_key(&wanted, key).ok()?;
        let corners = self.layout.corners[number];
        let order = self.sides[number].order();
        let places = [0, 1, 2].map(|corner| corners[corner] * barycentric[order[corner]]);
        let place = places.into_iter().sum();
        Some(lookup(&self.irradiance, self.layout.side, place))
    }

    /// The bytes of an OpenEXR file of the irradiance, linear, W/m².
    ///
    /// # Errors
    /// Those of the encoder.
    pub fn exr(&self, options: &MeshOptions) -> ImageResult<Vec<u8>> {
        let values = self.irradiance.iter();
        images::linear(values.map(|&light| options.scaled(light)), self.layout.side)
    }

    /// The bytes of a PNG file of what a white surface would send, exposed and cut off at 1.
    ///
    /// # Errors
    /// Those of the encoder.
    pub fn png(&self, options: &MeshOptions) -> ImageResult<Vec<u8>> {
        let values = self.irradiance.iter();
        let white = |&light: &Vec3| options.color.exposed(options.scaled(light) * FRAC_1_PI);
        images::display(values.map(white), self.layout.side)
    }
}
