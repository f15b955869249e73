//! The bytes of buffers and of views of them, read when they are first asked for.

use std::cell::{OnceCell, RefCell};

use super::document::{Buffer, Document};
use super::files::Files;
use super::printable;

/// The buffers of a file.
#[derive(Debug)]
pub(super) struct Buffers<'a> {
    document: &'a Document,
    /// The buffer in the GLB file.
    chunk: Option<&'a [u8]>,
    files: RefCell<Files>,
    /// Those of files, or in the text.
    read: Vec<OnceCell<Result<Vec<u8>, String>>>,
}

impl<'a> Buffers<'a> {
    pub(super) fn new(document: &'a Document, chunk: Option<&'a [u8]>, files: Files) -> Self {
        Self {
            document,
            chunk,
            files: RefCell::new(files),
            read: document.buffers.iter().map(|_| OnceCell::new()).collect(),
        }
    }

    /// The bytes of a view.
    ///
    /// # Errors
    /// The problem, without a remedy.
    pub(super) fn view(&self, index: usize) -> Result<&[u8], String> {
        let view = self.document.buffer_views.get(index);
        let view = view.ok_or("a buffer view that does not exist is named")?;
        let bytes = self.buffer(view.buffer)?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let range = end.and_then(|end| {
            Some(usize::try_from(view.byte_offset).ok()?..usize::try_from(end).ok()?)
        });
        let part = range.and_then(|range| bytes.get(range));
        part.ok_or_else(|| {
            let name = self.document.buffers.get(view.buffer).map(named);
            format!("{} ends early", name.unwrap_or_default())
        })
    }

    /// The bytes that a URI names.
    ///
    /// # Errors
    /// A clause with the reason.
    pub(super) fn file(&self, uri: &str) -> Result<Vec<u8>, String> {
        self.files.borrow_mut().read(uri)
    }

    /// What was read from.
    pub(super) fn into_files(self) -> Files {
        self.files.into_inner()
    }

    fn buffer(&self, index: usize) -> Result<&[u8], String> {
        let (Some(buffer), Some(cell)) = (self.document.buffers.get(index), self.read.get(index))
        else {
            return Err("a buffer that does not exist is named".to_owned());
        };
        let uri = match (&buffer.uri, index, self.chunk) {
            (Some(uri), ..) => uri,
            (None, 0, Some(chunk)) => return Ok(chunk),
            (None, ..) => return Err(format!("{} has no data", named(buffer))),
        };
        let read = cell.get_or_init(|| self.file(uri));
        read.as_deref()
            .map_err(|reason| format!("{} {reason}", named(buffer)))
    }
}

/// A buffer in a sentence.
fn named(buffer: &Buffer) -> String {
    match &buffer.uri {
        Some(uri) if !uri.starts_with("data:") => format!("buffer '{}'", printable(uri)),
        _ => "a buffer inside the file".to_owned(),
    }
}
