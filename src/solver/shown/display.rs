//! The snapshot of a solve, made from its state.

use std::{f32::consts::PI, sync::Arc};

use glam::{Vec2, Vec3, Vec4};

use super::seams::Seams;
use crate::{
    geometry::area_vector,
    hierarchy::{Channels as _, Cluster, Hierarchy, NodeId},
    scene::{Appearance, Scene, TriangleId},
    solver::{
        Cancel, ClusterBox, DisplayMesh, Omitted, Snapshot, VertexLight,
        direct::Surfaces,
        iteration::LinkedLight,
        vertices::{LeafLight, vertex_means},
    },
    transport::luminance,
};

/// A triangle of the display mesh: its element and its vertices.
pub(super) type DisplayTriangle = (u32, [u32; 3]);

/// The triangles of a crack-free mesh of the elements; `None` if the elements are those of the current display mesh, and as
/// many of them lie inside solids.
pub(crate) fn changed_triangles(
    hierarchy: &mut Hierarchy,
    current: &DisplayMesh,
) -> Option<Vec<DisplayTriangle>> {
    let has_changed = current.indices.is_empty()
        || current.own_vertex_count() != hierarchy.mesh.vertices.len()
        || leaf_counts(hierarchy) != shown_leaf_counts(current);
    has_changed.then(|| hierarchy.mesh.crack_free_triangles())
}

/// The state from which a snapshot is made.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Appearance by material.
    pub appearances: &'a [Appearance],
    /// The elements, with their direct light.
    pub surfaces: Surfaces<'a>,
    /// Light over links.
    pub linked: &'a LinkedLight,
    /// Linked light of the leaves.
    pub leaves: &'a [LeafLight],
    /// Factor of the linked light by vertex; empty for 1.
    pub factors: &'a [Vec4],
    /// The omissions of the plan.
    pub omitted: &'a Arc<Vec<Omitted>>,
    /// Number of the step.
    pub step: u32,
}

