//! Numbers as people read them, and as they type them.

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
        let text = format!("{value:.decimals$}");
        match (decimals, text.strip_prefix('-')) {
            (0, Some(digits)) => format!("-{}", in_groups(digits)),
            (0, None) => in_groups(&text),
            _ => text,
        }
    }
}

/// A number as it was typed, with or without spaces between thousands.
pub fn number(text: &str) -> Option<f64> {
    let packed: String = text.split_whitespace().collect();
    packed.parse().ok()
}

/// A count with thin spaces between thousands.
pub fn count(value: u64) -> String {
    in_groups(&value.to_string())
}

/// A sentence whose whole numbers look like those of [`count`], however it groups them.
pub fn counts_in(text: &str) -> String {
    let alike = |word: &str| {
        let is_end = |c: char| ",;:.()".contains(c);
        let core = word.trim_matches(is_end);
        let digits = core.replace(',', "");
        match digits.parse() {
            Ok(value) if core.starts_with(|c: char| c.is_ascii_digit()) => {
                word.replacen(core, &count(value), 1)
            }
            _ => word.to_owned(),
        }
    };
    text.split(' ').map(alike).collect::<Vec<_>>().join(" ")
}

fn in_groups(digits: &str) -> String {
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

/// A bound of a relative error as per cent, where it says more than that all may be wrong.
pub fn bound(relative: f64) -> String {
    if relative < 1.0 {
        format!("{} %", figure(100.0 * relative))
    } else {
        "over 100 %".to_owned()
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
            (1234.5, "1\u{2009}234"),
            (-995_100.0, "-995\u{2009}100"),
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

    #[test]
    fn a_bound_is_a_figure_only_where_it_bounds() {
        assert_eq!(bound(0.25), "25.0 %");
        assert_eq!(bound(24.99), "over 100 %");
        assert_eq!(bound(f64::INFINITY), "over 100 %");
        assert_eq!(bound(f64::NAN), "over 100 %");
    }

    #[test]
    fn numbers_look_alike_and_are_read_as_they_look() {
        for value in [0.5, 1234.0, 995_100.0, -995_100.0] {
            assert_eq!(number(&figure(value)), Some(value));
        }
        assert_eq!(number("seven"), None);
        let sentence = "20,000 triangles (1022 of them small), room-42879, 0.25, and 7.";
        let wanted =
            "20\u{2009}000 triangles (1\u{2009}022 of them small), room-42879, 0.25, and 7.";
        assert_eq!(counts_in(sentence), wanted);
    }
}
