//! A treelet: the slab residuals of up to 8 children, and the links that lead to them.
//!
//! Rows stand for slabs and columns for children, so that a vector register loads four slabs of four children at once.
//! A treelet has two halves: the first holds the lower ends, the second the upper ends. U4 packs both ends into one
//! byte instead. Its first half holds slabs 0 to 6 and its second half slabs 7 to 12, or, at width 8, children 0 to 3
//! and 4 to 7. Slab 7 begins a new register: slab `s` is in row `s` if it is below 7, and in row `s + 1` otherwise. The
//! last four bytes of each half, which no row uses, hold the links: the kinds of the children, and where the first
//! child of each kind is. Children of one kind are numbered consecutively from the first, in the order of the children.
//!
//! All children of a *short* treelet are leaf packets, and it takes half a line. One byte holds both codes of a slab,
//! each of four bits that stand for one of [`SHORT_CODES`]. Loose slabs cost least for packets, because no slab is
//! predicted from theirs. Two thirds of all treelets have only packets as children.
//!
//! Section 7 of `spec/format.md` says where each byte stands and what the kinds are.

use crate::kdop::Kdop;
use crate::leaf::PACKET;
use crate::profile::{Encoding, Profile};
use crate::quantize::{encode_four_outward, encode_max_outward, encode_min_outward, residual_unit};
use crate::slabs::{Group, NodeSlabs, row};
use std::hint::select_unpredictable;

/// Bytes of a short treelet.
pub const SHORT_TREELET_BYTES: usize = 32;
/// The 8-bit codes for which the 4-bit codes of short treelets stand. They are closer together where the codes of
/// packets are frequent.
pub const SHORT_CODES: [u8; 16] = [0, 10, 21, 32, 44, 55, 67, 78, 90, 103, 116, 129, 142, 157, 176, 208];

/// One child of a treelet. The list of variants is part of the major version of the format, and each reader must handle
/// all of them.
///
/// [`Links`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Child {
    /// There is no child in this place.
    Empty,
    /// The treelet in a slot of the same page.
    Treelet(u8),
    /// The subtree root to which a remote link of the page leads.
    Remote(u8),
    /// A leaf packet of the page.
    Leaf {
        /// The number of the packet in the page's leaf block.
        packet: u16,
        /// The number of its triangles, 1 to 4.
        triangles: u8,
    },
}

/// The kind of a child, from which its nibble follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ChildKind {
    /// A treelet of the same page, which is not short.
    Treelet,
    /// A short treelet of the same page.
    ShortTreelet,
    /// A subtree root of another page.
    Remote,
    /// A leaf packet of 1 to 4 triangles.
    Leaf { triangles: usize },
}

/// The links of a treelet, as stored.
///
/// ```
/// use bvh_format::profile::Profile;
/// use bvh_format::treelet::{Child, Links};
///
/// // A treelet, a remote link, and a packet of two triangles.
/// let links = Links { kinds: 0x521, first_treelet: 3, first_remote: 9, first_leaf: 20, ..Links::NONE };
/// let mut treelet = [0; 64];
/// links.write(Profile::Dop14U8, &mut treelet);
/// assert_eq!(Links::read(Profile::Dop14U8, &treelet), links);
/// assert_eq!(links.children(), 3);
/// assert_eq!((links.child(0), links.child(1)), (Child::Treelet(3), Child::Remote(9)));
/// assert_eq!((links.child(2), links.child(3)), (Child::Leaf { packet: 20, triangles: 2 }, Child::Empty));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Links {
    /// The kinds of the children: one nibble per child, that of child 0 lowest.
    pub kinds: u32,
    /// The slot of the first child treelet that is not short.
    pub first_treelet: u8,
    /// The slot of the first short child treelet.
    pub first_short: u8,
    /// The number of the first remote link.
    pub first_remote: u8,
    /// The number of the first leaf packet, below 1024.
    pub first_leaf: u16,
}

/// The lowest bits of the fields of the word that holds the first of each kind.
const FIRST_SHORT_BIT: u32 = 7;
const FIRST_REMOTE_BIT: u32 = 14;
const FIRST_LEAF_BIT: u32 = 22;

/// A mask of the lowest bit of each nibble.
const LOWEST_BITS: u32 = 0x1111_1111;

