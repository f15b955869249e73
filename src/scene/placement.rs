//! The same scene elsewhere: larger or smaller, moved, mirrored, or with the other axis up.

use std::sync::Arc;

use glam::DVec3;

use super::{Lighting, Scene, SceneBuilder, SceneOptions, SkySource, SunSource, Texture, UpAxis};

/// A similarity of space, under which light stays as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Size of the copy over that of the scene, above 0.
    pub scale: f64,
    /// Where its origin lies, in units of the copy.
    pub offset: DVec3,
    /// Whether x becomes −x. Corners of faces are swapped, so that fronts stay fronts.
    pub is_mirrored: bool,
    /// Whether the other of +Y and +Z is up.
    pub is_turned: bool,
}

impl Placement {
    /// Where everything stays.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        offset: DVec3::ZERO,
        is_mirrored: false,
        is_turned: false,
    };

    /// Where a point of the scene lies in the copy; world coordinates. `up` is the up axis of the scene.
    pub fn point(&self, point: DVec3, up: UpAxis) -> DVec3 {
        self.direction(point, up) * self.scale + self.offset
    }

    /// A direction of the scene in the copy.
    pub fn direction(&self, direction: DVec3, up: UpAxis) -> DVec3 {
        let DVec3 { x, y, z } = direction;
        let x = if self.is_mirrored { -x } else { x };
        // East stays, and so does north as seen from above.
        match (self.is_turned, up) {
            (false, _) => DVec3::new(x, y, z),
            (true, UpAxis::Y) => DVec3::new(x, -z, y),
            (true, UpAxis::Z) => DVec3::new(x, z, -y),
        }
    }

    /// The faces of a scene in the copy. `up` is the up axis of the scene.
    pub fn faces(&self, mut builder: SceneBuilder, up: UpAxis) -> SceneBuilder {
        for position in &mut builder.positions {
            *position = self.point(*position, up);
        }
        for face in &mut builder.faces {
            if let Some(normals) = &mut face.normals {
                *normals = normals.map(|normal| self.direction(normal.as_dvec3(), up).as_vec3());
            }
            if self.is_mirrored {
                face.turn();
            }
        }
        builder
    }

    /// How the copy is read: as the scene, with the axis that is up then.
    pub fn options(&self, options: SceneOptions, up: UpAxis) -> SceneOptions {
        let up = match (self.is_turned, up) {
            (false, up) => up,
            (true, UpAxis::Y) => UpAxis::Z,
            (true, UpAxis::Z) => UpAxis::Y,
        };
        SceneOptions {
            up: Some(up),
            ..options
        }
    }

    /// The light of the copy: that of the scene, whose lamps were asked for by `lighting`.
    pub fn lighting(&self, scene: &Scene, lighting: &Lighting) -> Lighting {
        let (environment, up, unit) = (&scene.environment, scene.up, scene.radiance_unit);
        let mut sky = SkySource::of(&environment.sky, up, unit);
        let mut sun = environment
            .sun
            .map_or(SunSource::Dark, |sun| SunSource::of(&sun, up, unit));
        if self.is_mirrored {
            if let SkySource::Picture {
                picture, rotation, ..
            } = &mut sky
            {
                *picture = Arc::new(mirrored(picture));
                *rotation = -*rotation;
            }
            if let SunSource::Disc { azimuth, .. } = &mut sun {
                *azimuth = -*azimuth;
            }
        }
        Lighting {
            sky: Some(sky),
            sun: Some(sun),
            lamps: lighting.lamps.clone(),
            ..Lighting::default()
        }
    }
}

