//! Light that gloss reflects to the eye where no rays are shot: at the vertices of specular surfaces, the brightest lamps by
//! the part of them that is seen, and all else as the linear function of the direction that is nearest to it.

use std::collections::HashMap;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::{
    incoming::{Incoming, vertex_places},
    lamps::Source,
    surface::LitScene,
};
use crate::{
    geometry::{Harmonics, RayTree},
    scene::{Scene, TriangleId, luminance},
    solver::{Cancel, Snapshot},
};

/// Most lamps that are told apart. Fewer blur highlights; more take time and memory for each vertex.
pub const GLOSS_LAMPS: usize = 4;

/// A lamp that gloss shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlossLamp {
    /// Its middle in frame units and 1, or the direction towards the sun and 0.
    pub place: Vec4,
    /// Its mean radiance.
    pub radiance: Vec3,
}

/// Light at a vertex. By channel three numbers and a fourth: the radiance from a direction is nearest to their product with
/// it, plus the fourth. Last the solid angles of the lamps as far as they are seen.
pub type GlossVertex = [[f32; 4]; 4];

/// Light that the specular surfaces of a mesh reflect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GlossLight {
    /// The brightest lamps, at most [`GLOSS_LAMPS`].
    pub lamps: Vec<GlossLamp>,
    /// By vertex; zeros where nothing is specular.
    pub vertices: Vec<GlossVertex>,
}

/// Light that gloss reflects at the vertices of a snapshot; `None` when cancelled.
pub fn gloss_at_vertices(
    scene: &Scene,
    rays: &RayTree,
    snapshot: &Snapshot,
    cancel: &Cancel,
) -> Option<GlossLight> {
    let lit = LitScene::new(scene, rays, snapshot);
    let incoming = Incoming::new(&lit, 0);
    let found = Lamps::of(&lit);
    let is_specular = |triangle: usize| {
        let id = TriangleId(lit.mesh.triangle_of[triangle]);
        scene.material(id).specular.is_some()
    };
    let places = vertex_places(lit.mesh, is_specular);
    cancel.proceed()?;
    let light = |(vertex, place): (usize, &Option<_>)| {
        let (Some(place), false) = (place, cancel.is_cancelled()) else {
            return GlossVertex::default();
        };
        let (mut rest, mut lamps) = (Harmonics::default(), [0.0; GLOSS_LAMPS]);
        incoming.gather(place, vertex, |arriving| {
            match found.lamp(arriving.source) {
                Some(lamp) => {
                    let brightness = luminance(found.list[lamp].radiance);
                    lamps[lamp] += luminance(arriving.light) / brightness;
                }
                None => rest.add(arriving.direction, arriving.light),
            };
        });
        let [red, green, blue] = linear(&rest, lit.mesh.normals[vertex]);
        [red, green, blue, lamps]
    };
    let mut vertices: Vec<GlossVertex> = places.par_iter().enumerate().map(light).collect();
    cancel.proceed()?;
    lit.mesh.repeat_light(&mut vertices);
    Some(GlossLight {
        lamps: found.list,
        vertices,
    })
}

/// The linear function of the direction that is nearest to light over the hemisphere about a normal (least squares), by
/// channel: its slope, and its value in the middle of all directions.
fn linear(light: &Harmonics, normal: Vec3) -> [[f32; 4]; 3] {
    use std::f32::consts::PI;
    let (all, [x, y, z]) = light.moments();
    [0, 1, 2].map(|channel| {
        let (all, vector) = (all[channel], Vec3::new(x[channel], y[channel], z[channel]));
        let along = vector.dot(normal);
        // Of 1 and of the height, the squares add to 2 π and 2 π / 3, and their product to π.
        let even = (2.0 * all - 3.0 * along) / PI;
        let rising = (6.0 * along - 3.0 * all) / PI;
        let slope = (vector - normal * along) * (3.0 / (2.0 * PI)) + normal * rising;
        slope.extend(even).to_array()
    })
}

/// The lamps that are told apart.
struct Lamps {
    list: Vec<GlossLamp>,
    /// The lamp of an emitting triangle.
    of_triangle: HashMap<TriangleId, usize>,
    has_sun: bool,
}

/// Triangles of one lamp.
#[derive(Clone, Default)]
struct Group {
    triangles: Vec<TriangleId>,
    area: f32,
    /// Sums over the area.
    place: Vec3,
    radiance: Vec3,
}

