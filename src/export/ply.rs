//! Binary PLY of the display mesh with light at its vertices.
//!
//! Per vertex: position in world units, normal, tone-mapped sRGB, linear radiance and irradiance, and light by direction where
//! that is asked for. MeshLab, Blender and
//! CloudCompare show the bytes; tools that compute read the floats. Positions are floats, too, where these hold the shape,
//! else doubles: coordinates of surveyors have seven digits before the point.

use std::io::{self, Write};

use glam::DVec3;
use rayon::prelude::*;

use super::{
    MeshOptions,
    mesh::{HARMONICS_MEANING, Light, LitMesh, write_vector},
};
use crate::{scene::Frame, solver::DisplayMesh};

/// Write a lit mesh in world units.
///
/// # Errors
/// Those of `out`.
pub(super) fn write_ply(
    out: &mut dyn Write,
    lit: LitMesh<'_>,
    options: &MeshOptions,
) -> io::Result<()> {
    let (mesh, frame) = (&lit.snapshot.mesh, &lit.scene.frame);
    let coordinate = Coordinate::holding(mesh, frame);
    out.write_all(header(lit, coordinate, options).as_bytes())?;
    for (index, &position) in mesh.positions.iter().enumerate() {
        let light = Light::at(lit, index, options);
        coordinate.write(out, frame.to_world(position))?;
        write_vector(out, mesh.normals[index])?;
        out.write_all(&options.color.encode(light.radiance))?;
        let mut values = light.values(lit, index, options);
        values.try_for_each(|value| write_vector(out, value))?;
    }
    for corners in &mesh.indices {
        out.write_all(&[3])?;
        for corner in corners {
            out.write_all(&(*corner as i32).to_le_bytes())?;
        }
    }
    Ok(())
}

/// Properties of light by direction.
const HARMONICS_NAMES: [&str; 12] = [
    "sh0_r", "sh0_g", "sh0_b", "sh1_r", "sh1_g", "sh1_b", "sh2_r", "sh2_g", "sh2_b", "sh3_r",
    "sh3_g", "sh3_b",
];

/// The type of positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coordinate {
    Float,
    Double,
}

/// How far rounding to floats may move a corner, as a share of the height of its face. Smaller, and scenes about the
/// origin get doubles for single slivers, which fewer programs read; larger, and fine meshes far from it are visibly bent.
const MOST_MOVED_OF_FACE: f64 = 0.01;

/// The same as a share of the scene's extent: faces may be large and lie closely before each other. Smaller, and scenes
/// some extents from the origin get doubles; larger, and a picture sinks into the wall that it hangs on.
const MOST_MOVED_OF_SCENE: f64 = 1e-5;

impl Coordinate {
    /// The smallest type that holds every face of a mesh.
    fn holding(mesh: &DisplayMesh, frame: &Frame) -> Self {
        let most_moved = MOST_MOVED_OF_SCENE * Frame::EXTENT / frame.scale;
        let is_held = |corners: &[u32; 3]| {
            let exact = corners.map(|corner| frame.to_world(mesh.positions[corner as usize]));
            let moved = exact.map(|place| (place.as_vec3().as_dvec3() - place).length());
            let moved = moved.into_iter().fold(0.0, f64::max);
            let [a, b, c] = exact;
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let height = (b - a).cross(c - a).length() / longest;
            // A face without a height has none to lose.
            moved <= most_moved && !(height > 0.0 && moved > MOST_MOVED_OF_FACE * height)
        };
        if mesh.indices.par_iter().all(is_held) {
            Self::Float
        } else {
            Self::Double
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Float => "float",
            Self::Double => "double",
        }
    }

    fn write(self, out: &mut dyn Write, position: DVec3) -> io::Result<()> {
        match self {
            Self::Float => write_vector(out, position.as_vec3()),
            Self::Double => out.write_all(&position.to_array().map(f64::to_le_bytes).concat()),
        }
    }
}

