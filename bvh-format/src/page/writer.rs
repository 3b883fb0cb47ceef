//! Writes a page from the plan of a baker: roots first, then treelet after treelet with their children.
//!
//! The writer numbers children as the format demands, encodes their slabs under the *decoded* slabs of their parents,
//! collects the packets of the leaf block, and fills in the header. The caller decides which treelet goes into which
//! slot, and visits the treelets in that order.

use super::{
    LINK_BYTES, NO_PARENT, PAGE, PAGE_HEADER_BYTES, PARENT_BYTES, Page, PageHeader, PageShape, RootRef,
    anchor_at, link_at,
};
use crate::checksum::checksum;
use crate::ids::{WORD, encode_ids};
use crate::kdop::Kdop;
use crate::leaf::{LINE, PACKET, Packet, TriangleEncoding, WidePacket, encode_block};
use crate::page::decode::decode_slabs;
use crate::profile::Profile;
use crate::slabs::NodeSlabs;
use crate::treelet::{Child, ChildKind, Links, SHORT_TREELET_BYTES, SlabEncoder};
use crate::turning::{TurningSlab, encode_turning};
use crate::vertex::Vertices;
use zerocopy::{FromZeros, IntoBytes};

/// A page and its blocks. Until a [`PagePatcher`](super::PagePatcher) changes its numbers, it is page 0, its blocks are
/// the first of their sections, and its checksum is missing.
///
/// [`PagePatcher`](super::PagePatcher) has an example.
pub struct WrittenPage {
    /// The bytes of the page.
    pub bytes: Box<[u8; PAGE]>,
    /// The leaf block in whole lines; empty without packets.
    pub leaf_block: Vec<u8>,
    /// The id block in whole words; empty without packets or ids.
    pub id_block: Vec<u8>,
}

/// Writes one page.
///
/// First call [`root`](Self::root) for each root. Then call, for each slot in turn,
/// [`begin_treelet`](Self::begin_treelet) and one of [`treelet`](Self::treelet),
/// [`short_treelet`](Self::short_treelet), [`remote`](Self::remote) and [`leaf`](Self::leaf) for each child. Finally
/// call [`finish`](Self::finish). In the order of the calls, children that are treelets of this page take the next free
/// slots, short ones the next slots after all others, and remote links and leaf packets the next free numbers. The
/// children of a short treelet must all be packets.
///
/// [`PagePatcher`](super::PagePatcher) has an example.
///
/// # Panics
/// The methods panic if more is written than the shape has room for, or than the profile allows for a treelet.
pub struct PageWriter {
    bytes: Box<[u8; PAGE]>,
    profile: Profile,
    f16_scale: f32,
    shape: PageShape,
    /// The decoded slabs of the slots that have been given to a root or a child so far.
    decoded: Vec<NodeSlabs>,
    /// The same of the slots of short treelets.
    decoded_short: Vec<NodeSlabs>,
    /// Treelets begun so far.
    begun: usize,
    /// Remote links written so far.
    remotes: usize,
    packets: Vec<Packet>,
    /// The vertices behind the packets, if they are corrected.
    wide: Vec<WidePacket>,
    ids: Vec<LaneIds>,
    open: OpenTreelet,
}

/// The tightest bound of the triangles below a child.
///
/// [`PagePatcher`](super::PagePatcher) has an example.
#[derive(Debug, Clone, Copy)]
pub struct TightBound {
    /// The slabs of the profile's directions.
    pub kdop: Kdop,
    /// A slab along a direction of the child's own. Profiles without turning slabs leave it out.
    pub turning: Option<TurningSlab>,
}

impl TightBound {
    /// The bound of nothing.
    pub const EMPTY: Self = Self::of_kdop(Kdop::EMPTY);

    /// A bound without a turning slab.
    pub const fn of_kdop(kdop: Kdop) -> Self {
        Self { kdop, turning: None }
    }
}

