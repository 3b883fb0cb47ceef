//! Collects the nets of the triangles of an object that have duplicates.

use super::edge::{Edge, End};
use crate::error::BakeError;
use crate::storage::Spill;
use crate::storage::external_sort::Sorter;
use crate::storage::resources::Resources;

/// The bits of the filter, which is indexed by the last bits of ids.
const FILTER_BITS: usize = 1 << 23;
/// The share of a buffer that each of the sorters takes.
const SORTERS_PER_BUFFER: usize = 4;
/// The part of edges that belong to no part.
pub(super) const NO_PART: u32 = u32::MAX;
/// The greatest magnitude of a net.
pub(crate) const MAX_NET: i64 = i32::MAX as i64 - 1;

/// The nets of an object that are not 1.
pub(crate) struct Nets {
    /// Pairs of an id and a net.
    pub(super) of_ids: Sorter<[u32; 2]>,
    /// The edges of the triangles with nets, counted as often as the net exceeds 1, and later those of bricks.
    pub(super) edges: Sorter<Edge>,
    /// Has a bit set for each id with a net, and for some others; empty if there are no nets.
    filter: Vec<u64>,
}

/// Returns how many records a sorter of edges or nets sorts at once.
pub(super) fn run<T>(resources: &Resources) -> usize {
    resources.sorted_at_once::<T>(u64::MAX) / SORTERS_PER_BUFFER
}

impl Nets {
    pub(crate) fn new(resources: &Resources) -> Self {
        let (of_ids, edges) = (Sorter::of_runs(run::<[u32; 2]>(resources)), run::<Edge>(resources));
        Self { of_ids, edges: Sorter::of_runs(edges), filter: Vec::new() }
    }

    /// Adds the net of a triangle, which is not 1, and whose corners have these bits.
    pub(crate) fn add(
        &mut self,
        id: u32,
        net: i32,
        [a, b, c]: [End; 3],
        spill: &Spill,
    ) -> Result<(), BakeError> {
        self.filter.resize(FILTER_BITS / 64, 0);
        self.filter[word(id)] |= bit(id);
        self.of_ids.extend(&[[id, net as u32]], spill)?;
        for ends in [[a, b], [b, c], [c, a]] {
            if ends[0] != ends[1] {
                self.edges.extend(&[Edge { ends, count: net - 1, of: NO_PART }.sorted()], spill)?;
            }
        }
        Ok(())
    }

    /// Returns whether there are nets at all.
    pub(super) fn any(&self) -> bool {
        !self.filter.is_empty()
    }

    /// Returns whether a triangle may have a net: true for all that have one.
    pub(super) fn may_have(&self, id: u32) -> bool {
        self.filter.get(word(id)).is_some_and(|word| word & bit(id) != 0)
    }
}

fn word(id: u32) -> usize {
    id as usize % FILTER_BITS / 64
}

fn bit(id: u32) -> u64 {
    1 << (id % 64)
}
