//! Builds the tree of a brick in little time, from clusters along a Morton curve.
//!
//! A curve through the cells of a grid of cubes visits the centres of all triangles, so that one sort by the places on the curve
//! brings neighbours together. Each cluster is what a cell of some size holds, at most a few dozen triangles. Bins find the splits
//! above the clusters, which are far fewer than the triangles; within a cluster, splits after whole packets are tried along all
//! three axes. Cells that are still crowded when the curve ends are split by bins (`binned`), so that no mesh gets a bad tree.
//!
//! The order by a Morton curve is that of Lauterbach et al., "Fast BVH Construction on GPUs" (2009), section 4, and the splits above
//! clusters follow Pantaleoni and Luebke, "HLBVH" (2010), section 4.

use super::binary::{Content, NONE, NodeIndex, Tree};
use super::binned::{MAX_SEQUENTIAL_TRIANGLES, expected_nodes, partition};
use super::boxes::{Aabb, Binning, Cost, Reference};
use super::{Builder, PACKET, PacketTriangles};
use crate::threads;
use crate::triangles::Triangle;
use bvh_format::ordered::to_ordered;

/// The cells of the curve along each axis, a power of two whose cube has as many bits as codes have.
const CELLS_PER_AXIS: usize = 1 << CODE_BITS_PER_AXIS;
const CODE_BITS_PER_AXIS: u32 = 10;
/// The most triangles of a cluster that its cell does not force, because places in it have 6 bits.
const MAX_CLUSTER: usize = 64;
/// A cell of at most this many triangles is a cluster.
const MAX_CELL: usize = 32;
/// A cell of at most [`MAX_CLUSTER`] triangles is a cluster if one of its halves would have fewer than this.
const MIN_HALF: usize = 8;
/// The number of bins along each axis of a box of many clusters, and of few.
const MANY_BINS: usize = 16;
const FEW_BINS: usize = 8;
/// The most clusters in few bins.
const MAX_FEW_CLUSTERS: usize = 32;
/// The number of levels above clusters below which only medians are used, which bounds the depth of any tree.
const MAX_COSTED_DEPTH: usize = 64;
/// The bits by which references are sorted in one pass.
const RADIX_BITS: u32 = 10;

/// The place of a triangle on the curve, with the number of its reference in the low half.
type Key = u64;

/// The code of a key: its place on the curve.
fn code(key: Key) -> u32 {
    (key >> 32) as u32
}

/// The number of a key's reference.
fn number_of(key: Key) -> usize {
    key as u32 as usize
}

/// Builds the tree of a brick.
pub(super) fn brick(builder: &Builder, triangles: &[Triangle]) -> Tree<PacketTriangles> {
    let mut tree = Tree::with_capacity(expected_nodes(triangles.len()));
    let reference = |number: u32| Reference::new(number, &triangles[number as usize].corners);
    if triangles.len() <= MAX_CLUSTER {
        let mut references = [Reference::NONE; MAX_CLUSTER];
        references
            .iter_mut()
            .zip(0..triangles.len() as u32)
            .for_each(|(own, number)| *own = reference(number));
        cluster(builder, &mut tree, &references[..triangles.len()]);
        return tree;
    }
    let references: Vec<Reference> = (0..triangles.len() as u32).map(reference).collect();
    let keys = sorted_keys(&references);
    let mut clusters = Vec::with_capacity(triangles.len() / PACKET);
    add_cells(&keys, 0, &mut clusters);
    let mut centres = Aabb::EMPTY;
    let items = clusters.iter().enumerate().map(|(number, &(first, count))| {
        let mut bounds = Aabb::EMPTY;
        let keys = &keys[first as usize..][..count as usize];
        keys.iter().for_each(|&key| bounds.join(&references[number_of(key)].aabb()));
        centres.join(&Aabb::of_point(bounds.centre()));
        Reference::of_box(number as u32, &bounds)
    });
    let mut items: Vec<Reference> = items.collect();
    let above = Above { builder, clusters: &clusters, keys: &keys, references: &references };
    let mut spare = vec![Reference::NONE; items.len()];
    above.node(&mut tree, &mut items, &mut spare, &centres, 0);
    tree
}

