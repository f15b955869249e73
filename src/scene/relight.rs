//! The same triangles with other reflectance and emission of materials.

use glam::Vec3;
use rayon::prelude::*;

use super::{Appearance, MaterialId, Scene, Surface, TriangleId};

/// Materials that emit or reflect under other appearances, but not in the scene as it was read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ActiveMaterials {
    /// By material; none where it is shorter.
    emit: Vec<bool>,
    /// Likewise.
    reflect: Vec<bool>,
}

impl ActiveMaterials {
    /// Whether a material emits that does not in the scene.
    pub fn emits(&self, material: MaterialId) -> bool {
        self.emit.get(material.index()) == Some(&true)
    }

    /// Whether a material reflects that does not in the scene.
    pub fn reflects(&self, material: MaterialId) -> bool {
        self.reflect.get(material.index()) == Some(&true)
    }

    /// Whether all materials that are active in the other are active here.
    pub fn covers(&self, other: &Self) -> bool {
        let covers = |own: &[bool], other: &[bool]| {
            let is_own = |at: usize| own.get(at) == Some(&true);
            other.iter().enumerate().all(|(at, is)| !is || is_own(at))
        };
        covers(&self.emit, &other.emit) && covers(&self.reflect, &other.reflect)
    }

    /// The materials that are active in either.
    pub fn joined(&self, other: &Self) -> Self {
        let join = |own: &[bool], other: &[bool]| {
            let is = |of: &[bool], at: usize| of.get(at) == Some(&true);
            let count = own.len().max(other.len());
            (0..count).map(|at| is(own, at) || is(other, at)).collect()
        };
        Self {
            emit: join(&self.emit, &other.emit),
            reflect: join(&self.reflect, &other.reflect),
        }
    }
}

impl Scene {
    /// The materials that are active under these appearances, one for each material.
    pub fn active_materials(&self, appearances: &[Appearance]) -> ActiveMaterials {
        let pairs = || self.materials.iter().zip(appearances);
        let activates = |before: Vec3, now: Vec3| before == Vec3::ZERO && now != Vec3::ZERO;
        ActiveMaterials {
            emit: pairs()
                .map(|(material, now)| activates(material.emission, now.emission))
                .collect(),
            reflect: pairs()
                .map(|(material, now)| activates(material.reflectance, now.reflectance))
                .collect(),
        }
    }

    /// How each material reflects and emits.
    pub fn appearances(&self) -> Vec<Appearance> {
        self.materials.iter().map(Appearance::of).collect()
    }

    /// Appearances brought into their ranges, one for each material. Materials without a new appearance stay as they
    /// are.
    pub fn allowed(&self, requested: &[Appearance]) -> Vec<Appearance> {
        let mut allowed = self.appearances();
        for (appearance, request) in allowed.iter_mut().zip(requested) {
            *appearance = request.within(self.max_reflectance);
        }
        allowed
    }

    /// The surfaces of the triangles under these appearances.
    pub fn surfaces_under(&self, appearances: &[Appearance]) -> Vec<Surface> {
        let allowed = self.allowed(appearances);
        let changed: Vec<bool> = allowed
            .iter()
            .zip(&self.materials)
            .map(|(appearance, material)| *appearance != Appearance::of(material))
            .collect();
        self.surfaces
            .par_iter()
            .zip(&self.triangles)
            .enumerate()
            .with_min_len(4096)
            .map(|(index, (surface, triangle))| {
                let of = triangle.material.index();
                if !changed[of] {
                    return *surface;
                }
                let means = self.texture_means(TriangleId(index as u32));
                let shown = means.times(&allowed[of], self.max_reflectance);
                Surface {
                    reflectance: shown.reflectance,
                    emission: shown.emission,
                    ..*surface
                }
            })
            .collect()
    }

    /// The scene with these appearances.
    pub fn relit(&self, appearances: &[Appearance]) -> Self {
        let mut relit = Self {
            surfaces: self.surfaces_under(appearances),
            ..self.clone()
        };
        for (material, appearance) in relit.materials.iter_mut().zip(self.allowed(appearances)) {
            material.reflectance = appearance.reflectance;
            material.emission = appearance.emission;
        }
        relit
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec2};

