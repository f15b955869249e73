//! Plots of curves over two logarithmic axes, as SVG and as PNG.
//!
//! A plot becomes a [`Drawing`]: lines, filled polygons and text at fixed places. Both formats draw that same list
//! with the same font outlines, so that they look alike on every machine.

mod axis;
mod curves;
mod glyphs;
mod raster;
mod svg;

use std::io;

use glam::Vec2;

pub use curves::{Curve, CurvePlot};

/// Red, green and blue, sRGB.
type Color = [u8; 3];

/// Where a text begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Anchor {
    Start,
    Middle,
    End,
}

/// A thing to draw; lengths in units of the drawing, y downwards.
#[derive(Clone, Debug, PartialEq)]
enum Mark {
    /// A line through points.
    Line {
        points: Vec<Vec2>,
        width: f32,
        color: Color,
        is_dashed: bool,
    },
    /// A filled polygon.
    Polygon { points: Vec<Vec2>, color: Color },
    /// A line of text, its baseline at a point, perhaps turned to read upwards.
    Text {
        at: Vec2,
        size: f32,
        anchor: Anchor,
        is_upward: bool,
        color: Color,
        text: String,
    },
}

/// The drawing of both formats, later marks over earlier ones, on white.
#[derive(Clone, Debug, Default, PartialEq)]
struct Drawing {
    size: Vec2,
    title: String,
    marks: Vec<Mark>,
}

/// Length of a dash and of the gap behind it.
const DASH: [f32; 2] = [7.0, 4.0];

impl CurvePlot {
    /// Write the plot as SVG.
    ///
    /// # Errors
    /// As writing to `out`.
    pub fn write_svg(&self, out: &mut dyn io::Write) -> io::Result<()> {
        svg::write(&self.drawing(), out)
    }

    /// Write the plot as PNG, two pixels to a unit of the SVG.
    ///
    /// # Errors
    /// As writing to `out`.
    pub fn write_png(&self, out: &mut dyn io::Write) -> io::Result<()> {
        raster::write(&self.drawing(), out)
    }
}
