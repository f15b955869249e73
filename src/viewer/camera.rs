//! The camera: a turntable around a pivot, in frame units, with smoothed motion.
//!
//! Frame units make tiny and huge scenes alike: the largest extent of any scene is 100.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Mat4, Quat, Vec2, Vec3, camera::rh};

/// A direction to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisView {
    /// From the front.
    Front,
    /// From the right.
    Right,
    /// From behind.
    Back,
    /// From the left.
    Left,
    /// From above.
    Top,
    /// From below.
    Bottom,
    /// From above, front and right.
    Isometric,
}

impl AxisView {
    /// From the other side; the same where there is none.
    pub fn opposite(self) -> Self {
        match self {
            Self::Front => Self::Back,
            Self::Back => Self::Front,
            Self::Right => Self::Left,
            Self::Left => Self::Right,
            Self::Top => Self::Bottom,
            Self::Bottom => Self::Top,
            Self::Isometric => Self::Isometric,
        }
    }
}

/// Closest distance to the pivot. Smaller, and single precision makes the picture tremble.
const MIN_DISTANCE: f32 = 0.02;
/// Farthest distance: the scene is a few pixels there.
const MAX_DISTANCE: f32 = 5000.0;
/// Nearer surfaces are cut off. Smaller costs depth precision on GL, where depth is not reversed; larger cuts into
/// walls that a camera stands beside.
const NEAR: f32 = 0.01;
/// Depth of an orthographic picture on each side of the pivot.
const ORTHOGRAPHIC_DEPTH: f32 = 6000.0;
/// Short of the pole by this, so that the horizon is always defined.
const MAX_PITCH: f32 = FRAC_PI_2 - 1e-3;

/// A turntable camera. Positions in frame units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point that it looks at and turns around.
    pub pivot: Vec3,
    /// Radians around the up axis; 0 looks from the front.
    pub yaw: f32,
    /// Radians above the horizon, −π/2…π/2.
    pub pitch: f32,
    /// From the pivot, above 0.
    pub distance: f32,
    /// Vertical angle of view.
    pub fov_y_radians: f32,
    /// Parallel instead of central projection.
    pub orthographic: bool,
    /// The up direction, a unit vector; the camera turns around it.
    pub up: Vec3,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            pivot: Vec3::ZERO,
            yaw: 0.6,
            pitch: 0.35,
            distance: 180.0,
            fov_y_radians: 45_f32.to_radians(),
            orthographic: false,
            up: Vec3::Y,
        }
    }
}

impl Camera {
    /// A camera at a point that looks at another. Points that coincide look to the back from one unit away.
    pub fn looking(eye: Vec3, target: Vec3, up: Vec3) -> Self {
        let camera = Self {
            up,
            ..Self::default()
        };
        let away = camera.to_y_up(eye - target);
        let distance = away.length();
        let away = away.try_normalize().unwrap_or(Vec3::Z);
        Self {
            pivot: target,
            yaw: away.x.atan2(away.z),
            pitch: away.y.clamp(-1.0, 1.0).asin().clamp(-MAX_PITCH, MAX_PITCH),
            distance: distance.clamp(MIN_DISTANCE, MAX_DISTANCE),
            ..camera
        }
    }

    /// Scene directions to directions with y up.
    fn to_y_up(self, v: Vec3) -> Vec3 {
        Quat::from_rotation_arc(self.up, Vec3::Y) * v
    }

    /// Directions with y up to scene directions.
    fn to_scene(self, v: Vec3) -> Vec3 {
        Quat::from_rotation_arc(self.up, Vec3::Y).inverse() * v
    }

    /// Unit vector from the pivot to the eye.
    pub fn backward(&self) -> Vec3 {
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        self.to_scene(Vec3::new(
            sin_yaw * cos_pitch,
            sin_pitch,
            cos_yaw * cos_pitch,
        ))
    }

    /// Unit vector to the right of the picture.
    pub fn right(&self) -> Vec3 {
        let (sin_yaw, cos_yaw) = self.yaw.sin_cos();
        self.to_scene(Vec3::new(cos_yaw, 0.0, -sin_yaw))
    }

    /// Unit vector to the top of the picture.
    pub fn upward(&self) -> Vec3 {
        self.backward().cross(self.right())
    }

    /// Where the eye is.
    pub fn eye(&self) -> Vec3 {
        self.pivot + self.backward() * self.distance
    }

