//! Reading an OBJ file with its MTL files and textures into a [`Scene`].
//!
//! The file passes [`ObjCleaner`], beside it the parser, then [`Triangulator`], and ends in [`SceneBuilder`]. What can be
//! skipped is skipped, counted and named with its line; only what leaves no scene is an error.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::ahead::parse_ahead;
use super::build::{BuildError, Face, SceneBuilder, SceneOptions, Source};
use super::clean::{FaceNote, MAX_LIBRARIES, Mention, Notes, ObjCleaner};
use super::locate::{Missing, locate};
use super::mtl::{MtlMaterial, TextureReference, read_mtl};
use super::progress::ReadProgress;
use super::source;
use super::texture::linear_from_srgb;
use super::triangulate::{MAX_CLIPPED_CORNERS, Triangulator};
use super::warning::WarningKind;
use super::{Material, MaterialId, Scene, Texture, TextureId};

/// Why an OBJ file gives no scene.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// No file of that name.
    #[error("there is no such file; check the name: {}", path.display())]
    NotFound {
        /// What was asked for.
        path: PathBuf,
    },
    /// A folder instead of a file.
    #[error("this is a folder; name the OBJ file in it: {}", path.display())]
    Folder {
        /// What was asked for.
        path: PathBuf,
    },
    /// A pipe or a device: it may have no end.
    #[error("this is a pipe or a device; save the scene to a file first: {}", path.display())]
    NotFile {
        /// What was asked for.
        path: PathBuf,
    },
    /// The system refuses to read it.
    #[error("the file cannot be read ({reason}); check its permissions and the disk: {}", path.display())]
    Unreadable {
        /// What the system says.
        reason: String,
        /// What was asked for.
        path: PathBuf,
    },
    /// Nothing but white space.
    #[error("the file is empty; export the scene again: {}", path.display())]
    Empty {
        /// What was asked for.
        path: PathBuf,
    },
    /// Another format.
    #[error("this is not an OBJ text file; export the scene as Wavefront OBJ: {}", path.display())]
    NotObj {
        /// What was asked for.
        path: PathBuf,
    },
    /// No face is left to light.
    #[error("there are no usable faces{detail}; export the surfaces as polygons: {}", path.display())]
    NoFaces {
        /// Why they went, starting with a separator, or empty.
        detail: String,
        /// What was asked for.
        path: PathBuf,
    },
    /// More than the program can index.
    #[error("there are too many triangles or vertices ({count}, at most {limit}); split the scene: {}", path.display())]
    TooLarge {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
        /// What was asked for.
        path: PathBuf,
    },
    /// The parser gave up on text that was cleaned for it.
    #[error("the OBJ parser gave up ({reason}); export the scene again with another program: {}", path.display())]
    Parser {
        /// What the parser says.
        reason: String,
        /// What was asked for.
        path: PathBuf,
    },
}

/// Read an OBJ file.
///
/// # Errors
/// [`ReadError`] when no scene is left; everything else is a warning in [`Scene::warnings`].
pub fn read_obj(path: &Path, options: &SceneOptions) -> Result<Scene, ReadError> {
    read_obj_with_progress(path, options, &ReadProgress::default())
}

/// Read an OBJ file and tell another thread how much of it has been read.
///
/// # Errors
/// As [`read_obj`].
pub fn read_obj_with_progress(
    path: &Path,
    options: &SceneOptions,
    progress: &ReadProgress,
) -> Result<Scene, ReadError> {
    let (reader, watch) = source::open(path)?;
    let reader = progress.count(reader, watch.length());
    let file = path
        .file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned();
    let (models, mut notes) = parse(path, ObjCleaner::new(reader, &file))?;
    if watch.has_changed() {
        let message = "the file changed while it was read; open it again once it is whole";
        notes.log.note(WarningKind::FileChanged, message, "", 0);
    }
    let stem = path.file_stem().unwrap_or(path.as_os_str());
    let mut import = Import {
        options,
        root: folder_of(path),
        builder: SceneBuilder {
            source: Source {
                name: stem.to_string_lossy().into_owned(),
                file,
            },
            ..SceneBuilder::default()
        },
        notes,
        textures: HashMap::new(),
        pixel_budget: PIXEL_BUDGET,
        library_budget: MAX_LIBRARIES,
        slots: Vec::new(),
        default_slot: None,
    };
    import.materials(&models);
    import.models(&models);
    drop(models);
    import.finish(path)
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Run the parser over the clean text.
fn parse(
    path: &Path,
    cleaner: ObjCleaner<impl BufRead + Send>,
) -> Result<(Vec<tobj::Model>, Notes), ReadError> {
    let options = tobj::LoadOptions::default();
    let parsed = parse_ahead(cleaner, |text| {
        tobj::load_obj_buf(text, &options, |_| Err(tobj::LoadError::OpenFileFailed))
    });
    let path = path.to_owned();
    let parsed = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            let reason = error.to_string();
            return Err(ReadError::Unreadable { reason, path });
        }
    };
    let (Some(models), Some(notes)) = (parsed.value, parsed.notes) else {
        let reason = "internal failure".to_owned();
        return Err(ReadError::Parser { reason, path });
    };
    if let Some(reason) = notes.failure {
        return Err(ReadError::Unreadable { reason, path });
    }
    match models {
        Ok(_) if !notes.any_text => Err(ReadError::Empty { path }),
        Ok(_) if notes.statements == 0 => Err(ReadError::NotObj { path }),
        Ok((models, _)) => Ok((models, notes)),
        Err(error) => Err(ReadError::Parser {
            reason: error.to_string(),
            path,
        }),
    }
}

