//! Logical lines of an OBJ or MTL file, whatever wrote it: any line ending, byte-order mark, UTF-16, continuation, NUL
//! bytes and bytes that are not UTF-8; and what stands in a line: words, numbers, names.

use std::borrow::Cow;
use std::io::{BufRead, ErrorKind, Result};

use super::encoding::DecodedText;
use super::warning::{WarningKind, WarningLog};

/// Bytes of the longest line that is read. A face of a million corners needs some 24 MB; a binary file without line
/// ends must not fill the memory.
const MAX_LINE: usize = 64 << 20;

/// Reads logical lines one after the other.
#[derive(Debug)]
pub(super) struct LogicalLines<R> {
    source: DecodedText<R>,
    /// The line last read, without its ending.
    pub(super) text: Vec<u8>,
    line_count: usize,
    after_return: bool,
    too_long: bool,
}

impl<R: BufRead> LogicalLines<R> {
    /// Start at the beginning of a file.
    pub(super) fn new(source: R) -> Self {
        Self {
            source: DecodedText::new(source),
            text: Vec::new(),
            line_count: 0,
            after_return: false,
            too_long: false,
        }
    }

    /// Read the next logical line into [`Self::text`] and return the number of its first line, or nothing at the end.
    pub(super) fn advance(&mut self, log: &mut WarningLog, file: &str) -> Result<Option<usize>> {
        self.text.clear();
        self.too_long = false;
        if !self.append_line()? {
            return Ok(None);
        }
        let first = self.line_count;
        if first == 1 {
            self.begin(log, file);
        }
        // Comments often end in a Windows path, so they never continue.
        if self.text.trim_ascii_start().first() != Some(&b'#') {
            while self.drop_continuation() && self.append_line()? {}
        }
        self.cure(log, file, first);
        Ok(Some(first))
    }

    /// The byte-order mark of the first line.
    fn begin(&mut self, log: &mut WarningLog, file: &str) {
        if self.text.starts_with(b"\xef\xbb\xbf") {
            self.text.drain(..3);
        }
        if self.source.is_utf16() {
            let message = "the file is UTF-16, which many programs cannot read, and was decoded";
            log.note(WarningKind::Encoding, message, file, 1);
        }
    }

    /// Remove the `\` at the end of the text, if it is one that joins lines.
    fn drop_continuation(&mut self) -> bool {
        let end = self.text.trim_ascii_end().len();
        // The second byte of a GBK character may be a backslash, too.
        let joins = match self.text[..end] {
            [.., before, b'\\'] => before.is_ascii(),
            [b'\\'] => true,
            _ => false,
        };
        if joins {
            self.text.truncate(end - 1);
            self.text.push(b' ');
        }
        joins
    }

    /// Append one physical line, ended by LF, CR LF, CR or the end of the file; false if there is none.
    fn append_line(&mut self) -> Result<bool> {
        let mut any = false;
        loop {
            let chunk = match self.source.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                chunk => chunk?,
            };
            if chunk.is_empty() {
                self.line_count += usize::from(any);
                return Ok(any);
            }
            if std::mem::take(&mut self.after_return) && chunk[0] == b'\n' {
                self.source.consume(1);
                continue;
            }
            let end = chunk
                .iter()
                .position(|&byte| byte == b'\n' || byte == b'\r');
            let length = end.unwrap_or(chunk.len());
            if self.text.len() + length <= MAX_LINE {
                self.text.extend_from_slice(&chunk[..length]);
            } else {
                self.too_long = true;
            }
            any = true;
            self.after_return = end.is_some_and(|end| chunk[end] == b'\r');
            self.source.consume(length + usize::from(end.is_some()));
            if end.is_some() {
                self.line_count += 1;
                return Ok(true);
            }
        }
    }

    /// Make the line safe to look at and say what was done.
    fn cure(&mut self, log: &mut WarningLog, file: &str, line: usize) {
        if self.too_long {
            self.text.clear();
            let message = "skipped a line of more than 64 MiB";
            log.note(WarningKind::LineSkipped, message, file, line);
        }
        if self.text.contains(&0) {
            for byte in &mut self.text {
                if *byte == 0 {
                    *byte = b' ';
                }
            }
            log.note(
                WarningKind::Encoding,
                "NUL bytes were read as spaces",
                file,
                line,
            );
        }
        if !self.text.is_ascii() && std::str::from_utf8(&self.text).is_err() {
            let message = "bytes that are not UTF-8 were replaced, so names may look odd";
            log.note(WarningKind::Encoding, message, file, line);
        }
    }
}

