//! Cluster boxes as lines: in which colours; the face powers of one as arrows.

use glam::Vec3;

use super::{
    render::{BoxInstance, SegmentInstance},
    theme,
    view::{ClusterColor, ClusterOverlay},
};
use crate::solver::ClusterBox;

/// Boxes drawn at most. More are a grey fog and slow on a software adapter.
pub const MAX_BOXES: usize = 200_000;

/// Part of the ramp's colours below those of boxes: the darkest would not show on dark surfaces.
pub const RAMP_START: f32 = 0.15;

/// Boxes in colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColoredBoxes {
    /// The boxes.
    pub instances: Vec<BoxInstance>,
    /// Values of the first and the last colour: powers and areas in frame units, counts, or W/m².
    pub ends: [f32; 2],
}

/// The boxes of an overlay that shows these clusters of all; empty where it is off.
pub fn boxes(all: &[ClusterBox], shown: &[usize], overlay: &ClusterOverlay) -> ColoredBoxes {
    if !overlay.shown || shown.is_empty() {
        return ColoredBoxes::default();
    }
    let shown: Vec<&ClusterBox> = chosen(all, shown, MAX_BOXES)
        .into_iter()
        .map(|index| &all[index])
        .collect();
    let [low, high] = color_range(&shown, overlay.color);
    let colored = |cluster: &&ClusterBox| {
        let t = (quantity(cluster, overlay.color) - low) / (high - low).max(f32::MIN_POSITIVE);
        let at = RAMP_START + (1.0 - RAMP_START) * t.clamp(0.0, 1.0);
        instance(cluster, theme::ramp(at))
    };
    ColoredBoxes {
        instances: shown.iter().map(colored).collect(),
        ends: [low, high].map(|end| value_of(end, overlay.color)),
    }
}

/// At most so many boxes: the largest, and with half of them or more the others, evenly spread.
fn chosen(all: &[ClusterBox], shown: &[usize], most: usize) -> Vec<usize> {
    if shown.len() <= most {
        return shown.to_vec();
    }
    let extent = |index: usize| (all[index].max - all[index].min).max_element();
    let mut extents: Vec<f32> = shown.iter().map(|&index| extent(index)).collect();
    let (_, limit, _) = extents.select_nth_unstable_by(most / 2, |a, b| b.total_cmp(a));
    let (large, small): (Vec<usize>, Vec<usize>) =
        shown.iter().partition(|&&index| extent(index) > *limit);
    let rest = spread(&small, most - large.len());
    large.iter().copied().chain(rest).collect()
}

/// At most so many of a list, evenly spread over it: neighbours in the tree's order are neighbours in the scene, so that
/// no part of the scene is left bare.
fn spread(list: &[usize], most: usize) -> impl Iterator<Item = usize> {
    let count = list.len().min(most);
    (0..count).map(move |place| list[place * list.len() / count])
}

/// One box in a colour.
pub fn instance(cluster: &ClusterBox, color: Vec3) -> BoxInstance {
    // Flat clusters, such as a wall, keep a visible edge.
    let thick = Vec3::splat(0.02);
    let [a, b, c] = (cluster.min - thick).to_array();
    let [d, e, f] = (cluster.max + thick).to_array();
    let [red, green, blue] = color.to_array();
    [a, b, c, d, e, f, red, green, blue]
}

/// The twelve edges of a box as ribbons.
pub fn outline(min: Vec3, max: Vec3, color: Vec3) -> Vec<SegmentInstance> {
    let corner = |bits: u32| {
        let is_upper = glam::BVec3::new(bits & 1 != 0, bits & 2 != 0, bits & 4 != 0);
        Vec3::select(is_upper, max, min)
    };
    let mut edges = Vec::with_capacity(12);
    for axis in [1, 2, 4] {
        for bits in (0..8).filter(|bits| bits & axis == 0) {
            edges.push(segment(corner(bits), corner(bits | axis), color, false));
        }
    }
    edges
}

/// The six face powers as arrows from the faces outwards; the strongest is half as long as the box is large.
pub fn face_power_arrows(cluster: &ClusterBox) -> Vec<SegmentInstance> {
    let strongest = cluster.face_power.into_iter().fold(0.0, f32::max);
    if strongest <= 0.0 {
        return Vec::new();
    }
    let extent = (cluster.max - cluster.min).max_element().max(0.5);
    let centre = 0.5 * (cluster.min + cluster.max);
    let half = 0.5 * (cluster.max - cluster.min);
    let mut arrows = Vec::new();
    for (face, power) in cluster.face_power.into_iter().enumerate() {
        let axis = face / 2;
        let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
        let direction = sign * [Vec3::X, Vec3::Y, Vec3::Z][axis];
        if power > 0.0 {
            let start = centre + direction * half;
            let end = start + direction * (0.5 * extent * power / strongest);
            arrows.push(segment(start, end, theme::AXIS_LINES[axis], true));
        }
    }
    arrows
}

/// One ribbon, with or without an arrowhead at its end.
pub fn segment(start: Vec3, end: Vec3, color: Vec3, is_arrow: bool) -> SegmentInstance {
    let [a, b, c] = start.to_array();
    let [d, e, f] = end.to_array();
    let [red, green, blue] = color.to_array();
    [
        a,
        b,
        c,
        d,
        e,
        f,
        red,
        green,
        blue,
        if is_arrow { 1.0 } else { 0.0 },
    ]
}

