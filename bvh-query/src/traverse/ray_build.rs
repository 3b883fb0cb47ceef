//! Makes the tree of boxes that rays walk ([`crate::file::ray_tree`]) from the treelets of an object.
//!
//! A node starts with the children of a treelet. As long as eight places suffice, the largest child that is a treelet gives way to
//! its own children. Boxes are then computed from the packets up, and are tighter than those of the file.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::ray_tree::{LeafPlaces, PLACE_BYTES, PLACES_PER_PACKET, RayChild, RayNode, RayTree};
use crate::isa::{Isa, Task};
use crate::traverse::node_cache::{max_nodes, too_many};
use crate::traverse::open_child::{ClosedChild, open_child, spread};
use bvh_format::leaf::{Packet, TriangleEncoding};
use bvh_format::object::Object;
use bvh_format::slabs::Group;
use bvh_format::treelet::{Child, Links};
use std::rc::Rc;

/// Children of a node.
const WIDTH: usize = 8;

/// Most bytes of a tree per triangle.
const MAX_BYTES_PER_TRIANGLE: u64 = 16;
/// A tree of this many bytes may take more than that per triangle.
const SMALL_BYTES: u64 = 1 << 14;

/// Makes the tree of an object; none if it would be too large.
pub(crate) struct MakeRayTree<'a> {
    pub(crate) bvh: &'a Bvh,
    pub(crate) object: &'a Object,
}

/// A treelet that has been decoded.
struct Opened {
    groups: [Group; 2],
    links: Links,
    page: u32,
    /// The place of the first packet of the page.
    first_place: u32,
}

/// A child of a node that is being made.
struct Member {
    parent: Rc<Opened>,
    place: usize,
    /// Half the surface of its box; negative if it is not to be opened.
    area: f32,
    opened: Option<Rc<Opened>>,
}

/// A node to be made, and where it is a child.
struct Pending {
    opened: Rc<Opened>,
    at: Option<(usize, usize)>,
    depth: usize,
}

impl Task for MakeRayTree<'_> {
    type Output = Result<Option<RayTree>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object } = self;
        let Some(places) = self.places()? else { return Ok(None) };
        let most = object.triangles().saturating_mul(MAX_BYTES_PER_TRIANGLE).max(SMALL_BYTES);
        let first = object.record().first_page.get();
        let slabs = bvh.page(object, first)?.anchor_slabs(0);
        let links = Links { kinds: 1, ..Links::NONE };
        let above = Opened { groups: [spread(isa, &slabs), Group::ZERO], links, page: first, first_place: 0 };
        let mut maker = Maker { bvh, object, places: &places, left: max_nodes(object) };
        let (mut nodes, mut pending, mut deepest) = (Vec::new(), Vec::new(), 0);
        if let Some(opened) = isa.run(Open(&mut maker, &above, 0))? {
            pending.push(Pending { opened, at: None, depth: 1 });
        }
        while let Some(Pending { opened, at, depth }) = pending.pop() {
            let number = nodes.len();
            if let Some((node, lane)) = at {
                let node: &mut RayNode = &mut nodes[node];
                node.children[lane] = RayChild::node(number as u32);
            }
            deepest = deepest.max(depth);
            let mut node = RayNode::EMPTY;
            let members = maker.members(isa, opened)?;
            for (lane, member) in members.into_iter().enumerate().rev() {
                let Opened { links, first_place, .. } = &*member.parent;
                if let Child::Leaf { packet, triangles } = links.child(member.place) {
                    let per_packet = if places.plain.is_some() { PLACES_PER_PACKET } else { 1 };
                    let place = first_place + per_packet * u32::from(packet);
                    if place >= RayChild::MAX_PLACES {
                        return Ok(None);
                    }
                    node.children[lane] = RayChild::leaf(place, triangles);
                    // Makes the box one that is to be computed.
                    node.ends[0][lane] = 0.0;
                } else if let Some(opened) = match member.opened {
                    Some(opened) => Some(opened),
                    None => isa.run(Open(&mut maker, &member.parent, member.place))?,
                } {
                    node.ends[0][lane] = 0.0;
                    pending.push(Pending { opened, at: Some((number, lane)), depth: depth + 1 });
                }
            }
            nodes.push(node);
            if (nodes.len() * size_of::<RayNode>()) as u64 > most {
                return Ok(None);
            }
        }
        nodes.shrink_to_fit();
        isa.run(Fit { bvh, object, places: &places, nodes: &mut nodes })?;
        Ok(Some(RayTree::new(nodes, places, (WIDTH - 1) * deepest + WIDTH)))
    }
}

impl MakeRayTree<'_> {
    /// Finds where the packets are, after checking all pages and leaf blocks. Returns nothing for an order that no baker makes.
    fn places(&self) -> Result<Option<LeafPlaces>, QueryError> {
        let Self { bvh, object } = self;
        let is_plain = object.triangle_encoding() == TriangleEncoding::F32;
        let (mut places, mut base) = (LeafPlaces::default(), None);
        for number in object.pages() {
            let page = bvh.page(object, number)?;
            let block = bvh.leaf_block(object, &page)?;
            let first = if is_plain {
                let start = (block.as_ptr() as usize).wrapping_sub(bvh.bytes().as_ptr() as usize);
                match start.checked_sub(*base.get_or_insert(start)) {
                    Some(from) => from / PLACE_BYTES,
                    None => return Ok(None),
                }
            } else {
                page.header().first_packet.get() as usize
            };
            let is_known = first < RayChild::MAX_PLACES as usize;
            if !is_known || places.pages.last().is_some_and(|&(before, _)| before as usize > first) {
                return Ok(None);
            }
            places.pages.push((first as u32, number));
        }
        places.plain = base;
        places.make_runs();
        Ok(Some(places))
    }
}

