//! The lit mesh as a file: what the formats share.

use std::{
    f32::consts::FRAC_1_PI,
    io::{self, Write},
};

use glam::Vec3;

use super::ColorOptions;
use crate::{
    geometry::Harmonics,
    scene::{Scene, UpAxis},
    solver::{Lamp, LampLight, Snapshot},
};

/// A lit mesh to be written.
#[derive(Clone, Copy, Debug)]
pub struct LitMesh<'a> {
    /// Mesh and light.
    pub snapshot: &'a Snapshot,
    /// The scene that it shows.
    pub scene: &'a Scene,
    /// Light by direction at its vertices, where that is asked for.
    pub harmonics: Option<&'a [Harmonics]>,
    /// The light of each of its lamps, where that is asked for.
    pub lamps: &'a [LampLight],
}

impl LitMesh<'_> {
    /// What a lamp is called.
    pub(super) fn lamp_name(&self, lamp: Lamp) -> &str {
        match lamp {
            Lamp::Material(material) => &self.scene.materials[material].name,
            Lamp::Sky => "sky",
            Lamp::Sun => "sun",
        }
    }
}

/// What the coefficients of light by direction are, in a sentence for files.
pub(super) const HARMONICS_MEANING: &str = "incident radiance, linear, W/m^2: integral of L Y over the hemisphere of the vertex normal, \
     in the axes of the positions; Y = 0.282095, 0.488603 y, 0.488603 z, 0.488603 x";

/// Options of an exported mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshOptions {
    /// How displayed colours are made.
    pub color: ColorOptions,
    /// The scene's up axis.
    pub up: UpAxis,
    /// Factor on all emission, and with it on all light.
    pub emission_scale: f32,
    /// Of the scene: see [`crate::scene::Scene::radiance_unit`].
    pub radiance_unit: f32,
    /// Whether all objects of the scene become one.
    pub merge: bool,
}

impl Default for MeshOptions {
    fn default() -> Self {
        Self {
            color: ColorOptions::default(),
            up: UpAxis::default(),
            emission_scale: 1.0,
            radiance_unit: 1.0,
            merge: false,
        }
    }
}

impl MeshOptions {
    /// Light of the scene as files have it: in watts, with the factor on all emission; finite and not negative.
    pub fn scaled(&self, light: Vec3) -> Vec3 {
        scaled(
            light,
            [self.emission_scale, self.radiance_unit].map(f64::from),
        )
    }
}

/// Light at a vertex of the display mesh, linear, finite and not negative.
pub(super) struct Light {
    /// Emitted and reflected, W·sr⁻¹·m⁻².
    pub(super) radiance: Vec3,
    /// Arriving, W·m⁻².
    pub(super) irradiance: Vec3,
    /// The same by direction, as [`Harmonics`]; of either sign.
    pub(super) harmonics: Option<[Vec3; 4]>,
}

impl Light {
    /// Light at the vertex of this index; dark where none is known.
    pub(super) fn at(lit: LitMesh<'_>, index: usize, options: &MeshOptions) -> Self {
        let snapshot = lit.snapshot;
        let arriving = snapshot.light.irradiance.get(index).copied();
        let emission = snapshot.mesh.emission[index];
        let harmonics = lit.harmonics.map(|harmonics| {
            let Harmonics(values) = harmonics.get(index).copied().unwrap_or_default();
            values.map(|value| options.scaled(value) - options.scaled(-value))
        });
        Self {
            harmonics,
            ..Self::of(snapshot, index, emission, arriving, options)
        }
    }

    /// What files have of it beside a colour, in their order: radiance, irradiance, then, as far as they are asked for, the
    /// coefficients by direction, and radiance and irradiance of each lamp.
    pub(super) fn values<'a>(
        &self,
        lit: LitMesh<'a>,
        index: usize,
        options: &'a MeshOptions,
    ) -> impl Iterator<Item = Vec3> + use<'a> {
        let of_lamps = lit.lamps.iter().flat_map(move |lamp| {
            let light = Self::of_lamp(lit, lamp, index, options);
            [light.radiance, light.irradiance]
        });
        let directions = self.harmonics.into_iter().flatten();
        [self.radiance, self.irradiance]
            .into_iter()
            .chain(directions)
            .chain(of_lamps)
    }

    /// That of a lamp alone.
    fn of_lamp(lit: LitMesh<'_>, lamp: &LampLight, index: usize, options: &MeshOptions) -> Self {
        let arriving = lamp.irradiance.get(index).copied();
        let emission = lamp.emission.get(index).copied().unwrap_or_default();
        Self::of(lit.snapshot, index, emission, arriving, options)
    }

    fn of(
        snapshot: &Snapshot,
        index: usize,
        emission: Vec3,
        arriving: Option<Vec3>,
        options: &MeshOptions,
    ) -> Self {
        let irradiance = presentable(arriving.unwrap_or_default());
        let radiance = emission + snapshot.mesh.reflectance[index] * irradiance * FRAC_1_PI;
        Self {
            radiance: options.scaled(radiance),
            irradiance: options.scaled(irradiance),
            harmonics: None,
        }
    }
}

