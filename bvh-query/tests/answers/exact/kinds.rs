//! Generates pairs of small meshes of every kind that is hard to decide, and poses to start from.

use crate::common::shapes::{comb, cube, dirty, moved, plate, rounded, soup, sphere, terrain};
use crate::common::{Random, Triangle, random_pose, rotation};
use bvh_query::Pose;

pub(crate) const KINDS: [(&str, Make); 18] = [
    ("random", |random| both(random, |random| loose(random, 1.0, 1.0))),
    ("slivers", |random| both(random, |random| loose(random, 1.0, 1e-7))),
    ("needles", |random| both(random, needles)),
    ("coplanar", |random| [plate(1 << random.below(3)), moved(&plate(2), scale(random, 2), [0.0; 3])]),
    ("shared corners", shared_corners),
    ("terrain", |random| both(random, |random| terrain(3 + random.below(4), random.bits() >> 32))),
    ("nested boxes", |random| [nested(1 + random.below(4)), nested(1 + random.below(4))]),
    ("mixed scales", |random| both(random, mixed_scales)),
    ("soup", |random| both(random, |random| soup(20 + random.below(60), random.bits() >> 32))),
    ("points and segments", |random| both(random, |random| dirty(&loose(random, 1.0, 1.0), random.bits()))),
    ("combs", |random| [comb(8 + random.below(40)), comb(8 + random.below(40))]),
    ("spheres", |random| [dirty(&sphere(random.below(3) as u32), random.bits()), cube()]),
    ("far from the origin", far),
    ("size 1e-20", |random| both(random, |random| moved(&loose(random, 1.0, 0.01), 1e-20, [0.0; 3]))),
    ("size 1e15", |random| both(random, |random| moved(&loose(random, 1.0, 0.01), 1e15, [0.0; 3]))),
    ("subnormal", |random| {
        let scale = 2f64.powi(-126 - random.below(20) as i32);
        both(random, |random| moved(&loose(random, 1.0, 0.1), scale, [0.0; 3]))
    }),
    ("exponents of all sizes", |random| both(random, wild)),
    ("unequal sizes", |random| {
        let [a, b] = [(); 2].map(|()| 2f64.powi(random.below(120) as i32 - 60));
        [moved(&loose(random, 1.0, 0.1), a, [0.0; 3]), moved(&loose(random, 1.0, 0.1), b, [0.0; 3])]
    }),
];

pub(crate) type Make = fn(&mut Random) -> [Vec<Triangle>; 2];

/// Returns a power of two from 1 down to 2^-`most`.
fn scale(random: &mut Random, most: usize) -> f64 {
    2f64.powi(-(random.below(most + 1) as i32))
}

fn both(random: &mut Random, make: impl Fn(&mut Random) -> Vec<Triangle>) -> [Vec<Triangle>; 2] {
    [make(random), make(random)]
}

/// Makes up to 24 triangles of size `size` whose height is `flatness` times their width.
fn loose(random: &mut Random, size: f64, flatness: f64) -> Vec<Triangle> {
    let count = 1 + random.below(24);
    let thin = flatness.powf((random.signed() + 1.0) / 2.0);
    let triangle = |_| {
        let (place, first, second, slant) = (random.point(), random.point(), random.point(), random.signed());
        let corner = |x: f64, y: f64| [0, 1, 2].map(|k| size * (place[k] + x * first[k] + y * second[k]));
        [corner(0.0, 0.0), corner(1.0, 0.0), corner(slant, thin)]
    };
    rounded((0..count).map(triangle).collect())
}

/// Makes long triangles of almost no width, which all pass through the middle.
fn needles(random: &mut Random) -> Vec<Triangle> {
    let count = 1 + random.below(16);
    let needle = |_| {
        let (tip, width) = (random.point(), 10f64.powf(-4.0 + 3.0 * random.signed()));
        let off = random.point();
        let side = |sign: f64| [0, 1, 2].map(|k| -tip[k] + sign * width * off[k]);
        [tip, side(1.0), side(-1.0)]
    };
    rounded((0..count).map(needle).collect())
}

