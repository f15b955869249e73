//! Polygons into triangles: convex ones as fans, others by ear clipping in the plane they are closest to.

use glam::{DVec2, DVec3};

/// Corners up to which a polygon that is not convex is clipped ear by ear, which takes up to the square of their
/// number (0.1 s for a bad case of this size). Fewer would spoil real floor plans and glyphs, more could hang.
pub(super) const MAX_CLIPPED_CORNERS: usize = 20_000;

/// Cuts polygons; keeps its buffers from one to the next.
#[derive(Default)]
pub(super) struct Triangulator {
    plane: Vec<[f64; 2]>,
    ears: Option<earcut::Earcut<f64>>,
    triangles: Vec<u32>,
    /// Edges by their first corners, in the order of their least x.
    edges: Vec<u32>,
}

/// Why the triangles of a polygon may not be what was meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Doubt {
    /// It is not convex and has too many corners to be cut well.
    TooManyCorners,
    /// Its edges cross each other, as those of a bow tie.
    CrossesItself,
}

/// How far both of two edges must reach past each other to cross, as a share of the polygon's extent. Smaller, and
/// corners that only touch an edge cross it by the rounding of the file's digits; larger, and crossings of thin parts are
/// missed.
const CROSSING_DEPTH: f64 = 1e-5;

impl Triangulator {
    /// Cut a polygon; the result indexes its corners, keeps their winding, and has no triangle without area unless it
    /// is the only one.
    pub(super) fn cut(&mut self, polygon: &[DVec3]) -> (&[u32], Option<Doubt>) {
        self.triangles.clear();
        let count = polygon.len();
        self.project(polygon);
        let convex = self.is_convex();
        let doubt = if convex {
            None
        } else if count > MAX_CLIPPED_CORNERS {
            Some(Doubt::TooManyCorners)
        } else {
            self.clip();
            self.crosses_itself().then_some(Doubt::CrossesItself)
        };
        if self.triangles.is_empty() {
            let fan = (2..count as u32).flat_map(|last| [0, last - 1, last]);
            self.triangles.extend(fan);
        }
        self.drop_slivers(polygon);
        (&self.triangles, doubt)
    }

    /// Fill [`Self::plane`] such that the polygon runs counter-clockwise.
    fn project(&mut self, polygon: &[DVec3]) {
        let origin = polygon.first().copied().unwrap_or_default();
        let normal = normal_of(polygon, origin);
        let size = normal.abs();
        let flat = |point: DVec3| {
            if size.x >= size.y && size.x >= size.z {
                (DVec2::new(point.y, point.z), normal.x)
            } else if size.y >= size.z {
                (DVec2::new(point.z, point.x), normal.y)
            } else {
                (DVec2::new(point.x, point.y), normal.z)
            }
        };
        self.plane.clear();
        self.plane.extend(polygon.iter().map(|&point| {
            let (point, sign) = flat(point - origin);
            if sign < 0.0 {
                [point.y, point.x]
            } else {
                [point.x, point.y]
            }
        }));
    }

    /// Whether the polygon turns left at every corner and goes round once.
    fn is_convex(&self) -> bool {
        let count = self.plane.len();
        if count <= 3 {
            return true;
        }
        let point = |index: usize| DVec2::from_array(self.plane[index % count]);
        let mut descents = 0;
        let mut was_right = None;
        let mut first_right = None;
        for index in 0..count {
            let edge = point(index + 1) - point(index);
            if edge.perp_dot(point(index + 2) - point(index + 1)) < 0.0 {
                return false;
            }
            // A simple convex polygon changes between going right and going left just twice.
            if edge.x != 0.0 {
                let right = edge.x > 0.0;
                first_right.get_or_insert(right);
                descents += usize::from(was_right.is_some_and(|was| was != right));
                was_right = Some(right);
            }
        }
        descents + usize::from(was_right != first_right) <= 2
    }