/// Pixels of all textures together: 768 MiB. The next picture gets a quarter of what is left.
const PIXEL_BUDGET: usize = 1 << 26;

/// Bytes of an MTL file that are read.
const MAX_MTL_BYTES: u64 = 256 << 20;

/// A material of the scene with what its faces need.
#[derive(Clone, Copy, Debug)]
struct Slot {
    id: MaterialId,
    /// Scale and offset of texture coordinates, where it has a texture.
    mapping: Option<(DVec2, DVec2)>,
}

/// The scene on its way in.
struct Import<'a> {
    options: &'a SceneOptions,
    root: PathBuf,
    builder: SceneBuilder,
    notes: Notes,
    /// Pictures by path; nothing where reading failed.
    textures: HashMap<PathBuf, Option<TextureId>>,
    pixel_budget: usize,
    /// Names of MTL files that are still looked for.
    library_budget: usize,
    /// By index in [`Notes::materials`].
    slots: Vec<Slot>,
    default_slot: Option<Slot>,
}

/// What the faces of a material can show.
#[derive(Clone, Copy, Debug, Default)]
struct Shown {
    has_faces: bool,
    /// Whether any of them has texture coordinates.
    has_texcoords: bool,
}

/// A material with the file it comes from.
struct Defined {
    material: MtlMaterial,
    file: String,
    /// Folder of the MTL file, relative to that of the OBJ file.
    folder: PathBuf,
}

