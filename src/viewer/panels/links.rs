//! Links of what is selected: whether, whose, in which colours, how many.

use eframe::egui::{self, Slider};

use super::{
    legend::{Scale, scale_ui},
    row,
};
use crate::viewer::{
    figures::count,
    links,
    state::State,
    view::{LinkColor, LinkEnd, LinkOverlay},
};

const ENDS: [(LinkEnd, &str, &str); 2] = [
    (
        LinkEnd::Element,
        "Picked element",
        "Links that light the element under the picked point: its own, and those of all above it",
    ),
    (
        LinkEnd::Cluster,
        "Selected cluster",
        "Links over which the selected cluster receives, and those of all above it",
    ),
];

const COLORS: [(LinkColor, &str, &str); 2] = [
    (
        LinkColor::Strength,
        "Strength",
        "How much light the link brings, from the weakest to the strongest of those drawn; spaced logarithmically",
    ),
    (
        LinkColor::Visibility,
        "Visibility",
        "The part of the light that nothing blocks",
    ),
];

/// Show the controls.
pub fn links_ui(ui: &mut egui::Ui, state: &mut State) {
    let overlay = &mut state.view.links;
    ui.checkbox(&mut overlay.shown, "Show links")
        .on_hover_text("Lines to where the light of what is picked comes from (L)");
    if !overlay.shown {
        return;
    }
    let label = ui.label("Links of");
    row::choice(ui, "links of", &mut overlay.of, &ENDS).labelled_by(label.id);
    let label = ui.label("Link colour");
    row::choice(ui, "link colour", &mut overlay.color, &COLORS).labelled_by(label.id);
    let label = ui
        .label("Strongest")
        .on_hover_text("How many links are drawn at most");
    let slider = Slider::new(&mut overlay.most, LinkOverlay::MOST_RANGE).logarithmic(true);
    ui.add(slider).labelled_by(label.id);
    summary_ui(ui, state);
}

/// The drawn links, or why there are none.
fn summary_ui(ui: &mut egui::Ui, state: &State) {
    let overlay = &state.view.links;
    let Some(inspection) = state.inspections.of(overlay.of) else {
        ui.weak(if state.inspections.is_waiting(overlay.of) {
            "The solver answers after this step, or at once when paused."
        } else {
            match overlay.of {
                LinkEnd::Element => "Click a surface to see where its light comes from.",
                LinkEnd::Cluster => "Show boxes and click a surface to select a cluster.",
            }
        });
        return;
    };
    let summary = links::summary(inspection, overlay);
    let scale = Scale {
        ends: summary.range.map(f64::from),
        is_logarithmic: overlay.color == LinkColor::Strength,
    };
    let (quantity, unit) = match overlay.color {
        LinkColor::Visibility => ("Visible part", "of 1"),
        LinkColor::Strength => ("Irradiance over a link", "W/m²"),
    };
    ui.weak(quantity);
    scale_ui(ui, &scale, unit, 0.0);
    ui.weak(format!(
        "{} of {} links, {:.0} % of their light, after step {}.",
        count(summary.drawn as u64),
        count(summary.all as u64),
        100.0 * summary.share,
        inspection.step
    ));
}
