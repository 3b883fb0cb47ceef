//! Where the closest surface to a point is.
//!
//! Triangles are bounded in f32, up to sixteen at a time. Those that may be the closest are kept, and measured in f64
//! at the end, nearest first. Pruning is strict, as in [`crate::query::pair_search`], so the answer does not depend on the
//! order of visits.

use crate::error::{NumberError, QueryError};
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::file::shape::Shape;
use crate::isa::{Isa, Lanes, Task};
use crate::leaf::frame::scale_of;
use crate::leaf::point_bounds::{LocalPoint, point_bounds};
use crate::narrow::{Closest, Point, point_distance, triangles_below, triangles_within};
use crate::numerics::{MAX_STRETCH, SLACK, round_up};
use crate::pose::Pose;
use crate::query::exact::{placed, stored};
use crate::query::probe::bounded::BoundedTriangle;
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::probe::point::{check_point, sum_of_magnitudes};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::traverse::point_filter::PointFilter;
use crate::traverse::probe_walk::ProbeVisitor;
use crate::traverse::walk_memory::WalkMemory;
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use bvh_format::slabs::Group;

/// Bounded triangles kept before the nearest are measured and the rest is thinned out.
const MAX_BOUNDED: usize = 256;

/// The closest triangle so far.
#[derive(Clone, Copy)]
struct BestTriangle {
    closest: Closest,
    object: u32,
    /// Ids are read where they matter: of the answer, and of triangles that tie.
    place: TrianglePlace,
}

/// The closest point of a mesh to a given one.
///
/// [`Querier::closest_point`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ClosestPoint {
    /// The distance in mesh units; 0 if and only if the given point is on the mesh.
    pub distance: f64,
    /// The mesh is certainly at least this far away.
    pub lower: f64,
    /// The mesh is certainly at most this far away.
    pub upper: f64,
    /// The closest point, in the mesh's frame.
    pub point: [f64; 3],
    /// The number that its object has in the file.
    pub object: u32,
    /// Its triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle: u32,
}

impl Querier {
    /// Returns the closest point of a mesh to `point`, given in the mesh's frame, and its triangle. Returns `None` if
    /// the mesh is farther away than `within`, in mesh units, which may be infinite.
    ///
    /// The distance is that of the stored triangles, to within a few roundings of f64 at the scale of the closest
    /// triangle and its gap. Of equally near triangles, the answer names the one with the lowest numbers of object and
    /// triangle. It is decided exactly whether the mesh is farther away than `within`. The answer has the same bits on
    /// all backends. A coordinate below 2^-213 counts as 0. The distance from a rounded shape is that from its core less the
    /// radius; within the radius it is 0, and the closest point is the given one.
    ///
    /// ```
    /// use bvh_query::{ClosestPoint, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let found = querier.closest_point(&block, [3.0, 0.5, 0.0], f64::INFINITY)?;
    /// let Some(ClosestPoint { distance, point, .. }) = found else { panic!() };
    /// assert_eq!((distance, point), (2.0, [1.0, 0.5, 0.0]));
    /// assert!(querier.closest_point(&block, [3.0, 0.5, 0.0], 1.5)?.is_none());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate is not finite or beyond 2^120, or `within` is negative or NaN;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, [`QueryError::Budget`] if the budget does not
    /// suffice.
    pub fn closest_point<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        point: [f64; 3],
        within: f64,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        check_within(within)?;
        let point = check_point(&point)?;
        self.start();
        self.closest_point_of(&shape.into(), &point, within)
    }

    /// Returns the closest point to one that has been checked, as has `within`.
    pub(crate) fn closest_point_of(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
        within: f64,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        let radius = placed.shape.radius();
        if radius == 0.0 {
            return self.closest_of_core(placed, point, within, IsWithin::Closed);
        }
        let Some(core) = self.closest_of_core(placed, point, radius + within, IsWithin::Closed)? else {
            return Ok(None);
        };
        if core.upper <= radius
            || core.lower <= radius
                && self.closest_of_core(placed, point, radius, IsWithin::Closed)?.is_some()
        {
            return Ok(Some(ClosestPoint { distance: 0.0, lower: 0.0, upper: 0.0, point: *point, ..core }));
        }
        Ok(Some(beyond(core, *point, radius)))
    }

    /// Returns the closest point of a core to one that has been checked, as has `within`.
    pub(crate) fn closest_of_core(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
        within: f64,
        is_within: IsWithin,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        let mut search = TriangleSearch {
            point: *point,
            is_within,
            within,
            limit: within * (1.0 + SLACK),
            best: None,
            settled_lower: f64::INFINITY,
        };
        for index in 0..placed.shape.objects().len() {
            self.memory.budget.visit()?;
            let (memory, bounded) = (&mut self.memory, &mut self.bounded_triangles);
            let (tests, stats) =
                self.backend.run(SearchObject { search: &mut search, placed, index, memory, bounded })?;
            self.stats.add(tests, stats);
        }
        search.answer(placed.shape)
    }
}

