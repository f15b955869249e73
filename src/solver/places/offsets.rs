//! Offset places of vertices behind a wall: further inside their elements, before the wall.

use std::{collections::HashMap, ops::Range};

use glam::Vec3;

use super::receivers::{Receiver, inset, vertex_places};
use crate::hierarchy::{Element, Hierarchy};

/// Places at which light of vertices behind a wall is evaluated.
#[derive(Default)]
pub(crate) struct OffsetPlaces {
    pub(crate) by_vertex: HashMap<u32, OffsetPlace>,
    /// By vertex, the element in which an offset place was last sought, or `u32::MAX`.
    pub(crate) probed_at: Vec<u32>,
}

/// The place at which light of one vertex is evaluated.
#[derive(Clone, Copy)]
pub(crate) struct OffsetPlace {
    pub(crate) place: Vec3,
    /// Share of the way to the centroid.
    pub(crate) inset: f32,
}

impl OffsetPlaces {
    /// The places at which light of the corners of a leaf is evaluated; `corners` are their positions.
    pub(crate) fn places(&self, element: &Element, corners: [Vec3; 3]) -> [Vec3; 3] {
        let usual = inset(element, corners);
        [0, 1, 2].map(|side| {
            let offset = self.by_vertex.get(&element.vertices[side]);
            let inset = offset.map_or(usual, |offset| offset.inset);
            corners[side].lerp(element.centroid, inset)
        })
    }

    /// As [`vertex_places`], with the offset places of vertices behind walls.
    pub(crate) fn vertex_places(
        &self,
        hierarchy: &Hierarchy,
        elements: Range<usize>,
        is_wanted: &[bool],
    ) -> Vec<(u32, Receiver)> {
        let mut places = vertex_places(hierarchy, elements, is_wanted);
        for (vertex, receiver) in &mut places {
            if let Some(offset) = self.by_vertex.get(vertex) {
                receiver.point = offset.place;
            }
        }
        places
    }

    /// Approximate memory in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(self.probed_at.as_slice())
            + self.by_vertex.len() * size_of::<(u32, OffsetPlace)>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{builtin::furnace, test_shapes::one_sided};

    #[test]
    fn light_of_an_offset_vertex_is_evaluated_at_its_place_and_of_others_near_them() {
        let hierarchy = Hierarchy::new(&one_sided(furnace(0.5, 1.0, 1)), 30.0);
        let (mesh, element) = (&hierarchy.mesh, &hierarchy.mesh.elements[0]);
        let corners = mesh.corners(0);
        let (vertex, share) = (element.vertices[1], 0.35);
        let place = corners[1].lerp(element.centroid, share);
        let mut offsets = OffsetPlaces::default();
        let usual = offsets.places(element, corners);
        offsets.by_vertex.insert(
            vertex,
            OffsetPlace {
                place,
                inset: share,
            },
        );
        let found = offsets.places(element, corners);
        assert_eq!((found[0], found[2]), (usual[0], usual[2]));
        assert_eq!(found[1], place);
        assert!(usual[1].distance(corners[1]) < 0.1 * place.distance(corners[1]));
        // As a receiver.
        let all = vec![true; mesh.vertices.len()];
        let elements = 0..mesh.elements.len();
        for (of, receiver) in offsets.vertex_places(&hierarchy, elements, &all) {
            assert_eq!(receiver.point == place, of == vertex);
        }
    }
}
