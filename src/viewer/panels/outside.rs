//! Sky and sun: on or off, how bright, in which colour, from where.

use eframe::egui;
use glam::Vec3;

use super::{
    color::color_button,
    row::{self, slider},
};
use crate::{
    scene::{Environment, Lighting, Scene, Sky, SkySource, Sun, SunSource},
    viewer::{action::Action, state::State},
};

/// Show sky and sun; a requested action goes into `actions`.
pub fn outside_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let Some(loaded) = &state.loaded else {
        return;
    };
    let mut lighting = state.lighting.clone();
    sky_ui(ui, &loaded.scene, &mut lighting);
    sun_ui(ui, &loaded.scene, &mut lighting);
    if lighting != state.lighting {
        actions.push(Action::Light(lighting));
    }
}

/// Brightness and colour of which the largest channel is 1.
fn split(light: Vec3) -> (f32, Vec3) {
    let strength = light.max_element();
    match strength > 0.0 {
        true => (strength, light / strength),
        false => (0.0, Vec3::ONE),
    }
}

/// The present sky as something that is asked for: a picture of the scene's own counts as none.
fn sky_of(environment: &Environment, unit: f32) -> SkySource {
    match environment.sky {
        Sky::Uniform(radiance) => SkySource::Uniform(radiance * unit),
        Sky::Dark | Sky::Picture(_) => SkySource::Dark,
    }
}

fn sky_ui(ui: &mut egui::Ui, scene: &Scene, lighting: &mut Lighting) {
    let environment = &scene.environment;
    if lighting.sky.is_none() && matches!(environment.sky, Sky::Picture(_)) {
        ui.weak("The scene brings its own sky along.");
        return;
    }
    let present = lighting.sky.clone();
    let mut sky = present.unwrap_or_else(|| sky_of(environment, scene.radiance_unit));
    let before = sky.clone();
    match &mut sky {
        SkySource::Picture { scale, .. } => {
            let explanation = "Factor on the radiance of the picture of the sky";
            row::setting(ui, "Sky picture", explanation, scale, &1.0, |ui, value| {
                ui.add(slider(value, 0.01..=100.0))
            });
        }
        SkySource::Dark => {
            let mut is_on = false;
            ui.checkbox(&mut is_on, "Sky")
                .on_hover_text("The same light from all directions");
            if is_on {
                sky = SkySource::Uniform(Vec3::ONE);
            }
        }
        SkySource::Uniform(radiance) => {
            let (mut strength, mut color) = split(*radiance);
            let mut is_on = true;
            ui.horizontal(|ui| {
                color_button(ui, "Colour of the sky", &mut color);
                ui.checkbox(&mut is_on, "Sky")
                    .on_hover_text("The same light from all directions");
            });
            let explanation = "Radiance of the sky, W/(sr·m²)";
            row::setting(
                ui,
                "Sky radiance",
                explanation,
                &mut strength,
                &1.0,
                |ui, value| ui.add(slider(value, 0.01..=100.0)),
            );
            *radiance = color * strength;
            if !is_on {
                sky = SkySource::Dark;
            }
        }
    }
    if sky != before {
        lighting.sky = Some(sky);
    }
}

/// The present sun as something that is asked for.
fn sun_of(scene: &Scene) -> SunSource {
    let Some(sun) = scene.environment.sun else {
        return SunSource::Dark;
    };
    let [azimuth, elevation] = sun.place(scene.up);
    SunSource::Disc {
        azimuth,
        elevation,
        irradiance: sun.irradiance * scene.radiance_unit,
        diameter: sun.diameter.to_degrees(),
    }
}

/// The sun that is switched on: in the afternoon.
const NEW_SUN: SunSource = SunSource::Disc {
    azimuth: 225.0,
    elevation: 40.0,
    irradiance: Vec3::splat(SunSource::IRRADIANCE),
    diameter: Sun::DEGREES,
};

fn sun_ui(ui: &mut egui::Ui, scene: &Scene, lighting: &mut Lighting) {
    let mut sun = lighting.sun.unwrap_or_else(|| sun_of(scene));
    let before = sun;
    match &mut sun {
        SunSource::Dark => {
            let mut is_on = false;
            ui.checkbox(&mut is_on, "Sun")
                .on_hover_text("A small disc in the sky");
            if is_on {
                sun = NEW_SUN;
            }
        }
        SunSource::Disc {
            azimuth,
            elevation,
            irradiance,
            ..
        } => {
            let (mut strength, mut color) = split(*irradiance);
            let mut is_on = true;
            ui.horizontal(|ui| {
                color_button(ui, "Colour of the sun", &mut color);
                ui.checkbox(&mut is_on, "Sun")
                    .on_hover_text("A small disc in the sky");
            });
            let degrees = |range| {
                move |ui: &mut egui::Ui, value: &mut f32| {
                    ui.add(egui::Slider::new(value, range).suffix("°"))
                }
            };
            row::setting(
                ui,
                "Sun azimuth",
                "Clockwise from north as seen from above: -Z, or +Y where Z is up",
                azimuth,
                &225.0,
                degrees(0.0..=360.0),
            );
            row::setting(
                ui,
                "Sun elevation",
                "Above the horizon",
                elevation,
                &40.0,
                degrees(-90.0..=90.0),
            );
            row::setting(
                ui,
                "Sun irradiance",
                "Of a surface that faces the sun, W/m²",
                &mut strength,
                &SunSource::IRRADIANCE,
                |ui, value| ui.add(slider(value, 0.01..=1000.0)),
            );
            *irradiance = color * strength;
            if !is_on {
                sun = SunSource::Dark;
            }
        }
    }
    if sun != before {
        lighting.sun = Some(sun);
    }
}
