//! How a texture lies on the faces of a material: which texture coordinates it takes, and how they are turned.

use glam::{DAffine2, DMat2, DVec2};

use super::document::{Document, TextureInfo};
use crate::scene::Wrap;

/// The way of a texture from the texture coordinates of a file to those of a scene, whose v points up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// The set of texture coordinates.
    pub(super) set: u32,
    from_file: DAffine2,
    /// How it goes on beyond its edges, along u and v.
    pub(super) wrap: [Wrap; 2],
}

impl Placement {
    /// That of a texture of a material. The rotation is that of the example of `KHR_texture_transform`, which shows the
    /// lower left quarter of a picture; the shader printed there turns the other way.
    pub(super) fn of(document: &Document, info: &TextureInfo) -> Self {
        let transform = info.extensions.transform.as_ref();
        let turned = transform.map_or(DAffine2::IDENTITY, |transform| {
            let [across, down] = transform.scale;
            let (sine, cosine) = transform.rotation.sin_cos();
            DAffine2 {
                matrix2: DMat2::from_cols(
                    DVec2::new(cosine, -sine) * across,
                    DVec2::new(sine, cosine) * down,
                ),
                translation: DVec2::from_array(transform.offset),
            }
        });
        let upright = DAffine2::from_scale_angle_translation(DVec2::new(1.0, -1.0), 0.0, DVec2::Y);
        let texture = document.textures.get(info.index);
        let sampler = texture.and_then(|texture| document.samplers.get(texture.sampler?));
        let wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| {
            [sampler.wrap_s, sampler.wrap_t].map(|wrap| match wrap {
                Some(CLAMP_TO_EDGE) => Wrap::Clamp,
                Some(MIRRORED_REPEAT) => Wrap::Mirror,
                _ => Wrap::Repeat,
            })
        });
        let set = transform.and_then(|transform| transform.tex_coord);
        Self {
            set: set.unwrap_or(info.tex_coord),
            from_file: upright * turned,
            wrap,
        }
    }

    /// Texture coordinates of the scene.
    pub(super) fn place(&self, uv: [f32; 2]) -> DVec2 {
        self.from_file
            .transform_point2(DVec2::from_array(uv.map(f64::from)))
    }
}

/// The numbers that the specification gives to what is not repetition.
const CLAMP_TO_EDGE: u32 = 33_071;
const MIRRORED_REPEAT: u32 = 33_648;

#[cfg(test)]
mod tests {
    use super::*;

    fn placement(transform: &str) -> Placement {
        let info = format!(
            r#"{{"index":0,"texCoord":1,"extensions":{{"KHR_texture_transform":{transform}}}}}"#
        );
        let document = serde_json::from_str(
            r#"{"textures":[{"sampler":0}],"samplers":[{"wrapS":33071,"wrapT":33648}]}"#,
        );
        Placement::of(&document.unwrap(), &serde_json::from_str(&info).unwrap())
    }

    #[test]
    fn the_example_of_the_extension_shows_the_lower_left_quarter() {
        let turned = placement(r#"{"offset":[0,1],"rotation":1.57079632679,"scale":[0.5,0.5]}"#);
        let quarter = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|uv| turned.place(uv));
        let expected = [[0.0, 0.0], [0.0, 0.5], [0.5, 0.5], [0.5, 0.0]].map(DVec2::from_array);
        for (found, expected) in quarter.into_iter().zip(expected) {
            assert!((found - expected).length() < 1e-9, "{quarter:?}");
        }
        // Scale comes before rotation.
        let flat = placement(r#"{"rotation":1.57079632679,"scale":[2,1],"texCoord":3}"#);
        assert!((flat.place([1.0, 0.0]) - DVec2::new(0.0, 3.0)).length() < 1e-9);
        assert_eq!((flat.set, turned.set), (3, 1));
    }

    #[test]
    fn v_points_up_in_a_scene() {
        assert_eq!(placement("{}").place([0.25, 0.0]), DVec2::new(0.25, 1.0));
    }

    #[test]
    fn samplers_say_how_textures_go_on() {
        assert_eq!(placement("{}").wrap, [Wrap::Clamp, Wrap::Mirror]);
    }
}
