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
}

impl Triangulator {
    /// Cut a polygon; the result indexes its corners, keeps their winding, and has no triangle without area unless it
    /// is the only one. Also returns whether the polygon had too many corners to be cut well.
    pub(super) fn cut(&mut self, polygon: &[DVec3]) -> (&[u32], bool) {
        self.triangles.clear();
        let count = polygon.len();
        self.project(polygon);
        let convex = self.is_convex();
        let too_many = !convex && count > MAX_CLIPPED_CORNERS;
        if !convex && !too_many {
            self.clip();
        }
        if self.triangles.is_empty() {
            let fan = (2..count as u32).flat_map(|last| [0, last - 1, last]);
            self.triangles.extend(fan);
        }
        self.drop_slivers(polygon);
        (&self.triangles, too_many)
    }

    /// Fill [`Self::plane`] such that the polygon runs counter-clockwise.
    fn project(&mut self, polygon: &[DVec3]) {
        let origin = polygon.first().copied().unwrap_or_default();
        let normal = newell_normal(polygon, origin);
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
            if !super::build::is_degenerate(corners) {
                self.triangles.copy_within(start..start + 3, kept);
                kept += 3;
            }
        }
        self.triangles.truncate(kept.max(3));
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
                let (triangles, too_many) = triangulator.cut(&polygon);
                let normal = right.cross(up);
                assert!(!too_many);
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
    fn polygon_on_a_line_gives_one_triangle_to_count() {
        let polygon = [0.0, 1.0, 2.0, 3.0].map(|x| DVec3::new(x, 0.0, 0.0));
        let mut triangulator = Triangulator::default();
        assert_eq!(triangulator.cut(&polygon).0.len(), 3);
    }
}
