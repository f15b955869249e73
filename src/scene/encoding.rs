//! Text in UTF-16, as editors and shells of Windows write it, on its way to UTF-8.
//!
//! Everything else passes as it is: bytes of other encodings are a matter of single lines (see [`super::lines`]).

use std::io::{BufRead, Read, Result};

/// How the characters of a file are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Encoding {
    /// A byte or several for each character, ASCII among them.
    Bytes,
    /// Two bytes for each UTF-16 unit, the less significant first.
    Utf16Little,
    /// Two bytes for each UTF-16 unit, the more significant first.
    Utf16Big,
}

impl Encoding {
    /// The encoding of a file that begins like this: by its byte-order mark, or by ASCII characters of two bytes.
    fn of(head: &[u8]) -> Self {
        match head {
            // This would be UTF-32.
            [0xff, 0xfe, 0, 0, ..] => Self::Bytes,
            [0xff, 0xfe, ..] => Self::Utf16Little,
            [0xfe, 0xff, ..] => Self::Utf16Big,
            [first, 0, second, 0, ..] if *first != 0 && *second != 0 => Self::Utf16Little,
            [0, first, 0, second, ..] if *first != 0 && *second != 0 => Self::Utf16Big,
            _ => Self::Bytes,
        }
    }
}

/// A file whose UTF-16 is read as UTF-8. Halves of characters become U+FFFD.
#[derive(Debug)]
pub(super) struct DecodedText<R> {
    source: R,
    /// Known once the beginning was looked at.
    encoding: Option<Encoding>,
    /// UTF-8 of the last part of the file.
    text: Vec<u8>,
    /// Bytes of [`Self::text`] that were consumed.
    position: usize,
    /// The first byte of a unit that is cut by the end of a part.
    half_unit: Option<u8>,
    /// The first unit of a character of two units.
    high_surrogate: Option<u16>,
}

impl<R: BufRead> DecodedText<R> {
    /// Start at the beginning of a file.
    pub(super) fn new(source: R) -> Self {
        Self {
            source,
            encoding: None,
            text: Vec::new(),
            position: 0,
            half_unit: None,
            high_surrogate: None,
        }
    }

    /// Whether the file is UTF-16; false before anything was read.
    pub(super) fn is_utf16(&self) -> bool {
        self.encoding
            .is_some_and(|encoding| encoding != Encoding::Bytes)
    }

    /// Decode the next part of the source; the text stays empty at its end.
    fn decode_part(&mut self, is_big: bool) -> Result<()> {
        self.text.clear();
        self.position = 0;
        while self.text.is_empty() {
            let part = self.source.fill_buf()?;
            let length = part.len();
            if length == 0 {
                let is_cut = self.half_unit.take().is_some() | self.high_surrogate.take().is_some();
                if is_cut {
                    push(&mut self.text, char::REPLACEMENT_CHARACTER);
                }
                return Ok(());
            }
            for &byte in part {
                let Some(first) = self.half_unit.take() else {
                    self.half_unit = Some(byte);
                    continue;
                };
                let unit = if is_big {
                    u16::from_be_bytes([first, byte])
                } else {
                    u16::from_le_bytes([first, byte])
                };
                decode_unit(unit, &mut self.high_surrogate, &mut self.text);
            }
            self.source.consume(length);
        }
        Ok(())
    }
}

/// Append the character that a unit completes, if it does.
fn decode_unit(unit: u16, high_surrogate: &mut Option<u16>, text: &mut Vec<u8>) {
    if let Some(first) = high_surrogate.take() {
        if let Some(Ok(character)) = char::decode_utf16([first, unit]).next() {
            return push(text, character);
        }
        push(text, char::REPLACEMENT_CHARACTER);
    }
    if (0xd800..0xdc00).contains(&unit) {
        *high_surrogate = Some(unit);
    } else {
        let character = char::from_u32(u32::from(unit));
        push(text, character.unwrap_or(char::REPLACEMENT_CHARACTER));
    }
}

fn push(text: &mut Vec<u8>, character: char) {
    text.extend_from_slice(character.encode_utf8(&mut [0; 4]).as_bytes());
}

impl<R: BufRead> Read for DecodedText<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for DecodedText<R> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        let encoding = match self.encoding {
            Some(encoding) => encoding,
            None => *self.encoding.insert(Encoding::of(self.source.fill_buf()?)),
        };
        if encoding == Encoding::Bytes {
            return self.source.fill_buf();
        }
        if self.position >= self.text.len() {
            self.decode_part(encoding == Encoding::Utf16Big)?;
        }
        Ok(&self.text[self.position..])
    }

    fn consume(&mut self, count: usize) {
        match self.encoding {
            Some(Encoding::Utf16Little | Encoding::Utf16Big) => self.position += count,
            _ => self.source.consume(count),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::BufReader;

    use super::*;

    fn decoded(bytes: &[u8], capacity: usize) -> String {
        let mut reader = DecodedText::new(BufReader::with_capacity(capacity, bytes));
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        text
    }

    fn utf16(text: &str, bytes_of: impl Fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(bytes_of).collect()
    }

    #[test]
    fn both_orders_are_decoded_wherever_parts_end() {
        let text = "\u{feff}v 1 2 3\r\nusemtl 床\u{1f600}\n";
        for capacity in [4, 5, 7, 4096] {
            assert_eq!(decoded(&utf16(text, u16::to_le_bytes), capacity), text);
            assert_eq!(decoded(&utf16(text, u16::to_be_bytes), capacity), text);
            let unmarked = &text['\u{feff}'.len_utf8()..];
            assert_eq!(
                decoded(&utf16(unmarked, u16::to_le_bytes), capacity),
                unmarked
            );
            assert_eq!(decoded(text.as_bytes(), capacity), text);
        }
    }

    #[test]
    fn halves_of_characters_are_replaced() {
        let mut bytes = utf16("\u{feff}a", u16::to_le_bytes);
        for unit in [0xd800_u16, u16::from(b'b'), 0xdc00, 0xd801, 0xd802] {
            bytes.extend(unit.to_le_bytes());
        }
        bytes.push(b'c');
        let replaced = "\u{feff}a\u{fffd}b\u{fffd}\u{fffd}\u{fffd}";
        assert_eq!(decoded(&bytes, 4096), replaced);
    }

    #[test]
    fn other_bytes_pass_as_they_are() {
        let bytes = b"o \xb0\xd7\n\0\0v 1 2 3";
        let mut reader = DecodedText::new(&bytes[..]);
        let mut read = Vec::new();
        reader.read_to_end(&mut read).unwrap();
        assert_eq!(read, bytes);
        assert!(!reader.is_utf16());
    }
}