/// The treelet that is being written.
struct OpenTreelet {
    /// The byte of the page at which it starts.
    at: usize,
    bytes: usize,
    children: usize,
    links: Links,
    slabs: SlabEncoder,
}

/// The ids of a packet's triangles.
struct LaneIds {
    ids: [u32; PACKET],
    count: usize,
}

impl AsRef<[u32]> for LaneIds {
    fn as_ref(&self) -> &[u32] {
        &self.ids[..self.count]
    }
}

impl PageWriter {
    /// Starts a page of this shape. `f16_scale` is the object's unit of f16 residuals, a power of two.
    pub fn new(profile: Profile, f16_scale: f32, shape: PageShape) -> Self {
        debug_assert!(shape.fits(profile));
        let none = NodeSlabs::default();
        Self {
            bytes: Box::new([0; PAGE]),
            profile,
            f16_scale,
            shape,
            decoded: Vec::with_capacity(shape.treelets),
            decoded_short: Vec::with_capacity(shape.short),
            begun: 0,
            remotes: 0,
            packets: Vec::with_capacity(shape.treelets * profile.width()),
            wide: Vec::new(),
            ids: Vec::with_capacity(shape.treelets * profile.width()),
            open: OpenTreelet {
                at: 0,
                bytes: 0,
                children: 0,
                links: Links::NONE,
                slabs: SlabEncoder::new(profile, f16_scale, &none),
            },
        }
    }

    /// Writes the anchor of the next root: its slabs, and the page and remote link that lead to it. Without a parent
    /// it is the object's root, or its parent is patched in later.
    pub fn root(&mut self, slabs: &Kdop, parent: Option<(u32, u8)>) {
        let (root, count) = (self.decoded.len(), self.profile.directions().slabs());
        let ends = slabs.lo[..count].iter().chain(&slabs.hi[..count]);
        let anchor = &mut self.bytes[anchor_at(self.profile, root)..];
        for (place, end) in anchor.as_chunks_mut().0.iter_mut().zip(ends) {
            *place = end.to_le_bytes();
        }
        write_parent(&mut self.bytes, self.profile, root, parent.unwrap_or((NO_PARENT, 0)));
        self.decoded.push(NodeSlabs::from_kdop(slabs, count));
    }

    /// Starts the treelet in the next slot.
    pub fn begin_treelet(&mut self) {
        let (slot, others) = (self.begun, self.shape.treelets - self.shape.short);
        self.begun += 1;
        let short = slot.saturating_sub(others);
        let (bytes, own) = match slot < others {
            true => (self.profile.treelet_bytes(), &self.decoded[slot]),
            false => (SHORT_TREELET_BYTES, &self.decoded_short[short]),
        };
        let within = (slot - short) * self.profile.treelet_bytes() + short * SHORT_TREELET_BYTES;
        self.open = OpenTreelet {
            at: self.shape.treelet_line(self.profile) * LINE + within,
            bytes,
            children: 0,
            links: Links {
                kinds: 0,
                first_treelet: self.decoded.len() as u8,
                first_short: (others + self.decoded_short.len()) as u8,
                first_remote: self.remotes as u8,
                first_leaf: self.packets.len() as u16,
            },
            slabs: SlabEncoder::new(self.profile, self.f16_scale, own),
        };
    }

    /// Adds a child that is a treelet of this page: the one in the next free slot.
    pub fn treelet(&mut self, bound: &TightBound) {
        self.child(bound, ChildKind::Treelet);
    }

    /// Adds a child that is a short treelet of this page: the one in the next free slot of those.
    pub fn short_treelet(&mut self, bound: &TightBound) {
        self.child(bound, ChildKind::ShortTreelet);
    }

    /// Adds a child that is a subtree root of another page.
    pub fn remote(&mut self, bound: &TightBound, to: RootRef) {
        self.child(bound, ChildKind::Remote);
        write_remote(&mut self.bytes, self.profile, self.shape.roots as u8, self.remotes as u8, to);
        self.remotes += 1;
    }

