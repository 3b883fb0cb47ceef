//! What a walk computes of opened nodes, kept under the number of the node.

use bytemuck::Zeroable;

/// A value for each opened node, and what it was computed for: the number of a walk, or the generation of nodes.
pub(super) struct PerNode<T> {
    values: Vec<T>,
    /// 0 for none. In a list of their own, so that looking for a value touches only one cache line.
    computed_for: Vec<u64>,
}

impl<T> Default for PerNode<T> {
    fn default() -> Self {
        Self { values: Vec::new(), computed_for: Vec::new() }
    }
}

impl<T: Zeroable + Clone> PerNode<T> {
    /// Returns the value of a node, and whether it was computed for `what`, which is not 0. If it was not, the caller
    /// computes it.
    #[inline(always)]
    pub(super) fn of(&mut self, node: usize, what: u64) -> (&mut T, bool) {
        if self.computed_for.len() <= node {
            self.grow(node);
        }
        let known = std::mem::replace(&mut self.computed_for[node], what) == what;
        (&mut self.values[node], known)
    }

    /// Returns the value of a node as it is. It has one: a call of `of` has computed it.
    #[inline(always)]
    pub(super) fn get(&self, node: usize) -> &T {
        &self.values[node]
    }

    #[cold]
    fn grow(&mut self, node: usize) {
        self.values.resize(node + 64, T::zeroed());
        self.computed_for.resize(node + 64, 0);
    }
}
