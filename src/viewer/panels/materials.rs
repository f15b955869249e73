//! Lights and materials: each light on or off, brighter, in another colour; each material in another colour.
//!
//! The automatic exposure stays where it is while anything is changed, or what is dimmed would look as before.

use eframe::egui;
use glam::Vec3;

use super::{
    color::color_button,
    outside,
    row::{self, slider},
    solo::Solos,
};
use crate::{
    solver::Lamp,
    viewer::{
        action::Action,
        figures::seconds,
        materials::{LightControl, Materials},
        state::State,
    },
};

/// Height of the list of lights, and of that of materials, above which it scrolls, in points.
const MOST_HEIGHT: f32 = 240.0;

/// Show the lights and the materials; a requested action goes into `actions`.
pub fn materials_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let Some(loaded) = &state.loaded else {
        return;
    };
    let mut materials = state.materials.clone();
    lights_ui(ui, &mut materials, &Solos::of(state), actions);
    row::section(ui, "Materials", false, |ui| {
        reflectances_ui(ui, &mut materials, loaded.scene.max_reflectance);
    });
    ui.horizontal(|ui| {
        let reset = egui::Button::new("Reset lights and materials");
        let reset = ui.add_enabled(materials.are_changed(), reset);
        if reset.on_hover_text("All as in the file").clicked() {
            materials.reset();
        }
        let undo = egui::Button::new("Undo");
        let undo = ui.add_enabled(state.history.can_undo(), undo);
        if undo.on_hover_text("As before the last change (Ctrl+Z)").clicked() {
            actions.push(Action::Undo);
        }
        if let Some(secs) = state.run.relit_secs {
            ui.weak(format!("Relit in {}", seconds(secs)))
                .on_hover_text(
                    "What the last change took to show. It uses the links that there are; Continue refines them.",
                );
        }
    });
    if materials != state.materials {
        actions.push(Action::Relight(materials));
    }
    ui.separator();
    outside::outside_ui(ui, state, actions);
}

fn lights_ui(
    ui: &mut egui::Ui,
    materials: &mut Materials,
    solos: &Solos,
    actions: &mut Vec<Action>,
) {
    let lights: Vec<usize> = materials.lights().collect();
    if lights.is_empty() {
        ui.weak("No material emits light.");
    }
    named_ui(ui, materials);
    if lights.is_empty() {
        return;
    }
    // Of each light a line with its name and one with its intensity.
    let height = 2.0 * ui.spacing().interact_size.y + ui.spacing().item_spacing.y;
    egui::ScrollArea::vertical()
        .id_salt("lights")
        .max_height(MOST_HEIGHT)
        .min_scrolled_height(MOST_HEIGHT)
        .show_rows(ui, height, lights.len(), |ui, shown| {
            for &index in &lights[shown] {
                ui.push_id(index, |ui| light_ui(ui, materials, index, solos, actions));
            }
        });
}

/// Offer to light what is named like a lamp.
fn named_ui(ui: &mut egui::Ui, materials: &mut Materials) {
    let named = materials.named_like_lamps();
    if named.is_empty() || materials.lights().next().is_some() {
        return;
    }
    let names: Vec<&str> = named
        .iter()
        .map(|&index| materials.now[index].name.as_str())
        .collect();
    let lit = ui
        .button("Light what is named like a lamp")
        .on_hover_text(names.join(", "));
    if lit.clicked() {
        for index in named {
            materials.make_lamp(index);
        }
    }
}

/// A material's reflectance, and whether it is a lamp.
pub(super) fn material_ui(ui: &mut egui::Ui, materials: &mut Materials, index: usize, most: f32) {
    let default = materials.of_file(index).reflectance;
    let mut is_lamp = materials.is_lamp(index);
    ui.horizontal(|ui| {
        let material = &mut materials.now[index];
        let name = format!("Reflectance of {}", material.name);
        color_button(ui, &name, &mut material.reflectance);
        material.reflectance = material.reflectance.min(Vec3::splat(most));
        let label = format!("{} is a lamp", material.name);
        let lamp = ui.toggle_value(&mut is_lamp, "Lamp");
        lamp.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        let lamp = lamp.on_hover_text("Whether it emits light; how much stands above");
        ui.label(&material.name);
        if material.reflectance != default && row::reset_button(ui, &name).clicked() {
            material.reflectance = default;
        }
        if lamp.clicked() {
            match is_lamp {
                true => materials.make_lamp(index),
                false => materials.put_out(index),
            }
        }
    });
}

fn light_ui(
    ui: &mut egui::Ui,
    materials: &mut Materials,
    index: usize,
    solos: &Solos,
    actions: &mut Vec<Action>,
) {
    let default = materials.of_file(index).light;
    let material = &mut materials.now[index];
    let Some(light) = &mut material.light else {
        return;
    };
    let default = default.unwrap_or(light.as_made());
    ui.horizontal(|ui| {
        let name = format!("Colour of {}", material.name);
        color_button(ui, &name, &mut light.color);
        ui.checkbox(&mut light.is_on, &material.name)
            .on_hover_text("Whether it emits light");
        solos.button(ui, Lamp::Material(index), &material.name, actions);
    });
    ui.add_enabled_ui(light.is_on, |ui| intensity_ui(ui, light, &default));
}

fn intensity_ui(ui: &mut egui::Ui, light: &mut LightControl, default: &LightControl) {
    row::setting(
        ui,
        "Intensity",
        "Times as bright as in the file, or as it was made. Values outside the slider may be typed.",
        &mut light.intensity,
        &default.intensity,
        |ui, value| ui.add(slider(value, 0.01..=100.0)),
    );
}

fn reflectances_ui(ui: &mut egui::Ui, materials: &mut Materials, most: f32) {
    let height = ui.spacing().interact_size.y;
    let count = materials.now.len();
    egui::ScrollArea::vertical()
        .id_salt("reflectances")
        .max_height(MOST_HEIGHT)
        .min_scrolled_height(MOST_HEIGHT)
        .show_rows(ui, height, count, |ui, shown| {
            for index in shown {
                ui.push_id(index, |ui| material_ui(ui, materials, index, most));
            }
        });
}
