//! What a ray hits: the first hit, any hit, or all hits.

use crate::error::{NumberError, QueryError};
use crate::narrow::{self, Crossing, RoundedRay, Triangle};
use crate::query::probe::line::{Candidate, Line, LineQuestion, Numbers};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::check_point;
use crate::query::probe::stays::{Rounded, ends};
use crate::query::querier::Querier;
use std::cmp::Ordering;

/// A ray: all points `origin + t * direction` with `t` from 0 to `until`, both ends included.
///
/// ```
/// use bvh_query::Ray;
///
/// let down = Ray::new([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]);
/// assert_eq!(down.until, f64::INFINITY);
/// let up_to_a_point = Ray { origin: [0.0; 3], direction: [1.0, 2.0, 2.0], until: 1.0 };
/// assert_eq!(up_to_a_point, Ray::new([0.0; 3], [1.0, 2.0, 2.0]).until(1.0)); // in units of the direction
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in mesh units.
    pub origin: [f64; 3],
    /// The direction, which is the unit of `t`. Its length may be from 2^-500 to 2^500. A component of less than 2^-200
    /// of the largest counts as 0.
    pub direction: [f64; 3],
    /// The greatest `t`, in units of the direction; it may be infinite.
    pub until: f64,
}

impl Ray {
    /// A ray without an end.
    pub fn new(origin: [f64; 3], direction: [f64; 3]) -> Self {
        Self { origin, direction, until: f64::INFINITY }
    }

    /// Lets the ray end at a parameter, in units of its direction.
    #[must_use]
    pub fn until(self, until: f64) -> Self {
        Self { until, ..self }
    }
}

/// Where a ray hits a mesh.
///
/// [`Querier::first_hit`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct RayHit {
    /// The parameter, in units of the ray's direction; 0 if and only if the ray's origin is on the mesh. Its relative
    /// error is at most 2^-43.
    pub t: f64,
    /// The exact parameter is at least this.
    pub lower: f64,
    /// The exact parameter is at most this.
    pub upper: f64,
    /// The point, in the frame of the ray.
    pub point: [f64; 3],
    /// The number that its object has in the file.
    pub object: u32,
    /// Its triangle: its number in the input or, in a file without ids, its place in the order of the leaves.
    pub triangle: u32,
}

