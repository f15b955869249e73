//! A drawing as SVG. Each letter's outline is written once and used where it stands.

use std::{
    collections::BTreeSet,
    fmt::Write as _,
    io::{self, Write},
};

use glam::Vec2;

use super::{
    Anchor, Color, DASH, Drawing, Mark,
    glyphs::{Font, Letter, Stroke},
};

/// Outlines are written in this fraction of the font size, so that whole numbers are fine enough.
const UNITS: f32 = 1000.0;

/// Write a drawing.
pub(super) fn write(drawing: &Drawing, out: &mut dyn Write) -> io::Result<()> {
    let font = Font::embedded().ok_or_else(|| io::Error::other("the font of plots is broken"))?;
    let (mut body, mut used) = (String::new(), BTreeSet::new());
    for mark in &drawing.marks {
        // Writing to a string does not fail.
        let _ = write_mark(mark, &font, &mut used, &mut body);
    }
    let Vec2 { x, y } = drawing.size;
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {x} {y}\" width=\"{x}\" height=\"{y}\" role=\"img\">\n\
         <title>{}</title>\n<defs>",
        escaped(&drawing.title)
    )?;
    for glyph in used {
        let outline = path(&font.outline(glyph));
        writeln!(out, "<path id=\"g{glyph}\" d=\"{outline}\"/>")?;
    }
    writeln!(
        out,
        "</defs>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}</svg>"
    )
}

fn write_mark(
    mark: &Mark,
    font: &Font,
    used: &mut BTreeSet<u32>,
    body: &mut String,
) -> std::fmt::Result {
    match mark {
        Mark::Line {
            points,
            width,
            color,
            is_dashed,
        } => {
            let dash = if *is_dashed {
                format!(" stroke-dasharray=\"{} {}\"", DASH[0], DASH[1])
            } else {
                String::new()
            };
            writeln!(
                body,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}/>",
                places(points),
                hexadecimal(*color)
            )
        }
        Mark::Polygon { points, color } => writeln!(
            body,
            "<polygon points=\"{}\" fill=\"{}\"/>",
            places(points),
            hexadecimal(*color)
        ),
        Mark::Text {
            at,
            size,
            anchor,
            is_upward,
            color,
            text,
        } => {
            let (letters, width) = font.set(text);
            used.extend(letters.iter().map(|letter| letter.glyph));
            let turn = if *is_upward { " rotate(-90)" } else { "" };
            let scale = size / UNITS;
            write!(
                body,
                "<g aria-label=\"{}\" fill=\"{}\" transform=\"translate({:.1} {:.1}){turn} scale({scale})\">",
                escaped(text),
                hexadecimal(*color),
                at.x,
                at.y
            )?;
            let start = start(*anchor, width);
            for Letter { glyph, offset } in letters {
                let x = (start + offset) * UNITS;
                write!(body, "<use href=\"#g{glyph}\" x=\"{x:.0}\"/>")?;
            }
            writeln!(body, "</g>")
        }
    }
}

/// Where a text of a width starts, relative to its anchor.
pub(super) fn start(anchor: Anchor, width: f32) -> f32 {
    match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * width,
        Anchor::End => -width,
    }
}

fn path(outline: &[Stroke]) -> String {
    let mut text = String::new();
    let pair = |[x, y]: [f32; 2]| format!("{:.0} {:.0}", x * UNITS, y * UNITS);
    for stroke in outline {
        text += &match *stroke {
            Stroke::Move(to) => format!("M{}", pair(to)),
            Stroke::Line(to) => format!("L{}", pair(to)),
            Stroke::Quadratic(control, to) => format!("Q{} {}", pair(control), pair(to)),
            Stroke::Cubic(first, second, to) => {
                format!("C{} {} {}", pair(first), pair(second), pair(to))
            }
            Stroke::Close => "Z".to_owned(),
        };
    }
    text
}

fn places(points: &[Vec2]) -> String {
    let place = |point: &Vec2| format!("{:.1},{:.1}", point.x, point.y);
    points.iter().map(place).collect::<Vec<_>>().join(" ")
}

fn hexadecimal([red, green, blue]: Color) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
