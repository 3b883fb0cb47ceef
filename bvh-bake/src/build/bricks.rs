//! Divides an object into bricks, parts of at most 2^18 triangles, and builds the tree above them.
//!
//! Trees are built within a brick and above the bricks, never across: what a part of the file looks like depends
//! on the triangles of its brick and on few figures of the rest. A baker can thus take one brick at a time,
//! whatever the size of the mesh, and get the same bytes.
//!
//! The centres of all boxes are counted into a grid of 64 cells along each axis of the box around them, each
//! cell with the box of its triangles. Planes between cells then split it, by the cost of all other splits,
//! until a part has no more than 2^18 triangles. A single cell that has more is divided by a grid of its own.
//! Two passes over the triangles thus do for any mesh that is not crowded into a few spots.

use super::boxes::{Aabb, Binning, Cost};
use super::{Builder, Node};
use crate::ablation::SplitRule;
use crate::error::BakeError;
use crate::means::Means;
use crate::progress::Tally;
use crate::scratch::{Spill, Stream};
use crate::soup::{Grouped, InStream, Triangle, Triangles, distribute, fold};

/// Cells of the grid along an axis.
const CELLS: usize = 64;
/// Beyond this many splits of one grid they halve the number of triangles, which bounds the tree's depth.
const MAX_COSTED_DEPTH: usize = 32;

/// A brick, by number.
pub(super) type BrickIndex = u32;

/// A cell of the grid that has triangles.
#[derive(Clone, Copy)]
struct Cell {
    at: [u8; 3],
    count: u32,
    bounds: Aabb,
}

/// Divides triangles, adding to the bricks found so far; returns the tree above those added.
pub(super) struct Division<'a> {
    pub(super) builder: &'a Builder,
    pub(super) means: &'a Means,
    pub(super) spill: &'a Spill,
    /// Over the triangles, once; those that are divided again count no more.
    pub(super) tally: &'a Tally<'a>,
    pub(super) bricks: Vec<Stream<Triangle>>,
}

impl Division<'_> {
    /// Divides `count` triangles. `grid` is theirs, if there are more than a brick has.
    pub(super) fn divide(
        &mut self,
        triangles: &impl Triangles,
        count: u64,
        grid: Option<Grid>,
    ) -> Result<Node<BrickIndex>, BakeError> {
        let Some(grid) = grid.filter(|_| count > self.builder.brick as u64) else {
            let mut brick = self.means.streams(&[count]);
            distribute(
                triangles.parts(),
                |part| Ok(Grouped::new(&triangles.part(part)?, 1, |_, _| 0)),
                &mut brick,
                self.spill,
                self.tally,
            )?;
            self.bricks.append(&mut brick);
            return Ok(Node::Leaf(self.bricks.len() as u32 - 1));
        };
        let mut cells = grid.cells();
        if let [cell] = cells[..] {
            // Equal centres, or too close to tell apart: halves in the order of the input.
            let mut halves = self.halves(triangles, count)?.into_iter();
            let mut next = || self.divide_stream(halves.next());
            let (left, right) = (next()?, next()?);
            return Ok(Node::above(left, right, cell.bounds.squared_girth()));
        }
        let mut parts = Parts { of_cell: vec![0; CELLS * CELLS * CELLS], counts: Vec::new() };
        let tree = split(&mut cells, self.builder, &mut parts, 0);
        let mut streams = self.means.streams(&parts.counts);
        let make = |part: usize| {
            let group = |_: usize, triangle: &Triangle| {
                parts.of_cell[grid.cell(Aabb::of_triangle(&triangle.corners).centre())]
            };
            Ok(Grouped::new(&triangles.part(part)?, parts.counts.len(), group))
        };
        distribute(triangles.parts(), make, &mut streams, self.spill, self.tally)?;
        drop((grid, parts));
        let mut streams = streams.into_iter();
        // In the order in which the parts were numbered.
        tree.replace_leaves(&mut |_| self.divide_stream(streams.next()))
    }

    fn divide_stream(&mut self, stream: Option<Stream<Triangle>>) -> Result<Node<BrickIndex>, BakeError> {
        let stream = stream.unwrap_or_else(|| Stream::of_pieces(1));
        if stream.count() <= self.builder.brick as u64 {
            self.bricks.push(stream);
            return Ok(Node::Leaf(self.bricks.len() as u32 - 1));
        }
        let triangles = InStream::new(&stream);
        let grid = Grid::of(&triangles)?;
        self.divide(&triangles, stream.count(), Some(grid))
    }

    /// The first half of the triangles and the rest.
    fn halves(&self, triangles: &impl Triangles, count: u64) -> Result<Vec<Stream<Triangle>>, BakeError> {
        let half = count / 2;
        let mut firsts = vec![0];
        for part in 0..triangles.parts() {
            let length = triangles.part(part)?.len() as u64;
            firsts.push(firsts[part] + length);
        }
        let mut halves = self.means.streams(&[half, count - half]);
        let make = |part: usize| {
            let right = |place: usize, _: &Triangle| u32::from(firsts[part] + place as u64 >= half);
            Ok(Grouped::new(&triangles.part(part)?, 2, right))
        };
        distribute(triangles.parts(), make, &mut halves, self.spill, self.tally)?;
        Ok(halves)
    }
}

