//! Parts of all dialogs that ask for a file: the window around them, and the button that confirms.

use eframe::egui::{self, Button, Key};

/// Show a dialog where it is open; it closes once `add` says that it is done.
pub fn dialog(
    ctx: &egui::Context,
    title: &str,
    open: &mut bool,
    add: impl FnOnce(&mut egui::Ui) -> bool,
) {
    let mut stays = *open;
    let shown = egui::Window::new(title)
        .open(&mut stays)
        .collapsible(false)
        .resizable(false)
        .default_width(400.0)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, -60.0])
        .show(ctx, add);
    let is_done = shown.and_then(|shown| shown.inner).unwrap_or(false);
    *open = stays && !is_done;
}

/// A field for the name of a file.
pub fn file_field(ui: &mut egui::Ui, label: &str, text: &mut String) {
    let label = ui.label(label);
    let field = egui::TextEdit::singleline(text).desired_width(f32::INFINITY);
    ui.add(field).labelled_by(label.id);
}

/// The button that confirms, and the key that does so, too. `hint` says what is missing where it cannot be confirmed.
pub fn confirm(ui: &mut egui::Ui, text: &str, is_complete: bool, hint: &str) -> bool {
    ui.add_space(4.0);
    let button = ui.add_enabled(is_complete, Button::new(text));
    let is_clicked = button.on_disabled_hover_text(hint).clicked();
    is_clicked || is_complete && ui.input(|input| input.key_pressed(Key::Enter))
}
