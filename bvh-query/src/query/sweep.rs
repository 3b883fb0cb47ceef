//! What may meet during an interval of time: a walk that leaves out what is apart all the time.
//!
//! Take a direction x that is fixed in A's frame for the interval. If at both ends of the interval all of a part of B is on one
//! side of a part of A along x, by more than `limit * |x|`, then it is all the time, but for the sagitta: each point of B is
//! within the sagitta of the segment between where it is at the ends, and both ends of the segment are beyond. The limit is
//! the clearance and the sagitta, and more. It would not do for a direction that turns with B to set both apart at both ends.
//!
//! Nodes are set apart along A's directions, by the slabs that hold B's at both ends. Pairs of triangles are set apart by
//! their boxes, or along the line between their closest points in the middle of the interval.

use crate::error::QueryError;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Task};
use crate::narrow::{Closest, Point, Triangle, cross, dot, subtract, triangle_distance};
use crate::pose::Pose;
use crate::query::answers::QueryStats;
use crate::query::exact::placed;
use crate::query::placed_pair::Walk;
use crate::query::querier::Querier;
use crate::traverse::node_test::Measure;
use crate::traverse::placement::{ObjectPair, Placement};
use crate::traverse::walk::{Order, Visitor};
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use std::ops::ControlFlow;

/// Two triangles that may meet, each in the frame of its own mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweptPair {
    pub(super) a: Triangle,
    pub(super) b: Triangle,
}

/// An interval of time: where B is at its start, in the middle and at its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    pub(super) start: Pose,
    pub(super) middle: Pose,
    pub(super) end: Pose,
    /// How far apart parts have to be, in mesh units, to be left out.
    pub(super) limit: f64,
}

impl Sweep {
    /// Returns whether two triangles are farther apart than the limit all the time, as far as can be seen.
    pub(super) fn sets_apart(&self, pair: &SweptPair) -> bool {
        let ends = [placed(&pair.b, &self.start), placed(&pair.b, &self.end)];
        self.boxes_are_apart(&pair.a, &ends) || {
            let middle = placed(&pair.b, &self.middle);
            self.normals_set_apart(&pair.a, &ends, &middle) || {
                let closest = triangle_distance(&pair.a, &middle);
                self.closest_set_apart(&pair.a, &ends, &closest)
            }
        }
    }

    fn boxes_are_apart(&self, a: &Triangle, ends: &[Triangle; 2]) -> bool {
        (0..3).any(|axis| {
            let of_a = a.map(|corner| corner[axis]);
            let of_b = ends.map(|end| end.map(|corner| corner[axis]));
            let of_b = of_b.as_flattened();
            least(of_b) - most(&of_a) > self.limit || least(&of_a) - most(of_b) > self.limit
        })
    }

    /// Decides along the line between the closest points.
    fn closest_set_apart(&self, a: &Triangle, ends: &[Triangle; 2], closest: &Closest) -> bool {
        self.is_apart_along(subtract(closest.point_b, closest.point_a), a, ends)
    }

    /// Decides along the normals of both triangles: many pairs, in a tenth of the time that closest points take.
    fn normals_set_apart(&self, a: &Triangle, ends: &[Triangle; 2], middle: &Triangle) -> bool {
        self.is_apart_along(normal(a), a, ends) || self.is_apart_along(normal(middle), a, ends)
    }

    /// Returns whether a direction sets the triangles apart, in either sense.
    #[inline(always)]
    fn is_apart_along(&self, x: Point, a: &Triangle, ends: &[Triangle; 2]) -> bool {
        let along = |corner: &Point| dot(x, *corner);
        let of_a = a.each_ref().map(along);
        let of_b = ends.each_ref().map(|end| end.each_ref().map(along));
        let of_b = of_b.as_flattened();
        let gap = (least(of_b) - most(&of_a)).max(least(&of_a) - most(of_b));
        // Where x underflows, nothing is apart along it.
        gap > 0.0 && gap > self.limit * dot(x, x).sqrt()
    }
}

fn normal([p, q, r]: &Triangle) -> Point {
    cross(subtract(*q, *p), subtract(*r, *p))
}

fn least(values: &[f64]) -> f64 {
    values.iter().fold(f64::INFINITY, |least, &value| least.min(value))
}

fn most(values: &[f64]) -> f64 {
    values.iter().fold(f64::NEG_INFINITY, |most, &value| most.max(value))
}

