//! Checks that a hierarchy keeps its promises; for tests, after every build and division.

use glam::Vec3;

use super::{Hierarchy, NodeId};

impl Hierarchy {
    /// The first promise that is broken, in words.
    ///
    /// # Errors
    /// Names the node and what is wrong with it.
    pub fn validate(&self) -> Result<(), String> {
        self.validate_clusters()?;
        self.validate_elements()?;
        self.validate_colors()?;
        self.validate_balance()
    }

    /// Clusters cover each patch once, children divide their parent's range and lie in its box.
    fn validate_clusters(&self) -> Result<(), String> {
        let root = self.clusters.first().ok_or("no root cluster")?;
        if root.start != 0 || root.end as usize > self.patches.len() {
            return Err("the root does not begin with the first patch".to_owned());
        }
        for (index, cluster) in self.clusters.iter().enumerate() {
            let children = self.children(NodeId(index as u32));
            if cluster.is_leaf() {
                continue;
            }
            let [first, second] =
                [children.start, children.end - 1].map(|child| &self.clusters[child as usize]);
            let divides = first.start == cluster.start
                && first.end == second.start
                && second.end == cluster.end;
            if !divides || first.patches().is_empty() || second.patches().is_empty() {
                return Err(format!(
                    "cluster {index}: children do not divide its patches"
                ));
            }
            for child in [first, second] {
                if child.parent != index as u32
                    || child.min.cmplt(cluster.min).any()
                    || child.max.cmpgt(cluster.max).any()
                {
                    return Err(format!("cluster {index}: a child does not lie in it"));
                }
            }
            let area = first.area + second.area;
            if (area - cluster.area).abs() > 1e-5 * cluster.area {
                return Err(format!(
                    "cluster {index}: area {} but children have {area}",
                    cluster.area
                ));
            }
        }
        Ok(())
    }

    /// Parents have the mean colours of their children, which have equal areas.
    fn validate_colors(&self) -> Result<(), String> {
        for (index, element) in self.mesh.elements.iter().enumerate() {
            if element.is_leaf() {
                continue;
            }
            let count = f32::from(element.child_count);
            let mean =
                |of: &dyn Fn(usize) -> Vec3| element.children().map(of).sum::<Vec3>() / count;
            for (own, mean) in [
                (
                    self.reflectance_of(index),
                    mean(&|child| self.reflectance_of(child)),
                ),
                (
                    self.emission_of(index),
                    mean(&|child| self.emission_of(child)),
                ),
            ] {
                if (own - mean).abs().cmpgt(1e-5 * own + 1e-7).any() {
                    return Err(format!(
                        "element {index}: colour {own} but its children have {mean}"
                    ));
                }
            }
        }
        Ok(())
    }

    /// Children of elements share their parent's area and patch.
    fn validate_elements(&self) -> Result<(), String> {
        let elements = &self.mesh.elements;
        for (index, element) in elements.iter().enumerate() {
            for child in element.children() {
                let child = elements
                    .get(child)
                    .ok_or(format!("element {index}: missing child"))?;
                if child.parent != index as u32
                    || child.patch != element.patch
                    || child.level != element.level + element.child_count / 2
                {
                    return Err(format!("element {index}: a child does not belong to it"));
                }
                let share = 1.0 / f32::from(element.child_count);
                if child.area_vector != element.area_vector * share {
                    return Err(format!(
                        "element {index}: a child has not its share of the area"
                    ));
                }
            }
        }
        Ok(())
    }