/// The nibble of a child that is a treelet of the same page, which is not short.
const KIND_TREELET: u32 = 1;
/// The nibble of a child that is a subtree root of another page.
const KIND_REMOTE: u32 = 2;
/// The nibble of a child that is a short treelet of the same page.
const KIND_SHORT_TREELET: u32 = 3;
/// The nibble of a child that is a leaf packet of one triangle; up to three more triangles add to it.
const KIND_LEAF: u32 = 4;
/// The nibble of a child that is a leaf packet of four triangles.
const KIND_LEAF_LAST: u32 = KIND_LEAF + PACKET as u32 - 1;

impl Links {
    /// The links of no children.
    pub const NONE: Self =
        Self { kinds: 0, first_treelet: 0, first_short: 0, first_remote: 0, first_leaf: 0 };

    /// Reads the links of a treelet of 32, 64, 128 or 256 bytes.
    #[inline]
    pub fn read(profile: Profile, treelet: &[u8]) -> Self {
        let word = |end: usize| {
            let mut bytes = [0; 4];
            bytes.copy_from_slice(&treelet[end - 4..end]);
            u32::from_le_bytes(bytes)
        };
        let (half, firsts) = (word(treelet.len() / 2), word(treelet.len()));
        // In a short treelet of four children, codes take the place of the first word.
        let kinds = if is_short(treelet) && profile.width() == 4 { firsts & 0xffff } else { half };
        let field = |bit: u32, bits: u32| firsts >> bit & ((1 << bits) - 1);
        let first_leaf = field(FIRST_LEAF_BIT, 10) as u16;
        if is_short(treelet) {
            return Self { kinds, first_leaf, ..Self::NONE };
        }
        Self {
            kinds,
            first_treelet: field(0, 7) as u8,
            first_short: field(FIRST_SHORT_BIT, 7) as u8,
            first_remote: field(FIRST_REMOTE_BIT, 8) as u8,
            first_leaf,
        }
    }

    /// Writes the links into a treelet.
    pub fn write(&self, profile: Profile, treelet: &mut [u8]) {
        let (half, end) = (treelet.len() / 2, treelet.len());
        let mut firsts = u32::from(self.first_leaf) << FIRST_LEAF_BIT;
        if is_short(treelet) && profile.width() == 4 {
            firsts |= self.kinds;
        } else {
            treelet[half - 4..half].copy_from_slice(&self.kinds.to_le_bytes());
        }
        if !is_short(treelet) {
            firsts |= u32::from(self.first_treelet)
                | u32::from(self.first_short) << FIRST_SHORT_BIT
                | u32::from(self.first_remote) << FIRST_REMOTE_BIT;
        }
        treelet[end - 4..end].copy_from_slice(&firsts.to_le_bytes());
    }

    /// States the kind of the child in place `index`, 0 to 7, which was empty.
    pub(crate) fn set_kind(&mut self, index: usize, kind: ChildKind) {
        let nibble = match kind {
            ChildKind::Treelet => KIND_TREELET,
            ChildKind::ShortTreelet => KIND_SHORT_TREELET,
            ChildKind::Remote => KIND_REMOTE,
            ChildKind::Leaf { triangles } => KIND_LEAF + triangles as u32 - 1,
        };
        self.kinds |= nibble << (4 * index);
    }

    /// Returns the leaf packets among the children, as the lowest bits of their nibbles.
    #[inline]
    pub fn leaves(&self) -> u32 {
        (self.kinds >> 2) & LOWEST_BITS
    }

    /// Returns the treelets of this page among the children that are not short, as the lowest bits of their nibbles.
    #[inline]
    pub fn treelets(&self) -> u32 {
        self.kinds & LOWEST_BITS & !(self.kinds >> 1) & !self.leaves()
    }

    /// Returns the short treelets of this page among the children, as the lowest bits of their nibbles.
    #[inline]
    pub fn short_treelets(&self) -> u32 {
        self.kinds & LOWEST_BITS & (self.kinds >> 1) & !self.leaves()
    }

    /// Returns the children in other pages, as the lowest bits of their nibbles.
    #[inline]
    pub fn remotes(&self) -> u32 {
        (self.kinds >> 1) & LOWEST_BITS & !self.kinds & !self.leaves()
    }

    /// Returns true if the kinds of the first `children` children are known ones and, in a short treelet, those of packets.
    pub(crate) fn kinds_are_known(&self, children: usize, short: bool) -> bool {
        (0..children).all(|child| match self.kinds >> (4 * child) & 15 {
            KIND_LEAF..=KIND_LEAF_LAST => true,
            KIND_TREELET | KIND_REMOTE | KIND_SHORT_TREELET => !short,
            _ => false,
        })
    }

