//! From raw faces in world coordinates to a [`Scene`] that keeps its promises.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use super::builder::{ObjectName, Skipped};
use super::crossings::cut_crossings;
use super::means::{Pictures, TextureAverages};
use super::ranges::{finite_non_negative, limited_reflectance};
use super::texture::MAX_SAMPLES;
use super::{
    Appearance, BuildError, Cutout, Face, Frame, Material, Object, Scene, SceneBuilder,
    SceneOptions, Surface, Texture, TextureId, TriangleId, Warning, WarningKind,
};

impl SceneBuilder {
    /// Check, clean, scale and finish.
    ///
    /// # Errors
    /// [`BuildError::NoFaces`] when nothing usable is left, [`BuildError::TooLarge`] above 2³¹ of anything.
    pub fn finish(mut self, options: &SceneOptions) -> Result<Scene, BuildError> {
        const LIMIT: usize = i32::MAX as usize;
        let count = self.faces.len().max(self.positions.len());
        if count > LIMIT {
            return Err(BuildError::TooLarge {
                count,
                limit: LIMIT,
            });
        }
        let unusable = self.drop_unusable_faces();
        if self.faces.is_empty() {
            return Err(no_faces(&unusable));
        }
        self.sanitise_textures(options);
        let losing = self.limit_reflecting_textures(options.reflectance_limit());
        self.sanitise_materials(options, losing);
        let radiance_unit = self.scale_emission();
        let frame = self.frame();
        let (mut positions, mut corner_of) = self.weld(&frame);
        let vanished = self.drop_vanished_faces(&frame, &corner_of);
        if self.faces.is_empty() {
            return Err(no_faces(&vanished));
        }
        let overlaps = self.drop_repeated_faces(&corner_of, &positions);
        let face_count = self.faces.len();
        self.omit_textures();
        let mut triangles = self.triangles(&corner_of, &positions, options);
        self.resolve_overlaps(
            &overlaps,
            &mut triangles,
            &frame,
            &mut positions,
            &mut corner_of,
        );
        let averages = TextureAverages::new(self.pictures(), &self.materials);
        let surfaces = self.surfaces(&frame, &averages, options);
        let (told, is_in_metres) = (self.source.up, self.source.is_in_metres);
        let mut scene = Scene {
            name: self.source.name,
            files: self.source.files,
            face_count,
            frame,
            positions,
            triangles: triangles.list,
            surfaces,
            texcoords: corner_values(&self.faces, |face| face.texcoords),
            normals: corner_values(&self.faces, |face| face.normals),
            materials: self.materials,
            textures: self.textures,
            cutouts: self.cutouts,
            objects: object_ranges(&self.objects, self.faces.len()),
            warnings: self.warnings,
            omitted_textures: self.omitted_textures,
            doubled_faces: self.doubled_faces,
            max_reflectance: options.reflectance_limit(),
            averages: Arc::new(averages),
            up: options.up.unwrap_or_default(),
            up_evidence: None,
            is_in_metres,
            views: Vec::new(),
            environment: Arc::default(),
            radiance_unit,
        };
        if options.up.is_none() {
            scene.find_up(told);
        }
        scene.warn_of_darkness();
        cut_crossings(&mut scene);
        Ok(scene)
    }
}

/// The error for faces that were all skipped.
fn no_faces(skipped: &[Skipped]) -> BuildError {
    let count: usize = skipped.iter().map(|skipped| skipped.count).sum();
    let detail = match skipped.first() {
        Some(first) => format!(": all {count} were skipped ({})", first.reason),
        None => String::new(),
    };
    BuildError::NoFaces { detail }
}

