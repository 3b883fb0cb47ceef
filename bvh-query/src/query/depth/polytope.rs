//! A polytope inside the Minkowski difference of two convex solids, which grows towards its surface where that is nearest to 0.
//!
//! Points of the difference are differences of a point of A and one of B. B moved by `t` meets A if and only if `t` is in it, so
//! the depth is the distance from 0 to its surface. A farthest vertex of A less one of B in the opposite direction is a point of that
//! surface; each one that is added replaces the faces that it sees by those between itself and their border. This is the expanding
//! polytope algorithm (van den Bergen, *Proximity Queries and Penetration Depth Computation on 3D Game Objects*, 2001).
//!
//! The proof does not depend on how the polytope was made. Each directed edge of a face has its opposite in another one, now
//! and after each step, so the faces are a closed surface. If 0 is certainly beneath the plane of each, by at least `r`, all faces
//! turn the same way around it, so that the surface winds around 0 at least once and meets no point nearer than `r`. It winds around
//! none outside of the difference, which is convex and contains all faces. So the ball of radius `r` about 0 is in the difference.

use crate::narrow::{Point, cross, dot, subtract, unit};
use crate::numerics::UNIT_ROUNDOFF;
use bvh_format::vec3::length;

/// A point of the difference, and the vertices that it is the difference of, in A's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) difference: Point,
    pub(super) of_a: Point,
    pub(super) of_b: Point,
}

/// A face, by the numbers of its corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    corners: [u16; 3],
    /// Away from the inside, of unit length; without area, it is zero.
    pub(super) normal: Point,
    /// How far 0 is beneath the plane, to within `error`.
    pub(super) distance: f64,
    pub(super) error: f64,
}

/// A closed surface of faces.
#[derive(Debug)]
pub(super) struct Polytope {
    corners: Vec<Corner>,
    faces: Vec<Face>,
    /// The border of what a corner sees, in use only while the polytope grows.
    border: Vec<(u16, u16)>,
}

/// The most corners. Curved shapes need about as many as the inverse of the error that is allowed.
const MAX_CORNERS: usize = 1024;

/// The least sine between the base of the first tetrahedron and the way to its apex: far more than roundings, so that its faces have
/// known sides.
const LEAST_SINE: f64 = 1.0 / (1 << 30) as f64;

impl Polytope {
    /// Returns a tetrahedron of four corners that are the farthest along some directions, beginning with the one given; none if the
    /// difference has hardly any volume.
    pub(super) fn spanning(between: Point, farthest: &mut dyn FnMut(&Point) -> Corner) -> Option<Self> {
        let along = if unit(between) == [0.0; 3] { [1.0, 0.0, 0.0] } else { unit(between) };
        let ends = [farthest(&along.map(|x| -x)), farthest(&along)];
        let axis = unit(subtract(ends[1].difference, ends[0].difference));
        let least = (0..3).fold(0, |k, j| if axis[j].abs() < axis[k].abs() { j } else { k });
        let mut across = [0.0; 3];
        across[least] = 1.0;
        for side in [unit(cross(axis, across)), unit(cross(axis, cross(axis, across)))] {
            let third = farthest(&side);
            let normal = unit(cross(axis, subtract(third.difference, ends[0].difference)));
            for way in [normal, normal.map(|x| -x)] {
                let fourth = farthest(&way);
                if let Some(polytope) = Self::tetrahedron([ends[0], ends[1], third, fourth]) {
                    return Some(polytope);
                }
            }
        }
        None
    }

    /// Returns the tetrahedron of four corners, or `None` if it has hardly any volume.
    fn tetrahedron(corners: [Corner; 4]) -> Option<Self> {
        let [p, q, r, s] = corners.map(|corner| corner.difference);
        let (normal, to_s) = (cross(subtract(q, p), subtract(r, p)), subtract(s, p));
        let height = dot(normal, to_s);
        if height.is_nan() || height.abs() <= LEAST_SINE * length(normal) * length(to_s) {
            return None;
        }
        let mut polytope = Self { corners: corners.to_vec(), faces: Vec::new(), border: Vec::new() };
        let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        for [i, j, k] in faces {
            // With s above the first face, it turns clockwise around the outside.
            let corners = if height > 0.0 { [i, k, j] } else { [i, j, k] };
            polytope.faces.push(polytope.face(corners));
        }
        Some(polytope)
    }

    /// With W the largest coordinate of the corners and E that of the edges, at most 2 W: differences are off by u W, an edge by
    /// 2 u W + u E, and a component of the normal by less than 8 u E (W + E), at most 24 u E W. The normal is therefore off by less
    /// than 42 u E W, which turns the plane, by that much over the normal's length, about corners no farther than 1.8 W from 0. The
    /// product, the length and the corner itself take less than 16 u W.
    fn face(&self, corners: [u16; 3]) -> Face {
        let [p, q, r] = corners.map(|corner| self.corners[usize::from(corner)].difference);
        let (to_q, to_r) = (subtract(q, p), subtract(r, p));
        let normal = cross(to_q, to_r);
        let scale = length(normal);
        let largest = |of: &[Point]| of.as_flattened().iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let (extent, reach) = (largest(&[to_q, to_r]), largest(&[p, q, r]));
        if scale < f64::MIN_POSITIVE {
            return Face { corners, normal: [0.0; 3], distance: f64::INFINITY, error: f64::INFINITY };
        }
        let normal = normal.map(|x| x / scale);
        let error = UNIT_ROUNDOFF * reach * (16.0 + 160.0 * extent * reach / scale);
        Face { corners, normal, distance: dot(normal, p), error }
    }

