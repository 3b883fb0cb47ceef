//! Decoded slabs of one node, and of four children at once in the order of vector registers.

use crate::kdop::Kdop;
use bytemuck::{Pod, Zeroable};

/// Returns the row that holds a slab. Row 7 stays empty, so that slab 7 begins a new register of four rows.
#[inline]
pub const fn row(slab: usize) -> usize {
    if slab < 7 { slab } else { slab + 1 }
}

/// The decoded slabs of one node, by [row]. Rows that have no slab of the profile are meaningless.
///
/// ```
/// use bvh_format::kdop::Kdop;
/// use bvh_format::slabs::{Group, NodeSlabs, row};
///
/// let kdop = Kdop::of_points([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]);
/// let node = NodeSlabs::from_kdop(&kdop, 13);
/// assert_eq!((node.hi[row(3)], node.hi[row(7)]), (6.0, 3.0)); // x + y + z, and x + y
/// assert_eq!(node.to_kdop(13), kdop);
/// let group = Group::of_one(&node);
/// assert_eq!(group.rows()[16 + row(3)][0], 6.0); // upper ends follow the 16 rows of lower ones
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NodeSlabs {
    /// Lower ends by row.
    pub lo: [f32; 16],
    /// Upper ends by row.
    pub hi: [f32; 16],
}

impl NodeSlabs {
    /// Takes the first `slabs` slabs of a k-DOP.
    pub fn from_kdop(kdop: &Kdop, slabs: usize) -> Self {
        let mut node = Self::default();
        for slab in 0..slabs {
            node.lo[row(slab)] = kdop.lo[slab];
            node.hi[row(slab)] = kdop.hi[slab];
        }
        node
    }

    /// Returns a k-DOP of the first `slabs` slabs. Its other slabs are those of [`Kdop::EMPTY`].
    pub fn to_kdop(&self, slabs: usize) -> Kdop {
        let mut kdop = Kdop::EMPTY;
        for slab in 0..slabs {
            kdop.lo[slab] = self.lo[row(slab)];
            kdop.hi[slab] = self.hi[row(slab)];
        }
        kdop
    }
}

/// The decoded slabs of four children in the order of vector registers: element `4 * r + c` of register `q` is row
/// `4 * q + r` of child `c`. Elements of absent children, and of rows that have no slab of the profile, are meaningless.
///
/// [`NodeSlabs`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Group {
    /// Lower ends.
    pub lo: [[f32; 16]; 4],
    /// Upper ends.
    pub hi: [[f32; 16]; 4],
}

impl Group {
    /// A group of zeros.
    pub const ZERO: Self = Self { lo: [[0.0; 16]; 4], hi: [[0.0; 16]; 4] };

    /// Returns the rows of four children each: lower ends in rows 0 to 15, upper ends in rows 16 to 31.
    #[inline(always)]
    pub fn rows(&self) -> &[[f32; 4]; 32] {
        bytemuck::cast_ref(self)
    }

    /// Makes a group in which the first child has these slabs.
    pub fn of_one(node: &NodeSlabs) -> Self {
        let mut group = Self::ZERO;
        for row in 0..16 {
            group.lo[row / 4][4 * (row % 4)] = node.lo[row];
            group.hi[row / 4][4 * (row % 4)] = node.hi[row];
        }
        group
    }
}
