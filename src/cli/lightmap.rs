//! `--export-lightmap`: the light in a picture over all surfaces, and a GLB that shows it.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use anyhow::{Context as _, Result, bail};
use clap::Args;
use serde::Serialize;

use super::{
    UsageError,
    output::{self, Destination},
    progress::Progress,
};
use crate::{
    export::MeshOptions,
    geometry::RayTree,
    lightmap::{LayoutError, Lightmap, LightmapFacts, LightmapRequest, bake_lightmap},
    picture::TexelSource,
    scene::Scene,
    solver::{Cancel, Snapshot},
};

/// Flags of the lightmap.
#[derive(Clone, Debug, Args)]
pub struct LightmapFlags {
    /// Write a lightmap into this folder: lightmap.exr, lightmap.png, and the scene as a GLB that shows it
    ///
    /// Its light is found by rays at each texel, as in traced pictures. Texture coordinates of the file are used where they
    /// lay out all surfaces within 0 and 1 without overlap, else new ones.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    pub export_lightmap: Option<PathBuf>,
    /// Texels of the lightmap for a metre, that is a unit of the file [default: as many as 1024 x 1024 texels hold]
    #[arg(
        long,
        value_name = "N",
        value_parser = density,
        requires = "export_lightmap",
        help_heading = "Output"
    )]
    pub texels_per_metre: Option<f64>,
}

/// A lightmap and how long it took.
pub(super) struct Baked {
    lightmap: Lightmap,
    facts: BakedFacts,
}

/// What the report says of a lightmap.
#[derive(Clone, Debug, Serialize)]
pub(super) struct BakedFacts {
    #[serde(flatten)]
    facts: LightmapFacts,
    seconds: f64,
}

/// The pictures in the folder.
const PICTURES: [&str; 2] = ["lightmap.exr", "lightmap.png"];

impl LightmapFlags {
    /// Whether one is asked for.
    pub(super) fn is_wanted(&self) -> bool {
        self.export_lightmap.is_some()
    }

    /// Refuse what cannot be written; makes the folder.
    pub(super) fn check(&self) -> Result<()> {
        let Some(folder) = &self.export_lightmap else {
            return Ok(());
        };
        if folder.exists() && !folder.is_dir() {
            bail!(UsageError(format!(
                "the lightmap needs a folder: {}",
                folder.display()
            )));
        }
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        output::check(&folder.join(PICTURES[0]))
    }

    /// The pictures that will be written.
    pub(super) fn pictures(&self) -> Vec<Destination> {
        let folder = self.export_lightmap.iter();
        folder
            .flat_map(|folder| PICTURES.map(|name| destination(folder, name)))
            .flatten()
            .collect()
    }

    /// The GLB that will be written of a scene of this name.
    pub(super) fn mesh(&self, scene: &str) -> Option<Destination> {
        destination(self.export_lightmap.as_ref()?, &mesh_name(scene))
    }

    /// Make the lightmap, if one is asked for. An interruption that came before, which ended the solve, does not end it; one
    /// that comes meanwhile does, and there is none.
    pub(super) fn bake(
        &self,
        scene: &Scene,
        snapshot: &Snapshot,
        seed: u64,
        quiet: bool,
        interrupted: &AtomicBool,
    ) -> Result<Option<Baked>> {
        if !self.is_wanted() {
            return Ok(None);
        }
        let begin = Instant::now();
        let was_interrupted = interrupted.swap(false, Ordering::Relaxed);
        let rays = RayTree::new(scene);
        let request = LightmapRequest {
            source: TexelSource {
                scene,
                rays: &rays,
                snapshot,
                seed,
            },
            texels_per_unit: self.texels_per_metre,
        };
        let cancel = Cancel::default();
        let progress = Mutex::new(Progress::new(quiet));
        let told = |part: f32| {
            if interrupted.load(Ordering::Relaxed) {
                cancel.cancel();
            }
            // Another thread is telling otherwise.
            if let Ok(mut progress) = progress.try_lock() {
                progress.say(format!("lightmap {:.0} %", 100.0 * part));
            }
        };
        let baked = bake_lightmap(&request, &told, &cancel);
        interrupted.fetch_or(was_interrupted, Ordering::Relaxed);
        if let Ok(mut progress) = progress.into_inner() {
            progress.finish();
        }
        let lightmap = match baked {
            Err(LayoutError::Cancelled) => {
                output::say("interrupted: no lightmap was written");
                return Ok(None);
            }
            baked => baked?,
        };
        let facts = lightmap.facts().clone();
        say(&facts, self.texels_per_metre.is_some());
        Ok(Some(Baked {
            lightmap,
            facts: BakedFacts {
                facts,
                seconds: begin.elapsed().as_secs_f64(),
            },
        }))
    }

