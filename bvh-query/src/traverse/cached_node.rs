//! The children of an opened node, as a walk of two trees needs them: four under a number, decoded, and what is asked first
//! of each.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::LeafPacket;
use crate::isa::{Isa, Lanes, Task};
use crate::traverse::open_child::{ClosedChild, Opened, leaf_lanes, open_child, spread};
use bvh_format::object::Object;
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::treelet::Links;
use bvh_format::turning::TurningCodes;

/// A child of an opened node: the number of the node and, in the lowest two bits, that of the child.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChildRef(u32);

impl ChildRef {
    /// Stands for no child.
    pub(crate) const NONE: Self = Self(0);

    #[inline(always)]
    pub(crate) fn new(node: usize, child: usize) -> Self {
        Self((node as u32) << 2 | child as u32)
    }

    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// Converts back from `bits`.
    #[inline(always)]
    pub(crate) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub(crate) fn node(self) -> usize {
        (self.0 >> 2) as usize
    }

    #[inline(always)]
    pub(crate) fn child(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// Up to four children of a node, decoded. The others of a node of more than four are under the next number.
#[derive(Clone, Copy)]
pub(crate) struct CachedNode {
    pub(crate) group: Group,
    pub(crate) turning: TurningCodes,
    /// Where all children of the node are.
    links: Links,
    pub(super) page: u32,
    /// The place of the first of these children among those of the node: 0 or 4.
    first: u8,
    /// Whether the next number has more children of the same node.
    pub(crate) continues: bool,
    /// The lanes of the children in tests of 16 pairs.
    pub(crate) lanes: ChildLanes,
}

/// What a walk asks first of a child.
#[derive(Clone, Copy)]
pub(crate) struct ChildInfo {
    /// The largest side of its box, in mesh units.
    pub(crate) extent: f32,
    /// The number of its opened node, or `CLOSED`; of a leaf packet, `LEAF` with the number of the packet in the lowest bits,
    /// and how many triangles it has above.
    opened: u32,
}

/// Stands for the number of a node that has not been opened.
const CLOSED: u32 = LEAF - 1;
/// The lowest of what stands for leaf packets.
const LEAF: u32 = 1 << 31;
/// How many bits the number of a packet takes.
const PACKET_BITS: u32 = 16;

impl ChildInfo {
    pub(super) const NONE: Self = Self { extent: 0.0, opened: CLOSED };
    /// A root. It is larger than any node, so that both roots are opened at once.
    pub(super) const ROOT: Self = Self { extent: f32::INFINITY, opened: CLOSED };

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.opened >= LEAF
    }

    /// Returns the leaf packet, if it is one, of this page.
    #[inline(always)]
    pub(super) fn leaf(self, page: u32) -> Option<LeafPacket> {
        let (packet, triangles) = (self.opened as u16, (self.opened >> PACKET_BITS) as u8);
        self.is_leaf().then_some(LeafPacket { page, packet, triangles })
    }

    /// Returns the number of the opened node, if it has been opened.
    #[inline(always)]
    pub(super) fn opened(self) -> Option<usize> {
        (self.opened < CLOSED).then_some(self.opened as usize)
    }

    /// Remembers the number of the opened node.
    #[inline(always)]
    pub(super) fn open(&mut self, number: usize) {
        self.opened = number as u32;
    }
}

/// The lanes in which four children take part in a test of 16 pairs: as children of A, and as children of B.
#[derive(Clone, Copy)]
pub(crate) struct ChildLanes {
    /// Of all children.
    pub(crate) all: [u16; 2],
    /// Of leaf packets.
    pub(crate) leaves: [u16; 2],
}

impl ChildLanes {
    const NONE: Self = Self { all: [0; 2], leaves: [0; 2] };

    /// `children` and `leaves` have a bit for each of four children.
    #[inline(always)]
    fn new(children: u16, leaves: u16) -> Self {
        let lanes = |bits: u16| [ROWS_OF_LANES[usize::from(bits & 15)], 0x1111 * bits];
        Self { all: lanes(children), leaves: lanes(leaves) }
    }
}

/// For the bits of four rows, the bits of the four lanes of each row.
static ROWS_OF_LANES: [u16; 16] = {
    let mut lanes = [0; 16];
    let mut at: usize = 0;
    while at < 64 {
        let bit = (((at / 4) >> (at % 4)) & 1) as u16;
        lanes[at / 4] |= (bit * 0xf) << (4 * (at % 4));
        at += 1;
    }
    lanes
};

impl CachedNode {
    pub(super) const EMPTY: Self = Self {
        group: Group::ZERO,
        turning: TurningCodes::NONE,
        links: Links::NONE,
        page: 0,
        first: 0,
        continues: false,
        lanes: ChildLanes::NONE,
    };

