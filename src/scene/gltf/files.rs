//! The files beside a glTF file, read whole and within a budget.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::uri::Resource;
use crate::scene::locate::{Missing, SceneFolder};

/// Bytes of all buffers and pictures beside a glTF file together. Sixteen million triangles without shared corners take
/// less.
const MAX_BYTES: u64 = 2 << 30;

/// What a glTF file may read.
#[derive(Debug)]
pub(super) struct Files {
    folder: SceneFolder,
    /// Bytes that may still be read.
    budget: u64,
    /// Paths of the files that were found.
    found: BTreeSet<PathBuf>,
}

impl Files {
    /// Those in the folder of a glTF file.
    pub(super) fn beside(folder: &Path) -> Self {
        Self {
            folder: SceneFolder::new(folder.to_owned()),
            budget: MAX_BYTES,
            found: BTreeSet::new(),
        }
    }

    /// The bytes that a URI names.
    ///
    /// # Errors
    /// A clause with the reason.
    pub(super) fn read(&mut self, uri: &str) -> Result<Vec<u8>, String> {
        match Resource::of(uri)? {
            Resource::Data(bytes) => Ok(bytes),
            Resource::Remote => Err(
                "is on the network, from which nothing is read; save it beside the scene"
                    .to_owned(),
            ),
            Resource::File(names) => {
                let path = self.find(&names).map_err(missing_because)?;
                self.read_file(&path)
            }
        }
    }

    fn read_file(&mut self, path: &Path) -> Result<Vec<u8>, String> {
        let unreadable = |error: std::io::Error| format!("cannot be read ({error})");
        let file = File::open(path).map_err(unreadable)?;
        let mut bytes = Vec::new();
        file.take(self.budget + 1)
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        let length = bytes.len() as u64;
        if length > self.budget {
            return Err(format!(
                "is too large: a scene has at most {} MiB of buffers and pictures",
                MAX_BYTES >> 20
            ));
        }
        self.budget -= length;
        Ok(bytes)
    }

    /// Note a file that the scene names but that need not be read.
    pub(super) fn note(&mut self, uri: &str) {
        if let Ok(Resource::File(names)) = Resource::of(uri) {
            // What is missing is not missed.
            let _ = self.find(&names);
        }
    }

    /// Paths of all files that were found.
    pub(super) fn into_found(self) -> impl Iterator<Item = PathBuf> {
        self.found.into_iter()
    }

    fn find(&mut self, names: &[String]) -> Result<PathBuf, Missing> {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let (_, path) = self.folder.locate(Path::new(""), &names)?;
        let path = self.folder.path_of(&path);
        self.found.insert(path.clone());
        Ok(path)
    }
}

/// Why a file is not taken, behind its name.
fn missing_because(missing: Missing) -> String {
    match missing {
        Missing::Absent => "was not found beside the scene",
        Missing::Outside => "lies outside the folder of the scene and was not read",
        Missing::Ambiguous => "fits several files that differ in letter case, so none was read",
    }
    .to_owned()
}
