//! Cluster boxes: which ones, which colour, and the selected cluster.

use eframe::egui::{self, Slider};

use super::{
    legend::{Scale, scale_ui},
    power::PowerScale,
    row,
};
use crate::{
    solver::ClusterBox,
    viewer::{
        action::Action,
        cluster_lines::{MAX_BOXES, RAMP_START},
        clusters::path_to,
        figures::{count, figure},
        state::State,
        theme,
        view::{ClusterColor, ClusterCut, ClusterOverlay},
    },
};

/// Show the controls; requested actions go into `actions`.
pub fn clusters_ui(ui: &mut egui::Ui, state: &mut State, actions: &mut Vec<Action>) {
    let snapshot = state.run.snapshot.clone();
    let clusters: &[ClusterBox] = snapshot.as_ref().map_or(&[], |snapshot| &snapshot.clusters);
    ui.checkbox(&mut state.view.clusters.shown, "Show boxes")
        .on_hover_text("Boxes of the cluster tree over the light (B)");
    if clusters.is_empty() {
        ui.weak("There are no clusters yet.");
        return;
    }
    if state.view.clusters.shown {
        boxes_ui(ui, state, clusters.len());
    }
    match state
        .cluster
        .and_then(|index| clusters.get(index).map(|cluster| (index, cluster)))
    {
        Some((index, cluster)) => {
            selected_ui(ui, state, cluster);
            // The probe lists the way to what is picked.
            if state.inspections.element().is_none() {
                path_ui(ui, clusters, index, PowerScale::of(state), actions);
            }
        }
        None if state.view.clusters.shown => {
            ui.weak("Click a surface to select the cluster around it.");
        }
        None => {}
    }
}

/// Which boxes are drawn, and the quantity of their colours.
fn boxes_ui(ui: &mut egui::Ui, state: &mut State, cluster_count: usize) {
    let overlay = &mut state.view.clusters;
    let deepest = state.shown_clusters.deepest.unwrap_or(overlay.level);
    cut_ui(ui, overlay, deepest);
    let options = ClusterColor::ALL.map(|color| (color, color.label(), ""));
    let label = ui.label("Colour");
    row::choice(ui, "cluster colour", &mut overlay.color, &options).labelled_by(label.id);
    counts_ui(ui, state, cluster_count);
}

/// Which clusters are shown.
fn cut_ui(ui: &mut egui::Ui, overlay: &mut ClusterOverlay, deepest: u32) {
    let label = ui.label("Boxes");
    row::choice(ui, "cluster cut", &mut overlay.cut, &ClusterCut::ALL).labelled_by(label.id);
    match overlay.cut {
        ClusterCut::Level => {
            let label = ui
                .label("Level")
                .on_hover_text("[ for larger, ] for smaller clusters");
            ui.add(Slider::new(&mut overlay.level, 0..=deepest))
                .labelled_by(label.id);
        }
        ClusterCut::Size => {
            let label = ui
                .label("Size")
                .on_hover_text("Part of the scene's extent; [ for larger, ] for smaller clusters");
            let slider = Slider::new(&mut overlay.size, ClusterOverlay::SIZE_RANGE)
                .logarithmic(true)
                .custom_formatter(|value, _| figure(value));
            ui.add(slider).labelled_by(label.id);
        }
        ClusterCut::Used => {}
    }
}

fn counts_ui(ui: &mut egui::Ui, state: &State, cluster_count: usize) {
    let shown = state.shown_clusters.shown.len();
    legend_ui(ui, state);
    ui.weak(format!(
        "{} boxes of {} clusters.",
        count(shown as u64),
        count(cluster_count as u64)
    ));
    if shown > MAX_BOXES {
        ui.weak(format!(
            "Only {} of them are drawn, the largest first.",
            count(MAX_BOXES as u64)
        ));
    }
}

/// Legend of the colours of the boxes.
fn legend_ui(ui: &mut egui::Ui, state: &State) {
    let (Some(staged), Some(loaded)) = (&state.staged, &state.loaded) else {
        return;
    };
    let color = staged.wanted.clusters.color;
    let power = PowerScale::of(state);
    let ends = staged.box_ends.map(f64::from);
    let (ends, unit) = match color {
        ClusterColor::Power => (staged.box_ends.map(|end| power.value(end)), power.unit()),
        ClusterColor::Area => {
            let frame = &loaded.scene.frame;
            (ends.map(|end| frame.area_to_world(end)), "square units")
        }
        ClusterColor::Spread => (ends, "of 1"),
        ClusterColor::Links => (ends, "links"),
        ClusterColor::Error => (ends, "W/m²"),
    };
    let scale = Scale {
        ends,
        is_logarithmic: color != ClusterColor::Spread,
    };
    let quantity = match color {
        ClusterColor::Power => power.name(),
        other => other.label(),
    };
    ui.weak(quantity);
    scale_ui(ui, &scale, unit, RAMP_START);
}

fn selected_ui(ui: &mut egui::Ui, state: &State, cluster: &ClusterBox) {
    let Some(loaded) = &state.loaded else { return };
    let frame = &loaded.scene.frame;
    // Lists of figures are in world units; the cluster is in frame units.
    let area_scale = frame.area_to_world(1.0);
    let size = (cluster.max - cluster.min).as_dvec3() / frame.scale;
    let power = PowerScale::of(state);
    ui.add_space(4.0);
    ui.colored_label(
        theme::selected_text(ui.visuals()),
        format!("Cluster at level {}", cluster.level),
    );
    row::figures(ui, "cluster", |ui| {
        row::figure(ui, "Patches", count(u64::from(cluster.patch_count)), "");
        row::size(ui, size);
        let area = figure(f64::from(cluster.area) * area_scale);
        row::figure(
            ui,
            "Area",
            area,
            "Of its patches, in square units of the file",
        );
        row::figure(
            ui,
            power.name(),
            power.text(cluster.power),
            power.explanation(),
        );
        row::figure(
            ui,
            "Direction spread",
            figure(f64::from(cluster.direction_spread)),
            "0 when all normals agree, 1 when they cancel",
        );
        row::figure(
            ui,
            "Links received",
            count(u64::from(cluster.link_count)),
            "",
        );
        row::figure(
            ui,
            "Links sent",
            count(u64::from(cluster.source_count)),
            "Links by which it lights others as one",
        );
        row::figure(
            ui,
            "Error bound",
            format!("{} W/m²", figure(f64::from(cluster.error))),
            "Of the links that it receives over",
        );
        for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
            let [plus, minus] = [
                cluster.face_power[2 * axis],
                cluster.face_power[2 * axis + 1],
            ];
            row::figure(
                ui,
                &format!("Along +{name} / −{name}"),
                format!("{} / {}", figure(power.value(plus)), power.text(minus)),
                "Power along the normals of the box; drawn as arrows",
            );
        }
    });
}

fn path_ui(
    ui: &mut egui::Ui,
    clusters: &[ClusterBox],
    index: usize,
    power: PowerScale,
    actions: &mut Vec<Action>,
) {
    ui.add_space(4.0);
    ui.weak("Path from the root");
    let path = path_to(clusters, index);
    for node in path {
        let cluster = &clusters[node];
        let text = format!(
            "Level {} · {} patches · power {} · links {}",
            cluster.level,
            count(u64::from(cluster.patch_count)),
            power.text(cluster.power),
            count(u64::from(cluster.link_count)),
        );
        if ui.selectable_label(node == index, text).clicked() {
            actions.push(Action::SelectCluster(node));
        }
    }
}
