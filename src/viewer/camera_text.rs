//! The camera as the flags that the command line takes, to be copied and pasted as text.

use glam::{DVec3, Vec3};

use super::{camera::Camera, options::CameraRequest};
use crate::scene::Frame;

/// The flags that show what a camera shows.
pub fn to_flags(camera: &Camera, frame: &Frame) -> String {
    let point = |point: Vec3| {
        // As many digits as single precision has in the frame.
        let step = f64::from(f32::EPSILON) * Frame::EXTENT / frame.scale;
        let decimals = (-step.log10()).ceil().clamp(0.0, 17.0) as usize;
        let DVec3 { x, y, z } = frame.to_world(point);
        format!("{x:.decimals$},{y:.decimals$},{z:.decimals$}")
    };
    let Vec3 { x, y, z } = camera.up;
    format!(
        "--camera-position={} --camera-focal-point={} --camera-view-up={x},{y},{z} --camera-view-angle={}",
        point(camera.eye()),
        point(camera.pivot),
        camera.fov_y_radians.to_degrees()
    )
}

/// The camera that a text asks for by such flags; `None` where it has none, or one that cannot be read.
pub fn from_flags(text: &str) -> Option<CameraRequest> {
    let mut request = CameraRequest::default();
    let mut words = text.split_whitespace();
    while let Some(word) = words.next() {
        let Some(flag) = word.strip_prefix("--camera-") else {
            continue;
        };
        let (name, value) = match flag.split_once('=') {
            Some(both) => both,
            None => (flag, words.next()?),
        };
        match name {
            "position" => request.position = Some(triple(value)?),
            "focal-point" => request.focal_point = Some(triple(value)?),
            "view-up" => request.up = Some(triple(value)?.as_vec3().try_normalize()?),
            "view-angle" => {
                let degrees: f32 = value.parse().ok()?;
                request.view_angle_degrees = Some(Some(degrees).filter(|it| it.is_finite())?);
            }
            _ => return None,
        }
    }
    (request != CameraRequest::default()).then_some(request)
}

fn triple(text: &str) -> Option<DVec3> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    let [x, y, z] = numbers.ok()?[..] else {
        return None;
    };
    Some(DVec3::new(x, y, z)).filter(|point| point.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_lead_back_to_the_camera() {
        for scale in [1e-5, 0.03, 1.0, 2e4] {
            let frame = Frame {
                centre: DVec3::new(412_345.678, -20.0, 3.0),
                scale,
            };
            let camera = Camera {
                fov_y_radians: 0.7,
                ..Camera::looking(
                    Vec3::new(10.0, 22.0, 31.0),
                    Vec3::new(1.0, 0.5, -2.0),
                    Vec3::Z,
                )
            };
            let text = to_flags(&camera, &frame);
            let read = from_flags(&text).expect("its own text");
            let found = read.apply(Camera::default(), &frame);
            assert!(found.eye().distance(camera.eye()) < 1e-3, "{text}");
            assert!(found.pivot.distance(camera.pivot) < 1e-3, "{text}");
            assert!((found.fov_y_radians - 0.7).abs() < 1e-5);
            assert_eq!(found.up, Vec3::Z);
        }
    }

    #[test]
    fn other_text_is_no_camera() {
        for text in [
            "",
            "hello",
            "--camera-position",
            "--camera-position=1,2",
            "--camera-position=1,2,nan",
            "--camera-view-up=0,0,0",
            "--camera-view-angle=wide",
            "--camera-roll=3",
        ] {
            assert_eq!(from_flags(text), None, "{text}");
        }
        let found = from_flags("vecrad solve a.obj --camera-position 1,2,-3 -q").expect("a place");
        assert_eq!(found.position, Some(DVec3::new(1.0, 2.0, -3.0)));
        assert_eq!(found.focal_point, None);
    }
}
