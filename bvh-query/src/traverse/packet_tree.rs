//! The boxes of all leaf packets of a shape, four in one, and all pairs of packets whose boxes overlap.
//!
//! A shape that is compared with itself meets all of its packets, in a pose that turns nothing. A pair walk would keep some
//! KiB for each treelet, and align slabs that are aligned already. So this tree has only boxes. Level 0 has those of the
//! packets in the order of the file, in which neighbours are near each other, and each box of the next level holds four of
//! them. Its shape follows from the number of packets alone, whatever the file states.
//!
//! ```text
//! pairs := {(root, root)}
//! while (a, b) := pop(pairs):
//!     for each child of a and each child of b whose boxes overlap, if a is b only for those with child a <= child b:
//!         push them, or visit them if they are packets
//! ```
//!
//! So each unordered pair is visited at most once. For each level, at most 16 pairs wait.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes};
use crate::traverse::budget::Budget;
use std::ops::ControlFlow;

/// The boxes of four triangles, packets or nodes: `[axis][place]`. In an empty place, there is a box that overlaps none.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Boxes {
    pub(crate) lo: [[f32; 4]; 3],
    pub(crate) hi: [[f32; 4]; 3],
}

impl Boxes {
    pub(crate) const EMPTY: Self = Self { lo: [[f32::INFINITY; 4]; 3], hi: [[f32::NEG_INFINITY; 4]; 3] };

    /// Returns a bit for each pair of boxes that overlap: bit `4 * a + b`.
    #[inline(always)]
    pub(crate) fn overlapping<I: Isa>(&self, isa: I, other: &Self) -> u16 {
        let mut mask = u16::MAX;
        for axis in 0..3 {
            let below = isa.repeat(&self.lo[axis]).le(isa.tile(&other.hi[axis]));
            let above = isa.tile(&other.lo[axis]).le(isa.repeat(&self.hi[axis]));
            mask &= I::F32x16::bits(below) & I::F32x16::bits(above);
        }
        mask
    }

    /// Puts the box of four others in a place.
    #[inline(always)]
    fn put(&mut self, place: usize, of: &Self) {
        for axis in 0..3 {
            let (lo, hi) = (&of.lo[axis], &of.hi[axis]);
            self.lo[axis][place & 3] = lo[1..].iter().fold(lo[0], |x, &y| if y < x { y } else { x });
            self.hi[axis][place & 3] = hi[1..].iter().fold(hi[0], |x, &y| if y > x { y } else { x });
        }
    }
}

/// The pairs of places of the same four boxes in which the first is not behind the second.
const IN_ORDER: u16 = 0b1000_1100_1110_1111;
/// Those in which the first is before the second.
pub(crate) const BEFORE: u16 = 0b0000_1000_1100_1110;

/// What is done with a pair of packets: their numbers, of which the first is not larger.
pub(crate) trait PacketVisitor {
    fn packets<I: Isa>(
        &mut self,
        isa: I,
        pair: (u32, u32),
        budget: &mut Budget,
    ) -> Result<ControlFlow<()>, QueryError>;
}

/// The leaf packets of a shape, and the boxes around them: 44 bytes per packet, and as much again while they grow.
#[derive(Default)]
pub(crate) struct PacketTree {
    /// The place of the object in the shape, and the packet.
    packets: Vec<(u32, LeafPacket)>,
    /// From the packets to the root.
    levels: Vec<Vec<Boxes>>,
}

impl PacketTree {
    /// Appends a packet of an object, with the boxes of its triangles. All packets come before `build`.
    #[inline(always)]
    pub(crate) fn push(&mut self, object: u32, leaf: LeafPacket, boxes: &Boxes) {
        if self.levels.is_empty() {
            self.levels.push(Vec::new());
        }
        put(&mut self.levels[0], self.packets.len(), boxes);
        self.packets.push((object, leaf));
    }

    /// Builds the levels above the packets.
    pub(crate) fn build(&mut self) {
        while let Some(level) = self.levels.last().filter(|level| level.len() > 1) {
            let mut above = Vec::with_capacity(level.len().div_ceil(4));
            level.iter().enumerate().for_each(|(place, boxes)| put(&mut above, place, boxes));
            self.levels.push(above);
        }
    }

    /// Returns the packets by their numbers, in the order of the file: the place of the object in the shape, and the packet.
    pub(crate) fn packets(&self) -> &[(u32, LeafPacket)] {
        &self.packets
    }

    /// Visits all pairs of packets whose boxes overlap, a packet and itself included, until the visitor breaks. Each pair of
    /// nodes and of packets counts as a visit.
    #[inline(always)]
    pub(crate) fn visit_pairs<I: Isa, V: PacketVisitor>(
        &self,
        isa: I,
        budget: &mut Budget,
        visitor: &mut V,
    ) -> Result<(), QueryError> {
        let Some(root) = self.levels.len().checked_sub(1) else { return Ok(()) };
        let mut waiting = vec![(root, 0, 0)];
        while let Some((level, a, b)) = waiting.pop() {
            budget.visit()?;
            let boxes = &self.levels[level];
            let mut mask = boxes[a as usize].overlapping(isa, &boxes[b as usize]);
            mask &= if a == b { IN_ORDER } else { u16::MAX };
            while mask != 0 {
                let lane = mask.trailing_zeros();
                mask &= mask - 1;
                let (a, b): (u32, u32) = (4 * a + lane / 4, 4 * b + lane % 4);
                if level > 0 {
                    waiting.push((level - 1, a, b));
                    continue;
                }
                budget.visit()?;
                if visitor.packets(isa, (a, b), budget)?.is_break() {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

/// Puts the box of four others in the next place of a level.
#[inline(always)]
fn put(level: &mut Vec<Boxes>, place: usize, of: &Boxes) {
    if place.is_multiple_of(4) {
        level.push(Boxes::EMPTY);
    }
    let Some(boxes) = level.last_mut() else { unreachable!("the first place makes four") };
    boxes.put(place, of);
}
