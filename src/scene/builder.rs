//! Raw faces in world coordinates, on their way to a [`super::Scene`].

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

use super::{
    Cutout, Material, MaterialId, Texture, UpAxis, Warning, WarningKind, texture::OmittedTextures,
};

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
    pub(super) fn turn(&mut self) {
        self.corners.swap(1, 2);
        if let Some(texcoords) = &mut self.texcoords {
            texcoords.swap(1, 2);
        }
        if let Some(normals) = &mut self.normals {
            normals.swap(1, 2);
        }
    }
}

/// What a run of faces is called in its file; empty where it has no name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ObjectName {
    /// The object (`o` in OBJ).
    pub object: Arc<str>,
    /// The group within the object (`g` in OBJ).
    pub group: Arc<str>,
}

impl ObjectName {
    /// The narrower of both names.
    pub fn label(&self) -> &str {
        match &*self.group {
            "" => &self.object,
            group => group,
        }
    }
}

impl From<&str> for ObjectName {
    fn from(object: &str) -> Self {
        Self {
            object: object.into(),
            group: Arc::default(),
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
    /// See [`super::Scene::files`].
    pub files: Vec<PathBuf>,
    /// The axis that points up in what its program writes, where that is known.
    pub up: Option<UpAxis>,
    /// See [`super::Scene::is_in_metres`].
    pub is_in_metres: bool,
}

impl Source {
    /// A file that says nothing of its up axis.
    pub(super) fn of(path: &Path) -> Self {
        let text = |name: Option<&OsStr>| {
            name.unwrap_or(path.as_os_str())
                .to_string_lossy()
                .into_owned()
        };
        Self {
            name: text(path.file_stem()),
            file: text(path.file_name()),
            files: vec![path.to_owned()],
            up: None,
            is_in_metres: false,
        }
    }
}

/// Collects faces in world coordinates and turns them into a [`super::Scene`].
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
    /// Pictures of what is cut out that the materials name.
    pub cutouts: Vec<Cutout>,
    /// Names of objects with the index of their first face, ascending.
    pub objects: Vec<(ObjectName, usize)>,
    /// Warnings of the reader.
    pub warnings: Vec<Warning>,
    /// Textures that were not even read.
    pub omitted_textures: OmittedTextures,
    /// Faces omitted since each lies on another one that looks the same way.
    pub(super) doubled_faces: usize,
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

    /// Say that faces, or parts of faces, of these lines were omitted; nothing where there are none.
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
    pub(super) fn warn_of_skipped(&mut self, what: &str, skipped: &Skipped) {
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
}

/// Faces omitted for one reason.
pub(super) struct Skipped {
    pub(super) reason: &'static str,
    pub(super) count: usize,
    /// Line of the first.
    pub(super) line: u32,
}