    /// No edge of a leaf carries more than one hanging point.
    fn validate_balance(&self) -> Result<(), String> {
        for leaf in self.mesh.active_leaves() {
            if self.mesh.hangs_twice(leaf) {
                return Err(format!("element {leaf}: a neighbour is two levels finer"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::{
        geometry::Random,
        scene::{Material, SceneBuilder, SceneOptions},
    };

    /// A bumpy sheet of `2 · side²` triangles.
    fn sheet(side: u32, seed: u64) -> SceneBuilder {
        long_sheet(side, seed, 1.0)
    }

    /// A bumpy sheet of `2 · side²` triangles that are so many times as long as wide.
    fn long_sheet(side: u32, seed: u64, length: f64) -> SceneBuilder {
        let mut random = Random::new(seed, 0);
        let mut builder = SceneBuilder::default();
        let material = builder.push_material(Material::plain("grey", Vec3::splat(0.5), Vec3::ONE));
        for row in 0..=side {
            for column in 0..=side {
                builder.push_position(DVec3::new(
                    length * f64::from(column),
                    f64::from(random.uniform()),
                    row.into(),
                ));
            }
        }
        for row in 0..side {
            for column in 0..side {
                let a = row * (side + 1) + column;
                let (b, c, d) = (a + 1, a + side + 1, a + side + 2);
                builder.push_triangle([a, c, b], material);
                builder.push_triangle([b, c, d], material);
            }
        }
        builder
    }

    fn hierarchy(builder: SceneBuilder) -> Hierarchy {
        let scene = builder
            .finish(&SceneOptions::default())
            .expect("the sheet has faces");
        Hierarchy::new(&scene, 40.0)
    }

    #[test]
    fn hierarchies_of_any_size_keep_their_promises() {
        for side in [1, 2, 3, 7, 20] {
            hierarchy(sheet(side, 1)).validate().unwrap();
        }
    }

    #[test]
    fn a_hundred_thousand_triangles_of_one_centroid_make_a_shallow_tree() {
        let mut builder = SceneBuilder::default();
        let material = builder.push_material(Material::plain("grey", Vec3::splat(0.5), Vec3::ONE));
        for index in 0..100_000 {
            let angle = f64::from(index) * 1e-3;
            let size = 1.0 + f64::from(index) * 1e-5;
            let corners = [0.0, 1.0, 2.0].map(|third| {
                let (sine, cosine) = (angle + third * std::f64::consts::TAU / 3.0).sin_cos();
                builder.push_position(DVec3::new(size * cosine, 0.0, size * sine))
            });
            builder.push_triangle(corners, material);
        }
        let hierarchy = hierarchy(builder);
        hierarchy.validate().unwrap();
        let deepest = (0..hierarchy.patches.len())
            .map(|patch| hierarchy.clusters_over(patch).count())
            .max();
        // Cuts by extent go on for a while among rounding; from the given depth on each halves the patches.
        assert!(deepest <= Some(48 + 18), "{deepest:?}");
    }

    #[test]
    fn subtrees_cover_the_tree_once() {
        for side in [1, 30, 90] {
            let hierarchy = hierarchy(sheet(side, 2));
            let cover = &hierarchy.subtrees;
            let mut seen: Vec<usize> = cover.runs.iter().cloned().flatten().collect();
            seen.extend(&cover.top);
            seen.sort_unstable();
            assert!(seen.iter().copied().eq(0..hierarchy.clusters.len()));
            for run in &cover.runs {
                let root = hierarchy.clusters[run.start].parent;
                assert!(cover.top.contains(&(root as usize)));
                let is_inside = |&parent: &u32| parent == root || run.contains(&(parent as usize));
                let mut parents = hierarchy.clusters[run.clone()].iter().map(|c| c.parent);
                assert!(parents.all(|parent| is_inside(&parent)));
            }
            assert!(side < 90 || cover.top.len() < 100, "{}", cover.top.len());
        }
    }

    #[test]
    fn random_divisions_stay_balanced() {
        for (seed, length) in [(0, 1.0), (1, 1.0), (2, 5.0), (3, 20.0), (4, 100.0)] {
            let mut hierarchy = hierarchy(long_sheet(4, seed, length));
            let mut random = Random::new(seed, 1);
            for _ in 0..40 {
                let wanted = random.below(hierarchy.mesh.elements.len() as u32);
                hierarchy.mesh.divide(&[wanted]);
                hierarchy.validate().unwrap();
            }
        }
    }

    #[test]
    fn deep_division_at_one_corner_stays_balanced() {
        for length in [1.0, 30.0] {
            let mut hierarchy = hierarchy(long_sheet(3, 3, length));
            for _ in 0..8 {
                let corner = hierarchy
                    .mesh
                    .leaves()
                    .find(|&leaf| hierarchy.mesh.elements[leaf].vertices.contains(&0));
                hierarchy.mesh.divide(&[corner.unwrap() as u32]);
                hierarchy.validate().unwrap();
            }
        }
    }

    #[test]
    fn parts_of_slivers_count_by_their_length() {
        for (length, halvings) in [(1.0, 1), (40.0, 2)] {
            let mut hierarchy = hierarchy(long_sheet(1, 5, length));
            let largest = |hierarchy: &Hierarchy| {
                let sizes = hierarchy.mesh.leaves();
                let sizes = sizes.map(|leaf| hierarchy.mesh.size_of_parts(leaf));
                sizes.fold(0.0, f32::max)
            };
            let before = largest(&hierarchy);
            let area = hierarchy.mesh.elements[0].area_vector.length();
            assert_eq!(before > area, length > 2.0, "{before} {area}");
            // Halves of a triangle with two long edges have one of them.
            for _ in 0..halvings {
                let wanted: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
                assert!(hierarchy.mesh.divide(&wanted));
            }
            let ratio = largest(&hierarchy) / before;
            assert!((0.2..0.3).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn division_makes_slivers_shorter() {
        let mut hierarchy = hierarchy(long_sheet(2, 5, 40.0));
        // Lengths over heights: their largest, and their mean by area.
        let lengths = |hierarchy: &Hierarchy| {
            let (mut most, mut sum, mut whole) = (0.0f32, 0.0, 0.0);
            for leaf in hierarchy.mesh.leaves() {
                let [a, b, c] = hierarchy.mesh.corners(leaf);
                let area = hierarchy.mesh.elements[leaf].area_vector.length();
                let sides = [a.distance(b), b.distance(c), c.distance(a)];
                let length = sides.into_iter().fold(0.0, f32::max).powi(2) / (2.0 * area);
                (most, sum, whole) = (most.max(length), sum + length * area, whole + area);
            }
            (most, sum / whole)
        };
        let before = lengths(&hierarchy);
        for _ in 0..10 {
            let wanted: Vec<u32> = hierarchy.mesh.leaves().map(|leaf| leaf as u32).collect();
            hierarchy.mesh.divide(&wanted);
        }
        hierarchy.validate().unwrap();
        let after = lengths(&hierarchy);
        assert!(after.1 < 0.5 * before.1, "{before:?} {after:?}");
        assert!(after.0 < 2.5 * before.0, "{before:?} {after:?}");
    }

    #[test]
    fn closed_edges_leave_no_crack() {
        for length in [1.0, 12.0] {
            assert_closed(hierarchy(long_sheet(3, 4, length)), length as f32);
        }
    }

    /// Divide here and there, and look for open edges.
    fn assert_closed(mut hierarchy: Hierarchy, length: f32) {
        for _ in 0..4 {
            let wanted: Vec<u32> = hierarchy
                .mesh
                .leaves()
                .step_by(5)
                .map(|leaf| leaf as u32)
                .collect();
            hierarchy.mesh.divide(&wanted);
        }
        let triangles = hierarchy.mesh.crack_free_triangles();
        // Each edge inside the sheet has as many triangles on one side as on the other.
        let mut balance = std::collections::HashMap::new();
        for (_, vertices) in &triangles {
            let points = vertices.map(|vertex| hierarchy.mesh.vertices[vertex as usize].point);
            for side in 0..3 {
                let (a, b) = (points[side], points[(side + 1) % 3]);
                *balance.entry((a.min(b), a.max(b))).or_insert(0) += if a < b { 1 } else { -1 };
            }
        }
        let border = |point: u32| {
            let position = hierarchy.mesh.points[point as usize];
            // The longer side spans the frame.
            let rim = 0.999 * 50.0;
            (position.x.abs() > rim, position.z.abs() * length > rim)
        };
        for ((a, b), sum) in balance {
            let (a, b) = (border(a), border(b));
            let on_rim = (a.0 && b.0) || (a.1 && b.1);
            assert!(sum == 0 || on_rim, "open edge inside the sheet");
        }
    }
}
