//! Where the files are that an OBJ or MTL file names: never outside the folder of the OBJ file, not even by a symbolic
//! link, and never a pipe or a device.
//!
//! Names come from other machines: from systems that do not tell upper from lower case, that store accents apart from
//! their letters, or where the files lay in other folders. So what is not there as it is named is searched by the ends of
//! its path, in any letter case and Unicode form, and taken where only one file fits.

use std::collections::HashMap;
use std::ffi::OsString;
use std::fs;
use std::path::{Component, Path, PathBuf};

use unicode_normalization::UnicodeNormalization as _;

/// Why a file was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    /// It is not there.
    Absent,
    /// The name leads out of the scene's folder, and no file that fits it lies inside.
    Outside,
    /// Several files fit it.
    Ambiguous,
}

/// The files of a scene.
#[derive(Debug)]
pub(super) struct SceneFolder {
    root: PathBuf,
    /// The root without symbolic links, where it is known.
    followed_root: Option<PathBuf>,
    /// Folders that were searched, relative to the root.
    listings: HashMap<PathBuf, Listing>,
}

/// The entries of a folder, by names in one letter case and Unicode form.
type Listing = HashMap<String, Vec<OsString>>;

/// Bytes of a name at most: file systems allow no longer ones.
const LONGEST_NAME: usize = 4096;

impl SceneFolder {
    /// The folder of an OBJ file.
    pub(super) fn new(root: PathBuf) -> Self {
        Self {
            followed_root: root.canonicalize().ok(),
            root,
            listings: HashMap::new(),
        }
    }

    /// The path from here of a path relative to the root.
    pub(super) fn path_of(&self, path: &Path) -> PathBuf {
        self.root.join(path)
    }

    /// Find a file by the names that a statement of a file in `folder` (relative to the root) may mean; returns the number
    /// of the name and a path relative to the root.
    ///
    /// Every name is tried as it stands, beside the naming file and beside the OBJ file; then the files are searched that
    /// fit the longest end of its path. Symbolic links are followed where they stay inside.
    ///
    /// # Errors
    /// Why the last name was not found.
    pub(super) fn locate(
        &mut self,
        folder: &Path,
        names: &[&str],
    ) -> Result<(usize, PathBuf), Missing> {
        let mut missing = Missing::Absent;
        for (number, name) in names.iter().enumerate() {
            match self.as_named(folder, name) {
                Ok(path) => return Ok((number, path)),
                Err(why) => missing = why,
            }
        }
        for (number, name) in names.iter().enumerate() {
            match self.by_end_of_path(folder, name) {
                Ok(path) => return Ok((number, path)),
                Err(Missing::Absent) => {}
                Err(why) => missing = why,
            }
        }
        Err(missing)
    }

    /// The file of exactly this name, or the same without the spaces and quotes around it or with `\` as `/`.
    fn as_named(&self, folder: &Path, name: &str) -> Result<PathBuf, Missing> {
        if name.len() > LONGEST_NAME {
            return Err(Missing::Absent);
        }
        let bare = unquoted(name);
        let slashed = bare.replace('\\', "/");
        let mut missing = Missing::Absent;
        for spelling in [name, bare, &slashed] {
            for start in [folder, Path::new("")] {
                match inside(start, Path::new(spelling)) {
                    Some(path) if self.is_file(&path) => match self.holds(&path) {
                        true => return Ok(path),
                        false => missing = Missing::Outside,
                    },
                    Some(_) => {}
                    None => missing = Missing::Outside,
                }
            }
        }
        // A drive letter is an ordinary folder name on other systems.
        if slashed.as_bytes().get(1) == Some(&b':') {
            missing = Missing::Outside;
        }
        Err(missing)
    }

    /// The one file that fits the longest end of a path that any file fits.
    fn by_end_of_path(&mut self, folder: &Path, name: &str) -> Result<PathBuf, Missing> {
        if name.len() > LONGEST_NAME {
            return Err(Missing::Absent);
        }
        let slashed = unquoted(name).replace('\\', "/");
        let parts = slashed.split('/');
        let parts: Vec<&str> = parts.filter(|part| !matches!(*part, "" | ".")).collect();
        for first in 0..parts.len() {
            for start in [folder, Path::new("")] {
                let fitting = self.fitting(start, &parts[first..]);
                if !fitting.is_empty() {
                    return closest(fitting).ok_or(Missing::Ambiguous);
                }
            }
        }
        Err(Missing::Absent)
    }

    /// All files below `start` whose paths are these parts but for letter case and Unicode form.
    fn fitting(&mut self, start: &Path, parts: &[&str]) -> Vec<Fitting> {
        let mut found = vec![Fitting {
            path: start.to_owned(),
            difference: Difference::None,
        }];
        for part in parts {
            let mut next = Vec::new();
            for Fitting { path, difference } in found {
                if *part == ".." {
                    if let Some(parent) = path.parent() {
                        let path = parent.to_owned();
                        next.push(Fitting { path, difference });
                    }
                    continue;
                }
                let same = self.listing(&path).get(&folded(part));
                next.extend(same.into_iter().flatten().map(|entry| Fitting {
                    path: path.join(entry),
                    difference: difference.max(Difference::between(part, &entry.to_string_lossy())),
                }));
            }
            found = next;
        }
        found.retain(|fitting| self.is_file(&fitting.path) && self.holds(&fitting.path));
        found
    }

