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
    walk: u32,
    /// By node: the walk that computed its value last, and where it put it.
    places: Vec<(u32, u32)>,
}

impl<T> Default for PerWalk<T> {
    fn default() -> Self {
        Self { values: Vec::new(), used: 0, walk: 0, places: Vec::new() }
    }
}

impl<T: Zeroable + Clone> PerWalk<T> {
    /// Forgets all values, before a walk.
    #[inline(always)]
    pub(super) fn start(&mut self) {
        (self.walk, self.used) = (self.walk.wrapping_add(1), 0);
        if self.walk == 0 {
            self.start_over();
        }
    }

    /// Forgets the walks of all nodes, when their numbers have been used up.
    #[cold]
    fn start_over(&mut self) {
        self.walk = 1;
        self.places.fill((0, 0));
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
            (*walk, *place) = (self.walk, self.used as u32);
            self.used += 1;
        }
        (&mut self.values[*place as usize], known)
    }

    #[cold]
    fn grow(&mut self, node: usize) {
        let places = self.places.len().max(node + 64);
        self.places.resize(places, (0, 0));
        self.values.resize(self.used + 64, T::zeroed());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_this_walk_even_when_numbers_of_walks_start_over() {
        let mut values = PerWalk::<u32> { walk: u32::MAX - 2, ..Default::default() };
        for walk in 0..6 {
            values.start();
            let met = [70, 3, 70].map(|node| {
                let (value, is_known) = values.of(node);
                (std::mem::replace(value, walk), is_known)
            });
            assert_eq!(met.map(|(_, is_known)| is_known), [false, false, true], "{walk}");
            assert_eq!(met[2].0, walk);
        }
    }
}
