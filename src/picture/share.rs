//! Records of neighbouring pixels shared, so that few rays from each make a smooth picture.
//!
//! What direct and indirect light are more than the light stored at vertices is averaged over pixels whose surfaces are near
//! and turned alike, as far as light changes slowly between them: indirect light over the lengths of its rays (Ward, Rubinstein
//! and Clear, "A Ray Tracing Solution for Diffuse Interreflection", 1988), direct light over the width of its penumbrae
//! (Mehta, Wang and Ramamoorthi, "Axis-Aligned Filtering for Interactive Sampled Soft Shadows", 2012).

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::record::{INDIRECT, KINDS, Record};
use crate::solver::Cancel;

/// Rounds of averages over 5 × 5 pixels, each twice as far apart as in the round before. Fewer leave noise; more change
/// nothing.
const ROUNDS: u32 = 5;

/// Part of the distance over which direct light changes by most of itself, from which a record does not count. Larger blurs
/// penumbrae; smaller leaves noise in them.
const DIRECT_REACH: f32 = 0.1;

/// The same for what indirect light is more than stored, of the lengths of its rays. Larger smooths contacts away; smaller
/// leaves noise.
const INDIRECT_REACH: f32 = 0.3;

/// Angle of normals, in radians, from which records do not count for each other. Larger rounds edges off; smaller leaves
/// noise on curved surfaces.
const LARGEST_TURN: f32 = 0.4;

/// Pixels over which records are shared however near their rays went. Fewer leave noise in corners; more smooth them away.
const LEAST_PIXELS: f32 = 2.0;

/// Rows on each side from which a pixel may share.
pub(super) const SHARED_ROWS: u32 = 2 * ((1 << ROUNDS) - 1);

/// Pixels of a round, 5 × 5: the middle one is that which they are shared by.
const AROUND: usize = 25;

/// The records of some rows of a picture, row by row; `None` where there is no surface.
pub(super) struct Records {
    pub(super) list: Vec<Option<Record>>,
    pub(super) width: usize,
    /// The first row.
    pub(super) top: u32,
}

/// The mean of records about a pixel, and its variance.
#[derive(Clone, Copy, Debug, Default)]
struct Shared {
    mean: Vec3,
    variance: f32,
}

/// Light shared between pixels.
pub(super) struct SharedLight<'a> {
    records: &'a Records,
    list: Vec<Option<[Shared; KINDS]>>,
}

/// The part of the distance over which light of a kind changes, within which it is shared.
fn reach(kind: usize) -> f32 {
    match kind {
        INDIRECT => INDIRECT_REACH,
        _ => DIRECT_REACH,
    }
}

/// How much the pixels of a round count by their number, row by row.
fn bell(index: usize) -> f32 {
    const BELL: [f32; 5] = [1.0 / 16.0, 0.25, 0.375, 0.25, 1.0 / 16.0];
    BELL[index / 5] * BELL[index % 5]
}

impl Record {
    /// How much another one counts here by its place, 0…1.
    fn weights(&self, other: &Self) -> [f32; KINDS] {
        let apart = other.position - self.position;
        let fit = self.fit(apart, other.normal);
        if fit <= 0.0 {
            return [0.0; KINDS];
        }
        let distance = apart.length();
        std::array::from_fn(|kind| {
            let change = match kind {
                INDIRECT => self
                    .indirect_change(apart, distance)
                    .max(other.indirect_change(apart, distance)),
                _ => distance * self.changes[kind].max(other.changes[kind]),
            };
            (fit - change / reach(kind)).max(0.0)
        })
    }

    /// How much indirect light changes over a way of this length, as far as what is near tells: where that lies in one
    /// direction, as in a corner, light changes in this direction alone; where it is all around, in each.
    fn indirect_change(&self, way: Vec3, length: f32) -> f32 {
        let around = (self.changes[INDIRECT] - self.towards.length()).max(0.0);
        length * around + self.towards.dot(way).abs()
    }

    /// How well a place so far away belongs to the same surface, 0…1.
    fn fit(&self, apart: Vec3, normal: Vec3) -> f32 {
        let height = apart.dot(self.normal).abs() / (LEAST_PIXELS * self.spacing);
        // The cosine of a small angle is one less half of its square.
        let turn = (2.0 - 2.0 * self.normal.dot(normal)).max(0.0).sqrt();
        (1.0 - turn / LARGEST_TURN).max(0.0) * (1.0 - height).max(0.0)
    }
}

