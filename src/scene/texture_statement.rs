//! Texture statements of MTL files: options before and after a file name, which may hold spaces, `-` and `#`.
//!
//! No rule tells a name from what surrounds it, so a statement has several readings; which one is meant shows in which
//! file there is.

use glam::DVec2;

use super::Wrap;

/// A texture statement without its keyword.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureStatement {
    text: String,
}

/// One way to read a texture statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureReference {
    /// File name, not empty.
    pub(super) name: String,
    /// How it lies.
    pub(super) mapping: Mapping,
    /// The first option that is not followed and may change the picture.
    pub(super) ignored: Option<String>,
}

/// How a texture lies on the faces of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mapping {
    /// `-s`: texture coordinates are multiplied by it …
    scale: DVec2,
    /// `-o`: … and then moved by it.
    offset: DVec2,
    /// `-clamp`: how the picture goes on beyond its edges.
    pub(super) wrap: Wrap,
}

impl Default for Mapping {
    fn default() -> Self {
        Self {
            scale: DVec2::ONE,
            offset: DVec2::ZERO,
            wrap: Wrap::Repeat,
        }
    }
}

impl Mapping {
    /// Where a texture coordinate of the file lies in the picture.
    pub(super) fn place(self, uv: DVec2) -> DVec2 {
        uv * self.scale + self.offset
    }
}

/// Arguments of an option at most, by the format.
const MOST_ARGUMENTS: usize = 3;

/// Bytes of a statement that is looked at. File systems allow half of it for a path; more only costs time.
const LONGEST_STATEMENT: usize = 8192;

/// Readings of one statement. Fewer would miss the name behind several unknown options; each more is a look at the disk
/// for a name that nobody meant.
const MOST_READINGS: usize = 32;

impl TextureStatement {
    /// The name after the keyword; empty if there is no name in it, or one that is too long.
    pub(super) fn of(text: &str) -> Option<Self> {
        if text.len() > LONGEST_STATEMENT {
            return None;
        }
        let statement = Self {
            text: text.to_owned(),
        };
        (!statement.readings().is_empty()).then_some(statement)
    }

    /// Whether another statement names the same file, by the barest reading of both.
    pub(super) fn means_file_of(&self, other: &Self) -> bool {
        let name = |statement: &Self| statement.readings().pop().map(|reading| reading.name);
        name(self) == name(other)
    }

    /// The ways to read the statement, from the longest name to the barest.
    pub(super) fn readings(&self) -> Vec<TextureReference> {
        let mut readings = Vec::new();
        add_readings(&self.text, &Options::default(), &mut readings);
        readings
    }
}

/// Add the readings of a text that follows options.
fn add_readings(text: &str, before: &Options, readings: &mut Vec<TextureReference>) {
    let mut options = before.clone();
    let mut rest = text.trim_start();
    while let Some(after) = options.take_known(rest) {
        rest = after;
    }
    for end in name_ends(rest) {
        let (name, behind) = rest.split_at(end);
        let mut options = options.clone();
        options.take_all(behind);
        if !options.add_reading(name, readings) {
            return;
        }
    }
    // An option that is not known has an unknown number of arguments.
    let (option, mut rest) = next_word(rest);
    if !is_option(option) {
        return;
    }
    options.ignore(option);
    for _ in 0..=MOST_ARGUMENTS {
        add_readings(rest, &options, readings);
        let (word, after) = next_word(rest);
        if is_option(word) || after.is_empty() {
            return;
        }
        rest = after;
    }
}

/// Where the name that a text begins with may end, the last place first: at the end, before an option, before a comment.
fn name_ends(text: &str) -> Vec<usize> {
    let mut ends = vec![text.len()];
    let mut rest = next_word(text).1;
    while !rest.is_empty() {
        let (word, after) = next_word(rest);
        if is_option(word) || word.starts_with('#') {
            ends.push(text.len() - rest.len());
        }
        rest = after;
    }
    ends[1..].reverse();
    ends
}

/// The values of options.
#[derive(Clone, Debug, Default)]
struct Options {
    mapping: Mapping,
    ignored: Option<String>,
}

