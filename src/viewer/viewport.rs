//! The pane that shows the scene: keeps a target of its own size, and draws only when something changed.

use std::sync::Arc;

use eframe::{
    egui::{self, Color32, Rect, TextureId, pos2},
    egui_wgpu::RenderState,
};
use glam::Vec3;

use super::{
    camera::Camera,
    line_cache::LineCache,
    navigation,
    pick::Pick,
    render::{Gpu, Overlay, Picture, RenderError, Renderer, Target},
    state::{Severity, State},
    theme,
    view::{ViewMode, ViewSettings},
};
use crate::{
    scene::Scene,
    solver::{DisplayMesh, VertexLight},
};

/// The adapter's half of the pane.
pub struct Viewport {
    render_state: RenderState,
    renderer: Renderer,
    target: Option<(Target, TextureId)>,
    /// What the target shows.
    drawn: Option<PictureKey>,
    lines: LineCache,
}

/// Everything that a picture depends on. Arcs are held, so that an address is not used twice.
#[derive(Clone)]
struct PictureKey {
    scene: Arc<Scene>,
    mesh: Arc<DisplayMesh>,
    light: Arc<VertexLight>,
    errors: Option<Arc<Vec<f32>>>,
    overlay: Overlay,
    camera: Camera,
    view: ViewSettings,
    is_unlit: bool,
    range: [f32; 2],
    size: [u32; 2],
    background: Vec3,
}

impl PartialEq for PictureKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.scene, &other.scene)
            && Arc::ptr_eq(&self.mesh, &other.mesh)
            && Arc::ptr_eq(&self.light, &other.light)
            && self.errors.as_ref().map(Arc::as_ptr) == other.errors.as_ref().map(Arc::as_ptr)
            && Arc::ptr_eq(&self.overlay.boxes, &other.overlay.boxes)
            && Arc::ptr_eq(&self.overlay.segments, &other.overlay.segments)
            && self.camera == other.camera
            && self.view == other.view
            && self.is_unlit == other.is_unlit
            && self.range == other.range
            && self.size == other.size
            && self.background == other.background
    }
}

impl Viewport {
    /// A pane on the window's device.
    pub fn new(render_state: &RenderState) -> Self {
        let gpu = Gpu::new(
            &render_state.adapter,
            render_state.device.clone(),
            render_state.queue.clone(),
        );
        Self {
            render_state: render_state.clone(),
            renderer: Renderer::new(gpu),
            target: None,
            drawn: None,
            lines: LineCache::default(),
        }
    }

    /// The adapter's name, for people.
    pub fn adapter_name(&self) -> &str {
        &self.renderer.gpu().adapter_name
    }

    /// Show the scene in a rectangle.
    fn paint(&mut self, ui: &egui::Ui, rect: Rect, state: &mut State) {
        let pixels_per_point = ui.ctx().pixels_per_point();
        let size = [rect.width(), rect.height()]
            .map(|points| ((points * pixels_per_point).round() as u32).max(1));
        state.viewport_size = size;
        let Some(key) = self.key(state, size, background(ui)) else {
            return;
        };
        let texture = match self.texture(size) {
            Ok(texture) => texture,
            Err(error) => {
                state.messages.push(Severity::Error, error.to_string());
                return;
            }
        };
        if self.drawn.as_ref() != Some(&key)
            && let Some((target, _)) = &self.target
        {
            let picture = picture(&key, pixels_per_point);
            if let Err(error) = self.renderer.render(target, &picture) {
                state.messages.push(Severity::Error, error.to_string());
            }
            self.drawn = Some(key);
        }
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture, rect, whole, Color32::WHITE);
    }

    /// A picture of what is shown, at another size.
    ///
    /// # Errors
    /// One sentence for people.
    pub fn picture(
        &mut self,
        state: &State,
        size: [u32; 2],
    ) -> Result<(image::RgbaImage, Option<image::Rgb32FImage>), String> {
        let background = Vec3::splat(theme::PICTURE_BACKGROUND);
        let key = self
            .key(state, size, background)
            .ok_or("there is nothing to take a picture of; open a scene first")?;
        let gpu = self.renderer.gpu().clone();
        let target = Target::new(&gpu, size).map_err(|error| error.to_string())?;
        // Lines as wide, in the picture, as they are in the window.
        let pixels_per_point = size[1] as f32 / 800.0;
        self.renderer
            .render(&target, &picture(&key, pixels_per_point))
            .map_err(|error| error.to_string())?;
        let display = target
            .read_display(&gpu)
            .map_err(|error| error.to_string())?;
        let radiance = target.read_linear(&gpu, key.view.exposure_factor()).ok();
        Ok((display, radiance))
    }

    fn key(&mut self, state: &State, size: [u32; 2], background: Vec3) -> Option<PictureKey> {
        let loaded = state.loaded.as_ref()?;
        let snapshot = state.run.snapshot.as_ref()?;
        let overlay = self.lines.overlay(state, &snapshot.clusters).clone();
        Some(PictureKey {
            scene: loaded.scene.clone(),
            mesh: snapshot.mesh.clone(),
            light: snapshot.light.clone(),
            errors: (state.view.mode == ViewMode::Error)
                .then(|| state.truth.vertex_errors(snapshot).cloned())
                .flatten(),
            overlay,
            camera: state.rig.current,
            view: state.view.clone(),
            is_unlit: !snapshot.is_lit(),
            range: state.false_color_range,
            size,
            background,
        })
    }

    /// The texture of a target of a size.
    fn texture(&mut self, size: [u32; 2]) -> Result<TextureId, RenderError> {
        if let Some((target, id)) = &self.target
            && target.size() == size
        {
            return Ok(*id);
        }
        let gpu = self.renderer.gpu();
        let target = Target::new(gpu, size)?;
        let mut renderer = self.render_state.renderer.write();
        let filter = wgpu::FilterMode::Nearest;
        let id = match self.target.take() {
            Some((_, id)) => {
                renderer.update_egui_texture_from_wgpu_texture(
                    &gpu.device,
                    target.display_view(),
                    filter,
                    id,
                );
                id
            }
            None => renderer.register_native_texture(&gpu.device, target.display_view(), filter),
        };
        self.target = Some((target, id));
        self.drawn = None;
        Ok(id)
    }
}

