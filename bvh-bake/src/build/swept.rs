//! Builds the tree of a few dozen triangles, trying all positions along all three axes.
//!
//! References are sorted along the axes once; splits keep the orders.

use super::binned::weight;
use super::boxes::{Aabb, Cost, Reference};
use super::{Builder, Node, PACKET, PacketTriangles};
use crate::ablation::SplitRule;
use bvh_format::leaf::to_ordered;

/// Most triangles that are swept: sets of them are 64 bits.
pub(super) const MOST: usize = 64;

/// The tree of at most `MOST` references.
pub(super) fn tree(builder: &Builder, references: &[Reference]) -> Node<PacketTriangles> {
    let count = references.len();
    let mut boxes = [Aabb::EMPTY; MOST];
    let mut keys = [[0u64; MOST]; 3];
    for (place, reference) in references.iter().enumerate() {
        boxes[place] = reference.aabb();
        let centre = boxes[place].centre();
        for axis in 0..3 {
            // The place in the list below the centre: ties keep their order.
            let ordered = to_ordered(centre[axis]) as u32 ^ 1 << 31;
            keys[axis][place] = u64::from(ordered) << 32 | place as u64;
        }
    }
    let mut orders = [[0u8; MOST]; 3];
    for axis in 0..3 {
        let keys = &mut keys[axis][..count];
        keys.sort_unstable();
        orders[axis].iter_mut().zip(keys).for_each(|(order, key)| *order = *key as u8);
    }
    let [x, y, z] = &mut orders;
    Sweep { builder, references, boxes: &boxes }.node([&mut x[..count], &mut y[..count], &mut z[..count]])
}

struct Sweep<'a> {
    builder: &'a Builder,
    references: &'a [Reference],
    boxes: &'a [Aabb; MOST],
}

impl Sweep<'_> {
    fn aabb(&self, place: u8) -> &Aabb {
        &self.boxes[usize::from(place) % MOST]
    }

    /// `orders` holds the same places, sorted along each axis.
    fn node(&self, orders: [&mut [u8]; 3]) -> Node<PacketTriangles> {
        let count = orders[0].len();
        if count <= PACKET {
            let numbers = orders[0].iter().map(|&place| self.references[usize::from(place)].triangle);
            return Node::Leaf(PacketTriangles::new(numbers));
        }
        let mut bounds = Aabb::EMPTY;
        orders[0].iter().for_each(|&place| bounds.join(self.aabb(place)));
        let (axis, middle) = self.best_position(&orders, &bounds);
        let mut is_left = 0u64;
        orders[axis][..middle].iter().for_each(|place| is_left |= 1 << place);
        for other in (0..3).filter(|&other| other != axis) {
            partition(orders[other], is_left);
        }
        let [x, y, z] = orders.map(|order| order.split_at_mut(middle));
        let left = self.node([x.0, y.0, z.0]);
        let right = self.node([x.1, y.1, z.1]);
        Node::above(left, right, bounds.squared_girth())
    }

    /// The axis and length of the first side of the cheapest split.
    fn best_position(&self, orders: &[&mut [u8]; 3], bounds: &Aabb) -> (usize, usize) {
        let builder = self.builder;
        let cost = Cost::within(bounds, builder.splits);
        let count = orders[0].len();
        if builder.splits == SplitRule::Median {
            let unit = if count > builder.treelet { builder.treelet } else { PACKET };
            return (bounds.longest(), (count / 2).next_multiple_of(unit));
        }
        // Below a treelet of leaves no packet more than needed is opened.
        let packets = if count <= builder.treelet { count.div_ceil(PACKET) } else { usize::MAX };
        let may =
            |position: usize| position.div_ceil(PACKET) + (count - position).div_ceil(PACKET) <= packets;
        // A multiple of the packet may always be.
        let mut best = (f32::INFINITY, 0, PACKET);
        for axis in 0..3 {
            let order = &orders[axis][..count];
            let mut right_cost = [0.0; MOST];
            let mut right = Aabb::EMPTY;
            for position in (1..count).rev() {
                right.join(self.aabb(order[position]));
                right_cost[position % MOST] = cost.of(&right, weight(count - position));
            }
            let mut left = Aabb::EMPTY;
            for position in 1..count {
                left.join(self.aabb(order[position - 1]));
                let cost = cost.of(&left, weight(position)) + right_cost[position % MOST];
                if cost < best.0 && may(position) {
                    best = (cost, axis, position);
                }
            }
        }
        (best.1, best.2)
    }
}

/// Brings the places of one side to the front; both keep their order.
fn partition(order: &mut [u8], is_left: u64) {
    let mut others = [0u8; MOST];
    let mut ends = [0; 2];
    for index in 0..order.len() {
        let place = order[index];
        let side = usize::from(is_left >> place & 1 == 0);
        order[ends[0]] = place;
        others[ends[1] % MOST] = place;
        ends[side] += 1;
    }
    order[ends[0]..].copy_from_slice(&others[..ends[1]]);
}
