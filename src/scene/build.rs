//! From raw faces in world coordinates to a [`Scene`] that keeps its promises.

use std::{path::PathBuf, sync::Arc};

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::coplanar::Overlaps;
use super::crossings::cut_crossings;
use super::means::TextureAverages;
use super::nesting;
use super::orientation::{Evidence, Facing, Regions};
use super::overlay::{self, DOUBLED};
use super::ranges::{self, finite_non_negative, limited_reflectance};
use super::sidedness::{self, Shells};
use super::texture::MAX_SAMPLES;
use super::{
    Appearance, Frame, Material, MaterialId, Object, Scene, SizeClasses, Spared, Surface, Texture,
    TextureId, Triangle, TriangleId, Warning, WarningKind,
};

/// Which sides of a triangle reflect and emit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sides {
    /// Faces of a consistently wound closed shell are one-sided, all others two-sided.
    #[default]
    Auto,
    /// All one-sided: counter-clockwise is the front.
    One,
    /// All two-sided.
    Two,
}

/// How a scene is read, apart from what the file says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneOptions {
    /// Sidedness of faces.
    pub sides: Sides,
    /// Reflectance above this is clamped, per channel; in 0…1. Near 1 light never dies and errors grow without bound.
    pub max_reflectance: f32,
    /// Whether `Kd` and `Ke` in the MTL file are sRGB-encoded. Textures of 8 bits always are.
    pub mtl_color_is_srgb: bool,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            sides: Sides::Auto,
            max_reflectance: ranges::DEFAULT_MAX_REFLECTANCE,
            mtl_color_is_srgb: false,
        }
    }
}

impl SceneOptions {
    /// The largest reflectance, within 0…1.
    pub(super) fn reflectance_limit(&self) -> f32 {
        self.max_reflectance.clamp(0.0, 1.0)
    }
}

/// A triangle on its way in.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Indices into [`SceneBuilder::positions`].
    pub corners: [u32; 3],
    /// Texture coordinates of the corners.
    pub texcoords: Option<[Vec2; 3]>,
    /// Shading normals of the corners.
    pub normals: Option<[Vec3; 3]>,
    /// Index into [`SceneBuilder::materials`].
    pub material: MaterialId,
    /// Line in the file, 0 where it has none.
    pub line: u32,
}

impl Face {
    /// Make the back the front.
    fn turn(&mut self) {
        self.corners.swap(1, 2);
        if let Some(texcoords) = &mut self.texcoords {
            texcoords.swap(1, 2);
        }
        if let Some(normals) = &mut self.normals {
            normals.swap(1, 2);
        }
    }
}

/// Where the faces come from, for messages.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Name of the scene.
    pub name: String,
    /// File name without folder, empty for generated scenes.
    pub file: String,
    /// See [`Scene::files`].
    pub files: Vec<PathBuf>,
}

/// Collects faces in world coordinates and turns them into a [`Scene`].
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    /// Where it comes from.
    pub source: Source,
    /// World positions; may hold non-finite ones, whose faces are dropped.
    pub positions: Vec<DVec3>,
    /// Triangles.
    pub faces: Vec<Face>,
    /// Materials, in file values (not yet clamped).
    pub materials: Vec<Material>,
    /// Textures that the materials name.
    pub textures: Vec<Texture>,
    /// Object names with the index of their first face, ascending.
    pub objects: Vec<(String, usize)>,
    /// What was met while reading.
    pub warnings: Vec<Warning>,
    /// Textures that were not even read.
    pub spared: Spared,
}

/// Why there is no scene.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BuildError {
    /// Nothing is left to light.
    #[error("no usable faces{detail}")]
    NoFaces {
        /// Why they went, starting with a separator, or empty.
        detail: String,
    },
    /// More than 2³¹ triangles or vertices.
    #[error("too many triangles: {count} (at most {limit})")]
    TooLarge {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
}

