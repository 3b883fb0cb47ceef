//! Builds binary trees over triangle boxes: one in each brick, and one above the bricks.
//!
//! Planes between the cells of a grid divide the triangles into bricks. Within a brick, bins find the splits down to a
//! few dozen triangles; below that, all positions along all three axes are tried. All three use one cost
//! (`boxes::Cost`). Last, subtrees of a brick move to where they enlarge the tree least (`reinsert`).
//!
//! The result does not depend on the order in which threads run: counts and boxes are merged by sums of integers
//! and by minima, partitions are stable, and ties go to the lower axis and position.

pub(crate) mod arena;
mod binary;
mod binned;
mod boxes;
mod bricks;
mod curve;
mod reinsert;
mod swept;
pub(crate) mod treelets;
pub(crate) mod turning;

use crate::error::BakeError;
use crate::progress::{Stage, Step};
use crate::storage::resources::{MAX_BRICK_TRIANGLES, Resources};
use crate::threads;
use crate::triangles::{Batch, BatchStream, Kept, Triangle};
pub(crate) use binary::Tree;
pub(crate) use boxes::Aabb;
use boxes::Reference;
use bricks::Division;
pub(crate) use bricks::{BrickIndex, Grid};
use bvh_format::leaf::{PACKET, order_of_lanes};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};

/// Returns true if `triangles` triangles make a single brick.
pub(crate) fn is_one_brick(triangles: u64) -> bool {
    triangles <= MAX_BRICK_TRIANGLES as u64
}

/// The most children of a treelet in any profile.
pub(crate) const MAX_CHILDREN: usize = 8;

/// The triangles of a leaf packet, by number: ascending in a tree, and in the order of lanes in treelets.
#[derive(Clone, Copy)]
pub(crate) struct PacketTriangles {
    numbers: [u32; PACKET],
    count: u8,
}

impl PacketTriangles {
    /// Takes the first numbers, as many as a packet holds.
    pub(crate) fn new(numbers: impl Iterator<Item = u32>) -> Self {
        let mut packet = Self { numbers: [0; PACKET], count: 0 };
        for (slot, number) in packet.numbers.iter_mut().zip(numbers) {
            *slot = number;
            packet.count += 1;
        }
        packet.numbers[..usize::from(packet.count)].sort_unstable();
        packet
    }

    /// The same triangles in the order in which the packet takes the fewest bytes.
    fn in_order_of_lanes(self, triangles: &[Triangle]) -> Self {
        let mut corners = [[[0.0; 3]; 3]; PACKET];
        for (corners, &number) in corners.iter_mut().zip(self.numbers()) {
            *corners = triangles[number as usize].corners;
        }
        let order = order_of_lanes(&corners[..self.numbers().len()]);
        Self { numbers: order.map(|lane| self.numbers[usize::from(lane)]), ..self }
    }

    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers[..usize::from(self.count)]
    }
}

/// The bricks of an object and the tree above them.
pub(crate) struct Bricks {
    bricks: Vec<BatchStream>,
    boxes: Vec<Aabb>,
    top: Tree<BrickIndex>,
    builder: Builder,
}

impl Bricks {
    /// Divides triangles within `bounds` into bricks, for treelets of `width` children. `grid` counts all of them, if they
    /// are more than a brick holds.
    pub(crate) fn divide(
        triangles: &Kept,
        bounds: &Aabb,
        grid: Option<Grid>,
        width: usize,
        method: Method,
        resources: &Resources,
    ) -> Result<Self, BakeError> {
        let builder = Builder::new(width, method);
        let spill = resources.scratch.spill();
        let (bricks, boxes) = (Vec::new(), Vec::new());
        let mut division = Division { builder: &builder, resources, spill: &spill, bricks, boxes };
        let top = division.divide(triangles, triangles.count(), bounds, grid)?;
        let (bricks, boxes) = (division.bricks, division.boxes);
        Ok(Self { bricks, boxes, top, builder })
    }

    /// Makes a single brick of all triangles, which are no more than it may have.
    pub(crate) fn of_one(triangles: BatchStream, bounds: &Aabb, width: usize, method: Method) -> Self {
        Self {
            bricks: vec![triangles],
            boxes: vec![*bounds],
            top: Tree::leaf(0),
            builder: Builder::new(width, method),
        }
    }

    /// Returns a box of the triangles of each brick.
    pub(crate) fn boxes(&self) -> &[Aabb] {
        &self.boxes
    }

