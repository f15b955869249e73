//! Opening the file of a scene: only a file, only as long as it is now, and watched for change while it is read.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Take};
use std::path::Path;
use std::time::SystemTime;

use super::encoding::DecodedText;
use super::lines::split_keyword;
use super::read_error::ReadError;

/// Length and time of change, by which a change is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stamp {
    length: u64,
    changed: Option<SystemTime>,
}

impl Stamp {
    fn of(file: &File) -> std::io::Result<Self> {
        let metadata = file.metadata()?;
        Ok(Self {
            length: metadata.len(),
            changed: metadata.modified().ok(),
        })
    }
}

/// Detects whether a file has changed since it was opened.
#[derive(Debug)]
pub(super) struct Watch {
    file: File,
    before: Stamp,
}

impl Watch {
    /// Bytes that the file had when it was opened.
    pub(super) fn length(&self) -> u64 {
        self.before.length
    }

    /// Whether it has another length or time of change, or cannot be asked.
    pub(super) fn has_changed(&self) -> bool {
        Stamp::of(&self.file).map_or(true, |now| now != self.before)
    }
}

/// What is said of a file that has changed meanwhile.
pub(super) const CHANGED: &str =
    "the file changed while it was read; open it again once it is whole";

/// Open the file. One that grows is read up to its present end.
pub(super) fn open(path: &Path) -> Result<(BufReader<Take<File>>, Watch), ReadError> {
    let path_buf = || path.to_owned();
    let unreadable = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => ReadError::NotFound { path: path_buf() },
        std::io::ErrorKind::IsADirectory => ReadError::Folder { path: path_buf() },
        _ => ReadError::Unreadable {
            reason: error.to_string(),
            path: path_buf(),
        },
    };
    // Asked before it is opened: opening a pipe waits for somebody to write.
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if metadata.is_dir() {
        return Err(ReadError::Folder { path: path_buf() });
    }
    if !metadata.is_file() {
        return Err(ReadError::NotFile { path: path_buf() });
    }
    let file = File::open(path).map_err(unreadable)?;
    let watch = Watch {
        before: Stamp::of(&file).map_err(unreadable)?,
        file: file.try_clone().map_err(unreadable)?,
    };
    let source = file.take(watch.before.length);
    let mut reader = BufReader::with_capacity(256 << 10, source);
    let head = reader.fill_buf().map_err(unreadable)?;
    if head.is_empty() {
        return Err(ReadError::Empty { path: path_buf() });
    }
    Ok((reader, watch))
}

/// Whether a file that begins like this is no OBJ text.
///
/// # Errors
/// Those of the decoder.
pub(super) fn is_binary(head: &[u8]) -> std::io::Result<bool> {
    let mut text = Vec::with_capacity(head.len());
    DecodedText::new(head).read_to_end(&mut text)?;
    Ok(looks_binary(&text))
}

/// Whether the beginning of a file holds no OBJ statement but bytes that text does not have.
fn looks_binary(head: &[u8]) -> bool {
    let control = |byte: &u8| *byte < 32 && !byte.is_ascii_whitespace();
    let statement = |line: &[u8]| {
        let (keyword, rest) = split_keyword(line);
        let known: [&[u8]; 7] = [b"v", b"f", b"o", b"g", b"vn", b"vt", b"mtllib"];
        known.contains(&keyword) && !rest.is_empty()
    };
    head.iter().any(control)
        && !head
            .split(|&byte| byte == b'\n' || byte == b'\r')
            .any(statement)
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn a_file_that_grows_is_read_to_its_old_end_and_known_to_have_changed() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"v 0 0 0\n").unwrap();
        let (mut reader, watch) = open(file.path()).unwrap();
        assert!(!watch.has_changed());
        file.write_all(b"v 1 0 0\n").unwrap();
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        assert_eq!(text, "v 0 0 0\n");
        assert!(watch.has_changed());
    }

    #[test]
    fn a_file_that_is_cut_is_known_to_have_changed() {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(b"v 0 0 0\n").unwrap();
        let (_reader, watch) = open(file.path()).unwrap();
        file.as_file().set_len(0).unwrap();
        assert!(watch.has_changed());
    }
}
