//! Where the closest surface to a point is.
//!
//! Triangles are bounded in f32, four against four points at a time. Those that may be the closest are kept, and measured in
//! f64 at the end, nearest first. Pruning is strict, as in [`crate::query::search`]: so the answer does not depend on the
//! order of visits, nor on which points walk together.

use crate::error::QueryError;
use crate::file::bvh::Bvh;
use crate::file::place::{LeafPacket, TrianglePlace};
use crate::file::shape::Shape;
use crate::isa::Isa;
use crate::leaf::local::{LocalFrame, valid_lanes};
use crate::leaf::placed_packet::PlacedPackets;
use crate::leaf::point::{LocalPoints, point_bounds};
use crate::narrow::{Closest, Point, point_distance, triangles_within};
use crate::query::answers::{ClosestPoint, QueryStats};
use crate::query::exact::stored;
use crate::query::options::check_distance;
use crate::query::probe::point::check_point;
use crate::query::querier::Querier;
use crate::traverse::align::round_up;
use crate::traverse::node_test::{Measure, gaps_along};
use crate::traverse::placement::{POSE_ERROR, Placement};
use crate::traverse::probe_walk::{PROBES, ProbeVisitor};
use bvh_format::kdop::{DirectionSet, FACTORS};
use bvh_format::leaf::Packet;
use bvh_format::object::Object;
use bvh_format::slabs::{Group, row};
use std::ops::ControlFlow;

/// Bounded triangles kept before the nearest are measured and the rest is thinned out.
const MAX_BOUNDED: usize = 256;

/// A triangle that may be the closest to a point, with bounds of its distance in mesh units.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct BoundedTriangle {
    lower: f32,
    leaf: LeafPacket,
    lane: u8,
    probe: u8,
}

/// The closest triangle so far.
#[derive(Clone, Copy)]
struct Best {
    closest: Closest,
    object: u32,
    triangle: u32,
}

impl Querier {
    /// Returns the closest point of a mesh to `point`, given in the mesh's frame, and its triangle. Nothing if the mesh is
    /// farther than `within`, in mesh units, which may be infinite.
    ///
    /// The distance is that of the stored triangles, to within a few roundings of f64 at the scale of the closest triangle and
    /// of its gap. Of equally near triangles, the answer names that with the lowest numbers of object and triangle. Whether the
    /// mesh is farther than `within` is decided exactly. It has the same bits on all backends. A coordinate below 2^-213
    /// counts as 0.
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate is not finite or beyond 2^120, or `within` is negative or NaN;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged, [`QueryError::Budget`] if the budget does not
    /// suffice.
    pub fn closest_point<'a>(
        &mut self,
        shape: impl Into<Shape<'a>>,
        point: [f64; 3],
        within: f64,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        let [closest, ..] = self.closest_points(shape.into(), &[point], within)?;
        Ok(closest)
    }

    /// Returns the closest points to up to four points, side by side.
    pub(crate) fn closest_points(
        &mut self,
        shape: Shape<'_>,
        points: &[Point],
        within: f64,
    ) -> Result<[Option<ClosestPoint>; PROBES], QueryError> {
        check_within(within)?;
        let mut all = [[0.0; 3]; PROBES];
        for (to, point) in all.iter_mut().zip(points) {
            *to = check_point(point)?;
        }
        self.start();
        let mut search = Search {
            points: all,
            within,
            limits: [round_up(within * (1.0 + 2f64.powi(-40))); PROBES],
            best: [None; PROBES],
            settled_lower: [f64::INFINITY; PROBES],
        };
        for (index, object) in shape.objects().iter().enumerate() {
            self.memory.visit()?;
            self.packets[0].start();
            self.bounded_triangles.clear();
            let mut visitor = Nearest::new(
                &mut search,
                (shape.bvh(), object),
                &mut self.packets[0],
                &mut self.bounded_triangles,
            );
            visitor.number = (shape.first() + index) as u32;
            let walk = self.memory.probe_walk(shape.bvh(), object, points.len(), &mut visitor);
            let tests = self.backend.run(walk)?;
            self.backend.run(Settle(&mut visitor))?;
            let stats = visitor.stats;
            self.stats.add(tests, stats);
        }
        Ok([0, 1, 2, 3].map(|probe| search.answer(probe)))
    }
}

