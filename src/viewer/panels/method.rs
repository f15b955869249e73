//! Settings of the method, for those who look into it: clusters, oracle, direct light, and what is automatic.

use eframe::egui::{self, DragValue};

use super::row::{self, slider};
use crate::{
    geometry::RAY_OFFSET,
    solver::{Direct, Method, Oracle, Push, SolveSettings},
    viewer::{figures::figure, state::State},
};

/// Show them in a section that is folded at first.
pub(super) fn method_ui(ui: &mut egui::Ui, state: &State, settings: &mut SolveSettings) {
    row::section(ui, "Method", false, |ui| {
        let default = SolveSettings::normal();
        row::setting(
            ui,
            "Clusters",
            "How a cluster keeps its power and area by direction. Changing it restarts the run.",
            &mut settings.method,
            &default.method,
            |ui, value| {
                row::choice(
                    ui,
                    "method",
                    value,
                    &[
                        (
                            Method::Bounded,
                            "Bounded",
                            "Spherical harmonics kept within guaranteed bounds",
                        ),
                        (
                            Method::SixFace,
                            "Six faces",
                            "Six vectors along the box normals, as in the paper; too bright at coarse links",
                        ),
                        (
                            Method::Single,
                            "One vector",
                            "One vector; opposite faces cancel",
                        ),
                        (Method::Exact, "Exact sum", "The sum over all patches; slow"),
                        (
                            Method::Isotropic,
                            "Isotropic",
                            "The same in every direction",
                        ),
                    ],
                )
            },
        );
        row::setting(
            ui,
            "Link error",
            "How the error of a link is judged. Changing it restarts the run.",
            &mut settings.oracle,
            &default.oracle,
            |ui, value| {
                row::choice(
                    ui,
                    "oracle",
                    value,
                    &[
                        (
                            Oracle::Interval,
                            "Interval bounds",
                            "Bounds over both boxes",
                        ),
                        (
                            Oracle::Samples,
                            "p samples",
                            "Largest minus smallest of p sample pairs, as in the paper",
                        ),
                    ],
                )
            },
        );
        row::setting(
            ui,
            "Samples p",
            "Sample pairs of a link. The cost of judging a link grows with it.",
            &mut settings.samples,
            &default.samples,
            |ui, value| {
                ui.add_enabled(
                    settings.oracle == Oracle::Samples,
                    DragValue::new(value).range(1..=4096).speed(0.2),
                )
            },
        );
        if state.has_emitters() {
            row::setting(
                ui,
                "Direct light",
                "How light straight from emitters is computed. Changing it restarts the run.",
                &mut settings.direct,
                &default.direct,
                |ui, value| {
                    row::choice(
                        ui,
                        "direct",
                        value,
                        &[
                            (
                                Direct::Sampled,
                                "Shadow rays",
                                "From every vertex to every light: sharp shadows",
                            ),
                            (
                                Direct::Linked,
                                "Links",
                                "Through links, as all other light; the paper's way",
                            ),
                        ],
                    )
                },
            );
        }
        row::setting(
            ui,
            "Push",
            "How the light of several links reaches the faces of a cluster. Changing it restarts the run.",
            &mut settings.push,
            &default.push,
            |ui, value| {
                row::choice(
                    ui,
                    "push",
                    value,
                    &[
                        (Push::Combined, "Once an iteration", "Combined first"),
                        (
                            Push::AtOnce,
                            "Link by link",
                            "To every face at once; slow on large clusters",
                        ),
                    ],
                )
            },
        );
        row::setting(
            ui,
            "Crease angle",
            "Edges sharper than this are shaded as edges. Changing it restarts the run.",
            &mut settings.crease_degrees,
            &default.crease_degrees,
            |ui, value| {
                ui.add(
                    DragValue::new(value)
                        .range(0.0..=180.0)
                        .suffix("°")
                        .speed(0.5),
                )
            },
        );
        row::setting(
            ui,
            "Convergence",
            "The iteration ends when it changes less than this fraction of the power.",
            &mut settings.tolerance,
            &default.tolerance,
            |ui, value| ui.add(slider(value, 1e-6..=1e-1)),
        );
        row::setting(
            ui,
            "Seed",
            "Of every random choice. The same seed gives the same light. Changing it restarts the run.",
            &mut settings.seed,
            &default.seed,
            |ui, value| ui.add(DragValue::new(value).speed(0.1)),
        );
        ray_offset_ui(ui, state);
    });
}

/// How far rays keep from surfaces: nothing to set, but to be known.
fn ray_offset_ui(ui: &mut egui::Ui, state: &State) {
    let text = state.loaded.as_ref().map_or_else(
        || "automatic".to_owned(),
        |loaded| {
            let offset = f64::from(RAY_OFFSET) / loaded.scene.frame.scale;
            format!("{} (automatic)", figure(offset))
        },
    );
    row::fixed(
        ui,
        "Ray offset",
        "Shadow rays start and end this far from their ends, in the file's units: a millionth of the scene's largest \
         extent. Nearer, and rounding makes rays meet the surface that they leave; further, and light leaks through \
         thin gaps. It follows the size of the scene, so there is nothing to set.",
        &text,
    );
}
