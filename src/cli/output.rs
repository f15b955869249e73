//! Where a command's output goes: files, standard output (`-`), and sentences on standard error.

use std::{
    fmt::Display,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, anyhow, bail};

use super::UsageError;
use crate::scene::{self, folder_of};

/// Whether a name means standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Put a sentence on standard error. One that nobody reads is no reason to stop.
pub(super) fn say(sentence: impl Display) {
    let _ = writeln!(io::stderr(), "{sentence}");
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
    scene::try_writing(path)
        .with_context(|| format!("cannot write to the folder {}", folder.display()))
}

/// Write a file whole or not at all; or write to standard output, as much of it as its reader wants.
///
/// Where the file cannot be written, it is saved in the folder for temporary files, so that a long solve is not lost;
/// the error says so.
pub(super) fn write_whole(
    path: &Path,
    write: impl Fn(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    if is_stdout(path) {
        let mut out = io::stdout().lock();
        let written = write(&mut out).and_then(|()| out.flush());
        return match written {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
            written => written.context("cannot write to standard output"),
        };
    }
    let Err(error) = scene::write_whole(path, &write) else {
        return Ok(());
    };
    Err(match rescue(path, write) {
        Ok(saved) => anyhow!(
            "cannot write {}: {error}; saved as {} instead",
            path.display(),
            saved.display()
        ),
        Err(_) => anyhow!("cannot write {}: {error}", path.display()),
    })
}

/// Write to a new file in the folder for temporary files, and return which.
fn rescue(path: &Path, write: impl Fn(&mut dyn Write) -> io::Result<()>) -> io::Result<PathBuf> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut file = tempfile::Builder::new()
        .prefix("vecrad-")
        .suffix(&format!("-{name}"))
        .tempfile()?;
    let mut out = io::BufWriter::new(file.as_file_mut());
    write(&mut out)?;
    out.flush()?;
    drop(out);
    Ok(file.keep().map_err(|error| error.error)?.1)
}
