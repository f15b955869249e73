//! From the state of a solve to what is shown of it.

use std::{f32::consts::PI, sync::Arc};

use glam::{Vec2, Vec3, Vec4};

use super::seams::{Seams, repeat};
use crate::{
    geometry::area_vector,
    hierarchy::{Cluster, NodeId},
    scene::TriangleId,
    solver::{
        Cancel, ClusterBox, DisplayMesh, Snapshot, Solver, VertexLight, vertices::VertexMeans,
    },
    transport::luminance,
};

impl Solver {
    /// Renew the snapshot after a step. The mesh is kept where no element was divided. When cancelled the snapshot stays
    /// as it was.
    pub(crate) fn show(&mut self, cancel: &Cancel) -> Option<()> {
        let held = &self.snapshot.mesh;
        let has_changed = held.indices.is_empty()
            || held.own_vertex_count() != self.hierarchy.mesh.vertices.len()
            || self.hierarchy.mesh.leaves().count() != self.leaf_count_shown();
        cancel.proceed()?;
        let triangles = has_changed.then(|| self.hierarchy.mesh.closed_triangles());
        cancel.proceed()?;
        // None of these needs the others.
        let mut direct = self.direct.take();
        let ((mesh, means), ()) = rayon::join(
            || {
                rayon::join(
                    || match triangles {
                        Some(triangles) => self.display_mesh(triangles, cancel).map(Arc::new),
                        None => Some(self.snapshot.mesh.clone()),
                    },
                    || VertexMeans::new(&self.hierarchy, &self.leaves, &self.gathered),
                )
            },
            || {
                if let Some(field) = &mut direct {
                    field.smooth(&self.hierarchy);
                }
            },
        );
        self.direct = direct;
        let mesh = mesh?;
        cancel.proceed()?;
        let (light, clusters) = rayon::join(
            || self.vertex_light(&means, &mesh),
            || self.cluster_boxes(cancel),
        );
        let clusters = clusters?;
        self.snapshot = Snapshot {
            step: self.step,
            mesh,
            light: Arc::new(light),
            clusters: Arc::new(clusters),
            left_out: self.plan.left_out.clone(),
        };
        Some(())
    }

    /// Number of leaves in the mesh that is shown: display triangles of one element follow each other.
    fn leaf_count_shown(&self) -> usize {
        self.snapshot
            .mesh
            .element_of
            .chunk_by(|a, b| a == b)
            .count()
    }

    /// The mesh that is shown, from elements with the triangles that close their edges.
    fn display_mesh(
        &self,
        triangles: Vec<(u32, [u32; 3])>,
        cancel: &Cancel,
    ) -> Option<DisplayMesh> {
        let mesh = &self.hierarchy.mesh;
        let count = mesh.vertices.len();
        let mut seams = (!self.scene.texcoords.is_empty()).then(Seams::default);
        let mut display = DisplayMesh {
            positions: (0..count as u32)
                .map(|vertex| mesh.position(vertex))
                .collect(),
            normals: vec![Vec3::ZERO; count],
            texcoords: vec![Vec2::NAN; if seams.is_some() { count } else { 0 }],
            ..DisplayMesh::default()
        };
        for (element, vertices) in triangles {
            let patch = self.hierarchy.patch_of(element as usize);
            let corners = vertices.map(|vertex| display.positions[vertex as usize]);
            let weight = area_vector(corners).length().max(f32::MIN_POSITIVE);
            for vertex in vertices.map(|vertex| vertex as usize) {
                display.normals[vertex] += patch.normal * weight;
            }
            let shown = match &mut seams {
                Some(seams) => vertices.map(|vertex| {
                    let point = display.positions[vertex as usize];
                    let uv = self.texcoord_at(patch.triangle, point);
                    seams.vertex_with(vertex, uv, &mut display)
                }),
                None => vertices,
            };
            display.indices.push(shown);
            display.triangle_of.push(patch.triangle.0);
            display.is_back.push(patch.is_back);
            display
                .element_of
                .push(self.hierarchy.clusters.len() as u32 + element);
        }
        cancel.proceed()?;
        for normal in &mut display.normals {
            *normal = normal.normalize_or_zero();
        }
        repeat(&mut display.normals, count, &display.repeated);
        // Vertices of no triangle.
        for uv in display.texcoords.iter_mut().filter(|uv| uv.is_nan()) {
            *uv = Vec2::ZERO;
        }
        self.color(&mut display);
        Some(display)
    }

