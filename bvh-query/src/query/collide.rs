//! Do the meshes touch? Also the first contact in the order of the trees.

use super::{Found, Querier, QueryStats, Scene, Traversal, each_pair, surely_apart};
use crate::bvh::Shape;
use crate::error::QueryError;
use crate::isa::Isa;
use crate::leaf::collide::{drain, face_planes};
use crate::leaf::decoded::Decoded;
use crate::leaf::local::Local;
use crate::leaf::queue::{Candidate, Queue};
use crate::narrow::triangles_intersect;
use crate::pose::Pose;
use crate::traverse::opened::Leaf;
use crate::traverse::pair::{Measure, Order, Visitor};
use std::ops::ControlFlow;

impl Querier {
    /// True if the meshes touch or intersect with B placed by `pose` in A's frame.
    ///
    /// Exact: equals exact predicates on the placed vertices, for all pairs of triangles. Touching
    /// counts; a mesh wholly inside another without touching it does not (meshes are surfaces).
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn collide<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<bool, QueryError> {
        self.start();
        Ok(self.any_contact(a.into(), b.into(), pose)?.is_some())
    }

    /// One pair of triangles in contact, whichever is found first.
    pub(super) fn any_contact(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Option<Found>, QueryError> {
        each_pair(a, b, pose, |scene| {
            let pair = self.find_contact(scene, Order::Nearest)?;
            Ok(pair.map(|pair| Found { numbers: scene.numbers, pair }))
        })
    }

    /// One pair of triangles in contact. In `Order::Tree` it is the same on every backend.
    pub(super) fn find_contact(
        &mut self,
        scene: &Scene<'_>,
        order: Order,
    ) -> Result<Option<Candidate>, QueryError> {
        self.stack.visit()?;
        if surely_apart(&scene.pair) {
            return Ok(None);
        }
        self.queue.clear();
        self.decoded.iter_mut().for_each(Decoded::start);
        let mut visitor = Contacts {
            scene,
            queue: &mut self.queue,
            decoded: &mut self.decoded,
            order,
            stats: QueryStats::default(),
            visit: |candidate| Ok(ControlFlow::Break(candidate)),
            found: None,
        };
        let task = Traversal { pair: scene.pair, stack: &mut self.stack, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let (found, stats) = (visitor.found, visitor.stats);
        self.stats.add(tests, stats);
        Ok(found)
    }
}

impl QueryStats {
    /// Adds what a traversal did.
    pub(super) fn add(&mut self, node_tests: u64, other: Self) {
        self.node_tests += node_tests;
        self.packet_tests += other.packet_tests;
        self.exact_tests += other.exact_tests;
    }
}

/// Decides triangle pairs exactly and hands those in contact to `visit`, until it breaks.
pub(super) struct Contacts<'a, F> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) queue: &'a mut Queue,
    pub(super) decoded: &'a mut [Decoded; 2],
    pub(super) order: Order,
    pub(super) stats: QueryStats,
    pub(super) visit: F,
    /// What `visit` broke with.
    pub(super) found: Option<Candidate>,
}

impl<F: FnMut(Candidate) -> Result<ControlFlow<Candidate>, QueryError>> Contacts<'_, F> {
    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        if self.queue.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        for candidate in drain(isa, self.queue) {
            if self.decide(candidate)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(never)]
    fn decide(&mut self, candidate: Candidate) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        let a = self.scene.triangle_a(candidate.a, candidate.lane_a)?;
        let b = self.scene.triangle_b(candidate.b, candidate.lane_b)?;
        if triangles_intersect(&a, &b)
            && let ControlFlow::Break(found) = (self.visit)(candidate)?
        {
            self.found = Some(found);
            return Ok(ControlFlow::Break(()));
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl<F: FnMut(Candidate) -> Result<ControlFlow<Candidate>, QueryError>> Visitor for Contacts<'_, F> {
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
        (a, b): (Leaf, Leaf),
        _at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.stats.packet_tests += 1;
        let pair = &self.scene.pair;
        let [decoded_a, decoded_b] = &mut *self.decoded;
        let packet_a = pair.bvh_a.packet_again(pair.object_a, a, decoded_a)?;
        let packet_b = pair.bvh_b.packet_again(pair.object_b, b, decoded_b)?;
        let local = Local::new(isa, self.scene.frame(), packet_a, packet_b);
        let mut mask = face_planes(isa, &local, a, b);
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            self.queue.push(&local, Candidate::in_lane(a, b, lane));
            if self.queue.is_full() && self.drain(isa)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        self.drain(isa).map(|_| ())
    }
}
