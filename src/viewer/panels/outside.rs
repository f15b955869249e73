//! Sky and sun: on or off, how bright, in which colour, from where.

use eframe::egui;
use glam::Vec3;

use super::{
    color::color_button,
    row::{self, slider},
    solo::Solos,
};
use crate::{
    scene::{HosekSky, Lighting, Sky, SkySource, Sun, SunSource},
    solver::Lamp,
    viewer::{action::Action, loader::LoadedScene, state::State},
};

/// Show sky and sun; a requested action goes into `actions`.
pub fn outside_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let Some(loaded) = state.loaded.clone() else {
        return;
    };
    let mut lighting = state.lighting.clone();
    let solos = Solos::of(state);
    let [has_sky, has_sun] = state.has_outside();
    let mut solo = |ui: &mut egui::Ui, lamp: Lamp| match lamp {
        Lamp::Sky if has_sky => solos.button(ui, lamp, "the sky", actions),
        Lamp::Sun if has_sun => solos.button(ui, lamp, "the sun", actions),
        _ => {}
    };
    // Both, and no comparison of the pictures in it.
    let has_changed = sky_ui(ui, &loaded, &mut lighting, &mut solo)
        | sun_ui(
            ui,
            &loaded,
            &mut lighting,
            &mut state.panels.drags_sun,
            &mut solo,
        );
    if has_changed {
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

/// The sky that there is, or would be were it switched on.
fn sky_of(loaded: &LoadedScene, lighting: &Lighting) -> SkySource {
    let (own, scene) = (&loaded.own_environment, &loaded.scene);
    match &lighting.sky {
        Some(sky) => sky.clone(),
        None if matches!(own.sky, Sky::Dark) && loaded.emitter_count == 0 => {
            SkySource::Uniform(Vec3::ONE)
        }
        None => SkySource::of(&own.sky, scene.up, scene.radiance_unit),
    }
}

/// Shows the button of a light that may be shown alone.
type SoloButton<'a> = &'a mut dyn FnMut(&mut egui::Ui, Lamp);

/// Kinds of sky.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SkyKind {
    Uniform,
    Hosek,
    Picture,
}

/// Turbidity of a clear day.
const CLEAR: f32 = 3.0;

fn sky_ui(
    ui: &mut egui::Ui,
    loaded: &LoadedScene,
    lighting: &mut Lighting,
    solo: SoloButton<'_>,
) -> bool {
    let mut sky = sky_of(loaded, lighting);
    let was_on = sky != SkySource::Dark && !lighting.is_sky_off;
    let mut is_on = was_on;
    let mut has_changed = false;
    ui.horizontal(|ui| {
        if let Some(scale) = sky.scale_mut().filter(|_| was_on) {
            let (strength, mut color) = split(*scale);
            let before = color;
            color_button(ui, "Colour of the sky", &mut color);
            if color != before {
                *scale = color * strength;
                has_changed = true;
            }
        }
        ui.checkbox(&mut is_on, "Sky")
            .on_hover_text("Light from all around");
        solo(ui, Lamp::Sky);
    });
    if is_on != was_on {
        lighting.is_sky_off = !is_on;
        if sky == SkySource::Dark {
            lighting.sky = Some(SkySource::Uniform(Vec3::ONE));
        }
        return true;
    }
    if !is_on {
        return false;
    }
    has_changed |= kind_ui(ui, loaded, lighting, &mut sky);
    let (name, explanation) = match &sky {
        SkySource::Dark | SkySource::Uniform(_) => {
            ("Sky radiance", "Radiance of the sky, W/(sr·m²)")
        }
        SkySource::Hosek { .. } | SkySource::Picture { .. } => {
            ("Sky strength", "Factor on the radiance of the sky")
        }
    };
    if let Some(scale) = sky.scale_mut() {
        let (mut strength, color) = split(*scale);
        let is_changed = row::setting(ui, name, explanation, &mut strength, &1.0, |ui, value| {
            ui.add(slider(value, 0.01..=100.0))
        });
        if is_changed {
            *scale = color * strength;
            has_changed = true;
        }
    }
    match &mut sky {
        SkySource::Dark | SkySource::Uniform(_) => {}
        SkySource::Hosek { turbidity, .. } => {
            let explanation = "Turbidity: 1 in clean air, 3 on a clear day, 10 in haze";
            has_changed |= row::setting(ui, "Haze", explanation, turbidity, &CLEAR, |ui, value| {
                ui.add(egui::Slider::new(value, 1.0..=10.0))
            });
        }
        SkySource::Picture { rotation, .. } => {
            let explanation = "Turn of the picture, clockwise as seen from above";
            has_changed |= row::setting(
                ui,
                "Sky rotation",
                explanation,
                rotation,
                &0.0,
                |ui, value| ui.add(egui::Slider::new(value, -180.0..=180.0).suffix("°")),
            );
        }
    }
    if has_changed {
        lighting.sky = Some(sky);
    }
    has_changed
}

