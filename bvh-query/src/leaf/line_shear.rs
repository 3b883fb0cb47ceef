//! Which triangles of a packet a line may cross, in f64.
//!
//! Along a line with direction d, whose largest component is along z, points are moved to where the line through them along d meets
//! the plane z = 0: (x - z dx / dz, y - z dy / dz), seen from a point of the line (S. Woop, C. Benthin, I. Wald, "Watertight
//! Ray/Triangle Intersection", 2013). The line then passes the edge from a to b on the side that the sign of ax by - ay bx tells.
//! Two opposite signs that are certain show that it misses the triangle.
//!
//! Error, with u = 2^-53: let M bound the coordinates of corners as the point of the line sees them, and let the points of the line
//! and the corners be off by e along each axis, together. A computed coordinate is off by e + u M. The quotients are at most 1, and
//! off by s = 2^-43: the components of the direction are off by at most 2^-45 of the largest one, where a pose has turned them. A
//! moved coordinate is then off by at most f = 2 e + (s + 6u) M, and at most X = 2 M + f. A product of two is off by 2 X f + f^2 + u X^2,
//! and the difference of two products by twice that and 2 u X^2.

use crate::isa::Isa;
use crate::isa::doubles::Doubles;
use crate::numerics::{DIRECTION_ERROR, UNIT_ROUNDOFF};
use bvh_format::leaf::Packet;
use std::hint::select_unpredictable;

/// A line as the test of packets needs it.
pub(crate) struct LineShear {
    /// The axes called x, y and z.
    axes: [usize; 3],
    /// A point of the line, along these.
    point: [f64; 3],
    /// The quotients of the direction.
    slope: [f64; 2],
    /// Signs of larger numbers are certain.
    certain: f64,
}

impl LineShear {
    /// The line through a point, both around the object's origin. `inverse` has the inverses of the direction's components. `error` bounds that of the points of the line and of the corners
    /// along each axis, and `farthest` the coordinates of corners as the point sees them.
    #[inline(always)]
    pub(crate) fn new(
        point: &[f64; 3],
        (direction, inverse): (&[f64; 3], &[f64; 3]),
        error: f64,
        farthest: f64,
    ) -> Self {
        let [x, y, z] = direction.map(f64::abs);
        // No branch could predict which one is the largest.
        let of_two = usize::from(y > x);
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][select_unpredictable(z > x.max(y), 2, of_two)];
        let largest = direction[axes[2]];
        // A point has no direction: then no sign is certain.
        let (inverse, is_line) = if largest == 0.0 { (0.0, false) } else { (inverse[axes[2]], true) };
        let farthest = farthest + error;
        let moved = 2.0 * error + (DIRECTION_ERROR + 6.0 * UNIT_ROUNDOFF) * farthest;
        let most = 2.0 * farthest + moved;
        let of_product = 2.0 * most * moved + moved * moved + 2.0 * UNIT_ROUNDOFF * most * most;
        let certain = if is_line { 2.0 * of_product * (1.0 + 1.0 / (1 << 20) as f64) } else { f64::INFINITY };
        Self {
            axes,
            point: axes.map(|axis| point[axis]),
            slope: [direction[axes[0]] * inverse, direction[axes[1]] * inverse],
            certain,
        }
    }

    /// Returns a bit for each triangle of a packet that the line may cross.
    #[inline(always)]
    pub(crate) fn crossed<I: Isa>(&self, isa: I, packet: &Packet) -> u16 {
        let (a, b, c) = (self.moved(isa, packet, 0), self.moved(isa, packet, 1), self.moved(isa, packet, 2));
        let (ab, bc, ca) = (side(a, b), side(b, c), side(c, a));
        let (least, most) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
        let (above, below) = (isa.splat_wide(self.certain), isa.splat_wide(-self.certain));
        !(above.bits_below(most) & least.bits_below(below)) & 0xf
    }

    /// Returns where a corner of each triangle is moved to.
    #[inline(always)]
    fn moved<I: Isa>(&self, isa: I, packet: &Packet, corner: usize) -> [I::F64x4; 2] {
        let ([x, y, z], of) = (self.axes, &packet.corners[corner]);
        let point = [self.point[0], self.point[1], self.point[2]];
        let along = isa.widen(&of[z % 3]).sub(isa.splat_wide(point[2]));
        let x = isa.widen(&of[x % 3]).sub(isa.splat_wide(point[0]));
        let y = isa.widen(&of[y % 3]).sub(isa.splat_wide(point[1]));
        [x.sub(along.mul(isa.splat_wide(self.slope[0]))), y.sub(along.mul(isa.splat_wide(self.slope[1])))]
    }
}

/// Returns numbers whose signs tell on which side the line passes an edge.
#[inline(always)]
fn side<D: Doubles>(p: [D; 2], q: [D; 2]) -> D {
    p[0].mul(q[1]).sub(p[1].mul(q[0]))
}
