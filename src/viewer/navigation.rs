//! Mouse and flying keys in the viewport: from drags and wheels to a camera.

use eframe::egui::{self, Key, PointerButton};
use glam::{Vec2, Vec3};

use super::{
    action::Action,
    panel_state::PanelState,
    pick::{self, Pick},
    state::State,
};
use crate::scene::{Lighting, SunSource};

/// Degrees that the sun goes for each point that it is dragged: a window's width takes it nearly around. Less needs
/// several drags for a day, more makes single degrees hard to hit.
const SUN_DEGREES: f32 = 0.25;

/// The result of a click.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Picked {
    /// This point was clicked.
    Surface(Pick),
    /// The background was clicked.
    Nothing,
}

/// Move the camera, or the sun, by what the mouse did; returns what a click picked. Asks for a repaint only while the
/// camera moves. A requested action goes into `actions`.
pub fn navigate(
    ui: &egui::Ui,
    response: &egui::Response,
    state: &mut State,
    actions: &mut Vec<Action>,
) -> Option<Picked> {
    let rect = response.rect;
    let modifiers = ui.input(|input| input.modifiers);
    let drag = response.drag_delta();
    let drag = Vec2::new(drag.x, drag.y);
    let sun = state.sun().filter(|_| state.panels.drags_sun);
    let camera = &mut state.rig.target;
    // Move by drags.
    if let Some(sun) = sun
        && response.dragged_by(PointerButton::Primary)
        && !modifiers.shift
    {
        actions.extend(dragged(sun, drag).map(|sun| {
            let lighting = state.lighting.clone();
            let sun = Some(sun);
            Action::Light(Lighting { sun, ..lighting })
        }));
    } else if response.dragged_by(PointerButton::Primary) && !modifiers.shift {
        camera.orbit(drag);
    } else if response.dragged_by(PointerButton::Primary)
        || response.dragged_by(PointerButton::Middle)
    {
        camera.pan(drag, rect.height());
    } else if response.dragged_by(PointerButton::Secondary) && modifiers.command {
        let pivot = camera.pivot;
        camera.zoom_towards((drag.y * 0.01).exp(), pivot);
    } else if response.dragged_by(PointerButton::Secondary) {
        camera.look(drag);
    }
    // Fly while the right button is held.
    let holds_right =
        response.is_pointer_button_down_on() && ui.input(|input| input.pointer.secondary_down());
    if holds_right {
        fly(ui, state);
    }
    // Zoom to what is under the cursor.
    if response.contains_pointer() {
        zoom(ui, rect, state, holds_right);
    }
    // Glide.
    let seconds = ui.input(|input| input.stable_dt).min(0.1);
    if state.rig.advance(seconds) {
        ui.ctx().request_repaint();
    }
    clicked(response, state)
}

/// A sun after a drag in points, as if the viewer looked towards it: to the right is clockwise, up is higher. `None` where
/// it stays.
fn dragged(sun: SunSource, drag: Vec2) -> Option<SunSource> {
    let SunSource::Disc {
        azimuth,
        elevation,
        irradiance,
        diameter,
    } = sun
    else {
        return None;
    };
    let moved = SunSource::Disc {
        azimuth: (azimuth + drag.x * SUN_DEGREES).rem_euclid(360.0),
        elevation: (elevation - drag.y * SUN_DEGREES).clamp(-90.0, 90.0),
        irradiance,
        diameter,
    };
    (drag != Vec2::ZERO && moved != sun).then_some(moved)
}

/// Move eye and pivot with W A S D Q E.
fn fly(ui: &egui::Ui, state: &mut State) {
    let (keys, modifiers, seconds) = ui.input(|input| {
        let axis = |plus, minus| {
            f32::from(u8::from(input.key_down(plus))) - f32::from(u8::from(input.key_down(minus)))
        };
        let keys = Vec3::new(
            axis(Key::D, Key::A),
            axis(Key::E, Key::Q),
            axis(Key::W, Key::S),
        );
        (keys, input.modifiers, input.stable_dt.min(0.1))
    });
    if keys == Vec3::ZERO {
        return;
    }
    let speed_factor = match (modifiers.shift, modifiers.ctrl) {
        (true, _) => 4.0,
        (_, true) => 0.25,
        _ => 1.0,
    };
    let step = state.panels.fly_speed * speed_factor * seconds;
    state.rig.target.fly(keys * step);
    ui.ctx().request_repaint();
}

