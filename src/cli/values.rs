//! Values of flags: the names and explanations that the enums of other rooms have on the command line.

use clap::{ValueEnum, builder::PossibleValue};

use crate::{
    export::ToneMap,
    scene::Sides,
    solver::{Direct, Method, Omission, Oracle},
};

/// Let the variants of an enum be values of flags.
macro_rules! values {
    ($type:ty { $($variant:ident = $name:literal $(or $alias:literal)?, $help:literal;)+ }) => {
        impl ValueEnum for $type {
            fn value_variants<'a>() -> &'a [Self] {
                &[$(Self::$variant),+]
            }

            fn to_possible_value(&self) -> Option<PossibleValue> {
                Some(match self {
                    $(Self::$variant => PossibleValue::new($name)$(.alias($alias))?.help($help),)+
                })
            }
        }
    };
}

values!(Sides {
    Auto = "auto", "Closed shells one-sided, sheets two-sided";
    One = "one", "Counter-clockwise is the front";
    Two = "two", "Both sides";
});

values!(ToneMap {
    None = "none", "Cut off at white";
    Neutral = "neutral", "Khronos PBR Neutral";
});

values!(Method {
    Bounded = "bounded", "Spherical harmonics within bounds";
    SixFace = "six-face", "Six vectors along the box normals: the paper";
    Single = "single", "One vector";
    Exact = "exact", "Sum over all patches";
    Isotropic = "isotropic", "The same in every direction";
});

values!(Oracle {
    Interval = "interval", "Bounds over both boxes";
    Samples = "samples", "Largest minus smallest over sample pairs: the paper";
});

values!(Direct {
    Sampled = "sampled" or "auto", "Shadow rays from every vertex";
    Linked = "linked", "Over links: the paper";
});

values!(Omission {
    Unlit = "unlit", "Surfaces that no light can reach";
    Rays = "rays", "Rays where nothing can block them";
    Elements = "elements", "Elements where light varies little and nothing casts a shadow";
    Clusters = "clusters", "Links of clusters where nothing casts a shadow and there are few patches";
    Outside = "outside", "The sky and the sun where no surface sees them";
});

/// A finite number.
pub(super) fn number(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|number: &f32| number.is_finite())
        .ok_or_else(|| "not a number".to_owned())
}

/// A finite number that is not negative.
pub(super) fn at_least_zero(text: &str) -> Result<f32, String> {
    number(text).and_then(|value| match value >= 0.0 {
        true => Ok(value),
        false => Err("must be at least 0".to_owned()),
    })
}

/// A share above 0 and up to 1, given in per cent, with or without its sign.
pub(super) fn per_cent(text: &str) -> Result<f32, String> {
    let text = text.trim_end_matches('%').trim_end();
    number(text).and_then(|value| match value > 0.0 && value <= 100.0 {
        true => Ok(value / 100.0),
        false => Err("must be above 0 and at most 100".to_owned()),
    })
}

/// The name of a value on the command line.
pub(super) fn name_of(value: &impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_named_as_in_reports() {
        for omission in Omission::ALL {
            assert_eq!(name_of(&omission), omission.name());
        }
        assert_eq!(Direct::from_str("auto", false), Ok(Direct::Sampled));
    }
}