/// Finite and not negative, whatever comes in.
fn presentable(light: Vec3) -> Vec3 {
    light.map(|x| if x > 0.0 { x.min(f32::MAX) } else { 0.0 })
}

/// Light times two factors. Values above the range of single precision keep their colour.
fn scaled(light: Vec3, [first, second]: [f64; 2]) -> Vec3 {
    let scaled = presentable(light).as_dvec3() * first * second;
    let excess = scaled.max_element() / f64::from(f32::MAX);
    (scaled / excess.max(1.0)).as_vec3()
}

pub(super) fn write_vector(out: &mut dyn Write, vector: Vec3) -> io::Result<()> {
    out.write_all(&vector.to_array().map(f32::to_le_bytes).concat())
}

#[cfg(test)]
pub(super) mod tests {
    use std::{f32::consts::PI, sync::Arc};

    use glam::DVec3;

    use super::*;
    use crate::{
        scene::{Frame, Material, MaterialId, SceneBuilder, SceneOptions},
        solver::{DisplayMesh, VertexLight},
    };

    /// World units about the origin.
    pub(in crate::export) const UNMOVED: Frame = Frame {
        centre: DVec3::ZERO,
        scale: 1.0,
    };

    /// Triangles side by side, each of an object of this name and the material of this index, in world units.
    pub(in crate::export) fn named_scene(triangles: &[(&str, usize)]) -> Scene {
        let mut builder = SceneBuilder::default();
        let count = triangles.iter().map(|(_, material)| material + 1).max();
        for material in 0..count.unwrap_or(1) {
            let name = format!("material {material}");
            builder.push_material(Material::plain(&name, Vec3::splat(0.5), Vec3::ZERO));
        }
        for (place, (name, material)) in triangles.iter().enumerate() {
            let x = 2.0 * place as f64;
            let corners = [[x, 0.0], [x + 1.0, 0.0], [x, 1.0]];
            let corners = corners.map(|[x, y]| builder.push_position(DVec3::new(x, y, 0.0)));
            builder.objects.push(((*name).into(), builder.faces.len()));
            builder.push_triangle(corners, MaterialId(*material as u32));
        }
        let mut scene = builder.finish(&SceneOptions::default()).unwrap();
        scene.frame = UNMOVED;
        scene
    }

    /// The scene of [`triangle`] in a frame.
    pub(in crate::export) fn scene_in(frame: Frame) -> Scene {
        let mut scene = named_scene(&[("", 0)]);
        scene.frame = frame;
        scene
    }

    /// One triangle that reflects half of an irradiance of π; its second corner emits 1.
    pub(in crate::export) fn triangle() -> Snapshot {
        let mesh = DisplayMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            normals: vec![Vec3::Z; 3],
            reflectance: vec![Vec3::splat(0.5); 3],
            emission: vec![Vec3::ZERO, Vec3::ONE, Vec3::ZERO],
            indices: vec![[0, 1, 2]],
            triangle_of: vec![0],
            is_back: vec![false],
            element_of: vec![0],
            ..DisplayMesh::default()
        };
        let light = VertexLight {
            irradiance: vec![Vec3::splat(PI); 3],
            direct: vec![Vec3::ZERO; 3],
        };
        Snapshot {
            step: 1,
            mesh: Arc::new(mesh),
            light: Arc::new(light),
            ..Snapshot::default()
        }
    }

    #[test]
    fn light_is_scaled_with_the_emission_and_always_presentable() {
        let options = MeshOptions {
            emission_scale: 2.0,
            ..MeshOptions::default()
        };
        let lit = LitMesh {
            snapshot: &triangle(),
            scene: &scene_in(UNMOVED),
            harmonics: None,
            lamps: &[],
        };
        let light = Light::at(lit, 1, &options);
        assert!((light.irradiance.x - 2.0 * PI).abs() < 1e-5);
        assert!((light.radiance.x - 3.0).abs() < 1e-5);
        for (value, expected) in [(f32::NAN, 0.0), (-1.0, 0.0), (f32::INFINITY, f32::MAX)] {
            assert_eq!(presentable(Vec3::splat(value)), Vec3::splat(expected));
        }
        let colour = scaled(Vec3::new(4.0, 2.0, 0.0), [1e25, 1e20]);
        assert_eq!(colour.x, f32::MAX);
        assert!((colour.y / colour.x - 0.5).abs() < 1e-6 && colour.z == 0.0);
    }
}
