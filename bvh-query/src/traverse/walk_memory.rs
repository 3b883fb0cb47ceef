//! The memory of walks, kept from one query to the next, and the budget of the query under way.

use crate::file::bvh::Bvh;
use crate::file::ray_tree::RayTree;
use crate::traverse::budget::Budget;
use crate::traverse::probe_walk::{ProbeStack, ProbeVisitor, ProbeWalk};
use crate::traverse::ray_walk::{BoxFilter, RayVisitor, RayWalk};
use crate::traverse::walk::PairMemory;
use bvh_format::object::Object;

/// What walks need, and how many visits are left to a query.
#[derive(Default)]
pub(crate) struct WalkMemory {
    pub(crate) pairs: PairMemory,
    probes: ProbeStack,
    rays: Vec<u64>,
    pub(crate) budget: Budget,
}

impl WalkMemory {
    /// Returns a walk of the tree that rays have of an object.
    pub(crate) fn ray_walk<'a, V: RayVisitor>(
        &'a mut self,
        tree: &'a RayTree,
        filter: BoxFilter,
        visitor: &'a mut V,
    ) -> RayWalk<'a, V> {
        RayWalk { tree, filter, stack: &mut self.rays, visitor }
    }

    /// Returns a walk of one object for a probe.
    pub(crate) fn probe_walk<'a, V: ProbeVisitor>(
        &'a mut self,
        bvh: &'a Bvh,
        object: &'a Object,
        visitor: &'a mut V,
    ) -> ProbeWalk<'a, V> {
        ProbeWalk { bvh, object, stack: &mut self.probes, budget: &mut self.budget, visitor }
    }
}
