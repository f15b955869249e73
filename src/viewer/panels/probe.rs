//! The picked point: position, surface, light, and the light over its object.

use eframe::egui;
use glam::Vec3;

use super::{materials, path::path_ui, power::PowerScale, row};
use crate::{
    metrics::PooledError,
    scene::luminance,
    viewer::{
        action::Action,
        figures::{bound, count, figure},
        state::State,
        view::LinkEnd,
    },
};

/// Show the picked point; requested actions go into `actions`.
pub fn probe_ui(ui: &mut egui::Ui, state: &State, actions: &mut Vec<Action>) {
    let (Some(selection), Some(loaded)) = (&state.selection, &state.loaded) else {
        ui.weak("Click a surface to see its light.");
        return;
    };
    let scene = &loaded.scene;
    let pick = &selection.pick;
    let triangle = scene.triangles[pick.triangle.index()];
    let surface = state.materials.surface(scene, pick.triangle);
    let world = scene.frame.to_world(pick.point);
    let material = &scene.materials[triangle.material.index()];
    row::figures(ui, "probe", |ui| {
        let place = format!(
            "{}  {}  {}",
            figure(world.x),
            figure(world.y),
            figure(world.z)
        );
        row::figure(ui, "Position", place, "In the file's units");
        let side = if pick.is_back { "back" } else { "front" };
        row::figure(
            ui,
            "Triangle",
            format!("{} ({side})", count(u64::from(pick.triangle.0))),
            "",
        );
        let name = if material.name.is_empty() {
            "default"
        } else {
            &material.name
        };
        row::figure(ui, "Material", name, "");
        let is_grey = state.is_grey();
        let (color, channels) = if is_grey {
            (grey as fn(Vec3) -> String, "Of all colours alike")
        } else {
            (rgb as fn(Vec3) -> String, "Red, green, blue")
        };
        row::figure(ui, "Reflectance", color(surface.reflectance), channels);
        let scale = state.view.emission_scale * state.radiance_unit();
        if surface.emission != Vec3::ZERO {
            row::figure(
                ui,
                "Emission",
                format!("{} W/(sr·m²)", color(surface.emission * scale)),
                "Emitted radiance",
            );
        }
        if let Some(probe) = selection.probe.map(|probe| probe.scaled(scale)) {
            row::figure(
                ui,
                "Element",
                count(u64::from(probe.element)),
                "Node of the hierarchy",
            );
            row::figure(
                ui,
                "Irradiance",
                format!("{} W/m²", figure(f64::from(luminance(probe.irradiance)))),
                "Luminance of the light that arrives",
            );
            if !is_grey {
                row::figure(ui, "", rgb(probe.irradiance), "Red, green, blue");
            }
            row::figure(
                ui,
                "Direct",
                format!("{} W/m²", figure(f64::from(luminance(probe.direct)))),
                "Straight from emitters",
            );
            row::figure(
                ui,
                "Radiance",
                format!("{} W/(sr·m²)", figure(f64::from(luminance(probe.radiance)))),
                "Luminance of the light that leaves",
            );
            if !is_grey {
                row::figure(ui, "", rgb(probe.radiance), "Red, green, blue");
            }
            row::figure(
                ui,
                "Radiosity",
                format!(
                    "{} W/m²",
                    figure(f64::from(luminance(probe.radiance) * std::f32::consts::PI))
                ),
                "π times the radiance",
            );
            row::figure(
                ui,
                "Estimated error",
                estimated_error(probe.estimated_error),
                "Mean over the part of the surfaces around this place whose error is told from noise, of the light that is \
                 shown there: the view 'Estimated error' as a figure",
            );
            inspection_rows(ui, state);
        }
    });
    let mut materials = state.materials.clone();
    let index = triangle.material.index();
    materials::material_ui(ui, &mut materials, index, scene.max_reflectance);
    if materials != state.materials {
        actions.push(Action::Relight(materials));
    }
    if selection.probe.is_none() && pick.is_back && !triangle.two_sided {
        ui.weak("This side is the back of a one-sided face: it reflects nothing.");
    }
    object_ui(ui, state);
    if let Some(inspection) = state.inspections.element() {
        let power = PowerScale::of(state);
        path_ui(
            ui,
            &inspection.path,
            &scene.frame,
            power,
            state.cluster,
            actions,
        );
    }
    ui.horizontal(|ui| {
        if ui
            .button("Show object")
            .on_hover_text("Bring the object into view (F)")
            .clicked()
        {
            actions.push(Action::FrameSelected);
        }
        if ui
            .button("Clear selection")
            .on_hover_text("Esc does the same while nothing runs")
            .clicked()
        {
            actions.push(Action::ClearSelection);
        }
    });
}

