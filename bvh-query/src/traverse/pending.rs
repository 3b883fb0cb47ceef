//! The pairs that a walk has still to visit, grouped by the node test that left them.
//!
//! A test writes its 16 bounds directly into the list, and a mask marks the pairs that are left. Pairs are therefore
//! neither moved nor sorted. In a depth-first walk, the last test is next. In a best-first walk, the test with the least
//! bound is next.

use crate::isa::{Isa, in_order};
use crate::traverse::cached_node::ChildRef;
use std::hint::select_unpredictable;

/// A pair of nodes to visit, and a lower bound of their distance; see `Measure`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Entry {
    pub(crate) bound: f32,
    pub(crate) a: ChildRef,
    pub(crate) b: ChildRef,
}

impl Entry {
    /// Returns the pair of both roots, with the least bound of all.
    pub(crate) fn of_roots(a: ChildRef, b: ChildRef) -> Self {
        Self { bound: f32::NEG_INFINITY, a, b }
    }
}

/// The result of a node test for 16 pairs, four nodes of A against four of B: element `4 * a + b`.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Tested {
    pub(crate) bounds: [f32; 16],
    /// The first of four children of each side.
    pub(crate) a: ChildRef,
    pub(crate) b: ChildRef,
    /// The lanes of the pairs that are left.
    pub(crate) left: u16,
}

impl Tested {
    pub(crate) const NONE: Self = Self { bounds: [0.0; 16], a: ChildRef::NONE, b: ChildRef::NONE, left: 0 };

    /// Returns the pair in a lane.
    #[inline(always)]
    pub(crate) fn entry(&self, lane: u32) -> Entry {
        let a = ChildRef::from_bits(self.a.bits() + (lane >> 2 & 3));
        let b = ChildRef::from_bits(self.b.bits() + (lane & 3));
        Entry { bound: self.bounds[lane as usize & 15], a, b }
    }
}

