//! glTF 2.0 into a scene: GLB, or text with buffers and pictures beside it or inside.
//!
//! What light needs is taken: meshes where nodes place them, materials, lamps, the sun and a camera. Parts that cannot be
//! used are left out, counted and named; only a file without a usable face is an error. Nothing outside the folder of the
//! file is read, and what an accessor claims to hold costs no memory.

mod accessors;
mod buffers;
mod container;
mod document;
mod files;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod pictures;
mod placement;
mod remarks;
mod shapes;
mod uri;

pub(super) use container::is_gltf;

use std::path::Path;

use glam::DVec3;

use buffers::Buffers;
use document::Document;
use files::Files;
use materials::Materials;
use meshes::{Meshes, TooMany};
use nodes::Placed;

use super::builder::{BuildError, SceneBuilder, Source};
use super::listed::{MOST_LISTED, listed, shortened};
use super::warning::WarningLog;
use super::whole::folder_of;
use super::{Environment, FileView, ReadError, Scene, SceneOptions, Sky, Sun, UpAxis, WarningKind};

/// Extensions that are followed, and those of materials that may be left out without harm to what is lit.
const KNOWN_EXTENSIONS: [&str; 16] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_variants",
];

/// How many of them, from the front, are followed.
const FOLLOWED: usize = 9;

/// Pictures that no face shows are looked up to this number, so that nothing is written over them.
const MOST_UNSHOWN: usize = 4096;

/// A file as it was read, before its faces are cleaned and scaled.
#[derive(Debug)]
pub(super) struct Imported {
    pub(super) builder: SceneBuilder,
    sun: Option<Sun>,
    views: Vec<FileView>,
}

/// Take a file apart that lies at a path.
///
/// # Errors
/// When no face is left.
pub(super) fn import(
    path: &Path,
    bytes: &[u8],
    options: &SceneOptions,
) -> Result<Imported, ReadError> {
    let refused = |reason: String| ReadError::Refused {
        reason,
        path: path.to_owned(),
    };
    let parts = container::parse(bytes).map_err(refused)?;
    let document = &parts.document;
    let mut log = WarningLog::default();
    check_extensions(document, &mut log).map_err(refused)?;
    let walk = nodes::walk(document).map_err(refused)?;
    for (count, message) in [
        (
            walk.repeated,
            "a node was left out where it is named again; each has one place in the tree",
        ),
        (walk.unknown, "a node that does not exist is named"),
    ] {
        if count > 0 {
            log.note_times(WarningKind::Unsupported, message, count, "", 0);
        }
    }
    let buffers = Buffers::new(document, parts.chunk, Files::beside(folder_of(path)));
    let builder = SceneBuilder {
        source: Source {
            up: Some(UpAxis::Y),
            is_in_metres: true,
            ..Source::of(path)
        },
        ..SceneBuilder::default()
    };
    let materials = Materials::new(document, options);
    let mut meshes = Meshes::new(document, &buffers, materials, builder);
    meshes
        .add(&walk.placed)
        .map_err(|TooMany { count, limit }| {
            let path = path.to_owned();
            ReadError::TooLarge { count, limit, path }
        })?;
    let Meshes {
        mut builder,
        materials,
        log: of_meshes,
        first_fault,
        ..
    } = meshes.finish();
    log.append(of_meshes);
    log.append(materials.into_log());
    if builder.faces.is_empty() {
        return Err(match first_fault {
            Some(fault) => refused(format!(
                "no surface of the glTF file can be used, as {fault}; export it again, with all files that belong to it"
            )),
            None => {
                refused("the glTF file shows no surface; export a scene with meshes".to_owned())
            }
        });
    }
    let sun = lights::add_lights(document, &walk.placed, &mut builder, &mut log);
    let mut files = buffers.into_files();
    let uris = document
        .images
        .iter()
        .filter_map(|image| image.uri.as_deref());
    uris.take(MOST_UNSHOWN).for_each(|uri| files.note(uri));
    builder.source.files.extend(files.into_found());
    builder.warnings = log.into_warnings();
    Ok(Imported {
        builder,
        sun,
        views: walk
            .placed
            .iter()
            .filter_map(|placed| view(document, placed))
            .collect(),
    })
}

impl Imported {
    /// Clean, scale and finish the scene.
    ///
    /// # Errors
    /// When no face is left.
    pub(super) fn finish(self, path: &Path, options: &SceneOptions) -> Result<Scene, ReadError> {
        let path = path.to_owned();
        let mut finished = self.builder.finish(options).map_err(|error| match error {
            BuildError::NoFaces { detail } => ReadError::NoFaces { detail, path },
            BuildError::TooLarge { count, limit } => ReadError::TooLarge { count, limit, path },
        })?;
        finished.views = self.views;
        Ok(match self.sun {
            Some(sun) => finished.in_environment(Environment {
                sky: Sky::Dark,
                sun: Some(sun),
                is_default: false,
            }),
            None => finished,
        })
    }
}

/// The camera of a node, where it has one with a perspective.
fn view(document: &Document, placed: &Placed) -> Option<FileView> {
    let camera = document.cameras.get(placed.node.camera?)?;
    let direction = (placed.world.matrix3 * DVec3::NEG_Z).try_normalize()?;
    Some(FileView {
        position: placed.world.translation,
        direction,
        fov_y_radians: camera.perspective.as_ref()?.yfov as f32,
    })
}

/// Refuse a file that cannot be shown without what is not known here, and name what is left out.
fn check_extensions(document: &Document, log: &mut WarningLog) -> Result<(), String> {
    let named = |names: &[&str]| {
        let names: Vec<String> = names.iter().map(|name| printable(name)).collect();
        listed(names.iter().map(String::as_str), MOST_LISTED)
    };
    let required = document.extensions_required.iter().map(String::as_str);
    let missing: Vec<&str> = required
        .filter(|name| !KNOWN_EXTENSIONS.contains(name))
        .collect();
    if !missing.is_empty() {
        return Err(format!(
            "the glTF file needs {}, which vecrad does not have; export it without compression and such extensions",
            named(&missing)
        ));
    }
    let used = document.extensions_used.iter().map(String::as_str);
    let left_out: Vec<&str> = used
        .filter(|name| !KNOWN_EXTENSIONS[..FOLLOWED].contains(name))
        .collect();
    if !left_out.is_empty() {
        let message = format!("extensions that are not followed: {}", named(&left_out));
        log.note(WarningKind::Unsupported, &message, "", 0);
    }
    Ok(())
}

/// A name of the file as messages and lists may have it: short, and without control characters.
fn printable(name: &str) -> String {
    shortened(name).replace(char::is_control, "\u{fffd}")
}
