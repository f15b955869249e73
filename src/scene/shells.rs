//! Shells: sets of triangles connected by shared edges.
//!
//! A shell is closed and consistently wound when every directed edge meets its opposite exactly once.

use glam::{DVec3, Vec3};

use super::coplanar::{COPLANAR, reach};
use super::{DisjointSets, Triangle, half_edges};

/// The shells of a scene.
#[derive(Clone, Debug)]
pub(super) struct Shells {
    /// Shell of each triangle.
    pub(super) of_triangle: Vec<u32>,
    /// By shell: whether it is closed and consistently wound.
    pub(super) closed: Vec<bool>,
    /// By shell: six times the volume that it encloses, negative where it looks inward; 0 where it is open or flat.
    pub(super) volume: Vec<f64>,
}

/// Triangles with the shells they form.
pub(super) struct ShelledTriangles {
    /// In the order of the faces.
    pub(super) list: Vec<Triangle>,
    /// Of these.
    pub(super) shells: Shells,
}

impl Shells {
    /// Find the shells.
    pub(super) fn of(triangles: &[Triangle], positions: &[Vec3]) -> Self {
        let edges = half_edges(triangles.iter().map(|triangle| triangle.corners));
        // Connect triangles over shared edges.
        let mut forest = DisjointSets::new(triangles.len());
        let mut open = Vec::new();
        for group in edges.chunk_by(|a, b| a.ends == b.ends) {
            for pair in group.windows(2) {
                forest.join(pair[0].triangle, pair[1].triangle);
            }
            if group.len() != 2 || group[0].is_forward == group[1].is_forward {
                open.push(group[0].triangle);
            }
        }
        // Number the shells in the order of their first triangles.
        let mut number = vec![u32::MAX; triangles.len()];
        let mut count = 0;
        let mut of_triangle = Vec::with_capacity(triangles.len());
        for triangle in 0..triangles.len() as u32 {
            let root = forest.root(triangle) as usize;
            if number[root] == u32::MAX {
                number[root] = count;
                count += 1;
            }
            of_triangle.push(number[root]);
        }
        let mut closed = vec![true; count as usize];
        for triangle in open {
            closed[of_triangle[triangle as usize] as usize] = false;
        }
        let volume = volumes(triangles, positions, &of_triangle, &closed);
        Self {
            of_triangle,
            closed,
            volume,
        }
    }
}

/// See [`Shells::volume`].
fn volumes(
    triangles: &[Triangle],
    positions: &[Vec3],
    of_triangle: &[u32],
    closed: &[bool],
) -> Vec<f64> {
    /// Sums over a shell.
    #[derive(Clone, Copy, Default)]
    struct Sums {
        /// A corner; what is far from the origin keeps its digits when it is measured from there.
        origin: Option<DVec3>,
        volume: f64,
        double_area: f64,
    }
    let mut sums = vec![Sums::default(); closed.len()];
    for (triangle, &shell) in triangles.iter().zip(of_triangle) {
        if !closed[shell as usize] {
            continue;
        }
        let sums = &mut sums[shell as usize];
        let corners = triangle
            .corners
            .map(|corner| positions[corner as usize].as_dvec3());
        let origin = *sums.origin.get_or_insert(corners[0]);
        let [a, b, c] = corners.map(|corner| corner - origin);
        sums.volume += a.dot(b.cross(c));
        sums.double_area += (b - a).cross(c - a).length();
    }
    let volume = |sums: &Sums| {
        // Of a plate, the quotient is three halves of its thickness.
        let thickness = COPLANAR * reach(sums.origin.unwrap_or_default());
        let is_flat = sums.volume.abs() <= sums.double_area * thickness;
        if is_flat { 0.0 } else { sums.volume }
    };
    sums.iter().map(volume).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::scene::MaterialId;

    fn triangles(corners: &[[u32; 3]]) -> Vec<Triangle> {
        let make = |&corners: &[u32; 3]| Triangle {
            corners,
            material: MaterialId(0),
            two_sided: false,
            bounds_solid: false,
        };
        corners.iter().map(make).collect()
    }

    pub(in crate::scene) const TETRAHEDRON: [[u32; 3]; 4] =
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    /// Sides of a box that looks outward; bits 0, 1 and 2 of the number of a corner tell whether it is the upper one along x,
    /// y and z. The second is the top.
    pub(in crate::scene) const CUBOID: [[usize; 4]; 6] = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];

    const POSITIONS: [Vec3; 7] = [
        Vec3::ZERO,
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        Vec3::NEG_X,
        Vec3::NEG_Y,
        Vec3::NEG_Z,
    ];

    pub(in crate::scene) fn shells(corners: &[[u32; 3]]) -> Shells {
        Shells::of(&triangles(corners), &POSITIONS)
    }

    #[test]
    fn volumes_tell_which_way_shells_look_and_flat_ones_have_none() {
        assert_eq!(shells(&TETRAHEDRON).volume, [1.0]);
        let inward = TETRAHEDRON.map(|[a, b, c]| [a, c, b]);
        assert_eq!(shells(&inward).volume, [-1.0]);
        assert_eq!(shells(&TETRAHEDRON[1..]).volume, [0.0]);
        let plate = shells(&[[1, 2, 3], [1, 3, 2]]);
        assert_eq!((plate.closed, plate.volume), (vec![true], vec![0.0]));
    }
}
