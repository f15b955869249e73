//! Records of a grid of places, row by row, with more rays where their light is noisy.

use std::ops::Range;

use rayon::prelude::*;

use super::{OF_MEAN, record::Record, sampler::Sampler, share::Records};
use crate::solver::Cancel;

/// Rays of each record over the hemisphere and to each kind of light. Fewer are noisy where many pixels share them; more take
/// time.
const RAYS: u32 = 4;

/// Most rays of a record. Fewer leave noise in corners; more take time there.
const MOST_RAYS: u32 = 128;

/// Standard error of the light at a pixel, relative to itself and a part of that of the picture, above which it gets more
/// rays. Smaller takes time; larger leaves grain.
const RECORD_NOISE: f32 = 0.01;

/// Makes the records of a grid; `T` is what the rays of one thread use again and again.
pub(super) struct Survey<'a, T> {
    /// Places of a row.
    pub(super) width: u32,
    pub(super) seed: u64,
    pub(super) cancel: &'a Cancel,
    pub(super) tools: &'a (dyn Fn() -> T + Sync),
    /// The record of a place, if there is a surface, by so many rays to each kind of light and over the hemisphere.
    pub(super) record: RecordOf<'a, T>,
    /// Hears of every row, twice.
    pub(super) told: &'a (dyn Fn() + Sync),
}

/// See [`Survey::record`].
pub(super) type RecordOf<'a, T> =
    &'a (dyn Fn(&mut T, [u32; 2], &Sampler, [u32; 2]) -> Option<Record> + Sync);

impl<T> Survey<'_, T> {
    /// The records of some rows.
    pub(super) fn rows(&self, rows: Range<u32>) -> Option<Records> {
        let mut records = self.first(rows)?;
        self.refine(&mut records)?;
        Some(records)
    }

    /// A record of the middle of each place of some rows.
    fn first(&self, rows: Range<u32>) -> Option<Records> {
        let width = self.width as usize;
        let sampler = Sampler::new(RAYS, self.seed);
        let mut list: Vec<Option<Record>> = vec![None; width * rows.len()];
        let by_row = list.par_chunks_mut(width).zip(rows.clone().into_par_iter());
        by_row.for_each_init(
            || (self.tools)(),
            |tools, (records, row)| {
                for (column, record) in records.iter_mut().enumerate() {
                    *record = self.at(tools, [column as u32, row], &sampler, [RAYS; 2]);
                }
                (self.told)();
            },
        );
        self.cancel.proceed()?;
        let mut records = Records {
            list,
            width,
            top: rows.start,
        };
        records.smooth_changes();
        Some(records)
    }

    /// More rays for records that are noisy however many are shared.
    fn refine(&self, records: &mut Records) -> Option<()> {
        let width = records.width;
        let sampler = Sampler::new(MOST_RAYS, !self.seed);
        let floor = OF_MEAN * records.mean_stored();
        let shared = records.shared(self.cancel)?;
        let more = |tools: &mut T, at: usize| {
            if at.is_multiple_of(width) {
                (self.told)();
            }
            let more = shared.relative_errors(at, floor).map(|error| {
                let noise = error / RECORD_NOISE;
                let wanted = (RAYS as f32 * noise * noise) as u32;
                wanted.min(MOST_RAYS).saturating_sub(RAYS)
            });
            if more == [0; 2] {
                return None;
            }
            let at = [(at % width) as u32, records.top + (at / width) as u32];
            self.at(tools, at, &sampler, more)
        };
        let more: Vec<Option<Record>> = (0..records.list.len())
            .into_par_iter()
            .map_init(|| (self.tools)(), more)
            .collect();
        self.cancel.proceed()?;
        for (record, more) in records.list.iter_mut().zip(more) {
            if let (Some(record), Some(more)) = (record, more) {
                for (light, more) in record.light.iter_mut().zip(&more.light) {
                    light.merge(more);
                }
            }
        }
        Some(())
    }

    fn at(
        &self,
        tools: &mut T,
        at: [u32; 2],
        sampler: &Sampler,
        counts: [u32; 2],
    ) -> Option<Record> {
        self.cancel.proceed()?;
        (self.record)(tools, at, sampler, counts)
    }
}
