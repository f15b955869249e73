//! The pane that shows the scene: keeps a target of its own size, and draws only when something changed.

use std::sync::{Arc, Weak};

use eframe::{
    egui::{self, Color32, Pos2, Rect, TextureId, pos2},
    egui_wgpu::RenderState,
};
use glam::{Vec3, Vec4};

use super::{
    action::Action,
    camera::Camera,
    exposure,
    first_look::Interior,
    line_cache::LineCache,
    messages::Severity,
    navigation,
    pick::Pick,
    render::{
        CutoutTarget, Gpu, Metering, Overlay, Picture, RenderError, Renderer, SegmentInstance,
        Target, Uploads,
    },
    saver::{Canvas, Drawn},
    sharpening::Sharpening,
    stage::Staged,
    state::State,
    theme,
    view::{ViewMode, ViewSettings},
};
use crate::solver::VertexLight;

/// The adapter's half of the pane.
pub struct Viewport {
    render_state: RenderState,
    renderer: Renderer,
    target: Option<(Target, TextureId)>,
    /// The picture in the target.
    drawn: Option<PictureKey>,
    lines: LineCache,
    metered: Option<MeterKey>,
    metering: Option<Metering>,
    /// The light that was there when nothing but errors lit the scene. It is not shown while that of new lamps is on its
    /// way, or the exposure would follow it.
    dark: Option<Weak<VertexLight>>,
    sharpening: Sharpening,
}

/// Everything that the automatic exposure depends on.
struct MeterKey {
    /// Weak: its light may be large.
    light: Weak<VertexLight>,
    mode: ViewMode,
    texture_detail: bool,
    backs: bool,
    see_through: bool,
    camera: Camera,
}

impl MeterKey {
    fn of(key: &PictureKey) -> Self {
        Self {
            light: Arc::downgrade(&key.staged.wanted.snapshot.light),
            mode: key.view.mode,
            texture_detail: key.view.texture_detail,
            backs: key.view.backs,
            see_through: key.view.see_through,
            camera: key.camera,
        }
    }

    /// Whether another picture may need another exposure.
    fn differs_from(&self, other: &Self) -> bool {
        !self.light.ptr_eq(&other.light)
            || self.mode != other.mode
            || self.texture_detail != other.texture_detail
            || self.backs != other.backs
            || self.see_through != other.see_through
            || exposure::shows_other_things(&self.camera, &other.camera)
    }
}

/// Everything that a picture depends on. Arcs are stored, so that no address is reused.
#[derive(Clone)]
struct PictureKey {
    staged: Arc<Staged>,
    /// Whether there is no light to show.
    is_unlit: bool,
    segments: Arc<Vec<SegmentInstance>>,
    camera: Camera,
    view: ViewSettings,
    interior: Option<Interior>,
    size: [u32; 2],
    background: Vec3,
}

