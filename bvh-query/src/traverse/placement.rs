//! Where object B is in the frame of object A.

use crate::file::bvh::Bvh;
use crate::numerics::POSE_ERROR;
use crate::pose::Pose;
use crate::pose::frames::inverse;
use bvh_format::object::Object;

/// The pose of object B in the frame of object A, both around their origins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) rotation: [[f64; 3]; 3],
    /// R origin_b + t - origin_a.
    pub(crate) translation: [f64; 3],
    /// Bound on the f64 error of translation and of placed vertices, and on how far these are from their offsets, mesh units.
    pub(crate) error: f64,
}

impl Placement {
    /// An empty placement, before the first pose is prepared.
    pub(crate) const NONE: Self = Self { rotation: [[0.0; 3]; 3], translation: [0.0; 3], error: 0.0 };

    pub(crate) fn new(pose: &Pose, a: &Object, b: &Object) -> Self {
        let (a, b) = (a.volumes(), b.volumes());
        let [x, y, z] = pose.translation();
        let placed = pose.place(b.origin);
        let from_a = |axis: usize| placed[axis] - a.origin[axis];
        Self {
            rotation: *pose.rotation(),
            translation: [from_a(0), from_a(1), from_a(2)],
            // A's frame may stretch what B leaves out by 2^-19.
            error: (a.magnitude + b.magnitude + x.abs() + y.abs() + z.abs()) * POSE_ERROR
                + (a.left_out + b.left_out * (1.0 + 1.0 / (1 << 18) as f64)),
        }
    }

    /// Returns the placement of A in the frame of B.
    ///
    /// A rotation may be 2^-20 off, so this is the inverse, not the transpose. With v = 2^-53, its entries are
    /// within 16v of exact ones: 3v from a difference of products, 12v from the determinant's inverse, v from
    /// their product. Along a direction of up to three entries that moves a projection by 54v of the
    /// coordinates and 64v of the translation's, together less than 2^-45 of the magnitudes that `error`
    /// is 2^-48 of. Alignment charges three times the error; four times as much here covers all.
    pub(crate) fn inverse(&self) -> Self {
        let rotation = inverse(&self.rotation);
        let t = self.translation;
        let translation = rotation.map(|row: [f64; 3]| -(row[0] * t[0] + row[1] * t[1] + row[2] * t[2]));
        Self { rotation, translation, error: 4.0 * self.error }
    }

    /// Returns where a point of B, around B's origin, is in A's frame, around A's origin.
    #[inline(always)]
    pub(crate) fn place(&self, point: [f64; 3]) -> [f64; 3] {
        let (r, t) = (&self.rotation, &self.translation);
        let along = |i: usize| r[i][0] * point[0] + r[i][1] * point[1] + r[i][2] * point[2] + t[i];
        // Not by `map`, which is not always compiled in place.
        [along(0), along(1), along(2)]
    }

    /// Returns a direction of A's frame in B's frame.
    #[inline(always)]
    pub(crate) fn seen_from_b(&self, d: [f64; 3]) -> [f64; 3] {
        let r = &self.rotation;
        let along = |i: usize| r[0][i] * d[0] + r[1][i] * d[1] + r[2][i] * d[2];
        [along(0), along(1), along(2)]
    }
}

/// Two objects, and where B is.
#[derive(Clone, Copy)]
pub(crate) struct ObjectPair<'a> {
    pub(crate) bvh_a: &'a Bvh,
    pub(crate) object_a: &'a Object,
    pub(crate) bvh_b: &'a Bvh,
    pub(crate) object_b: &'a Object,
    pub(crate) placement: &'a Placement,
    /// Where B is as well, for walks that sweep; else the same.
    pub(crate) end: &'a Placement,
}
