//! Constructs pairs of meshes of which most pairs of triangles touch, or miss touching by a few roundings.
//!
//! A *star* is a bundle of triangles that all contain one point, its centre, as a corner, in an edge or in a face, and
//! that lie on one side of a plane through it; some are segments and points. Two stars with the same centre on opposite
//! sides of the plane touch in every pair of triangles: corner on corner, corner on edge, edge across edge, face on face,
//! shared edges and so on. Moving one by a few roundings parts them, or lets them cross.
//!
//! All corners are small integers times a power of two. B is stored as the pose's inverse takes it, which is exact for
//! rotations with rational entries; integer quaternions give these. `f64` entries and the arithmetic of placing then move
//! each placed corner by a few roundings of its own.

use bvh_query::Pose;
use cbvh_testkit::exact::{Boxed, Decided, Length, intersect};
use cbvh_testkit::{Random, Triangle};

type Integer = [i64; 3];

/// Two meshes, and the pose in which B's stars meet A's.
pub(super) struct Stars {
    pub(super) a: Vec<Triangle>,
    pub(super) b: Vec<Triangle>,
    pub(super) rotation: [[f64; 3]; 3],
    pub(super) translation: [f64; 3],
    /// The triangles per star, of A and of B.
    pub(super) sizes: [usize; 2],
    /// The normal of all planes, from A to B, in A's frame.
    pub(super) normal: [f64; 3],
}

/// How many stars there are, and how many triangles each has; few triangles make small trees, many make deep ones.
const SHAPES: [(usize, [usize; 2]); 8] = [
    (1, [64, 64]),
    (1, [40, 90]),
    (4, [32, 32]),
    (16, [16, 16]),
    (16, [8, 24]),
    (64, [8, 8]),
    (160, [5, 5]),
    (400, [3, 3]),
];

/// How near the boundary a pair has to be, in units of 2^-53 of the largest magnitude that occurs in placing a corner. A
/// placed corner is within four of its exact place, and poses are moved by up to six.
const ROUNDINGS: f64 = 32.0;
const UNIT: f64 = f64::EPSILON / 2.0;

/// The largest coordinate of a corner around its star's centre, before it is multiplied by the rotation's denominator.
const REACH: i64 = 96;

/// Returns a rotation that maps integers to integers over a denominator: that of a quaternion of integers up to `most`. Small
/// ones turn the axes or make 3-4-5.
fn rotation(random: &mut Random, most: usize) -> ([Integer; 3], i64) {
    let mut number = || random.below(2 * most + 1) as i64 - most as i64;
    let [x, y, z, w] = [(); 4].map(|()| number());
    let w = if [x, y, z, w] == [0; 4] { 1 } else { w };
    let numerators = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), w * w - x * x + y * y - z * z, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z],
    ];
    (numerators, x * x + y * y + z * z + w * w)
}

impl Stars {
    pub(super) fn new(random: &mut Random) -> Self {
        let (count, mut sizes) = SHAPES[random.below(8)];
        if random.below(2) == 0 {
            sizes.reverse();
        }
        // Corners of B have to fit in f32, and those of a single star are small.
        let most = if count == 1 { [1, 3, 40][random.below(3)] } else { random.below(4) };
        let (numerators, n) = rotation(random, most);
        let normal = loop {
            let normal = [(); 3].map(|()| [0, 0, 1, -1, 2, -3][random.below(6)]);
            if normal != [0; 3] {
                break normal;
            }
        };
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for centre in centres(random, count) {
            let star = Star::new(random, normal);
            let at = |t: [Integer; 3]| t.map(|p| [0, 1, 2].map(|k| centre[k] + p[k]));
            a.extend((0..sizes[0]).map(|_| at(star.triangle(random, -1))));
            b.extend((0..sizes[1]).map(|_| at(star.triangle(random, 1))));
        }
        // Far places lose bits of what is stored and placed: A's, and B's before it is placed.
        let unit = 2f64.powi(random.below(180) as i32 - 100);
        let mut far = || {
            let bits = [0, 0, 10, 20, 28][random.below(5)];
            [(); 3].map(|()| if bits == 0 { 0 } else { random.below(2 << bits) as i64 - (1 << bits) })
        };
        let (far_a, far_b) = (far(), far());
        let float = |p: Integer| p.map(|x| x as f64 * unit);
        let of_a = |p: Integer| float([0, 1, 2].map(|k| n * (p[k] + far_a[k])));
        let back = |j: usize, p: &Integer| (0..3).map(|i| numerators[i][j] * (p[i] + far_b[i])).sum();
        let of_b = |p: Integer| float([0, 1, 2].map(|j| back(j, &p)));
        Self {
            a: a.into_iter().map(|t: [Integer; 3]| t.map(of_a)).collect(),
            b: b.into_iter().map(|t: [Integer; 3]| t.map(of_b)).collect(),
            rotation: numerators.map(|row| row.map(|x| x as f64 / n as f64)),
            translation: float([0, 1, 2].map(|k| n * (far_a[k] - far_b[k]))),
            sizes,
            normal: normal.map(|x| x as f64),
        }
    }

    /// Returns the number of pairs of triangles around common centres.
    pub(super) fn pairs(&self) -> usize {
        self.a.len() * self.sizes[1]
    }

    /// Returns the numbers of two triangles around a common centre.
    pub(super) fn any_pair(&self, random: &mut Random) -> (usize, usize) {
        let star = random.below(self.a.len() / self.sizes[0]);
        let [i, j] = [0, 1].map(|side| star * self.sizes[side] + random.below(self.sizes[side]));
        (i, j)
    }

