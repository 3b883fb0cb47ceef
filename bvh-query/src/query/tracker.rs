//! Temporal coherence: reuses the last answers about two meshes for the next pose.
//!
//! A tracker keeps two things, and neither affects an answer:
//!
//! - *A pair of triangles*, the last that was closest, near or in contact. In any pose, it is one of the pairs that the
//!   question is about. If it meets in the new pose, so do the meshes. Otherwise its distance in the new pose is
//!   measured in f64, and the certified upper bound limits the walk before it begins. The direction between its closest
//!   points is the first separating direction. The pair itself is not an answer: the walk prunes strictly beyond the
//!   limit, meets this pair or a nearer one, and decides as always.
//! - *Bounds* of the distance in an earlier pose, which are certified. No vertex of B moves farther than
//!   [`displacement`] from that pose to a new one, so the distance changes by no more. If the bounds decide the
//!   question, there is no walk.
//!
//! Both belong to two open files and the objects in question. They are forgotten when a question is about others.
//!
//! A walk that only looks for contact learns nothing about the distance. After the answer no, the tracker therefore
//! sometimes asks whether the meshes are within [`LOOK_AHEAD_MOTIONS`] times the last motion, with no more work than
//! the question took. If they are not, the next few answers are known. If they are, or if that takes too much work, the
//! tracker waits longer before it asks again. Conservative advancement bounds motion in the same way: B. Mirtich,
//! "Impulse-based Dynamic Simulation of Rigid Body Systems", 1996, section 2.3.2.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::narrow::{Triangle, triangles_intersect, triangles_within};
use crate::pose::Pose;
use crate::query::displacement::{displacement, size};
use crate::query::distance::Distance;
use crate::query::distance::no_answer;
use crate::query::exact::{TriangleDistance, placed, stored};
use crate::query::options::{DistanceOptions, check_distance};
use crate::query::pair_search::PairSearch;
use crate::query::placed_pair::FoundPair;
use crate::query::querier::Querier;
use crate::query::rounded::limit_of_cores;

/// Reuses the last results for two meshes, so that a query of a nearby pose costs less.
///
/// A tracker has queries of [`Querier`] and gives the same results, bit for bit. Keep one tracker for each pair
/// of meshes that moves along a path. Meshes and poses may come in any order: a pose far from the last one costs one
/// more test of two triangles, and other meshes make the tracker forget. A tracker holds some 300 bytes, borrows
/// nothing, and allocates nothing that the querier would not.
///
/// A query through a tracker makes fewer visits. It may therefore have an answer where the querier alone meets a
/// damaged page or exceeds its budget. Each object of B beyond the first counts as a visit, because the tracker bounds
/// how far it has moved.
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
    pair: Option<FoundPair>,
    bounds: Option<DistanceBounds>,
    /// How many questions to let pass before looking ahead again.
    wait: u32,
    /// The value that `wait` was last set to.
    waited: u32,
}

#[derive(Debug, Clone, Copy)]
struct Asked {
    sides: [(u64, usize, usize); 2],
    pose: Pose,
}

/// Certified bounds of the distance in a pose, in mesh units.
#[derive(Debug, Clone, Copy)]
struct DistanceBounds {
    pose: Pose,
    lower: f64,
    upper: f64,
}

/// How far to look ahead, in motions as long as the last one.
const LOOK_AHEAD_MOTIONS: f64 = 8.0;
/// The longest motion that counts as a small step, as a fraction of B's size. After a longer one, a pair that was near may
/// be anywhere, and looking ahead is in vain.
const MAX_STEP_PER_SIZE: f64 = 1.0 / 16.0;
/// The most questions to let pass between two looks ahead.
const MAX_QUESTIONS_BETWEEN_LOOKS: u32 = 64;

impl Tracker {
    /// Creates a tracker that remembers nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Answers [`Querier::collide`], by means of `querier`.
    ///
    /// # Errors
    /// The errors of [`Querier::collide`].
    pub fn collide<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<bool, QueryError> {
        self.within(querier, a, b, pose, 0.0)
    }

