//! Takes the solids of an STL file, counting the distinct vertices of each.

use super::Gatherer;
use crate::io::{Fault, Halt, Place, stl};
use crate::mesh::MAX_VERTICES;
use crate::scratch::Spill;
use crate::sorter::Sorter;
use xxhash_rust::xxh3::xxh3_64;

/// Gives solids to a gatherer.
pub(super) struct Solids<'a, 'b> {
    gatherer: &'a mut Gatherer<'b>,
    object: usize,
    vertices: Positions,
}

impl<'a, 'b> Solids<'a, 'b> {
    pub(super) fn new(gatherer: &'a mut Gatherer<'b>) -> Self {
        let vertices = Positions::new(gatherer);
        Self { gatherer, object: 0, vertices }
    }
}

impl stl::Solids for Solids<'_, '_> {
    fn begin(&mut self, name: String, _: usize) -> Result<(), Halt> {
        self.object = self.gatherer.object(name);
        Ok(())
    }

    fn triangle(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Halt> {
        self.gatherer.add(self.object, corners)?;
        if !self.gatherer.counts_vertices() {
            return Ok(());
        }
        corners.into_iter().try_for_each(|corner| self.vertices.add(corner))
    }

    fn end(&mut self) -> Result<(), Halt> {
        let fresh = Positions::new(self.gatherer);
        let count = std::mem::replace(&mut self.vertices, fresh).count()?;
        if count > MAX_VERTICES {
            return Err(Fault::Limit { place: Place::File, most: MAX_VERTICES, what: "vertices" }.into());
        }
        self.gatherer.add_vertices(self.object, count);
        Ok(())
    }
}

/// Counts distinct positions: those that are `f32` numbers and others are sorted apart. Most repetitions come soon
/// after each other, and are not even sorted.
struct Positions {
    narrow: Sorter<[u32; 3]>,
    wide: Sorter<[u64; 3]>,
    /// Positions seen of late, in places that depend on their hashes.
    recent: Vec<[u64; 3]>,
    spill: Spill,
}

/// Positions that are remembered.
const RECENT: usize = 1 << 16;
/// No position: a NaN.
const NONE: [u64; 3] = [u64::MAX; 3];

impl Positions {
    fn new(gatherer: &Gatherer) -> Self {
        let means = gatherer.means;
        Self {
            narrow: Sorter::of_runs(means.sorted_at_once::<[u32; 3]>(u64::MAX)),
            wide: Sorter::of_runs(means.sorted_at_once::<[u64; 3]>(u64::MAX)),
            recent: Vec::new(),
            spill: means.scratch.spill(),
        }
    }

    fn add(&mut self, position: [f64; 3]) -> Result<(), Halt> {
        if self.recent.is_empty() {
            self.recent.resize(RECENT, NONE);
        }
        // -0.0 and 0.0 are one.
        let position = position.map(|value| value + 0.0);
        let bits = position.map(f64::to_bits);
        let place = xxh3_64(bytemuck::bytes_of(&bits)) as usize % RECENT;
        if self.recent[place] == bits {
            return Ok(());
        }
        self.recent[place] = bits;
        let narrow = position.map(|value| value as f32);
        if narrow.map(f64::from) == position {
            self.narrow.extend(&[narrow.map(f32::to_bits)], &self.spill)?;
        } else {
            self.wide.extend(&[bits], &self.spill)?;
        }
        Ok(())
    }

    fn count(self) -> Result<u64, Halt> {
        Ok(distinct(self.narrow)? + distinct(self.wide)?)
    }
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
