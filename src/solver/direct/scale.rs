//! The light to which errors are relative at each place: that of the scene, or less where all that is seen from there is
//! darker.
//!
//! A picture of a dark room is exposed for that room, however bright the sun shines on the walls outside.

use crate::hierarchy::Hierarchy;

/// Least light to which errors are relative, as a share of the mean. Smaller costs elements and rays in rooms that are
/// nearly black (36 of them behind slots of half a square metre: at 1/30 22 times the processor time of 1, at 1/10 7
/// times); larger leaves shadows in rooms that a window lights as coarse as if nobody looked into them (behind one of a
/// square metre: an error of 8 % at 1, 4 % at 1/5, 3 % at 1/10 and 2 % at 1/30).
const LEAST: f32 = 0.1;

/// How bright the surroundings of each element are.
#[derive(Default)]
pub(crate) struct Surroundings {
    /// By element, relative to the mean of the scene, [`LEAST`]…1; newer elements have that of the element that was
    /// divided, and before it is known all have 1.
    relative: Vec<f32>,
}

impl Surroundings {
    /// From the mean irradiance of what is seen from each element, relative to that of the scene.
    pub(crate) fn new(seen: Vec<f32>) -> Self {
        let relative = seen.into_iter().map(|seen| seen.clamp(LEAST, 1.0));
        Self {
            relative: relative.collect(),
        }
    }

    /// Of an element.
    fn of(&self, hierarchy: &Hierarchy, mut element: usize) -> f32 {
        if self.relative.is_empty() {
            return 1.0;
        }
        while element >= self.relative.len() {
            element = hierarchy.mesh.elements[element].parent as usize;
        }
        self.relative[element]
    }

    /// Memory in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(self.relative.as_slice())
    }
}

/// The light (luminance) to which errors are relative.
#[derive(Clone, Copy)]
pub(super) struct Scale<'a> {
    pub mean: f32,
    pub surroundings: &'a Surroundings,
}

impl Scale<'_> {
    /// At an element.
    pub(super) fn at(self, hierarchy: &Hierarchy, element: usize) -> f32 {
        self.mean * self.surroundings.of(hierarchy, element)
    }

    /// At each vertex.
    pub(super) fn at_vertices(self, hierarchy: &Hierarchy) -> Vec<f32> {
        let mesh = &hierarchy.mesh;
        if self.surroundings.relative.is_empty() {
            return vec![self.mean; mesh.vertices.len()];
        }
        let area = |leaf: usize| mesh.elements[leaf].area_vector.length();
        let areas = mesh.areas_about_vertices();
        let sums = mesh.sums_about_vertices(|leaf| area(leaf) * self.at(hierarchy, leaf));
        let means = sums.into_iter().zip(areas);
        means
            .map(|(sum, area)| sum / area.max(f32::MIN_POSITIVE))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, builtin};

    #[test]
    fn dark_surroundings_count_down_to_a_limit_and_new_elements_inherit_theirs() {
        let scene = builtin::plates(1.0)
            .finish(&SceneOptions::default())
            .unwrap();
        let mut hierarchy = Hierarchy::new(&scene, 30.0);
        let count = hierarchy.mesh.elements.len();
        let unknown = Surroundings::default();
        assert_eq!(unknown.of(&hierarchy, count - 1), 1.0);
        let mut seen = vec![2.0; count];
        (seen[0], seen[1]) = (0.5, 0.0);
        let surroundings = Surroundings::new(seen);
        assert!(hierarchy.mesh.divide(&[0]));
        let scale = Scale {
            mean: 4.0,
            surroundings: &surroundings,
        };
        assert_eq!(scale.at(&hierarchy, 1), 4.0 * LEAST);
        assert_eq!(scale.at(&hierarchy, 2), 4.0);
        let child = (count..hierarchy.mesh.elements.len())
            .find(|&element| hierarchy.mesh.elements[element].parent == 0)
            .unwrap();
        assert_eq!(scale.at(&hierarchy, child), 2.0);
        let within = |light: &f32| (4.0 * LEAST..=4.0).contains(light);
        assert!(scale.at_vertices(&hierarchy).iter().all(within));
    }
}
