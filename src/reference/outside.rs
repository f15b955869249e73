//! Light from outside as the references sample it: the sky by its luminance, the sun by its disc.

use std::{collections::HashMap, f32::consts::PI, sync::Arc};

use glam::{Vec2, Vec3};

use super::scatter::Scatter;
use crate::{
    geometry::{RayTree, cosine_direction, low_discrepancy_2d},
    scene::{Environment, MaterialId, Scene, Sky, SkyPicture, Specular, TriangleId, luminance},
};

/// Most cells of a table by width and height. Fewer blur a sun in the picture into its surroundings, and noise grows; more
/// take memory.
const MOST_CELLS: [u32; 2] = [1024, 512];

/// Where light from outside is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Position in frame units.
    pub(super) position: Vec3,
    /// Unit normal towards the side that receives.
    pub(super) normal: Vec3,
    /// The triangle it lies on, which its own rays do not meet.
    pub(super) triangle: TriangleId,
}

/// Points of the unit square that choose a direction to the sky and one to the sun.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct OutsideSquares {
    /// For the sky.
    pub(super) sky: Vec2,
    /// For the sun.
    pub(super) sun: Vec2,
}

impl OutsideSquares {
    /// Points of a low-discrepancy sequence shifted by these.
    pub(super) fn moved(self, index: u32) -> Self {
        Self {
            sky: low_discrepancy_2d(index, self.sky),
            sun: low_discrepancy_2d(index, self.sun),
        }
    }
}

/// Sky and sun of a scene.
pub(super) struct Outside {
    environment: Arc<Environment>,
    /// Of a sky that varies.
    table: Option<SkyTable>,
    /// Mirrors that show the sun.
    mirrors: SunMirrors,
}

/// The mirrors of a scene that show the sun. Rays that meet its disc by chance count nothing, so that what mirrors send of it
/// has rays of its own: over one mirror, not over several.
#[derive(Clone, Debug, Default)]
struct SunMirrors {
    /// Mirrors that are turned alike.
    list: Vec<SunMirror>,
    /// By triangle, index into `list`, and whether both sides reflect.
    of_triangle: HashMap<TriangleId, (usize, bool)>,
}

/// Mirrors of a material that are turned alike.
#[derive(Clone, Copy, Debug)]
struct SunMirror {
    /// Unit normal of the fronts.
    normal: Vec3,
    material: MaterialId,
    /// What is reflected, by channel.
    reflectance: Vec3,
}

/// Most of these. Fewer leave out what curved mirrors send of the sun; more take a ray each at every reflection.
const MOST_SUN_MIRRORS: usize = 64;

/// Mirrors whose normals differ by less than this are turned alike.
const ALIKE: f32 = 1e-4;

impl SunMirrors {
    /// Those of a scene; none where there are too many.
    fn of(scene: &Scene) -> Self {
        let mut found = Self::default();
        if scene.environment.sun.is_none() {
            return found;
        }
        for id in scene.triangle_ids() {
            let own = scene.material(id);
            let Some(Specular::Mirror { reflectance }) = own.specular else {
                continue;
            };
            let triangle = &scene.triangles[id.index()];
            let normal = scene.surfaces[id.index()].area_vector.normalize_or_zero();
            let is_alike = |known: &SunMirror| {
                known.material == triangle.material && known.normal.abs_diff_eq(normal, ALIKE)
            };
            let index = found.list.iter().position(is_alike).unwrap_or_else(|| {
                found.list.push(SunMirror {
                    normal,
                    material: triangle.material,
                    reflectance: reflectance * own.share_of_met(),
                });
                found.list.len() - 1
            });
            if found.list.len() > MOST_SUN_MIRRORS {
                return Self::default();
            }
            found.of_triangle.insert(id, (index, triangle.two_sided));
        }
        found
    }
}

impl Outside {
    /// Those of a scene.
    pub(super) fn new(scene: &Scene) -> Self {
        let environment = scene.environment.clone();
        let table = match &environment.sky {
            Sky::Picture(sky) if !environment.sky.is_dark() => Some(SkyTable::new(sky)),
            _ => None,
        };
        Self {
            environment,
            table,
            mirrors: SunMirrors::of(scene),
        }
    }

    /// Whether no light comes from outside.
    pub(super) fn is_dark(&self) -> bool {
        self.environment.is_dark()
    }

    /// Shadow rays of a sample: one for a sky that varies, one for the sun.
    pub(super) fn ray_count(&self) -> u32 {
        u32::from(self.table.is_some())
            + u32::from(self.environment.sun.is_some())
            + self.mirrors.list.len() as u32
    }

