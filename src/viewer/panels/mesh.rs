//! The dialog for exporting the lit mesh.

use std::path::{Path, PathBuf};

use eframe::egui;

use crate::{
    export::MeshFormat,
    viewer::{action::Action, state::State},
};

/// Show the dialog where it is open; wishes go into `actions`.
pub fn mesh_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let mut open = state.panels.mesh;
    let mut done = false;
    egui::Window::new("Export lit mesh")
        .open(&mut open)
        .collapsible(false)
        .resizable(false)
        .default_width(400.0)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, -60.0])
        .show(ctx, |ui| {
            done = mesh_ui(ui, &mut state.panels.mesh_text, actions);
        });
    state.panels.mesh = open && !done;
}

/// Format and place; whether it was confirmed.
fn mesh_ui(ui: &mut egui::Ui, text: &mut String, actions: &mut Vec<Action>) -> bool {
    let present = MeshFormat::of(Path::new(text.trim()));
    ui.horizontal(|ui| {
        ui.label("Format");
        for format in MeshFormat::ALL {
            let (label, explanation) = label(format);
            let is_present = present.as_ref() == Ok(&format);
            let button = ui.selectable_label(is_present, label);
            if button.on_hover_text(explanation).clicked() {
                let path = PathBuf::from(text.trim()).with_extension(format.extension());
                *text = path.display().to_string();
            }
        }
    });
    let label = ui.label("File");
    let field = egui::TextEdit::singleline(text).desired_width(f32::INFINITY);
    ui.add(field).labelled_by(label.id);
    ui.weak("Exposure and up axis are those of the view, in a PLY the tone map, too.");
    ui.add_space(4.0);
    let button = ui.add_enabled(present.is_ok(), egui::Button::new("Export"));
    let confirmed = button
        .on_disabled_hover_text("The name must end in .ply or .glb.")
        .clicked();
    if confirmed {
        actions.push(Action::SaveMesh(PathBuf::from(text.trim())));
    }
    confirmed
}

/// Name and use of a format.
fn label(format: MeshFormat) -> (&'static str, &'static str) {
    match format {
        MeshFormat::Ply => (
            "PLY",
            "For MeshLab, CloudCompare and tools that compute: displayed colours as bytes, light as floats",
        ),
        MeshFormat::Glb => (
            "GLB",
            "For viewers and engines: an unlit glTF mesh with linear colours, and light as floats",
        ),
    }
}