    /// Returns the number of children, if there are no gaps between them.
    #[inline]
    pub fn children(&self) -> usize {
        8 - self.kinds.leading_zeros() as usize / 4
    }

    /// Returns the number of the leaf packet in place `index`, 0 to 7, and how many triangles it has. What is no packet gives
    /// numbers without meaning.
    #[inline]
    pub fn packet(&self, index: usize) -> (u16, u8) {
        let shift = 4 * (index as u32 & 7);
        let before = (self.leaves() & ((1 << shift) - 1)).count_ones();
        (self.first_leaf.wrapping_add(before as u16), (self.kinds >> shift & 3) as u8 + 1)
    }

    /// Returns the child in place `index`, 0 to 7.
    #[inline]
    pub fn child(&self, index: usize) -> Child {
        let shift = 4 * (index as u32 & 7);
        let before = (1u32 << shift) - 1;
        let rank = |of: u32| (of & before).count_ones();
        let kind = (self.kinds >> shift) & 15;
        match kind {
            KIND_TREELET | KIND_SHORT_TREELET => {
                // Nothing predicts which of the two it is, so no branch asks.
                let is_short = kind == KIND_SHORT_TREELET;
                let first = select_unpredictable(is_short, self.first_short, self.first_treelet);
                let of = select_unpredictable(is_short, self.short_treelets(), self.treelets());
                Child::Treelet(first.wrapping_add(rank(of) as u8))
            }
            KIND_REMOTE => Child::Remote(self.first_remote.wrapping_add(rank(self.remotes()) as u8)),
            KIND_LEAF..=KIND_LEAF_LAST => {
                let (packet, triangles) = self.packet(index);
                Child::Leaf { packet, triangles }
            }
            _ => Child::Empty,
        }
    }
}

/// Returns true if these are the bytes of a short treelet.
#[inline]
pub(crate) fn is_short(treelet: &[u8]) -> bool {
    treelet.len() == SHORT_TREELET_BYTES
}

/// Where the codes of one child stand in a treelet.
pub(crate) struct CodePlaces {
    encoding: Encoding,
    is_short: bool,
    /// The byte of row 0, and the bytes from each row to the next.
    first: usize,
    per_row: usize,
    /// The bytes from the code of a lower end to that of the upper end. If it is 0, one byte has both, that of the lower end
    /// in the low nibble.
    upper: usize,
}

impl CodePlaces {
    /// Returns the places of child `child` in a treelet of these bytes.
    #[inline]
    pub(crate) fn new(profile: Profile, treelet: &[u8], child: usize) -> Self {
        let (encoding, width, is_short) = (profile.encoding(), profile.width(), is_short(treelet));
        debug_assert!(!is_short || profile.has_short_treelets());
        let half = if is_short { SHORT_TREELET_BYTES } else { profile.treelet_bytes() } / 2;
        let size = match encoding {
            Encoding::U4 | Encoding::U8 => 1,
            Encoding::F16 => 2,
            Encoding::F32 => 4,
        };
        // At width 8, each half has four of the children.
        let (first, columns, upper) = match width {
            8 => ((child / 4) * half + child % 4, 4, half / 2),
            _ => (child * size, width * size, half),
        };
        let in_one_byte = is_short || encoding == Encoding::U4;
        Self { encoding, is_short, first, per_row: columns, upper: if in_one_byte { 0 } else { upper } }
    }

    /// Returns the bytes at which the codes of a slab start.
    #[inline]
    fn of(&self, slab: usize) -> (usize, usize) {
        let lo = self.first + row(slab) * self.per_row;
        (lo, lo + self.upper)
    }

    /// Reads the two codes of a slab. For F32, which has no codes, it returns 0: see `read_ends`.
    #[inline]
    pub(crate) fn read(&self, treelet: &[u8], slab: usize) -> (u16, u16) {
        let (lo, hi) = self.of(slab);
        if self.upper == 0 {
            let (lo, hi) = (treelet[lo] & 15, treelet[lo] >> 4);
            let code = |code: u8| if self.is_short { SHORT_CODES[usize::from(code)] } else { code };
            return (code(lo).into(), code(hi).into());
        }
        match self.encoding {
            Encoding::U4 | Encoding::U8 => (u16::from(treelet[lo]), u16::from(treelet[hi])),
            Encoding::F16 => {
                let code = |at: usize| u16::from_le_bytes([treelet[at], treelet[at + 1]]);
                (code(lo), code(hi))
            }
            Encoding::F32 => (0, 0),
        }
    }