impl SceneBuilder {
    /// Add a world position and return its index.
    pub fn push_position(&mut self, position: DVec3) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }

    /// Add a material and return its id.
    pub fn push_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// Add a triangle without texture coordinates.
    pub fn push_triangle(&mut self, corners: [u32; 3], material: MaterialId) {
        self.faces.push(Face {
            corners,
            texcoords: None,
            normals: None,
            material,
            line: 0,
        });
    }

    /// Check, clean, scale and finish.
    ///
    /// # Errors
    /// [`BuildError::NoFaces`] when nothing usable is left, [`BuildError::TooLarge`] beyond 2³¹ of anything.
    pub fn finish(mut self, options: &SceneOptions) -> Result<Scene, BuildError> {
        const LIMIT: usize = i32::MAX as usize;
        let count = self.faces.len().max(self.positions.len());
        if count > LIMIT {
            return Err(BuildError::TooLarge {
                count,
                limit: LIMIT,
            });
        }
        let unusable = self.drop_unusable_faces();
        if self.faces.is_empty() {
            return Err(no_faces(&unusable));
        }
        self.sanitise_textures();
        let losing = self.limit_reflecting_textures(options.reflectance_limit());
        self.sanitise_materials(options, losing);
        let radiance_unit = self.scale_emission();
        let frame = self.frame();
        let (mut positions, mut corner_of) = self.weld(&frame);
        let vanished = self.drop_vanished_faces(&frame, &corner_of);
        if self.faces.is_empty() {
            return Err(no_faces(&vanished));
        }
        let overlaps = self.drop_repeated_faces(&corner_of, &positions);
        let face_count = self.faces.len();
        self.spare_textures();
        let mut triangles = self.triangles(&corner_of, &positions, options);
        self.resolve_overlaps(
            &overlaps,
            &mut triangles,
            &frame,
            &mut positions,
            &mut corner_of,
        );
        let averages = TextureAverages::new(&self.textures, &self.materials);
        let surfaces = self.surfaces(&frame, &averages, options);
        let mut scene = Scene {
            name: self.source.name,
            files: self.source.files,
            face_count,
            frame,
            positions,
            triangles: triangles.list,
            surfaces,
            texcoords: corner_values(&self.faces, |face| face.texcoords),
            normals: corner_values(&self.faces, |face| face.normals),
            materials: self.materials,
            textures: self.textures,
            objects: object_ranges(&self.objects, self.faces.len()),
            warnings: self.warnings,
            spared: self.spared,
            max_reflectance: options.reflectance_limit(),
            averages: Arc::new(averages),
            radiance_unit,
        };
        if !scene.has_emitter() {
            scene.warnings.push(Warning {
                kind: WarningKind::NoEmitter,
                message: "nothing emits light, so the result is black; give a material Ke above 0"
                    .to_owned(),
                count: 1,
                place: None,
            });
        }
        cut_crossings(&mut scene);
        Ok(scene)
    }
}

/// Triangles with the shells they form.
pub(super) struct ShelledTriangles {
    /// In the order of the faces.
    pub(super) list: Vec<Triangle>,
    /// Of these.
    pub(super) shells: Shells,
}

/// The error for faces that were all skipped.
fn no_faces(skipped: &[Skipped]) -> BuildError {
    let count: usize = skipped.iter().map(|skipped| skipped.count).sum();
    let detail = match skipped.first() {
        Some(first) => format!(": all {count} were skipped ({})", first.reason),
        None => String::new(),
    };
    BuildError::NoFaces { detail }
}

/// Faces left out for one reason.
struct Skipped {
    reason: &'static str,
    count: usize,
    /// Line of the first.
    line: u32,
}

/// Area below this fraction of the squared longest edge counts as zero: the rounding of decimal digits in a file
/// leaves about 1e-16, a needle of aspect one in a million has 1e-6.
const DEGENERATE_AREA: f64 = 1e-12;