/// The tests that still have pairs to visit.
#[derive(Default)]
pub(crate) struct PendingTests {
    /// Each has at least one pair left. At least one longer than `len`, once room has been asked for.
    tests: Vec<Tested>,
    /// The place of each test in the order of visits: `nearest` of its pairs. As long as `tests`.
    keys: Vec<i32>,
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
        &mut self.tests[self.len]
    }

    #[cold]
    fn grow(&mut self) {
        let length = 2 * self.len + 64;
        self.tests.resize(length, Tested::NONE);
        self.keys.resize(length, 0);
    }

    /// Keeps the test in `room`, of which pairs are left. That in the lane of `key` comes first.
    #[inline(always)]
    pub(crate) fn push(&mut self, left: u16, key: i32) {
        if let Some(test) = self.tests.get_mut(self.len)
            && let Some(to) = self.keys.get_mut(self.len)
        {
            (test.left, *to) = (left, key);
            self.len += 1;
        }
    }

    /// Pushes a single pair.
    #[inline(always)]
    pub(crate) fn push_one(&mut self, entry: Entry) {
        let room = self.room();
        (room.bounds[0], room.a, room.b) = (entry.bound, entry.a, entry.b);
        self.push(1, in_order(entry.bound) & !15);
    }

    /// Takes the next pair of the last test, and finds the nearest of those that are left. Nothing waits for this until
    /// the next pair is taken.
    #[inline(always)]
    pub(crate) fn pop<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        let last = self.len.checked_sub(1)?;
        let (entry, is_last) = self.take(isa, last);
        self.len -= usize::from(is_last);
        Some(entry)
    }

    /// Takes the next pair of a test, and returns whether it was the last one that was left.
    #[inline(always)]
    fn take<I: Isa>(&mut self, isa: I, at: usize) -> (Entry, bool) {
        let (test, key) = (&mut self.tests[at], &mut self.keys[at]);
        let entry = test.entry(*key as u32 & 15);
        test.left &= !(1 << (*key & 15));
        *key = isa.nearest(&test.bounds, test.left);
        (entry, test.left == 0)
    }

    /// Drops tests from the end until the next pair may be within a limit. Each test's next pair is its nearest, so a test
    /// whose next pair is beyond the limit has none within it.
    #[inline(always)]
    pub(crate) fn drop_beyond(&mut self, limit: f32) {
        // Adding zero takes the sign from a zero.
        let limit = in_order(limit + 0.0) | 15;
        while let Some(last) = self.len.checked_sub(1)
            && self.keys[last] > limit
        {
            self.len = last;
        }
    }

    /// Takes the pair of least bound, if each test's next pair is its nearest. The order of the tests changes.
    #[inline(always)]
    pub(crate) fn pop_least<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        let at = self.nearest();
        let (entry, is_last) = self.take(isa, at);
        if is_last {
            self.len -= 1;
            self.tests[at] = self.tests[self.len];
            self.keys[at] = self.keys[self.len];
        }
        Some(entry)
    }

    /// Returns the test whose next pair has the least bound; of equal ones, the first. There is at least one test.
    #[inline(always)]
    fn nearest(&self) -> usize {
        // The last keys have just been stored, one by one. A register of them would have to wait until they are in the cache.
        let (chunks, last) = self.keys[..self.len].split_at((self.len.saturating_sub(1)) & !15);
        let chunks = chunks.as_chunks::<16>().0;
        let mut least = [i32::MAX; 16];
        for chunk in chunks {
            for lane in 0..16 {
                least[lane] = least[lane].min(chunk[lane]);
            }
        }
        let least = least.iter().chain(last).fold(i32::MAX, |least, &key| least.min(key));
        for (number, chunk) in chunks.iter().enumerate() {
            let mut found = 0u16;
            for lane in 0..16 {
                found |= u16::from(chunk[lane] == least) << lane;
            }
            if found != 0 {
                return 16 * number + found.trailing_zeros() as usize;
            }
        }
        let mut place = self.len - 1;
        for at in (16 * chunks.len()..self.len - 1).rev() {
            place = select_unpredictable(self.keys[at] == least, at, place);
        }
        place
    }

    /// Moves the test whose next pair has the least bound to the end.
    #[inline(always)]
    pub(crate) fn nearest_last(&mut self) {
        if let Some(last) = self.len.checked_sub(1) {
            let nearest = self.nearest();
            self.tests.swap(nearest, last);
            self.keys.swap(nearest, last);
        }
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
            if self.keys[at] < self.keys[start] {
                self.tests.swap(start, at);
                self.keys.swap(start, at);
            }
        }
        self.len = self.len.min(start + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::isa::{Backend, Task};
    use cbvh_testkit::Random;

    /// What is left, by bound, in a walk of random tests that is checked against a list of all pairs.
    struct Walk<'a>(&'a mut Random, bool);

    impl Task for Walk<'_> {
        type Output = ();

        #[inline(always)]
        fn run<I: Isa>(self, isa: I) {
            let Self(random, is_best_first) = self;
            let (mut pending, mut expected) = (PendingTests::default(), Vec::<(f32, u32, u32)>::new());
            let mut number = 0;
            for _ in 0..400 {
                if random.below(3) > 0 {
                    number += 1;
                    let mut bounds = [0.0; 16];
                    for bound in &mut bounds {
                        // Some are equal, and some differ in the last bits only.
                        let whole = random.below(40) as f32 - 15.0;
                        *bound = f32::from_bits(whole.to_bits() + random.below(3) as u32);
                    }
                    let left = random.bits() as u16 & random.bits() as u16;
                    let room = pending.room();
                    (room.bounds, room.a, room.b) =
                        (bounds, ChildRef::new(number, 0), ChildRef::new(number, 0));
                    if left != 0 {
                        pending.push(left, isa.nearest(&bounds, left));
                    }
                    for lane in (0..16).filter(|lane| left >> lane & 1 == 1) {
                        let child = |at: usize| ChildRef::new(number, at).bits();
                        expected.push((bounds[lane], child(lane / 4), child(lane % 4)));
                    }
                }
                if !is_best_first && random.below(8) == 0 {
                    let limit = [random.below(40) as f32 - 15.0, -0.0][random.below(2)];
                    pending.drop_beyond(limit);
                    // Only pairs beyond the limit are gone: what is left is popped below.
                    expected.retain(|pair| pair.0 <= limit || is_left(&pending, pair));
                }
                let found = if is_best_first { pending.pop_least(isa) } else { pending.pop(isa) };
                assert_eq!(found.is_none(), expected.is_empty());
                let Some(found) = found else { continue };
                let pair = (found.bound, found.a.bits(), found.b.bits());
                let at = expected.iter().position(|left| *left == pair).expect("a pair that is left");
                if is_best_first {
                    let least = expected.iter().map(|pair| pair.0).min_by(f32::total_cmp).unwrap();
                    assert!(in_order(pair.0) >> 4 <= in_order(least) >> 4, "{pair:?} {least}");
                }
                expected.swap_remove(at);
            }
        }
    }

    fn is_left(pending: &PendingTests, (_, a, b): &(f32, u32, u32)) -> bool {
        let of = |at: u32| ChildRef::from_bits(at);
        pending.tests[..pending.len].iter().any(|test| {
            let lane = 4 * of(*a).child() + of(*b).child();
            test.a.node() == of(*a).node() && test.left >> lane & 1 == 1
        })
    }

    #[test]
    fn no_pair_is_lost_and_the_nearest_comes_first() {
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let random = &mut Random::new(8);
            for round in 0..50 {
                backend.run(Walk(random, round % 2 == 0));
            }
        }
    }
}
