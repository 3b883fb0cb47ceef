//! How far apart the meshes are, and whether they are within a distance.
//!
//! Touching meshes are at distance 0. The answer then names the first contact that a walk for contact meets.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::leaf::queue::TrianglePair;
use crate::pose::Pose;
use crate::query::bounding_volumes::sphere_gap;
use crate::query::exact::TriangleDistance;
use crate::query::options::{DistanceOptions, check_distance};
use crate::query::pair_search::{BestPair, EachWithin, Finalists, NearestPairs, PairSearch, ids};
use crate::query::placed_pair::{FoundPair, PlacedPair, VisitPair, Walk, each_pair};
use crate::query::querier::Querier;
use crate::query::rounded::{between, limit_of_cores, sum_of_radii};
use crate::query::stats::QueryStats;

/// The least distance of two shapes. For shapes with radii, `triangle_a` and `triangle_b` are those of the cores, and the points
/// are on the rounded surfaces; where the shapes touch, both are one common point.
///
/// [`Querier::distance`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Distance {
    /// The distance in mesh units; 0 if and only if the meshes touch.
    pub distance: f64,
    /// A certified lower bound: the two triangles named here are at least this far apart. If the query allowed an
    /// error, no two triangles of the meshes are nearer. Exact arithmetic, not this bound, decides whether the meshes
    /// touch.
    pub lower: f64,
    /// A certified upper bound: the two triangles, and so the meshes, are at most this far apart.
    pub upper: f64,
    /// The closest point on A, in A's frame.
    pub point_a: [f64; 3],
    /// The closest point on B, in A's frame.
    pub point_b: [f64; 3],
    /// The number that the object of A has in its file.
    pub object_a: u32,
    /// The triangle of A with the closest point: its number in the input.
    pub triangle_a: u32,
    /// The number that the object of B has in its file.
    pub object_b: u32,
    /// The triangle of B with the closest point.
    pub triangle_b: u32,
}

impl BestPair {
    /// Returns the pair as an answer, given `PairSearch::proved`.
    pub(super) fn distance(&self, proved: f64) -> Distance {
        let lower = if self.closest.distance == 0.0 { 0.0 } else { proved };
        let (object_a, object_b) = self.found.numbers;
        Distance {
            distance: self.closest.distance,
            lower,
            upper: self.closest.upper,
            point_a: self.closest.point_a,
            point_b: self.closest.point_b,
            object_a,
            triangle_a: self.ids.0,
            object_b,
            triangle_b: self.ids.1,
        }
    }
}

