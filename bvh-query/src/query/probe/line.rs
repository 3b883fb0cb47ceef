//! Questions about lines, and what is left of a line near an object.
//!
//! A line is clipped to the box of an object, in f64. This leaves a segment as long as the object, against which nodes and packets are
//! tested: see [`super::line_walks`]. A line that starts near the object serves as it is.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::narrow::{Point, Triangle};
use crate::numerics::{MAX_STRETCH, SLACK, round_up};
use crate::query::exact::{placed, stored};
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::probe::point::sum_of_magnitudes;
use crate::query::stats::QueryStats;
use crate::traverse::line_filter::Segment;
use bvh_format::object::Object;

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

    /// Decides about a triangle that the line may meet. All that it does meet up to the limit are named, in any order.
    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError>;
}

/// The numbers of a triangle's instance, its object and itself.
pub(super) type Numbers = (u32, u32, u32);

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
    pub(super) fn numbers(&self) -> Result<Numbers, QueryError> {
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

/// A question, and what it says of itself before it is asked.
pub(super) struct Posed<'a> {
    question: &'a mut dyn LineQuestion,
    line: Line,
    limit: f64,
    is_about_cores: bool,
}

impl<'a> Posed<'a> {
    #[inline(always)]
    fn new<Q: LineQuestion>(question: &'a mut Q) -> Self {
        let (line, limit) = (question.line(), question.limit());
        Self { line, limit, is_about_cores: question.is_about_cores(), question }
    }
}

/// Questions of one kind, one after another.
pub(super) trait LineQuestions {
    fn next(&mut self) -> Option<Posed<'_>>;
}

impl<Q: LineQuestion> LineQuestions for std::slice::IterMut<'_, Q> {
    fn next(&mut self) -> Option<Posed<'_>> {
        Iterator::next(self).map(Posed::new)
    }
}

/// What is left of a line in the box of an object.
pub(super) struct Clipped {
    pub(super) segment: Segment,
    /// The direction of the line, which the segment may be too short to tell, and the inverses of its components.
    pub(super) direction: Point,
    pub(super) inverse: Point,
    /// The parameter at which the segment starts, and how much of it the segment is long.
    start: f64,
    length: f64,
    /// The inverse of that.
    pub(super) inverse_length: f64,
    /// More than the share of the whole segment.
    pub(super) whole: f32,
    /// How far around its triangles the shape reaches.
    pub(super) radius: f64,
}

impl Clipped {
    #[inline(always)]
    pub(super) fn new(line: &Line, into: &IntoObject, limit: f64, radius: f64) -> Option<Self> {
        let (origin, direction) = (into.point(line.origin), into.direction(line.direction));
        // A point of the line in the box is at most twice as far along it as the magnitudes of both add up to.
        let error = into.error(4.0 * (line.magnitude + sum_of_magnitudes(&origin) + radius));
        // A pose may stretch: see `closest`.
        let reach = radius * MAX_STRETCH;
        let inverse = direction.map(|v| 1.0 / v);
        let [start, end] = range_in_box(&origin, (&direction, &inverse), &into.bounds, error + reach)?;
        let (start, end) = (start.max(0.0), end.min(limit));
        if start > end {
            return None;
        }
        let length = end - start;
        Some(Self {
            segment: Segment {
                start: [0, 1, 2].map(|k| origin[k] + start * direction[k]),
                vector: direction.map(|v| length * v),
                error: 2.0 * error,
                reach,
            },
            direction,
            inverse,
            start,
            length,
            inverse_length: 1.0 / length,
            // Entries may exceed 1 by rounding.
            whole: 2.0,
            radius,
        })
    }

    /// Takes a line as it is, with its own parameter for the share of a segment, if it starts near the object, and its numbers and
    /// those of the object are far from the limits of `f32`; else clips it. Nothing waits for the ends of what would be left of it.
    #[inline(always)]
    pub(super) fn whole_or_clipped(line: &Line, into: &IntoObject, limit: f64, radius: f64) -> Option<Self> {
        /// So much farther away than the object is large, no digits are missed.
        const MAX_SIZES: f64 = 16.0;
        let are_usual = |x: f64| (USUAL..1.0 / USUAL).contains(&x);
        let (origin, direction) = (into.point(line.origin), into.direction(line.direction));
        let largest = direction[0].abs().max(direction[1].abs()).max(direction[2].abs());
        let far = farthest(&origin, &into.bounds);
        if !(are_usual(into.size) && are_usual(largest) && far + radius <= MAX_SIZES * into.size) {
            return Self::new(line, into, limit, radius);
        }
        // As in `new`.
        let error = into.error(4.0 * (line.magnitude + sum_of_magnitudes(&origin) + radius));
        let reach = radius * MAX_STRETCH;
        let inverse = direction.map(|v| 1.0 / v);
        let [start, end] = range_in_box(&origin, (&direction, &inverse), &into.bounds, error + reach)?;
        if end < 0.0 || start > limit {
            return None;
        }
        Some(Self {
            segment: Segment { start: origin, vector: direction, error: 2.0 * error, reach },
            direction,
            inverse,
            start: 0.0,
            length: f64::INFINITY,
            inverse_length: 1.0,
            whole: f32::INFINITY,
            radius,
        })
    }