/// Counts and boxes of all cells.
pub(crate) struct Grid {
    binning: Binning<CELLS>,
    counts: Vec<u32>,
    bounds: Vec<Aabb>,
}

impl Grid {
    /// An empty grid over the box of all triangles' centres, twice as large.
    pub(crate) fn empty(centres: &Aabb) -> Self {
        let size = CELLS * CELLS * CELLS;
        Self { binning: Binning::new(centres), counts: vec![0; size], bounds: vec![Aabb::EMPTY; size] }
    }

    /// Adds a triangle's box.
    #[inline]
    pub(crate) fn add(&mut self, bounds: &Aabb) {
        let cell = self.cell(bounds.centre());
        self.counts[cell] += 1;
        self.bounds[cell].join(bounds);
    }

    /// Adds the cells of another grid over the same box.
    pub(crate) fn merged(mut self, other: &Self) -> Self {
        self.counts.iter_mut().zip(&other.counts).for_each(|(a, b)| *a += b);
        self.bounds.iter_mut().zip(&other.bounds).for_each(|(a, b)| a.join(b));
        self
    }

    /// The grid of some triangles.
    fn of(triangles: &impl Triangles) -> Result<Self, BakeError> {
        let join_centres = |centres: &mut Aabb, part: usize| {
            for triangle in triangles.part(part)?.iter() {
                centres.join(&Aabb::of_point(Aabb::of_triangle(&triangle.corners).centre()));
            }
            Ok(())
        };
        let mut centres = Aabb::EMPTY;
        fold(triangles.parts(), || Aabb::EMPTY, join_centres)?.iter().for_each(|some| centres.join(some));
        let count = |grid: &mut Self, part: usize| {
            let triangles = triangles.part(part)?;
            triangles.iter().for_each(|triangle| grid.add(&Aabb::of_triangle(&triangle.corners)));
            Ok(())
        };
        let grids = fold(triangles.parts(), || Self::empty(&centres), count)?;
        Ok(grids.into_iter().reduce(|a, b| a.merged(&b)).unwrap_or_else(|| Self::empty(&centres)))
    }

    fn cell(&self, centre: [f32; 4]) -> usize {
        let [x, y, z, _] = self.binning.bins(centre);
        (x * CELLS + y) * CELLS + z
    }

    /// The cells that have triangles.
    fn cells(&self) -> Vec<Cell> {
        let used = (0..self.counts.len()).filter(|&cell| self.counts[cell] > 0);
        used.map(|cell| Cell {
            at: [cell / (CELLS * CELLS), cell / CELLS % CELLS, cell % CELLS].map(|at| at as u8),
            count: self.counts[cell],
            bounds: self.bounds[cell],
        })
        .collect()
    }
}

/// Which cells make which part, parts numbered from the left of the tree.
struct Parts {
    of_cell: Vec<u32>,
    counts: Vec<u64>,
}

impl Parts {
    fn add(&mut self, cells: &[Cell]) -> Node<BrickIndex> {
        let number = self.counts.len() as u32;
        for cell in cells {
            let [x, y, z] = cell.at.map(usize::from);
            self.of_cell[(x * CELLS + y) * CELLS + z] = number;
        }
        self.counts.push(cells.iter().map(|cell| u64::from(cell.count)).sum());
        Node::Leaf(number)
    }
}

/// Splits cells until each part is a brick or a single cell.
fn split(cells: &mut [Cell], builder: &Builder, parts: &mut Parts, depth: usize) -> Node<BrickIndex> {
    let count: usize = cells.iter().map(|cell| cell.count as usize).sum();
    if count <= builder.brick || cells.len() == 1 {
        return parts.add(cells);
    }
    let mut bounds = Aabb::EMPTY;
    cells.iter().for_each(|cell| bounds.join(&cell.bounds));
    let plane = if depth < MAX_COSTED_DEPTH { best_plane(cells, &bounds, builder.splits) } else { None };
    let middle = match plane {
        Some((axis, plane)) => {
            // Stable, though cells have no order that matters: their places are unique.
            cells.sort_by_key(|cell| cell.at[axis] >= plane);
            cells.partition_point(|cell| cell.at[axis] < plane)
        }
        None => {
            cells.sort_unstable_by_key(|cell| cell.at);
            let mut left = 0;
            let before = cells.iter().take_while(|cell| {
                left += cell.count as usize;
                left <= count / 2
            });
            before.count().clamp(1, cells.len() - 1)
        }
    };
    let (left, right) = cells.split_at_mut(middle);
    let left = split(left, builder, parts, depth + 1);
    let right = split(right, builder, parts, depth + 1);
    Node::above(left, right, bounds.squared_girth())
}

