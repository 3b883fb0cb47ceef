//! Puts planned pages into another order, for measurements.
//!
//! Pages hold several subtrees and so may have several parents. Each counts as the child of the page that links
//! to its first root; the tree this gives is laid out as wished, and then pages are taken in that order, but
//! each only after all pages that link to it.

use crate::ablation::PageOrder;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// Puts pages into the order wished for; returns their numbers. The first stays the root's. For each page `links` has
/// the page and the root that each of its links leads to.
pub(crate) fn arrange(links: &[Vec<(usize, u8)>], order: PageOrder) -> Vec<usize> {
    let tree = PageTree::new(links);
    let wished = match order {
        PageOrder::Levels => return (0..links.len()).collect(),
        PageOrder::DepthFirst => tree.depth_first(),
        PageOrder::BreadthFirst => tree.breadth_first(),
        PageOrder::VanEmdeBoas => tree.van_emde_boas(),
    };
    tree.parents_first(&wished)
}

struct PageTree {
    /// Pages that a page links to, by link; some several times.
    links: Vec<Vec<usize>>,
    /// Pages that count as a page's children.
    children: Vec<Vec<usize>>,
}

impl PageTree {
    fn new(links: &[Vec<(usize, u8)>]) -> Self {
        let first = |links: &Vec<(usize, u8)>| {
            links.iter().filter(|(_, root)| *root == 0).map(|(page, _)| *page).collect()
        };
        let pages = |links: &Vec<(usize, u8)>| links.iter().map(|(page, _)| *page).collect();
        Self { links: links.iter().map(pages).collect(), children: links.iter().map(first).collect() }
    }

    fn depth_first(&self) -> Vec<usize> {
        let (mut order, mut stack) = (Vec::new(), vec![0]);
        while let Some(page) = stack.pop() {
            order.push(page);
            stack.extend(self.children[page].iter().rev());
        }
        order
    }

    fn breadth_first(&self) -> Vec<usize> {
        let (mut order, mut queue) = (Vec::new(), VecDeque::from([0]));
        while let Some(page) = queue.pop_front() {
            order.push(page);
            queue.extend(&self.children[page]);
        }
        order
    }

    fn van_emde_boas(&self) -> Vec<usize> {
        let mut heights = vec![1; self.children.len()];
        for &page in self.breadth_first().iter().rev() {
            let below = self.children[page].iter().map(|&child| heights[child]).max();
            heights[page] = 1 + below.unwrap_or(0);
        }
        let mut order = Vec::new();
        self.lay_out(0, heights[0], &heights, &mut order);
        order
    }

    /// Lays out so many levels from `root` on; returns the pages below them. Halves the levels each time it
    /// calls itself.
    fn lay_out(&self, root: usize, levels: usize, heights: &[usize], order: &mut Vec<usize>) -> Vec<usize> {
        let levels = levels.min(heights[root]);
        if levels <= 1 {
            order.push(root);
            return self.children[root].clone();
        }
        let upper = levels / 2;
        let middle = self.lay_out(root, upper, heights, order);
        middle.into_iter().flat_map(|page| self.lay_out(page, levels - upper, heights, order)).collect()
    }

    /// The wished order, but with each page after all that link to it.
    fn parents_first(&self, wished: &[usize]) -> Vec<usize> {
        let mut rank = vec![0; wished.len()];
        wished.iter().enumerate().for_each(|(place, &page)| rank[page] = place);
        let mut missing = vec![0; wished.len()];
        self.links.iter().flatten().for_each(|&page| missing[page] += 1);
        let (mut order, mut ready) = (Vec::new(), BinaryHeap::from([Reverse((0, 0))]));
        while let Some(Reverse((_, page))) = ready.pop() {
            order.push(page);
            for &next in &self.links[page] {
                missing[next] -= 1;
                if missing[next] == 0 {
                    ready.push(Reverse((rank[next], next)));
                }
            }
        }
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fifteen pages, a complete binary tree numbered breadth-first.
    fn complete() -> PageTree {
        let children = |page: usize| if page < 7 { vec![2 * page + 1, 2 * page + 2] } else { Vec::new() };
        let children: Vec<_> = (0..15).map(children).collect();
        PageTree { links: children.clone(), children }
    }

    #[test]
    fn a_complete_tree_is_laid_out_as_the_textbook_has_it() {
        let tree = complete();
        assert_eq!(tree.van_emde_boas(), [0, 1, 2, 3, 7, 8, 4, 9, 10, 5, 11, 12, 6, 13, 14]);
        assert_eq!(tree.depth_first(), [0, 1, 3, 7, 8, 4, 9, 10, 2, 5, 11, 12, 6, 13, 14]);
        assert!(tree.breadth_first().into_iter().eq(0..15));
        for wished in [tree.van_emde_boas(), tree.depth_first()] {
            assert_eq!(tree.parents_first(&wished), wished);
        }
    }

    #[test]
    fn a_page_waits_for_all_that_link_to_it() {
        let mut tree = complete();
        // Page 3 has a subtree below page 2, too.
        tree.links[2].push(3);
        let order = tree.parents_first(&tree.depth_first());
        let place = |page| order.iter().position(|&at| at == page);
        assert!(place(3) > place(2) && order.len() == 15);
    }
}
