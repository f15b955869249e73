//! Recoverable trouble that travels with the scene: what was skipped, cured or clamped.

use std::fmt;

/// What kind of trouble, for grouping and for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WarningKind {
    /// A face was left out: bad index, non-finite or too few corners, zero area.
    FaceSkipped,
    /// A line of the OBJ or MTL file could not be used.
    LineSkipped,
    /// A material name or file that is not there.
    MaterialMissing,
    /// A texture that is not there or cannot be decoded.
    TextureMissing,
    /// A value was brought into its range, such as a reflectance above the clamp.
    ValueClamped,
    /// Bytes that are not UTF-8 were replaced.
    Encoding,
    /// A feature of the file that vecrad does not use (transparency, NURBS, …).
    Unsupported,
    /// Nothing in the scene emits light.
    NoEmitter,
    /// Something about orientation or sidedness that deserves a look.
    Orientation,
}

/// One kind of trouble, counted, with the place where it was first met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Its kind.
    pub kind: WarningKind,
    /// What happened and what was done, one sentence in lower case without a final period.
    pub message: String,
    /// How often, at least 1.
    pub count: usize,
    /// File name (without folder) and line of the first, where known; lines count from 1.
    pub place: Option<(String, usize)>,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some((file, line)) = &self.place {
            write!(f, "{file}:{line}: ")?;
        }
        f.write_str(&self.message)?;
        if self.count > 1 {
            write!(f, " ({} times)", self.count)?;
        }
        Ok(())
    }
}
