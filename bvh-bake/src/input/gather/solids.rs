//! Gathers the solids of an STL file, and counts the distinct vertices of each.

use super::Gatherer;
use crate::error::{BakeError, Fault, Halt, Place};
use crate::input::stl;
use crate::limits::MAX_VERTICES;
use crate::storage::Spill;
use crate::storage::external_sort::Sorter;
use crate::threads;
use xxhash_rust::xxh3::xxh3_64;

/// Passes solids to a gatherer.
pub(super) struct SolidsForBake<'a, 'b> {
    gatherer: &'a mut Gatherer<'b>,
    object: usize,
    vertices: PositionCounter,
}

impl<'a, 'b> SolidsForBake<'a, 'b> {
    pub(super) fn new(gatherer: &'a mut Gatherer<'b>) -> Self {
        let vertices = PositionCounter::new(gatherer);
        Self { gatherer, object: 0, vertices }
    }
}

impl stl::Solids for SolidsForBake<'_, '_> {
    fn begin(&mut self, name: String, _: usize) -> Result<(), Halt> {
        self.object = self.gatherer.object(name)?;
        Ok(())
    }

    fn triangles(
        &mut self,
        count: usize,
        corners_of: impl Fn(usize) -> [[f64; 3]; 3] + Sync,
    ) -> Result<(), Halt> {
        let Self { gatherer, object, vertices } = self;
        if gatherer.counts_vertices() {
            vertices.add(count, &corners_of)?;
        }
        gatherer.add_triangles(*object, count, corners_of)
    }

    fn end(&mut self) -> Result<(), Halt> {
        let fresh = PositionCounter::new(self.gatherer);
        let count = std::mem::replace(&mut self.vertices, fresh).count()?;
        if count > MAX_VERTICES {
            return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" }.into());
        }
        self.gatherer.add_vertices(self.object, count);
        Ok(())
    }
}

/// Counts distinct positions. Positions of `f32` numbers and other positions are sorted separately. Most repetitions
/// follow soon after each other and are dropped before sorting.
struct PositionCounter {
    narrow: Sorter<[u32; 3]>,
    wide: Sorter<[u64; 3]>,
    spill: Spill,
}

/// The number of triangles whose positions one thread processes at a time.
const TASK_TRIANGLES: usize = 1 << 14;
/// The number of positions that a thread remembers.
const RECENT_POSITIONS: usize = 1 << 14;
/// Stands for no position: a NaN.
const NONE: [u64; 3] = [u64::MAX; 3];

impl PositionCounter {
    fn new(gatherer: &Gatherer) -> Self {
        let resources = gatherer.resources;
        Self {
            narrow: Sorter::of_runs(resources.sorted_at_once::<[u32; 3]>(u64::MAX)),
            wide: Sorter::of_runs(resources.sorted_at_once::<[u64; 3]>(u64::MAX)),
            spill: resources.scratch.spill(),
        }
    }

    /// Adds the corners of triangles.
    fn add(
        &mut self,
        count: usize,
        corners_of: &(impl Fn(usize) -> [[f64; 3]; 3] + Sync),
    ) -> Result<(), BakeError> {
        let of_task = |start: usize| {
            let triangles = start..(start + TASK_TRIANGLES).min(count);
            distinct_of_late(triangles.flat_map(corners_of))
        };
        for (narrow, wide) in threads::map((0..count).step_by(TASK_TRIANGLES), of_task) {
            self.narrow.extend(&narrow, &self.spill)?;
            self.wide.extend(&wide, &self.spill)?;
        }
        Ok(())
    }

    fn count(self) -> Result<u64, Halt> {
        Ok(distinct(self.narrow)? + distinct(self.wide)?)
    }
}

/// Distinct positions: those of `f32` numbers, and the others.
type Distinct = (Vec<[u32; 3]>, Vec<[u64; 3]>);

/// Returns positions without most of their repetitions: those of `f32` numbers, and the others.
fn distinct_of_late(positions: impl Iterator<Item = [f64; 3]>) -> Distinct {
    let (mut narrow, mut wide) = (Vec::new(), Vec::new());
    // Recent positions, at places that depend on their hashes.
    let mut recent = vec![NONE; RECENT_POSITIONS];
    for position in positions {
        // -0.0 and 0.0 are the same position.
        let position = position.map(|value| value + 0.0);
        let bits = position.map(f64::to_bits);
        let place = xxh3_64(bytemuck::bytes_of(&bits)) as usize % RECENT_POSITIONS;
        if recent[place] == bits {
            continue;
        }
        recent[place] = bits;
        let rounded = position.map(|value| value as f32);
        if rounded.map(f64::from) == position {
            narrow.push(rounded.map(f32::to_bits));
        } else {
            wide.push(bits);
        }
    }
    (narrow, wide)
}

fn distinct<T: bytemuck::Pod + Ord + Send + Sync>(records: Sorter<T>) -> Result<u64, Halt> {
    let (mut count, mut last) = (0, None);
    records.visit(|record| {
        count += u64::from(last != Some(*record));
        last = Some(*record);
        Ok(())
    })?;
    Ok(count)
}
