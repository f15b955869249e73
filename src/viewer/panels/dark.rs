//! What is offered over the scene where no light reaches it.

use eframe::egui;

use crate::viewer::{action::Action, materials::Materials, state::State, theme};

/// Say that the scene is dark, and offer what helps by one click: the material that was picked, those that are named like
/// lamps, or the one above the viewer become lamps.
pub fn dark_ui(ui: &egui::Ui, rect: egui::Rect, state: &State, actions: &mut Vec<Action>) {
    if !state.is_dark() {
        return;
    }
    let corner = rect.center_top() + egui::vec2(0.0, 12.0);
    egui::Area::new(egui::Id::unique("dark"))
        .fixed_pos(corner)
        .pivot(egui::Align2::CENTER_TOP)
        .constrain_to(rect)
        .show(ui.ctx(), |ui| {
            egui::Frame::popup(ui.style()).show(ui, |ui| {
                ui.set_max_width((rect.width() - 40.0).clamp(120.0, 420.0));
                ui.colored_label(
                    theme::warning(ui.visuals()),
                    "No light reaches this. It is shown as if a lamp stood beside the camera.",
                );
                if let Some(materials) = remedy_ui(ui, state) {
                    actions.push(Action::Relight(materials));
                }
            });
        });
}

/// A button that makes lamps; returns the materials once it is pressed.
fn remedy_ui(ui: &mut egui::Ui, state: &State) -> Option<Materials> {
    let mut materials = state.materials.clone();
    let picked = state
        .selection
        .as_ref()
        .map(|selection| selection.pick.triangle);
    let named = materials.named_like_lamps();
    let loaded = state.loaded.as_ref()?;
    let above = || {
        let camera = &state.rig.current;
        let hit = loaded
            .rays
            .closest(camera.eye(), loaded.scene.up.vector(), None);
        hit.map(|hit| hit.triangle)
    };
    let (text, lamps) = if let (None, false) = (picked, named.is_empty()) {
        ("Light what is named like a lamp".to_owned(), named)
    } else if let Some(triangle) = picked.or_else(above) {
        let index = loaded.scene.triangles[triangle.index()].material.index();
        let place = if picked.is_some() { "picked" } else { "above" };
        let name = &materials.now[index].name;
        (format!("Make “{name}” ({place}) a lamp"), vec![index])
    } else {
        ui.weak("Click a surface to make a lamp of it.");
        return None;
    };
    let is_pressed = ui.button(text).clicked();
    if picked.is_none() {
        ui.weak("Or click a surface to make a lamp of its material.");
    }
    for index in lamps {
        materials.make_lamp(index);
    }
    is_pressed.then_some(materials)
}
