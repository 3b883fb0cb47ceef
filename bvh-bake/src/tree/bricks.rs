//! Divides an object into bricks, which are parts of at most 2^18 triangles, and builds the tree above them.
//!
//! Trees are built within bricks and above bricks, and never mix the two. The bytes of a part of the file therefore
//! depend only on the triangles of its brick and on a few numbers from the rest. A baker can take one brick at a time,
//! whatever the size of the mesh, and get the same bytes.
//!
//! The box around the centres of all triangles' boxes is divided into a grid of 64 cells along each axis. Each cell
//! counts its centres and joins the boxes of their triangles. Planes between cells then split the grid, by the same
//! cost as all other splits, until each part has at most 2^18 triangles. A single cell that has more is divided by a
//! grid of its own. Two passes over the triangles are thus enough for any mesh that is not crowded into a few spots.

use super::Builder;
use super::binary::Tree;
use super::boxes::{Aabb, Binning, Cost};
use crate::error::BakeError;
use crate::storage::Spill;
use crate::storage::resources::Resources;
use crate::triangles::{BatchStream, Grouped, InStream, Triangle, Triangles, distribute, fold};
use wide::f32x4;

/// The number of cells of the grid along each axis.
const CELLS_PER_AXIS: usize = 64;
/// The number of levels below which splits of one grid halve the number of triangles, which bounds the tree's depth.
const MAX_COSTED_DEPTH: usize = 32;

/// The number of a brick.
pub(crate) type BrickIndex = u32;

/// A cell of the grid that contains triangles.
#[derive(Clone, Copy)]
struct Cell {
    at: [u8; 3],
    count: u32,
    bounds: Aabb,
}

/// Divides triangles into bricks. The new bricks are added to those found so far.
pub(super) struct Division<'a> {
    pub(super) builder: &'a Builder,
    pub(super) resources: &'a Resources,
    pub(super) spill: &'a Spill,
    pub(super) bricks: Vec<BatchStream>,
    /// A box of the triangles of each brick.
    pub(super) boxes: Vec<Aabb>,
}

impl Division<'_> {
    /// Divides `count` triangles, which `bounds` contains, and returns the tree above their bricks. `grid` is the grid of
    /// these triangles, which is needed only if there are more of them than fit in a brick.
    pub(super) fn divide(
        &mut self,
        triangles: &impl Triangles,
        count: u64,
        bounds: &Aabb,
        grid: Option<Grid>,
    ) -> Result<Tree<BrickIndex>, BakeError> {
        let Some(grid) = grid.filter(|_| count > self.builder.brick as u64) else {
            let mut brick = BatchStream::several(self.resources, &[count], triangles.are_exact());
            distribute(
                triangles.parts(),
                |part| Ok(Grouped::new(triangles.part(part)?, 1, |_, _| 0)),
                &mut brick,
                self.spill,
            )?;
            self.bricks.append(&mut brick);
            self.boxes.push(*bounds);
            return Ok(Tree::leaf(self.bricks.len() as u32 - 1));
        };
        let mut cells = grid.cells();
        if let [cell] = cells[..] {
            // The centres are equal, or too close to tell apart: split into halves in the order of the input.
            let [left, right] = self.halves(triangles, count)?;
            let left = self.divide_stream(left, &cell.bounds)?;
            let right = self.divide_stream(right, &cell.bounds)?;
            return Ok(Tree::above(left, right, cell.bounds));
        }
        let mut parts =
            Parts { of_cell: vec![0; CELLS_PER_AXIS.pow(3)], counts: Vec::new(), boxes: Vec::new() };
        let tree = split(&mut cells, self.builder, &mut parts, 0);
        let mut streams = BatchStream::several(self.resources, &parts.counts, triangles.are_exact());
        let make = |part: usize| {
            let group = |_: usize, triangle: &Triangle| {
                parts.of_cell[grid.cell(Aabb::of_triangle(&triangle.corners).centre())]
            };
            Ok(Grouped::new(triangles.part(part)?, parts.counts.len(), group))
        };
        distribute(triangles.parts(), make, &mut streams, self.spill)?;
        let boxes = parts.boxes;
        drop((grid, parts.of_cell));
        let mut streams = streams.into_iter().zip(&boxes);
        // The parts are numbered in the order of the tree's leaves.
        tree.replace_leaves(&mut |_| {
            let (stream, bounds) = streams.next().expect("each leaf is a part");
            self.divide_stream(stream, bounds)
        })
    }

    fn divide_stream(&mut self, stream: BatchStream, bounds: &Aabb) -> Result<Tree<BrickIndex>, BakeError> {
        if stream.count() <= self.builder.brick as u64 {
            self.bricks.push(stream);
            self.boxes.push(*bounds);
            return Ok(Tree::leaf(self.bricks.len() as u32 - 1));
        }
        let triangles = InStream::new(&stream);
        let grid = Grid::of(&triangles)?;
        self.divide(&triangles, stream.count(), bounds, Some(grid))
    }

    /// Returns the first half of the triangles, and the rest.
    fn halves(&self, triangles: &impl Triangles, count: u64) -> Result<[BatchStream; 2], BakeError> {
        let half = count / 2;
        let mut firsts = vec![0];
        for part in 0..triangles.parts() {
            let length = triangles.part(part)?.len() as u64;
            firsts.push(firsts[part] + length);
        }
        let counts = [half, count - half];
        let mut halves = BatchStream::several(self.resources, &counts, triangles.are_exact());
        let make = |part: usize| {
            let right = |place: usize, _: &Triangle| u32::from(firsts[part] + place as u64 >= half);
            Ok(Grouped::new(triangles.part(part)?, 2, right))
        };
        distribute(triangles.parts(), make, &mut halves, self.spill)?;
        let [left, right] = <[_; 2]>::try_from(halves).ok().expect("a stream for each half");
        Ok([left, right])
    }
}

