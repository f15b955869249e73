//! Uniform resource identifiers as glTF files have them: data in base64, or names of files.

use percent_encoding::percent_decode_str;

/// What a URI names.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Resource {
    /// The data itself.
    Data(Vec<u8>),
    /// A file: its name decoded, and as it stands, where that is another.
    File(Vec<String>),
    /// Something on the network.
    Remote,
}

impl Resource {
    /// Read a URI.
    ///
    /// # Errors
    /// A clause with the reason.
    pub(super) fn of(uri: &str) -> Result<Self, &'static str> {
        let scheme = uri.split(':').next().filter(|scheme| *scheme != uri);
        match scheme.map(str::to_ascii_lowercase).as_deref() {
            Some("data") => data(&uri["data:".len()..]).map(Self::Data),
            // Of longer ones: a single letter is a drive.
            Some("http" | "https" | "ftp" | "ws" | "wss") => Ok(Self::Remote),
            _ => {
                let mut names = vec![decoded(uri)];
                if names[0] != uri {
                    names.push(uri.to_owned());
                }
                Ok(Self::File(names))
            }
        }
    }
}

/// What stands behind the scheme of a data URI: a type that nobody asks for, then the data.
fn data(text: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, body) = text.split_once(',').ok_or("is a data URI without data")?;
    match kind.rsplit(';').next() {
        Some(end) if end.trim().eq_ignore_ascii_case("base64") => {
            from_base64(body).ok_or("is not valid base64")
        }
        _ => Ok(decoded_bytes(body)),
    }
}

/// Bytes in base64, of either alphabet, with or without the padding, and white space left out.
fn from_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut count) = (0_u32, 0);
    let text = text.trim_end().trim_end_matches('=');
    for byte in text.bytes().filter(|byte| !byte.is_ascii_whitespace()) {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    // A single letter at the end holds no byte.
    (count < 6).then_some(bytes)
}

/// A name with `%20` and the like decoded.
fn decoded(text: &str) -> String {
    String::from_utf8(decoded_bytes(text)).unwrap_or_else(|_| text.to_owned())
}

fn decoded_bytes(text: &str) -> Vec<u8> {
    percent_decode_str(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_read_in_every_dress() {
        for (text, expected) in [
            ("", Some(&b""[..])),
            ("aGk=", Some(b"hi")),
            ("aGk", Some(b"hi")),
            ("aG kK\n", Some(b"hi\n")),
            ("+/8=", Some(b"\xfb\xff")),
            ("-_8", Some(b"\xfb\xff")),
            ("a", None),
            ("a*Gk", None),
        ] {
            assert_eq!(from_base64(text).as_deref(), expected, "{text}");
        }
    }

    #[test]
    fn uris_are_data_files_or_remote() {
        let data = |bytes: &[u8]| Ok(Resource::Data(bytes.to_vec()));
        let file = |names: &[&str]| {
            Ok(Resource::File(
                names.iter().map(|name| (*name).to_owned()).collect(),
            ))
        };
        for (uri, expected) in [
            ("data:application/octet-stream;base64,aGk=", data(b"hi")),
            ("DATA:;base64,aGk=", data(b"hi")),
            ("data:,h%69", data(b"hi")),
            ("data:base64", Err("is a data URI without data")),
            ("data:;base64,?", Err("is not valid base64")),
            ("a%20b.bin", file(&["a b.bin", "a%20b.bin"])),
            ("100%.bin", file(&["100%.bin"])),
            ("%ff.bin", file(&["%ff.bin"])),
            ("..%2Fa.bin", file(&["../a.bin", "..%2Fa.bin"])),
            ("C:\\maps\\a.png", file(&["C:\\maps\\a.png"])),
            ("https://example.com/a.bin", Ok(Resource::Remote)),
            ("", file(&[""])),
            ("é%", file(&["é%"])),
        ] {
            assert_eq!(Resource::of(uri), expected, "{uri}");
        }
    }
}
