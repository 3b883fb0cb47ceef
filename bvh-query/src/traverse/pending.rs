//! The pairs that a walk has still to visit, grouped by the node test that left them.
//!
//! A test writes its 16 bounds directly into the list, and a mask marks the pairs that are left. Pairs are therefore
//! neither moved nor sorted, and no branch depends on their number. In a depth-first walk, the last test is next. In a
//! best-first walk, the test with the least bound is next.

use crate::isa::Isa;
use crate::traverse::node_cache::ChildRef;

/// A pair of nodes to visit, and a lower bound of their distance; see `Measure`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Entry {
    pub(crate) bound: f32,
    pub(crate) a: ChildRef,
    pub(crate) b: ChildRef,
}

impl Entry {
    /// Both roots, with the least bound of all.
    pub(crate) const ROOTS: Self = Self { bound: f32::NEG_INFINITY, a: ChildRef::ROOT, b: ChildRef::ROOT };
}

/// The result of a node test for 16 pairs, four nodes of A against four of B: element `4 * a + b`.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Tested {
    pub(crate) bounds: [f32; 16],
    /// The first of four children of each side.
    pub(crate) a: ChildRef,
    pub(crate) b: ChildRef,
}

impl Tested {
    pub(crate) const NONE: Self = Self { bounds: [0.0; 16], a: ChildRef::ROOT, b: ChildRef::ROOT };

    /// Returns the pair in a lane.
    #[inline(always)]
    pub(crate) fn entry(&self, lane: u32) -> Entry {
        let a = ChildRef::from_bits(self.a.bits() + (lane >> 2 & 3));
        let b = ChildRef::from_bits(self.b.bits() + (lane & 3));
        Entry { bound: self.bounds[lane as usize & 15], a, b }
    }
}

/// A test and the pairs of it that are left. There is at least one.
#[derive(Clone, Copy)]
struct PendingTest {
    tested: Tested,
    /// The lanes of the pairs that are left.
    left: u16,
    /// The lane to take next.
    next: u32,
}

impl PendingTest {
    /// Returns the bound of the next pair.
    #[inline(always)]
    fn bound(&self) -> f32 {
        self.tested.bounds[self.next as usize & 15]
    }
}

/// The tests that still have pairs to visit.
#[derive(Default)]
pub(crate) struct PendingTests {
    /// At least one longer than `len`, once room has been asked for.
    tests: Vec<PendingTest>,
    len: usize,
}

impl PendingTests {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns room for the next test. `push` keeps it.
    #[inline(always)]
    pub(crate) fn room(&mut self) -> &mut Tested {
        if self.tests.len() <= self.len {
            self.grow();
        }
        &mut self.tests[self.len].tested
    }

    #[cold]
    fn grow(&mut self) {
        self.tests.resize(2 * self.len + 64, PendingTest { tested: Tested::NONE, left: 0, next: 0 });
    }

    /// Keeps the test in `room`, unless no pairs are left. The pair in lane `first` comes first.
    #[inline(always)]
    pub(crate) fn push(&mut self, left: u16, first: u32) {
        if let Some(test) = self.tests.get_mut(self.len) {
            (test.left, test.next) = (left, first);
            self.len += usize::from(left != 0);
        }
    }

    /// Pushes a single pair.
    #[inline(always)]
    pub(crate) fn push_one(&mut self, entry: Entry) {
        let room = self.room();
        (room.bounds[0], room.a, room.b) = (entry.bound, entry.a, entry.b);
        self.push(1, 0);
    }

    /// Takes the next pair of the last test, and finds the nearest of those that are left. Nothing waits for this until
    /// the next pair is taken.
    #[inline(always)]
    pub(crate) fn pop<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        let last = self.len.checked_sub(1)?;
        let test = &mut self.tests[last];
        let entry = test.tested.entry(test.next);
        test.left &= !(1 << (test.next & 15));
        test.next = isa.least(&test.tested.bounds, test.left);
        self.len -= usize::from(test.left == 0);
        Some(entry)
    }

    /// Drops tests from the end until the next pair is within a limit. Each test's next pair is its nearest, so a test whose
    /// next pair is beyond the limit has none within it.
    #[inline(always)]
    pub(crate) fn drop_beyond(&mut self, limit: f32) {
        while let Some(last) = self.len.checked_sub(1)
            && self.tests[last].bound() > limit
        {
            self.len = last;
        }
    }

    /// Takes the pair of least bound, if each test's next pair is its nearest. The order of the tests changes.
    #[inline(always)]
    pub(crate) fn pop_least<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        self.nearest_last();
        self.pop(isa)
    }

    /// Moves the test whose next pair has the least bound to the end.
    #[inline(always)]
    pub(crate) fn nearest_last(&mut self) {
        let Some(last) = self.len.checked_sub(1) else { return };
        let (mut place, mut least) = (last, self.tests[last].bound());
        for (at, test) in self.tests[..last].iter().enumerate() {
            let bound = test.bound();
            (place, least) = if bound < least { (at, bound) } else { (place, least) };
        }
        self.tests.swap(place, last);
    }

    /// Returns the number of tests.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Leaves, of the tests from `start` on, only the one whose next pair has the least bound.
    #[inline(always)]
    pub(crate) fn keep_nearest(&mut self, start: usize) {
        for at in start + 1..self.len {
            if self.tests[at].bound() < self.tests[start].bound() {
                self.tests.swap(start, at);
            }
        }
        self.len = self.len.min(start + 1);
    }
}
