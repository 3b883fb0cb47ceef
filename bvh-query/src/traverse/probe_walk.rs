//! The walk of one tree on which questions about lines stand: up to four probes at a time.
//!
//! ```text
//! entries := {(root, all probes)}
//! while entry := pop(entries):
//!     leave out the probes for which its bound exceeds their limit; if none is left: skip
//!     if the node is a leaf packet: visitor.leaf(packet, probes)
//!     else open it; for each of its children and each probe:
//!         bound := lower bound of their distance
//!         if bound <= limit of the probe: keep, the nearest child next
//! ```
//!
//! A node test has four children in rows and four probes in columns: the sixteen lanes of the pair walk. The walk ends as that
//! of pairs does, because a file is a tree, and has at most two frames for each level.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::node_cache::{ChildRef, NodeCache};
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use std::ops::ControlFlow;

/// How many probes walk together.
pub(crate) const PROBES: usize = 4;

/// What a question does with the leaf packets that a walk meets.
pub(crate) trait ProbeVisitor {
    /// Bounds four children against all probes: element `4 * child + probe`.
    fn bound<I: Isa>(&self, isa: I, children: &Group) -> I::V;

    /// Returns the limit of each probe: what has a larger bound is not visited.
    fn limits(&self) -> &[f32; PROBES];

    /// Visits a leaf packet with the probes whose bits are set.
    fn leaf<I: Isa>(&mut self, isa: I, leaf: LeafPacket, probes: u16) -> Result<ControlFlow<()>, QueryError>;
}

/// The result of a node test: what is left of four children against four probes.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct ProbeFrame {
    bounds: [f32; 16],
    /// The first of the four children.
    first: ChildRef,
    /// The lanes that are left.
    left: u16,
}

/// A walk of an object.
pub(crate) struct ProbeWalk<'a, V> {
    pub(crate) bvh: &'a Bvh,
    pub(crate) object: &'a Object,
    pub(crate) nodes: &'a mut NodeCache,
    pub(crate) stack: &'a mut Vec<ProbeFrame>,
    /// The visits that may still be made.
    pub(crate) left: &'a mut u64,
    pub(crate) budget: u64,
    /// How many probes there are.
    pub(crate) probes: usize,
    pub(crate) visitor: &'a mut V,
}

impl<V: ProbeVisitor> Task for ProbeWalk<'_, V> {
    /// The number of node tests.
    type Output = Result<u64, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(mut self, isa: I) -> Self::Output {
        self.nodes.start(isa, self.bvh, self.object)?;
        self.stack.clear();
        let all = (1u16 << self.probes) - 1;
        self.stack.push(ProbeFrame { bounds: [0.0; 16], first: ChildRef::ROOT, left: all });
        let mut tests = 0;
        while let Some(frame) = self.stack.last_mut() {
            let limits = isa.tile(self.visitor.limits());
            let live = frame.left & I::V::bits(isa.load(&frame.bounds).le(limits));
            if live == 0 {
                self.stack.pop();
                continue;
            }
            let child = (isa.least(&frame.bounds, live) as usize / 4) & 3;
            let probes = (live >> (4 * child)) & 0xf;
            frame.left = live & !(0xf << (4 * child));
            let at = ChildRef::from_bits(frame.first.bits() + child as u32);
            if frame.left == 0 {
                self.stack.pop();
            }
            *self.left = self.left.checked_sub(1).ok_or(QueryError::Budget { visits: self.budget })?;
            if let Some(leaf) = self.nodes.get(at.node()).leaf(at.child()) {
                let visit = VisitLeaf { visitor: &mut *self.visitor, leaf, probes };
                if isa.run(visit)?.is_break() {
                    break;
                }
                continue;
            }
            let number = self.nodes.open(isa, self.bvh, self.object, at)?;
            tests += self.push_children(isa, number, probes);
        }
        Ok(tests)
    }
}

impl<V: ProbeVisitor> ProbeWalk<'_, V> {
    /// Tests all children of a node and keeps those within the limits, the nearest one next.
    #[inline(always)]
    fn push_children<I: Isa>(&mut self, isa: I, number: usize, probes: u16) -> u64 {
        let node = self.nodes.get(number);
        let limits = isa.tile(self.visitor.limits());
        let parts = node.count.div_ceil(4);
        let mut nearest = f32::INFINITY;
        for part in 0..parts {
            let bounds = self.visitor.bound(isa, &node.groups[part & 1]);
            let children = (node.count - 4 * part).min(4);
            let exist = ((1u32 << (4 * children)) - 1) as u16 & (0x1111 * probes);
            let left = I::V::bits(bounds.le(limits)) & exist;
            if left == 0 {
                continue;
            }
            let mut frame = ProbeFrame { bounds: [0.0; 16], first: ChildRef::new(number, 4 * part), left };
            isa.store(bounds, &mut frame.bounds);
            let least = frame.bounds[isa.least(&frame.bounds, left) as usize & 15];
            let at = self.stack.len();
            self.stack.push(frame);
            if part == 1 && least > nearest {
                self.stack.swap(at - 1, at);
            }
            nearest = least;
        }
        parts as u64
    }
}

/// Visits a leaf packet.
struct VisitLeaf<'a, V> {
    visitor: &'a mut V,
    leaf: LeafPacket,
    probes: u16,
}

impl<V: ProbeVisitor> Task for VisitLeaf<'_, V> {
    type Output = Result<ControlFlow<()>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.visitor.leaf(isa, self.leaf, self.probes)
    }
}