impl Records {
    /// Replace how fast the light of each record changes by the mean about it, since that of a few rays is noise, and bound
    /// it for indirect light so that some pixels share always.
    pub(super) fn smooth_changes(&mut self) {
        let smoothed = |at: usize| -> Option<([f32; KINDS], Vec3)> {
            let own = self.list[at].as_ref()?;
            let (mut sums, mut weights) = ([0.0; KINDS], [0.0; KINDS]);
            let mut towards = Vec3::ZERO;
            for (index, _, other) in self.around(at, 1) {
                let weight = bell(index) * own.fit(other.position - own.position, other.normal);
                if other.changes[INDIRECT] > 0.0 {
                    towards += other.towards * weight;
                }
                for kind in 0..KINDS {
                    // Where nothing is blocked it is not known.
                    if other.changes[kind] > 0.0 {
                        sums[kind] += other.changes[kind] * weight;
                        weights[kind] += weight;
                    }
                }
            }
            let mut changes: [f32; KINDS] = std::array::from_fn(|kind| match weights[kind] {
                0.0 => 0.0,
                weights => sums[kind] / weights,
            });
            towards /= weights[INDIRECT].max(f32::MIN_POSITIVE);
            let most = INDIRECT_REACH / (LEAST_PIXELS * own.spacing);
            if changes[INDIRECT] > most {
                towards *= most / changes[INDIRECT];
                changes[INDIRECT] = most;
            }
            Some((changes, towards))
        };
        let all: Vec<Option<([f32; KINDS], Vec3)>> =
            (0..self.list.len()).into_par_iter().map(smoothed).collect();
        for (record, smoothed) in self.list.iter_mut().zip(all) {
            if let (Some(record), Some(smoothed)) = (record, smoothed) {
                (record.changes, record.towards) = smoothed;
            }
        }
    }

    /// Mean luminance of the irradiance stored.
    pub(super) fn mean_stored(&self) -> f32 {
        let stored = self.list.iter().flatten().map(|record| record.stored);
        let (sum, count) = stored.fold((0.0, 0.0), |(sum, count), light| {
            (sum + f64::from(light), count + 1.0)
        });
        if count > 0.0 {
            (sum / count) as f32
        } else {
            0.0
        }
    }

    /// Means over records, as far as they count; `None` when cancelled.
    pub(super) fn shared(&self, cancel: &Cancel) -> Option<SharedLight<'_>> {
        // The variance of a few rays is noise, too.
        let own = |at: usize| -> Option<[Shared; KINDS]> {
            let own = self.list[at].as_ref()?;
            let (mut sums, mut weights) = ([0.0; KINDS], f32::MIN_POSITIVE);
            for (index, _, other) in self.around(at, 1) {
                let weight = bell(index) * own.fit(other.position - own.position, other.normal);
                weights += weight;
                for (sum, light) in sums.iter_mut().zip(&other.light) {
                    *sum += weight * light.variance();
                }
            }
            Some(std::array::from_fn(|kind| Shared {
                mean: own.light[kind].mean,
                variance: sums[kind] / weights / own.light[kind].count.max(1.0),
            }))
        };
        let mut list: Vec<Option<[Shared; KINDS]>> =
            (0..self.list.len()).into_par_iter().map(own).collect();
        for round in 0..ROUNDS {
            cancel.proceed()?;
            let mean = |at: usize| self.mean(&list, at, 1 << round);
            list = (0..self.list.len()).into_par_iter().map(mean).collect();
        }
        let bounded = |at: usize| self.bounded(&list, at);
        let list = (0..list.len()).into_par_iter().map(bounded).collect();
        cancel.proceed()?;
        Some(SharedLight {
            records: self,
            list,
        })
    }

    /// The mean about a pixel over pixels so far apart. Two that lie opposite each other count alike: otherwise a pixel at an
    /// edge would have the light of places further in, and shadows would shift there.
    fn mean(
        &self,
        list: &[Option<[Shared; KINDS]>],
        at: usize,
        step: usize,
    ) -> Option<[Shared; KINDS]> {
        let (record, own) = (self.list[at].as_ref()?, list[at]?);
        let mut near = [[0.0; KINDS]; AROUND];
        let mut places = [at; AROUND];
        for (index, other, place) in self.around(at, step) {
            if list[other].is_some() {
                (near[index], places[index]) = (record.weights(place), other);
            }
        }
        let mut sums = [(Vec3::ZERO, 0.0, 0.0); KINDS];
        for index in 0..AROUND {
            let Some(others) = &list[places[index]] else {
                continue;
            };
            let opposite = near[AROUND - 1 - index];
            for kind in 0..KINDS {
                let (mean, weights, variance) = &mut sums[kind];
                let weight = bell(index) * near[index][kind].min(opposite[kind]);
                *mean += others[kind].mean * weight;
                *weights += weight;
                *variance += others[kind].variance * weight * weight;
            }
        }
        Some(std::array::from_fn(|kind| match sums[kind] {
            (_, 0.0, _) => own[kind],
            (mean, weights, variance) => Shared {
                mean: mean / weights,
                variance: variance / (weights * weights),
            },
        }))
    }

    /// The light of a pixel within that of its neighbours on the same surface: where few pixels share, one of the rare rays
    /// that meet something bright would make a speck. Neighbours count with those opposite, as in means: at an edge, light
    /// may well go on rising.
    fn bounded(&self, list: &[Option<[Shared; KINDS]>], at: usize) -> Option<[Shared; KINDS]> {
        let (record, mut own) = (self.list[at].as_ref()?, list[at]?);
        let mut near = [None; AROUND];
        for (index, other, place) in self.around(at, 1) {
            if record.fit(place.position - record.position, place.normal) > 0.0 {
                near[index] = list[other].as_ref();
            }
        }
        let mut bounds = [(Vec3::INFINITY, Vec3::NEG_INFINITY); KINDS];
        for index in (0..AROUND).filter(|&index| index != AROUND / 2) {
            if let (Some(others), Some(_)) = (near[index], near[AROUND - 1 - index]) {
                for ((low, high), other) in bounds.iter_mut().zip(others) {
                    (*low, *high) = (low.min(other.mean), high.max(other.mean));
                }
            }
        }
        for (own, (low, high)) in own.iter_mut().zip(bounds) {
            if low.cmple(high).all() {
                own.mean = own.mean.clamp(low, high);
            }
        }
        Some(own)
    }

    /// The records about one, `step` apart, of its group: each with its number among those about, row by row, and its index.
    fn around(&self, at: usize, step: usize) -> impl Iterator<Item = (usize, usize, &Record)> {
        let (row, column) = ((at / self.width) as isize, (at % self.width) as isize);
        let height = (self.list.len() / self.width) as isize;
        let (width, step) = (self.width as isize, step as isize);
        let group = self.list[at].as_ref().map(|record| record.group);
        (0..AROUND).filter_map(move |index| {
            let (down, across) = (index as isize / 5, index as isize % 5);
            let (row, column) = (row + (down - 2) * step, column + (across - 2) * step);
            let is_inside = (0..height).contains(&row) && (0..width).contains(&column);
            let at = is_inside.then_some((row * width + column) as usize)?;
            let record = self.list[at].as_ref()?;
            (Some(record.group) == group).then_some((index, at, record))
        })
    }
}

