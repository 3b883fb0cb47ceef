//! Why a simple shape cannot be made.

/// Why a function of [`shapes`](crate::shapes) makes no mesh.
///
/// ```
/// use bvh_bake::{ShapeError, shapes};
///
/// assert_eq!(shapes::block([2.0, 0.0, 2.0]), Err(ShapeError::Length { name: "side", found: 0.0 }));
/// assert_eq!(shapes::ground([f64::INFINITY; 2], 1.0), Err(ShapeError::HalfSpace("side")));
/// ```
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
    /// A ground without end, which would be a half-space.
    #[error(
        "{0}: expected a finite length above 0, found inf: a half-space cannot be baked; make a ground that reaches beyond \
         everything that it is asked about"
    )]
    HalfSpace(&'static str),
    /// An error for which a polygon around a circle would need too many sides.
    #[error(
        "max_error: expected an error for which 4096 sides suffice, at least 3e-7 of the radius, found {0}"
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
    /// A point that cannot be in a file.
    #[error(
        "points: expected finite coordinates of at most 2^120 in magnitude, found {found:?} at number {number}"
    )]
    Point {
        /// The number of the point.
        number: usize,
        /// Its coordinates.
        found: [f64; 3],
    },
    /// Points without a volume, of which there is no solid hull.
    #[error(
        "points: expected four or more that are not in one plane, found {points} {}: bake triangles, a segment or a cloud, \
         with a radius if it should be thick",
        ["at one place", "on one line", "in one plane"][*dimension]
    )]
    Flat {
        /// The number of points.
        points: usize,
        /// 0 if all are at one place, 1 if they are on a line, and 2 if they are in a plane.
        dimension: usize,
    },
    /// A cell that is not of an octree.
    #[error(
        "cells: expected as size a power of two and as corner multiples of it, found size {size} at {corner:?}, number \
         {number}"
    )]
    Cell {
        /// The number of the cell.
        number: usize,
        /// Its corner.
        corner: [i32; 3],
        /// Its size.
        size: u32,
    },
}
