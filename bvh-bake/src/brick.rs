//! What becomes of a brick: its tree cut, planned and encoded, but for the rest of half a page that goes to the pages above.

use crate::arena::Arena;
use crate::build::{Bricks, Node, PacketTriangles};
use crate::draft::{Draft, Drafts};
use crate::encode::{Encoder, Style};
use crate::error::BakeError;
use crate::means::Means;
use crate::pages::{self, Place};
use crate::scratch::Spill;
use crate::soup::Triangle;
use crate::treelets::{Child, ChildKind, Cutter, packet};
use bvh_format::kdop::Kdop;
use std::collections::HashMap;

/// A brick whose pages are a draft.
struct Brick {
    draft: Draft,
    /// Of the whole brick.
    kdop: Kdop,
    /// The treelets in no page yet, with those below them that are in one.
    rest: Arena,
    /// The triangles of the rest.
    triangles: Vec<Triangle>,
    /// Which treelets of the rest are in a page, counted from the brick's first, and where.
    placed: Vec<(u32, Place)>,
    /// Children of all treelets.
    children: u64,
}

/// The pages of an object, and what its treelets have in children.
pub(crate) struct Drafted {
    pub(crate) drafts: Drafts,
    pub(crate) children: u64,
}

/// Builds, cuts, plans and encodes an object.
pub(crate) fn draft(bricks: Bricks, style: Style, means: &Means) -> Result<Drafted, BakeError> {
    let spill = means.scratch.spill();
    let (bricks, top) = bricks.build(means, |tree, triangles| of_brick(tree, triangles, style, &spill))?;
    let (width, slabs) = (style.profile.width(), style.profile.directions().slabs());
    let mut top = match top {
        Node::Leaf(_) => Arena::empty(),
        top => {
            let brick =
                |brick: u32| Child { kdop: bricks[brick as usize].kdop, kind: ChildKind::Brick(brick) };
            Arena::flatten(Cutter { width, slabs, leaf: brick }.cut(top))
        }
    };
    let children = top.children_in_all() + bricks.iter().map(|brick| brick.children).sum::<u64>();
    let mut triangles = Vec::new();
    let (mut rests, mut drafts, mut placed) = (Vec::new(), Vec::new(), Vec::new());
    for mut brick in bricks {
        brick.rest.renumber_triangles(triangles.len() as u32);
        triangles.append(&mut brick.triangles);
        rests.push(brick.rest);
        drafts.push(brick.draft);
        placed.push(brick.placed);
    }
    let ranges;
    (top, ranges) = Arena::join(top, rests);
    let mut taken = vec![false; top.treelets.len()];
    for (range, placed) in ranges.iter().zip(&placed) {
        placed.iter().for_each(|(treelet, _)| taken[range.start + *treelet as usize] = true);
    }
    let pages = pages::plan_rest(&top, style.profile, taken);
    let mut places = pages::places(&pages, top.treelets.len());
    let mut base = pages.len() as u32;
    for ((range, placed), draft) in ranges.iter().zip(placed).zip(&drafts) {
        for (treelet, place) in placed {
            places[range.start + treelet as usize] = Place { page: base + place.page, ..place };
        }
        base += draft.page_count() as u32;
    }
    let mut parents = HashMap::new();
    for (number, page) in (0..).zip(&pages) {
        for (link, &target) in (0..).zip(&page.remotes) {
            let Place { page, slot } = places[target as usize];
            parents.insert((page, slot), (number, link));
        }
    }
    let encoder = Encoder { arena: &top, pages: &pages, places: &places, triangles: &triangles, style };
    drafts.insert(0, Draft::new(encoder.encode(), &spill)?);
    Ok(Drafted { drafts: Drafts { profile: style.profile, drafts, parents, order: None }, children })
}

fn of_brick(
    tree: Node<PacketTriangles>,
    triangles: &[Triangle],
    style: Style,
    spill: &Spill,
) -> Result<Brick, BakeError> {
    let (width, slabs) = (style.profile.width(), style.profile.directions().slabs());
    let cutter = Cutter { width, slabs, leaf: |leaf| packet(triangles, leaf) };
    let root = cutter.cut(tree);
    let kdop = root.kdop(slabs);
    let mut arena = Arena::flatten(root);
    let plan = pages::plan_brick(&arena, style.profile);
    let places = pages::places(&plan.pages, arena.treelets.len());
    let encoder = Encoder { arena: &arena, pages: &plan.pages, places: &places, triangles, style };
    let encoded = encoder.encode();
    let children = arena.children_in_all();
    let (mut own, mut placed) = (Vec::new(), Vec::new());
    let rest = arena.rest(&plan.taken, triangles, &mut own, |there, here| {
        placed.push((here, places[there as usize]));
    });
    Ok(Brick { draft: Draft::new(encoded, spill)?, kdop, rest, triangles: own, placed, children })
}
