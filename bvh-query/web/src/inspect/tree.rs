//! Visits all nodes of a shape with their levels, page by page.
//!
//! Links lead only to later pages, so that one pass is enough. It keeps the levels of roots whose pages come later.

use bvh_format::object::Object;
use bvh_format::page::decode::decode_page;
use bvh_format::page::{Page, RootRef, check_page};
use bvh_format::slabs::NodeSlabs;
use bvh_format::treelet::Child;
use bvh_format::turning::{TurningSlab, decode_turning};
use bvh_format::{FormatError, Rule};
use bvh_query::{Bvh, Shape};
use std::collections::HashMap;

/// A node: a child of a treelet.
pub(super) struct Node<'a> {
    /// The number of the object.
    pub(super) object: usize,
    /// The page of the treelet.
    pub(super) page: &'a Page<'a>,
    /// How many links lead from the root to the node; 1 for the children of the root.
    pub(super) level: usize,
    pub(super) child: Child,
    pub(super) slabs: &'a NodeSlabs,
    pub(super) turning: Option<TurningSlab>,
}

impl Node<'_> {
    /// The page and the slot of the treelet that the node is, or the page and the number of the packet.
    pub(super) fn place(&self) -> (u32, u16) {
        let page = self.page.header().page_number.get();
        match self.child {
            Child::Treelet(slot) => (page, slot.into()),
            Child::Remote(link) => {
                let to = self.page.remote(link);
                (to.page(), to.root().into())
            }
            Child::Leaf { packet, .. } => (page, packet),
            Child::Empty => (page, 0),
        }
    }

    /// The triangles of the node, if it is a leaf packet.
    pub(super) fn triangles(&self) -> Option<u8> {
        match self.child {
            Child::Leaf { triangles, .. } => Some(triangles),
            _ => None,
        }
    }
}

/// Reads a page and checks it.
pub(super) fn page<'a>(bvh: &'a Bvh, object: &Object, number: u32) -> Result<Page<'a>, FormatError> {
    let (layout, at) = (bvh.layout(), bvh.layout().page_offset(number));
    let bytes = layout.page_bytes(bvh.bytes(), number);
    let bytes = bytes.ok_or_else(|| FormatError::new(Rule::ObjectPages, at, "a page", "none"))?;
    check_page(bytes, number, object, at)?;
    Ok(Page::new(bytes, object.profile()))
}

/// Visits all nodes but the roots of objects. `treelet` is called with the object and the level of each treelet.
pub(super) fn visit(
    shape: Shape<'_>,
    mut treelet: impl FnMut(usize, usize),
    mut node: impl FnMut(&Node<'_>),
) -> Result<(), FormatError> {
    let bvh = shape.bvh();
    for (number, object) in shape.object_numbers().zip(shape.objects()) {
        // By page and root.
        let mut ahead: HashMap<(u32, u8), usize> = HashMap::new();
        for page_number in object.pages() {
            let page = page(bvh, object, page_number)?;
            let header = page.header();
            let mut levels: Vec<usize> = (0..header.treelets)
                .map(|slot| ahead.remove(&(page_number, slot)).unwrap_or_default())
                .collect();
            let mut seen = None;
            decode_page(&page, object.f16_scale(), |slot, place, _, slabs| {
                let level = levels[usize::from(slot)];
                if seen != Some(slot) {
                    treelet(number, level);
                    seen = Some(slot);
                }
                let child = page.links(slot).child(place);
                let turning = decode_turning(object.profile(), page.treelet(slot), place, slabs);
                match child {
                    Child::Treelet(inner) => levels[usize::from(inner)] = level + 1,
                    Child::Remote(link) => {
                        let to: RootRef = page.remote(link);
                        ahead.insert((to.page(), to.root()), level + 1);
                    }
                    Child::Leaf { .. } | Child::Empty => {}
                }
                node(&Node { object: number, page: &page, level: level + 1, child, slabs, turning });
                Ok::<_, FormatError>(())
            })?;
        }
    }
    Ok(())
}
