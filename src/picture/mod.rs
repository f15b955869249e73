//! The picture pass: a picture by rays from the eye over the light of a solve.
//!
//! From the surface of each pixel a few rays go to the lights and over the hemisphere (`record`): these look up the light
//! stored where they end. Pixels share what their rays found where light changes slowly (`share`), and more rays are shot
//! where that is noisy. Further rays from the eye then find textures, cut-outs and edges (`shade`), sharing that light.
//! The texels of lightmaps get their light in the same way (`texels`), without an eye.
//! Needs no graphics adapter; on all processors, and the same bits on any number of them.

mod film;
mod gloss;
mod incoming;
mod lamps;
mod lens;
mod record;
mod sampler;
mod shade;
mod share;
mod surface;
mod survey;
mod texels;
mod turn;

pub use film::Developed;
pub use gloss::{GLOSS_LAMPS, GlossLamp, GlossLight, GlossVertex, gloss_at_vertices};
pub use incoming::harmonics_at_vertices;
pub use lens::Lens;
pub use texels::{TexelGrid, TexelLight, TexelPlace, TexelSource, light_texels};

use std::{f32::consts::PI, ops::Range};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::{
    geometry::RayTree,
    scene::Scene,
    solver::{Cancel, Snapshot},
};

use film::Pixel;
use record::{Record, Recorder};
use sampler::{Sampler, Use};
use shade::{Seen, Sight};
use share::{SHARED_ROWS, SharedLight};
use surface::{LitScene, Surface};
use survey::Survey;

/// Which surfaces a camera does not see: point, and unit normal towards the camera.
pub type HiddenFrom<'a> = &'a (dyn Fn(Vec3, Vec3) -> bool + Sync);

/// What a picture shows.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// All of its triangles.
    pub rays: &'a RayTree,
    /// Its light.
    pub snapshot: &'a Snapshot,
    /// Surfaces that the camera looks through.
    pub hidden: Option<HiddenFrom<'a>>,
    /// Whether backs of one-sided surfaces are seen, instead of being looked through.
    pub shows_backs: bool,
    /// Whether the surfaces are shown as a lamp beside the eye would show them, and not their light.
    pub is_unlit: bool,
}

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Rays from the eye through a pixel at most.
    pub samples: u32,
    /// Of all random numbers.
    pub seed: u64,
}

/// Samples of each pixel before it is known which are noisy. Fewer miss edges and penumbrae; more take time where nothing
/// changes.
const FIRST_SAMPLES: u32 = 4;

/// By how much the number of samples grows from round to round where pixels are noisy.
const GROWTH: u32 = 4;

/// Standard error of a pixel, relative to its light and a part of that of the picture, above which it gets more samples.
/// Smaller takes time; larger leaves grain in penumbrae and jagged edges.
const NOISE: f32 = 0.01;

/// The part of the mean light of the picture that noise is relative to beside the pixel's own.
const OF_MEAN: f32 = 0.1;

/// Pixels that are made at once, about. Fewer share less work; more take more memory: about 500 bytes for each.
const BAND: u32 = 1 << 21;

/// A picture, row by row from the top; `None` when cancelled.
pub fn trace(
    subject: &Subject<'_>,
    lens: &Lens,
    exposure: &Exposure,
    cancel: &Cancel,
) -> Option<Vec<Developed>> {
    let lit = LitScene::new(subject.scene, subject.rays, subject.snapshot);
    cancel.proceed()?;
    let pass = Pass {
        subject,
        lit: &lit,
        lens,
        exposure,
        cancel,
    };
    let [width, height] = exposure.size;
    let rows = (BAND / width).max(1);
    let mut picture = Vec::with_capacity(width as usize * height as usize);
    for top in (0..height).step_by(rows as usize) {
        let band = top..(top + rows).min(height);
        picture.par_extend(pass.band(band)?.par_iter().map(Pixel::developed));
    }
    Some(picture)
}

/// What all rays of a picture share.
struct Pass<'a> {
    subject: &'a Subject<'a>,
    lit: &'a LitScene<'a>,
    lens: &'a Lens,
    exposure: &'a Exposure,
    cancel: &'a Cancel,
}

/// What rays of one thread use again and again.
struct Tools<'a> {
    sight: Sight,
    recorder: Recorder<'a>,
}

impl<'a> Pass<'a> {
    /// Some rows of the picture.
    fn band(&self, rows: Range<u32>) -> Option<Vec<Pixel>> {
        let [width, height] = self.exposure.size;
        let about = rows.start.saturating_sub(SHARED_ROWS)..(rows.end + SHARED_ROWS).min(height);
        let survey = Survey {
            width,
            seed: self.exposure.seed,
            cancel: self.cancel,
            tools: &|| Tools {
                sight: Sight::default(),
                recorder: Recorder::new(self.lit),
            },
            record: &|tools, at, sampler, counts| self.record(tools, at, sampler, counts),
            told: &|| {},
        };
        let records = survey.rows(about)?;
        let light = records.shared(self.cancel)?;
        let mut pixels = vec![Pixel::default(); width as usize * rows.len()];
        let mut is_wanted = vec![true; pixels.len()];
        let most = self.exposure.samples;
        let (mut done, mut wanted) = (0, FIRST_SAMPLES.min(most));
        while done < wanted {
            if done > 0 {
                is_wanted = noisy(&pixels, width as usize);
            }
            self.expose(&light, rows.start, done..wanted, &is_wanted, &mut pixels)?;
            (done, wanted) = (wanted, (wanted * GROWTH).min(most));
        }
        Some(pixels)
    }