impl SceneBuilder {
    /// Remove faces with bad indices, non-finite corners or no area.
    fn drop_unusable_faces(&mut self) -> Vec<Skipped> {
        let positions = std::mem::take(&mut self.positions);
        let material_count = self.materials.len().max(1);
        let skipped = self.drop_faces(|_, face| unusable(face, &positions, material_count));
        self.positions = positions;
        skipped
    }

    /// Remove faces that shrink to a line or a point in the frame's single precision.
    fn drop_vanished_faces(&mut self, frame: &Frame, corner_of: &[u32]) -> Vec<Skipped> {
        let positions = std::mem::take(&mut self.positions);
        let skipped = self.drop_faces(|_, face| {
            let [a, b, c] = face.corners.map(|corner| corner_of[corner as usize]);
            let area = area_vector(face.corners.map(|corner| positions[corner as usize]), frame);
            // Of areas whose square underflows there is no direction either.
            let vanished = a == b || b == c || c == a || area.length() == 0.0;
            vanished.then_some("too small next to the size of the scene")
        });
        self.positions = positions;
        skipped
    }

    /// Remove faces with the corners of an earlier one that look the same way, so that the shells of both are as one; returns
    /// which of the others lie over each other.
    fn drop_repeated_faces(&mut self, corner_of: &[u32], positions: &[Vec3]) -> Overlaps {
        loop {
            let corners: Vec<[u32; 3]> = self
                .faces
                .iter()
                .map(|face| face.corners.map(|corner| corner_of[corner as usize]))
                .collect();
            let overlaps = Overlaps::of(&corners, positions);
            let repeated = overlay::repeated(&overlaps, &corners);
            if repeated.is_empty() {
                return overlaps;
            }
            self.drop_faces(|index, _| {
                let is_repeated = repeated.binary_search(&(index as u32)).is_ok();
                is_repeated.then_some(DOUBLED)
            });
        }
    }

    /// Remove the faces for which there is a reason, count them by reason, and keep objects at their first faces. The
    /// reason is asked for by the place among the faces and the face.
    fn drop_faces(
        &mut self,
        reason: impl Fn(usize, &Face) -> Option<&'static str> + Sync,
    ) -> Vec<Skipped> {
        let mut skipped: Vec<Skipped> = Vec::new();
        let faces = self.faces.par_iter().enumerate();
        if !faces
            .clone()
            .any(|(index, face)| reason(index, face).is_some())
        {
            return skipped;
        }
        let (mut index, mut kept) = (0, 0);
        let objects = &mut self.objects;
        let mut next_object = 0;
        self.faces.retain(|face| {
            while objects
                .get(next_object)
                .is_some_and(|object| object.1 <= index)
            {
                objects[next_object].1 = kept;
                next_object += 1;
            }
            index += 1;
            let Some(reason) = reason(index - 1, face) else {
                kept += 1;
                return true;
            };
            match skipped.iter_mut().find(|known| known.reason == reason) {
                Some(known) => known.count += 1,
                None => skipped.push(Skipped {
                    reason,
                    count: 1,
                    line: face.line,
                }),
            }
            false
        });
        for object in &mut objects[next_object..] {
            object.1 = kept;
        }
        for skipped in &skipped {
            self.warn_of_skipped("a face", skipped);
        }
        skipped
    }

    /// Say that faces, or parts of faces, of these lines were left out; nothing where there are none.
    pub(super) fn warn_of_lines(&mut self, what: &str, reason: &'static str, lines: &[u32]) {
        if let Some(&line) = lines.first() {
            let count = lines.len();
            self.warn_of_skipped(
                what,
                &Skipped {
                    reason,
                    count,
                    line,
                },
            );
        }
    }

