//! The scalar reference decoder of treelets: normative, and the oracle of every vector backend.

use crate::kdop::Kdop;
use crate::profile::{Encoding, Profile};
use crate::quantize::{decode_max, decode_min, residual_unit};
use crate::treelet::{read_codes, read_ends, row};
use bytemuck::{Pod, Zeroable};

/// The decoded slabs of one node in row order (slab `s` in row `s`, from 7 on in row `s + 1`).
/// Rows beyond the profile's directions hold nothing of meaning.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NodeSlabs {
    /// Lower ends by row.
    pub lo: [f32; 16],
    /// Upper ends by row.
    pub hi: [f32; 16],
}

impl NodeSlabs {
    /// From a k-DOP.
    pub fn from_kdop(kdop: &Kdop, slabs: usize) -> Self {
        let mut node = Self::default();
        for slab in 0..slabs {
            node.lo[row(slab)] = kdop.lo[slab];
            node.hi[row(slab)] = kdop.hi[slab];
        }
        node
    }

    /// To a k-DOP of the first `slabs` slabs; the rest is that of nothing.
    pub fn to_kdop(&self, slabs: usize) -> Kdop {
        let mut kdop = Kdop::EMPTY;
        for slab in 0..slabs {
            kdop.lo[slab] = self.lo[row(slab)];
            kdop.hi[slab] = self.hi[row(slab)];
        }
        kdop
    }
}

/// The decoded slabs of four children in register order: element `4 * r + c` of register `q` is row
/// `4 * q + r` of child `c`. Elements of absent children and of rows beyond the profile's
/// directions hold nothing of meaning.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Group {
    /// Lower ends.
    pub lo: [[f32; 16]; 4],
    /// Upper ends.
    pub hi: [[f32; 16]; 4],
}

impl Group {
    /// All zero.
    pub const ZERO: Self = Self { lo: [[0.0; 16]; 4], hi: [[0.0; 16]; 4] };

    /// The rows one by one, four children each: lower ends in rows 0 to 15, upper ends in 16 to 31.
    #[inline(always)]
    pub fn rows(&self) -> &[[f32; 4]; 32] {
        bytemuck::cast_ref(self)
    }

    /// A group of one child, the first.
    pub fn of_one(node: &NodeSlabs) -> Self {
        let mut group = Self::ZERO;
        for row in 0..16 {
            group.lo[row / 4][4 * (row % 4)] = node.lo[row];
            group.hi[row / 4][4 * (row % 4)] = node.hi[row];
        }
        group
    }
}

/// Decodes one child of a treelet under its parent's decoded slabs.
pub fn decode_child(
    profile: Profile,
    object_scale: f32,
    treelet: &[u8],
    child: usize,
    parent: &NodeSlabs,
) -> NodeSlabs {
    let encoding = profile.encoding();
    let mut node = NodeSlabs::default();
    for slab in 0..profile.directions().slabs() {
        let row = row(slab);
        if encoding == Encoding::F32 {
            (node.lo[row], node.hi[row]) = read_ends(profile, treelet, child, slab);
            continue;
        }
        let (parent_lo, parent_hi) = (parent.lo[row], parent.hi[row]);
        let unit = residual_unit(encoding, parent_lo, parent_hi, object_scale);
        let (code_lo, code_hi) = read_codes(profile, treelet, child, slab);
        node.lo[row] = decode_min(encoding, code_lo, parent_lo, unit);
        node.hi[row] = decode_max(encoding, code_hi, parent_hi, unit);
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::treelet::encode_slabs;

    /// A random point cloud's k-DOP, nested in the parent cloud's.
    fn clouds(seed: u64) -> (Kdop, Vec<Kdop>) {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1 << 24) as f32 - 0.5
        };
        let scale = 2f32.powi((seed % 60) as i32 - 30);
        let mut parent = Kdop::EMPTY;
        let children = (0..8)
            .map(|_| {
                let centre = [random(), random(), random()];
                let points = [(); 4].map(|()| centre.map(|c| (c + 0.1 * random()) * scale));
                let child = Kdop::of_points(points);
                parent.join(&child, 13);
                child
            })
            .collect();
        (parent, children)
    }

    #[test]
    fn every_profile_decodes_to_slabs_that_contain_the_true_ones() {
        for profile in Profile::ALL {
            let slabs = profile.directions().slabs();
            for seed in 0..500 {
                let (parent, children) = clouds(seed);
                let parent = NodeSlabs::from_kdop(&parent, slabs);
                let scale = 2f32.powi((seed % 60) as i32 - 30 - 14);
                let mut treelet = vec![0; profile.treelet_bytes()];
                let children = &children[..profile.width()];
                encode_slabs(profile, scale, &parent, children, &mut treelet);
                for (index, child) in children.iter().enumerate() {
                    let decoded = decode_child(profile, scale, &treelet, index, &parent);
                    assert!(decoded.to_kdop(slabs).contains(child, slabs), "{}", profile.name());
                }
            }
        }
    }
}