impl Querier {
    /// Returns where a ray first hits a mesh, or `None`.
    ///
    /// Triangles are closed sets: a ray that touches a corner or an edge, or meets a triangle in its plane, hits it at
    /// its first point in the triangle. Exact predicates decide whether the ray hits, and what. Of triangles that it
    /// hits at exactly the same parameter, the answer names the one with the lowest numbers of object and triangle. The
    /// answer has the same bits on all backends.
    ///
    /// A ray hits a rounded shape where it first comes within the radius of the core, and at 0 if it starts there. Whether it does
    /// is exact; `lower` and `upper` say how well the parameter is known, which is less for a ray that only grazes the shape.
    ///
    /// The method is that of A. Segura and F. Feito (2001), decided by exact predicates, on a walk along boxes. The first rays walk
    /// along the slabs of k-DOPs, until the file has made a tree of boxes, and so do rays with a budget.
    /// Cost: a fraction of a microsecond; without boxes about a microsecond.
    ///
    /// ```
    /// use bvh_query::{Querier, Ray, RayHit};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let down = Ray::new([0.25, 0.5, 3.0], [0.0, 0.0, -2.0]);
    /// let Some(RayHit { t, point, .. }) = Querier::new()?.first_hit(&block, &down)? else { panic!() };
    /// assert_eq!((t, point), (1.0, [0.25, 0.5, 1.0])); // t counts in lengths of the direction
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if a coordinate of the origin is not finite or beyond 2^120, if the largest component of
    /// the direction is not from 2^-500 to 2^500 in magnitude, if a component is NaN, or if `until` is negative or NaN;
    /// [`QueryError::Damaged`] if a page that the query touches is damaged; [`QueryError::Budget`] if the budget does
    /// not suffice.
    pub fn first_hit<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        ray: &Ray,
    ) -> Result<Option<RayHit>, QueryError> {
        let mut first = First::new(ray)?;
        self.start();
        self.ask_line(&shape.into(), &mut first)?;
        Ok(first.hit().map(|(_, hit)| hit))
    }

    /// Returns whether a ray hits a mesh at all. The decision is that of [`Querier::first_hit`].
    ///
    /// ```
    /// use bvh_query::{Querier, Ray};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let down = Ray::new([0.25, 0.5, 3.0], [0.0, 0.0, -1.0]);
    /// assert!(querier.any_hit(&block, &down)?);
    /// assert!(!querier.any_hit(&block, &down.until(1.5))?); // ends before it
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::first_hit`].
    pub fn any_hit<'a>(&mut self, shape: impl Into<PlacedShape<'a>>, ray: &Ray) -> Result<bool, QueryError> {
        let mut any = Any::new(ray)?;
        self.start();
        self.ask_line(&shape.into(), &mut any)?;
        Ok(any.found)
    }

    /// Returns all hits of a ray in the order along it. Each parameter occurs once, however many triangles are hit at
    /// exactly that parameter: a ray through an edge hits once, and the hit names the triangle with the lowest numbers.
    /// If the ray lies in a triangle's plane and meets it, the first point counts.
    ///
    /// A rounded shape is one body, all points within the radius of its core, and its hits are where the ray enters and leaves it,
    /// in turns. The first hit is that of [`Querier::first_hit`], at 0 if the ray starts in the body, and an exit beyond `until` is no
    /// hit. Each hit names the triangle within whose radius the ray comes there, or ceases to be; of several at the same parameter,
    /// the one with the lowest numbers. A ray that only touches the body enters and leaves it at the same parameter. A closed core
    /// is hollow, whether it is solid or not, as it is for the first hit: a ray that passes its inside leaves the body, and enters
    /// it again on the other side. Whether there are hits is exact, and so are their `lower` and `upper` as bounds. Two parts of
    /// the ray in the body are told apart if their bounds prove the gap between them, and are one if not, so each gap that is
    /// reported is one. If `until` is between the bounds of an exit, `t` decides whether the exit is a hit.
    ///
    /// Cost: that of visiting each triangle that the ray meets. For a rounded shape, some microseconds per triangle at which the ray may
    /// enter or leave the body, a fraction of a microsecond per other triangle within whose radius it comes, and up to 1 KiB for each.
    ///
    /// ```
    /// use bvh_query::{Querier, Ray};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let down = Ray::new([0.25, 0.5, 3.0], [0.0, 0.0, -1.0]);
    /// let heights: Vec<f64> = Querier::new()?.all_hits(&block, &down)?.iter().map(|hit| hit.point[2]).collect();
    /// assert_eq!(heights, [1.0, -1.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Querier::first_hit`].
    pub fn all_hits<'a>(
        &mut self,
        shape: impl Into<PlacedShape<'a>>,
        ray: &Ray,
    ) -> Result<Vec<RayHit>, QueryError> {
        let mut all = All::new(ray)?;
        self.start();
        self.ask_line(&shape.into(), &mut all)?;
        Ok(all.hits().into_iter().map(|(_, hit)| hit).collect())
    }
}

/// The lengths that directions may have.
const LENGTHS: std::ops::RangeInclusive<f64> =
    f64::from_bits((1023 - 500) << 52)..=f64::from_bits((1023 + 500) << 52);

/// Components of directions below this share of the largest, 2^-200, count as 0.
const LEAST_COMPONENT: f64 = f64::from_bits((1023 - 200) << 52);

/// A ray whose direction has a power of two as its unit, so that its largest component is in [1, 2).
#[derive(Clone, Copy)]
pub(super) struct Scaled {
    ray: narrow::Ray,
    /// What parameters of this ray are multiplied by to be those of the ray that was given, a power of two.
    unit: f64,
    until: f64,
}

impl Scaled {
    #[inline(always)]
    pub(super) fn new(ray: &Ray) -> Result<Self, QueryError> {
        let origin = check_point(&ray.origin)?;
        let largest =
            ray.direction.iter().fold(0.0f64, |most, v| if v.abs() <= most { most } else { v.abs() });
        if !LENGTHS.contains(&largest) || ray.direction.iter().any(|v| v.is_nan()) {
            return Err(NumberError::Direction(largest).into());
        }
        if ray.until.is_nan() || ray.until < 0.0 {
            return Err(NumberError::Until(ray.until).into());
        }
        // The exponent of the largest component, negated.
        let unit = f64::from_bits((2046 - (largest.to_bits() >> 52)) << 52);
        let direction =
            ray.direction.map(|v| if (v * unit).abs() < LEAST_COMPONENT { 0.0 } else { v * unit });
        Ok(Self { ray: narrow::Ray { origin, direction }, unit, until: ray.until / unit })
    }

