//! Finds all pairs of triangles within a distance: the contacts of rounded shapes.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::Isa;
use crate::leaf::distance::{bounds, near};
use crate::leaf::local::valid_lanes;
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::narrow::triangles_within;
use crate::query::answers::QueryStats;
use crate::query::collide::Visit;
use crate::query::exact::TriangleDistance;
use crate::query::placed_pair::PlacedPair;
use crate::traverse::align::round_up;
use crate::traverse::node_filter::Measure;
use crate::traverse::walk::{Order, Visitor};
use std::ops::ControlFlow;

/// Collects pairs of triangles that may be within the distance.
pub(super) struct WithinVisitor<'a> {
    /// Of A and of B.
    pub(super) packets: &'a mut [PlacedPackets; 2],
    pub(super) near: NearPairs<'a>,
}

/// Decides pairs of triangles exactly, and passes those within the distance to `visit`, until it breaks.
pub(super) struct NearPairs<'a> {
    placed: &'a PlacedPair<'a>,
    queue: &'a mut TriangleQueue,
    within: f64,
    /// Not below `within`, with slack for the roundings of bounds.
    limit: f32,
    visit: Visit<'a>,
    pub(super) stats: QueryStats,
    pub(super) found: Option<TrianglePair>,
}

impl<'a> NearPairs<'a> {
    pub(super) fn new(
        placed: &'a PlacedPair<'a>,
        queue: &'a mut TriangleQueue,
        within: f64,
        visit: Visit<'a>,
    ) -> Self {
        let limit = round_up(within * (1.0 + 2f64.powi(-40)));
        Self { placed, queue, within, limit, visit, stats: QueryStats::default(), found: None }
    }

    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        if self.queue.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        let scale = self.placed.frame().scale;
        let (bounds, filled) = (bounds(isa, self.queue), self.queue.filled());
        for (lane, pair) in self.queue.take().into_iter().enumerate() {
            let Some(pair) = pair.filter(|_| filled >> lane & 1 == 1) else { break };
            let lower = (bounds.lower[lane] / scale).next_down().max(0.0);
            if lower <= self.limit && self.decide(isa, pair)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(never)]
    fn decide<I: Isa>(&mut self, isa: I, pair: TrianglePair) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        let a = self.placed.triangle_a(pair.a, pair.lane_a)?;
        let b = self.placed.triangle_b(pair.b, pair.lane_b)?;
        let closest = isa.run(TriangleDistance(&a, &b));
        if triangles_within(&a, &b, &closest, self.within)
            && let ControlFlow::Break(last) = (self.visit)(pair)?
        {
            self.found = Some(last);
            return Ok(ControlFlow::Break(()));
        }
        Ok(ControlFlow::Continue(()))
    }
}

impl Visitor for WithinVisitor<'_> {
    const MEASURE: Measure = Measure::Distance;

    fn order(&self) -> Order {
        Order::Any
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.near.limit
    }

    #[inline(always)]
    fn witness(&self) -> Option<[f32; 3]> {
        None
    }

    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (LeafPacket, LeafPacket),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        let near_pairs = &mut self.near;
        near_pairs.stats.packet_tests += 1;
        let local = near_pairs.placed.local(isa, self.packets, (a, b))?;
        let limit = near_pairs.limit * near_pairs.placed.frame().scale;
        let mut mask = valid_lanes(a.triangles, b.triangles) & near(isa, &local, limit);
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            near_pairs.queue.push(&local, TrianglePair::in_lane(a, b, lane));
            if near_pairs.queue.is_full() && near_pairs.drain(isa)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        if at_once { near_pairs.drain(isa) } else { Ok(ControlFlow::Continue(())) }
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        self.near.drain(isa).map(drop)
    }
}
