//! Divides the vertices of an object into cells, so that each cell can be searched by itself.
//!
//! Cells are cubes of at least four times the distance. A vertex belongs to the cell in which it lies, and is listed in all cells
//! from which it may be within reach: most often in one, at most in eight. The list of a cell thus has all that decides where its
//! own vertices go.
//!
//! A list that exceeds the memory for it, which takes very many vertices within a few times the distance, is cut. Each piece of it
//! is then searched for the vertices of each piece.

use super::first::{Reach, Tree, Vertex};
use super::{Bits, Record};
use crate::error::BakeError;
use crate::storage::external_sort::Sorter;
use crate::storage::{Piece, Spill};
use crate::threads;
use crate::triangles::placement::Extent;
use std::borrow::Cow;

/// The vertices per cell of a surface that fills its box evenly.
const VERTICES_PER_CELL: f64 = 512.0;
/// The most cells along an axis. Three numbers of cells fit into 64 bits.
const MAX_CELLS: u64 = 1 << 20;
/// A bound of what rounding adds to a distance in [`Reach`]: a few times 2^-53 of it.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

/// Bytes of memory per record while a cell is searched: the record, its vertex in the tree, and its share of the nodes.
pub(super) const BYTES_PER_USE: usize = 128;
/// The most uses in the lists that are searched side by side.
const USES_PER_BATCH: usize = 1 << 17;
/// The vertices for which a thread searches at a time.
const VERTICES_PER_TASK: usize = 1 << 10;

/// The division of an object's box.
pub(super) struct Cells {
    lo: [f64; 3],
    side: f64,
    /// A distance that no vertex within reach exceeds along an axis.
    reach: f64,
}

impl Cells {
    /// Divides the box of an object of at most `triangles` triangles. The distance is above 0.
    pub(super) fn new(extent: &Extent, distance: f64, triangles: u64) -> Self {
        // Most meshes have half as many vertices as triangles.
        let along = (triangles as f64 / 2.0 / VERTICES_PER_CELL).sqrt().ceil().clamp(1.0, MAX_CELLS as f64);
        let side = (extent.diagonal() / along).max(4.0 * distance);
        Self { lo: extent.lo, side, reach: distance * ROUNDED_UP }
    }

    /// Returns the cell along an axis. A larger coordinate never has a smaller cell, because no operation here, though each
    /// rounds, changes the order of two values.
    fn along(&self, axis: usize, coordinate: f64) -> u64 {
        (((coordinate - self.lo[axis]) / self.side) as u64).min(MAX_CELLS)
    }

    /// Lists the vertices of a part in their cells.
    pub(super) fn list(&self, vertices: &[(Bits, u64)]) -> Vec<Record> {
        let mut uses = Vec::with_capacity(vertices.len());
        for &(position, corner) in vertices {
            let [x, y, z] = [0, 1, 2].map(|axis| {
                let coordinate = f64::from_bits(position[axis]);
                self.along(axis, coordinate - self.reach)..=self.along(axis, coordinate + self.reach)
            });
            for (x, y) in x.flat_map(|x| y.clone().map(move |y| (x, y))) {
                uses.extend(z.clone().map(|z| Record { key: number([x, y, z]), position, corner }));
            }
        }
        uses
    }

    /// Returns whether a listed vertex lies in the cell itself.
    fn is_own(&self, listed: &Record) -> bool {
        let at = [0, 1, 2].map(|axis| self.along(axis, f64::from_bits(listed.position[axis])));
        number(at) == listed.key
    }

    /// Passes the move of each vertex that moves to `moves`, once for each part that uses it. At most `most` records of a list are in
    /// memory.
    pub(super) fn first_vertices(
        &self,
        uses: Sorter<Record>,
        reach: &Reach,
        most: usize,
        spill: &Spill,
        moves: &mut Sorter<Record>,
    ) -> Result<(), BakeError> {
        let (mut lists, mut waiting, mut open) = (Vec::new(), 0, List::default());
        let uses = uses.finish();
        let mut merge = uses.merge();
        loop {
            let next = merge.next()?;
            if open.last.last().is_some_and(|last| next.is_none_or(|next| next.key != last.key)) {
                let list = std::mem::take(&mut open);
                for piece in 1..list.pieces() {
                    moves.extend(&self.search(&list, piece, reach)?, spill)?;
                }
                waiting += list.last.len();
                lists.push(list);
            }
            if next.is_none() || waiting >= most.min(USES_PER_BATCH) {
                spill.go_on()?;
                let found = threads::map(std::mem::take(&mut lists), |list| self.search(&list, 0, reach));
                found.into_iter().try_for_each(|found| moves.extend(&found?, spill))?;
                waiting = 0;
            }
            let Some(next) = next else { return Ok(()) };
            if open.last.len() == most {
                open.full.push(spill.put(std::mem::take(&mut open.last))?);
            }
            open.last.push(next);
        }
    }

