//! Scenes in ZIP archives: unpacked to a folder for temporary files, within bounds, and read from there.
//!
//! Of the format (PKWARE's APPNOTE 6.3) what programs write is known: the list at the end of the archive, and files that are
//! stored or deflated. Names never lead out of the folder, and what a file unpacks to is counted as it comes.

use std::fs::{self, File};
use std::io::{self, Read, Write as _};
use std::path::{Path, PathBuf};

use flate2::Crc;
use flate2::read::DeflateDecoder;
use tempfile::TempDir;

use super::listed::{MOST_LISTED, listed, shortened};
use super::read_error::ReadError;

/// Bytes of an archive and of all that is in it at most, each. Scenes with pictures take some hundred million.
const MAX_BYTES: u64 = 2 << 30;

/// Files in an archive at most.
const MAX_FILES: usize = 1 << 14;

/// Folders above a file at most, and the file: each is made, for each file.
const DEEPEST: usize = 32;

/// Beginnings of the list's end, of an entry of the list, and of a file.
const END: &[u8] = b"PK\x05\x06";
const ENTRY: &[u8] = b"PK\x01\x02";
const FILE: &[u8] = b"PK\x03\x04";

/// Bytes of these without names and the like.
const END_BYTES: usize = 22;
const ENTRY_BYTES: usize = 46;
const FILE_BYTES: usize = 30;

/// Whether a file that begins like this is an archive.
pub(super) fn is_archive(head: &[u8]) -> bool {
    head.starts_with(FILE) || head.starts_with(END)
}

/// An archive that was unpacked; its files go with it.
#[derive(Debug)]
pub(super) struct Unpacked {
    folder: TempDir,
    scene: PathBuf,
}

impl Unpacked {
    /// The only scene in it.
    pub(super) fn scene(&self) -> PathBuf {
        self.folder.path().join(&self.scene)
    }
}

/// Unpack an archive. `is_scene` tells the endings of scenes.
///
/// # Errors
/// Where it does not hold one scene, or cannot be unpacked.
pub(super) fn unpack(
    path: &Path,
    archive: impl Read,
    is_scene: impl Fn(&str) -> bool,
) -> Result<Unpacked, ReadError> {
    let refused = |reason: String| ReadError::Refused {
        reason,
        path: path.to_owned(),
    };
    let mut bytes = Vec::new();
    archive
        .take(MAX_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| ReadError::Unreadable {
            reason: error.to_string(),
            path: path.to_owned(),
        })?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(refused(too_large()));
    }
    let entries = entries(&bytes).map_err(refused)?;
    let scene = only_scene(&entries, is_scene).map_err(refused)?;
    let folder = tempfile::tempdir().map_err(|error| {
        refused(format!(
            "the archive cannot be unpacked ({error}); make room for temporary files"
        ))
    })?;
    let mut budget = MAX_BYTES;
    for entry in &entries {
        entry
            .unpack(&bytes, folder.path(), &mut budget)
            .map_err(refused)?;
    }
    Ok(Unpacked { folder, scene })
}

fn too_large() -> String {
    format!(
        "the archive, or what is in it, has more than {} MiB; unpack it and open the scene in it",
        MAX_BYTES >> 20
    )
}

fn damaged() -> String {
    "the archive is damaged or has a form that is not known; pack it again, or unpack it and open the scene in it".to_owned()
}

/// A file in an archive.
#[derive(Debug)]
struct Entry {
    /// Below the folder.
    path: PathBuf,
    is_encrypted: bool,
    /// 0 where it is stored, 8 where it is deflated.
    method: u16,
    checksum: u32,
    packed: usize,
    /// Of its own header.
    offset: usize,
}

