//! The querier: the backend and the working memory of all queries.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::isa::{Backend, BackendError};
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::queue::TriangleQueue;
use crate::query::exact::RecentTriangles;
use crate::query::pair_search::BoundedPair;
use crate::query::probe::bounded::BoundedTriangle;
use crate::query::probe::placed::IntoObject;
use crate::query::stats::QueryStats;
use crate::traverse::budget::Budget;
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::Stop;
use std::sync::Arc;

/// Runs queries about two meshes.
///
/// A querier holds the backend and the working memory of queries. Once the memory has grown to the size that the meshes
/// need, a query allocates nothing. A querier keeps some decoded treelets from one query to the next, which does not
/// affect answers. Use one querier per thread.
///
/// ```
/// use bvh_query::{Pose, Querier};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut querier = Querier::new()?;
/// for step in 0..4 {
///     let pose = Pose::new(*Pose::IDENTITY.rotation(), [f64::from(step), 0.0, 0.0])?;
///     assert_eq!(querier.collide(&block, &block, &pose)?, step <= 2); // the blocks are 2 wide
/// }
/// println!("{}, {:?}", querier.backend(), querier.stats());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Worst case
/// These bounds hold for files of any bytes, forged ones included. Each pair of objects is walked once; a distance of 0, or
/// one near the sum of two radii, takes a second walk. Let the pages of the two objects have t and u treelets, and p and q leaf packets.
///
/// - Time: a walk visits at most (t + p) * (u + q) pairs of nodes, each once, with up to four node tests or one packet
///   test each. Ordinary meshes need a few hundred visits. For files from strangers, limit the time further with
///   [`Querier::set_budget`].
/// - Memory: 8 MiB, and at most 8 KiB for each treelet of either file that the query opens; no recursion. A page has at
///   most 110 treelets. The answer of [`Querier::contacts`] takes 16 bytes more per contact, and
///   [`Querier::patches`] up to 2 KiB, and 56 bytes per contact point.
/// - Contacts: at most one for each pair of triangles for which the pages of both files have room, listed duplicates
///   included. More are an error.
///
/// If a query touches a page, leaf block or id block in which a byte was changed, it returns an error. A file that was
/// forged with correct checksums may hold wrong bounds. Its answers may then be wrong or an error, but nothing worse
/// happens.
pub struct Querier {
    pub(super) backend: Backend,
    pub(super) memory: WalkMemory,
    pub(super) queue: TriangleQueue,
    /// Of A and of B.
    pub(super) packets: [PlacedPackets; 2],
    /// Of A and of B.
    pub(super) recent: [RecentTriangles; 2],
    /// For sweeps: what is in A's frame at the end of an interval.
    pub(super) at_end: Ends,
    pub(super) bounded: Vec<BoundedPair>,
    pub(super) bounded_triangles: Vec<BoundedTriangle>,
    /// The frame of the object that lines in its own frame were last about, by the number of its file and its own.
    pub(super) own_frame: Option<((u64, usize), IntoObject)>,
    budget: Budget,
    pub(super) stats: QueryStats,
    questions: u64,
}

/// The memory of B at the end of an interval; at its start, B is where other queries have it.
#[derive(Default)]
pub(super) struct Ends {
    pub(super) packets: PlacedPackets,
    pub(super) queue: TriangleQueue,
}

impl Querier {
    /// Starts a query, for which placed triangles are of no use, except for packets of A.
    pub(super) fn start_placed(&mut self) {
        let [packets_a, packets_b] = &mut self.packets;
        packets_a.start_with_known();
        packets_b.start();
        self.recent.iter_mut().for_each(RecentTriangles::start);
    }

    /// Creates a querier with the fastest backend of this CPU, or with the one that the environment variable `CBVH_ISA`
    /// names.
    ///
    /// # Errors
    /// [`BackendError`] if `CBVH_ISA` names no backend, or one that the CPU lacks.
    pub fn new() -> Result<Self, BackendError> {
        Ok(Self::with_backend(Backend::detect()?))
    }

    /// Creates a querier with a backend. The portable backend replaces one that the CPU lacks.
    pub fn with_backend(backend: Backend) -> Self {
        let backend = if backend.is_available() { backend } else { Backend::Scalar };
        Self {
            backend,
            memory: WalkMemory::default(),
            queue: TriangleQueue::default(),
            packets: Default::default(),
            recent: Default::default(),
            at_end: Ends::default(),
            bounded: Vec::new(),
            bounded_triangles: Vec::new(),
            own_frame: None,
            budget: Budget::new(u64::MAX),
            stats: QueryStats::default(),
            questions: 0,
        }
    }