    /// Add to the warning that the reader may have given for the same reason.
    fn warn_of_skipped(&mut self, what: &str, skipped: &Skipped) {
        let message = format!("skipped {what}: {}", skipped.reason);
        let known = self
            .warnings
            .iter_mut()
            .find(|known| known.message == message);
        if let Some(known) = known {
            known.count += skipped.count;
            return;
        }
        self.warnings.push(Warning {
            kind: WarningKind::FaceSkipped,
            message,
            count: skipped.count,
            place: (skipped.line > 0).then(|| (self.source.file.clone(), skipped.line as usize)),
        });
    }

    /// Make every texture safe to look up.
    fn sanitise_textures(&mut self) {
        for texture in &mut self.textures {
            for pixel in &mut texture.pixels {
                *pixel = pixel.map(finite_non_negative);
            }
        }
        let textures = &self.textures;
        for material in &mut self.materials {
            let usable = |texture: &TextureId| {
                textures
                    .get(texture.index())
                    .is_some_and(Texture::is_consistent)
            };
            material.emission_texture = material.emission_texture.filter(usable);
            material.reflectance_texture = material.reflectance_texture.filter(usable);
        }
    }

    /// Triangles in the frame with their sidedness. Shells that are wound the wrong way are turned.
    fn triangles(
        &mut self,
        corner_of: &[u32],
        positions: &[Vec3],
        options: &SceneOptions,
    ) -> ShelledTriangles {
        let make = |face: &Face| Triangle {
            corners: face.corners.map(|corner| corner_of[corner as usize]),
            material: face.material,
            two_sided: false,
            bounds_solid: false,
        };
        let mut list: Vec<Triangle> = self.faces.iter().map(make).collect();
        debug_assert!(positions.iter().all(|position| position.is_finite()));
        let shells = Shells::of(&list, positions);
        let facings = self.orient(&mut list, &shells, positions, options.sides);
        let flags = sidedness::two_sided(&shells, &facings, options.sides);
        for (triangle, two_sided) in list.iter_mut().zip(flags) {
            triangle.two_sided = two_sided;
            triangle.bounds_solid &= !two_sided;
        }
        ShelledTriangles { list, shells }
    }

    /// Find out which side of each shell is meant, turn those that are wound otherwise, and mark those that bound solids.
    fn orient(
        &mut self,
        list: &mut [Triangle],
        shells: &Shells,
        positions: &[Vec3],
        sides: Sides,
    ) -> Vec<Facing> {
        let parents = nesting::parents(shells, list, positions);
        let (regions, meant) = {
            let regions = Regions::new(
                shells,
                &parents,
                &Evidence {
                    emits: &|triangle| {
                        let material = list[triangle].material;
                        self.materials[material.index()].emission != Vec3::ZERO
                    },
                    area_vector: &|triangle| {
                        let corners = list[triangle].corners;
                        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
                        (b - a).cross(c - a) * 0.5
                    },
                    normals: &|triangle| self.faces[triangle].normals,
                },
            );
            let meant = regions.facings();
            (regions, meant)
        };
        self.warn_of_orientation(shells, &regions, &meant, sides);
        let facings = match sides {
            Sides::Auto => meant,
            Sides::One | Sides::Two => vec![Facing::AsWound; meant.len()],
        };
        let solids = regions.solids(&facings);
        let faces = self.faces.iter_mut().zip(list);
        for ((face, triangle), &shell) in faces.zip(&shells.of_triangle) {
            triangle.bounds_solid = solids[shell as usize];
            if facings[shell as usize] == Facing::Turned {
                triangle.corners.swap(1, 2);
                face.turn();
            }
        }
        facings
    }

