//! Files that are written whole or not at all: filled aside, in the same folder, and renamed when nothing is missing.
//!
//! The target of a symbolic link is replaced, not the link. Devices and pipes cannot be replaced: they are written to.

use std::{
    fs,
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

/// Begins the names of files that are not whole yet.
const ASIDE: &str = ".vecrad-";

/// Fill a file aside, then put it in its place. The old file stays until then, and where anything fails.
///
/// # Errors
/// Those of `fill` and of the system.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if is_device(path) {
        let mut out = BufWriter::new(fs::OpenOptions::new().write(true).open(path)?);
        fill(&mut out)?;
        return out.flush();
    }
    let path = target_of(path);
    let aside = tempfile::Builder::new()
        .prefix(ASIDE)
        .make_in(folder_of(&path), |name| {
            // Opened as any other file is, so that the permissions are those the user expects.
            fs::File::create_new(name)
        })?;
    let mut out = BufWriter::new(aside);
    fill(&mut out)?;
    let aside = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    // A disk may say only now that it is full.
    aside.as_file().sync_all()?;
    aside.persist(&path).map_err(|error| error.error)?;
    Ok(())
}

/// Try whether a file could be written, and leave nothing behind.
///
/// # Errors
/// Those of the system.
pub fn try_writing(path: &Path) -> io::Result<()> {
    if is_device(path) {
        return Ok(());
    }
    tempfile::tempfile_in(folder_of(&target_of(path))).map(drop)
}

/// The folder that a file is in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Symbolic links that are followed one after another before they count as a circle, as on most systems.
const MOST_LINKS: usize = 40;

/// The file that a name leads to, without symbolic links, `.` and `..`, whether or not there is a file yet.
pub fn place_of(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Ok(place) = fs::canonicalize(&path) {
            return place;
        }
        let folder = folder_of(&path);
        // A link to a file that is not there yet.
        match fs::read_link(&path) {
            Ok(target) => path = folder.join(target),
            Err(_) => {
                let folder = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
                return folder.join(path.file_name().unwrap_or_default());
            }
        }
    }
    path
}

/// Whether there is something that is neither a file nor a folder.
fn is_device(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
}

/// Where a symbolic link leads, else the path itself.
fn target_of(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_symlink() => {
            fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
        }
        _ => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, |out| out.write_all(b"old")).unwrap();
        let failed = write_whole(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("disk on fire"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_devices_stay_devices() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, null] = ["a.txt", "link", "null"].map(|name| folder.path().join(name));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        std::os::unix::fs::symlink("/dev/null", &null).unwrap();
        for path in [&link, &null] {
            try_writing(path).unwrap();
            write_whole(path, |out| out.write_all(b"new")).unwrap();
            assert!(fs::symlink_metadata(path).unwrap().is_symlink());
        }
        assert_eq!(fs::read(&file).unwrap(), b"new");
        assert!(is_device(Path::new("/dev/null")));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 3);
    }
}
