//! How far apart are the meshes, where, and is it less than d?
//!
//! Pairs of triangles are bounded in f32, 16 at a time; those that may be the closest are kept as
//! candidates and settled in f64 at the end, nearest first. Pruning is strict: a pair is left out
//! only if its distance certainly exceeds that of another, so that the answer - the least f64
//! distance, of equal ones that with the smallest triangle numbers - does not depend on the order of
//! visits. Touching meshes are at distance 0, and the pair of triangles is the first in the order of
//! the trees.

use super::exact::TriangleDistance;
use super::{Found, Querier, QueryStats, Scene, Traversal, each_pair, sphere_gap};
use crate::bvh::Shape;
use crate::error::QueryError;
use crate::isa::Isa;
use crate::leaf::decoded::Decoded;
use crate::leaf::distance::{bounds, near, near_along};
use crate::leaf::local::{Local, valid_lanes};
use crate::leaf::queue::{self, Queue};
use crate::narrow::{Closest, triangles_within};
use crate::pose::Pose;
use crate::traverse::align::round_up;
use crate::traverse::opened::Leaf;
use crate::traverse::pair::{Measure, Order, Visitor};
use std::ops::ControlFlow;

/// Leaf pairs to visit best-first before going on depth-first.
const BEST_FIRST_LEAVES: u32 = 2;
/// Candidates kept before the nearest are settled and the rest thinned out.
const MANY_CANDIDATES: usize = 256;

/// How exact a distance has to be.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DistanceOptions {
    /// The answer may exceed the least distance by this fraction of it.
    pub rel_err: f64,
    /// And by this much, mesh units.
    pub abs_err: f64,
}

/// The least distance of two meshes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// The distance in mesh units; 0 if and only if the meshes touch.
    pub distance: f64,
    /// The two triangles named here are certainly at least this far apart, and with an allowed error
    /// no two triangles of the meshes are nearer. Exact arithmetic, not this, decides whether the
    /// meshes touch.
    pub lower: f64,
    /// The two triangles, and so the meshes, are certainly at most this far apart.
    pub upper: f64,
    /// The closest point on A, in A's frame.
    pub point_a: [f64; 3],
    /// The closest point on B, in A's frame.
    pub point_b: [f64; 3],
    /// Number of the object of A in its file.
    pub object_a: u32,
    /// Triangle of A with that point: its number in the input.
    pub triangle_a: u32,
    /// Number of the object of B in its file.
    pub object_b: u32,
    /// Triangle of B with that point.
    pub triangle_b: u32,
}

/// A pair of triangles that may be the closest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    /// Bounds of the distance, mesh units.
    lower: f32,
    upper: f32,
    pair: queue::Candidate,
}

/// The closest pair so far.
#[derive(Clone, Copy)]
pub(super) struct Best {
    closest: Closest,
    pub(super) found: Found,
    ids: (u32, u32),
}