    /// Builds the tree of each brick and passes it to `make` with the number of the brick, several bricks at a time. Returns
    /// the results of `make` by brick, and the tree above the bricks. Packets number the triangles of their brick.
    pub(crate) fn build<T: Send>(
        self,
        resources: &Resources,
        make: impl Fn(usize, Tree<PacketTriangles>, &Batch) -> Result<T, BakeError> + Sync,
    ) -> Result<(Vec<T>, Tree<BrickIndex>), BakeError> {
        let Self { bricks, top, builder, .. } = self;
        let count = bricks.len();
        // The largest bricks come first, so that few threads wait for the last one.
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&number| std::cmp::Reverse(bricks[number].count()));
        let bricks: Vec<_> = bricks.into_iter().map(|brick| Mutex::new(Some(brick))).collect();
        let made: Vec<_> = (0..count).map(|_| Mutex::new(None)).collect();
        let make = |number: usize| {
            let brick = locked(&bricks[number]).take().expect("each brick is built once");
            let (tree, triangles) = builder.tree_of_brick(brick)?;
            resources.progress.go_on()?;
            let done = || resources.progress.add(Step::Bake(Stage::Build), triangles.len() as u64);
            done();
            let made = make(number, tree, &triangles)?;
            done();
            Ok::<T, BakeError>(made)
        };
        let next = AtomicUsize::new(0);
        let work = || {
            while let Some(&number) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                let result = make(number);
                if result.is_err() {
                    // The other loops end after their current brick.
                    next.fetch_add(count, Ordering::Relaxed);
                }
                *locked(&made[number]) = Some(result);
            }
        };
        // One loop per brick that may be in memory. A thread that waits for another may run a second loop, but only loops
        // start bricks.
        threads::each(resources.bricks.min(count), &|_| work());
        // Bricks after one that failed are not made.
        let results = made.into_iter().filter_map(|made| locked(&made).take());
        let results: Vec<T> = results.collect::<Result<_, _>>()?;
        assert_eq!(results.len(), count, "every brick is made");
        Ok((results, top))
    }
}

/// Locks what threads share. They only put something in or take it out while they hold the lock.
fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().expect("no thread panics while it holds the lock")
}

/// How the tree of a brick is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
    /// By clusters along a curve (`curve`), in the least time.
    Curve,
    /// By bins down to few triangles.
    Coarse,
    /// By bins down to a few dozen triangles; then subtrees move (`reinsert`).
    Fine,
}

/// A brick of at most this many triangles stays as it is, because its triangles fit in a cache of a processor in any order.
const MAX_UNORDERED_TRIANGLES: usize = 1 << 14;

struct Builder {
    /// The number of triangles in a full treelet of leaves.
    treelet: usize,
    /// The most triangles of a brick.
    brick: usize,
    /// Nodes of at most this many triangles are swept (`swept`).
    sweep: usize,
    method: Method,
}

impl Builder {
    fn new(width: usize, method: Method) -> Self {
        let sweep = if method == Method::Fine { swept::MAX_SWEPT } else { 16 };
        Self { treelet: PACKET * width, brick: MAX_BRICK_TRIANGLES, sweep, method }
    }

    /// Takes the triangles of a brick out of their storage, builds their tree, and puts them in the order of its packets if they are
    /// many.
    fn tree_of_brick(
        &self,
        brick: BatchStream,
    ) -> Result<(Tree<PacketTriangles>, Batch<'static>), BakeError> {
        let triangles = brick.take()?;
        let mut tree = self.tree(&triangles);
        if triangles.len() <= MAX_UNORDERED_TRIANGLES {
            return Ok((tree, triangles));
        }
        // All later steps go from packet to packet, and would otherwise wait for far memory at each triangle.
        let mut order: Vec<u32> = Vec::with_capacity(triangles.len());
        for packet in tree.leaves_mut() {
            let first = order.len() as u32;
            order.extend_from_slice(packet.numbers());
            *packet = PacketTriangles::new(first..order.len() as u32);
        }
        Ok((tree, triangles.at(order.iter().map(|&number| number as usize))))
    }

    /// Builds the tree of a brick.
    fn tree(&self, triangles: &[Triangle]) -> Tree<PacketTriangles> {
        let tree = self.split_tree(triangles);
        if self.method != Method::Fine {
            return tree;
        }
        // A copy of the tree would cost every bake time. Hardly any bake needs it, so that it is built again instead.
        reinsert::optimised(tree).unwrap_or_else(|| self.split_tree(triangles))
    }

    /// Builds the tree by splits, before any subtree is moved.
    fn split_tree(&self, triangles: &[Triangle]) -> Tree<PacketTriangles> {
        if self.method == Method::Curve {
            return curve::brick(self, triangles);
        }
        let none = || vec![Reference::NONE; triangles.len()];
        let pays = triangles.len() > binned::MAX_SEQUENTIAL_TRIANGLES;
        let (mut references, mut scratch) = threads::join_if(pays, none, none);
        // On all threads: for a cloud, whose other steps are short, this is a fifth of the bake.
        threads::change(&mut references, |number, reference| {
            *reference = Reference::new(number as u32, &triangles[number].corners);
        });
        self.brick(&mut references, &mut scratch)
    }
}
