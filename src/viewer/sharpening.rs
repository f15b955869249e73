//! The view at rest: traced pictures of it, each finer than the one before, over the one that is drawn.

use std::{
    sync::{
        Arc,
        mpsc::{self, Receiver},
    },
    thread,
    time::{Duration, Instant},
};

use eframe::egui::{self, ColorImage, Rect, TextureHandle, TextureOptions, pos2};

use super::{
    camera::Camera,
    first_look::Interior,
    headless::Subject,
    sharpness::Sharpness,
    stage::Staged,
    state::State,
    traced::{self, Traced},
    view::{ViewMode, ViewSettings},
};
use crate::{export::ToneMap, geometry::RayTree, picture::Exposure, solver::Cancel, worker};

/// How long nothing may move before pictures are traced. Shorter begins between two drags; longer keeps people waiting.
const REST: Duration = Duration::from_millis(300);

/// The pictures of a view: by what their size is divided, and the most samples of a pixel. Fewer steps show nothing for long;
/// more trace in vain.
const PASSES: [(u32, u32); 3] = [(3, 4), (1, 4), (1, 16)];

/// What a traced picture depends on. Arcs are stored, so that no address is reused.
#[derive(Clone)]
struct Wished {
    staged: Arc<Staged>,
    rays: Arc<RayTree>,
    interior: Option<Interior>,
    camera: Camera,
    size: [u32; 2],
    backs: bool,
    see_through: bool,
}

impl PartialEq for Wished {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.staged.wanted.snapshot, &other.staged.wanted.snapshot)
            && Arc::ptr_eq(&self.rays, &other.rays)
            && self.camera == other.camera
            && self.size == other.size
            && self.backs == other.backs
            && self.see_through == other.see_through
    }
}

/// How a picture is exposed.
#[derive(Clone, Copy, PartialEq)]
struct Look {
    factor: f32,
    tone_map: ToneMap,
    background: f32,
}

/// The traced pictures of the view that is wished for.
struct Tracing {
    wished: Wished,
    since: Instant,
    /// Begun once the view has rested.
    pictures: Option<(Cancel, Receiver<(u32, Traced)>)>,
    /// The finest so far.
    shown: Option<Shown>,
}

/// A traced picture in the window.
struct Shown {
    samples: u32,
    picture: Traced,
    /// How its texture is exposed.
    texture: Option<(Look, TextureHandle)>,
}

impl Drop for Tracing {
    fn drop(&mut self) {
        if let Some((cancel, _)) = &self.pictures {
            cancel.cancel();
        }
    }
}

/// Traces pictures of views at rest.
#[derive(Default)]
pub struct Sharpening {
    tracing: Option<Tracing>,
}

impl Sharpening {
    /// Show the traced picture of the present view over a rectangle, as far as there is one.
    pub fn show(&mut self, ui: &egui::Ui, rect: Rect, background: f32, state: &mut State) {
        state.sharpness = None;
        let Some(wished) = wished(state) else {
            self.tracing = None;
            return;
        };
        let tracing = match &mut self.tracing {
            Some(tracing) if tracing.wished == wished => tracing,
            tracing => tracing.insert(Tracing {
                wished,
                since: Instant::now(),
                pictures: None,
                shown: None,
            }),
        };
        let rested = tracing.since.elapsed();
        if rested < REST {
            ui.ctx().request_repaint_after(REST - rested);
            return;
        }
        if tracing.pictures.is_none() {
            tracing.begin(ui.ctx(), &state.view);
        }
        tracing.paint(ui, rect, background, state);
    }
}

