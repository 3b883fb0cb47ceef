//! Distances between oriented boxes, and between oriented rectangles with a radius: the ideal bounds.

use super::vector::{Matrix, Vector, cross, dot, length, minus, plus, times, turned};

/// Steps towards the closest points. Pairs that are not decided then are not apart.
const STEPS: usize = 100;

/// An oriented box, grown by a radius.
#[derive(Debug, Clone, Copy)]
pub(super) struct RoundBox {
    pub(super) centre: Vector,
    /// The axes, of length 1.
    pub(super) axes: Matrix,
    /// Half of the sides.
    pub(super) half: Vector,
    pub(super) radius: f64,
}

impl RoundBox {
    /// How far the box reaches from its centre along a direction of length 1, without its radius.
    fn reach(&self, x: Vector) -> f64 {
        (0..3).map(|i| dot(self.axes[i], x).abs() * self.half[i]).sum()
    }

    /// Returns the point of the box that is closest to a point.
    fn closest(&self, point: Vector) -> Vector {
        let from_centre = turned(&self.axes, minus(point, self.centre));
        (0..3).fold(self.centre, |sum, i| {
            plus(sum, times(self.axes[i], from_centre[i].clamp(-self.half[i], self.half[i])))
        })
    }

    /// Returns the distance of a point from the box, without its radius.
    pub(super) fn away(&self, point: Vector) -> f64 {
        length(minus(point, self.closest(point)))
    }

    /// Returns true if the boxes are more than `limit` apart: along one of the 15 axes of two boxes, or along the line
    /// between points that approach the closest ones by alternating projections. `f64` throughout; not certified.
    pub(super) fn apart(&self, other: &Self, limit: f64) -> bool {
        let limit = limit + self.radius + other.radius;
        let between = minus(other.centre, self.centre);
        let along = |x: Vector| dot(between, x).abs() - self.reach(x) - other.reach(x) > limit;
        if self.axes.into_iter().chain(other.axes).any(along) {
            return true;
        }
        for a in self.axes {
            for b in other.axes {
                let x = cross(a, b);
                let norm = length(x);
                if norm > 1e-9 && along(times(x, 1.0 / norm)) {
                    return true;
                }
            }
        }
        if limit <= 0.0 {
            return false;
        }
        let mut of_other = other.centre;
        for _ in 0..STEPS {
            let of_self = self.closest(of_other);
            of_other = other.closest(of_self);
            let line = minus(of_other, of_self);
            let norm = length(line);
            if norm <= limit {
                return false;
            }
            if along(times(line, 1.0 / norm)) {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oriented::vector::IDENTITY;

    #[test]
    fn boxes_are_apart_below_their_distance_and_not_above() {
        let a = RoundBox { centre: [0.0; 3], axes: IDENTITY, half: [1.0, 2.0, 3.0], radius: 0.0 };
        // Turned by a quarter of a right angle twice, its corner points at A.
        let (s, c) = (0.6, 0.8);
        let axes = [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]];
        let b = RoundBox { centre: [5.0, 6.0, 7.0], axes, half: [1.0, 1.0, 1.0], radius: 0.0 };
        // The corners nearest to A's corner (1, 2, 3), and the edges between them, by a fine grid.
        let grid = |i: u32| f64::from(i) / 200.0 - 1.0;
        let nearest = (0..=400)
            .flat_map(|i| (0..=400).map(move |j| (i, j)))
            .map(|(i, j)| {
                let p = plus(b.centre, plus(times(axes[0], grid(i)), times(axes[1], grid(j))));
                let p = [p[0], p[1], p[2] - 1.0];
                length(minus(p, a.closest(p)))
            })
            .fold(f64::INFINITY, f64::min);
        for (radius, sum) in [(0.0, 0.0), (0.25, 0.5)] {
            let (a, b) = (RoundBox { radius, ..a }, RoundBox { radius, ..b });
            assert!(a.apart(&b, nearest - sum - 0.02) && !a.apart(&b, nearest - sum + 0.02));
            assert!(b.apart(&a, nearest - sum - 0.02) && !b.apart(&a, nearest - sum + 0.02));
        }
    }
}