    /// Height of the picture at the pivot, in frame units.
    pub fn height_at_pivot(&self) -> f32 {
        2.0 * self.distance * (0.5 * self.fov_y_radians).tan()
    }

    /// Clip space (depth 1 near, 0 far) from frame coordinates. `aspect` is width over height.
    pub fn clip_from_frame(&self, aspect: f32) -> Mat4 {
        let view_from_frame = rh::view::look_to_mat4(self.eye(), -self.backward(), self.upward());
        let clip_from_view = if self.orthographic {
            let half = 0.5 * self.height_at_pivot();
            // Near and far exchanged: depth is reversed as in perspective.
            rh::proj::directx::orthographic(
                -half * aspect,
                half * aspect,
                -half,
                half,
                self.distance + ORTHOGRAPHIC_DEPTH,
                self.distance - ORTHOGRAPHIC_DEPTH,
            )
        } else {
            rh::proj::directx::perspective_infinite_reverse(self.fov_y_radians, aspect, NEAR)
        };
        clip_from_view * view_from_frame
    }

    /// Origin and unit direction of the ray through a point of the picture; −1…1, y up.
    pub fn ray(&self, ndc: Vec2, aspect: f32) -> (Vec3, Vec3) {
        let half = 0.5 * self.height_at_pivot();
        let offset = self.right() * (ndc.x * half * aspect) + self.upward() * (ndc.y * half);
        let forward = -self.backward();
        if self.orthographic {
            // From before the scene, so that nothing is missed.
            let start = self.pivot + offset - forward * (self.distance + 200.0);
            (start, forward)
        } else {
            let through = (forward * self.distance + offset).normalize_or(forward);
            (self.eye(), through)
        }
    }

    /// The directions that are seen, linear in the place of the picture: that of its middle, and what those of its right
    /// edge and of its upper edge differ by. In parallel projection all are the same.
    pub fn rays(&self, aspect: f32) -> [Vec3; 3] {
        let half = match self.orthographic {
            true => 0.0,
            false => (0.5 * self.fov_y_radians).tan(),
        };
        [
            -self.backward(),
            self.right() * (half * aspect),
            self.upward() * half,
        ]
    }

    /// Turn by a drag in points.
    pub fn orbit(&mut self, drag: Vec2) {
        const RADIANS_PER_POINT: f32 = 0.008;
        self.yaw = (self.yaw - drag.x * RADIANS_PER_POINT).rem_euclid(2.0 * PI);
        self.pitch = (self.pitch + drag.y * RADIANS_PER_POINT).clamp(-MAX_PITCH, MAX_PITCH);
    }

    /// Move the scene with a drag in points, in a picture of this height.
    pub fn pan(&mut self, drag: Vec2, picture_height: f32) {
        let per_point = self.height_at_pivot() / picture_height.max(1.0);
        self.pivot += (self.upward() * drag.y - self.right() * drag.x) * per_point;
    }

    /// Come nearer (factor below 1) or go back, keeping the point under the cursor where it is in the picture.
    pub fn zoom_towards(&mut self, factor: f32, point: Vec3) {
        let distance = (self.distance * factor).clamp(MIN_DISTANCE, MAX_DISTANCE);
        let factor = distance / self.distance;
        self.pivot = point + (self.pivot - point) * factor;
        self.distance = distance;
    }

    /// Turn the head: the eye stays.
    pub fn look(&mut self, drag: Vec2) {
        let eye = self.eye();
        self.orbit(drag * 0.5);
        self.pivot = eye - self.backward() * self.distance;
    }

    /// Move eye and pivot together: x right, y up, z forward, in frame units.
    pub fn fly(&mut self, step: Vec3) {
        self.pivot += self.right() * step.x + self.upward() * step.y - self.backward() * step.z;
    }

    /// Turn around another point without moving the eye or the picture's direction more than needed.
    pub fn set_pivot(&mut self, point: Vec3) {
        let eye = self.eye();
        let turned = Self::looking(eye, point, self.up);
        self.pivot = point;
        self.yaw = turned.yaw;
        self.pitch = turned.pitch;
        self.distance = turned.distance;
    }

    /// Show a whole box, from the direction that it has.
    pub fn frame_box(&mut self, min: Vec3, max: Vec3, aspect: f32) {
        let radius = (0.5 * (max - min).length()).max(MIN_DISTANCE);
        let narrow = (0.5 * self.fov_y_radians).tan() * aspect.min(1.0);
        self.pivot = 0.5 * (min + max);
        self.distance = (radius / narrow.atan().sin()).clamp(MIN_DISTANCE, MAX_DISTANCE);
    }