impl Import<'_> {
    /// Make a material of each name that `usemtl` mentions.
    fn materials(&mut self, models: &[tobj::Model]) {
        let library = self.read_libraries();
        let mut unknown = Vec::new();
        let shown = self.shown(models);
        let mentions = std::mem::take(&mut self.notes.materials);
        for (mention, shown) in mentions.into_iter().zip(shown) {
            let slot = match library.get(&mention.name) {
                Some(defined) => self.define(defined, shown),
                None => {
                    let grey = Material::plain(&mention.name, DEFAULT_REFLECTANCE, Vec3::ZERO);
                    unknown.push(mention);
                    Slot {
                        id: self.builder.push_material(grey),
                        mapping: None,
                    }
                }
            };
            self.slots.push(slot);
        }
        self.warn_of_unknown(&unknown);
    }

    /// What the faces of each material that is mentioned can show.
    fn shown(&self, models: &[tobj::Model]) -> Vec<Shown> {
        let mut shown = vec![Shown::default(); self.notes.materials.len()];
        for model in models {
            let segment = model.name.parse::<usize>().ok();
            let segment = segment.and_then(|segment| self.notes.segments.get(segment));
            if let Some(material) = segment.and_then(|segment| segment.material) {
                shown[material].has_faces |= !model.mesh.indices.is_empty();
                // What is not finite stands for none.
                let mut texcoords = model.mesh.texcoords.iter();
                shown[material].has_texcoords |= texcoords.any(|at| at.is_finite());
            }
        }
        shown
    }

    fn warn_of_unknown(&mut self, unknown: &[Mention]) {
        const LISTED: usize = 8;
        let Some(first) = unknown.first() else {
            return;
        };
        let names = unknown
            .iter()
            .take(LISTED)
            .map(|mention| format!("'{}'", shortened(&mention.name)));
        let mut listed = names.collect::<Vec<_>>().join(", ");
        if unknown.len() > LISTED {
            listed += &format!(" and {} more", unknown.len() - LISTED);
        }
        let message = format!("no material file defines {listed}; grey is used instead");
        let count = unknown.iter().map(|mention| mention.count).sum();
        let file = &self.builder.source.file;
        let kind = WarningKind::MaterialMissing;
        self.notes
            .log
            .note_times(kind, &message, count, file, first.line);
    }

    /// Read every MTL file that is mentioned; later definitions of a name replace earlier ones.
    fn read_libraries(&mut self) -> HashMap<String, Defined> {
        let mut library = HashMap::new();
        let mut read = Vec::new();
        for mention in std::mem::take(&mut self.notes.libraries) {
            for path in self.library_paths(&mention) {
                if !read.contains(&path) {
                    self.read_library(&path, &mut library);
                    read.push(path);
                }
            }
        }
        library
    }

    /// The files that one `mtllib` means: its whole text as one name with spaces, else a list of names.
    fn library_paths(&mut self, mention: &Mention) -> Vec<PathBuf> {
        let here = Path::new("");
        if let Ok(path) = locate(&self.root, here, &mention.name) {
            return vec![path];
        }
        let mut words: Vec<&str> = mention
            .name
            .split_whitespace()
            .take(self.library_budget)
            .collect();
        self.library_budget -= words.len();
        let all = words
            .iter()
            .map(|word| locate(&self.root, here, word))
            .collect::<Vec<_>>();
        if all.iter().all(Result::is_err) {
            // One missing name with spaces is likelier than several missing ones.
            words = vec![&mention.name];
        }
        let mut found = Vec::new();
        for (word, path) in words.into_iter().zip(all) {
            let why = match path {
                Ok(path) => {
                    found.push(path);
                    continue;
                }
                Err(Missing::Absent) => "was not found beside the OBJ file",
                Err(Missing::Outside) => "lies outside the folder of the OBJ file and was not read",
            };
            let message = format!("material file '{}' {why}", shortened(word));
            let file = &self.builder.source.file;
            let kind = WarningKind::MaterialMissing;
            self.notes
                .log
                .note_times(kind, &message, mention.count, file, mention.line);
        }
        found
    }

    fn read_library(&mut self, path: &Path, library: &mut HashMap<String, Defined>) {
        let file = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let log = &mut self.notes.log;
        let materials = File::open(self.root.join(path))
            .map_err(|error| format!("it cannot be opened ({error})"))
            .and_then(|source| read_mtl(BufReader::new(source.take(MAX_MTL_BYTES)), &file, log));
        match materials {
            Ok(materials) => library.extend(materials.into_iter().map(|material| {
                let defined = Defined {
                    file: file.clone(),
                    folder: path.parent().unwrap_or(Path::new("")).to_owned(),
                    material,
                };
                (defined.material.name.clone(), defined)
            })),
            Err(reason) => {
                let message = format!("material file '{file}' was left out: {reason}");
                log.note(WarningKind::MaterialMissing, &message, "", 0);
            }
        }
    }

    /// Turn a material of an MTL file into one of the scene. Pictures that no face shows are not read, but where a missing
    /// colour depends on whether there is one.
    fn define(&mut self, defined: &Defined, shown: Shown) -> Slot {
        let MtlMaterial {
            diffuse,
            emissive,
            diffuse_map,
            emissive_map,
            ..
        } = &defined.material;
        let mut texture = |map: &Option<TextureReference>, color: &Option<Vec3>| {
            if shown.has_texcoords || (shown.has_faces && color.is_none()) {
                return self.texture(map.as_ref(), defined);
            }
            self.builder.spared.unused_textures += usize::from(map.is_some());
            None
        };
        let reflectance_texture = texture(diffuse_map, diffuse);
        let emission_texture = texture(emissive_map, emissive);
        // A texture without a colour stands for itself.
        let bare = |texture: Option<TextureId>, otherwise: Vec3, most: f32| {
            texture.map_or(otherwise, |_| Vec3::splat(most))
        };
        let most = self.options.max_reflectance.clamp(0.0, 1.0);
        let linear = |colour: Vec3| {
            if self.options.mtl_color_is_srgb {
                colour.map(linear_from_srgb)
            } else {
                colour
            }
        };
        let material = Material {
            name: defined.material.name.clone(),
            reflectance: diffuse.map_or_else(
                || bare(reflectance_texture, DEFAULT_REFLECTANCE, most),
                linear,
            ),
            emission: emissive.map_or_else(|| bare(emission_texture, Vec3::ZERO, 1.0), linear),
            reflectance_texture,
            emission_texture,
        };
        let mapping = self.mapping(&material, defined);
        Slot {
            id: self.builder.push_material(material),
            mapping,
        }
    }

    /// How the material's textures lie; both share the coordinates of a face.
    fn mapping(&mut self, material: &Material, defined: &Defined) -> Option<(DVec2, DVec2)> {
        let of = |texture: Option<TextureId>, map: &Option<TextureReference>| {
            texture.and(map.as_ref()).map(|map| (map.scale, map.offset))
        };
        let diffuse = of(material.reflectance_texture, &defined.material.diffuse_map);
        let emissive = of(material.emission_texture, &defined.material.emissive_map);
        if diffuse.is_some() && emissive.is_some() && diffuse != emissive {
            let message =
                "map_Ke with other -s or -o than map_Kd: those of map_Kd are used for both";
            self.note_defined(WarningKind::Unsupported, message, defined);
        }
        diffuse.or(emissive)
    }

    fn note_defined(&mut self, kind: WarningKind, message: &str, defined: &Defined) {
        let line = defined.material.line;
        self.notes.log.note(kind, message, &defined.file, line);
    }

    /// Read a picture once; a missing or broken one is a warning.
    fn texture(
        &mut self,
        reference: Option<&TextureReference>,
        defined: &Defined,
    ) -> Option<TextureId> {
        let reference = reference?;
        if let Some(option) = &reference.ignored {
            let message = format!("texture option {option} is not followed");
            self.note_defined(WarningKind::Unsupported, &message, defined);
        }
        let why = match locate(&self.root, &defined.folder, &reference.name) {
            Ok(path) => match self.load(&path, &reference.name) {
                Ok(id) => return Some(id),
                Err(reason) => format!("cannot be used: {reason}"),
            },
            Err(Missing::Absent) => "was not found".to_owned(),
            Err(Missing::Outside) => {
                "lies outside the folder of the OBJ file and was not read".to_owned()
            }
        };
        let name = shortened(&reference.name);
        let message = format!("texture '{name}' {why}; the plain colour is used");
        self.note_defined(WarningKind::TextureMissing, &message, defined);
        None
    }

    fn load(&mut self, path: &Path, name: &str) -> Result<TextureId, String> {
        if let Some(known) = self.textures.get(path) {
            return known.ok_or_else(|| "see above".to_owned());
        }
        let read = Texture::read(&self.root.join(path), name).map(|texture| {
            let texture = texture.reduced_to(self.pixel_budget / 4);
            self.pixel_budget = self.pixel_budget.saturating_sub(texture.pixels.len());
            self.builder.textures.push(texture);
            TextureId(self.builder.textures.len() as u32 - 1)
        });
        self.textures
            .insert(path.to_owned(), read.as_ref().ok().copied());
        read
    }

    /// Copy all parsed faces into the builder.
    fn models(&mut self, models: &[tobj::Model]) {
        let mut triangulator = Triangulator::default();
        let faces = std::mem::take(&mut self.notes.faces);
        self.builder.faces.reserve(faces.len());
        let mut faces = faces.into_iter();
        for model in models {
            let segment = model.name.parse::<usize>().ok();
            let Some(segment) = segment.and_then(|segment| self.notes.segments.get(segment)) else {
                continue;
            };
            let objects = &mut self.builder.objects;
            if objects
                .last()
                .is_none_or(|(name, _)| **name != *segment.object)
            {
                objects.push((segment.object.to_string(), self.builder.faces.len()));
            }
            let slot = match segment.material {
                Some(material) => self.slots[material],
                None => self.default_slot(),
            };
            self.mesh(&model.mesh, slot, &mut triangulator, &mut faces);
        }
    }

    fn default_slot(&mut self) -> Slot {
        let builder = &mut self.builder;
        *self.default_slot.get_or_insert_with(|| Slot {
            id: builder.push_material(Material::plain("", DEFAULT_REFLECTANCE, Vec3::ZERO)),
            mapping: None,
        })
    }

    fn mesh(
        &mut self,
        mesh: &tobj::Mesh,
        slot: Slot,
        triangulator: &mut Triangulator,
        faces: &mut impl Iterator<Item = FaceNote>,
    ) {
        let base = self.builder.positions.len();
        let points = mesh.positions.as_chunks::<3>().0;
        self.builder
            .positions
            .extend(points.iter().map(|&point| DVec3::from_array(point)));
        let mut start = 0;
        let mut polygon = Vec::new();
        while start < mesh.indices.len() {
            let Some(FaceNote { line, corner_count }) = faces.next() else {
                break;
            };
            let count = corner_count as usize;
            let corners = Corners { mesh, slot, start };
            if count == 3 {
                self.push_face(&corners, [0, 1, 2], base, line);
            } else {
                polygon.clear();
                polygon.extend((0..count).map(|corner| corners.position(corner)));
                let (triangles, too_many) = triangulator.cut(&polygon);
                for &triangle in triangles.as_chunks::<3>().0 {
                    self.push_face(&corners, triangle.map(|corner| corner as usize), base, line);
                }
                if too_many {
                    self.warn_of_fan(line);
                }
            }
            start += count.max(1);
        }
    }

    fn warn_of_fan(&mut self, line: u32) {
        let message = format!(
            "a face with more than {MAX_CLIPPED_CORNERS} corners that is not convex was cut as a fan and may overlap itself; export it triangulated"
        );
        let file = &self.builder.source.file;
        self.notes
            .log
            .note(WarningKind::Unsupported, &message, file, line as usize);
    }

    fn push_face(&mut self, corners: &Corners, which: [usize; 3], base: usize, line: u32) {
        let index = |corner: usize| {
            let index = corners.mesh.indices[corners.start + corner] as usize + base;
            // Beyond the range it stays out of range, and the builder says so.
            u32::try_from(index).unwrap_or(u32::MAX)
        };
        self.builder.faces.push(Face {
            corners: which.map(index),
            texcoords: corners.texcoords(which),
            normals: corners.normals(which),
            material: corners.slot.id,
            line,
        });
    }

    /// Build the scene, with what was noted while reading before what the builder adds.
    fn finish(mut self, path: &Path) -> Result<Scene, ReadError> {
        let skipped = self.notes.skipped_faces;
        let (file, log) = (self.builder.source.file.clone(), self.notes.log);
        self.builder.warnings = log.into_warnings();
        let first = self
            .builder
            .warnings
            .iter()
            .find(|warning| warning.kind == WarningKind::FaceSkipped);
        let first = first.map(ToString::to_string);
        let path = path.to_owned();
        self.builder
            .finish(self.options)
            .map_err(|error| match error {
                BuildError::NoFaces { detail } => ReadError::NoFaces {
                    detail: match first {
                        Some(first) if skipped > 0 => format!(" ({first})"),
                        _ if detail.is_empty() => format!(" (no face is defined in {file})"),
                        _ => detail,
                    },
                    path,
                },
                BuildError::TooLarge { count, limit } => ReadError::TooLarge { count, limit, path },
            })
    }
}