    /// Give the vertices of a display mesh the colours of the elements about them.
    pub(crate) fn color(&self, display: &mut DisplayMesh) {
        let count = display.positions.len();
        let base = self.hierarchy.clusters.len() as u32;
        let mut sums = vec![(Vec3::ZERO, Vec3::ZERO, 0.0f32); count];
        for (vertices, element) in display.indices.iter().zip(&display.element_of) {
            let element = (element - base) as usize;
            let shown = [
                self.hierarchy.reflectance_of(element),
                self.hierarchy.emission_of(element),
            ];
            let corners = vertices.map(|vertex| display.positions[vertex as usize]);
            let weight = area_vector(corners).length().max(f32::MIN_POSITIVE);
            for &vertex in vertices {
                let (reflectance, emission, weights) = &mut sums[display.own_vertex(vertex)];
                *reflectance += shown[0] * weight;
                *emission += shown[1] * weight;
                *weights += weight;
            }
        }
        repeat(&mut sums, display.own_vertex_count(), &display.repeated);
        let mean = |sum: Vec3, weight: f32| if weight > 0.0 { sum / weight } else { sum };
        let means = sums.iter();
        display.appearances = self.appearances().to_vec();
        display.reflectance = means.clone().map(|&(sum, _, by)| mean(sum, by)).collect();
        display.emission = means.map(|&(_, sum, by)| mean(sum, by)).collect();
    }

    /// Texture coordinates of a point on a triangle, by its barycentric coordinates there.
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

    /// Largest radiosity by channel: no irradiance can be larger.
    fn brightest(&self) -> Vec4 {
        let sampled = |leaf: usize| match self.is_sampled(leaf) {
            true => (self.hierarchy.emission_of(leaf) * PI).extend(0.0),
            false => Vec4::ZERO,
        };
        let mesh = &self.hierarchy.mesh;
        mesh.leaves()
            .map(|leaf| self.radiosity(leaf) + sampled(leaf))
            .fold(Vec4::ZERO, Vec4::max)
    }

    fn vertex_light(&self, means: &VertexMeans, mesh: &DisplayMesh) -> VertexLight {
        let count = means.irradiance.len();
        let mut light = VertexLight {
            irradiance: Vec::with_capacity(count),
            direct: Vec::with_capacity(count),
            uncertainty: Vec::with_capacity(count),
        };
        let brightest = self.brightest();
        for (vertex, (&linked, &error)) in means.irradiance.iter().zip(&means.error).enumerate() {
            let (direct, noise) = self
                .direct
                .as_ref()
                .map(|field| field.vertex(&self.hierarchy, vertex as u32))
                .unwrap_or_default();
            light
                .irradiance
                .push(displayable((linked + direct).min(brightest)));
            light.direct.push(displayable(direct));
            let error = error + noise;
            light
                .uncertainty
                .push(if error.is_finite() { error } else { f32::MAX });
        }
        repeat(&mut light.irradiance, count, &mesh.repeated);
        repeat(&mut light.direct, count, &mesh.repeated);
        repeat(&mut light.uncertainty, count, &mesh.repeated);
        light
    }

    fn cluster_boxes(&self, cancel: &Cancel) -> Option<Vec<ClusterBox>> {
        let mut boxes: Vec<ClusterBox> = Vec::with_capacity(self.hierarchy.clusters.len());
        for (index, cluster) in self.hierarchy.clusters.iter().enumerate() {
            let level = match cluster.parent {
                u32::MAX => 0,
                parent => boxes[parent as usize].level + 1,
            };
            boxes.push(self.cluster_box(index, cluster, level));
        }
        cancel.proceed()?;
        for link in self.links.all() {
            if let Some(source) = boxes.get_mut(link.source.index()) {
                source.source_count += 1;
            }
        }
        self.add_sampled_emission(&mut boxes);
        Some(boxes)
    }

    /// Add what tables leave out, since no link carries it: the emission of sampled emitters.
    fn add_sampled_emission(&self, boxes: &mut [ClusterBox]) {
        let Some(field) = &self.direct else { return };
        for index in field.lights.sampled_patches() {
            let patch = &self.hierarchy.patches[index];
            let radiosity = luminance((patch.emission * PI).extend(0.0));
            let vector = patch.area_vector * radiosity;
            for cluster in self.hierarchy.clusters_over(index) {
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
        let links = self.links.of(NodeId(index as u32));
        let moments = &self.power.clusters[index];
        let vector = Vec3::from_array(moments.linear.map(|along| along.w));
        let total = moments.total().w;
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

/// A colour that is safe to show: finite and not negative.
fn displayable(color: Vec4) -> Vec3 {
    color
        .truncate()
        .map(|x| if x.is_finite() { x.max(0.0) } else { 0.0 })
}