    /// Whether edges of [`Self::plane`] cross each other.
    fn crosses_itself(&mut self) -> bool {
        let count = self.plane.len();
        let point = |index: usize| DVec2::from_array(self.plane[index % count]);
        let edge = |first: u32| [point(first as usize), point(first as usize + 1)];
        let (min, max) = (0..count)
            .map(point)
            .fold((DVec2::MAX, DVec2::MIN), |(min, max), at| {
                (min.min(at), max.max(at))
            });
        let depth = CROSSING_DEPTH * (max - min).max_element();
        let edges = &mut self.edges;
        edges.clear();
        edges.extend(0..count as u32);
        let least = |first: u32| edge(first)[0].x.min(edge(first)[1].x);
        edges.sort_unstable_by(|&one, &other| least(one).total_cmp(&least(other)));
        edges.iter().enumerate().any(|(place, &one)| {
            let [a, b] = edge(one);
            edges[place + 1..]
                .iter()
                .map(|&other| edge(other))
                .take_while(|[c, d]| c.x.min(d.x) < a.x.max(b.x))
                .any(|[c, d]| cross_deeply([a, b], [c, d], depth))
        })
    }

    /// Clip ears of [`Self::plane`] into [`Self::triangles`], wound as the polygon is.
    fn clip(&mut self) {
        let ears = self.ears.get_or_insert_with(earcut::Earcut::new);
        let plane = &self.plane;
        let none: [u32; 0] = [];
        ears.earcut(plane.iter().copied(), &none, &mut self.triangles);
        for triangle in self.triangles.chunks_exact_mut(3) {
            let [a, b, c] =
                [0, 1, 2].map(|corner| DVec2::from_array(plane[triangle[corner] as usize]));
            if (b - a).perp_dot(c - a) < 0.0 {
                triangle.swap(1, 2);
            }
        }
    }

    /// Remove triangles without area, which straight corners leave; the last one stays, to be counted as a bad face.
    fn drop_slivers(&mut self, polygon: &[DVec3]) {
        if self.triangles.len() <= 3 {
            return;
        }
        let mut kept = 0;
        for start in (0..self.triangles.len()).step_by(3) {
            let corners = [0, 1, 2].map(|corner| polygon[self.triangles[start + corner] as usize]);
            if !super::usable::is_degenerate(corners) {
                self.triangles.copy_within(start..start + 3, kept);
                kept += 3;
            }
        }
        self.triangles.truncate(kept.max(3));
    }
}

/// Whether each of two edges has its ends on both sides of the other's line, at least so far away from it.
fn cross_deeply([a, b]: [DVec2; 2], [c, d]: [DVec2; 2], depth: f64) -> bool {
    if c.y.max(d.y) < a.y.min(b.y) || c.y.min(d.y) > a.y.max(b.y) {
        return false;
    }
    let parts = |from: DVec2, to: DVec2, points: [DVec2; 2]| {
        let along = to - from;
        let [one, other] = points.map(|point| along.perp_dot(point - from));
        let far = depth * along.length();
        one.min(other) < -far && one.max(other) > far
    };
    parts(a, b, [c, d]) && parts(c, d, [a, b])
}

/// A vector across a polygon: twice its area vector, or what is across its widest corner where the parts of the area
/// cancel each other, as in a bow tie.
fn normal_of(polygon: &[DVec3], origin: DVec3) -> DVec3 {
    let normal = newell_normal(polygon, origin);
    let count = polygon.len();
    let corner = |index: usize| {
        let [a, b, c] = [0, 1, 2].map(|next| polygon[(index + next) % count]);
        (b - a).cross(c - b)
    };
    let is_wider = |a: &DVec3, b: &DVec3| a.length_squared().total_cmp(&b.length_squared());
    match (0..count).map(corner).max_by(is_wider) {
        // Rounding leaves about 1e-16 of it.
        Some(widest) if normal.length() < 1e-9 * widest.length() => widest,
        _ => normal,
    }
}