    /// Write a lightmap.
    pub(super) fn write(
        &self,
        baked: &Baked,
        scene: &Scene,
        snapshot: &Snapshot,
        options: &MeshOptions,
    ) -> Result<()> {
        let Some(folder) = &self.export_lightmap else {
            return Ok(());
        };
        let lightmap = &baked.lightmap;
        let [exr, png] = PICTURES.map(|name| folder.join(name));
        let pictures = [(exr, lightmap.exr(options)), (png, lightmap.png(options))];
        // What cannot be written does not stop the rest from being written.
        let mut written: Vec<Result<()>> = Vec::new();
        for (path, bytes) in pictures {
            written.push(write_picture(&path, bytes));
        }
        let mesh = folder.join(mesh_name(&scene.name));
        written.push(output::write_whole(&mesh, |out| {
            lightmap.write_glb(out, scene, snapshot, options)
        }));
        written.into_iter().collect()
    }
}

/// A file in the folder.
fn destination(folder: &Path, name: &str) -> Option<Destination> {
    let label = format!("{name} of --export-lightmap");
    Destination::new(&label, &folder.join(name))
}

fn write_picture(path: &Path, bytes: image::ImageResult<Vec<u8>>) -> Result<()> {
    let bytes = bytes.with_context(|| format!("cannot write {}", path.display()))?;
    output::write_whole(path, |out| out.write_all(&bytes))
}

impl Baked {
    /// What the report says of it.
    pub(super) fn facts(&self) -> BakedFacts {
        self.facts.clone()
    }
}

/// Say what came of it.
fn say(facts: &LightmapFacts, is_asked: bool) {
    let per_cent = |part: f64| format!("{:.1} %", 100.0 * part);
    let seams = facts.seam_error.map_or_else(String::new, |error| {
        format!("light differs across seams by {}, ", per_cent(error))
    });
    output::say(format_args!(
        "lightmap: {0} × {0} texels, {1:.3} for a metre, {2} charts ({3}); {seams}{4} by {5}",
        facts.side,
        facts.texels_per_unit,
        facts.charts,
        facts.coordinates,
        if seams.is_empty() {
            "light differs from that of the vertices"
        } else {
            "from that of the vertices"
        },
        per_cent(facts.beside_vertices),
    ));
    if facts.limited_charts > 0 {
        let why = match is_asked {
            true => "since a lightmap has at most 4096 × 4096",
            false => "since they are larger than the rest of the scene by far",
        };
        output::say(format_args!(
            "note: {} of {} charts have fewer texels for a metre, {why}",
            facts.limited_charts, facts.charts
        ));
    }
}

/// The name of the GLB of a scene.
fn mesh_name(scene: &str) -> String {
    match output::file_stem(scene) {
        stem if stem.is_empty() => "scene.glb".to_owned(),
        stem => format!("{stem}.glb"),
    }
}

fn density(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|density: &f64| *density > 0.0 && density.is_finite())
        .ok_or_else(|| "must be a number above 0".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_are_above_zero() {
        assert_eq!(density("12.5"), Ok(12.5));
        for wrong in ["", "0", "-1", "nan", "inf", "many"] {
            assert!(density(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_mesh_is_named_after_the_scene() {
        assert_eq!(mesh_name("my room"), "my_room.glb");
        assert_eq!(mesh_name(""), "scene.glb");
    }
}
