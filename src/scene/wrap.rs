//! How a picture goes on beyond its edges.

/// How a picture goes on beyond its edges, along one axis of its texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// It begins again.
    #[default]
    Repeat,
    /// It is mirrored, then begins again.
    Mirror,
    /// Its outermost pixels go on without end.
    Clamp,
}

impl Wrap {
    /// The place in the picture, 0…1, that a finite coordinate shows.
    pub(super) fn place(self, at: f32) -> f32 {
        match self {
            Self::Repeat => at.rem_euclid(1.0),
            Self::Mirror => 1.0 - (at.rem_euclid(2.0) - 1.0).abs(),
            Self::Clamp => at.clamp(0.0, 1.0),
        }
    }

    /// The pixel of a row of so many that a number stands for, whether it is one of them or lies beyond its ends.
    pub(super) fn pixel(self, number: i64, count: u32) -> u32 {
        let count = i64::from(count);
        let inside = match self {
            Self::Repeat => number.rem_euclid(count),
            Self::Mirror => {
                let number = number.rem_euclid(2 * count);
                number.min(2 * count - 1 - number)
            }
            Self::Clamp => number.clamp(0, count - 1),
        };
        inside as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_and_pixels_agree_on_what_is_shown() {
        let count = 4;
        for (wrap, expected) in [
            (Wrap::Repeat, [2, 3, 0, 1, 2, 3, 0, 1, 2, 3]),
            (Wrap::Mirror, [1, 0, 0, 1, 2, 3, 3, 2, 1, 0]),
            (Wrap::Clamp, [0, 0, 0, 1, 2, 3, 3, 3, 3, 3]),
        ] {
            for (number, expected) in (-2..).zip(expected) {
                assert_eq!(wrap.pixel(number, count), expected, "{wrap:?} {number}");
                let place = wrap.place((number as f32 + 0.5) / count as f32);
                let pixel = (place * count as f32).min(3.0).floor() as u32;
                assert_eq!(pixel, expected, "{wrap:?} {number}");
            }
        }
    }
}
