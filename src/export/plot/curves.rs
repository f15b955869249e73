//! Curves over two logarithmic axes: frame, grid, ticks, curves with their marks, and a legend beside them.

use std::f32::consts::TAU;

use glam::Vec2;

use super::{
    Anchor, Color, Drawing, Mark,
    axis::{LogAxis, SHOWABLE},
    glyphs::Font,
};

/// A curve and its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its name in the legend.
    pub label: String,
    /// Its points, joined in this order; those that are not positive cannot be shown and are omitted.
    pub points: Vec<[f64; 2]>,
    /// Dashed curves are what the others are compared with.
    pub is_dashed: bool,
    /// Whether each point gets a mark. A curve without is a grey rule to hold the others against.
    pub has_marks: bool,
}

/// Curves over two logarithmic axes.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePlot {
    /// Above the plot.
    pub title: String,
    /// Below the horizontal axis, with its unit.
    pub x_label: String,
    /// Beside the vertical axis, with its unit.
    pub y_label: String,
    /// From first to last, in the order of the legend.
    pub curves: Vec<Curve>,
}

/// The frame of the curves, in units of the drawing.
const LEFT: f32 = 76.0;
const TOP: f32 = 48.0;
const WIDTH: f32 = 640.0;
const HEIGHT: f32 = 460.0;
const BELOW: f32 = 58.0;

/// From the frame to the legend, and from its line to its text.
const GAP: f32 = 18.0;
const LEGEND_LINE: f32 = 34.0;
const LEGEND_ROW: f32 = 21.0;

const TEXT_SIZE: f32 = 13.5;
const TITLE_SIZE: f32 = 17.0;

const INK: Color = [34, 34, 34];
const GRID: Color = [214, 214, 214];
const RULE: Color = [130, 130, 130];
const FINE_GRID: Color = [238, 238, 238];

/// Colours that stay apart for colour-blind eyes and on white (Okabe & Ito 2008, the yellow darkened).
const PALETTE: [Color; 8] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [120, 94, 20],
    [86, 180, 233],
    [230, 159, 0],
    [80, 80, 80],
];

impl CurvePlot {
    /// Everything at its place.
    pub(super) fn drawing(&self) -> Drawing {
        let axes = self.axes();
        let mut marks = Vec::new();
        draw_frame(&axes, &mut marks);
        for (index, curve) in self.curves.iter().enumerate() {
            draw_curve(curve, index, &axes, &mut marks);
        }
        self.draw_texts(&mut marks);
        let legend_width = self.draw_legend(&mut marks);
        Drawing {
            size: Vec2::new(
                (LEFT + WIDTH + GAP + legend_width + GAP).ceil(),
                (TOP + HEIGHT + BELOW).max(TOP + LEGEND_ROW * (self.curves.len() + 1) as f32),
            ),
            title: self.title.clone(),
            marks,
        }
    }

    fn axes(&self) -> [LogAxis; 2] {
        let shown = || {
            self.curves
                .iter()
                .flat_map(|curve| &curve.points)
                .filter(|point| is_shown(point))
        };
        [
            LogAxis::around(shown().map(|point| point[0]), [LEFT, LEFT + WIDTH]),
            LogAxis::around(shown().map(|point| point[1]), [TOP + HEIGHT, TOP]),
        ]
    }

    fn draw_texts(&self, marks: &mut Vec<Mark>) {
        let middle = LEFT + 0.5 * WIDTH;
        let mut text = |at, size, is_upward, text: &str| {
            marks.push(Mark::Text {
                at,
                size,
                anchor: Anchor::Middle,
                is_upward,
                color: INK,
                text: text.to_owned(),
            });
        };
        text(Vec2::new(middle, 29.0), TITLE_SIZE, false, &self.title);
        let below = TOP + HEIGHT + BELOW - 14.0;
        text(Vec2::new(middle, below), TEXT_SIZE, false, &self.x_label);
        let beside = Vec2::new(20.0, TOP + 0.5 * HEIGHT);
        text(beside, TEXT_SIZE, true, &self.y_label);
    }