impl Lamps {
    /// The sun, and the emitters of most power; triangles that share corners are one.
    fn of(lit: &LitScene<'_>) -> Self {
        let scene = lit.scene;
        let sun = scene.environment.sun.map(|sun| GlossLamp {
            place: sun.direction.extend(0.0),
            radiance: sun.radiance(),
        });
        let sun = sun.filter(|sun| luminance(sun.radiance) > 0.0);
        let mut groups: Vec<Group> = Vec::new();
        for triangles in joined(scene, |id| lit.emitters.density(id) > 0.0) {
            let mut group = Group::default();
            for &id in &triangles {
                let surface = &scene.surfaces[id.index()];
                let area = surface.area_vector.length();
                let [a, b, c] = scene.corners(id);
                group.area += area;
                group.place += (a + b + c) / 3.0 * area;
                group.radiance += surface.emission * area;
            }
            group.triangles = triangles;
            groups.push(group);
        }
        groups.retain(|group| group.area > 0.0 && luminance(group.radiance) > 0.0);
        groups.sort_by(|a, b| luminance(b.radiance).total_cmp(&luminance(a.radiance)));
        groups.truncate(GLOSS_LAMPS - usize::from(sun.is_some()));
        let mut lamps = Self {
            has_sun: sun.is_some(),
            list: sun.into_iter().collect(),
            of_triangle: HashMap::new(),
        };
        for group in groups {
            let index = lamps.list.len();
            let own = group.triangles.iter().map(|&id| (id, index));
            lamps.of_triangle.extend(own);
            lamps.list.push(GlossLamp {
                place: (group.place / group.area).extend(1.0),
                radiance: group.radiance / group.area,
            });
        }
        lamps
    }

    /// The lamp that light comes from straight.
    fn lamp(&self, source: Source) -> Option<usize> {
        match source {
            Source::Emitter(triangle) => self.of_triangle.get(&triangle).copied(),
            Source::Sun => self.has_sun.then_some(0),
            Source::Other => None,
        }
    }
}

/// Wanted triangles, those that share corners together.
fn joined(scene: &Scene, is_wanted: impl Fn(TriangleId) -> bool) -> Vec<Vec<TriangleId>> {
    let wanted: Vec<TriangleId> = scene.triangle_ids().filter(|&id| is_wanted(id)).collect();
    // Each points to one of the same lamp before it, the first one to itself.
    let mut first: Vec<usize> = (0..wanted.len()).collect();
    fn root(first: &[usize], mut at: usize) -> usize {
        while first[at] != at {
            at = first[at];
        }
        at
    }
    let mut at_corner: HashMap<[u32; 3], usize> = HashMap::new();
    for (index, &id) in wanted.iter().enumerate() {
        for corner in scene.corners(id) {
            let key = corner.to_array().map(f32::to_bits);
            let other = *at_corner.entry(key).or_insert(index);
            let ends = [root(&first, index), root(&first, other)];
            let [low, high] = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            first[high] = low;
            // Shorter ways for those that come.
            first[index] = low;
        }
    }
    let mut groups: Vec<Vec<TriangleId>> = vec![Vec::new(); wanted.len()];
    for (index, &id) in wanted.iter().enumerate() {
        groups[root(&first, index)].push(id);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::{Random, hemisphere_direction},
        scene::{Material, SceneBuilder, SceneOptions},
    };

    #[test]
    fn the_linear_function_of_linear_light_is_that_light() {
        let (normal, slope) = (Vec3::new(0.36, 0.48, 0.8), Vec3::new(0.3, -0.5, 0.2));
        let (mut light, mut random, count) = (Harmonics::default(), Random::new(1, 2), 200_000);
        for _ in 0..count {
            let direction = hemisphere_direction(normal, random.uniform_2d());
            let radiance = 1.0 + slope.dot(direction);
            let each = std::f32::consts::TAU / count as f32;
            light.add(direction, Vec3::new(radiance, 2.0, 0.0) * each);
        }
        let [red, green, blue] = linear(&light, normal).map(Vec4::from_array);
        assert!(red.abs_diff_eq(slope.extend(1.0), 0.03), "{red}");
        assert!(green.abs_diff_eq(Vec4::W * 2.0, 0.05), "{green}");
        assert_eq!(blue, Vec4::ZERO);
    }

    #[test]
    fn triangles_that_share_corners_are_one_lamp() {
        let mut builder = SceneBuilder::default();
        let glowing = builder.push_material(Material::plain("lamp", Vec3::ZERO, Vec3::ONE));
        for shift in [0.0, 3.0] {
            let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
            let [a, b, c, d] =
                corners.map(|[x, y]| builder.push_position(glam::DVec3::new(x + shift, y, 0.0)));
            builder.push_triangle([a, b, c], glowing);
            builder.push_triangle([a, c, d], glowing);
        }
        let scene = builder.finish(&SceneOptions::default()).expect("usable");
        let groups = joined(&scene, |_| true);
        assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
    }
}
