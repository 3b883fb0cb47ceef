//! Whether points are inside a mesh, on it or outside.
//!
//! The winding number of each object is counted along a ray to the nearest side of its box:
//! [`crate::narrow::AxisRay`] has the method. Those of all objects of a shape add up.

use crate::error::QueryError;
use crate::file::topology::Topology;
use crate::narrow::{AxisRay, Passing, Point};
use crate::query::probe::closest::ClosestPoint;
use crate::query::probe::closest::IsWithin;
use crate::query::probe::line::{Candidate, Line, LineQuestion};
use crate::query::probe::placed::{IntoObject, PlacedShape};
use crate::query::probe::point::{check_point, sum_of_magnitudes};
use crate::query::querier::Querier;

/// What an object that is not closed means for points that are not on it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum OpenObject {
    /// It leaves undefined what is inside.
    Undefined,
    /// It contains nothing.
    Empty,
}

/// On which side of a mesh a point is. The command and the bindings of other languages use its numbers: `side as i8`.
///
/// [`Querier::side`](crate::Querier::side) has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(i8)]
pub enum Side {
    /// The point is neither on the surface nor inside.
    Outside = -1,
    /// The point is on the surface.
    On = 0,
    /// The surface winds around the point.
    Inside = 1,
    /// The point is not on the surface, and the mesh has no inside, because it is not closed and consistently oriented.
    Undefined = 2,
}

/// The distance of a point from the surface of a mesh, and the side that it is on. Inside overlapping parts of one mesh, the
/// closest surface may be a face between them: see
/// [`Querier::signed_point_distance`](crate::Querier::signed_point_distance), which has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SignedPointDistance {
    /// The side of the point.
    pub side: Side,
    /// The closest point of the surface.
    pub closest: ClosestPoint,
}

impl SignedPointDistance {
    /// Returns the distance in mesh units, negative inside, or `None` if the mesh has no inside.
    pub fn value(&self) -> Option<f64> {
        match self.side {
            Side::Inside => Some(-self.closest.distance),
            Side::On | Side::Outside => Some(self.closest.distance),
            Side::Undefined => None,
        }
    }
}

impl Querier {
    /// Returns whether a point is inside a mesh, on its surface or outside.
    ///
    /// A point is inside if the surface winds around it, that is, if its winding number is not 0. So overlapping closed
    /// parts count as one solid, and a closed surface turned inside out has the same inside. An exact duplicate in the
    /// input counts like any other triangle, with its own orientation. The answer is exact and has the same bits on all
    /// backends. If a mesh is not closed and consistently oriented, the side is known only for points on it.
    ///
    /// A point is inside a rounded shape if it is nearer to the core than the radius, or inside the core. An open core contains
    /// nothing.
    ///
    /// Cost: about a microsecond.
    ///
    /// ```
    /// use bvh_query::{Querier, Side};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// assert_eq!(querier.side(&block, [0.5, 0.0, 0.0])?, Side::Inside);
    /// assert_eq!(querier.side(&block, [1.0, 0.0, 0.0])?, Side::On);
    /// assert_eq!(querier.side(&block, [1.0_f64.next_up(), 0.0, 0.0])?, Side::Outside);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate is not finite or beyond 2^120; [`QueryError::NoTopology`] if the file was
    /// baked without topology; [`QueryError::Damaged`] if a page that the query touches is damaged;
    /// [`QueryError::Budget`] if the budget does not suffice.
    pub fn side<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        point: [f64; 3],
    ) -> Result<Side, QueryError> {
        let point = check_point(&point)?;
        self.start();
        self.side_of_shape(&shape.into(), &point)
    }

    /// Returns the closest point of a mesh to `point`, and the side that `point` is on. Returns `None` if the mesh is
    /// farther away than `within`. The signed distance is that of the surface, negative inside. These are two
    /// queries, and each has the whole budget.
    ///
    /// The surface is all triangles of the mesh. Where closed parts of it overlap, or one lies within another, the closest
    /// triangle may be inside the mesh: the distance is then less than that to the outside. Unite the parts before baking
    /// if only their outer surface matters.
    ///
    /// ```
    /// use bvh_query::{Querier, Side, SignedPointDistance};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let found = Querier::new()?.signed_point_distance(&block, [0.75, 0.0, 0.0], f64::INFINITY)?;
    /// let found: SignedPointDistance = found.expect("nothing is farther away than infinity");
    /// assert_eq!((found.side, found.value()), (Side::Inside, Some(-0.25)));
    /// assert_eq!(found.closest.point, [1.0, 0.0, 0.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::closest_point`] and [`Querier::side`].
    pub fn signed_point_distance<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        point: [f64; 3],
        within: f64,
    ) -> Result<Option<SignedPointDistance>, QueryError> {
        let shape = shape.into();
        let Some(mut closest) = self.closest_point(shape, point, within)? else { return Ok(None) };
        let stats = self.stats;
        let side = self.side(shape, point)?;
        let radius = shape.shape.radius();
        if radius > 0.0 && side == Side::Inside {
            closest = self.depth(&shape, &check_point(&point)?)?.unwrap_or(closest);
        }
        self.stats.add(stats.node_tests, stats);
        Ok(Some(SignedPointDistance { side, closest }))
    }

    /// Returns how deep a point is inside a rounded shape, which is at most the distance from where it ends: the radius less the
    /// distance from the core or, inside the core, the sum of both.
    pub(crate) fn depth(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
    ) -> Result<Option<ClosestPoint>, QueryError> {
        let radius = placed.shape.radius();
        let Some(core) = self.closest_of_core(placed, point, f64::INFINITY, IsWithin::Closed)? else {
            return Ok(None);
        };
        let is_inside_core = self.side_of(placed, point, OpenObject::Empty)? == Side::Inside;
        let sign = if is_inside_core { 1.0 } else { -1.0 };
        let reach = if core.distance > 0.0 { sign * -radius / core.distance } else { 0.0 };
        let [near, far] = if is_inside_core { [core.lower, core.upper] } else { [core.upper, core.lower] };
        let distance = (radius + sign * core.distance).max(f64::MIN_POSITIVE);
        Ok(Some(ClosestPoint {
            distance,
            lower: (radius + sign * near).next_down().clamp(0.0, distance),
            upper: (radius + sign * far).next_up().max(distance),
            point: [0, 1, 2].map(|k| core.point[k] + reach * (point[k] - core.point[k])),
            ..core
        }))
    }

    /// Returns the side of a shape that a point is on, which has been checked.
    pub(crate) fn side_of_shape(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
    ) -> Result<Side, QueryError> {
        let radius = placed.shape.radius();
        if radius == 0.0 {
            return self.side_of(placed, point, OpenObject::Undefined);
        }
        match self.closest_of_core(placed, point, radius, IsWithin::Closed)? {
            Some(closest) if closest.upper < radius => Ok(Side::Inside),
            Some(_) if self.closest_of_core(placed, point, radius, IsWithin::Open)?.is_some() => {
                Ok(Side::Inside)
            }
            found => match (self.side_of(placed, point, OpenObject::Empty)?, found) {
                (Side::Outside, Some(_)) => Ok(Side::On),
                (side, _) => Ok(side),
            },
        }
    }

    /// Returns the side of a core that a point is on, which has been checked.
    pub(crate) fn side_of(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
        open: OpenObject,
    ) -> Result<Side, QueryError> {
        let (mut undefined, mut winding) = (false, 0);
        for (index, object) in placed.shape.objects().iter().enumerate() {
            self.memory.budget.visit()?;
            let into = IntoObject::new(placed.pose.as_ref(), object);
            let topology = placed.shape.bvh().topology(placed.shape.first() + index)?;
            undefined |= !topology.closed && open == OpenObject::Undefined;
            let Some(ray) = short_way_out(point, &into) else { continue };
            let mut question = Winding { ray, beside: None, topology, is_on: false, winding: 0 };
            self.ask_line_of_object(placed, index, &mut question)?;
            if question.is_on {
                return Ok(Side::On);
            }
            winding += question.winding;
        }
        Ok(match (undefined, winding) {
            (true, _) => Side::Undefined,
            (false, 0) => Side::Outside,
            (false, _) => Side::Inside,
        })
    }
}

