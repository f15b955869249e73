//! The triangles of a scene with their places in its lightmap, by object and material, and how those look under it.

use std::{
    collections::{BTreeMap, HashMap},
    f32::consts::FRAC_1_PI,
};

use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use super::{bake::Lightmap, layout::PADDING, padding::pad, texels::Texels};
use crate::{
    export::MeshOptions,
    scene::{Appearance, MaterialId, Scene},
    solver::Snapshot,
};

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vertex {
    /// Index of its position in the scene.
    pub(super) point: u32,
    /// Unit normal towards the lit side.
    pub(super) normal: Vec3,
    /// The file's texture coordinates, from the upper left.
    pub(super) own: Vec2,
    /// Place in the lightmap, likewise 0…1.
    pub(super) place: Vec2,
}

/// The triangles of one object and material.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) material: usize,
    pub(super) vertices: Vec<Vertex>,
    pub(super) indices: Vec<[u32; 3]>,
}

/// The parts of each object of a scene.
pub(super) fn parts(scene: &Scene, map: &Lightmap) -> Vec<Vec<Part>> {
    let sides = map.sides.iter().enumerate();
    let mut sides = sides.peekable();
    let objects = scene.objects.iter().map(|object| {
        let mut parts: BTreeMap<MaterialId, (Part, HashMap<[u32; 8], u32>)> = BTreeMap::new();
        while let Some((number, side)) = sides.next_if(|(_, side)| side.triangle < object.end) {
            let material = side.material(scene);
            let (part, known) = parts.entry(material).or_default();
            part.material = material.index();
            let triangle = side.triangle.index();
            let flat = side.normal(scene);
            let (points, order) = (side.points(scene), side.order());
            let corners = [0, 1, 2].map(|corner| {
                let smooth = scene.normals.get(triangle).map(|all| all[order[corner]]);
                let own = scene.texcoords.get(triangle).map(|all| all[order[corner]]);
                let own = own.filter(|at| at.is_finite()).unwrap_or_default();
                part.vertex(
                    known,
                    Vertex {
                        point: points[corner],
                        // A zero has two signs, which would part vertices.
                        normal: toward(smooth, flat) + Vec3::ZERO,
                        own: Vec2::new(own.x, 1.0 - own.y),
                        place: map.layout.corners[number][corner] / map.layout.side as f32,
                    },
                )
            });
            part.indices.push(corners);
        }
        parts.into_values().map(|(part, _)| part).collect()
    });
    objects.collect()
}

impl Part {
    /// The index of a vertex, which is added unless there is one like it.
    fn vertex(&mut self, known: &mut HashMap<[u32; 8], u32>, vertex: Vertex) -> u32 {
        let Vertex {
            point,
            normal,
            own,
            place,
        } = vertex;
        let [x, y, z] = normal.to_array().map(f32::to_bits);
        let [u, v, across, down] = [own.x, own.y, place.x, place.y].map(f32::to_bits);
        *known
            .entry([point, x, y, z, u, v, across, down])
            .or_insert_with(|| {
                self.vertices.push(vertex);
                self.vertices.len() as u32 - 1
            })
    }
}

/// The normal of the file where it has one that looks to the lit side, else that of the triangle.
fn toward(smooth: Option<Vec3>, flat: Vec3) -> Vec3 {
    let smooth = smooth.and_then(Vec3::try_normalize).unwrap_or(flat);
    match smooth.dot(flat) {
        cosine if cosine > 0.0 => smooth,
        cosine if cosine < 0.0 => -smooth,
        _ => flat,
    }
}

/// How a material looks under the lightmap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    /// By what the texels are multiplied: reflectance and opacity.
    pub(super) factor: Vec4,
    /// Whether texels have radiance, and alpha, instead of light: where it emits, has pictures, or is lit so brightly that
    /// white would be cut off.
    pub(super) is_baked: bool,
    /// What their alpha means.
    pub(super) alpha: Alpha,
}

/// How what is behind a surface shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    Opaque,
    CutOut,
    Blended,
}

/// What surfaces look like.
pub(super) struct Looks {
    /// By material.
    pub(super) looks: Vec<Look>,
    /// The picture that they all have, exposed, linear; alpha last.
    pub(super) picture: Vec<Vec4>,
}

