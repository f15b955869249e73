//! Recoverable trouble that travels with the scene: what was skipped, cured or clamped.

use std::fmt;

/// Kind of a warning, for grouping and for tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum WarningKind {
    /// A face was omitted: bad index, non-finite or too few corners, zero area.
    FaceSkipped,
    /// A line of the OBJ or MTL file could not be used.
    LineSkipped,
    /// A material name or file that is not there.
    MaterialMissing,
    /// A texture that is not there or cannot be decoded.
    TextureMissing,
    /// A value was brought into its range, such as a reflectance above the clamp.
    ValueClamped,
    /// The file is not UTF-8: it was decoded, or bytes were replaced.
    Encoding,
    /// A feature of the file that vecrad does not use (gloss, NURBS, …).
    Unsupported,
    /// Light passes through surfaces, or does not though they ask for it.
    SeeThrough,
    /// Nothing in the scene emits light.
    NoEmitter,
    /// Light that was asked for and may not be as meant.
    Light,
    /// The file changed while it was read.
    FileChanged,
    /// Something about orientation or sidedness that deserves a look.
    Orientation,
}

/// One kind of trouble, counted, with the place where it was first met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Its kind.
    pub kind: WarningKind,
    /// The problem and the remedy, one sentence in lower case without a final period.
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

/// Warnings as they are met: equal ones are counted, and their number is bounded.
#[derive(Clone, Debug, Default)]
pub(super) struct WarningLog {
    warnings: Vec<Warning>,
}

/// Distinct warnings kept. Fewer would hide causes, many more would bury the reader and slow a hostile file down.
const MAX_DISTINCT: usize = 64;

impl WarningLog {
    /// Count one more of this kind and message; `line` 0 means that no line is known.
    pub(super) fn note(&mut self, kind: WarningKind, message: &str, file: &str, line: usize) {
        self.note_times(kind, message, 1, file, line);
    }

    /// Count `count` more of this kind and message.
    pub(super) fn note_times(
        &mut self,
        kind: WarningKind,
        message: &str,
        count: usize,
        file: &str,
        line: usize,
    ) {
        const OVERFLOW: &str = "more of this kind, not listed one by one";
        // A name in a file must neither break the line nor command the terminal.
        let printable = message.replace(char::is_control, "\u{fffd}");
        let message = printable.as_str();
        let message = if self.find(kind, message).is_none() && self.warnings.len() >= MAX_DISTINCT {
            OVERFLOW
        } else {
            message
        };
        match self.find(kind, message) {
            Some(index) => self.warnings[index].count += count,
            None => self.warnings.push(Warning {
                kind,
                message: message.to_owned(),
                count,
                place: (line > 0).then(|| (file.to_owned(), line)),
            }),
        }
    }

    /// Add those of another log.
    pub(super) fn append(&mut self, other: Self) {
        for warning in other.warnings {
            let (file, line) = warning.place.unwrap_or_default();
            self.note_times(warning.kind, &warning.message, warning.count, &file, line);
        }
    }

    /// The warnings in the order in which each was first met.
    pub(super) fn into_warnings(self) -> Vec<Warning> {
        self.warnings
    }

    fn find(&self, kind: WarningKind, message: &str) -> Option<usize> {
        self.warnings
            .iter()
            .position(|known| known.kind == kind && known.message == message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_warnings_are_counted_at_their_first_place() {
        let mut log = WarningLog::default();
        log.note(
            WarningKind::FaceSkipped,
            "skipped a face: no area",
            "a.obj",
            3,
        );
        log.note(
            WarningKind::FaceSkipped,
            "skipped a face: no area",
            "a.obj",
            9,
        );
        let warnings = log.into_warnings();
        assert_eq!(warnings.len(), 1);
        assert_eq!(
            warnings[0].to_string(),
            "a.obj:3: skipped a face: no area (2 times)"
        );
    }

    #[test]
    fn control_characters_do_not_reach_the_reader() {
        let mut log = WarningLog::default();
        log.note(WarningKind::LineSkipped, "bad \x1b[2J\nname", "", 0);
        assert_eq!(
            log.into_warnings()[0].message,
            "bad \u{fffd}[2J\u{fffd}name"
        );
    }

    #[test]
    fn distinct_warnings_are_bounded() {
        let mut log = WarningLog::default();
        for number in 0..10_000 {
            log.note(
                WarningKind::TextureMissing,
                &format!("texture {number}"),
                "",
                0,
            );
        }
        let warnings = log.into_warnings();
        assert!(warnings.len() <= MAX_DISTINCT + 9);
        assert_eq!(warnings.iter().map(|w| w.count).sum::<usize>(), 10_000);
    }
}
