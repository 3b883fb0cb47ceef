//! Joins the triangles of a brick into parts and counts its edges.
//!
//! Triangles are taken in the order of their places, in which neighbours are near each other. A run of them has a small
//! hash table, which stays in the cache nearest to the processor, and most edges cancel there. The few that do not are
//! sorted. Hashes only bring edges together: what is equal is decided by coordinates.

use super::edge::{Edge, End, ends};
use super::max_parts;
use super::nets::Nets;
use crate::error::BakeError;
use crate::storage::{Piece, Spill};
use crate::threads;
use crate::tree::Aabb;
use crate::triangles::Batch;
use std::sync::atomic::{AtomicU64, Ordering};

/// The triangles of a run. The components of surfaces that meet along an edge depend on this number.
const TRIANGLES_PER_RUN: usize = 512;
/// The places of a run's hash table, which is at most three eighths full.
const TABLE: usize = 1 << 12;
const _: () = assert!(3 * TRIANGLES_PER_RUN * 8 <= 3 * TABLE);
const _: () = assert!(3 * TRIANGLES_PER_RUN < NO_EDGE as usize);
/// The content of an empty place of the hash table.
const NO_EDGE: u16 = u16::MAX;

/// The place of a part that has no triangle in the pages of its brick.
pub(super) const NO_PLACE: u32 = u32::MAX;

/// What the bricks of an object need to know.
pub(crate) struct Survey {
    pub(super) nets: Nets,
    /// The boxes of all bricks, around the origin.
    boxes: Vec<Bounds>,
    /// The origin, if ends are vertices, not offsets.
    origin: Option<[f64; 3]>,
    /// The most parts that an object may have to get a list of components.
    max_parts: u64,
    /// The number of parts found so far.
    parts: AtomicU64,
}

/// A box: its lower corner, then its upper corner.
type Bounds = [[f32; 3]; 2];

/// What a brick adds to the topology of its object.
pub(crate) struct BrickTopology {
    /// The number of parts: triangles that are joined by edges within the brick.
    pub(super) parts: u32,
    /// For each part the least place in the pages of the brick, counted from the first of them, or `NO_PLACE`. The list
    /// is empty if the object has too many parts.
    pub(super) least: Vec<u32>,
    /// The part of each triangle of the rest.
    pub(super) rest: Vec<u32>,
    /// Whether there is an edge that does not cancel and cannot be one of another brick.
    pub(super) open: bool,
    /// The edges that do not cancel but may be those of other bricks, each with its part.
    pub(super) edges: Piece<Edge>,
    /// Pairs of the id and the place of triangles in the pages of the brick that may have nets.
    pub(super) netted: Piece<[u32; 2]>,
}

impl Survey {
    /// Starts an object of `triangles` triangles in bricks of these boxes.
    pub(crate) fn new(nets: Nets, boxes: &[Aabb], triangles: u64, origin: Option<[f64; 3]>) -> Self {
        let bounds = |of: &Aabb| [[0, 1, 2].map(|axis| of.lo(axis)), [0, 1, 2].map(|axis| of.hi(axis))];
        let boxes = boxes.iter().map(bounds).collect();
        Self { nets, boxes, origin, max_parts: max_parts(triangles), parts: AtomicU64::new(0) }
    }

    /// Returns whether components are listed, after the last brick.
    pub(super) fn lists_components(&self) -> bool {
        self.parts.load(Ordering::Relaxed) <= self.max_parts
    }

