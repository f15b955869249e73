//! Letters as outlines, in units of the font's size with y downwards.

use skrifa::{
    FontRef, GlyphId, MetadataProvider as _,
    instance::{LocationRef, Size},
    metrics::GlyphMetrics,
    outline::{DrawSettings, OutlineGlyphCollection, OutlinePen},
};

/// A step along the outline of a letter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stroke {
    /// Begin at a point.
    Move([f32; 2]),
    /// A straight line to a point.
    Line([f32; 2]),
    /// A parabola by its control point and its end.
    Quadratic([f32; 2], [f32; 2]),
    /// A cubic by its control points and its end.
    Cubic([f32; 2], [f32; 2], [f32; 2]),
    /// Back to where it began.
    Close,
}

/// A letter of a text that is set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Letter {
    /// Which outline.
    pub(super) glyph: u32,
    /// Where it starts, in font sizes from the start of the text.
    pub(super) offset: f32,
}

/// The font of all plots.
pub(super) struct Font {
    characters: skrifa::charmap::Charmap<'static>,
    outlines: OutlineGlyphCollection<'static>,
    widths: GlyphMetrics<'static>,
}

impl Font {
    /// The font in the program; `None` if its bytes were not a font.
    pub(super) fn embedded() -> Option<Self> {
        let font = FontRef::new(epaint_default_fonts::UBUNTU_LIGHT).ok()?;
        Some(Self {
            characters: font.charmap(),
            outlines: font.outline_glyphs(),
            widths: font.glyph_metrics(Size::new(1.0), LocationRef::default()),
        })
    }

    /// The letters of a text and its width, in font sizes. Characters that the font lacks leave a gap.
    pub(super) fn set(&self, text: &str) -> (Vec<Letter>, f32) {
        /// Width of what is missing.
        const GAP: f32 = 0.5;
        let (mut letters, mut offset) = (Vec::new(), 0.0);
        for character in text.chars() {
            let Some(id) = self.characters.map(character) else {
                offset += GAP;
                continue;
            };
            letters.push(Letter {
                glyph: id.to_u32(),
                offset,
            });
            offset += self.widths.advance_width(id).unwrap_or(GAP);
        }
        (letters, offset)
    }

    /// The outline of a letter at size 1; nothing for a space.
    pub(super) fn outline(&self, glyph: u32) -> Vec<Stroke> {
        let mut pen = Pen::default();
        if let Some(outline) = self.outlines.get(GlyphId::new(glyph)) {
            let settings = DrawSettings::unhinted(Size::new(1.0), LocationRef::default());
            if outline.draw(settings, &mut pen).is_err() {
                pen.strokes.clear();
            }
        }
        pen.strokes
    }
}

/// Collects an outline and turns it over: in fonts, y goes up.
#[derive(Default)]
struct Pen {
    strokes: Vec<Stroke>,
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.strokes.push(Stroke::Move([x, -y]));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.strokes.push(Stroke::Line([x, -y]));
    }

    fn quad_to(&mut self, cx0: f32, cy0: f32, x: f32, y: f32) {
        self.strokes.push(Stroke::Quadratic([cx0, -cy0], [x, -y]));
    }

    fn curve_to(&mut self, cx0: f32, cy0: f32, cx1: f32, cy1: f32, x: f32, y: f32) {
        self.strokes
            .push(Stroke::Cubic([cx0, -cy0], [cx1, -cy1], [x, -y]));
    }

    fn close(&mut self) {
        self.strokes.push(Stroke::Close);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_font_knows_every_character_of_a_plot() {
        let font = Font::embedded().unwrap();
        for character in "abcdefghijklmnopqrstuvwxyzABCXYZ0123456789 .,:;-–=%()÷/ερ≤√".chars()
        {
            // Greek and signs included; the space has no outline.
            let id = font.characters.map(character);
            assert!(id.is_some(), "{character}");
            let outline = font.outline(id.unwrap().to_u32());
            assert_eq!(outline.is_empty(), character == ' ', "{character}");
        }
    }

    #[test]
    fn a_text_is_as_wide_as_its_letters() {
        let font = Font::embedded().unwrap();
        let ((letters, one), (_, two)) = (font.set("n"), font.set("nn"));
        assert!(
            (two - 2.0 * one).abs() < 1e-6 && one > 0.3 && one < 0.8,
            "{one}"
        );
        assert_eq!(letters.len(), 1);
        assert!(font.set("\u{10ffff}").1 > 0.0);
    }
}
