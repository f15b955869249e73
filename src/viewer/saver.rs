//! Pictures, lit meshes and tables to files, on threads of their own.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError, mpsc::Sender},
    thread::{self, JoinHandle},
};

use image::{DynamicImage, RgbaImage};

use super::{
    loader::SceneSource,
    messages::Severity,
    picture_file::{EncodeError, encode},
    render::{CutoutTarget, Gpu, ReadError, Target},
};
use crate::{
    export::{self, MeshFormat, MeshOptions, UnknownMeshFormat, write_csv},
    geometry::RayTree,
    metrics::SceneComparison,
    picture::harmonics_at_vertices,
    scene::{MaterialLibrary, Scene, folder_of, is_scene_ending, place_of, write_whole},
    solver::{Cancel, Snapshot},
    worker::{self, Wake},
};

/// A sentence from another thread.
pub type Notice = (Severity, String);

/// Threads that write files; the program stays until they are done.
#[derive(Clone, Default)]
pub struct Unfinished(Arc<Mutex<Vec<JoinHandle<()>>>>);

impl Unfinished {
    fn add(&self, thread: JoinHandle<()>) {
        let mut threads = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        threads.retain(|thread| !thread.is_finished());
        threads.push(thread);
    }

    /// Wait for all of them.
    pub fn finish(&self) {
        let threads = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        for thread in threads {
            // A panic of the thread has been printed.
            let _ = thread.join();
        }
    }
}

/// A picture that the adapter is drawing.
pub struct Drawn {
    /// Where it is drawn.
    pub canvas: Canvas,
    /// By what.
    pub gpu: Gpu,
    /// The factor on its radiance.
    pub exposure_factor: f32,
}

/// Where a picture is drawn.
pub enum Canvas {
    /// Over a background.
    Opaque(Box<Target>),
    /// Without one.
    Cutout(Box<CutoutTarget>),
}

/// Where a picture comes from.
pub enum Shot {
    /// The adapter, once it is done.
    Drawn(Box<Drawn>),
    /// The window.
    Seen(RgbaImage),
}

impl Shot {
    /// Wait for the picture: display colours, and linear radiance where there is any.
    fn read(self) -> Result<(DynamicImage, Option<DynamicImage>), SaveError> {
        let opaque = |display: RgbaImage| DynamicImage::from(display).into_rgb8().into();
        let drawn = match self {
            Self::Seen(display) => return Ok((opaque(display), None)),
            Self::Drawn(drawn) => drawn,
        };
        let (gpu, exposure_factor) = (&drawn.gpu, drawn.exposure_factor);
        match &drawn.canvas {
            Canvas::Opaque(target) => {
                let display = target.read_display(gpu)?;
                let radiance = target.read_linear(gpu, exposure_factor).ok();
                Ok((opaque(display), radiance.map(DynamicImage::from)))
            }
            Canvas::Cutout(target) => {
                let cutout = target.read(gpu, exposure_factor)?;
                let (display, radiance) = cutout.into_images();
                Ok((display, Some(radiance)))
            }
        }
    }
}

/// The content of a file.
pub enum Content {
    /// A picture; `.exr` takes the radiance.
    Picture(Shot),
    /// The mesh with light at its vertices.
    Mesh(LitMesh),
    /// Error against run time, as a table with a line for each step.
    Table(SceneComparison),
}

/// A mesh to be exported.
pub struct LitMesh {
    /// Mesh and light.
    pub snapshot: Arc<Snapshot>,
    /// Their scene, and all of its triangles.
    pub scene: Arc<Scene>,
    /// See above.
    pub rays: Arc<RayTree>,
    /// Whether light by direction is added, and the seed of its random numbers.
    pub harmonics: Option<u64>,
    /// Options of the file.
    pub options: MeshOptions,
}

impl LitMesh {
    fn save(&self, path: &Path) -> Result<(), SaveError> {
        let format = MeshFormat::of(path)?;
        let library = format
            .companions(path, &self.scene)
            .map_err(SaveError::Write)?;
        let companions = library.as_ref().map_or(Vec::new(), MaterialLibrary::paths);
        for path in [path.to_owned()].into_iter().chain(companions) {
            if is_one_of(&path, &self.scene.files) {
                return Err(SaveError::Input(path));
            }
        }
        let wanted = self.harmonics.filter(|_| format.holds_attributes());
        let harmonics = wanted.and_then(|seed| {
            let (scene, rays, snapshot) = (&self.scene, &self.rays, &self.snapshot);
            let work = || harmonics_at_vertices(scene, rays, snapshot, seed, &Cancel::default());
            match worker::pool_that_gives_way("harmonics", 0) {
                Some(pool) => pool.install(work),
                None => work(),
            }
        });
        let lit = export::LitMesh {
            snapshot: &self.snapshot,
            scene: &self.scene,
            harmonics: harmonics.as_deref(),
            lamps: &[],
        };
        if let Some(library) = library {
            library.write(&self.scene).map_err(SaveError::Write)?;
        }
        let written = write_whole(path, |out| format.write(out, path, lit, &self.options));
        written.map_err(SaveError::Write)
    }
}

/// Whether a path leads to one of some files.
fn is_one_of(path: &Path, files: &[PathBuf]) -> bool {
    let place = place_of(path);
    // A file that does not exist yet is none of them.
    place.exists() && files.iter().any(|file| place_of(file) == place)
}

