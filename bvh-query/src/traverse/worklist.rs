//! The work list of a walk: pairs of nodes still to visit, appended 16 lanes at a time and taken from the end or where
//! the bound is least.
//!
//! Keys, nodes of A and nodes of B are separate arrays. So the survivors of a node test are moved here in a few
//! instructions without a branch, and the least key is found in vector registers.

use crate::isa::Isa;
use crate::traverse::node_cache::ChildRef;

/// A pair of nodes to visit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Entry {
    /// The bits of the bound, made to compare as the bound does.
    key: u32,
    pub(crate) a: ChildRef,
    pub(crate) b: ChildRef,
}

impl Entry {
    /// Both roots, with the least bound of all, minus infinity.
    pub(crate) const ROOTS: Self = Self { key: 0x007f_ffff, a: ChildRef::ROOT, b: ChildRef::ROOT };

    #[inline(always)]
    pub(crate) fn bound(self) -> f32 {
        f32::from_bits(if self.key >> 31 == 1 { self.key & !(1 << 31) } else { !self.key })
    }
}

/// Converts a bound to bits that compare as bounds do.
#[inline(always)]
fn key(bound: f32) -> u32 {
    let bits = bound.to_bits();
    let flip = (bits as i32 >> 31) as u32 | 1 << 31;
    bits ^ flip
}

/// The result of a node test for 16 pairs, four nodes of A against four of B: element `4 * a + b`.
#[derive(Clone, Copy)]
pub(crate) struct Tested {
    pub(crate) keys: [u32; 16],
    pub(crate) a: [u32; 16],
    pub(crate) b: [u32; 16],
}

impl Tested {
    /// `a` and `b` are the first of four children each.
    #[inline(always)]
    pub(crate) fn new(bounds: &[f32; 16], a: ChildRef, b: ChildRef) -> Self {
        let mut tested = Self { keys: [0; 16], a: [0; 16], b: [0; 16] };
        for lane in 0..16 {
            tested.keys[lane] = key(bounds[lane]);
            tested.a[lane] = a.bits() + lane as u32 / 4;
            tested.b[lane] = b.bits() + lane as u32 % 4;
        }
        tested
    }
}

/// Pairs of nodes in the order in which they were added.
#[derive(Default)]
pub(crate) struct Worklist {
    /// All three arrays are at least 16 longer than `len`, so that whole registers can be stored.
    keys: Vec<u32>,
    a: Vec<u32>,
    b: Vec<u32>,
    len: usize,
}

impl Worklist {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    fn make_room(&mut self) {
        if self.keys.len() < self.len + 32 {
            self.grow();
        }
    }

    #[cold]
    fn grow(&mut self) {
        let room = 2 * self.len + 64;
        self.keys.resize(room, 0);
        self.a.resize(room, 0);
        self.b.resize(room, 0);
    }

    #[inline(always)]
    pub(crate) fn push(&mut self, entry: Entry) {
        self.make_room();
        let at = self.len;
        (self.keys[at], self.a[at], self.b[at]) = (entry.key, entry.a.bits(), entry.b.bits());
        self.len += 1;
    }

    /// Appends the pairs in the lanes of a mask.
    #[inline(always)]
    pub(crate) fn append<I: Isa>(&mut self, isa: I, tested: &Tested, mask: u16) {
        self.make_room();
        let at = self.len;
        let room = (
            self.keys.get_mut(at..).and_then(|rest| rest.first_chunk_mut()),
            self.a.get_mut(at..).and_then(|rest| rest.first_chunk_mut()),
            self.b.get_mut(at..).and_then(|rest| rest.first_chunk_mut()),
        );
        if let (Some(keys), Some(a), Some(b)) = room {
            isa.compress(mask, &tested.keys, keys);
            isa.compress(mask, &tested.a, a);
            isa.compress(mask, &tested.b, b);
            self.len += mask.count_ones() as usize;
        }
    }

    #[inline(always)]
    pub(crate) fn get(&self, at: usize) -> Entry {
        Entry { key: self.keys[at], a: ChildRef::from_bits(self.a[at]), b: ChildRef::from_bits(self.b[at]) }
    }

    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        Some(self.get(self.len))
    }

    /// Removes the first pair of the least key. The last pair takes its place.
    #[inline(always)]
    pub(crate) fn pop_least(&mut self) -> Option<Entry> {
        let keys = &self.keys[..self.len];
        let least = keys.iter().fold(u32::MAX, |least, &key| least.min(key));
        let place = keys.iter().position(|&key| key == least)?;
        self.swap(place, self.len - 1);
        self.pop()
    }

    /// Moves the pair of least bound from `start` on to the end, where it is popped first. A full sort gains little and
    /// costs several mispredicted branches.
    #[inline(always)]
    pub(crate) fn nearest_last(&mut self, start: usize) {
        let keys = &self.keys[start..self.len];
        let Some(last) = keys.len().checked_sub(1) else { return };
        let mut least = last;
        for index in 0..last {
            least = if keys[index] < keys[least] { index } else { least };
        }
        self.swap(start + least, start + last);
    }

    #[inline(always)]
    fn swap(&mut self, i: usize, j: usize) {
        self.keys.swap(i, j);
        self.a.swap(i, j);
        self.b.swap(i, j);
    }

    /// Reverses the pairs from `start` on.
    pub(crate) fn reverse(&mut self, start: usize) {
        self.keys[start..self.len].reverse();
        self.a[start..self.len].reverse();
        self.b[start..self.len].reverse();
    }

    /// Leaves only the last pair from `start` on.
    #[inline(always)]
    pub(crate) fn keep_last(&mut self, start: usize) {
        if self.len > start {
            self.swap(start, self.len - 1);
            self.len = start + 1;
        }
    }

    /// Moves all pairs from `start` on to `other`, in order.
    #[inline(always)]
    pub(crate) fn move_to(&mut self, start: usize, other: &mut Self) {
        (start..self.len).for_each(|at| other.push(self.get(at)));
        self.len = start;
    }
}