    /// The entries of a folder inside the root.
    fn listing(&mut self, path: &Path) -> &Listing {
        if !self.listings.contains_key(path) {
            let listing = self.read_listing(path);
            self.listings.insert(path.to_owned(), listing);
        }
        &self.listings[path]
    }

    /// Nothing where it is no folder, lies outside or cannot be read.
    fn read_listing(&self, path: &Path) -> Listing {
        let mut listing = Listing::new();
        if !self.holds(path) {
            return listing;
        }
        let entries = fs::read_dir(self.path_of(path)).into_iter().flatten();
        for name in entries.flatten().map(|entry| entry.file_name()) {
            let key = folded(&name.to_string_lossy());
            listing.entry(key).or_default().push(name);
        }
        listing
    }

    fn is_file(&self, path: &Path) -> bool {
        self.path_of(path).is_file()
    }

    /// Whether a path is still below the root when all symbolic links are followed.
    fn holds(&self, path: &Path) -> bool {
        let followed = self.path_of(path).canonicalize();
        match (&self.followed_root, followed) {
            (Some(root), Ok(path)) => path.starts_with(root),
            _ => false,
        }
    }
}

/// A file or folder that a name may mean.
struct Fitting {
    path: PathBuf,
    difference: Difference,
}

/// How a name on disk differs from the one that is looked for, the least difference first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Difference {
    None,
    UnicodeForm,
    LetterCase,
}

impl Difference {
    fn between(one: &str, other: &str) -> Self {
        if one == other {
            Self::None
        } else if one.nfc().eq(other.nfc()) {
            Self::UnicodeForm
        } else {
            Self::LetterCase
        }
    }
}

/// The one that differs least, if it is one.
fn closest(fitting: Vec<Fitting>) -> Option<PathBuf> {
    let least = fitting.iter().map(|fitting| fitting.difference).min()?;
    let mut closest = fitting
        .into_iter()
        .filter(|fitting| fitting.difference == least);
    let first = closest.next()?;
    closest.next().is_none().then_some(first.path)
}

/// A name in one letter case and Unicode form. Upper case first: letters such as `ς` and `σ` share only that.
fn folded(name: &str) -> String {
    let cased = name
        .nfd()
        .flat_map(char::to_uppercase)
        .flat_map(char::to_lowercase);
    cased.nfc().collect()
}

fn unquoted(name: &str) -> &str {
    name.trim().trim_matches('"')
}

