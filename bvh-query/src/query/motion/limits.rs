//! The part of a question that stays the same while time is searched, and its limits for an interval of time: how far B
//! moves from the middle, and how far apart parts must be at both ends.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::motion::RigidPath;
use crate::numerics::{CELL_ERROR, SLACK};
use crate::pose::Pose;
use crate::query::displacement::displacement;
use crate::query::motion::MotionOptions;
use crate::query::rounded::limit_of_cores;
use bvh_format::object::Object;

/// How often time may be halved: the middle of a cell is an `f64`, and far from rounding.
pub(super) const MAX_DEPTH: u32 = 45;
/// The default tolerance, as a fraction of the diagonal of the smaller object's box.
const DEFAULT_TOLERANCE: f64 = 1e-6;
/// The least default tolerance, as a fraction of how far vertices are from the origins of both frames: 2^-38. A cell has to
/// be reached before B moves by less than the rounding of its poses, which is below 2^-42 of these distances where the meshes
/// are near each other. A cell may reach an eighth of the tolerance.
const LEAST_TOLERANCE: f64 = 1.0 / (1u64 << 38) as f64;
/// Two shapes, the path of B in A's frame, and what counts as a hit.
pub(super) struct Question<'a> {
    pub(super) a: Shape<'a>,
    pub(super) b: Shape<'a>,
    pub(super) path: &'a dyn RigidPath,
    /// How far apart the cores may be for a hit: the clearance and the radii.
    pub(super) clearance: f64,
    pub(super) tolerance: f64,
    /// The diagonal of the larger object's box, and both radii of the shape.
    pub(super) size: f64,
    /// Whether what is inside a shape counts as a hit.
    pub(super) is_solid: bool,
    /// How far vertices of B are at most from the origin of its frame.
    radius: f64,
    /// The same of A.
    radius_a: f64,
}

/// An interval of time, and the poses of B at its ends.
#[derive(Clone, Copy)]
pub(super) struct TimeSpan {
    pub(super) times: [f64; 2],
    pub(super) poses: [Pose; 2],
}

/// The middle of an interval of time.
#[derive(Clone, Copy)]
pub(super) struct Middle {
    pub(super) at: f64,
    pub(super) pose: Pose,
    /// How far any vertex of B is at most from its place in the middle, during the interval.
    pub(super) reach: f64,
}

impl<'a> Question<'a> {
    pub(super) fn new(
        a: Shape<'a>,
        b: Shape<'a>,
        path: &'a dyn RigidPath,
        options: &MotionOptions,
    ) -> Result<Self, QueryError> {
        options.check()?;
        let question = Self::unchecked(a, b, path);
        let tolerance = options.tolerance_between(a, b);
        Ok(Self { clearance: limit_of_cores(a, b, options.clearance), tolerance, ..question })
    }

    /// A question without clearance and tolerance.
    pub(super) fn unchecked(a: Shape<'a>, b: Shape<'a>, path: &'a dyn RigidPath) -> Self {
        let size = size_of(a.objects(), a.radius()).max(size_of(b.objects(), b.radius()));
        Self {
            a,
            b,
            path,
            clearance: 0.0,
            tolerance: 0.0,
            size,
            is_solid: a.is_solid() || b.is_solid(),
            radius: radius(b.objects()),
            radius_a: radius(a.objects()),
        }
    }

    /// Returns the interval between two times.
    pub(super) fn span(&self, t0: f64, t1: f64) -> TimeSpan {
        TimeSpan { times: [t0, t1], poses: [self.path.pose(t0), self.path.pose(t1)] }
    }

    /// Returns the middle of an interval.
    pub(super) fn middle(&self, span: &TimeSpan) -> Middle {
        let [t0, t1] = span.times;
        let at = t0 + (t1 - t0) / 2.0;
        let pose = self.path.pose(at);
        let half = |end: &Pose, from, to| displacement(self.b, &pose, end) + self.sagitta(from, to);
        let reach = half(&span.poses[0], t0, at).max(half(&span.poses[1], at, t1));
        Middle { at, pose, reach }
    }

    /// Returns how far apart parts must be at both ends of an interval to be farther apart than the sum of the clearance and
    /// `reach` all the time.
    pub(super) fn limit(&self, span: &TimeSpan, reach: f64) -> f64 {
        let [t0, t1] = span.times;
        let translations = span.poses.iter().flat_map(|pose| pose.translation()).map(f64::abs);
        let magnitude = 3.0 * (self.radius + self.radius_a) + translations.sum::<f64>();
        let least = self.clearance + reach + self.sagitta(t0, t1);
        least * (1.0 + CELL_ERROR) + CELL_ERROR * magnitude
    }

