//! Files that are dropped on the window, or held over it.

use std::path::{Path, PathBuf};

use eframe::egui;

use super::{
    super::{loader::SceneSource, messages::Severity},
    App,
};
use crate::scene::is_scene_ending;

impl App {
    /// Open the scene among files that were dropped since the last frame.
    pub(super) fn take_dropped(&mut self, ctx: &egui::Context) {
        let paths: Vec<PathBuf> = ctx.input(|input| {
            let files = input.raw.dropped_files.iter();
            files.map(|file| file.path().to_owned()).collect()
        });
        match scene_among(&paths) {
            None => {}
            Some(Ok(path)) => {
                let name = path.display().to_string();
                self.load(SceneSource::File(path));
                if paths.len() > 1 {
                    let count = paths.len();
                    let text = format!(
                        "{count} files were dropped; {name} is read, with the files that it names"
                    );
                    self.state.messages.push(Severity::Note, text);
                }
            }
            Some(Err(sentence)) => self.state.messages.push(Severity::Error, sentence),
        }
    }
}

/// The scene among dropped files and folders, or one sentence; `None` where nothing was dropped.
fn scene_among(paths: &[PathBuf]) -> Option<Result<PathBuf, String>> {
    let scene = paths.iter().find(|path| is_scene(path) && path.is_file());
    let chosen = scene.or(paths.first())?;
    Some(if chosen.is_dir() {
        scene_in(chosen)
    } else {
        // A file that is no scene is refused by its reader, which knows why.
        Ok(chosen.clone())
    })
}

/// The only scene in a folder.
fn scene_in(folder: &Path) -> Result<PathBuf, String> {
    let refused = |reason: &str| format!("{reason}: {}", folder.display());
    let entries = std::fs::read_dir(folder)
        .map_err(|error| refused(&format!("the dropped folder cannot be read ({error})")))?;
    let mut scenes = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| is_scene(path) && path.is_file());
    match (scenes.next(), scenes.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(refused(
            "there is no OBJ or glTF file in the dropped folder",
        )),
        _ => Err(refused(
            "there are several scenes in the dropped folder; drop one of them",
        )),
    }
}

fn is_scene(path: &Path) -> bool {
    let ending = path.extension().and_then(|ending| ending.to_str());
    ending.is_some_and(is_scene_ending)
}

/// Say what dropping will do while files are held over the window.
pub(super) fn hover_ui(ctx: &egui::Context) {
    let hovering: Vec<Option<String>> = ctx.input(|input| {
        let names = input.raw.hovered_files.iter().map(|file| {
            let name = file.path.as_ref()?.file_name()?;
            Some(name.to_string_lossy().into_owned())
        });
        names.collect()
    });
    let text = match hovering.as_slice() {
        [] => return,
        [Some(name)] => format!("Drop to open {name}"),
        [None] => "Drop to open".to_owned(),
        _ => "Drop to open the scene among these".to_owned(),
    };
    let screen = ctx.content_rect();
    egui::Area::new(egui::Id::unique("drop hint"))
        .order(egui::Order::Foreground)
        .interactable(false)
        .fixed_pos(screen.min)
        .show(ctx, |ui| {
            ui.painter()
                .rect_filled(screen, 0.0, egui::Color32::from_black_alpha(170));
            let text = egui::RichText::new(text)
                .size(24.0)
                .color(egui::Color32::WHITE);
            ui.put(screen, egui::Label::new(text).selectable(false));
        });
}
