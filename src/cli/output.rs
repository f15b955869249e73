//! Files that are written whole or not at all; `-` is standard output.

use std::{
    fs,
    io::{self, BufWriter, Write},
    path::Path,
};

use anyhow::{Context as _, Result, bail};

use super::UsageError;

/// Whether a name means standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Say early that a file cannot be written, rather than after a long solve.
pub(super) fn check(path: &Path) -> Result<()> {
    if is_stdout(path) {
        return Ok(());
    }
    if path.is_dir() {
        bail!(UsageError(format!(
            "this is a folder; name a file in it: {}",
            path.display()
        )));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        bail!(UsageError(format!(
            "there is no such folder; make it first: {}",
            folder.display()
        )));
    }
    tempfile::tempfile_in(folder)
        .map(drop)
        .with_context(|| format!("cannot write to the folder {}", folder.display()))
}

/// Write a file aside, then put it in its place; or write to standard output.
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let written = if is_stdout(path) {
        let mut out = io::stdout().lock();
        write(&mut out).and_then(|()| out.flush())
    } else {
        write_file(path, write)
    };
    written.with_context(|| format!("cannot write {}", path.display()))
}

fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let aside = tempfile::Builder::new()
        .prefix(".vecrad-")
        .make_in(folder_of(path), |name| {
            // Opened as any other file is, so that the permissions are those the user expects.
            fs::File::create_new(name)
        })?;
    let mut out = BufWriter::new(aside);
    write(&mut out)?;
    let aside = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    aside.persist(path).map_err(|error| error.error)?;
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
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
}