    /// Finds the moves of the vertices that lie in the cell of a list, for the uses in a piece of it.
    fn search(&self, list: &List, piece: usize, reach: &Reach) -> Result<Vec<Record>, BakeError> {
        let own = list.piece(piece)?;
        let goal = |uses| Goal { uses, best: vertex(uses) };
        let mut goals: Vec<Goal> = vertices(&own).filter(|uses| self.is_own(&uses[0])).map(goal).collect();
        for other in 0..list.pieces() {
            let tree = Tree::new(vertices(&list.piece(other)?).map(vertex).collect());
            threads::map(goals.chunks_mut(VERTICES_PER_TASK), |goals| {
                for goal in goals {
                    goal.best = tree.first(&vertex(goal.uses).position, reach, goal.best);
                }
            });
        }
        let mut moves = Vec::new();
        for Goal { uses, best } in goals {
            let to = best.position.map(f64::to_bits);
            if to != uses[0].position {
                moves.extend(uses.iter().map(|of| Record {
                    key: of.corner,
                    position: to,
                    corner: of.corner,
                }));
            }
        }
        Ok(moves)
    }
}

/// A vertex, by its uses in a piece of a list, and the first vertex in reach of it that has been found so far.
struct Goal<'a> {
    uses: &'a [Record],
    best: Vertex,
}

/// The list of a cell, in pieces.
#[derive(Default)]
struct List {
    full: Vec<Piece<Record>>,
    last: Vec<Record>,
}

impl List {
    fn pieces(&self) -> usize {
        self.full.len() + 1
    }

    fn piece(&self, number: usize) -> Result<Cow<'_, [Record]>, BakeError> {
        self.full.get(number).map_or(Ok(Cow::Borrowed(&self.last)), Piece::all)
    }
}

fn number([x, y, z]: [u64; 3]) -> u64 {
    x << 42 | y << 21 | z
}

/// Returns the uses of each distinct vertex of a piece. If a vertex occurs in two pieces of a list, its number is larger in the
/// second one, so that it finds itself in the first.
fn vertices(piece: &[Record]) -> impl Iterator<Item = &[Record]> {
    piece.chunk_by(|a, b| a.position == b.position)
}

fn vertex(uses: &[Record]) -> Vertex {
    Vertex::new(uses[0].corner, uses[0].position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::Scratch;
    use cbvh_testkit::Random;

    /// Lists of any length, in memory and in files, give what a comparison of all vertices gives.
    #[test]
    fn pieces_of_lists_give_the_moves_of_whole_lists() {
        let directory = cbvh_testkit::folder();
        let mut random = Random::new(3);
        for case in 0..30 {
            let count = 40 * (case + 1);
            let lattice = |random: &mut Random| random.below(12) as f64 - 6.0;
            let anywhere = |random: &mut Random| 6.0 * random.signed();
            let coordinate = if case % 2 == 0 { lattice } else { anywhere };
            let vertices: Vec<(Bits, u64)> = (0..count)
                .map(|corner| ([(); 3].map(|()| (coordinate(&mut random) + 0.0).to_bits()), corner))
                .collect();
            let mut extent = Extent::EMPTY;
            vertices.iter().for_each(|(position, _)| extent.add(&position.map(f64::from_bits)));
            for distance in [0.5, 1.0, 1.5, 4.0] {
                let mut expected = Vec::new();
                for &(position, corner) in &vertices {
                    let near = |other: &&(Bits, u64)| {
                        let squared =
                            |axis| (f64::from_bits(other.0[axis]) - f64::from_bits(position[axis])).powi(2);
                        squared(0) + squared(1) + squared(2) <= distance * distance
                    };
                    let to = vertices.iter().find(near).unwrap().0;
                    expected.extend((to != position).then_some(Record { key: corner, position: to, corner }));
                }
                for (most, allowance) in [(1, 0), (7, 0), (100, 1 << 12), (usize::MAX, u64::MAX)] {
                    let scratch = Scratch::in_directory(directory.path(), allowance, &Default::default());
                    let spill = scratch.spill();
                    // More triangles make smaller cells.
                    let cells = Cells::new(&extent, distance, if case % 3 == 0 { 1 << 20 } else { 1 });
                    let mut uses = Sorter::of_runs(most);
                    uses.extend(&cells.list(&vertices), &spill).unwrap();
                    let mut moves = Sorter::of_runs(most);
                    cells.first_vertices(uses, &Reach::new(distance), most, &spill, &mut moves).unwrap();
                    let mut found = Vec::new();
                    moves
                        .visit(|next| {
                            found.push(*next);
                            Ok(())
                        })
                        .unwrap();
                    assert!(found == expected, "case {case}, distance {distance}, {most} records at once");
                }
            }
        }
    }
}
