//! Two shapes, and a line that one of them moves on.

use crate::file::shape::Shape;
use crate::narrow::Point;
use crate::numerics::{PLACING_ERROR, POSE_ERROR};
use crate::pose::Pose;
use crate::query::motion::radius;
use crate::query::rounded::sum_of_radii;
use bvh_format::vec3::length;

/// From so many triangles on, a shape is fine.
const MANY_TRIANGLES: u64 = 2048;

/// Two shapes, and the line that B moves on.
#[derive(Clone, Copy)]
pub(super) struct Translation<'a> {
    pub(super) a: Shape<'a>,
    pub(super) b: Shape<'a>,
    pub(super) pose: &'a Pose,
    /// Of unit length, to within roundings.
    pub(super) direction: Point,
    /// More than B has to move until its box is beyond A's.
    pub(super) length: f64,
    /// The extents of both boxes, which steps of searches begin from.
    pub(super) size: f64,
    /// The sum of the radii.
    pub(super) radii: f64,
    /// A bound on the error of distances between the shapes.
    pub(super) error: f64,
    /// A bound on how far rounding moves a coordinate of B from where a move from another place on the line would take it.
    pub(super) placing: f64,
    /// The size of the smaller triangles, about.
    pub(super) grain: f64,
    /// Whether both have so many triangles that walks which decide about each one in contact take longer than distances.
    pub(super) is_fine: bool,
}

impl<'a> Translation<'a> {
    pub(super) fn new(a: Shape<'a>, b: Shape<'a>, pose: &'a Pose) -> Self {
        let radii = sum_of_radii(a, b);
        let (mut size, mut magnitude, mut grain) = (radii, 0.0, f64::INFINITY);
        // Boxes that overlap are apart after a move by both diagonals, and radii count on both sides.
        let mut length = 2.0 * radii;
        for shape in [a, b] {
            let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for object in shape.objects() {
                let [low, high] = object.bounding_box();
                for k in 0..3 {
                    (lo[k], hi[k]) = (lo[k].min(low[k]), hi[k].max(high[k]));
                    magnitude += low[k].abs() + high[k].abs();
                }
            }
            let extent = (0..3).map(|k| hi[k] - lo[k]).sum::<f64>();
            size += extent;
            length += (0..3).map(|k| (hi[k] - lo[k]).powi(2)).sum::<f64>().sqrt();
            grain = grain.min(extent / (shape.triangles() as f64).sqrt());
        }
        let is_fine = a.triangles().min(b.triangles()) >= MANY_TRIANGLES;
        magnitude += pose.translation().iter().map(|t| t.abs()).sum::<f64>();
        // Never 0, so that each turn of a search goes on, even for two points in one place.
        let error = (POSE_ERROR * (magnitude + size)).max(f64::MIN_POSITIVE);
        let length = 1.01 * length;
        let farthest = pose.translation().iter().fold(0.0f64, |most, t| most.max(t.abs())) + length;
        let placing = (PLACING_ERROR * (radius(b.objects()) + farthest)).max(f64::MIN_POSITIVE);
        Self { a, b, pose, direction: [0.0; 3], length, size, radii, error, placing, grain, is_fine }
    }

    pub(super) fn along(self, direction: Point) -> Self {
        debug_assert!(direction.iter().all(|x| x.is_finite()), "a direction has a length");
        Self { direction, ..self }
    }

    /// Returns the translation of B at a place.
    pub(super) fn translation_at(&self, at: f64) -> Point {
        self.direction.map(|d| at * d)
    }

    /// Returns the pose of B at a place.
    pub(super) fn pose_at(&self, at: f64) -> Pose {
        moved(self.pose, self.translation_at(at))
    }
}

/// Returns a pose with B moved.
pub(super) fn moved(pose: &Pose, translation: Point) -> Pose {
    let from = pose.translation();
    Pose::of_valid(*pose.rotation(), [0, 1, 2].map(|k| from[k] + translation[k]))
}

/// Returns the length of a vector, rounded up.
pub(super) fn length_above(v: Point) -> f64 {
    length(v) * (1.0 + 4.0 * f64::EPSILON)
}
