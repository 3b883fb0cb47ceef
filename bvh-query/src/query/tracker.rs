//! Temporal coherence: what the last answers about two meshes tell of the next one.
//!
//! Two things are kept, and neither shows in an answer:
//!
//! - *A pair of triangles*, the last that was closest, near or in contact. Whatever the pose, it is one of the pairs
//!   that the question is about. If it meets in the new pose, so do the meshes. Else its distance there, measured in
//!   f64 with its certified upper bound, limits the walk before it begins, and the direction between its closest
//!   points is the first witness axis. It is no answer itself: the walk prunes strictly beyond the limit, comes by
//!   this pair or a nearer one, and decides as it always does.
//! - *A clearance*: certified bounds of the distance in the pose of that time. No vertex of B is moved farther than
//!   [`motion`] from there to a new pose, so the new distance is within that of the old one. Where this says that
//!   the meshes are apart, or within d, or not, nothing is walked.
//!
//! Both belong to two open files and the objects asked about, and are forgotten when others come.
//!
//! A walk that only looks for contact learns nothing of clearance. So after the answer no, the tracker at times asks
//! further whether the meshes come as near as [`AHEAD`] times the last motion, with no more work than the question
//! took. If not, some next answers are known; if they do or that is too much work, it waits longer each time.
//! Conservative advancement bounds motion in the same way: B. Mirtich, "Impulse-based Dynamic Simulation of Rigid
//! Body Systems", 1996, section 2.3.2.

use super::distance::{DistanceOptions, Search, no_answer};
use super::exact::TriangleDistance;
use super::exact::{placed, stored};
use super::{Distance, Found, Querier};
use crate::bvh::Shape;
use crate::error::QueryError;
use crate::narrow::{Triangle, triangles_intersect, triangles_within};
use crate::pose::Pose;
use crate::traverse::align::POSE_ERROR;
use bvh_format::object::Object;

/// Remembers the last answers about two meshes, so that the next one, about a pose near by, costs less.
///
/// Its questions are those of [`Querier`], and so are the answers, bit for bit. Keep one for each pair of meshes
/// that moves along a path. It may be asked about any meshes and poses in any order: what does not fit what it
/// remembers costs a look at two triangles, and other meshes make it forget. It holds some 300 bytes, borrows
/// nothing, and allocates nothing that the querier would not.
///
/// A query through a tracker visits less, so that it may have an answer where the querier alone comes upon a damaged
/// page or the end of its budget.
///
/// ```
/// use bvh_query::{Bvh, Pose, Querier, Tracker};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
/// # let triangle = Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default())?.0)?;
/// let mut querier = Querier::new()?;
/// let mut tracker = Tracker::new();
/// for step in 0..100 {
///     let height = 1.0 - f64::from(step) / 128.0;
///     let pose = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, height])?;
///     assert_eq!(tracker.distance(&mut querier, &triangle, &triangle, &pose)?.distance, height);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, Default)]
pub struct Tracker {
    /// What the last question was about.
    last: Option<Asked>,
    pair: Option<Found>,
    clearance: Option<Clearance>,
    /// Questions to let pass before looking ahead again, and how many that was the last time.
    wait: u32,
    waited: u32,
}

#[derive(Debug, Clone, Copy)]
struct Asked {
    sides: [(u64, usize, usize); 2],
    pose: Pose,
}

/// Certified bounds of the distance in a pose, mesh units.
#[derive(Debug, Clone, Copy)]
struct Clearance {
    pose: Pose,
    lower: f64,
    upper: f64,
}

/// How many motions like the last one to look ahead.
const AHEAD: f64 = 8.0;
/// Beyond this fraction of B's size a motion is no small step: a pair that was near need not be, and looking ahead is
/// in vain.
const SMALL: f64 = 1.0 / 16.0;
/// The most questions to let pass.
const PATIENCE: u32 = 64;

impl Tracker {
    /// One that remembers nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// [`Querier::collide`], by `querier`.
    ///
    /// # Errors
    /// If a page that the query touches is damaged, or the budget does not suffice.
    pub fn collide<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<bool, QueryError> {
        let (a, b) = (a.into(), b.into());
        querier.start();
        let moved = self.turn_to(a, b, pose);
        if self.bounds(b, pose).is_some_and(|(lower, _)| lower > 0.0) {
            return Ok(false);
        }
        if let Some((triangle_a, triangle_b)) = self.triangles(querier, a, b, pose)
            && triangles_intersect(&triangle_a, &triangle_b)
        {
            return Ok(true);
        }
        let contact = querier.any_contact(a, b, pose)?;
        if contact.is_some() {
            self.pair = contact;
        } else {
            self.look_ahead(querier, a, b, pose, (0.0, moved));
        }
        Ok(contact.is_some())
    }