/// Returns the keys of all references in the order of the curve.
fn sorted_keys(references: &[Reference]) -> Vec<Key> {
    let mut centres = Aabb::EMPTY;
    references.iter().for_each(|reference| centres.join(&Aabb::of_point(reference.aabb().centre())));
    let binning = Binning::<CELLS_PER_AXIS>::of_cubes(&centres);
    let key = |(reference, number): (&Reference, u64)| {
        let [x, y, z] = binning.bins(reference.aabb().centre()).map(|bin| spread(bin as u32));
        u64::from(x << 2 | y << 1 | z) << 32 | number
    };
    let mut keys: Vec<Key> = references.iter().zip(0..).map(key).collect();
    if keys.len() < 1 << RADIX_BITS {
        keys.sort_unstable();
        return keys;
    }
    let mut other = vec![0; keys.len()];
    let mut counts = [[0u32; 1 << RADIX_BITS]; (3 * CODE_BITS_PER_AXIS / RADIX_BITS) as usize];
    let digit =
        |key: Key, pass: usize| (key >> (32 + RADIX_BITS * pass as u32)) as usize & ((1 << RADIX_BITS) - 1);
    for &key in &keys {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(key, pass)] += 1;
        }
    }
    for (pass, counts) in counts.iter_mut().enumerate() {
        let mut start = 0;
        for count in counts.iter_mut() {
            (*count, start) = (start, start + *count);
        }
        for &key in &keys {
            let place = &mut counts[digit(key, pass)];
            other[*place as usize] = key;
            *place += 1;
        }
        std::mem::swap(&mut keys, &mut other);
    }
    keys
}

/// Returns a number of 10 bits with two zeros between them.
fn spread(bits: u32) -> u32 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

/// Adds the clusters of the sorted keys of a cell: the place of the first reference of each, and their number.
fn add_cells(keys: &[Key], first: u32, clusters: &mut Vec<(u32, u32)>) {
    let differing = code(keys[0]) ^ code(keys[keys.len() - 1]);
    if keys.len() > MAX_CELL && differing != 0 {
        let bit = 1 << (31 - differing.leading_zeros());
        let middle = keys.partition_point(|&key| code(key) & bit == 0);
        if keys.len() > MAX_CLUSTER || middle.min(keys.len() - middle) >= MIN_HALF {
            add_cells(&keys[..middle], first, clusters);
            return add_cells(&keys[middle..], first + middle as u32, clusters);
        }
    }
    clusters.push((first, keys.len() as u32));
}

/// The tree above clusters.
struct Above<'a> {
    builder: &'a Builder,
    /// The place of the first reference of each cluster, and their number.
    clusters: &'a [(u32, u32)],
    /// The keys of all references in the order of the curve.
    keys: &'a [Key],
    references: &'a [Reference],
}

