//! Why a file gives no scene, one sentence each.

use std::path::{Path, PathBuf};

/// Why a file gives no scene.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// No file of that name.
    #[error("there is no such file; check the name: {}", path.display())]
    NotFound {
        /// The path.
        path: PathBuf,
    },
    /// A folder instead of a file.
    #[error("this is a folder; name the scene file in it: {}", path.display())]
    Folder {
        /// The path.
        path: PathBuf,
    },
    /// A pipe or a device: it may have no end.
    #[error("this is a pipe or a device; save the scene to a file first: {}", path.display())]
    NotFile {
        /// The path.
        path: PathBuf,
    },
    /// The system refuses to read it.
    #[error("the file cannot be read ({reason}); check its permissions and the disk: {}", path.display())]
    Unreadable {
        /// The message of the system.
        reason: String,
        /// The path.
        path: PathBuf,
    },
    /// Nothing but white space.
    #[error("the file is empty; export the scene again: {}", path.display())]
    Empty {
        /// The path.
        path: PathBuf,
    },
    /// Another format.
    #[error("this is neither glTF nor OBJ text; export the scene as one of these: {}", path.display())]
    NotScene {
        /// The path.
        path: PathBuf,
    },
    /// A glTF file or an archive that cannot be used.
    #[error("{reason}: {}", path.display())]
    Refused {
        /// The problem and the remedy.
        reason: String,
        /// The path.
        path: PathBuf,
    },
    /// No face is left to light.
    #[error("there are no usable faces{detail}; export the surfaces as polygons: {}", path.display())]
    NoFaces {
        /// Why they went, starting with a separator, or empty.
        detail: String,
        /// The path.
        path: PathBuf,
    },
    /// Numbers in a notation that cannot be read, and nothing else to light.
    #[error("line {line} has {notation} in a vertex, so no usable faces are left; {cure}: {}", path.display())]
    ForeignNumbers {
        /// The first line of them.
        line: usize,
        /// How they are written.
        notation: &'static str,
        /// The remedy.
        cure: &'static str,
        /// The path.
        path: PathBuf,
    },
    /// More than the program can index.
    #[error("there are too many triangles, vertices or parts ({count}, at most {limit}); split the scene: {}", path.display())]
    TooLarge {
        /// How many there are.
        count: usize,
        /// How many there may be.
        limit: usize,
        /// The path.
        path: PathBuf,
    },
    /// The parser gave up on text that was cleaned for it.
    #[error("the OBJ parser gave up ({reason}); export the scene again with another program: {}", path.display())]
    Parser {
        /// The message of the parser.
        reason: String,
        /// The path.
        path: PathBuf,
    },
}

impl ReadError {
    /// The same of another path: that of the archive in which the file is.
    pub(super) fn at(mut self, other: &Path) -> Self {
        match &mut self {
            Self::NotFound { path }
            | Self::Folder { path }
            | Self::NotFile { path }
            | Self::Unreadable { path, .. }
            | Self::Empty { path }
            | Self::NotScene { path }
            | Self::Refused { path, .. }
            | Self::NoFaces { path, .. }
            | Self::ForeignNumbers { path, .. }
            | Self::TooLarge { path, .. }
            | Self::Parser { path, .. } => other.clone_into(path),
        }
        self
    }
}
