//! A few pairs of triangles during an interval of time: which of them are apart all the time, whether any is within a
//! distance, and when that may first be.

use crate::isa::{Isa, Task};
use crate::motion::RigidPath;
use crate::narrow::{
    Closest, Point, Triangle, cross, dot, subtract, triangle_distance_with, triangles_intersect,
    triangles_within,
};
use crate::pose::Pose;
use crate::query::exact::placed;
use crate::query::motion::limits::{Question, TimeSpan};
use crate::query::querier::Querier;
use std::rc::Rc;

/// How often the time of contact of a pair is improved.
const MOST_STEPS: u32 = 12;

/// Squares of directions below this, 2^-900, may have lost digits to underflow.
const LEAST_SQUARE: f64 = f64::from_bits((1023 - 900) << 52);

/// Two triangles that may meet, each in the frame of its own mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct SweptPair {
    pub(super) a: Triangle,
    pub(super) b: Triangle,
}

/// Pairs of triangles, shared by intervals. Those before `first` are known to be apart.
#[derive(Clone)]
pub(super) struct Kept {
    pairs: Rc<[SweptPair]>,
    first: usize,
}

impl Kept {
    pub(super) fn new(pairs: Vec<SweptPair>) -> Self {
        Self { pairs: pairs.into(), first: 0 }
    }

    pub(super) fn left(&self) -> &[SweptPair] {
        &self.pairs[self.first..]
    }
}

/// An interval of time: the poses of B at its start, in the middle and at its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    pub(super) start: Pose,
    pub(super) middle: Pose,
    pub(super) end: Pose,
    /// How far apart parts must be to be left out, in mesh units.
    pub(super) limit: f64,
    /// How far apart boxes of triangles along A's axes must be. If B slides, that is free of rounding.
    pub(super) box_limit: f64,
}

impl Sweep {
    /// Returns whether a simple test shows that two triangles are farther apart than the limit all the time: by their
    /// boxes, the normals of both, or the line between their closest points in the middle.
    #[inline(always)]
    fn sets_apart<I: Isa>(&self, isa: I, pair: &SweptPair) -> bool {
        let ends = [placed(&pair.b, &self.start), placed(&pair.b, &self.end)];
        box_gap(&pair.a, ends.as_flattened()) > self.box_limit || {
            let middle = placed(&pair.b, &self.middle);
            self.is_apart_along(normal(&pair.a), &pair.a, &ends)
                || self.is_apart_along(normal(&middle), &pair.a, &ends)
                || {
                    let Closest { point_a, point_b, .. } = triangle_distance_with(isa, &pair.a, &middle);
                    self.is_apart_along(subtract(point_b, point_a), &pair.a, &ends)
                }
        }
    }

    /// Returns whether a direction separates the triangles, in either sense.
    #[inline(always)]
    fn is_apart_along(&self, x: Point, a: &Triangle, ends: &[Triangle; 2]) -> bool {
        let along = |corner: &Point| dot(x, *corner);
        let of_a = a.each_ref().map(along);
        let of_b = ends.each_ref().map(|end| end.each_ref().map(along));
        let of_b = of_b.as_flattened();
        let gap = (least(of_b) - most(&of_a)).max(least(&of_a) - most(of_b));
        // Where the square of x has underflown, nothing is apart along it.
        let squared = dot(x, x);
        squared >= LEAST_SQUARE && gap > self.limit * squared.sqrt()
    }
}

/// The largest gap of the boxes of a triangle and of some points along an axis: no more than their distance.
#[inline(always)]
fn box_gap(a: &Triangle, points: &[Point]) -> f64 {
    let mut gap = f64::NEG_INFINITY;
    for axis in 0..3 {
        let of_a = a.map(|corner| corner[axis]);
        let least_b = points.iter().fold(f64::INFINITY, |least, point| least.min(point[axis]));
        let most_b = points.iter().fold(f64::NEG_INFINITY, |most, point| most.max(point[axis]));
        gap = gap.max(least_b - most(&of_a)).max(least(&of_a) - most_b);
    }
    gap
}

fn normal([p, q, r]: &Triangle) -> Point {
    cross(subtract(*q, *p), subtract(*r, *p))
}

#[inline(always)]
fn least(values: &[f64]) -> f64 {
    values.iter().fold(f64::INFINITY, |least, &value| least.min(value))
}

#[inline(always)]
fn most(values: &[f64]) -> f64 {
    values.iter().fold(f64::NEG_INFINITY, |most, &value| most.max(value))
}

