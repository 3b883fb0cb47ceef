//! What every answer has, whatever the question.

use crate::console::significant;
use bvh_format::checksum::Hasher;

/// An answer.
pub(crate) trait Answer {
    /// Returns whether the answer counts among the positives.
    fn is_positive(&self) -> bool;

    /// Returns the answer as a number, of which the record has the sum.
    fn value(&self) -> f64;

    /// Returns the raw line, without nanoseconds.
    fn raw(&self) -> String {
        significant(self.value())
    }

    /// Hashes what the raw line tells.
    fn hash(&self, hasher: &mut Hasher);
}
