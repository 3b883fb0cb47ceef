//! A treelet: the slab residuals of up to 8 children, and where those children are.
//!
//! Rows run over slabs and columns over children, so that a vector register loads four slabs of four
//! children at once. A treelet has two halves: lower ends in the first, upper ends in the second
//! (U4 packs both into one byte and keeps slabs 0-6 in the first half and 7-12 in the second, or,
//! at width 8, children 0-3 and 4-7). Slab 7 and up begin a new register: the row of slab `s` is
//! `s` below 7 and `s + 1` from there on. The last four bytes of each half, which no row uses, hold
//! the links:
//!
//! | bytes | what |
//! |---|---|
//! | last 4 of the first half | child kinds, one nibble per child, child 0 lowest |
//! | last 4 of the second half | `u8` first treelet slot, `u8` first remote link, `u16` first leaf packet |
//!
//! A nibble is 0 for no child, 1 for a treelet in this page, 2 for a subtree root in another page,
//! 4 + n - 1 for a leaf packet of n triangles (1 to 4). Children of one kind are numbered
//! consecutively from the first, in the order of the children.

use crate::kdop::Kdop;
use crate::profile::{Encoding, Profile};
use crate::quantize::{encode_four_outward, encode_max_outward, encode_min_outward, residual_unit};
use crate::slabs::{Group, NodeSlabs, row};

/// One child of a treelet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Child {
    /// No child in this place.
    Empty,
    /// The treelet in this slot of the same page.
    Treelet(u8),
    /// The subtree root that this entry of the page's remote table names.
    Remote(u8),
    /// A leaf packet of the page.
    Leaf {
        /// Number of the packet within the page's leaf block.
        packet: u16,
        /// Triangles in it, 1 to 4.
        triangles: u8,
    },
}

/// The links of a treelet, as stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Links {
    /// One nibble per child.
    pub kinds: u32,
    /// Slot of the first child treelet.
    pub first_treelet: u8,
    /// Index of the first remote link.
    pub first_remote: u8,
    /// Number of the first leaf packet.
    pub first_leaf: u16,
}

const EACH: u32 = 0x1111_1111;

impl Links {
    /// Reads the links of a treelet of 64, 128 or 256 bytes.
    #[inline]
    pub fn read(treelet: &[u8]) -> Self {
        let half = treelet.len() / 2;
        let word = |end: usize| {
            let mut bytes = [0; 4];
            bytes.copy_from_slice(&treelet[end - 4..end]);
            u32::from_le_bytes(bytes)
        };
        let second = word(treelet.len());
        Self {
            kinds: word(half),
            first_treelet: second as u8,
            first_remote: (second >> 8) as u8,
            first_leaf: (second >> 16) as u16,
        }
    }

    /// Writes the links into a treelet.
    pub fn write(&self, treelet: &mut [u8]) {
        let (half, end) = (treelet.len() / 2, treelet.len());
        treelet[half - 4..half].copy_from_slice(&self.kinds.to_le_bytes());
        treelet[end - 4] = self.first_treelet;
        treelet[end - 3] = self.first_remote;
        treelet[end - 2..end].copy_from_slice(&self.first_leaf.to_le_bytes());
    }

    /// A bit (the lowest of its nibble) for every child that is a leaf packet.
    #[inline]
    pub fn leaves(&self) -> u32 {
        (self.kinds >> 2) & EACH
    }

    /// A bit (the lowest of its nibble) for every child that is a treelet of this page.
    #[inline]
    pub fn treelets(&self) -> u32 {
        self.kinds & EACH & !self.leaves()
    }

    /// A bit (the lowest of its nibble) for every child in another page.
    #[inline]
    pub fn remotes(&self) -> u32 {
        (self.kinds >> 1) & EACH & !self.leaves()
    }

    /// Number of children, if there are no gaps.
    #[inline]
    pub fn children(&self) -> usize {
        8 - self.kinds.leading_zeros() as usize / 4
    }

