//! Why a simple shape cannot be made.

/// Why a function of [`shapes`](crate::shapes) makes no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A number that is no length.
    #[error("{name}: expected a finite length above 0, found {found}")]
    Length {
        /// The parameter.
        name: &'static str,
        /// The number.
        found: f64,
    },
    /// An error for which a polygon around a circle would need too many sides.
    #[error(
        "most_error: expected an error for which 4096 sides suffice, at least 3e-7 of the radius, found {0}"
    )]
    Sides(f64),
    /// Heights that are no grid.
    #[error(
        "heights: expected two or more rows of two or more columns, found {heights} numbers for {columns} columns"
    )]
    Grid {
        /// The columns.
        columns: usize,
        /// The number of heights.
        heights: usize,
    },
}
