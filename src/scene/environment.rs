//! Light from outside the scene: a sky around it, and a sun.
//!
//! Both are infinitely far away, so that their light depends on the direction alone. Directions are those of the scene's
//! coordinates and point from the scene to the light.

use std::{
    f32::consts::{PI, TAU},
    sync::Arc,
};

use glam::{Mat3, Vec2, Vec3};

use super::{
    Scene, Texture, UpAxis, Warning, WarningKind,
    ranges::{MAX_EMISSION, limited_emission},
};

/// Most parts of a picture of the sky: a pixel is then a third of a degree wide, less than the sun. More take time;
/// fewer blur the sun of pictures.
const MOST_SAMPLES: usize = 1 << 20;

/// Light from outside the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Environment {
    /// The sky.
    pub sky: Sky,
    /// The sun, if there is one.
    pub sun: Option<Sun>,
    /// Whether this is the uniform sky of a scene without any emitter, which nobody asked for.
    pub is_default: bool,
}

/// Radiance from all directions.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Sky {
    /// None: rays that leave the scene meet darkness.
    #[default]
    Dark,
    /// The same radiance from all directions, also from below; linear RGB, in units of [`Scene::radiance_unit`].
    Uniform(Vec3),
    /// A picture.
    Picture(SkyPicture),
}

/// An equirectangular picture of the sky.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyPicture {
    /// Radiance, linear; the top row is straight up.
    pub picture: Arc<Texture>,
    /// Factor on the radiance of the picture, in units of [`Scene::radiance_unit`].
    pub scale: Vec3,
    /// From directions of the scene to those of the picture, in which +Y is up, the middle is +Z, and +X is a quarter of
    /// the width left of it.
    from_scene: Mat3,
}

/// A disc of uniform radiance in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards its centre.
    pub direction: Vec3,
    /// Irradiance of a surface that faces it, linear RGB, in units of W/m² times [`Scene::radiance_unit`].
    pub irradiance: Vec3,
    /// Angular diameter, radians; above 0 and below π.
    pub diameter: f32,
}

impl Sun {
    /// A direction to the disc, uniform as a surface sees it that faces its centre, and the inverse of the cosine between
    /// both. The irradiance of another surface is that of this one times its cosine with the direction, times the inverse.
    pub fn sample(&self, square: Vec2) -> (Vec3, f32) {
        let sine = (0.5 * self.diameter).sin() * square.x.sqrt();
        let height = (1.0 - sine * sine).max(0.0).sqrt();
        let (across, up) = (square.y * TAU).sin_cos();
        let (tangent, bitangent) = self.direction.any_orthonormal_pair();
        let direction = (tangent * up + bitangent * across) * sine + self.direction * height;
        (direction, 1.0 / height.max(f32::MIN_POSITIVE))
    }
}

/// Radiance of a small part of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkySample {
    /// Unit vector towards it.
    pub direction: Vec3,
    /// Its mean radiance.
    pub radiance: Vec3,
    /// Its size, steradians; those of all parts add to 4π.
    pub solid_angle: f32,
}

impl Environment {
    /// The uniform sky that lights a scene without emitters.
    pub fn default_sky() -> Self {
        Self {
            sky: Sky::Uniform(Vec3::ONE),
            sun: None,
            is_default: true,
        }
    }

    /// The uniform sky in place of a dark one.
    pub(super) fn with_default_sky(self) -> Self {
        Self {
            sun: self.sun,
            ..Self::default_sky()
        }
    }

    /// Whether no light comes from outside.
    pub fn is_dark(&self) -> bool {
        self.sky.is_dark() && self.sun.is_none_or(|sun| sun.irradiance == Vec3::ZERO)
    }

    /// Whether all of its light is white.
    pub fn is_grey(&self) -> bool {
        let is_grey = |color: Vec3| color.min_element() == color.max_element();
        let sky = match &self.sky {
            Sky::Dark => true,
            Sky::Uniform(radiance) => is_grey(*radiance),
            Sky::Picture(sky) => {
                is_grey(sky.scale) && sky.picture.pixels.iter().all(|&pixel| is_grey(pixel))
            }
        };
        sky && self.sun.is_none_or(|sun| is_grey(sun.irradiance))
    }