    /// Limits each query from now on to this many visits. A query that needs more ends with [`QueryError::Budget`].
    /// Without a budget, only the sizes of the files limit a query and, for a motion, its path and tolerance.
    ///
    /// The budget limits the time of a query, and the memory that it adds, whatever the files hold. Each of these
    /// counts as one visit:
    ///
    /// - a pair of objects, and a pair of nodes or of leaf packets of both trees;
    /// - for a point or a line: an object, a node that is opened, and a leaf packet;
    /// - a contact that is reported: one that stands for duplicates counts once for each pair of them;
    /// - for [`Querier::patches`]: what its rays visit, and each 64 comparisons of points;
    /// - for [`Querier::relation`], and where a shape is solid: each pair of a component of one mesh and an object of the
    ///   other;
    /// - for a motion: each interval of time, and each object of B in it beyond the first.
    ///
    /// Rays and segments with a budget do not walk along the boxes that a [`Bvh`](crate::Bvh) keeps for them, because their visits must
    /// not depend on what was asked before. They then take two to three times as long.
    ///
    /// A visit takes some 100 ns; the first one of a page takes some microseconds more, because the page is checked.
    /// Queries of scans and of CAD models with 10^5 to 10^6 triangles take from some hundred visits, for separated
    /// meshes, to some 10^6, for all contacts of a deep overlap. The lists of duplicates and of the topology are not
    /// charged: a query checks each in one pass when it first needs it.
    pub fn set_budget(&mut self, visits: u64) {
        self.budget = Budget::new(visits).stopped_by(self.budget.stop().cloned());
    }

    /// Stops each query from now on when another thread, a timer or a signal handler sets the flag, or when the function that stands
    /// in its place returns true. The query then ends with [`QueryError::Stopped`], and so does each later one until the flag is
    /// cleared. `None` removes the flag.
    ///
    /// A query reads the flag before its first visit and after each 256 visits ([`Querier::set_budget`]), so it ends within
    /// a millisecond or so. What is not charged to a budget is not stopped either: the first check of a list of duplicates or of the
    /// topology, and the boxes that a [`Bvh`](crate::Bvh) makes for its rays. A flag that is not set affects no answer.
    ///
    /// ```
    /// use bvh_query::{Bvh, Pose, Querier, QueryError};
    /// use std::sync::{Arc, atomic::{AtomicBool, Ordering}};
    /// use std::time::{Duration, Instant};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
    /// # let mesh = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
    /// let (mut querier, stop) = (Querier::new()?, Arc::new(AtomicBool::new(false)));
    /// querier.set_stop(Some(stop.clone()));
    /// assert!(querier.collide(&mesh, &mesh, &Pose::IDENTITY)?);
    ///
    /// stop.store(true, Ordering::Relaxed); // on any thread
    /// assert_eq!(querier.collide(&mesh, &mesh, &Pose::IDENTITY), Err(QueryError::Stopped));
    ///
    /// let end = Instant::now() + Duration::from_secs(1);
    /// querier.set_stop(Some(Arc::new(move || Instant::now() > end)));
    /// assert!(querier.collide(&mesh, &mesh, &Pose::IDENTITY)?);
    /// # Ok(())
    /// # }
    /// ```
    pub fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.budget = std::mem::take(&mut self.budget).stopped_by(stop);
    }

    /// Lets each query from now on make the visits that are left of a budget.
    #[inline(never)]
    pub(crate) fn set_rest(&mut self, rest: Budget) {
        self.budget = rest;
    }

    /// Returns how many visits the last query made.
    pub(crate) fn visits(&self) -> u64 {
        self.memory.budget.made()
    }

    /// Charges a visit that is made outside of queries, by the code that combines them.
    pub(crate) fn charge_visit(&mut self) -> Result<(), QueryError> {
        self.memory.budget.visit()
    }

    /// Charges a look at each object of a shape. The first one comes with the question.
    pub(super) fn look_at_objects(&mut self, shape: Shape<'_>) -> Result<(), QueryError> {
        self.memory.budget.charge(shape.objects().len().saturating_sub(1) as u64)
    }

    /// Returns the backend in use.
    pub fn backend(&self) -> Backend {
        self.backend
    }

    /// Returns how much work the last query took.
    pub fn stats(&self) -> QueryStats {
        self.stats
    }

    /// Returns how many questions it was asked.
    pub(crate) fn questions(&self) -> u64 {
        self.questions
    }

    /// Resets what belongs to one query.
    pub(crate) fn start(&mut self) {
        self.stats = QueryStats::default();
        self.questions += 1;
        self.memory.budget.clone_from(&self.budget);
    }
}
