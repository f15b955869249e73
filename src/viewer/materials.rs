//! Lights and materials as the user has changed them: what is switched on, how bright, in which colour.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::scene::{Appearance, Lamp, Material, Scene, Surface, TriangleId};

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

    /// A white lamp whose radiance is `strength`.
    fn white(strength: f32) -> Self {
        Self {
            is_on: true,
            intensity: 1.0,
            color: Vec3::ONE,
            strength,
        }
    }

    /// The same at its first brightness and white.
    pub fn as_made(&self) -> Self {
        Self::white(self.strength)
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

    /// Make a material a lamp, as bright as the brightest of the file, or of radiance 1. One that is switched off is
    /// switched on.
    pub fn make_lamp(&mut self, index: usize) {
        let known = self.of_file.iter().filter_map(|material| material.light);
        let strength = known.map(|light| light.strength).fold(0.0, f32::max);
        let strength = if strength > 0.0 { strength } else { 1.0 };
        let light = &mut self.now[index].light;
        light
            .get_or_insert_with(|| LightControl::white(strength))
            .is_on = true;
    }

    /// Make a material no lamp: one of the file is switched off.
    pub fn put_out(&mut self, index: usize) {
        let light = &mut self.now[index].light;
        match self.of_file[index].light {
            Some(_) => light.iter_mut().for_each(|light| light.is_on = false),
            None => *light = None,
        }
    }

    /// Whether a material emits now.
    pub fn is_lamp(&self, index: usize) -> bool {
        self.now[index].light.is_some_and(|light| light.is_on)
    }

    /// Materials that emit nothing though their names say that they are lamps.
    pub fn named_like_lamps(&self) -> Vec<usize> {
        let is_named = |&index: &usize| is_named_like_lamp(&self.now[index].name);
        (0..self.now.len())
            .filter(|&index| !self.is_lamp(index))
            .filter(is_named)
            .collect()
    }

    /// The materials that were changed, here or by lamps that are asked for.
    pub fn changes(&self, asked: &[Lamp]) -> Vec<SavedMaterial> {
        let pairs = self.now.iter().zip(&self.of_file);
        let is_asked = |name: &str| asked.iter().any(|lamp| lamp.material == name);
        let changed = pairs.filter(|(now, of_file)| now != of_file || is_asked(&now.name));
        changed
            .map(|(now, _)| {
                let Appearance {
                    reflectance,
                    emission,
                } = now.appearance();
                SavedMaterial {
                    name: now.name.clone(),
                    reflectance: reflectance.to_array(),
                    emission: emission.to_array(),
                }
            })
            .collect()
    }

    /// Change materials as they were saved, but the emission of lamps that are asked for; returns the names that no
    /// material has.
    pub fn restore<'a>(&mut self, saved: &'a [SavedMaterial], asked: &[Lamp]) -> Vec<&'a str> {
        let mut unknown = Vec::new();
        for saved in saved {
            let known = self.now.iter().position(|now| now.name == saved.name);
            let Some(index) = known else {
                unknown.push(saved.name.as_str());
                continue;
            };
            self.now[index].reflectance = Vec3::from_array(saved.reflectance);
            if asked.iter().any(|lamp| lamp.material == saved.name) {
                continue;
            }
            let emission = Vec3::from_array(saved.emission);
            let strength = emission.max_element();
            if strength <= 0.0 {
                self.put_out(index);
                continue;
            }
            self.make_lamp(index);
            if let Some(light) = &mut self.now[index].light {
                light.color = emission / strength;
                light.intensity = strength / light.strength;
            }
        }
        unknown
    }

    /// Reset to the values of the file.
    pub fn reset(&mut self) {
        self.now.clone_from(&self.of_file);
    }

    /// Whether anything differs from the file.
    pub fn are_changed(&self) -> bool {
        self.now != self.of_file
    }

    /// Which materials emit.
    pub fn are_lamps(&self) -> Vec<bool> {
        (0..self.now.len())
            .map(|index| self.is_lamp(index))
            .collect()
    }

    /// Switch materials that have a light on or off.
    pub fn switch(&mut self, index: usize, is_on: bool) {
        if let Some(light) = &mut self.now[index].light {
            light.is_on = is_on;
        }
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

/// A changed material as the sidecar has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedMaterial {
    /// Its name.
    pub name: String,
    /// Diffuse reflectance, linear, 0 to 1.
    pub reflectance: [f32; 3],
    /// Emitted radiance, in units of [`Scene::radiance_unit`], at least 0.
    pub emission: [f32; 3],
}

