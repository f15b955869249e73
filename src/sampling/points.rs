//! Random points of the surfaces whose light is to be measured.
//!
//! Points lie on sides that reflect and do not emit all over: elsewhere there is no error to see, and a sky would take
//! nearly all of them. They are uniform over the area, so plain means over them are area-weighted. Where most of the area
//! lies far outside the objects of the scene (a ground to the horizon, a dome), two groups count alike, each weighted by
//! area: what lies within reach of the objects, and the surroundings. Both have half of the points, so that plain means
//! over all points are means of both groups.

use std::{cell::LazyCell, collections::HashMap, fmt};

use glam::{DVec3, Vec2, Vec3};
use serde::Serialize;

use super::{SurfacePoint, emitters::Emitters};
use crate::{
    geometry::{Random, RayTree, cosine_direction, low_discrepancy_2d, triangle_point},
    scene::{DisjointSets, Scene, TriangleId},
};

/// The surfaces that the points stand for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SampledSurfaces {
    /// Whether nothing reflects without emitting, so that all surfaces count.
    pub all_emit: bool,
    /// Where surroundings count for one half: how far from the objects they begin, in world units.
    pub reach: Option<f64>,
}

impl fmt::Display for SampledSurfaces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self.all_emit {
            false => "reflecting surfaces without emitters, area-weighted",
            true => "all surfaces (none reflects without emitting), area-weighted",
        })?;
        match self.reach {
            None => Ok(()),
            Some(reach) => write!(
                f,
                " within two groups that count alike: up to {} units from the objects, and the surroundings outside",
                rounded(reach)
            ),
        }
    }
}

/// A length with two significant digits.
fn rounded(length: f64) -> f64 {
    let unit = 10_f64.powf(length.max(f64::MIN_POSITIVE).log10().floor() - 1.0);
    let rounded = (length / unit).round() * unit;
    // Without digits that only rounding leaves.
    format!("{rounded:.6}").parse().unwrap_or(rounded)
}

/// Pieces of surface that are more times as large as the typical one are no objects, and surfaces that are further from
/// all objects, in terms of its size, are out of their reach. Smaller, and walls of a room are surroundings of what
/// stands in it; larger, and the ground around a house takes the points of the house. Ordinary rooms stay whole with
/// any factor above 3.
const REACH: f64 = 8.0;

/// Surroundings count for this part at most.
const SURROUNDINGS_SHARE: f64 = 0.5;

/// Where this part of all points would lie near the objects anyway, there are no surroundings. Smaller, and too few points
/// are left for the objects; larger, and means over a room are no longer those over its area.
const ENOUGH_SHARE: f64 = 0.125;

/// What lies near the objects receives this part of what their lamps emit at least. Smaller, and the ceiling behind a lamp
/// is all that is looked at; larger, and the reach of a lamp that shines past its object grows without end.
const LEAST_LIGHT: f64 = 0.25;

/// Rays that tell where the light of lamps lands.
const LIGHT_RAYS: u32 = 256;

/// Their stream of random numbers, apart from those of points.
const LIGHT_STREAM: u64 = 1 << 63;

