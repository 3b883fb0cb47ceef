//! The numbers that a caller gives with a question, and the checks on them.

use crate::error::{NumberError, QueryError};

/// Defines the options of a question: a struct with public fields, their defaults, and for each field a method that sets it.
/// `name(given): kept = default` is a field that is set by a value of the type `given`.
macro_rules! options {
    (
        $(#[$about:meta])*
        pub struct $options:ident {
            $($(#[$doc:meta])* $name:ident($given:ty): $kept:ty = $default:expr,)*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[non_exhaustive]
        pub struct $options {
            $($(#[$doc])* pub $name: $kept,)*
        }

        impl Default for $options {
            fn default() -> Self {
                Self { $($name: $default,)* }
            }
        }

        impl $options {
            /// Returns the defaults.
            pub fn new() -> Self {
                Self::default()
            }

            $($(#[$doc])*
            #[must_use]
            pub fn $name(self, $name: $given) -> Self {
                Self { $name: $name.into(), ..self }
            })*
        }
    };
}

pub(crate) use options;

options! {
    /// How exact a distance has to be. By default it is exact.
    ///
    /// ```
    /// use bvh_query::DistanceOptions;
    ///
    /// let within_a_percent = DistanceOptions::new().rel_err(0.01);
    /// assert_eq!(within_a_percent.abs_err, 0.0);
    /// ```
    pub struct DistanceOptions {
        /// The answer may exceed the least distance by this fraction of it. A query refuses a fraction that is negative or not
        /// finite.
        rel_err(f64): f64 = 0.0,
        /// The answer may exceed the least distance by this length as well, in mesh units. A query refuses a length that is
        /// negative or not finite.
        abs_err(f64): f64 = 0.0,
    }
}

impl DistanceOptions {
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