    /// Points of the unit square by `next`, which is asked only for those that are needed.
    pub(super) fn squares(&self, mut next: impl FnMut() -> Vec2) -> OutsideSquares {
        let mut square = |is_needed: bool| if is_needed { next() } else { Vec2::ZERO };
        OutsideSquares {
            sky: square(self.table.is_some()),
            sun: square(self.environment.sun.is_some()),
        }
    }

    /// Irradiance straight from outside by directions chosen for sky and sun; what a cosine-weighted ray adds is
    /// [`Self::by_ray`].
    pub(super) fn share(
        &self,
        rays: &RayTree,
        at: Place,
        scatter: Scatter,
        squares: OutsideSquares,
    ) -> Vec3 {
        self.sky_share(rays, at, scatter, squares.sky)
            + self.sun_share(rays, at, scatter, squares.sun)
            + self.mirrored_sun_share(rays, at, scatter, squares.sun)
    }

    /// Radiance by a ray that left the scene, weighted against [`Self::share`] by the balance heuristic where its direction
    /// was chosen with a density.
    pub(super) fn by_ray(&self, direction: Vec3, density: Option<f32>) -> Vec3 {
        let radiance = self.environment.sky.radiance(direction);
        let Some(by_ray) = density else {
            return radiance;
        };
        let by_table = self
            .table
            .as_ref()
            .map_or(0.0, |table| table.density(direction));
        if by_ray > 0.0 {
            radiance * (by_ray / (by_ray + by_table))
        } else {
            Vec3::ZERO
        }
    }

    /// Irradiance straight from outside by one sample of each kind.
    pub(super) fn irradiance(
        &self,
        rays: &RayTree,
        at: Place,
        toward: Vec2,
        squares: OutsideSquares,
    ) -> Vec3 {
        let diffuse = Scatter::Diffuse(at.normal);
        let mut sum = self.share(rays, at, diffuse, squares);
        if !self.environment.sky.is_dark() {
            let direction = cosine_direction(at.normal, toward);
            let density = Some(diffuse.toward(direction).density);
            sum += self.by_ray(direction, density) * PI * passing(rays, at, direction);
        }
        sum
    }

    fn sky_share(&self, rays: &RayTree, at: Place, scatter: Scatter, square: Vec2) -> Vec3 {
        let Some(table) = &self.table else {
            return Vec3::ZERO;
        };
        let direction = table.direction(square);
        let toward = scatter.toward(direction);
        if toward.value <= 0.0 {
            return Vec3::ZERO;
        }
        let density = table.density(direction) + toward.density;
        let radiance = self.environment.sky.radiance(direction);
        radiance * (toward.value / density) * passing(rays, at, direction)
    }

    /// By a point of the disc, uniform as a surface sees it that faces its centre. Rays that meet the disc by chance count
    /// nothing.
    fn sun_share(&self, rays: &RayTree, at: Place, scatter: Scatter, square: Vec2) -> Vec3 {
        let Some(sun) = self.environment.sun else {
            return Vec3::ZERO;
        };
        let (direction, weight) = sun.sample(square);
        let toward = scatter.toward(direction);
        if toward.value <= 0.0 {
            return Vec3::ZERO;
        }
        sun.irradiance * (toward.value * weight) * passing(rays, at, direction)
    }

    /// As the sun's share, over one mirror.
    fn mirrored_sun_share(
        &self,
        rays: &RayTree,
        at: Place,
        scatter: Scatter,
        square: Vec2,
    ) -> Vec3 {
        let Some(sun) = self.environment.sun else {
            return Vec3::ZERO;
        };
        let (direction, weight) = sun.sample(square);
        let mut sum = Vec3::ZERO;
        for (number, mirror) in self.mirrors.list.iter().enumerate() {
            let cosine = direction.dot(mirror.normal);
            let toward_mirror = direction.reflect(mirror.normal);
            let toward = scatter.toward(toward_mirror);
            if toward.value <= 0.0 {
                continue;
            }
            let start = Some(at.triangle);
            let Some(hit) = rays.closest(at.position, toward_mirror, start) else {
                continue;
            };
            let met = self.mirrors.of_triangle.get(&hit.triangle);
            let is_meant = |&&(met, is_two_sided): &&(usize, bool)| {
                met == number && (cosine > 0.0 || is_two_sided)
            };
            if met.filter(is_meant).is_some() {
                let point = at.position + toward_mirror * hit.distance;
                let tint = rays.tint(at.position, toward_mirror, start, Some(hit));
                let passed = rays.transmittance_outward(point, direction, Some(hit.triangle));
                sum +=
                    sun.irradiance * (toward.value * weight) * mirror.reflectance * tint * passed;
            }
        }
        sum
    }
}