    /// Draw the legend and return its width.
    fn draw_legend(&self, marks: &mut Vec<Mark>) -> f32 {
        let font = Font::embedded();
        let (left, mut widest) = (LEFT + WIDTH + GAP, 0.0_f32);
        for (index, curve) in self.curves.iter().enumerate() {
            let y = TOP + 10.0 + LEGEND_ROW * index as f32;
            let line = [Vec2::new(left, y), Vec2::new(left + LEGEND_LINE - 8.0, y)];
            marks.push(line_mark(curve, index, line.to_vec()));
            if curve.has_marks {
                marks.push(point_mark(index, line[0].midpoint(line[1])));
            }
            marks.push(Mark::Text {
                at: Vec2::new(left + LEGEND_LINE, y + 4.5),
                size: TEXT_SIZE,
                anchor: Anchor::Start,
                is_upward: false,
                color: INK,
                text: curve.label.clone(),
            });
            let width = font.as_ref().map_or(0.0, |font| font.set(&curve.label).1);
            widest = widest.max(width * TEXT_SIZE);
        }
        LEGEND_LINE + widest
    }
}

fn is_shown(point: &[f64; 2]) -> bool {
    point.iter().all(|value| SHOWABLE.contains(value))
}

/// Grid, frame, ticks and their labels.
fn draw_frame(axes: &[LogAxis; 2], marks: &mut Vec<Mark>) {
    let [x_axis, y_axis] = axes;
    let (right, bottom) = (LEFT + WIDTH, TOP + HEIGHT);
    let mut texts = Vec::new();
    let mut text = |at, anchor, text: &str| {
        texts.push(Mark::Text {
            at,
            size: TEXT_SIZE,
            anchor,
            is_upward: false,
            color: INK,
            text: text.to_owned(),
        });
    };
    let mut lines = [Vec::new(), Vec::new()];
    for tick in x_axis.ticks() {
        let x = x_axis.place(tick.value);
        let line = [Vec2::new(x, TOP), Vec2::new(x, bottom)];
        lines[usize::from(tick.label.is_some())].push(line);
        if let Some(label) = tick.label {
            text(Vec2::new(x, bottom + 19.0), Anchor::Middle, &label);
        }
    }
    for tick in y_axis.ticks() {
        let y = y_axis.place(tick.value);
        let line = [Vec2::new(LEFT, y), Vec2::new(right, y)];
        lines[usize::from(tick.label.is_some())].push(line);
        if let Some(label) = tick.label {
            text(Vec2::new(LEFT - 8.0, y + 4.5), Anchor::End, &label);
        }
    }
    let [fine, labelled] = lines;
    marks.extend(fine.into_iter().map(|line| grid_line(line, FINE_GRID)));
    marks.extend(labelled.into_iter().map(|line| grid_line(line, GRID)));
    let corners = [
        (LEFT, TOP),
        (right, TOP),
        (right, bottom),
        (LEFT, bottom),
        (LEFT, TOP),
    ];
    marks.push(Mark::Line {
        points: corners.map(|(x, y)| Vec2::new(x, y)).to_vec(),
        width: 1.2,
        color: INK,
        is_dashed: false,
    });
    marks.append(&mut texts);
}

fn grid_line(line: [Vec2; 2], color: Color) -> Mark {
    Mark::Line {
        points: line.to_vec(),
        width: 1.0,
        color,
        is_dashed: false,
    }
}

fn draw_curve(curve: &Curve, index: usize, [x_axis, y_axis]: &[LogAxis; 2], marks: &mut Vec<Mark>) {
    let points: Vec<Vec2> = curve
        .points
        .iter()
        .filter(|point| is_shown(point))
        .map(|&[x, y]| Vec2::new(x_axis.place(x), y_axis.place(y)))
        .collect();
    let dots: Vec<Mark> = points.iter().map(|&at| point_mark(index, at)).collect();
    marks.push(line_mark(curve, index, points));
    if curve.has_marks {
        marks.extend(dots);
    }
}

fn color_of(index: usize) -> Color {
    PALETTE[index % PALETTE.len()]
}

fn line_mark(curve: &Curve, index: usize, points: Vec<Vec2>) -> Mark {
    Mark::Line {
        points,
        width: 1.8,
        color: if curve.has_marks {
            color_of(index)
        } else {
            RULE
        },
        is_dashed: curve.is_dashed,
    }
}

