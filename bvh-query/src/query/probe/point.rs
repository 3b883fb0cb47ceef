//! The points that questions may be about.

use crate::error::{NumberError, QueryError};
use crate::narrow::Point;
use crate::numerics::LEAST_COORDINATE;
use bvh_format::object::MAX_COORDINATE;

/// Refuses a point beyond the range of files. Coordinates too small for exact arithmetic become 0.
pub(crate) fn check_point(point: &Point) -> Result<Point, QueryError> {
    if let Some(&found) = point.iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
        return Err(NumberError::Point(found).into());
    }
    Ok(point.map(|x| if x.abs() < LEAST_COORDINATE { 0.0 } else { x }))
}

/// Returns the sum of the magnitudes of the coordinates.
#[inline(always)]
pub(crate) fn sum_of_magnitudes(point: &Point) -> f64 {
    point[0].abs() + point[1].abs() + point[2].abs()
}
