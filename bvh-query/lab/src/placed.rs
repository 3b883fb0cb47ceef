//! Two trees in a pose: bounds of one tree along the directions of the other, and gaps between bounds.

use crate::tree::Tree;
use bvh_format::kdop::{DirectionSet, FACTORS, Kdop};
use bvh_format::realign::{Form, upper_form};
use bvh_format::slabs::row;
use bvh_query::Pose;

/// The slab ends along the other side's directions, lower and upper.
pub(crate) type Aligned = [[f64; 2]; 13];

/// A pose of one tree beside another, seen from both.
pub(crate) struct Placed {
    /// B along A's directions.
    pub(crate) along_a: Frame,
    /// A along B's directions.
    pub(crate) along_b: Frame,
}

impl Placed {
    /// Places B beside A. Bounds are seen as k-DOPs of `sets`, which are subsets of those of the trees.
    pub(crate) fn new(a: &Tree, b: &Tree, pose: &Pose, sets: [DirectionSet; 2]) -> Self {
        let (r, origin) = (pose.rotation(), pose.place(b.origin));
        let t = [0, 1, 2].map(|axis| origin[axis] - a.origin[axis]);
        let inverse = [0, 1, 2].map(|i| [0, 1, 2].map(|j| r[j][i]));
        let back = inverse.map(|row| -(0..3).map(|axis| row[axis] * t[axis]).sum::<f64>());
        let [set_a, set_b] = sets;
        Self { along_a: Frame::new(r, t, set_a, set_b), along_b: Frame::new(&inverse, back, set_b, set_a) }
    }
}

/// The directions of one side, along which the other's nodes are seen.
pub(crate) struct Frame {
    /// Per direction the form of the other's upper end along it, and what the pose adds.
    axes: Vec<(Form, f64)>,
    /// Lengths of the directions.
    lengths: Vec<f64>,
    /// The slab of each row of a form.
    slabs: [u8; 16],
}

impl Frame {
    fn new(rotation: &[[f64; 3]; 3], translation: [f64; 3], own: DirectionSet, other: DirectionSet) -> Self {
        let axis = |direction: &[f64; 3]| {
            let seen = [0, 1, 2].map(|i| (0..3).map(|j| rotation[j][i] * direction[j]).sum());
            let offset: f64 = (0..3).map(|i| direction[i] * translation[i]).sum();
            (upper_form(seen, other), offset)
        };
        let directions = &FACTORS[..own.slabs()];
        let length = |d: &[f64; 3]| d.iter().map(|c| c * c).sum::<f64>().sqrt();
        let mut slabs = [0; 16];
        (0..13).for_each(|slab| slabs[row(slab)] = slab as u8);
        Self {
            axes: directions.iter().map(axis).collect(),
            lengths: directions.iter().map(length).collect(),
            slabs,
        }
    }

    /// Returns the ends of a bound of the other side along the directions of this one.
    pub(crate) fn aligned(&self, bound: &Kdop) -> Aligned {
        let mut aligned = [[0.0; 2]; 13];
        for (ends, (form, offset)) in aligned.iter_mut().zip(&self.axes) {
            let end = |form: Form| -> f64 {
                let term = |j: usize| {
                    let row = usize::from(form.rows[j]);
                    let slab = usize::from(self.slabs[row % 16]);
                    let end = if row < 16 { bound.lo[slab] } else { bound.hi[slab] };
                    f64::from(form.coefficients[j]) * f64::from(end)
                };
                term(0) + term(1) + term(2) + offset
            };
            *ends = [end(form.mirrored()), end(*form)];
        }
        aligned
    }

    /// Returns a lower bound of the distance between a node of this side and one of the other side. It is negative
    /// where they overlap along all directions of this side.
    pub(crate) fn gap(&self, own: &Kdop, other: &Aligned) -> f64 {
        (0..self.lengths.len()).map(|slab| self.along(slab, own, other)).fold(f64::NEG_INFINITY, f64::max)
    }

    fn along(&self, slab: usize, own: &Kdop, other: &Aligned) -> f64 {
        let [lo, hi] = other[slab];
        (lo - f64::from(own.hi[slab])).max(f64::from(own.lo[slab]) - hi) / self.lengths[slab]
    }
}