    /// Decides whether the surfaces of two cores touch.
    fn cores_touch(
        &mut self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<bool, QueryError> {
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

    /// Answers [`Querier::distance`], by means of `querier`.
    ///
    /// # Errors
    /// The errors of [`Querier::distance`].
    pub fn distance<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        querier.start();
        self.distance_between(querier, a.into(), b.into(), pose)
    }

    /// Returns the distance of two shapes, as a part of a larger question.
    pub(super) fn distance_between(
        &mut self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        querier.look_at_objects(b)?;
        let moved = self.turn_to(a, b, pose);
        let search = || PairSearch::new(DistanceOptions::default(), f64::INFINITY);
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
            // No pair near by is remembered, or one that no walk leads to, as a forged file may have it.
            None => {
                limited = search();
                querier.nearest(a, b, pose, &mut limited)?.ok_or_else(|| no_answer(a))?
            }
        };
        let core = best.distance(limited.proved());
        self.pair = Some(best.found);
        self.bounds = Some(DistanceBounds { pose: *pose, lower: core.lower, upper: core.upper });
        querier.distance_of_shapes(a, b, pose, core)
    }

    /// Answers [`Querier::within`], by means of `querier`; `d` is in mesh units.
    ///
    /// # Errors
    /// The errors of [`Querier::within`].
    pub fn within<'a>(
        &mut self,
        querier: &mut Querier,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        check_distance(d)?;
        let (a, b) = (a.into(), b.into());
        querier.start();
        querier.look_at_objects(b)?;
        let near = self.cores_within(querier, a, b, pose, limit_of_cores(a, b, d))?;
        Ok(near || querier.inside_point(a, b, pose)?.is_some())
    }

    /// Decides whether the surfaces of two cores are within a distance.
    fn cores_within(
        &mut self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        if d == 0.0 {
            return self.cores_touch(querier, a, b, pose);
        }
        let moved = self.turn_to(a, b, pose);
        match self.bounds(b, pose) {
            Some((lower, _)) if lower > d => return Ok(false),
            Some((_, upper)) if upper <= d => return Ok(true),
            _ => {}
        }
        let mut search = PairSearch::new(DistanceOptions::default(), d);
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
            self.pair = search.found();
        } else {
            self.look_ahead(querier, a, b, pose, (d, moved));
        }
        Ok(search.done)
    }

    /// Forgets what is not about these meshes. Returns how far B has moved since the last question, if that was about them
    /// too.
    fn turn_to(&mut self, a: Shape<'_>, b: Shape<'_>, pose: &Pose) -> Option<f64> {
        let sides = [a.identity(), b.identity()];
        let last = self.last.filter(|last| last.sides == sides);
        if last.is_none() {
            *self = Self::default();
        }
        self.last = Some(Asked { sides, pose: *pose });
        last.map(|last| displacement(b, &last.pose, pose))
    }

    /// Returns certified bounds of the distance in a new pose.
    fn bounds(&self, b: Shape<'_>, pose: &Pose) -> Option<(f64, f64)> {
        let held = self.bounds.as_ref()?;
        let moved = displacement(b, &held.pose, pose);
        Some(((held.lower - moved).next_down(), (held.upper + moved).next_up()))
    }

    /// Returns the remembered pair of triangles in a new pose. A damaged page is left for the walk to find.
    fn triangles(
        &self,
        querier: &mut Querier,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Option<(Triangle, Triangle)> {
        let FoundPair { numbers, pair } = self.pair?;
        let (object_a, object_b) = (a.numbered(numbers.0)?, b.numbered(numbers.1)?);
        let triangle_a = stored(a.bvh(), object_a, pair.a, pair.lane_a).ok()?;
        let triangle_b = stored(b.bvh(), object_b, pair.b, pair.lane_b).ok()?;
        querier.stats.exact_tests += 1;
        Some((triangle_a, placed(&triangle_b, pose)))
    }

    /// Asks whether meshes that are more than `beyond` apart have room for several more motions as long as the last
    /// one, `moved`. This takes at most as many visits as the query did, and its errors do not matter. The rest of the budget is
    /// left for what the query asks after it.
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
        let room = beyond + LOOK_AHEAD_MOTIONS * moved;
        let mut search = PairSearch::new(DistanceOptions::default(), room);
        let budget = querier.memory.budget.clone();
        querier.memory.budget.allow_as_much_again();
        let found = querier.search(a, b, pose, &mut search);
        querier.memory.budget = budget.after(querier.memory.budget.made());
        if found.is_ok() && !search.done {
            self.bounds = Some(DistanceBounds { pose: *pose, lower: room, upper: f64::INFINITY });
            self.waited = 0;
        } else {
            // The nearest pair known is perhaps the first to touch.
            self.pair = search.found().or(self.pair);
            self.waited = (2 * self.waited + 1).min(MAX_QUESTIONS_BETWEEN_LOOKS);
            self.wait = self.waited;
        }
    }
}

/// Returns whether a motion is known and a small step.
fn is_small(moved: Option<f64>, b: Shape<'_>) -> bool {
    moved.is_some_and(|moved| moved <= MAX_STEP_PER_SIZE * size(b.objects()))
}
