//! What may meet during an interval of time: a walk that leaves out everything that is apart all the time.
//!
//! Take a direction x that is fixed in A's frame for the interval. Let all of a part of B be on one side of a part of A
//! along x, by more than `limit * |x|`, at both ends of the interval. Each point of B is within the sagitta of the
//! segment between its places at both ends, and both ends of the segment are beyond the limit. The part of B is
//! therefore on that side all the time, except for the sagitta, which the limit includes together with the clearance. A
//! direction that turns with B would not do, even if it separates both parts at both ends.
//!
//! Nodes are separated along A's directions, by slabs that contain B's slabs at both ends. Pairs of triangles are
//! separated 16 at a time, by their boxes, normals, centroids and closest points ([`crate::leaf::pair_bounds`]).

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::Isa;
use crate::leaf::local::{Local, valid_lanes};
use crate::leaf::pair_bounds::{swept_bounds, swept_near};
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::queue::{TrianglePair, TriangleQueue};
use crate::query::exact::stored;
use crate::query::motion::swept_pairs::{CountApart, Sweep, SweptPair};
use crate::query::placed_pair::{PlacedPair, Walk};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::node_filter::Measure;
use crate::traverse::placement::{ObjectPair, Placement};
use crate::traverse::walk::{Order, Visitor};
use std::ops::ControlFlow;

impl Querier {
    /// Adds the pairs of triangles of two objects that are not certainly apart during the interval. Returns false if
    /// there are more pairs, or more work, than allowed; some pairs are then missing.
    pub(super) fn sweep(
        &mut self,
        (placed, sweep): (&PlacedPair<'_>, &Sweep),
        found: &mut Vec<SweptPair>,
        room: Room,
    ) -> Result<bool, QueryError> {
        self.memory.budget.visit()?;
        let ObjectPair { object_a, object_b, .. } = placed.pair;
        let start = Placement::new(&sweep.start, object_a, object_b);
        let end = Placement::new(&sweep.end, object_a, object_b);
        let pair = ObjectPair { placement: &start, end: &end, ..placed.pair };
        self.queue.clear();
        self.at_end.queue.clear();
        self.start_placed();
        self.at_end.packets.start();
        let mut visitor = Swept {
            packets: &mut self.packets,
            packets_at_end: &mut self.at_end.packets,
            candidates: SweptCandidates {
                placed: [placed.moved(&sweep.start, &start), placed.moved(&sweep.end, &end)],
                queues: [&mut self.queue, &mut self.at_end.queue],
                sweep,
                limit: (sweep.limit as f32).next_up(),
                found,
                room,
                stats: QueryStats::default(),
            },
        };
        let task = &mut Walk { pair: &pair, memory: &mut self.memory, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let (stats, is_whole) = (visitor.candidates.stats, !visitor.candidates.is_full());
        self.stats.add(tests, stats);
        Ok(is_whole)
    }
}

/// Collects pairs of triangles.
struct Swept<'a> {
    /// Of A, and of B at the start of the interval.
    packets: &'a mut [PlacedPackets; 2],
    packets_at_end: &'a mut PlacedPackets,
    candidates: SweptCandidates<'a>,
}

/// Tests pairs of triangles, 16 at a time, and keeps those that are not certainly apart during the interval.
struct SweptCandidates<'a> {
    /// With B at the start of the interval and at its end.
    placed: [PlacedPair<'a>; 2],
    queues: [&'a mut TriangleQueue; 2],
    sweep: &'a Sweep,
    /// The limit of the sweep, rounded up.
    limit: f32,
    found: &'a mut Vec<SweptPair>,
    room: Room,
    stats: QueryStats,
}

/// When a sweep is given up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// The most pairs of triangles.
    pub(super) pairs: usize,
    /// The most pairs of packets to look at.
    pub(super) packet_tests: u64,
}

impl SweptCandidates<'_> {
    fn is_full(&self) -> bool {
        self.found.len() > self.room.pairs || self.stats.packet_tests > self.room.packet_tests
    }

    /// Returns the limit in units of the local frame.
    #[inline(always)]
    fn local_limit(&self) -> f32 {
        self.limit * self.placed[0].frame().scale
    }