/// Text from bytes. Bytes that are not UTF-8 become one character each, so that different names stay different.
pub(super) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|&byte| char::from(byte)).collect()),
    }
}

/// The first word of a line and what follows, both trimmed.
pub(super) fn split_keyword(text: &[u8]) -> (&[u8], &[u8]) {
    let text = text.trim_ascii();
    let end = text
        .iter()
        .position(u8::is_ascii_whitespace)
        .unwrap_or(text.len());
    let (keyword, rest) = text.split_at(end);
    (keyword, rest.trim_ascii_start())
}

/// The words of a statement up to a comment.
pub(super) fn words(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    rest.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .take_while(|word| word[0] != b'#')
}

/// The names that the rest of a `usemtl`, `newmtl`, `mtllib` or texture statement may mean, from all of it to the
/// barest: as it stands, without Unicode spaces around it, and without a comment. None is empty unless all is.
///
/// Which of them is meant shows in what there is: a name may hold `#`, and end in a space that is not ASCII.
pub(super) fn spellings(text: &str) -> impl Iterator<Item = &str> {
    let trimmed = text.trim();
    let bare = without_comment(trimmed);
    let is_other = |name: &str, before: &str| !name.is_empty() && name != before;
    let trimmed_too = is_other(trimmed, text).then_some(trimmed);
    let bare_too = is_other(bare, trimmed).then_some(bare);
    [Some(text), trimmed_too, bare_too].into_iter().flatten()
}

/// A trimmed name up to the first `#` that follows a space.
fn without_comment(name: &str) -> &str {
    let mut after_space = true;
    let comment = name.char_indices().find(|&(_, character)| {
        let is_comment = after_space && character == '#';
        after_space = character.is_whitespace();
        is_comment
    });
    comment.map_or(name, |(start, _)| name[..start].trim_end())
}

/// The name of an object or a group, up to a `#` that stands alone. There is no definition to compare it with, and names
/// such as `Window #3` are common.
pub(super) fn label(text: &str) -> &str {
    let mut name = text.trim();
    if let Some(start) = name
        .match_indices('#')
        .map(|(start, _)| start)
        .find(|&start| {
            let is_space = |character: Option<char>| character.is_none_or(char::is_whitespace);
            is_space(name[..start].chars().next_back())
                && is_space(name[start + 1..].chars().next())
        })
    {
        name = name[..start].trim_end();
    }
    name
}

/// A word read as a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// A number that single precision can hold.
    Finite,
    /// NaN, an infinity, or outside single precision.
    NotFinite,
    /// A number but for a comma, as in `0,5`. It may be a decimal comma or stand between thousands or numbers.
    Comma,
    /// A number but for the exponent of Fortran, as in `5.0D-1`.
    FortranExponent,
    /// No number at all.
    Malformed,
}

impl Number {
    /// Look at one word.
    pub(super) fn of(word: &[u8]) -> Self {
        if is_plain_decimal(word) {
            return Self::Finite;
        }
        let parsed = std::str::from_utf8(word)
            .ok()
            .and_then(|text| text.parse::<f64>().ok());
        match parsed {
            Some(value) if value.abs() <= f64::from(f32::MAX) => Self::Finite,
            Some(_) => Self::NotFinite,
            None => Self::foreign(word),
        }
    }

    /// Look at a word that is not a number here.
    fn foreign(word: &[u8]) -> Self {
        let digits = word.iter().any(u8::is_ascii_digit);
        let all = |others: &[u8]| {
            let mut bytes = word.iter();
            digits && bytes.all(|byte| byte.is_ascii_digit() || others.contains(byte))
        };
        if word.contains(&b',') && all(b",.+-eE") {
            return Self::Comma;
        }
        let exponent = |byte: &u8| {
            if matches!(byte, b'd' | b'D') {
                b'e'
            } else {
                *byte
            }
        };
        let with_e: Vec<u8> = word.iter().map(exponent).collect();
        let is_number = |text: &str| text.parse::<f64>().is_ok();
        if all(b".+-dD") && std::str::from_utf8(&with_e).is_ok_and(is_number) {
            return Self::FortranExponent;
        }
        Self::Malformed
    }

    /// How numbers are written, where it is the notation that cannot be read, and what to do about it.
    pub(super) fn notation(self) -> Option<Notation> {
        match self {
            Self::Comma => Some(Notation {
                name: "a decimal comma",
                cure: "export with decimal points",
            }),
            Self::FortranExponent => Some(Notation {
                name: "a D exponent",
                cure: "export with E exponents",
            }),
            Self::Finite | Self::NotFinite | Self::Malformed => None,
        }
    }
}

