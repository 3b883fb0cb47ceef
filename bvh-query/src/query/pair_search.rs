//! The search for the closest pair of triangles.
//!
//! Pairs of triangles are bounded in f32, 16 at a time. Those that may be the closest are kept, and settled in f64 at
//! the end, nearest first. Pruning is strict: a pair is left out only if its distance certainly exceeds that of another
//! pair. The answer therefore does not depend on the order of visits. It is the pair with the least f64 distance and,
//! of equal ones, that with the smallest triangle numbers.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::Isa;
use crate::leaf::local::valid_lanes;
use crate::leaf::pair_bounds::{bounds, near, near_along};
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::narrow::{Closest, triangles_intersect, triangles_within};
use crate::numerics::{SLACK, round_up};
use crate::query::exact::TriangleDistance;
use crate::query::options::DistanceOptions;
use crate::query::placed_pair::{FoundPair, PlacedPair, VisitPair};
use crate::query::stats::QueryStats;
use crate::traverse::node_filter::Measure;
use crate::traverse::walk::{Order, Visitor};
use std::ops::ControlFlow;

/// Pairs of leaf packets to visit best-first before the walk goes on depth-first.
const BEST_FIRST_LEAF_PAIRS: u32 = 2;
/// Bounded pairs kept before the nearest are settled and the rest is thinned out.
const MAX_BOUNDED_PAIRS: usize = 256;

/// A pair of triangles that may be the closest, with bounds of its distance in mesh units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BoundedPair {
    lower: f32,
    upper: f32,
    pair: TrianglePair,
}

/// The closest pair so far.
#[derive(Clone, Copy)]
pub(super) struct BestPair {
    pub(super) closest: Closest,
    pub(super) found: FoundPair,
    /// The ids of both triangles.
    pub(super) ids: (u32, u32),
}

/// Returns the ids of both triangles.
pub(super) fn ids(placed: &PlacedPair<'_>, pair: &TrianglePair) -> Result<(u32, u32), QueryError> {
    let (a, b) = (&placed.pair.object_a, &placed.pair.object_b);
    Ok((placed.pair.bvh_a.triangle_id(a, pair.place_a())?, placed.pair.bvh_b.triangle_id(b, pair.place_b())?))
}

/// What is known of the distance so far, over all pairs of objects.
pub(super) struct PairSearch {
    options: DistanceOptions,
    /// The errors that the options allow are of the distance beyond this one, the sum of radii.
    beyond: f64,
    /// The question of `within`: stop at the first pair at most this far apart.
    enough: Option<f64>,
    pub(super) best: Option<BestPair>,
    /// A pair in contact, which ends the search. Which one it is depends on the backend.
    pub(super) touching: Option<FoundPair>,
    /// The least certified lower bound of the pairs settled.
    settled_lower: f64,
    /// No pair is farther apart than this: f32, rounded up.
    upper: f32,
    /// Pairs whose lower bound exceeds this do not matter.
    limit: f32,
    pub(super) done: bool,
    /// A direction along which the meshes are likely apart, at most of length 1.
    direction: Option<[f32; 3]>,
    order: Order,
}

impl PairSearch {
    /// Starts a search that stops at the first pair at most `enough` apart, or that looks for the closest pair if `enough`
    /// is infinite.
    pub(super) fn new(options: DistanceOptions, enough: f64) -> Self {
        let mut search = Self {
            options,
            beyond: 0.0,
            enough: enough.is_finite().then_some(enough),
            best: None,
            touching: None,
            settled_lower: f64::INFINITY,
            upper: f32::INFINITY,
            limit: f32::INFINITY,
            done: false,
            direction: None,
            order: Order::Best { leaves: BEST_FIRST_LEAF_PAIRS },
        };
        search.lower_upper(round_up(enough * (1.0 + SLACK)));
        search
    }

    /// Starts a search for the closest pair of two cores, given the sum of the radii around them.
    pub(super) fn between_shapes(options: DistanceOptions, beyond: f64) -> Self {
        Self { beyond, ..Self::new(options, f64::INFINITY) }
    }

    /// Limits the search by a pair of triangles of the meshes: pairs farther apart are not looked at. The pair itself is
    /// still to be found by the walk.
    pub(super) fn start_from(&mut self, closest: &Closest) {
        let Closest { point_a, point_b, upper, .. } = closest;
        self.direction = within_unit([0, 1, 2].map(|axis| point_b[axis] - point_a[axis]));
        self.order = Order::Nearest;
        self.lower_upper(with_slack(*upper));
    }

    /// Leaves out pairs of triangles that are certainly farther apart than this.
    pub(super) fn limit_to(&mut self, distance: f64) {
        self.lower_upper(with_slack(distance));
    }