    /// Looks at the pairs in the queues, and keeps those that may meet.
    #[inline(always)]
    fn drain<I: Isa>(&mut self, isa: I) -> Result<ControlFlow<()>, QueryError> {
        let limit = self.local_limit();
        let [start, end] = &mut self.queues;
        if start.is_empty() {
            return Ok(ControlFlow::Continue(()));
        }
        let near = swept_bounds(isa, [start, end], limit);
        end.clear();
        for (lane, pair) in start.take().into_iter().enumerate() {
            if let Some(pair) = pair.filter(|_| near >> lane & 1 == 1) {
                self.keep(pair)?;
            }
        }
        if self.found.len() > self.room.pairs {
            // Where faces slide along each other, f32 may not resolve gaps that f64 does. If the first pair is not apart in f64
            // either, the others are not looked at: there really are many pairs near each other.
            let apart = isa.run(CountApart(self.sweep, self.found));
            self.stats.exact_tests += apart as u64 + 1;
            self.found.drain(..apart);
        }
        Ok(if self.is_full() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    /// Keeps a pair.
    #[inline(never)]
    fn keep(&mut self, pair: TrianglePair) -> Result<(), QueryError> {
        let ObjectPair { bvh_a, object_a, bvh_b, object_b, .. } = self.placed[0].pair;
        let a = stored(bvh_a, object_a, pair.a, pair.lane_a)?;
        let b = stored(bvh_b, object_b, pair.b, pair.lane_b)?;
        self.found.push(SweptPair { a, b });
        Ok(())
    }
}

impl Visitor for Swept<'_> {
    const MEASURE: Measure = Measure::Distance;
    const SWEEPS: bool = true;

    fn order(&self) -> Order {
        Order::Any
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.candidates.limit
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
        let limit = candidates.local_limit();
        let [from, to] = &candidates.placed;
        let [packets_a, packets_b] = &mut *self.packets;
        let placed_a = from.place_a(isa, packets_a, a)?;
        let start = Local::new(from.frame(), placed_a, from.place_b(isa, packets_b, b)?);
        let end = Local::new(to.frame(), placed_a, to.place_b(isa, self.packets_at_end, b)?);
        let mut mask = valid_lanes(a.triangles, b.triangles) & swept_near(isa, [&start, &end], limit);
        while mask != 0 {
            let pair = TrianglePair::in_lane(a, b, mask.trailing_zeros() as u8);
            mask &= mask - 1;
            candidates.queues[0].push(&start, pair);
            candidates.queues[1].push(&end, pair);
            if candidates.queues[0].is_full() && candidates.drain(isa)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(if candidates.is_full() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    #[inline(always)]
    fn finish<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        self.candidates.drain(isa).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::bvh::Bvh;
    use crate::isa::Backend;
    use crate::narrow::{Triangle, triangle_distance};
    use crate::pose::Pose;
    use crate::query::exact::placed;
    use crate::query::placed_pair::each_pair;
    use bvh_bake::mesh::Mesh;
    use cbvh_testkit::Random;

    fn point(random: &mut Random) -> [f64; 3] {
        [random.signed(), random.signed(), random.signed()]
    }

    fn pose(random: &mut Random, near: [f64; 3], spread: f64) -> Pose {
        let [x, y, z] = point(random).map(|v| spread * v);
        let shift = point(random);
        let at = [0, 1, 2].map(|k| near[k] + spread * shift[k]);
        let length = (x * x + y * y + z * z + 1.0).sqrt();
        Pose::from_quaternion([x, y, z, 1.0].map(|v| v / length), at).unwrap()
    }

    /// Small triangles all over a cube, some of them without area.
    fn soup(random: &mut Random, size: f64) -> (Vec<Triangle>, Bvh) {
        let mut triangles = Vec::new();
        for number in 0..150 {
            let at = point(random);
            let extent = if number % 7 == 0 { 0.5 } else { 0.1 };
            let [p, q, mut r] = [point(random), point(random), point(random)]
                .map(|v| [0, 1, 2].map(|k| f64::from((size * (at[k] + extent * v[k])) as f32)));
            if number % 10 == 3 {
                r = q;
            }
            triangles.push([p, q, r]);
        }
        let corners = triangles.as_flattened().to_vec();
        let mesh =
            Mesh::from_triangles(corners, (0..150u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
        let options = bvh_bake::Options::default();
        (triangles, Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &options).unwrap().0).unwrap())
    }

    fn sorted(triangle: &Triangle) -> Triangle {
        let mut corners = *triangle;
        corners.sort_by(|p, q| p.partial_cmp(q).unwrap());
        corners
    }

    /// Wherever on the segments between both ends the corners of B are, what a sweep leaves out is beyond the limit.
    #[test]
    fn what_a_sweep_leaves_out_is_apart_on_all_chords() {
        let random = &mut Random::new(3);
        for round in 0..24 {
            let size = [1.0, 1e-3, 3e7][round % 3];
            let ((of_a, a), (of_b, b)) = (soup(random, size), soup(random, size));
            let near = point(random).map(|v| 2.0 * size * v);
            let spread = [0.5, 0.05, 0.002][round / 3 % 3];
            let scaled = |random: &mut Random| {
                let pose = pose(random, near.map(|v| v / size), spread);
                Pose::new(*pose.rotation(), pose.translation().map(|t| t * size)).unwrap()
            };
            let [start, middle, end] = [scaled(random), scaled(random), scaled(random)];
            let limit = size * [0.1, 1e-3, 1e-6][round / 8];
            let sweep = Sweep { start, middle, end, limit, box_limit: limit };
            for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                let mut querier = Querier::with_backend(backend);
                querier.start();
                let mut found = Vec::new();
                let room = Room { pairs: usize::MAX, packet_tests: u64::MAX };
                each_pair(a.all(), b.all(), &middle, |placed| {
                    assert!(querier.sweep((placed, &sweep), &mut found, room)?);
                    Ok(None::<()>)
                })
                .unwrap();
                let mut kept: Vec<_> = found.iter().map(|pair| [sorted(&pair.a), sorted(&pair.b)]).collect();
                kept.sort_by(|x, y| x.partial_cmp(y).unwrap());
                assert!(kept.len() < of_a.len() * of_b.len() / 2, "{} pairs are kept", kept.len());
                for (triangle_a, triangle_b) in of_a.iter().flat_map(|a| of_b.iter().map(move |b| (a, b))) {
                    let key = [sorted(triangle_a), sorted(triangle_b)];
                    if kept.binary_search_by(|pair| pair.partial_cmp(&key).unwrap()).is_ok() {
                        continue;
                    }
                    let [from, to] = [placed(triangle_b, &start), placed(triangle_b, &end)];
                    for sample in 0..6 {
                        let share = [0, 1, 2].map(|_| (0.5 + 0.5 * random.signed()).clamp(0.0, 1.0));
                        let share = if sample < 2 { [f64::from(sample); 3] } else { share };
                        let on_chords = [0, 1, 2]
                            .map(|c| [0, 1, 2].map(|k| from[c][k] + share[c] * (to[c][k] - from[c][k])));
                        let distance = triangle_distance(triangle_a, &on_chords).distance;
                        assert!(
                            distance > limit * (1.0 - 1e-6),
                            "{distance:e} of {limit:e}, round {round}, {backend}"
                        );
                    }
                }
            }
        }
    }
}
