//! The broad phase: trees of boxes over the instances, one for those that stand still and one for those that move.
//!
//! An instance counts as standing still until it moves. Then its leaf in the first tree becomes empty, and it is in the
//! second tree from the next question on. When it moves again, the boxes above it are computed again. When moves have
//! made the boxes of the second tree 1.5 times as large as after its build, the next question builds that tree anew.
//! The first tree therefore stays as tight as it was built, however far a few instances travel. Both trees are built
//! anew when an instance is added or removed.
//!
//! A file may put all instances in one place, or give them groups of which only the unions meet. Then every pair must
//! be tested. Each step of a search is therefore charged to the budget of the question, and no search holds all pairs.

mod by_key;
mod least_first;
mod near_pairs;
mod tree;

pub(super) use by_key::ByKey;
pub(super) use near_pairs::NearestFirst;

use crate::error::QueryError;
use crate::isa::Backend;
use crate::scene::groups::Groups;
use crate::scene::world_box::WorldBox;
use crate::traverse::budget::Budget;
use near_pairs::NearPairs;
use std::ops::ControlFlow;
use tree::{Child, Tree};

/// An instance, as the broad phase knows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    pub(super) place: u32,
    pub(super) bounds: WorldBox,
    pub(super) groups: Groups,
}

/// Both trees.
#[derive(Default, Clone, Debug)]
pub(super) struct BroadPhase {
    still: Tree,
    moving: Tree,
    /// Whether the instance in each place has moved since it was added.
    has_moved: Vec<bool>,
    /// Whether both trees are to be built by the next question, or the second one.
    is_stale: bool,
    is_moving_stale: bool,
}

impl BroadPhase {
    /// Records that an instance was added to a place, or removed from it.
    pub(super) fn replace(&mut self, place: u32) {
        self.is_stale = true;
        if let Some(has_moved) = self.has_moved.get_mut(place as usize) {
            *has_moved = false;
        }
    }

    /// Records that an instance has moved. The boxes above it are out of date until [`settle`](Self::settle).
    pub(super) fn set_box(&mut self, item: Item) {
        // A build takes all instances as they are then: poses set before it say nothing about which ones move.
        let Some(has_moved) = self.has_moved.get_mut(item.place as usize).filter(|_| !self.is_stale) else {
            return;
        };
        if std::mem::replace(has_moved, true) {
            self.moving.set(item);
        } else {
            self.still.set(Item { bounds: WorldBox::EMPTY, groups: Groups::NONE, ..item });
            self.is_moving_stale = true;
        }
    }

    /// Records that an instance has changed its groups.
    pub(super) fn set_groups(&mut self, item: Item) {
        match self.has_moved.get(item.place as usize) {
            _ if self.is_stale => {}
            Some(true) => self.moving.set(item),
            _ => self.still.set(item),
        }
        self.settle();
    }

    /// Computes the boxes above all instances that have moved.
    pub(super) fn settle(&mut self) {
        self.still.settle();
        self.moving.settle();
    }

    /// Returns whether a question has to build a tree first.
    pub(super) fn is_out_of_date(&self) -> bool {
        self.is_stale || self.is_moving_stale || self.moving.has_grown()
    }

    /// Builds the trees that are out of date. `items` lists them; places are below `places`.
    pub(super) fn refresh(&mut self, items: impl Iterator<Item = Item>, places: usize) {
        if !self.is_out_of_date() {
            return;
        }
        self.has_moved.resize(places, false);
        let (moving, still): (Vec<Item>, Vec<Item>) =
            items.partition(|item| self.has_moved.get(item.place as usize) == Some(&true));
        if self.is_stale {
            self.still.build(still, places);
        }
        self.moving.build(moving, places);
        (self.is_stale, self.is_moving_stale) = (false, false);
    }

