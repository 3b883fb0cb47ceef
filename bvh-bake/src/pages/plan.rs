//! Gathers treelets into pages: bottom subtrees first, then the tree above them, up to the root.
//!
//! On every level, the largest subtrees of at most half a page are taken off the tree and put into pages in depth-first
//! order, several per page. The tree that remains, with remote links in their places, is the tree of the next level.
//! Half a page keeps two losses small: the anchors, which take one line per subtree, and the room that no subtree fits.
//! The pages of the last level, which has the root, come first in the file, so that children are always in later pages
//! than their parents.
//!
//! If the style of the pages says so, treelets whose children are all packets are written as short ones, except for
//! roots.
//!
//! Each brick is planned by itself, except for a rest of at most half a page. The rests and the tree above the bricks
//! are planned last and come first in the file. The bricks follow one after the other.

use crate::pages::Style;
use crate::tree::arena::{Arena, TreeletIndex};
use bvh_format::page::{PAGE, PageShape};
use bvh_format::profile::Profile;
use std::collections::VecDeque;

/// The most pages that are open at a time. With more, pages are filled better, but neighbours are scattered farther.
const MAX_OPEN_PAGES: usize = 24;

/// A page: its subtree roots, and all its treelets by slot.
pub(crate) struct PagePlan {
    pub(crate) roots: usize,
    /// Treelets in slot order: breadth-first from the roots, and short ones after the others.
    pub(crate) slots: Vec<TreeletIndex>,
    /// How many of the treelets are short.
    pub(crate) short: usize,
    /// The treelet to which each remote link leads, in the order of slots and children.
    pub(crate) remotes: Vec<TreeletIndex>,
}

/// The place of a treelet.
#[derive(Clone, Copy, Default)]
pub(crate) struct Place {
    pub(crate) page: u32,
    pub(crate) slot: u8,
}

/// The pages of a brick, counted from its first.
pub(crate) struct Plan {
    pub(crate) pages: Vec<PagePlan>,
    /// The treelets in these pages.
    pub(crate) taken: Vec<bool>,
}

/// The room that a subtree takes in a page.
#[derive(Clone, Copy, Default)]
struct Load {
    roots: u32,
    remotes: u32,
    treelets: u32,
    short: u32,
}

impl Load {
    fn with(self, other: Self) -> Self {
        Self {
            roots: self.roots + other.roots,
            remotes: self.remotes + other.remotes,
            treelets: self.treelets + other.treelets,
            short: self.short + other.short,
        }
    }

    fn shape(self) -> PageShape {
        let [roots, remotes, treelets, short] =
            [self.roots, self.remotes, self.treelets, self.short].map(|count| count as usize);
        PageShape { roots, remotes, treelets, short }
    }

    fn fits(self, profile: Profile) -> bool {
        self.shape().fits(profile)
    }

    fn lines(self, profile: Profile) -> usize {
        self.shape().lines(profile)
    }
}

/// Plans the pages of a brick, except for a rest of at most half a page.
pub(crate) fn plan_brick(arena: &Arena, style: Style) -> Plan {
    let mut region = Region::new(arena, style, vec![false; arena.len()]);
    let pages = region.plan(Until::HalfAPage);
    Plan { pages, taken: region.taken }
}

/// Plans the pages of all treelets that are not taken.
pub(crate) fn plan_rest(arena: &Arena, style: Style, taken: Vec<bool>) -> Vec<PagePlan> {
    Region::new(arena, style, taken).plan(Until::Nothing)
}

/// Returns the place of each of `count` treelets.
pub(crate) fn places(pages: &[PagePlan], count: usize) -> Vec<Place> {
    let mut places = vec![Place::default(); count];
    for (page, plan) in pages.iter().enumerate() {
        for (slot, &treelet) in plan.slots.iter().enumerate() {
            places[treelet as usize] = Place { page: page as u32, slot: slot as u8 };
        }
    }
    places
}

/// The number of the root, which is above all other treelets.
const ROOT: TreeletIndex = 0;

/// The amount that may remain unplanned.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Until {
    HalfAPage,
    Nothing,
}

/// A tree of treelets, of which the lower ones are gradually put into pages.
struct Region<'a> {
    arena: &'a Arena,
    profile: Profile,
    /// Whether treelets of nothing but packets are short.
    short_treelets: bool,
    /// Per treelet, whether it is in a page.
    taken: Vec<bool>,
    /// For each of the others, the room that it and the unplanned treelets below it take.
    loads: Vec<Load>,
}

impl<'a> Region<'a> {
    fn new(arena: &'a Arena, style: Style, taken: Vec<bool>) -> Self {
        let loads = vec![Load::default(); taken.len()];
        Self { arena, profile: style.profile, short_treelets: style.has_short_treelets(), taken, loads }
    }

