//! A logarithmic axis: its range, its ticks, and what they say.

use crate::metrics::grouped;

/// Space between labelled ticks at least, in units of the drawing; less, and labels run into each other.
const BETWEEN_LABELS: f32 = 34.0;

/// Room for a digit of a label and its share of the gap; long labels need more than [`BETWEEN_LABELS`].
const DIGIT_ROOM: f32 = 7.2;

/// Decades that an axis shows at most: the rest of a curve that falls further carries no information.
const MOST_DECADES: f64 = 8.0;

/// Numbers that an axis can show: outside them, powers of ten leave the range of `f64`.
pub(super) const SHOWABLE: std::ops::RangeInclusive<f64> = 1e-200..=1e200;

/// A range of positive numbers on an interval of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LogAxis {
    /// Least and greatest number, the ends of the axis.
    pub(super) range: [f64; 2],
    /// Where those lie in the drawing.
    pub(super) span: [f32; 2],
}

/// A tick, with a label where there is room for it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) value: f64,
    pub(super) label: Option<String>,
}

impl LogAxis {
    /// The axis that holds these values, widened to round numbers; without any positive value, 1 to 10.
    pub(super) fn around(values: impl Iterator<Item = f64>, span: [f32; 2]) -> Self {
        let (mut min, mut max) = (f64::INFINITY, 0.0_f64);
        for value in values.filter(|value| SHOWABLE.contains(value)) {
            (min, max) = (min.min(value), max.max(value));
        }
        if max <= 0.0 {
            (min, max) = (1.0, 10.0);
        }
        min = min.max(max / 10_f64.powf(MOST_DECADES));
        let mut range = [round_down(min), round_up(max)];
        if range[1] / range[0] < 4.0 {
            range = [range[0] / 2.0, range[1] * 2.0].map(round_down);
        }
        Self { range, span }
    }

    /// Place of a positive number; numbers off the axis lie at its ends.
    pub(super) fn place(&self, value: f64) -> f32 {
        let [low, high] = self.range.map(f64::ln);
        let share = (value.max(f64::MIN_POSITIVE).ln() - low) / (high - low);
        let [start, end] = self.span;
        start + (end - start) * share.clamp(0.0, 1.0) as f32
    }

    /// Ticks at 1, 2, … 9 times powers of ten; labels at 1, 2 and 5 where there is room, else at powers of ten.
    pub(super) fn ticks(&self) -> Vec<Tick> {
        let decade = (self.place(self.range[0] * 10.0) - self.span[0]).abs();
        let whole = (self.span[1] - self.span[0]).abs();
        let per_decade = if self.range[1] / self.range[0] < 10.0 {
            whole / (self.range[1] / self.range[0]).log10() as f32
        } else {
            decade
        };
        // The narrowest step between 1, 2, 5 and 10 is log₁₀ 2 of a decade.
        let digits = self.range.map(|value| value.log10().abs().ceil() as u8 + 1);
        let room = BETWEEN_LABELS.max(f32::from(digits[0].max(digits[1])) * DIGIT_ROOM);
        let labels_fives = per_decade * 2_f32.log10() > room;
        let [low, high] = self.range.map(|value| value.log10().floor() as i32);
        let mut ticks = Vec::new();
        for power in low..=high {
            for digit in 1..=9 {
                let value = f64::from(digit) * 10_f64.powi(power);
                let slack = 1e-9;
                if value < self.range[0] * (1.0 - slack) || value > self.range[1] * (1.0 + slack) {
                    continue;
                }
                let is_labelled = digit == 1 || (labels_fives && (digit == 2 || digit == 5));
                let label = is_labelled.then(|| number(digit, power));
                ticks.push(Tick { value, label });
            }
        }
        ticks
    }
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a positive number.
fn round_down(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let digits = value / power * (1.0 + 1e-9);
    let digit = [5.0, 2.0].into_iter().find(|digit| digits >= *digit);
    digit.unwrap_or(1.0) * power
}

/// The smallest of 1, 2 and 5 times a power of ten that is not below a positive number.
fn round_up(value: f64) -> f64 {
    let power = 10_f64.powf(value.log10().floor());
    let digits = value / power * (1.0 - 1e-9);
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digits <= *digit);
    digit.unwrap_or(10.0) * power
}

/// A digit times a power of ten, written out.
fn number(digit: i32, power: i32) -> String {
    if power >= 0 {
        let zeros = power.min(18) as u32;
        return grouped(u64::from(digit.unsigned_abs()) * 10_u64.pow(zeros));
    }
    let decimals = power.unsigned_abs() as usize;
    format!("{:.decimals$}", f64::from(digit) * 10_f64.powi(power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_its_values_between_round_ends() {
        let axis = LogAxis::around([0.13, 40.0, f64::NAN, 0.0].into_iter(), [0.0, 600.0]);
        assert!((axis.range[0] - 0.1).abs() < 1e-9 && (axis.range[1] - 50.0).abs() < 1e-9);
        assert!((axis.place(0.1)).abs() < 1e-3 && (axis.place(50.0) - 600.0).abs() < 1e-3);
        // The middle of a logarithmic axis is the geometric mean.
        assert!((axis.place(5_f64.sqrt()) - 300.0).abs() < 1e-2);
        let wild = [f64::MAX, f64::MIN_POSITIVE, f64::INFINITY, 7.0].into_iter();
        assert!(LogAxis::around(wild, [0.0, 1.0]).range[1] < 100.0);
        let empty = LogAxis::around([].into_iter(), [0.0, 1.0]);
        assert_eq!(empty.range, [1.0, 10.0]);
        let single = LogAxis::around([3.0].into_iter(), [0.0, 1.0]);
        assert!(single.range[0] < 3.0 && single.range[1] > 3.0);
    }

    #[test]
    fn labels_keep_their_distance_and_are_written_out() {
        for (range, span) in [
            ([0.01, 100.0], 600.0),
            ([1.0, 5.0], 300.0),
            ([1e3, 1e6], 90.0),
        ] {
            let axis = LogAxis {
                range,
                span: [0.0, span],
            };
            let places: Vec<f32> = axis
                .ticks()
                .iter()
                .filter(|tick| tick.label.is_some())
                .map(|tick| axis.place(tick.value))
                .collect();
            assert!(!places.is_empty());
            let distance = |pair: &[f32]| pair[1] - pair[0];
            assert!(
                places.windows(2).all(|pair| distance(pair) > 29.0),
                "{places:?}"
            );
        }
        assert_eq!(
            [number(5, -2), number(1, 0), number(2, 4)],
            ["0.05", "1", "20,000"]
        );
    }
}