/// Something on its way to a file.
pub struct Saving {
    /// Where to; the ending names the format.
    pub path: PathBuf,
    /// The content.
    pub content: Content,
}

impl Saving {
    /// Write it, and say how that went.
    pub fn start(self, notices: Sender<Notice>, unfinished: &Unfinished, wake: Wake) {
        let failed = notices.clone();
        let spawned = thread::Builder::new()
            .name("saver".to_owned())
            .spawn(move || {
                // Nobody listens once the window is closed.
                let _ = notices.send(self.write());
                wake();
            });
        match spawned {
            Ok(thread) => unfinished.add(thread),
            Err(error) => {
                let text = format!("cannot start to save: {error}");
                let _ = failed.send((Severity::Error, text));
            }
        }
    }

    fn write(self) -> Notice {
        let written = match self.content {
            Content::Picture(shot) => shot.read().and_then(|shot| save(shot, &self.path)),
            Content::Mesh(mesh) => mesh.save(&self.path),
            Content::Table(table) => write_whole(&self.path, |out| write_csv(table.rows(), out))
                .map_err(SaveError::Write),
        };
        match written {
            Ok(()) => {
                let place = std::path::absolute(&self.path).unwrap_or(self.path);
                (Severity::Note, format!("saved {}", place.display()))
            }
            Err(error) => {
                let text = format!("cannot save {}: {error}", self.path.display());
                (Severity::Error, text)
            }
        }
    }
}

fn save(
    (display, radiance): (DynamicImage, Option<DynamicImage>),
    path: &Path,
) -> Result<(), SaveError> {
    let bytes = encode(display, radiance, path)?;
    write_whole(path, |out| out.write_all(&bytes)).map_err(SaveError::Write)
}

/// Why something does not become a file.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// It did not come back from the adapter.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The picture does not become such a file.
    #[error(transparent)]
    Encode(#[from] EncodeError),
    /// The format is none of meshes.
    #[error(transparent)]
    MeshFormat(#[from] UnknownMeshFormat),
    /// It would replace what the scene is read from.
    #[error("it would replace a file that the scene is read from, {}; choose another name", .0.display())]
    Input(PathBuf),
    /// The system refuses.
    #[error(transparent)]
    Write(std::io::Error),
}

/// A name for a picture that is free, beside the scene where that is a file, else in the pictures folder: `scene_1.png`
/// and on.
pub fn free_picture_path(source: Option<&SceneSource>) -> PathBuf {
    let folder = match source.and_then(SceneSource::path) {
        Some(path) => folder_of(path).to_owned(),
        None => directories::UserDirs::new()
            .and_then(|folders| folders.picture_dir().map(Path::to_owned))
            .filter(|folder| folder.is_dir())
            .unwrap_or_default(),
    };
    let name = source.map(SceneSource::label).unwrap_or_default();
    free_name(&folder, &plain_stem(&name), "png")
}

/// A name for a table of errors that is free, beside the scene where that is a file: `scene_errors_1.csv` and on.
pub fn free_table_path(source: &SceneSource) -> PathBuf {
    free_path_beside(source, "errors", "csv")
}

/// A name for the lit mesh that is free, beside the scene where that is a file: `scene_lit_1.glb` and on.
pub fn free_mesh_path(source: &SceneSource) -> PathBuf {
    free_path_beside(source, "lit", MeshFormat::Glb.extension())
}

fn free_path_beside(source: &SceneSource, what: &str, extension: &str) -> PathBuf {
    let folder = source
        .path()
        .map(|path| folder_of(path).to_owned())
        .unwrap_or_default();
    let stem = format!("{}_{what}", plain_stem(&source.label()));
    free_name(&folder, &stem, extension)
}

/// The name of a scene as files may have it.
fn plain_stem(scene: &str) -> String {
    let stem = match scene.rsplit_once('.') {
        Some((stem, ending)) if is_scene_ending(ending) => stem,
        _ => scene,
    };
    let stem: String = stem
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "-_".contains(c) {
                c
            } else {
                '_'
            }
        })
        .collect();
    if stem.is_empty() {
        "vecrad".to_owned()
    } else {
        stem
    }
}

fn free_name(folder: &Path, stem: &str, extension: &str) -> PathBuf {
    (1_u32..)
        .map(|number| folder.join(format!("{stem}_{number}.{extension}")))
        .find(|path| !path.exists())
        .unwrap_or_else(|| folder.join(format!("vecrad.{extension}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_stand_beside_their_scene_under_free_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let source = SceneSource::File(folder.path().join("Hall 2.OBJ"));
        let first = free_picture_path(Some(&source));
        assert_eq!(first, folder.path().join("Hall_2_1.png"));
        std::fs::write(&first, "").expect("a file");
        assert_eq!(
            free_picture_path(Some(&source)),
            folder.path().join("Hall_2_2.png")
        );
        assert_eq!(
            free_mesh_path(&source),
            folder.path().join("Hall_2_lit_1.glb")
        );
        let builtin = SceneSource::Builtin("cornell".to_owned());
        assert!(free_picture_path(Some(&builtin)).ends_with("cornell_1.png"));
        assert!(free_picture_path(None).ends_with("vecrad_1.png"));
    }
}
