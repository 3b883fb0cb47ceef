//! The walk of a line: finds the triangles that a ray or a segment may meet, nearest first.
//!
//! The line is first clipped to the box of an object, in f64. This leaves a segment as long as the object, against
//! which nodes and packets are tested in f32. The remaining triangles go to a question, which decides exactly.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::file::shape::Shape;
use crate::isa::{Isa, Task};
use crate::leaf::frame::scale_of;
use crate::leaf::line_sides::{crossed, direction};
use crate::leaf::point_bounds::LocalPoint;
use crate::narrow::{Point, Triangle};
use crate::numerics::{MAX_STRETCH, SLACK, round_up};
use crate::query::exact::{placed, stored};
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::probe::point::sum_of_magnitudes;
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::line_filter::{LineFilter, Segment};
use crate::traverse::probe_walk::ProbeVisitor;
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use bvh_format::slabs::Group;

/// A part of a line in the frame of a question: its points are `origin + t * direction` with t from 0 to a limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub(crate) origin: Point,
    pub(crate) direction: Point,
    /// The sum of the magnitudes of the coordinates that it was made of.
    magnitude: f64,
}

impl Line {
    pub(super) fn new(origin: Point, direction: Point) -> Self {
        Self { origin, direction, magnitude: sum_of_magnitudes(&origin) }
    }

    /// The closed segment between two points, for t from 0 to 1.
    pub(super) fn between(from: Point, to: Point) -> Self {
        let direction = [0, 1, 2].map(|k| to[k] - from[k]);
        Self { origin: from, direction, magnitude: sum_of_magnitudes(&from) + sum_of_magnitudes(&to) }
    }
}

/// A question about a line. The walk calls it through a reference, so that one walk is compiled for all questions. A call
/// costs little next to an exact decision.
pub(crate) trait LineQuestion {
    fn line(&self) -> Line;

    /// Returns the limit of the parameter; a negative one if no more need be known.
    fn limit(&self) -> f64;

    /// Returns whether the radii of shapes do not matter.
    fn is_about_cores(&self) -> bool {
        false
    }

    /// Refuses shapes about which the question is not defined.
    fn admits(&self, _: Shape<'_>) -> Result<(), QueryError> {
        Ok(())
    }

    /// Decides about a triangle that the line may meet. All that it does meet up to the limit are named, in any order.
    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError>;
}

/// A triangle that a line may meet.
pub(crate) struct Candidate<'a> {
    /// In the frame of the question.
    pub(super) triangle: Triangle,
    /// How far around the triangle its shape reaches.
    pub(super) radius: f64,
    /// The numbers of its instance in a scene and of its object in the file.
    numbers: (u32, u32),
    bvh: &'a Bvh,
    stored_in: &'a Object,
    leaf: LeafPacket,
    lane: u8,
}

impl Candidate<'_> {
    /// Returns the numbers of its instance, its object and itself.
    pub(super) fn numbers(&self) -> Result<(u32, u32, u32), QueryError> {
        let (instance, object) = self.numbers;
        Ok((instance, object, self.bvh.triangle_id(self.stored_in, self.place())?))
    }

    /// Returns its place in the order of the leaves of its object.
    pub(super) fn place_number(&self) -> Result<u32, QueryError> {
        self.bvh.place_of(self.stored_in, self.place())
    }

    fn place(&self) -> TrianglePlace {
        TrianglePlace { page: self.leaf.page, packet: self.leaf.packet, lane: self.lane }
    }
}

impl Querier {
    /// Asks a question about a line and all objects of a shape.
    pub(crate) fn ask_line(
        &mut self,
        placed: &PlacedShape<'_>,
        question: &mut dyn LineQuestion,
    ) -> Result<(), QueryError> {
        question.admits(placed.shape)?;
        for (index, object) in placed.shape.objects().iter().enumerate() {
            self.memory.budget.visit()?;
            let into = IntoObject::new(placed.pose.as_ref(), object);
            self.ask_line_of_object(placed, index, &into, question)?;
        }
        Ok(())
    }

    /// Asks a question about a line and one object of a shape, which the caller has charged.
    pub(super) fn ask_line_of_object(
        &mut self,
        placed: &PlacedShape<'_>,
        index: usize,
        into: &IntoObject,
        question: &mut dyn LineQuestion,
    ) -> Result<(), QueryError> {
        let radius = if question.is_about_cores() { 0.0 } else { placed.shape.radius() };
        if let Some(clipped) = Clipped::new(&question.line(), into, question.limit(), radius) {
            let memory = &mut self.memory;
            let (tests, stats) = self.backend.run(AskObject { placed, index, clipped, question, memory })?;
            self.stats.add(tests, stats);
        }
        Ok(())
    }
}

/// What is left of a line in the box of an object.
struct Clipped {
    segment: Segment,
    /// The direction of the line, which the segment may be too short to tell.
    direction: Point,
    /// The inverse of the largest side of the box, a power of two.
    scale: f64,
    /// The parameter at which the segment starts, and how much of it the segment is long.
    start: f64,
    length: f64,
    /// How far around its triangles the shape reaches.
    radius: f64,
}

