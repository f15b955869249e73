//! Scenes: triangles with reflectance, emission and sidedness, in a frame of known size.
//!
//! A [`Scene`] is made by [`SceneBuilder`], whatever it comes from (an OBJ file, a built-in scene, a test), so that
//! every scene obeys the same promises: finite positions in the unit frame, no zero-area triangle, reflectance below
//! the clamp, non-negative emission.
//! Units: radiance in units of [`Scene::radiance_unit`], lengths in units of the frame (see [`Frame`]).

mod ahead;
mod appearance;
mod archive;
mod bsdf;
mod build;
mod builder;
pub mod builtin;
mod clean;
mod clip;
mod color;
mod coplanar;
mod crossings;
mod cutout;
mod edges;
mod emission;
mod encoding;
mod environment;
mod finish;
mod fit;
mod frame;
mod geodesic;
mod gltf;
mod hosek;
mod known_light;
mod library;
mod lighting;
mod limited;
mod lines;
mod listed;
mod locate;
mod means;
mod mtl;
mod mtl_specular;
mod nesting;
mod obj;
mod omitted_textures;
mod options;
mod orientation;
mod overlay;
mod palette;
mod placement;
mod progress;
mod ranges;
mod read;
mod read_error;
mod relight;
mod shells;
mod sidedness;
mod size_classes;
mod sky_file;
mod source;
mod specular;
mod suggestion;
#[cfg(test)]
pub(crate) mod test_shapes;
mod texcoords;
mod texture;
mod texture_statement;
mod triangulate;
mod up_axis;
mod upright;
mod usable;
mod warning;
mod whole;
mod wrap;
mod write;

pub use appearance::Appearance;
pub use bsdf::{Gloss, LobeMoments, LobeValue, Specular, reflected, reflected_by_pane, refracted};
pub use builder::{BuildError, Face, ObjectName, SceneBuilder, Source};
pub use color::{LUMINANCE, linear_from_srgb, luminance, srgb_byte, srgb_from_linear};
pub use crossings::CLOSED_GAP;
pub use cutout::{Cutout, SeeThrough};
pub use edges::{DisjointSets, HalfEdge, half_edges};
pub use environment::{Environment, Sky, SkyPicture, SkySample, Sun};
pub use finish::Finish;
pub use frame::Frame;
pub use hosek::HosekSky;
pub use lighting::{Lamp, Lighting, SkySource, SunSource};
pub use means::TextureMeans;
pub use options::{SceneOptions, Sides};
pub use placement::Placement;
pub use progress::ReadProgress;
pub use read::{
    SCENE_ENDINGS, is_scene_ending, read_scene, read_scene_and_faces, read_scene_with_progress,
};
pub use read_error::ReadError;
pub use relight::ActiveMaterials;
pub use size_classes::SizeClasses;
pub use sky_file::{SkyError, SkyFile, read_sky};
pub use suggestion::closest;
pub use texture::{OmittedTextures, Texture};
pub use up_axis::UpAxis;
pub use upright::UpEvidence;
pub use warning::{Warning, WarningKind};
pub use whole::{folder_of, place_of, try_writing, write_whole};
pub use wrap::Wrap;
pub use write::{MaterialLibrary, write_builtin, write_obj};
pub(crate) use write::{coordinates, write_name};

use std::{path::PathBuf, sync::Arc};

use glam::{DVec3, Vec2, Vec3};

use means::TextureAverages;

/// Index of a [`Material`] in [`Scene::materials`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

/// Index of a [`Triangle`] in [`Scene::triangles`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TriangleId(pub u32);

/// Index of a [`Texture`] in [`Scene::textures`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

