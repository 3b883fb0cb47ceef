//! The walk of lines: finds the triangles that up to four rays or segments may meet, nearest first.
//!
//! A line is first clipped to the box of an object, in f64. What is left is a segment as long as the object: nodes and packets
//! are tested against it in f32, four at a time against all lines. What may be met goes to a question, which decides exactly.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::isa::Isa;
use crate::leaf::line::{Directions, LocalLines, crossed, directions};
use crate::leaf::local::{LocalFrame, valid_lanes};
use crate::leaf::placed_packet::PlacedPackets;
use crate::narrow::{Point, Triangle};
use crate::query::answers::QueryStats;
use crate::query::exact::stored;
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::querier::Querier;
use crate::traverse::align::round_up;
use crate::traverse::line_test::{LineTest, Segment};
use crate::traverse::placement::Placement;
use crate::traverse::probe_walk::{PROBES, ProbeVisitor};
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use std::ops::ControlFlow;

/// A part of a line in the frame of a question: its points are `origin + t * direction` with t from 0 to a limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) origin: Point,
    pub(super) direction: Point,
    /// The sum of the magnitudes of the coordinates that it was made of.
    pub(super) magnitude: f64,
}

impl Line {
    pub(super) const NONE: Self = Self { origin: [0.0; 3], direction: [0.0; 3], magnitude: 0.0 };

    pub(super) fn new(origin: Point, direction: Point) -> Self {
        Self { origin, direction, magnitude: sum_of_magnitudes(&origin) }
    }

    /// The closed segment between two points, for t from 0 to 1.
    pub(super) fn between(from: Point, to: Point) -> Self {
        let direction = [0, 1, 2].map(|k| to[k] - from[k]);
        Self { origin: from, direction, magnitude: sum_of_magnitudes(&from) + sum_of_magnitudes(&to) }
    }
}

pub(super) fn sum_of_magnitudes(point: &Point) -> f64 {
    point.iter().map(|v| v.abs()).sum()
}

/// What is asked about lines.
pub(super) trait LineQuestion {
    /// Returns the limit of a line; a negative one if no more need be known of it.
    fn limit(&self, line: usize) -> f64;

    /// Decides about a triangle that a line may meet. All that it does meet up to the limit are named, in any order.
    fn decide(&mut self, line: usize, candidate: &Candidate<'_>) -> Result<(), QueryError>;
}

/// A triangle that a line may meet.
pub(super) struct Candidate<'a> {
    /// In the frame of the question.
    pub(super) triangle: Triangle,
    /// The number of its object in the file.
    pub(super) object: u32,
    bvh: &'a Bvh,
    stored_in: &'a Object,
    leaf: LeafPacket,
    lane: u8,
}

impl Candidate<'_> {
    /// Returns its number in the input.
    pub(super) fn id(&self) -> Result<u32, QueryError> {
        self.bvh.triangle_id(self.stored_in, self.place())
    }

    pub(super) fn place(&self) -> TrianglePlace {
        TrianglePlace { page: self.leaf.page, packet: self.leaf.packet, lane: self.lane }
    }
}

impl Querier {
    /// Asks a question about up to four lines and one object of a shape.
    pub(super) fn walk_lines(
        &mut self,
        placed: &PlacedShape<'_>,
        index: usize,
        lines: &[Line],
        question: &mut impl LineQuestion,
    ) -> Result<(), QueryError> {
        self.memory.visit()?;
        let (bvh, object) = (placed.shape.bvh(), &placed.shape.objects()[index]);
        let into = IntoObject::new(placed.pose.as_ref(), object);
        let mut clipped = Clipped::NONE;
        for (number, line) in lines.iter().take(PROBES).enumerate() {
            clipped.clip(number, line, &into, question.limit(number));
        }
        if clipped.limits.iter().all(|limit| *limit < 0.0) {
            return Ok(());
        }
        self.packets[0].start();
        let mut visitor = Lines {
            question,
            bvh,
            object,
            placed,
            number: (placed.shape.first() + index) as u32,
            test: LineTest::new(&clipped.segments, object.profile().directions()),
            directions: directions(&clipped.segments),
            clipped,
            frame: LocalFrame::new(&Placement::NONE, object, object),
            packets: &mut self.packets[0],
            stats: QueryStats::default(),
        };
        let walk = self.memory.probe_walk(bvh, object, lines.len().min(PROBES), &mut visitor);
        let tests = self.backend.run(walk)?;
        let stats = visitor.stats;
        self.stats.add(tests, stats);
        Ok(())
    }
}

/// What is left of lines in the box of an object.
struct Clipped {
    segments: [Segment; PROBES],
    /// The parameters at which they start, and how much of them they are long.
    starts: [f64; PROBES],
    lengths: [f64; PROBES],
    /// The shares of the segments up to which they are asked about; negative if no more need be known.
    limits: [f32; PROBES],
}

/// What a share of a segment is enlarged by for all roundings of f64.
const SLACK: f64 = 1.0 / (1u64 << 40) as f64;

