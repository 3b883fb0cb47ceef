//! Turns the tree of a brick into pages: the tree is cut, planned and encoded, except for a rest of at most half a
//! page, which goes to the pages above the bricks.

use crate::error::BakeError;
use crate::pages::Style;
use crate::pages::encode::Encoder;
use crate::pages::plan::{self, Place};
use crate::pages::unnumbered::{ObjectPages, UnnumberedPages};
use crate::storage::Spill;
use crate::storage::resources::Resources;
use crate::topology::{self, BrickTopology, ObjectTopology, Rest, Survey};
use crate::tree::arena::Arena;
use crate::tree::treelets::{cut_brick, cut_top};
use crate::tree::turning;
use crate::tree::{Bricks, PacketTriangles, Tree};
use crate::triangles::Batch;
use bvh_format::kdop::Kdop;
use bvh_format::leaf::PACKET;
use std::collections::HashMap;

/// A brick that has been encoded.
struct EncodedBrick {
    pages: UnnumberedPages,
    packets: u64,
    /// The number of treelets in the pages.
    treelets: u64,
    /// The k-DOP of the whole brick.
    kdop: Kdop,
    /// The treelets that are in no page yet, with those directly below them that are in one.
    rest: Arena,
    /// The triangles of the rest.
    triangles: Batch<'static>,
    /// The treelets of the rest that are in a page, counted from the brick's first page, and their places.
    placed: Vec<(u32, Place)>,
    /// The number of children of all treelets.
    children: u64,
    topology: Option<BrickTopology>,
}

/// The pages of an object and what they hold.
pub(crate) struct EncodedObject {
    pub(crate) pages: ObjectPages,
    pub(crate) packets: u64,
    pub(crate) treelets: u64,
    /// The number of children of all treelets.
    pub(crate) children: u64,
    /// The topology, if there was a survey of it.
    pub(crate) topology: Option<ObjectTopology>,
}

/// Builds the trees of an object, cuts them into treelets, plans the pages and encodes them. `spill` stores what is kept
/// to the end of the bake.
pub(crate) fn encode_object(
    bricks: Bricks,
    style: Style,
    survey: Option<Survey>,
    resources: &Resources,
    spill: &Spill,
) -> Result<EncodedObject, BakeError> {
    let (bricks, top) = bricks.build(resources, |number, tree, triangles| {
        encode_brick(number, tree, triangles, style, survey.as_ref(), spill)
    })?;
    let (width, slabs) = (style.profile.width(), style.profile.directions().slabs());
    let mut top = if top.is_leaf() {
        Arena::empty()
    } else {
        cut_top(&top, |brick| bricks[brick as usize].kdop, width, slabs)
    };
    let sum = |of: fn(&EncodedBrick) -> u64| bricks.iter().map(of).sum::<u64>();
    let children = top.child_count() + sum(|brick| brick.children);
    let (packets, treelets) = (sum(|brick| brick.packets), sum(|brick| brick.treelets));
    let mut triangles = Batch::default();
    let (mut rests, mut parts, mut placed) = (Vec::new(), Vec::new(), Vec::new());
    let (mut topologies, mut first_places, mut next_packet) = (Vec::new(), Vec::new(), 0);
    for mut brick in bricks {
        topologies.extend(brick.topology);
        first_places.push(next_packet);
        next_packet += brick.packets;
        brick.rest.renumber_triangles(triangles.len() as u32);
        triangles.append(brick.triangles);
        rests.push(brick.rest);
        parts.push(brick.pages);
        placed.push(brick.placed);
    }
    let ranges;
    (top, ranges) = Arena::join(top, rests);
    let mut taken = vec![false; top.len()];
    for (range, placed) in ranges.iter().zip(&placed) {
        placed.iter().for_each(|(treelet, _)| taken[range.start + *treelet as usize] = true);
    }
    let pages = plan::plan_rest(&top, style, taken);
    let mut places = plan::places(&pages, top.len());
    let mut base = pages.len() as u32;
    for ((range, placed), part) in ranges.iter().zip(placed).zip(&parts) {
        for (treelet, place) in placed {
            places[range.start + treelet as usize] = Place { page: base + place.page, ..place };
        }
        base += part.page_count() as u32;
    }
    let mut parents = HashMap::new();
    for (number, page) in (0..).zip(&pages) {
        for (link, &target) in (0..).zip(&page.remotes) {
            let Place { page, slot } = places[target as usize];
            parents.insert((page, slot), (number, link));
        }
    }
    let encoder = Encoder { arena: &top, pages: &pages, places: &places, triangles: &triangles, style };
    let encoded = encoder.encode();
    let mut topology = None;
    if let Some(survey) = survey {
        let mut places = vec![0; triangles.len()];
        encoder.triangle_places().iter().for_each(|&(number, place)| places[number as usize] = place);
        let rest = Rest { triangles: &triangles, places: &places };
        // An object with more than 2^30 packets is refused when it is complete.
        let first_places =
            first_places.iter().map(|packet| ((encoded.packets + packet) * PACKET as u64) as u32);
        let first_places: Vec<u32> = first_places.collect();
        topology = Some(topology::join(survey, topologies, &first_places, &rest, resources, spill)?);
    }
    let (packets, treelets) = (packets + encoded.packets, treelets + encoded.treelets);
    parts.insert(0, UnnumberedPages::new(encoded, spill)?);
    let pages = ObjectPages { profile: style.profile, parts, parents };
    Ok(EncodedObject { pages, packets, treelets, children, topology })
}

fn encode_brick(
    number: usize,
    tree: Tree<PacketTriangles>,
    triangles: &Batch,
    style: Style,
    survey: Option<&Survey>,
    spill: &Spill,
) -> Result<EncodedBrick, BakeError> {
    let (width, slabs) = (style.profile.width(), style.profile.directions().slabs());
    let mut arena = cut_brick(&tree, triangles, width, slabs, &style.behind, style.orders_lanes());
    if style.profile.has_turning_slabs() && !style.is_cloud && !style.is_quick {
        turning::fit(&mut arena, triangles, style.behind.left_out);
    }
    drop(tree);
    spill.go_on()?;
    let kdop = arena.kdop(0, slabs);
    let plan = plan::plan_brick(&arena, style);
    let places = plan::places(&plan.pages, arena.len());
    let encoder = Encoder { arena: &arena, pages: &plan.pages, places: &places, triangles, style };
    let encoded = encoder.encode();
    spill.go_on()?;
    let (packets, treelets, children) = (encoded.packets, encoded.treelets, arena.child_count());
    let (mut own, mut placed) = (Vec::new(), Vec::new());
    let rest = arena.rest(&plan.taken, &mut own, |there, here| {
        placed.push((here, places[there as usize]));
    });
    let topology =
        survey.map(|survey| survey.brick(number, triangles, &encoder.triangle_places(), &own, spill));
    let topology = topology.transpose()?;
    let pages = UnnumberedPages::new(encoded, spill)?;
    let own = triangles.at(own.iter().map(|&number| number as usize));
    Ok(EncodedBrick { pages, packets, treelets, kdop, rest, triangles: own, placed, children, topology })
}