/// Refuses an invalid limit. Infinity means that there is no limit.
pub(crate) fn check_within(within: f64) -> Result<(), QueryError> {
    if within >= 0.0 { Ok(()) } else { Err(NumberError::Within(within).into()) }
}

/// Whether a triangle that is exactly as far away as the limit counts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum IsWithin {
    Closed,
    Open,
}

/// Returns the closest point of a rounded shape, given that of its core, which is farther away than the radius.
pub(super) fn beyond(core: ClosestPoint, point: Point, radius: f64) -> ClosestPoint {
    // The point is not on the surface, so the distance must not round to zero.
    let distance = (core.distance - radius).max(f64::MIN_POSITIVE);
    let share = (radius / core.distance).min(1.0);
    ClosestPoint {
        distance,
        lower: (core.lower - radius).next_down().clamp(0.0, distance),
        upper: (core.upper - radius).next_up().max(distance),
        point: [0, 1, 2].map(|k| core.point[k] + share * (point[k] - core.point[k])),
        ..core
    }
}

/// What is known of a point, over all objects.
struct TriangleSearch {
    point: Point,
    is_within: IsWithin,
    within: f64,
    /// Triangles whose lower bound exceeds it do not matter.
    limit: f64,
    best: Option<BestTriangle>,
    /// The least certified lower bound of the triangles that were measured.
    settled_lower: f64,
}

impl TriangleSearch {
    fn answer(&self, shape: Shape<'_>) -> Result<Option<ClosestPoint>, QueryError> {
        let Some(BestTriangle { closest, object, place }) = self.best else { return Ok(None) };
        let of = &shape.objects()[object as usize - shape.first()];
        let triangle = shape.bvh().triangle_id(of, place)?;
        let Closest { distance, upper, point_a, .. } = closest;
        // Triangles that were left out are certainly farther than one that was measured.
        let lower = if distance == 0.0 { 0.0 } else { self.settled_lower };
        Ok(Some(ClosestPoint { distance, lower, upper, point: point_a, object, triangle }))
    }
}

/// Searches an object.
struct SearchObject<'a> {
    search: &'a mut TriangleSearch,
    placed: &'a PlacedShape<'a>,
    index: usize,
    memory: &'a mut WalkMemory,
    bounded: &'a mut Vec<BoundedTriangle>,
}

impl Task for SearchObject<'_> {
    /// The number of node tests, and what else was done.
    type Output = Result<(u64, QueryStats), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self { search, placed, index, memory, bounded } = self;
        bounded.clear();
        let mut visitor = NearestTriangles::new(isa, search, placed, index, bounded);
        let tests = isa.run(memory.probe_walk(visitor.bvh, visitor.object, &mut visitor))?;
        visitor.settle(isa)?;
        let limit = f64::from(visitor.limit) / (visitor.scale * visitor.stretch);
        let stats = visitor.stats;
        search.limit = search.limit.min(limit);
        Ok((tests, stats))
    }
}

/// Collects triangles of an object that may be the closest.
struct NearestTriangles<'a> {
    search: &'a mut TriangleSearch,
    bvh: &'a Bvh,
    object: &'a Object,
    pose: Option<&'a Pose>,
    /// The number of the object in its file.
    number: u32,
    /// How many units of the filters a mesh unit is, a power of two.
    scale: f64,
    /// More than the square of how much longer a distance may be in the object's frame: 1 if that is the question's.
    stretch: f64,
    /// The limit in the unit of filters.
    limit: f32,
    test: PointFilter,
    local: LocalPoint,
    /// Room for packets that are encoded.
    rooms: [Packet; 4],
    bounded: &'a mut Vec<BoundedTriangle>,
    stats: QueryStats,
}