    /// Returns the node above a root, given a group of its slabs and its page.
    pub(super) fn above(group: Group, page: u32) -> Self {
        let links = Links { kinds: 1, ..Links::NONE };
        Self { group, links, page, lanes: ChildLanes::new(1, 0), ..Self::EMPTY }
    }

    /// Returns the place of one of these children among all children of the node.
    #[inline(always)]
    pub(super) fn place(&self, child: ChildRef) -> usize {
        usize::from(self.first) + child.child()
    }

    /// Adopts the children of a treelet from `first` on, whose slabs have been decoded.
    #[inline(always)]
    fn adopt<I: Isa>(
        &mut self,
        isa: I,
        (opened, count): (&Opened<'_>, usize),
        first: usize,
        infos: &mut [ChildInfo],
    ) {
        (self.links, self.page) = (opened.links, opened.page.header().page_number.get());
        (self.first, self.continues) = (first as u8, first + 4 < count);
        let children = (1u16 << count.saturating_sub(first).min(4)) - 1;
        let leaves = leaf_lanes(&self.links, first / 4);
        self.lanes = ChildLanes::new(children, leaves);
        let (rows, mut extents) = (self.group.rows(), [0.0; 4]);
        let mut widest = isa.load4(&rows[16]).sub(isa.load4(&rows[0]));
        for axis in 1..3 {
            widest = widest.max(isa.load4(&rows[16 + axis]).sub(isa.load4(&rows[axis])));
        }
        isa.store4(widest, &mut extents);
        for (child, info) in infos.iter_mut().enumerate() {
            let (packet, triangles) = self.links.packet(first + child);
            let leaf = LEAF | u32::from(triangles) << PACKET_BITS | u32::from(packet);
            let opened = if leaves >> child & 1 == 1 { leaf } else { CLOSED };
            *info = ChildInfo { extent: extents[child & 3], opened };
        }
    }
}

/// Decodes an inner child of an opened node. Returns how many numbers it takes.
pub(super) struct DecodeNode<'a> {
    pub(super) bvh: &'a Bvh,
    pub(super) object: &'a Object,
    pub(super) parent: &'a CachedNode,
    pub(super) child: ChildRef,
    pub(super) to: &'a mut [CachedNode],
    pub(super) infos: &'a mut [ChildInfo],
}

impl Task for DecodeNode<'_> {
    type Output = Result<usize, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object, parent, child, to: [to, next, ..], infos } = self else {
            unreachable!("there is room for two numbers")
        };
        let closed = ClosedChild {
            group: &parent.group,
            column: child.child(),
            links: &parent.links,
            place: parent.place(child),
            page: parent.page,
        };
        let groups = [&mut to.group, &mut next.group];
        let Some(opened) = open_child(isa, (bvh, object), &closed, groups)? else {
            (to.continues, to.lanes) = (false, ChildLanes::NONE);
            return Ok(1);
        };
        let profile = object.profile();
        to.turning = match opened.treelet.first_chunk() {
            Some(treelet) if profile.has_turning_slabs() => TurningCodes::read(treelet),
            _ => TurningCodes::NONE,
        };
        isa.prefetch::<10>(bvh.packets_to_prefetch(object, &opened.page, &opened.links));
        if bvh.is_worth_prefetching() {
            for treelets in opened.page.treelets_ahead(&opened.links) {
                isa.prefetch::<8>(treelets);
            }
        }
        let count = opened.links.children().min(profile.width());
        let (first, second) = infos.split_at_mut(4);
        to.adopt(isa, (&opened, count), 0, first);
        if count > 4 {
            next.turning = TurningCodes::NONE;
            next.adopt(isa, (&opened, count), 4, &mut second[..4]);
        }
        Ok(1 + usize::from(to.continues))
    }
}

/// Spreads the slabs of a root to a group.
pub(super) struct Spread<'a>(pub(super) &'a NodeSlabs);

impl Task for Spread<'_> {
    type Output = Group;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Group {
        spread(isa, self.0)
    }
}