impl Querier {
    /// Leaves out the pairs before the first one that is not certainly apart during the interval.
    pub(super) fn leave_out(&mut self, sweep: &Sweep, pairs: Kept) -> Kept {
        let apart = self.backend.run(CountApart(sweep, pairs.left()));
        self.stats.exact_tests += apart as u64;
        Kept { first: pairs.first + apart, ..pairs }
    }

    /// Returns whether any pair is at most `d` apart in a pose, exactly.
    pub(super) fn any_pair_within(&mut self, pairs: &[SweptPair], pose: &Pose, d: f64) -> bool {
        self.stats.exact_tests += pairs.len() as u64;
        self.backend.run(AnyWithin(pairs, pose, d))
    }

    /// Returns an estimate of the time when the first of some pairs comes within the clearance, if any seems to.
    pub(super) fn contact_time(
        &mut self,
        question: &Question<'_>,
        span: &TimeSpan,
        pairs: &[SweptPair],
    ) -> Option<f64> {
        self.stats.exact_tests += pairs.len() as u64;
        self.backend.run(ContactTime { path: question.path, clearance: question.clearance, span, pairs })
    }
}

/// Counts the pairs before the first one that is not certainly apart during the interval.
pub(super) struct CountApart<'a>(pub(super) &'a Sweep, pub(super) &'a [SweptPair]);

impl Task for CountApart<'_> {
    type Output = usize;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> usize {
        let Self(sweep, pairs) = self;
        // A closure would be compiled without the features of the backend.
        for (number, pair) in pairs.iter().enumerate() {
            if !sweep.sets_apart(isa, pair) {
                return number;
            }
        }
        pairs.len()
    }
}

/// Decides whether any pair is within a distance.
struct AnyWithin<'a>(&'a [SweptPair], &'a Pose, f64);

impl Task for AnyWithin<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> bool {
        let Self(pairs, pose, d) = self;
        for pair in pairs {
            let b = placed(&pair.b, pose);
            // A rounded gap exceeds d only if the exact one does.
            let within = box_gap(&pair.a, &b) <= d
                && if d == 0.0 {
                    triangles_intersect(&pair.a, &b)
                } else {
                    triangles_within(&pair.a, &b, &triangle_distance_with(isa, &pair.a, &b), d)
                };
            if within {
                return true;
            }
        }
        false
    }
}

/// Guesses when pairs come within the clearance. From each pose of B, it goes on to the time at which the closest
/// points would meet if they moved on the chords of their paths.
struct ContactTime<'a> {
    path: &'a dyn RigidPath,
    clearance: f64,
    span: &'a TimeSpan,
    pairs: &'a [SweptPair],
}

impl ContactTime<'_> {
    #[inline(always)]
    fn of<I: Isa>(&self, isa: I, pair: &SweptPair, before: f64) -> Option<f64> {
        let ([start, end], last) = (self.span.times, &self.span.poses[1]);
        let (mut time, mut pose) = (start, self.span.poses[0]);
        for _ in 0..MOST_STEPS {
            let b = placed(&pair.b, &pose);
            let Closest { point_a, point_b, distance, .. } = triangle_distance_with(isa, &pair.a, &b);
            let gap = distance - self.clearance;
            if gap <= 0.0 {
                return Some(time);
            }
            let reached = last.place(taken_back(point_b, &pose));
            let towards = subtract(point_a, point_b);
            // The distance exceeds the clearance, which is not negative.
            let approach = dot(subtract(reached, point_b), towards) / distance;
            let next = time + gap / approach * (end - time);
            // Also if it is no number.
            if !(approach > 0.0 && next < before) {
                return None;
            }
            if next <= time {
                break;
            }
            (time, pose) = (next, self.path.pose(next));
        }
        Some(time)
    }
}

impl Task for ContactTime<'_> {
    type Output = Option<f64>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Option<f64> {
        let mut earliest = None;
        for pair in self.pairs {
            earliest = self.of(isa, pair, earliest.unwrap_or(self.span.times[1])).or(earliest);
        }
        earliest
    }
}

/// Returns about where a point that is placed by a pose is in B's frame.
#[inline(always)]
fn taken_back(point: Point, pose: &Pose) -> Point {
    let (r, t) = (pose.rotation(), pose.translation());
    let from = [0, 1, 2].map(|k| point[k] - t[k]);
    [0, 1, 2].map(|k| r[0][k] * from[0] + r[1][k] * from[1] + r[2][k] * from[2])
}
