//! What a walk computes of opened nodes, kept under the number of the node.

use bytemuck::Zeroable;

/// A value for each opened node, and what it was computed for: the generation of nodes.
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

/// A value for each of the nodes that a walk meets. The values of one walk lie side by side, in the order in which
/// they were computed, so that they stay in the first caches however many nodes are open.
pub(super) struct PerWalk<T> {
    values: Vec<T>,
    /// How many values this walk has computed.
    used: usize,
    /// The number of the walk, not 0.
    walk: u64,
    /// By node: the walk that computed its value last, and where it put it.
    places: Vec<(u64, usize)>,
}

impl<T> Default for PerWalk<T> {
    fn default() -> Self {
        Self { values: Vec::new(), used: 0, walk: 0, places: Vec::new() }
    }
}

impl<T: Zeroable + Clone> PerWalk<T> {
    /// Forgets all values, for a walk of a number of its own.
    pub(super) fn start(&mut self, walk: u64) {
        (self.walk, self.used) = (walk, 0);
    }

    /// Returns the value of a node, and whether this walk has computed it. If it has not, the caller computes it.
    #[inline(always)]
    pub(super) fn of(&mut self, node: usize) -> (&mut T, bool) {
        if self.places.len() <= node || self.values.len() <= self.used {
            self.grow(node);
        }
        let (walk, place) = &mut self.places[node];
        let known = *walk == self.walk;
        if !known {
            (*walk, *place) = (self.walk, self.used);
            self.used += 1;
        }
        (&mut self.values[*place], known)
    }

    /// Returns the value of a node as it is. It has one: a call of `of` has computed it.
    #[inline(always)]
    pub(super) fn get(&self, node: usize) -> &T {
        &self.values[self.places[node].1]
    }

    #[cold]
    fn grow(&mut self, node: usize) {
        let places = self.places.len().max(node + 64);
        self.places.resize(places, (0, 0));
        self.values.resize(self.used + 64, T::zeroed());
    }
}
