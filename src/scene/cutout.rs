//! Cut-outs: which parts of a picture are there, at one bit a pixel.

use glam::{Vec2, Vec3};

use super::{Material, Scene, Specular, TriangleId, Wrap, ranges::finite_non_negative};

/// Alpha below which a pixel is cut out.
pub(super) const LEAST_ALPHA: f32 = 0.5;

/// A picture of what is there and what is cut out, looked up without interpolation. Row 0 is the top, so
/// `v` = 1 is the top edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cutout {
    /// File name as the material gives it.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// Pixels row by row from the top, 64 in a word; 1 is there.
    words: Vec<u64>,
    /// How it goes on beyond its edges, along u and v.
    pub wrap: [Wrap; 2],
}

impl Cutout {
    /// The cut-out of a picture of this size; `is_there` gets column and row.
    pub fn new(name: &str, [width, height]: [u32; 2], is_there: impl Fn(u32, u32) -> bool) -> Self {
        let count = width as usize * height as usize;
        let mut words = vec![0; count.div_ceil(64)];
        let places = (0..height).flat_map(|row| (0..width).map(move |column| (column, row)));
        for (index, (column, row)) in places.enumerate() {
            words[index / 64] |= u64::from(is_there(column, row)) << (index % 64);
        }
        Self {
            name: name.to_owned(),
            width,
            height,
            words,
            wrap: <[Wrap; 2]>::default(),
        }
    }

    /// Whether a pixel is there.
    pub fn has(&self, column: u32, row: u32) -> bool {
        let index = row as usize * self.width as usize + column as usize;
        self.words[index / 64] >> (index % 64) & 1 == 1
    }

    /// Whether something is there at a texture coordinate. One that is not finite reads as 0.
    pub fn has_at(&self, uv: Vec2) -> bool {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let pixel = |wrap: Wrap, at: f32, count: u32| {
            ((wrap.place(at) * count as f32) as u32).min(count - 1)
        };
        let [across, down] = self.wrap;
        self.has(
            pixel(across, uv.x, self.width),
            self.height - 1 - pixel(down, uv.y, self.height),
        )
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// Whether nothing is cut out.
    pub fn is_whole(&self) -> bool {
        let count = self.width as usize * self.height as usize;
        let there: usize = self
            .words
            .iter()
            .map(|word| word.count_ones() as usize)
            .sum();
        there == count
    }

    /// Whether the size and the pixels agree, so that looking up cannot fail.
    pub(super) fn is_consistent(&self) -> bool {
        let count = self.width as usize * self.height as usize;
        count > 0 && count.div_ceil(64) == self.words.len()
    }
}

/// What passes straight through a surface: where it is cut out, all light; elsewhere the transmission of its material.
#[derive(Clone, Copy, Debug)]
pub struct SeeThrough<'a> {
    /// Part of the light that passes where it is not cut out, by channel, 0…1.
    pub transmission: Vec3,
    /// What is there of it, with the texture coordinates of the corners.
    pub cutout: Option<(&'a Cutout, [Vec2; 3])>,
}

impl Material {
    /// Part of the light that passes straight through where the material is not cut out, by channel, 0…1.
    /// What glass reflects does not pass; here it is the same from all directions.
    pub fn transmission(&self) -> Vec3 {
        let specular = self.specular.as_ref();
        let clear = specular.map_or(1.0, Specular::mean_transmittance);
        (1.0 - self.opacity) * clear * self.filter
    }

    /// The part of all rays that meet the material where it is not cut out, 0…1: those that do not pass, averaged over
    /// the channels. What the filter absorbs is met, too, and is black.
    pub fn met_share(&self) -> f32 {
        1.0 - self.transmission().element_sum() / 3.0
    }

    /// Whether it looks different from place to place.
    pub fn has_pictures(&self) -> bool {
        self.reflectance_texture.is_some()
            || self.emission_texture.is_some()
            || self.cutout.is_some()
    }

    /// Whether light passes straight through some of it.
    pub fn is_see_through(&self) -> bool {
        self.cutout.is_some() || self.transmission() != Vec3::ZERO
    }

    /// The part of what rays meet that reflects and emits as the colours say, 0…1; the filter absorbs the rest.
    pub fn share_of_met(&self) -> f32 {
        let met = self.met_share();
        if met > 0.0 { self.opacity / met } else { 0.0 }
    }