/// The counts and boxes of all cells.
pub(crate) struct Grid {
    binning: Binning<CELLS_PER_AXIS>,
    counts: Vec<u32>,
    bounds: Vec<Aabb>,
}

impl Grid {
    /// Makes an empty grid over `centres`, the box of the triangles' centres, each times two.
    pub(crate) fn empty(centres: &Aabb) -> Self {
        let size = CELLS_PER_AXIS * CELLS_PER_AXIS * CELLS_PER_AXIS;
        Self { binning: Binning::new(centres), counts: vec![0; size], bounds: vec![Aabb::EMPTY; size] }
    }

    /// Adds the box of a triangle.
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

    /// Makes the grid of the given triangles.
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

    fn cell(&self, centre: f32x4) -> usize {
        let [x, y, z] = self.binning.bins(centre);
        (x * CELLS_PER_AXIS + y) * CELLS_PER_AXIS + z
    }

    /// Returns the cells that contain triangles.
    fn cells(&self) -> Vec<Cell> {
        let used = (0..self.counts.len()).filter(|&cell| self.counts[cell] > 0);
        used.map(|cell| Cell {
            at: [
                cell / (CELLS_PER_AXIS * CELLS_PER_AXIS),
                cell / CELLS_PER_AXIS % CELLS_PER_AXIS,
                cell % CELLS_PER_AXIS,
            ]
            .map(|at| at as u8),
            count: self.counts[cell],
            bounds: self.bounds[cell],
        })
        .collect()
    }
}

/// Assigns cells to parts, which are numbered from the left of the tree.
struct Parts {
    of_cell: Vec<u32>,
    counts: Vec<u64>,
    /// The box of the triangles of each part.
    boxes: Vec<Aabb>,
}

impl Parts {
    fn add(&mut self, cells: &[Cell]) -> Tree<BrickIndex> {
        let number = self.counts.len() as u32;
        for cell in cells {
            let [x, y, z] = cell.at.map(usize::from);
            self.of_cell[(x * CELLS_PER_AXIS + y) * CELLS_PER_AXIS + z] = number;
        }
        self.counts.push(cells.iter().map(|cell| u64::from(cell.count)).sum());
        let mut bounds = Aabb::EMPTY;
        cells.iter().for_each(|cell| bounds.join(&cell.bounds));
        self.boxes.push(bounds);
        Tree::leaf(number)
    }
}