    /// The child in place `index`, 0 to 7.
    #[inline]
    pub fn child(&self, index: usize) -> Child {
        let shift = 4 * (index as u32 & 7);
        let before = (1u32 << shift) - 1;
        let rank = |of: u32| (of & before).count_ones();
        let kind = (self.kinds >> shift) & 15;
        match kind {
            1 => Child::Treelet(self.first_treelet.wrapping_add(rank(self.treelets()) as u8)),
            2 => Child::Remote(self.first_remote.wrapping_add(rank(self.remotes()) as u8)),
            4..=7 => Child::Leaf {
                packet: self.first_leaf.wrapping_add(rank(self.leaves()) as u16),
                triangles: kind as u8 - 3,
            },
            _ => Child::Empty,
        }
    }
}

/// Where the two codes of a child's slab stand in a treelet.
struct Place {
    lo: usize,
    hi: usize,
}

/// Byte offsets of a residual; for U4 both ends share the byte (low nibble: lower end).
fn place(profile: Profile, child: usize, slab: usize) -> Place {
    let half = profile.treelet_bytes() / 2;
    let row = row(slab);
    match (profile.encoding(), profile.width()) {
        (Encoding::U4, 8) => {
            let at = (child / 4) * half + row * 4 + child % 4;
            Place { lo: at, hi: at }
        }
        (Encoding::U4, _) => Place { lo: row * 4 + child, hi: row * 4 + child },
        (_, 8) => {
            let at = (child / 4) * half + row * 4 + child % 4;
            Place { lo: at, hi: at + half / 2 }
        }
        (encoding, width) => {
            let size = match encoding {
                Encoding::F16 => 2,
                Encoding::F32 => 4,
                _ => 1,
            };
            let at = (row * width + child) * size;
            Place { lo: at, hi: at + half }
        }
    }
}

/// The two codes of a child's slab. For F32 the codes are 0 and `read_ends` has the values.
pub(crate) fn read_codes(profile: Profile, treelet: &[u8], child: usize, slab: usize) -> (u16, u16) {
    let Place { lo, hi } = place(profile, child, slab);
    match profile.encoding() {
        Encoding::U4 => (u16::from(treelet[lo] & 15), u16::from(treelet[lo] >> 4)),
        Encoding::U8 => (u16::from(treelet[lo]), u16::from(treelet[hi])),
        Encoding::F16 => {
            let code = |at: usize| u16::from_le_bytes([treelet[at], treelet[at + 1]]);
            (code(lo), code(hi))
        }
        Encoding::F32 => (0, 0),
    }
}

/// The two ends of a child's slab of the F32 profile, 0 for others.
pub(crate) fn read_ends(profile: Profile, treelet: &[u8], child: usize, slab: usize) -> (f32, f32) {
    if profile.encoding() != Encoding::F32 {
        return (0.0, 0.0);
    }
    let Place { lo, hi } = place(profile, child, slab);
    let end = |at: usize| {
        let mut bytes = [0; 4];
        bytes.copy_from_slice(&treelet[at..at + 4]);
        f32::from_le_bytes(bytes)
    };
    (end(lo), end(hi))
}

