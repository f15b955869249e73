//! Links of what is selected as lines from receiver to source.

use super::{
    cluster_lines::{outline, segment},
    render::SegmentInstance,
    theme,
    view::{LinkColor, LinkOverlay},
};
use crate::{
    scene::luminance,
    solver::{InspectedLink, Inspection},
};

/// Magnitudes that the colours of strengths span at most. With fewer, weak links look alike; with more, strong ones do.
const MOST_MAGNITUDES: f32 = 3.0;

/// The quantity of the lines, for their legend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkSummary {
    /// Links drawn.
    pub drawn: usize,
    /// Links there are.
    pub all: usize,
    /// The part of the irradiance over links that those drawn bring, 0…1.
    pub share: f32,
    /// Ends of the colours: visibilities, or luminances in W/m².
    pub range: [f32; 2],
}

/// The quantity of the lines of an inspection.
pub fn summary(inspection: &Inspection, overlay: &LinkOverlay) -> LinkSummary {
    let drawn = drawn(inspection, overlay);
    let brought: f32 = drawn.iter().map(strength).sum();
    let total = luminance(inspection.linked);
    LinkSummary {
        drawn: drawn.len(),
        all: inspection.links.len(),
        share: if total > 0.0 {
            (brought / total).min(1.0)
        } else {
            0.0
        },
        range: range(drawn, overlay.color),
    }
}

/// One line a link, from receiver to source, the strongest on top; light within a cluster is the outline of its box.
pub fn segments(inspection: &Inspection, overlay: &LinkOverlay) -> Vec<SegmentInstance> {
    let drawn = drawn(inspection, overlay);
    let range = range(drawn, overlay.color);
    let mut lines = Vec::new();
    for link in drawn.iter().rev() {
        let color = theme::ramp(position(link, overlay.color, range));
        if link.source.node == link.receiver.node {
            lines.extend(outline(link.source.min, link.source.max, color));
        } else {
            lines.push(segment(
                link.receiver.centre,
                link.source.centre,
                color,
                false,
            ));
        }
    }
    lines
}

/// The strongest.
fn drawn<'a>(inspection: &'a Inspection, overlay: &LinkOverlay) -> &'a [InspectedLink] {
    let count = (overlay.most as usize).min(inspection.links.len());
    &inspection.links[..count]
}

fn strength(link: &InspectedLink) -> f32 {
    luminance(link.irradiance).max(0.0)
}

/// Ends of the colours: strengths from the weakest to the strongest of those drawn, which come strongest first.
fn range(drawn: &[InspectedLink], color: LinkColor) -> [f32; 2] {
    match color {
        LinkColor::Visibility => [0.0, 1.0],
        LinkColor::Strength => {
            let [most, least] =
                [drawn.first(), drawn.last()].map(|link| link.map_or(0.0, strength));
            [least.max(most * 10f32.powf(-MOST_MAGNITUDES)), most]
        }
    }
}

/// Where a link stands between the ends of the colours, 0…1; strengths by their logarithm.
fn position(link: &InspectedLink, color: LinkColor, [low, high]: [f32; 2]) -> f32 {
    let position = match color {
        LinkColor::Visibility => link.visibility,
        LinkColor::Strength if 0.0 < low && low < high => {
            (strength(link).max(low) / low).ln() / (high / low).ln()
        }
        LinkColor::Strength if low > 0.0 => 1.0,
        LinkColor::Strength => 0.0,
    };
    position.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::{
        hierarchy::NodeId,
        solver::{Place, Subject},
    };

    fn place(node: u32) -> Place {
        Place {
            node: NodeId(node),
            min: Vec3::splat(node as f32),
            max: Vec3::splat(node as f32 + 1.0),
            centre: Vec3::splat(node as f32 + 0.5),
        }
    }

    /// Two links to node 1, from 2 and from 3, and light within 0.
    fn inspection() -> Inspection {
        let link = |source, receiver, light, visibility| InspectedLink {
            source: place(source),
            receiver: place(receiver),
            visibility,
            irradiance: Vec3::splat(light),
            form_factor: 0.1,
            error: 0.0,
        };
        Inspection {
            subject: Subject::Cluster(NodeId(1)),
            step: 1,
            links: vec![
                link(2, 1, 8.0, 0.5),
                link(0, 0, 1.5, 1.0),
                link(3, 1, 0.5, 0.0),
            ],
            linked: Vec3::splat(10.0),
            direct: Vec3::ZERO,
            row_sum: 0.3,
            error_bound: 0.0,
            path: Vec::new(),
        }
    }

    #[test]
    fn lines_run_from_receiver_to_source_and_the_strongest_is_on_top() {
        let overlay = LinkOverlay {
            color: LinkColor::Visibility,
            ..LinkOverlay::default()
        };
        let lines = segments(&inspection(), &overlay);
        assert_eq!(lines.len(), 1 + 12 + 1);
        let strongest = lines[lines.len() - 1];
        assert_eq!(strongest[..6], [1.5, 1.5, 1.5, 2.5, 2.5, 2.5]);
        assert_eq!(strongest[6..9], theme::ramp(0.5).to_array());
    }

    #[test]
    fn only_the_strongest_are_drawn_and_their_share_is_told() {
        let mut overlay = LinkOverlay {
            most: 1,
            color: LinkColor::Strength,
            ..LinkOverlay::default()
        };
        let told = summary(&inspection(), &overlay);
        assert_eq!((told.drawn, told.all), (1, 3));
        assert!((told.share - 0.8).abs() < 1e-6, "{told:?}");
        assert_eq!(told.range[1], 8.0);
        overlay.most = 9;
        assert!((summary(&inspection(), &overlay).share - 1.0).abs() < 1e-6);
    }

    #[test]
    fn strengths_of_those_drawn_use_all_colours() {
        let color_of = |lines: &[SegmentInstance], at: usize| lines[at][6..9].to_vec();
        let ramp = |at: f32| theme::ramp(at).to_array().to_vec();
        let mut overlay = LinkOverlay {
            color: LinkColor::Strength,
            ..LinkOverlay::default()
        };
        // From 0.5 to 8, whose logarithms are 4 octaves apart; 1.5 lies at log2(3)/4.
        let lines = segments(&inspection(), &overlay);
        let (weakest, middle, strongest) = (
            color_of(&lines, 0),
            color_of(&lines, 1),
            color_of(&lines, 13),
        );
        assert_eq!((weakest, strongest), (ramp(0.0), ramp(1.0)));
        let wanted = ramp(3f32.log2() / 4.0);
        assert!(middle.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-4));
        // Fewer span less: the weakest of them is where the colours begin.
        overlay.most = 2;
        assert_eq!(color_of(&segments(&inspection(), &overlay), 0), ramp(0.0));
        overlay.most = 1;
        assert_eq!(color_of(&segments(&inspection(), &overlay), 0), ramp(1.0));
    }

    #[test]
    fn a_dark_element_has_lines_of_finite_colours() {
        let mut dark = inspection();
        dark.linked = Vec3::ZERO;
        for link in &mut dark.links {
            link.irradiance = Vec3::ZERO;
        }
        let overlay = LinkOverlay {
            color: LinkColor::Strength,
            ..LinkOverlay::default()
        };
        assert!(
            segments(&dark, &overlay)
                .iter()
                .flatten()
                .all(|x| x.is_finite())
        );
        assert_eq!(summary(&dark, &overlay).share, 0.0);
    }
}
