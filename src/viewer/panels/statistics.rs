//! Counts of the scene, the solve and the machine.

use eframe::egui;

use super::{omissions, row};
use crate::viewer::{
    figures::{count, figure, seconds},
    state::State,
};

/// Show the counts.
pub fn statistics_ui(ui: &mut egui::Ui, state: &State) {
    row::figures(ui, "statistics", |ui| {
        if let Some(loaded) = &state.loaded {
            let scene = &loaded.scene;
            let size = (loaded.max - loaded.min).as_dvec3() / scene.frame.scale;
            row::figure(
                ui,
                "Triangles",
                count(scene.face_count as u64),
                "Of the scene as read",
            );
            row::figure(ui, "Materials", count(scene.materials.len() as u64), "");
            if !scene.textures.is_empty() {
                row::figure(ui, "Textures", count(scene.textures.len() as u64), "");
            }
            row::figure(
                ui,
                "Objects",
                count(scene.objects.len() as u64),
                "Named runs of triangles",
            );
            row::figure(
                ui,
                "Emitters",
                count(loaded.emitter_count as u64),
                "Triangles that emit light",
            );
            row::size(ui, size);
        }
        if let Some(secs) = state.run.prepare_secs {
            row::figure(
                ui,
                "Preparing",
                seconds(secs),
                "Time to build the hierarchy and the ray tree",
            );
        }
        let clusters = state.run.snapshot.as_ref().map(|shown| &shown.clusters);
        if let Some(clusters) = clusters
            && let Some(root) = clusters.first()
        {
            row::figure(
                ui,
                "Patches",
                count(u64::from(root.patch_count)),
                "Triangles that take part, one for each lit side",
            );
            row::figure(
                ui,
                "Clusters",
                count(clusters.len() as u64),
                "Groups of patches",
            );
        }
        if let Some(report) = state.report() {
            if let Some(error) = report.estimated_error {
                row::figure(
                    ui,
                    "Estimated energy",
                    format!(
                        "{:.3} ({:.3}…{:.3})",
                        error.energy, error.energy_low, error.energy_high
                    ),
                    "Mean light over the mean of the true light, by the rays of 'Estimated error', and its 95 % interval; 1 \
                     is right",
                );
            }
            row::figure(
                ui,
                "Nodes",
                count(report.nodes),
                "Clusters, patches and elements",
            );
            row::figure(
                ui,
                "Elements",
                count(report.elements),
                "Leaves that receive light",
            );
            row::figure(
                ui,
                "Vertices",
                count(report.vertices),
                "Of the displayed mesh",
            );
            let rate = report.shadow_rays as f64 / report.solve_s.max(1e-9);
            row::figure(
                ui,
                "Rays per second",
                count(rate as u64),
                "Shadow rays over the time of the solver",
            );
            row::figure(
                ui,
                "Row sums",
                format!(
                    "{} / {} / {}",
                    figure(f64::from(report.row_sum_min)),
                    figure(f64::from(report.row_sum_mean)),
                    figure(f64::from(report.row_sum_max))
                ),
                "Smallest, mean and largest sum of form factors; 1 in a closed scene",
            );
            row::figure(
                ui,
                "Contraction",
                figure(f64::from(report.contraction)),
                "Ratio of successive changes; below 1 the iteration converges",
            );
        }
    });
    omissions::omissions_ui(ui, state);
    frame_ui(ui, state);
    if !state.adapter_name.is_empty() {
        ui.add_space(2.0);
        ui.weak(&state.adapter_name);
    }
    if cfg!(debug_assertions) {
        ui.weak("Debug build: many times slower than a release build.");
    }
}

/// Time of a frame of the window.
fn frame_ui(ui: &mut egui::Ui, state: &State) {
    let Some([middle, most]) = state.frame_times.middle_and_most() else {
        return;
    };
    let ms = |secs: f32| format!("{:.1}", 1000.0 * secs);
    row::figures(ui, "frames", |ui| {
        row::figure(
            ui,
            "CPU per frame",
            format!("{} ms (max {})", ms(middle), ms(most)),
            "Time that the window works on a frame, without waiting for the screen; other work on the same cores lengthens it. Median and maximum of the last frames",
        );
    });
}
