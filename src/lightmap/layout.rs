//! Where every lit side lies in the lightmap: how large that is, and how many texels a length gets.

use glam::Vec2;

use super::{
    charts::{Chart, charts},
    own::own_coordinates,
    pack::pack,
    seams::{Seam, seams},
    sides::{Neighbours, Side},
};
use crate::scene::{Frame, Scene};

/// Texels about each chart that repeat its light. Fewer, and a lookup blends other charts in; more take room, most of all
/// where charts are small.
pub(super) const PADDING: u32 = 2;

/// Width and height of a lightmap in texels, at least and at most. Larger ones fill the memory of graphics adapters, and take
/// more than a gigabyte here.
const LEAST_SIDE: u32 = 64;
const MOST_SIDE: u32 = 4096;

/// Width and height where no density is asked for, unless charts are too many. Smaller, and shadows in a room blur; larger
/// takes time.
const DEFAULT_SIDE: u32 = 1024;

/// Part of the texels, along an axis, that surfaces get at least where no density is asked for, before the lightmap is made
/// larger. Smaller, and charts are mostly padding; larger, and no square is filled well enough.
const LEAST_USE: f32 = 0.5;

/// Extent of a chart, relative to that of the scene proper, above which it has fewer texels where no density is asked for: a
/// ground to the horizon would take all of them.
const LARGE: f32 = 1.5;

/// Extents of a chart in texels below which all of it has one.
const ONE_TEXEL: f32 = 0.5;

/// Times that the room for densities is halved in search of the largest that fits.
const SEARCHES: u32 = 14;

/// Where the sides of a scene lie in its lightmap.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    /// Width and height in texels.
    pub(super) side: u32,
    /// Texels for a length of a frame unit.
    pub(super) density: f32,
    /// Corners of each side in texels from the upper left; the middle of the first texel is at 0.5.
    pub(super) corners: Vec<[Vec2; 3]>,
    /// The chart of each side.
    pub(super) chart_of: Vec<u32>,
    /// Charts.
    pub(super) chart_count: usize,
    /// Charts with fewer texels than the density says.
    pub(super) limited: usize,
    /// Whether these are the coordinates of the file.
    pub(super) is_own: bool,
    /// Edges where a surface goes on smoothly from chart to chart.
    pub(super) seams: Vec<Seam>,
}

/// Why there is no lightmap.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayoutError {
    /// Each chart takes a texel and those about it.
    #[error(
        "a lightmap has at most {MOST_SIDE} × {MOST_SIDE} texels, too few for the {charts} charts of this scene, whose faces do not hang together; export a mesh with the light at its vertices instead"
    )]
    TooManyCharts {
        /// Of the scene.
        charts: usize,
    },
    /// It was cancelled.
    #[error("the lightmap was cancelled")]
    Cancelled,
}

impl Layout {
    /// Lay out all sides of a scene, with so many texels for a frame unit where that is asked for.
    pub(super) fn new(
        scene: &Scene,
        sides: &[Side],
        density: Option<f32>,
        proceed: &dyn Fn() -> Option<()>,
    ) -> Result<Self, LayoutError> {
        let neighbours = Neighbours::of(scene, sides);
        let mut layout = match own_coordinates(scene, sides, &neighbours) {
            Some(own) => Self::own(scene, sides, own, density),
            None => Self::unwrapped(scene, sides, &neighbours, density, proceed)?,
        };
        layout.seams = seams(&layout.corners, &layout.chart_of, &neighbours);
        Ok(layout)
    }

    /// In charts.
    fn unwrapped(
        scene: &Scene,
        sides: &[Side],
        neighbours: &Neighbours,
        density: Option<f32>,
        proceed: &dyn Fn() -> Option<()>,
    ) -> Result<Self, LayoutError> {
        let charts = charts(scene, sides, neighbours, proceed).ok_or(LayoutError::Cancelled)?;
        let arranged = match density {
            None => arranged_by_default(&charts),
            Some(density) => arranged_at(&charts, density),
        };
        let arranged = arranged.ok_or(LayoutError::TooManyCharts {
            charts: charts.len(),
        })?;
        Ok(arranged.layout(&charts, sides.len()))
    }

    /// The file's own coordinates, with the island of each side.
    fn own(
        scene: &Scene,
        sides: &[Side],
        (places, islands): (Vec<[Vec2; 3]>, Vec<u32>),
        density: Option<f32>,
    ) -> Self {
        let covered: f32 = places
            .iter()
            .map(|&[a, b, c]| 0.5 * (b - a).perp_dot(c - a).abs())
            .sum();
        let area: f32 = sides.iter().map(|side| side.area(scene)).sum();
        // Lengths over those of the unit square.
        let length = (area / covered.max(f32::MIN_POSITIVE)).sqrt();
        let wanted = density.map_or(DEFAULT_SIDE as f32, |density| density * length);
        let side = (wanted.min(MOST_SIDE as f32).max(1.0) as u32)
            .next_power_of_two()
            .clamp(LEAST_SIDE, MOST_SIDE);
        let islands_count = islands.iter().max().map_or(0, |last| *last as usize + 1);
        Self {
            side,
            density: side as f32 / length,
            corners: places
                .into_iter()
                .map(|corners| corners.map(|place| place * side as f32))
                .collect(),
            chart_of: islands,
            chart_count: islands_count,
            limited: if wanted > MOST_SIDE as f32 {
                islands_count
            } else {
                0
            },
            is_own: true,
            seams: Vec::new(),
        }
    }
}