    fn line(&self) -> Line {
        Line::new(self.ray.origin, self.ray.direction)
    }

    /// Returns where it meets a triangle, if it does within its length.
    #[inline(always)]
    fn crossing(&self, Candidate { triangle, radius, .. }: &Candidate<'_>) -> Option<Crossing> {
        if *radius > 0.0 {
            return RoundedRay::new(&self.ray, triangle, *radius).entry(self.until);
        }
        self.ray.crossing(triangle).filter(|crossing| self.ray.is_within(triangle, crossing, self.until))
    }

    /// Returns whether it meets a triangle within its length.
    #[inline(always)]
    fn meets(&self, candidate: &Candidate<'_>) -> bool {
        let Candidate { triangle, radius, .. } = candidate;
        if *radius > 0.0 {
            return RoundedRay::new(&self.ray, triangle, *radius).is_met(self.until);
        }
        self.ray.meets(triangle, self.until)
    }

    /// Returns a hit as an answer, and the number of its instance.
    fn hit(&self, crossing: &Crossing, (instance, object, triangle): Numbers) -> (u32, RayHit) {
        let narrow::Ray { origin, direction } = self.ray;
        // A product with a power of two: exact, unless it underflows.
        let scaled = |t: f64| if t > 0.0 { (t * self.unit).max(f64::MIN_POSITIVE) } else { 0.0 };
        let hit = RayHit {
            t: scaled(crossing.t),
            lower: if crossing.lower * self.unit < f64::MIN_POSITIVE {
                0.0
            } else {
                crossing.lower * self.unit
            },
            upper: scaled(crossing.upper),
            point: [0, 1, 2].map(|k| origin[k] + crossing.t * direction[k]),
            object,
            triangle,
        };
        (instance, hit)
    }
}

/// A triangle that a ray meets.
#[derive(Clone, Copy)]
struct Met {
    crossing: Crossing,
    triangle: Triangle,
    numbers: Numbers,
}

impl Met {
    fn new(crossing: Crossing, candidate: &Candidate<'_>) -> Result<Self, QueryError> {
        Ok(Self { crossing, triangle: candidate.triangle, numbers: candidate.numbers()? })
    }

    fn compare(&self, ray: &Scaled, other: &Self) -> Ordering {
        ray.ray.compare((&self.triangle, &self.crossing), (&other.triangle, &other.crossing))
    }
}

/// Which triangle is met first?
pub(crate) struct First {
    ray: Scaled,
    /// The first triangle without a radius. Exact predicates tell which it is.
    best: Option<Met>,
    /// The first one with a radius. The least parameter tells.
    best_rounded: Option<Met>,
}

impl First {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Result<Self, QueryError> {
        Ok(Self::about(Scaled::new(ray)?))
    }

    #[inline(always)]
    pub(super) fn about(ray: Scaled) -> Self {
        Self { ray, best: None, best_rounded: None }
    }

    /// Returns the first hit, and the number of its instance.
    pub(crate) fn hit(&self) -> Option<(u32, RayHit)> {
        let order = |met: &&Met| (met.crossing.t, met.numbers);
        let all = self.best.iter().chain(&self.best_rounded);
        all.min_by(|x, y| order(x).partial_cmp(&order(y)).unwrap_or(Ordering::Equal))
            .map(|best| self.ray.hit(&best.crossing, best.numbers))
    }

    /// Returns the parameter of the first hit of a triangle without a radius, and the triangle's unit normal.
    pub(crate) fn met(&self) -> Option<(f64, [f64; 3])> {
        let best = self.best.as_ref()?;
        Some((best.crossing.t * self.ray.unit, narrow::unit_normal(&best.triangle)))
    }

    /// Returns whether a triangle with a radius is certainly met after what was found.
    fn enters_later(&self, Candidate { triangle, radius, .. }: &Candidate<'_>) -> bool {
        let limit = self.limit();
        limit < self.ray.until && RoundedRay::new(&self.ray.ray, triangle, *radius).enters_after(limit)
    }