    /// The same with all radiance times a factor, within the range of emission.
    pub(super) fn scaled(mut self, factor: f32) -> Self {
        let scale = |radiance: Vec3| limited_emission(radiance * factor);
        match &mut self.sky {
            Sky::Dark => {}
            Sky::Uniform(radiance) => *radiance = scale(*radiance),
            Sky::Picture(sky) => {
                let brightest = sky
                    .picture
                    .pixels
                    .iter()
                    .copied()
                    .fold(Vec3::ZERO, Vec3::max);
                let scale = scale(sky.scale);
                let excess = (scale * brightest).max_element() / MAX_EMISSION;
                sky.scale = scale / excess.max(1.0);
            }
        }
        if let Some(sun) = &mut self.sun {
            // Of the disc, too, the radiance must be in range.
            let most = MAX_EMISSION * sun.projected_solid_angle();
            let irradiance = scale(sun.irradiance);
            let excess = irradiance.max_element() / most;
            sun.irradiance = irradiance / excess.max(1.0);
        }
        self
    }
}

impl Sky {
    /// Whether it gives no light.
    pub fn is_dark(&self) -> bool {
        match self {
            Self::Dark => true,
            Self::Uniform(radiance) => *radiance == Vec3::ZERO,
            Self::Picture(sky) => {
                sky.scale == Vec3::ZERO || sky.picture.pixels.iter().all(|&p| p == Vec3::ZERO)
            }
        }
    }

    /// Radiance from the direction of a unit vector.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Dark => Vec3::ZERO,
            Self::Uniform(radiance) => *radiance,
            Self::Picture(sky) => sky.radiance(direction),
        }
    }
}

impl SkyPicture {
    /// A picture around a scene, turned clockwise as seen from above by an angle in degrees.
    pub fn new(picture: Arc<Texture>, scale: Vec3, up: UpAxis, rotation: f32) -> Self {
        Self {
            picture,
            scale,
            from_scene: Mat3::from_rotation_y(rotation.to_radians()) * upright(up),
        }
    }

    /// By how much the picture is turned clockwise as seen from above, degrees, -180 to 180; see [`Self::new`].
    pub fn rotation(&self, up: UpAxis) -> f32 {
        let turn = self.from_scene * upright(up).transpose();
        turn.z_axis.x.atan2(turn.z_axis.z).to_degrees()
    }

    /// The rotation from directions of the scene to those of the picture, in which +Y is up, the middle is +Z, and +X is
    /// a quarter of the width left of it.
    pub fn from_scene(&self) -> Mat3 {
        self.from_scene
    }

    /// The place of the direction of a unit vector, across from the left and down from the top, each 0 to 1.
    pub fn place(&self, direction: Vec3) -> Vec2 {
        let direction = self.from_scene * direction;
        let across = direction.x.atan2(-direction.z) / (2.0 * PI);
        Vec2::new(
            across.rem_euclid(1.0),
            direction.y.clamp(-1.0, 1.0).acos() / PI,
        )
    }

    /// The unit vector to a place.
    pub fn direction(&self, place: Vec2) -> Vec3 {
        let (sin, cos) = (place.x * 2.0 * PI).sin_cos();
        let (along, height) = (place.y * PI).sin_cos();
        self.from_scene.transpose() * Vec3::new(sin * along, height, -cos * along)
    }

    /// Radiance from the direction of a unit vector, bilinear between pixels.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let direction = self.from_scene * direction;
        let across = direction.x.atan2(-direction.z) / (2.0 * PI);
        let down = direction.y.clamp(-1.0, 1.0).acos() / PI;
        // The lookup repeats across, and ends at the rows of the poles.
        let half = 0.5 / self.picture.height as f32;
        let at = Vec2::new(across, 1.0 - down.clamp(half, 1.0 - half));
        self.picture.sample(at) * self.scale
    }

    /// The sky in parts: one for each pixel, or several if there would be fewer than `least`; large pictures are
    /// averaged down.
    pub fn samples(&self, least: usize) -> Vec<SkySample> {
        let reduced = match self.picture.pixels.len() > MOST_SAMPLES {
            true => Arc::new((*self.picture).clone().reduced_to(MOST_SAMPLES)),
            false => self.picture.clone(),
        };
        let parts = (least as f64 / reduced.pixels.len() as f64).sqrt().ceil() as u32;
        let [columns, rows] = [reduced.width, reduced.height].map(|side| side * parts.max(1));
        let to_scene = self.from_scene.transpose();
        let mut samples = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            let angle = |line: f64| line / f64::from(rows) * std::f64::consts::PI;
            let [above, middle, below] = [0.0, 0.5, 1.0].map(|part| angle(f64::from(row) + part));
            let solid_angle = (above.cos() - below.cos()) * std::f64::consts::TAU;
            for column in 0..columns {
                let across = (f64::from(column) + 0.5) / f64::from(columns);
                let (sin, cos) = (across * std::f64::consts::TAU).sin_cos();
                let direction = [sin * middle.sin(), middle.cos(), -cos * middle.sin()];
                let half = 0.5 / reduced.height as f64;
                let down = middle / std::f64::consts::PI;
                let at = [across, 1.0 - down.clamp(half, 1.0 - half)].map(|x| x as f32);
                samples.push(SkySample {
                    direction: to_scene * Vec3::from_array(direction.map(|x| x as f32)),
                    radiance: reduced.sample(Vec2::from_array(at)) * self.scale,
                    solid_angle: (solid_angle / f64::from(columns)) as f32,
                });
            }
        }
        samples
    }
}

