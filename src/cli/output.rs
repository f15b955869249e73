//! Where a command's output goes: files, standard output (`-`), and sentences on standard error. Two outputs never share
//! a file, and none replaces a file of the scene.

use std::{
    fmt::Display,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

use anyhow::{Context as _, Result, anyhow, bail};

use super::UsageError;
use crate::scene::{self, folder_of, place_of};

/// Whether a name means standard output.
pub(super) fn is_stdout(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Print a sentence to standard error. A closed standard error is ignored.
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

/// A file that is going to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Destination {
    /// The flag or file name that it is known by.
    label: String,
    /// As it was given.
    path: PathBuf,
    /// The same for all names of one file.
    place: PathBuf,
}

impl Destination {
    /// The file of this name; `None` for standard output, pipes and devices, which several outputs may share.
    pub(super) fn new(label: &str, path: &Path) -> Option<Self> {
        let is_stream =
            fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir());
        (!is_stdout(path) && !is_stream).then(|| Self {
            label: label.to_owned(),
            path: path.to_owned(),
            place: place_of(path),
        })
    }
}

/// Refuse two outputs that are one file.
pub(super) fn check_distinct(destinations: &[Destination]) -> Result<()> {
    for (index, one) in destinations.iter().enumerate() {
        if let Some(other) = destinations[..index]
            .iter()
            .find(|other| other.place == one.place)
        {
            bail!(UsageError(format!(
                "{} and {} name the same file; give each its own: {}",
                other.label,
                one.label,
                one.path.display()
            )));
        }
    }
    Ok(())
}

/// Refuse an output that would replace one of these files, which the scene is read from.
pub(super) fn check_inputs_kept(destinations: &[Destination], inputs: &[PathBuf]) -> Result<()> {
    // A file that does not exist yet cannot be read.
    let existing: Vec<&Destination> = destinations
        .iter()
        .filter(|destination| destination.place.exists())
        .collect();
    if existing.is_empty() {
        return Ok(());
    }
    let places = inputs.iter().map(|input| place_of(input));
    for place in places {
        if let Some(one) = existing
            .iter()
            .find(|destination| destination.place == place)
        {
            bail!(UsageError(format!(
                "{} would replace a file that the scene is read from; choose another name: {}",
                one.label,
                one.path.display()
            )));
        }
    }
    Ok(())
}

/// A scene's name as a file's, without its ending.
pub(super) fn file_stem(scene: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || c == '-';
    scene
        .chars()
        .map(|c| if plain(c) { c } else { '_' })
        .collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn destinations(names: &[PathBuf]) -> Vec<Destination> {
        let named = names.iter().enumerate();
        named
            .filter_map(|(index, path)| Destination::new(&format!("--flag-{index}"), path))
            .collect()
    }

    #[test]
    fn all_names_of_a_file_are_one_place() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir(root.join("sub")).unwrap();
        fs::write(root.join("there.ply"), "").unwrap();
        let mut same = vec![
            (root.join("new.ply"), root.join("./new.ply")),
            (root.join("new.ply"), root.join("sub/../new.ply")),
            (root.join("there.ply"), root.join("sub/../there.ply")),
        ];
        #[cfg(unix)]
        {
            let link = |target: &str, name: &str| {
                std::os::unix::fs::symlink(target, root.join(name)).unwrap();
            };
            link("there.ply", "link");
            link("link", "sub/../second");
            link("new.ply", "dangling");
            link("../new.ply", "sub/dangling");
            link(".", "here");
            same.extend([
                (root.join("there.ply"), root.join("link")),
                (root.join("there.ply"), root.join("second")),
                (root.join("new.ply"), root.join("dangling")),
                (root.join("new.ply"), root.join("sub/dangling")),
                (root.join("new.ply"), root.join("here/new.ply")),
            ]);
        }
        for (one, other) in same {
            let error = check_distinct(&destinations(&[one.clone(), other.clone()])).unwrap_err();
            let sentence = error.to_string();
            assert!(
                error.is::<UsageError>() && sentence.contains("--flag-0 and --flag-1"),
                "{one:?} {other:?}: {sentence}"
            );
        }
        let others = ["new.ply", "sub/new.ply", "there.ply"].map(|name| root.join(name));
        check_distinct(&destinations(&others)).unwrap();
    }

    #[test]
    fn files_of_the_scene_are_kept_whatever_they_are_called() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for name in ["s.obj", "s.mtl", "floor.png"] {
            fs::write(root.join(name), "").unwrap();
        }
        let inputs = ["s.obj", "s.mtl", "floor.png"].map(|name| root.join(name));
        for name in ["s.obj", "./s.mtl", "floor.png"] {
            let outputs = destinations(&[root.join("lit.ply"), root.join(name)]);
            let error = check_inputs_kept(&outputs, &inputs).unwrap_err();
            assert!(
                error.to_string().contains("--flag-1 would replace"),
                "{name}"
            );
        }
        let outputs = destinations(&[root.join("lit.ply"), root.join("s.json")]);
        check_inputs_kept(&outputs, &inputs).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn standard_output_and_devices_may_be_shared() {
        let streams = ["-", "-", "/dev/null", "/dev/null"].map(PathBuf::from);
        assert_eq!(destinations(&streams), []);
    }
}