    /// Reads the two ends of a slab from a treelet of encoding F32. For other encodings it returns 0.
    pub(crate) fn read_ends(&self, treelet: &[u8], slab: usize) -> (f32, f32) {
        if self.encoding != Encoding::F32 {
            return (0.0, 0.0);
        }
        let (lo, hi) = self.of(slab);
        let end = |at: usize| {
            let mut bytes = [0; 4];
            bytes.copy_from_slice(&treelet[at..at + 4]);
            f32::from_le_bytes(bytes)
        };
        (end(lo), end(hi))
    }

    /// Writes the codes of a slab, or its ends in encoding F32, into bytes that are zero so far.
    #[inline]
    fn write(&self, treelet: &mut [u8], slab: usize, (code_lo, code_hi): (u16, u16), ends: (f32, f32)) {
        let (lo, hi) = self.of(slab);
        if self.upper == 0 {
            let code = |code: u16| if self.is_short { short_code(code) } else { code as u8 };
            treelet[lo] = code(code_lo) | code(code_hi) << 4;
            return;
        }
        match self.encoding {
            Encoding::U4 | Encoding::U8 => (treelet[lo], treelet[hi]) = (code_lo as u8, code_hi as u8),
            Encoding::F16 => {
                treelet[lo..lo + 2].copy_from_slice(&code_lo.to_le_bytes());
                treelet[hi..hi + 2].copy_from_slice(&code_hi.to_le_bytes());
            }
            Encoding::F32 => {
                treelet[lo..lo + 4].copy_from_slice(&ends.0.to_le_bytes());
                treelet[hi..hi + 4].copy_from_slice(&ends.1.to_le_bytes());
            }
        }
    }
}

/// Writes the slabs of a treelet's children under the decoded slabs of the treelet, rounding outward.
pub(crate) struct SlabEncoder {
    profile: Profile,
    /// The decoded slabs of the treelet.
    pub(crate) parent: NodeSlabs,
    /// By slab: the residual unit and its inverse, and the lower and the negated upper end of the treelet. Lanes without a slab of
    /// their own repeat the last one.
    units: [f32; 16],
    inverses: [f32; 16],
    lo: [f32; 16],
    negated_hi: [f32; 16],
}

impl SlabEncoder {
    /// Prepares the units of a treelet.
    pub(crate) fn new(profile: Profile, f16_scale: f32, parent: &NodeSlabs) -> Self {
        let last = profile.directions().slabs() - 1;
        let rows: [usize; 16] = std::array::from_fn(|slab| row(slab.min(last)));
        let (lo, hi) = (rows.map(|row| parent.lo[row]), rows.map(|row| parent.hi[row]));
        let encoding = profile.encoding();
        let units: [f32; 16] =
            std::array::from_fn(|slab| residual_unit(encoding, lo[slab], hi[slab], f16_scale));
        let (inverses, negated_hi) = (units.map(|unit| 1.0 / unit), hi.map(|hi| -hi));
        Self { profile, parent: *parent, units, inverses, lo, negated_hi }
    }