impl<'a> NearestTriangles<'a> {
    #[inline(always)]
    fn new<I: Isa>(
        isa: I,
        search: &'a mut TriangleSearch,
        placed: &'a PlacedShape<'a>,
        index: usize,
        bounded: &'a mut Vec<BoundedTriangle>,
    ) -> Self {
        let (bvh, object, pose) = (placed.shape.bvh(), &placed.shape.objects()[index], placed.pose.as_ref());
        let into = IntoObject::new(pose, object);
        let (point, [lo, hi]) = (into.point(search.point), &into.bounds);
        let farthest =
            (0..3).fold(0.0f64, |far, k| far.max((point[k] - lo[k]).abs()).max((hi[k] - point[k]).abs()));
        let error = into.error(sum_of_magnitudes(&search.point) + sum_of_magnitudes(&point));
        let stretch = if pose.is_some() { MAX_STRETCH } else { 1.0 };
        let scale = scale_of(farthest);
        Self {
            bvh,
            object,
            pose,
            number: (placed.shape.first() + index) as u32,
            scale,
            stretch,
            limit: round_up(search.limit * stretch * scale),
            test: PointFilter::new(isa, &point, object.profile().directions(), error, scale as f32),
            local: LocalPoint::new(&point, error, scale as f32),
            rooms: [Packet::NONE; 4],
            search,
            bounded,
            stats: QueryStats::default(),
        }
    }

    /// Measures the bounded triangles that still may be the closest, nearest first.
    #[inline(always)]
    fn settle<I: Isa>(&mut self, isa: I) -> Result<(), QueryError> {
        let limit = self.limit;
        self.bounded.retain(|triangle| triangle.lower <= limit);
        self.bounded.sort_unstable_by(|x, y| y.lower.total_cmp(&x.lower));
        while let Some(BoundedTriangle { lower, leaf, lane }) = self.bounded.pop() {
            if lower > self.limit {
                continue;
            }
            self.stats.exact_tests += 1;
            let (search, point) = (&*self.search, self.search.point);
            let mut triangle = stored(self.bvh, self.object, leaf, lane)?;
            if let Some(pose) = self.pose {
                triangle = placed(&triangle, pose);
            }
            let closest = point_distance(isa, &triangle, point);
            let place = TrianglePlace { page: leaf.page, packet: leaf.packet, lane };
            let is_better = match &search.best {
                // Objects come in the order of their numbers.
                Some(best) if closest.distance == best.closest.distance => {
                    self.number == best.object && self.id(place)? < self.id(best.place)?
                }
                best => best.as_ref().is_none_or(|best| closest.distance < best.closest.distance),
            };
            let is_within = match search.is_within {
                _ if search.within == f64::INFINITY => true,
                IsWithin::Closed => triangles_within(&triangle, &[point; 3], &closest, search.within),
                IsWithin::Open => triangles_below(&triangle, &[point; 3], &closest, search.within),
            };
            if is_better && is_within {
                self.search.best = Some(BestTriangle { closest, object: self.number, place });
            }
            self.search.settled_lower = self.search.settled_lower.min(closest.lower);
            self.limit = self.limit.min(round_up(closest.upper * (1.0 + SLACK) * self.stretch * self.scale));
        }
        self.bounded.clear();
        Ok(())
    }

    /// Returns the number of a triangle in the input.
    fn id(&self, place: TrianglePlace) -> Result<u32, QueryError> {
        self.bvh.triangle_id(self.object, place)
    }
}

impl ProbeVisitor for NearestTriangles<'_> {
    #[inline(always)]
    fn bounds<I: Isa>(&self, isa: I, children: &Group) -> I::F32x4 {
        self.test.bounds(isa, children)
    }

    #[inline(always)]
    fn limit(&self) -> f32 {
        self.limit
    }

    #[inline(always)]
    fn leaves<I: Isa>(&mut self, isa: I, leaves: &[LeafPacket]) -> Result<(), QueryError> {
        self.stats.packet_tests += leaves.len() as u64;
        let (packets, valid) = self.bvh.packets(isa, self.object, leaves, &mut self.rooms)?;
        let bounds = point_bounds(isa, packets, &self.local);
        let nearest = isa.least(&bounds.upper, valid) as usize & 15;
        self.limit = self.limit.min(round_up(f64::from(bounds.upper[nearest]) * self.stretch));
        let mut left = valid & I::F32x16::bits(isa.load(&bounds.lower).le(isa.splat(self.limit)));
        while left != 0 {
            let at = left.trailing_zeros() as usize & 15;
            left &= left - 1;
            let (leaf, lane) = (leaves[at / 4], (at & 3) as u8);
            self.bounded.push(BoundedTriangle { lower: bounds.lower[at], leaf, lane });
        }
        if self.bounded.len() >= MAX_BOUNDED {
            self.settle(isa)?;
        }
        Ok(())
    }
}
