//! How much of a file has been read, for those who wait for it on another thread.

use std::io::{self, BufRead, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of a file that have been read, and its length. Clones share them.
#[derive(Clone, Debug, Default)]
pub struct ReadProgress(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    read: AtomicU64,
    all: AtomicU64,
}

impl ReadProgress {
    /// The part that has been read, 0…1; 0 before the file is open.
    pub fn share(&self) -> f32 {
        let [read, all] = [&self.0.read, &self.0.all].map(|count| count.load(Ordering::Relaxed));
        if all == 0 {
            return 0.0;
        }
        (read as f64 / all as f64).min(1.0) as f32
    }

    /// Count what is read of a text of so many bytes.
    pub(super) fn count<R: BufRead>(&self, text: R, byte_count: u64) -> Counted<R> {
        self.0.read.store(0, Ordering::Relaxed);
        self.0.all.store(byte_count, Ordering::Relaxed);
        Counted {
            text,
            counts: self.0.clone(),
        }
    }
}

/// A text whose bytes are counted as they are consumed.
pub(super) struct Counted<R> {
    text: R,
    counts: Arc<Counts>,
}

impl<R: BufRead> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.text.read(buffer)?;
        self.counts.read.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Counted<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.text.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.text.consume(count);
        self.counts.read.fetch_add(count as u64, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_consumed_is_counted_once() {
        let progress = ReadProgress::default();
        assert_eq!(progress.share(), 0.0);
        let mut text = progress.count(&b"v 0 0 0\nv 1 0 0\n"[..], 16);
        assert_eq!(progress.share(), 0.0);
        let mut line = String::new();
        text.read_line(&mut line).unwrap();
        assert_eq!(progress.clone().share(), 0.5);
        text.read_to_string(&mut line).unwrap();
        assert_eq!(progress.share(), 1.0);
    }
}
