//! The dialog for exporting the lit mesh.

use std::path::{Path, PathBuf};

use eframe::egui;

use super::dialog::{confirm, dialog, file_field};
use crate::{
    export::MeshFormat,
    viewer::{action::Action, state::State},
};

/// Show the dialog where it is open; requested actions go into `actions`.
pub fn mesh_window(ctx: &egui::Context, state: &mut State, actions: &mut Vec<Action>) {
    let panels = &mut state.panels;
    let (text, is_merged) = (&mut panels.mesh_text, &mut panels.mesh_merged);
    let has_harmonics = &mut panels.mesh_has_harmonics;
    dialog(ctx, "Export lit mesh", &mut panels.mesh, |ui| {
        mesh_ui(ui, text, [is_merged, has_harmonics], actions)
    });
}

/// Format and place; whether it was confirmed.
fn mesh_ui(
    ui: &mut egui::Ui,
    text: &mut String,
    [is_merged, has_harmonics]: [&mut bool; 2],
    actions: &mut Vec<Action>,
) -> bool {
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
    file_field(ui, "File", text);
    // A PLY is one mesh always, and an OBJ has room for one colour.
    let has_objects = present != Ok(MeshFormat::Ply);
    ui.add_enabled(has_objects, egui::Checkbox::new(is_merged, "One object"))
        .on_hover_text("All objects of the scene as one; else each keeps its name");
    let has_attributes = present != Ok(MeshFormat::Obj);
    let directions = egui::Checkbox::new(has_harmonics, "Light by direction");
    ui.add_enabled(has_attributes, directions).on_hover_text(
        "Adds to each vertex the light that arrives, as first-order spherical harmonics: four colours, found by rays",
    );
    ui.weak("Exposure and up axis are those of the view, in a PLY and an OBJ the tone map, too.");
    let hint = "The name must end in .ply, .glb or .obj.";
    let confirmed = confirm(ui, "Export", present.is_ok(), hint);
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
        MeshFormat::Obj => (
            "OBJ",
            "For modellers: displayed colours at vertices, with the materials and textures of the scene beside it",
        ),
        MeshFormat::Glb => (
            "GLB",
            "For viewers and engines: an unlit glTF mesh with linear colours, and light as floats",
        ),
    }
}
