//! Records what the walks of two trees meet, for tools that show the work of a query. Needs the feature `__trace`.
//!
//! Nodes are numbered as the walk numbers them: `Step::Objects` gives the number of the node that has an object's root as its only
//! child, and `Step::Opened` that of each opened node, until the next `Step::Objects`. The pages of the file tell what the
//! children of a node are.

use crate::file::place::LeafPacket;
use crate::traverse::placement::ObjectPair;
use std::cell::RefCell;

/// What a walk does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Starts to walk two objects.
    Objects {
        /// Their first pages in the files of A and B.
        pages: [u32; 2],
        /// The nodes above their roots.
        above: [u32; 2],
    },
    /// Opens a node.
    Opened {
        /// 0 for A, 1 for B.
        side: u8,
        /// The number of the node's parent.
        parent: u32,
        /// Which child of the parent it is.
        child: u8,
        /// The number of the node.
        node: u32,
    },
    /// Tests two leaf packets, of A and of B: the page of each, and its number in the page.
    Packets([(u32, u16); 2]),
}

thread_local! {
    /// The most steps, and those so far, while a question is recorded.
    static STEPS: RefCell<Option<(usize, Vec<Step>)>> = const { RefCell::new(None) };
}

/// Runs a query on this thread, and returns the answer with the first `most` steps of its walks.
pub fn record<T>(most: usize, ask: impl FnOnce() -> T) -> (T, Vec<Step>) {
    STEPS.set(Some((most, Vec::new())));
    let answer = ask();
    (answer, STEPS.take().map(|(_, steps)| steps).unwrap_or_default())
}

fn add(step: Step) {
    STEPS.with_borrow_mut(|recorded| {
        if let Some((most, steps)) = recorded
            && steps.len() < *most
        {
            steps.push(step);
        }
    });
}

pub(super) fn objects(pair: &ObjectPair<'_>, above: [usize; 2]) {
    let pages = [pair.object_a, pair.object_b].map(|object| object.record().first_page.get());
    add(Step::Objects { pages, above: above.map(|node| node as u32) });
}

pub(super) fn opened(side: u8, (parent, child): (usize, usize), node: usize) {
    add(Step::Opened { side, parent: parent as u32, child: child as u8, node: node as u32 });
}

pub(super) fn packets((a, b): (LeafPacket, LeafPacket)) {
    add(Step::Packets([a, b].map(|leaf| (leaf.page, leaf.packet))));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bvh, Pose, Querier};

    #[test]
    fn steps_lead_from_both_roots_to_the_packets_tested() {
        let bytes = include_bytes!("../../../testdata/ok-everything.cbvh");
        let bvh = Bvh::from_static(bytes).unwrap();
        let mut querier = Querier::new().unwrap();
        let mut ask = || querier.contacts(&bvh, &bvh, &Pose::IDENTITY).map(|found| found.len());
        let (found, steps) = record(1000, &mut ask);
        let found = found.unwrap();
        let mut opened = [Vec::new(), Vec::new()];
        let mut packets = 0;
        for step in &steps {
            match *step {
                Step::Objects { pages, above } => {
                    assert!(pages.into_iter().all(|page| page < bvh.layout().page_count()));
                    opened = above.map(|node| vec![node]);
                }
                Step::Opened { side, parent, node, .. } => {
                    let known = &mut opened[usize::from(side)];
                    assert!(known.contains(&parent), "{step:?}");
                    known.push(node);
                }
                Step::Packets(_) => packets += 1,
            }
        }
        assert!(matches!(steps[0], Step::Objects { .. }));
        assert!(packets > 0 && found > 0);
        // Outside of `record`, nothing is kept; and no more than asked for.
        assert_eq!(ask().unwrap(), found);
        assert_eq!(record(2, &mut ask).1, steps[..2]);
    }
}
