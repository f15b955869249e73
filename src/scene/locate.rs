//! Where the files are that an OBJ or MTL file names: never outside the folder of the OBJ file, not even by a symbolic
//! link, and never a pipe or a device.

use std::path::{Component, Path, PathBuf};

/// Why a file was not found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    /// It is not there.
    Absent,
    /// The name leads out of the scene's folder, and no file of that name lies inside.
    Outside,
}

/// Find a file by the name that a file in `folder` (relative to `root`) gives it; returns a path relative to `root`.
///
/// Tried in turn: as it stands beside the naming file and beside the OBJ file, the same with `\` as `/`, then the bare
/// file name in both folders. Symbolic links are followed where they stay inside.
pub(super) fn locate(root: &Path, folder: &Path, name: &str) -> Result<PathBuf, Missing> {
    let name = name.trim().trim_matches('"');
    let slashed = name.replace('\\', "/");
    let base_name = slashed.rsplit('/').next().unwrap_or_default();
    let mut missing = Missing::Absent;
    for spelling in [name, &slashed, base_name] {
        for start in [folder, Path::new("")] {
            match inside(start, Path::new(spelling)) {
                Some(path) if root.join(&path).is_file() => match stays_inside(root, &path) {
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

/// Whether a file is still below the root when all symbolic links are followed.
fn stays_inside(root: &Path, path: &Path) -> bool {
    let followed = root.canonicalize().and_then(|inside| {
        let file = root.join(path).canonicalize()?;
        Ok(file.starts_with(inside))
    });
    followed.unwrap_or(false)
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

    #[test]
    fn files_are_found_inside_and_never_outside() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("scene");
        std::fs::create_dir_all(root.join("textures")).unwrap();
        std::fs::create_dir_all(root.join("materials")).unwrap();
        std::fs::write(root.join("textures/a b.png"), "").unwrap();
        std::fs::write(root.join("c.png"), "").unwrap();
        std::fs::write(folder.path().join("secret.png"), "").unwrap();
        let find = |from: &str, name: &str| locate(&root, Path::new(from), name);
        let texture = Ok(PathBuf::from("textures/a b.png"));
        assert_eq!(find("", "textures/a b.png"), texture);
        assert_eq!(find("materials", "../textures/a b.png"), texture);
        assert_eq!(find("materials", "textures\\a b.png"), texture);
        assert_eq!(find("textures", "C:\\Users\\me\\a b.png"), texture);
        assert_eq!(
            find("materials", "/home/me/c.png"),
            Ok(PathBuf::from("c.png"))
        );
        assert_eq!(find("", "../secret.png"), Err(Missing::Outside));
        let absolute = folder.path().join("secret.png");
        assert_eq!(find("", &absolute.to_string_lossy()), Err(Missing::Outside));
        assert_eq!(find("", "none.png"), Err(Missing::Absent));
        assert_eq!(find("", ""), Err(Missing::Absent));
    }
}