/// Makes two meshes of which B has corners and edges of A.
fn shared_corners(random: &mut Random) -> [Vec<Triangle>; 2] {
    let a = loose(random, 1.0, 0.01);
    let mut b = Vec::new();
    for _ in 0..1 + random.below(12) {
        let [p, q, r] = a[random.below(a.len())];
        let other = rounded(vec![[random.point(); 3]])[0][0];
        b.push([[p, q, other], [other, r, p], [q, other, p], [p, q, r]][random.below(4)]);
    }
    [a, b]
}

/// Makes boxes within boxes, each half as large as the one around it.
fn nested(count: usize) -> Vec<Triangle> {
    (0..count).flat_map(|level| moved(&cube(), 2f64.powi(-(level as i32)), [0.0; 3])).collect()
}

/// Makes triangles whose size and whose distance from the origin are each anywhere from 2^-60 to 1.
fn mixed_scales(random: &mut Random) -> Vec<Triangle> {
    let mut all = Vec::new();
    for _ in 0..1 + random.below(12) {
        let (scale, place) = (scale(random, 60), scale(random, 60));
        let offset = random.point().map(|x| x * place);
        all.extend(moved(&loose(random, 1.0, 0.1)[..1], scale, offset));
    }
    all
}

/// Makes triangles whose coordinates may have any exponent of f32 that a file accepts.
fn wild(random: &mut Random) -> Vec<Triangle> {
    let (low, count) = (random.below(240) as i32 - 149, 1 + random.below(10));
    let span = 1 + random.below((119 - low) as usize);
    let mut coordinate = || random.signed() * 2f64.powi(low + random.below(span) as i32);
    rounded((0..count).map(|_| [(); 3].map(|()| [(); 3].map(|()| coordinate()))).collect())
}

/// Makes two meshes around a place that needs an origin in f64, 2^20 to 2^48 times as far away as the meshes are
/// large.
fn far(random: &mut Random) -> [Vec<Triangle>; 2] {
    [(); 2].map(|()| {
        let far = 2f64.powi(20 + random.below(29) as i32);
        let offset = random.point().map(|x| x * far);
        let point = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] + offset[k]);
        loose(random, 1.0, 0.1).into_iter().map(|t| t.map(point)).collect()
    })
}

/// Returns the rotations that map the axes onto each other. Their entries are 0, 1 and -1, and placed corners are
/// exact.
pub(crate) fn exact_turns() -> Vec<[[f64; 3]; 3]> {
    let mut turns = Vec::new();
    for [x, y, z] in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]] {
        for signs in 0..8 {
            let row = |axis: usize, bit: usize| {
                [0, 1, 2].map(|k| if k != axis { 0.0 } else { 1.0 - 2.0 * (signs >> bit & 1) as f64 })
            };
            let rows = [row(x, 0), row(y, 1), row(z, 2)];
            // `Pose` refuses reflections.
            turns.extend(Pose::new(rows, [0.0; 3]).map(|pose| *pose.rotation()));
        }
    }
    turns
}

/// Returns a rotation: none, an exact one, any, a very small one, or one as far from rigid as is accepted.
pub(crate) fn turn(random: &mut Random) -> [[f64; 3]; 3] {
    let exact = exact_turns();
    let any = *random_pose(random, 0.0).rotation();
    match random.below(6) {
        0 => exact[0],
        1 => exact[random.below(exact.len())],
        2 => {
            let [x, y, z] = random.point().map(|x| x * 10f64.powf(-9.0 + 7.0 * random.signed()));
            rotation([x, y, z, (1.0 - x * x - y * y - z * z).sqrt()])
        }
        // Entries that are off by 2^-23 make products of rows off by less than 2^-20.
        3 => any.map(|row| row.map(|x| x + random.signed() * 2f64.powi(-23))),
        _ => any,
    }
}
