//! Three-vectors of lanes.
//!
//! Functions, not closures, take registers here and elsewhere: a closure may not be inlined, and what
//! is not inlined into a backend's function lacks its features.

use crate::isa::{Isa, Lanes};

/// x, y, z of several lanes.
pub(crate) type Vec3<T> = [T; 3];

/// Three points, or three edges.
pub(crate) type Corners<T> = [Vec3<T>; 3];

/// Three numbers, each in all of four lanes.
#[inline(always)]
pub(crate) fn splat4<I: Isa>(isa: I, v: [f32; 3]) -> Vec3<I::F32x4> {
    [isa.splat4(v[0]), isa.splat4(v[1]), isa.splat4(v[2])]
}

#[inline(always)]
pub(crate) fn sub<T: Lanes>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0].sub(b[0]), a[1].sub(b[1]), a[2].sub(b[2])]
}

#[inline(always)]
pub(crate) fn add<T: Lanes>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [a[0].add(b[0]), a[1].add(b[1]), a[2].add(b[2])]
}

/// The edges of a triangle: from each corner to the next.
#[inline(always)]
pub(crate) fn edges<T: Lanes>(t: &Corners<T>) -> Corners<T> {
    [sub(t[1], t[0]), sub(t[2], t[1]), sub(t[0], t[2])]
}

#[inline(always)]
pub(crate) fn dot<T: Lanes>(a: Vec3<T>, b: Vec3<T>) -> T {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2].mul(b[2])))
}

#[inline(always)]
pub(crate) fn cross<T: Lanes>(a: Vec3<T>, b: Vec3<T>) -> Vec3<T> {
    [
        a[2].neg_mul_add(b[1], a[1].mul(b[2])),
        a[0].neg_mul_add(b[2], a[2].mul(b[0])),
        a[1].neg_mul_add(b[0], a[0].mul(b[1])),
    ]
}

/// `v * factor + base`.
#[inline(always)]
pub(crate) fn along<T: Lanes>(base: Vec3<T>, factor: T, v: Vec3<T>) -> Vec3<T> {
    [v[0].mul_add(factor, base[0]), v[1].mul_add(factor, base[1]), v[2].mul_add(factor, base[2])]
}

/// The largest magnitude of the components.
#[inline(always)]
pub(crate) fn largest<T: Lanes>(v: Vec3<T>) -> T {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

#[inline(always)]
pub(crate) fn min3<T: Lanes>(v: Vec3<T>) -> T {
    v[0].min(v[1]).min(v[2])
}

#[inline(always)]
pub(crate) fn max3<T: Lanes>(v: Vec3<T>) -> T {
    v[0].max(v[1]).max(v[2])
}

/// The products of each corner with a direction.
#[inline(always)]
pub(crate) fn project<T: Lanes>(corners: &Corners<T>, direction: Vec3<T>) -> Vec3<T> {
    [dot(direction, corners[0]), dot(direction, corners[1]), dot(direction, corners[2])]
}

/// The largest magnitude of a component of three vectors.
#[inline(always)]
pub(crate) fn largest_of<T: Lanes>(vectors: &Corners<T>) -> T {
    largest(vectors[0]).max(largest(vectors[1])).max(largest(vectors[2]))
}