/// Refuses a limit that means nothing. Infinity is none.
pub(super) fn check_within(within: f64) -> Result<(), QueryError> {
    if within == f64::INFINITY { Ok(()) } else { check_distance(within) }
}

/// What is known of all points, over all objects.
struct Search {
    points: [Point; PROBES],
    within: f64,
    /// Triangles whose lower bound exceeds the limit of a point do not matter to it.
    limits: [f32; PROBES],
    best: [Option<Best>; PROBES],
    /// The least certified lower bounds of the triangles that were measured.
    settled_lower: [f64; PROBES],
}

impl Search {
    fn answer(&self, probe: usize) -> Option<ClosestPoint> {
        let Best { closest, object, triangle } = self.best[probe]?;
        let Closest { distance, upper, point_a, .. } = closest;
        // Triangles that were left out are beyond the limit, which has only ever decreased.
        let lower = self.settled_lower[probe].min(f64::from(self.limits[probe]));
        let lower = if distance == 0.0 { 0.0 } else { lower };
        Some(ClosestPoint { distance, lower, upper, point: point_a, object, triangle })
    }
}

/// Collects triangles of an object that may be the closest.
struct Nearest<'a> {
    search: &'a mut Search,
    bvh: &'a Bvh,
    object: &'a Object,
    /// The number of the object in its file.
    number: u32,
    set: DirectionSet,
    /// The points around the object's origin.
    points: [Point; PROBES],
    /// Their slabs, in columns.
    slabs: Group,
    frame: LocalFrame,
    packets: &'a mut PlacedPackets,
    bounded: &'a mut Vec<BoundedTriangle>,
    stats: QueryStats,
}

impl<'a> Nearest<'a> {
    fn new(
        search: &'a mut Search,
        (bvh, object): (&'a Bvh, &'a Object),
        packets: &'a mut PlacedPackets,
        bounded: &'a mut Vec<BoundedTriangle>,
    ) -> Self {
        let origin = object.origin();
        let points = search.points.map(|point| [0, 1, 2].map(|k| point[k] - origin[k]));
        let [lo, hi] = object.bounding_box();
        let magnitude = (0..3).map(|k| {
            let farthest = points.iter().fold(0.0f64, |far, point| far.max(point[k].abs()));
            farthest + (lo[k] - origin[k]).abs() + (hi[k] - origin[k]).abs() + origin[k].abs()
        });
        let error = POSE_ERROR * magnitude.sum::<f64>();
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let placement = Placement { rotation: identity, translation: [0.0; 3], error };
        let set = object.profile().directions();
        Self {
            search,
            bvh,
            object,
            number: 0,
            set,
            points,
            slabs: slabs_of(&points, set, error),
            frame: LocalFrame::new(&placement, object, object),
            packets,
            bounded,
            stats: QueryStats::default(),
        }
    }