/// What passes along a ray out of the scene, by channel.
fn passing(rays: &RayTree, at: Place, direction: Vec3) -> Vec3 {
    rays.transmittance_outward(at.position, direction, Some(at.triangle))
}

/// Chooses directions to a picture of the sky with a density proportional to the luminance of its cells.
struct SkyTable {
    sky: SkyPicture,
    columns: u32,
    rows: u32,
    /// Running sums of power over all cells, row by row.
    cumulative: Vec<f64>,
}

impl SkyTable {
    fn new(sky: &SkyPicture) -> Self {
        let picture = &sky.picture;
        let columns = picture.width.min(MOST_CELLS[0]);
        let rows = picture.height.min(MOST_CELLS[1]);
        let mut table = Self {
            sky: sky.clone(),
            columns,
            rows,
            cumulative: Vec::with_capacity(columns as usize * rows as usize),
        };
        // The pixels about a cell, those beside it included, since radiance is interpolated between them.
        let pixels = |cell: u32, cells: u32, size: u32| {
            let [cell, cells, size] = [cell, cells, size].map(u64::from);
            (cell * size / cells, ((cell + 1) * size).div_ceil(cells))
        };
        let mut sum = 0.0;
        for row in 0..rows {
            let (top, bottom) = pixels(row, rows, picture.height);
            let lines = top.saturating_sub(1)..(bottom + 1).min(u64::from(picture.height));
            for column in 0..columns {
                let (left, right) = pixels(column, columns, picture.width);
                let width = u64::from(picture.width);
                let (mut power, mut count) = (0.0, 0.0);
                for line in lines.clone() {
                    for place in left + width - 1..=right + width {
                        let pixel = picture.pixels[(line * width + place % width) as usize];
                        power += strength(pixel * sky.scale);
                        count += 1.0;
                    }
                }
                sum += power / count * table.solid_angle(row);
                table.cumulative.push(sum);
            }
        }
        table
    }

    /// Cosines of the angles from the zenith between which a row lies.
    fn heights(&self, row: u32) -> [f64; 2] {
        let angle = |line: u32| f64::from(line) / f64::from(self.rows) * std::f64::consts::PI;
        [angle(row).cos(), angle(row + 1).cos()]
    }

    /// Of a cell.
    fn solid_angle(&self, row: u32) -> f64 {
        let [above, below] = self.heights(row);
        (above - below) * std::f64::consts::TAU / f64::from(self.columns)
    }

    /// The direction of a point of the unit square: across it chooses a column and the place there, down likewise a row.
    fn direction(&self, square: Vec2) -> Vec3 {
        let columns = self.columns as usize;
        let total = self.cumulative.last().copied().unwrap_or(0.0);
        let before = |index: usize| {
            index
                .checked_sub(1)
                .map_or(0.0, |last| self.cumulative[last])
        };
        // Rows end at every so many cells.
        let wanted = f64::from(square.y) * total;
        let row = self.cumulative.partition_point(|&sum| sum <= wanted) / columns;
        let row = row.min(self.rows as usize - 1);
        let (start, end) = (before(row * columns), before((row + 1) * columns));
        let down = ((wanted - start) / (end - start)).clamp(0.0, 1.0);
        let wanted = start + f64::from(square.x) * (end - start);
        let cells = &self.cumulative[row * columns..(row + 1) * columns];
        let column = cells.partition_point(|&sum| sum <= wanted).min(columns - 1);
        let first = before(row * columns + column);
        let across = ((wanted - first) / (cells[column] - first)).clamp(0.0, 1.0);
        let [above, below] = self.heights(row as u32);
        let down = (above + (below - above) * down).clamp(-1.0, 1.0).acos() / std::f64::consts::PI;
        let across = (column as f64 + across) / f64::from(self.columns);
        self.sky.direction(Vec2::new(across as f32, down as f32))
    }

    /// Probability per steradian of choosing a direction.
    fn density(&self, direction: Vec3) -> f32 {
        let place = self.sky.place(direction);
        let cell = |place: f32, cells: u32| ((place * cells as f32) as u32).min(cells - 1);
        let (column, row) = (cell(place.x, self.columns), cell(place.y, self.rows));
        let index = (row * self.columns + column) as usize;
        let before = index
            .checked_sub(1)
            .map_or(0.0, |last| self.cumulative[last]);
        let total = self.cumulative.last().copied().unwrap_or(0.0);
        ((self.cumulative[index] - before) / total / self.solid_angle(row)) as f32
    }
}

