//! A drawing as PNG: everything becomes closed outlines, which are filled by the non-zero rule with smooth edges.

use std::io::{self, Write};

use glam::Vec2;
use image::{ExtendedColorType, ImageEncoder as _, Rgb, RgbImage, codecs::png::PngEncoder};

use super::{
    Color, DASH, Drawing, Mark,
    glyphs::{Font, Stroke},
    svg::start,
};

/// Pixels to a unit of the drawing: sharp on dense screens.
const SCALE: f32 = 2.0;

/// Scan lines to a row of pixels. Across, edges are exact; down, this many steps of grey.
const LINES: usize = 5;

/// Straight pieces to a curve of a letter.
const PIECES: u8 = 6;

/// Corners of the discs that join and end lines.
const DISC_CORNERS: u8 = 14;

/// Closed outlines in pixels.
type Outlines = Vec<Vec<Vec2>>;

/// Write a drawing.
pub(super) fn write(drawing: &Drawing, out: &mut dyn Write) -> io::Result<()> {
    let font = Font::embedded().ok_or_else(|| io::Error::other("the font of plots is broken"))?;
    let size = (drawing.size * SCALE).round().as_uvec2();
    let mut image = RgbImage::from_pixel(size.x, size.y, Rgb([255; 3]));
    for mark in &drawing.marks {
        let (outlines, color) = outlines(mark, &font);
        fill(&mut image, &outlines, color);
    }
    PngEncoder::new(out)
        .write_image(image.as_raw(), size.x, size.y, ExtendedColorType::Rgb8)
        .map_err(io::Error::other)
}

fn outlines(mark: &Mark, font: &Font) -> (Outlines, Color) {
    match mark {
        Mark::Line {
            points,
            width,
            color,
            is_dashed,
        } => {
            let points: Vec<Vec2> = points.iter().map(|point| *point * SCALE).collect();
            let runs = if *is_dashed {
                dashes(&points, DASH.map(|length| length * SCALE))
            } else {
                vec![points]
            };
            let stroke = |run: &Vec<Vec2>| stroke(run, 0.5 * width * SCALE, *is_dashed);
            (runs.iter().flat_map(stroke).collect(), *color)
        }
        Mark::Polygon { points, color } => {
            let points = points.iter().map(|point| *point * SCALE);
            (vec![points.collect()], *color)
        }
        Mark::Text {
            at,
            size,
            anchor,
            is_upward,
            color,
            text,
        } => {
            let (letters, width) = font.set(text);
            let mut outlines = Vec::new();
            for letter in letters {
                let offset = start(*anchor, width) + letter.offset;
                let place = |[x, y]: [f32; 2]| {
                    let set = Vec2::new(x + offset, y) * *size;
                    // A quarter turn to the left.
                    let set = if *is_upward {
                        Vec2::new(set.y, -set.x)
                    } else {
                        set
                    };
                    (*at + set) * SCALE
                };
                outlines.extend(flattened(&font.outline(letter.glyph), place));
            }
            (outlines, *color)
        }
    }
}

/// The outline of a letter in straight pieces.
fn flattened(outline: &[Stroke], place: impl Fn([f32; 2]) -> Vec2) -> Outlines {
    let mut contours: Outlines = Vec::new();
    let mut at = Vec2::ZERO;
    for stroke in outline {
        let pieces: Vec<Vec2> = match *stroke {
            Stroke::Move(to) => {
                contours.push(Vec::new());
                vec![place(to)]
            }
            Stroke::Line(to) => vec![place(to)],
            Stroke::Quadratic(control, to) => {
                let (control, to) = (place(control), place(to));
                curve(|t| at.lerp(control, t).lerp(control.lerp(to, t), t))
            }
            Stroke::Cubic(first, second, to) => {
                let [first, second, to] = [first, second, to].map(&place);
                let parabola = |a: Vec2, b: Vec2, c: Vec2, t| a.lerp(b, t).lerp(b.lerp(c, t), t);
                curve(|t| parabola(at, first, second, t).lerp(parabola(first, second, to, t), t))
            }
            Stroke::Close => Vec::new(),
        };
        at = pieces.last().copied().unwrap_or(at);
        if let Some(contour) = contours.last_mut() {
            contour.extend(pieces);
        }
    }
    contours
}

/// Points along a curve, its start omitted.
fn curve(at: impl Fn(f32) -> Vec2) -> Vec<Vec2> {
    (1..=PIECES)
        .map(|piece| at(f32::from(piece) / f32::from(PIECES)))
        .collect()
}

/// A line as a rectangle for each piece and, unless its ends are to be square, a disc at each point.
fn stroke(points: &[Vec2], half_width: f32, has_square_ends: bool) -> Outlines {
    let mut outlines = Vec::new();
    for pair in points.windows(2) {
        let [a, b] = [pair[0], pair[1]];
        let aside = (b - a).normalize_or_zero().perp() * half_width;
        outlines.push(vec![a - aside, b - aside, b + aside, a + aside]);
    }
    let joints = if has_square_ends {
        points.get(1..points.len().saturating_sub(1)).unwrap_or(&[])
    } else {
        points
    };
    for joint in joints {
        let corner = |index: u8| {
            let angle = std::f32::consts::TAU * f32::from(index) / f32::from(DISC_CORNERS);
            *joint + Vec2::from_angle(angle) * half_width
        };
        outlines.push((0..DISC_CORNERS).map(corner).collect());
    }
    outlines
}

