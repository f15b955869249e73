//! From the bytes of a glTF file to its JSON and its binary chunk: text, or the container GLB.

use super::document::Document;

/// Objects of the JSON at most: each takes some hundred bytes once it is read, so that without a limit a text of commas
/// and braces would fill the memory. A scene of 300,000 meshes has four million.
const MAX_OBJECTS: usize = 1 << 22;

/// Bytes of the JSON at most. Whole scenes in data URIs are smaller.
const MAX_TEXT: usize = 1 << 29;

/// The numbers that the specification gives to the kinds of chunks: `JSON` and `BIN`.
const JSON: u32 = 0x4e4f_534a;
const BIN: u32 = 0x004e_4942;

/// Whether a file that begins like this is glTF: a GLB, or JSON, which no OBJ file begins like.
pub(in crate::scene) fn is_gltf(head: &[u8]) -> bool {
    if head.starts_with(b"glTF") {
        return true;
    }
    let mut marks = without_mark(head)
        .iter()
        .filter(|byte| !byte.is_ascii_whitespace());
    marks.next() == Some(&b'{') && matches!(marks.next(), Some(b'"' | b'}') | None)
}

/// The two parts of a file.
#[derive(Debug)]
pub(super) struct Parts<'a> {
    pub(super) document: Document,
    /// The buffer that the file holds beside its text.
    pub(super) chunk: Option<&'a [u8]>,
}

/// Take a file apart and read its JSON.
///
/// # Errors
/// The problem and the remedy.
pub(super) fn parse(bytes: &[u8]) -> Result<Parts<'_>, String> {
    let (text, chunk) = match bytes.starts_with(b"glTF") {
        true => split(bytes)?,
        false => (bytes, None),
    };
    let text = without_mark(text);
    if text.len() > MAX_TEXT || object_count(text) > MAX_OBJECTS {
        return Err(format!(
            "the JSON of the glTF file has more than {} MiB or {MAX_OBJECTS} objects; split the scene",
            MAX_TEXT >> 20
        ));
    }
    let document: Document = serde_json::from_slice(text).map_err(|error| {
        format!("the JSON of the glTF file cannot be read ({error}); export the scene again")
    })?;
    check_version(&document)?;
    Ok(Parts { document, chunk })
}

/// The JSON and the binary chunk of a GLB; chunks of other kinds are passed over.
fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let cut = || "the GLB file ends early; copy or export it again".to_owned();
    let (header, _) = bytes.split_at_checked(12).ok_or_else(cut)?;
    let [version, length] = [4, 8].map(|at| number(&header[at..]));
    if version != 2 {
        return Err(format!(
            "this is glTF {version}, and only 2.0 is read; export the scene as glTF 2.0"
        ));
    }
    // Bytes behind the length are none of the file.
    let mut rest = bytes.get(12..length as usize).ok_or_else(cut)?;
    let (mut text, mut binary) = (None, None);
    while !rest.is_empty() {
        let (header, behind) = rest.split_at_checked(8).ok_or_else(cut)?;
        let [length, kind] = [0, 4].map(|at| number(&header[at..]));
        let (chunk, behind) = behind.split_at_checked(length as usize).ok_or_else(cut)?;
        match kind {
            JSON if text.is_none() => text = Some(chunk),
            BIN if binary.is_none() => binary = Some(chunk),
            _ => {}
        }
        rest = behind;
    }
    let text = text.ok_or("the GLB file has no JSON; export it again")?;
    Ok((text, binary))
}

/// The first four bytes as a number.
fn number(bytes: &[u8]) -> u32 {
    bytes
        .first_chunk()
        .map_or(0, |four| u32::from_le_bytes(*four))
}

/// Without a byte-order mark.
fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Braces that open outside of strings.
fn object_count(text: &[u8]) -> usize {
    let (mut count, mut is_string, mut is_escaped) = (0, false, false);
    for &byte in text {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' if is_string => is_escaped = true,
            b'"' => is_string = !is_string,
            b'{' if !is_string => count += 1,
            _ => {}
        }
    }
    count
}

/// Refuse what is no glTF, and other versions of it.
fn check_version(document: &Document) -> Result<(), String> {
    let asset = &document.asset;
    if asset.version.is_empty() {
        return Err(
            "this JSON is not glTF, as it names no version; open a glTF or OBJ file".to_owned(),
        );
    }
    let least = asset.min_version.as_ref().unwrap_or(&asset.version);
    let is_known =
        asset.version.starts_with("2.") && (least == "2.0" || asset.min_version.is_none());
    if !is_known {
        let version = super::printable(least);
        return Err(format!(
            "this is glTF {version}, and only 2.0 is read; export the scene as glTF 2.0"
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"{"asset":{"version":"2.0"}}"#;

    fn glb(chunks: &[(u32, &[u8])]) -> Vec<u8> {
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, chunk) in chunks {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(*chunk);
        }
        let length = bytes.len() as u32;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        bytes
    }

    #[test]
    fn glb_and_json_are_told_from_obj() {
        for head in [&b"glTF"[..], b" {\n \"asset\"", b"\xef\xbb\xbf{}", b"{"] {
            assert!(is_gltf(head), "{head:?}");
        }
        for head in [&b"v 0 0 0"[..], b"", b"# {\"asset\"", b"glT", b"{ v 0 0 0"] {
            assert!(!is_gltf(head), "{head:?}");
        }
    }

    #[test]
    fn chunks_are_found_in_any_order() {
        let bytes = glb(&[
            (7, b"other"),
            (JSON, TEXT.as_bytes()),
            (BIN, b"12"),
            (BIN, b""),
        ]);
        let parts = parse(&bytes).unwrap();
        assert_eq!(parts.chunk, Some(&b"12"[..]));
        let mut longer = bytes.clone();
        longer.extend(b"behind");
        assert!(parse(&longer).is_ok());
        assert!(parse(TEXT.as_bytes()).unwrap().chunk.is_none());
    }

    #[test]
    fn every_cut_is_noticed() {
        let bytes = glb(&[(JSON, TEXT.as_bytes()), (BIN, b"1234")]);
        for length in 4..bytes.len() {
            let error = parse(&bytes[..length]).unwrap_err();
            assert!(error.contains("ends early"), "{length}: {error}");
        }
    }

    #[test]
    fn other_versions_and_other_json_are_refused() {
        for (text, said) in [
            ("{}", "names no version"),
            (r#"{"asset":{"version":"1.0"}}"#, "this is glTF 1.0"),
            (
                r#"{"asset":{"version":"2.1","minVersion":"2.1"}}"#,
                "this is glTF 2.1",
            ),
            (r#"{"asset":{"version":"2.0"}"#, "cannot be read"),
            (
                r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":-1}]}"#,
                "cannot be read",
            ),
        ] {
            let error = parse(text.as_bytes()).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        assert!(parse(br#"{"asset":{"version":"2.1","minVersion":"2.0"}}"#).is_ok());
    }

    #[test]
    fn objects_are_counted_outside_of_strings() {
        assert_eq!(object_count(br#"{"a{\"{":[{},{}],"\\":{}}"#), 4);
        let many = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{}{{}}]}}"#,
            "{},".repeat(MAX_OBJECTS)
        );
        assert!(
            parse(many.as_bytes())
                .unwrap_err()
                .contains("split the scene")
        );
    }
}