/// The axis and first cell of the right side of the cheapest split that leaves something on both sides.
fn best_plane(cells: &[Cell], parent: &Aabb, splits: SplitRule) -> Option<(usize, u8)> {
    let mut bins = [[(0usize, Aabb::EMPTY); CELLS]; 3];
    for cell in cells {
        for axis in 0..3 {
            let (count, bounds) = &mut bins[axis][usize::from(cell.at[axis])];
            *count += cell.count as usize;
            bounds.join(&cell.bounds);
        }
    }
    let cost = Cost::within(parent, splits);
    let best =
        (0..3).filter_map(|axis| Builder::best_of(&bins[axis], cost).map(|(c, plane)| (c, axis, plane)));
    let least = best.reduce(|best, other| if other.0 < best.0 { other } else { best });
    least.map(|(_, axis, plane)| (axis, plane as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::{Progress, Step};
    use crate::soup::Corners;

    const BUILDER: Builder =
        Builder { treelet: 16, brick: 100, sweep: 64, passes: &[], splits: SplitRule::Reach };

    fn small(at: [f32; 3], size: f32) -> Corners {
        let [x, y, z] = at;
        [[x, y, z], [x + size, y, z], [x, y + size, z + size]]
    }

    fn spiral(count: u32, scale: f32) -> Vec<Corners> {
        let at = |i: u32| {
            let angle = f64::from(i) * 0.1;
            let radius = scale * i as f32 / count as f32;
            [radius * angle.cos() as f32, radius * angle.sin() as f32, radius]
        };
        (0..count).map(|i| small(at(i), scale * 1e-3)).collect()
    }

    fn divided(triangles: &[Corners], builder: &Builder) -> (Vec<Vec<u32>>, Node<BrickIndex>) {
        let progress = Progress::default();
        let means = Means::unlimited(&progress);
        let tally = progress.tally(Step::Read, 0, 0, 0);
        let spill = means.scratch.spill();
        let mut all = Stream::of_pieces(1000);
        let triangles = triangles.iter().zip(0..).map(|(&corners, id)| Triangle { corners, id });
        all.append(&spill, &triangles.collect::<Vec<_>>()).unwrap();
        all.finish(&spill).unwrap();
        let mut division =
            Division { builder, means: &means, spill: &spill, tally: &tally, bricks: Vec::new() };
        let top = division.divide_stream(Some(all)).unwrap();
        let bricks = division.bricks.into_iter().map(|brick| brick.take().unwrap());
        (bricks.map(|brick| brick.iter().map(|triangle| triangle.id).collect()).collect(), top)
    }

    fn leaves(node: &Node<BrickIndex>, found: &mut Vec<BrickIndex>) {
        match node {
            Node::Leaf(brick) => found.push(*brick),
            Node::Inner(inner) => {
                assert_eq!(inner.leaves, inner.left.leaves() + inner.right.leaves());
                leaves(&inner.left, found);
                leaves(&inner.right, found);
            }
        }
    }

    /// Every triangle is in one brick, bricks are small, keep the order and are numbered from the left.
    fn check(triangles: &[Corners]) -> usize {
        let (bricks, top) = divided(triangles, &BUILDER);
        let mut all = bricks.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..triangles.len() as u32));
        assert!(bricks.iter().all(|brick| !brick.is_empty() && brick.len() <= BUILDER.brick));
        assert!(bricks.iter().all(|brick| brick.is_sorted()));
        let mut found = Vec::new();
        leaves(&top, &mut found);
        assert!(found.into_iter().eq(0..bricks.len() as u32));
        for threads in [1, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| divided(triangles, &BUILDER)).0, bricks, "{threads} threads");
        }
        bricks.len()
    }

    #[test]
    fn meshes_of_all_kinds_are_divided() {
        assert_eq!(check(&spiral(100, 1.0)), 1);
        let bricks = check(&spiral(5000, 1.0));
        assert!((50..200).contains(&bricks), "{bricks}");
        check(&spiral(5000, 1e-40));
        check(&spiral(5000, 1e36));
        // All in one place: no plane tells them apart.
        assert_eq!(check(&vec![small([1.0, 2.0, 3.0], 1.0); 1000]), 16);
        // Crowds in crowds: most triangles are in a single cell of a grid, several times over.
        let crowds = (0..8).flat_map(|level| spiral(300, 300f32.powi(-level)));
        check(&crowds.collect::<Vec<_>>());
        // Along a line, and along one with a far end.
        let mut line: Vec<Corners> = (0..3000).map(|i| small([i as f32, 0.0, 0.0], 0.5)).collect();
        check(&line);
        line.push(small([1e30, 0.0, 0.0], 1.0));
        check(&line);
    }

    #[test]
    fn neighbours_share_bricks() {
        let grid: Vec<Corners> =
            (0..1600).map(|i| small([(i % 40) as f32, (i / 40) as f32, 0.0], 0.1)).collect();
        let (bricks, _) = divided(&grid, &BUILDER);
        let area = |brick: &Vec<u32>| {
            let extent = |of: fn(u32) -> u32| {
                let values = brick.iter().map(|&i| of(i));
                values.clone().max().unwrap() - values.min().unwrap() + 1
            };
            extent(|i| i % 40) * extent(|i| i / 40)
        };
        let total: u32 = bricks.iter().map(area).sum();
        assert_eq!(total, 1600, "bricks overlap");
    }
}
