//! Boxes in the world that contain every vertex as a question places it.
//!
//! A question about two instances places B in A's frame by `Pose::relative`. Seen from the world through A's exact
//! pose, its vertices are where B's exact pose puts them, except for roundings. Let u = 2^-53, and let m be the sum,
//! over both instances, of the magnitudes of the translation and of the box that it places. Entries of the relative
//! rotation are off by at most 32u (three products with entries of an inverse, 16u each, and 4u: see `pose/frames.rs`),
//! its translation by 64u m, and a placed vertex by 8u m more. Over three axes that is below 2^-45 m, and computing the box
//! itself loses less. A motion may look for contact within an eighth of its tolerance, which may be 2^-41 of m where it is
//! no part of a size. Each box is larger by 2^-40 of its own share of m, more than all of these. A's frame may be stretched
//! against the world by 2^-22, so that squared gaps between boxes are reduced by 2^-19 of themselves: see `squared_gap`. A
//! relative translation below 2^-213 counts as 0, for which each box is larger by 2^-211.

use crate::numerics::{FLUSHED, SLACK};
use crate::pose::Pose;
use bvh_format::object::{Object, Volumes};

/// A box along the axes of the world, in mesh units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct WorldBox {
    pub(super) lo: [f64; 3],
    pub(super) hi: [f64; 3],
}

impl WorldBox {
    /// A box that contains nothing.
    pub(super) const EMPTY: Self = Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] };

    /// Bounds placed objects by their boxes and spheres.
    pub(super) fn of(objects: &[Extent], world: &Pose) -> Self {
        let (rotation, translation) = (world.rotation(), world.translation());
        let shift = translation.iter().map(|t| t.abs()).sum::<f64>();
        let mut bounds = Self::EMPTY;
        for Extent { centre, half, middle, radius, magnitude } in objects {
            let error = SLACK * (magnitude + shift) + FLUSHED;
            for k in 0..3 {
                let r = &rotation[k];
                let at = |p: &[f64; 3]| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + translation[k];
                let reach = r[0].abs() * half[0] + r[1].abs() * half[1] + r[2].abs() * half[2];
                let (box_at, sphere_at) = (at(centre), at(middle));
                bounds.lo[k] = lesser(bounds.lo[k], greater(box_at - reach, sphere_at - radius) - error);
                bounds.hi[k] = greater(bounds.hi[k], lesser(box_at + reach, sphere_at + radius) + error);
            }
        }
        bounds
    }

    /// Returns whether it contains nothing.
    pub(super) fn is_empty(&self) -> bool {
        self.lo[0] > self.hi[0]
    }

    /// Returns the smallest box around both.
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            lo: [0, 1, 2].map(|k| lesser(self.lo[k], other.lo[k])),
            hi: [0, 1, 2].map(|k| greater(self.hi[k], other.hi[k])),
        }
    }

    /// Returns a box that is larger by some mesh units on every side.
    pub(super) fn grown(&self, by: f64) -> Self {
        // More than all roundings.
        let by = |end: f64| by * (1.0 + SLACK) + SLACK * end.abs();
        Self { lo: self.lo.map(|end| end - by(end)), hi: self.hi.map(|end| end + by(end)) }
    }

    /// Returns the sum of the sides: how often a box is met grows with it. That of the empty box is 0.
    pub(super) fn girth(&self) -> f64 {
        (0..3).map(|k| greater(self.hi[k] - self.lo[k], 0.0)).sum()
    }

    /// Returns the square of a lower bound of the distance that a question may find between what is in the boxes; 0 if they
    /// meet. Gaps are 0 or at least 2^-264, and coordinates are below 2^122, so that squares neither underflow nor overflow.
    #[inline]
    pub(super) fn squared_gap(&self, other: &Self) -> f64 {
        let mut squared = 0.0;
        for k in 0..3 {
            let apart = greater(greater(self.lo[k] - other.hi[k], other.lo[k] - self.hi[k]), 0.0);
            squared += apart * apart;
        }
        squared * (1.0 - 1.0 / (1 << 19) as f64)
    }
}

/// The box and the sphere of an object, from the object table: no page is touched.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Extent {
    /// The middle of the box, and half of its sides.
    centre: [f64; 3],
    half: [f64; 3],
    /// The middle and the radius of the sphere. The radius is larger by 2^-19, because poses may stretch by 2^-20.
    middle: [f64; 3],
    radius: f64,
    /// At least the sum of the magnitudes of the radius, the origin and the ends of the box.
    magnitude: f64,
}

impl Extent {
    pub(super) fn of(object: &Object) -> Self {
        let Volumes { origin, box_centre, half_sides, sphere_centre, sphere_radius, magnitude, left_out: _ } =
            *object.volumes();
        let radius = sphere_radius * (1.0 + 1.0 / (1 << 19) as f64);
        Self {
            centre: [0, 1, 2].map(|k| origin[k] + box_centre[k]),
            half: half_sides,
            middle: [0, 1, 2].map(|k| origin[k] + sphere_centre[k]),
            radius,
            magnitude: radius + magnitude,
        }
    }
}

/// Returns the lesser of two numbers. `f64::min` takes four times the instructions, for NaN, which does not occur here.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// Returns the greater of two numbers.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
