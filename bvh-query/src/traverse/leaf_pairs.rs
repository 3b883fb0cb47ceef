//! The pairs of leaf packets that a walk has met, grouped by the node test that left them, and visited several at a time.

use crate::traverse::pending::{Entry, Tested};

/// Pairs of leaf packets in the order in which they were met.
#[derive(Default)]
pub(crate) struct LeafPairs {
    /// Node tests, and the lanes of the pairs that they left. Those from `used` on have no meaning.
    tests: Vec<(Tested, u16)>,
    used: usize,
    /// The number of pairs.
    pairs: u32,
}

impl LeafPairs {
    pub(crate) fn clear(&mut self) {
        (self.used, self.pairs) = (0, 0);
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
        self.tests[self.used] = (*tested, mask);
        self.used += usize::from(mask != 0);
        self.pairs += mask.count_ones();
    }

    #[cold]
    fn grow(&mut self) {
        self.tests.resize(2 * self.used + 16, (Tested::NONE, 0));
    }

    /// Returns the first pair from a place on, and the place after it. A place is a test and a lane of it.
    #[inline(always)]
    pub(crate) fn next(&self, (test, lane): (usize, u32)) -> Option<(Entry, (usize, u32))> {
        let (tested, mask) = self.tests[..self.used].get(test)?;
        // Each test has at least one pair, and a place is never after its last one.
        let lane = lane + (u32::from(*mask) >> lane).trailing_zeros();
        let after = lane + 1;
        let is_last = u32::from(*mask) >> after == 0;
        Some((tested.entry(lane), if is_last { (test + 1, 0) } else { (test, after) }))
    }
}