impl Querier {
    /// The least distance of the meshes with B placed by `pose` in A's frame, with both closest
    /// points and their triangles.
    ///
    /// The distance is that of the placed vertices' triangles to within a few roundings of f64 at
    /// the scale of the two closest triangles. Bit-identical on all backends.
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn distance<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        self.distance_with(a, b, pose, &DistanceOptions::default())
    }

    /// The same, not necessarily the least: allowed errors save time. `lower` says what has been
    /// proved. With an allowed error, which of the allowed answers is found may depend on the
    /// backend.
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn distance_with<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &DistanceOptions,
    ) -> Result<Distance, QueryError> {
        let (a, b) = (a.into(), b.into());
        self.start();
        let mut search = Search::new(*options, f64::INFINITY);
        // Shapes have triangles, and nothing is pruned before a distance is known.
        let best = self.nearest(a, b, pose, &mut search)?.ok_or_else(|| no_answer(a))?;
        Ok(best.distance(search.proved()))
    }

    /// The closest pair of triangles that the limit of `search` leaves to be found; of touching meshes, the first
    /// contact.
    pub(super) fn nearest(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        search: &mut Search,
    ) -> Result<Option<Best>, QueryError> {
        self.search(a, b, pose, search)?;
        if search.best.is_some_and(|best| best.closest.distance == 0.0) {
            return Ok(self.first_contact(a, b, pose)?.or(search.best));
        }
        Ok(search.best)
    }

    /// True if the placed meshes are at most `d` apart (mesh units). That is exact, also where `d` is between
    /// the bounds of [`Querier::distance`]: integers of any length decide there, and are the one thing that a
    /// warm query allocates. NaN is no distance: false.
    ///
    /// # Errors
    /// If a page that the query touches is damaged.
    pub fn within<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        let (a, b) = (a.into(), b.into());
        if d.is_nan() || d < 0.0 || d == f64::INFINITY {
            self.start();
            return Ok(d > 0.0);
        }
        if d == 0.0 {
            return self.collide(a, b, pose);
        }
        self.start();
        let mut search = Search::new(DistanceOptions::default(), d);
        self.search(a, b, pose, &mut search)?;
        Ok(search.done)
    }

    /// Looks for the closest pair that the limit of `search` leaves to be found.
    pub(super) fn search(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        search: &mut Search,
    ) -> Result<(), QueryError> {
        each_pair(a, b, pose, |scene| {
            self.stack.visit()?;
            let gap = sphere_gap(scene.pair.placement, scene.pair.object_a, scene.pair.object_b);
            if gap > f64::from(search.limit) {
                return Ok(None);
            }
            self.queue.clear();
            self.decoded.iter_mut().for_each(Decoded::start);
            self.candidates.clear();
            let mut visitor = Nearest {
                scene,
                direction: search.direction,
                search,
                queue: &mut self.queue,
                decoded: &mut self.decoded,
                candidates: &mut self.candidates,
                stats: QueryStats::default(),
            };
            let task = Traversal { pair: scene.pair, stack: &mut self.stack, visitor: &mut visitor };
            let tests = self.backend.run(task)?;
            let stats = visitor.stats;
            self.stats.add(tests, stats);
            Ok(search.done.then_some(()))
        })?;
        Ok(())
    }

    /// The answer for touching meshes: the first contact in the order of the trees.
    #[cold]
    pub(super) fn first_contact(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Option<Best>, QueryError> {
        each_pair(a, b, pose, |scene| {
            let Some(pair) = self.find_contact(scene, Order::Tree)? else { return Ok(None) };
            let triangle_a = scene.triangle_a(pair.a, pair.lane_a)?;
            let triangle_b = scene.triangle_b(pair.b, pair.lane_b)?;
            let closest = self.backend.run(TriangleDistance(&triangle_a, &triangle_b));
            let ids = ids(scene, &pair)?;
            Ok(Some(Best { closest, found: Found { numbers: scene.numbers, pair }, ids }))
        })
    }
}

/// A distance without a pair of triangles: only a forged file can bring it about.
#[cold]
pub(super) fn no_answer(a: Shape<'_>) -> QueryError {
    let at = a.bvh().layout().page_offset(0);
    bvh_format::FormatError::new(bvh_format::Rule::VertexFinite, at, "finite triangles", "none").into()
}

fn ids(scene: &Scene<'_>, pair: &queue::Candidate) -> Result<(u32, u32), QueryError> {
    let (a, b) = (&scene.pair.object_a, &scene.pair.object_b);
    Ok((scene.pair.bvh_a.triangle_id(a, pair.place_a())?, scene.pair.bvh_b.triangle_id(b, pair.place_b())?))
}

impl Best {
    /// As an answer, given what `Search::proved` says.
    pub(super) fn distance(&self, proved: f64) -> Distance {
        let lower = if self.closest.distance == 0.0 { 0.0 } else { proved };
        let (object_a, object_b) = self.found.numbers;
        Distance {
            distance: self.closest.distance,
            lower,
            upper: self.closest.upper,
            point_a: self.closest.point_a,
            point_b: self.closest.point_b,
            object_a,
            triangle_a: self.ids.0,
            object_b,
            triangle_b: self.ids.1,
        }
    }
}

