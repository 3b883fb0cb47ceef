//! Moves subtrees of a brick's tree to where they enlarge it least.
//!
//! The cost of a tree is the sum of its inner nodes' sizes (`Aabb::squared_girth`). A subtree is taken out, and with it
//! its parent, which leaves its place to the other child; then it goes beside the node where it adds least. The
//! search for that node goes up from the old place and down from there, and cuts off what cannot be better
//! than the best so far. After Bittner, Hapala and Havran, "Fast Insertion-Based Optimization of Bounding Volume
//! Hierarchies" (2013), section 3, with the search of Meister and Bittner, "Parallel Reinsertion for Bounding
//! Volume Hierarchy Optimization" (2018), section 4. Moves are made one after the other, the largest subtrees
//! first: threads have bricks to share, and the tree does not depend on them.
//!
//! Packets stay as they are. Boxes serve as well as k-DOPs here and take a third of the time.

use super::boxes::{Aabb, Reference};
use super::{Node, PacketTriangles};
use crate::soup::Triangle;

/// Nodes looked at for one subtree, at most; hardly any search comes near. It bounds the time for meshes of which
/// every part overlaps every other.
const MOST_VISITS: usize = 1024;
/// A tree that would be deeper is left as it was: the stages behind recurse.
const MOST_DEPTH: usize = 256;
/// Gains of less than this part of the place's own cost are not worth a move.
const LEAST_GAIN: f64 = 1e-4;

/// One run through the tree.
#[derive(Clone, Copy)]
pub(super) struct Pass {
    /// Of so many subtrees one is tried, the largest.
    pub(super) one_in: usize,
}

type Index = u32;

const NONE: Index = Index::MAX;

/// Makes moves in the tree of a brick.
pub(super) fn optimise(
    node: Node<PacketTriangles>,
    passes: &[Pass],
    triangles: &[Triangle],
) -> Node<PacketTriangles> {
    if passes.is_empty() || node.leaves() < 4 {
        return node;
    }
    let mut tree = Tree { nodes: Vec::with_capacity(2 * node.leaves() - 1), root: 0 };
    tree.add(node, NONE, triangles);
    for pass in passes {
        let before = tree.clone();
        tree.run(*pass);
        if tree.depth() > MOST_DEPTH {
            tree = before;
            break;
        }
    }
    tree.node(tree.root)
}

#[derive(Clone)]
struct Tree {
    nodes: Vec<Flat>,
    root: Index,
}

/// A node of a tree in an array.
#[derive(Clone)]
struct Flat {
    bounds: Aabb,
    size: f64,
    parent: Index,
    content: Content,
}

#[derive(Clone, Copy)]
enum Content {
    Packet(PacketTriangles),
    Inner([Index; 2]),
}

impl Tree {
    /// Adds a node and all below it, parents first.
    fn add(&mut self, node: Node<PacketTriangles>, parent: Index, triangles: &[Triangle]) -> Index {
        let index = self.nodes.len() as Index;
        match node {
            Node::Leaf(packet) => {
                let mut bounds = Aabb::EMPTY;
                for &number in packet.numbers() {
                    bounds.join(&Reference::new(number, &triangles[number as usize].corners).aabb());
                }
                let content = Content::Packet(packet);
                self.nodes.push(Flat { bounds, size: bounds.squared_girth(), parent, content });
            }
            Node::Inner(inner) => {
                let content = Content::Inner([NONE; 2]);
                self.nodes.push(Flat { bounds: Aabb::EMPTY, size: inner.size, parent, content });
                let left = self.add(inner.left, index, triangles);
                let right = self.add(inner.right, index, triangles);
                let mut bounds = self.at(left).bounds;
                bounds.join(&self.at(right).bounds);
                let flat = self.at_mut(index);
                (flat.bounds, flat.content) = (bounds, Content::Inner([left, right]));
            }
        }
        index
    }

    /// The tree below an index.
    fn node(&self, index: Index) -> Node<PacketTriangles> {
        let flat = self.at(index);
        match flat.content {
            Content::Packet(packet) => Node::Leaf(packet),
            Content::Inner([left, right]) => Node::above(self.node(left), self.node(right), flat.size),
        }
    }

    fn at(&self, index: Index) -> &Flat {
        &self.nodes[index as usize]
    }

    fn at_mut(&mut self, index: Index) -> &mut Flat {
        &mut self.nodes[index as usize]
    }

    fn children(&self, index: Index) -> Option<[Index; 2]> {
        match self.at(index).content {
            Content::Packet(_) => None,
            Content::Inner(children) => Some(children),
        }
    }

    /// The other child of a node's parent; of the root, itself.
    fn sibling(&self, index: Index) -> Index {
        let parent = self.at(index).parent;
        let children = if parent == NONE { None } else { self.children(parent) };
        children.map_or(index, |[left, right]| if left == index { right } else { left })
    }

    /// Levels below the root.
    fn depth(&self) -> usize {
        let (mut stack, mut depth) = (vec![(self.root, 0)], 0);
        while let Some((index, level)) = stack.pop() {
            depth = depth.max(level);
            stack.extend(self.children(index).into_iter().flatten().map(|child| (child, level + 1)));
        }
        depth
    }