    /// Bring opacity and filter into their range; what is not finite lets nothing pass.
    pub(super) fn limit_transmission(&mut self) {
        let opacity = self.opacity;
        self.opacity = if opacity.is_finite() {
            opacity.clamp(0.0, 1.0)
        } else {
            1.0
        };
        self.filter = self
            .filter
            .map(|channel| finite_non_negative(channel).min(1.0));
    }
}

impl Scene {
    /// How the pictures of a material go on beyond their edges, along u and v; all in one way.
    pub fn wrap_of(&self, material: &Material) -> [Wrap; 2] {
        let texture = material.reflectance_texture.or(material.emission_texture);
        match (texture, material.cutout) {
            (Some(texture), _) => self.textures[texture.index()].wrap,
            (None, Some(cutout)) => self.cutouts[cutout.index()].wrap,
            (None, None) => [Wrap::Repeat; 2],
        }
    }

    /// What passes through a triangle; `None` where nothing does.
    pub fn see_through(&self, triangle: TriangleId) -> Option<SeeThrough<'_>> {
        let material = self.material(triangle);
        let uv = self.texcoords.get(triangle.index());
        let cutout = material.cutout.zip(uv);
        let see_through = SeeThrough {
            transmission: material.transmission(),
            cutout: cutout.map(|(id, uv)| (&self.cutouts[id.index()], *uv)),
        };
        let is_opaque = see_through.cutout.is_none() && see_through.transmission == Vec3::ZERO;
        (!is_opaque).then_some(see_through)
    }

    /// The part of all rays to a point of a triangle that meet it, 0…1. `barycentric` sums to 1.
    pub fn opacity_at(&self, triangle: TriangleId, barycentric: Vec3) -> f32 {
        match self.see_through(triangle) {
            None => 1.0,
            Some(see_through) if !see_through.has_at(barycentric) => 0.0,
            Some(_) => self.material(triangle).met_share(),
        }
    }

    /// Whether light passes straight through some surface.
    pub fn is_see_through(&self) -> bool {
        self.materials.iter().any(Material::is_see_through)
    }
}

impl SeeThrough<'_> {
    /// Whether the surface is there at a point of its triangle, and not cut out. `barycentric` sums to 1.
    pub fn has_at(&self, barycentric: Vec3) -> bool {
        self.cutout.is_none_or(|(cutout, [a, b, c])| {
            cutout.has_at(a * barycentric.x + b * barycentric.y + c * barycentric.z)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_looked_up_from_the_top_and_repeat() {
        // A width that does not divide 64.
        let cutout = Cutout::new("leaf", [5, 31], |column, row| column == 4 || row == 0);
        assert!(cutout.is_consistent() && !cutout.is_whole());
        for shift in [-3.0, 0.0, 2.0] {
            let at = |x: f32, y: f32| cutout.has_at(Vec2::new(x + shift, y - shift));
            assert!(at(0.9, 0.5) && at(0.1, 0.99));
            assert!(!at(0.1, 0.5) && !at(0.79, 0.01));
        }
        assert!(!cutout.has_at(Vec2::NAN) && Cutout::new("", [3, 3], |_, _| true).is_whole());
    }

    #[test]
    fn what_does_not_pass_is_met_and_what_is_absorbed_is_black() {
        let glass = |opacity: f32, filter: Vec3| {
            let mut glass = Material::plain("glass", Vec3::splat(0.5), Vec3::ZERO);
            (glass.opacity, glass.filter) = (opacity, filter);
            glass.limit_transmission();
            glass
        };
        let clear = glass(0.25, Vec3::ONE);
        assert_eq!((clear.met_share(), clear.share_of_met()), (0.25, 1.0));
        let red = glass(0.4, Vec3::X);
        assert!((red.met_share() - 0.8).abs() < 1e-6 && (red.share_of_met() - 0.5).abs() < 1e-6);
        assert!(!glass(f32::NAN, Vec3::ONE).is_see_through());
        assert!(!glass(-1.0, Vec3::ZERO).is_see_through());
        assert_eq!(glass(-1.0, Vec3::splat(7.0)).share_of_met(), 0.0);
    }
}
