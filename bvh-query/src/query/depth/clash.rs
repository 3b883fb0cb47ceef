//! How two parts of an assembly lie: apart, near, touching, overlapping, one in the other, or twice in one place.

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::depth::balls::bounds;
use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::penetration::Penetration;
use crate::query::displacement::{displacement, size};
use crate::query::distance::Distance;
use crate::query::exact::{placed, stored_at};
use crate::query::intersection::Intersection;
use crate::query::options::{check, options};
use crate::query::probe::closest::IsWithin;
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::check_point;
use crate::query::probe::relation::Relation;
use crate::query::probe::relation::each_triangle;
use crate::query::querier::Querier;
use crate::query::rounded::{limit_of_cores, sum_of_radii};

/// How two parts lie. The command and the bindings of other languages use its numbers (`class as u8`) and names.
///
/// [`Querier::clash`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
#[non_exhaustive]
pub enum ClashClass {
    /// Their surfaces are farther apart than the clearance and the tolerance, and neither is inside the other.
    Apart = 0,
    /// Their surfaces are farther apart than the tolerance, but at most the clearance.
    Near = 1,
    /// Their surfaces are at most the tolerance apart, or they have points in common and their depth is at most the tolerance.
    Touching = 2,
    /// Their depth exceeds the tolerance.
    Overlapping = 3,
    /// One is wholly inside the other.
    Contained = 4,
    /// Both are the same part in the same place, to within the tolerance.
    Duplicated = 5,
    /// They have points in common, and the tolerance lies between the bounds that were found for their depth.
    Undecided = 6,
    /// They have points in common, and one is not closed, so that they have no depth.
    Intersecting = 7,
    /// Their depth exceeds the tolerance, and one passes through the other. Overlapping parts are this or protruding if magnitudes are
    /// asked for ([`ClashOptions::magnitudes`]).
    Piercing = 8,
    /// Their depth exceeds the tolerance, and neither passes through the other.
    Protruding = 9,
}

impl ClashClass {
    /// All classes, in the order of their numbers.
    pub const ALL: [Self; 10] = [
        Self::Apart,
        Self::Near,
        Self::Touching,
        Self::Overlapping,
        Self::Contained,
        Self::Duplicated,
        Self::Undecided,
        Self::Intersecting,
        Self::Piercing,
        Self::Protruding,
    ];

    /// Returns its name: `apart`, `near` and so on.
    pub fn name(self) -> &'static str {
        match self {
            Self::Apart => "apart",
            Self::Near => "near",
            Self::Touching => "touching",
            Self::Overlapping => "overlapping",
            Self::Contained => "contained",
            Self::Duplicated => "duplicated",
            Self::Undecided => "undecided",
            Self::Intersecting => "intersecting",
            Self::Piercing => "piercing",
            Self::Protruding => "protruding",
        }
    }
}

/// How two parts lie, and by how much.
///
/// [`Querier::clash`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Clash {
    /// How they lie.
    pub class: ClashClass,
    /// Whether they touch and, if not, whether one is inside the other.
    pub relation: Relation,
    /// For near parts, and for touching ones without a common point: how far apart their surfaces are. Infinite for parts that
    /// are apart, and 0 for all others.
    pub distance: f64,
    /// For parts that touch, overlap or are undecided: the bounds of their depth, both 0 without a common point. Parts that are not
    /// closed have none.
    pub depth: Option<Penetration>,
    /// What the parts have in common, if magnitudes are asked for and the parts overlap, are undecided, contain each other or are
    /// duplicated.
    pub magnitudes: Option<Intersection>,
    /// A point of the clash in A's frame: between the closest points, in both parts, or in contact.
    pub point: [f64; 3],
}

options! {
    /// What counts as a clash.
    ///
    /// [`Querier::clash`] has an example.
    pub struct ClashOptions {
        /// Parts at most this far apart are near, in mesh units. 0, the default, looks for no near parts. A query refuses a
        /// clearance that is negative or not finite.
        clearance(f64): f64 = 0.0,
        /// Parts at most this far apart, or at most this deep in each other, are touching, in mesh units. `None`, the default,
        /// stands for a millionth of the largest side of both parts. A query refuses a length that is negative or not finite.
        tolerance(f64): Option<f64> = None,
        /// The search for a depth ends when its bounds are this near each other, as a part of the lower one. A query refuses a part
        /// that is not above 0 or not finite.
        relative_gap(f64): f64 = 0.1,
        /// The most visits of the search for the depth of a pair: see [`Querier::set_budget`], whose budget limits it, too.
        visits(u64): u64 = 1 << 20,
        /// Whether to measure what parts have in common ([`Querier::intersection`]), and to divide overlapping ones into piercing and
        /// protruding ones. Parts with a radius or a margin are not measured.
        magnitudes(bool): bool = false,
    }
}

