//! What a question about a depth is asked with: when its search ends, and shapes that have an inside.

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::query::options::{check, options};

options! {
    /// When the search for a depth ends. By default it does when the bounds are within one per cent, or when it has tried all it
    /// knows.
    ///
    /// ```
    /// use bvh_query::PenetrationOptions;
    ///
    /// let is_it_deeper_than_a_tenth = PenetrationOptions::new().tolerance(0.1);
    /// assert_eq!(is_it_deeper_than_a_tenth.relative_gap, 0.01);
    /// ```
    pub struct PenetrationOptions {
        /// It ends when the upper bound exceeds the lower one by no more than this part of it. A query refuses a part that is not
        /// above 0 or not finite.
        relative_gap(f64): f64 = 0.01,
        /// It ends when it is known whether the depth exceeds this length, in mesh units. A query refuses a length that is negative
        /// or not finite.
        tolerance(f64): Option<f64> = None,
    }
}

impl PenetrationOptions {
    /// Returns whether bounds of a depth end the search.
    pub(super) fn is_enough(&self, lower: f64, upper: f64) -> bool {
        upper <= lower * (1.0 + self.relative_gap)
            || self.tolerance.is_some_and(|tolerance| lower > tolerance || upper <= tolerance)
    }

    /// Returns an error for the numbers that every query refuses.
    ///
    /// # Errors
    /// [`QueryError::Number`] if the relative gap or the tolerance is not a valid number.
    pub fn check(&self) -> Result<(), QueryError> {
        check(NumberError::RelativeGap, self.relative_gap)?;
        if self.relative_gap == 0.0 {
            return Err(NumberError::RelativeGap(0.0).into());
        }
        self.tolerance.map_or(Ok(()), |tolerance| check(NumberError::DepthTolerance, tolerance))
    }
}

/// Refuses shapes without an inside.
pub(in crate::query) fn check_closed(a: Shape<'_>, b: Shape<'_>) -> Result<(), QueryError> {
    a.check_closed()?;
    b.check_closed()
}
