//! The points that questions may be about.

use crate::error::{NumberError, QueryError};
use crate::narrow::Point;
use bvh_format::object::MAX_COORDINATE;

/// Coordinates of points below this, 2^-213 mesh units, count as 0: all others are multiples of 2^-266, as exact arithmetic
/// needs them (`narrow`).
const LEAST_COORDINATE: f64 = f64::from_bits((1023 - 213) << 52);

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