impl Above<'_> {
    fn count(&self, item: &Reference) -> usize {
        self.clusters[item.triangle() as usize].1 as usize
    }

    /// Adds the subtree of some clusters to `tree` and returns the index of its root. `centres` is the box of their centres.
    fn node(
        &self,
        tree: &mut Tree<PacketTriangles>,
        items: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> NodeIndex {
        if let [item] = items {
            return self.cluster(tree, item);
        }
        let (bounds, count, middle, centres) = if items.len() > MAX_FEW_CLUSTERS {
            self.split::<MANY_BINS>(items, scratch, centres, depth)
        } else {
            self.split::<FEW_BINS>(items, scratch, centres, depth)
        };
        let (left, right) = items.split_at_mut(middle);
        let (left_scratch, right_scratch) = scratch.split_at_mut(middle);
        let index = tree.add(bounds, Content::Inner([NONE; 2]));
        let is_many = count > MAX_SEQUENTIAL_TRIANGLES && threads::current_num_threads() > 1;
        let children = tree.add_both(
            is_many.then(|| expected_nodes(count / 2)),
            |tree| self.node(tree, left, left_scratch, &centres[0], depth + 1),
            |tree| self.node(tree, right, right_scratch, &centres[1], depth + 1),
        );
        tree.link(index, children);
        index
    }

    /// Adds the subtree of a cluster.
    fn cluster(&self, tree: &mut Tree<PacketTriangles>, item: &Reference) -> NodeIndex {
        let (first, count) = self.clusters[item.triangle() as usize];
        let keys = &self.keys[first as usize..][..count as usize];
        let references = keys.iter().map(|&key| self.references[number_of(key)]);
        if keys.len() <= MAX_CLUSTER {
            let mut few = [Reference::NONE; MAX_CLUSTER];
            few.iter_mut().zip(references).for_each(|(own, reference)| *own = reference);
            return cluster(self.builder, tree, &few[..keys.len()]);
        }
        let mut references: Vec<Reference> = references.collect();
        let mut scratch = references.clone();
        tree.append(self.builder.brick(&mut references, &mut scratch))
    }

    /// Orders clusters so that those of the first side come before those of the second. Returns the box of all, the number of
    /// their triangles, the length of the first side, and the boxes of the centres of each side.
    fn split<const BINS: usize>(
        &self,
        items: &mut [Reference],
        scratch: &mut [Reference],
        centres: &Aabb,
        depth: usize,
    ) -> (Aabb, usize, usize, [Aabb; 2]) {
        let binning = Binning::<BINS>::new(centres);
        let mut bins = [[(0usize, Aabb::EMPTY); BINS]; 3];
        for item in &*items {
            let (bounds, count) = (item.aabb(), self.count(item));
            let at = binning.bins(bounds.centre());
            for axis in 0..3 {
                let (sum, bin) = &mut bins[axis][at[axis]];
                *sum += count;
                bin.join(&bounds);
            }
        }
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        bins[0].iter().for_each(|(of_bin, bin)| (count += of_bin, bounds.join(bin)).1);
        let mut best: Option<(f32, usize, usize)> = None;
        if depth < MAX_COSTED_DEPTH {
            let cost = Cost::within(&bounds, self.builder.treelet);
            for axis in 0..3 {
                if let Some((cost, plane)) = Builder::best_of(&bins[axis], cost)
                    && best.is_none_or(|(least, ..)| cost < least)
                {
                    best = Some((cost, axis, plane));
                }
            }
        }
        if let Some((_, axis, plane)) = best {
            let (middle, centres) = partition(items, scratch, |centre| binning.bins(centre)[axis] < plane);
            return (bounds, count, middle, centres);
        }
        // All centres are nearly equal, or the tree is deep: split into halves in the order of the curve.
        items.sort_unstable_by_key(Reference::triangle);
        let middle = items.len() / 2;
        let centres = [&items[..middle], &items[middle..]].map(|side| {
            let mut centres = Aabb::EMPTY;
            side.iter().for_each(|item| centres.join(&Aabb::of_point(item.aabb().centre())));
            centres
        });
        (bounds, count, middle, centres)
    }
}

/// Adds the subtree of at most [`MAX_CLUSTER`] references to `tree` and returns the index of its root.
fn cluster(builder: &Builder, tree: &mut Tree<PacketTriangles>, references: &[Reference]) -> NodeIndex {
    let count = references.len();
    let mut orders = [[0u8; MAX_CLUSTER]; 3];
    let mut bounds = Aabb::EMPTY;
    if count > PACKET {
        let mut keys = [[0u32; MAX_CLUSTER]; 3];
        for (place, reference) in references.iter().enumerate() {
            let centre = reference.aabb().centre().to_array();
            for axis in 0..3 {
                // The last bits of the centre give way to the place in the list, so that equal centres keep their order.
                let ordered = to_ordered(centre[axis]) as u32 ^ 1 << 31;
                keys[axis][place] = ordered & !(MAX_CLUSTER as u32 - 1) | place as u32;
            }
        }
        for (order, keys) in orders.iter_mut().zip(&mut keys) {
            keys[..count].sort_unstable();
            order.iter_mut().zip(keys).for_each(|(order, key)| *order = *key as u8 & (MAX_CLUSTER as u8 - 1));
        }
    } else {
        orders[0] = std::array::from_fn(|place| place as u8);
    }
    references.iter().for_each(|reference| bounds.join(&reference.aabb()));
    let [x, y, z] = &mut orders;
    let cluster = Cluster { builder, references };
    cluster.node(tree, [&mut x[..count], &mut y[..count], &mut z[..count]], bounds)
}

