//! Constructs pairs of meshes of which most pairs of triangles touch, or miss touching by a few roundings.
//!
//! A *star* is a bundle of triangles that all contain one point, its centre, as a corner, in an edge or in a face, and
//! that lie on one side of a plane through it; some are segments and points. Two stars with the same centre on opposite
//! sides of the plane touch in every pair of triangles: corner on corner, corner on edge, edge across edge, face on face,
//! shared edges and so on. Moving one by a few roundings parts them, or lets them cross.
//!
//! All corners are small integers times a power of two. B is stored as the pose's inverse takes it. For rotations with
//! rational entries, which integer quaternions give, it is stored exactly, at any number of places; `f64` entries and the
//! arithmetic of placing then move each placed corner by a few roundings of its own. Other rotations round B's corners to
//! `f32`, so the pose brings the centre of a single star to its place.

use crate::common::rotation;
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

/// The largest coordinate of a corner around its star's centre, before it is multiplied by the rotation's denominator.
const REACH: i64 = 96;

/// A rotation that maps integers to integers over `whole`.
struct Rational {
    numerators: [[i64; 3]; 3],
    whole: i64,
}

impl Rational {
    /// Returns the rotation of a small integer quaternion: the axes turned, 3-4-5, or a denominator up to 36.
    fn new(random: &mut Random) -> Self {
        let most = [0, 1, 1, 2, 3][random.below(5)];
        loop {
            let [x, y, z, w] = [(); 4].map(|()| random.below(2 * most as usize + 1) as i64 - most);
            if most == 0 {
                return Self { numerators: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], whole: 1 };
            }
            let whole = x * x + y * y + z * z + w * w;
            if whole > 0 {
                let numerators = [
                    [w * w + x * x - y * y - z * z, 2 * (x * y - z * w), 2 * (x * z + y * w)],
                    [2 * (x * y + z * w), w * w - x * x + y * y - z * z, 2 * (y * z - x * w)],
                    [2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z],
                ];
                return Self { numerators, whole };
            }
        }
    }

    /// Takes a point whose coordinates are multiples of `whole` back, exactly.
    fn back(&self, p: Integer) -> Integer {
        [0, 1, 2].map(|j| (0..3).map(|i| self.numerators[i][j] * (p[i] / self.whole)).sum())
    }
}

