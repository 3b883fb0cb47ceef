//! Inverses, compositions and relative poses: from one frame to another.
//!
//! A pose may be 2^-20 from rigid, so its inverse is that of the matrix and not the transpose. All formulas are plain
//! `f64`, never fused, so that results have the same bits everywhere.
//!
//! Error, with u = 2^-53: entries of an inverse are within 16u of exact ones (3u from a difference of products, 12u from
//! the determinant's inverse, u from their product), entries of a product of two rotations within 4u. A translation is
//! within 64u of the sum of the magnitudes that it is made of.

use super::{Pose, PoseError, departure};

type Rotation = [[f64; 3]; 3];

/// How far from orthonormal a rotation is kept, 2^-40: see `to_keep`.
const MAX_KEPT_ERROR: f64 = 1.0 / (1u64 << 40) as f64;

impl Pose {
    /// Returns the inverse pose: `R^-1` and `-(R^-1 t)`, where `R^-1` is the adjugate over the determinant.
    ///
    /// # Errors
    /// [`PoseError`] if the inverse is beyond a limit of [`Pose::new`]. This may happen for a pose near such a limit.
    pub fn inverse(&self) -> Result<Self, PoseError> {
        let inverse = inverse(&self.rotation);
        Self::new(inverse, turn(&inverse, self.translation).map(|t| -t))
    }

    /// Returns the pose that applies this one and then `next`: `R' R` and `R' t + t'`, where `R'` and `t'` are those of
    /// `next`. For example, `part_in_body.then(&body_in_world)` is the pose of the part in the world.
    ///
    /// # Errors
    /// [`PoseError`] if the result is beyond a limit of [`Pose::new`]: two poses near the limit of 2^-20 may compose to one
    /// beyond it.
    pub fn then(&self, next: &Self) -> Result<Self, PoseError> {
        let then = self.then_of_attached(next);
        Self::new(then.rotation, then.translation)
    }

    /// Returns [`Pose::then`] of the pose that is kept of an attached instance, whether or not the result is within the limits.
    pub(crate) fn then_of_attached(&self, parent: &Self) -> Self {
        Self::of_valid(product(&parent.rotation, &self.rotation), parent.place(self.translation))
    }

    /// Returns the pose to keep of an instance that is attached to a parent in this pose: the one in the parent's frame.
    pub(crate) fn kept_of_attached(&self, child: &Self) -> Self {
        Self::relative_of_instances(self, child).to_keep()
    }

    /// Returns this pose with the nearest orthonormal rotation, unless it is within 2^-40 of orthonormal: more than products of
    /// orthonormal ones lose. So an instance is as rigid as its parent, but for that, and chains of parents do not add up
    /// what rotations are off by.
    pub(crate) fn to_keep(self) -> Self {
        if departure(&self.rotation, 1.0) <= MAX_KEPT_ERROR {
            return self;
        }
        // Every pose is near enough to an orthonormal one.
        Self::nearest(self.rotation, self.translation).unwrap_or(self)
    }

    /// Returns the pose of B in A's frame, given the poses of both in the world: `Ra^-1 Rb` and `Ra^-1 (tb - ta)`.
    /// Queries take this pose. The translations are subtracted first, so that a place far from the world's origin loses
    /// no accuracy.
    ///
    /// # Errors
    /// [`PoseError`] if the result is beyond a limit of [`Pose::new`]. It is not if both rotations are within 2^-23 of rigid
    /// and no translation exceeds 2^118.
    pub fn relative(world_a: &Self, world_b: &Self) -> Result<Self, PoseError> {
        let relative = Self::relative_of_instances(world_a, world_b);
        Self::new(relative.rotation, relative.translation)
    }

    /// Returns [`Pose::relative`] of two instances of a scene, which takes no poses without one.
    pub(crate) fn relative_of_instances(world_a: &Self, world_b: &Self) -> Self {
        let inverse = inverse(&world_a.rotation);
        let (a, b) = (world_a.translation, world_b.translation);
        let between = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
        Self::of_valid(product(&inverse, &world_b.rotation), turn(&inverse, between))
    }
}

/// The adjugate over the determinant.
pub(crate) fn inverse([x, y, z]: &Rotation) -> Rotation {
    let cross = |a: &[f64; 3], b: &[f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let columns = [cross(y, z), cross(z, x), cross(x, y)];
    let scale = 1.0 / ((x[0] * columns[0][0] + x[1] * columns[0][1]) + x[2] * columns[0][2]);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| columns[j][i] * scale))
}

pub(crate) fn product(left: &Rotation, right: &Rotation) -> Rotation {
    left.map(|row| [0, 1, 2].map(|j| (row[0] * right[0][j] + row[1] * right[1][j]) + row[2] * right[2][j]))
}

pub(crate) fn turn(rotation: &Rotation, v: [f64; 3]) -> [f64; 3] {
    rotation.map(|row| (row[0] * v[0] + row[1] * v[1]) + row[2] * v[2])
}