impl View<'_> {
    /// The snapshot after a step: with a new mesh of these triangles (see [`changed_triangles`]), or, for `None`, with
    /// that of the snapshot before. `None` when cancelled.
    pub(crate) fn show(
        &self,
        triangles: Option<Vec<DisplayTriangle>>,
        before: &Snapshot,
        cancel: &Cancel,
    ) -> Option<Snapshot> {
        let hierarchy = self.surfaces.hierarchy;
        // These three are independent.
        let ((mesh, means), direct) = rayon::join(
            || {
                rayon::join(
                    || match triangles {
                        Some(triangles) => self.display_mesh(triangles, cancel).map(Arc::new),
                        None => Some(before.mesh.clone()),
                    },
                    || vertex_means(hierarchy, self.leaves, self.factors),
                )
            },
            || self.surfaces.direct.shown(hierarchy),
        );
        let mesh = mesh?;
        cancel.proceed()?;
        let (light, clusters) = rayon::join(
            || self.vertex_light(&means, direct.as_deref(), &mesh),
            || self.cluster_boxes(cancel),
        );
        Some(Snapshot {
            step: self.step,
            mesh,
            light: Arc::new(light),
            clusters: Arc::new(clusters?),
            omitted: self.omitted.clone(),
            lights: None,
            errors: Arc::default(),
        })
    }

    /// The display mesh of some triangles; `None` when cancelled.
    fn display_mesh(
        &self,
        triangles: Vec<DisplayTriangle>,
        cancel: &Cancel,
    ) -> Option<DisplayMesh> {
        let hierarchy = self.surfaces.hierarchy;
        let mesh = &hierarchy.mesh;
        let count = mesh.vertices.len();
        let has_texcoords = !self.scene.texcoords.is_empty();
        let mut seams = Seams::default();
        let mut display = DisplayMesh {
            positions: (0..count as u32)
                .map(|vertex| mesh.position(vertex))
                .collect(),
            normals: vec![Vec3::ZERO; count],
            texcoords: vec![Vec2::NAN; if has_texcoords { count } else { 0 }],
            ..DisplayMesh::default()
        };
        // Triangles, with copies of vertices where texture coordinates differ, and inside solids.
        for (element, vertices) in triangles {
            let patch = hierarchy.patch_of(element as usize);
            let corners = vertices.map(|vertex| display.positions[vertex as usize]);
            let weight = area_vector(corners).length().max(f32::MIN_POSITIVE);
            for vertex in vertices.map(|vertex| vertex as usize) {
                display.normals[vertex] += patch.normal * weight;
            }
            let is_covered = mesh.elements[element as usize].is_covered;
            let shown = vertices.map(|vertex| {
                let point = display.positions[vertex as usize];
                let uv = has_texcoords.then(|| self.texcoord_at(patch.triangle, point));
                seams.vertex_with(vertex, uv, is_covered, &mut display)
            });
            display.indices.push(shown);
            display.triangle_of.push(patch.triangle.0);
            display.is_back.push(patch.is_back);
            display
                .element_of
                .push(hierarchy.clusters.len() as u32 + element);
        }
        cancel.proceed()?;
        // Values of the vertices.
        let normals = display.normals.iter();
        let mut normals: Vec<Vec3> = normals.map(|normal| normal.normalize_or_zero()).collect();
        display.repeat(&mut normals);
        display.normals = normals;
        // Vertices without a triangle.
        for uv in display.texcoords.iter_mut().filter(|uv| uv.is_nan()) {
            *uv = Vec2::ZERO;
        }
        color(hierarchy, self.appearances, &mut display);
        Some(display)
    }

    /// Texture coordinates of a point of a triangle.
    fn texcoord_at(&self, triangle: TriangleId, point: Vec3) -> Vec2 {
        let uv = self.scene.texcoords[triangle.index()];
        let [a, b, c] = self.scene.corners(triangle);
        let whole = area_vector([a, b, c]);
        let scale = 1.0 / whole.length_squared().max(f32::MIN_POSITIVE);
        let u = area_vector([point, b, c]).dot(whole) * scale;
        let v = area_vector([a, point, c]).dot(whole) * scale;
        let place = uv[0] * u + uv[1] * v + uv[2] * (1.0 - u - v);
        if place.is_finite() { place } else { uv[0] }
    }

    /// Largest radiosity by channel, with the light from outside: no irradiance can be larger.
    fn brightest(&self) -> Vec4 {
        let (surfaces, hierarchy) = (self.surfaces, self.surfaces.hierarchy);
        let sampled = |leaf: usize| match surfaces.is_sampled(leaf) {
            true => (hierarchy.emission_of(leaf) * PI).extend(0.0),
            false => Vec4::ZERO,
        };
        let leaves = hierarchy.mesh.leaves();
        let of_met = |leaf| hierarchy.opacity_of(leaf).max(f32::MIN_POSITIVE);
        leaves
            .map(|leaf| (self.linked.radiosity(surfaces, leaf) + sampled(leaf)) / of_met(leaf))
            .fold(Vec4::ZERO, Vec4::max)
            + surfaces.direct.brightest_outside()
    }

    /// Light at the vertices: from links as means of the leaves about them, and straight from emitters.
    fn vertex_light(
        &self,
        means: &[Vec4],
        direct: Option<&[Vec4]>,
        mesh: &DisplayMesh,
    ) -> VertexLight {
        let count = means.len();
        let mut light = VertexLight {
            irradiance: Vec::with_capacity(count),
            direct: Vec::with_capacity(count),
        };
        let brightest = self.brightest();
        for (vertex, &linked) in means.iter().enumerate() {
            let direct = direct.map_or(Vec4::ZERO, |direct| direct[vertex]);
            light
                .irradiance
                .push(displayable((linked + direct).min(brightest)));
            light.direct.push(displayable(direct));
        }
        mesh.repeat_light(&mut light.irradiance);
        mesh.repeat_light(&mut light.direct);
        light
    }

    /// Figures of all clusters; `None` when cancelled.
    fn cluster_boxes(&self, cancel: &Cancel) -> Option<Vec<ClusterBox>> {
        let clusters = &self.surfaces.hierarchy.clusters;
        let mut boxes: Vec<ClusterBox> = Vec::with_capacity(clusters.len());
        for (index, cluster) in clusters.iter().enumerate() {
            let level = match cluster.parent {
                u32::MAX => 0,
                parent => boxes[parent as usize].level + 1,
            };
            boxes.push(self.cluster_box(index, cluster, level));
        }
        cancel.proceed()?;
        for link in self.linked.links.all() {
            if let Some(source) = boxes.get_mut(link.source.index()) {
                source.source_count += 1;
            }
        }
        self.add_sampled_emission(&mut boxes);
        Some(boxes)
    }

    /// Add the power of sampled emitters, which the tables do not contain.
    fn add_sampled_emission(&self, boxes: &mut [ClusterBox]) {
        let Surfaces {
            hierarchy, direct, ..
        } = self.surfaces;
        for index in direct.sampled_patches() {
            let patch = &hierarchy.patches[index];
            let radiosity = luminance((patch.emission * PI).extend(0.0));
            let vector = patch.area_vector * radiosity;
            for cluster in hierarchy.clusters_over(index) {
                let shown = &mut boxes[cluster];
                shown.power += vector.length();
                for axis in 0..3 {
                    shown.face_power[2 * axis] += vector[axis].max(0.0);
                    shown.face_power[2 * axis + 1] += (-vector[axis]).max(0.0);
                }
            }
        }
    }

    fn cluster_box(&self, index: usize, cluster: &Cluster, level: u32) -> ClusterBox {
        let links = self.linked.links.of(NodeId(index as u32));
        let moments = &self.linked.power.clusters[index];
        let vector = moments.area_vector();
        let total = moments.total().area();
        ClusterBox {
            min: cluster.min,
            max: cluster.max,
            level,
            parent: cluster.parent,
            patch_count: cluster.end - cluster.start,
            area: cluster.area,
            power: luminance(moments.total()),
            direction_spread: if total > 0.0 {
                (1.0 - vector.length() / total).clamp(0.0, 1.0)
            } else {
                0.0
            },
            link_count: links.len() as u32,
            source_count: 0,
            error: links.iter().map(|link| link.error).sum(),
            face_power: moments.six_faces().map(luminance),
        }
    }
}