impl SavedMaterial {
    /// One sentence about the first value out of its range.
    ///
    /// # Errors
    /// Where there is one.
    pub fn check(&self) -> Result<(), String> {
        for (what, values, most) in [
            ("reflectance", self.reflectance, 1.0),
            ("emission", self.emission, f32::MAX),
        ] {
            let wrong = values
                .into_iter()
                .find(|value| !(0.0..=most).contains(value));
            if let Some(value) = wrong {
                let name = &self.name;
                return Err(format!(
                    "{what} of '{name}' is {value}, which is out of range"
                ));
            }
        }
        Ok(())
    }
}

/// Words that name lamps: whole words of a name, and ends of words, as in `ceilinglight`. A wall may be painted lightgrey.
const LAMP_WORDS: [&str; 9] = [
    "light", "lights", "lamp", "lamps", "bulb", "bulbs", "neon", "emitter", "emission",
];

/// Whether the name of a material says that it is a lamp.
fn is_named_like_lamp(name: &str) -> bool {
    let name = name.to_lowercase();
    let mut words = name.split(|c: char| !c.is_alphabetic());
    name.contains('灯')
        || words.any(|word| {
            word.starts_with("emit")
                || word.starts_with("emiss")
                || LAMP_WORDS.iter().any(|lamp| word.ends_with(lamp))
        })
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
    fn any_material_becomes_a_lamp_and_none_again() {
        let scene = cornell();
        let mut materials = Materials::of(&scene);
        let white = materials.now.iter().position(|now| now.name == "white");
        let white = white.expect("the box has white walls");
        materials.make_lamp(white);
        assert!(materials.is_lamp(white));
        let strength = scene.materials.iter().map(|of| of.emission.max_element());
        let strength = strength.fold(0.0, f32::max);
        let emission = materials.appearances(&scene)[white].emission;
        assert_eq!(emission, Vec3::splat(strength));
        materials.put_out(white);
        assert!(!materials.are_changed());
    }

    #[test]
    fn lamps_are_known_by_their_names() {
        let lamps = [
            "Light",
            "ceiling_lamp.003",
            "CeilingLight",
            "Neon2",
            "吊灯",
            "emit",
            "Bulb_E27",
            "emissive",
        ];
        for name in lamps {
            assert!(is_named_like_lamp(name), "{name}");
        }
        for name in ["lightgrey", "wall", "delighted", "clamped", "", "x2lamb"] {
            assert!(!is_named_like_lamp(name), "{name}");
        }
    }

    #[test]
    fn saved_changes_are_made_again() {
        let scene = cornell();
        let mut materials = Materials::of(&scene);
        materials.now[0].reflectance = Vec3::new(0.1, 0.2, 0.3);
        materials.make_lamp(1);
        let lamp = materials.lights().last().expect("the box has a lamp");
        materials.put_out(lamp);
        let saved = materials.changes(&[]);
        assert_eq!(saved.len(), 3);
        assert!(saved.iter().all(|saved| saved.check().is_ok()));
        let mut again = Materials::of(&scene);
        assert!(again.restore(&saved, &[]).is_empty());
        assert_eq!(again.appearances(&scene), materials.appearances(&scene));
        let mut asked = Materials::of(&scene);
        let lamps = asked.lights().map(|index| Lamp {
            material: asked.now[index].name.clone(),
            radiance: Vec3::ONE,
        });
        let lamps: Vec<Lamp> = lamps.collect();
        asked.restore(&saved, &lamps);
        assert_eq!(Materials::of(&scene).changes(&lamps).len(), 1);
        assert!(asked.is_lamp(lamp) && !again.is_lamp(lamp));
        let mut gone = saved[0].clone();
        gone.name = "gone".to_owned();
        assert_eq!(again.restore(&[gone.clone()], &[]), ["gone"]);
        gone.emission[1] = f32::NAN;
        assert!(gone.check().is_err());
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