impl SceneBuilder {
    fn pictures(&self) -> Pictures<'_> {
        Pictures {
            textures: &self.textures,
            cutouts: &self.cutouts,
        }
    }

    /// Make every texture and cut-out safe to look up, and bring what passes through materials into its range.
    fn sanitise_textures(&mut self, options: &SceneOptions) {
        for texture in &mut self.textures {
            for pixel in &mut texture.pixels {
                *pixel = pixel.map(finite_non_negative);
            }
        }
        let textures = &self.textures;
        for material in &mut self.materials {
            let usable = |texture: &TextureId| {
                textures
                    .get(texture.index())
                    .is_some_and(Texture::is_consistent)
            };
            material.emission_texture = material.emission_texture.filter(usable);
            material.reflectance_texture = material.reflectance_texture.filter(usable);
            material.cutout = material.cutout.filter(|id| {
                let cutout = self.cutouts.get(id.index());
                cutout.is_some_and(Cutout::is_consistent)
            });
            material.limit_transmission();
            if options.is_opaque {
                (material.opacity, material.cutout) = (1.0, None);
            }
            if options.is_matt || options.is_opaque && material.is_glass() {
                material.specular = None;
            }
        }
    }

    /// Bring reflectance and emission into their ranges; give the scene a material if it has none. `clamped` are materials
    /// that reflect too much with their textures.
    fn sanitise_materials(&mut self, options: &SceneOptions, mut clamped: Vec<String>) {
        if self.materials.is_empty() {
            self.materials
                .push(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
        }
        let max = options.reflectance_limit();
        let (mut corrected, mut scaled) = (Vec::new(), Vec::new());
        for material in &mut self.materials {
            let reflectance = limited_reflectance(material.reflectance, max);
            let emission = material.emission.map(finite_non_negative);
            if material.reflectance.cmpgt(Vec3::splat(max)).any() {
                clamped.push(material.name.clone());
            }
            if emission != material.emission
                || reflectance
                    .cmpne(material.reflectance.min(Vec3::splat(max)))
                    .any()
            {
                corrected.push(material.name.clone());
            }
            material.reflectance = reflectance;
            material.emission = emission;
            if material.limit_specular() {
                scaled.push(material.name.clone());
            }
        }
        for (names, what) in [
            (
                scaled,
                "diffuse and specular reflectance (Kd and Ks) that add to more than 1 were scaled to 1".to_owned(),
            ),
            (
                clamped,
                format!(
                    "reflectance above {max} was clamped to it, since light must lose energy at every bounce"
                ),
            ),
            (
                corrected,
                "reflectance or emission that was negative or not finite was brought into range"
                    .to_owned(),
            ),
        ] {
            if let Some(first) = names.first() {
                self.warnings.push(Warning {
                    kind: WarningKind::ValueClamped,
                    message: format!("material '{first}': {what}"),
                    count: names.len(),
                    place: None,
                });
            }
        }
    }

    /// Area vectors from the file's own digits, and the means of reflectance and emission.
    fn surfaces(
        &self,
        frame: &Frame,
        averages: &TextureAverages,
        options: &SceneOptions,
    ) -> Vec<Surface> {
        let max = options.reflectance_limit();
        self.faces
            .par_iter()
            .map(|face| {
                let corners = face.corners.map(|corner| self.positions[corner as usize]);
                let material = &self.materials[face.material.index()];
                let means = averages.over(self.pictures(), material, face.texcoords, MAX_SAMPLES);
                let shown = means.times(&Appearance::of(material), max);
                Surface {
                    area_vector: frame.area_vector(corners),
                    reflectance: shown.reflectance,
                    emission: shown.emission,
                    opacity: means.opacity,
                }
            })
            .collect()
    }
}

/// Corner values of all faces if any face has them, else nothing.
fn corner_values<T: Copy + Default>(
    faces: &[Face],
    of: impl Fn(&Face) -> Option<[T; 3]>,
) -> Vec<[T; 3]> {
    if faces.iter().any(|face| of(face).is_some()) {
        faces
            .iter()
            .map(|face| of(face).unwrap_or_default())
            .collect()
    } else {
        Vec::new()
    }
}

