//! Bounds of a tree under a predictor: what a query would know if residuals were relative to that.

use super::tree::Tree;
use bvh_format::kdop::Kdop;
use bvh_format::profile::Encoding;
use bvh_format::quantize::{decode_max, decode_min, encode_max_outward, encode_min_outward, residual_unit};

/// What a child's residuals are relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::report) enum Predictor {
    /// The parent's decoded bound, as the format has it.
    Chain,
    /// The parent's tight bound, which no decoder knows: the least that a chain could come to.
    ParentTight,
    /// The object's bound: no prediction at all.
    Root,
}

impl Predictor {
    /// All of them, the format's own first.
    pub(in crate::report) const ALL: [Self; 3] = [Self::Chain, Self::ParentTight, Self::Root];

    /// The name in tables.
    pub(in crate::report) fn name(self) -> &'static str {
        match self {
            Self::Chain => "chain",
            Self::ParentTight => "parent-tight",
            Self::Root => "none",
        }
    }

    /// Sets the bounds of a tree. The encoding has residuals that count steps of the slab they are relative to.
    pub(in crate::report) fn apply(self, encoding: Encoding, tree: &mut Tree) {
        let slabs = tree.set.slabs();
        let root = tree.nodes[0].tight;
        tree.nodes[0].bound = root;
        for number in 0..tree.nodes.len() {
            let base = match self {
                Self::Chain => tree.nodes[number].bound,
                Self::ParentTight => tree.nodes[number].tight,
                Self::Root => root,
            };
            for child in tree.nodes[number].children.clone() {
                let node = &mut tree.nodes[child as usize];
                node.bound = coded(encoding, &base, &node.tight, slabs);
            }
        }
    }
}

/// A bound as it comes back from its residuals: the format's own arithmetic.
fn coded(encoding: Encoding, base: &Kdop, tight: &Kdop, slabs: usize) -> Kdop {
    let mut bound = Kdop::EMPTY;
    for slab in 0..slabs {
        let (lo, hi) = (base.lo[slab], base.hi[slab]);
        let unit = residual_unit(encoding, lo, hi, 0.0);
        let code = encode_min_outward(encoding, tight.lo[slab], lo, unit);
        bound.lo[slab] = decode_min(encoding, code, lo, unit);
        let code = encode_max_outward(encoding, tight.hi[slab], hi, unit);
        bound.hi[slab] = decode_max(encoding, code, hi, unit);
    }
    bound
}