/// Charts in a square.
struct Arranged {
    side: u32,
    density: f32,
    /// Distances between texels along the edges of each chart's rectangle.
    spans: Vec<[u32; 2]>,
    places: Vec<[u32; 2]>,
    limited: usize,
}

/// At the largest density that fits a square of the usual size, or a larger one where charts are many.
fn arranged_by_default(charts: &[Chart]) -> Option<Arranged> {
    let most = LARGE * Frame::EXTENT as f32;
    let counted = |chart: &Chart| {
        let extent = chart.flat.extent;
        extent * (most / extent.max_element()).min(1.0)
    };
    let area: f32 = charts
        .iter()
        .map(|chart| counted(chart).element_product())
        .sum();
    let mut side = DEFAULT_SIDE;
    loop {
        let ideal = side as f32 / area.max(f32::MIN_POSITIVE).sqrt();
        let at = |density: f32| Arranged::new(charts, side, density, density * most);
        // Few charts that are all of one shape may leave half of the square.
        let found = largest(|part| at(ideal * part));
        let is_last = side == MOST_SIDE;
        match found {
            Some(found) if is_last || found.density >= LEAST_USE * ideal => return Some(found),
            found if is_last => return found,
            _ => side *= 2,
        }
    }
}

/// At a density, in the smallest square; in the largest one with fewer texels for large charts.
fn arranged_at(charts: &[Chart], density: f32) -> Option<Arranged> {
    let mut side = LEAST_SIDE;
    while side < MOST_SIDE {
        if let Some(arranged) = Arranged::new(charts, side, density, f32::INFINITY) {
            return Some(arranged);
        }
        side *= 2;
    }
    Arranged::new(charts, side, density, f32::INFINITY)
        .or_else(|| largest(|part| Arranged::new(charts, side, density, part * side as f32)))
}

/// What is made of the largest part, 0…1, that something is made of.
fn largest<T>(make: impl Fn(f32) -> Option<T>) -> Option<T> {
    // Twelve octaves.
    let part = |exponent: f32| exponent.exp2();
    let (mut low, mut high) = (-12.0, 0.0);
    let mut best = make(part(low))?;
    for _ in 0..SEARCHES {
        let middle = 0.5 * (low + high);
        match make(part(middle)) {
            Some(made) => (low, best) = (middle, made),
            None => high = middle,
        }
    }
    Some(best)
}

impl Arranged {
    /// Charts at a density, none with more texels along an axis than `most`; `None` where they do not fit.
    fn new(charts: &[Chart], side: u32, density: f32, most: f32) -> Option<Self> {
        let mut limited = 0;
        let mut spans = Vec::with_capacity(charts.len());
        for chart in charts {
            let mut extent = chart.flat.extent * density;
            if extent.max_element() > most {
                extent *= most / extent.max_element();
                limited += 1;
            }
            if extent.max_element() > side as f32 {
                return None;
            }
            spans.push(extent.to_array().map(span));
        }
        let sizes: Vec<[u32; 2]> = spans
            .iter()
            .map(|span| span.map(|span| span + 1 + 2 * PADDING))
            .collect();
        Some(Self {
            side,
            density,
            places: pack(&sizes, side)?,
            spans,
            limited,
        })
    }

    /// The edges of a chart's rectangle lie on the middles of its outermost texels, so that charts that meet in one have the
    /// same light there.
    fn layout(self, charts: &[Chart], side_count: usize) -> Layout {
        let mut corners = vec![[Vec2::ZERO; 3]; side_count];
        let mut chart_of = vec![0; side_count];
        for (number, chart) in charts.iter().enumerate() {
            let [span, place] = [self.spans[number], self.places[number]]
                .map(|[x, y]| Vec2::new(x as f32, y as f32));
            let first = place + PADDING as f32 + 0.5;
            let scale = span / chart.flat.extent.max(Vec2::splat(f32::MIN_POSITIVE));
            for (&side, flat) in chart.sides.iter().zip(&chart.flat.corners) {
                let side = side as usize;
                corners[side] = flat.map(|at| first + (at * scale).clamp(Vec2::ZERO, span));
                chart_of[side] = number as u32;
            }
        }
        Layout {
            side: self.side,
            density: self.density,
            corners,
            chart_of,
            chart_count: charts.len(),
            limited: self.limited,
            is_own: false,
            seams: Vec::new(),
        }
    }
}