    /// Measures the bounded triangles that still may be the closest, nearest first.
    #[inline(always)]
    fn settle<I: Isa>(&mut self, _isa: I) -> Result<(), QueryError> {
        self.bounded.sort_unstable_by(|x, y| y.lower.total_cmp(&x.lower));
        while let Some(BoundedTriangle { lower, leaf, lane, probe }) = self.bounded.pop() {
            let probe = usize::from(probe) % PROBES;
            if lower > self.search.limits[probe] {
                continue;
            }
            self.stats.exact_tests += 1;
            let triangle = stored(self.bvh, self.object, leaf, lane)?;
            let point = self.search.points[probe];
            let closest = point_distance(&triangle, point);
            let settled = &mut self.search.settled_lower[probe];
            *settled = settled.min(closest.lower);
            let is_better = match &self.search.best[probe] {
                Some(best) if closest.distance == best.closest.distance => {
                    (self.number, self.id(leaf, lane)?) < (best.object, best.triangle)
                }
                Some(best) => closest.distance < best.closest.distance,
                None => {
                    self.search.within == f64::INFINITY
                        || triangles_within(&triangle, &[point; 3], &closest, self.search.within)
                }
            };
            if is_better {
                let best = Best { closest, object: self.number, triangle: self.id(leaf, lane)? };
                self.search.best[probe] = Some(best);
            }
            let limit = round_up(closest.upper * (1.0 + 2f64.powi(-40)));
            self.search.limits[probe] = self.search.limits[probe].min(limit);
        }
        Ok(())
    }
}

impl Nearest<'_> {
    /// Returns the number of a triangle in the input.
    fn id(&self, leaf: LeafPacket, lane: u8) -> Result<u32, QueryError> {
        let place = TrianglePlace { page: leaf.page, packet: leaf.packet, lane };
        self.bvh.triangle_id(self.object, place)
    }
}

/// Returns the slabs of points, four in columns, along the directions of a set, rounded outward.
fn slabs_of(points: &[Point; PROBES], set: DirectionSet, error: f64) -> Group {
    let mut group = Group::ZERO;
    for slab in 0..set.slabs() {
        let at = row(slab);
        for (column, point) in points.iter().enumerate() {
            let along: f64 = (0..3).map(|k| FACTORS[slab][k] * point[k]).sum();
            let lane = 4 * (at % 4) + column;
            group.lo[at / 4][lane] = -round_up(error - along);
            group.hi[at / 4][lane] = round_up(along + error);
        }
    }
    group
}

/// Measures what has been collected, with the features of a backend.
struct Settle<'a, 'b>(&'a mut Nearest<'b>);

impl crate::isa::Task for Settle<'_, '_> {
    type Output = Result<(), QueryError>;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        self.0.settle(isa)
    }
}

impl ProbeVisitor for Nearest<'_> {
    #[inline(always)]
    fn bound<I: Isa>(&self, isa: I, children: &Group) -> I::V {
        gaps_along(isa, Measure::Distance, self.set, (children, &self.slabs))
    }

    #[inline(always)]
    fn limits(&self) -> &[f32; PROBES] {
        &self.search.limits
    }

    #[inline(always)]
    fn leaf<I: Isa>(&mut self, isa: I, leaf: LeafPacket, probes: u16) -> Result<ControlFlow<()>, QueryError> {
        self.stats.packet_tests += 1;
        let (known, packet) = self.packets.place(leaf.page, leaf.packet);
        if !known {
            packet.place_a(isa, &self.frame, self.bvh.packet(self.object, leaf, &mut Packet::default())?);
        }
        let local = LocalPoints::new(&self.frame, packet, &self.points);
        let bounds = point_bounds(isa, packet, &local);
        let scale = self.frame.scale;
        let mut mask = (0x1111 * probes) & valid_lanes(leaf.triangles, PROBES as u8);
        while mask != 0 {
            let at = mask.trailing_zeros() as usize & 15;
            mask &= mask - 1;
            // A power of two: exact, unless the mesh is so tiny that it takes a last outward step.
            let lower = (bounds.lower[at] / scale).next_down().max(0.0);
            let upper = (bounds.upper[at] / scale).next_up();
            let limit = &mut self.search.limits[at & 3];
            if lower <= *limit {
                *limit = limit.min(upper);
                let (lane, probe) = ((at >> 2) as u8, (at & 3) as u8);
                self.bounded.push(BoundedTriangle { lower, leaf, lane, probe });
            }
        }
        if self.bounded.len() >= MAX_BOUNDED {
            self.settle(isa)?;
        }
        Ok(ControlFlow::Continue(()))
    }
}
