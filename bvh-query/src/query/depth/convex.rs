//! How deep two convex solids overlap, from the nearest face of their Minkowski difference.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::narrow::{ConvexSolid, Enclosed, Point, dot, subtract};
use crate::numerics::UNIT_ROUNDOFF;
use crate::pose::Pose;
use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::polytope::{Corner, Face, Polytope};
use crate::query::depth::translation::{Translation, length_above};
use crate::query::querier::Querier;
use std::sync::Arc;

/// How deep two convex solids overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConvexDepth {
    /// Bounds of the depth; the upper one is the length of the translation, after which B is free.
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) translation: Point,
    /// A point in both.
    pub(super) common: Point,
    /// The points of A and of B that meet where B comes free.
    pub(super) points: [Point; 2],
    pub(super) is_spent: bool,
}

/// Two convex solids, and the vertices from which the next search for a farthest one starts.
struct Solids<'a> {
    a: &'a ConvexSolid,
    b: &'a ConvexSolid,
    pose: &'a Pose,
    last: [u32; 2],
}

impl Solids<'_> {
    /// Returns the point of the difference that is the farthest along a direction, but for roundings.
    fn farthest(&mut self, direction: &Point) -> Corner {
        let rows = self.pose.rotation();
        let back = [0, 1, 2].map(|k| -(0..3).map(|j| rows[j][k] * direction[j]).sum::<f64>());
        let Self { a, b, pose, last } = self;
        *last = [a.farthest(direction, last[0]), b.farthest(&back, last[1])];
        let of_a = a.vertices[last[0] as usize];
        let of_b = pose.place(b.vertices[last[1] as usize]);
        Corner { difference: subtract(of_a, of_b), of_a, of_b }
    }

    /// Returns how far B has to move along a unit direction at least until a plane across it is between the solids: the greatest
    /// difference of heights of all vertices. Heights are those over a point, so that they are as precise as the solids are small.
    fn width(&self, direction: &Point, over: &Point) -> f64 {
        let height = |vertex: Point| dot(*direction, subtract(vertex, *over));
        let highest = self.a.vertices.iter().map(|v| height(*v)).fold(f64::NEG_INFINITY, f64::max);
        let lowest =
            self.b.vertices.iter().map(|v| height(self.pose.place(*v))).fold(f64::INFINITY, f64::min);
        highest - lowest
    }
}

impl Querier {
    /// Returns the depth of two shapes if their cores are convex solids that certainly overlap; none if they are not, or where
    /// roundings matter too much. The search ends as soon as both bounds are enough for the options.
    ///
    /// The surface of the placed B is within what placing it rounds of a convex one. Scaled about a centre so that it keeps as far
    /// inside of that as the surface may come, B is certainly convex; that takes the same part of its reach as of the ball inside.
    pub(super) fn convex_depth(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<Option<ConvexDepth>, QueryError> {
        let (Some(of_a), Some(of_b)) = (core(a)?, core(b)?) else { return Ok(None) };
        let line = Translation::new(a, b, pose);
        let placing = 2.0 * line.placing;
        let bent = placing * (1.0 + 2.0 * of_b.reach / of_b.inner);
        let mut solids = Solids { a: &of_a, b: &of_b, pose, last: [0; 2] };
        let between = subtract(of_a.centre, pose.place(of_b.centre));
        let Some(mut polytope) = Polytope::spanning(between, &mut |direction| solids.farthest(direction))
        else {
            return Ok(None);
        };
        let mut best: Option<(f64, Face, [Point; 2])> = None;
        let mut is_spent = false;
        loop {
            let face = polytope.nearest();
            let corner = solids.farthest(&face.normal);
            let height = dot(face.normal, corner.difference);
            if height <= 0.0 {
                return Ok(None);
            }
            let known = best.as_ref().map_or(f64::INFINITY, |best| best.0);
            if face.distance > 0.0 && height < known {
                best = Some((height, face, polytope.foot(&face)));
            }
            let upper = height.min(known) + line.radii;
            let lower = face.distance + line.radii;
            if face.distance > 0.0 && options.is_enough(lower - bent, upper + bent) {
                break;
            }
            match self.memory.budget.visit() {
                Err(QueryError::Budget { .. }) => {
                    is_spent = true;
                    break;
                }
                visited => visited?,
            }
            if height - face.distance <= face.error || !polytope.grow(corner) {
                break;
            }
        }
        let inside = polytope.certain() - bent;
        let Some((_, face, [of_a, of_b])) = best.filter(|_| inside > 0.0) else { return Ok(None) };
        let spare = 32.0 * UNIT_ROUNDOFF * line.size + 2.0 * placing;
        let at = solids.width(&face.normal, &of_a) + line.radii + spare;
        let translation = line.along(face.normal).translation_at(at);
        let upper = length_above(translation);
        let lower = (inside + line.radii).next_down().min(upper);
        // Those of the cores, moved out to the surfaces.
        let out = |from: Point, radius: f64| [0, 1, 2].map(|k| from[k] + radius * face.normal[k]);
        let points = [out(of_a, a.radius()), out(of_b, -b.radius())];
        let common = polytope.common();
        Ok(Some(ConvexDepth { lower, upper, translation, common, points, is_spent }))
    }
}

/// Returns the core of a shape of one object as a convex solid.
fn core(shape: Shape<'_>) -> Result<Option<Arc<ConvexSolid>>, QueryError> {
    if shape.objects().len() != 1 {
        return Ok(None);
    }
    Ok(match shape.bvh().enclosed(shape.first())? {
        Enclosed::Convex(solid) => Some(solid),
        Enclosed::Nothing | Enclosed::Unknown => None,
    })
}

/// Returns whether a shape has an inside: it is closed, and has a radius or triangles with area.
pub(super) fn has_inside(shape: Shape<'_>) -> Result<bool, QueryError> {
    if !shape.is_closed()? {
        return Ok(false);
    }
    let mut has_inside = shape.radius() > 0.0;
    for object in shape.object_numbers() {
        has_inside = has_inside || !matches!(shape.bvh().enclosed(object)?, Enclosed::Nothing);
    }
    Ok(has_inside)
}
