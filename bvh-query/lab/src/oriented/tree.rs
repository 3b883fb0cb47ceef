//! The tree of a file in memory, without its bounds: children, triangles, and where pages begin.

use super::vector::Vector;
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::treelet::Child;
use bvh_query::Bvh;

/// A tree. Children have higher numbers than their parents; node 0 is the root.
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// The object's origin, mesh units.
    pub(super) origin: Vector,
    /// The corners of all triangles around the origin. Those below one node follow each other.
    corners: Vec<[Vector; 3]>,
}

/// A node: a treelet, or a leaf packet if it has triangles.
#[derive(Clone)]
pub(super) struct Node {
    /// The treelet that holds the node; the root for the root.
    pub(super) parent: u32,
    pub(super) children: Vec<u32>,
    /// The number of triangles of a leaf packet; 0 for a treelet.
    pub(super) triangles: u32,
    /// The triangles below: the place of the first one, and their number.
    first: u32,
    pub(super) below: u32,
    /// True for roots of subtrees of pages, which have anchors.
    pub(super) is_anchor: bool,
    /// The largest side of the box around the triangles, along the axes of the object, mesh units.
    pub(super) extent: f64,
}

impl Tree {
    /// Reads the tree of a file's first object, whose pages have been checked.
    pub(super) fn of_file(bvh: &Bvh) -> Option<Self> {
        let object = bvh.objects().first()?;
        let (layout, bytes, profile) = (bvh.layout(), bvh.bytes(), object.profile());
        let page = |number: u32| Some(Page::new(layout.page_bytes(bytes, number)?, profile));
        let first = object.record().first_page.get();
        let empty = Node {
            parent: 0,
            children: Vec::new(),
            triangles: 0,
            first: 0,
            below: 0,
            is_anchor: false,
            extent: 0.0,
        };
        let root = Node { is_anchor: true, ..empty.clone() };
        let mut tree = Self { nodes: vec![root], origin: object.origin(), corners: Vec::new() };
        // Treelets to read: node, page and slot. A treelet's own packets are read first, and then one of its subtrees
        // after the other, so that the triangles below a node follow each other.
        let mut stack = vec![(0, first, 0)];
        while let Some((node, number, slot)) = stack.pop() {
            tree.nodes[node].first = tree.corners.len() as u32;
            let here = page(number)?;
            let links = here.links(slot);
            for child in 0..links.children() {
                let place = tree.nodes.len();
                let mut found = Node { parent: node as u32, ..empty.clone() };
                match links.child(child) {
                    Child::Empty => continue,
                    Child::Treelet(slot) => stack.push((place, number, slot)),
                    Child::Remote(link) => {
                        let to = here.remote(link);
                        found.is_anchor = true;
                        stack.push((place, to.page(), to.root()));
                    }
                    Child::Leaf { packet, triangles } => {
                        let block = layout.leaf_block(bytes, here.header());
                        let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                        found.triangles = triangles.into();
                        found.below = found.triangles;
                        found.first = tree.corners.len() as u32;
                        let corners = (0..usize::from(triangles)).map(|lane| values.triangle(lane));
                        tree.corners.extend(corners.map(|t| t.map(|p| p.map(f64::from))));
                    }
                }
                tree.nodes.push(found);
                tree.nodes[node].children.push(place as u32);
            }
        }
        for number in (0..tree.nodes.len()).rev() {
            let below = tree.nodes[number].children.iter().map(|&child| tree.nodes[child as usize].below);
            let below = tree.nodes[number].below + below.sum::<u32>();
            tree.nodes[number].below = below;
            let corners = || tree.corners_below(&tree.nodes[number]).as_flattened().iter();
            let side = |axis: usize| {
                let most = corners().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max);
                most - corners().map(|p| p[axis]).fold(f64::INFINITY, f64::min)
            };
            tree.nodes[number].extent = (0..3).map(side).fold(0.0, f64::max);
        }
        Some(tree)
    }

    /// Returns the corners of the triangles below a node, around the origin.
    pub(super) fn corners_below(&self, node: &Node) -> &[[Vector; 3]] {
        &self.corners[node.first as usize..][..node.below as usize]
    }

    /// The number of treelets.
    pub(super) fn treelets(&self) -> usize {
        self.nodes.iter().filter(|node| node.triangles == 0).count()
    }

    /// The number of treelets that have an anchor.
    pub(super) fn anchors(&self) -> usize {
        self.nodes.iter().filter(|node| node.is_anchor).count()
    }
}
