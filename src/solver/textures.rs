//! Division of elements by their textures, before any light: a painted lamp, a floor that is half dark.
//!
//! An element sends the mean of its textures uniformly, so part of its light leaves from the wrong place: at most half
//! of the mean deviation, displaced by about the radius. At the distance `d` the irradiance from displaced light is
//! wrong by the share `4 · displacement / d` ([`CHANGE`]). For a distance as large as the sending area, these errors
//! are summed over all elements as independent ones, and the elements with the largest errors are divided until the sum
//! is below the tolerance. So fine patterns, whose light leaves evenly, and weak senders are not divided.

use glam::Vec3;
use rayon::prelude::*;

use crate::{
    hierarchy::{Hierarchy, luminance},
    scene::{Appearance, Scene},
};

/// Tolerated error of the light that leaves, relative to all of it. Larger displaces lamps; smaller divides more finely
/// than links resolve.
const TOLERANCE: f32 = 0.02;

/// Relative change of a form factor, in multiples of the displacement over the distance: one for each of the two
/// cosines, two for the squared distance.
const CHANGE: f32 = 4.0;

/// Most elements that textures may make. Fewer, and many painted lamps are coarse; more, and sampling them takes longer
/// than everything else. One lamp takes ten to a hundred, whatever the picture.
const MOST_MADE: usize = 4096;

/// Textures are not measured on elements whose errors together cannot exceed this share of the tolerance. Larger
/// ignores errors; smaller takes time where there are many small textured faces.
const UNSEEN_SHARE: f32 = 0.1;

/// Light of one kind that all elements send: emission, or reflection of uniform light.
#[derive(Clone, Copy, Default)]
struct Sent {
    /// Luminance times area.
    power: f64,
    /// Square of the luminance times area.
    squares: f64,
}

impl Sent {
    fn add(self, luminance: f32, area: f32) -> Self {
        let (luminance, area) = (f64::from(luminance), f64::from(area));
        Self {
            power: self.power + luminance * area,
            squares: self.squares + luminance * luminance * area,
        }
    }

    /// Error due to an element of this area and radius whose light deviates so much from its mean; 0 where nothing is
    /// sent.
    fn error(self, deviation: f32, area: f32, radius: f32) -> f32 {
        // Square root of the area that would send the same power uniformly.
        let size = self.power / self.squares.sqrt();
        let displaced = 0.5 * f64::from(deviation) * f64::from(area) * f64::from(radius);
        let error = f64::from(CHANGE) * displaced / (size * self.power);
        if error.is_finite() { error as f32 } else { 0.0 }
    }
}

/// The textures of a scene with the present appearances.
#[derive(Clone, Copy)]
pub(super) struct Painted<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Appearance by material.
    pub appearances: &'a [Appearance],
}

