//! Text that one thread cleans while another parses what is clean already.

use std::io::{self, BufRead, Read};
use std::panic::AssertUnwindSafe;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use super::clean::{Notes, ObjCleaner};

/// Chunks that may wait for the parser. Fewer, and both wait for each other's slow ones; more only hold memory.
const CHUNKS_AHEAD: usize = 16;

/// The results of the parser and of the cleaner; `None` where one panicked.
pub(super) struct Parsed<T> {
    /// The result of the parser.
    pub(super) value: Option<T>,
    /// Notes of the cleaner.
    pub(super) notes: Option<Notes>,
}

/// Clean on a thread of its own and parse on this one.
///
/// # Errors
/// Those of the system, where it gives no thread.
pub(super) fn parse_ahead<T>(
    cleaner: ObjCleaner<impl BufRead + Send>,
    parse: impl FnOnce(&mut CleanText) -> T,
) -> io::Result<Parsed<T>> {
    let (sender, receiver) = sync_channel(CHUNKS_AHEAD);
    thread::scope(|scope| {
        let cleaning = thread::Builder::new()
            .name("obj-cleaner".to_owned())
            .spawn_scoped(scope, move || clean(cleaner, &sender))?;
        let mut text = CleanText {
            receiver,
            chunk: Vec::new(),
            position: 0,
        };
        // The clean text is valid for the parser; should it panic nevertheless, the window must survive.
        let value = std::panic::catch_unwind(AssertUnwindSafe(|| parse(&mut text))).ok();
        // The cleaner stops when the parser stops reading.
        drop(text);
        Ok(Parsed {
            value,
            notes: cleaning.join().ok(),
        })
    })
}

/// Send chunks until there are no more or the receiver is gone.
fn clean(mut cleaner: ObjCleaner<impl BufRead>, sender: &SyncSender<Vec<u8>>) -> Notes {
    while let Some(chunk) = cleaner.next_chunk() {
        if sender.send(chunk).is_err() {
            break;
        }
    }
    cleaner.notes
}

/// Clean text as it comes.
pub(super) struct CleanText {
    receiver: Receiver<Vec<u8>>,
    chunk: Vec<u8>,
    position: usize,
}

impl Read for CleanText {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let available = self.fill_buf()?;
        let count = available.len().min(buffer.len());
        buffer[..count].copy_from_slice(&available[..count]);
        self.consume(count);
        Ok(count)
    }
}

impl BufRead for CleanText {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.position >= self.chunk.len() {
            self.position = 0;
            // The end comes with the end of the cleaner.
            self.chunk = self.receiver.recv().unwrap_or_default();
        }
        Ok(&self.chunk[self.position..])
    }

    fn consume(&mut self, count: usize) {
        self.position += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Many more chunks than may wait.
    fn long_text() -> String {
        "v 0.25 0.5 1\n".repeat(1 << 20)
    }

    #[test]
    fn all_text_comes_in_order() {
        let text = long_text();
        let cleaner = ObjCleaner::new(text.as_bytes(), "x.obj");
        let parsed = parse_ahead(cleaner, |clean| {
            let mut all = String::new();
            clean.read_to_string(&mut all).unwrap();
            all
        })
        .unwrap();
        assert!(parsed.value.unwrap().ends_with(&text));
        assert_eq!(parsed.notes.unwrap().statements, 1 << 20);
    }

    #[test]
    fn a_parser_that_gives_up_ends_the_cleaner_and_keeps_the_notes() {
        let text = long_text();
        for panics in [false, true] {
            let cleaner = ObjCleaner::new(text.as_bytes(), "x.obj");
            let parsed = parse_ahead(cleaner, |clean| {
                assert!(clean.fill_buf().is_ok() && !panics, "as asked");
            })
            .unwrap();
            assert_eq!(parsed.value.is_none(), panics);
            assert!(parsed.notes.unwrap().statements < 1 << 20);
        }
    }
}