impl ClashOptions {
    pub(crate) fn check(&self) -> Result<(), QueryError> {
        check(NumberError::Clearance, self.clearance)?;
        PenetrationOptions::new().relative_gap(self.relative_gap).check()?;
        self.tolerance.map_or(Ok(()), |tolerance| check(NumberError::DepthTolerance, tolerance))
    }

    /// Returns the tolerance for parts, one of which has this largest side.
    pub(crate) fn tolerance_of(&self, size: f64) -> f64 {
        self.tolerance.unwrap_or(1e-6 * size)
    }
}

impl Querier {
    /// Returns how two parts lie, with B placed by a pose in A's frame.
    ///
    /// A tolerance is part of the query. A pose that turns by anything but right angles rounds each vertex that it places, by
    /// about 1e-16 of its coordinates, so that flush faces overlap or come apart by as much. Both count as touching: parts within
    /// the tolerance of each other, which is exact as [`Querier::within`] is, and parts whose depth ([`Querier::penetration`]) is at
    /// most the tolerance. Where a part fits another one without a gap, like a peg in its hole, the depth is mostly undecided:
    /// `lower` is at most the tolerance, and `upper` how far it has to be pulled.
    ///
    /// Cost: that of `within` with the tolerance or the clearance, whichever is larger, for parts that are farther apart than
    /// both. Others also take `collide`, and a `distance` or a `penetration`; magnitudes take an `intersection`.
    ///
    /// ```
    /// use bvh_query::{Clash, ClashClass, ClashOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let mut querier = Querier::new()?;
    /// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// let options = ClashOptions::new().clearance(0.5);
    /// let near: Clash = querier.clash(&block, &block, &at(2.25)?, &options)?;
    /// assert_eq!((near.class, near.distance), (ClashClass::Near, 0.25));
    ///
    /// let deep = querier.clash(&block, &block, &at(1.5)?, &options)?;
    /// assert_eq!(deep.class, ClashClass::Overlapping);
    /// assert!(deep.depth.is_some_and(|depth| depth.lower <= 0.5 && 0.5 <= depth.upper));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; else the errors of [`Querier::relation`].
    pub fn clash<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &ClashOptions,
    ) -> Result<Clash, QueryError> {
        self.clash_along(a.into(), b.into(), pose, options, Pose::IDENTITY.rotation())
    }

    /// Returns how two parts lie, with the box of what they have in common along other axes than those of A's frame.
    pub(crate) fn clash_along(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &ClashOptions,
        axes: &[[f64; 3]; 3],
    ) -> Result<Clash, QueryError> {
        options.check()?;
        self.start();
        let mut clash = self.clash_of(a, b, pose, options)?;
        use ClashClass::{Contained, Duplicated, Overlapping, Piercing, Protruding, Undecided};
        let is_shared = matches!(clash.class, Overlapping | Undecided | Contained | Duplicated);
        let is_measured = options.magnitudes && is_shared && sum_of_radii(a, b) == 0.0;
        if is_measured && a.is_closed()? && b.is_closed()? {
            let shared = self.intersection_along(a, b, pose, axes)?;
            if clash.class == Overlapping {
                let pierces = shared.pierced_a.or(shared.pierced_b).is_some();
                clash.class = if pierces { Piercing } else { Protruding };
            }
            clash.magnitudes = Some(shared);
        }
        Ok(clash)
    }

    fn clash_of(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &ClashOptions,
    ) -> Result<Clash, QueryError> {
        let tolerance = options.tolerance_of(size(a.objects()).max(size(b.objects())));
        let reach = tolerance.max(options.clearance);
        // Most pairs are apart, and this question says so.
        let is_within_reach = self.cores_within(a, b, pose, limit_of_cores(a, b, reach))?;
        let touches =
            is_within_reach && (reach == 0.0 || self.cores_within(a, b, pose, sum_of_radii(a, b))?);
        let relation = if touches { Relation::Touching } else { self.relation_of_disjoint(a, b, pose)? };
        let clash =
            |class, point| Clash { class, relation, distance: 0.0, depth: None, magnitudes: None, point };
        let is_disjoint = matches!(relation, Relation::Apart | Relation::Undefined);
        if is_disjoint && !is_within_reach {
            return Ok(Clash { distance: f64::INFINITY, ..clash(ClashClass::Apart, [0.0; 3]) });
        }
        if is_disjoint
            && tolerance < reach
            && (tolerance == 0.0 || !self.cores_within(a, b, pose, limit_of_cores(a, b, tolerance))?)
        {
            let (distance, point) = self.gap(a, b, pose)?;
            return Ok(Clash { distance, ..clash(ClashClass::Near, point) });
        }
        if self.are_duplicates(a, b, pose, tolerance)? {
            let [lo, hi] = bounds(&PlacedShape::from(a));
            return Ok(clash(ClashClass::Duplicated, middle(lo, hi)));
        }
        let (own, other) = (PlacedShape::from(a), b.at(pose));
        if matches!(relation, Relation::AInB | Relation::BInA) {
            let (inner, outer) = if relation == Relation::AInB { (&own, &other) } else { (&other, &own) };
            return Ok(clash(ClashClass::Contained, self.first_inside(inner, outer)?.unwrap_or_default()));
        }
        let has_depth = a.is_closed()? && b.is_closed()?;
        if is_disjoint {
            let (distance, point) = self.gap(a, b, pose)?;
            let depth = has_depth.then_some(Penetration { point, ..Penetration::APART });
            return Ok(Clash { distance, depth, ..clash(ClashClass::Touching, point) });
        }
        if !has_depth {
            return Ok(clash(ClashClass::Intersecting, self.common_contact(a, b, pose)?));
        }
        let search = PenetrationOptions::new().relative_gap(options.relative_gap);
        let visits = self.memory.budget.clone();
        self.memory.budget = visits.clone().rest(visits.left().min(options.visits));
        let depth = self.depth_of_overlap(a, b, pose, &search);
        let made = self.memory.budget.made();
        self.memory.budget = visits;
        self.memory.budget.charge(made)?;
        let depth = depth?;
        let class = if depth.lower > tolerance {
            ClashClass::Overlapping
        } else if depth.upper <= tolerance {
            ClashClass::Touching
        } else {
            ClashClass::Undecided
        };
        let point = if depth.lower > 0.0 { depth.point } else { self.common_contact(a, b, pose)? };
        Ok(Clash { depth: Some(depth), ..clash(class, point) })
    }

    /// Returns how far apart the surfaces of two shapes are that have no common point, and the point in the middle of the gap.
    fn gap(&mut self, a: Shape<'_>, b: Shape<'_>, pose: &Pose) -> Result<(f64, [f64; 3]), QueryError> {
        let nearest = self.distance_of_cores(a, b, pose)?;
        let Distance { distance, point_a, point_b, .. } = self.distance_of_shapes(a, b, pose, nearest)?;
        Ok((distance, middle(point_a, point_b)))
    }

    /// Returns a point near the contact of two shapes that touch.
    fn common_contact(&mut self, a: Shape<'_>, b: Shape<'_>, pose: &Pose) -> Result<[f64; 3], QueryError> {
        let Distance { point_a, point_b, .. } = self.distance_of_cores(a, b, pose)?;
        Ok(middle(point_a, point_b))
    }

    /// Returns whether two shapes are the same part in the same place: they have as many triangles and the same box, and each
    /// vertex of either is within the tolerance of the other's surface.
    fn are_duplicates(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        tolerance: f64,
    ) -> Result<bool, QueryError> {
        if a.triangles() != b.triangles() || a.radius() != b.radius() {
            return Ok(false);
        }
        let (own, other) = (PlacedShape::from(a), b.at(pose));
        let [box_a, box_b] = [&own, &other].map(bounds);
        let differ = |x: &f64, y: &f64| (x - y).abs() > tolerance + 1e-9 * (x.abs() + y.abs());
        if box_a.as_flattened().iter().zip(box_b.as_flattened()).any(|(x, y)| differ(x, y)) {
            return Ok(false);
        }
        if a.identity() == b.identity() && displacement(b, &Pose::IDENTITY, pose) <= tolerance {
            return Ok(true);
        }
        Ok(self.all_within(&own, &other, tolerance)? && self.all_within(&other, &own, tolerance)?)
    }

    /// Returns whether all vertices of a mesh are within a distance of the core of another shape.
    fn all_within(
        &mut self,
        mesh: &PlacedShape<'_>,
        other: &PlacedShape<'_>,
        d: f64,
    ) -> Result<bool, QueryError> {
        let bvh = mesh.shape.bvh();
        let mut are_within = true;
        for object in mesh.shape.objects() {
            each_triangle(bvh, object, |place| {
                let mut corners = stored_at(bvh, object, place)?;
                if let Some(pose) = &mesh.pose {
                    corners = placed(&corners, pose);
                }
                for corner in &corners {
                    let corner = check_point(corner)?;
                    are_within &= self.closest_of_core(other, &corner, d, IsWithin::Closed)?.is_some();
                }
                Ok(!are_within)
            })?;
        }
        Ok(are_within)
    }
}

/// Returns the point in the middle between two others.
fn middle(from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) / 2.0)
}