struct Cluster<'a> {
    builder: &'a Builder,
    references: &'a [Reference],
}

impl Cluster<'_> {
    /// Adds the subtree of some references, whose box is `bounds`, to `tree` and returns the index of its root. Each of `orders`
    /// holds the same places of references, sorted along its axis.
    fn node(&self, tree: &mut Tree<PacketTriangles>, orders: [&mut [u8]; 3], bounds: Aabb) -> NodeIndex {
        let count = orders[0].len();
        if count <= PACKET {
            let numbers = orders[0].iter().map(|&place| self.references[usize::from(place)].triangle());
            return tree.add(bounds, Content::Leaf(PacketTriangles::new(numbers)));
        }
        let index = tree.add(bounds, Content::Inner([NONE; 2]));
        let Split { axis, middle, sides } = self.best(&orders, &bounds);
        let mut is_left = 0u64;
        orders[axis][..middle].iter().for_each(|place| is_left |= 1 << place);
        if count - middle > PACKET || middle > PACKET {
            for other in (0..3).filter(|&other| other != axis) {
                part(orders[other], is_left);
            }
        } else if axis != 0 {
            // Only the first order is looked at from here on.
            part(orders[0], is_left);
        }
        let [x, y, z] = orders.map(|order| order.split_at_mut(middle));
        let left = self.node(tree, [x.0, y.0, z.0], sides[0]);
        let right = self.node(tree, [x.1, y.1, z.1], sides[1]);
        tree.link(index, [left, right]);
        index
    }

    /// Returns the cheapest split after a whole number of packets.
    fn best(&self, orders: &[&mut [u8]; 3], bounds: &Aabb) -> Split {
        let cost = Cost::within(bounds, self.builder.treelet);
        let count = orders[0].len();
        let mut best = (f32::INFINITY, Split { axis: 0, middle: PACKET, sides: [*bounds; 2] });
        let aabb = |place: u8| self.references[usize::from(place) % MAX_CLUSTER].aabb();
        for (axis, order) in orders.iter().enumerate() {
            let (mut rights, mut right) = ([Aabb::EMPTY; MAX_CLUSTER / PACKET], Aabb::EMPTY);
            let starts = (PACKET..count).step_by(PACKET);
            let mut end = count;
            for start in starts.clone().rev() {
                order[start..end].iter().for_each(|&place| right.join(&aabb(place)));
                (rights[start / PACKET], end) = (right, start);
            }
            let mut left = Aabb::EMPTY;
            for middle in starts {
                order[middle - PACKET..middle].iter().for_each(|&place| left.join(&aabb(place)));
                let right = rights[middle / PACKET];
                let cost = cost.of(&left, middle) + cost.of(&right, count - middle);
                if cost < best.0 {
                    best = (cost, Split { axis, middle, sides: [left, right] });
                }
            }
        }
        best.1
    }
}

struct Split {
    axis: usize,
    /// The length of the first side.
    middle: usize,
    /// The boxes of both sides.
    sides: [Aabb; 2],
}

/// Moves the places of one side to the front. Both sides keep their order.
fn part(order: &mut [u8], is_left: u64) {
    let mut others = [0u8; MAX_CLUSTER];
    let mut ends = [0; 2];
    for index in 0..order.len() {
        let place = order[index];
        let side = usize::from(is_left >> place & 1 == 0);
        order[ends[0]] = place;
        others[ends[1] % MAX_CLUSTER] = place;
        ends[side] += 1;
    }
    order[ends[0]..].iter_mut().zip(&others[..ends[1]]).for_each(|(place, other)| *place = *other);
}
