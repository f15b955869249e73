//! The list of omissions, folded.

use eframe::egui;

use crate::viewer::{figures::counts_in, state::State, wording::without_flags};

/// Show the list, where there is one.
pub fn omissions_ui(ui: &mut egui::Ui, state: &State) {
    let Some(snapshot) = &state.run.snapshot else {
        return;
    };
    if snapshot.omitted.is_empty() {
        return;
    }
    egui::CollapsingHeader::new(format!("Omitted ({})", snapshot.omitted.len()))
        .id_salt("omitted")
        .show(ui, |ui| {
            for omission in snapshot.omitted.iter() {
                let reason = counts_in(&without_flags(&omission.reason));
                ui.label(counts_in(&omission.what))
                    .on_hover_text(format!("{reason}; {}", omission.bound));
                ui.weak(format!("since {reason}"));
            }
        });
}
