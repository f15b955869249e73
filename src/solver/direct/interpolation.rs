//! Interpolation error of the unoccluded light of sampled emitters.
//!
//! All corners of an element may miss a shadow, and so large elements are divided whatever light they get. Without
//! shadows it is enough to evaluate the unoccluded light at several places.

use glam::Vec3;

use super::{border::SPREAD_SHARE, lights::Lights};
use crate::{
    hierarchy::{Hierarchy, luminance},
    solver::{
        limits::Limits,
        places::{INSET, Receiver, share_root},
    },
};

/// Places on a triangle, barycentric: the midpoints of its sides and the centroids of its quarters.
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
    /// Whether linear interpolation of the unoccluded light between the corners of an element errs by more than the
    /// tolerance.
    pub(super) fn has_interpolation_error(
        &self,
        hierarchy: &Hierarchy,
        element: usize,
        limits: Limits,
    ) -> bool {
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
        let error = PLACES
            .map(|place| (light(place) - corners.dot(place)).abs())
            .into_iter()
            .fold(0.0, f32::max);
        let spread = corners.max_element() - corners.min_element();
        let mean = self.mean_power(hierarchy).max(f32::MIN_POSITIVE);
        (error + SPREAD_SHARE * spread) * share_root(hierarchy, element) / mean > limits.tolerance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scene::{builtin::plates, test_shapes::one_sided},
        solver::{Direct, SolveSettings},
    };

    #[test]
    fn near_lamps_have_an_interpolation_error_and_far_ones_have_none() {
        for (distance, expected) in [(0.2, true), (1.0, true), (100.0, false)] {
            let scene = one_sided(plates(distance));
            let hierarchy = Hierarchy::new(&scene, 30.0);
            let limits = Limits::new(&SolveSettings::normal(), &hierarchy, 1.0, u64::MAX);
            let lights = Lights::of_emitters(&scene, &hierarchy, Direct::Sampled).unwrap();
            let is_receiver = |patch: &usize| hierarchy.patches[*patch].emission == Vec3::ZERO;
            for patch in (0..hierarchy.patches.len()).filter(is_receiver) {
                let found = lights.has_interpolation_error(&hierarchy, patch, limits);
                assert_eq!(found, expected, "{distance}");
            }
            assert!(Lights::of_emitters(&scene, &hierarchy, Direct::Linked).is_none());
        }
    }
}
