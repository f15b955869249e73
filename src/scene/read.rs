//! Reading a scene from a file of any format that is known, told by its content and not by its name.

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Take};
use std::path::Path;

use super::builder::{SceneBuilder, Source};
use super::options::SceneOptions;
use super::progress::{Counted, ReadProgress};
use super::read_error::ReadError;
use super::source::{self, CHANGED, Watch};
use super::warning::Warning;
use super::{Scene, WarningKind, archive, gltf, obj};

/// Endings of the names of scenes, as file dialogs want them. Any file is read that holds one.
pub const SCENE_ENDINGS: [&str; 8] = ["obj", "gltf", "glb", "zip", "OBJ", "GLTF", "GLB", "ZIP"];

/// Whether files with this ending hold scenes.
pub fn is_scene_ending(ending: &str) -> bool {
    let is_this = |known: &&str| known.eq_ignore_ascii_case(ending);
    SCENE_ENDINGS.iter().any(is_this)
}

/// Read a scene: OBJ with its MTL files, or glTF, or an archive with one of them.
///
/// # Errors
/// [`ReadError`] when no scene is left; everything else is a warning in [`Scene::warnings`].
pub fn read_scene(path: &Path, options: &SceneOptions) -> Result<Scene, ReadError> {
    read_scene_with_progress(path, options, &ReadProgress::default())
}

/// Read a scene and report to another thread how much of the file has been read.
///
/// # Errors
/// As [`read_scene`].
pub fn read_scene_with_progress(
    path: &Path,
    options: &SceneOptions,
    progress: &ReadProgress,
) -> Result<Scene, ReadError> {
    import(path, options, progress)?.finish(path, options)
}

/// Read a scene, and keep its faces as they are before they are cleaned and scaled.
///
/// # Errors
/// As [`read_scene`].
pub fn read_scene_and_faces(
    path: &Path,
    options: &SceneOptions,
) -> Result<(Scene, SceneBuilder), ReadError> {
    let import = import(path, options, &ReadProgress::default())?;
    let faces = import.builder().clone();
    Ok((import.finish(path, options)?, faces))
}

/// What a file holds.
enum Import<'a> {
    Obj(Box<obj::Import<'a>>),
    Gltf(Box<gltf::Imported>),
}

impl Import<'_> {
    fn builder(&self) -> &SceneBuilder {
        match self {
            Self::Obj(import) => &import.builder,
            Self::Gltf(import) => &import.builder,
        }
    }

    fn builder_mut(&mut self) -> &mut SceneBuilder {
        match self {
            Self::Obj(import) => &mut import.builder,
            Self::Gltf(import) => &mut import.builder,
        }
    }

    fn finish(self, path: &Path, options: &SceneOptions) -> Result<Scene, ReadError> {
        match self {
            Self::Obj(import) => import.finish(path),
            Self::Gltf(import) => import.finish(path, options),
        }
    }
}

/// Read the file at a path, or the only scene in an archive there.
fn import<'a>(
    path: &Path,
    options: &'a SceneOptions,
    progress: &ReadProgress,
) -> Result<Import<'a>, ReadError> {
    let mut opened = Opened::at(path, progress)?;
    if !archive::is_archive(opened.head(path)?) {
        return opened.import(path, options);
    }
    let unpacked = archive::unpack(path, &mut opened.reader, |ending| {
        is_scene_ending(ending) && !ending.eq_ignore_ascii_case("zip")
    })?;
    let scene = unpacked.scene();
    let inner = Opened::at(&scene, &ReadProgress::default());
    let inner = inner.and_then(|inner| inner.import(&scene, options));
    let mut import = inner.map_err(|error| error.at(path))?;
    let has_changed = opened.watch.has_changed();
    let builder = import.builder_mut();
    builder.source.name = Source::of(path).name;
    builder.source.files = vec![path.to_owned()];
    if has_changed {
        builder.warnings.push(changed());
    }
    Ok(import)
}

/// A file that was opened.
struct Opened {
    reader: Counted<BufReader<Take<File>>>,
    watch: Watch,
}

impl Opened {
    fn at(path: &Path, progress: &ReadProgress) -> Result<Self, ReadError> {
        let (reader, watch) = source::open(path)?;
        Ok(Self {
            reader: progress.count(reader, watch.length()),
            watch,
        })
    }

    /// The beginning of the file.
    fn head(&mut self, path: &Path) -> Result<&[u8], ReadError> {
        let head = self.reader.fill_buf();
        head.map_err(|error| unreadable(&error, path))
    }

    /// Read it as what it holds.
    fn import<'a>(
        mut self,
        path: &Path,
        options: &'a SceneOptions,
    ) -> Result<Import<'a>, ReadError> {
        let head = self.head(path)?;
        if gltf::is_gltf(head) {
            let mut bytes = Vec::new();
            let read = self.reader.read_to_end(&mut bytes);
            read.map_err(|error| unreadable(&error, path))?;
            let mut import = gltf::import(path, &bytes, options)?;
            if self.watch.has_changed() {
                import.builder.warnings.push(changed());
            }
            return Ok(Import::Gltf(Box::new(import)));
        }
        if source::is_binary(head).map_err(|error| unreadable(&error, path))? {
            return Err(ReadError::NotScene {
                path: path.to_owned(),
            });
        }
        let import = obj::import(path, self.reader, &self.watch, options)?;
        Ok(Import::Obj(Box::new(import)))
    }
}

fn unreadable(error: &std::io::Error, path: &Path) -> ReadError {
    ReadError::Unreadable {
        reason: error.to_string(),
        path: path.to_owned(),
    }
}

fn changed() -> Warning {
    Warning {
        kind: WarningKind::FileChanged,
        message: CHANGED.to_owned(),
        count: 1,
        place: None,
    }
}