/// What the sky is. A clear day comes with its sun.
fn kind_ui(
    ui: &mut egui::Ui,
    loaded: &LoadedScene,
    lighting: &mut Lighting,
    sky: &mut SkySource,
) -> bool {
    let mut kind = match sky {
        SkySource::Dark | SkySource::Uniform(_) => SkyKind::Uniform,
        SkySource::Hosek { .. } => SkyKind::Hosek,
        SkySource::Picture { .. } => SkyKind::Picture,
    };
    let mut options = vec![
        (SkyKind::Uniform, "Uniform", "The same from all directions"),
        (
            SkyKind::Hosek,
            "Clear day",
            "Blue, about the place of the sun",
        ),
    ];
    if kind == SkyKind::Picture {
        options.push((SkyKind::Picture, "Picture", "An equirectangular picture"));
    }
    let explanation = "Where the light of the sky comes from";
    let before = kind;
    row::setting(
        ui,
        "Kind of sky",
        explanation,
        &mut kind,
        &before,
        |ui, value| row::choice(ui, "Kind of sky", value, &options),
    );
    if kind == before {
        return false;
    }
    match kind {
        SkyKind::Uniform => *sky = SkySource::Uniform(Vec3::ONE),
        SkyKind::Hosek => {
            *sky = clear_day(loaded, lighting);
        }
        SkyKind::Picture => {}
    }
    true
}

/// A clear sky about the sun, which is switched on. Both are as bright beside each other as they are by nature, and the
/// sun is as bright as before.
fn clear_day(loaded: &LoadedScene, lighting: &mut Lighting) -> SkySource {
    let sun = match sun_of(loaded, lighting) {
        SunSource::Disc {
            azimuth,
            elevation,
            irradiance,
            diameter,
        } if elevation >= 0.0 => (azimuth, elevation, irradiance.max_element(), diameter),
        _ => (
            NEW_PLACE[0],
            NEW_PLACE[1],
            SunSource::IRRADIANCE,
            Sun::DEGREES,
        ),
    };
    let (azimuth, elevation, strength, diameter) = sun;
    let by_nature =
        HosekSky::new(CLEAR, azimuth, elevation).map_or(Vec3::ONE, |day| day.sun_irradiance);
    let scale = strength / by_nature.max_element();
    lighting.is_sun_off = false;
    lighting.sun = Some(SunSource::Disc {
        azimuth,
        elevation,
        irradiance: by_nature * scale,
        diameter,
    });
    SkySource::Hosek {
        turbidity: CLEAR,
        scale: Vec3::splat(scale),
    }
}

/// Azimuth and elevation of a sun that is switched on where there was none: in the afternoon.
const NEW_PLACE: [f32; 2] = [225.0, 40.0];