struct Maker<'a> {
    bvh: &'a Bvh,
    object: &'a Object,
    places: &'a LeafPlaces,
    /// How many treelets may still be opened.
    left: usize,
}

impl Maker<'_> {
    /// Returns the members of the node that starts with the children of a treelet.
    #[inline(always)]
    fn members<I: Isa>(&mut self, isa: I, opened: Rc<Opened>) -> Result<Vec<Member>, QueryError> {
        let mut members = Vec::with_capacity(WIDTH);
        add_members(&mut members, &opened, self.object);
        loop {
            let largest = (0..members.len()).filter(|&i| members[i].area >= 0.0);
            let Some(at) = largest.max_by(|&i, &j| members[i].area.total_cmp(&members[j].area)) else {
                break;
            };
            let member = &mut members[at];
            member.area = -1.0;
            let Some(opened) = isa.run(Open(self, &member.parent, member.place))? else { continue };
            member.opened = Some(opened.clone());
            if members.len() - 1 + opened.links.children().min(self.object.profile().width()) <= WIDTH {
                members.swap_remove(at);
                add_members(&mut members, &opened, self.object);
            }
        }
        Ok(members)
    }
}

/// Adds the children of a treelet.
#[inline(always)]
fn add_members(members: &mut Vec<Member>, opened: &Rc<Opened>, object: &Object) {
    for place in 0..opened.links.children().min(object.profile().width()) {
        let area = match opened.links.child(place) {
            Child::Treelet(_) | Child::Remote(_) => {
                let rows = opened.groups[place / 4].rows();
                let [x, y, z] = [0, 1, 2].map(|row| rows[16 + row][place % 4] - rows[row][place % 4]);
                (x * y + y * z + z * x).max(0.0)
            }
            Child::Leaf { .. } => -1.0,
            Child::Empty => continue,
        };
        members.push(Member { parent: opened.clone(), place, area, opened: None });
    }
}

/// Opens a child of a treelet.
struct Open<'a, 'b>(&'a mut Maker<'b>, &'a Opened, usize);

impl Task for Open<'_, '_> {
    type Output = Result<Option<Rc<Opened>>, QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self(maker, parent, place) = self;
        let &mut Maker { bvh, object, places, .. } = maker;
        maker.left = maker.left.checked_sub(1).ok_or_else(|| too_many(bvh, object, max_nodes(object)))?;
        let mut groups = [Group::ZERO; 2];
        let child = ClosedChild {
            group: &parent.groups[(place / 4) & 1],
            column: place % 4,
            links: &parent.links,
            place,
            page: parent.page,
        };
        let Some(opened) = open_child(isa, (bvh, object), &child, groups.each_mut())? else {
            return Ok(None);
        };
        let page = opened.page.header().page_number.get();
        let number = page.wrapping_sub(object.record().first_page.get()) as usize;
        let first_place = places.pages.get(number).map_or(0, |&(first, _)| first);
        Ok(Some(Rc::new(Opened { groups, links: opened.links, page, first_place })))
    }
}

/// Computes the boxes of all nodes from the packets up.
struct Fit<'a> {
    bvh: &'a Bvh,
    object: &'a Object,
    places: &'a LeafPlaces,
    nodes: &'a mut [RayNode],
}

impl Task for Fit<'_> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { bvh, object, places, nodes } = self;
        let mut room = Packet::NONE;
        // The children of a node come after it.
        for number in (0..nodes.len()).rev() {
            for lane in 0..WIDTH {
                let node = &nodes[number];
                if node.ends[0][lane] == f32::INFINITY {
                    continue;
                }
                let child = node.children[lane];
                let ends = match child.as_node() {
                    Some(child) => {
                        let of = &nodes[child].ends;
                        let ends = |from: usize, join: fn(f32, f32) -> f32| {
                            [0, 1, 2].map(|axis| of[from + axis].into_iter().reduce(join).unwrap_or(0.0))
                        };
                        [ends(0, f32::min), ends(3, f32::max)]
                    }
                    None => {
                        let (place, triangles) = child.as_leaf();
                        let packet = bvh.packet(isa, object, places.packet(place, triangles), &mut room)?;
                        box_of(packet, triangles.into())
                    }
                };
                let node = &mut nodes[number];
                for axis in 0..3 {
                    node.ends[axis][lane] = ends[0][axis];
                    node.ends[3 + axis][lane] = ends[1][axis];
                }
            }
        }
        Ok(())
    }
}

/// Returns the lower and the upper ends of the first triangles of a packet.
fn box_of(packet: &Packet, triangles: usize) -> [[f32; 3]; 2] {
    let (mut lo, mut hi) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for corner in &packet.corners {
        for axis in 0..3 {
            for &x in &corner[axis][..triangles] {
                (lo[axis], hi[axis]) = (lo[axis].min(x), hi[axis].max(x));
            }
        }
    }
    [lo, hi]
}
