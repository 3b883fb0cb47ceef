//! Gathers treelets into pages: bottom subtrees first, then the tree above them, up to the root.
//!
//! On every level the largest subtrees of at most half a page are taken off the tree and put
//! into pages, several to a page, in depth-first order; what is left above them, with remote links
//! in their places, is the tree of the next level. Half a page keeps both losses small: anchors (one
//! line a subtree) and room that no subtree fits. Pages of the last level, the root's, come first
//! in the file, so that children are always in later pages than their parents.

use crate::treelets::{ChildKind, Treelet};
use bvh_format::page::{PAGE, fits};
use bvh_format::profile::Profile;
use std::collections::VecDeque;

/// Pages that are filled side by side; more fill better and scatter neighbours.
const OPEN_PAGES: usize = 24;

/// A treelet by number in the arena, in depth-first order: children have higher numbers.
pub(crate) type TreeletIndex = usize;

/// The tree as an arena.
pub(crate) struct Arena {
    pub(crate) treelets: Vec<Treelet>,
    /// Per treelet and child the child treelet, if it is one.
    pub(crate) children: Vec<[Option<TreeletIndex>; 8]>,
}

/// A page: its subtree roots and all its treelets by slot.
pub(crate) struct PagePlan {
    pub(crate) roots: usize,
    /// Treelets in slot order, breadth-first from the roots.
    pub(crate) slots: Vec<TreeletIndex>,
    /// Per remote link the treelet it leads to, in the order of slots and children.
    pub(crate) remotes: Vec<TreeletIndex>,
}

/// Where a treelet is.
#[derive(Clone, Copy, Default)]
pub(crate) struct Place {
    pub(crate) page: u32,
    pub(crate) slot: u8,
}

/// The pages of an object in the order of the file, and where each treelet is.
pub(crate) struct Plan {
    pub(crate) pages: Vec<PagePlan>,
    pub(crate) places: Vec<Place>,
}

/// Flattens the tree, depth-first.
pub(crate) fn flatten(root: Treelet) -> Arena {
    let mut arena = Arena { treelets: Vec::new(), children: Vec::new() };
    // (treelet, parent and child it hangs from); a stack, since trees may be deep.
    let mut stack = vec![(root, None)];
    while let Some((mut treelet, from)) = stack.pop() {
        let index = arena.treelets.len();
        if let Some((parent, child)) = from {
            let links: &mut [Option<TreeletIndex>; 8] = &mut arena.children[parent];
            links[child] = Some(index);
        }
        for (child, slot) in treelet.children.iter_mut().enumerate().rev() {
            if let ChildKind::Treelet(inner) = &mut slot.kind {
                let inner = std::mem::replace(inner.as_mut(), Treelet { children: Vec::new() });
                stack.push((inner, Some((index, child))));
            }
        }
        arena.treelets.push(treelet);
        arena.children.push([None; 8]);
    }
    arena
}

/// Room that a subtree takes in a page.
#[derive(Clone, Copy, Default)]
struct Load {
    roots: usize,
    remotes: usize,
    treelets: usize,
}

impl Load {
    fn with(self, other: Self) -> Self {
        Self {
            roots: self.roots + other.roots,
            remotes: self.remotes + other.remotes,
            treelets: self.treelets + other.treelets,
        }
    }

    fn fits(self, profile: Profile) -> bool {
        fits(profile, self.roots, self.remotes, self.treelets)
    }

    fn lines(self, profile: Profile) -> usize {
        bvh_format::page::treelet_line(profile, self.roots, self.remotes)
            + self.treelets * (profile.treelet_bytes() / 64)
    }
}

/// Plans the pages of an object.
pub(crate) fn plan(arena: &Arena, profile: Profile) -> Plan {
    let count = arena.treelets.len();
    let mut taken = vec![false; count];
    let mut levels = Vec::new();
    while !taken[0] {
        levels.push(plan_level(arena, profile, &mut taken));
    }
    let pages: Vec<PagePlan> = levels.into_iter().rev().flatten().collect();
    let mut places = vec![Place::default(); count];
    for (page, plan) in pages.iter().enumerate() {
        for (slot, &treelet) in plan.slots.iter().enumerate() {
            places[treelet] = Place { page: page as u32, slot: slot as u8 };
        }
    }
    Plan { pages, places }
}

/// Takes one level of subtrees off the tree.
fn plan_level(arena: &Arena, profile: Profile, taken: &mut [bool]) -> Vec<PagePlan> {
    let loads = loads(arena, taken);
    let half = (PAGE / 64 - 1) / 2;
    // What fits a page may be a root; half a page is the aim, a single treelet always fits.
    let small = |index: TreeletIndex| {
        let load = Load { roots: 1, ..loads[index] };
        load.lines(profile) - 1 <= half.max(1 + profile.treelet_bytes() / 64 + 1)
    };
    let mut pages: Vec<(Load, Vec<TreeletIndex>)> = Vec::new();
    let mut open: VecDeque<usize> = VecDeque::new();
    let mut stack = vec![0];
    let mut roots = Vec::new();
    let all_in_one = Load { roots: 1, ..loads[0] }.fits(profile);
    while let Some(index) = stack.pop() {
        let alone = index == 0 && all_in_one;
        if !alone && !small(index) {
            stack.extend(arena.children[index].iter().rev().flatten().filter(|&&child| !taken[child]));
            continue;
        }
        let load = Load { roots: 1, ..loads[index] };
        // The fullest open page that has room.
        let room = open.iter().copied().filter(|&page| pages[page].0.with(load).fits(profile));
        let page = room.max_by_key(|&page| (pages[page].0.lines(profile), std::cmp::Reverse(page)));
        let page = page.unwrap_or_else(|| {
            pages.push((Load::default(), Vec::new()));
            open.push_back(pages.len() - 1);
            if open.len() > OPEN_PAGES {
                open.pop_front();
            }
            pages.len() - 1
        });
        pages[page].0 = pages[page].0.with(load);
        pages[page].1.push(index);
        roots.push(index);
    }
    let plans = pages.into_iter().map(|(_, roots)| plan_page(arena, taken, roots)).collect();
    roots.iter().for_each(|&root| take(arena, taken, root));
    plans
}

/// Per treelet the room of the subtree below it, in what is left of the tree.
fn loads(arena: &Arena, taken: &[bool]) -> Vec<Load> {
    let mut loads = vec![Load::default(); arena.treelets.len()];
    for index in (0..loads.len()).rev().filter(|&index| !taken[index]) {
        let mut load = Load { treelets: 1, ..Load::default() };
        for &child in arena.children[index].iter().flatten() {
            if taken[child] {
                load.remotes += 1;
            } else {
                load = load.with(loads[child]);
            }
        }
        loads[index] = load;
    }
    loads
}

/// Numbers a page's treelets breadth-first and collects its remote links in the same order.
fn plan_page(arena: &Arena, taken: &[bool], roots: Vec<TreeletIndex>) -> PagePlan {
    let mut plan = PagePlan { roots: roots.len(), slots: roots, remotes: Vec::new() };
    let mut next = 0;
    while next < plan.slots.len() {
        for &child in arena.children[plan.slots[next]].iter().flatten() {
            if taken[child] { plan.remotes.push(child) } else { plan.slots.push(child) }
        }
        next += 1;
    }
    plan
}

fn take(arena: &Arena, taken: &mut [bool], root: TreeletIndex) {
    let mut stack = vec![root];
    while let Some(index) = stack.pop() {
        taken[index] = true;
        stack.extend(arena.children[index].iter().flatten().filter(|&&child| !taken[child]));
    }
}