    /// Say which shells are not lit as they are wound, or would not be.
    fn warn_of_orientation(
        &mut self,
        shells: &Shells,
        regions: &Regions,
        meant: &[Facing],
        sides: Sides,
    ) {
        let is_odd = |shell: usize| {
            meant[shell] != Facing::AsWound || sides == Sides::One && regions.is_opposed(shell)
        };
        let odd: Vec<usize> = (0..meant.len()).filter(|&shell| is_odd(shell)).collect();
        let is_first = |shell: &u32| odd.first() == Some(&(*shell as usize));
        let Some(first) = shells.of_triangle.iter().position(is_first) else {
            return;
        };
        let of_kind = |kind: Facing| odd.iter().filter(|&&shell| meant[shell] == kind).count();
        let message = match (sides, of_kind(Facing::Turned), of_kind(Facing::Both)) {
            (Sides::Two, _, _) => return,
            (Sides::One, _, _) => {
                "the faces of a surface look away from what they should light, or light falls on their black backs; flip \
                 them, or use --sides auto"
            }
            (Sides::Auto, _, 0) => {
                "the faces of a closed surface looked away from what they should light and were turned; --sides one keeps \
                 their winding"
            }
            (Sides::Auto, 0, _) => {
                "light falls on the backs of a closed surface, so it is lit on both sides; --sides one keeps the backs black"
            }
            (Sides::Auto, _, _) => {
                "the faces of a closed surface looked away from what they should light and were turned or are lit on both \
                 sides; --sides one keeps their winding"
            }
        };
        let line = self.faces[first].line as usize;
        self.warnings.push(Warning {
            kind: WarningKind::Orientation,
            message: message.to_owned(),
            count: odd.len(),
            place: (line > 0).then(|| (self.source.file.clone(), line)),
        });
    }