    /// Looks at a brick. `placed` gives the number of each triangle in the brick's own pages and its place there, by
    /// ascending places. `rest` gives the numbers of the other triangles.
    pub(crate) fn brick(
        &self,
        number: usize,
        triangles: &Batch,
        placed: &[(u32, u32)],
        rest: &[u32],
        spill: &Spill,
    ) -> Result<BrickTopology, BakeError> {
        let order: Vec<u32> = placed.iter().map(|(number, _)| *number).chain(rest.iter().copied()).collect();
        let mut parents = vec![0; order.len()];
        let runs = order.chunks(TRIANGLES_PER_RUN).zip(parents.chunks_mut(TRIANGLES_PER_RUN));
        let open = threads::map(runs.enumerate(), |(run, (order, parents))| {
            let first = (run * TRIANGLES_PER_RUN) as u32;
            let ends = order.iter().map(|&number| number as usize);
            let ends = ends.map(|number| ends_of(triangles, number));
            run_of_triangles(ends, parents, first)
        });
        let open = open.concat();
        let mut parents = Sets(parents);
        let mut edges = count_together(&open, |a, b| parents.join(a, b));
        // The sets are numbered by their first triangles, which have the least places.
        let (mut of_first, mut least, mut parts) = (vec![0; order.len()], Vec::new(), 0);
        for (triangle, parent) in parents.0.iter().enumerate() {
            if *parent as usize == triangle {
                of_first[triangle] = parts;
                parts += 1;
                least.push(placed.get(triangle).map_or(NO_PLACE, |(_, place)| *place));
            }
        }
        let mut part_of = |triangle: u32| of_first[parents.first(triangle) as usize];
        let rest = (placed.len()..order.len()).map(|triangle| part_of(triangle as u32)).collect();
        let (near, all) = (self.near(number), edges.len());
        edges.retain(|edge| self.nets.any() || near.iter().any(|bounds| self.contains(bounds, edge)));
        edges.iter_mut().for_each(|edge| edge.of = part_of(edge.of));
        let mut netted = Vec::new();
        if self.nets.any() {
            let all = placed.iter().map(|&(number, place)| [triangles[number as usize].id, place]);
            netted.extend(all.filter(|[id, _]| self.nets.may_have(*id)));
        }
        let before = self.parts.fetch_add(u64::from(parts), Ordering::Relaxed);
        if before + u64::from(parts) > self.max_parts {
            least = Vec::new();
        }
        Ok(BrickTopology {
            parts,
            least,
            rest,
            open: edges.len() < all,
            edges: spill.put(edges)?,
            netted: spill.put(netted)?,
        })
    }

    /// Returns the boxes of other bricks that touch that of a brick.
    fn near(&self, number: usize) -> Vec<Bounds> {
        let [lo, hi] = self.boxes[number];
        let touches =
            |other: &Bounds| (0..3).all(|axis| other[0][axis] <= hi[axis] && lo[axis] <= other[1][axis]);
        let others = self.boxes.iter().enumerate().filter(|(other, _)| *other != number);
        others.map(|(_, other)| *other).filter(touches).collect()
    }

    /// Returns whether a box contains the offsets of both ends of an edge.
    fn contains(&self, [lo, hi]: &Bounds, edge: &Edge) -> bool {
        edge.ends.iter().all(|end| {
            (0..3).all(|axis| {
                let offset = match self.origin {
                    None => f32::from_bits(end[axis] as u32),
                    Some(origin) => (f64::from_bits(end[axis]) - origin[axis]) as f32,
                };
                lo[axis] <= offset && offset <= hi[axis]
            })
        })
    }
}

fn ends_of(triangles: &Batch, number: usize) -> [End; 3] {
    ends(&triangles[number], triangles.exact.get(number))
}