/// Choose `count` points; fewer where there is no surface. The same for the same seed.
pub fn sample_points(
    scene: &Scene,
    rays: &RayTree,
    count: u32,
    seed: u64,
) -> (Vec<SurfacePoint>, SampledSurfaces) {
    let all: Vec<Side> = lit_sides(scene).collect();
    let mut counted: Vec<Side> = all
        .iter()
        .copied()
        .filter(|side| shows_error(scene, side.triangle))
        .collect();
    let all_emit = counted.is_empty();
    if all_emit {
        counted.clone_from(&all);
    }
    let counts = |point: &SurfacePoint| all_emit || shows_error(scene, point.triangle);
    // One run over all lit sides serves most scenes: few of its points are lost on emitters.
    let whole = |sides: &[Side]| -> Vec<Piece> {
        let pieces = sides.iter().map(|&side| Piece::whole(scene, side));
        pieces.collect()
    };
    let mut drawn = draw(scene, &whole(&all), count, &mut Random::new(seed, u64::MAX));
    drawn.retain(counts);
    let region = ObjectRegion::find(scene, &counted, || light_paths(scene, rays, seed));
    let groups = match &region {
        None => vec![(drawn, whole(&counted), count)],
        Some(region) => {
            let outer = (f64::from(count) * SURROUNDINGS_SHARE) as u32;
            let (near, far) = drawn
                .into_iter()
                .partition(|point: &SurfacePoint| region.contains(point.position.as_dvec3()));
            let (inside, outside) = region.split(scene, &counted);
            vec![(near, inside, count - outer), (far, outside, outer)]
        }
    };
    let mut points = Vec::with_capacity(count as usize);
    for (stream, (drawn, pieces, wanted)) in groups.into_iter().enumerate() {
        let missing = wanted.saturating_sub(drawn.len() as u32);
        points.extend(thinned(drawn, wanted as usize));
        let mut random = Random::new(seed, u64::MAX - 1 - stream as u64);
        points.extend(draw(scene, &pieces, missing, &mut random));
    }
    let sampled = SampledSurfaces {
        all_emit,
        reach: region.map(|region| region.reach / scene.frame.scale),
    };
    (points, sampled)
}

/// A side of a triangle.
#[derive(Clone, Copy, Debug)]
struct Side {
    triangle: TriangleId,
    is_back: bool,
}

/// Every side that receives light: all fronts, and the backs of two-sided triangles.
fn lit_sides(scene: &Scene) -> impl Iterator<Item = Side> {
    scene.triangle_ids().flat_map(|triangle| {
        let side = move |is_back| Side { triangle, is_back };
        let back = scene.triangles[triangle.index()].two_sided;
        std::iter::once(side(false)).chain(back.then_some(side(true)))
    })
}

/// Whether light that arrives at a triangle shows, and not only that which it emits.
fn shows_error(scene: &Scene, triangle: TriangleId) -> bool {
    let surface = &scene.surfaces[triangle.index()];
    let has_dark_parts = scene.material(triangle).emission_texture.is_some()
        && scene.texcoords.get(triangle.index()).is_some();
    surface.reflectance != Vec3::ZERO && (surface.emission == Vec3::ZERO || has_dark_parts)
}

/// A side or a triangular part of one.
struct Piece {
    side: Side,
    /// Barycentric coordinates of the corners.
    corners: [DVec3; 3],
    /// In square frame units.
    area: f64,
}

impl Piece {
    fn whole(scene: &Scene, side: Side) -> Self {
        Self {
            side,
            corners: WHOLE,
            area: area_of(scene, side.triangle),
        }
    }

    /// The parts of a convex polygon of a side, given by barycentric coordinates.
    fn fan(scene: &Scene, side: Side, polygon: &[DVec3]) -> impl Iterator<Item = Self> {
        let whole = area_of(scene, side.triangle);
        let first = polygon.first().copied().unwrap_or(DVec3::ZERO);
        let pairs = polygon.windows(2).skip(1);
        pairs
            .map(move |pair| {
                let corners = [first, pair[0], pair[1]];
                let share = corners[0].dot(corners[1].cross(corners[2])).abs();
                Self {
                    side,
                    corners,
                    area: share * whole,
                }
            })
            .filter(|piece| piece.area > 0.0)
    }
}

/// Barycentric coordinates of a triangle's own corners.
const WHOLE: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

fn area_of(scene: &Scene, triangle: TriangleId) -> f64 {
    f64::from(scene.surfaces[triangle.index()].area_vector.length())
}

/// Points uniform over the area: systematically along the running area, low-discrepancy within a piece.
fn draw(scene: &Scene, pieces: &[Piece], count: u32, random: &mut Random) -> Vec<SurfacePoint> {
    let offset = f64::from(random.uniform());
    let shift = random.uniform_2d();
    let total: f64 = pieces.iter().map(|piece| piece.area).sum();
    let (mut points, mut passed) = (Vec::new(), 0.0);
    let mut next = 0;
    for piece in pieces {
        passed += piece.area;
        while next < count && (f64::from(next) + offset) * total < passed * f64::from(count) {
            let square = low_discrepancy_2d(next, shift);
            points.push(point_of(scene, piece, square));
            next += 1;
        }
    }
    points
}