/// The traced picture that the state asks for: of light alone, while nothing is computed.
fn wished(state: &State) -> Option<Wished> {
    let (view, loaded, staged) = (&state.view, state.loaded.as_ref()?, state.staged.as_ref()?);
    let has_overlay = view.edges || view.clusters.shown || view.links.shown;
    let shows_textures = view.texture_detail || loaded.scene.textures.is_empty();
    let is_light = view.mode == ViewMode::Radiance && staged.wanted.mode == view.mode;
    let is_at_rest = !state.run.status.is_busy() && state.loading.is_none();
    let is_wished = view.traced && is_light && !has_overlay && shows_textures && is_at_rest;
    // Light of another scene is on its way out.
    let is_of_scene = Arc::ptr_eq(&staged.wanted.scene, &loaded.scene);
    (is_wished && is_of_scene && staged.is_lit && !state.is_dark()).then(|| Wished {
        staged: staged.clone(),
        rays: loaded.rays.clone(),
        interior: loaded.interior,
        camera: state.rig.current,
        size: state.viewport_size,
        backs: view.backs,
        see_through: view.see_through,
    })
}

impl Tracing {
    /// Trace the pictures on a thread of its own.
    fn begin(&mut self, ctx: &egui::Context, view: &ViewSettings) {
        let (sender, pictures) = mpsc::channel();
        let cancel = Cancel::default();
        let (wished, stop, ctx) = (self.wished.clone(), cancel.clone(), ctx.clone());
        // The window exposes what comes.
        let view = ViewSettings {
            auto_exposure: false,
            ..view.clone()
        };
        let work = move || {
            let pool = worker::pool_that_gives_way("picture", 0);
            let wanted = &wished.staged.wanted;
            let subject = Subject {
                scene: &wanted.scene,
                snapshot: &wanted.snapshot,
                errors: None,
                interior: wished.interior,
                is_dark: false,
            };
            for (divisor, samples) in PASSES {
                let exposure = Exposure {
                    size: wished.size.map(|side| side.div_ceil(divisor)),
                    samples,
                    seed: 0,
                };
                let (camera, rays) = (&wished.camera, &*wished.rays);
                let trace = || traced::trace(subject, rays, camera, &view, &exposure, &stop);
                let picture = match &pool {
                    Some(pool) => pool.install(trace),
                    None => trace(),
                };
                let Some(picture) = picture else {
                    return;
                };
                if sender.send((samples, picture)).is_err() {
                    return;
                }
                ctx.request_repaint();
            }
        };
        // Without a thread the drawn picture stays.
        let _ = thread::Builder::new()
            .name("picture".to_owned())
            .spawn(work);
        self.pictures = Some((cancel, pictures));
    }

    /// Paint the finest picture so far.
    fn paint(&mut self, ui: &egui::Ui, rect: Rect, background: f32, state: &mut State) {
        let mut is_done = false;
        if let Some((_, pictures)) = &self.pictures {
            let newest = loop {
                match pictures.try_recv() {
                    Ok((samples, picture)) => {
                        self.shown = Some(Shown {
                            samples,
                            picture,
                            texture: None,
                        });
                    }
                    Err(error) => break error,
                }
            };
            is_done = newest == mpsc::TryRecvError::Disconnected;
        }
        let Some(Shown {
            samples,
            picture,
            texture,
        }) = &mut self.shown
        else {
            state.sharpness = (!is_done).then_some(Sharpness {
                samples: 0,
                noise: None,
                is_done,
            });
            return;
        };
        state.sharpness = Some(Sharpness {
            samples: *samples,
            noise: picture.noise(),
            is_done,
        });
        let look = Look {
            factor: state.view.light_factor() * state.view.exposure_factor(),
            tone_map: state.view.tone_map,
            background,
        };
        if texture.as_ref().is_none_or(|(exposed, _)| *exposed != look) {
            picture.expose(&state.view);
            let shown = picture.display(background);
            let size = [shown.width() as usize, shown.height() as usize];
            let image = ColorImage::from_rgba_unmultiplied(size, shown.as_raw());
            let handle = ui
                .ctx()
                .load_texture("traced", image, TextureOptions::LINEAR);
            *texture = Some((look, handle));
        }
        if let Some((_, texture)) = texture {
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            let white = egui::Color32::WHITE;
            ui.painter().image(texture.id(), rect, whole, white);
        }
    }
}