/// Number of leaves, and of those that are covered.
fn leaf_counts(hierarchy: &Hierarchy) -> [usize; 2] {
    let mesh = &hierarchy.mesh;
    let is_covered = |leaf: &usize| mesh.elements[*leaf].is_covered;
    [
        mesh.leaves().count(),
        mesh.leaves().filter(is_covered).count(),
    ]
}

/// The same of a display mesh: triangles of one element are consecutive.
fn shown_leaf_counts(mesh: &DisplayMesh) -> [usize; 2] {
    let of = &mesh.element_of;
    let firsts = (0..of.len()).filter(|&at| at == 0 || of[at] != of[at - 1]);
    let covered = firsts.clone().filter(|&first| mesh.is_covered(first));
    [firsts.count(), covered.count()]
}

/// Set the colours of the vertices of a display mesh to the means of the elements about them, weighted by the area that
/// rays meet: what they pass has no colour.
pub(crate) fn color(hierarchy: &Hierarchy, appearances: &[Appearance], display: &mut DisplayMesh) {
    let count = display.positions.len();
    let base = hierarchy.clusters.len() as u32;
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO, 0.0f32); count];
    for (vertices, element) in display.indices.iter().zip(&display.element_of) {
        let element = (element - base) as usize;
        let Met { colors, opacity } = Met::of(hierarchy, element);
        let corners = vertices.map(|vertex| display.positions[vertex as usize]);
        let area = area_vector(corners).length().max(f32::MIN_POSITIVE);
        let weight = area * opacity;
        for &vertex in vertices {
            let (reflectance, emission, weights) = &mut sums[display.own_vertex(vertex)];
            *reflectance += colors[0] * area;
            *emission += colors[1] * area;
            *weights += weight;
        }
    }
    display.repeat(&mut sums);
    let mean = |sum: Vec3, weight: f32| if weight > 0.0 { sum / weight } else { sum };
    let means = sums.iter();
    display.appearances = appearances.to_vec();
    display.reflectance = means.clone().map(|&(sum, _, by)| mean(sum, by)).collect();
    display.emission = means.map(|&(_, sum, by)| mean(sum, by)).collect();
}

/// What rays meet of an element.
struct Met {
    /// Reflectance and emission, means over all of the element.
    colors: [Vec3; 2],
    /// See [`Hierarchy::opacity_of`].
    opacity: f32,
}

impl Met {
    /// Weight of an element that is cut out. Nobody sees it, but light is interpolated across it: it must have the colours
    /// of its patch, and next to others not count.
    const CUT_OUT: f32 = 1e-6;

    fn of(hierarchy: &Hierarchy, element: usize) -> Self {
        let (opacity, patch) = (hierarchy.opacity_of(element), hierarchy.patch_of(element));
        if opacity > 0.0 || patch.opacity <= 0.0 {
            return Self {
                colors: [
                    hierarchy.diffuse_reflectance_of(element),
                    hierarchy.emission_of(element),
                ],
                opacity,
            };
        }
        let scale = Self::CUT_OUT / patch.opacity;
        Self {
            colors: [patch.reflectance * scale, patch.emission * scale],
            opacity: Self::CUT_OUT,
        }
    }
}

/// A colour that is safe to display: finite and not negative.
fn displayable(color: Vec4) -> Vec3 {
    color
        .color()
        .map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
}