/// The wheel and pinching; while flying the wheel changes the speed.
fn zoom(ui: &egui::Ui, rect: egui::Rect, state: &mut State, flies: bool) {
    let (scroll, pinch, pointer) = ui.input(|input| {
        (
            input.smooth_scroll_delta().y,
            input.zoom_delta(),
            input.pointer.hover_pos(),
        )
    });
    if flies {
        let speed = state.panels.fly_speed * (scroll * 0.004).exp();
        let (slowest, fastest) = PanelState::FLY_SPEED_RANGE.into_inner();
        state.panels.fly_speed = speed.clamp(slowest, fastest);
        return;
    }
    let factor = (-scroll * 0.004).exp() / pinch.max(1e-3);
    let (true, Some(pointer)) = ((factor - 1.0).abs() > 1e-5, pointer) else {
        return;
    };
    let point = point_under(rect, state, pointer);
    state.rig.target.zoom_towards(factor, point);
}

/// The surface under the pointer, or the plane of the pivot.
fn point_under(rect: egui::Rect, state: &State, pointer: egui::Pos2) -> Vec3 {
    let camera = &state.rig.target;
    let aspect = rect.width() / rect.height().max(1.0);
    let ndc = ndc_of(rect, pointer);
    let surface = state
        .loaded
        .as_ref()
        .and_then(|loaded| pick::pick(loaded, camera, ndc, aspect, &state.view));
    surface.map_or_else(
        || {
            let (origin, direction) = camera.ray(ndc, aspect);
            let backward = camera.backward();
            let along = (camera.pivot - origin).dot(backward) / direction.dot(backward);
            origin + direction * along
        },
        |pick| pick.point,
    )
}

/// The action of a click or double click.
fn clicked(response: &egui::Response, state: &mut State) -> Option<Picked> {
    if !response.clicked() && !response.double_clicked() {
        return None;
    }
    let loaded = state.loaded.as_ref()?;
    let rect = response.rect;
    let ndc = ndc_of(rect, response.interact_pointer_pos()?);
    let aspect = rect.width() / rect.height().max(1.0);
    let hit = pick::pick(loaded, &state.rig.current, ndc, aspect, &state.view);
    if response.double_clicked() {
        match hit {
            Some(pick) => state.rig.target.set_pivot(pick.point),
            None => state.frame_all(),
        }
        response.ctx.request_repaint();
    }
    Some(hit.map_or(Picked::Nothing, Picked::Surface))
}

/// A point of the window as a point of the picture; −1…1, y up.
fn ndc_of(rect: egui::Rect, point: egui::Pos2) -> Vec2 {
    let offset = (point - rect.center()) / (0.5 * rect.size());
    Vec2::new(offset.x, -offset.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_goes_with_the_drag_and_stops_at_the_zenith() {
        let sun = |azimuth: f32, elevation: f32| SunSource::Disc {
            azimuth,
            elevation,
            irradiance: Vec3::ONE,
            diameter: 0.53,
        };
        let moved = |x, y| dragged(sun(350.0, 80.0), Vec2::new(x, y));
        assert_eq!(moved(80.0, 0.0), Some(sun(10.0, 80.0)));
        assert_eq!(moved(0.0, 40.0), Some(sun(350.0, 70.0)));
        assert_eq!(moved(0.0, -400.0), Some(sun(350.0, 90.0)));
        assert_eq!(moved(0.0, 0.0), None);
        assert_eq!(dragged(SunSource::Dark, Vec2::ONE), None);
    }
}
