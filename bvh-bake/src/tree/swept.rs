//! Builds the tree of a few dozen triangles by trying every split position along all three axes.
//!
//! The references are sorted along each axis once, and splits keep these orders.

use super::binary::{Content, NONE, NodeIndex, Tree};
use super::boxes::{Aabb, Cost, Reference};
use super::{Builder, PACKET, PacketTriangles};
use bvh_format::ordered::to_ordered;

/// The most triangles that are swept, because sets of them have 64 bits.
pub(super) const MAX_SWEPT: usize = 64;

/// Adds the subtree of at most `MAX_SWEPT` references to `tree` and returns the index of its root.
pub(super) fn add(
    builder: &Builder,
    tree: &mut Tree<PacketTriangles>,
    references: &[Reference],
) -> NodeIndex {
    let count = references.len();
    let mut boxes = [Aabb::EMPTY; MAX_SWEPT];
    let mut keys = [[0u64; MAX_SWEPT]; 3];
    for (place, reference) in references.iter().enumerate() {
        boxes[place] = reference.aabb();
        let centre = boxes[place].centre().to_array();
        for axis in 0..3 {
            // The key holds the centre and below it the place in the list, so that equal centres keep their order.
            let ordered = to_ordered(centre[axis]) as u32 ^ 1 << 31;
            keys[axis][place] = u64::from(ordered) << 32 | place as u64;
        }
    }
    let mut orders = [[0u8; MAX_SWEPT]; 3];
    for axis in 0..3 {
        let keys = &mut keys[axis][..count];
        keys.sort_unstable();
        orders[axis].iter_mut().zip(keys).for_each(|(order, key)| *order = *key as u8);
    }
    let [x, y, z] = &mut orders;
    let sweep = Sweep { builder, references, boxes: &boxes };
    sweep.node(tree, [&mut x[..count], &mut y[..count], &mut z[..count]])
}

struct Sweep<'a> {
    builder: &'a Builder,
    references: &'a [Reference],
    boxes: &'a [Aabb; MAX_SWEPT],
}

impl Sweep<'_> {
    fn aabb(&self, place: u8) -> &Aabb {
        &self.boxes[usize::from(place) % MAX_SWEPT]
    }

    /// Adds the subtree of some references to `tree` and returns the index of its root. Each of `orders` holds the same
    /// places of references, sorted along its axis.
    fn node(&self, tree: &mut Tree<PacketTriangles>, orders: [&mut [u8]; 3]) -> NodeIndex {
        let count = orders[0].len();
        let mut bounds = Aabb::EMPTY;
        orders[0].iter().for_each(|&place| bounds.join(self.aabb(place)));
        if count <= PACKET {
            let numbers = orders[0].iter().map(|&place| self.references[usize::from(place)].triangle());
            return tree.add(bounds, Content::Leaf(PacketTriangles::new(numbers)));
        }
        let index = tree.add(bounds, Content::Inner([NONE; 2]));
        let (axis, middle) = self.best_position(&orders, &bounds);
        let mut is_left = 0u64;
        orders[axis][..middle].iter().for_each(|place| is_left |= 1 << place);
        for other in (0..3).filter(|&other| other != axis) {
            partition(orders[other], is_left);
        }
        let [x, y, z] = orders.map(|order| order.split_at_mut(middle));
        let left = self.node(tree, [x.0, y.0, z.0]);
        let right = self.node(tree, [x.1, y.1, z.1]);
        tree.link(index, [left, right]);
        index
    }

    /// Returns the axis of the cheapest split and the length of its first side.
    fn best_position(&self, orders: &[&mut [u8]; 3], bounds: &Aabb) -> (usize, usize) {
        let builder = self.builder;
        let cost = Cost::within(bounds, builder.treelet);
        let count = orders[0].len();
        // A part that fits in one treelet of leaves is split only where that takes no extra packet.
        let packets = if count <= builder.treelet { count.div_ceil(PACKET) } else { usize::MAX };
        let may =
            |position: usize| position.div_ceil(PACKET) + (count - position).div_ceil(PACKET) <= packets;
        // A split after a whole packet is always allowed.
        let mut best = (f32::INFINITY, 0, PACKET);
        for axis in 0..3 {
            let order = &orders[axis][..count];
            // The girths come first, one after the other; what follows has no order and takes several at a time.
            let mut girths = [[0.0; MAX_SWEPT]; 2];
            let (mut left, mut right) = (Aabb::EMPTY, Aabb::EMPTY);
            for position in 1..count {
                left.join(self.aabb(order[position - 1]));
                girths[0][position % MAX_SWEPT] = left.girth();
                right.join(self.aabb(order[count - position]));
                girths[1][(count - position) % MAX_SWEPT] = right.girth();
            }
            let mut costs = [0.0; MAX_SWEPT];
            for position in 1..count {
                let at = position % MAX_SWEPT;
                costs[at] =
                    cost.of_girth(girths[0][at], position) + cost.of_girth(girths[1][at], count - position);
            }
            for position in 1..count {
                let cost = costs[position % MAX_SWEPT];
                if cost < best.0 && may(position) {
                    best = (cost, axis, position);
                }
            }
        }
        (best.1, best.2)
    }
}

/// Moves the places of one side to the front. Both sides keep their order.
fn partition(order: &mut [u8], is_left: u64) {
    let mut others = [0u8; MAX_SWEPT];
    let mut ends = [0; 2];
    for index in 0..order.len() {
        let place = order[index];
        let side = usize::from(is_left >> place & 1 == 0);
        order[ends[0]] = place;
        others[ends[1] % MAX_SWEPT] = place;
        ends[side] += 1;
    }
    order[ends[0]..].copy_from_slice(&others[..ends[1]]);
}
