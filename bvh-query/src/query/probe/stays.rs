//! Finds where a ray enters and leaves shapes with a radius, from where it is within the radius of each triangle.
//!
//! The points within the radius of a triangle are convex, so a ray is among them for one interval. The intervals of an instance are
//! joined where they meet, or where their bounds do not prove that they are apart. What is left are the intervals of the whole shape.

use crate::narrow::{Crossing, Ray, RoundedRay, Triangle, dot};
use crate::query::probe::line::Numbers;

/// A triangle within whose radius a ray comes.
pub(super) struct Rounded {
    triangle: Triangle,
    radius: f64,
    numbers: Numbers,
    /// How far along the ray the triangle is, about.
    along: f64,
}

impl Rounded {
    pub(super) fn new(ray: &Ray, (triangle, radius): (&Triangle, f64), numbers: Numbers) -> Self {
        let along = triangle.iter().map(|corner| dot(*corner, ray.direction)).sum();
        Self { triangle: *triangle, radius, numbers, along }
    }
}

/// An interval of a ray, and the triangles that each of its ends belongs to.
#[derive(Clone, Copy)]
struct Stay {
    entry: (Crossing, Numbers),
    exit: (Crossing, Numbers),
}

impl Stay {
    /// Returns whether two intervals are of one instance and may have a point in common.
    fn may_meet(&self, other: &Self) -> bool {
        self.entry.1.0 == other.entry.1.0
            && self.entry.0.lower <= other.exit.0.upper
            && other.entry.0.lower <= self.exit.0.upper
    }

    /// Makes one interval of two that meet.
    fn join(&mut self, other: &Self) {
        let (first, last) = (self.entry.0, self.exit.0);
        if (other.entry.0.t, other.entry.1) < (first.t, self.entry.1) {
            self.entry = other.entry;
        }
        if (-other.exit.0.t, other.exit.1) < (-last.t, self.exit.1) {
            self.exit = other.exit;
        }
        let (entry, exit) = (&mut self.entry.0, &mut self.exit.0);
        (entry.lower, entry.upper) =
            (first.lower.min(other.entry.0.lower), first.upper.min(other.entry.0.upper));
        (exit.lower, exit.upper) = (last.lower.max(other.exit.0.lower), last.upper.max(other.exit.0.upper));
    }
}

/// Returns the ends of the intervals, up to a parameter `until`, of a ray that comes within the radius of each of some triangles up to
/// there: in the order of their parameters, so that entries and exits of an instance alternate.
///
/// The order of the triangles does not matter. Cost: a few microseconds per triangle, and much less for those which are between the
/// ends of what is known already, as they are taken in the order along the ray.
pub(super) fn ends(ray: &Ray, until: f64, met: &[Rounded]) -> Vec<(Crossing, Numbers)> {
    let mut stays: Vec<Stay> = Vec::new();
    let words = |(at, of): (usize, &Rounded)| {
        let (instance, object, triangle) = of.numbers;
        key(u64::from(instance) << 32 | u64::from(object), of.along, u64::from(triangle) << 32 | at as u64)
    };
    for at in in_order(met.iter().enumerate().map(words).collect()) {
        let &Rounded { ref triangle, radius, numbers, .. } = &met[at];
        let rounded = RoundedRay::new(ray, triangle, radius);
        let known = stays.last_mut().filter(|known| known.entry.1.0 == numbers.0);
        if known.as_ref().is_some_and(|known| rounded.is_between(known.entry.0.upper, known.exit.0.lower)) {
            continue;
        }
        let Some([entry, exit]) = rounded.stay(until) else { continue };
        let stay = Stay { entry: (entry, numbers), exit: (exit, numbers) };
        match known {
            Some(known) if known.may_meet(&stay) => known.join(&stay),
            _ => stays.push(stay),
        }
    }
    let words = |(at, stay): (usize, &Stay)| key(stay.entry.1.0.into(), stay.entry.0.lower, at as u64);
    let mut joined: Vec<Stay> = Vec::new();
    for at in in_order(stays.iter().enumerate().map(words).collect()) {
        match joined.last_mut() {
            Some(earlier) if earlier.may_meet(&stays[at]) => earlier.join(&stays[at]),
            _ => joined.push(stays[at]),
        }
    }
    let ends = joined.iter().flat_map(|stay| [stay.entry, stay.exit]);
    let ends: Vec<_> = ends.filter(|(crossing, _)| crossing.t <= until).collect();
    // At equal parameters, an entry stays before its exit.
    let words = |(at, end): (usize, &(Crossing, Numbers))| key(0, end.0.t, at as u64);
    in_order(ends.iter().enumerate().map(words).collect()).map(|at| ends[at]).collect()
}

/// A key of three words: a number, another one in the order of `f64::total_cmp`, and a place in the lower half of the last word.
fn key(first: u64, x: f64, last: u64) -> [u64; 3] {
    [first, x.to_bits() ^ (((x.to_bits() as i64 >> 63) as u64) | 1 << 63), last]
}

/// Returns the places in keys in their ascending order. The library has this sort already: pages need not load another one.
fn in_order(mut keys: Vec<[u64; 3]>) -> impl Iterator<Item = usize> {
    keys.sort_unstable();
    keys.into_iter().map(|[.., last]| last as u32 as usize)
}