/// The quantity of a colour; powers, areas and counts by their logarithm, since they span many magnitudes.
fn quantity(cluster: &ClusterBox, color: ClusterColor) -> f32 {
    let log = |x: f32| x.clamp(1e-20, 1e20).log10();
    match color {
        ClusterColor::Power => log(cluster.power),
        ClusterColor::Area => log(cluster.area),
        ClusterColor::Spread => cluster.direction_spread,
        ClusterColor::Links => (cluster.link_count as f32 + 1.0).log10(),
        ClusterColor::Error => log(cluster.error),
    }
}

/// The value at a position of [`quantity`].
fn value_of(position: f32, color: ClusterColor) -> f32 {
    match color {
        ClusterColor::Spread => position,
        ClusterColor::Links => 10f32.powf(position) - 1.0,
        _ => 10f32.powf(position),
    }
}

/// Ends of the colours of some boxes; at most six magnitudes for logarithms.
fn color_range(shown: &[&ClusterBox], color: ClusterColor) -> [f32; 2] {
    if color == ClusterColor::Spread {
        return [0.0, 1.0];
    }
    let (mut low, mut high) = (f32::MAX, f32::MIN);
    for cluster in shown {
        let value = quantity(cluster, color);
        low = low.min(value);
        high = high.max(value);
    }
    [low.max(high - 6.0), high]
}

#[cfg(test)]
mod tests {
    use super::{super::clusters::tests::tree, *};

    #[test]
    fn boxes_are_finite_and_only_there_when_shown() {
        let mut overlay = ClusterOverlay::default();
        let all: Vec<usize> = (0..tree().len()).collect();
        assert_eq!(boxes(&tree(), &all, &overlay), ColoredBoxes::default());
        overlay.shown = true;
        for color in ClusterColor::ALL {
            overlay.color = color;
            for instance in boxes(&tree(), &all, &overlay).instances {
                assert!(
                    instance.iter().all(|x| x.is_finite()),
                    "{color:?} {instance:?}"
                );
            }
        }
    }

    #[test]
    fn the_ends_of_the_colours_are_those_of_the_boxes() {
        let mut tree = tree();
        (tree[1].power, tree[2].link_count) = (100.0, 7);
        let all: Vec<usize> = (0..tree.len()).collect();
        let ends = |color| {
            let overlay = ClusterOverlay {
                shown: true,
                color,
                ..ClusterOverlay::default()
            };
            boxes(&tree, &all, &overlay).ends
        };
        for (color, expected) in [
            (ClusterColor::Power, [1.0, 100.0]),
            (ClusterColor::Links, [0.0, 7.0]),
            (ClusterColor::Spread, [0.0, 1.0]),
        ] {
            let found = ends(color);
            let is_near =
                |index: usize| (found[index] - expected[index]).abs() < 1e-3 * expected[1];
            assert!(is_near(0) && is_near(1), "{color:?}: {found:?}");
        }
    }

    #[test]
    fn too_many_are_thinned_out_evenly() {
        let list: Vec<usize> = (100..110).collect();
        assert_eq!(spread(&list, 20).collect::<Vec<_>>(), list);
        assert_eq!(
            spread(&list, 5).collect::<Vec<_>>(),
            [100, 102, 104, 106, 108]
        );
        assert_eq!(spread(&list, 3).collect::<Vec<_>>(), [100, 103, 106]);
        assert_eq!(spread(&[], 5).count(), 0);
    }

    #[test]
    fn of_too_many_the_largest_are_kept() {
        let sized = |size: f32| ClusterBox {
            max: tree()[0].min + Vec3::splat(size),
            ..tree()[0]
        };
        // One large box among many small ones of one size.
        let all: Vec<ClusterBox> = (0..100)
            .map(|index| sized(if index == 37 { 5.0 } else { 1.0 }))
            .collect();
        let shown: Vec<usize> = (0..100).collect();
        let kept = chosen(&all, &shown, 10);
        assert_eq!(kept, [37, 0, 11, 22, 33, 45, 56, 67, 78, 89]);
        assert_eq!(chosen(&all, &shown, 100), shown);
    }

    #[test]
    fn arrows_point_where_the_power_goes() {
        let arrows = face_power_arrows(&tree()[0]);
        assert_eq!(arrows.len(), 2);
        let ends = |arrow: &SegmentInstance| {
            let (start, end) = arrow[..6].split_at(3);
            (Vec3::from_slice(start), Vec3::from_slice(end))
        };
        // +x with power 1 and +y with power 2, from the faces of a box of 8.
        let (start, end) = ends(&arrows[0]);
        assert_eq!(
            (start, end),
            (Vec3::new(8.0, 4.0, 4.0), Vec3::new(10.0, 4.0, 4.0))
        );
        let (start, end) = ends(&arrows[1]);
        assert_eq!(
            (start, end),
            (Vec3::new(4.0, 8.0, 4.0), Vec3::new(4.0, 12.0, 4.0))
        );
    }
}
