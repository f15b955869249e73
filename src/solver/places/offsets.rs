//! Places of vertices that lie behind a wall: further within their elements, before it.

use std::{collections::HashMap, ops::Range};

use glam::Vec3;

use super::receivers::{Receiver, inset, vertex_places};
use crate::hierarchy::{Element, Hierarchy};

/// Where light is evaluated for vertices that lie behind a wall.
#[derive(Default)]
pub(crate) struct OffsetPlaces {
    pub(crate) by_vertex: HashMap<u32, OffsetPlace>,
    /// The element at which a vertex was looked at last, or `u32::MAX`.
    pub(crate) probed_at: Vec<u32>,
}

/// Where light is evaluated for one of them.
#[derive(Clone, Copy)]
pub(crate) struct OffsetPlace {
    pub(crate) place: Vec3,
    /// Share of the way to the centroid.
    pub(crate) inset: f32,
}

impl OffsetPlaces {
    /// Where light of the corners of a leaf is evaluated; `corners` are where they are.
    pub(crate) fn places(&self, element: &Element, corners: [Vec3; 3]) -> [Vec3; 3] {
        let usual = inset(element, corners);
        [0, 1, 2].map(|side| {
            let moved = self.by_vertex.get(&element.vertices[side]);
            let inset = moved.map_or(usual, |moved| moved.inset);
            corners[side].lerp(element.centroid, inset)
        })
    }

    /// As [`vertex_places`], but for vertices behind walls before these.
    pub(crate) fn vertex_places(
        &self,
        hierarchy: &Hierarchy,
        elements: Range<usize>,
        is_wanted: &[bool],
    ) -> Vec<(u32, Receiver)> {
        let mut places = vertex_places(hierarchy, elements, is_wanted);
        for (vertex, receiver) in &mut places {
            if let Some(moved) = self.by_vertex.get(vertex) {
                receiver.point = moved.place;
            }
        }
        places
    }

    /// Bytes held, about.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.probed_at.as_slice())
            + self.by_vertex.len() * size_of::<(u32, OffsetPlace)>()
    }
}