/// A disc for the first round of colours, then a square, a triangle and a diamond.
fn point_mark(index: usize, at: Vec2) -> Mark {
    let (corners, radius, turn) = match index / PALETTE.len() % 4 {
        0 => (16, 3.6, 0.0),
        1 => (4, 4.8, TAU / 8.0),
        2 => (3, 5.2, -TAU / 4.0),
        _ => (4, 5.2, 0.0),
    };
    let corner = |index: u8| {
        let angle = turn + TAU * f32::from(index) / f32::from(corners);
        at + Vec2::from_angle(angle) * radius
    };
    Mark::Polygon {
        points: (0..corners).map(corner).collect(),
        color: color_of(index),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(curves: usize) -> CurvePlot {
        let curve = |index: usize| Curve {
            label: format!("run <{index}> & more"),
            points: (1..6)
                .map(|step| f64::from(step) * (index + 1) as f64)
                .map(|time| [time, 0.3 / time])
                .chain([[f64::NAN, 1.0], [1.0, 0.0]])
                .collect(),
            is_dashed: index.is_multiple_of(2),
            has_marks: true,
        };
        CurvePlot {
            title: "title".to_owned(),
            x_label: "time (s)".to_owned(),
            y_label: "error (%)".to_owned(),
            curves: (0..curves).map(curve).collect(),
        }
    }

    /// Box of a text, by its width and a line's height.
    fn text_box(mark: &Mark) -> Option<[Vec2; 2]> {
        let Mark::Text {
            at,
            size,
            anchor,
            is_upward,
            text,
            ..
        } = mark
        else {
            return None;
        };
        let width = Font::embedded().unwrap().set(text).1;
        let start = super::super::svg::start(*anchor, width) * size;
        let (low, high) = (
            Vec2::new(start, -0.75 * size),
            Vec2::new(start + width * size, 0.2 * size),
        );
        Some(if *is_upward {
            [
                *at + Vec2::new(low.y, -high.x),
                *at + Vec2::new(high.y, -low.x),
            ]
        } else {
            [*at + low, *at + high]
        })
    }

    #[test]
    fn no_text_touches_another_or_the_rim() {
        for count in [0, 1, 14, 30] {
            let drawing = plot(count).drawing();
            let boxes: Vec<[Vec2; 2]> = drawing.marks.iter().filter_map(text_box).collect();
            for (index, [low, high]) in boxes.iter().enumerate() {
                assert!(low.min_element() >= 0.0 && (drawing.size - *high).min_element() >= 0.0);
                for [other_low, other_high] in &boxes[..index] {
                    let apart = low.cmpgt(*other_high).any() || other_low.cmpgt(*high).any();
                    assert!(apart, "{count}: {low} {high} and {other_low} {other_high}");
                }
            }
        }
    }

    #[test]
    fn curves_stay_inside_the_frame() {
        for mark in plot(14).drawing().marks {
            if let Mark::Line { points, .. } = mark {
                assert!(
                    points
                        .iter()
                        .all(|point| point.is_finite() && point.y >= TOP)
                );
            }
        }
    }

    #[test]
    fn svg_is_escaped_and_closed_and_png_has_its_size() {
        let plot = plot(3);
        let mut svg = Vec::new();
        plot.write_svg(&mut svg).unwrap();
        let svg = String::from_utf8(svg).unwrap();
        assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
        assert!(svg.contains("run &lt;1&gt; &amp; more") && !svg.contains("run <"));
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        for opened in ["g", "defs", "title"] {
            let count = |text: &str| svg.matches(text).count();
            let begins = count(&format!("<{opened}>")) + count(&format!("<{opened} "));
            assert_eq!(begins, count(&format!("</{opened}>")), "{opened}");
        }
        let mut png = Vec::new();
        plot.write_png(&mut png).unwrap();
        let image = image::load_from_memory(&png).unwrap();
        let size = plot.drawing().size * 2.0;
        assert_eq!(
            (image.width(), image.height()),
            (size.x as u32, size.y as u32)
        );
    }
}