    fn run(&mut self, pass: Pass) {
        let mut order: Vec<(f64, Index)> =
            self.nodes.iter().zip(0..).map(|(flat, index)| (flat.size, index)).collect();
        let count = order.len().div_ceil(pass.one_in);
        let larger = |a: &(f64, Index), b: &(f64, Index)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
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

    /// The node beside which the subtree at `index` is best, if that is another than now.
    fn search(&self, index: Index, stack: &mut Vec<(Index, f64)>) -> Option<Index> {
        let Flat { bounds, size, parent, .. } = *self.at(index);
        let sibling = self.sibling(index);
        // What is won so far: first the parent's cost, then of each node further up by how much it shrinks.
        let mut won = self.at(parent).size;
        let (mut best, mut place) = (won * LEAST_GAIN, None);
        let (mut from, mut above, mut without) = (index, parent, Aabb::EMPTY);
        let mut visits = 0;
        while above != NONE && visits < MOST_VISITS {
            let other = self.sibling(from);
            stack.clear();
            stack.push((other, won));
            while let Some((beside, won)) = stack.pop() {
                // The new parent costs at least as much as the subtree.
                if won - size <= best || visits == MOST_VISITS {
                    continue;
                }
                visits += 1;
                let flat = self.at(beside);
                let mut joined = bounds;
                joined.join(&flat.bounds);
                let left = won - joined.squared_girth();
                if left > best && beside != sibling {
                    (best, place) = (left, Some(beside));
                }
                // Further down this node grows as it would here.
                if let Some(children) = self.children(beside) {
                    let won = left + flat.size;
                    if won - size > best {
                        stack.extend(children.map(|child| (child, won)));
                    }
                }
            }
            without.join(&self.at(other).bounds);
            if above != parent {
                won += self.at(above).size - without.squared_girth();
            }
            (from, above) = (above, self.at(above).parent);
        }
        place
    }

    /// Moves the subtree at `index`, with its parent, beside another node.
    fn insert_beside(&mut self, place: Index, index: Index) {
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

    /// Puts a node in the place of a child of `above`, or of the root.
    fn replace(&mut self, above: Index, old: Index, new: Index) {
        self.at_mut(new).parent = above;
        if above == NONE {
            self.root = new;
        } else if let Content::Inner(children) = &mut self.at_mut(above).content {
            children.iter_mut().filter(|child| **child == old).for_each(|child| *child = new);
        }
    }

    /// Takes the bounds of a node and of those above it from their children.
    fn refit(&mut self, mut index: Index) {
        while index != NONE
            && let Some([left, right]) = self.children(index)
        {
            let mut bounds = self.at(left).bounds;
            bounds.join(&self.at(right).bounds);
            let flat = self.at_mut(index);
            (flat.bounds, flat.size) = (bounds, bounds.squared_girth());
            index = flat.parent;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ablation::SplitRule;
    use crate::build::Builder;
    use crate::options::Effort;
    use crate::soup::Corners;

    /// Long thin triangles in all directions, some far out.
    fn sticks(count: usize) -> Vec<Corners> {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1 << 24) as f32
        };
        let mut stick = || {
            let from = [random(), random(), random()].map(|v| v * 10.0);
            let to = [0, 1, 2].map(|axis| from[axis] + random() * random());
            [from, to, [from[0] + 0.01, from[1], from[2]]]
        };
        (0..count).map(|_| stick()).collect()
    }

    fn cost(tree: &Tree) -> f64 {
        tree.nodes.iter().filter(|flat| matches!(flat.content, Content::Inner(_))).map(|flat| flat.size).sum()
    }

    fn packets(tree: &Tree) -> Vec<Vec<u32>> {
        let packet = |flat: &Flat| match flat.content {
            Content::Packet(packet) => Some(packet.numbers().to_vec()),
            Content::Inner(_) => None,
        };
        let mut packets: Vec<_> = tree.nodes.iter().filter_map(packet).collect();
        packets.sort();
        packets
    }

    /// Each node is named by its parent, and bounds are those of the children.
    fn check(tree: &Tree, index: Index, parent: Index) -> usize {
        let flat = tree.at(index);
        assert_eq!(flat.parent, parent);
        let Content::Inner([left, right]) = flat.content else { return 1 };
        let mut bounds = tree.at(left).bounds;
        bounds.join(&tree.at(right).bounds);
        assert_eq!(bounds.squared_girth(), flat.size);
        check(tree, left, index) + check(tree, right, index) + 1
    }

    #[test]
    fn passes_lower_the_cost_and_keep_all_packets() {
        for triangles in [sticks(3000), sticks(30), vec![[[1.0, 2.0, 3.0]; 3]; 500]] {
            let triangles: Vec<Triangle> =
                triangles.into_iter().zip(0..).map(|(corners, id)| Triangle { corners, id }).collect();
            let built = Builder::new(4, Effort::Fast, SplitRule::Reach).tree(&triangles);
            let mut flat = Tree { nodes: Vec::new(), root: 0 };
            flat.add(built, NONE, &triangles);
            let kept = packets(&flat);
            for one_in in [10, 1, 1] {
                let before = cost(&flat);
                flat.run(Pass { one_in });
                assert_eq!(check(&flat, flat.root, NONE), flat.nodes.len());
                assert!(cost(&flat) <= before, "{} > {before}", cost(&flat));
                assert_eq!(packets(&flat), kept);
                assert!(flat.depth() < MOST_DEPTH);
            }
        }
    }
}
