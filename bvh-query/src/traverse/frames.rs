//! The pairs that a walk has still to visit, in one frame per node test.
//!
//! A test writes its 16 bounds straight into a frame, and the frame marks the pairs that are left in a mask. So pairs are
//! neither moved nor sorted, and no branch depends on how many there are. Depth-first, the last frame is next;
//! best-first, the frame with the least bound.

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
    const NONE: Self = Self { bounds: [0.0; 16], a: ChildRef::ROOT, b: ChildRef::ROOT };

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
struct Frame {
    tested: Tested,
    /// The lanes of the pairs that are left.
    left: u16,
    /// The lane to take next.
    next: u32,
}

impl Frame {
    /// Returns the bound of the next pair.
    #[inline(always)]
    fn bound(&self) -> f32 {
        self.tested.bounds[self.next as usize & 15]
    }
}

/// The frames of the tests that still have pairs.
#[derive(Default)]
pub(crate) struct Frames {
    /// At least one longer than `len`, once a frame has been asked for.
    frames: Vec<Frame>,
    len: usize,
}

impl Frames {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns room for the next test. `push` makes a frame of it.
    #[inline(always)]
    pub(crate) fn room(&mut self) -> &mut Tested {
        if self.frames.len() <= self.len {
            self.grow();
        }
        &mut self.frames[self.len].tested
    }

    #[cold]
    fn grow(&mut self) {
        self.frames.resize(2 * self.len + 64, Frame { tested: Tested::NONE, left: 0, next: 0 });
    }

    /// Makes a frame of the test in `room`, unless no pairs are left. The pair in lane `first` comes first.
    #[inline(always)]
    pub(crate) fn push(&mut self, left: u16, first: u32) {
        if let Some(frame) = self.frames.get_mut(self.len) {
            (frame.left, frame.next) = (left, first);
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

    /// Takes the next pair of the last frame, and finds the nearest of those that are left: nothing waits for that before
    /// the next pair is taken.
    #[inline(always)]
    pub(crate) fn pop<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        let last = self.len.checked_sub(1)?;
        let frame = &mut self.frames[last];
        let entry = frame.tested.entry(frame.next);
        frame.left &= !(1 << (frame.next & 15));
        frame.next = isa.least(&frame.tested.bounds, frame.left);
        self.len -= usize::from(frame.left == 0);
        Some(entry)
    }

    /// Takes the pair of least bound, if each frame's next pair is its nearest. The order of the frames changes.
    #[inline(always)]
    pub(crate) fn pop_least<I: Isa>(&mut self, isa: I) -> Option<Entry> {
        self.nearest_last();
        self.pop(isa)
    }

    /// Moves the frame whose next pair has the least bound to the end.
    #[inline(always)]
    pub(crate) fn nearest_last(&mut self) {
        let Some(last) = self.len.checked_sub(1) else { return };
        let (mut place, mut least) = (last, self.frames[last].bound());
        for (at, frame) in self.frames[..last].iter().enumerate() {
            let bound = frame.bound();
            (place, least) = if bound < least { (at, bound) } else { (place, least) };
        }
        self.frames.swap(place, last);
    }

    /// Returns the number of frames.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Leaves, of the frames from `start` on, only the one whose next pair has the least bound.
    #[inline(always)]
    pub(crate) fn keep_nearest(&mut self, start: usize) {
        for at in start + 1..self.len {
            if self.frames[at].bound() < self.frames[start].bound() {
                self.frames.swap(start, at);
            }
        }
        self.len = self.len.min(start + 1);
    }
}
