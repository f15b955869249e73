//! Chinese, Japanese and Korean text by a font of the system, looked for when the first such character is shown.
//!
//! The window's own fonts have none of these characters, and carrying one would double the size of the program. A window
//! without such text never looks.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use eframe::egui::{
    FallbackRequest, FontData, FontFamily, FontInsert, FontPriority, FontProvider, InsertFontFamily,
};

/// Fonts that cover the three scripts, or most of them, and the face to take; the best first.
const FONTS: [(&str, u32); 14] = [
    ("NotoSansCJK-Regular.ttc", 2),
    ("NotoSansCJKsc-Regular.otf", 0),
    ("SourceHanSansSC-Regular.otf", 0),
    ("NotoSansSC-Regular.otf", 0),
    ("wqy-microhei.ttc", 0),
    ("wqy-zenhei.ttc", 0),
    ("DroidSansFallbackFull.ttf", 0),
    ("DroidSansFallback.ttf", 0),
    ("PingFang.ttc", 0),
    ("Hiragino Sans GB.ttc", 0),
    ("Arial Unicode.ttf", 0),
    ("msyh.ttc", 0),
    ("msyh.ttf", 0),
    ("simsun.ttc", 0),
];

/// Folders below folders that are looked into.
const MOST_DEPTH: u32 = 4;

/// Finds a font for characters that the window's own fonts lack.
#[derive(Default)]
pub struct SystemFonts {
    /// Families that were answered; the same font twice would not help.
    answered: Mutex<HashSet<FontFamily>>,
}

impl FontProvider for SystemFonts {
    fn font_for(&self, request: &FallbackRequest<'_>) -> Option<FontInsert> {
        request
            .cluster
            .chars()
            .next()
            .filter(|c| is_east_asian(*c))?;
        let is_first = self
            .answered
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(request.family.clone());
        if !is_first {
            return None;
        }
        let (path, face) = best_font(&font_folders())?;
        let family = InsertFontFamily {
            family: request.family.clone(),
            priority: FontPriority::Lowest,
        };
        let mut data = FontData::from_owned(fs::read(path).ok()?);
        data.index = face;
        Some(FontInsert::new("system", data, vec![family]))
    }
}

/// Whether a character is of one of the three scripts or their punctuation.
fn is_east_asian(c: char) -> bool {
    matches!(
        u32::from(c),
        0x1100..=0x11ff | 0x2e80..=0xa4cf | 0xac00..=0xd7ff | 0xf900..=0xfaff | 0xfe30..=0xfe4f
            | 0xff00..=0xffef | 0x2_0000..=0x3_ffff
    )
}

/// Where systems keep fonts.
fn font_folders() -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = [
        "/usr/share/fonts",
        "/usr/local/share/fonts",
        "/System/Library/Fonts",
        "/Library/Fonts",
    ]
    .map(PathBuf::from)
    .to_vec();
    if let Some(windows) = std::env::var_os("WINDIR") {
        folders.push(Path::new(&windows).join("Fonts"));
    }
    if let Some(user) = directories::UserDirs::new() {
        folders.extend(user.font_dir().map(Path::to_owned));
        folders.push(user.home_dir().join(".fonts"));
    }
    folders
}

/// The best of the known fonts below some folders, and its face.
fn best_font(folders: &[PathBuf]) -> Option<(PathBuf, u32)> {
    let mut found = Vec::new();
    for folder in folders {
        collect(folder, MOST_DEPTH, &mut found);
    }
    let (_, path, face) = found.into_iter().min_by_key(|(rank, ..)| *rank)?;
    Some((path, face))
}

/// Known fonts below a folder, with their rank.
fn collect(folder: &Path, depth: u32, found: &mut Vec<(usize, PathBuf, u32)>) {
    // A folder that is not there, or not ours to read, holds nothing.
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() && depth > 0 {
            collect(&path, depth - 1, found);
        } else if let Some(rank) = FONTS.iter().position(|(name, _)| path.ends_with(name)) {
            found.push((rank, path, FONTS[rank].1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_font_is_found_in_any_folder() {
        let folder = tempfile::tempdir().expect("a folder");
        let deep = folder.path().join("opentype/noto");
        fs::create_dir_all(&deep).expect("folders");
        let folders = [folder.path().to_owned(), PathBuf::from("/no/such/folder")];
        assert_eq!(best_font(&folders), None);
        fs::write(folder.path().join("wqy-zenhei.ttc"), "").expect("a file");
        fs::write(folder.path().join("Other.ttf"), "").expect("a file");
        assert_eq!(best_font(&folders).map(|(_, face)| face), Some(0));
        let best = deep.join("NotoSansCJK-Regular.ttc");
        fs::write(&best, "").expect("a file");
        assert_eq!(best_font(&folders), Some((best, 2)));
    }

    #[test]
    fn only_east_asian_text_looks_for_fonts() {
        assert!(
            "\u{623f}\u{9593}\u{304b}\u{d55c}"
                .chars()
                .all(is_east_asian)
        );
        assert!(!"room é Ж ½ ε".chars().any(is_east_asian));
    }
}
