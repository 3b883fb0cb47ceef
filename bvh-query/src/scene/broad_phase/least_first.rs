//! What a search of the trees has yet to look at, in the order of a number.

use std::cmp::Ordering;

/// Something with a number. The greatest has the least number, so that a heap gives it first; of equal numbers, that of the
/// least thing is first.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeastFirst<T> {
    pub(super) number: f64,
    pub(super) of: T,
}

impl<T: Ord> Ord for LeastFirst<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        other.number.total_cmp(&self.number).then_with(|| other.of.cmp(&self.of))
    }
}

impl<T: Ord> PartialOrd for LeastFirst<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T: Ord> PartialEq for LeastFirst<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T: Ord> Eq for LeastFirst<T> {}