    /// Returns the face whose plane is nearest to 0, or the one that 0 is the farthest beyond.
    pub(super) fn nearest(&self) -> Face {
        let first = self.faces[0];
        self.faces.iter().fold(first, |best, face| if face.distance < best.distance { *face } else { best })
    }

    /// Returns a bound: the ball of this radius about 0 is inside, if it is positive.
    pub(super) fn certain(&self) -> f64 {
        // Nothing is known of a face without a normal.
        let beneath = |face: &Face| {
            if face.normal == [0.0; 3] { f64::NEG_INFINITY } else { face.distance - face.error }
        };
        self.faces.iter().map(beneath).fold(f64::INFINITY, f64::min)
    }

    /// Adds a corner. Returns whether that has changed anything.
    pub(super) fn grow(&mut self, corner: Corner) -> bool {
        if self.corners.len() >= MAX_CORNERS {
            return false;
        }
        // Faces in whose plane it is go, too: with them, it might make faces without area.
        let is_seen = |face: &Face| dot(face.normal, corner.difference) - face.distance >= -face.error;
        self.border.clear();
        for face in self.faces.iter().filter(|face| is_seen(face)) {
            let [p, q, r] = face.corners;
            for (from, to) in [(p, q), (q, r), (r, p)] {
                match self.border.iter().position(|edge| *edge == (to, from)) {
                    Some(opposite) => drop(self.border.swap_remove(opposite)),
                    None => self.border.push((from, to)),
                }
            }
        }
        // What sees nothing is inside, and what sees everything is no more precise than the errors.
        if self.border.is_empty() {
            return false;
        }
        self.faces.retain(|face| !is_seen(face));
        let number = self.corners.len() as u16;
        self.corners.push(corner);
        for edge in 0..self.border.len() {
            let (from, to) = self.border[edge];
            self.faces.push(self.face([from, to, number]));
        }
        true
    }

    /// Returns the points of A and of B whose difference is the foot of 0 on the plane of a face, or near it. A facet of the difference
    /// has several faces in one plane: the points are those of the one around the foot.
    pub(super) fn foot(&self, face: &Face) -> [Point; 2] {
        let foot = face.normal.map(|x| face.distance * x);
        let ways =
            |of: &Face| of.corners.map(|corner| subtract(self.corners[usize::from(corner)].difference, foot));
        let is_in_plane = |of: &&Face| ways(of).iter().all(|way| dot(*way, face.normal).abs() <= face.error);
        let mut best = (f64::NEG_INFINITY, [[0.0; 3]; 2]);
        for of in std::iter::once(face).chain(self.faces.iter().filter(is_in_plane)) {
            let [p, q, r] = ways(of);
            let area = |u: Point, v: Point| dot(cross(u, v), face.normal);
            let areas = [area(q, r), area(r, p), area(p, q)];
            let least = areas.iter().fold(f64::INFINITY, |least, area| least.min(*area));
            if least > best.0 {
                let corners = of.corners.map(|corner| self.corners[usize::from(corner)]);
                best = (least, combined(&corners, areas.map(|area| area.max(0.0))));
            }
        }
        best.1
    }

    /// Returns a point that is in A and in B, but for roundings: 0 is in one of the tetrahedra between a corner and the faces.
    pub(super) fn common(&self) -> Point {
        let apex = self.corners[0].difference;
        let mut best = (f64::NEG_INFINITY, [0.0; 3]);
        for face in &self.faces {
            let corners = face.corners.map(|corner| self.corners[usize::from(corner)]);
            let [p, q, r] = corners.map(|corner| corner.difference);
            let six_volumes = |p, q, r| dot(p, cross(q, r));
            let shares = [
                six_volumes(p, q, r),
                six_volumes(apex, r, q),
                six_volumes(apex, p, r),
                six_volumes(apex, q, p),
            ];
            let least = shares.iter().fold(f64::INFINITY, |least, share| least.min(*share));
            if least > best.0 {
                let all = [self.corners[0], corners[0], corners[1], corners[2]];
                best = (least, combined(&all, shares.map(|share| share.max(0.0)))[0]);
            }
        }
        best.1
    }
}

/// Returns the points of A and of B of a combination of corners.
fn combined<const N: usize>(corners: &[Corner; N], shares: [f64; N]) -> [Point; 2] {
    let sum: f64 = shares.iter().sum();
    let shares = if sum > 0.0 { shares.map(|share| share / sum) } else { [1.0 / N as f64; N] };
    let of = |point: fn(&Corner) -> Point| {
        [0, 1, 2].map(|k| (0..N).map(|n| shares[n] * point(&corners[n])[k]).sum::<f64>())
    };
    [of(|corner| corner.of_a), of(|corner| corner.of_b)]
}