    /// Show a whole box as large as it can be, from the direction that it has.
    pub fn fit_box(&mut self, min: Vec3, max: Vec3, aspect: f32) {
        /// Share of the picture that the box takes.
        const SHARE: f32 = 0.92;
        self.pivot = 0.5 * (min + max);
        let half = 0.5 * (max - min);
        let tan = (0.5 * self.fov_y_radians).tan() * SHARE;
        let needed = (0..8).map(|corner| {
            let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            let corner = half * Vec3::new(sign(0), sign(1), sign(2));
            let across = corner.dot(self.right()).abs() / (tan * aspect);
            let up = corner.dot(self.upward()).abs() / tan;
            corner.dot(self.backward()) + across.max(up)
        });
        let needed = needed.fold(MIN_DISTANCE, f32::max);
        self.distance = needed.min(MAX_DISTANCE);
    }

    /// The same angle of view and projection from another place.
    pub fn placed(&self, eye: Vec3, pivot: Vec3, up: Vec3) -> Self {
        Self {
            fov_y_radians: self.fov_y_radians,
            orthographic: self.orthographic,
            ..Self::looking(eye, pivot, up)
        }
    }

    /// Look along an axis; the other way along it where the camera does so already.
    pub fn look_from(&mut self, view: AxisView) {
        let along = Self::angles_from(view);
        (self.yaw, self.pitch) = match (self.yaw, self.pitch) == along {
            true => Self::angles_from(view.opposite()),
            false => along,
        };
    }

    /// Yaw and pitch.
    fn angles_from(view: AxisView) -> (f32, f32) {
        match view {
            AxisView::Front => (0.0, 0.0),
            AxisView::Back => (PI, 0.0),
            AxisView::Right => (FRAC_PI_2, 0.0),
            AxisView::Left => (-FRAC_PI_2, 0.0),
            AxisView::Top => (0.0, MAX_PITCH),
            AxisView::Bottom => (0.0, -MAX_PITCH),
            AxisView::Isometric => (PI / 4.0, (1.0 / 3_f32.sqrt()).asin()),
        }
    }

    /// Whether all figures are finite and in range.
    pub fn is_valid(&self) -> bool {
        let distance = MIN_DISTANCE..=MAX_DISTANCE;
        self.pivot.is_finite()
            && self.up.is_normalized()
            && self.yaw.is_finite()
            && self.pitch.abs() <= FRAC_PI_2
            && distance.contains(&self.distance)
            && self.fov_y_radians > 0.01
            && self.fov_y_radians < 3.1
    }
}

/// A camera that moves smoothly to its target.
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraRig {
    /// Where it is going.
    pub target: Camera,
    /// Where it is.
    pub current: Camera,
}

impl CameraRig {
    /// Time constant of the glide, in seconds. Shorter feels hard, longer feels like lag.
    const GLIDE_SECS: f32 = 0.06;

    /// Be there at once.
    pub fn jump(&mut self, camera: Camera) {
        self.target = camera;
        self.current = camera;
    }