fn picture(key: &PictureKey, pixels_per_point: f32) -> Picture<'_> {
    Picture {
        scene: &key.scene,
        mesh: &key.mesh,
        light: &key.light,
        errors: key.errors.as_ref(),
        camera: &key.camera,
        view: &key.view,
        is_unlit: key.is_unlit,
        range: key.range,
        overlay: &key.overlay,
        background: key.background,
        pixels_per_point,
    }
}

/// The theme's background, display-linear.
fn background(ui: &egui::Ui) -> Vec3 {
    if ui.visuals().dark_mode {
        Vec3::splat(theme::PICTURE_BACKGROUND)
    } else {
        Vec3::splat(0.5)
    }
}

/// The pane: picture, navigation, marks. Without an adapter only navigation works, as in tests.
pub fn viewport_ui(
    ui: &mut egui::Ui,
    viewport: Option<&mut Viewport>,
    state: &mut State,
) -> Option<navigation::Picked> {
    let rect = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(rect, egui::Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Scene"));
    let picked = navigation::navigate(ui, &response, state);
    ui.painter().rect_filled(rect, 0.0, ui.visuals().panel_fill);
    if let Some(viewport) = viewport {
        viewport.paint(ui, rect, state);
    }
    if let Some(selection) = &state.selection {
        mark(ui, rect, &state.rig.current, &selection.pick);
    }
    if state.loaded.is_some() {
        axes(ui, rect, &state.rig.current);
    }
    picked
}

/// A ring around the picked point.
fn mark(ui: &egui::Ui, rect: Rect, camera: &Camera, pick: &Pick) {
    let aspect = rect.width() / rect.height().max(1.0);
    let clip = camera.clip_from_frame(aspect) * pick.point.extend(1.0);
    if clip.w <= 0.0 {
        return;
    }
    let at = rect.center() + egui::vec2(clip.x, -clip.y) / clip.w * 0.5 * rect.size();
    let painter = ui.painter().with_clip_rect(rect);
    painter.circle_stroke(
        at,
        6.0,
        egui::Stroke::new(3.0, Color32::from_black_alpha(160)),
    );
    painter.circle_stroke(at, 6.0, egui::Stroke::new(1.5, theme::SELECTED));
}

/// Which way the axes point, in the lower left corner.
fn axes(ui: &egui::Ui, rect: Rect, camera: &Camera) {
    const LENGTH: f32 = 26.0;
    let origin = rect.left_bottom() + egui::vec2(44.0, -44.0);
    let painter = ui.painter().with_clip_rect(rect);
    let mut arms: Vec<(usize, Vec3)> = [Vec3::X, Vec3::Y, Vec3::Z]
        .map(|axis| {
            Vec3::new(
                axis.dot(camera.right()),
                axis.dot(camera.upward()),
                axis.dot(camera.backward()),
            )
        })
        .into_iter()
        .enumerate()
        .collect();
    // The nearest last, over the others.
    arms.sort_by(|(_, a), (_, b)| a.z.total_cmp(&b.z));
    for (axis, arm) in arms {
        let color = theme::axis_color(axis);
        let end = origin + egui::vec2(arm.x, -arm.y) * LENGTH;
        painter.line_segment([origin, end], egui::Stroke::new(2.0, color));
        painter.text(
            origin + egui::vec2(arm.x, -arm.y) * (LENGTH + 9.0),
            egui::Align2::CENTER_CENTER,
            ["X", "Y", "Z"][axis],
            egui::FontId::proportional(11.0),
            color,
        );
    }
}