    /// Returns the pose of the construction, or one whose numbers are moved by a few roundings. The pose may be refused.
    pub(super) fn nudged(&self, number: usize, random: &mut Random) -> Option<Pose> {
        let (mut rotation, mut translation) = (self.rotation, self.translation);
        let largest = self.largest_magnitude(&rotation, translation);
        let mut step = |x: &mut f64, unit: f64| {
            let steps = random.below(5) as f64 - 2.0;
            *x += steps * if unit > 0.0 { unit } else { x.abs().next_up() - x.abs() };
        };
        if number & 1 == 1 {
            let unit = if number & 2 == 0 { 0.0 } else { UNIT * largest };
            let axes = if number & 4 == 0 { 0..3 } else { number / 8 % 3..number / 8 % 3 + 1 };
            translation[axes].iter_mut().for_each(|x| step(x, unit));
        }
        if number & 8 == 8 {
            let unit = if number & 16 == 0 { 0.0 } else { UNIT };
            rotation.as_flattened_mut().iter_mut().for_each(|x| step(x, unit));
        }
        Pose::new(rotation, translation).ok()
    }

    /// Returns whether moving B by [`ROUNDINGS`] of the largest magnitude in the pose parts a pair that touches, or whether the
    /// pair is apart by no more than that. B's triangle is placed.
    pub(super) fn is_near(&self, (a, b): (&Triangle, &Triangle), touching: bool, pose: &Pose) -> bool {
        let off = ROUNDINGS * UNIT * self.largest_magnitude(pose.rotation(), pose.translation());
        if !touching {
            return Length::between(a, b).compare(off).is_le();
        }
        let length = self.normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let moved = b.map(|p| [0, 1, 2].map(|k| p[k] + off * self.normal[k] / length));
        !intersect(&Boxed::new(*a), &Boxed::new(moved), &mut Decided::default())
    }

    /// Returns the largest sum of the magnitudes of the terms of a placed coordinate, and of a coordinate of A.
    fn largest_magnitude(&self, rotation: &[[f64; 3]; 3], translation: [f64; 3]) -> f64 {
        let of_b = self.b.iter().flatten().flat_map(|p| {
            let sum = move |k: usize| (0..3).map(|j| (rotation[k][j] * p[j]).abs()).sum::<f64>();
            (0..3).map(move |k| sum(k) + translation[k].abs())
        });
        self.a.iter().flatten().flatten().map(|x| x.abs()).chain(of_b).fold(0.0, f64::max)
    }
}

/// Returns the places of stars, so far apart that none meets another; a single one is at 0.
fn centres(random: &mut Random, count: usize) -> Vec<Integer> {
    let side = (count as f64).cbrt().ceil() as i64;
    let place = |number: i64| {
        let cell = [number % side, number / side % side, number / side / side];
        let spread = if count == 1 { 1 } else { REACH as usize };
        cell.map(|x| 4 * REACH * (x - side / 2) + random.below(spread) as i64)
    };
    (0..count as i64).map(place).collect()
}

/// What the triangles of both sides of a plane share.
struct Star {
    normal: Integer,
    /// Vectors in the plane. Having few of them makes shared and overlapping edges frequent.
    flat: [Integer; 4],
}

impl Star {
    fn new(random: &mut Random, normal: Integer) -> Self {
        let flat = [(); 4].map(|()| {
            loop {
                let [x, y, z] = [(); 3].map(|()| random.below(11) as i64 - 5);
                let [a, b, c] = normal;
                let vector = [b * z - c * y, c * x - a * z, a * y - b * x];
                if vector != [0; 3] {
                    break vector;
                }
            }
        });
        Self { normal, flat }
    }

    /// Returns a vector that is strictly on one side of the plane.
    fn off(&self, random: &mut Random, side: i64) -> Integer {
        loop {
            let vector = [(); 3].map(|()| random.below(2 * REACH as usize / 3) as i64 - REACH / 3);
            match side * (0..3).map(|k| self.normal[k] * vector[k]).sum::<i64>() {
                0 => {}
                1.. => return vector,
                _ => return vector.map(|x| -x),
            }
        }
    }

    /// Returns a triangle, segment or point on one side that contains the centre.
    fn triangle(&self, random: &mut Random, side: i64) -> [Integer; 3] {
        let [e, f] = [random.below(4), random.below(4)].map(|i| self.flat[i]);
        let (u, v) = (self.off(random, side), self.off(random, side));
        let times = |p: Integer, x: i64| p.map(|y| x * y);
        let zero = [0; 3];
        let lifted = [0, 1, 2].map(|k| e[k] + side * self.normal[k]);
        let mut t = match random.below(16) {
            // The centre is a corner.
            0 | 1 => [zero, u, v],
            2 => [zero, u, [zero, u, times(u, 2)][random.below(3)]],
            3 => [[zero; 3], [zero, u, v]][random.below(2)],
            4 | 5 => [zero, e, u],
            6 => [zero, e, f],
            // It is in an edge.
            7 | 8 => [e, times(e, -1), u],
            9 => [e, times(e, -2), u],
            10 => [e, times(e, -1), f],
            11 => [e, times(e, -1), lifted],
            12 => [e, times(e, -1), [zero, e, times(e, 2)][random.below(3)]],
            // It is in the face, unless the triangle is a segment.
            _ => [e, f, [0, 1, 2].map(|k| -e[k] - f[k])],
        };
        t.rotate_left(random.below(3));
        if random.below(2) == 0 {
            t.swap(0, 1);
        }
        t
    }
}
