//! The numbers that a caller gives with a question, and the checks on them.

use crate::error::{NumberError, QueryError};

/// How exact a distance has to be. By default it is exact.
///
/// ```
/// use bvh_query::DistanceOptions;
///
/// let within_a_percent = DistanceOptions::new().rel_err(0.01);
/// assert_eq!(within_a_percent.abs_err, 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct DistanceOptions {
    /// The answer may exceed the least distance by this fraction of it.
    pub rel_err: f64,
    /// The answer may exceed the least distance by this length as well, in mesh units.
    pub abs_err: f64,
}

impl DistanceOptions {
    /// Asks for the exact distance.
    pub fn new() -> Self {
        Self::default()
    }

    /// Lets the answer exceed the least distance by this fraction of it. A query refuses a fraction that is negative or
    /// not finite.
    #[must_use]
    pub fn rel_err(self, rel_err: f64) -> Self {
        Self { rel_err, ..self }
    }

    /// Lets the answer exceed the least distance by this length, in mesh units. A query refuses a length that is
    /// negative or not finite.
    #[must_use]
    pub fn abs_err(self, abs_err: f64) -> Self {
        Self { abs_err, ..self }
    }

    /// Refuses invalid errors.
    pub(super) fn check(&self) -> Result<(), QueryError> {
        check(NumberError::RelErr, self.rel_err)?;
        check(NumberError::AbsErr, self.abs_err)
    }
}

/// Refuses a distance to compare with that is NaN, infinite or negative.
pub(crate) fn check_distance(d: f64) -> Result<(), QueryError> {
    check(NumberError::Distance, d)
}

/// Refuses a number that is NaN, infinite or negative.
pub(crate) fn check(wrong: fn(f64) -> NumberError, found: f64) -> Result<(), QueryError> {
    if found.is_finite() && found >= 0.0 { Ok(()) } else { Err(wrong(found).into()) }
}