    /// Bring reflectance and emission into their ranges; give the scene a material if it has none. `clamped` are materials
    /// that reflect too much with their textures.
    fn sanitise_materials(&mut self, options: &SceneOptions, mut clamped: Vec<String>) {
        if self.materials.is_empty() {
            self.materials
                .push(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
        }
        let max = options.reflectance_limit();
        let mut corrected = Vec::new();
        for material in &mut self.materials {
            let reflectance = limited_reflectance(material.reflectance, max);
            let emission = material.emission.map(finite_non_negative);
            if material.reflectance.cmpgt(Vec3::splat(max)).any() {
                clamped.push(material.name.clone());
            }
            if emission != material.emission
                || reflectance
                    .cmpne(material.reflectance.min(Vec3::splat(max)))
                    .any()
            {
                corrected.push(material.name.clone());
            }
            material.reflectance = reflectance;
            material.emission = emission;
        }
        for (names, what) in [
            (
                clamped,
                format!(
                    "reflectance above {max} was clamped to it, since light must lose energy at every bounce"
                ),
            ),
            (
                corrected,
                "reflectance or emission that was negative or not finite was brought into range"
                    .to_owned(),
            ),
        ] {
            if let Some(first) = names.first() {
                self.warnings.push(Warning {
                    kind: WarningKind::ValueClamped,
                    message: format!("material '{first}': {what}"),
                    count: names.len(),
                    place: None,
                });
            }
        }
    }

    /// The frame that fits the corners in use.
    fn frame(&self) -> Frame {
        let corners = self
            .faces
            .par_iter()
            .map(|face| face.corners.map(|corner| self.positions[corner as usize]));
        let (min, max) = corners
            .map(|[a, b, c]| (a.min(b).min(c), a.max(b).max(c)))
            .reduce(
                || (DVec3::MAX, DVec3::MIN),
                |a, b| (a.0.min(b.0), a.1.max(b.1)),
            );
        let extent = (max - min).max_element();
        let frame = Frame::fitting(min, max);
        let sizes = self.sizes_of_reflecting_faces();
        let classes = SizeClasses::new(sizes.iter().map(|&(squared, area, _)| (squared, area)));
        let detail = LARGEST_EXTENT * classes.area.sqrt();
        frame.focused(extent, detail, || {
            let fine = sizes
                .into_iter()
                .filter(|(squared, ..)| classes.is_fine(*squared));
            median(fine.map(|(_, _, centroid)| centroid).collect())
        })
    }

    /// Squared longest edge, area and centroid of all faces that do not emit, or of all where all do, in world units.
    fn sizes_of_reflecting_faces(&self) -> Vec<(f64, f64, DVec3)> {
        let emits = |face: &Face| self.materials[face.material.index()].emission != Vec3::ZERO;
        let all_emit = self.faces.iter().all(emits);
        let chosen = self
            .faces
            .par_iter()
            .filter(|face| all_emit || !emits(face));
        chosen
            .map(|face| {
                let [a, b, c] = face.corners.map(|corner| self.positions[corner as usize]);
                let squares = [a - b, b - c, c - a].map(DVec3::length_squared);
                let longest = squares.into_iter().fold(0.0, f64::max);
                let area = 0.5 * (b - a).cross(c - a).length();
                (longest, area, (a + b + c) / 3.0)
            })
            .collect()
    }

    /// Merge corners that fall on the same frame position; returns the positions and where each old one went.
    fn weld(&self, frame: &Frame) -> (Vec<Vec3>, Vec<u32>) {
        let place = |corner: u32| {
            // Adding 0 turns -0 into 0, so that both have the same bits.
            frame.from_world(self.positions[corner as usize]) + 0.0
        };
        let first_equal = self.first_equal(place);
        let mut positions = Vec::new();
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut corner_of = number.clone();
        for corner in self.faces.iter().flat_map(|face| face.corners) {
            let number = &mut number[first_equal[corner as usize] as usize];
            if *number == u32::MAX {
                *number = positions.len() as u32;
                positions.push(place(corner));
            }
            corner_of[corner as usize] = *number;
        }
        (positions, corner_of)
    }

    /// By corner: the first one in the same place, bit by bit.
    fn first_equal(&self, place: impl Fn(u32) -> Vec3 + Sync) -> Vec<u32> {
        let mut places: Vec<([u32; 3], u32)> = (0..self.positions.len() as u32)
            .into_par_iter()
            .map(|corner| (place(corner).to_array().map(f32::to_bits), corner))
            .collect();
        places.par_sort_unstable();
        let mut first_equal = vec![0; places.len()];
        for equal in places.chunk_by(|a, b| a.0 == b.0) {
            for &(_, corner) in equal {
                first_equal[corner as usize] = equal[0].1;
            }
        }
        first_equal
    }

    /// Area vectors from the file's own digits, and the means of reflectance and emission.
    fn surfaces(
        &self,
        frame: &Frame,
        averages: &TextureAverages,
        options: &SceneOptions,
    ) -> Vec<Surface> {
        let max = options.reflectance_limit();
        self.faces
            .par_iter()
            .map(|face| {
                let corners = face.corners.map(|corner| self.positions[corner as usize]);
                let material = &self.materials[face.material.index()];
                let means = averages.over(&self.textures, material, face.texcoords, MAX_SAMPLES);
                let shown = means.times(&Appearance::of(material), max);
                Surface {
                    area_vector: area_vector(corners, frame),
                    reflectance: shown.reflectance,
                    emission: shown.emission,
                }
            })
            .collect()
    }
}

/// Largest extent of a scene, in multiples of the root of its area, that its frame fits. Usual rooms have less than 1, a
/// corridor 3; beyond, it is far surroundings, or a stray vertex, that make a scene large.
const LARGEST_EXTENT: f64 = 4.0;

/// The median of some points by coordinate, zero of none.
fn median(mut points: Vec<DVec3>) -> DVec3 {
    let middle = points.len() / 2;
    let coordinate = |axis: usize| {
        let (_, point, _) =
            points.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
        point[axis]
    };
    match middle {
        0 => points.first().copied().unwrap_or_default(),
        _ => DVec3::from_array([0, 1, 2].map(coordinate)),
    }
}

/// Area times unit normal in frame units.
fn area_vector([a, b, c]: [DVec3; 3], frame: &Frame) -> Vec3 {
    ((b - a).cross(c - a) * (0.5 * frame.scale * frame.scale)).as_vec3()
}

/// Why a face cannot be used, if it cannot.
fn unusable(face: &Face, positions: &[DVec3], material_count: usize) -> Option<&'static str> {
    if face
        .corners
        .iter()
        .any(|&corner| corner as usize >= positions.len())
    {
        return Some("vertex index out of range");
    }
    if face.material.index() >= material_count {
        return Some("material index out of range");
    }
    let [a, b, c] = face.corners.map(|corner| positions[corner as usize]);
    if !(a.is_finite() && b.is_finite() && c.is_finite()) {
        return Some("a corner is not a finite number");
    }
    is_degenerate([a, b, c]).then_some("no area")
}