/// The sun that there is, or would be were it switched on.
fn sun_of(loaded: &LoadedScene, lighting: &Lighting) -> SunSource {
    let (own, scene) = (&loaded.own_environment, &loaded.scene);
    lighting.sun.unwrap_or_else(|| match &own.sun {
        Some(sun) => SunSource::of(sun, scene.up, scene.radiance_unit),
        None => SunSource::Dark,
    })
}

fn sun_ui(
    ui: &mut egui::Ui,
    loaded: &LoadedScene,
    lighting: &mut Lighting,
    is_dragged: &mut bool,
    solo: SoloButton<'_>,
) -> bool {
    let mut sun = sun_of(loaded, lighting);
    let was_on = sun != SunSource::Dark && !lighting.is_sun_off;
    let mut is_on = was_on;
    let before = sun;
    ui.horizontal(|ui| {
        if let (true, SunSource::Disc { irradiance, .. }) = (was_on, &mut sun) {
            let (strength, mut color) = split(*irradiance);
            color_button(ui, "Colour of the sun", &mut color);
            *irradiance = color * strength;
        }
        ui.checkbox(&mut is_on, "Sun")
            .on_hover_text("A small disc in the sky");
        solo(ui, Lamp::Sun);
        if was_on {
            ui.toggle_value(is_dragged, "Drag sun").on_hover_text(
                "Left drag in the view moves the sun: across its azimuth, up and down its elevation (U)",
            );
        }
    });
    if is_on != was_on {
        lighting.is_sun_off = !is_on;
        *is_dragged &= is_on;
        if sun == SunSource::Dark {
            lighting.sun = Some(new_sun());
        }
        return true;
    }
    if let (true, SunSource::Disc { .. }) = (is_on, sun) {
        disc_ui(ui, &mut sun);
    }
    if sun == before {
        return false;
    }
    lighting.sun = Some(sun);
    true
}

fn disc_ui(ui: &mut egui::Ui, sun: &mut SunSource) {
    let SunSource::Disc {
        azimuth,
        elevation,
        irradiance,
        diameter,
    } = sun
    else {
        return;
    };
    let degrees = |range| {
        move |ui: &mut egui::Ui, value: &mut f32| {
            ui.add(egui::Slider::new(value, range).suffix("°"))
        }
    };
    let [new_azimuth, new_elevation] = NEW_PLACE;
    // On the command line it may be negative.
    let mut shown = azimuth.rem_euclid(360.0);
    let explanation = "Clockwise from north as seen from above: -Z, or +Y where Z is up";
    let is_changed = row::setting(
        ui,
        "Sun azimuth",
        explanation,
        &mut shown,
        &new_azimuth,
        degrees(0.0..=360.0),
    );
    if is_changed {
        *azimuth = shown;
    }
    row::setting(
        ui,
        "Sun elevation",
        "Above the horizon",
        elevation,
        &new_elevation,
        degrees(-90.0..=90.0),
    );
    let (mut strength, color) = split(*irradiance);
    let explanation = "Of a surface that faces the sun, W/m²";
    let default = SunSource::IRRADIANCE;
    let is_changed = row::setting(
        ui,
        "Sun irradiance",
        explanation,
        &mut strength,
        &default,
        |ui, value| ui.add(slider(value, 0.01..=1000.0)),
    );
    if is_changed {
        *irradiance = color * strength;
    }
    let explanation = "The larger, the softer its shadows";
    row::setting(
        ui,
        "Sun diameter",
        explanation,
        diameter,
        &Sun::DEGREES,
        |ui, value| {
            let slider = egui::Slider::new(value, 0.1..=90.0).logarithmic(true);
            ui.add(slider.suffix("°"))
        },
    );
}

/// The sun that is switched on where there was none.
fn new_sun() -> SunSource {
    let [azimuth, elevation] = NEW_PLACE;
    SunSource::Disc {
        azimuth,
        elevation,
        irradiance: Vec3::splat(SunSource::IRRADIANCE),
        diameter: Sun::DEGREES,
    }
}
