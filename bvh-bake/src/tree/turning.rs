//! Fits a turning slab, along the mean normal of its patch, to each child that does not have too many triangles.
//!
//! The mean is weighted by area and ignores which side of a triangle is outside, so the two sides of a sheet do not
//! cancel. Patches are fitted from the leaves up: normals add up, and the slab of each patch is measured from all its
//! triangles.

use crate::threads;
use crate::tree::PacketTriangles;
use crate::tree::arena::{Arena, ChildKind};
use crate::tree::treelets::packet_of;
use crate::triangles::Triangle;
use bvh_format::leaf::Packet;
use bvh_format::turning::{MAX_TRIANGLES, TurningDirection, TurningSlab};

type Vector = [f64; 3];

/// Fits the turning slabs of all children of an arena that have at most [`MAX_TRIANGLES`] triangles below.
pub(crate) fn fit(arena: &mut Arena, triangles: &[Triangle], left_out: [f32; 3]) {
    let largest = largest_patches(arena);
    let arena_read = &*arena;
    let fitted = threads::map(largest, |place| {
        let (packets, fitted) = (Vec::new(), Vec::new());
        let mut patches = Patches { arena: arena_read, triangles, left_out, packets, fitted };
        patches.fit(place);
        patches.fitted
    });
    for (place, slab) in fitted.into_iter().flatten() {
        arena.children_mut()[place].bound.turning = Some(slab);
    }
}

/// The places of the children of at most [`MAX_TRIANGLES`] triangles whose parents have more or are the root.
fn largest_patches(arena: &Arena) -> Vec<usize> {
    let count = arena.len() as u32;
    let mut below = vec![0; arena.len()];
    let of_child = |below: &[usize], kind: &ChildKind| match kind {
        ChildKind::Leaf(packet) => packet.numbers().len(),
        ChildKind::Treelet(treelet) => below[*treelet as usize],
        ChildKind::Brick(_) => usize::MAX,
    };
    for treelet in (0..count).rev() {
        let children = arena.children(treelet).iter();
        below[treelet as usize] =
            children.fold(0usize, |sum, child| sum.saturating_add(of_child(&below, &child.kind)));
    }
    let large = (0..count).filter(|&treelet| treelet == 0 || below[treelet as usize] > MAX_TRIANGLES);
    large
        .flat_map(|treelet| arena.range(treelet))
        .filter(|&place| of_child(&below, &arena.child(place).kind) <= MAX_TRIANGLES)
        .collect()
}

/// The children of a patch that are being fitted.
struct Patches<'a> {
    arena: &'a Arena,
    triangles: &'a [Triangle],
    /// How far vertices are from their offsets.
    left_out: [f32; 3],
    /// The packets of the patch so far, in the order of the tree.
    packets: Vec<Packet>,
    /// The slabs so far, with the places of their children.
    fitted: Vec<(usize, TurningSlab)>,
}

impl Patches<'_> {
    /// Fits a child and all children below. Returns the sum of its normals, weighted by area.
    fn fit(&mut self, place: usize) -> Vector {
        let first = self.packets.len();
        let normal = match &self.arena.child(place).kind {
            ChildKind::Leaf(packet) => self.add_packet(packet),
            ChildKind::Treelet(treelet) => {
                let places = self.arena.range(*treelet);
                places.fold([0.0; 3], |sum, place| add_either_way(sum, self.fit(place)))
            }
            ChildKind::Brick(_) => return [0.0; 3],
        };
        let direction = TurningDirection::near(normal);
        let slab = TurningSlab::around(direction, &self.packets[first..], self.left_out);
        self.fitted.push((place, slab));
        normal
    }

    fn add_packet(&mut self, packet: &PacketTriangles) -> Vector {
        let corners = packet.numbers().iter().map(|&number| &self.triangles[number as usize].corners);
        let normal = corners.fold([0.0; 3], |sum, corners| add_either_way(sum, normal(corners)));
        self.packets.push(packet_of(self.triangles, packet));
        normal
    }
}

/// The normal of a triangle, twice its area long.
fn normal(corners: &[[f32; 3]; 3]) -> Vector {
    let [a, b, c] = corners.map(|corner| corner.map(f64::from));
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

/// Adds a normal or its opposite, whichever makes the sum longer.
fn add_either_way(sum: Vector, normal: Vector) -> Vector {
    let along = sum[0] * normal[0] + sum[1] * normal[1] + sum[2] * normal[2];
    let sign = if along < 0.0 { -1.0 } else { 1.0 };
    [0, 1, 2].map(|axis| sum[axis] + sign * normal[axis])
}