    /// Returns the limit: pairs whose lower bound exceeds it do not matter.
    pub(super) fn limit(&self) -> f32 {
        self.limit
    }

    /// Returns a direction along which the meshes are likely apart, at most of length 1.
    pub(super) fn direction(&self) -> Option<[f32; 3]> {
        self.direction
    }

    /// Returns the pair in contact, or the closest one so far.
    pub(super) fn found(&self) -> Option<FoundPair> {
        self.touching.or(self.best.map(|best| best.found))
    }

    /// Returns a distance that no two triangles of the meshes are below: pruned pairs are beyond the limit, which has
    /// only ever decreased, and the others have been settled.
    pub(super) fn proved(&self) -> f64 {
        self.settled_lower.min(f64::from(self.limit))
    }

    /// Returns the limit beyond which pairs may be pruned, given an upper bound of the distance.
    fn limit_of(&self, upper: f64) -> f64 {
        let DistanceOptions { rel_err, abs_err } = self.options;
        if self.beyond == 0.0 {
            return ((upper - abs_err) / (1.0 + rel_err)).max(0.0);
        }
        // Where the shapes may touch, nothing is left out: it must be decided whether they do.
        upper.min(self.beyond + ((upper - self.beyond - abs_err) / (1.0 + rel_err)).max(0.0))
    }

    /// Adopts a better upper bound.
    fn lower_upper(&mut self, upper: f32) {
        if upper < self.upper {
            self.upper = upper;
            self.limit = round_up(self.limit_of(f64::from(upper)));
        }
    }

    /// Settles a pair in f64. `may_touch` tells that no gap has been proved.
    fn settle<I: Isa>(
        &mut self,
        isa: I,
        placed: &PlacedPair<'_>,
        pair: TrianglePair,
        may_touch: bool,
    ) -> Result<(), QueryError> {
        let triangle_a = placed.triangle_a(pair.a, pair.lane_a)?;
        let triangle_b = placed.triangle_b(pair.b, pair.lane_b)?;
        let found = FoundPair { numbers: placed.numbers, pair };
        // Most pairs without a gap touch, and a touching pair needs no distance.
        if may_touch && triangles_intersect(&triangle_a, &triangle_b) {
            (self.touching, self.done) = (Some(found), true);
            return Ok(());
        }
        let closest = isa.run(TriangleDistance(&triangle_a, &triangle_b));
        self.settled_lower = self.settled_lower.min(closest.lower);
        let nearer = match &self.best {
            None => true,
            Some(best) if closest.distance == best.closest.distance => {
                let order = |numbers: (u32, u32), ids: (u32, u32)| (numbers.0, ids.0, numbers.1, ids.1);
                order(placed.numbers, ids(placed, &pair)?) < order(best.found.numbers, best.ids)
            }
            Some(best) => closest.distance < best.closest.distance,
        };
        if nearer {
            self.best = Some(BestPair { closest, found, ids: ids(placed, &pair)? });
        }
        self.lower_upper(with_slack(closest.upper));
        self.done |= match self.enough {
            Some(d) => triangles_within(&triangle_a, &triangle_b, &closest, d),
            None => false,
        };
        Ok(())
    }
}

/// Returns the limit that a pair of triangles sets, with slack for the error of the f64 distance itself, so that pairs as
/// near or nearly as near are kept.
fn with_slack(upper: f64) -> f32 {
    round_up(upper * (1.0 + SLACK))
}

/// Scales a direction to a length of at most 1. A direction of no length gives none.
fn within_unit(direction: [f64; 3]) -> Option<[f32; 3]> {
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let unit = direction.map(|d| (d / length * (1.0 - 2f64.powi(-20))) as f32);
    (length > 0.0 && unit.iter().all(|d| d.is_finite())).then_some(unit)
}

/// Collects pairs of triangles that may be the closest.
pub(super) struct NearestPairs<'a> {
    /// Of A and of B.
    pub(super) packets: &'a mut [PlacedPackets; 2],
    pub(super) finalists: Finalists<'a>,
}

/// The question for all pairs of triangles within a distance: the contacts of rounded shapes.
pub(super) struct EachWithin<'a> {
    pub(super) d: f64,
    pub(super) visit: VisitPair<'a>,
    /// What `visit` broke with.
    pub(super) found: Option<TrianglePair>,
}

/// Bounds pairs of triangles and measures those that still may be the closest.
pub(super) struct Finalists<'a> {
    pub(super) placed: &'a PlacedPair<'a>,
    pub(super) search: &'a mut PairSearch,
    /// With it, the limit stays as it is, and each pair is decided.
    pub(super) each_within: Option<EachWithin<'a>>,
    pub(super) queue: &'a mut TriangleQueue,
    pub(super) bounded: &'a mut Vec<BoundedPair>,
    /// The direction of the closest pair so far, at most of length 1.
    pub(super) direction: Option<[f32; 3]>,
    pub(super) stats: QueryStats,
}

