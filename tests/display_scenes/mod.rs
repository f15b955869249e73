//! Display meshes made without a solver.

use vecrad::{scene::Scene, solver::DisplayMesh};

/// The scene's own triangles, each with vertices of its own.
pub(crate) fn own_triangles(scene: &Scene) -> DisplayMesh {
    let mut mesh = DisplayMesh::default();
    for id in scene.triangle_ids() {
        let first = mesh.positions.len() as u32;
        let surface = scene.surfaces[id.index()];
        for corner in scene.corners(id) {
            mesh.positions.push(corner);
            mesh.normals.push(surface.area_vector.normalize_or_zero());
            mesh.reflectance.push(surface.reflectance);
            mesh.emission.push(surface.emission);
        }
        mesh.indices.push([first, first + 1, first + 2]);
        mesh.triangle_of.push(id.0);
        mesh.is_back.push(false);
        mesh.element_of.push(id.0);
    }
    mesh
}
