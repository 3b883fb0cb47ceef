//! The table of meshes, and those that a querier keeps at hand.

use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::MeshHandle;
use bvh_query::{OwnedShape, Shape};

/// All meshes that are open.
pub(crate) static MESHES: Table<OwnedShape> = Table::new(Kind::Mesh);

/// How many meshes a querier keeps at hand.
const MAX_AT_HAND: usize = 8;

/// The meshes that a querier was last asked about, each with its handle. Those of the last question come first.
///
/// Threads that ask about one mesh would otherwise write to the same words of memory in each question. While no mesh is
/// freed, a question about meshes at hand only reads a counter that nobody writes. A mesh that was freed is let go when the
/// querier is next asked, about any mesh, or is freed.
#[derive(Default)]
pub(crate) struct AtHand {
    meshes: Vec<(u64, OwnedShape)>,
    /// How many meshes had been freed when those at hand were last looked through.
    removals: u64,
}

impl AtHand {
    /// Returns both meshes of a question.
    pub(crate) fn pair(&mut self, a: MeshHandle, b: MeshHandle) -> Result<(Shape<'_>, Shape<'_>), Failure> {
        self.let_go();
        let (place_a, place_b) = (self.place("a", a.id, 0)?, self.place("b", b.id, 1)?);
        Ok((self.meshes[place_a].1.shape(), self.meshes[place_b].1.shape()))
    }

    /// Returns the mesh of a question about one.
    pub(crate) fn one(&mut self, name: &str, mesh: MeshHandle) -> Result<Shape<'_>, Failure> {
        self.let_go();
        let place = self.place(name, mesh.id, 0)?;
        Ok(self.meshes[place].1.shape())
    }

    /// Lets go of meshes that were freed.
    fn let_go(&mut self) {
        let removals = MESHES.removals();
        if removals != self.removals {
            self.removals = removals;
            self.meshes.retain(|(id, _)| MESHES.is_open(*id));
        }
    }

    /// Returns the place of a mesh, which is `front` or before it: moves it there, or takes it to hand there.
    fn place(&mut self, name: &str, handle: u64, front: usize) -> Result<usize, Failure> {
        match self.meshes.iter().position(|(id, _)| *id == handle) {
            Some(place) if place <= front => return Ok(place),
            Some(place) => self.meshes[front..=place].rotate_right(1),
            None => {
                let shape = MESHES.share(name, handle)?;
                self.meshes.truncate(MAX_AT_HAND - 1);
                self.meshes.insert(front, (handle, shape));
            }
        }
        Ok(front)
    }
}