/// From directions of a scene to those in which +Y is up. As Blender converts: east stays +X, and north is +Y or -Z.
fn upright(up: UpAxis) -> Mat3 {
    match up {
        UpAxis::Y => Mat3::IDENTITY,
        UpAxis::Z => Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y),
    }
}

impl Sun {
    /// Angular diameter of the sun seen from the earth, degrees.
    pub const DEGREES: f32 = 0.53;

    /// Unit vector to a place in the sky: `azimuth` clockwise from north as seen from above, `elevation` above the
    /// horizon, both in degrees. North is +Y if Z is up and -Z if Y is up; east is +X.
    pub fn towards(azimuth: f32, elevation: f32, up: UpAxis) -> Vec3 {
        let (sin, cos) = f64::from(azimuth).to_radians().sin_cos();
        let (height, along) = f64::from(elevation).to_radians().sin_cos();
        let [east, north, height] = [sin * along, cos * along, height].map(|x| x as f32);
        match up {
            UpAxis::Y => Vec3::new(east, height, -north),
            UpAxis::Z => Vec3::new(east, north, height),
        }
    }

    /// Azimuth, -180 to 180, and elevation of its centre, degrees, as in [`Self::towards`].
    pub fn place(&self, up: UpAxis) -> [f32; 2] {
        let Vec3 { x: east, y, z } = self.direction;
        let [north, height] = match up {
            UpAxis::Y => [-z, y],
            UpAxis::Z => [y, z],
        };
        let azimuth = east.atan2(north).to_degrees();
        [azimuth, height.clamp(-1.0, 1.0).asin().to_degrees()]
    }

    /// Radiance of the disc.
    pub fn radiance(&self) -> Vec3 {
        self.irradiance / self.projected_solid_angle()
    }

    /// Cosine of the angle between the centre and the rim.
    pub fn rim_cosine(&self) -> f32 {
        (0.5 * self.diameter).cos()
    }

    /// Solid angle of the disc, projected on a plane that faces its centre, steradians.
    fn projected_solid_angle(&self) -> f32 {
        PI * (0.5 * self.diameter).sin().powi(2)
    }
}

impl Scene {
    /// The scene in an environment whose radiance is given in W·sr⁻¹·m⁻², with a warning where it stays dark.
    pub fn in_environment(mut self, environment: Environment) -> Self {
        self.environment = Arc::new(environment.scaled(1.0 / self.radiance_unit));
        self.warn_of_darkness();
        self
    }

    /// The scene with the default sky, and a word about it, if neither a surface nor the environment gives light.
    pub fn lit_by_default(self) -> Self {
        if self.has_light() {
            return self;
        }
        self.in_environment(Environment::default_sky())
    }

    /// Put the warning that fits in place of an earlier one about the lack of emitters.
    pub(super) fn warn_of_darkness(&mut self) {
        self.warnings
            .retain(|warning| warning.kind != WarningKind::NoEmitter);
        let message = if self.environment.is_default {
            "nothing emits light, so a uniform sky of radiance 1 lights the scene; --sky none turns it off"
        } else if !self.has_light() {
            "nothing emits light, so the result is black; give a material Ke above 0, or the scene a sky"
        } else {
            return;
        };
        self.warnings.push(Warning {
            kind: WarningKind::NoEmitter,
            message: message.to_owned(),
            count: 1,
            place: None,
        });
    }

    /// Whether a surface or the environment gives light.
    pub fn has_light(&self) -> bool {
        self.has_emitter() || !self.environment.is_dark()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: Vec3, b: Vec3) {
        assert!((a - b).abs().max_element() < 1e-5, "{a} for {b}");
    }