/// Splits cells until each part fits in a brick or is a single cell.
fn split(cells: &mut [Cell], builder: &Builder, parts: &mut Parts, depth: usize) -> Tree<BrickIndex> {
    let count: usize = cells.iter().map(|cell| cell.count as usize).sum();
    if count <= builder.brick || cells.len() == 1 {
        return parts.add(cells);
    }
    let mut bounds = Aabb::EMPTY;
    cells.iter().for_each(|cell| bounds.join(&cell.bounds));
    let plane = if depth < MAX_COSTED_DEPTH { best_plane(cells, &bounds, builder.treelet) } else { None };
    let middle = match plane {
        Some((axis, plane)) => {
            // The sort is stable, but the order of the cells would not matter, because each has a place of its own.
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
    Tree::above(left, right, bounds)
}

/// Returns the axis and the first cell of the right side of the cheapest split that leaves cells on both sides.
fn best_plane(cells: &[Cell], parent: &Aabb, treelet: usize) -> Option<(usize, u8)> {
    let mut bins = [[(0usize, Aabb::EMPTY); CELLS_PER_AXIS]; 3];
    for cell in cells {
        for axis in 0..3 {
            let (count, bounds) = &mut bins[axis][usize::from(cell.at[axis])];
            *count += cell.count as usize;
            bounds.join(&cell.bounds);
        }
    }
    let cost = Cost::within(parent, treelet);
    let best =
        (0..3).filter_map(|axis| Builder::best_of(&bins[axis], cost).map(|(c, plane)| (c, axis, plane)));
    let least = best.reduce(|best, other| if other.0 < best.0 { other } else { best });
    least.map(|(_, axis, plane)| (axis, plane as u8))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::Progress;
    use crate::tree::Method;
    use crate::tree::binary::{Content, NodeIndex};
    use crate::triangles::{Batch, Corners};

    const BUILDER: Builder = Builder { treelet: 16, brick: 100, sweep: 64, method: Method::Coarse };

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

    fn divided(corners: &[Corners], builder: &Builder) -> (Vec<Vec<u32>>, Tree<BrickIndex>) {
        let progress = Progress::default();
        let resources = Resources::unlimited(&progress);
        let spill = resources.scratch.spill();
        let mut all = BatchStream::several(&resources, &[corners.len() as u64], false).remove(0);
        let triangles = corners.iter().zip(0..).map(|(&corners, id)| Triangle { corners, id });
        all.append(&spill, &Batch::of(triangles.collect::<Vec<_>>())).unwrap();
        all.finish(&spill).unwrap();
        let mut division =
            Division { builder, resources: &resources, spill: &spill, bricks: Vec::new(), boxes: Vec::new() };
        let bounds_of = |triangles: &mut dyn Iterator<Item = &Corners>| {
            let mut bounds = Aabb::EMPTY;
            triangles.for_each(|corners| bounds.join(&Aabb::of_triangle(corners)));
            bounds
        };
        let top = division.divide_stream(all, &bounds_of(&mut corners.iter())).unwrap();
        for (brick, bounds) in division.bricks.iter().zip(&division.boxes) {
            for part in brick.parts(1000) {
                let triangles = brick.part(&part).unwrap();
                let own = bounds_of(&mut triangles.iter().map(|triangle| &triangle.corners));
                assert!((0..3).all(|a| bounds.lo(a) <= own.lo(a) && own.hi(a) <= bounds.hi(a)));
            }
        }
        assert_eq!(division.bricks.len(), division.boxes.len());
        let bricks = division.bricks.into_iter().map(|brick| brick.take().unwrap());
        (bricks.map(|brick| brick.iter().map(|triangle| triangle.id).collect()).collect(), top)
    }

    fn leaves(tree: &Tree<BrickIndex>, node: NodeIndex, found: &mut Vec<BrickIndex>) {
        match tree.at(node).content {
            Content::Leaf(brick) => found.push(brick),
            Content::Inner(children) => {
                assert!(children.iter().all(|&child| tree.at(child).parent == node));
                children.iter().for_each(|&child| leaves(tree, child, found));
            }
        }
    }

    /// Asserts that every triangle is in exactly one brick, and that bricks are small, keep the order of the
    /// triangles and are numbered from the left. Returns the number of bricks.
    fn check(triangles: &[Corners]) -> usize {
        let (bricks, top) = divided(triangles, &BUILDER);
        let mut all = bricks.concat();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..triangles.len() as u32));
        assert!(bricks.iter().all(|brick| !brick.is_empty() && brick.len() <= BUILDER.brick));
        assert!(bricks.iter().all(|brick| brick.is_sorted()));
        let mut found = Vec::new();
        leaves(&top, top.root, &mut found);
        assert_eq!(top.leaves(), found.len());
        assert!(found.into_iter().eq(0..bricks.len() as u32));
        for threads in [1, 3] {
            let pool = cbvh_testkit::pool(threads);
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
        // All triangles are in one place, where no plane separates them.
        assert_eq!(check(&vec![small([1.0, 2.0, 3.0], 1.0); 1000]), 16);
        // Crowds within crowds: several times over, most triangles are in a single cell of the grid.
        let crowds = (0..8).flat_map(|level| spiral(300, 300f32.powi(-level)));
        check(&crowds.collect::<Vec<_>>());
        // Triangles along a line, then the same line with one triangle far away.
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