/// Runs of triangles from the first faces of objects; together they cover all triangles, and none is empty.
fn object_ranges(starts: &[(ObjectName, usize)], triangle_count: usize) -> Vec<Object> {
    let mut objects: Vec<Object> = Vec::new();
    let mut push = |name: &ObjectName, start: usize, end: usize| {
        if start >= end {
            return;
        }
        match objects.last_mut() {
            Some(last) if last.name == *name => last.end = TriangleId(end as u32),
            _ => objects.push(Object {
                name: name.clone(),
                start: TriangleId(start as u32),
                end: TriangleId(end as u32),
            }),
        }
    };
    let first = starts.first().map_or(triangle_count, |(_, start)| *start);
    push(&ObjectName::default(), 0, first.min(triangle_count));
    for (index, (name, start)) in starts.iter().enumerate() {
        let end = starts
            .get(index + 1)
            .map_or(triangle_count, |(_, next)| *next);
        push(name, *start, end.min(triangle_count));
    }
    objects
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec2};

    use super::*;
    use crate::scene::{MaterialId, Sides};

    fn builder_of(points: &[[f64; 3]]) -> SceneBuilder {
        let mut builder = SceneBuilder::default();
        for &point in points {
            builder.push_position(DVec3::from_array(point));
        }
        builder
    }

    const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    fn checkerboard() -> Texture {
        let pixels = [Vec3::ZERO, Vec3::ONE, Vec3::ONE, Vec3::ZERO].to_vec();
        Texture {
            name: "checker".to_owned(),
            width: 2,
            height: 2,
            pixels,
            ..Texture::default()
        }
    }

    #[test]
    fn objects_follow_their_faces_when_others_are_dropped() {
        let mut builder = builder_of(&TRIANGLE);
        for (name, corners) in [
            ("a", [0, 0, 1]),
            ("b", [0, 1, 2]),
            ("c", [1, 1, 2]),
            ("d", [0, 2, 1]),
        ] {
            builder.objects.push((name.into(), builder.faces.len()));
            builder.push_triangle(corners, MaterialId(0));
        }
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        let objects = scene
            .objects
            .iter()
            .map(|o| (o.name.label(), o.start.0, o.end.0));
        assert_eq!(objects.collect::<Vec<_>>(), [("b", 0, 1), ("d", 1, 2)]);
        assert_eq!(scene.warnings[0].count, 2);
    }

    #[test]
    fn faces_before_the_first_object_have_a_nameless_one() {
        let objects = object_ranges(&[("a".into(), 2)], 3);
        assert_eq!(objects.len(), 2);
        assert_eq!(
            (objects[0].end, objects[1].end),
            (TriangleId(2), TriangleId(3))
        );
        assert_eq!(object_ranges(&[], 3).len(), 1);
    }

    #[test]
    fn textured_reflectance_is_the_area_mean() {
        let mut builder = builder_of(&TRIANGLE);
        builder.textures.push(checkerboard());
        let mut material = Material::plain("m", Vec3::splat(0.8), Vec3::splat(3.0));
        material.reflectance_texture = Some(TextureId(0));
        material.emission_texture = Some(TextureId(0));
        builder.push_material(material);
        let uv = [Vec2::ZERO, Vec2::new(8.0, 0.0), Vec2::new(0.0, 8.0)];
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.faces[0].texcoords = Some(uv);
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert!((scene.surfaces[0].reflectance - 0.4).abs().max_element() < 0.01);
        assert!((scene.surfaces[0].emission - 1.5).abs().max_element() < 0.04);
    }

    #[test]
    fn bright_reflectance_texture_is_clamped_but_still_emits() {
        let mut builder = builder_of(&TRIANGLE);
        let mut texture = checkerboard();
        for pixel in &mut texture.pixels {
            *pixel += 39.5;
        }
        builder.textures.push(texture);
        let mut material = Material::plain("m", Vec3::ONE, Vec3::ONE);
        material.reflectance_texture = Some(TextureId(0));
        material.emission_texture = Some(TextureId(0));
        builder.push_material(material);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.faces[0].texcoords = Some([Vec2::ZERO, Vec2::X, Vec2::Y]);
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert!(scene.surfaces[0].reflectance.max_element() <= 0.98);
        assert!((scene.surfaces[0].emission - 40.0).abs().max_element() < 0.1);
    }

    #[test]
    fn faces_that_vanish_in_single_precision_are_dropped() {
        let mut points = TRIANGLE.to_vec();
        points.extend([[1e12, 0.0, 0.0], [0.0, 1e12, 0.0]]);
        let mut builder = builder_of(&points);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.push_triangle([0, 3, 4], MaterialId(0));
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 1);
        assert!(
            scene.warnings[0]
                .message
                .contains("too small next to the size")
        );
    }

    #[test]
    fn faces_whose_area_has_no_square_in_single_precision_are_dropped() {
        let mut points = TRIANGLE.to_vec();
        // About the origin, so that the small triangle keeps its corners apart.
        points.extend([[1e14, 0.0, 0.0], [-1e14, 0.0, 0.0], [0.0, 1e14, 0.0]]);
        points.push([0.0, -1e14, 0.0]);
        let mut builder = builder_of(&points);
        builder.push_triangle([0, 1, 2], MaterialId(0));
        builder.push_triangle([3, 4, 5], MaterialId(0));
        builder.push_triangle([3, 4, 6], MaterialId(0));
        let scene = builder.finish(&SceneOptions::default()).unwrap();
        assert_eq!(scene.triangles.len(), 2);
    }

    #[test]
    fn outward_room_with_a_light_inside_is_named() {
        let mut builder = builder_of(&[
            [0.0, 0.0, 0.0],
            [9.0, 0.0, 0.0],
            [0.0, 9.0, 0.0],
            [0.0, 0.0, 9.0],
            [1.0, 1.0, 1.0],
            [2.0, 1.0, 1.0],
            [1.0, 2.0, 1.0],
        ]);
        let wall = builder.push_material(Material::plain("wall", Vec3::splat(0.5), Vec3::ZERO));
        let light = builder.push_material(Material::plain("light", Vec3::ZERO, Vec3::ONE));
        for corners in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]] {
            builder.push_triangle(corners, wall);
        }
        builder.push_triangle([4, 5, 6], light);
        let orientation = |sides| {
            let scene = builder
                .clone()
                .finish(&SceneOptions::with_sides(sides))
                .unwrap();
            let kinds = scene.warnings.iter().map(|warning| warning.kind);
            kinds
                .filter(|&kind| kind == WarningKind::Orientation)
                .count()
        };
        assert_eq!(orientation(Sides::Auto), 1);
        assert_eq!(orientation(Sides::Two), 0);
    }
}