/// The dashes of a line.
fn dashes(points: &[Vec2], [dash, gap]: [f32; 2]) -> Outlines {
    let mut runs: Outlines = points
        .first()
        .map(|start| vec![*start])
        .into_iter()
        .collect();
    let (mut left, mut is_drawn) = (dash, true);
    for pair in points.windows(2) {
        let [mut from, to] = [pair[0], pair[1]];
        while from.distance(to) > left {
            from += (to - from).normalize_or_zero() * left;
            match runs.last_mut() {
                Some(run) if is_drawn => run.push(from),
                _ => runs.push(vec![from]),
            }
            is_drawn = !is_drawn;
            left = if is_drawn { dash } else { gap };
        }
        left -= from.distance(to);
        if let Some(run) = runs.last_mut()
            && is_drawn
        {
            run.push(to);
        }
    }
    runs
}

/// Fill closed outlines by the non-zero rule.
fn fill(image: &mut RgbImage, outlines: &[Vec<Vec2>], color: Color) {
    let points = || outlines.iter().flatten();
    let top = points().map(|point| point.y).fold(f32::MAX, f32::min);
    let bottom = points().map(|point| point.y).fold(0.0, f32::max);
    let rows = top.max(0.0).floor() as u32..(bottom.ceil() as u32).min(image.height());
    let mut coverage = vec![0.0_f32; image.width() as usize];
    for row in rows {
        coverage.fill(0.0);
        for line in 0..LINES {
            let y = row as f32 + (line as f32 + 0.5) / LINES as f32;
            for [from, to] in spans(outlines, y) {
                cover(&mut coverage, from, to);
            }
        }
        for (column, &covered) in coverage.iter().enumerate() {
            if covered > 0.0 {
                let share = (covered / LINES as f32).min(1.0);
                let pixel = image.get_pixel_mut(column as u32, row);
                for (channel, target) in pixel.0.iter_mut().zip(color) {
                    let mixed = f32::from(*channel) * (1.0 - share) + f32::from(target) * share;
                    *channel = mixed.round() as u8;
                }
            }
        }
    }
}

/// The pieces of a scan line that lie inside.
fn spans(outlines: &[Vec<Vec2>], y: f32) -> Vec<[f32; 2]> {
    let mut crossings: Vec<(f32, i32)> = Vec::new();
    for outline in outlines {
        let next = outline.iter().cycle().skip(1);
        for (a, b) in outline.iter().zip(next) {
            if (a.y <= y) != (b.y <= y) {
                let x = a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y);
                crossings.push((x, if b.y > a.y { 1 } else { -1 }));
            }
        }
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut winding, mut spans) = (0, Vec::new());
    for pair in crossings.windows(2) {
        winding += pair[0].1;
        if winding != 0 {
            spans.push([pair[0].0, pair[1].0]);
        }
    }
    spans
}

/// Add the share of each pixel that an interval covers.
fn cover(coverage: &mut [f32], from: f32, to: f32) {
    let (from, to) = (from.max(0.0), to.min(coverage.len() as f32));
    if from >= to {
        return;
    }
    let last = (to.ceil() as usize).min(coverage.len());
    for (column, share) in coverage
        .iter_mut()
        .enumerate()
        .take(last)
        .skip(from as usize)
    {
        let (left, right) = (column as f32, column as f32 + 1.0);
        *share += (to.min(right) - from.max(left)).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ink(image: &RgbImage) -> f32 {
        let dark = |pixel: &Rgb<u8>| 1.0 - f32::from(pixel.0[0]) / 255.0;
        image.pixels().map(dark).sum()
    }

    fn filled(outlines: &[Vec<Vec2>]) -> f32 {
        let mut image = RgbImage::from_pixel(40, 40, Rgb([255; 3]));
        fill(&mut image, outlines, [0; 3]);
        ink(&image)
    }

    #[test]
    fn a_filled_area_is_as_dark_as_it_is_large() {
        let square = |low: f32, high: f32| {
            [[low, low], [high, low], [high, high], [low, high]]
                .map(Vec2::from_array)
                .to_vec()
        };
        assert!((filled(&[square(3.3, 20.3)]) - 289.0).abs() < 4.0);
        // Overlaps count once; a hole that turns the other way is omitted.
        let twice = filled(&[square(2.0, 12.0), square(2.0, 12.0)]);
        assert!((twice - 100.0).abs() < 1.0, "{twice}");
        let mut hole = square(10.0, 20.0);
        hole.reverse();
        let ring = filled(&[square(5.0, 25.0), hole]);
        assert!((ring - 300.0).abs() < 2.0, "{ring}");
        assert!(filled(&[]) <= 0.0 && filled(&[square(-9.0, -1.0)]) <= 0.0);
    }

    #[test]
    fn a_dashed_line_is_drawn_for_its_share() {
        let line = [
            Vec2::new(0.0, 5.0),
            Vec2::new(20.0, 5.0),
            Vec2::new(35.0, 5.0),
        ];
        let runs = dashes(&line, [3.0, 2.0]);
        let length: f32 = runs
            .iter()
            .flat_map(|run| run.windows(2))
            .map(|pair| pair[0].distance(pair[1]))
            .sum();
        assert!((length - 21.0).abs() < 1e-4, "{length}");
        assert_eq!(runs.len(), 7);
        assert!((filled(&stroke(&line, 1.0, true)) - 70.0).abs() < 3.5);
    }
}