/// As many of the points as wanted, evenly chosen; all where there are fewer.
fn thinned(points: Vec<SurfacePoint>, wanted: usize) -> Vec<SurfacePoint> {
    let count = points.len();
    if count <= wanted {
        return points;
    }
    (0..wanted)
        .map(|index| points[index * count / wanted])
        .collect()
}

/// The point of a piece that belongs to a point of the unit square.
fn point_of(scene: &Scene, piece: &Piece, square: Vec2) -> SurfacePoint {
    let within = triangle_point(square);
    let [u, v, w] = piece.corners;
    let barycentric = if piece.corners == WHOLE {
        within
    } else {
        let [x, y, z] = within.as_dvec3().to_array();
        (u * x + v * y + w * z).as_vec3()
    };
    let Side { triangle, is_back } = piece.side;
    SurfacePoint::at(scene, triangle, is_back, barycentric)
}

/// A connected piece of surface.
struct Component {
    min: DVec3,
    max: DVec3,
    triangle_count: usize,
}

impl Component {
    /// Diagonal of its box.
    fn size(&self) -> f64 {
        self.min.distance(self.max)
    }
}

/// Pieces of surface that share corners.
fn components(scene: &Scene) -> Vec<Component> {
    let mut sets = DisjointSets::new(scene.positions.len());
    for triangle in &scene.triangles {
        let [a, b, c] = triangle.corners;
        sets.join(a, b);
        sets.join(a, c);
    }
    let mut index_of: HashMap<u32, usize> = HashMap::new();
    let mut found: Vec<Component> = Vec::new();
    for triangle in &scene.triangles {
        let root = sets.root(triangle.corners[0]);
        let index = *index_of.entry(root).or_insert(found.len());
        if index == found.len() {
            found.push(Component {
                min: DVec3::MAX,
                max: DVec3::MIN,
                triangle_count: 0,
            });
        }
        let component = &mut found[index];
        component.triangle_count += 1;
        for corner in triangle.corners {
            let position = scene.positions[corner as usize].as_dvec3();
            component.min = component.min.min(position);
            component.max = component.max.max(position);
        }
    }
    found
}

/// Part of the pieces, or of the triangles, that tell how large objects are. Smaller, and a few crumbs do; larger, and two
/// or three pieces of surroundings outnumber a house.
const TYPICAL_PART: f64 = 0.25;

/// How large objects are: a quarter of the pieces are no larger, or a quarter of the triangles belong to such pieces,
/// whichever is less. So neither a finely divided ground nor one in many parts hides what stands on it.
fn typical_size(components: &[Component]) -> f64 {
    let mut sorted: Vec<(f64, f64)> = components
        .iter()
        .map(|piece| (piece.size(), piece.triangle_count as f64))
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let quantile = |weight: fn(&(f64, f64)) -> f64| {
        let wanted = TYPICAL_PART * sorted.iter().map(weight).sum::<f64>();
        let mut sum = 0.0;
        let found = sorted.iter().find(|piece| {
            sum += weight(piece);
            sum >= wanted
        });
        found.map_or(0.0, |(size, _)| *size)
    };
    quantile(|_| 1.0).min(quantile(|piece| piece.1))
}

/// Where some light of the emitters starts and where it lands, each of the same power.
fn light_paths(scene: &Scene, rays: &RayTree, seed: u64) -> Vec<[DVec3; 2]> {
    let emitters = Emitters::new(scene);
    let mut random = Random::new(seed, LIGHT_STREAM);
    let path = |index: u32| {
        let square = low_discrepancy_2d(index, random.uniform_2d());
        let choice = (f64::from(index) + 0.5) / f64::from(LIGHT_RAYS);
        let from = emitters.sample(scene, choice, square)?;
        let front = scene.surfaces[from.triangle.index()]
            .area_vector
            .normalize_or_zero();
        let is_back = scene.triangles[from.triangle.index()].two_sided && random.uniform() < 0.5;
        let direction = cosine_direction(if is_back { -front } else { front }, random.uniform_2d());
        let hit = rays.closest(from.position, direction, Some(from.triangle))?;
        let to = from.position + direction * hit.distance;
        Some([from.position.as_dvec3(), to.as_dvec3()])
    };
    (0..LIGHT_RAYS).filter_map(path).collect()
}

