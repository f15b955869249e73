//! Error at the vertices of a display mesh, against paths traced from each of them.
//!
//! Random surface points give the figures; they are too few to draw. So every vertex gets paths of its own, pass by
//! pass, and shows `√max(0, d² − s²)` with d the difference of radiance and s the standard error of its mean: noise of
//! the reference neither hides an error nor makes one up, on average. Spreading the errors of the random points over
//! the surface would cost nothing, but blur just what the view is for: shadow borders, contacts and seams.

use std::{collections::HashMap, f64::consts::FRAC_1_PI, sync::Arc};

use glam::{DVec3, Vec3};

use crate::{
    geometry::RayTree,
    reference::{BakePoint, bake},
    scene::{Scene, TriangleId, luminance},
    solver::{DisplayMesh, VertexLight},
};

/// Vertices traced between two checks for other tasks. Fewer leave threads idle at the end of a piece, more
/// keep a new snapshot waiting.
const PIECE: usize = 4096;

/// Sums of one vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    /// Irradiance, summed over passes.
    irradiance: DVec3,
    /// Squared luminance of the reflected radiance, summed over passes.
    radiance_squared: f64,
    /// Passes.
    count: u32,
}

/// A vertex by its position, normal and reflectance, which outlive the mesh.
type Place = [[u32; 3]; 3];

/// Path-traced light at the vertices of one mesh.
pub struct VertexReference {
    mesh: Arc<DisplayMesh>,
    points: Vec<BakePoint>,
    sums: Vec<Sums>,
    /// Passes that all vertices have seen.
    passes: u32,
    /// Next vertex of the pass under way.
    cursor: usize,
    /// Seed of the next piece.
    seed: u64,
}

impl VertexReference {
    /// Samples a vertex and pass: one evenly spread group, the least that yields a variance.
    pub const SAMPLES_PER_PASS: u32 = 8;

    /// Nothing known yet about the vertices of a mesh.
    pub fn new(mesh: &Arc<DisplayMesh>, seed: u64) -> Self {
        let points = bake_points(mesh);
        Self {
            mesh: mesh.clone(),
            sums: vec![Sums::default(); points.len()],
            points,
            passes: 0,
            cursor: 0,
            seed,
        }
    }

    /// The same for a mesh with more or other vertices; what is known of those in the same places is kept.
    pub fn on_mesh(&self, mesh: &Arc<DisplayMesh>) -> Self {
        let known: HashMap<Place, Sums> = (0..self.points.len())
            .map(|vertex| (place(&self.mesh, vertex), self.sums[vertex]))
            .collect();
        let mut moved = Self::new(mesh, self.seed);
        for (vertex, sums) in moved.sums.iter_mut().enumerate() {
            if let Some(earlier) = known.get(&place(mesh, vertex)) {
                *sums = *earlier;
            }
        }
        moved
    }

    /// The mesh.
    pub fn mesh(&self) -> &Arc<DisplayMesh> {
        &self.mesh
    }

    /// Samples that every vertex has seen at least.
    pub fn samples(&self) -> u32 {
        self.passes * Self::SAMPLES_PER_PASS
    }

    /// Share of the pass under way that is done, 0 to 1.
    pub fn pass_share(&self) -> f32 {
        self.cursor as f32 / self.points.len().max(1) as f32
    }

    /// Trace a piece of the pass under way. `None` when cancelled, and nothing changes; else whether it ended the pass.
    pub fn advance(
        &mut self,
        scene: &Scene,
        rays: &RayTree,
        cancel: &(dyn Fn() -> bool + Sync),
    ) -> Option<bool> {
        // Vertices taken over from another mesh may be ahead.
        let piece: Vec<usize> = (self.cursor..self.points.len())
            .filter(|&vertex| self.sums[vertex].count <= self.passes)
            .take(PIECE)
            .collect();
        let points: Vec<BakePoint> = piece.iter().map(|&vertex| self.points[vertex]).collect();
        let traced = bake(
            scene,
            rays,
            &points,
            Self::SAMPLES_PER_PASS,
            self.seed,
            cancel,
        )?;
        self.seed = self.seed.wrapping_add(1);
        for (&vertex, irradiance) in piece.iter().zip(traced) {
            let sums = &mut self.sums[vertex];
            let radiance = reflected(self.mesh.reflectance[vertex], irradiance.as_dvec3());
            sums.irradiance += irradiance.as_dvec3();
            sums.radiance_squared += radiance * radiance;
            sums.count += 1;
        }
        self.cursor = piece.last().map_or(self.points.len(), |last| last + 1);
        let is_whole = piece.len() < PIECE || self.cursor == self.points.len();
        if is_whole {
            self.passes += 1;
            self.cursor = 0;
        }
        Some(is_whole)
    }

