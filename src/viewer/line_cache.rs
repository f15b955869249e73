//! Links and the selected cluster as lines over the light, made again only when what they show changes.

use std::sync::Arc;

use super::{
    cluster_lines, links, render::SegmentInstance, state::State, theme, view::LinkOverlay,
};
use crate::solver::{ClusterBox, Inspection};

/// The lines of the last frame, and what they were made from. Arcs are stored, so that no address is reused.
#[derive(Default)]
pub(super) struct LineCache {
    segments: Arc<Vec<SegmentInstance>>,
    key: Option<SegmentsKey>,
}

struct SegmentsKey {
    /// A copy: to hold the tree would keep a large one longer than it is shown.
    selected: Option<ClusterBox>,
    inspection: Option<Arc<Inspection>>,
    shown: LinkOverlay,
}

impl LineCache {
    /// The lines of a state with this tree, with or without what marks the selected cluster.
    pub(super) fn segments(
        &mut self,
        state: &State,
        clusters: &[ClusterBox],
        marks_selection: bool,
    ) -> &Arc<Vec<SegmentInstance>> {
        let selected = state.cluster.filter(|_| marks_selection);
        let selected = selected.and_then(|index| clusters.get(index));
        let inspection = state.inspections.drawn(&state.view.links);
        let is_current = |key: &SegmentsKey| {
            key.selected.as_ref() == selected
                && key.inspection.as_ref().map(Arc::as_ptr) == inspection.map(Arc::as_ptr)
                && key.shown == state.view.links
        };
        if !self.key.as_ref().is_some_and(is_current) {
            self.segments = Arc::new(segments(state, selected, inspection));
            self.key = Some(SegmentsKey {
                selected: selected.copied(),
                inspection: inspection.cloned(),
                shown: state.view.links,
            });
        }
        &self.segments
    }
}

/// Links, and over them the box and the face powers of the selected cluster.
fn segments(
    state: &State,
    selected: Option<&ClusterBox>,
    inspection: Option<&Arc<Inspection>>,
) -> Vec<SegmentInstance> {
    let mut lines = inspection.map_or_else(Vec::new, |inspection| {
        links::segments(inspection, &state.view.links)
    });
    if let Some(cluster) = selected {
        lines.extend(cluster_lines::outline(
            cluster.min,
            cluster.max,
            theme::SELECTED_LINE,
        ));
        lines.extend(cluster_lines::face_power_arrows(cluster));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::{super::clusters::tests::tree, *};

    #[test]
    fn a_selection_is_marked_only_where_that_is_asked_for() {
        let state = State {
            cluster: Some(0),
            ..State::default()
        };
        let (clusters, mut lines) = (tree(), LineCache::default());
        let marked = lines.segments(&state, &clusters, true).clone();
        // The edges of a box, and two arrows.
        assert_eq!(marked.len(), 12 + 2);
        assert!(lines.segments(&state, &clusters, false).is_empty());
        assert_eq!(*lines.segments(&state, &clusters, true), marked);
    }
}