    /// Adds a child that is a leaf packet of one to four triangles: their corners, around the object's origin, and ids.
    pub fn leaf(&mut self, bound: &TightBound, triangles: impl Iterator<Item = ([[f32; 3]; 3], u32)>) {
        let (mut corners, mut ids) = ([[[0.0; 3]; 3]; PACKET], LaneIds { ids: [0; PACKET], count: 0 });
        for (lane, triangle) in triangles.enumerate() {
            (corners[lane], ids.ids[lane]) = triangle;
            ids.count += 1;
        }
        self.child(bound, ChildKind::Leaf { triangles: ids.count });
        self.packets.push(Packet::new(&corners[..ids.count]));
        self.ids.push(ids);
    }

    /// States the vertices behind the packet that was added last. Objects whose vertices are corrected need them.
    pub fn wide_leaf(&mut self, triangles: &[[[f64; 3]; 3]]) {
        self.wide.push(WidePacket::new(triangles));
    }

    /// Writes the bound and the kind of the next child of the treelet.
    fn child(&mut self, bound: &TightBound, kind: ChildKind) {
        let open = &mut self.open;
        let child = open.children;
        open.children += 1;
        open.links.set_kind(child, kind);
        let treelet = &mut self.bytes[open.at..][..open.bytes];
        open.slabs.encode(child, &bound.kdop, treelet);
        open.links.write(self.profile, treelet);
        let turning = bound.turning.as_ref().filter(|_| self.profile.has_turning_slabs());
        let is_treelet = matches!(kind, ChildKind::Treelet | ChildKind::ShortTreelet);
        if !is_treelet && turning.is_none() {
            return;
        }
        // Of a child that is not a treelet, only the box is needed.
        let slabs = if is_treelet { self.profile.directions().slabs() } else { 3 };
        let decoded = decode_slabs(self.profile, self.f16_scale, treelet, child, &open.slabs.parent, slabs);
        if let Some(turning) = turning {
            encode_turning(self.profile, treelet, child, &decoded, turning);
        }
        match kind {
            ChildKind::Treelet => self.decoded.push(decoded),
            ChildKind::ShortTreelet => self.decoded_short.push(decoded),
            _ => {}
        }
    }

    /// Encodes the blocks and writes the header. `vertices` states how those of the object follow from offsets.
    pub fn finish(mut self, encoding: TriangleEncoding, vertices: &Vertices, with_ids: bool) -> WrittenPage {
        let short = self.decoded_short.len();
        let treelets = self.decoded.len() + short;
        let written = PageShape { roots: self.shape.roots, remotes: self.remotes, treelets, short };
        debug_assert!(written == self.shape && self.begun == self.shape.treelets);
        let none = self.packets.is_empty();
        let mut header = PageHeader {
            packets: (self.packets.len() as u16).into(),
            roots: self.shape.roots as u8,
            treelets: self.shape.treelets as u8,
            remotes: self.shape.remotes as u8,
            treelet_line: self.shape.treelet_line(self.profile) as u8,
            profile: self.profile.number(),
            short: self.shape.short as u8,
            ..PageHeader::new_zeroed()
        };
        write_header(&mut self.bytes, &header);
        // Plain packets stay in their order.
        let order = match encoding {
            TriangleEncoding::F32 => Vec::new(),
            _ => packets_depth_first(&Page::new(&self.bytes, self.profile)),
        };
        let leaf_block = if none {
            Vec::new()
        } else {
            encode_block(encoding, &self.packets, &order, vertices, &self.wide)
        };
        let id_block = if none || !with_ids { Vec::new() } else { encode_ids(&self.ids) };
        header.leaf_checksum = checksum(&leaf_block).into();
        header.id_checksum = if id_block.is_empty() { 0 } else { checksum(&id_block) }.into();
        header.leaf_lines = ((leaf_block.len() / LINE) as u32).into();
        header.id_words = ((id_block.len() / WORD) as u32).into();
        write_header(&mut self.bytes, &header);
        WrittenPage { bytes: self.bytes, leaf_block, id_block }
    }
}

