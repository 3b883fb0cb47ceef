//! Why an object is not closed: counts its open edges when somebody needs them.
//!
//! Files do not store these counts. Few files are open, fewer callers want to know why, and counting takes about a third of a second per
//! million triangles, which is less than the message costs its reader. What has been counted is kept while the file is open.

use crate::error::{NumberError, QueryError};
use crate::file::bvh::Bvh;
use crate::file::shape::Shape;
use bvh_format::object::Object;
use bvh_format::open_edges::{OpenEdges, Traversal, count, edges_of_page};
use std::sync::{Arc, PoisonError};

/// The most triangles and pages of an object whose open edges are counted for an error, which takes some tenths of a second.
const MAX_EXPLAINED_TRIANGLES: u64 = 1 << 20;
const MAX_EXPLAINED_PAGES: usize = 1 << 13;
/// The most edges that are in memory meanwhile, 16 MiB.
const MAX_EXPLAINED_EDGES: usize = 1 << 18;

impl Bvh {
    /// Returns the open edges of an object, which are why it is not closed; none if it is closed. How many there are of each kind,
    /// the first ones, and how near they are to each other, so that a bake with a weld can close cracks.
    ///
    /// Cost: for an open object, reading all of it twice at the first call, which takes about a third of a second per million
    /// triangles, 64 bytes of memory for each edge that does not cancel within its page, and about 200 for each open edge; later, none.
    ///
    /// # Errors
    /// The errors of [`Bvh::is_closed`], and [`QueryError::Damaged`] if a page of the object is damaged.
    pub fn open_edges(&self, object: usize) -> Result<Arc<OpenEdges>, QueryError> {
        Ok(self.counted_within(object, usize::MAX)?.expect("no limit is exceeded"))
    }

    /// Returns the open edges of an object, or `None` if more than `most` edges would have to be in memory to count them.
    fn counted_within(&self, object: usize, most: usize) -> Result<Option<Arc<OpenEdges>>, QueryError> {
        if self.topology(object)?.closed {
            return Ok(Some(Arc::default()));
        }
        let known = || self.counted().lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(edges) = known().get(&object) {
            return Ok(Some(edges.clone()));
        }
        let of_object = self.objects().get(object).ok_or(NumberError::Object(object))?;
        let mut failed = None;
        let mut edges_of =
            |page| self.edges_of(object, of_object, page).map_err(|error| failed = Some(error)).ok();
        let edges = count(object as u32, of_object.pages(), most, &mut edges_of);
        match failed {
            Some(error) => Err(error),
            None => Ok(edges.map(|edges| known().entry(object).or_insert(Arc::new(edges)).clone())),
        }
    }

    /// Returns the error of a question about the inside of an object that is not closed.
    #[cold]
    pub(crate) fn not_closed(&self, object: usize) -> QueryError {
        let is_small = self.objects().get(object).is_some_and(|of| {
            of.triangles() <= MAX_EXPLAINED_TRIANGLES && of.pages().len() <= MAX_EXPLAINED_PAGES
        });
        let counted = is_small.then(|| self.counted_within(object, MAX_EXPLAINED_EDGES));
        QueryError::NotClosed { object, edges: counted.and_then(|edges| edges.ok().flatten()) }
    }

    /// Returns the edges of the triangles of a page.
    fn edges_of(&self, number: usize, object: &Object, page: u32) -> Result<Vec<Traversal>, QueryError> {
        let topology = self.topology(number)?;
        let page = self.page(object, page)?;
        let (block, ids) = (self.leaf_block(object, &page)?, self.id_block(&page)?);
        let ids = self.layout().has_ids().then_some(ids);
        Ok(edges_of_page(object, &page, block, ids, &|place| topology.net(place)))
    }
}

impl Shape<'_> {
    /// Returns the open edges of all objects of the shape: see [`Bvh::open_edges`].
    ///
    /// # Errors
    /// The errors of [`Bvh::open_edges`].
    pub fn open_edges(self) -> Result<OpenEdges, QueryError> {
        let mut all = OpenEdges::default();
        for number in self.object_numbers() {
            all.join(OpenEdges::clone(&*self.bvh().open_edges(number)?));
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, VerifyOptions, to_bytes};
    use bvh_format::Layout;
    use cbvh_testkit::Random;
    use cbvh_testkit::ball::ball;

    /// The bake counts in another way, on all threads and with files; its tests compare it with brute force.
    #[test]
    fn open_edges_are_those_of_the_bake() {
        let mut random = Random::new(2);
        let (positions, mut triangles) = ball(20_000);
        triangles.retain(|_| random.below(50) != 0);
        let sphere = Mesh::from_triangles(positions, triangles);
        let crowd: Vec<[f64; 3]> = (0..300).map(|_| [(); 3].map(|()| random.below(3) as f64)).collect();
        let crowd = Mesh::from_triangles(crowd, (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
        for (mesh, options) in [
            (&sphere, Options::default()),
            (&crowd, Options::default()),
            (&crowd, Options::default().ids(false)),
        ] {
            let (bytes, report) = to_bytes(mesh, &options).unwrap();
            let layout = Layout::read(&bytes).unwrap();
            let stored = bvh_bake::open_edges(&layout, &bytes[..], &VerifyOptions::default()).unwrap();
            let bvh = Bvh::from_bytes(bytes).unwrap();
            let edges = bvh.open_edges(0).unwrap();
            assert!(*edges == stored && Some(&stored) == report.open_edges.as_ref() && !stored.is_empty());
            let error = bvh.all().solid().unwrap_err();
            assert!(error.to_string().contains(&stored.to_string()), "{error}");
            assert_eq!(error, QueryError::NotClosed { object: 0, edges: Some(edges.clone()) });
            assert_eq!(bvh.all().open_edges(), Ok(stored));
            assert!(Arc::ptr_eq(&edges, &bvh.open_edges(0).unwrap()));
            assert!(matches!(bvh.open_edges(1), Err(QueryError::Number(NumberError::Object(1)))));
        }
    }
}