impl Querier {
    /// Returns the least distance of the meshes, with B placed by `pose` in A's frame, both closest points and their
    /// triangles.
    ///
    /// The distance is that of the triangles on the placed vertices, to within a few roundings of f64 at the scale of the
    /// two closest triangles. It has the same bits on all backends.
    ///
    /// ```
    /// use bvh_query::{Distance, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// # let mesh = bvh_bake::mesh::Mesh::from_triangles(corners, vec![[0, 1, 2]]);
    /// # let triangle = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&mesh, &Default::default())?.0)?;
    /// let above = Pose::new(*Pose::IDENTITY.rotation(), [0.0, 0.0, 1.5])?;
    /// let Distance { distance, lower, upper, point_a, point_b, triangle_b, .. } =
    ///     Querier::new()?.distance(&block, &triangle, &above)?;
    /// assert_eq!((distance, triangle_b), (0.5, 0));
    /// assert!(lower <= distance && distance <= upper);
    /// assert_eq!((point_a[2], point_b[2]), (1.0, 1.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, [`QueryError::Budget`] if the budget does not
    /// suffice.
    pub fn distance<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        self.distance_with(a, b, pose, &DistanceOptions::default())
    }

    /// Returns the distance of two cores, as a part of a larger question.
    pub(super) fn distance_of_cores(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Distance, QueryError> {
        let mut search = PairSearch::between_shapes(DistanceOptions::default(), 0.0);
        let best = self.nearest(a, b, pose, &mut search)?.ok_or_else(|| no_answer(a))?;
        Ok(best.distance(search.proved()))
    }

    /// Returns a distance that may exceed the least one by an allowed error, which saves time. `lower` is the bound
    /// that was proved. Different backends may return different allowed answers.
    ///
    /// ```
    /// use bvh_query::{DistanceOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let beside = Pose::new(*Pose::IDENTITY.rotation(), [2.5, 0.0, 0.0])?;
    /// let within_a_tenth = DistanceOptions::new().rel_err(0.1);
    /// let found = Querier::new()?.distance_with(&block, &block, &beside, &within_a_tenth)?;
    /// assert!(found.lower <= 0.5 && 0.5 <= found.upper && found.distance <= 0.55);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if an allowed error is negative, NaN or infinite; else the errors of
    /// [`Querier::distance`].
    pub fn distance_with<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &DistanceOptions,
    ) -> Result<Distance, QueryError> {
        options.check()?;
        let (a, b) = (a.into(), b.into());
        self.start();
        self.distance_between(a, b, pose, options)
    }

    /// Returns the distance of two shapes, as a part of a larger question.
    pub(super) fn distance_between(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &DistanceOptions,
    ) -> Result<Distance, QueryError> {
        let mut search = PairSearch::between_shapes(*options, sum_of_radii(a, b));
        // Shapes have triangles, and nothing is pruned before a distance is known.
        let best = self.nearest(a, b, pose, &mut search)?.ok_or_else(|| no_answer(a))?;
        self.distance_of_shapes(a, b, pose, best.distance(search.proved()))
    }

    /// Returns the answer of [`Querier::distance`] if the distance is at most `limit`; if it is not, perhaps `None`.
    pub(crate) fn distance_below<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        limit: f64,
    ) -> Result<Option<Distance>, QueryError> {
        let (a, b) = (a.into(), b.into());
        self.start();
        let mut search = PairSearch::new(DistanceOptions::default(), f64::INFINITY);
        search.limit_to(limit_of_cores(a, b, limit).next_up());
        match self.nearest(a, b, pose, &mut search)? {
            Some(best) => self.distance_of_shapes(a, b, pose, best.distance(search.proved())).map(Some),
            // Surfaces are farther apart than the limit, but what is inside a solid touches it.
            None if self.inside_point(a, b, pose)?.is_some() => {
                self.distance_between(a, b, pose, &DistanceOptions::default()).map(Some)
            }
            None => Ok(None),
        }
    }

    /// Turns the distance of two cores into that of the shapes.
    pub(super) fn distance_of_shapes(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        core: Distance,
    ) -> Result<Distance, QueryError> {
        let sum = sum_of_radii(a, b);
        let meet_at = |point| Distance {
            distance: 0.0,
            lower: 0.0,
            upper: 0.0,
            point_a: point,
            point_b: point,
            ..core
        };
        if sum > 0.0 {
            let near = core.upper <= sum || core.lower <= sum && self.cores_within(a, b, pose, sum)?;
            if near {
                // At most as far from either core as the radius there.
                return Ok(meet_at(between(core.point_a, core.point_b, a.radius() / sum)));
            }
        }
        if core.distance == 0.0 {
            return Ok(core);
        }
        if let Some(point) = self.inside_point(a, b, pose)? {
            return Ok(meet_at(point));
        }
        if sum == 0.0 {
            return Ok(core);
        }
        // The shapes do not touch, so the distance must not round to zero.
        let distance = (core.distance - sum).max(f64::MIN_POSITIVE);
        let share = |radius: f64| (radius / core.distance).min(1.0);
        Ok(Distance {
            distance,
            lower: (core.lower - sum).next_down().clamp(0.0, distance),
            upper: (core.upper - sum).next_up().max(distance),
            point_a: between(core.point_a, core.point_b, share(a.radius())),
            point_b: between(core.point_b, core.point_a, share(b.radius())),
            ..core
        })
    }

    /// Returns the closest pair of triangles within the limit of `search`; of touching meshes, the first contact.
    ///
    /// Which contact the search meets depends on the backend, because its order follows bounds of distances. The answer
    /// must not depend on it, so a second walk, for contact only, names the pair.
    pub(super) fn nearest(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        search: &mut PairSearch,
    ) -> Result<Option<BestPair>, QueryError> {
        self.search(a, b, pose, search)?;
        if let Some(touching) = search.touching {
            return Ok(match self.first_contact(a, b, pose)? {
                Some(first) => Some(first),
                // In a file with forged bounds the walk for contact may miss what the search has met.
                None => each_pair(a, b, pose, |placed| {
                    let is_its = placed.numbers == touching.numbers;
                    is_its.then(|| self.contact(placed, touching.pair)).transpose()
                })?,
            });
        }
        Ok(search.best)
    }

    /// Returns whether the placed meshes are at most `d` apart, in mesh units. `within` at 0 is
    /// [`Querier::collide`].
    ///
    /// The answer is exact, also if `d` is between the bounds of [`Querier::distance`]. Integers of any length decide
    /// such a case; a warm query allocates nothing else.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let beside = Pose::new(*Pose::IDENTITY.rotation(), [2.5, 0.0, 0.0])?;
    /// assert!(querier.within(&block, &block, &beside, 0.5)?);
    /// assert!(!querier.within(&block, &block, &beside, 0.5_f64.next_down())?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if `d` is negative, NaN or infinite; else the errors of [`Querier::distance`].
    pub fn within<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        d: f64,
    ) -> Result<bool, QueryError> {
        check_distance(d)?;
        self.start();
        self.shapes_within(a.into(), b.into(), pose, d)
    }

    /// Looks for the closest pair within the limit of `search`.
    pub(super) fn search(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        search: &mut PairSearch,
    ) -> Result<(), QueryError> {
        each_pair(a, b, pose, |placed| {
            self.memory.budget.visit()?;
            let gap = sphere_gap(placed.pair.placement, placed.pair.object_a, placed.pair.object_b);
            if gap > f64::from(search.limit()) {
                return Ok(None);
            }
            self.walk_nearest(placed, search, None)?;
            Ok(search.done.then_some(()))
        })?;
        Ok(())
    }

    /// Looks for the closest pair of triangles of two objects within the limit of `search`. With a distance and a visitor, it
    /// passes on each pair within the distance instead, and returns what the visitor broke with.
    pub(super) fn walk_nearest(
        &mut self,
        placed: &PlacedPair<'_>,
        search: &mut PairSearch,
        each_within: Option<(f64, VisitPair<'_>)>,
    ) -> Result<Option<TrianglePair>, QueryError> {
        self.queue.clear();
        self.start_placed();
        self.bounded.clear();
        let finalists = Finalists {
            placed,
            direction: search.direction(),
            search,
            each_within: each_within.map(|(d, visit)| EachWithin { d, visit, found: None }),
            queue: &mut self.queue,
            bounded: &mut self.bounded,
            stats: QueryStats::default(),
        };
        let mut visitor = NearestPairs { packets: &mut self.packets, finalists };
        let task = &mut Walk { pair: &placed.pair, memory: &mut self.memory, visitor: &mut visitor };
        let tests = self.backend.run(task)?;
        let Finalists { stats, each_within, .. } = visitor.finalists;
        self.stats.add(tests, stats);
        Ok(each_within.and_then(|each| each.found))
    }

    /// Returns the answer for touching meshes: the first contact that a walk meets, the same on every backend.
    #[cold]
    pub(super) fn first_contact(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
    ) -> Result<Option<BestPair>, QueryError> {
        each_pair(a, b, pose, |placed| {
            let pair = self.find_contact(placed)?;
            pair.map(|pair| self.contact(placed, pair)).transpose()
        })
    }

    /// Returns the answer that names a pair of triangles in contact.
    fn contact(&self, placed: &PlacedPair<'_>, pair: TrianglePair) -> Result<BestPair, QueryError> {
        let triangle_a = placed.triangle_a(pair.a, pair.lane_a)?;
        let triangle_b = placed.triangle_b(pair.b, pair.lane_b)?;
        let closest = self.backend.run(TriangleDistance(&triangle_a, &triangle_b));
        Ok(BestPair { closest, found: FoundPair { numbers: placed.numbers, pair }, ids: ids(placed, &pair)? })
    }
}

/// Returns the error of a distance without a pair of triangles, which only a forged file can bring about.
#[cold]
pub(super) fn no_answer(a: Shape<'_>) -> QueryError {
    let at = a.bvh().layout().page_offset(0);
    bvh_format::FormatError::new(bvh_format::Rule::VertexFinite, at, "finite triangles", "none").into()
}