/// The numbers of a page's packets in the order of the tree, depth-first.
fn packets_depth_first(page: &Page) -> Vec<u16> {
    let mut order = Vec::with_capacity(page.header().packets.get().into());
    let mut stack: Vec<Child> = (0..page.header().roots).rev().map(Child::Treelet).collect();
    while let Some(child) = stack.pop() {
        match child {
            Child::Treelet(slot) => {
                let links = page.links(slot);
                stack.extend((0..links.children()).rev().map(|child| links.child(child)));
            }
            Child::Leaf { packet, .. } => order.push(packet),
            Child::Remote(_) | Child::Empty => {}
        }
    }
    order
}

/// Writes the header of a page.
pub(super) fn write_header(bytes: &mut [u8; PAGE], header: &PageHeader) {
    bytes[..PAGE_HEADER_BYTES].copy_from_slice(header.as_bytes());
}

/// Writes into the anchor of a root which remote link of which page leads to it.
pub(super) fn write_parent(bytes: &mut [u8; PAGE], profile: Profile, root: usize, (page, link): (u32, u8)) {
    let at = anchor_at(profile, root + 1) - PARENT_BYTES;
    bytes[at..at + 4].copy_from_slice(&page.to_le_bytes());
    bytes[at + 4] = link;
}

/// Writes a remote link of a page of `roots` roots.
pub(super) fn write_remote(bytes: &mut [u8; PAGE], profile: Profile, roots: u8, link: u8, to: RootRef) {
    let at = link_at(profile, roots, link);
    bytes[at..at + LINK_BYTES].copy_from_slice(&to.0.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::super::{PagePatcher, PagePlace, check_page};
    use super::*;
    use crate::ids::decode_id;
    use crate::leaf::decode_packet;
    use crate::object::{Object, ObjectRecord, Volumes};
    use crate::page::decode::decode_child;
    use crate::rule::Rule;
    use crate::treelet::Child;
    use crate::turning::{TurningDirection, decode_turning};
    use std::ops::Range;

    const ENCODING: TriangleEncoding = TriangleEncoding::Packed;
    const SUMS: Vertices = Vertices::around([0.0; 3]);
    /// Root 1 of page 7 is that of page 5, link 3.
    const PARENT: (u32, u8) = (5, 3);
    const REMOTE: RootRef = RootRef(9 << 6 | 2);
    const PLACE: PagePlace = PagePlace { page: 7, leaf_line: 1000, id_word: 2000, first_packet: 3000 };

    /// The corners and the id of the triangle of a number.
    fn triangle(number: u32) -> ([[f32; 3]; 3], u32) {
        let at = number as f32;
        ([[at, 0.25, 0.0], [at + 0.5, 0.0, -0.125], [at, 0.75, 0.5]], 100 + 3 * number)
    }

    fn kdop(numbers: Range<u32>) -> Kdop {
        Kdop::of_points(numbers.flat_map(|number| triangle(number).0))
    }

    fn bound(numbers: Range<u32>) -> TightBound {
        let triangles = numbers.clone().map(|number| triangle(number).0);
        let packets: Vec<Packet> = triangles.map(|triangle| Packet::new(&[triangle])).collect();
        let direction = TurningDirection::near([0.25, 0.5, 1.0]);
        TightBound { kdop: kdop(numbers), turning: Some(TurningSlab::around(direction, &packets, [0.0; 3])) }
    }

    /// A page of two roots. The first has a packet of four triangles, a treelet and a remote link. That treelet has a packet of one triangle, and so has the second root. The treelet is short in profiles that have such.
    fn write(profile: Profile, with_ids: bool) -> WrittenPage {
        let short = profile.has_short_treelets();
        let shape = PageShape { roots: 2, remotes: 1, treelets: 3, short: short.into() };
        let mut writer = PageWriter::new(profile, 2f32.powi(-12), shape);
        writer.root(&kdop(0..8), None);
        writer.root(&kdop(8..9), Some(PARENT));
        writer.begin_treelet();
        writer.leaf(&bound(0..4), (0..4).map(triangle));
        if short {
            writer.short_treelet(&bound(4..5))
        } else {
            writer.treelet(&bound(4..5))
        }
        writer.remote(&bound(5..8), REMOTE);
        writer.begin_treelet();
        writer.leaf(&bound(8..9), (8..9).map(triangle));
        writer.begin_treelet();
        writer.leaf(&bound(4..5), (4..5).map(triangle));
        writer.finish(ENCODING, &SUMS, with_ids)
    }

    /// An object to which page 7 may belong.
    fn object(profile: Profile) -> Object {
        let mut record = ObjectRecord::new_zeroed();
        record.first_page = 2.into();
        record.pages = 20.into();
        Object {
            name: String::new(),
            profile,
            triangle_encoding: ENCODING,
            f16_scale: 2f32.powi(-12),
            volumes: Volumes::of(&record, &SUMS),
            vertices: SUMS,
            record,
        }
    }

    #[test]
    fn a_written_page_keeps_the_rules_and_reads_back() {
        for profile in Profile::ALL {
            let slabs = profile.directions().slabs();
            let mut written = write(profile, true);
            let mut patcher = PagePatcher::new(&mut written.bytes, profile);
            patcher.set_place(&PLACE);
            patcher.set_parent(0, 4, 1);
            patcher.seal();
            check_page(&written.bytes, 7, &object(profile), 0).unwrap();

            let page = Page::new(&written.bytes, profile);
            assert_eq!([page.anchor_parent(0), page.anchor_parent(1)], [(4, 1), PARENT]);
            assert_eq!(
                page.anchor_slabs(1).to_kdop(slabs),
                NodeSlabs::from_kdop(&kdop(8..9), slabs).to_kdop(slabs)
            );
            let header = page.header();
            assert_eq!(header.leaf_bytes(), 64_000..64_000 + written.leaf_block.len());
            assert_eq!(header.id_bytes(), 16_000..16_000 + written.id_block.len());
            assert_eq!(PLACE.behind(header).first_packet, 3003);
            let first = page.links(0);
            let leaf = |packet, triangles| Child::Leaf { packet, triangles };
            assert_eq!([first.child(0), first.child(1)], [leaf(0, 4), Child::Treelet(2)]);
            assert_eq!((first.child(2), page.remote(0)), (Child::Remote(0), REMOTE));
            assert_eq!(page.links(1).child(0), leaf(1, 1));
            assert_eq!(page.links(2).child(0), leaf(2, 1));

            let decode = |slot, child, parent: &NodeSlabs| {
                decode_child(profile, 2f32.powi(-12), page.treelet(slot), child, parent)
            };
            let root = page.anchor_slabs(0);
            let inner = decode(0, 1, &root);
            assert!(root.to_kdop(slabs).contains(&kdop(0..8), slabs), "{}", profile.name());
            for (slot, child, parent, held) in [
                (0, 0, root, bound(0..4)),
                (0, 1, root, bound(4..5)),
                (2, 0, inner, bound(4..5)),
                (1, 0, page.anchor_slabs(1), bound(8..9)),
            ] {
                let decoded = decode(slot, child, &parent);
                assert!(decoded.to_kdop(slabs).contains(&held.kdop, slabs), "{}", profile.name());
                let turning = decode_turning(profile, page.treelet(slot), child, &decoded);
                assert_eq!(turning.is_some(), profile.has_turning_slabs());
                if let (Some(decoded), Some(held)) = (turning, held.turning) {
                    assert_eq!(decoded.direction, held.direction);
                    assert!(decoded.lo <= held.lo && held.hi <= decoded.hi, "{decoded:?} around {held:?}");
                }
            }
            for (packet, lane, number) in [(0, 0, 0), (0, 3, 3), (1, 0, 8), (2, 0, 4)] {
                let corners = decode_packet(ENCODING, &written.leaf_block, packet).triangle(lane);
                assert_eq!((corners, decode_id(&written.id_block, packet, lane)), triangle(number));
            }
        }
    }

    #[test]
    fn short_treelets_are_numbered_after_all_others_and_have_packets_alone() {
        for profile in Profile::ALL.into_iter().filter(|profile| profile.has_short_treelets()) {
            let kinds = if profile.width() == 4 { 28 } else { 12 };
            // The only child of the treelet in slot 2 becomes a treelet, a root of another page and a short treelet.
            let kinds_at =
                PagePatcher::new(&mut write(profile, true).bytes, profile).page().treelet_at(2) + kinds;
            // Then the page states no short treelet, and two of three where two are roots.
            let changes = [
                (kinds_at, 4, None),
                (kinds_at, 1, Some(Rule::ChildKinds)),
                (kinds_at, 2, Some(Rule::ChildKinds)),
                (kinds_at, 3, Some(Rule::ChildKinds)),
                (63, 0, Some(Rule::TreeletLinks)),
                (63, 2, Some(Rule::ShortTreelets)),
            ];
            for (at, value, rule) in changes {
                let mut written = write(profile, true);
                let mut patcher = PagePatcher::new(&mut written.bytes, profile);
                patcher.set_place(&PLACE);
                patcher.set_parent(0, 4, 1);
                written.bytes[at] = value;
                PagePatcher::new(&mut written.bytes, profile).seal();
                let found = check_page(&written.bytes, 7, &object(profile), 0).err().map(|error| error.rule);
                assert_eq!(found, rule, "{}: {value} at byte {at}", profile.name());
            }
        }
    }

    #[test]
    fn patches_change_the_numbers_and_nothing_else() {
        let profile = Profile::Dop26U8Wide;
        let (untouched, mut patched) = (write(profile, false), write(profile, false));
        let mut patcher = PagePatcher::new(&mut patched.bytes, profile);
        patcher.set_place(&PLACE);
        patcher.set_parent(1, 6, 200);
        patcher.set_remote(0, RootRef::new(12, 61));
        patcher.seal();
        let page = Page::new(&patched.bytes, profile);
        assert_eq!((page.anchor_parent(1), page.remote(0)), ((6, 200), RootRef::new(12, 61)));
        let header = page.header();
        assert_eq!((header.page_number.get(), header.leaf_line.get()), (7, 1000));
        // Without ids the page has no place in the id section.
        assert_eq!((header.id_word.get(), header.first_packet.get()), (0, 3000));
        let anchors = anchor_at(profile, 2);
        let numbers =
            [0..8, 24..48, anchors - PARENT_BYTES..anchors - PARENT_BYTES + 5, anchors..anchors + LINK_BYTES];
        for at in 0..PAGE {
            if !numbers.iter().any(|range| range.contains(&at)) {
                assert_eq!(page.bytes()[at], untouched.bytes[at], "byte {at}");
            }
        }
    }

    #[test]
    fn a_page_without_packets_has_no_blocks() {
        let shape = PageShape { roots: 1, remotes: 1, treelets: 1, short: 0 };
        let mut writer = PageWriter::new(Profile::Dop14U8, 1.0, shape);
        writer.root(&kdop(0..3), None);
        writer.begin_treelet();
        writer.remote(&bound(0..3), REMOTE);
        let page = writer.finish(ENCODING, &SUMS, true);
        assert!(page.leaf_block.is_empty() && page.id_block.is_empty());
    }
}