impl Painted<'_> {
    /// Divide elements by their textures until the error of the light that leaves is below [`TOLERANCE`]. Children are
    /// not smaller than `min_area` (square frame units), and the mesh gets at most `most_elements`.
    pub(super) fn divide(self, hierarchy: &mut Hierarchy, min_area: f32, most_elements: u64) {
        let most = hierarchy.mesh.elements.len() + MOST_MADE;
        let most_elements = most_elements.min(most as u64);
        loop {
            let leaves = self.textured_leaves(hierarchy, min_area);
            let mut wanted = self.misplaced(hierarchy, &leaves);
            while !hierarchy.mesh.fits(&wanted, most_elements) {
                // The first ones have the largest errors.
                wanted.truncate(wanted.len() / 2);
            }
            if wanted.is_empty() || !hierarchy.mesh.divide(&wanted) {
                return;
            }
            hierarchy.color_new_elements(self.scene, self.appearances);
        }
    }

    /// Mean deviation of reflectance and emission within an element; `None` if its textures were not measured.
    pub(super) fn deviation(self, hierarchy: &Hierarchy, element: usize) -> Option<Appearance> {
        let deviation = hierarchy.texture_deviation_of(element)?;
        let triangle = hierarchy.patch_of(element).triangle;
        let material = self.scene.triangles[triangle.index()].material;
        Some(deviation.times(&self.appearances[material.index()], 1.0))
    }

    /// Leaves that textures may divide.
    fn textured_leaves(self, hierarchy: &Hierarchy, min_area: f32) -> Vec<usize> {
        if self.scene.texcoords.is_empty() {
            return Vec::new();
        }
        let leaves = hierarchy.mesh.active_leaves().filter(|&leaf| {
            hierarchy.mesh.size_of_parts(leaf) >= min_area
                && self.scene.is_textured(hierarchy.patch_of(leaf).triangle)
        });
        leaves.collect()
    }

    /// Those of some textured leaves that must be divided, in descending order of error.
    fn misplaced(self, hierarchy: &mut Hierarchy, leaves: &[usize]) -> Vec<u32> {
        if leaves.is_empty() {
            return Vec::new();
        }
        // Measure the textures of leaves that may err.
        let sent = sent(hierarchy);
        let unseen = UNSEEN_SHARE * TOLERANCE / (leaves.len() as f32).sqrt();
        // No deviation is larger than twice the mean.
        let may_err = |&leaf: &usize| {
            let most = shown_by(hierarchy, leaf).map(|mean| 2.0 * mean);
            hierarchy.texture_deviation_of(leaf).is_none()
                && error_of(hierarchy, sent, leaf, most) > unseen
        };
        let unknown: Vec<usize> = leaves.iter().copied().filter(may_err).collect();
        hierarchy.measure_textures(self.scene, self.appearances, &unknown);
        // Take the largest errors until the sum of the others is small.
        let mut errors: Vec<(f32, usize)> = leaves
            .par_iter()
            .filter_map(|&leaf| {
                let deviation = self.deviation(hierarchy, leaf)?;
                let deviations = [deviation.reflectance, deviation.emission];
                let of_leaf = error_of(hierarchy, sent, leaf, deviations);
                (of_leaf > 0.0).then_some((of_leaf, leaf))
            })
            .collect();
        errors.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut rest: f64 = errors
            .iter()
            .map(|(error, _)| f64::from(*error).powi(2))
            .sum();
        let is_wanted = |&(error, _): &(f32, usize)| {
            let is_wrong = rest > f64::from(TOLERANCE).powi(2);
            rest -= f64::from(error).powi(2);
            is_wrong
        };
        let wanted = errors.iter().copied().take_while(is_wanted);
        wanted.map(|(_, leaf)| leaf as u32).collect()
    }
}

/// Mean reflectance and emission of an element.
fn shown_by(hierarchy: &Hierarchy, element: usize) -> [Vec3; 2] {
    [
        hierarchy.reflectance_of(element),
        hierarchy.emission_of(element),
    ]
}

/// Light that all leaves reflect and emit.
fn sent(hierarchy: &Hierarchy) -> [Sent; 2] {
    let leaves = hierarchy.mesh.active_leaves();
    leaves.fold([Sent::default(); 2], |sent, leaf| {
        let area = hierarchy.mesh.elements[leaf].area_vector.length();
        let [reflected, emitted] = shown_by(hierarchy, leaf);
        let add = |sent: Sent, color: Vec3| sent.add(luminance(color.extend(0.0)), area);
        [add(sent[0], reflected), add(sent[1], emitted)]
    })
}

