//! Direct light for the first picture.

use glam::Vec3;

use super::{field::DirectField, fields::DirectFields, samples::DirectLight};
use crate::{
    geometry::RayTree,
    hierarchy::Hierarchy,
    solver::{Cancel, places::Receiver},
};

/// Approximate limit of the vertices that are sampled for the first picture. On a larger mesh others borrow the light of a
/// near one; the first step samples all. Fewer make the first picture of large meshes rougher; more delay it.
const FIRST_VERTICES: usize = 1 << 14;

impl DirectFields {
    /// Sample the corners of leaves for the first picture; those of large meshes borrow from each other. Returns the rays
    /// shot; `None` when cancelled.
    pub(crate) fn sample_vertices_first(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        samples: u32,
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        let (elements, vertices) = (
            0..hierarchy.mesh.elements.len(),
            hierarchy.mesh.vertices.len(),
        );
        let is_large = vertices > FIRST_VERTICES && !self.is_empty();
        let groups = is_large.then(|| {
            let all = vec![true; vertices];
            let receivers = self.offsets().vertex_places(hierarchy, elements, &all);
            groups_of_near(receivers, FIRST_VERTICES)
        });
        let mut shot = 0;
        for field in self.all_mut() {
            shot += match &groups {
                Some(groups) => {
                    field.sample_groups(rays, hierarchy, groups, samples, seed, cancel)?
                }
                None => field.sample_vertices(rays, hierarchy, samples, seed, cancel)?,
            };
        }
        Some(shot)
    }
}

impl DirectField {
    /// Sample one vertex of each of these groups for the first picture; the others borrow its light. Returns the rays shot;
    /// `None` when cancelled.
    fn sample_groups(
        &mut self,
        rays: &RayTree,
        hierarchy: &Hierarchy,
        groups: &[Vec<(u32, Receiver)>],
        samples: u32,
        seed: u64,
        cancel: &Cancel,
    ) -> Option<u64> {
        let count = hierarchy.mesh.vertices.len();
        self.vertices.resize(count, Some(DirectLight::default()));
        let firsts = groups.iter().filter_map(|group| group.first());
        let sampled: Vec<(u32, Receiver)> = firsts.copied().collect();
        let explored = self.probe(rays, hierarchy, &sampled, samples, seed, cancel)?;
        for group in groups {
            let mut vertices = group.iter().map(|&(vertex, _)| vertex as usize);
            let first = vertices.next().and_then(|first| self.vertices[first]);
            for other in vertices {
                self.vertices[other] = first.map(DirectLight::borrowed);
            }
        }
        Some(explored + self.shot(&sampled))
    }
}

/// Receivers in at most about `most` groups of near ones that face alike.
fn groups_of_near(mut receivers: Vec<(u32, Receiver)>, most: usize) -> Vec<Vec<(u32, Receiver)>> {
    let mut size = 2 * receivers.len().div_ceil(most);
    loop {
        let mut groups = Vec::new();
        add_groups(&mut receivers, size, &mut groups);
        if groups.len() <= most || size >= receivers.len() {
            return groups;
        }
        size *= 2;
    }
}

/// Halve receivers along the longest axis of their box until `size` are left, and group these by the signs of their
/// normals.
fn add_groups(
    receivers: &mut [(u32, Receiver)],
    size: usize,
    groups: &mut Vec<Vec<(u32, Receiver)>>,
) {
    if receivers.len() > size {
        let bound = |of: fn(Vec3, Vec3) -> Vec3| {
            let points = receivers.iter().map(|(_, receiver)| receiver.point);
            points.reduce(of).unwrap_or(Vec3::ZERO)
        };
        let axis = (bound(Vec3::max) - bound(Vec3::min)).max_position();
        let middle = receivers.len() / 2;
        receivers.select_nth_unstable_by(middle, |(a, one), (b, other)| {
            let order = one.point[axis].total_cmp(&other.point[axis]);
            order.then(a.cmp(b))
        });
        let (below, above) = receivers.split_at_mut(middle);
        add_groups(below, size, groups);
        add_groups(above, size, groups);
        return;
    }
    let facing = |receiver: &Receiver| receiver.normal.cmpge(Vec3::ZERO).bitmask();
    receivers.sort_unstable_by_key(|(vertex, receiver)| (facing(receiver), *vertex));
    let alike = receivers.chunk_by(|(_, a), (_, b)| facing(a) == facing(b));
    groups.extend(alike.map(<[(u32, Receiver)]>::to_vec));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{geometry::Random, scene::TriangleId};

    #[test]
    fn groups_hold_each_receiver_once_and_only_near_ones_that_face_alike() {
        let mut random = Random::new(3, 0);
        // A small object, and a ground that is a thousand times as large.
        let receivers: Vec<(u32, Receiver)> = (0..20_000)
            .map(|index| {
                let [x, y, z] = [(); 3].map(|()| random.uniform() - 0.5);
                let (point, normal) = match index % 2 {
                    0 => (Vec3::new(x, y, z) * 1e-3, Vec3::new(z, x, y)),
                    _ => (Vec3::new(x, 0.0, z), Vec3::Y),
                };
                let receiver = Receiver {
                    point,
                    normal: normal.normalize_or(Vec3::Y),
                    triangle: TriangleId(0),
                };
                (index, receiver)
            })
            .collect();
        let groups = groups_of_near(receivers.clone(), 2000);
        assert!((500..=2000).contains(&groups.len()), "{}", groups.len());
        let mut seen = vec![0; receivers.len()];
        let mut distances = 0.0;
        for group in &groups {
            let (head, first) = group[0];
            for &(index, other) in group {
                seen[index as usize] += 1;
                assert!(first.normal.dot(other.normal) > -1e-3);
                let distance = first.point.distance(other.point);
                distances += distance;
                let are_small = index % 2 == 0 && head % 2 == 0;
                assert!(!are_small || distance < 1e-3, "{distance}");
            }
        }
        // Groups around the object are long, others are not.
        let mean = distances / receivers.len() as f32;
        assert!(mean < 0.05, "{mean}");
        assert!(seen.into_iter().all(|count| count == 1));
    }
}
