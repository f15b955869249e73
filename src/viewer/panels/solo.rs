//! Buttons that show one light alone.

use eframe::egui;

use crate::{
    solver::Lamp,
    viewer::{action::Action, state::State},
};

/// Which lights may be shown alone, and which one is.
pub(super) struct Solos {
    alone: Option<Lamp>,
    /// With one light only it is alone anyway.
    are_several: bool,
}

impl Solos {
    /// In this state.
    pub(super) fn of(state: &State) -> Self {
        let outside = state.has_outside().into_iter().filter(|has| *has);
        Self {
            alone: state.solo.as_ref().map(|solo| solo.lamp),
            are_several: state.materials.lights().count() + outside.count() > 1,
        }
    }

    /// A button that shows a light alone, or all of them again.
    pub(super) fn button(
        &self,
        ui: &mut egui::Ui,
        lamp: Lamp,
        name: &str,
        actions: &mut Vec<Action>,
    ) {
        if !self.are_several {
            return;
        }
        let mut is_alone = self.alone == Some(lamp);
        let label = format!("Only {name}");
        let button = ui.toggle_value(&mut is_alone, "Solo");
        button.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
        let button = button.on_hover_text("Show this light alone; once more, all that were on");
        if button.clicked() {
            actions.push(Action::Solo(lamp));
        }
    }
}
