//! Vertices on seams: of textures, and between what is lit and what lies inside a solid.
//!
//! All triangles about a vertex share its light, but not always its texture coordinates: at a seam of the picture, or
//! where it repeats, those on either side differ. Such a vertex has a copy for each further pair of coordinates; copies
//! follow all other vertices. Triangles inside solids have copies of their own, which are dark: the outline of what stands
//! on a floor goes through vertices that the lit floor has, too.

use std::collections::HashMap;

use glam::Vec2;

use crate::solver::DisplayMesh;

/// Texture coordinates that differ by less, in periods of the picture, are equal. Smaller, and rounding makes seams;
/// larger, and a picture is distorted by more than a pixel of 1024.
const SAME_PLACE: f32 = 1.0 / 1024.0;

/// The copies of the vertices of a display mesh.
#[derive(Default)]
pub(super) struct Seams {
    /// By vertex, and whether they are of triangles inside solids.
    copies: HashMap<(u32, bool), Vec<u32>>,
}

impl Seams {
    /// The vertex, or its copy, with these texture coordinates, if there are any; a new copy if there is none. A vertex whose
    /// coordinates are NaN takes them. Inside a solid it is always a copy.
    pub(super) fn vertex_with(
        &mut self,
        vertex: u32,
        uv: Option<Vec2>,
        is_covered: bool,
        mesh: &mut DisplayMesh,
    ) -> u32 {
        if let (Some(uv), false) = (uv, is_covered) {
            let present = &mut mesh.texcoords[vertex as usize];
            if present.is_nan() {
                *present = uv;
            }
        }
        let has_them = |vertex: u32| {
            uv.is_none_or(|uv| {
                let present = mesh.texcoords[vertex as usize];
                present == uv || present.abs_diff_eq(uv, SAME_PLACE)
            })
        };
        if !is_covered && has_them(vertex) {
            return vertex;
        }
        let others = self.copies.entry((vertex, is_covered)).or_default();
        if let Some(&other) = others.iter().find(|&&other| has_them(other)) {
            return other;
        }
        let other = mesh.positions.len() as u32;
        others.push(other);
        mesh.positions.push(mesh.positions[vertex as usize]);
        mesh.texcoords.extend(uv);
        mesh.repeated.push(vertex);
        if is_covered {
            mesh.covered.push(other);
        }
        other
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_vertex_has_one_copy_for_each_place_in_the_picture() {
        let mut mesh = DisplayMesh {
            positions: vec![Vec3::X, Vec3::Y],
            texcoords: vec![Vec2::NAN; 2],
            ..DisplayMesh::default()
        };
        let mut seams = Seams::default();
        let mut at =
            |vertex, u| seams.vertex_with(vertex, Some(Vec2::new(u, 0.5)), false, &mut mesh);
        assert_eq!((at(0, 0.0), at(1, 0.5)), (0, 1));
        // Rounding is no seam, a whole period is.
        assert_eq!((at(0, 1e-5), at(0, 1.0), at(0, 1.0)), (0, 2, 2));
        assert_eq!((at(0, 2.0), at(0, 1.0), at(1, 0.5)), (3, 2, 1));
        assert_eq!(mesh.repeated, [0, 0]);
        assert_eq!(mesh.positions, [Vec3::X, Vec3::Y, Vec3::X, Vec3::X]);
        assert_eq!([0, 1, 2, 3].map(|v| mesh.own_vertex(v)), [0, 1, 0, 0]);
        let mut light = vec![3.0, 4.0, 9.0, 9.0];
        mesh.repeat(&mut light);
        assert_eq!(light, [3.0, 4.0, 3.0, 3.0]);
    }

    #[test]
    fn triangles_inside_solids_have_vertices_of_their_own_without_light() {
        let mut mesh = DisplayMesh {
            positions: vec![Vec3::X, Vec3::Y],
            ..DisplayMesh::default()
        };
        let mut seams = Seams::default();
        let mut at = |vertex, is_covered| seams.vertex_with(vertex, None, is_covered, &mut mesh);
        assert_eq!((at(0, false), at(0, true), at(1, true)), (0, 2, 3));
        assert_eq!((at(1, false), at(0, true), at(1, true)), (1, 2, 3));
        (mesh.indices, mesh.normals) = (vec![[0, 1, 1], [2, 3, 3]], vec![Vec3::Z; 2]);
        assert_eq!(
            [0, 1].map(|triangle| mesh.is_covered(triangle)),
            [false, true]
        );
        let (mut light, mut normals) = (vec![3.0, 4.0], mesh.normals.clone());
        mesh.repeat_light(&mut light);
        mesh.repeat(&mut normals);
        assert_eq!(
            (light, normals),
            (vec![3.0, 4.0, 0.0, 0.0], vec![Vec3::Z; 4])
        );
    }
}