/// The numbers of two and of four bytes at a place.
fn short(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn long(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// The files that the list names, without those whose names lead elsewhere.
fn entries(bytes: &[u8]) -> Result<Vec<Entry>, String> {
    // Behind the end there may be a comment of up to 64 KiB.
    let tail = bytes
        .len()
        .saturating_sub(END_BYTES + usize::from(u16::MAX));
    let end = bytes[tail..]
        .windows(END.len())
        .rposition(|window| window == END)
        .ok_or_else(damaged)?;
    let end = &bytes[tail + end..];
    let count = short(end, 10).ok_or_else(damaged)?;
    let start = long(end, 16).ok_or_else(damaged)? as usize;
    if usize::from(count) > MAX_FILES {
        return Err(format!(
            "the archive has {count} files, and at most {MAX_FILES} are read; unpack it and open the scene in it"
        ));
    }
    let mut rest = bytes.get(start..).ok_or_else(damaged)?;
    let mut entries = Vec::new();
    for _ in 0..count {
        let (entry, length) = entry(rest).ok_or_else(damaged)?;
        entries.extend(entry);
        rest = rest.get(length..).ok_or_else(damaged)?;
    }
    Ok(entries)
}

/// The entry at the beginning, if it is a file to be unpacked, and its length in the list.
fn entry(bytes: &[u8]) -> Option<(Option<Entry>, usize)> {
    if !bytes.starts_with(ENTRY) {
        return None;
    }
    let [name, extra, comment] = [28, 30, 32].map(|at| short(bytes, at).map(usize::from));
    let name_end = ENTRY_BYTES + name?;
    let name = bytes.get(ENTRY_BYTES..name_end)?;
    let path = path_of(&String::from_utf8_lossy(name));
    let entry = path.map(|path| {
        Some(Entry {
            path,
            is_encrypted: short(bytes, 8)? & 1 == 1,
            method: short(bytes, 10)?,
            checksum: long(bytes, 16)?,
            packed: long(bytes, 20)? as usize,
            offset: long(bytes, 42)? as usize,
        })
    });
    let entry = match entry {
        Some(entry) => Some(entry?),
        None => None,
    };
    Some((entry, name_end + extra? + comment?))
}

/// A path below the folder of what is unpacked; nothing for folders, for names that lead elsewhere, and for what some systems
/// add beside files.
fn path_of(name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let parts = || name.split('/').filter(|part| *part != ".");
    let is_odd = |part: &str| matches!(part, "" | ".." | "__MACOSX") || part.contains([':', '\0']);
    let is_usable = parts().count() <= DEEPEST && !parts().any(is_odd);
    is_usable.then(|| parts().collect())
}

/// The path of the only scene.
fn only_scene(entries: &[Entry], is_scene: impl Fn(&str) -> bool) -> Result<PathBuf, String> {
    let ends_so = |entry: &&Entry| {
        let ending = entry.path.extension().and_then(|ending| ending.to_str());
        ending.is_some_and(&is_scene)
    };
    let scenes: Vec<&Entry> = entries.iter().filter(ends_so).collect();
    match scenes[..] {
        [only] => Ok(only.path.clone()),
        [] => Err("there is no OBJ or glTF file in the archive; pack one with the files that belong to it".to_owned()),
        _ => {
            let names: Vec<String> = scenes
                .iter()
                .map(|scene| shortened(&scene.path.to_string_lossy()).replace(char::is_control, "\u{fffd}"))
                .collect();
            let names = listed(names.iter().map(String::as_str), MOST_LISTED);
            Err(format!(
                "there are several scenes in the archive: {names}; unpack it and open one of them"
            ))
        }
    }
}

impl Entry {
    /// Write the file into a folder.
    fn unpack(&self, archive: &[u8], folder: &Path, budget: &mut u64) -> Result<(), String> {
        if self.is_encrypted {
            return Err("the archive is encrypted; unpack it and open the scene in it".to_owned());
        }
        let packed = self.packed(archive).ok_or_else(damaged)?;
        let path = folder.join(&self.path);
        let written = fs::create_dir_all(path.parent().unwrap_or(folder))
            .and_then(|()| File::create_new(&path))
            .and_then(|file| match self.method {
                0 => copy(packed, file, *budget),
                8 => copy(DeflateDecoder::new(packed), file, *budget),
                _ => Err(io::ErrorKind::Unsupported.into()),
            });
        let (length, checksum) = written.map_err(|error| match error.kind() {
            io::ErrorKind::StorageFull => {
                format!("the archive cannot be unpacked ({error}); make room for temporary files")
            }
            _ => damaged(),
        })?;
        *budget = budget.checked_sub(length).ok_or_else(too_large)?;
        match checksum == self.checksum {
            true => Ok(()),
            false => Err(damaged()),
        }
    }

    /// Its bytes in the archive.
    fn packed<'a>(&self, archive: &'a [u8]) -> Option<&'a [u8]> {
        let header = archive.get(self.offset..)?;
        if !header.starts_with(FILE) {
            return None;
        }
        let [name, extra] = [26, 28].map(|at| short(header, at).map(usize::from));
        let start = FILE_BYTES + name? + extra?;
        header.get(start..start.checked_add(self.packed)?)
    }
}

/// Copy until one byte more than the budget; returns length and checksum.
fn copy(source: impl Read, mut file: File, budget: u64) -> io::Result<(u64, u32)> {
    let mut source = source.take(budget + 1);
    let mut sum = Crc::new();
    let mut block = vec![0; 1 << 16];
    let mut length = 0;
    loop {
        let count = source.read(&mut block)?;
        if count == 0 {
            return Ok((length, sum.sum()));
        }
        sum.update(&block[..count]);
        file.write_all(&block[..count])?;
        length += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use flate2::{Compression, write::DeflateEncoder};

    use super::*;

    #[test]
    fn what_unpacks_is_counted_and_checked() {
        let content = vec![7; 100_000];
        let mut encoder = DeflateEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&content).unwrap();
        let packed = encoder.finish().unwrap();
        let mut sum = Crc::new();
        sum.update(&content);
        let mut archive = vec![0; FILE_BYTES];
        archive[..FILE.len()].copy_from_slice(FILE);
        archive.extend(&packed);
        let entry = |checksum: u32| Entry {
            path: PathBuf::from("maps/a.bin"),
            is_encrypted: false,
            method: 8,
            checksum,
            packed: packed.len(),
            offset: 0,
        };
        for (checksum, mut budget, expected) in [
            (sum.sum(), 100_000, Ok(())),
            (sum.sum(), 99_999, Err(too_large())),
            (sum.sum() ^ 1, 100_000, Err(damaged())),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let unpacked = entry(checksum).unpack(&archive, folder.path(), &mut budget);
            assert_eq!(unpacked, expected);
            let written = fs::read(folder.path().join("maps/a.bin")).unwrap();
            assert!(written.len() <= 100_000 && content.starts_with(&written));
        }
    }

    #[test]
    fn names_stay_below_the_folder() {
        for (name, expected) in [
            ("a.obj", Some("a.obj")),
            ("./maps/a b.png", Some("maps/a b.png")),
            ("maps\\a.png", Some("maps/a.png")),
            ("maps/", None),
            ("../a.obj", None),
            ("a/../../b", None),
            ("/etc/passwd", None),
            ("\\\\server\\a", None),
            ("C:/a", None),
            ("__MACOSX/a.obj", None),
            ("", None),
        ] {
            assert_eq!(path_of(name), expected.map(PathBuf::from), "{name}");
        }
        assert_eq!(path_of("a/".repeat(40).trim_end_matches('/')), None);
    }
}
