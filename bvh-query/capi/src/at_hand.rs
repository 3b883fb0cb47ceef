//! The table of meshes, and those that a querier keeps at hand.

use crate::status::Failure;
use crate::table::{Kind, Table};
use crate::types::MeshHandle;
use bvh_query::{OwnedShape, Shape};

/// All meshes that are open.
pub(crate) static MESHES: Table<OwnedShape> = Table::new(Kind::Mesh);

/// How many meshes a querier keeps at hand.
const MOST_AT_HAND: usize = 8;

/// Meshes that a querier was last asked about.
///
/// Threads that ask about one mesh would otherwise count its uses in the same word of memory, twice a question. A mesh
/// at hand is compared with its place in the table by reading alone. One that was freed is let go when the querier is next
/// asked, about any mesh, or is freed.
#[derive(Default)]
pub(crate) struct AtHand {
    meshes: [Option<(u64, OwnedShape)>; MOST_AT_HAND],
    /// Where the next mesh goes when all places are taken.
    next: usize,
    /// How many meshes had been freed when those at hand were last looked through.
    removals: u64,
}

impl AtHand {
    /// Returns both meshes of a question.
    pub(crate) fn pair(&mut self, a: MeshHandle, b: MeshHandle) -> Result<(Shape<'_>, Shape<'_>), Failure> {
        self.let_go();
        let place_a = self.place("a", a.id, MOST_AT_HAND)?;
        let place_b = self.place("b", b.id, place_a)?;
        Ok((self.at(place_a)?, self.at(place_b)?))
    }

    /// Returns the mesh of a question about one.
    pub(crate) fn one(&mut self, name: &str, mesh: MeshHandle) -> Result<Shape<'_>, Failure> {
        self.let_go();
        let place = self.place(name, mesh.id, MOST_AT_HAND)?;
        self.at(place)
    }

    fn at(&self, place: usize) -> Result<Shape<'_>, Failure> {
        let mesh = self.meshes.get(place).and_then(Option::as_ref);
        let (_, shape) =
            mesh.ok_or_else(|| Failure::new(crate::status::Status::Internal, "a mesh that is not at hand"))?;
        Ok(shape.shape())
    }

    /// Lets go of meshes that were freed.
    #[inline]
    fn let_go(&mut self) {
        let removals = MESHES.removals();
        if removals != self.removals {
            self.removals = removals;
            self.meshes.iter_mut().for_each(|mesh| {
                mesh.take_if(|(id, _)| !MESHES.is_open(*id));
            });
        }
    }

    /// Returns the place of a mesh, after taking it to hand in another place than `taken`.
    #[inline]
    fn place(&mut self, name: &str, handle: u64, taken: usize) -> Result<usize, Failure> {
        let is_it = |mesh: &Option<(u64, OwnedShape)>| mesh.as_ref().is_some_and(|(id, _)| *id == handle);
        match self.meshes.iter().position(is_it) {
            Some(place) if MESHES.is_open(handle) => Ok(place),
            _ => self.take(name, handle, taken),
        }
    }

    #[cold]
    fn take(&mut self, name: &str, handle: u64, taken: usize) -> Result<usize, Failure> {
        let shape = MESHES.share(name, handle)?;
        let place = self.meshes.iter().position(Option::is_none).unwrap_or_else(|| {
            self.next = (self.next + 1) % MOST_AT_HAND;
            if self.next == taken {
                self.next = (self.next + 1) % MOST_AT_HAND;
            }
            self.next
        });
        self.meshes[place] = Some((handle, shape));
        Ok(place)
    }
}