impl SharedLight<'_> {
    /// Standard errors of direct and indirect light at a pixel, relative to the irradiance there and a floor.
    pub(super) fn relative_errors(&self, at: usize, floor: f32) -> [f32; 2] {
        let (Some(record), Some(shared)) = (&self.records.list[at], &self.list[at]) else {
            return [0.0; 2];
        };
        let light = (record.stored + floor).max(f32::MIN_POSITIVE);
        let (direct, indirect) = shared.split_at(INDIRECT);
        [direct, indirect].map(|shared| {
            let variance: f32 = shared.iter().map(|shared| shared.variance).sum();
            variance.sqrt() / light
        })
    }

    /// What irradiance is more than the indirect light stored, W/m², at the place of a record.
    pub(super) fn of(&self, at: usize) -> Option<Vec3> {
        let (record, shared) = (self.records.list[at].as_ref()?, self.list[at]?);
        Some(record.excess_of(shared.map(|shared| shared.mean)))
    }

    /// What irradiance is more than the indirect light stored at a place, W/m², that is `seen` at a place of the picture in
    /// pixels; `None` where no record is near.
    pub(super) fn at(&self, seen: Vec2, position: Vec3, normal: Vec3) -> Option<Vec3> {
        /// Of records beyond the four that are nearest, so that they count where those do not.
        const FAR: f32 = 1e-3;
        let records = self.records;
        let height = records.list.len() / records.width;
        let centre = seen - 0.5 - Vec2::new(0.0, records.top as f32);
        let first = (centre.round() - 1.0).max(Vec2::ZERO).as_usizevec2();
        let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
        for row in first.y..(first.y + 3).min(height) {
            for column in first.x..(first.x + 3).min(records.width) {
                let at = row * records.width + column;
                let (Some(record), Some(shared)) = (&records.list[at], &self.list[at]) else {
                    continue;
                };
                let apart = (centre - Vec2::new(column as f32, row as f32)).abs();
                let tent = (1.0 - apart).max(Vec2::splat(FAR));
                let weight = tent.x * tent.y * record.fit(position - record.position, normal);
                sum += record.excess_of(shared.map(|shared| shared.mean)) * weight;
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }
}