/// The box around the objects of a scene and what is within their reach.
struct ObjectRegion {
    min: DVec3,
    max: DVec3,
    /// In frame units.
    reach: f64,
}

impl ObjectRegion {
    /// The region, where most of the area that counts lies outside it.
    fn find(
        scene: &Scene,
        counted: &[Side],
        light_paths: impl FnOnce() -> Vec<[DVec3; 2]>,
    ) -> Option<Self> {
        let components = components(scene);
        let total: f64 = counted
            .iter()
            .map(|side| area_of(scene, side.triangle))
            .sum();
        let mut reach = REACH * typical_size(&components);
        let light = LazyCell::new(light_paths);
        loop {
            let region = Self::around(&components, reach);
            if components
                .iter()
                .all(|piece| region.contains(piece.min) && region.contains(piece.max))
            {
                return None;
            }
            let (inside, _) = region.split(scene, counted);
            let area: f64 = inside.iter().map(|piece| piece.area).sum();
            if area >= ENOUGH_SHARE * total {
                return None;
            }
            let size = reach / REACH;
            if area >= size * size && region.holds_light(&light) {
                return Some(region);
            }
            reach = (2.0 * reach).max(f64::MIN_POSITIVE);
        }
    }

    fn around(components: &[Component], reach: f64) -> Self {
        let objects = components.iter().filter(|piece| piece.size() <= reach);
        let (min, max) = objects.fold((DVec3::MAX, DVec3::MIN), |(min, max), piece| {
            (min.min(piece.min), max.max(piece.max))
        });
        Self {
            min: min - reach,
            max: max + reach,
            reach,
        }
    }

    fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Whether what the lamps within emit lands there, as far as it lands anywhere: a lamp that hangs high above the ground
    /// has nothing in its reach but light.
    fn holds_light(&self, paths: &[[DVec3; 2]]) -> bool {
        let own = paths.iter().filter(|[from, _]| self.contains(*from));
        let (landed, all) = own.fold((0, 0), |(landed, all), [_, to]| {
            (landed + u32::from(self.contains(*to)), all + 1)
        });
        f64::from(landed) >= LEAST_LIGHT * f64::from(all)
    }

    /// The parts of the sides inside and outside.
    fn split(&self, scene: &Scene, sides: &[Side]) -> (Vec<Piece>, Vec<Piece>) {
        let (mut inside, mut outside) = (Vec::new(), Vec::new());
        for &side in sides {
            let corners = scene.corners(side.triangle).map(|corner| corner.as_dvec3());
            if corners.iter().all(|&corner| self.contains(corner)) {
                inside.push(Piece::whole(scene, side));
                continue;
            }
            let mut kept = WHOLE.to_vec();
            for axis in 0..3 {
                let values = DVec3::from_array(corners.map(|corner| corner[axis]));
                for distances in [values - self.min[axis], self.max[axis] - values] {
                    let cut = clip(&kept, -distances);
                    outside.extend(Piece::fan(scene, side, &cut));
                    kept = clip(&kept, distances);
                }
            }
            inside.extend(Piece::fan(scene, side, &kept));
        }
        (inside, outside)
    }
}