impl Querier {
    /// Returns how often a shape winds around a point that has been checked, and is moved by less than any number: by (ε³, ε, ε²) with a
    /// sign. So no point is on its surface. All its objects are closed.
    pub(crate) fn winding_beside(
        &mut self,
        placed: &PlacedShape<'_>,
        point: &Point,
        sign: f64,
    ) -> Result<i64, QueryError> {
        let mut winding = 0;
        for (index, object) in placed.shape.objects().iter().enumerate() {
            self.memory.budget.visit()?;
            let into = IntoObject::new(placed.pose.as_ref(), object);
            if short_way_out(point, &into).is_none() {
                continue;
            }
            let topology = placed.shape.bvh().topology(placed.shape.first() + index)?;
            let ray = AxisRay { origin: *point, axis: 0, ascends: true };
            let mut question = Winding { ray, beside: Some(sign), topology, is_on: false, winding: 0 };
            self.ask_line_of_object(placed, index, &mut question)?;
            winding += question.winding;
        }
        Ok(winding)
    }
}

/// Returns a ray along an axis that leaves an object's box soon; nothing if the point is not in the box.
fn short_way_out(point: &Point, into: &IntoObject) -> Option<AxisRay> {
    let seen = into.point(*point);
    let error = into.error(4.0 * (sum_of_magnitudes(point) + sum_of_magnitudes(&seen)));
    let [lo, hi] = &into.bounds;
    let mut best = (f64::INFINITY, 0, true);
    for k in 0..3 {
        for (way, ascends) in [(seen[k] - lo[k], false), (hi[k] - seen[k], true)] {
            if way < -error {
                return None;
            }
            if way < best.0 {
                best = (way, k, ascends);
            }
        }
    }
    // Where the object is turned, the axis of the question that is nearest to that of the object leads out about as soon.
    let (axis, ascends) = into.nearest_axis(best.1, best.2);
    Some(AxisRay { origin: *point, axis, ascends })
}

/// How often does an object wind around a point?
struct Winding<'a> {
    ray: AxisRay,
    /// The sign with which the point is moved, if it is.
    beside: Option<f64>,
    topology: Topology<'a>,
    is_on: bool,
    winding: i64,
}

impl LineQuestion for Winding<'_> {
    fn line(&self) -> Line {
        Line::new(self.ray.origin, self.ray.direction())
    }

    fn is_about_cores(&self) -> bool {
        true
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        match (self.is_on, self.topology.closed) {
            (true, _) => -1.0,
            // What matters is only whether the point is on it.
            (false, false) => 0.0,
            (false, true) => f64::INFINITY,
        }
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        let passing = match self.beside {
            None => self.ray.passing(&candidate.triangle),
            Some(sign) => self.ray.passing_beside(&candidate.triangle, sign),
        };
        if passing == Passing::Starts {
            self.is_on = true;
        } else if passing != Passing::Misses && self.topology.closed {
            let net = i64::from(self.topology.net(candidate.place_number()?));
            self.winding += if passing == Passing::Leaves { net } else { -net };
        }
        Ok(())
    }
}