    /// Returns how far any cell of an interval reaches at most. Cells have a reach of at most an eighth of the tolerance, and may have
    /// little more than half of that.
    ///
    /// If B slides, it moves steadily but for the sagitta s: in cells of one length, by d with at most 2 s to spare. So if such cells certainly
    /// reach no more than the eighth, and those of twice the length certainly more, then all cells have that length.
    pub(super) fn reach_of_cells(&self, span: &TimeSpan) -> f64 {
        let ([t0, t1], [start, end]) = (span.times, &span.poses);
        let most = self.tolerance / 8.0;
        if !self.path.slides(t0, t1) {
            return most;
        }
        let way = displacement(self.b, start, end);
        // What is charged for the roundings of poses does not shrink with cells.
        let charged = displacement(self.b, start, start) + displacement(self.b, end, end);
        let spare = charged + 3.0 * self.sagitta(t0, t1);
        let half = |depth: i32| way / (t1 - t0) * 2f64.powi(-depth - 1);
        let reaches = |depth: &i32| half(*depth) * (1.0 + SLACK) + spare <= most;
        match (0..=MAX_DEPTH as i32).find(reaches) {
            Some(depth) if (half(depth - 1) - charged) * (1.0 - SLACK) - spare > most => {
                half(depth) * (1.0 + SLACK) + spare
            }
            _ => most,
        }
    }

    /// The same limit for boxes along A's axes. If B slides, rounding moves each corner to where it is in some pose, or not as far,
    /// and a rounded gap exceeds a number only if the exact one does.
    pub(super) fn box_limit(&self, span: &TimeSpan, reach: f64) -> f64 {
        let [t0, t1] = span.times;
        match reach {
            _ if !self.path.slides(t0, t1) => self.limit(span, reach),
            0.0 => self.clearance,
            // As cells round it.
            _ => (self.clearance + reach).next_up(),
        }
    }

    /// Returns the sagitta of the path. If a user's path returns an invalid number, it counts as infinite.
    fn sagitta(&self, t0: f64, t1: f64) -> f64 {
        let sagitta = self.path.sagitta(self.radius, t0, t1);
        if sagitta >= 0.0 { sagitta } else { f64::INFINITY }
    }
}

/// What the default tolerance of a question depends on, of one shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measures {
    /// The largest diagonal of the boxes of its objects, and two radii, in mesh units.
    pub(crate) size: f64,
    /// How far vertices are at most from the origin of their frame, in mesh units.
    pub(crate) radius: f64,
}

impl Measures {
    pub(crate) fn of(shape: Shape<'_>) -> Self {
        Self { size: size_of(shape.objects(), shape.radius()), radius: radius(shape.objects()) }
    }
}

/// Returns the default tolerance of a question about two shapes.
pub(crate) fn default_tolerance(a: Measures, b: Measures) -> f64 {
    let (smaller, larger) = (a.size.min(b.size), a.size.max(b.size));
    // A point has no size of its own, and two points have none at all.
    let size = [smaller, larger].into_iter().find(|&size| size > 0.0).unwrap_or(1.0);
    (DEFAULT_TOLERANCE * size).max(LEAST_TOLERANCE * (a.radius + b.radius))
}

/// Returns how far vertices of objects are at most from the origin of their frame, rounded up, in mesh units.
pub(crate) fn radius(objects: &[Object]) -> f64 {
    let of = |object: &Object| {
        let [lo, hi] = object.bounding_box();
        let far: f64 = (0..3).map(|axis| lo[axis].abs().max(hi[axis].abs()).powi(2)).sum();
        let (centre, radius) = object.bounding_sphere();
        let centre: f64 = centre.iter().map(|value| value * value).sum();
        far.sqrt().min(centre.sqrt() + radius)
    };
    // A rotation may stretch by 2^-19.
    objects.iter().map(of).fold(0.0, f64::max) * (1.0 + 1.0 / (1 << 18) as f64)
}

/// Returns the largest diagonal of the boxes of objects and two radii around them, in mesh units.
pub(crate) fn size_of(objects: &[Object], radius: f64) -> f64 {
    let diagonal = |object: &Object| {
        let [lo, hi] = object.bounding_box();
        (0..3).map(|axis| (hi[axis] - lo[axis]).powi(2)).sum::<f64>().sqrt()
    };
    objects.iter().map(diagonal).fold(0.0, f64::max) + 2.0 * radius
}