impl Looks {
    /// Those of the materials of a scene.
    pub(super) fn of(
        scene: &Scene,
        snapshot: &Snapshot,
        map: &Lightmap,
        options: &MeshOptions,
    ) -> Self {
        let texels = Texels::new(scene, &map.sides, &map.layout);
        let white = |at: usize| {
            let light = options.scaled(map.irradiance[at]);
            options.color.exposed(light * FRAC_1_PI)
        };
        let material = |at: usize| {
            let side = texels.side(at)?;
            Some(map.sides[side as usize].material(scene).index())
        };
        let mut is_bright = vec![false; scene.materials.len()];
        for at in 0..map.irradiance.len() {
            if let Some(material) = material(at) {
                is_bright[material] |= white(at).max_element() > 1.0;
            }
        }
        let shown = Shown {
            scene,
            snapshot,
            options,
        };
        let mut looks: Vec<Look> = (0..scene.materials.len())
            .map(|material| shown.look(material, is_bright[material]))
            .collect();
        // The file's own coordinates may have two materials side by side.
        if map.layout.is_own && looks.iter().any(|look| look.is_baked) {
            looks = (0..scene.materials.len())
                .map(|material| shown.look(material, true))
                .collect();
        }
        let value = |at: usize| -> Option<Vec4> {
            let side = texels.side(at)?;
            if !looks[material(at)?].is_baked {
                return Some(white(at).extend(1.0));
            }
            Some(shown.baked(map, &texels, side, at))
        };
        let mut picture: Vec<Option<Vec4>> = (0..map.irradiance.len())
            .into_par_iter()
            .map(value)
            .collect();
        pad(&mut picture, map.layout.side as usize, PADDING);
        let empty = Vec3::ZERO.extend(1.0);
        let picture = picture.into_iter().map(|value| value.unwrap_or(empty));
        Self {
            looks,
            picture: picture.collect(),
        }
    }
}

/// Surfaces with their present materials.
struct Shown<'a> {
    scene: &'a Scene,
    snapshot: &'a Snapshot,
    options: &'a MeshOptions,
}

impl Shown<'_> {
    fn appearance(&self, material: usize) -> Appearance {
        let present = self.snapshot.mesh.appearances.get(material).copied();
        present.unwrap_or_else(|| Appearance::of(&self.scene.materials[material]))
    }

    fn look(&self, index: usize, is_bright: bool) -> Look {
        let material = &self.scene.materials[index];
        let shown = self.appearance(index);
        let emits = shown.emission != Vec3::ZERO;
        let is_baked = is_bright || emits || material.has_pictures();
        let opacity = material.met_share();
        let color = match is_baked {
            true => Vec3::ONE,
            false => shown.reflectance * material.share_of_met(),
        };
        let alpha = match material.cutout {
            _ if opacity < 1.0 => Alpha::Blended,
            Some(_) => Alpha::CutOut,
            None => Alpha::Opaque,
        };
        Look {
            // What is cut out has its opacity in the texels.
            factor: color.extend(if material.cutout.is_some() {
                1.0
            } else {
                opacity
            }),
            is_baked,
            alpha,
        }
    }

    /// Exposed radiance of a texel, averaged over the part of the surface that it shows, and its alpha.
    fn baked(&self, map: &Lightmap, texels: &Texels<'_>, side: u32, at: usize) -> Vec4 {
        /// Places along an axis.
        const PLACES: usize = 4;
        /// How much the colour of what is cut out counts, so that it is that of its surroundings where nothing is there.
        const CUT_OUT: f32 = 1e-3;
        let triangle = map.sides[side as usize].triangle;
        let material = map.sides[side as usize].material(self.scene);
        let appearance = self.appearance(material.index());
        let width = map.layout.side as usize;
        let corner = Vec2::new((at % width) as f32, (at / width) as f32);
        let (mut colors, mut weights, mut met) = (Vec3::ZERO, 0.0, 0.0);
        let is_cut_out = self.scene.materials[material.index()].cutout.is_some();
        for place in 0..PLACES * PLACES {
            let within = Vec2::new((place % PLACES) as f32, (place / PLACES) as f32) + 0.5;
            let parts = texels.barycentric(side, corner + within / PLACES as f32);
            let opacity = match is_cut_out {
                true => self.scene.opacity_at(triangle, parts),
                false => 1.0,
            };
            let reflectance = self
                .scene
                .reflected_at(triangle, appearance.reflectance, parts);
            let emission = self.scene.emitted_at(triangle, appearance.emission, parts);
            let weight = opacity.max(CUT_OUT);
            colors += weight * (emission + reflectance * map.irradiance[at] * FRAC_1_PI);
            weights += weight;
            met += opacity;
        }
        let radiance = self.options.scaled(colors / weights);
        let alpha = met / (PLACES * PLACES) as f32;
        self.options
            .color
            .exposed(radiance)
            .min(Vec3::ONE)
            .extend(alpha)
    }
}