    /// Luminance by which the radiance of each vertex errs under this light, without the reference's noise, in units
    /// of `unit` W·sr⁻¹·m⁻². `None` before two passes, which yield no noise, and for light of another
    /// mesh.
    pub fn errors(&self, light: &VertexLight, unit: f64) -> Option<Vec<f32>> {
        if self.passes < 2 || light.irradiance.len() != self.points.len() {
            return None;
        }
        let error = |vertex: usize| {
            let sums = self.sums[vertex];
            let count = f64::from(sums.count);
            let reflectance = self.mesh.reflectance[vertex];
            let mean = reflected(reflectance, sums.irradiance / count);
            let variance = (sums.radiance_squared / count - mean * mean).max(0.0) / (count - 1.0);
            let measured = reflected(reflectance, light.irradiance[vertex].as_dvec3());
            let error = ((measured - mean).powi(2) - variance).max(0.0).sqrt();
            (error / unit.max(f64::MIN_POSITIVE)).min(f64::from(f32::MAX)) as f32
        };
        Some((0..self.points.len()).map(error).collect())
    }
}

/// Luminance of the radiance that a surface reflects.
fn reflected(reflectance: Vec3, irradiance: DVec3) -> f64 {
    f64::from(luminance(reflectance * irradiance.as_vec3())) * FRAC_1_PI
}

fn place(mesh: &DisplayMesh, vertex: usize) -> Place {
    [&mesh.positions, &mesh.normals, &mesh.reflectance]
        .map(|values| values[vertex].to_array().map(f32::to_bits))
}

/// Each vertex with the first triangle that it is a corner of.
fn bake_points(mesh: &DisplayMesh) -> Vec<BakePoint> {
    let mut triangle_of = vec![0; mesh.positions.len()];
    for (index, corners) in mesh.indices.iter().enumerate().rev() {
        for &corner in corners {
            triangle_of[corner as usize] = mesh.triangle_of[index];
        }
    }
    mesh.positions
        .iter()
        .zip(&mesh.normals)
        .zip(triangle_of)
        .map(|((&position, &normal), triangle)| BakePoint {
            position,
            normal,
            triangle: TriangleId(triangle),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, builtin};

    const NEVER: &(dyn Fn() -> bool + Sync) = &|| false;

    /// The triangles of the plates as they are.
    fn plates() -> (Scene, RayTree, Arc<DisplayMesh>) {
        let scene = builtin::find_builtin("plates")
            .expect("built in")
            .scene(&SceneOptions::default())
            .expect("valid");
        let rays = RayTree::new(&scene);
        let mut mesh = DisplayMesh::default();
        for id in scene.triangle_ids() {
            let first = mesh.positions.len() as u32;
            let surface = scene.surfaces[id.index()];
            for corner in scene.corners(id) {
                mesh.positions.push(corner);
                mesh.normals.push(surface.area_vector.normalize_or_zero());
                mesh.reflectance.push(Vec3::splat(0.5));
                mesh.emission.push(surface.emission);
            }
            mesh.indices.push([first, first + 1, first + 2]);
            mesh.triangle_of.push(id.0);
            mesh.is_back.push(false);
            mesh.element_of.push(id.0);
        }
        (scene, rays, Arc::new(mesh))
    }

    /// Light that is the reference's own mean, times a factor.
    fn light(reference: &VertexReference, factor: f32) -> VertexLight {
        let irradiance = reference
            .sums
            .iter()
            .map(|sums| (sums.irradiance / f64::from(sums.count)).as_vec3() * factor)
            .collect();
        VertexLight {
            irradiance,
            ..VertexLight::default()
        }
    }

    #[test]
    fn the_reference_has_no_error_against_itself_and_a_wrong_light_has() {
        let (scene, rays, mesh) = plates();
        let mut reference = VertexReference::new(&mesh, 7);
        assert_eq!(reference.errors(&VertexLight::default(), 1.0), None);
        for _ in 0..8 {
            assert_eq!(reference.advance(&scene, &rays, NEVER), Some(true));
        }
        let own = reference
            .errors(&light(&reference, 1.0), 1.0)
            .expect("8 passes");
        assert!(own.iter().all(|error| *error < 1e-6), "{own:?}");
        let doubled = reference
            .errors(&light(&reference, 2.0), 1.0)
            .expect("8 passes");
        assert!(doubled.iter().any(|error| *error > 1e-3), "{doubled:?}");
    }

    #[test]
    fn cancelling_leaves_no_trace_and_a_new_mesh_keeps_what_is_known() {
        let (scene, rays, mesh) = plates();
        let mut reference = VertexReference::new(&mesh, 7);
        assert_eq!(reference.advance(&scene, &rays, &|| true), None);
        assert_eq!(reference.samples(), 0);
        reference.advance(&scene, &rays, NEVER);
        reference.advance(&scene, &rays, NEVER);
        let mut larger = (*mesh).clone();
        larger.positions.push(Vec3::ONE);
        larger.normals.push(Vec3::Z);
        larger.reflectance.push(Vec3::ONE);
        larger.emission.push(Vec3::ZERO);
        let moved = reference.on_mesh(&Arc::new(larger));
        let count = mesh.positions.len();
        assert!(moved.sums[..count].iter().all(|sums| sums.count == 2));
        assert_eq!(moved.sums[count], Sums::default());
        assert_eq!(moved.samples(), 0, "the new vertex has seen nothing");
    }
}
