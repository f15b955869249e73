//! Where nothing casts a shadow: over which elements the light of sampled emitters is as good as linear, how much light
//! varies over others, and what is known of closures.
//!
//! Elements are divided where their corners do not tell what lies between. Shadows could hide from all of them, and so
//! large elements are divided whatever they see; without shadows it is enough to look closely at the light itself.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    Solver,
    coverage::{Closure, Closures},
    direct::{Lights, Limits, SPREAD_SHARE},
    places::{INSET, Receiver, share_root},
};
use crate::{hierarchy::Hierarchy, transport::luminance};

/// Places on a triangle, barycentric: the middles of its sides and those of its quarters.
const PLACES: [Vec3; 7] = [
    Vec3::new(0.5, 0.5, 0.0),
    Vec3::new(0.0, 0.5, 0.5),
    Vec3::new(0.5, 0.0, 0.5),
    Vec3::new(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0),
    Vec3::new(2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0),
    Vec3::new(1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0),
    Vec3::new(1.0 / 6.0, 1.0 / 6.0, 2.0 / 3.0),
];

impl Lights {
    /// Whether the unoccluded light bends over an element: it is not linear between what its corners tell, or some
    /// emitters are not sampled, so that it is not known.
    pub(super) fn bend_over(&self, hierarchy: &Hierarchy, element: usize, limits: Limits) -> bool {
        if !self.are_all(hierarchy) {
            return true;
        }
        let mut sums = Vec::new();
        let patch = hierarchy.patch_of(element);
        let centroid = hierarchy.mesh.elements[element].centroid;
        let [a, b, c] = hierarchy.mesh.corners(element);
        let mut light = |at: Vec3| {
            let point = (a * at.x + b * at.y + c * at.z).lerp(centroid, INSET);
            let receiver = Receiver {
                point,
                normal: patch.normal,
                triangle: patch.triangle,
            };
            luminance(self.unoccluded(&receiver, None, &mut sums))
        };
        let corners = Vec3::from_array(Vec3::AXES.map(&mut light));
        let bend = PLACES
            .map(|place| (light(place) - corners.dot(place)).abs())
            .into_iter()
            .fold(0.0, f32::max);
        let spread = corners.max_element() - corners.min_element();
        let mean = self.mean_power(hierarchy).max(f32::MIN_POSITIVE);
        (bend + SPREAD_SHARE * spread) * share_root(hierarchy, element) / mean > limits.tolerance
    }
}

impl Solver {
    /// Closures that need no rays: 1 on closed surfaces, and none where all form factors are exact. Elsewhere they must be
    /// probed: where walls are white, a leak that is seen by one ray in a thousand decides.
    pub(super) fn closures_in_clear(&self) -> Option<Closures> {
        if !self.plan.is_clear {
            return None;
        }
        let closure = match (self.plan.is_closed, self.plan.is_by_patch) {
            (true, _) => Closure::CLOSED,
            (false, true) => Closure::UNKNOWN,
            (false, false) => return None,
        };
        Some(Closures::even(&self.hierarchy, closure))
    }

    /// By how much the radiosity of each leaf varies over it (half the range of its corners, luminance), as direct light is
    /// now and linked light was when it was last gathered, and by its textures. Of leaves divided since, the parts vary by
    /// half.
    pub(super) fn radiosity_spreads(&self) -> Vec<f32> {
        let range = |corners: [f32; 3]| {
            let [least, most] =
                [f32::min, f32::max].map(|of| corners.into_iter().fold(corners[0], of));
            most - least
        };
        let hierarchy = &self.hierarchy;
        let elements = &hierarchy.mesh.elements;
        let mut linked = vec![0.0; elements.len()];
        for light in &self.leaves {
            linked[light.element as usize] = range(light.corners.map(luminance));
        }
        for index in 0..elements.len() {
            for child in elements[index].children() {
                linked[child] = f32::max(linked[child], linked[index] * 0.5);
            }
        }
        let spread = |index: usize| {
            let direct = self.direct.as_ref().map_or(0.0, |field| {
                range(
                    elements[index]
                        .vertices
                        .map(|vertex| luminance(field.corner(vertex))),
                )
            });
            let reflectance = luminance(hierarchy.reflectance_of(index).extend(0.0));
            0.5 * reflectance * (linked[index] + direct) + self.texture_spread(index)
        };
        let all = (0..elements.len()).into_par_iter();
        all.map(|index| {
            if elements[index].is_leaf() {
                spread(index)
            } else {
                0.0
            }
        })
        .collect()
    }
}
