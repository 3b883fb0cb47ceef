//! Gathers the solids of an STL file: each is an object.

use super::Gatherer;
use crate::error::Halt;
use crate::input::stl::Solids;

/// Passes solids to a gatherer.
pub(super) struct SolidsForBake<'a, 'b> {
    pub(super) gatherer: &'a mut Gatherer<'b>,
    pub(super) object: usize,
}

impl Solids for SolidsForBake<'_, '_> {
    fn begin(&mut self, name: String, _: usize) -> Result<(), Halt> {
        self.object = self.gatherer.object(name)?;
        Ok(())
    }

    fn triangles(
        &mut self,
        count: usize,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
    ) -> Result<(), Halt> {
        self.gatherer.add_triangles(self.object, count, corners_of)
    }
}