fn header(lit: LitMesh<'_>, coordinate: Coordinate, options: &MeshOptions) -> String {
    let (mesh, frame) = (&lit.snapshot.mesh, &lit.scene.frame);
    let (vertex_count, face_count) = (mesh.positions.len(), mesh.indices.len());
    let tone_map = options.color.tone_map.name();
    let properties = |kind: &str, names: &[&str]| -> String {
        names
            .iter()
            .map(|name| format!("property {kind} {name}\n"))
            .collect()
    };
    let origin = match coordinate {
        Coordinate::Float => String::new(),
        // For programs that have no doubles.
        Coordinate::Double => {
            let DVec3 { x, y, z } = frame.centre;
            format!(
                "comment origin {x} {y} {z}, to subtract before positions are rounded to floats\n"
            )
        }
    };
    let (meaning, harmonics) = match lit.harmonics {
        None => Default::default(),
        Some(_) => (
            format!("comment sh {HARMONICS_MEANING}\n"),
            properties("float", &HARMONICS_NAMES),
        ),
    };
    let (mut lamps, mut of_lamps) = (String::new(), String::new());
    for (number, lamp) in lit.lamps.iter().enumerate() {
        // A name may hold anything but the end of a line.
        let name = lit.lamp_name(lamp.lamp).replace(char::is_control, " ");
        lamps += &format!("comment lamp {number} {name}\n");
        for quantity in ["radiance", "irradiance"] {
            for channel in ["r", "g", "b"] {
                of_lamps += &format!("property float lamp{number}_{quantity}_{channel}\n");
            }
        }
    }
    format!(
        "ply\nformat binary_little_endian 1.0\n\
         comment vecrad {version}\n\
         comment exposure {exposure} EV, tone curve {tone_map}, colours sRGB\n\
         comment radiance linear W/(sr m^2), irradiance linear W/m^2, lengths in units of the scene\n\
         comment up axis {up}\n{meaning}{lamps}{origin}\
         element vertex {vertex_count}\n{position}{normal}\
         property uchar red\nproperty uchar green\nproperty uchar blue\n{light}{harmonics}{of_lamps}\
         element face {face_count}\nproperty list uchar int vertex_indices\nend_header\n",
        version = env!("CARGO_PKG_VERSION"),
        exposure = options.color.exposure_ev,
        up = options.up.name(),
        position = properties(coordinate.name(), &["x", "y", "z"]),
        normal = properties("float", &["nx", "ny", "nz"]),
        light = properties(
            "float",
            &[
                "radiance_r",
                "radiance_g",
                "radiance_b",
                "irradiance_r",
                "irradiance_g",
                "irradiance_b",
            ],
        ),
    )
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::{
        super::mesh::tests::{UNMOVED, scene_in, triangle},
        *,
    };
    use crate::{
        geometry::Harmonics,
        solver::{Lamp, LampLight},
    };

    /// Header and body.
    fn parted(bytes: &[u8]) -> (&[u8], &[u8]) {
        let end = b"end_header\n";
        let start = bytes.windows(end.len()).position(|w| w == end);
        bytes.split_at(start.unwrap() + end.len())
    }

    #[test]
    fn radiance_is_emission_plus_reflected_irradiance_over_pi_in_world_units() {
        let frame = Frame {
            centre: DVec3::new(10.0, 0.0, 0.0),
            scale: 2.0,
        };
        let mut bytes = Vec::new();
        let lit = LitMesh {
            snapshot: &triangle(),
            scene: &scene_in(frame),
            harmonics: None,
            lamps: &[],
        };
        write_ply(&mut bytes, lit, &MeshOptions::default()).unwrap();
        let (_, body) = parted(&bytes);
        assert_eq!(body.len(), 3 * (12 * 4 + 3) + 13);
        let float = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        let second = 51;
        assert_eq!(float(second), 10.5, "x in world units");
        assert!((float(27) - 0.5).abs() < 1e-6, "reflected only");
        assert!((float(second + 27) - 1.5).abs() < 1e-6, "emitted, too");
        assert!(
            (float(39) - std::f32::consts::PI).abs() < 1e-6,
            "irradiance"
        );
    }

    #[test]
    fn light_by_direction_follows_where_it_is_asked_for() {
        let harmonics = [Harmonics([0.0, 1.0, -2.0, 3.0].map(Vec3::splat)); 3];
        let mut bytes = Vec::new();
        let lit = LitMesh {
            snapshot: &triangle(),
            scene: &scene_in(UNMOVED),
            harmonics: Some(&harmonics),
            lamps: &[],
        };
        write_ply(&mut bytes, lit, &MeshOptions::default()).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("property float sh3_b\nelement face"));
        let (_, body) = parted(&bytes);
        assert_eq!(body.len(), 3 * (12 * 4 + 3 + 48) + 13);
        let float = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        let found = [0, 1, 2, 3].map(|order| float(51 + 12 * order));
        assert_eq!(found, [0.0, 1.0, -2.0, 3.0]);
    }

    #[test]
    fn the_light_of_each_lamp_follows_with_its_name() {
        let lamp = |lamp: Lamp, irradiance: f32| LampLight {
            lamp,
            irradiance: vec![Vec3::splat(irradiance); 3],
            emission: vec![Vec3::ZERO; 3],
        };
        let lamps = [lamp(Lamp::Material(0), 1.0), lamp(Lamp::Sky, 2.0)];
        let mut bytes = Vec::new();
        let lit = LitMesh {
            snapshot: &triangle(),
            scene: &scene_in(UNMOVED),
            harmonics: None,
            lamps: &lamps,
        };
        write_ply(&mut bytes, lit, &MeshOptions::default()).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("comment lamp 0 material 0\ncomment lamp 1 sky\n"));
        assert!(text.contains("property float lamp1_irradiance_b\nelement face"));
        let (_, body) = parted(&bytes);
        assert_eq!(body.len(), 3 * (12 * 4 + 3 + 48) + 13);
        let float = |at: usize| f32::from_le_bytes(body[at..at + 4].try_into().unwrap());
        assert_eq!([63, 87].map(float), [1.0, 2.0], "irradiance of each");
        let reflected = 0.5 / std::f32::consts::PI;
        assert!((float(51) - reflected).abs() < 1e-6, "{}", float(51));
    }

    /// Header and positions of the triangle in a frame about a place, where a frame unit is half a unit of the world.
    fn written_at(centre: DVec3) -> (String, Vec<DVec3>) {
        let frame = Frame { centre, scale: 2.0 };
        let mut bytes = Vec::new();
        let lit = LitMesh {
            snapshot: &triangle(),
            scene: &scene_in(frame),
            harmonics: None,
            lamps: &[],
        };
        write_ply(&mut bytes, lit, &MeshOptions::default()).unwrap();
        let (header, body) = parted(&bytes);
        let header = String::from_utf8(header.to_vec()).unwrap();
        let body = &body[..body.len() - 13];
        let is_double =
            header.contains("property double x\nproperty double y\nproperty double z\n");
        assert_eq!(
            header.matches("double").count(),
            if is_double { 3 } else { 0 }
        );
        let vertex = if is_double {
            12 * 4 + 3 + 12
        } else {
            12 * 4 + 3
        };
        let number = |bytes: &[u8], place: usize| {
            if is_double {
                f64::from_le_bytes(bytes[8 * place..8 * place + 8].try_into().unwrap())
            } else {
                f32::from_le_bytes(bytes[4 * place..4 * place + 4].try_into().unwrap()).into()
            }
        };
        let positions = body
            .chunks_exact(vertex)
            .map(|bytes| DVec3::from_array([0, 1, 2].map(|place| number(bytes, place))));
        (header, positions.collect())
    }

    #[test]
    fn positions_are_doubles_where_floats_lose_the_shape() {
        for (centre, is_double) in [
            (DVec3::ZERO, false),
            (DVec3::new(300.0, -40.0, 9.0), false),
            // Floats about here are 0.5, 0.125 and 64 apart.
            (DVec3::new(412_345.678, 5_812_345.432, 123.4), true),
            (DVec3::new(0.0, 0.0, -1_234_567.3), true),
            (DVec3::new(1e9 + 0.3, 0.0, 0.0), true),
        ] {
            let (header, positions) = written_at(centre);
            assert_eq!(header.contains("double"), is_double, "{centre}");
            assert_eq!(header.contains("comment origin"), is_double, "{centre}");
            let expected = [DVec3::ZERO, DVec3::X * 0.5, DVec3::Y * 0.5];
            for (position, expected) in positions.into_iter().zip(expected) {
                let error = (position - centre - expected).length();
                assert!(error < 1e-3 * 0.5, "{position} at {centre}");
            }
        }
        let (header, _) = written_at(DVec3::new(412_345.5, 5_812_345.25, 123.0));
        assert!(
            header.contains("comment origin 412345.5 5812345.25 123, "),
            "{header}"
        );
    }
}
