//! The pairs of leaf packets that a walk has met, appended 16 lanes at a time and visited several at a time.
//!
//! Bounds, nodes of A and nodes of B are separate arrays, so the survivors of a node test are appended in a few
//! instructions without a branch.

use crate::isa::Isa;
use crate::traverse::node_cache::ChildRef;
use crate::traverse::pending::{Entry, Tested};

/// Pairs of leaf packets in the order in which they were met.
#[derive(Default)]
pub(crate) struct LeafPairs {
    /// All three arrays are at least 16 longer than `len`, so that whole registers can be stored.
    bounds: Vec<f32>,
    a: Vec<u32>,
    b: Vec<u32>,
    len: usize,
}

impl LeafPairs {
    pub(crate) fn clear(&mut self) {
        self.len = 0;
    }

    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    #[inline(always)]
    fn make_room(&mut self) {
        if self.bounds.len() < self.len + 32 {
            self.grow();
        }
    }

    #[cold]
    fn grow(&mut self) {
        let room = 2 * self.len + 64;
        self.bounds.resize(room, 0.0);
        self.a.resize(room, 0);
        self.b.resize(room, 0);
    }

    /// Appends the pairs in the lanes of a mask.
    #[inline(always)]
    pub(crate) fn append<I: Isa>(&mut self, isa: I, tested: &Tested, mask: u16) {
        self.make_room();
        let at = self.len;
        let room = (
            self.bounds.get_mut(at..).and_then(|rest| rest.first_chunk_mut::<16>()),
            self.a.get_mut(at..).and_then(|rest| rest.first_chunk_mut()),
            self.b.get_mut(at..).and_then(|rest| rest.first_chunk_mut()),
        );
        if let (Some(bounds), Some(a), Some(b)) = room {
            let lanes: [u32; 16] = std::array::from_fn(|lane| lane as u32);
            isa.compress(mask, bytemuck::cast_ref(&tested.bounds), bytemuck::cast_mut(bounds));
            isa.compress(mask, &lanes.map(|lane| tested.a.bits() + lane / 4), a);
            isa.compress(mask, &lanes.map(|lane| tested.b.bits() + lane % 4), b);
            self.len += mask.count_ones() as usize;
        }
    }

    #[inline(always)]
    pub(crate) fn get(&self, at: usize) -> Entry {
        let (a, b) = (ChildRef::from_bits(self.a[at]), ChildRef::from_bits(self.b[at]));
        Entry { bound: self.bounds[at], a, b }
    }
}
