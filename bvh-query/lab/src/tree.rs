//! The tree of a file in memory: each node has the bound that a query decodes, the tight one, and its children.

use bvh_format::decode::decode_child;
use bvh_format::kdop::{DirectionSet, Kdop};
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::Child;
use bvh_query::Bvh;

/// A tree of bounds. Children have higher numbers than their parents; node 0 is the root.
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) set: DirectionSet,
    /// The object's origin, mesh units.
    pub(crate) origin: [f64; 3],
}

/// A node: a treelet, or a leaf if it has triangles.
pub(crate) struct Node {
    /// The bound that a query decodes.
    pub(crate) bound: Kdop,
    /// The least bound that contains the triangles below.
    pub(crate) tight: Kdop,
    pub(crate) children: Vec<u32>,
    /// Triangles of a leaf, 0 for a treelet.
    pub(crate) triangles: u32,
}

impl Tree {
    /// Reads the tree of a file's first object. The file has been proved.
    pub(crate) fn of_file(bvh: &Bvh) -> Option<Self> {
        let object = bvh.objects().first()?;
        let (layout, bytes, profile) = (bvh.layout(), bvh.bytes(), object.profile());
        let slabs = profile.directions().slabs();
        let page = |number: u32| Some(Page::new(layout.page_bytes(bytes, number)?, profile));
        let first = object.record().first_page.get();
        let root = page(first)?.anchor_slabs(0);
        let mut tree = Self { nodes: Vec::new(), set: profile.directions(), origin: object.origin() };
        let inner = |slabs_of: &NodeSlabs| Node {
            bound: slabs_of.to_kdop(slabs),
            tight: Kdop::EMPTY,
            children: Vec::new(),
            triangles: 0,
        };
        tree.nodes.push(inner(&root));
        // Treelets to read: node, page, slot, decoded slabs.
        let mut stack = vec![(0, first, 0, root)];
        while let Some((node, number, slot, decoded)) = stack.pop() {
            let page_here = page(number)?;
            let treelet = page_here.treelet(slot);
            let links = page_here.links(slot);
            for child in 0..links.children() {
                let slabs_of = decode_child(profile, object.f16_scale(), treelet, child, &decoded);
                let place = tree.nodes.len();
                match links.child(child) {
                    Child::Empty => continue,
                    Child::Treelet(slot) => stack.push((place, number, slot, slabs_of)),
                    Child::Remote(link) => {
                        let to = page_here.remote(link);
                        // As in a query, the anchor replaces the decoded slabs from here on.
                        let anchor = page(to.page())?.anchor_slabs(to.root());
                        stack.push((place, to.page(), to.root(), anchor));
                    }
                    Child::Leaf { .. } => {}
                }
                let mut found = inner(&slabs_of);
                if let Child::Leaf { packet, triangles } = links.child(child) {
                    let block = layout.leaf_block(bytes, page_here.header());
                    let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                    let corners = (0..usize::from(triangles)).map(|lane| values.triangle(lane));
                    found.tight = Kdop::of_points(corners.flatten());
                    found.triangles = triangles.into();
                }
                tree.nodes.push(found);
                tree.nodes[node].children.push(place as u32);
            }
        }
        tree.sum_up();
        Some(tree)
    }

    /// Finds the tight bounds of treelets from those of leaves.
    fn sum_up(&mut self) {
        let slabs = self.set.slabs();
        for number in (0..self.nodes.len()).rev() {
            let mut tight = self.nodes[number].tight;
            for &child in &self.nodes[number].children {
                tight.join(&self.nodes[child as usize].tight, slabs);
            }
            self.nodes[number].tight = tight;
        }
    }
}
