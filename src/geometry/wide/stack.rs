//! What is still to be visited of a tree.

use super::node::Child;

/// Entries that need no memory of their own. Fewer, and rays through scenes of a million triangles ask for memory; many
/// more, and it costs time to clear them for every ray.
const AT_HAND: usize = 24;

/// A part of the tree that waits.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Entry {
    /// Distance at which the ray enters it; 0 where the order does not matter.
    pub(super) near: f32,
    pub(super) child: Child,
}

impl Entry {
    #[inline]
    pub(super) fn new(near: f32, child: Child) -> Self {
        Self { near, child }
    }
}

/// A stack that grows as deep as it must.
pub(super) struct Stack {
    at_hand: [Entry; AT_HAND],
    len: usize,
    /// Above those at hand.
    rest: Vec<Entry>,
}

impl Stack {
    #[inline]
    pub(super) fn new() -> Self {
        Self {
            at_hand: [Entry::default(); AT_HAND],
            len: 0,
            rest: Vec::new(),
        }
    }

    /// Entries at hand.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    #[inline]
    pub(super) fn push(&mut self, entry: Entry) {
        if let Some(free) = self.at_hand.get_mut(self.len) {
            *free = entry;
            self.len += 1;
        } else {
            self.rest.push(entry);
        }
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        if self.len == AT_HAND
            && let Some(entry) = self.rest.pop()
        {
            return Some(entry);
        }
        self.len = self.len.checked_sub(1)?;
        self.at_hand.get(self.len).copied()
    }

    /// Puts the entries at hand above the first so many in order, nearest last. Those in the rest keep theirs: it is
    /// only slower.
    #[inline]
    pub(super) fn sort_from(&mut self, first: usize) {
        let pushed = self.at_hand.get_mut(first..self.len).unwrap_or_default();
        for end in 1..pushed.len() {
            let mut at = end;
            while at > 0 && pushed[at].near > pushed[at - 1].near {
                pushed.swap(at, at - 1);
                at -= 1;
            }
        }
    }
}