/// Twice the area vector of a polygon.
fn newell_normal(polygon: &[DVec3], origin: DVec3) -> DVec3 {
    polygon
        .windows(2)
        .map(|pair| (pair[0] - origin).cross(pair[1] - origin))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area_vector(polygon: &[DVec3]) -> DVec3 {
        let mut triangulator = Triangulator::default();
        let (triangles, _) = triangulator.cut(polygon);
        triangles
            .chunks_exact(3)
            .map(|t| {
                let [a, b, c] = [0, 1, 2].map(|corner| polygon[t[corner] as usize]);
                (b - a).cross(c - a) * 0.5
            })
            .sum()
    }

    /// A star in the plane of two vectors; radius alternates, so every other corner is concave.
    fn star(count: usize, right: DVec3, up: DVec3) -> Vec<DVec3> {
        (0..count)
            .map(|i| {
                let angle = std::f64::consts::TAU * i as f64 / count as f64;
                let radius = if i % 2 == 0 { 1.0 } else { 0.4 };
                (right * angle.cos() + up * angle.sin()) * radius
            })
            .collect()
    }

    #[test]
    fn concave_polygons_keep_area_and_winding_in_every_plane() {
        for (right, up) in [
            (DVec3::X, DVec3::Y),
            (DVec3::Y, DVec3::X),
            (DVec3::Y, DVec3::Z),
            (DVec3::Z, DVec3::Y),
            (DVec3::Z, DVec3::X),
            (DVec3::X, DVec3::Z),
        ] {
            for count in [8, 10_000] {
                let polygon = star(count, right, up);
                let mut triangulator = Triangulator::default();
                let (triangles, doubt) = triangulator.cut(&polygon);
                let normal = right.cross(up);
                assert_eq!(doubt, None);
                for t in triangles.chunks_exact(3) {
                    let [a, b, c] = [0, 1, 2].map(|corner| polygon[t[corner] as usize]);
                    assert!((b - a).cross(c - a).dot(normal) > 0.0, "{right} {up}");
                }
                let exact =
                    newell_normal(&polygon, DVec3::ZERO) + polygon[count - 1].cross(polygon[0]);
                assert!((area_vector(&polygon) - exact * 0.5).length() < 1e-9);
            }
        }
    }

    #[test]
    fn convex_polygon_is_a_fan_and_straight_corners_leave_no_sliver() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
        let polygon = corners.map(|[x, y]| DVec3::new(x, y, 0.0));
        let mut triangulator = Triangulator::default();
        assert_eq!(triangulator.cut(&polygon).0, [0, 2, 3, 0, 3, 4]);
    }

    #[test]
    fn polygons_that_cross_themselves_are_told() {
        // Named, corners in the plane, and whether edges cross.
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let cases: [(&str, Vec<[f64; 2]>, bool); 8] = [
            ("square", square.to_vec(), false),
            ("bow tie", [0, 2, 1, 3].map(|k| square[k]).to_vec(), true),
            (
                "bow tie of unequal wings",
                vec![[0.0, 0.0], [3.0, 0.0], [1.0, 1.0], [2.0, 1.0]],
                true,
            ),
            (
                "pentagram",
                (0..5)
                    .map(|k| (f64::from(k) * 0.8 * std::f64::consts::PI).sin_cos().into())
                    .collect(),
                true,
            ),
            (
                "arrow",
                vec![[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]],
                false,
            ),
            (
                "hole behind a bridge",
                vec![
                    [0.0, 0.0],
                    [9.0, 0.0],
                    [9.0, 9.0],
                    [0.0, 9.0],
                    [0.0, 0.0],
                    [3.0, 3.0],
                    [3.0, 6.0],
                    [6.0, 6.0],
                    [6.0, 3.0],
                    [3.0, 3.0],
                ],
                false,
            ),
            (
                "corner on another edge but for rounding",
                vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, -1e-6], [0.0, 4.0]],
                false,
            ),
            (
                "corner past another edge",
                vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, -0.1], [0.0, 4.0]],
                true,
            ),
        ];
        for (name, corners, crosses) in cases {
            for turned in 0..3 {
                let polygon: Vec<DVec3> = corners
                    .iter()
                    .map(|&[x, y]| {
                        let mut place = [x, y, 0.5];
                        place.rotate_right(turned);
                        DVec3::from_array(place)
                    })
                    .collect();
                let mut triangulator = Triangulator::default();
                let (_, doubt) = triangulator.cut(&polygon);
                let expected = crosses.then_some(Doubt::CrossesItself);
                assert_eq!(doubt, expected, "{name}, turned {turned} times");
            }
        }
    }

    #[test]
    fn polygon_on_a_line_gives_one_triangle_to_count() {
        let polygon = [0.0, 1.0, 2.0, 3.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let mut triangulator = Triangulator::default();
        assert_eq!(triangulator.cut(&polygon).0.len(), 3);
    }
}