    /// Returns the parameter of the first hit if the ray leaves the triangle on the side that its normal points to.
    pub(crate) fn way_out(&self) -> Option<f64> {
        let (t, normal) = self.met()?;
        (narrow::dot(self.ray.ray.direction, normal) > 0.0).then_some(t)
    }
}

impl LineQuestion for First {
    fn line(&self) -> Line {
        self.ray.line()
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        let limit = |best: &Option<Met>| best.as_ref().map_or(self.ray.until, |best| best.crossing.upper);
        limit(&self.best).min(limit(&self.best_rounded))
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        if candidate.radius > 0.0 && self.enters_later(candidate) {
            return Ok(());
        }
        let Some(crossing) = self.ray.crossing(candidate) else { return Ok(()) };
        if candidate.radius > 0.0 {
            let found = Met::new(crossing, candidate)?;
            let order = |met: &Met| (met.crossing.t, met.numbers);
            if self.best_rounded.as_ref().is_none_or(|best| order(&found) < order(best)) {
                self.best_rounded = Some(found);
            }
            return Ok(());
        }
        let is_first = match &self.best {
            None => true,
            Some(best) => {
                let (found, held) = ((&candidate.triangle, &crossing), (&best.triangle, &best.crossing));
                let order = self.ray.ray.compare(found, held);
                order.is_lt() || order.is_eq() && candidate.numbers()? < best.numbers
            }
        };
        if is_first {
            self.best = Some(Met::new(crossing, candidate)?);
        }
        Ok(())
    }
}

/// Is any triangle met?
pub(crate) struct Any {
    ray: Scaled,
    pub(crate) found: bool,
}

impl Any {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Result<Self, QueryError> {
        Ok(Self::about(Scaled::new(ray)?))
    }

    #[inline(always)]
    pub(super) fn about(ray: Scaled) -> Self {
        Self { ray, found: false }
    }
}

impl LineQuestion for Any {
    fn line(&self) -> Line {
        self.ray.line()
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        if self.found { -1.0 } else { self.ray.until }
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        self.found |= self.ray.meets(candidate);
        Ok(())
    }
}

/// Which triangles are met?
pub(crate) struct All {
    ray: Scaled,
    /// The triangles without a radius.
    met: Vec<Met>,
    rounded: Vec<Rounded>,
}

impl All {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> Result<Self, QueryError> {
        Ok(Self::about(Scaled::new(ray)?))
    }

    #[inline(always)]
    pub(super) fn about(ray: Scaled) -> Self {
        Self { ray, met: Vec::new(), rounded: Vec::new() }
    }

    /// Returns the hits in the order along the ray, with the numbers of their instances.
    pub(crate) fn hits(&mut self) -> Vec<(u32, RayHit)> {
        let Self { ray, met, rounded } = self;
        met.sort_unstable_by(|x, y| x.compare(ray, y).then(x.numbers.cmp(&y.numbers)));
        met.dedup_by(|later, earlier| later.compare(ray, earlier).is_eq());
        if rounded.is_empty() {
            return met.iter().map(|of| ray.hit(&of.crossing, of.numbers)).collect();
        }
        let mut ends = ends(&ray.ray, ray.until, rounded).into_iter().peekable();
        let mut hits = Vec::with_capacity(met.len() + ends.len());
        for of in met.iter() {
            let of = (of.crossing, of.numbers);
            while let Some(end) = ends.next_if(|end| (end.0.t, end.1) < (of.0.t, of.1)) {
                hits.push(end);
            }
            hits.push(of);
        }
        hits.extend(ends);
        hits.iter().map(|(crossing, numbers)| ray.hit(crossing, *numbers)).collect()
    }
}

impl LineQuestion for All {
    fn line(&self) -> Line {
        self.ray.line()
    }

    #[inline(always)]
    fn limit(&self) -> f64 {
        self.ray.until
    }

    fn decide(&mut self, candidate: &Candidate<'_>) -> Result<(), QueryError> {
        if candidate.radius > 0.0 {
            if self.ray.meets(candidate) {
                let of = (&candidate.triangle, candidate.radius);
                self.rounded.push(Rounded::new(&self.ray.ray, of, candidate.numbers()?));
            }
        } else if let Some(crossing) = self.ray.crossing(candidate) {
            self.met.push(Met::new(crossing, candidate)?);
        }
        Ok(())
    }
}