    /// Writes the slabs of child `index`. The child's true k-DOP must lie within the treelet's decoded slabs, and its
    /// codes must be zero so far.
    pub(crate) fn encode(&self, index: usize, child: &Kdop, treelet: &mut [u8]) {
        let Self { profile, ref parent, ref units, .. } = *self;
        let encoding = profile.encoding();
        let slabs = profile.directions().slabs();
        let places = CodePlaces::new(profile, treelet, index);
        let put = |treelet: &mut [u8], slab: usize, code_lo: u16, code_hi: u16| {
            places.write(treelet, slab, (code_lo, code_hi), (child.lo[slab], child.hi[slab]));
        };
        match encoding {
            Encoding::U4 | Encoding::U8 => {
                let last = if encoding == Encoding::U4 { 15 } else { 255 };
                let end = |ends: &[f32; 13], slab: usize| ends[slab.min(slabs - 1)];
                let lo: [f32; 16] = std::array::from_fn(|slab| end(&child.lo, slab));
                let negated_hi: [f32; 16] = std::array::from_fn(|slab| -end(&child.hi, slab));
                let (mut codes_lo, mut codes_hi) = ([0; 16], [0; 16]);
                for four in 0..slabs.div_ceil(4) {
                    let of = |lanes: &[f32; 16]| lanes.as_chunks::<4>().0[four];
                    let (unit, inverse) = (of(units), of(&self.inverses));
                    codes_lo.as_chunks_mut::<4>().0[four] =
                        encode_four_outward(last, of(&lo), of(&self.lo), unit, inverse);
                    codes_hi.as_chunks_mut::<4>().0[four] =
                        encode_four_outward(last, of(&negated_hi), of(&self.negated_hi), unit, inverse);
                }
                if profile == Profile::Dop26U8Wide
                    && let Some(treelet) = treelet.first_chunk_mut::<128>()
                {
                    let rows = treelet.as_chunks_mut::<4>().0;
                    for slab in 0..13 {
                        rows[row(slab)][index % 4] = codes_lo[slab] as u8;
                        rows[16 + row(slab)][index % 4] = codes_hi[slab] as u8;
                    }
                    return;
                }
                (0..slabs).for_each(|slab| put(treelet, slab, codes_lo[slab], codes_hi[slab]));
            }
            Encoding::F16 => {
                for slab in 0..slabs {
                    let (parent_lo, parent_hi) = (parent.lo[row(slab)], parent.hi[row(slab)]);
                    let code_lo = encode_min_outward(encoding, child.lo[slab], parent_lo, units[slab]);
                    let code_hi = encode_max_outward(encoding, child.hi[slab], parent_hi, units[slab]);
                    put(treelet, slab, code_lo, code_hi);
                }
            }
            Encoding::F32 => (0..slabs).for_each(|slab| put(treelet, slab, 0, 0)),
        }
    }
}

/// Returns the last code of four bits that stands for a code of at most this one. Smaller codes are farther outward.
fn short_code(code: u16) -> u8 {
    const PLACES: [u8; 256] = {
        let (mut places, mut code, mut place) = ([0; 256], 0, 0);
        while code < 256 {
            if place + 1 < SHORT_CODES.len() && code >= SHORT_CODES[place + 1] as usize {
                place += 1;
            }
            places[code] = place as u8;
            code += 1;
        }
        places
    };
    PLACES[usize::from(code) & 255]
}

/// Returns the slabs of one child of a decoded group, which predict those of its own children.
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
                    let (lo, hi) = CodePlaces::new(profile, &vec![0; bytes], child).of(slab);
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
        let links = Links {
            kinds: 0x7234_1251,
            first_treelet: 9,
            first_short: 100,
            first_remote: 253,
            first_leaf: 700,
        };
        let mut treelet = [0xaa; 64];
        links.write(Profile::Dop6U8, &mut treelet);
        assert_eq!(Links::read(Profile::Dop6U8, &treelet), links);
        let children: Vec<Child> = (0..8).map(|i| links.child(i)).collect();
        assert_eq!(
            children,
            [
                Child::Treelet(9),
                Child::Leaf { packet: 700, triangles: 2 },
                Child::Remote(253),
                Child::Treelet(10),
                Child::Leaf { packet: 701, triangles: 1 },
                Child::Treelet(100),
                Child::Remote(254),
                Child::Leaf { packet: 702, triangles: 4 },
            ]
        );
        assert_eq!(links.children(), 8);
        assert_eq!(Links { kinds: 0x0000_0051, ..links }.children(), 2);
    }

    #[test]
    fn short_treelets_link_to_packets_alone() {
        for (profile, kinds) in [(Profile::Dop14U8, 0x7546), (Profile::Dop6U8, 0x4567_7654)] {
            let links = Links { kinds, first_leaf: 1023, ..Links::NONE };
            let mut treelet = [0; SHORT_TREELET_BYTES];
            links.write(profile, &mut treelet);
            assert_eq!(Links::read(profile, &treelet), links, "{}", profile.name());
            // Codes leave the links as they are, and the other way round.
            for child in 0..profile.width() {
                let places = CodePlaces::new(profile, &treelet, child);
                for slab in 0..profile.directions().slabs() {
                    treelet[places.of(slab).0] = 0x93;
                }
            }
            assert_eq!(Links::read(profile, &treelet), links, "{}", profile.name());
            let places = CodePlaces::new(profile, &treelet, profile.width() - 1);
            assert_eq!(places.read(&treelet, profile.directions().slabs() - 1), (32, 103));
        }
    }

    #[test]
    fn short_codes_are_the_next_ones_outward() {
        for code in 0..=255u16 {
            let place = usize::from(short_code(code));
            assert!(u16::from(SHORT_CODES[place]) <= code);
            assert!(SHORT_CODES.get(place + 1).is_none_or(|&next| u16::from(next) > code));
        }
    }
}
