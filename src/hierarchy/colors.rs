//! Colours of elements on which textures vary: each reflects and emits the mean of the textures over itself.
//!
//! Patches have colours of their own. More is kept only of textured patches that were divided, and of their elements;
//! a parent has the mean of its children, so that what a patch emits is what its leaves emit together.

use glam::Vec3;
use rayon::prelude::*;

use super::Hierarchy;
use crate::{
    geometry::barycentric_in_plane,
    scene::{Appearance, Scene, TextureMeans, TriangleId},
};

/// Colours of elements that differ from their patch.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementColors {
    /// By element: index into `varied`, or [`Self::PLAIN`]. Empty where there is none, and shorter than the elements where
    /// new ones have not been coloured yet: these look as their patch.
    slots: Vec<u32>,
    varied: Vec<Varied>,
}

/// Mean colours of textures on an element.
#[derive(Clone, Copy, Debug)]
struct Varied {
    means: TextureMeans,
    /// Mean absolute difference between the quarters of the element and the whole.
    deviation: TextureMeans,
    shown: Appearance,
}

impl ElementColors {
    const PLAIN: u32 = u32::MAX;

    fn of(&self, element: usize) -> Option<&Varied> {
        let slot = *self.slots.get(element)?;
        self.varied.get(slot as usize)
    }

    fn insert(&mut self, element: usize, varied: Varied) {
        if self.slots.len() <= element {
            self.slots.resize(element + 1, Self::PLAIN);
        }
        match self.slots[element] {
            Self::PLAIN => {
                self.slots[element] = self.varied.len() as u32;
                self.varied.push(varied);
            }
            slot => self.varied[slot as usize] = varied,
        }
    }

    /// Bytes in use.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.slots.as_slice()) + size_of_val(self.varied.as_slice())
    }
}

impl Hierarchy {
    /// Mean diffuse reflectance of an element.
    pub fn diffuse_reflectance_of(&self, element: usize) -> Vec3 {
        match self.colors.of(element) {
            Some(varied) => varied.shown.reflectance,
            None => self.patch_of(element).reflectance,
        }
    }

    /// Mean reflectance of an element with what mirrors, gloss and glass reflect as if it were diffuse.
    pub fn reflectance_of(&self, element: usize) -> Vec3 {
        let diffuse = self.diffuse_reflectance_of(element);
        match self
            .diffused
            .get(self.mesh.elements[element].patch as usize)
        {
            Some(&diffused) if diffused != Vec3::ZERO => {
                let most = Vec3::splat(self.max_reflectance);
                (diffuse + diffused * self.opacity_of(element)).min(most)
            }
            _ => diffuse,
        }
    }

    /// Mean emitted radiance of an element.
    pub fn emission_of(&self, element: usize) -> Vec3 {
        match self.colors.of(element) {
            Some(varied) => varied.shown.emission,
            None => self.patch_of(element).emission,
        }
    }

    /// Mean part of the rays to an element that meet it, 0…1. Reflectance and emission are means over all of it.
    pub fn opacity_of(&self, element: usize) -> f32 {
        match self.colors.of(element) {
            Some(varied) => varied.means.opacity,
            None => self.patch_of(element).opacity,
        }
    }

    /// Largest channel of the reflectance of any element.
    pub fn largest_reflectance(&self) -> f32 {
        let patches = self.patches.par_iter().map(|patch| patch.reflectance);
        let varied = self.colors.varied.par_iter();
        let all = patches.chain(varied.map(|varied| varied.shown.reflectance));
        let diffuse = all.map(Vec3::max_element).reduce(|| 0.0, f32::max);
        let with_specular = (0..self.diffused.len()).into_par_iter();
        let with_specular = with_specular.map(|patch| self.reflectance_of(patch).max_element());
        diffuse.max(with_specular.reduce(|| 0.0, f32::max))
    }

    /// Means of the textures over an element.
    pub fn texture_means_of(&self, scene: &Scene, element: usize) -> TextureMeans {
        match self.colors.of(element) {
            Some(varied) => varied.means,
            None => scene.texture_means(self.patch_of(element).triangle),
        }
    }

    /// By how much the textures of the quarters of an element differ from those of the whole, in the mean; `None` where
    /// nobody has looked.
    pub fn texture_deviation_of(&self, element: usize) -> Option<TextureMeans> {
        Some(self.colors.of(element)?.deviation)
    }

    /// Parts of a patch, none within another, that emit evenly as far as elements tell: leaves, and elements all of whose
    /// leaves emit the same. Elements that emit nothing are omitted.
    pub fn emitting_parts(&self, patch: usize) -> Vec<usize> {
        let mut parts = Vec::new();
        self.collect_even(patch, &mut parts);
        parts.retain(|&part| self.emission_of(part) != Vec3::ZERO);
        parts
    }

    /// Add the even parts of an element. Returns the emission of the whole where it is one part.
    fn collect_even(&self, element: usize, parts: &mut Vec<usize>) -> Option<Vec3> {
        let before = parts.len();
        let children = self.mesh.elements[element].children();
        let emission = self.emission_of(element);
        let mut is_even = true;
        for child in children {
            is_even &= self.collect_even(child, parts) == Some(emission);
        }
        if is_even {
            parts.truncate(before);
            parts.push(element);
        }
        is_even.then_some(emission)
    }

