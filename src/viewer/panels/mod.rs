//! The panels around the viewport, one a file. They show the state, and return wishes as actions.

pub mod clusters;
pub mod dialog;
pub mod emission;
pub mod error;
pub mod help;
pub mod left_out;
pub mod legend;
pub mod links;
pub mod materials;
pub mod menu;
pub mod mesh;
pub mod messages;
pub mod method;
pub mod path;
pub mod picture;
pub mod plot;
pub mod probe;
pub mod progress;
pub mod row;
pub mod scene;
pub mod settings;
pub mod sides;
pub mod statistics;
pub mod status;
pub mod table;
pub mod toolbar;

/// Three significant digits, without an exponent where that is short.
pub fn figure(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".to_owned()
    } else if !value.is_finite() {
        "–".to_owned()
    } else if !(1e-3..1e6).contains(&size) {
        format!("{value:.2e}")
    } else {
        // A setting of 0.01 is a little less than that in single precision.
        let magnitude = (size * (1.0 + 1e-6)).log10().floor() as i32;
        let decimals = (2 - magnitude).max(0) as usize;
        format!("{value:.decimals$}")
    }
}

/// A count with thin spaces between thousands.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::with_capacity(digits.len() * 2);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('\u{2009}');
        }
        text.push(digit);
    }
    text
}

/// Bytes as people read them.
pub fn bytes(value: u64) -> String {
    const MIB: f64 = 1024.0 * 1024.0;
    let mib = value as f64 / MIB;
    if mib < 1000.0 {
        format!("{} MiB", figure(mib))
    } else {
        format!("{} GiB", figure(mib / 1024.0))
    }
}

/// Seconds as people read them.
pub fn seconds(value: f64) -> String {
    if value < 1.0 {
        format!("{} ms", figure(value * 1000.0))
    } else if value < 60.0 {
        format!("{value:.1} s")
    } else {
        let whole = value as u64;
        format!("{} min {:02} s", whole / 60, whole % 60)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_short() {
        let cases = [
            (0.0, "0"),
            (1.234_56, "1.23"),
            (f64::from(0.01_f32), "0.0100"),
            (12.3456, "12.3"),
            (1234.5, "1234"),
            (0.012_345, "0.0123"),
            (1.5e-6, "1.50e-6"),
        ];
        for (value, text) in cases {
            assert_eq!(figure(value), text);
        }
        assert_eq!(count(1_234_567), "1\u{2009}234\u{2009}567");
        assert_eq!(count(999), "999");
        assert_eq!(seconds(75.2), "1 min 15 s");
    }
}
