//! Lines over the light, made again only when what they show changes.

use std::sync::Arc;

use super::{
    cluster_lines, links,
    render::{Overlay, SegmentInstance},
    state::State,
    theme,
    view::{ClusterOverlay, LinkOverlay},
};
use crate::solver::{ClusterBox, Inspection};

/// The lines of the last frame, and what they were made from. Arcs are held, so that an address is not used twice.
#[derive(Default)]
pub(super) struct LineCache {
    overlay: Overlay,
    boxes_key: Option<(Arc<Vec<ClusterBox>>, ClusterOverlay)>,
    segments_key: Option<SegmentsKey>,
}

struct SegmentsKey {
    clusters: Arc<Vec<ClusterBox>>,
    selected: Option<usize>,
    inspection: Option<Arc<Inspection>>,
    shown: LinkOverlay,
}

impl LineCache {
    /// The lines of a state with this tree.
    pub(super) fn overlay(&mut self, state: &State, clusters: &Arc<Vec<ClusterBox>>) -> &Overlay {
        self.update_boxes(state, clusters);
        self.update_segments(state, clusters);
        &self.overlay
    }

    fn update_boxes(&mut self, state: &State, clusters: &Arc<Vec<ClusterBox>>) {
        let shown = state.view.clusters;
        let is_current = |(held, drawn): &(Arc<Vec<ClusterBox>>, ClusterOverlay)| {
            Arc::ptr_eq(held, clusters) && *drawn == shown
        };
        if !self.boxes_key.as_ref().is_some_and(is_current) {
            self.overlay.boxes = Arc::new(cluster_lines::boxes(clusters, &shown));
            self.boxes_key = Some((clusters.clone(), shown));
        }
    }

    fn update_segments(&mut self, state: &State, clusters: &Arc<Vec<ClusterBox>>) {
        let inspection = state.inspections.drawn(&state.view.links);
        let is_current = |key: &SegmentsKey| {
            Arc::ptr_eq(&key.clusters, clusters)
                && key.selected == state.cluster
                && key.inspection.as_ref().map(Arc::as_ptr) == inspection.map(Arc::as_ptr)
                && key.shown == state.view.links
        };
        if !self.segments_key.as_ref().is_some_and(is_current) {
            self.overlay.segments = Arc::new(segments(state, clusters, inspection));
            self.segments_key = Some(SegmentsKey {
                clusters: clusters.clone(),
                selected: state.cluster,
                inspection: inspection.cloned(),
                shown: state.view.links,
            });
        }
    }
}

/// Links, and over them the box and the face powers of the selected cluster.
fn segments(
    state: &State,
    clusters: &[ClusterBox],
    inspection: Option<&Arc<Inspection>>,
) -> Vec<SegmentInstance> {
    let mut lines = inspection.map_or_else(Vec::new, |inspection| {
        links::segments(inspection, &state.view.links)
    });
    if let Some(cluster) = state.cluster.and_then(|index| clusters.get(index)) {
        lines.extend(cluster_lines::outline(
            cluster.min,
            cluster.max,
            theme::SELECTED_LINE,
        ));
        lines.extend(cluster_lines::face_power_arrows(cluster));
    }
    lines
}
