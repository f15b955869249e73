//! Keyboard focus: Tab moves it from control to control, a ring shows where it is, and panels scroll to it.

use eframe::egui::{self, Key};

use super::{theme, viewport::scene_id};

/// Keys that work the control that has the focus; the window's own meanings of them wait.
const KEYS_OF_CONTROLS: [Key; 2] = [Key::Space, Key::Enter];

/// Whether a text field, or a figure being typed, has the focus: all keys are its own then.
pub fn is_typing(ctx: &egui::Context) -> bool {
    ctx.text_edit_focused()
}

/// The keys that the focused control needs: none where there is none, or where it is the scene itself.
pub fn keys_in_use(ctx: &egui::Context) -> &'static [Key] {
    match ctx.memory(|memory| memory.focused()) {
        Some(id) if id != scene_id() => &KEYS_OF_CONTROLS,
        _ => &[],
    }
}

/// Whether any control has the focus.
pub fn is_anywhere(ctx: &egui::Context) -> bool {
    ctx.memory(|memory| memory.focused().is_some())
}

/// Draw a ring around the control that has the focus. Text fields have their own mark: the caret.
pub fn ring_ui(ctx: &egui::Context) {
    if is_typing(ctx) {
        return;
    }
    let focused = ctx.memory(|memory| memory.focused());
    let Some(control) = focused.and_then(|id| ctx.read_response(id)) else {
        return;
    };
    let layer = egui::LayerId::new(egui::Order::Tooltip, egui::Id::unique("focus ring"));
    // Within the window: the scene reaches to its edge.
    let rect = control.interact_rect.expand(2.0);
    let rect = rect.intersect(ctx.content_rect().shrink(1.0));
    ctx.layer_painter(layer).rect_stroke(
        rect,
        3.0,
        egui::Stroke::new(2.0, theme::SELECTED),
        egui::StrokeKind::Inside,
    );
}

/// Scroll to the control that has just got the focus, where it is one of those of this panel.
pub fn keep_in_view(ui: &egui::Ui) {
    let focused = ui.memory(|memory| memory.focused());
    let Some(control) = focused.and_then(|id| ui.ctx().read_response(id)) else {
        return;
    };
    let is_inside = control.gained_focus()
        && control.layer_id == ui.layer_id()
        && ui.clip_rect().x_range().contains(control.rect.center().x);
    if is_inside {
        ui.scroll_to_rect(control.rect, None);
    }
}
