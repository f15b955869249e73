//! The path from the root to what is inspected, as a list to choose clusters from.

use eframe::egui::{self, RichText};

use super::power::PowerScale;
use crate::{
    scene::Frame,
    solver::PathNode,
    viewer::{
        action::Action,
        figures::{count, figure},
        theme,
    },
};

/// Height of the list; longer ones scroll. Deep trees have forty entries.
const MOST_HEIGHT: f32 = 230.0;

/// Smaller than other text, so that an entry fits into the panel.
const FONT_SIZE: f32 = 11.0;

/// Show the nodes, the root first; a click on a cluster selects it.
pub fn path_ui(
    ui: &mut egui::Ui,
    path: &[PathNode],
    frame: &Frame,
    power: PowerScale,
    selected: Option<usize>,
    actions: &mut Vec<Action>,
) {
    ui.add_space(4.0);
    ui.label(RichText::new("Path from the root").color(theme::secondary_text(ui.visuals())));
    egui::ScrollArea::vertical()
        .id_salt("path")
        .max_height(MOST_HEIGHT)
        .show(ui, |ui| {
            // Lines as close as those of a list.
            ui.spacing_mut().interact_size.y = 16.0;
            ui.spacing_mut().item_spacing.y = 1.0;
            ui.spacing_mut().button_padding = egui::vec2(4.0, 1.0);
            for node in path {
                node_ui(ui, node, frame, power, selected, actions);
            }
        });
}

fn node_ui(
    ui: &mut egui::Ui,
    node: &PathNode,
    frame: &Frame,
    power: PowerScale,
    selected: Option<usize>,
    actions: &mut Vec<Action>,
) {
    let small = |text: String| RichText::new(text).size(FONT_SIZE);
    let explanation = explanation(node, frame, power);
    let Some(patch_count) = node.patch_count else {
        let text = format!(
            "Element {} · {} links",
            count(u64::from(node.place.node.0)),
            count(u64::from(node.link_count))
        );
        ui.horizontal(|ui| {
            // As far in as the text of the buttons above.
            ui.add_space(ui.spacing().button_padding.x);
            ui.label(small(text)).on_hover_text(explanation);
        });
        return;
    };
    let index = node.place.node.index();
    let text = format!(
        "Level {} · {} patches · {} · {} links",
        node.level,
        count(u64::from(patch_count)),
        power.text(node.power),
        count(u64::from(node.link_count))
    );
    let response = ui
        .selectable_label(selected == Some(index), small(text))
        .on_hover_text(explanation);
    if response.clicked() {
        actions.push(Action::SelectCluster(index));
    }
}

/// Box, area, power with its bounds, and error.
fn explanation(node: &PathNode, frame: &Frame, power: PowerScale) -> String {
    let area = figure(frame.area_to_world(f64::from(node.area)));
    let corner = |point| {
        let [x, y, z] = frame.to_world(point).to_array().map(figure);
        format!("{x}  {y}  {z}")
    };
    let [least, most] = node.power_bounds;
    let [x, y, z] = node.main_direction.to_array();
    format!(
        "From {} to {}\nArea {area}\n{} {}; over links {} … {} along {x:.2}  {y:.2}  {z:.2}\nError bound of its links {} W/m²",
        corner(node.place.min),
        corner(node.place.max),
        power.name(),
        power.text(node.power),
        figure(power.value(least)),
        power.text(most),
        figure(f64::from(node.error)),
    )
}