impl MaterialId {
    /// The position in [`Scene::materials`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl TriangleId {
    /// The position in [`Scene::triangles`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl TextureId {
    /// The position in [`Scene::textures`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl CutoutId {
    /// The position in [`Scene::cutouts`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Index of a [`Cutout`] in [`Scene::cutouts`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CutoutId(pub u32);

/// How a surface reflects, emits and lets light pass. Linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the MTL file, empty for the default material.
    pub name: String,
    /// Diffuse reflectance, 0 up to the clamp of [`SceneOptions::max_reflectance`]; multiplies the texture.
    pub reflectance: Vec3,
    /// Emitted radiance (`Ke`) in units of [`Scene::radiance_unit`], at least 0; multiplies the texture.
    pub emission: Vec3,
    /// `map_Kd`.
    pub reflectance_texture: Option<TextureId>,
    /// `map_Ke`.
    pub emission_texture: Option<TextureId>,
    /// The part that reflects and emits (`d`), 0…1; the rest passes straight on.
    pub opacity: f32,
    /// What is left of the light that passes (`Tf`), by channel, 0…1.
    pub filter: Vec3,
    /// Where the surface is cut out: `map_d`, or the alpha of `map_Kd`.
    pub cutout: Option<CutoutId>,
    /// What it sends in preferred directions. Glass is the part that is not opaque; mirrors and gloss are beside the diffuse
    /// part, with which they reflect at most all light.
    pub specular: Option<Specular>,
    /// Which sides of its faces reflect and emit, where the options leave that to the scene.
    pub sides: Sides,
}

impl Material {
    /// A plain, opaque material without textures.
    pub fn plain(name: &str, reflectance: Vec3, emission: Vec3) -> Self {
        Self {
            name: name.to_owned(),
            reflectance,
            emission,
            reflectance_texture: None,
            emission_texture: None,
            opacity: 1.0,
            filter: Vec3::ONE,
            cutout: None,
            specular: None,
            sides: Sides::Auto,
        }
    }
}

/// A triangle; its front is the side from which the corners run counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Indices into [`Scene::positions`].
    pub corners: [u32; 3],
    /// Its material.
    pub material: MaterialId,
    /// Whether the back reflects and emits as the front does. The back of a one-sided triangle is black but blocks.
    pub two_sided: bool,
    /// Whether it bounds a solid: it is of a closed shell that looks outward, or of a hollow in one. The shell of a room
    /// around everything bounds none.
    pub bounds_solid: bool,
}

/// The quantities of a triangle that transport needs, with textures averaged over its area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Area times unit normal of the front, in square frame units; computed from the file's own digits.
    pub area_vector: Vec3,
    /// Mean reflectance over the whole triangle, 0 where it is cut out; below the clamp.
    pub reflectance: Vec3,
    /// Mean emitted radiance of each side that emits over the whole triangle, 0 where it is cut out; in units of
    /// [`Scene::radiance_unit`].
    pub emission: Vec3,
    /// Mean part of the rays to it that meet it, 0…1; 1 where nothing passes.
    pub opacity: f32,
}

/// A camera of a file, in its coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileView {
    /// The eye.
    pub position: DVec3,
    /// Unit vector in which it looks.
    pub direction: DVec3,
    /// Vertical angle of view.
    pub fov_y_radians: f32,
}

/// A named run of triangles (`o` or `g` in OBJ; a node in glTF).
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Its name in the file.
    pub name: ObjectName,
    /// First triangle.
    pub start: TriangleId,
    /// One past the last triangle.
    pub end: TriangleId,
}

