//! What a question about two meshes visits: which treelets it opens, and which packets it tests.

use crate::answers::{floats, ids};
use crate::arguments::{Answer, pose, refused, with_querier, wrong};
use crate::mesh::Mesh;
use bvh_format::object::Object;
use bvh_format::page::Page;
use bvh_format::treelet::Child;
use bvh_query::Bvh;
use bvh_query::trace::{Step, record};
use js_sys::{Array, Float64Array};
use std::collections::BTreeMap;
use wasm_bindgen::prelude::*;

/// The most steps that are recorded: 84 MB of them.
const MAX_STEPS: usize = 1 << 22;

/// How often something was met, by page, and slot or packet.
type Counts = BTreeMap<(u32, u16), u32>;

/// What was met of one mesh.
struct Side<'a> {
    bvh: &'a Bvh,
    /// The object that is walked.
    object: Option<&'a Object>,
    /// What is above the root of the object.
    above: u32,
    /// The page and the slot of each opened node.
    nodes: Vec<Option<(u32, u8)>>,
    opened: Counts,
    tested: Counts,
}

impl Side<'_> {
    fn start(&mut self, first_page: u32, above: u32) {
        let objects = self.bvh.objects();
        let place = objects.binary_search_by_key(&first_page, |object| object.pages().start);
        self.object = place.ok().and_then(|place| objects.get(place));
        self.above = above;
        self.nodes.clear();
    }

    fn open(&mut self, parent: u32, child: u8, node: u32) -> Option<()> {
        let object = self.object?;
        let at = if parent == self.above {
            (object.pages().start, 0)
        } else {
            let (number, slot) = (*self.nodes.get(parent as usize)?)?;
            // The query has checked the page.
            let page = Page::new(self.bvh.layout().page_bytes(self.bvh.bytes(), number)?, object.profile());
            match page.links(slot).child(child.into()) {
                Child::Treelet(slot) => (number, slot),
                Child::Remote(link) => (page.remote(link).page(), page.remote(link).root()),
                Child::Leaf { .. } | Child::Empty => return None,
            }
        };
        if self.nodes.len() <= node as usize {
            self.nodes.resize(node as usize + 1, None);
        }
        self.nodes[node as usize] = Some(at);
        *self.opened.entry((at.0, at.1.into())).or_default() += 1;
        Some(())
    }

    /// Page, slot or packet, and count, one after the other, of the treelets and of the packets.
    fn rows(&self) -> JsValue {
        let rows = |of: &Counts| ids(of.iter().flat_map(|(&(page, at), &count)| [page, at.into(), count]));
        [rows(&self.opened), rows(&self.tested)].into_iter().collect::<Array>().into()
    }
}

/// Asks a question, `distance`, `collide` or `contacts`. Returns the numbers of node tests, packet tests, exact tests and recorded
/// steps, and what was met of A and of B.
#[wasm_bindgen]
pub fn visits(a: &Mesh, b: &Mesh, pose_of_b: &Float64Array, question: &str) -> Answer<Array> {
    let (of_b, shapes) = (pose(pose_of_b, "pose")?, [a, b].map(|mesh| mesh.shape.shape()));
    let [in_a, in_b] = shapes;
    let (asked, steps) = record(MAX_STEPS, || {
        with_querier(|querier| {
            match question {
                "distance" => querier.distance(in_a, in_b, &of_b).map(|_| ()),
                "collide" => querier.collide(in_a, in_b, &of_b).map(|_| ()),
                "contacts" => querier.contacts(in_a, in_b, &of_b).map(|_| ()),
                _ => return Err(wrong("question", "expected distance, collide or contacts")),
            }
            .map_err(refused)?;
            Ok(querier.stats())
        })
    });
    let stats = asked?;
    let mut sides = shapes.map(|shape| Side {
        bvh: shape.bvh(),
        object: None,
        above: 0,
        nodes: Vec::new(),
        opened: Counts::new(),
        tested: Counts::new(),
    });
    for step in &steps {
        match *step {
            Step::Objects { pages, above } => {
                for (side, (page, above)) in sides.iter_mut().zip(pages.into_iter().zip(above)) {
                    side.start(page, above);
                }
            }
            Step::Opened { side, parent, child, node } => {
                let _ = sides[usize::from(side & 1)].open(parent, child, node);
            }
            Step::Packets(of) => {
                for (side, at) in sides.iter_mut().zip(of) {
                    *side.tested.entry(at).or_default() += 1;
                }
            }
        }
    }
    let [of_a, of_b] = sides.map(|side| side.rows());
    let numbers = [stats.node_tests, stats.packet_tests, stats.exact_tests, steps.len() as u64];
    Ok([floats(numbers.into_iter().map(|number| number as f64)), of_a, of_b].into_iter().collect())
}