    /// Returns true if a treelet is short wherever it is no root.
    fn may_be_short(&self, index: TreeletIndex) -> bool {
        self.short_treelets && self.arena.has_only_packets(index)
    }

    fn is_taken(&self, index: TreeletIndex) -> bool {
        self.taken[index as usize]
    }

    /// The room of a subtree. Its root is not short.
    fn load(&self, index: TreeletIndex) -> Load {
        let load = self.loads[index as usize];
        Load { roots: 1, short: if load.treelets == 1 { 0 } else { load.short }, ..load }
    }

    /// Returns the children of a treelet that are treelets in no page yet.
    fn left_below(&self, index: TreeletIndex) -> impl DoubleEndedIterator<Item = TreeletIndex> {
        self.arena.treelets_below(index).filter(|&child| !self.is_taken(child))
    }

    /// Plans level by level, and returns the pages in the order of the file.
    fn plan(&mut self, until: Until) -> Vec<PagePlan> {
        let mut levels = Vec::new();
        while !self.is_taken(ROOT) {
            self.update_loads();
            if until == Until::HalfAPage && self.is_small(ROOT) {
                break;
            }
            levels.push(self.plan_level());
        }
        levels.into_iter().rev().flatten().collect()
    }

    /// Returns true if a treelet and the unplanned treelets below it fit in half a page. A single treelet always does.
    fn is_small(&self, index: TreeletIndex) -> bool {
        let half = (PAGE / 64 - 1) / 2;
        self.load(index).lines(self.profile) - 1 <= half.max(1 + self.profile.treelet_bytes() / 64 + 1)
    }

    /// Takes one level of subtrees off the tree.
    fn plan_level(&mut self) -> Vec<PagePlan> {
        let profile = self.profile;
        let mut pages: Vec<(Load, Vec<TreeletIndex>)> = Vec::new();
        let mut open: VecDeque<usize> = VecDeque::new();
        let mut stack = vec![ROOT];
        let mut roots = Vec::new();
        let all_in_one = self.load(ROOT).fits(profile);
        while let Some(index) = stack.pop() {
            let alone = index == ROOT && all_in_one;
            if !alone && !self.is_small(index) {
                stack.extend(self.left_below(index).rev());
                continue;
            }
            let load = self.load(index);
            // The fullest open page that has room.
            let room = open.iter().copied().filter(|&page| pages[page].0.with(load).fits(profile));
            let page = room.max_by_key(|&page| (pages[page].0.lines(profile), std::cmp::Reverse(page)));
            let page = page.unwrap_or_else(|| {
                pages.push((Load::default(), Vec::new()));
                open.push_back(pages.len() - 1);
                if open.len() > MAX_OPEN_PAGES {
                    open.pop_front();
                }
                pages.len() - 1
            });
            pages[page].0 = pages[page].0.with(load);
            pages[page].1.push(index);
            roots.push(index);
        }
        let plans = pages.into_iter().map(|(_, roots)| self.plan_page(roots)).collect();
        roots.into_iter().for_each(|root| self.take(root));
        plans
    }

    /// Sums the room of the unplanned treelets, from the leaves up.
    fn update_loads(&mut self) {
        for index in (0..self.taken.len()).rev() {
            if self.taken[index] {
                continue;
            }
            let short = self.may_be_short(index as u32).into();
            let mut load = Load { treelets: 1, short, ..Load::default() };
            for child in self.arena.treelets_below(index as u32) {
                if self.is_taken(child) {
                    load.remotes += 1;
                } else {
                    load = load.with(self.loads[child as usize]);
                }
            }
            self.loads[index] = load;
        }
    }

    /// Numbers the treelets of a page breadth-first, and collects its remote links in the same order.
    fn plan_page(&self, roots: Vec<TreeletIndex>) -> PagePlan {
        let mut plan = PagePlan { roots: roots.len(), slots: roots, short: 0, remotes: Vec::new() };
        let (mut next, mut short) = (0, Vec::new());
        while next < plan.slots.len() {
            for child in self.arena.treelets_below(plan.slots[next]) {
                let list = match child {
                    _ if self.is_taken(child) => &mut plan.remotes,
                    _ if self.may_be_short(child) => &mut short,
                    _ => &mut plan.slots,
                };
                list.push(child);
            }
            next += 1;
        }
        plan.short = short.len();
        plan.slots.append(&mut short);
        plan
    }

    fn take(&mut self, root: TreeletIndex) {
        let mut stack = vec![root];
        while let Some(index) = stack.pop() {
            stack.extend(self.left_below(index));
            self.taken[index as usize] = true;
        }
    }
}