    /// Move on by a time. Returns whether it is still on its way.
    pub fn advance(&mut self, seconds: f32) -> bool {
        let (target, current) = (self.target, &mut self.current);
        let mut yaw = (target.yaw - current.yaw).rem_euclid(2.0 * PI);
        if yaw > PI {
            yaw -= 2.0 * PI;
        }
        let share = 1.0 - (-seconds.max(0.0) / Self::GLIDE_SECS).exp();
        let gap = (target.pivot - current.pivot).length() / target.distance
            + yaw.abs()
            + (target.pitch - current.pitch).abs()
            + (target.distance / current.distance).ln().abs();
        // Below a thousandth nothing moves by a pixel.
        if gap < 1e-3 {
            *current = target;
            return false;
        }
        current.pivot = current.pivot.lerp(target.pivot, share);
        current.yaw += yaw * share;
        current.pitch += (target.pitch - current.pitch) * share;
        current.distance *= (target.distance / current.distance).powf(share);
        current.fov_y_radians = target.fov_y_radians;
        current.orthographic = target.orthographic;
        current.up = target.up;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ndc_of(camera: &Camera, point: Vec3, aspect: f32) -> Vec3 {
        camera.clip_from_frame(aspect).project_point3(point)
    }

    #[test]
    fn pivot_is_in_the_middle_of_the_picture() {
        for orthographic in [false, true] {
            let camera = Camera {
                pivot: Vec3::new(3.0, -2.0, 7.0),
                orthographic,
                ..Camera::default()
            };
            let ndc = ndc_of(&camera, camera.pivot, 1.5);
            assert!(ndc.truncate().length() < 1e-4, "{ndc}");
            assert!(ndc.z > 0.0 && ndc.z < 1.0, "{ndc}");
        }
    }

    #[test]
    fn nearer_points_have_greater_depth() {
        for orthographic in [false, true] {
            let camera = Camera {
                orthographic,
                ..Camera::default()
            };
            let near = ndc_of(&camera, camera.pivot + camera.backward() * 10.0, 1.0);
            let far = ndc_of(&camera, camera.pivot - camera.backward() * 10.0, 1.0);
            assert!(near.z > far.z, "{near} {far}");
        }
    }

    #[test]
    fn ray_goes_through_the_point_of_the_picture() {
        let aspect = 1.7;
        for up in [Vec3::Y, Vec3::Z] {
            for orthographic in [false, true] {
                let camera = Camera {
                    up,
                    orthographic,
                    ..Camera::default()
                };
                let ndc = Vec2::new(0.4, -0.6);
                let (origin, direction) = camera.ray(ndc, aspect);
                let seen = ndc_of(&camera, origin + direction * 300.0, aspect);
                assert!((seen.truncate() - ndc).length() < 1e-3, "{seen}");
            }
        }
    }

    #[test]
    fn zoom_keeps_the_point_under_the_cursor() {
        let mut camera = Camera::default();
        let point = Vec3::new(12.0, 5.0, -8.0);
        let before = ndc_of(&camera, point, 1.3).truncate();
        camera.zoom_towards(0.5, point);
        let after = ndc_of(&camera, point, 1.3).truncate();
        assert!((before - after).length() < 1e-3, "{before} {after}");
    }

    #[test]
    fn looking_puts_the_eye_where_it_was_asked() {
        let slanted = Vec3::new(1.0, -2.0, 0.5).normalize_or_zero();
        for up in [Vec3::Y, Vec3::Z, Vec3::NEG_Y, slanted] {
            let (eye, target) = (Vec3::new(10.0, 20.0, 30.0), Vec3::new(-1.0, 2.0, 3.0));
            let camera = Camera::looking(eye, target, up);
            assert!((camera.eye() - eye).length() < 1e-3, "{}", camera.eye());
            assert!(camera.right().dot(up).abs() < 1e-6, "the horizon is level");
            assert!(camera.upward().dot(up) > 0.0);
        }
    }

    #[test]
    fn looking_around_keeps_the_eye() {
        let mut camera = Camera::default();
        let eye = camera.eye();
        camera.look(Vec2::new(40.0, 25.0));
        assert!((camera.eye() - eye).length() < 1e-3);
    }

    #[test]
    fn horizon_is_kept() {
        let mut camera = Camera::default();
        camera.orbit(Vec2::new(123.0, 4000.0));
        assert!(camera.right().y.abs() < 1e-6);
        assert!(camera.upward().y > 0.0);
    }

    #[test]
    fn glide_arrives_and_then_rests() {
        let mut rig = CameraRig::default();
        rig.target.orbit(Vec2::new(200.0, 50.0));
        rig.target.zoom_towards(0.2, Vec3::ONE);
        let steps = (0..1000).take_while(|_| rig.advance(0.016)).count();
        assert!(steps > 2 && steps < 200, "{steps}");
        assert_eq!(rig.current, rig.target);
        assert!(!rig.advance(0.016));
    }

    #[test]
    fn framed_box_is_inside_the_picture() {
        let (min, max) = (Vec3::new(-50.0, -20.0, -30.0), Vec3::new(50.0, 20.0, 30.0));
        for frame in [Camera::frame_box, Camera::fit_box] {
            let mut camera = Camera::default();
            frame(&mut camera, min, max, 1.4);
            for corner in 0..8 {
                let pick = |bit: u32, axis: usize| {
                    if corner & bit == 0 {
                        min[axis]
                    } else {
                        max[axis]
                    }
                };
                let ndc = ndc_of(&camera, Vec3::new(pick(1, 0), pick(2, 1), pick(4, 2)), 1.4);
                assert!(ndc.x.abs() < 1.0 && ndc.y.abs() < 1.0, "{ndc}");
            }
        }
    }
}
