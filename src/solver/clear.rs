//! Where nothing casts a shadow: how much light varies over elements, and what is known of closures.

use rayon::prelude::*;

use super::{
    Solver,
    coverage::{Closure, Closures},
};
use crate::transport::luminance;

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