/// As of emitters: no colour is starved.
fn strength(radiance: Vec3) -> f64 {
    f64::from(luminance(radiance).max(radiance.element_sum() / 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        geometry::Random,
        scene::{Sun, Texture, UpAxis},
    };

    /// A sky of these pixels over 8 x 4.
    fn outside(pixel: impl Fn(u32, u32) -> f32, sun: Option<Sun>) -> Outside {
        let pixels = (0..32).map(|index| Vec3::splat(pixel(index % 8, index / 8)));
        let picture = Texture {
            name: String::new(),
            width: 8,
            height: 4,
            pixels: pixels.collect(),
            ..Texture::default()
        };
        let sky = SkyPicture::new(Arc::new(picture), Vec3::ONE, UpAxis::Y, 20.0);
        Outside {
            table: Some(SkyTable::new(&sky)),
            environment: Arc::new(Environment {
                sky: Sky::Picture(sky),
                sun,
                is_default: false,
            }),
            mirrors: SunMirrors::default(),
        }
    }

    fn mean_irradiance(outside: &Outside, normal: Vec3) -> f32 {
        let (rays, count) = (RayTree::clear(), 200_000);
        let at = Place {
            position: Vec3::ZERO,
            normal,
            triangle: TriangleId(0),
        };
        let mut random = Random::new(1, 2);
        let mut sum = 0.0;
        for _ in 0..count {
            let squares = outside.squares(|| random.uniform_2d());
            sum += f64::from(
                outside
                    .irradiance(&rays, at, random.uniform_2d(), squares)
                    .x,
            );
        }
        (sum / f64::from(count)) as f32
    }

    #[test]
    fn densities_add_to_one_and_directions_follow_them() {
        let outside = outside(
            |column, row| if (column, row) == (2, 1) { 1000.0 } else { 1.0 },
            None,
        );
        let table = outside.table.as_ref().expect("a picture");
        let (mut random, mut counts) = (Random::new(3, 4), [0u32; 32]);
        for _ in 0..50_000 {
            let direction = table.direction(random.uniform_2d());
            let place = table.sky.place(direction);
            counts[(place.y * 4.0) as usize * 8 + (place.x * 8.0) as usize % 8] += 1;
        }
        let mut sum = 0.0;
        for (index, count) in counts.into_iter().enumerate() {
            let row = index as u32 / 8;
            let middle =
                Vec2::new((index % 8) as f32 + 0.5, row as f32 + 0.5) / Vec2::new(8.0, 4.0);
            let chance =
                f64::from(table.density(table.sky.direction(middle))) * table.solid_angle(row);
            let scatter = 5.0 * (chance * 50_000.0).sqrt() + 1.0;
            assert!(
                (f64::from(count) - chance * 50_000.0).abs() < scatter,
                "{index}"
            );
            sum += chance;
        }
        assert!((sum - 1.0).abs() < 1e-4, "{sum}");
    }

    #[test]
    fn skies_and_suns_give_open_ground_what_they_should() {
        // A uniform picture: π.
        let even = outside(|_, _| 2.0, None);
        let normal = Vec3::new(0.48, 0.6, 0.64);
        assert!((mean_irradiance(&even, normal) / (2.0 * PI) - 1.0).abs() < 0.01);
        // The sun: E cos θ, whatever its size, while all of it is above the horizon.
        for diameter in [0.53f32.to_radians(), 1.0] {
            let sun = Sun {
                direction: Vec3::new(0.6, 0.8, 0.0),
                irradiance: Vec3::splat(7.0),
                diameter,
            };
            let mut sunny = outside(|_, _| 0.0, Some(sun));
            sunny.table = None;
            let found = mean_irradiance(&sunny, Vec3::Y);
            assert!((found / 5.6 - 1.0).abs() < 0.005, "{diameter}: {found}");
            assert_eq!(mean_irradiance(&sunny, Vec3::NEG_Y), 0.0);
        }
        // A small bright part, against the midpoint rule.
        let spot = outside(
            |column, row| if (column, row) == (5, 1) { 500.0 } else { 0.5 },
            None,
        );
        let (mut expected, steps) = (0.0, 400);
        for row in 0..steps {
            for column in 0..2 * steps {
                let [across, down] = [(column, 2 * steps), (row, steps)]
                    .map(|(at, of)| (at as f32 + 0.5) / of as f32);
                let Sky::Picture(sky) = &spot.environment.sky else {
                    panic!("no picture");
                };
                let direction = sky.direction(Vec2::new(across, down));
                let part = (down * PI).sin() * (PI / steps as f32).powi(2);
                let seen = sky.radiance(direction).x * direction.dot(normal).max(0.0);
                expected += f64::from(seen * part);
            }
        }
        let found = f64::from(mean_irradiance(&spot, normal));
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{found} for {expected}"
        );
    }
}
