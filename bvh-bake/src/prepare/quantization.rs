//! Limits how far quantisation may move vertices: the default, the limit, and the error that is coarse for a mesh.
//!
//! Quantised vertices lie on a grid whose step is between e / √3 and 2 e / √3 for an allowed error e. Triangles collapse
//! when the step approaches the length of their edges, so that the error is limited relative to the size of the object,
//! which is the diagonal D of its box.

use crate::error::{BakeError, excerpt};
use crate::options::Options;
use bvh_format::leaf::TriangleEncoding;

/// The default error as a share of the diagonal.
const DEFAULT_ERROR_PER_DIAGONAL: f64 = 1e-5;
/// The largest error as a share of the diagonal. At this limit, the step is between D / 174 and D / 87. A surface of
/// area D², such as a sphere, meets at most about 30,000 cells of such a grid, and anything thinner than D / 87 may
/// vanish. Beyond the limit, most triangles of a scan collapse: at the limit, Stanford's dragon and bunny keep 6 % and
/// 47 % of theirs.
const MAX_ERROR_PER_DIAGONAL: f64 = 1e-2;
/// The share of D / √n above which an error is coarse for n triangles. Their edges have a mean length of about 1.5 D / √n
/// if their area is D². At this share, up to 6 % of the triangles collapse in scans, robots and buildings of 3,000 to
/// 870,000 triangles. It is below the limit for more than 100 triangles.
const COARSE_ERROR_PER_SPACING: f64 = 0.1;

/// Returns the largest move that quantisation may make in an object with this diagonal, or `None` if vertices stay as
/// they are.
///
/// # Errors
/// [`BakeError::MaxError`] if the allowed error is negative, NaN, or exceeds a hundredth of the diagonal. An object of diagonal
/// 0 is a point and cannot collapse.
pub(crate) fn grid_error(options: &Options, object: &str, diagonal: f64) -> Result<Option<f64>, BakeError> {
    if options.triangles != Some(TriangleEncoding::Quantized) {
        return Ok(None);
    }
    let allowed = options.max_error.unwrap_or(DEFAULT_ERROR_PER_DIAGONAL * diagonal);
    let limit = MAX_ERROR_PER_DIAGONAL * diagonal;
    // NaN is no length either.
    let is_length = allowed >= 0.0;
    if !is_length || allowed > limit && diagonal > 0.0 {
        let object = excerpt(object.as_bytes());
        return Err(BakeError::MaxError { object, allowed, limit, diagonal });
    }
    Ok(Some(allowed).filter(|&error| error > 0.0))
}

/// Returns the largest error that is not coarse for an object if the allowed error exceeds it, and `None` otherwise.
pub(crate) fn advised_error(options: &Options, diagonal: f64, triangles: u64) -> Option<f64> {
    let advised = COARSE_ERROR_PER_SPACING * diagonal / (triangles.max(1) as f64).sqrt();
    let allowed = options.max_error?;
    (options.triangles == Some(TriangleEncoding::Quantized) && allowed > advised && diagonal > 0.0)
        .then_some(advised)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_limited_by_the_size_of_the_object() {
        let options =
            |max_error| Options::default().triangles(TriangleEncoding::Quantized).max_error(max_error);
        let error = |max_error, diagonal| grid_error(&options(max_error), "", diagonal);
        assert!(matches!(error(None, 200.0), Ok(Some(error)) if error == 200.0 * 1e-5));
        assert!(matches!(error(Some(2.0), 200.0), Ok(Some(2.0))));
        assert!(matches!(error(Some(2.001), 200.0), Err(BakeError::MaxError { limit: 2.0, .. })));
        for wrong in [-1e-300, f64::NAN] {
            assert!(matches!(error(Some(wrong), 200.0), Err(BakeError::MaxError { .. })));
            assert!(matches!(error(Some(wrong), 0.0), Err(BakeError::MaxError { .. })));
        }
        // A point cannot collapse.
        assert!(matches!((error(None, 0.0), error(Some(1.0), 0.0)), (Ok(None), Ok(Some(1.0)))));
        assert!(matches!(grid_error(&Options::default(), "", 200.0), Ok(None)));

        let advised = |max_error, triangles| advised_error(&options(Some(max_error)), 200.0, triangles);
        assert_eq!((advised(2.0, 100), advised(0.2, 10_000)), (None, None));
        assert_eq!(advised(0.21, 10_000), Some(0.2));
        assert_eq!((advised(0.02, 1_000_000), advised(0.021, 1_000_000)), (None, Some(0.02)));
        assert_eq!(advised_error(&options(None), 200.0, 1_000_000), None);
    }
}
