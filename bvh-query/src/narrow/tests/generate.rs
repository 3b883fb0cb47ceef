//! Generates pairs of triangles that are hard to decide or to measure, from a seed.

use crate::narrow::{Point, Triangle, add_scaled, cross, dot};
use cbvh_testkit::Random;

pub(super) fn triangle(random: &mut Random) -> Triangle {
    [random.point(), random.point(), random.point()]
}

/// Returns a number from 10^-`digits` to 1 whose logarithm is uniform.
pub(super) fn small(random: &mut Random, digits: f64) -> f64 {
    10_f64.powf(-digits * random.unit())
}

pub(super) fn grid_triangle(random: &mut Random, n: usize) -> [[i64; 3]; 3] {
    [0; 3].map(|_| [0; 3].map(|_| random.below(n) as i64))
}

pub(super) fn shuffled<T: Copy>(random: &mut Random, t: &[T; 3]) -> [T; 3] {
    let mut t = *t;
    t.swap(0, random.below(3));
    t.swap(1, 1 + random.below(2));
    t
}

/// Returns three perpendicular unit vectors, up to rounding.
fn frame(random: &mut Random) -> [Point; 3] {
    let unit = |v: Point| v.map(|x| x / dot(v, v).sqrt());
    let u = unit(random.point());
    let v = random.point();
    let v = unit(add_scaled(v, -dot(u, v), u));
    [u, v, cross(u, v)]
}

pub(super) fn float(t: &[[i64; 3]; 3]) -> Triangle {
    t.map(|p| p.map(|x| x as f64))
}

/// A pair of triangles and the name of its kind.
pub(super) type Case = (&'static str, Triangle, Triangle);

/// The number of kinds of pairs.
pub(super) const KINDS: usize = 11;

/// Returns a pair of a kind, of size about 1 and near the origin.
pub(super) fn pair(kind: usize, random: &mut Random) -> Case {
    let [u, v, n] = frame(random);
    let at = |x: f64, y: f64, z: f64| add_scaled(add_scaled(add_scaled([0.0; 3], x, u), y, v), z, n);
    let gap = small(random, 17.0);
    let thin = small(random, 9.0);
    let slant = small(random, 12.0);
    match kind {
        0 => ("random", triangle(random), triangle(random)),
        1 => {
            let far = random.point().map(|x| 4.0 * x);
            ("apart", triangle(random), triangle(random).map(|p| add_scaled(p, 1.0, far)))
        }
        2 => {
            let (x, y) = (random.unit() / 2.0, random.unit() / 2.0);
            let b = [at(x, y, gap), at(x + random.signed(), y, 1.0), at(x, y - random.signed(), 1.0)];
            ("corner over face", [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0)], b)
        }
        3 => {
            let a = [at(-1.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(random.signed(), 1.0, -1.0)];
            let b = [at(-random.unit(), -slant, gap), at(random.unit(), slant, gap), at(0.0, 0.5, 1.0 + gap)];
            ("nearly parallel edges", a, b)
        }
        4 => {
            let a = [at(-1.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(random.signed(), thin, 0.0)];
            let b = [at(random.signed(), thin / 3.0, gap), random.point(), random.point()];
            ("corner over flat sliver", a, b)
        }
        5 => {
            let a = [at(0.0, 0.0, 0.0), at(1.0, thin, 0.0), at(1.0, -thin, 0.0)];
            let b = [at(0.5, random.signed(), -1.0), at(0.5, 0.0, 1.0), at(0.5 + slant, 0.0, 1.0)];
            ("needle through needle", a, b.map(|p| add_scaled(p, thin * random.signed(), v)))
        }
        6 => {
            let a = [at(-1.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(random.signed(), thin, 0.0)];
            let b = [at(-1.0, -gap, 0.0), at(1.0, -gap, slant), at(random.signed(), -gap - thin, gap)];
            ("sliver beside sliver", a, b)
        }
        7 => {
            let a = triangle(random);
            let b = [a[random.below(3)], random.point(), random.point()];
            ("shared corner", a, b)
        }
        8 => {
            let a = triangle(random);
            let b = [a[1], a[0], add_scaled(a[2], slant * random.signed(), random.point())];
            ("shared edge, almost folded", a, b)
        }
        9 => {
            let mut flat = || at(random.signed(), random.signed(), 0.0);
            let (a, b) = ([flat(), flat(), flat()], [flat(), flat(), flat()]);
            ("nearly coplanar", a, b)
        }
        _ => {
            let a = triangle(random);
            let middle = add_scaled(a[0], random.unit(), add_scaled(a[1], -1.0, a[0]));
            let b = [middle, add_scaled(middle, gap, random.point()), random.point()];
            let b = if random.below(2) == 0 { [b[0]; 3] } else { [b[0], b[1], b[random.below(2)]] };
            ("segment or point on edge", a, b)
        }
    }
}