/// A scene ready to be lit.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Its name in titles and reports: the file's stem or the built-in name.
    pub name: String,
    /// The files that it comes from: the OBJ or glTF file, then MTL files, buffers and pictures that were found, those that
    /// no face shows included. Empty for generated scenes.
    pub files: Vec<PathBuf>,
    /// Triangles before faces were cut where others cross or cover them.
    pub face_count: usize,
    /// How positions relate to the file's coordinates.
    pub frame: Frame,
    /// Vertex positions in frame units, equal positions merged; all finite.
    pub positions: Vec<Vec3>,
    /// All triangles, none of zero area.
    pub triangles: Vec<Triangle>,
    /// One per triangle.
    pub surfaces: Vec<Surface>,
    /// Texture coordinates of the corners, one entry per triangle, or empty where no texture is used.
    pub texcoords: Vec<[Vec2; 3]>,
    /// Shading normals of the corners from the file, one entry per triangle, or empty where the file has none.
    /// They steer where the display mesh is smooth; light is computed with geometric normals.
    pub normals: Vec<[Vec3; 3]>,
    /// All materials; at least one.
    pub materials: Vec<Material>,
    /// Decoded textures.
    pub textures: Vec<Texture>,
    /// Pictures of what is cut out.
    pub cutouts: Vec<Cutout>,
    /// Named runs of triangles, in order, covering all of them.
    pub objects: Vec<Object>,
    /// Which axis points up: what the options say, else what is plain, else +Y.
    pub up: UpAxis,
    /// What shows that this axis points up; nothing where it was asked for or is the usual one.
    pub up_evidence: Option<UpEvidence>,
    /// Whether its file says that its unit of length is the metre, as glTF does and OBJ does not.
    pub is_in_metres: bool,
    /// The cameras of its file; the first is the view to open with.
    pub views: Vec<FileView>,
    /// Light from outside; dark as a scene is read.
    pub environment: Arc<Environment>,
    /// Warnings: what was skipped, corrected or clamped.
    pub warnings: Vec<Warning>,
    /// Textures that were omitted on the way in.
    pub omitted_textures: OmittedTextures,
    /// Faces that were omitted since each lies on another one that looks the same way.
    pub doubled_faces: usize,
    /// Reflectance is at most this, see [`SceneOptions::max_reflectance`].
    pub max_reflectance: f32,
    /// The textures, ready for means.
    averages: Arc<TextureAverages>,
    /// The radiance of emission 1, W·sr⁻¹·m⁻²: emission here and light computed from it are multiplied by this on their way
    /// out. A power of two, and 1 unless the file's brightest emission is outside 1e-12 … 1e12.
    pub radiance_unit: f32,
}

impl Scene {
    /// The three corners of a triangle in frame units.
    pub fn corners(&self, triangle: TriangleId) -> [Vec3; 3] {
        self.triangles[triangle.index()]
            .corners
            .map(|corner| self.positions[corner as usize])
    }

    /// The material of a triangle.
    pub fn material(&self, triangle: TriangleId) -> &Material {
        &self.materials[self.triangles[triangle.index()].material.index()]
    }

    /// Whether any triangle emits.
    pub fn has_emitter(&self) -> bool {
        self.surfaces
            .iter()
            .any(|surface| surface.emission != Vec3::ZERO)
    }

    /// Every triangle in order.
    pub fn triangle_ids(&self) -> impl Iterator<Item = TriangleId> + use<> {
        (0..self.triangles.len() as u32).map(TriangleId)
    }

    /// Reflectance at a point of a triangle of what rays meet there, texture looked up. `barycentric` sums to 1.
    pub fn reflectance_at(&self, triangle: TriangleId, barycentric: Vec3) -> Vec3 {
        let reflectance = self.material(triangle).reflectance;
        self.reflected_at(triangle, reflectance, barycentric)
    }

    /// The same where the reflectance of the material is another one.
    pub fn reflected_at(&self, triangle: TriangleId, reflectance: Vec3, barycentric: Vec3) -> Vec3 {
        let material = self.material(triangle);
        let color = reflectance * material.share_of_met();
        self.textured(triangle, material.reflectance_texture, color, barycentric)
    }

    /// Emitted radiance at a point of a triangle of what rays meet there, texture looked up. `barycentric` sums to 1.
    pub fn emission_at(&self, triangle: TriangleId, barycentric: Vec3) -> Vec3 {
        let emission = self.material(triangle).emission;
        self.emitted_at(triangle, emission, barycentric)
    }

    /// The same where the emission of the material is another one.
    pub fn emitted_at(&self, triangle: TriangleId, emission: Vec3, barycentric: Vec3) -> Vec3 {
        let material = self.material(triangle);
        let color = emission * material.share_of_met();
        self.textured(triangle, material.emission_texture, color, barycentric)
    }

    /// A colour of a material with its texture at a point of a triangle.
    fn textured(
        &self,
        triangle: TriangleId,
        texture: Option<TextureId>,
        color: Vec3,
        at: Vec3,
    ) -> Vec3 {
        match (texture, self.texcoords.get(triangle.index())) {
            (Some(texture), Some(uv)) => {
                let at = uv[0] * at.x + uv[1] * at.y + uv[2] * at.z;
                color * self.textures[texture.index()].sample(at)
            }
            _ => color,
        }
    }
}