/// Whether a triangle has no area but for rounding.
pub(super) fn is_degenerate([a, b, c]: [DVec3; 3]) -> bool {
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    let area = (b - a).cross(c - a).length();
    // Written so that a NaN from overflow counts as degenerate, too.
    !(area > DEGENERATE_AREA * longest && area.is_finite())
}

/// Corner values of all faces if any face has them, else nothing.
fn corner_values<T: Copy + Default>(
    faces: &[Face],
    of: impl Fn(&Face) -> Option<[T; 3]>,
) -> Vec<[T; 3]> {
    if faces.iter().any(|face| of(face).is_some()) {
        faces
            .iter()
            .map(|face| of(face).unwrap_or_default())
            .collect()
    } else {
        Vec::new()
    }
}

/// Runs of triangles from the first faces of objects; together they cover all triangles, and none is empty.
fn object_ranges(starts: &[(String, usize)], triangle_count: usize) -> Vec<Object> {
    let mut objects: Vec<Object> = Vec::new();
    let mut push = |name: &str, start: usize, end: usize| {
        if start >= end {
            return;
        }
        match objects.last_mut() {
            Some(last) if last.name == name => last.end = TriangleId(end as u32),
            _ => objects.push(Object {
                name: name.to_owned(),
                start: TriangleId(start as u32),
                end: TriangleId(end as u32),
            }),
        }
    };
    let first = starts.first().map_or(triangle_count, |(_, start)| *start);
    push("", 0, first.min(triangle_count));
    for (index, (name, start)) in starts.iter().enumerate() {
        let end = starts
            .get(index + 1)
            .map_or(triangle_count, |(_, next)| *next);
        push(name, *start, end.min(triangle_count));
    }
    objects
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builder_of(points: &[[f64; 3]]) -> SceneBuilder {
        let mut builder = SceneBuilder::default();
        for &point in points {
            builder.push_position(DVec3::from_array(point));
        }
        builder
    }

    const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn checkerboard() -> Texture {
        let pixels = [Vec3::ZERO, Vec3::ONE, Vec3::ONE, Vec3::ZERO].to_vec();
        Texture {
            name: "checker".to_owned(),
            width: 2,
            height: 2,
            pixels,
        }
    }

    #[test]
    fn objects_follow_their_faces_when_others_are_dropped() {
        let mut builder = builder_of(&TRIANGLE);
        for (name, corners) in [
            ("a", [0, 0, 1]),
            ("b", [0, 1, 2]),
            ("c", [1, 1, 2]),
            ("d", [0, 2, 1]),
        ] {
            builder.objects.push((name.to_owned(), builder.faces.len()));
            builder.push_triangle(corners, MaterialId(0));
        }
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        let objects = scene.objects.iter().map(|o| (&*o.name, o.start.0, o.end.0));
        assert_eq!(objects.collect::<Vec<_>>(), [("b", 0, 1), ("d", 1, 2)]);
        assert_eq!(scene.warnings[0].count, 2);
    }

    #[test]
    fn faces_before_the_first_object_have_a_nameless_one() {
        let objects = object_ranges(&[("a".to_owned(), 2)], 3);
        assert_eq!(objects.len(), 2);
        assert_eq!(
            (objects[0].end, objects[1].end),
            (TriangleId(2), TriangleId(3))
        );
        assert_eq!(object_ranges(&[], 3).len(), 1);
    }

    #[test]
    fn textured_reflectance_is_the_area_mean() {
        let mut builder = builder_of(&TRIANGLE);
        builder.textures.push(checkerboard());
        let mut material = Material::plain("m", Vec3::splat(0.8), Vec3::splat(3.0));
        material.reflectance_texture = Some(TextureId(0));
        material.emission_texture = Some(TextureId(0));
        builder.push_material(material);
        let uv = [Vec2::ZERO, Vec2::new(8.0, 0.0), Vec2::new(0.0, 8.0)];
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.faces[0].texcoords = Some(uv);
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert!((scene.surfaces[0].reflectance - 0.4).abs().max_element() < 0.01);
        assert!((scene.surfaces[0].emission - 1.5).abs().max_element() < 0.04);
    }

    #[test]
    fn bright_reflectance_texture_is_clamped_but_still_emits() {
        let mut builder = builder_of(&TRIANGLE);
        let mut texture = checkerboard();
        for pixel in &mut texture.pixels {
            *pixel += 39.5;
        }
        builder.textures.push(texture);
        let mut material = Material::plain("m", Vec3::ONE, Vec3::ONE);
        material.reflectance_texture = Some(TextureId(0));
        material.emission_texture = Some(TextureId(0));
        builder.push_material(material);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.faces[0].texcoords = Some([Vec2::ZERO, Vec2::X, Vec2::Y]);
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert!(scene.surfaces[0].reflectance.max_element() <= 0.98);
        assert!((scene.surfaces[0].emission - 40.0).abs().max_element() < 0.1);
    }

    #[test]
    fn faces_that_vanish_in_single_precision_are_dropped() {
        let mut points = TRIANGLE.to_vec();
        points.extend([[1e12, 0.0, 0.0], [0.0, 1e12, 0.0]]);
        let mut builder = builder_of(&points);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.push_triangle([0, 3, 4], MaterialId(0));
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 1);
        assert!(
            scene.warnings[0]
                .message
                .contains("too small next to the size")
        );
    }

    #[test]
    fn faces_whose_area_has_no_square_in_single_precision_are_dropped() {
        let mut points = TRIANGLE.to_vec();
        // About the origin, so that the small triangle keeps its corners apart.
        points.extend([[1e14, 0.0, 0.0], [-1e14, 0.0, 0.0], [0.0, 1e14, 0.0]]);
        points.push([0.0, -1e14, 0.0]);
        let mut builder = builder_of(&points);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.push_triangle([3, 4, 5], MaterialId(0));
        builder.push_triangle([3, 4, 6], MaterialId(0));
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 2);
    }

    #[test]
    fn outward_room_with_a_light_inside_is_named() {
        let mut builder = builder_of(&[
            [0.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],
            [0.0, 9.0, 0.0],
            [0.0, 0.0, 9.0],
            [1.0, 1.0, 1.0],
            [2.0, 1.0, 1.0],
            [1.0, 2.0, 1.0],
        ]);
        let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.5), Vec3::ZERO));
        let light = builder.push_material(Material::plain("light", Vec3::ZERO, Vec3::ONE));
        for corners in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] {
            builder.push_triangle(corners, wall);
        }
        builder.push_triangle([4, 5, 6], light);
        let orientation = |sides| {
            let options = SceneOptions {
                sides,
                ..SceneOptions::default()
            };
            let scene = builder.clone().finish(&options).unwrap();
            let kinds = scene.warnings.iter().map(|warning| warning.kind);
            kinds
                .filter(|&kind| kind == WarningKind::Orientation)
                .count()
        };
        assert_eq!(orientation(Sides::Auto), 1);
        assert_eq!(orientation(Sides::Two), 0);
    }
}
