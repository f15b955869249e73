//! What the scene does not need and was omitted, folded.

use eframe::egui;

use crate::viewer::{figures::counts_in, state::State, wording::without_flags};

/// Show the list, where there is one.
pub fn left_out_ui(ui: &mut egui::Ui, state: &State) {
    let Some(snapshot) = &state.run.snapshot else {
        return;
    };
    if snapshot.left_out.is_empty() {
        return;
    }
    egui::CollapsingHeader::new(format!("Omitted ({})", snapshot.left_out.len()))
        .id_salt("left out")
        .show(ui, |ui| {
            for left_out in snapshot.left_out.iter() {
                let reason = counts_in(&without_flags(&left_out.reason));
                ui.label(counts_in(&left_out.what))
                    .on_hover_text(format!("{reason}; {}", left_out.bound));
                ui.weak(format!("since {reason}"));
            }
        });
}
