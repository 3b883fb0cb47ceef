//! The pairs of leaf packets that a walk has met, grouped by the node test that left them, and visited several at a time.

use crate::traverse::pending::{Entry, Tested};

/// Pairs of leaf packets in the order in which they were met.
#[derive(Default)]
pub(crate) struct LeafPairs {
    /// Node tests that left at least one pair. Those from `used` on have no meaning.
    tests: Vec<Tested>,
    used: usize,
    /// The number of pairs.
    pairs: u32,
    /// The test of the first pair.
    first: usize,
}

impl LeafPairs {
    pub(crate) fn clear(&mut self) {
        (self.used, self.pairs, self.first) = (0, 0, 0);
    }

    /// Returns the number of pairs.
    #[inline(always)]
    pub(crate) fn len(&self) -> u32 {
        self.pairs
    }

    /// Appends the pairs in the lanes of a mask. No branch depends on the mask.
    #[inline(always)]
    pub(crate) fn append(&mut self, tested: &Tested, mask: u16) {
        if self.tests.len() <= self.used {
            self.grow();
        }
        self.tests[self.used] = Tested { left: mask, ..*tested };
        self.used += usize::from(mask != 0);
        self.pairs += mask.count_ones();
    }

    #[cold]
    fn grow(&mut self) {
        self.tests.resize(2 * self.used + 16, Tested::NONE);
    }

    /// Takes the first pair. No branch depends on where it is.
    #[inline(always)]
    pub(crate) fn take(&mut self) -> Option<Entry> {
        if self.pairs == 0 {
            self.clear();
            return None;
        }
        let test = &mut self.tests[self.first];
        let entry = test.entry(test.left.trailing_zeros());
        test.left &= test.left.wrapping_sub(1);
        self.first += usize::from(test.left == 0);
        self.pairs -= 1;
        Some(entry)
    }
}
