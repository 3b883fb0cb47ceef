//! What objects enclose. Found when a query first needs it, and kept while the file is open.
//!
//! A file may say that an object is convex, but no rule checks that, and a depth would be wrong if it were not so.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::narrow::{ConvexSolid, Enclosed, has_area};
use std::sync::{Arc, PoisonError};

/// The most triangles of an object that may be found to be convex. Each plane is compared with each vertex, which takes 25 ms for so
/// many; of objects that are not convex, most fail at the first planes.
const MAX_TRIANGLES: u64 = 4096;

impl Bvh {
    /// Returns what an object encloses.
    ///
    /// Cost: reading one of few triangles at the first call, and of others what comes before the first triangle with area.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page of the object is damaged.
    pub(crate) fn enclosed(&self, object: usize) -> Result<Enclosed, QueryError> {
        let known = || self.known_enclosed().lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(enclosed) = known().get(&object) {
            return Ok(enclosed.clone());
        }
        let Some(shape) = self.object(object) else { return Ok(Enclosed::Unknown) };
        let (mut triangles, mut have_area) = (Vec::new(), false);
        let is_small = shape.triangles() <= MAX_TRIANGLES;
        shape.visit_triangles_until(|_, corners| {
            have_area |= has_area(&corners);
            if is_small {
                triangles.push(corners);
            }
            have_area && !is_small
        })?;
        let found = if !have_area {
            Enclosed::Nothing
        } else {
            ConvexSolid::of_surface(&triangles)
                .map_or(Enclosed::Unknown, |solid| Enclosed::Convex(Arc::new(solid)))
        };
        Ok(known().entry(object).or_insert(found).clone())
    }
}
