//! Decides when the slab test is made, and keeps what it computes of nodes.
//!
//! A slab test costs about a third of a node test, so it must pay. Short walks make none, and a walk in which slabs
//! have separated too few pairs skips some tests. Answers do not depend on this.

use crate::isa::{Isa, Task};
use crate::traverse::node_cache::NodeCache;
use crate::traverse::node_filter::{Measure, NodeFilter};
use crate::traverse::pending::Tested;
use crate::traverse::per_node::PerNode;
use crate::traverse::placement::ObjectPair;
use crate::traverse::slab_filter::{SlabFilter, TurningGroup};

/// Builds with debug assertions, which tests are, make all slab tests, so that small meshes take part.
const ALWAYS: bool = cfg!(debug_assertions);
/// Node tests of a walk before slab tests begin.
const NODE_TESTS_BEFORE_SLABS: u32 = if ALWAYS { 0 } else { 24 };
/// The saving for each separated pair, in slab tests.
const TESTS_SAVED_PER_PAIR: i32 = 2;
/// The most that past savings count, in slab tests.
const MAX_BALANCE: i32 = 6;
/// When slab tests have cost this many more than they saved, they are left out for a while.
const MAX_LOSS: i32 = 3;
/// The length of the first pause, in node tests. Each further one is twice as long, until slabs pay again.
const FIRST_PAUSE: u32 = 24;

/// The slab test of the walk under way, and what it needs of opened nodes.
#[derive(Default)]
pub(crate) struct SlabMemory {
    /// The turning slabs of opened nodes.
    groups: PerNode<TurningGroup>,
    test: Option<Box<SlabFilter>>,
    /// The walk for which `test` was prepared.
    prepared: u64,
    /// The number of the walk under way.
    walk: u64,
    /// Whether the profiles of both sides have turning slabs.
    applies: bool,
    /// The number of node tests that are still made without.
    pause: u32,
    /// What slab tests have saved, less their number.
    balance: i32,
    /// The length of the next pause.
    next_pause: u32,
}

impl SlabMemory {
    /// Starts a walk, which has a number of its own.
    pub(crate) fn start(&mut self, walk: u64, pair: &ObjectPair<'_>) {
        self.walk = walk;
        self.applies =
            pair.object_a.profile().has_turning_slabs() && pair.object_b.profile().has_turning_slabs();
        (self.pause, self.balance, self.next_pause) = (NODE_TESTS_BEFORE_SLABS, 0, FIRST_PAUSE);
    }

    /// Makes no slab test in this walk.
    pub(crate) fn stop(&mut self) {
        self.applies = false;
    }

    /// Returns whether the next slab test is to be made.
    #[inline(always)]
    pub(crate) fn are_due(&mut self) -> bool {
        let due = self.pause == 0;
        self.pause = self.pause.saturating_sub(1);
        due && self.applies
    }
}

/// Tests pairs that a node test has left along their turning slabs, and returns the lanes that are left.
pub(crate) struct TestSlabs<'a> {
    pub(crate) memory: &'a mut SlabMemory,
    pub(crate) node_filter: &'a NodeFilter,
    pub(crate) measure: Measure,
    pub(crate) nodes: &'a NodeCache,
    /// The nodes of A and of B.
    pub(crate) numbers: (usize, usize),
    pub(crate) limit: f32,
    pub(crate) tested: &'a mut Tested,
    pub(crate) mask: u16,
}

impl Task for TestSlabs<'_> {
    type Output = u16;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> u16 {
        let Self { memory, node_filter, measure, nodes, numbers: (number_a, number_b), limit, tested, mask } =
            self;
        let (node_a, node_b) = (nodes.get(number_a), nodes.get(number_b));
        if !node_a.turning.any() && !node_b.turning.any() {
            return mask;
        }
        let test = memory.test.get_or_insert_with(|| Box::new(SlabFilter::NONE));
        if memory.prepared != memory.walk {
            memory.prepared = memory.walk;
            prepare(test, node_filter);
        }
        let groups = &mut memory.groups;
        for (number, node) in [(number_a, node_a), (number_b, node_b)] {
            let (group, is_known) = groups.of(number, nodes.generation());
            if !is_known {
                group.decode(isa, &node.turning, &node.group);
            }
        }
        let (group_a, group_b) = (groups.get(number_a), groups.get(number_b));
        let left = mask & test.run(isa, measure, (group_a, group_b), limit, &mut tested.bounds);
        let apart = (mask & !left).count_ones() as i32;
        memory.balance += TESTS_SAVED_PER_PAIR * apart - 1;
        if memory.balance > MAX_BALANCE {
            (memory.balance, memory.next_pause) = (MAX_BALANCE, FIRST_PAUSE);
        } else if memory.balance < -MAX_LOSS && !ALWAYS {
            (memory.balance, memory.pause) = (0, memory.next_pause);
            memory.next_pause = memory.next_pause.saturating_mul(2);
        }
        left
    }
}

#[inline(never)]
fn prepare(test: &mut SlabFilter, node_filter: &NodeFilter) {
    let placement = node_filter.placement();
    test.prepare(placement, &placement.inverse(), node_filter.magnitudes());
}