/// The part of a convex polygon, in barycentric coordinates, where a linear function with these values at the corners of
/// the triangle is not negative.
fn clip(polygon: &[DVec3], values: DVec3) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, &from) in polygon.iter().enumerate() {
        let to = polygon[(index + 1) % polygon.len()];
        let (here, there) = (from.dot(values), to.dot(values));
        if here >= 0.0 {
            kept.push(from);
        }
        if (here >= 0.0) != (there >= 0.0) {
            kept.push(from.lerp(to, here / (here - there)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{
        Material, MaterialId, SceneBuilder, SceneOptions, Sides, Texture, TextureId,
        builtin::find_builtin,
    };

    const COUNT: u32 = 4000;

    /// Faces of boxes and rectangles; grey is the first material, the light the second.
    struct Maker(SceneBuilder);

    const GREY: MaterialId = MaterialId(0);
    const LIGHT: MaterialId = MaterialId(1);

    impl Maker {
        fn new() -> Self {
            let mut builder = SceneBuilder::default();
            builder.push_material(Material::plain("grey", Vec3::splat(0.5), Vec3::ZERO));
            builder.push_material(Material::plain("light", Vec3::splat(0.5), Vec3::ONE));
            Self(builder)
        }

        /// A grid of squares, each of two triangles, of the parallelogram at a corner.
        fn grid(&mut self, at: DVec3, u: DVec3, v: DVec3, squares: u32, material: MaterialId) {
            let first = self.0.positions.len() as u32;
            let row = squares + 1;
            for j in 0..row {
                for i in 0..row {
                    let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(squares));
                    self.0.push_position(at + u * s + v * t);
                }
            }
            for j in 0..squares {
                for i in 0..squares {
                    let a = first + j * row + i;
                    self.0.push_triangle([a, a + 1, a + row + 1], material);
                    self.0.push_triangle([a, a + row + 1, a + row], material);
                }
            }
        }

        /// A box about a point, its faces outward, in grids.
        fn cube(&mut self, at: DVec3, half: f64, squares: u32, material: MaterialId) {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * half);
            for k in 0..3 {
                let [n, u, v] = [axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]];
                self.grid(at + n - u - v, 2.0 * u, 2.0 * v, squares, material);
                self.grid(at - n - u - v, 2.0 * v, 2.0 * u, squares, material);
            }
        }

        fn sample(self) -> (Scene, Vec<SurfacePoint>, SampledSurfaces) {
            let scene = self
                .0
                .finish(&SceneOptions::with_sides(Sides::One))
                .unwrap();
            let rays = RayTree::new(&scene);
            let (points, surfaces) = sample_points(&scene, &rays, COUNT, 1);
            assert_eq!(points.len(), COUNT as usize);
            for point in &points {
                assert!((point.barycentric.element_sum() - 1.0).abs() < 1e-5);
                assert!(point.position.is_finite());
            }
            (scene, points, surfaces)
        }
    }

    /// How many of the points lie this near to a world point.
    fn near(scene: &Scene, points: &[SurfacePoint], at: DVec3, radius: f64) -> usize {
        let is_near =
            |point: &&SurfacePoint| scene.frame.to_world(point.position).distance(at) <= radius;
        points.iter().filter(is_near).count()
    }

    #[test]
    fn points_of_a_room_lie_as_area_does_and_none_on_its_light() {
        for name in ["cornell", "room-1022", "plates"] {
            let scene = find_builtin(name)
                .unwrap()
                .scene(&SceneOptions::default())
                .unwrap();
            let rays = RayTree::new(&scene);
            let (points, surfaces) = sample_points(&scene, &rays, COUNT, 7);
            assert_eq!(surfaces, SampledSurfaces::default(), "{name}");
            assert_eq!(points.len(), COUNT as usize);
            assert!(points.iter().all(|point| point.emission == Vec3::ZERO));
            // Those of one run over all sides, but for the ones that would lie on the light.
            let sides = lit_sides(&scene).map(|side| Piece::whole(&scene, side));
            let pieces: Vec<Piece> = sides.collect();
            let plain = draw(&scene, &pieces, COUNT, &mut Random::new(7, u64::MAX));
            let kept = plain.into_iter().filter(|p| p.emission == Vec3::ZERO);
            assert!(kept.zip(&points).all(|(a, b)| a == *b), "{name}");
        }
    }

    #[test]
    fn a_sky_takes_no_points_whatever_its_size() {
        for half in [10.0, 1e3, 1e5] {
            let mut maker = Maker::new();
            maker.cube(DVec3::ZERO, half, 4, LIGHT);
            maker.cube(DVec3::ZERO, 1.0, 1, GREY);
            let (_, points, surfaces) = maker.sample();
            assert_eq!(surfaces, SampledSurfaces::default());
            assert!(points.iter().all(|point| point.emission == Vec3::ZERO));
        }
    }

    #[test]
    fn surroundings_take_half_of_the_points_however_large_and_finely_divided() {
        for (half, squares) in [(100.0, 1), (1e3, 40), (1e5, 1), (1e5, 60)] {
            let mut maker = Maker::new();
            // A ground, and a room of 4 with a cube and a light in it.
            let (x, z) = (DVec3::X, DVec3::Z);
            maker.grid(
                (x + z) * -half,
                z * 2.0 * half,
                x * 2.0 * half,
                squares,
                GREY,
            );
            maker.cube(DVec3::Y * 2.0, 2.0, 1, GREY);
            maker.cube(DVec3::Y, 0.5, 1, GREY);
            maker.grid(DVec3::Y * 3.9, x, z, 1, LIGHT);
            let (scene, points, surfaces) = maker.sample();
            let reach = surfaces.reach.unwrap();
            assert!((5.0..60.0).contains(&reach), "{reach}");
            let inner = near(&scene, &points, DVec3::ZERO, 2.0 * reach);
            assert!((2000..2100).contains(&inner), "{half} {squares}: {inner}");
            let room = near(&scene, &points, DVec3::Y * 2.0, 3.5);
            assert!(room > 40, "{half} {squares}: {room}");
        }
    }

    #[test]
    fn a_shell_far_around_a_small_object_takes_half_of_the_points() {
        for (half, squares) in [(200.0, 1), (1e4, 20)] {
            let mut maker = Maker::new();
            maker.cube(DVec3::ZERO, half, squares, GREY);
            maker.cube(DVec3::ZERO, 1.0, 1, GREY);
            maker.grid(DVec3::Y * 2.0, DVec3::X * 0.5, DVec3::Z * 0.5, 1, LIGHT);
            let (scene, points, surfaces) = maker.sample();
            assert!(surfaces.reach.is_some(), "{half}");
            let inner = near(&scene, &points, DVec3::ZERO, 1.8);
            assert!((2000..2020).contains(&inner), "{half}: {inner}");
        }
    }

    #[test]
    fn a_tiny_lamp_draws_points_to_where_its_light_is() {
        let mut maker = Maker::new();
        let half = 500.0;
        let (x, z) = (DVec3::X, DVec3::Z);
        maker.grid((x + z) * -half, z * 2.0 * half, x * 2.0 * half, 1, GREY);
        maker.grid(DVec3::Y, x * 1e-3, z * 1e-3, 1, LIGHT);
        let (scene, points, surfaces) = maker.sample();
        assert!(surfaces.reach.is_some());
        // On the ground alone there would be one in 80,000.
        let lit = near(&scene, &points, DVec3::ZERO, 4.0);
        assert!(lit > 1500, "{lit}");
    }

    #[test]
    fn a_tiny_lamp_in_a_room_leaves_means_over_the_area() {
        let mut maker = Maker::new();
        for half in [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 5.0) {
            for (n, turned) in [(half, true), (-half, false)] {
                let u = DVec3::new(half.y, half.z, half.x);
                let v = DVec3::new(half.z, half.x, half.y);
                let (first, second) = if turned { (v, u) } else { (u, v) };
                maker.grid(n - u - v, 2.0 * first, 2.0 * second, 1, GREY);
            }
        }
        let (x, z) = (DVec3::X, DVec3::Z);
        maker.grid(DVec3::Y * 4.99, x * 1e-3, z * 1e-3, 1, LIGHT);
        let (scene, points, surfaces) = maker.sample();
        assert_eq!(surfaces.reach, None);
        let by_lamp = near(&scene, &points, DVec3::Y * 5.0, 1.0);
        assert!(by_lamp < COUNT as usize / 100, "{by_lamp}");
    }

    #[test]
    fn where_everything_emits_all_counts_but_black_surfaces_never_do() {
        let mut maker = Maker::new();
        maker.cube(DVec3::ZERO, 1.0, 1, LIGHT);
        let (_, points, surfaces) = maker.sample();
        assert!(surfaces.all_emit && surfaces.reach.is_none());
        assert!(points.iter().all(|point| point.emission == Vec3::ONE));

        let mut maker = Maker::new();
        let black = Material::plain("black", Vec3::ZERO, Vec3::ZERO);
        let black = maker.0.push_material(black);
        maker.cube(DVec3::ZERO, 50.0, 1, black);
        maker.cube(DVec3::ZERO, 1.0, 1, GREY);
        let (_, points, _) = maker.sample();
        assert!(points.iter().all(|point| point.reflectance != Vec3::ZERO));
    }

    #[test]
    fn the_dark_parts_of_a_textured_light_are_looked_at() {
        let mut maker = Maker::new();
        let picture = Texture {
            name: "half.png".to_owned(),
            width: 8,
            height: 1,
            pixels: (0..8)
                .map(|x| Vec3::splat(if x < 4 { 1.0 } else { 0.0 }))
                .collect(),
            ..Texture::default()
        };
        maker.0.textures.push(picture);
        let mut material = Material::plain("screen", Vec3::splat(0.5), Vec3::ONE);
        material.emission_texture = Some(TextureId(0));
        let screen = maker.0.push_material(material);
        maker.grid(DVec3::ZERO, DVec3::X, DVec3::Y, 1, screen);
        for face in &mut maker.0.faces {
            let uv = |corner: u32| Vec2::new((corner % 2) as f32, (corner / 2) as f32);
            face.texcoords = Some(face.corners.map(uv));
        }
        let (_, points, surfaces) = maker.sample();
        assert!(!surfaces.all_emit);
        let dark = points.iter().filter(|point| point.emission == Vec3::ZERO);
        // Three eighths lie between black pixels.
        assert!(dark.count().abs_diff(1500) < 60);
    }

    #[test]
    fn parts_of_a_triangle_add_up_to_it() {
        let mut maker = Maker::new();
        maker.grid(
            DVec3::ZERO,
            DVec3::X * 30.0,
            DVec3::Y * 20.0 + DVec3::Z,
            1,
            GREY,
        );
        let scene = maker.0.finish(&SceneOptions::default()).unwrap();
        let sides: Vec<Side> = lit_sides(&scene).collect();
        let area = |pieces: &[Piece]| pieces.iter().map(|piece| piece.area).sum::<f64>();
        let total: f64 = sides
            .iter()
            .map(|side| area_of(&scene, side.triangle))
            .sum();
        let mut random = Random::new(3, 0);
        for _ in 0..200 {
            let mut point =
                || DVec3::from_array([(); 3].map(|()| 80.0 * f64::from(random.uniform()) - 40.0));
            let (a, b) = (point(), point());
            let region = ObjectRegion {
                min: a.min(b),
                max: a.max(b),
                reach: 1.0,
            };
            let (inside, outside) = region.split(&scene, &sides);
            let [within, outside_area] = [area(&inside), area(&outside)];
            assert!(
                (within + outside_area - total).abs() < 1e-9 * total,
                "{a} {b}"
            );
            for piece in inside.iter().chain(&outside) {
                let middle = (piece.corners[0] + piece.corners[1] + piece.corners[2]) / 3.0;
                let [u, v, w] = scene.corners(piece.side.triangle).map(|at| at.as_dvec3());
                let place = u * middle.x + v * middle.y + w * middle.z;
                let is_inside = inside.iter().any(|other| std::ptr::eq(other, piece));
                assert_eq!(region.contains(place), is_inside, "{a} {b}");
            }
        }
    }

    #[test]
    fn what_the_error_is_of_is_said() {
        let plain = SampledSurfaces::default().to_string();
        assert_eq!(plain, "reflecting surfaces without emitters, area-weighted");
        let grouped = SampledSurfaces {
            reach: Some(12.345),
            ..SampledSurfaces::default()
        };
        assert!(grouped.to_string().contains("up to 12 units"), "{grouped}");
        assert_eq!(rounded(0.001_234), 0.0012);
        assert_eq!(rounded(98_765.0), 99_000.0);
    }
}
