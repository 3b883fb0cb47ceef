//! Moves subtrees of a brick's tree to the places where they enlarge the tree least.
//!
//! The cost of a tree is the sum of the sizes of its inner nodes (`Aabb::squared_girth`). To move a subtree, its
//! parent is taken out with it, and the subtree's sibling takes the parent's place. The subtree and the parent are
//! then inserted beside the node where they add least. The search for that node goes up from the old place and down
//! from each node on the way, and prunes what cannot be better than the best place so far. The method follows
//! Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of Bounding Volume Hierarchies" (2013), section 3,
//! with the search of Meister and Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization" (2018),
//! section 4. Moves are made one after the other, the largest subtrees first. Threads share the work by bricks, so
//! the tree does not depend on their number.
//!
//! Packets stay as they are. Boxes serve as well as k-DOPs here and take a third of the time.

use super::PacketTriangles;
use super::binary::{Content, NONE, NodeIndex, Tree};
use super::boxes::Aabb;

/// The most nodes that a search visits. Searches rarely reach it. It bounds the time for meshes in which every part
/// overlaps every other.
const MAX_VISITS: usize = 1024;
/// The largest subtrees are moved: one subtree in this number.
const ONE_IN: usize = 10;
/// The most levels of a tree. A deeper one cannot be used, because later stages recurse.
const MAX_DEPTH: usize = 256;
/// The least gain that is worth a move, as a fraction of the size of the subtree's parent.
const MIN_GAIN: f64 = 1e-4;

/// Moves the largest subtrees of the tree of a brick. Returns `None` if the tree has become too deep to be used.
pub(super) fn optimised(mut tree: Tree<PacketTriangles>) -> Option<Tree<PacketTriangles>> {
    // With fewer leaves there is nothing to move.
    if tree.leaves() >= 4 {
        tree.run(ONE_IN);
    }
    (tree.depth() <= MAX_DEPTH).then_some(tree)
}

impl Tree<PacketTriangles> {
    /// Returns the other child of a node's parent. The sibling of the root is the root itself.
    fn sibling(&self, index: NodeIndex) -> NodeIndex {
        let parent = self.at(index).parent;
        let children = if parent == NONE { None } else { self.children(parent) };
        children.map_or(index, |[left, right]| if left == index { right } else { left })
    }

    /// Returns the number of levels below the root.
    fn depth(&self) -> usize {
        let (mut stack, mut depth) = (vec![(self.root, 0)], 0);
        while let Some((index, level)) = stack.pop() {
            depth = depth.max(level);
            stack.extend(self.children(index).into_iter().flatten().map(|child| (child, level + 1)));
        }
        depth
    }

    /// Moves the largest subtrees, one of every `one_in`.
    fn run(&mut self, one_in: usize) {
        let mut order: Vec<(f64, NodeIndex)> =
            self.nodes.iter().zip(0..).map(|(node, index)| (node.size(), index)).collect();
        let count = order.len().div_ceil(one_in);
        let larger = |a: &(f64, NodeIndex), b: &(f64, NodeIndex)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if count < order.len() {
            order.select_nth_unstable_by(count, larger);
            order.truncate(count);
        }
        order.sort_unstable_by(larger);
        let mut stack = Vec::new();
        for (_, index) in order {
            let parent = self.at(index).parent;
            // The root and its children stay.
            if parent == NONE || self.at(parent).parent == NONE {
                continue;
            }
            if let Some(place) = self.search(index, &mut stack) {
                self.insert_beside(place, index);
            }
        }
    }

    /// Returns the node beside which the subtree at `index` is best, unless that is its present sibling.
    fn search(&self, index: NodeIndex, stack: &mut Vec<(NodeIndex, f64)>) -> Option<NodeIndex> {
        let (node, sibling) = (self.at(index), self.sibling(index));
        let (bounds, size, parent) = (node.bounds, node.size(), node.parent);
        // The cost saved so far: first the parent's size, then also the amount by which each node further up shrinks.
        let mut won = self.at(parent).size();
        let (mut best, mut place) = (won * MIN_GAIN, None);
        let (mut from, mut above, mut without) = (index, parent, Aabb::EMPTY);
        let mut visits = 0;
        while above != NONE && visits < MAX_VISITS {
            let other = self.sibling(from);
            stack.clear();
            stack.push((other, won));
            while let Some((beside, won)) = stack.pop() {
                // The new parent costs at least as much as the subtree.
                if won - size <= best || visits == MAX_VISITS {
                    continue;
                }
                visits += 1;
                let node = self.at(beside);
                let mut joined = bounds;
                joined.join(&node.bounds);
                let left = won - joined.squared_girth();
                if left > best && beside != sibling {
                    (best, place) = (left, Some(beside));
                }
                // Below this node, this node grows as much as a new parent here would.
                if let Some(children) = self.children(beside) {
                    let won = left + node.size();
                    if won - size > best {
                        stack.extend(children.map(|child| (child, won)));
                    }
                }
            }
            without.join(&self.at(other).bounds);
            if above != parent {
                won += self.at(above).size() - without.squared_girth();
            }
            (from, above) = (above, self.at(above).parent);
        }
        place
    }