/// The inspection of the element.
fn inspection_rows(ui: &mut egui::Ui, state: &State) {
    let Some(inspection) = state.inspections.element() else {
        if state.inspections.is_waiting(LinkEnd::Element) {
            row::figure(
                ui,
                "Row sum",
                "…",
                "The solver answers after this step, or at once when paused",
            );
        }
        return;
    };
    let light = |color: Vec3| format!("{} W/m²", figure(f64::from(luminance(color))));
    row::figure(
        ui,
        "From links",
        light(inspection.linked),
        "Irradiance over all links, at the element's centroid",
    );
    row::figure(
        ui,
        "Error bound",
        error_bound(inspection.error_bound, luminance(inspection.linked)),
        "Worst case of the light from links, relative to it, for what their sources send; the estimated error says how \
         wrong the light is",
    );
    row::figure(
        ui,
        "From shadow rays",
        light(inspection.direct),
        "Irradiance straight from emitters by shadow rays, mean over the element",
    );
    row::figure(
        ui,
        "Row sum",
        figure(f64::from(inspection.row_sum)),
        "Sum of the form factors of the element's links; 1 in a closed scene",
    );
    let own = inspection.path.last().map_or(0, |node| node.link_count);
    row::figure(
        ui,
        "Links",
        format!(
            "{} ({} of its own)",
            count(inspection.links.len() as u64),
            count(u64::from(own))
        ),
        "Links that light the element: its own, and those of all above it",
    );
}

fn object_ui(ui: &mut egui::Ui, state: &State) {
    let (Some(selection), Some(loaded)) = (&state.selection, &state.loaded) else {
        return;
    };
    let Some(object) = selection
        .object
        .and_then(|index| loaded.scene.objects.get(index))
    else {
        return;
    };
    let light = selection.object_light;
    let scale = state.view.emission_scale * state.radiance_unit();
    let area = loaded.scene.frame.area_to_world(f64::from(light.area));
    let name = if object.name.label().is_empty() {
        "whole scene"
    } else {
        object.name.label()
    };
    ui.add_space(4.0);
    row::figures(ui, "object", |ui| {
        row::figure(ui, "Object", name, "");
        row::figure(ui, "Area", figure(area), "In square units of the file");
        row::figure(
            ui,
            "Irradiance",
            format!(
                "{} … {} … {}",
                figure(f64::from(light.min * scale)),
                figure(f64::from(light.mean * scale)),
                figure(f64::from(light.max * scale))
            ),
            "Smallest, mean and largest luminance over the object, in W/m²",
        );
    });
}

/// The estimated error of the light at a place.
fn estimated_error(pooled: Option<PooledError>) -> String {
    let Some(pooled) = pooled else {
        return "–".to_owned();
    };
    if pooled.error == 0.0 {
        return "not told from noise".to_owned();
    }
    let side = if pooled.error > 0.0 { "bright" } else { "dark" };
    let [of_rms, of_local] =
        [pooled.error, pooled.of_local].map(|share| figure(f64::from(100.0 * share.abs())));
    format!("{of_local} % too {side} ({of_rms} % of RMS)")
}

/// An error bound relative to the irradiance that it is of; without either there is nothing to be wrong.
fn error_bound(error: f32, irradiance: f32) -> String {
    if error > 0.0 {
        bound(f64::from(error) / f64::from(irradiance))
    } else {
        bound(0.0)
    }
}

fn grey(color: Vec3) -> String {
    figure(f64::from(color.x))
}

fn rgb(color: Vec3) -> String {
    let [red, green, blue] = color.to_array().map(|channel| figure(f64::from(channel)));
    format!("{red}  {green}  {blue}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimated_errors_have_a_side() {
        let text = |error: f32| {
            estimated_error(Some(PooledError {
                error,
                of_local: 2.0 * error,
                points: 8,
            }))
        };
        assert_eq!(text(0.02), "4.00 % too bright (2.00 % of RMS)");
        assert_eq!(text(-0.02), "4.00 % too dark (2.00 % of RMS)");
        assert_eq!(text(0.0), "not told from noise");
        assert_eq!(estimated_error(None), "–");
    }

    #[test]
    fn a_bound_above_the_light_itself_is_no_figure() {
        assert_eq!(error_bound(5.31, 0.25), "over 100 %");
        assert_eq!(error_bound(0.01, 0.25), "4.00 %");
        assert_eq!(error_bound(1.0, 0.0), "over 100 %");
        assert_eq!(error_bound(0.0, 0.0), "0 %");
    }
}