/// What is known of the distance, over all pairs of objects.
pub(super) struct Search {
    options: DistanceOptions,
    /// `within`'s question: stop at the first pair at most this far apart.
    enough: Option<f64>,
    pub(super) best: Option<Best>,
    /// The least certified lower bound of the pairs settled.
    settled_lower: f64,
    /// No pair is farther apart than this: f32, rounded up.
    upper: f32,
    /// Pairs with a lower bound beyond this do not matter.
    limit: f32,
    pub(super) done: bool,
    /// Along which the meshes are likely apart, at most of length 1.
    direction: Option<[f32; 3]>,
    order: Order,
}

impl Search {
    /// Stops at the first pair at most `enough` apart, or looks for the closest if that is infinite.
    pub(super) fn new(options: DistanceOptions, enough: f64) -> Self {
        let mut search = Self {
            options,
            enough: enough.is_finite().then_some(enough),
            best: None,
            settled_lower: f64::INFINITY,
            upper: f32::INFINITY,
            limit: f32::INFINITY,
            done: false,
            direction: None,
            order: Order::Best { leaves: BEST_FIRST_LEAVES },
        };
        search.lower_upper(round_up(enough * (1.0 + 2f64.powi(-40))));
        search
    }

    /// Starts from a pair of triangles of the meshes: what is farther apart is not looked at, and the pair
    /// itself is yet to be found.
    pub(super) fn start_from(&mut self, closest: &Closest) {
        let Closest { point_a, point_b, upper, .. } = closest;
        self.direction = within_unit([0, 1, 2].map(|axis| point_b[axis] - point_a[axis]));
        self.order = Order::Nearest;
        self.lower_upper(with_slack(*upper));
    }

    /// No two triangles of the meshes are nearer: what was pruned is beyond the limit, which only ever came
    /// down; the rest has been settled.
    pub(super) fn proved(&self) -> f64 {
        self.settled_lower.min(f64::from(self.limit))
    }

    /// What has been proved when pairs beyond `limit_of(upper)` are pruned.
    fn limit_of(&self, upper: f64) -> f64 {
        ((upper - self.options.abs_err) / (1.0 + self.options.rel_err)).max(0.0)
    }

    /// Takes over a better upper bound.
    fn lower_upper(&mut self, upper: f32) {
        if upper < self.upper {
            self.upper = upper;
            self.limit = round_up(self.limit_of(f64::from(upper)));
        }
    }

    /// Settles a pair in f64.
    fn settle<I: Isa>(
        &mut self,
        isa: I,
        scene: &Scene<'_>,
        pair: queue::Candidate,
    ) -> Result<(), QueryError> {
        let triangle_a = scene.triangle_a(pair.a, pair.lane_a)?;
        let triangle_b = scene.triangle_b(pair.b, pair.lane_b)?;
        let closest = isa.run(TriangleDistance(&triangle_a, &triangle_b));
        self.settled_lower = self.settled_lower.min(closest.lower);
        let nearer = match &self.best {
            None => true,
            Some(best) if closest.distance == best.closest.distance => {
                let order = |numbers: (u32, u32), ids: (u32, u32)| (numbers.0, ids.0, numbers.1, ids.1);
                order(scene.numbers, ids(scene, &pair)?) < order(best.found.numbers, best.ids)
            }
            Some(best) => closest.distance < best.closest.distance,
        };
        if nearer {
            let found = Found { numbers: scene.numbers, pair };
            self.best = Some(Best { closest, found, ids: ids(scene, &pair)? });
        }
        self.lower_upper(with_slack(closest.upper));
        self.done |= match self.enough {
            Some(d) => triangles_within(&triangle_a, &triangle_b, &closest, d),
            None => closest.distance == 0.0,
        };
        Ok(())
    }
}

/// The limit that a pair of triangles sets, with slack for the f64 distance's own error: equal and nearly equal
/// pairs stay candidates.
fn with_slack(upper: f64) -> f32 {
    round_up(upper * (1.0 + 2f64.powi(-40)))
}

/// A direction made at most 1 long; none if it has no length.
fn within_unit(direction: [f64; 3]) -> Option<[f32; 3]> {
    let length = direction.iter().map(|d| d * d).sum::<f64>().sqrt();
    let unit = direction.map(|d| (d / length * (1.0 - 2f64.powi(-20))) as f32);
    (length > 0.0 && unit.iter().all(|d| d.is_finite())).then_some(unit)
}