impl Clipped {
    const NONE: Self = Self {
        segments: [Segment::NONE; PROBES],
        starts: [0.0; PROBES],
        lengths: [0.0; PROBES],
        limits: [-1.0; PROBES],
    };

    fn clip(&mut self, number: usize, line: &Line, into: &IntoObject, limit: f64) {
        let (origin, direction) = (into.point(line.origin), into.direction(line.direction));
        // A point of the line in the box is at most twice as far along it as the magnitudes of both add up to.
        let error = into.error(4.0 * (line.magnitude + sum_of_magnitudes(&origin)));
        let Some([start, end]) = range_in_box(&origin, &direction, &into.bounds, error) else { return };
        let (start, end) = (start.max(0.0), end.min(limit));
        if start > end {
            return;
        }
        let length = end - start;
        self.segments[number] = Segment {
            start: [0, 1, 2].map(|k| origin[k] + start * direction[k]),
            vector: direction.map(|v| length * v),
            direction,
            error: 2.0 * error,
        };
        (self.starts[number], self.lengths[number]) = (start, length);
        // Entries may exceed 1 by rounding.
        self.limits[number] = 2.0;
    }

    /// Sets the share of a segment that is left.
    #[inline(always)]
    fn set_limit(&mut self, number: usize, limit: f64) {
        if limit < self.starts[number] {
            self.limits[number] = -1.0;
        } else if self.lengths[number] > 0.0 {
            let share = (limit - self.starts[number]) / self.lengths[number];
            self.limits[number] = round_up(share * (1.0 + SLACK)).min(self.limits[number]);
        }
    }
}

/// Returns the range of parameters for which a line may be in a box; nothing if it misses the box by more than an error.
#[inline(always)]
fn range_in_box(origin: &Point, direction: &Point, [lo, hi]: &[Point; 2], error: f64) -> Option<[f64; 2]> {
    let (mut near, mut far) = (f64::NEG_INFINITY, f64::INFINITY);
    for k in 0..3 {
        let (below, above) = (lo[k] - origin[k] - error, hi[k] - origin[k] + error);
        if direction[k] == 0.0 {
            if below > 0.0 || above < 0.0 {
                return None;
            }
            continue;
        }
        let (x, y) = (below / direction[k], above / direction[k]);
        near = near.max(x.min(y));
        far = far.min(x.max(y));
    }
    let (near, far) = (near - SLACK * near.abs(), far + SLACK * far.abs());
    (near <= far).then_some([near, far])
}

/// Hands the triangles of an object that lines may meet to a question.
struct Lines<'a, Q> {
    question: &'a mut Q,
    bvh: &'a Bvh,
    object: &'a Object,
    placed: &'a PlacedShape<'a>,
    number: u32,
    test: LineTest,
    directions: Directions,
    clipped: Clipped,
    frame: LocalFrame,
    packets: &'a mut PlacedPackets,
    stats: QueryStats,
}

impl<Q: LineQuestion> Lines<'_, Q> {
    /// Lets the question decide about a triangle.
    fn decide(&mut self, line: usize, leaf: LeafPacket, lane: u8) -> Result<(), QueryError> {
        self.stats.exact_tests += 1;
        let Self { bvh, object, .. } = *self;
        let mut triangle = stored(bvh, object, leaf, lane)?;
        if let Some(pose) = &self.placed.pose {
            triangle = triangle.map(|corner| pose.place(corner));
        }
        let candidate = Candidate { triangle, object: self.number, bvh, stored_in: object, leaf, lane };
        self.question.decide(line, &candidate)?;
        self.clipped.set_limit(line, self.question.limit(line));
        Ok(())
    }
}

impl<Q: LineQuestion> ProbeVisitor for Lines<'_, Q> {
    #[inline(always)]
    fn bound<I: Isa>(&self, isa: I, children: &Group) -> I::V {
        self.test.entries(isa, children)
    }

    #[inline(always)]
    fn limits(&self) -> &[f32; PROBES] {
        &self.clipped.limits
    }

    #[inline(always)]
    fn leaf<I: Isa>(&mut self, isa: I, leaf: LeafPacket, probes: u16) -> Result<ControlFlow<()>, QueryError> {
        self.stats.packet_tests += 1;
        let (known, packet) = self.packets.place(leaf.page, leaf.packet);
        if !known {
            packet.place_a(isa, &self.frame, self.bvh.packet(self.object, leaf, &mut Packet::default())?);
        }
        let local = LocalLines::new(&self.frame, packet, &self.clipped.segments, probes);
        let met = crossed(isa, packet, &self.directions, &local);
        let mut mask = met & (0x1111 * probes) & valid_lanes(leaf.triangles, PROBES as u8);
        while mask != 0 {
            let at = mask.trailing_zeros() as usize & 15;
            mask &= mask - 1;
            let line = at & 3;
            if self.clipped.limits[line] >= 0.0 {
                self.decide(line, leaf, (at >> 2) as u8)?;
            }
        }
        Ok(ControlFlow::Continue(()))
    }
}