    /// [`Querier::distance`], by `querier`.
    ///
    /// # Errors
    /// If a page that the query touches is damaged, or the budget does not suffice.
    pub fn distance<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        let (a, b) = (a.into(), b.into());
        querier.start();
        let moved = self.turn_to(a, b, pose);
        let search = || Search::new(DistanceOptions::default(), f64::INFINITY);
        let (mut limited, mut found) = (search(), None);
        if let Some((triangle_a, triangle_b)) = self.triangles(querier, a, b, pose) {
            let closest = querier.backend.run(TriangleDistance(&triangle_a, &triangle_b));
            if closest.distance == 0.0 {
                found = querier.first_contact(a, b, pose)?;
            } else if is_small(moved, b) {
                limited.start_from(&closest);
                found = querier.nearest(a, b, pose, &mut limited)?;
            }
        }
        let best = match found {
            Some(best) => best,
            // Nothing near by is remembered, or a triangle that no walk leads to, as a forged file may have it.
            None => {
                limited = search();
                querier.nearest(a, b, pose, &mut limited)?.ok_or_else(|| no_answer(a))?
            }
        };
        let answer = best.distance(limited.proved());
        self.pair = Some(best.found);
        self.clearance = Some(Clearance { pose: *pose, lower: answer.lower, upper: answer.upper });
        Ok(answer)
    }

    /// [`Querier::within`], by `querier`; `d` in mesh units.
    ///
    /// # Errors
    /// If a page that the query touches is damaged, or the budget does not suffice.
    pub fn within<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        let (a, b) = (a.into(), b.into());
        if d == 0.0 {
            return self.collide(querier, a, b, pose);
        }
        if d.is_nan() || d < 0.0 || d == f64::INFINITY {
            return querier.within(a, b, pose, d);
        }
        querier.start();
        let moved = self.turn_to(a, b, pose);
        match self.bounds(b, pose) {
            Some((lower, _)) if lower > d => return Ok(false),
            Some((_, upper)) if upper <= d => return Ok(true),
            _ => {}
        }
        let mut search = Search::new(DistanceOptions::default(), d);
        if let Some((triangle_a, triangle_b)) = self.triangles(querier, a, b, pose) {
            let closest = querier.backend.run(TriangleDistance(&triangle_a, &triangle_b));
            if triangles_within(&triangle_a, &triangle_b, &closest, d) {
                return Ok(true);
            }
            if is_small(moved, b) {
                search.start_from(&closest);
            }
        }
        querier.search(a, b, pose, &mut search)?;
        if search.done {
            self.pair = search.best.map(|best| best.found);
        } else {
            self.look_ahead(querier, a, b, pose, (d, moved));
        }
        Ok(search.done)
    }

    /// Forgets what is not about these meshes. Returns how far B has moved since the last question.
    fn turn_to(&mut self, a: Shape<'_>, b: Shape<'_>, pose: &Pose) -> Option<f64> {
        let sides = [a.identity(), b.identity()];
        let last = self.last.filter(|last| last.sides == sides);
        if last.is_none() {
            *self = Self::default();
        }
        self.last = Some(Asked { sides, pose: *pose });
        last.map(|last| motion(b, &last.pose, pose))
    }

    /// Certified bounds of the distance in a new pose.
    fn bounds(&self, b: Shape<'_>, pose: &Pose) -> Option<(f64, f64)> {
        let held = self.clearance.as_ref()?;
        let moved = motion(b, &held.pose, pose);
        Some(((held.lower - moved).next_down(), (held.upper + moved).next_up()))
    }

    /// The pair of triangles in a new pose. A page that is damaged is left for the walk to find.
    fn triangles(
        &self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Option<(Triangle, Triangle)> {
        let Found { numbers, pair } = self.pair?;
        let (object_a, object_b) = (a.numbered(numbers.0)?, b.numbered(numbers.1)?);
        let triangle_a = stored(a.bvh(), object_a, pair.a, pair.lane_a).ok()?;
        let triangle_b = stored(b.bvh(), object_b, pair.b, pair.lane_b).ok()?;
        querier.stats.exact_tests += 1;
        Some((triangle_a, placed(&triangle_b, pose)))
    }

    /// Asks, of meshes more than `beyond` apart that moved by `moved`, whether there is room for more of that.
    /// Takes at most as many visits as the query did, and nothing that goes wrong matters.
    fn look_ahead(
        &mut self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        (beyond, moved): (f64, Option<f64>),
    ) {
        let Some(moved) = moved.filter(|_| is_small(moved, b)) else { return };
        if self.wait > 0 {
            self.wait -= 1;
            return;
        }
        let room = beyond + AHEAD * moved;
        let mut search = Search::new(DistanceOptions::default(), room);
        querier.stack.allow_as_much_again();
        if querier.search(a, b, pose, &mut search).is_ok() && !search.done {
            self.clearance = Some(Clearance { pose: *pose, lower: room, upper: f64::INFINITY });
            self.waited = 0;
        } else {
            // The nearest that is known, and so perhaps the first to touch.
            self.pair = search.best.map(|best| best.found).or(self.pair);
            self.waited = (2 * self.waited + 1).min(PATIENCE);
            self.wait = self.waited;
        }
    }
}

/// False for a motion that is not known, too.
fn is_small(moved: Option<f64>, b: Shape<'_>) -> bool {
    moved.is_some_and(|moved| moved <= SMALL * size(b))
}

