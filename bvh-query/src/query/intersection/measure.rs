//! Volume, areas and box of what two meshes have in common, from the parts of faces that are its boundary.
//!
//! By the divergence theorem, the volume is a sixth of the sum of the determinants that a point of each face spans with the lines
//! around its parts, each as often as the parts count (W. R. Franklin, "Polygon Properties Calculated from the Vertex
//! Neighborhoods", 1987, has sums of this kind). All points are seen from a middle of the intersection, so that the terms are no larger
//! than its box.
//!
//! # Error
//! A point is off by its own error and by the rounding of its difference from the middle. With X, Y and Z for the largest coordinates of
//! three points and x, y and z for what they are off, their determinant has six products of three coordinates and is off by at most
//! 6 ((X + x) (Y + y) (Z + z) - X Y Z) and some roundings of 6 X Y Z; the sum of all is rounded as often as a compensated sum is. Points
//! far from the origin may be off by more than they are apart, so that no product of what they are off may be left out.

use crate::narrow::{Point, cross, dot, subtract};
use crate::numerics::UNIT_ROUNDOFF;
use crate::query::intersection::cuts::{Arc, Node};
use bvh_format::vec3::length;

/// A sum of numbers with a bound of its error.
#[derive(Clone, Copy, Default)]
struct Sum {
    value: f64,
    /// What rounding lost of the value.
    lost: f64,
    magnitude: f64,
    error: f64,
    terms: u64,
}

impl Sum {
    fn add(&mut self, term: f64, error: f64) {
        let sum = self.value + term;
        let (large, small) =
            if self.value.abs() > term.abs() { (self.value, term) } else { (term, self.value) };
        self.lost += (large - sum) + small;
        self.value = sum;
        self.magnitude += term.abs();
        self.error += error;
        self.terms += 1;
    }

    /// Returns the sum, which may be divided once, and how far it is then at most from the exact one.
    ///
    /// What is lost is itself a sum: of n numbers, each at most a rounding of the magnitude. So it is never more than n roundings of
    /// the magnitude, and each of its n sums is off by at most a rounding of that. Sums of fewer than 2^32 magnitudes and errors are
    /// off by less than a part of 2^20.
    fn total(&self) -> (f64, f64) {
        let total = self.value + self.lost;
        let of_lost = self.terms as f64 * UNIT_ROUNDOFF;
        let roundings = 2.0 * UNIT_ROUNDOFF * total.abs() + self.magnitude * of_lost * of_lost;
        (total, (self.error + roundings) * (1.0 + 1.0 / (1u64 << 20) as f64))
    }
}

/// A point seen from the middle.
struct Seen {
    point: Point,
    /// Its largest coordinate, and how far each is off.
    size: f64,
    error: f64,
}

/// What is measured.
pub(super) struct Measure {
    middle: Point,
    /// The directions along which the box is measured.
    axes: [Point; 3],
    volume: Sum,
    pub(super) areas: [f64; 2],
    pub(super) bounds: Option<[Point; 2]>,
}

impl Measure {
    pub(super) fn new(middle: Point, axes: &[Point; 3]) -> Self {
        Self { middle, axes: *axes, volume: Sum::default(), areas: [0.0; 2], bounds: None }
    }

    /// Adds the parts of a face of one of the surfaces, given the lines around them.
    pub(super) fn add(&mut self, nodes: &[Node], side: usize, arcs: &[Arc]) {
        let Some(first) = arcs.first() else { return };
        let base = self.seen(&nodes[first.from as usize]);
        let mut area = [0.0; 3];
        for arc in arcs {
            let [p, q] = [arc.from, arc.to].map(|node| self.seen(&nodes[node as usize]));
            let weight = arc.weight as f64;
            let spanned = dot(base.point, cross(p.point, q.point));
            let product = base.size * p.size * q.size;
            let moved_ends = p.error * (q.size + q.error) + p.size * q.error;
            let moved = base.error * (p.size + p.error) * (q.size + q.error) + base.size * moved_ends;
            // Products of tiny numbers underflow.
            let error = 6.0 * (moved + 8.0 * UNIT_ROUNDOFF * product) + f64::MIN_POSITIVE;
            self.volume.add(weight * spanned, weight.abs() * error);
            let turned = cross(subtract(p.point, base.point), subtract(q.point, base.point));
            area = [0, 1, 2].map(|k| area[k] + weight * turned[k]);
            self.include(&nodes[arc.from as usize].point);
        }
        self.areas[side] += length(area) / 2.0;
    }

    /// Returns the volume and a bound of its error.
    pub(super) fn volume(&self) -> (f64, f64) {
        let (sum, error) = self.volume.total();
        // Surfaces turned inside out wind around their insides the other way.
        (sum.abs() / 6.0, error / 6.0)
    }

    fn seen(&self, node: &Node) -> Seen {
        let point = subtract(node.point, self.middle);
        let size = point.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
        Seen { point, size, error: node.error + UNIT_ROUNDOFF * size }
    }

    /// Every end of a line is the start of another one.
    fn include(&mut self, point: &Point) {
        let along = self.axes.map(|axis| dot(axis, *point));
        let [lo, hi] = self.bounds.get_or_insert([along; 2]);
        for k in 0..3 {
            (lo[k], hi[k]) = (lo[k].min(along[k]), hi[k].max(along[k]));
        }
    }
}