    /// Calls `visit` with each pair of places whose groups meet and whose boxes are at most `limit` apart, and with the square
    /// of their gap, until it breaks. All backends visit the same pairs, at the same cost.
    pub(super) fn pairs(
        &self,
        backend: Backend,
        limit: f64,
        budget: &mut Budget,
        mut visit: impl FnMut(u32, u32, f64) -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, QueryError> {
        for trees in [[&self.still, &self.still], [&self.moving, &self.still], [&self.moving, &self.moving]] {
            let search = NearPairs::new(trees, limit, budget, &mut visit);
            if search.may_find() && backend.run(search)?.is_break() {
                return Ok(ControlFlow::Break(()));
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    /// Calls `visit` with each place whose groups meet those given and whose box is near another box, and with the
    /// square of their gap. `limit` returns how far apart they may be, for a box or for one that contains it.
    pub(super) fn near(
        &self,
        bounds: &WorldBox,
        groups: Groups,
        limit: impl Fn(&WorldBox) -> f64,
        budget: &mut Budget,
        mut visit: impl FnMut(u32, f64),
    ) -> Result<(), QueryError> {
        for tree in [&self.still, &self.moving] {
            let mut open: Vec<u32> = if tree.whole().is_some() { vec![0] } else { vec![] };
            while let Some(node) = open.pop() {
                for part in tree.parts(node) {
                    budget.visit()?;
                    if !part.groups.meet(groups) {
                        continue;
                    }
                    let inner = tree.bounds(part.child);
                    let squared_gap = bounds.squared_gap(&inner);
                    if squared_gap <= limit(&inner).powi(2) {
                        match part.child {
                            Child::Place(place) => visit(place, squared_gap),
                            Child::Node(node) => open.push(node),
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the places whose boxes have a finite key, in ascending order of the keys. The key of a box is at most that of any
    /// box in it.
    pub(super) fn by_key<K: Fn(&WorldBox) -> f64>(&self, key: K) -> ByKey<K> {
        ByKey::new(self, key)
    }

    fn tree(&self, which: Which) -> &Tree {
        match which {
            Which::Still => &self.still,
            Which::Moving => &self.moving,
        }
    }
}

/// One of the two trees.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Which {
    Still,
    Moving,
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    /// An instance near the origin, or far along a row.
    fn item(random: &mut Random, place: u32, is_in_row: bool) -> Item {
        let along = if is_in_row { 100.0 * f64::from(place) } else { 0.0 };
        let lo = [along, 0.0, 0.0].map(|from| from + 10.0 * random.signed());
        let bounds = WorldBox { lo, hi: lo.map(|end| end + 1.0 + random.signed()) };
        Item { place, bounds, groups: Groups { member: 1 << random.below(3), meets: 1 << random.below(3) } }
    }

    #[test]
    fn all_near_pairs_are_visited_once_after_any_moves() {
        let random = &mut Random::new(5);
        let (mut seen, mut grown) = (0, 0);
        for count in [0, 1, 2, 3, 16, 17, 40, 300] {
            // Places in between are empty.
            let mut items: Vec<Item> = (0..count).map(|number| item(random, 2 * number, true)).collect();
            let mut broad = BroadPhase::default();
            items.iter().for_each(|item| broad.replace(item.place));
            for step in 0..200 {
                let is_in_row = step < 120;
                if count > 0 {
                    let number = random.below(count as usize);
                    let place = 2 * number as u32;
                    let (bounds, has_moved) =
                        (items[number].bounds, broad.has_moved.get(place as usize).copied());
                    items[number] = item(random, place, is_in_row);
                    if step % 40 == 39 {
                        broad.replace(place);
                    } else if step % 8 == 3 {
                        items[number].bounds = bounds;
                        broad.set_groups(items[number]);
                        assert_eq!(broad.has_moved.get(place as usize).copied(), has_moved);
                    } else {
                        broad.set_box(items[number]);
                        // Some moves together, and the same one twice.
                        for _ in 0..step % 4 {
                            let number = random.below(count as usize);
                            items[number] = item(random, 2 * number as u32, is_in_row);
                            broad.set_box(items[number]);
                        }
                        broad.settle();
                    }
                }
                grown += usize::from(broad.moving.has_grown());
                broad.refresh(items.iter().copied(), 2 * count as usize);
                broad.still.check();
                broad.moving.check();
                let limit = [0.0, 1.5, f64::INFINITY][step % 3];
                let mut found = Vec::new();
                let mut made = None;
                for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                    found.clear();
                    let mut budget = Budget::new(u64::MAX);
                    let visited = broad.pairs(backend, limit, &mut budget, |a, b, squared_gap| {
                        found.push((a.min(b), a.max(b), squared_gap));
                        ControlFlow::Continue(())
                    });
                    assert_eq!(visited, Ok(ControlFlow::Continue(())));
                    // All backends compare the same boxes.
                    assert_eq!(*made.get_or_insert(budget.made()), budget.made());
                }
                found.sort_unstable_by_key(|&(a, b, _)| (a, b));
                let mut budget = Budget::new(u64::MAX);
                let mut expected = Vec::new();
                for (number, a) in items.iter().enumerate() {
                    for b in &items[number + 1..] {
                        let gap = a.bounds.squared_gap(&b.bounds);
                        if a.groups.meet(b.groups) && gap <= limit * limit {
                            expected.push((a.place, b.place, gap));
                        }
                    }
                }
                seen += expected.len();
                assert_eq!(found, expected, "{count} {step}");
                // The same pairs and gaps, place by place.
                found.clear();
                for item in &items {
                    let visit = |place, gap| {
                        if place > item.place {
                            found.push((item.place, place, gap));
                        }
                    };
                    broad.near(&item.bounds, item.groups, |_| limit, &mut budget, visit).unwrap();
                }
                found.sort_unstable_by_key(|&(a, b, _)| (a, b));
                assert_eq!(found, expected, "{count} {step}");
                let expected: Vec<_> = expected.into_iter().map(|(a, b, _)| (a, b)).collect();
                let (mut found, mut last) = (Vec::new(), 0.0);
                let mut nearest = NearestFirst::new(&broad);
                while let Some((a, b, squared_gap)) = nearest.next(&broad, &mut budget).unwrap() {
                    assert!(squared_gap >= last);
                    last = squared_gap;
                    if squared_gap <= limit * limit {
                        found.push((a.min(b), a.max(b)));
                    }
                }
                found.sort_unstable();
                assert_eq!(found, expected, "{count} {step}");
            }
        }
        assert!(seen > 1000 && grown > 0, "{seen} {grown}");
    }

    /// Boxes on a lattice of several sizes touch or just do not: what `f32` rounds, underflows or overflows must lose no pair.
    #[test]
    fn pairs_that_touch_or_are_as_far_apart_as_the_limit_are_found_at_every_scale() {
        let random = &mut Random::new(9);
        let mut seen = 0;
        for exponent in [-211, -149, -140, -75, -20, 0, 40, 63, 64, 100, 120] {
            let unit = 2f64.powi(exponent);
            // Ends that f32 cannot hold, some of them halfway between two that it can, and the next f64 beside them.
            let end = |random: &mut Random| {
                let third = (random.below(9) as f64 - 4.0 + 1.0 / 3.0) * unit;
                let nearest = third as f32;
                let halfway = (f64::from(nearest) + f64::from(nearest.next_up())) / 2.0;
                let end = if random.below(2) == 0 { third } else { halfway };
                [end.next_down(), end, end.next_up()][random.below(3)]
            };
            let items: Vec<Item> = (0..70)
                .map(|place| {
                    let corners = [(); 2].map(|()| [(); 3].map(|()| end(random)));
                    let lo = [0, 1, 2].map(|k| corners[0][k].min(corners[1][k]));
                    let hi = [0, 1, 2].map(|k| corners[0][k].max(corners[1][k]));
                    Item { place, bounds: WorldBox { lo, hi }, groups: Groups::ALL }
                })
                .collect();
            let mut broad = BroadPhase::default();
            items.iter().for_each(|item| broad.replace(item.place));
            broad.refresh(items.iter().copied(), items.len());
            let gap = |a: &Item, b: &Item| a.bounds.squared_gap(&b.bounds);
            let pairs =
                || items.iter().flat_map(|a| items[a.place as usize + 1..].iter().map(move |b| (a, b)));
            let gaps = || pairs().map(|(a, b)| gap(a, b)).filter(|gap| *gap > 0.0);
            let least = gaps().fold(f64::INFINITY, f64::min).sqrt();
            let any = gaps().next().unwrap_or(0.0).sqrt();
            for limit in [0.0, least.next_down(), least, least.next_up(), any, any.next_up(), unit] {
                let expected: Vec<_> = pairs()
                    .filter(|(a, b)| gap(a, b) <= limit * limit)
                    .map(|(a, b)| (a.place, b.place))
                    .collect();
                for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                    let mut found = Vec::new();
                    let visited = broad.pairs(backend, limit, &mut Budget::new(u64::MAX), |a, b, _| {
                        found.push((a.min(b), a.max(b)));
                        ControlFlow::Continue(())
                    });
                    assert_eq!(visited, Ok(ControlFlow::Continue(())));
                    found.sort_unstable();
                    assert_eq!(found, expected, "2^{exponent}, {limit:e}, {backend}");
                }
                seen += expected.len();
            }
        }
        assert!(seen > 1000, "{seen}");
    }
}