/// The largest side of the boxes of a shape's objects, mesh units.
fn size(side: Shape<'_>) -> f64 {
    let of = |object: &Object| half_sides(object).into_iter().fold(0.0, f64::max);
    2.0 * side.objects().iter().map(of).fold(0.0, f64::max)
}

fn half_sides(object: &Object) -> [f64; 3] {
    let (lo, hi) = (&object.record.box_lo, &object.record.box_hi);
    [0, 1, 2].map(|axis| (f64::from(hi[axis].get()) - f64::from(lo[axis].get())) / 2.0)
}

/// An upper bound of how far any vertex of B moves from one pose to another, mesh units.
///
/// A vertex is at most the half sides h of its object's box away from the centre c of it, so that along axis i it
/// moves by at most |dR_i c + dt_i| + |dR_i| h, where dR and dt are the changes of rotation and translation.
///
/// Rounding: let m be the sum, over the axes, of the magnitudes of the origin, of both ends of the box and of both
/// translations; rows of rotations have entries of at most 1 + 2^-20. Each placed vertex is off by at most 8u m along an
/// axis, twice; centre, half sides and the changes by 8u m, the products and sums above by 16u m; u = 2^-53. That is
/// below 2^-47 m, and over the three axes below 2^-46 m, which is charged. Squares underflow below 2^-511, which is
/// charged too.
fn motion(b: Shape<'_>, from: &Pose, to: &Pose) -> f64 {
    let mut change = [[0.0; 3]; 3];
    let mut shift = [0.0; 3];
    let mut translations = 0.0;
    for i in 0..3 {
        let (t_from, t_to) = (from.translation()[i], to.translation()[i]);
        shift[i] = t_to - t_from;
        translations += t_from.abs() + t_to.abs();
        for j in 0..3 {
            change[i][j] = to.rotation()[i][j] - from.rotation()[i][j];
        }
    }
    let of = |object: &Object| {
        let record = &object.record;
        let h = half_sides(object);
        let (mut c, mut m) = ([0.0; 3], translations);
        for axis in 0..3 {
            let (lo, hi) = (f64::from(record.box_lo[axis].get()), f64::from(record.box_hi[axis].get()));
            let origin = record.origin[axis].get();
            c[axis] = origin + (lo + hi) / 2.0;
            m += origin.abs() + lo.abs() + hi.abs();
        }
        let mut squared = 0.0;
        for i in 0..3 {
            let d = change[i];
            let centre = d[0] * c[0] + d[1] * c[1] + d[2] * c[2] + shift[i];
            let turn = d[0].abs() * h[0] + d[1].abs() * h[1] + d[2].abs() * h[2];
            squared += (centre.abs() + turn).powi(2);
        }
        let root = f64::sqrt(squared) * (1.0 + 2f64.powi(-50));
        root + 4.0 * POSE_ERROR * m + 2f64.powi(-511)
    };
    b.objects().iter().map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use crate::traverse::opened::Leaf;

    /// Of the golden file's vertices, none goes farther than the bound; and the bound is not much farther than the
    /// farthest goes, and what is charged for rounding, of an origin at 2^22.
    #[test]
    fn no_vertex_moves_farther_than_the_bound() {
        let bvh = Bvh::from_static(include_bytes!("../../../testdata/ok-everything.cbvh")).unwrap();
        let mut state = 7u64;
        let mut signed = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for round in 0..200 {
            let scale = 10f64.powi(-(round % 16));
            let angles = [signed() * 3.0, 0.0].map(|angle| angle + scale * signed());
            let translation = [signed(), signed(), signed()].map(|x| 1e3 * x);
            let poses = angles.map(|angle| {
                let (sin, cos) = angle.sin_cos();
                let moved = translation.map(|x| x + scale * signed());
                Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], moved).unwrap()
            });
            let [from, to] = if round % 5 == 0 { [poses[0]; 2] } else { poses };
            let bound = motion(bvh.all(), &from, &to);
            let mut farthest = 0.0f64;
            for object in bvh.objects() {
                let h = half_sides(object);
                for number in object.pages() {
                    let page = bvh.page(object, number).unwrap();
                    for packet in 0..page.header().packets.get() {
                        let origin = object.record.origin.map(|o| o.get());
                        let leaf = Leaf { page: number, packet, triangles: 4 };
                        for v in (0..4).flat_map(|lane| bvh.triangle(object, leaf, lane).unwrap()) {
                            let point = [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]));
                            let (p, q) = (from.place(point), to.place(point));
                            let squared: f64 = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum();
                            farthest = farthest.max(squared.sqrt());
                        }
                    }
                }
                assert!(farthest <= bound, "{farthest} beyond {bound}");
                assert!(h.iter().all(|h| *h >= 0.0));
            }
            assert!(round % 5 != 0 || bound < 1e-6, "{bound} on the spot");
            assert!(bound <= 1e-6 + 100.0 * (farthest + scale), "{bound} for {farthest}");
        }
    }
}
