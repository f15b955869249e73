//! The user's guide: the pages of `assets/guide`, in a window.

use std::collections::HashMap;

use eframe::egui;
use egui_commonmark::{CommonMarkCache, CommonMarkViewer};

/// A page: its text in Markdown, whose first line is its title.
struct Page(&'static str);

macro_rules! pages {
    ($($name:literal),* $(,)?) => {
        [$(Page(include_str!(concat!("../../../assets/guide/", $name, ".md")))),*]
    };
}

macro_rules! pictures {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_bytes!(concat!("../../../assets/guide/", $name)).as_slice())),*]
    };
}

/// In the order in which they are offered.
const PAGES: [Page; 12] = pages![
    "01-first-light",
    "02-godot",
    "03-blender",
    "04-three-js",
    "05-reading-the-error",
    "06-finding-a-leak",
    "07-clusters-and-links",
    "08-sky-and-sun",
    "09-mirrors",
    "10-lamps",
    "11-command-line",
    "12-troubleshooting",
];

/// By the name that pages call them.
const PICTURES: [(&str, &[u8]); 5] = pictures![
    "clusters.png",
    "cornell.png",
    "error.png",
    "glazed-room.png",
    "glossy.png",
];

/// Width of the text in points: longer lines are hard to read.
const WIDTH: f32 = 560.0;

impl Page {
    fn title(&self) -> &'static str {
        let first = self.0.lines().next().unwrap_or_default();
        first.trim_start_matches(['#', ' '])
    }

    /// Text, code, and pictures by their names, in the order of the page.
    fn parts(&self) -> Vec<Part> {
        let mut parts = Vec::new();
        for (index, block) in self.0.split("```").enumerate() {
            if index % 2 == 1 {
                // The first line names the language.
                parts.extend(
                    block
                        .split_once('\n')
                        .map(|(_, code)| Part::Code(code.trim())),
                );
                continue;
            }
            let mut rest = block;
            while let Some((before, picture)) = rest.split_once("\n![") {
                let Some((line, after)) = picture.split_once('\n') else {
                    break;
                };
                let name = line.split_once("](");
                let name = name.and_then(|(_, name)| name.strip_suffix(')'));
                parts.push(Part::Text(before));
                parts.extend(name.map(Part::Picture));
                rest = after;
            }
            parts.push(Part::Text(rest));
        }
        parts
    }
}

enum Part {
    Text(&'static str),
    Code(&'static str),
    Picture(&'static str),
}

/// The open page, and what was made of pages before.
#[derive(Default)]
pub struct Guide {
    page: Option<usize>,
    texts: CommonMarkCache,
    pictures: HashMap<&'static str, egui::TextureHandle>,
}

impl Guide {
    /// Close it; whether it was open.
    pub fn close(&mut self) -> bool {
        self.page.take().is_some()
    }

    /// The pages as entries of a menu.
    pub fn menu_ui(&mut self, ui: &mut egui::Ui) {
        for (index, page) in PAGES.iter().enumerate() {
            if ui.button(page.title()).clicked() {
                self.page = Some(index);
                ui.close();
            }
        }
    }

    /// The window, where a page is open.
    pub fn window(&mut self, ctx: &egui::Context) {
        let Some(index) = self.page else { return };
        let page = &PAGES[index];
        let mut is_open = true;
        let height = (ctx.content_rect().height() - 140.0).max(120.0);
        egui::Window::new("Guide")
            .open(&mut is_open)
            .collapsible(false)
            .default_width(WIDTH + 40.0)
            .default_height(height)
            .show(ctx, |ui| {
                let mut next = index;
                ui.horizontal(|ui| {
                    let is_first = index == 0;
                    if ui
                        .add_enabled(!is_first, egui::Button::new("Back"))
                        .clicked()
                    {
                        next = index - 1;
                    }
                    let is_last = index + 1 == PAGES.len();
                    if ui
                        .add_enabled(!is_last, egui::Button::new("Next"))
                        .clicked()
                    {
                        next = index + 1;
                    }
                    ui.weak(format!("{} of {}", index + 1, PAGES.len()));
                });
                self.page = Some(next);
                ui.separator();
                egui::ScrollArea::vertical()
                    .id_salt(index)
                    .max_height(height)
                    .show(ui, |ui| {
                        ui.set_max_width(WIDTH);
                        for (number, part) in page.parts().into_iter().enumerate() {
                            ui.push_id(number, |ui| self.part_ui(ui, &part));
                        }
                    });
            });
        if !is_open {
            self.page = None;
        }
    }

    fn part_ui(&mut self, ui: &mut egui::Ui, part: &Part) {
        match part {
            Part::Text(text) => {
                CommonMarkViewer::new().show(ui, &mut self.texts, text);
            }
            Part::Code(code) => {
                egui::Frame::group(ui.style()).show(ui, |ui| {
                    ui.set_min_width(ui.available_width());
                    ui.label(egui::RichText::new(*code).monospace());
                });
            }
            Part::Picture(name) => {
                if let Some(texture) = self.picture(ui.ctx(), name) {
                    ui.add(egui::Image::new(texture).max_width(WIDTH));
                }
            }
        }
    }

    fn picture(&mut self, ctx: &egui::Context, name: &'static str) -> Option<&egui::TextureHandle> {
        if !self.pictures.contains_key(name) {
            let picture = decoded(name)?;
            let texture = ctx.load_texture(name, picture, egui::TextureOptions::LINEAR);
            self.pictures.insert(name, texture);
        }
        self.pictures.get(name)
    }
}

/// A picture of the guide; `None` where there is none of this name.
fn decoded(name: &str) -> Option<egui::ColorImage> {
    let (_, bytes) = PICTURES.iter().find(|(known, _)| *known == name)?;
    let picture = image::load_from_memory(bytes).ok()?.into_rgba8();
    let size = [picture.width() as usize, picture.height() as usize];
    Some(egui::ColorImage::from_rgba_unmultiplied(size, &picture))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_have_titles_and_pictures_that_are_there() {
        let mut shown = 0;
        for page in &PAGES {
            assert!(page.0.starts_with("# ") && !page.title().is_empty());
            for part in page.parts() {
                if let Part::Picture(name) = part {
                    assert!(decoded(name).is_some(), "{name}");
                    shown += 1;
                }
            }
        }
        assert_eq!(shown, PICTURES.len());
    }

    #[test]
    fn keys_that_pages_name_do_something() {
        let table = crate::viewer::bindings::bindings();
        let is_known = |key: &str| table.iter().any(|binding| binding.keys() == key);
        let mut named = 0;
        for page in &PAGES {
            let words = page
                .0
                .split(|c: char| c.is_whitespace() || "().,:|".contains(c));
            for key in words.filter(|word| word.starts_with("Ctrl+") || word.starts_with("Alt+")) {
                assert!(is_known(key), "{key} in {}", page.title());
                named += 1;
            }
        }
        assert!(named > 3);
    }
}
