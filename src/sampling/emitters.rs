//! Area sampling of the emitting triangles.

use glam::{Vec2, Vec3};

use crate::{
    geometry::triangle_point,
    scene::{Scene, TriangleId, luminance},
};

/// A point on an emitter.
pub struct EmitterPoint {
    /// Where it lies.
    pub triangle: TriangleId,
    /// Its position in frame units.
    pub position: Vec3,
    /// Its place in the triangle.
    pub barycentric: Vec3,
}

/// Chooses points of emitters with a density proportional to the luminance that their triangle emits from both sides.
pub struct Emitters {
    triangles: Vec<TriangleId>,
    /// Running sums of power; the last is the total.
    cumulative: Vec<f64>,
    /// Per triangle of the scene: probability per area of choosing a point there.
    density: Vec<f32>,
}

impl Emitters {
    /// All emitters of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut emitters = Self {
            triangles: Vec::new(),
            cumulative: Vec::new(),
            density: vec![0.0; scene.triangles.len()],
        };
        let mut total = 0.0;
        for id in scene.triangle_ids() {
            let emitted = strength(scene, id);
            let power = emitted * f64::from(scene.surfaces[id.index()].area_vector.length());
            if power > 0.0 {
                total += power;
                emitters.triangles.push(id);
                emitters.cumulative.push(total);
            }
        }
        for &id in &emitters.triangles {
            emitters.density[id.index()] = (strength(scene, id) / total) as f32;
        }
        emitters
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Probability per area of choosing a point of this triangle.
    pub fn density(&self, triangle: TriangleId) -> f32 {
        self.density[triangle.index()]
    }

    /// The point that belongs to a number in 0…1 and a point of the unit square, if anything emits.
    pub fn sample(&self, scene: &Scene, choice: f64, square: Vec2) -> Option<EmitterPoint> {
        let total = *self.cumulative.last()?;
        let index = self
            .cumulative
            .partition_point(|&sum| sum <= choice * total)
            .min(self.triangles.len() - 1);
        let triangle = self.triangles[index];
        let barycentric = triangle_point(square);
        let [a, b, c] = scene.corners(triangle);
        Some(EmitterPoint {
            triangle,
            position: a * barycentric.x + b * barycentric.y + c * barycentric.z,
            barycentric,
        })
    }
}

/// Luminance that a triangle emits, summed over the sides that emit.
fn strength(scene: &Scene, id: TriangleId) -> f64 {
    let sides = if scene.triangles[id.index()].two_sided {
        2.0
    } else {
        1.0
    };
    // The factor keeps a purely blue emitter from being starved: it is as likely as a grey one of its mean.
    let emission = scene.surfaces[id.index()].emission;
    sides * f64::from(luminance(emission).max(emission.element_sum() / 3.0))
}