    /// Moves the subtree at `index`, with its parent, beside another node.
    fn insert_beside(&mut self, place: NodeIndex, index: NodeIndex) {
        let parent = self.at(index).parent;
        let sibling = self.sibling(index);
        let above = self.at(parent).parent;
        self.replace(above, parent, sibling);
        self.refit(above);
        let above = self.at(place).parent;
        self.replace(above, place, parent);
        self.at_mut(parent).content = Content::Inner([place, index]);
        self.at_mut(place).parent = parent;
        self.refit(parent);
    }

    /// Replaces a child of `above`, or the root, by another node.
    fn replace(&mut self, above: NodeIndex, old: NodeIndex, new: NodeIndex) {
        self.at_mut(new).parent = above;
        if above == NONE {
            self.root = new;
        } else if let Content::Inner(children) = &mut self.at_mut(above).content {
            children.iter_mut().filter(|child| **child == old).for_each(|child| *child = new);
        }
    }

    /// Computes the bounds of a node and of all its ancestors from their children.
    fn refit(&mut self, mut index: NodeIndex) {
        while index != NONE
            && let Some([left, right]) = self.children(index)
        {
            let mut bounds = self.at(left).bounds;
            bounds.join(&self.at(right).bounds);
            let node = self.at_mut(index);
            node.bounds = bounds;
            index = node.parent;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::binary::TreeNode;
    use crate::tree::{Builder, Method};
    use crate::triangles::{Corners, Triangle};
    use cbvh_testkit::Random;

    /// Makes long thin triangles in all directions, some of them far out.
    fn sticks(count: usize) -> Vec<Corners> {
        let mut random = Random::new(1);
        let mut random = || random.unit() as f32;
        let mut stick = || {
            let from = [random(), random(), random()].map(|v| v * 10.0);
            let to = [0, 1, 2].map(|axis| from[axis] + random() * random());
            [from, to, [from[0] + 0.01, from[1], from[2]]]
        };
        (0..count).map(|_| stick()).collect()
    }

    fn cost(tree: &Tree<PacketTriangles>) -> f64 {
        tree.nodes.iter().filter(|node| matches!(node.content, Content::Inner(_))).map(TreeNode::size).sum()
    }

    fn packets(tree: &Tree<PacketTriangles>) -> Vec<Vec<u32>> {
        let packet = |node: &TreeNode<PacketTriangles>| match node.content {
            Content::Leaf(packet) => Some(packet.numbers().to_vec()),
            Content::Inner(_) => None,
        };
        let mut packets: Vec<_> = tree.nodes.iter().filter_map(packet).collect();
        packets.sort();
        packets
    }

    /// Asserts that each node has the right parent and that its size is that of its children's box. Returns the
    /// number of nodes.
    fn check(tree: &Tree<PacketTriangles>, index: NodeIndex, parent: NodeIndex) -> usize {
        let node = tree.at(index);
        assert_eq!(node.parent, parent);
        let Content::Inner([left, right]) = node.content else { return 1 };
        let mut bounds = tree.at(left).bounds;
        bounds.join(&tree.at(right).bounds);
        assert_eq!(bounds.squared_girth(), node.size());
        check(tree, left, index) + check(tree, right, index) + 1
    }

    #[test]
    fn passes_lower_the_cost_and_keep_all_packets() {
        for triangles in [sticks(3000), sticks(30), vec![[[1.0, 2.0, 3.0]; 3]; 500]] {
            let triangles: Vec<Triangle> =
                triangles.into_iter().zip(0..).map(|(corners, id)| Triangle { corners, id }).collect();
            let mut tree = Builder::new(4, Method::Coarse).tree(&triangles);
            let kept = packets(&tree);
            for one_in in [10, 1, 1] {
                let before = cost(&tree);
                tree.run(one_in);
                assert_eq!(check(&tree, tree.root, NONE), tree.nodes.len());
                assert!(cost(&tree) <= before, "{} > {before}", cost(&tree));
                assert_eq!(packets(&tree), kept);
                assert!(tree.depth() < MAX_DEPTH);
            }
        }
    }
}