    /// A picture with one bright column and dark ground.
    fn picture(bright: u32) -> Arc<Texture> {
        let (width, height) = (64, 32);
        let pixel = |index: u32| {
            let (column, row) = (index % width, index / width);
            let color = if column == bright { Vec3::X } else { Vec3::Y };
            if row < height / 2 { color } else { Vec3::ZERO }
        };
        Arc::new(Texture {
            name: String::new(),
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
            ..Texture::default()
        })
    }

    #[test]
    fn the_sun_stands_where_maps_and_blender_have_it() {
        for (azimuth, elevation, y_up) in [
            (0.0, 0.0, Vec3::NEG_Z),
            (90.0, 0.0, Vec3::X),
            (180.0, 0.0, Vec3::Z),
            (-90.0, 0.0, Vec3::NEG_X),
            (45.0, 90.0, Vec3::Y),
            (180.0, 45.0, Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt())),
        ] {
            near(Sun::towards(azimuth, elevation, UpAxis::Y), y_up);
            let z_up = Vec3::new(y_up.x, -y_up.z, y_up.y);
            near(Sun::towards(azimuth, elevation, UpAxis::Z), z_up);
            for up in [UpAxis::Y, UpAxis::Z] {
                let sun = Sun {
                    direction: Sun::towards(azimuth, elevation, up),
                    irradiance: Vec3::ONE,
                    diameter: 0.01,
                };
                let [place, height] = sun.place(up);
                near(Sun::towards(place, height, up), sun.direction);
            }
        }
    }

    #[test]
    fn the_disc_of_the_sun_gives_its_irradiance() {
        for diameter in [0.001, 0.53f32.to_radians(), 0.5, 2.0] {
            let sun = Sun {
                direction: Vec3::Y,
                irradiance: Vec3::splat(3.0),
                diameter,
            };
            // Midpoint rule over rings.
            let (mut sum, rings) = (0.0, 1000);
            for ring in 0..rings {
                let angle = (ring as f32 + 0.5) / rings as f32 * 0.5 * diameter;
                sum += angle.sin() * angle.cos();
            }
            let whole = sun.radiance() * sum * 2.0 * PI * 0.5 * diameter / rings as f32;
            assert!((whole / 3.0 - 1.0).abs().max_element() < 1e-3, "{whole}");
        }
    }

    #[test]
    fn a_picture_is_upright_and_turns_clockwise() {
        for (up, south, east) in [
            (UpAxis::Y, Vec3::Z, Vec3::X),
            (UpAxis::Z, Vec3::NEG_Y, Vec3::X),
        ] {
            let sky = |rotation| {
                Sky::Picture(SkyPicture::new(picture(32), Vec3::splat(2.0), up, rotation))
            };
            let lifted = |horizontal: Vec3| (horizontal + 0.2 * up.vector()).normalize_or_zero();
            for rotation in [0.0, 35.0, -120.0] {
                let turned = SkyPicture::new(picture(32), Vec3::ONE, up, rotation);
                assert!((turned.rotation(up) - rotation).abs() < 1e-3);
            }
            assert!(sky(0.0).radiance(lifted(south)).x > 0.9, "the middle");
            near(sky(0.0).radiance(lifted(east)), Vec3::Y * 2.0);
            // Clockwise as seen from above, south turns to west.
            near(sky(90.0).radiance(lifted(south)), Vec3::Y * 2.0);
            assert!(sky(90.0).radiance(lifted(-east)).x > 0.9);
            near(
                sky(0.0).radiance((8.0 * up.vector() + east).normalize_or_zero()),
                Vec3::Y * 2.0,
            );
            near(sky(0.0).radiance(-up.vector()), Vec3::ZERO);
        }
    }

    #[test]
    fn strengths_are_brought_into_range() {
        let sun = Sun {
            direction: Vec3::Y,
            irradiance: Vec3::splat(f32::MAX),
            diameter: 0.01,
        };
        let environment = Environment {
            sky: Sky::Uniform(Vec3::new(f32::NAN, -1.0, 1e30)),
            sun: Some(sun),
            is_default: false,
        };
        let scaled = environment.scaled(0.5);
        assert_eq!(scaled.sky, Sky::Uniform(Vec3::new(0.0, 0.0, MAX_EMISSION)));
        let radiance = scaled.sun.map(|sun| sun.radiance().max_element());
        assert!(radiance.is_some_and(|most| most <= 1.001 * MAX_EMISSION));
        assert!(!scaled.is_dark() && Environment::default().is_dark());
        assert!(Environment::default().scaled(2.0).is_dark());
    }
}