    use super::*;
    use crate::scene::{Face, Material, SceneBuilder, SceneOptions, Texture, TextureId};

    /// A triangle under a grey texture, and one without.
    fn scene() -> Scene {
        let mut builder = SceneBuilder::default();
        builder.textures.push(Texture {
            name: String::new(),
            width: 2,
            height: 1,
            pixels: vec![Vec3::splat(0.4), Vec3::splat(0.6)],
            ..Texture::default()
        });
        let textured = builder.push_material(Material {
            reflectance_texture: Some(TextureId(0)),
            emission_texture: Some(TextureId(0)),
            ..Material::plain("textured", Vec3::ZERO, Vec3::ZERO)
        });
        let plain = builder.push_material(Material::plain("plain", Vec3::splat(0.4), Vec3::ONE));
        for corner in [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z] {
            builder.push_position(corner);
        }
        for (corners, material) in [([0, 1, 2], textured), ([0, 1, 3], plain)] {
            builder.faces.push(Face {
                corners,
                texcoords: Some([Vec2::ZERO, Vec2::X, Vec2::Y]),
                normals: None,
                material,
                line: 0,
            });
        }
        builder.finish(&SceneOptions::default()).expect("two faces")
    }

    fn grey(reflectance: f32, emission: f32) -> Appearance {
        Appearance {
            reflectance: Vec3::splat(reflectance),
            emission: Vec3::splat(emission),
        }
    }

    #[test]
    fn what_was_black_takes_its_texture_along() {
        let relit = scene().relit(&[grey(0.8, 6.0)]);
        let [textured, plain] = [relit.surfaces[0], relit.surfaces[1]];
        let mean = textured.reflectance / 0.8;
        assert!(mean.cmpgt(Vec3::splat(0.4)).all() && mean.cmplt(Vec3::splat(0.6)).all());
        assert!((textured.emission / 6.0 - mean).abs().max_element() < 1e-6);
        assert_eq!(plain, scene().surfaces[1], "it has no new appearance");
        assert_eq!(relit.appearances()[0], grey(0.8, 6.0));
    }

    #[test]
    fn appearances_are_brought_into_the_ranges_of_materials() {
        let scene = scene();
        let requested = [grey(7.0, -1.0), grey(f32::NAN, f32::INFINITY)];
        let allowed = scene.allowed(&requested);
        assert_eq!(allowed[0], grey(scene.max_reflectance, 0.0));
        assert_eq!(allowed[1], grey(0.0, 0.0));
        for surface in scene.surfaces_under(&requested) {
            assert!(surface.reflectance.max_element() <= scene.max_reflectance);
            assert_eq!(surface.emission, Vec3::ZERO);
        }
    }

    #[test]
    fn only_black_or_dark_materials_become_active() {
        let scene = scene();
        assert_eq!(scene.active_materials(&scene.appearances()), {
            ActiveMaterials {
                emit: vec![false; 2],
                reflect: vec![false; 2],
            }
        });
        let painted = scene.active_materials(&[grey(0.5, 0.0), grey(0.0, 0.0)]);
        let lit = scene.active_materials(&[grey(0.0, 1.0), grey(0.9, 7.0)]);
        assert!(painted.reflects(MaterialId(0)) && !painted.emits(MaterialId(0)));
        assert!(lit.emits(MaterialId(0)) && !lit.emits(MaterialId(1)));
        let (both, none) = (painted.joined(&lit), ActiveMaterials::default());
        assert!(both.covers(&painted) && both.covers(&lit) && both.covers(&none));
        assert!(!painted.covers(&lit) && !none.covers(&lit));
        assert_eq!(none.joined(&lit), lit);
    }

    #[test]
    fn back_to_what_the_file_says() {
        let scene = scene();
        let dark = scene.relit(&[grey(0.1, 0.0), grey(0.1, 0.0)]);
        assert!(!dark.has_emitter());
        let again = dark.relit(&scene.appearances());
        assert_eq!(again.surfaces, scene.surfaces);
        assert_eq!(again.materials, scene.materials);
    }
}