/// Joins the triangles of a run along their edges and returns the edges that do not cancel. `parents` becomes the sets
/// of joined triangles, which are numbered from `first`.
fn run_of_triangles(triangles: impl Iterator<Item = [End; 3]>, parents: &mut [u32], first: u32) -> Vec<Edge> {
    let mut table = [NO_EDGE; TABLE];
    let mut edges: Vec<Edge> = Vec::with_capacity(3 * parents.len());
    parents.iter_mut().zip(0..).for_each(|(parent, number)| *parent = number);
    // Reading ahead of the branches below keeps many reads from far memory under way.
    let triangles: Vec<_> = triangles.map(|ends| (ends, ends.map(hash))).collect();
    for (of, (ends, hashes)) in (0..).zip(&triangles) {
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let (start, end) = (ends[from], ends[to]);
            if is_same(&start, &end) {
                continue;
            }
            // The hash is the same for both directions.
            let mut place = hashes[from].wrapping_add(hashes[to]) as usize % TABLE;
            loop {
                let Some(found) = edges.get_mut(usize::from(table[place])) else {
                    table[place] = edges.len() as u16;
                    edges.push(Edge { ends: [start, end], count: 1, of });
                    break;
                };
                let opposite = is_same(&found.ends[0], &end) && is_same(&found.ends[1], &start);
                if opposite || is_same(&found.ends[0], &start) && is_same(&found.ends[1], &end) {
                    found.count += if opposite { -1 } else { 1 };
                    join(parents, found.of, of);
                    break;
                }
                place = (place + 1) % TABLE;
            }
        }
    }
    parents.iter_mut().for_each(|parent| *parent += first);
    let open = edges.iter().filter(|edge| edge.count != 0);
    open.map(|edge| Edge { of: edge.of + first, ..*edge }.sorted()).collect()
}

/// Returns whether two ends are the same, without the call that compilers make of a comparison of arrays.
#[inline(always)]
fn is_same(a: &End, b: &End) -> bool {
    (a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2]) == 0
}

/// Returns a hash, whose bits all depend on all coordinates.
#[inline(always)]
fn hash([x, y, z]: End) -> u64 {
    let low = (x ^ y.rotate_left(32)) ^ 0x9e37_79b9_7f4a_7c15;
    let mixed = u128::from(low) * u128::from(z ^ 0xd1b5_4a32_d192_ed03);
    (mixed >> 64) as u64 ^ mixed as u64
}

/// Brings equal edges together and passes the triangles of each two of them to `join`. Returns those that do not cancel,
/// each once.
fn count_together(edges: &[Edge], mut join: impl FnMut(u32, u32)) -> Vec<Edge> {
    // Sorting short keys takes a fraction of the time that sorting edges takes.
    let key = |edge: &Edge| hash(edge.ends[0]).wrapping_add(hash(edge.ends[1]));
    let mut order: Vec<(u64, u32)> = edges.iter().map(key).zip(0..).collect();
    order.sort_unstable();
    let (mut same, mut open) = (Vec::new(), Vec::new());
    for of_hash in order.chunk_by(|a, b| a.0 == b.0) {
        same.clear();
        same.extend(of_hash.iter().map(|(_, number)| edges[*number as usize]));
        same.sort_unstable();
        for same in same.chunk_by(|a, b| a.ends == b.ends) {
            same.iter().for_each(|edge| join(same[0].of, edge.of));
            let count = same.iter().map(|edge| edge.count).sum();
            open.extend((count != 0).then_some(Edge { count, ..same[0] }));
        }
    }
    open
}

/// Sets of numbers. Each number has a parent in its set, which is less, or is the first number of its set and its own
/// parent.
pub(super) struct Sets(pub(super) Vec<u32>);

impl Sets {
    /// Makes a set of each number.
    pub(super) fn of(count: u32) -> Self {
        Self((0..count).collect())
    }

    /// Returns the first number of the set that has this number.
    pub(super) fn first(&mut self, number: u32) -> u32 {
        first(&mut self.0, number)
    }

    /// Joins the sets of two numbers.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        join(&mut self.0, a, b);
    }
}

fn first(parents: &mut [u32], mut number: u32) -> u32 {
    while parents[number as usize] != number {
        let parent = parents[number as usize];
        // Halves the way for those who come later.
        parents[number as usize] = parents[parent as usize];
        number = parents[number as usize];
    }
    number
}

fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (first(parents, a), first(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}