/// Error due to an element whose reflectance and emission have these deviations.
fn error_of(hierarchy: &Hierarchy, sent: [Sent; 2], element: usize, deviations: [Vec3; 2]) -> f32 {
    let element = &hierarchy.mesh.elements[element];
    let area = element.area_vector.length();
    let errors = [0, 1].map(|kind| {
        let deviation = luminance(deviations[kind].extend(0.0));
        sent[kind].error(deviation, area, element.radius)
    });
    errors[0].hypot(errors[1])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DVec3, Vec2};

    use super::*;
    use crate::{
        scene::{
            Face, Material, MaterialId, SceneBuilder, SceneOptions, Sides, Texture, TextureId,
        },
        solver::{Cancel, SolveSettings, Solver, limits::min_area},
    };

    const SIDE: usize = 64;

    /// A square lamp with a picture, by column and row, that faces a black square.
    fn lamp(picture: impl Fn(usize, usize) -> f32) -> Solver {
        let mut builder = SceneBuilder::default();
        builder.textures.push(Texture {
            name: String::new(),
            width: SIDE as u32,
            height: SIDE as u32,
            pixels: (0..SIDE * SIDE)
                .map(|index| Vec3::splat(picture(index % SIDE, index / SIDE)))
                .collect(),
            ..Texture::default()
        });
        builder.push_material(Material {
            emission_texture: Some(TextureId(0)),
            ..Material::plain("lamp", Vec3::ZERO, Vec3::splat(2.0))
        });
        builder.push_material(Material::plain("wall", Vec3::ZERO, Vec3::ZERO));
        let places = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
        for (material, height) in [(0, 0.0), (1, 1.0)] {
            let points = places.map(|place| {
                builder.push_position(DVec3::new(place.x.into(), place.y.into(), height))
            });
            for corners in [[0, 1, 2], [0, 2, 3]] {
                let [a, b, c] = if material == 0 {
                    corners
                } else {
                    [corners[0], corners[2], corners[1]]
                };
                builder.faces.push(Face {
                    corners: [points[a], points[b], points[c]],
                    texcoords: Some([places[a], places[b], places[c]]),
                    normals: None,
                    material: MaterialId(material),
                    line: 0,
                });
            }
        }
        let options = SceneOptions {
            sides: Sides::One,
            ..SceneOptions::default()
        };
        let scene = Arc::new(builder.finish(&options).expect("four faces"));
        let settings = SolveSettings::draft();
        Solver::new(scene, settings, None, &Cancel::default()).expect("nobody cancels")
    }

    /// Whether nothing needs division any more.
    fn is_right(solver: &mut Solver) -> bool {
        let min_area = min_area(&solver.settings, &solver.hierarchy);
        let painted = Painted {
            scene: &solver.scene,
            appearances: &solver.scene.appearances(),
        };
        let leaves = painted.textured_leaves(&solver.hierarchy, min_area);
        painted.misplaced(&mut solver.hierarchy, &leaves).is_empty()
    }

    /// Area and power of the emitting parts, relative to a lamp that is white all over, and their number.
    fn shining(solver: &Solver) -> (f32, f32, usize) {
        let hierarchy = &solver.hierarchy;
        let lamps = (0..hierarchy.patches.len())
            .filter(|&patch| hierarchy.patches[patch].emission != Vec3::ZERO);
        let parts: Vec<usize> = lamps
            .flat_map(|patch| hierarchy.emitting_parts(patch))
            .collect();
        let patches = hierarchy.patches.iter();
        let whole = patches.map(|patch| patch.area).sum::<f32>() / 2.0;
        let area = |part: &usize| hierarchy.mesh.elements[*part].area_vector.length() / whole;
        let power = |part: &usize| area(part) * hierarchy.emission_of(*part).x / 2.0;
        (
            parts.iter().map(area).sum(),
            parts.iter().map(power).sum(),
            parts.len(),
        )
    }

    #[test]
    fn black_parts_of_a_lamp_do_not_emit_and_bright_ones_are_complete() {
        let mut solver = lamp(|column, row| match (column, row) {
            (16..32, 32..48) => 1.0,
            _ => 0.0,
        });
        solver.hierarchy.validate().expect("it is valid");
        assert!(is_right(&mut solver));
        let (area, power, count) = shining(&solver);
        assert!((power - 1.0 / 16.0).abs() < 1e-3, "{power}");
        // Including the rim over which the picture is blurred.
        assert!(area < 0.2, "{area}");
        assert!(count < 200, "{count}");
    }

    #[test]
    fn gradients_and_pictures_are_divided_until_they_are_right() {
        // The second is like a photograph: as rough at every size.
        let rough = |column: usize, row: usize| {
            let waves = (0..6).map(|octave| {
                let (x, y) = (column >> octave, row >> octave);
                ((x * 31 + y * 17 + octave) * 2_654_435_761 % 1000) as f32 / 6000.0
            });
            waves.sum::<f32>()
        };
        for (name, mut solver) in [
            ("gradient", lamp(|column, _| column as f32 / SIDE as f32)),
            ("picture", lamp(rough)),
        ] {
            solver.hierarchy.validate().expect("it is valid");
            assert!(is_right(&mut solver), "{name}");
            let (area, _, count) = shining(&solver);
            assert!(
                area > 0.99 && (4..200).contains(&count),
                "{name}: {area} {count}"
            );
        }
    }

    #[test]
    fn a_fine_pattern_is_not_divided() {
        let fine = lamp(|column, row| {
            if (column + row).is_multiple_of(2) {
                1.0
            } else {
                0.0
            }
        });
        let plain = lamp(|_, _| 0.5);
        let count = |solver: &Solver| solver.hierarchy.mesh.elements.len();
        assert_eq!(count(&fine), count(&plain));
        let (_, power, _) = shining(&fine);
        assert!((power - 0.5).abs() < 0.02, "{power}");
    }
}