    /// Measure the means and deviations of the textures on some elements.
    pub fn measure_textures(
        &mut self,
        scene: &Scene,
        appearances: &[Appearance],
        elements: &[usize],
    ) {
        let measured: Vec<Varied> = elements
            .par_iter()
            .map(|&element| self.look(scene, appearances, element))
            .collect();
        for (&element, varied) in elements.iter().zip(measured) {
            self.colors.insert(element, varied);
            self.show_textures(scene, appearances, element);
        }
    }

    /// Colour the elements that were made since the last time, where textures vary; materials have these appearances.
    pub fn color_new_elements(&mut self, scene: &Scene, appearances: &[Appearance]) {
        if scene.texcoords.is_empty() {
            return;
        }
        let is_textured = |&element: &usize| scene.is_textured(self.patch_of(element).triangle);
        let first = self.colors.slots.len().max(self.patches.len());
        let fresh: Vec<usize> = (first..self.mesh.elements.len())
            .filter(is_textured)
            .collect();
        if fresh.is_empty() {
            return;
        }
        self.measure_textures(scene, appearances, &fresh);
        self.pull_textures(scene, appearances);
    }

    /// Give patches and elements the colours that materials of these appearances have.
    pub fn paint(&mut self, scene: &Scene, appearances: &[Appearance]) {
        let surfaces = scene.surfaces_under(appearances);
        let patches = self.patches.par_iter_mut().with_min_len(4096);
        patches.for_each(|patch| {
            let surface = &surfaces[patch.triangle.index()];
            patch.reflectance = surface.reflectance;
            patch.emission = surface.emission;
        });
        for element in 0..self.colors.slots.len() {
            self.show_textures(scene, appearances, element);
        }
    }

    /// Mean colours of textures on an element.
    fn look(&self, scene: &Scene, appearances: &[Appearance], element: usize) -> Varied {
        let triangle = self.patch_of(element).triangle;
        let whole = scene.corners(triangle);
        let corners = self.mesh.corners(element);
        let part = corners.map(|corner| barycentric_in_plane(corner, whole));
        let quarters = scene.texture_quarters(triangle, part);
        let means = mean_of(quarters.into_iter());
        let deviation = mean_of(quarters.into_iter().map(|quarter| TextureMeans {
            reflectance: (quarter.reflectance - means.reflectance).abs(),
            emission: (quarter.emission - means.emission).abs(),
            opacity: (quarter.opacity - means.opacity).abs(),
        }));
        Varied {
            means,
            deviation,
            shown: shown(scene, appearances, triangle, means),
        }
    }

    /// Carry the means of textures up from the leaves.
    fn pull_textures(&mut self, scene: &Scene, appearances: &[Appearance]) {
        // Children come after their parents.
        for element in (0..self.colors.slots.len()).rev() {
            let children = self.mesh.elements[element].children();
            let known = children.filter_map(|child| Some(self.colors.of(child)?.means));
            if known.clone().next().is_none() {
                continue;
            }
            let means = mean_of(known);
            let triangle = self.patch_of(element).triangle;
            let varied = Varied {
                means,
                deviation: TextureMeans {
                    reflectance: Vec3::ZERO,
                    emission: Vec3::ZERO,
                    opacity: 0.0,
                },
                shown: shown(scene, appearances, triangle, means),
            };
            self.colors.insert(element, varied);
            self.show_textures(scene, appearances, element);
        }
    }

    /// Bring the colours of an element up to date with its textures.
    fn show_textures(&mut self, scene: &Scene, appearances: &[Appearance], element: usize) {
        let triangle = self.patch_of(element).triangle;
        let slot = self.colors.slots[element] as usize;
        let Some(varied) = self.colors.varied.get_mut(slot) else {
            return;
        };
        varied.shown = shown(scene, appearances, triangle, varied.means);
        let (shown, opacity) = (varied.shown, varied.means.opacity);
        if let Some(patch) = self.patches.get_mut(element) {
            (patch.reflectance, patch.emission) = (shown.reflectance, shown.emission);
            patch.opacity = opacity;
        }
    }
}

/// Mean colours of the textures of a material on a part of a triangle.
fn shown(
    scene: &Scene,
    appearances: &[Appearance],
    triangle: TriangleId,
    means: TextureMeans,
) -> Appearance {
    let material = scene.triangles[triangle.index()].material;
    means.times(&appearances[material.index()], scene.max_reflectance)
}

/// Mean of at least one.
fn mean_of(parts: impl Iterator<Item = TextureMeans>) -> TextureMeans {
    let (mut reflectance, mut emission) = (Vec3::ZERO, Vec3::ZERO);
    let (mut opacity, mut count) = (0.0, 0.0);
    for part in parts {
        reflectance += part.reflectance;
        emission += part.emission;
        opacity += part.opacity;
        count += 1.0;
    }
    TextureMeans {
        reflectance: reflectance / count,
        emission: emission / count,
        opacity: opacity / count,
    }
}