/// Distances between texels over an extent in texels.
fn span(extent: f32) -> u32 {
    /// What rounding adds.
    const ROUNDING: f32 = 1e-3;
    if extent < ONE_TEXEL {
        0
    } else {
        (extent - ROUNDING).ceil().max(1.0) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        lightmap::{flatten::Flat, texels::Texels},
        scene::{SceneOptions, Sides, builtin::find_builtin},
    };

    fn scene(name: &str, sides: Sides) -> Scene {
        let builtin = find_builtin(name).unwrap();
        builtin.scene(&SceneOptions::with_sides(sides)).unwrap()
    }

    fn layout(scene: &Scene, density: Option<f32>) -> Layout {
        let sides = Side::all(scene);
        Layout::new(scene, &sides, density, &|| Some(())).unwrap()
    }

    /// Texels whose middles lie inside triangles, by how many of them, those on edges left out.
    fn most_over_each_other(layout: &Layout) -> u32 {
        /// In texels.
        const MARGIN: f32 = 0.02;
        let side = layout.side as usize;
        let mut counts = vec![0; side * side];
        for &[a, b, c] in &layout.corners {
            let [low, high] = [a.min(b).min(c), a.max(b).max(c)];
            let is_clockwise = (b - a).perp_dot(c - a) < 0.0;
            for row in low.y as usize..=high.y as usize {
                for column in low.x as usize..=high.x as usize {
                    let place = Vec2::new(column as f32, row as f32) + 0.5;
                    let is_inside = [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
                        let edge = (to - from).normalize_or_zero();
                        let depth = edge.perp_dot(place - from);
                        (if is_clockwise { -depth } else { depth }) > MARGIN
                    });
                    counts[row * side + column] += u32::from(is_inside);
                }
            }
        }
        counts.into_iter().max().unwrap_or(0)
    }

    #[test]
    fn no_sides_of_built_in_scenes_lie_over_each_other_and_each_has_texels() {
        for (name, sides) in [
            ("cornell", Sides::Two),
            ("plates", Sides::Two),
            ("gallery", Sides::One),
            ("room-8621", Sides::One),
            ("courtyard", Sides::Auto),
            ("soup", Sides::Two),
        ] {
            let scene = scene(name, sides);
            let layout = layout(&scene, None);
            assert_eq!(most_over_each_other(&layout), 1, "{name}");
            assert!(!layout.is_own && layout.limited == 0, "{name}");
            let all = Side::all(&scene);
            let texels = Texels::new(&scene, &all, &layout);
            for (number, corners) in layout.corners.iter().enumerate() {
                for corner in corners {
                    // The texel that counts most there, and the chart about it.
                    let [column, row] = corner.to_array().map(|at| at as u32);
                    let place = texels.place([column, row]).unwrap();
                    assert_eq!(place.chart, layout.chart_of[number], "{name}");
                }
            }
        }
    }

    #[test]
    fn the_density_is_as_asked_until_the_lightmap_is_full() {
        let scene = scene("cornell", Sides::One);
        let sides = Side::all(&scene);
        let lengths = |layout: &Layout| -> Vec<[f32; 2]> {
            let corners = layout.corners.iter().zip(&sides);
            let lengths = corners.map(|(flat, side)| {
                let places = side.corners(&scene);
                [flat[0].distance(flat[1]), places[0].distance(places[1])]
            });
            lengths.collect()
        };
        let mut last = 0;
        for density in [0.1, 1.0, 10.0] {
            let layout = layout(&scene, Some(density));
            assert_eq!((layout.limited, layout.density), (0, density));
            assert!(layout.side > last);
            last = layout.side;
            for [texels, length] in lengths(&layout) {
                // At most a texel is added over a chart's extent.
                let most = 1.5 * (length * density) + 1.5;
                assert!(texels >= 0.99 * length * density - 0.7 && texels <= most);
            }
        }
        for density in [100.0, 1e6, f32::MAX] {
            let layout = layout(&scene, Some(density));
            assert!(layout.limited > 0 && layout.side == MOST_SIDE, "{density}");
            let spread = lengths(&layout);
            assert!(spread.iter().all(|[texels, _]| texels.is_finite()));
        }
        assert_eq!(layout(&scene, Some(f32::MIN_POSITIVE)).side, LEAST_SIDE);
    }

    #[test]
    fn too_many_charts_are_refused() {
        let flat = Flat {
            corners: Vec::new(),
            extent: Vec2::ONE,
        };
        let chart = Chart {
            sides: Vec::new(),
            flat,
        };
        let charts = vec![chart; 700_000];
        assert!(arranged_by_default(&charts).is_none());
        assert!(arranged_at(&charts, 1.0).is_none());
        assert!(arranged_at(&charts[..1000], 1.0).is_some());
    }
}