/// Reflectance where the file gives none.
const DEFAULT_REFLECTANCE: Vec3 = Vec3::splat(0.5);

/// Textures repeat, and far from the origin single precision has no digits left for the picture: faces are moved by so
/// many periods. Fewer, and the coordinates of neighbours are torn apart where nothing asks for it; many more, and the
/// digits are gone.
const NEAR_PERIODS: f64 = 256.0;

/// A name short enough for a message.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 120;
    if name.chars().count() <= LONGEST {
        return name.to_owned();
    }
    name.chars().take(LONGEST).chain(['…']).collect()
}

/// The corners of one face of a parsed mesh.
struct Corners<'a> {
    mesh: &'a tobj::Mesh,
    slot: Slot,
    start: usize,
}

impl Corners<'_> {
    fn position(&self, corner: usize) -> DVec3 {
        let index = self.mesh.indices[self.start + corner] as usize * 3;
        DVec3::from_slice(&self.mesh.positions[index..index + 3])
    }

    /// Texture coordinates, mapped and moved next to the origin, where the material has a texture.
    fn texcoords(&self, which: [usize; 3]) -> Option<[Vec2; 3]> {
        let (scale, offset) = self.slot.mapping?;
        let mut uv = [DVec2::ZERO; 3];
        for (uv, corner) in uv.iter_mut().zip(which) {
            let index = *self.mesh.texcoord_indices.get(self.start + corner)? as usize * 2;
            let value = DVec2::from_slice(self.mesh.texcoords.get(index..index + 2)?);
            *uv = value * scale + offset;
        }
        let shift = (uv[0] / NEAR_PERIODS).round() * NEAR_PERIODS;
        let uv = uv.map(|uv| (uv - shift).as_vec2());
        uv.iter().all(|uv| uv.is_finite()).then_some(uv)
    }

    fn normals(&self, which: [usize; 3]) -> Option<[Vec3; 3]> {
        let mut normals = [Vec3::ZERO; 3];
        for (normal, corner) in normals.iter_mut().zip(which) {
            let index = *self.mesh.normal_indices.get(self.start + corner)? as usize * 3;
            let value = DVec3::from_slice(self.mesh.normals.get(index..index + 3)?);
            *normal = value.try_normalize()?.as_vec3();
        }
        Some(normals)
    }
}
