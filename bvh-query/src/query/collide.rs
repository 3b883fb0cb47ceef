//! Decides whether the meshes touch, and finds the first contact that a walk meets.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::file::shape::Shape;
use crate::isa::Isa;
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::leaf::separating_axes::{drain, face_planes};
use crate::narrow::triangles_intersect;
use crate::pose::Pose;
use crate::query::bounding_volumes::surely_apart;
use crate::query::exact::RecentTriangles;
use crate::query::placed_pair::{FoundPair, PlacedPair, VisitPair, Walk, each_pair};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::node_filter::Measure;
use crate::traverse::walk::{Order, Visitor};
use std::ops::ControlFlow;

/// The number of candidates that a search for any contact decides first. Where meshes touch, they are likely to be in
/// contact; where they do not, some lanes of one more test stay empty.
const FIRST_DRAIN: usize = 6;

impl Querier {
    /// Returns whether the meshes touch or intersect, with B placed by `pose` in A's frame.
    ///
    /// The answer is exact: it is that of exact predicates on the placed vertices, for all pairs of triangles. Touching
    /// counts as collision. Meshes are surfaces: a mesh wholly inside another one, without touching it, does not
    /// collide with it, unless the outer one is solid ([`Shape::solid`]). [`Querier::relation`] finds such a mesh.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// // Both are 2 wide.
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// assert!(querier.collide(&block, &block, &at(2.0)?)?); // their faces touch
    /// assert!(!querier.collide(&block, &block, &at(2.0_f64.next_up())?)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, [`QueryError::Budget`] if the budget does not
    /// suffice.
    pub fn collide<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<bool, QueryError> {
        self.start();
        self.shapes_within(a.into(), b.into(), pose, 0.0)
    }

    /// Returns one pair of triangles in contact: whichever is found first.
    pub(super) fn any_contact(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Option<FoundPair>, QueryError> {
        each_pair(a, b, pose, |placed| {
            let pair = self.find_contact(placed)?;
            Ok(pair.map(|pair| FoundPair { numbers: placed.numbers, pair }))
        })
    }

    /// Returns the first pair of triangles in contact that a walk meets. It is the same on every backend: bounds along A's
    /// directions have the same bits, so pairs of nodes are met in the same order, and filters drop no pair in contact.
    pub(super) fn find_contact(
        &mut self,
        placed: &PlacedPair<'_>,
    ) -> Result<Option<TrianglePair>, QueryError> {
        self.memory.budget.visit()?;
        if surely_apart(&placed.pair) {
            return Ok(None);
        }
        self.walk_contacts(placed, Order::Nearest, FIRST_DRAIN, &mut |pair| Ok(ControlFlow::Break(pair)))
    }

    /// Passes the pairs of triangles of two objects that are in contact to `visit`, until it breaks, and returns what it broke
    /// with. The first `drain_at` candidates are decided together.
    pub(super) fn walk_contacts(
        &mut self,
        placed: &PlacedPair<'_>,
        order: Order,
        drain_at: usize,
        visit: VisitPair<'_>,
    ) -> Result<Option<TrianglePair>, QueryError> {
        self.queue.clear();
        self.start_placed();
        let candidates = Candidates {
            placed,
            queue: &mut self.queue,
            drain_at,
            stats: QueryStats::default(),
            recent: &mut self.recent,
            visit,
            found: None,
        };
        let mut visitor = ContactVisitor { packets: &mut self.packets, order, candidates };
        let task = &mut Walk { pair: &placed.pair, memory: &mut self.memory, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let Candidates { found, stats, .. } = visitor.candidates;
        self.stats.add(tests, stats);
        Ok(found)
    }
}

/// Collects pairs of triangles that may be in contact.
pub(super) struct ContactVisitor<'a> {
    /// Of A and of B.
    pub(super) packets: &'a mut [PlacedPackets; 2],
    pub(super) order: Order,
    pub(super) candidates: Candidates<'a>,
}

/// Decides pairs of triangles and passes those in contact to `visit`, until it breaks.
pub(super) struct Candidates<'a> {
    pub(super) placed: &'a PlacedPair<'a>,
    pub(super) queue: &'a mut TriangleQueue,
    /// The number of candidates that are decided together next; after that, a full queue.
    pub(super) drain_at: usize,
    pub(super) stats: QueryStats,
    /// Of A and of B.
    pub(super) recent: &'a mut [RecentTriangles; 2],
    pub(super) visit: VisitPair<'a>,
    /// What `visit` broke with.
    pub(super) found: Option<TrianglePair>,
}

impl Candidates<'_> {
    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        if self.queue.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        for (candidate, certain) in drain(isa, self.queue) {
            if self.decide(candidate, certain)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Decides a candidate: exactly, unless it is already certain that it is in contact.
    #[inline(never)]
    fn decide(&mut self, candidate: TrianglePair, certain: bool) -> Result<ControlFlow<()>, QueryError> {
        if (certain || self.intersect(candidate)?)
            && let ControlFlow::Break(found) = (self.visit)(candidate)?
        {
            self.found = Some(found);
            return Ok(ControlFlow::Break(()));
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(never)]
    fn intersect(&mut self, candidate: TrianglePair) -> Result<bool, QueryError> {
        self.stats.exact_tests += 1;
        let TrianglePair { a, b, lane_a, lane_b } = candidate;
        let [recent_a, recent_b] = &mut *self.recent;
        let triangle_a = recent_a.get_or_place(a, lane_a, || self.placed.triangle_a(a, lane_a))?;
        let triangle_b = recent_b.get_or_place(b, lane_b, || self.placed.triangle_b(b, lane_b))?;
        Ok(triangles_intersect(triangle_a, triangle_b))
    }
}

impl Visitor for ContactVisitor<'_> {
    const MEASURE: Measure = Measure::Overlap;

    fn order(&self) -> Order {
        self.order
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        0.0
    }

    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (LeafPacket, LeafPacket),
        _at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        let candidates = &mut self.candidates;
        candidates.stats.packet_tests += 1;
        let local = candidates.placed.local(isa, self.packets, (a, b))?;
        let planes = face_planes(isa, &local, a, b);
        let mut mask = !planes.apart;
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            candidates.queue.push(&local, TrianglePair::in_lane(a, b, lane));
            candidates.queue.mark_last_straddling(planes.overlap >> lane & 1 != 0);
            if candidates.queue.len() >= candidates.drain_at {
                candidates.drain_at = TriangleQueue::FULL;
                if candidates.drain(isa)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        self.candidates.drain(isa).map(|_| ())
    }
}