/// A picture with left and right exchanged.
fn mirrored(picture: &Texture) -> Texture {
    let mut mirrored = picture.clone();
    for row in mirrored.pixels.chunks_mut(picture.width.max(1) as usize) {
        row.reverse();
    }
    mirrored
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::scene::{Environment, Material, Sky, SkyPicture, Sun};

    /// A triangle under a sun and a sky whose east is bright.
    fn scene(up: UpAxis) -> (Scene, SceneBuilder) {
        let mut builder = SceneBuilder::default();
        let grey = builder.push_material(Material::plain("", Vec3::splat(0.5), Vec3::ZERO));
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 0.7, 0.9)];
        let corners = corners.map(|corner| builder.push_position(corner));
        builder.push_triangle(corners, grey);
        let options = SceneOptions {
            up: Some(up),
            ..SceneOptions::default()
        };
        let picture = Arc::new(Texture {
            name: String::new(),
            width: 8,
            height: 4,
            pixels: (0..32).map(|at| Vec3::splat(at as f32)).collect(),
            ..Texture::default()
        });
        let environment = Environment {
            sky: Sky::Picture(SkyPicture::new(picture, Vec3::ONE, up, 20.0)),
            sun: Some(Sun {
                direction: Sun::towards(70.0, 30.0, up),
                irradiance: Vec3::ONE,
                diameter: 0.01,
            }),
            is_default: false,
        };
        let scene = builder.clone().finish(&options).expect("a face");
        (scene.in_environment(environment), builder)
    }

    #[test]
    fn surfaces_and_light_from_outside_move_alike() {
        for up in [UpAxis::Y, UpAxis::Z] {
            let (scene, builder) = scene(up);
            for placement in [
                Placement::IDENTITY,
                Placement {
                    scale: 1000.0,
                    offset: DVec3::new(7e5, -3e5, 1e5),
                    ..Placement::IDENTITY
                },
                Placement {
                    is_mirrored: true,
                    ..Placement::IDENTITY
                },
                Placement {
                    is_turned: true,
                    ..Placement::IDENTITY
                },
                Placement {
                    is_turned: true,
                    is_mirrored: true,
                    ..Placement::IDENTITY
                },
            ] {
                let options = placement.options(SceneOptions::default(), up);
                let copy = placement.faces(builder.clone(), up).finish(&options);
                let lighting = placement.lighting(&scene, &Lighting::default());
                let copy = lighting.apply(copy.expect("a face"));
                let moved =
                    |direction: Vec3| placement.direction(direction.as_dvec3(), up).as_vec3();
                let near =
                    |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-4, "{a} {b} {placement:?}");
                let normal = |of: &Scene| of.surfaces[0].area_vector.normalize_or_zero();
                near(normal(&copy), moved(normal(&scene)));
                let sun = |of: &Scene| of.environment.sun.expect("it has one").direction;
                near(sun(&copy), moved(sun(&scene)));
                near(copy.up.vector(), moved(scene.up.vector()));
                for direction in [
                    Vec3::X,
                    Vec3::new(0.6, 0.0, 0.8),
                    Vec3::new(-0.48, 0.6, 0.64),
                ] {
                    let radiance = |of: &Scene, at: Vec3| of.environment.sky.radiance(at);
                    let expected = radiance(&scene, direction);
                    let found = radiance(&copy, moved(direction));
                    assert!(
                        (found - expected).abs().max_element() < 1e-2,
                        "{placement:?}"
                    );
                }
                let corner = scene
                    .frame
                    .to_world(scene.corners(crate::scene::TriangleId(0))[2]);
                let there = copy.frame.from_world(placement.point(corner, up));
                assert!(copy.positions.iter().any(|at| at.distance(there) < 1e-3));
            }
        }
    }

    #[test]
    fn mirrored_pictures_are_mirrored_rows() {
        let texture = Texture {
            name: String::new(),
            width: 2,
            height: 2,
            pixels: [1.0, 2.0, 3.0, 4.0].map(Vec3::splat).to_vec(),
            ..Texture::default()
        };
        let found = mirrored(&texture)
            .pixels
            .iter()
            .map(|pixel| pixel.x)
            .collect::<Vec<_>>();
        assert_eq!(found, [2.0, 1.0, 4.0, 3.0]);
        assert_eq!(texture.sample(Vec2::new(0.25, 0.75)).x, 1.0);
    }
}
