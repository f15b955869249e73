//! Random numbers of pixels: neighbouring pixels share one low-discrepancy sequence, so that not only the samples of a pixel
//! are spread evenly but also those of a group of pixels (Ahmed and Wonka, "Screen-Space Blue-Noise Diffusion of Monte Carlo
//! Sampling Error via Hierarchical Ordering of Pixels", 2020).

use std::ops::Range;

use glam::Vec2;

use crate::geometry::{Random, Shuffle, shuffled, sobol_2d};

/// What numbers are used for. Each use has a sequence of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// Place within the pixel.
    Place,
    /// Direction over the hemisphere.
    Hemisphere,
    /// The same from where the first one ends.
    Further,
    /// Which light, and which part of it.
    Light,
    Part,
    /// Direction of gloss.
    Gloss,
}

/// The numbers of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampler {
    /// Samples of a pixel at most, a power of 2 in the exponent.
    bits: u32,
    seed: u64,
}

impl Sampler {
    /// For so many samples of a pixel.
    pub(super) fn new(samples: u32, seed: u64) -> Self {
        Self {
            bits: samples.max(1).next_power_of_two().trailing_zeros(),
            seed,
        }
    }

    /// The numbers of a sample of a pixel.
    pub(super) fn sample(&self, [x, y]: [u32; 2], sample: u32) -> Numbers {
        // Along a curve that keeps neighbours together.
        let along = spread(x) | spread(y) << 1;
        Numbers {
            first: along << self.bits,
            sample,
        }
    }

    /// The point of the unit square that a sample uses.
    pub(super) fn point(&self, numbers: Numbers, used: Use) -> Vec2 {
        let mut random = Random::new(self.seed, used as u64);
        let index = numbers.first.wrapping_add(numbers.sample);
        let order = shuffled(index, random.next_u32());
        sobol_2d(order, [random.next_u32(), random.next_u32()])
    }

    /// The numbers of a ray from the eye beside its place.
    pub(super) fn chances(&self, numbers: Numbers) -> Chances {
        let index = u64::from(numbers.first.wrapping_add(numbers.sample));
        Chances {
            first: Some(self.point(numbers, Use::Gloss)),
            random: Random::new(self.seed, index << 32 | u64::from(u32::MAX)),
        }
    }

    /// Of so many shadow rays: the sequence of their pixel, and which of it they are.
    pub(super) fn shadow(&self, numbers: Numbers, count: u32) -> (Range<u32>, Shuffle) {
        let start = numbers.sample;
        let of_pixel = Numbers {
            sample: 0,
            ..numbers
        };
        let shuffle = Shuffle {
            shift: self.point(of_pixel, Use::Part),
            scramble: 0,
            offset: self.point(of_pixel, Use::Light).x,
        };
        (start..start.saturating_add(count), shuffle)
    }
}

/// Which of the numbers belong to a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numbers {
    /// The first one of its pixel.
    first: u32,
    sample: u32,
}

impl Numbers {
    /// Those of a later sample of the pixel.
    pub(super) fn after(self, count: u32) -> Self {
        Self {
            sample: self.sample.wrapping_add(count),
            ..self
        }
    }
}

/// What a ray from the eye meets by chance.
#[derive(Clone, Debug)]
pub(super) struct Chances {
    /// The first point, spread evenly over neighbouring pixels.
    first: Option<Vec2>,
    random: Random,
}

impl Chances {
    /// The next point of the unit square.
    pub(super) fn square(&mut self) -> Vec2 {
        self.first
            .take()
            .unwrap_or_else(|| self.random.uniform_2d())
    }

    /// A point of the unit square, and a number in 0…1.
    pub(super) fn choice(&mut self) -> (f64, Vec2) {
        let number = f64::from(self.random.next_u32()) / 4_294_967_296.0;
        (number, self.random.uniform_2d())
    }
}

/// The lower 16 bits, each followed by a 0.
fn spread(x: u32) -> u32 {
    [
        (8, 0x00ff_00ff),
        (4, 0x0f0f_0f0f),
        (2, 0x3333_3333),
        (1, 0x5555_5555),
    ]
    .into_iter()
    .fold(x & 0xffff, |x, (shift, mask)| (x | x << shift) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_samples_of_a_square_of_pixels_are_spread_together() {
        let sampler = Sampler::new(4, 5);
        for corner in [[0, 0], [8, 4], [60, 12]] {
            let pixels = (0..16).map(|at| [corner[0] + at % 4, corner[1] + at / 4]);
            let samples = pixels.flat_map(|pixel| (0..4).map(move |sample| (pixel, sample)));
            let mut cells: Vec<u32> = samples
                .map(|(pixel, sample)| {
                    let point = sampler.point(sampler.sample(pixel, sample), Use::Place);
                    (point.y * 8.0) as u32 * 8 + (point.x * 8.0) as u32
                })
                .collect();
            cells.sort_unstable();
            assert!(cells.into_iter().eq(0..64));
        }
    }
}