impl Stars {
    pub(super) fn new(random: &mut Random) -> Self {
        let rational = Rational::new(random);
        let is_rational = random.below(4) != 0;
        let (count, mut sizes) = if is_rational { SHAPES[random.below(8)] } else { SHAPES[random.below(2)] };
        if random.below(2) == 0 {
            sizes.reverse();
        }
        let n = rational.whole;
        let normal = loop {
            let normal = [(); 3].map(|()| [0, 0, 1, -1, 2, -3][random.below(6)]);
            if normal != [0; 3] {
                break normal;
            }
        };
        let centres = centres(random, count);
        // Rounded to f32, only what is a corner of B is where it should be; in some rounds that does not matter.
        let kinds = if is_rational || random.below(4) == 0 { [16, 16] } else { [16, 4] };
        let (mut a, mut b) = (Vec::new(), Vec::new());
        for centre in centres {
            let star = Star::new(random, normal);
            let [of_a, of_b] =
                [(-1, sizes[0], kinds[0]), (1, sizes[1], kinds[1])].map(|(side, size, kinds)| {
                    (0..size).map(|_| star.triangle(random, side, kinds)).collect::<Vec<_>>()
                });
            let at = |t: [Integer; 3]| t.map(|p| [0, 1, 2].map(|k| n * (centre[k] + p[k])));
            a.extend(of_a.into_iter().map(at));
            b.extend(of_b.into_iter().map(at));
        }
        // Far places lose bits of what is stored and placed: A's, and B's before it is placed.
        let unit = 2f64.powi(random.below(180) as i32 - 100);
        let mut far = || {
            let bits = [0, 0, 10, 20, 28][random.below(5)];
            [(); 3].map(|()| n * if bits == 0 { 0 } else { random.below(2 << bits) as i64 - (1 << bits) })
        };
        let (far_a, far_b) = (far(), far());
        let float = |p: Integer| p.map(|x| x as f64 * unit);
        let plus = |p: Integer, q: Integer| [0, 1, 2].map(|k| p[k] + q[k]);
        let placed_a: Vec<_> = a.iter().map(|t| t.map(|p| float(plus(p, far_a)))).collect();
        let normal = normal.map(|x| x as f64);
        if is_rational {
            let b = b.iter().map(|t| t.map(|p| float(rational.back(plus(p, far_b))))).collect();
            let rotation = rational.numerators.map(|row| row.map(|x| x as f64 / n as f64));
            let translation = float([0, 1, 2].map(|k| far_a[k] - far_b[k]));
            return Self { a: placed_a, b, rotation, translation, sizes, normal };
        }
        let rotation = rotation(random.quaternion());
        let back = |p: [f64; 3]| {
            [0, 1, 2].map(|j| f64::from((0..3).map(|i| rotation[i][j] * p[i]).sum::<f64>() as f32))
        };
        // The only star is around 0, which has no rounding; B's star may be stored around another point.
        let centre = [0, 1, 2].map(|k| (far_b[k] / n % (1 << 12)) as f64 * unit);
        let stored = |p: Integer| {
            let q = back(float(p));
            [0, 1, 2].map(|k| f64::from((q[k] + centre[k]) as f32))
        };
        let b = b.iter().map(|t| t.map(stored)).collect();
        let placed = rotation.map(|row| (row[0] * centre[0] + row[1] * centre[1]) + row[2] * centre[2]);
        let to = float(far_a);
        let translation = [0, 1, 2].map(|k| to[k] - placed[k]);
        Self { a: placed_a, b, rotation, translation, sizes, normal }
    }
}

/// Returns the places of stars, so far apart that none meets another; a single one is at 0.
fn centres(random: &mut Random, count: usize) -> Vec<Integer> {
    let side = (count as f64).cbrt().ceil() as i64;
    let place = |number: i64| {
        let cell = [number % side, number / side % side, number / side / side];
        cell.map(|x| {
            4 * REACH * (x - side / 2) + random.below(if count == 1 { 1 } else { REACH as usize }) as i64
        })
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

    /// Returns a triangle, segment or point on one side that contains the centre, of the first `kinds` kinds.
    fn triangle(&self, random: &mut Random, side: i64, kinds: usize) -> [Integer; 3] {
        let [e, f] = [random.below(4), random.below(4)].map(|i| self.flat[i]);
        let (u, v) = (self.off(random, side), self.off(random, side));
        let times = |p: Integer, x: i64| p.map(|y| x * y);
        let minus = |p: Integer, q: Integer| [0, 1, 2].map(|k| -p[k] - q[k]);
        let zero = [0; 3];
        let lifted = [0, 1, 2].map(|k| e[k] + side * self.normal[k]);
        let mut t = match random.below(kinds) {
            // The centre is a corner.
            0 | 1 => [zero, u, v],
            2 => [zero, u, [zero, u, times(u, 2)][random.below(3)]],
            3 if random.below(4) == 0 => [zero; 3],
            3 => [zero, u, v],
            4 | 5 => [zero, e, u],
            6 => [zero, e, f],
            // It is in an edge.
            7 | 8 => [e, times(e, -1), u],
            9 => [e, times(e, -2), u],
            10 => [e, times(e, -1), f],
            11 => [e, times(e, -1), lifted],
            12 => [e, times(e, -1), [zero, e, times(e, 2)][random.below(3)]],
            // It is in the face, unless the triangle is a segment.
            _ => [e, f, minus(e, f)],
        };
        t.rotate_left(random.below(3));
        if random.below(2) == 0 {
            t.swap(0, 1);
        }
        t
    }
}
