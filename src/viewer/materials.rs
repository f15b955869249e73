//! Lights and materials as the user has changed them: what is switched on, how bright, in which colour.

use glam::Vec3;

use crate::scene::{Appearance, Material, Scene, Surface, TriangleId};

/// A light as its controls show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightControl {
    /// Whether it emits.
    pub is_on: bool,
    /// Brightness relative to the file.
    pub intensity: f32,
    /// Linear colour; the largest channel of the file's is 1.
    pub color: Vec3,
    /// Largest channel of what the file says, W·sr⁻¹·m⁻².
    strength: f32,
}

impl LightControl {
    /// Of a material that emits.
    fn of(emission: Vec3) -> Option<Self> {
        let strength = emission.max_element();
        (strength > 0.0).then(|| Self {
            is_on: true,
            intensity: 1.0,
            color: emission / strength,
            strength,
        })
    }

    /// Emitted radiance.
    fn emission(&self) -> Vec3 {
        if self.is_on {
            self.color * (self.strength * self.intensity)
        } else {
            Vec3::ZERO
        }
    }
}

/// A material as its controls show it.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialControl {
    /// As in the MTL file.
    pub name: String,
    /// Diffuse reflectance, linear.
    pub reflectance: Vec3,
    /// Where it emits.
    pub light: Option<LightControl>,
}

impl MaterialControl {
    fn of(material: &Material) -> Self {
        let name = if material.name.is_empty() {
            "default"
        } else {
            &material.name
        };
        Self {
            name: name.to_owned(),
            reflectance: material.reflectance,
            light: LightControl::of(material.emission),
        }
    }

    fn appearance(&self) -> Appearance {
        let emission = self
            .light
            .as_ref()
            .map_or(Vec3::ZERO, LightControl::emission);
        Appearance {
            reflectance: self.reflectance,
            emission,
        }
    }
}

/// All materials of a scene, in its order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Materials {
    /// As they are now.
    pub now: Vec<MaterialControl>,
    /// As the file says.
    of_file: Vec<MaterialControl>,
}

impl Materials {
    /// As the file says.
    pub fn of(scene: &Scene) -> Self {
        let of_file: Vec<MaterialControl> =
            scene.materials.iter().map(MaterialControl::of).collect();
        Self {
            now: of_file.clone(),
            of_file,
        }
    }

    /// A material as in the file.
    pub fn of_file(&self, index: usize) -> &MaterialControl {
        &self.of_file[index]
    }

    /// Reset to the values of the file.
    pub fn reset(&mut self) {
        self.now.clone_from(&self.of_file);
    }

    /// Whether anything differs from the file.
    pub fn are_changed(&self) -> bool {
        self.now != self.of_file
    }

    /// Indices of the materials that emit, switched off or not.
    pub fn lights(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.now.len()).filter(|&index| self.now[index].light.is_some())
    }

    /// Their appearances, one for each. An unchanged one is exactly that of the scene.
    pub fn appearances(&self, scene: &Scene) -> Vec<Appearance> {
        let controls = self.now.iter().zip(&self.of_file);
        let of = |((now, of_file), material)| {
            if now == of_file {
                Appearance::of(material)
            } else {
                MaterialControl::appearance(now)
            }
        };
        controls.zip(&scene.materials).map(of).collect()
    }

    /// Whether no material has a colour.
    pub fn are_grey(&self) -> bool {
        let is_grey = |color: Vec3| color.min_element() == color.max_element();
        self.now.iter().all(|material| {
            let light = material.light.is_none_or(|light| is_grey(light.color));
            light && is_grey(material.reflectance)
        })
    }

    /// The surface of a triangle as it is now.
    pub fn surface(&self, scene: &Scene, triangle: TriangleId) -> Surface {
        let surface = scene.surfaces[triangle.index()];
        let index = scene.triangles[triangle.index()].material.index();
        let (Some(now), Some(of_file)) = (self.now.get(index), self.of_file.get(index)) else {
            return surface;
        };
        if now == of_file {
            return surface;
        }
        let (now, of_file) = (now.appearance(), of_file.appearance());
        let material = &scene.materials[index];
        // Textures are averaged in the surface: the colour that multiplies them goes with the ratio.
        let changed = |mean: Vec3, before: Vec3, after: Vec3, has_texture: bool| {
            let ratio = (after / before).map(|x| if x.is_finite() { x } else { 1.0 });
            if has_texture { mean * ratio } else { after }
        };
        Surface {
            reflectance: changed(
                surface.reflectance,
                of_file.reflectance,
                now.reflectance,
                material.reflectance_texture.is_some(),
            )
            .min(Vec3::splat(scene.max_reflectance)),
            emission: changed(
                surface.emission,
                of_file.emission,
                now.emission,
                material.emission_texture.is_some(),
            ),
            ..surface
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SceneOptions, builtin::builtin};

    fn cornell() -> Scene {
        let scene = builtin("cornell", &SceneOptions::default());
        scene.expect("it is built in").expect("it is whole")
    }

    #[test]
    fn what_is_not_changed_is_exactly_as_in_the_file() {
        let scene = cornell();
        let materials = Materials::of(&scene);
        assert_eq!(materials.appearances(&scene), scene.appearances());
        assert!(!materials.are_changed());
        for triangle in scene.triangle_ids() {
            let surface = materials.surface(&scene, triangle);
            assert_eq!(surface, scene.surfaces[triangle.index()]);
        }
    }

    #[test]
    fn a_light_is_dimmed_coloured_and_switched_off() {
        let scene = cornell();
        let mut materials = Materials::of(&scene);
        let lights: Vec<usize> = materials.lights().collect();
        let [lamp] = lights[..] else {
            panic!("one lamp, {} lights", lights.len())
        };
        let strength = scene.materials[lamp].emission.max_element();
        let change = |materials: &mut Materials, change: &dyn Fn(&mut LightControl)| {
            change(materials.now[lamp].light.as_mut().expect("it is a light"));
            materials.appearances(&scene)[lamp].emission
        };
        let found = change(&mut materials, &|light| {
            (light.intensity, light.color) = (0.5, Vec3::X);
        });
        assert!((found - Vec3::X * 0.5 * strength).length() < 1e-5 * strength);
        let found = change(&mut materials, &|light| light.is_on = false);
        assert_eq!(found, Vec3::ZERO);
        assert!(materials.are_changed());
        assert_eq!(materials.lights().count(), 1, "it can be switched on again");
        materials.reset();
        assert_eq!(materials.appearances(&scene), scene.appearances());
    }

    #[test]
    fn a_surface_follows_its_material() {
        let scene = cornell();
        let mut materials = Materials::of(&scene);
        let triangle = TriangleId(0);
        let material = scene.triangles[0].material.index();
        materials.now[material].reflectance = Vec3::new(0.1, 0.2, 7.0);
        let surface = materials.surface(&scene, triangle);
        assert_eq!(
            surface.reflectance,
            Vec3::new(0.1, 0.2, scene.max_reflectance)
        );
        let relit = scene.relit(&materials.appearances(&scene));
        assert_eq!(surface, relit.surfaces[0]);
    }
}