    /// The record of a pixel, of what is seen through its middle, by so many rays to each kind of light and over the
    /// hemisphere.
    fn record(
        &self,
        tools: &mut Tools<'a>,
        at: [u32; 2],
        sampler: &Sampler,
        counts: [u32; 2],
    ) -> Option<Record> {
        if self.subject.is_unlit {
            return None;
        }
        let (origin, direction) = self.ray(at, Vec2::splat(0.5));
        let Tools { sight, recorder } = tools;
        let numbers = sampler.sample(at, 0);
        sight.follow(self.seen(), origin, direction, sampler.chances(numbers));
        let (surface, length) = sight.main_surface()?;
        let spacing = self.lens.spacing(length, self.exposure.size[1]);
        Some(recorder.record(surface, spacing, sampler, numbers, counts))
    }

    /// Add samples to those of some rows of pixels that want them.
    fn expose(
        &self,
        light: &SharedLight<'_>,
        top: u32,
        samples: Range<u32>,
        is_wanted: &[bool],
        pixels: &mut [Pixel],
    ) -> Option<()> {
        let width = self.exposure.size[0] as usize;
        let sampler = Sampler::new(samples.end, self.exposure.seed);
        let rows = pixels
            .par_chunks_mut(width)
            .zip(is_wanted.par_chunks(width));
        rows.enumerate()
            .for_each_init(Sight::default, |sight, (row, (pixels, is_wanted))| {
                let wanted = pixels.iter_mut().zip(is_wanted).enumerate();
                for (column, (pixel, _)) in wanted.filter(|(_, (_, is_wanted))| **is_wanted) {
                    if self.cancel.is_cancelled() {
                        return;
                    }
                    let at = [column as u32, top + row as u32];
                    for sample in samples.clone() {
                        let numbers = sampler.sample(at, sample);
                        let within = sampler.point(numbers, Use::Place);
                        let (origin, direction) = self.ray(at, within);
                        sight.follow(self.seen(), origin, direction, sampler.chances(numbers));
                        let seen = Vec2::new(at[0] as f32, at[1] as f32) + within;
                        *pixel += sight.sample(self.seen(), |surface| {
                            if self.subject.is_unlit {
                                return Vec3::splat(beside_eye(surface, direction));
                            }
                            let [all, direct] = self.lit.stored(surface);
                            let near = light.at(seen, surface.position, surface.normal);
                            near.map_or(all, |more| (all - direct).max(Vec3::ZERO) + more)
                        });
                    }
                }
            });
        self.cancel.proceed()
    }

    /// What rays from the eye meet.
    fn seen(&self) -> Seen<'_> {
        Seen {
            subject: self.subject,
            lit: self.lit,
        }
    }

    /// The ray through a point of a pixel.
    fn ray(&self, at: [u32; 2], within: Vec2) -> (Vec3, Vec3) {
        let of = |[x, y]: [u32; 2]| Vec2::new(x as f32, y as f32);
        let place = (of(at) + within) / of(self.exposure.size);
        let [x, y] = (2.0 * place - 1.0).to_array();
        self.lens.ray(Vec2::new(x, -y))
    }
}

/// Irradiance by a lamp beside the eye that shows reflectances as they are, a little darker where a surface turns away.
fn beside_eye(surface: &Surface, direction: Vec3) -> f32 {
    PI * (0.15 + 0.6 * surface.normal.dot(direction).abs())
}

/// The pixels that are noisy, or beside one that is.
fn noisy(pixels: &[Pixel], width: usize) -> Vec<bool> {
    let noise: Vec<[f32; 2]> = pixels.par_iter().map(Pixel::noise).collect();
    let mean = noise.iter().map(|[mean, _]| f64::from(*mean)).sum::<f64>() / noise.len() as f64;
    let floor = OF_MEAN * mean as f32;
    let is_noisy = |&[mean, error]: &[f32; 2]| error > NOISE * (mean + floor);
    let own: Vec<bool> = noise.iter().map(is_noisy).collect();
    let beside = |at: usize| {
        let (row, column) = (at / width, at % width);
        let rows = row.saturating_sub(1)..(row + 2).min(own.len() / width);
        let columns = column.saturating_sub(1)..(column + 2).min(width);
        rows.into_iter()
            .any(|row| own[row * width..][columns.clone()].iter().any(|&own| own))
    };
    (0..own.len()).into_par_iter().map(beside).collect()
}