impl PartialEq for PictureKey {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.staged, &other.staged)
            && self.is_unlit == other.is_unlit
            && Arc::ptr_eq(&self.segments, &other.segments)
            && self.camera == other.camera
            && self.view == other.view
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
            metered: None,
            metering: None,
            dark: None,
            sharpening: Sharpening::default(),
        }
    }

    /// The adapter and the uploads to it.
    pub fn adapter(&self) -> (Gpu, Uploads) {
        (self.renderer.gpu().clone(), self.renderer.uploads())
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
        let Some(mut key) = self.key(state, size, background(ui), true) else {
            return;
        };
        if self.expose(ui, &key, state) {
            ui.ctx().request_repaint();
        }
        key.view.exposure = state.view.exposure;
        let texture = match self.texture(size) {
            Ok(texture) => texture,
            Err(error) => {
                state.messages.push(Severity::Error, error.to_string());
                return;
            }
        };
        if self.drawn.as_ref() != Some(&key)
            && let Some((target, id)) = self.target.take()
        {
            self.draw(&key, pixels_per_point, |renderer, picture, uploads| {
                renderer.draw(&target, picture, uploads);
            });
            self.target = Some((target, id));
            self.drawn = Some(key);
        }
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        ui.painter().image(texture, rect, whole, Color32::WHITE);
        let background = background(ui).x;
        self.sharpening.show(ui, rect, background, state);
    }

    /// Meter the picture where that is due, and let the exposure follow. Returns whether it is still on its way.
    fn expose(&mut self, ui: &egui::Ui, key: &PictureKey, state: &mut State) -> bool {
        if !state.view.auto_exposure {
            return false;
        }
        let gpu = self.renderer.gpu().clone();
        let is_first = state.exposure.target.is_none();
        // Lights that are dimmed would look as bright as before.
        let is_due = key.view.mode.is_light()
            && !key.is_unlit
            && (is_first || state.exposure.shows_lamps_only || !state.materials.are_changed());
        if is_due && self.metering.is_none() {
            let wanted = MeterKey::of(key);
            let last = self.metered.as_ref();
            if last.is_none_or(|last| wanted.differs_from(last)) {
                self.metering = self.draw(key, 1.0, |renderer, picture, uploads| {
                    renderer.meter(key.size, picture, uploads)
                });
                self.metered = Some(wanted);
            }
        }
        let came = match self.metering.take() {
            // The first picture of a scene is exposed from the start.
            Some(metering) if is_first => Some(metering.wait(&gpu)),
            Some(metering) => {
                let came = metering.poll(&gpu);
                self.metering = came.is_none().then_some(metering);
                came
            }
            None => None,
        };
        match came {
            Some(Ok(metered)) => state.exposure.note(&metered),
            Some(Err(error)) => state
                .messages
                .push_lasting(Severity::Error, error.to_string()),
            None => {}
        }
        let seconds = ui.input(|input| input.stable_dt).min(0.1);
        let seconds = if is_first { f32::INFINITY } else { seconds };
        let (exposure, is_moving) = state.exposure.advance(state.view.exposure, seconds);
        state.view.exposure = exposure;
        is_moving || self.metering.is_some()
    }

    /// Begin a picture of what is shown, at another size, with or without the background.
    ///
    /// # Errors
    /// One sentence for people.
    pub fn picture(
        &mut self,
        state: &State,
        size: [u32; 2],
        is_transparent: bool,
    ) -> Result<Drawn, String> {
        let background = Vec3::splat(theme::PICTURE_BACKGROUND);
        // The picked point is marked in the window only, not in saved pictures: without boxes or links
        // they would not know what the mark is.
        let marks_selection = state.view.clusters.shown || state.view.links.shown;
        let mut key = self
            .key(state, size, background, marks_selection)
            .ok_or("there is nothing to take a picture of; open a scene first")?;
        if let (true, Some(exposure)) = (state.view.auto_exposure, state.exposure.target) {
            key.view.exposure = exposure;
        }
        let gpu = self.renderer.gpu().clone();
        let canvas = if is_transparent {
            CutoutTarget::new(&gpu, size).map(|target| Canvas::Cutout(Box::new(target)))
        } else {
            Target::new(&gpu, size).map(|target| Canvas::Opaque(Box::new(target)))
        };
        let canvas = canvas.map_err(|error| error.to_string())?;
        // Lines as wide, in the picture, as they are in the window.
        let pixels_per_point = size[1] as f32 / 800.0;
        self.draw(
            &key,
            pixels_per_point,
            |renderer, picture, uploads| match &canvas {
                Canvas::Opaque(target) => renderer.draw(target, picture, uploads),
                Canvas::Cutout(target) => renderer.draw_cutout(target, picture, uploads),
            },
        );
        Ok(Drawn {
            canvas,
            gpu,
            exposure_factor: key.view.exposure_factor() / state.radiance_unit(),
        })
    }

    fn key(
        &mut self,
        state: &State,
        size: [u32; 2],
        background: Vec3,
        marks_selection: bool,
    ) -> Option<PictureKey> {
        let staged = state.staged.as_ref()?;
        let snapshot = &staged.wanted.snapshot;
        let light = &snapshot.light;
        if state.is_dark() {
            self.dark = Some(Arc::downgrade(light));
        }
        let mut dark = self.dark.iter();
        let is_dark = dark.any(|dark| dark.ptr_eq(&Arc::downgrade(light)));
        let lines = &mut self.lines;
        let segments = lines.segments(state, &snapshot.clusters, marks_selection);
        Some(PictureKey {
            staged: staged.clone(),
            is_unlit: !staged.is_lit || is_dark,
            segments: segments.clone(),
            camera: state.rig.current,
            view: ViewSettings {
                // Another mode shows once its light is on the adapter.
                mode: staged.wanted.mode,
                ..state.view.clone()
            },
            interior: state.loaded.as_ref().and_then(|loaded| loaded.interior),
            size,
            background,
        })
    }

    /// Describe the picture, and draw it; `None` without what is to be drawn.
    fn draw<T>(
        &mut self,
        key: &PictureKey,
        pixels_per_point: f32,
        draw: impl FnOnce(&mut Renderer, &Picture<'_>, &Uploads) -> T,
    ) -> Option<T> {
        let uploads = key.staged.uploads.as_ref()?;
        let wanted = &key.staged.wanted;
        let overlay = Overlay {
            boxes: Arc::default(),
            segments: key.segments.clone(),
        };
        let picture = Picture {
            scene: &wanted.scene,
            mesh: &wanted.snapshot.mesh,
            light: &wanted.snapshot.light,
            errors: key.staged.errors.as_ref(),
            gloss: wanted.gloss.as_ref(),
            camera: &key.camera,
            view: &key.view,
            is_unlit: key.is_unlit,
            range: wanted.range,
            interior: key.interior,
            overlay: &overlay,
            background: key.background,
            pixels_per_point,
        };
        Some(draw(&mut self.renderer, &picture, uploads))
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

/// The theme's background, display-linear.
fn background(ui: &egui::Ui) -> Vec3 {
    if ui.visuals().dark_mode {
        Vec3::splat(theme::PICTURE_BACKGROUND)
    } else {
        Vec3::splat(0.5)
    }
}

/// Identifier of the pane, for instance as the owner of the keyboard focus.
pub fn scene_id() -> egui::Id {
    egui::Id::unique("scene")
}

/// The pane: picture, navigation, marks. Without an adapter only navigation works, as in tests.
pub fn viewport_ui(
    ui: &mut egui::Ui,
    viewport: Option<&mut Viewport>,
    state: &mut State,
    actions: &mut Vec<Action>,
) -> Option<navigation::Picked> {
    let rect = ui.available_rect_before_wrap();
    ui.advance_cursor_after_rect(rect);
    let response = ui.interact(rect, scene_id(), egui::Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Scene"));
    let picked = navigation::navigate(ui, &response, state, actions);
    ui.painter().rect_filled(rect, 0.0, ui.visuals().panel_fill);
    if let Some(viewport) = viewport {
        viewport.paint(ui, rect, state);
    }
    if let Some(selection) = &state.selection {
        mark(ui, rect, &state.rig.current, &selection.pick);
    }
    if state.panels.drags_sun
        && let Some(loaded) = &state.loaded
        && let Some(sun) = &loaded.scene.environment.sun
    {
        sun_marker(ui, rect, &state.rig.current, sun.direction);
    }
    if state.loaded.is_some() {
        axes(ui, rect, &state.rig.current);
    }
    picked
}

/// Where a point, or with a fourth coordinate of 0 a direction, is seen; `None` behind the viewer.
fn seen_at(rect: Rect, camera: &Camera, point: Vec4) -> Option<Pos2> {
    let aspect = rect.width() / rect.height().max(1.0);
    let clip = camera.clip_from_frame(aspect) * point;
    (clip.w > 0.0).then(|| rect.center() + egui::vec2(clip.x, -clip.y) / clip.w * 0.5 * rect.size())
}

/// A disc with rays where the sun stands.
fn sun_marker(ui: &egui::Ui, rect: Rect, camera: &Camera, direction: Vec3) {
    const RADIUS: f32 = 7.0;
    let Some(at) = seen_at(rect, camera, direction.extend(0.0)) else {
        return;
    };
    let painter = ui.painter().with_clip_rect(rect);
    for (width, color) in [(4.0, Color32::from_black_alpha(160)), (2.0, theme::SUN)] {
        painter.circle_filled(at, RADIUS + 0.5 * width - 1.0, color);
        for turn in 0..8 {
            let arm = egui::Vec2::angled(turn as f32 * std::f32::consts::FRAC_PI_4);
            let ray = [at + arm * (RADIUS + 3.0), at + arm * (RADIUS + 9.0)];
            painter.line_segment(ray, egui::Stroke::new(width, color));
        }
    }
}

/// A ring around the picked point.
fn mark(ui: &egui::Ui, rect: Rect, camera: &Camera, pick: &Pick) {
    let Some(at) = seen_at(rect, camera, pick.point.extend(1.0)) else {
        return;
    };
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
