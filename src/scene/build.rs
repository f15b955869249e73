//! From raw faces in world coordinates to a [`Scene`] that keeps its promises.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};

use super::{
    Frame, Material, MaterialId, Object, Scene, Surface, Texture, Triangle, TriangleId, Warning,
    WarningKind,
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
            max_reflectance: 0.98,
            mtl_color_is_srgb: false,
        }
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

/// Where the faces come from, for messages.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Name of the scene.
    pub name: String,
    /// File name without folder, empty for generated scenes.
    pub file: String,
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
        let dropped = self.drop_unusable_faces();
        if self.faces.is_empty() {
            let detail = if dropped > 0 {
                format!(": all {dropped} were skipped")
            } else {
                String::new()
            };
            return Err(BuildError::NoFaces { detail });
        }
        self.sanitise_materials(options);
        let frame = self.frame();
        let (positions, corner_of) = self.weld(&frame);
        let mut triangles = Vec::with_capacity(self.faces.len());
        for face in &self.faces {
            triangles.push(Triangle {
                corners: face.corners.map(|corner| corner_of[corner as usize]),
                material: face.material,
                two_sided: false,
            });
        }
        let sides = super::sidedness::two_sided(&triangles, positions.len(), options.sides);
        for (triangle, two_sided) in triangles.iter_mut().zip(sides) {
            triangle.two_sided = two_sided;
        }
        let surfaces = self.surfaces(&frame);
        let mut scene = Scene {
            name: self.source.name,
            frame,
            positions,
            triangles,
            surfaces,
            texcoords: corner_values(&self.faces, |face| face.texcoords),
            normals: corner_values(&self.faces, |face| face.normals),
            materials: self.materials,
            textures: self.textures,
            objects: Vec::new(),
            warnings: self.warnings,
        };
        scene.objects = object_ranges(&self.objects, scene.triangles.len());
        if !scene.has_emitter() {
            scene.warnings.push(Warning {
                kind: WarningKind::NoEmitter,
                message: "nothing emits light, so the result is black; give a material Ke above 0"
                    .to_owned(),
                count: 1,
                place: None,
            });
        }
        Ok(scene)
    }
}

/// Area below this fraction of the squared longest edge counts as zero: the rounding of decimal digits in a file
/// leaves about 1e-16, a needle of aspect one in a million has 1e-6.
const DEGENERATE_AREA: f64 = 1e-12;

impl SceneBuilder {
    /// Remove faces with bad indices, non-finite corners or no area; returns how many went.
    fn drop_unusable_faces(&mut self) -> usize {
        let mut skipped: Vec<(&'static str, usize, u32)> = Vec::new();
        let positions = &self.positions;
        let material_count = self.materials.len().max(1);
        self.faces.retain(|face| {
            let reason = unusable(face, positions, material_count);
            if let Some(reason) = reason {
                match skipped.iter_mut().find(|(known, ..)| *known == reason) {
                    Some((_, count, _)) => *count += 1,
                    None => skipped.push((reason, 1, face.line)),
                }
            }
            reason.is_none()
        });
        for &(reason, count, line) in &skipped {
            let place = (line > 0).then(|| (self.source.file.clone(), line as usize));
            let message = format!("skipped a face: {reason}");
            self.warnings.push(Warning {
                kind: WarningKind::FaceSkipped,
                message,
                count,
                place,
            });
        }
        skipped.iter().map(|(_, count, _)| count).sum()
    }

    /// Bring reflectance and emission into their ranges; give the scene a material if it has none.
    fn sanitise_materials(&mut self, options: &SceneOptions) {
        if self.materials.is_empty() {
            self.materials
                .push(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
        }
        let max = options.max_reflectance.clamp(0.0, 1.0);
        let (mut clamped, mut cured) = (Vec::new(), Vec::new());
        for material in &mut self.materials {
            let reflectance = material.reflectance.map(|x| {
                if x.is_finite() {
                    x.clamp(0.0, max)
                } else {
                    0.0
                }
            });
            let emission = material
                .emission
                .map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 });
            if material.reflectance.cmpgt(Vec3::splat(max)).any() {
                clamped.push(material.name.clone());
            }
            if emission != material.emission
                || reflectance
                    .cmpne(material.reflectance.min(Vec3::splat(max)))
                    .any()
            {
                cured.push(material.name.clone());
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
                cured,
                "reflectance or emission that was negative or not finite was set to 0".to_owned(),
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
        let (mut min, mut max) = (DVec3::MAX, DVec3::MIN);
        for face in &self.faces {
            for corner in face.corners {
                min = min.min(self.positions[corner as usize]);
                max = max.max(self.positions[corner as usize]);
            }
        }
        Frame::fitting(min, max)
    }

    /// Merge corners that fall on the same frame position; returns the positions and where each old one went.
    fn weld(&self, frame: &Frame) -> (Vec<Vec3>, Vec<u32>) {
        let mut merged: HashMap<[u32; 3], u32> = HashMap::with_capacity(self.positions.len());
        let mut positions = Vec::new();
        let mut corner_of = vec![u32::MAX; self.positions.len()];
        for corner in self.faces.iter().flat_map(|face| face.corners) {
            let slot = &mut corner_of[corner as usize];
            if *slot == u32::MAX {
                // Adding 0 turns -0 into 0, so that both have the same bits.
                let position = frame.from_world(self.positions[corner as usize]) + 0.0;
                *slot = *merged
                    .entry(position.to_array().map(f32::to_bits))
                    .or_insert_with(|| {
                        positions.push(position);
                        positions.len() as u32 - 1
                    });
            }
        }
        (positions, corner_of)
    }

    /// Area vectors from the file's own digits, and the means of reflectance and emission.
    fn surfaces(&self, frame: &Frame) -> Vec<Surface> {
        let area_scale = frame.scale * frame.scale;
        self.faces
            .iter()
            .map(|face| {
                let [a, b, c] = face.corners.map(|corner| self.positions[corner as usize]);
                let material = &self.materials[face.material.index()];
                Surface {
                    area_vector: ((b - a).cross(c - a) * 0.5 * area_scale).as_vec3(),
                    reflectance: material.reflectance,
                    emission: material.emission,
                }
            })
            .collect()
    }
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
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    let area = (b - a).cross(c - a).length();
    // Written so that a NaN from overflow counts as degenerate, too.
    if area > DEGENERATE_AREA * longest && area.is_finite() {
        None
    } else {
        Some("no area")
    }
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

/// Runs of triangles from the first faces of objects.
fn object_ranges(starts: &[(String, usize)], triangle_count: usize) -> Vec<Object> {
    let _ = starts;
    vec![Object {
        name: String::new(),
        start: TriangleId(0),
        end: TriangleId(triangle_count as u32),
    }]
}
