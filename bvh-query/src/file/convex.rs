//! What objects enclose. Found when a query first needs it, and kept while the file is open.
//!
//! A file may say that an object is convex, but no rule checks that, and a depth would be wrong if it were not so.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::narrow::{ConvexSolid, Enclosed, has_area};
use std::sync::{Arc, PoisonError};

/// The most triangles of an object that may be found to be convex. Each plane is compared with each vertex, which takes up to 0.2 s for
/// so many; of objects that are not convex, most fail at the first planes.
const MAX_TRIANGLES: usize = 4096;

impl Bvh {
    /// Returns what an object encloses.
    ///
    /// Cost: at the first call, reading 4096 triangles, or more until the first one with area, and deciding whether they are convex.
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page of the object is damaged; the errors of [`Bvh::is_closed`].
    pub(crate) fn enclosed(&self, object: usize) -> Result<Enclosed, QueryError> {
        let known = || self.known_enclosed().lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(enclosed) = known().get(&object) {
            return Ok(enclosed.clone());
        }
        let Some(shape) = self.object(object) else { return Ok(Enclosed::Unknown) };
        let (mut triangles, mut have_area) = (Vec::new(), false);
        shape.visit_stored_until(|corners| {
            have_area |= has_area(&corners);
            if triangles.len() <= MAX_TRIANGLES {
                triangles.push(corners);
            }
            have_area && triangles.len() > MAX_TRIANGLES
        })?;
        // Duplicates of the other orientation may cancel what the stored triangles enclose.
        let is_simple = triangles.len() <= MAX_TRIANGLES && self.topology(object)?.counts_each_once();
        let found = if !have_area {
            Enclosed::Nothing
        } else {
            let solid = if is_simple { ConvexSolid::of_surface(&triangles) } else { None };
            solid.map_or(Enclosed::Unknown, |solid| Enclosed::Convex(Arc::new(solid)))
        };
        Ok(known().entry(object).or_insert(found).clone())
    }
}