impl Clipped {
    #[inline(always)]
    fn new(line: &Line, into: &IntoObject, limit: f64, radius: f64) -> Option<Self> {
        let (origin, direction) = (into.point(line.origin), into.direction(line.direction));
        // A point of the line in the box is at most twice as far along it as the magnitudes of both add up to.
        let error = into.error(4.0 * (line.magnitude + sum_of_magnitudes(&origin) + radius));
        // A pose may stretch: see `closest`.
        let error = error + radius * MAX_STRETCH;
        let [start, end] = range_in_box(&origin, &direction, &into.bounds, error)?;
        let (start, end) = (start.max(0.0), end.min(limit));
        if start > end {
            return None;
        }
        let [lo, hi] = &into.bounds;
        let size = (hi[0] - lo[0]).max(hi[1] - lo[1]).max(hi[2] - lo[2]);
        let length = end - start;
        Some(Self {
            segment: Segment {
                start: [0, 1, 2].map(|k| origin[k] + start * direction[k]),
                vector: direction.map(|v| length * v),
                error: 2.0 * error,
            },
            direction,
            scale: scale_of(size),
            start,
            length,
            radius,
        })
    }

    /// Returns the share of the segment up to a limit of the parameter; negative if that is before its start.
    #[inline(always)]
    fn share(&self, limit: f64) -> f32 {
        if limit < self.start {
            -1.0
        } else if limit - self.start < self.length {
            round_up((limit - self.start) / self.length * (1.0 + SLACK))
        } else {
            // Entries may exceed 1 by rounding.
            2.0
        }
    }

    /// Returns the point of the segment that is nearest to another one, or near that.
    #[inline(always)]
    fn nearest(&self, to: &[f32; 3]) -> Point {
        let Segment { start, vector, .. } = &self.segment;
        let from = [0, 1, 2].map(|k| f64::from(to[k]) - start[k]);
        let squared = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
        let along = from[0] * vector[0] + from[1] * vector[1] + from[2] * vector[2];
        // NaN, which only the packets of a forged file can give, does no harm.
        let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
        [0, 1, 2].map(|k| start[k] + share * vector[k])
    }
}

/// Returns the range of parameters for which a line may be in a box; nothing if it misses the box by more than an error.
#[inline(always)]
pub(crate) fn range_in_box(
    origin: &Point,
    direction: &Point,
    [lo, hi]: &[Point; 2],
    error: f64,
) -> Option<[f64; 2]> {
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

/// Asks about an object, with the features of a backend.
struct AskObject<'a> {
    placed: &'a PlacedShape<'a>,
    index: usize,
    clipped: Clipped,
    question: &'a mut dyn LineQuestion,
    memory: &'a mut WalkMemory,
}

impl Task for AskObject<'_> {
    /// The number of node tests, and what else was done.
    type Output = Result<(u64, QueryStats), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { placed, index, clipped, question, memory } = self;
        let (bvh, object) = (placed.shape.bvh(), &placed.shape.objects()[index]);
        let mut visitor = Walked {
            bvh,
            object,
            placed,
            number: (placed.shape.first() + index) as u32,
            test: LineFilter::new(isa, &clipped.segment, object.profile().directions()),
            direction: direction(&clipped.direction),
            limit: clipped.share(question.limit()),
            clipped,
            rooms: [Packet::NONE; 4],
            question,
            stats: QueryStats::default(),
        };
        let tests = isa.run(memory.probe_walk(bvh, object, &mut visitor))?;
        Ok((tests, visitor.stats))
    }
}

/// Hands the triangles of an object that a line may meet to a question.
struct Walked<'a> {
    question: &'a mut dyn LineQuestion,
    bvh: &'a Bvh,
    object: &'a Object,
    placed: &'a PlacedShape<'a>,
    number: u32,
    test: LineFilter,
    direction: [f32; 3],
    clipped: Clipped,
    /// The share of the segment that is left.
    limit: f32,
    /// Room for packets that are encoded.
    rooms: [Packet; 4],
    stats: QueryStats,
}

impl Walked<'_> {
    /// Lets the question decide about a triangle.
    fn decide(&mut self, leaf: LeafPacket, lane: u8) -> Result<(), QueryError> {
        self.stats.exact_tests += 1;
        let Self { bvh, object, .. } = *self;
        let mut triangle = stored(bvh, object, leaf, lane)?;
        if let Some(pose) = &self.placed.pose {
            triangle = placed(&triangle, pose);
        }
        let numbers = (self.placed.instance, self.number);
        let radius = self.clipped.radius;
        self.question.decide(&Candidate { triangle, radius, numbers, bvh, stored_in: object, leaf, lane })?;
        self.limit = self.clipped.share(self.question.limit());
        Ok(())
    }
}

impl ProbeVisitor for Walked<'_> {
    #[inline(always)]
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::F32x4 {
        self.test.entries(isa, children)
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError> {
        self.stats.packet_tests += leaves.len() as u64;
        let (packets, valid) = self.bvh.packets(isa, self.object, leaves, &mut self.rooms)?;
        let corner = &packets[0].corners[0];
        let near = self.clipped.nearest(&[corner[0][0], corner[1][0], corner[2][0]]);
        let point = LocalPoint::new(&near, self.clipped.segment.error, self.clipped.scale as f32);
        // A line may pass a rounded triangle on any side.
        let is_rounded = self.clipped.radius > 0.0;
        let mut left =
            if is_rounded { valid } else { valid & crossed(isa, packets, &point, &self.direction) };
        while left != 0 && self.limit >= 0.0 {
            let at = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            self.decide(leaves[at / 4], (at & 3) as u8)?;
        }
        Ok(())
    }
}