impl Querier {
    /// Adds the pairs of triangles of two objects that the interval does not set apart. Returns false if there are more of
    /// them, or more work, than there is room for; then some are missing.
    pub(super) fn sweep(
        &mut self,
        (pair, sweep): (&ObjectPair<'_>, &Sweep),
        found: &mut Vec<SweptPair>,
        room: Room,
    ) -> Result<bool, QueryError> {
        self.memory.visit()?;
        let ObjectPair { object_a, object_b, .. } = *pair;
        let placement = Placement::new(&sweep.start, object_a, object_b);
        let end = Placement::new(&sweep.end, object_a, object_b);
        let pair = ObjectPair { placement: &placement, end: &end, ..*pair };
        let mut visitor = Swept {
            pair,
            sweep,
            limit: (sweep.limit as f32).next_up(),
            found,
            room,
            stats: QueryStats::default(),
        };
        let task = Walk { pair, memory: &mut self.memory, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let (stats, is_whole) = (visitor.stats, !visitor.is_full());
        self.stats.add(tests, stats);
        Ok(is_whole)
    }
}

/// Collects pairs of triangles.
struct Swept<'a> {
    pair: ObjectPair<'a>,
    sweep: &'a Sweep,
    /// The limit of the sweep, rounded up.
    limit: f32,
    found: &'a mut Vec<SweptPair>,
    room: Room,
    stats: QueryStats,
}

impl Swept<'_> {
    fn is_full(&self) -> bool {
        self.found.len() > self.room.pairs || self.stats.packet_tests > self.room.packet_tests
    }
}

/// When a sweep is given up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// The most pairs of triangles.
    pub(super) pairs: usize,
    /// The most pairs of packets to look at.
    pub(super) packet_tests: u64,
}

/// Decides whether the middle of an interval sets two triangles apart, with the features of a backend.
struct SetsApart<'a> {
    sweep: &'a Sweep,
    a: &'a Triangle,
    /// The triangle of B at both ends and in the middle.
    ends: &'a [Triangle; 2],
    middle: &'a Triangle,
}

impl Task for SetsApart<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self, _isa: I) -> bool {
        let closest = triangle_distance(self.a, self.middle);
        self.sweep.closest_set_apart(self.a, self.ends, &closest)
    }
}

impl Visitor for Swept<'_> {
    const MEASURE: Measure = Measure::Distance;
    const SWEEPS: bool = true;

    fn order(&self) -> Order {
        Order::Any
    }

    fn limit(&self) -> f32 {
        self.limit
    }

    fn leaves<I: Isa>(
        &mut self,
        isa: I,
        (a, b): (LeafPacket, LeafPacket),
        _at_once: bool,
    ) -> Result<ControlFlow<()>, QueryError> {
        self.stats.packet_tests += 1;
        let ObjectPair { bvh_a, object_a, bvh_b, object_b, .. } = self.pair;
        let (mut room_a, mut room_b) = (Packet::default(), Packet::default());
        let packet_a = bvh_a.packet(object_a, a, &mut room_a)?;
        let packet_b = bvh_b.packet(object_b, b, &mut room_b)?;
        let Sweep { start, middle, end, .. } = self.sweep;
        for lane_b in 0..usize::from(b.triangles) {
            let of_b = triangle(packet_b, object_b, lane_b);
            let ends = [placed(&of_b, start), placed(&of_b, end)];
            let mut in_the_middle = None;
            for lane_a in 0..usize::from(a.triangles) {
                let of_a = triangle(packet_a, object_a, lane_a);
                if self.sweep.boxes_are_apart(&of_a, &ends) {
                    continue;
                }
                let middle = in_the_middle.get_or_insert_with(|| placed(&of_b, middle));
                if self.sweep.normals_set_apart(&of_a, &ends, middle) {
                    continue;
                }
                self.stats.exact_tests += 1;
                if isa.run(SetsApart { sweep: self.sweep, a: &of_a, ends: &ends, middle }) {
                    continue;
                }
                self.found.push(SweptPair { a: of_a, b: of_b });
            }
        }
        Ok(if self.is_full() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    }

    fn finish<I: Isa>(&mut self, _isa: I) -> Result<(), QueryError> {
        Ok(())
    }
}

/// Returns a triangle of a packet in the frame of its mesh: origin plus stored offset, a sum that is exact.
fn triangle(packet: &Packet, object: &Object, lane: usize) -> Triangle {
    let origin = object.origin();
    packet.triangle(lane).map(|v| [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis])))
}