/// A way to write numbers that is not that of OBJ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Notation {
    /// The notation, in words.
    pub(super) name: &'static str,
    /// The remedy, in words.
    pub(super) cure: &'static str,
}

/// Whether a word is digits with a sign and a point at most: nearly all numbers are, and this is quick to see.
fn is_plain_decimal(word: &[u8]) -> bool {
    let digits = word
        .strip_prefix(b"-")
        .or_else(|| word.strip_prefix(b"+"))
        .unwrap_or(word);
    let mut points = 0;
    let plain = digits.iter().all(|&byte| {
        points += usize::from(byte == b'.');
        byte.is_ascii_digit() || byte == b'.'
    });
    plain && points <= 1 && digits.len() > points && digits.len() <= 32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8]) -> Vec<(usize, String)> {
        let mut lines = LogicalLines::new(text);
        let mut log = WarningLog::default();
        let mut all = Vec::new();
        while let Some(line) = lines.advance(&mut log, "x").unwrap() {
            all.push((line, decode(&lines.text).into_owned()));
        }
        all
    }

    #[test]
    fn every_line_ending_counts_once() {
        let lines = read(b"a\r\nb\rc\n\nd");
        let expected = [(1, "a"), (2, "b"), (3, "c"), (4, ""), (5, "d")];
        assert_eq!(lines, expected.map(|(n, s)| (n, s.to_owned())));
    }

    #[test]
    fn continuations_are_joined_but_not_after_comments() {
        let lines = read(b"f 1 2 \\\r\n 3\n# C:\\dir\\\nv 1\\");
        assert_eq!(lines[0], (1, "f 1 2   3".to_owned()));
        assert_eq!(lines[1], (3, "# C:\\dir\\".to_owned()));
        assert_eq!(lines[2], (4, "v 1 ".to_owned()));
    }

    #[test]
    fn backslash_inside_a_double_byte_character_does_not_join() {
        assert_eq!(read(b"o \x95\\\nv 1 2 3").len(), 2);
    }

    #[test]
    fn byte_order_mark_is_stripped() {
        assert_eq!(read(b"\xef\xbb\xbfv 1 2 3"), [(1, "v 1 2 3".to_owned())]);
    }

    #[test]
    fn names_that_are_not_utf8_stay_different() {
        assert_ne!(decode(b"\xb0\xd7"), decode(b"\xba\xda"));
    }

    #[test]
    fn a_name_may_be_meant_without_spaces_and_without_a_comment() {
        for (text, expected) in [
            ("lamp", &["lamp"][..]),
            ("lamp   # 60 W", &["lamp   # 60 W", "lamp"]),
            ("床　木　", &["床　木　", "床　木"]),
            (
                "ランプ\u{a0} # 60 W　",
                &["ランプ\u{a0} # 60 W　", "ランプ\u{a0} # 60 W", "ランプ"],
            ),
            ("lamp#2", &["lamp#2"]),
            ("# none", &["# none"]),
            ("\u{3000}", &["\u{3000}"]),
            ("", &[""]),
        ] {
            assert_eq!(spellings(text).collect::<Vec<_>>(), expected, "{text:?}");
        }
    }

    #[test]
    fn a_label_ends_at_a_hash_that_stands_alone() {
        for (text, expected) in [
            ("chair # oak", "chair"),
            ("chair #", "chair"),
            ("Window #3", "Window #3"),
            ("Desk#1 #2\u{3000}", "Desk#1 #2"),
            ("# none", ""),
        ] {
            assert_eq!(label(text), expected, "{text:?}");
        }
    }

    #[test]
    fn numbers_are_told_apart() {
        for (word, expected) in [
            ("1", Number::Finite),
            ("-.5e-3", Number::Finite),
            ("+3.", Number::Finite),
            ("nan", Number::NotFinite),
            ("-inf", Number::NotFinite),
            ("1e39", Number::NotFinite),
            ("1e999", Number::NotFinite),
            ("1.#QNAN", Number::Malformed),
            (".", Number::Malformed),
            ("-", Number::Malformed),
            ("1,5", Number::Comma),
            ("-1.234,5e3", Number::Comma),
            ("1,", Number::Comma),
            (",", Number::Malformed),
            ("a,5", Number::Malformed),
            ("1.0D+00", Number::FortranExponent),
            ("-5d-1", Number::FortranExponent),
            ("1dd2", Number::Malformed),
            ("d", Number::Malformed),
            ("1.2.3", Number::Malformed),
        ] {
            assert_eq!(Number::of(word.as_bytes()), expected, "{word}");
        }
    }
}