/// Writes the slabs of `children` under the decoded `parent`, rounding outward.
///
/// `treelet` is zeroed and of the profile's size; links are written apart. Every child's true
/// k-DOP must lie within the parent's decoded slabs.
pub fn encode_slabs(
    profile: Profile,
    object_scale: f32,
    parent: &NodeSlabs,
    children: &[Kdop],
    treelet: &mut [u8],
) {
    let encoding = profile.encoding();
    let slabs = profile.directions().slabs();
    let mut units = [0.0; 16];
    for slab in 0..slabs {
        units[slab] = residual_unit(encoding, parent.lo[row(slab)], parent.hi[row(slab)], object_scale);
    }
    for (index, child) in children.iter().enumerate() {
        let mut put = |slab: usize, code_lo: u16, code_hi: u16| {
            let Place { lo, hi } = place(profile, index, slab);
            match encoding {
                Encoding::U4 => treelet[lo] = (code_lo | code_hi << 4) as u8,
                Encoding::U8 => (treelet[lo], treelet[hi]) = (code_lo as u8, code_hi as u8),
                Encoding::F16 => {
                    treelet[lo..lo + 2].copy_from_slice(&code_lo.to_le_bytes());
                    treelet[hi..hi + 2].copy_from_slice(&code_hi.to_le_bytes());
                }
                Encoding::F32 => {
                    treelet[lo..lo + 4].copy_from_slice(&child.lo[slab].to_le_bytes());
                    treelet[hi..hi + 4].copy_from_slice(&child.hi[slab].to_le_bytes());
                }
            }
        };
        match encoding {
            Encoding::U4 | Encoding::U8 => {
                let last = if encoding == Encoding::U4 { 15 } else { 255 };
                for first in (0..slabs).step_by(4) {
                    // Behind the last slab any other stands in.
                    let four: [usize; 4] = std::array::from_fn(|lane| (first + lane).min(slabs - 1));
                    let unit = four.map(|slab| units[slab]);
                    let (ends, parents) =
                        (four.map(|slab| child.lo[slab]), four.map(|slab| parent.lo[row(slab)]));
                    let codes_lo = encode_four_outward(last, ends, parents, unit);
                    let (ends, parents) =
                        (four.map(|slab| -child.hi[slab]), four.map(|slab| -parent.hi[row(slab)]));
                    let codes_hi = encode_four_outward(last, ends, parents, unit);
                    for lane in 0..4.min(slabs - first) {
                        put(four[lane], codes_lo[lane], codes_hi[lane]);
                    }
                }
            }
            Encoding::F16 => {
                for slab in 0..slabs {
                    let (parent_lo, parent_hi) = (parent.lo[row(slab)], parent.hi[row(slab)]);
                    let code_lo = encode_min_outward(encoding, child.lo[slab], parent_lo, units[slab]);
                    let code_hi = encode_max_outward(encoding, child.hi[slab], parent_hi, units[slab]);
                    put(slab, code_lo, code_hi);
                }
            }
            Encoding::F32 => (0..slabs).for_each(|slab| put(slab, 0, 0)),
        }
    }
}

/// The slabs of one child out of a decoded group, as the parent of the next level.
#[inline]
pub fn child_slabs(group: &Group, child: usize) -> NodeSlabs {
    let mut slabs = NodeSlabs::default();
    for row in 0..16 {
        slabs.lo[row] = group.lo[row / 4][4 * (row % 4) + child];
        slabs.hi[row] = group.hi[row / 4][4 * (row % 4) + child];
    }
    slabs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_do_not_overlap_each_other_or_the_links() {
        for profile in Profile::ALL {
            let bytes = profile.treelet_bytes();
            let size = match profile.encoding() {
                Encoding::F16 => 2,
                Encoding::F32 => 4,
                _ => 1,
            };
            let mut used = vec![0; bytes];
            for end in [bytes / 2, bytes] {
                used[end - 4..end].fill(1);
            }
            for slab in 0..profile.directions().slabs() {
                for child in 0..profile.width() {
                    let Place { lo, hi } = place(profile, child, slab);
                    used[lo..lo + size].iter_mut().for_each(|u| *u += 1);
                    if profile.encoding() != Encoding::U4 {
                        used[hi..hi + size].iter_mut().for_each(|u| *u += 1);
                    }
                }
            }
            assert!(used.iter().all(|&u| u <= 1), "{}", profile.name());
        }
    }

    #[test]
    fn links_round_trip_and_number_children_by_kind() {
        let links = Links { kinds: 0x7214_1251, first_treelet: 9, first_remote: 3, first_leaf: 700 };
        let mut treelet = [0xaa; 64];
        links.write(&mut treelet);
        assert_eq!(Links::read(&treelet), links);
        let children: Vec<Child> = (0..8).map(|i| links.child(i)).collect();
        assert_eq!(
            children,
            [
                Child::Treelet(9),
                Child::Leaf { packet: 700, triangles: 2 },
                Child::Remote(3),
                Child::Treelet(10),
                Child::Leaf { packet: 701, triangles: 1 },
                Child::Treelet(11),
                Child::Remote(4),
                Child::Leaf { packet: 702, triangles: 4 },
            ]
        );
        assert_eq!(links.children(), 8);
        assert_eq!(Links { kinds: 0x0000_0051, ..links }.children(), 2);
    }
}
