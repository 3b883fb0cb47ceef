//! How far apart the meshes are, and whether they are within a distance.
//!
//! Touching meshes are at distance 0. The answer then names the first contact that a walk for contact meets.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::leaf::queue::TrianglePair;
use crate::pose::Pose;
use crate::query::answers::{Distance, QueryStats};
use crate::query::bounding_volumes::sphere_gap;
use crate::query::exact::TriangleDistance;
use crate::query::options::{DistanceOptions, check_distance};
use crate::query::pair_search::{BestPair, Finalists, NearestPairs, PairSearch, ids};
use crate::query::placed_pair::{FoundPair, PlacedPair, Walk, each_pair};
use crate::query::querier::Querier;
use crate::query::rounded::{limit_of_cores, sum_of_radii};

impl Querier {
    /// Returns the least distance of the meshes, with B placed by `pose` in A's frame, both closest points and their
    /// triangles.
    ///
    /// The distance is that of the triangles on the placed vertices, to within a few roundings of f64 at the scale of the
    /// two closest triangles. It has the same bits on all backends.
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
        let best = self.nearest(a, b, pose, &mut search)?;
        best.map(|best| self.distance_of_shapes(a, b, pose, best.distance(search.proved()))).transpose()
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
            self.queue.clear();
            self.start_placed();
            self.bounded.clear();
            let finalists = Finalists {
                placed,
                direction: search.direction(),
                search,
                each_within: None,
                queue: &mut self.queue,
                bounded: &mut self.bounded,
                stats: QueryStats::default(),
            };
            let mut visitor = NearestPairs { packets: &mut self.packets, finalists };
            let task = &mut Walk { pair: &placed.pair, memory: &mut self.memory, visitor: &mut visitor };
            let tests = self.backend.run(task)?;
            let stats = visitor.finalists.stats;
            self.stats.add(tests, stats);
            Ok(search.done.then_some(()))
        })?;
        Ok(())
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