/// `start/name` without `.` and `..`, unless it leaves the root.
fn inside(start: &Path, name: &Path) -> Option<PathBuf> {
    let mut path = PathBuf::new();
    for component in start.components().chain(name.components()) {
        match component {
            Component::Normal(part) => path.push(part),
            Component::CurDir => {}
            Component::ParentDir => {
                if !path.pop() {
                    return None;
                }
            }
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene's folder with empty files, in a folder with `secret.png`.
    fn scene_with(files: &[&str]) -> (tempfile::TempDir, SceneFolder) {
        let outer = tempfile::tempdir().unwrap();
        fs::write(outer.path().join("secret.png"), "").unwrap();
        let root = outer.path().join("scene");
        fs::create_dir(&root).unwrap();
        for file in files {
            let path = root.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        (outer, SceneFolder::new(root))
    }

    fn find(folder: &mut SceneFolder, from: &str, name: &str) -> Result<PathBuf, Missing> {
        let found = folder.locate(Path::new(from), &[name]);
        found.map(|(_, path)| path)
    }

    #[test]
    fn files_are_found_inside_and_never_outside() {
        let (outer, mut folder) = scene_with(&["textures/a b.png", "materials/m.mtl", "c.png"]);
        let mut find = |from: &str, name: &str| find(&mut folder, from, name);
        let texture = Ok(PathBuf::from("textures/a b.png"));
        assert_eq!(find("", "textures/a b.png"), texture);
        assert_eq!(find("materials", "../textures/a b.png"), texture);
        assert_eq!(find("materials", "../Textures/./A B.png"), texture);
        assert_eq!(find("materials", "textures\\a b.png"), texture);
        assert_eq!(find("textures", "C:\\Users\\me\\a b.png"), texture);
        assert_eq!(find("", "\u{3000}\"textures/a b.png\" "), texture);
        assert_eq!(
            find("materials", "/home/me/c.png"),
            Ok(PathBuf::from("c.png"))
        );
        assert_eq!(find("", "../secret.png"), Err(Missing::Outside));
        assert_eq!(find("", "../Secret.png"), Err(Missing::Outside));
        assert_eq!(find("textures", "../../secret.png"), Err(Missing::Outside));
        let absolute = outer.path().join("secret.png");
        assert_eq!(find("", &absolute.to_string_lossy()), Err(Missing::Outside));
        assert_eq!(find("", "none.png"), Err(Missing::Absent));
        assert_eq!(find("", "textures"), Err(Missing::Absent));
        assert_eq!(find("", ""), Err(Missing::Absent));
        assert_eq!(find("", ".."), Err(Missing::Outside));
        assert_eq!(find("", &"a/".repeat(1 << 20)), Err(Missing::Absent));
    }

    #[test]
    fn the_longest_end_of_a_foreign_path_wins() {
        let (_outer, mut folder) = scene_with(&[
            "textures/wood/floor.png",
            "wood/floor.png",
            "floor.png",
            "materials/stone.png",
        ]);
        let mut find = |from: &str, name: &str| find(&mut folder, from, name).unwrap();
        let deep = Path::new("textures/wood/floor.png");
        assert_eq!(
            find("", "C:\\Projects\\house\\textures\\wood\\floor.png"),
            deep
        );
        assert_eq!(find("", "/home/me/house/textures/wood/floor.png"), deep);
        assert_eq!(
            find("", "\\\\server\\share\\Textures\\Wood\\Floor.PNG"),
            deep
        );
        assert_eq!(find("", "../elsewhere/textures/wood/floor.png"), deep);
        assert_eq!(
            find("", "D:/maps/wood/floor.png"),
            Path::new("wood/floor.png")
        );
        assert_eq!(find("", "D:/maps/oak/floor.png"), Path::new("floor.png"));
        let beside = Path::new("materials/stone.png");
        assert_eq!(find("materials", "D:/maps/stone.png"), beside);
    }

    #[test]
    fn letter_case_and_unicode_form_do_not_matter_where_one_file_fits() {
        let (_outer, mut folder) = scene_with(&[
            "textures/floor.png",
            "Straße/Bodenbela\u{308}ge.png",
            "both/a.png",
            "both/A.png",
            "One/lamp.png",
            "one/door.png",
        ]);
        let mut find = |name: &str| find(&mut folder, "", name);
        let found = |path: &str| Ok(PathBuf::from(path));
        assert_eq!(find("Textures/Floor.PNG"), found("textures/floor.png"));
        let decomposed = found("Straße/Bodenbela\u{308}ge.png");
        assert_eq!(find("Straße/Bodenbel\u{e4}ge.png"), decomposed);
        assert_eq!(find("STRASSE/BODENBEL\u{c4}GE.PNG"), decomposed);
        assert_eq!(find("both/a.png"), found("both/a.png"));
        assert_eq!(find("both/a.PNG"), Err(Missing::Ambiguous));
        // One of two folders has the file.
        assert_eq!(find("ONE/lamp.png"), found("One/lamp.png"));
        assert_eq!(find("One/door.png"), found("one/door.png"));
    }

    #[test]
    fn a_unicode_form_is_closer_than_a_letter_case() {
        let (_outer, mut folder) = scene_with(&["e\u{301}.png", "E\u{301}.png"]);
        let found = find(&mut folder, "", "\u{e9}.png");
        assert_eq!(found, Ok(PathBuf::from("e\u{301}.png")));
        assert_eq!(find(&mut folder, "", "\u{e9}.PNG"), Err(Missing::Ambiguous));
    }

    #[test]
    fn the_first_of_several_names_that_is_there_is_taken() {
        let (_outer, mut folder) = scene_with(&["floor.png", "wood #2.png"]);
        let mut find = |names: &[&str]| folder.locate(Path::new(""), names);
        let found = |number: usize, path: &str| Ok((number, PathBuf::from(path)));
        assert_eq!(find(&["wood #2.png", "wood"]), found(0, "wood #2.png"));
        // As it stands goes before any likeness.
        assert_eq!(find(&["x/FLOOR.png", "floor.png"]), found(1, "floor.png"));
        assert_eq!(find(&["none", "../none"]), Err(Missing::Outside));
    }

    #[cfg(unix)]
    #[test]
    fn no_link_leads_the_search_out() {
        use std::os::unix::fs::symlink;
        let (outer, mut folder) = scene_with(&["maps/floor.png"]);
        symlink("..", outer.path().join("scene/up")).unwrap();
        symlink("../secret.png", outer.path().join("scene/link.png")).unwrap();
        symlink("maps", outer.path().join("scene/textures")).unwrap();
        let mut find = |name: &str| find(&mut folder, "", name);
        assert_eq!(find("UP/secret.png"), Err(Missing::Absent));
        assert_eq!(find("C:/x/UP/Secret.png"), Err(Missing::Outside));
        assert_eq!(find("LINK.png"), Err(Missing::Absent));
        let inside = Ok(PathBuf::from("textures/floor.png"));
        assert_eq!(find("Textures/Floor.png"), inside);
    }
}