    /// Returns the share of the segment up to a limit of the parameter; negative if that is before its start.
    #[inline(always)]
    pub(super) fn share(&self, limit: f64) -> f32 {
        if limit < self.start {
            -1.0
        } else if limit - self.start < self.length {
            let share = (limit - self.start) * self.inverse_length * (1.0 + SLACK);
            // The inverse of a subnormal length may be infinite, and its product with zero is no number.
            if share.is_nan() { self.whole } else { round_up(share) }
        } else {
            self.whole
        }
    }

    /// Returns the point of the segment that is nearest to another one, or near that.
    #[inline(always)]
    pub(super) fn nearest(&self, to: &[f32; 3]) -> Point {
        let Segment { start, vector, .. } = &self.segment;
        let from = [0, 1, 2].map(|k| f64::from(to[k]) - start[k]);
        let squared = vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2];
        let along = from[0] * vector[0] + from[1] * vector[1] + from[2] * vector[2];
        // NaN, which only the packets of a forged file can give, does no harm.
        let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
        [0, 1, 2].map(|k| start[k] + share * vector[k])
    }
}

/// 2^-32: the least number that [`Clipped::whole_or_clipped`] takes as it is.
const USUAL: f64 = 1.0 / (1u64 << 32) as f64;

/// Returns how far the corners of a box are from a point along any axis.
#[inline(always)]
pub(super) fn farthest(from: &Point, [lo, hi]: &[Point; 2]) -> f64 {
    let far = |axis: usize| (from[axis] - lo[axis]).abs().max((hi[axis] - from[axis]).abs());
    far(0).max(far(1)).max(far(2))
}

/// Returns the range of parameters for which a line may be in a box; nothing if it misses the box by more than an error. The line has
/// a direction and the inverses of its components.
#[inline(always)]
pub(crate) fn range_in_box(
    origin: &Point,
    (direction, inverse): (&Point, &Point),
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
        let (x, y) = (below * inverse[k], above * inverse[k]);
        near = near.max(x.min(y));
        far = far.min(x.max(y));
    }
    let (near, far) = (near - SLACK * near.abs(), far + SLACK * far.abs());
    (near <= far).then_some([near, far])
}

/// A question about an object, and what is left of its line.
pub(super) struct Asked<'a> {
    question: &'a mut dyn LineQuestion,
    pub(super) bvh: &'a Bvh,
    pub(super) object: &'a Object,
    placed: &'a PlacedShape<'a>,
    number: u32,
    pub(super) clipped: Clipped,
    /// The share of the segment that is left.
    pub(super) limit: f32,
    pub(super) stats: &'a mut QueryStats,
}

impl<'a> Asked<'a> {
    /// Clips the line, or takes it as it is where that `may_be_whole`. Returns nothing if it misses the box of the object.
    #[inline(always)]
    pub(super) fn new(
        placed: &'a PlacedShape<'a>,
        index: usize,
        (into, may_be_whole): (&IntoObject, bool),
        posed: Posed<'a>,
        stats: &'a mut QueryStats,
    ) -> Option<Self> {
        let Posed { question, line, limit, is_about_cores } = posed;
        let radius = if is_about_cores { 0.0 } else { placed.shape.radius() };
        let clipped = if may_be_whole {
            Clipped::whole_or_clipped(&line, into, limit, radius)?
        } else {
            Clipped::new(&line, into, limit, radius)?
        };
        Some(Self {
            bvh: placed.shape.bvh(),
            object: &placed.shape.objects()[index],
            placed,
            number: (placed.shape.first() + index) as u32,
            limit: clipped.share(limit),
            clipped,
            question,
            stats,
        })
    }

    /// Lets the question decide about a triangle.
    pub(super) fn decide(&mut self, leaf: LeafPacket, lane: u8) -> Result<(), QueryError> {
        let triangle = stored(self.bvh, self.object, leaf, lane)?;
        self.decide_about(triangle, leaf, lane)
    }

    /// Lets the question decide about a triangle in the frame of its file.
    #[inline(always)]
    pub(super) fn decide_about(
        &mut self,
        mut triangle: Triangle,
        leaf: LeafPacket,
        lane: u8,
    ) -> Result<(), QueryError> {
        self.stats.exact_tests += 1;
        let Self { bvh, object, .. } = *self;
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