/// Looks for the closest pair of triangles.
struct Nearest<'a> {
    scene: &'a Scene<'a>,
    search: &'a mut Search,
    queue: &'a mut Queue,
    decoded: &'a mut [Decoded; 2],
    candidates: &'a mut Vec<Candidate>,
    /// Of the closest pair so far, at most of length 1.
    direction: Option<[f32; 3]>,
    stats: QueryStats,
}

impl Nearest<'_> {
    /// Bounds the distances of the pairs in the queue, and keeps those that may be the closest.
    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        if self.queue.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        let scale = self.scene.frame().scale;
        let (bounds, filled) = (bounds(isa, self.queue), self.queue.filled());
        for (lane, pair) in self.queue.take().into_iter().enumerate() {
            let Some(pair) = pair.filter(|_| filled >> lane & 1 == 1) else { break };
            // A power of two: exact, unless the meshes are so tiny that it takes a last outward step.
            let lower = (bounds.lower[lane] / scale).next_down().max(0.0);
            let upper = (bounds.upper[lane] / scale).next_up();
            if lower > self.search.limit {
                continue;
            }
            if upper < self.search.upper {
                self.search.lower_upper(upper);
                self.look_along(bounds.direction.map(|axis| axis[lane]));
            }
            if lower <= 0.0 {
                // Perhaps touching: knowing at once may end the search.
                if self.settle(isa, pair)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            } else {
                self.candidates.push(Candidate { lower, upper, pair });
                if self.candidates.len() >= MANY_CANDIDATES && self.settle_candidates(isa)?.is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    #[inline(never)]
    fn settle<I: Isa>(&mut self, isa: I, pair: queue::Candidate) -> Result<ControlFlow<()>, QueryError> {
        self.stats.exact_tests += 1;
        self.search.settle(isa, self.scene, pair)?;
        Ok(if self.search.done { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Settles the candidates that still may be the closest, nearest first.
    #[inline(never)]
    fn settle_candidates<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        self.candidates.sort_unstable_by(|x, y| y.lower.total_cmp(&x.lower));
        while let Some(candidate) = self.candidates.pop() {
            // With an allowed error, the pair that the limit came from may be beyond it.
            if candidate.lower > self.search.limit && candidate.upper > self.search.upper {
                continue;
            }
            if self.settle(isa, candidate.pair)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Remembers the direction of the closest pair, made at most 1 long.
    fn look_along(&mut self, direction: [f32; 3]) {
        self.direction = within_unit(direction.map(f64::from)).or(self.direction);
    }
}

impl Visitor for Nearest<'_> {
    const MEASURE: Measure = Measure::Distance;

    fn order(&self) -> Order {
        self.search.order
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.search.limit
    }

    #[inline(always)]
    fn witness(&self) -> Option<[f32; 3]> {
        self.direction
    }

    #[inline(always)]
    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (Leaf, Leaf),
        at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.stats.packet_tests += 1;
        let pair = &self.scene.pair;
        let [decoded_a, decoded_b] = &mut *self.decoded;
        let packet_a = pair.bvh_a.packet_again(pair.object_a, a, decoded_a)?;
        let packet_b = pair.bvh_b.packet_again(pair.object_b, b, decoded_b)?;
        let local = Local::new(isa, self.scene.frame(), packet_a, packet_b);
        let limit = self.search.limit * self.scene.frame().scale;
        let mut mask = valid_lanes(a.triangles, b.triangles);
        if let Some(direction) = self.direction {
            mask &= near_along(isa, &local, direction, limit);
        }
        if mask != 0 {
            mask &= near(isa, &local, limit);
        }
        while mask != 0 {
            let lane = mask.trailing_zeros() as u8;
            mask &= mask - 1;
            self.queue.push(&local, queue::Candidate::in_lane(a, b, lane));
            if self.queue.is_full() && self.drain(isa)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        if at_once { self.drain(isa) } else { Ok(ControlFlow::Continue(())) }
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        if self.drain(isa)?.is_continue() {
            let _ = self.settle_candidates(isa)?;
        }
        Ok(())
    }
}