impl Finalists<'_> {
    /// Bounds the distances of the pairs in the queue, and keeps those that may be the closest.
    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        if self.queue.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        let scale = self.placed.frame().scale;
        let (bounds, filled) = (bounds(isa, self.queue), self.queue.filled());
        for (lane, pair) in self.queue.take().into_iter().enumerate() {
            let Some(pair) = pair.filter(|_| filled >> lane & 1 == 1) else { break };
            // A power of two: exact, unless the meshes are so tiny that it takes a last outward step.
            let lower = (bounds.lower[lane] / scale).next_down().max(0.0);
            let upper = (bounds.upper[lane] / scale).next_up();
            if lower > self.search.limit {
                continue;
            }
            if self.each_within.is_some() {
                if self.decide(isa, pair)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                continue;
            }
            if upper < self.search.upper {
                self.search.lower_upper(upper);
                self.look_along(bounds.direction.map(|axis| axis[lane]));
            }
            if lower <= 0.0 {
                // The pair may touch, and then the search is over.
                if self.settle(isa, pair, true)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            } else {
                self.bounded.push(BoundedPair { lower, upper, pair });
                if self.bounded.len() >= MAX_BOUNDED_PAIRS && self.settle_bounded(isa)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Decides whether a pair is within the distance, and tells of it if it is.
    #[inline(never)]
    fn decide<I: Isa>(&mut self, isa: I, pair: TrianglePair) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        let Some(each) = &mut self.each_within else { return Ok(ControlFlow::Continue(())) };
        let a = self.placed.triangle_a(pair.a, pair.lane_a)?;
        let b = self.placed.triangle_b(pair.b, pair.lane_b)?;
        let closest = isa.run(TriangleDistance(&a, &b));
        if triangles_within(&a, &b, &closest, each.d)
            && let ControlFlow::Break(last) = (each.visit)(pair)?
        {
            each.found = Some(last);
            return Ok(ControlFlow::Break(()));
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(never)]
    fn settle<I: Isa>(
        &mut self,
        isa: I,
        pair: TrianglePair,
        may_touch: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        self.search.settle(isa, self.placed, pair, may_touch)?;
        Ok(if self.search.done { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Settles the bounded pairs that still may be the closest, nearest first.
    #[inline(never)]
    fn settle_bounded<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        self.bounded.sort_unstable_by(|x, y| y.lower.total_cmp(&x.lower));
        while let Some(bounded) = self.bounded.pop() {
            // With an allowed error, the pair that the limit came from may be beyond it.
            if bounded.lower > self.search.limit && bounded.upper > self.search.upper {
                continue;
            }
            if self.settle(isa, bounded.pair, false)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Remembers the direction of the closest pair, scaled to a length of at most 1.
    fn look_along(&mut self, direction: [f32; 3]) {
        self.direction = within_unit(direction.map(f64::from)).or(self.direction);
    }
}

impl Visitor for NearestPairs<'_> {
    const MEASURE: Measure = Measure::Distance;
    const MAY_BE_BEST_FIRST: bool = true;
    const HAS_SEPARATING_DIRECTION: bool = true;

    fn order(&self) -> Order {
        // Other orders may visit a pair of leaves twice, and each pair is told of once.
        if self.finalists.each_within.is_some() { Order::Any } else { self.finalists.search.order }
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.finalists.search.limit
    }

    #[inline(always)]
    fn separating_direction(&self) -> Option<[f32; 3]> {
        self.finalists.direction
    }

    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (LeafPacket, LeafPacket),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        let finalists = &mut self.finalists;
        finalists.stats.packet_tests += 1;
        let local = finalists.placed.local(isa, self.packets, (a, b))?;
        let limit = finalists.search.limit * finalists.placed.frame().scale;
        let mut mask = valid_lanes(a.triangles, b.triangles);
        if let Some(direction) = finalists.direction {
            mask &= near_along(isa, &local, direction, limit);
        }
        if mask != 0 {
            mask &= near(isa, &local, limit);
        }
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            finalists.queue.push(&local, TrianglePair::in_lane(a, b, lane));
            if finalists.queue.is_full() && finalists.drain(isa)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        if at_once { finalists.drain(isa) } else { Ok(ControlFlow::Continue(())) }
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        if self.finalists.drain(isa)?.is_continue() {
            let _ = self.finalists.settle_bounded(isa)?;
        }
        Ok(())
    }
}