impl Options {
    /// Take the option that a text begins with and return what follows; nothing if it is none that is known.
    fn take_known<'a>(&mut self, text: &'a str) -> Option<&'a str> {
        let (option, mut rest) = next_word(text);
        let limit = match option {
            "-s" | "-o" | "-t" => MOST_ARGUMENTS,
            "-mm" => 2,
            "-bm" | "-clamp" | "-blendu" | "-blendv" | "-cc" | "-imfchan" | "-texres"
            | "-boost" | "-type" => 1,
            _ => return None,
        };
        let is_numeric = matches!(option, "-s" | "-o" | "-t" | "-mm");
        let mut values = Vec::new();
        while values.len() < limit {
            let (word, after) = next_word(rest);
            if word.is_empty() || is_numeric && word.parse::<f64>().is_err() {
                break;
            }
            values.push(word);
            rest = after;
        }
        self.apply(option, &values);
        Some(rest)
    }

    /// Take all options of a text up to a comment; words that belong to none are passed over.
    fn take_all(&mut self, mut text: &str) {
        while !text.is_empty() && !text.starts_with('#') {
            text = self.take_known(text).unwrap_or_else(|| {
                let (word, after) = next_word(text);
                if is_option(word) {
                    self.ignore(word);
                }
                after
            });
        }
    }

    fn apply(&mut self, option: &str, values: &[&str]) {
        let number = |index: usize, default: f64| {
            values
                .get(index)
                .and_then(|word: &&str| word.parse::<f64>().ok())
                .filter(|value| value.is_finite())
                .unwrap_or(default)
        };
        match option {
            "-s" => self.mapping.scale = DVec2::new(number(0, 1.0), number(1, 1.0)),
            "-o" => self.mapping.offset = DVec2::new(number(0, 0.0), number(1, 0.0)),
            "-clamp" => {
                self.mapping.wrap = match values.first() {
                    Some(&"off") => Wrap::Repeat,
                    _ => Wrap::Clamp,
                }
            }
            "-t" | "-mm" => self.ignore(option),
            _ => {}
        }
    }

    fn ignore(&mut self, option: &str) {
        self.ignored.get_or_insert_with(|| option.to_owned());
    }

    /// Add a reading with this name, if it is one; false once there are enough.
    fn add_reading(self, name: &str, readings: &mut Vec<TextureReference>) -> bool {
        if readings.len() >= MOST_READINGS {
            return false;
        }
        let name = name.trim_ascii().trim_matches('"');
        if !name.trim().is_empty() {
            readings.push(TextureReference {
                name: name.to_owned(),
                mapping: self.mapping,
                ignored: self.ignored,
            });
        }
        true
    }
}

/// Whether a word looks like an option: `-` and letters.
fn is_option(word: &str) -> bool {
    word.strip_prefix('-').is_some_and(|letters| {
        !letters.is_empty() && letters.bytes().all(|byte| byte.is_ascii_alphabetic())
    })
}

fn next_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    (word, rest.trim_start())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn readings(text: &str) -> Vec<TextureReference> {
        let statement = TextureStatement {
            text: text.to_owned(),
        };
        statement.readings()
    }

    fn names(text: &str) -> Vec<String> {
        let readings = readings(text).into_iter();
        readings.map(|reading| reading.name).collect()
    }

    #[test]
    fn options_before_the_name_are_told_from_it() {
        let text = "-s 2 3 1 -o 0.5 -clamp on -bm 1 my tex-ture 2.png";
        let [reading] = &readings(text)[..] else {
            panic!("{:?}", names(text));
        };
        assert_eq!(reading.name, "my tex-ture 2.png");
        let expected = Mapping {
            scale: DVec2::new(2.0, 3.0),
            offset: DVec2::new(0.5, 0.0),
            wrap: Wrap::Clamp,
        };
        assert_eq!((reading.mapping, &reading.ignored), (expected, &None));
        for (text, wrap) in [
            ("-clamp off a.png", Wrap::Repeat),
            ("a.png -clamp on", Wrap::Clamp),
        ] {
            assert_eq!(readings(text).last().unwrap().mapping.wrap, wrap, "{text}");
        }
        let moved = readings("-t 1 1 1 a.png").remove(0);
        assert_eq!(moved.ignored.as_deref(), Some("-t"));
        assert_eq!(TextureStatement::of("-s 1 1 1"), None);
        assert_eq!(TextureStatement::of("  "), None);
        assert_eq!(names("-odd.png"), ["-odd.png"]);
    }

    #[test]
    fn options_behind_the_name_count_where_it_ends_before_them() {
        let text = "my floor.png -s 2 4 1 -o 0.5 0.25";
        let found = readings(text);
        let expected = [text, "my floor.png -s 2 4 1", "my floor.png"];
        assert_eq!(names(text), expected);
        assert_eq!(found[0].mapping.scale, DVec2::ONE);
        assert_eq!(found[1].mapping.offset, DVec2::new(0.5, 0.25));
        assert_eq!(found[2].mapping.scale, DVec2::new(2.0, 4.0));
        assert_eq!(found[2].mapping.offset, DVec2::new(0.5, 0.25));
    }

    #[test]
    fn unknown_options_may_have_any_arguments() {
        let expected = [
            "-foo 3 my floor.png",
            "3 my floor.png",
            "my floor.png",
            "floor.png",
        ];
        assert_eq!(names("-foo 3 my floor.png"), expected);
        let found = readings("-colorspace sRGB -s 2 2 1 floor.png -foo 1");
        let last = found.last().unwrap();
        assert_eq!(last.name, "floor.png");
        assert_eq!(last.mapping.scale, DVec2::splat(2.0));
        assert_eq!(last.ignored.as_deref(), Some("-colorspace"));
    }

    #[test]
    fn a_comment_and_quotes_may_surround_the_name() {
        let text = "\"my floor.png\" -s 2 2 1 # oak -o 9 9";
        let found = readings(text);
        let last = found.last().unwrap();
        assert_eq!(last.name, "my floor.png");
        assert_eq!(last.mapping.scale, DVec2::splat(2.0));
        assert_eq!(last.mapping.offset, DVec2::ZERO);
        assert_eq!(names("wood #2.png"), ["wood #2.png", "wood"]);
    }

    #[test]
    fn readings_are_bounded() {
        let many = "-a ".repeat(LONGEST_STATEMENT / 3);
        assert_eq!(readings(&many).len(), MOST_READINGS);
        assert_eq!(TextureStatement::of(&many.repeat(2)), None);
    }
}
