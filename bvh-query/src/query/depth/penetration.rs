//! How deep two shapes overlap: the shortest translation of B that makes interiors disjoint, between two certified bounds.
//!
//! Of two convex solids, both follow from their Minkowski difference ([`super::convex`]). Of others, the lower one follows from two
//! balls about one point ([`super::balls`]) or convex pieces ([`super::pieces`]), and the upper one from places that exact arithmetic calls free ([`super::free`]). A way that comes free ends at a facet of the obstacle, and the shortest way beyond the planes of such
//! facets is the next one to try, as in PolyDepth (Je, Tang, Lee, Lee, Kim, ACM Transactions on Graphics 31(1), 2012). No search
//! of this kind finds the least depth of all meshes, which is why the bounds say how good the answer is.

use crate::error::{NumberError, QueryError};
use crate::file::shape::Shape;
use crate::narrow::{Point, Triangle, cross, dot, subtract};
use crate::pose::Pose;
use crate::query::depth::balls::{ASCENT_STEPS, Balls, Depths, bounds};
use crate::query::depth::convex::ConvexDepth;
use crate::query::depth::free::{Free, LastContact, Search};
use crate::query::depth::options::{PenetrationOptions, check_closed};
use crate::query::depth::planes::{Plane, shortest_beyond};
use crate::query::depth::translation::{Translation, length_above, moved};
use crate::query::probe::relation::Relation;
use crate::query::querier::Querier;
use bvh_format::kdop::FACTORS;
use bvh_format::vec3::length;

/// How far B moves along a direction until interiors are disjoint.
///
/// [`Querier::separation`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Separation {
    /// Interiors meet at all shorter moves along the direction, in mesh units.
    pub lower: f64,
    /// The length of `translation`, in mesh units.
    pub upper: f64,
    /// A move of B along the direction, in A's frame, at which interiors are disjoint.
    pub translation: [f64; 3],
}

/// How deep two shapes overlap.
///
/// [`Querier::penetration`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Penetration {
    /// No shorter translation makes interiors disjoint, in mesh units.
    pub lower: f64,
    /// The length of `translation`, in mesh units.
    pub upper: f64,
    /// A translation of B, in A's frame, at which interiors are disjoint.
    pub translation: [f64; 3],
    /// A point in both shapes, in A's frame, where `lower` is above 0.
    pub point: [f64; 3],
    /// The radii of two balls about the point, one inside A and one inside B, which prove `lower`: their sum, but for roundings. Both
    /// are 0 where convex solids, or convex pieces of the shapes, prove more.
    pub radii: [f64; 2],
    /// Whether the budget ended the search.
    pub is_spent: bool,
}

impl Querier {
    /// Returns how far B moves along a direction, given in A's frame at any length, until interiors are disjoint. A mesh inside
    /// another one moves until it is out.
    ///
    /// Interiors are what [`Querier::side`] calls inside. `upper` is certain because exact arithmetic finds the shapes apart
    /// at the pose with that translation added. `lower` is certain because stretches during which two triangles cross, or a
    /// ball inside A and one inside B have a common point, follow each other without a gap. Both agree to some roundings,
    /// unless surfaces only slide along each other on a part of the way, or a tiny ball does: `lower` ends there. A surface
    /// that encloses no volume counts as if it did. All numbers have the same bits on all backends.
    ///
    /// Cost: some walks, each like one for contact, and as many as triangles follow each other on the way.
    ///
    /// ```
    /// use bvh_query::{Pose, Querier, Separation};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let overlapping = Pose::new(*Pose::IDENTITY.rotation(), [1.5, 0.0, 0.0])?;
    /// let Separation { lower, upper, translation, .. } =
    ///     Querier::new()?.separation(&block, &block, &overlapping, [0.0, 0.0, 1.0])?;
    /// assert!(lower <= 2.0 && 2.0 <= upper && upper - lower < 1e-9); // out through the top
    /// assert_eq!(translation[..2], [0.0, 0.0]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if the direction is zero or not finite; [`QueryError::NotClosed`] if an object of a shape has no
    /// inside; [`QueryError::NoTopology`] if a file was baked without topology; [`QueryError::Damaged`] if a page that the
    /// query touches is damaged; [`QueryError::Budget`] if the budget does not suffice.
    pub fn separation<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        direction: [f64; 3],
    ) -> Result<Separation, QueryError> {
        let (a, b, direction) = (a.into(), b.into(), unit(direction)?);
        self.start();
        check_closed(a, b)?;
        if self.relation_of(a, b, pose)? == Relation::Apart {
            return Ok(Separation { lower: 0.0, upper: 0.0, translation: [0.0; 3] });
        }
        let line = Translation::new(a, b, pose).along(direction);
        let (lower, upper) = match self.free_on(&line, 0.0, f64::INFINITY, Search::First)? {
            Some(Free { at, .. }) => (self.cover(&line, at)?, at),
            // Only in a file with forged bounds are interiors beyond boxes.
            None => (0.0, line.length),
        };
        let translation = line.translation_at(upper);
        Ok(Separation { lower, upper: length_above(translation), translation })
    }

    /// Returns how deep two shapes overlap: bounds of the length of the shortest translation of B after which interiors are
    /// disjoint. Both are exactly 0 where the shapes are apart. Where they only touch, `lower` is 0 and `upper` some roundings.
    ///
    /// Interiors are what [`Querier::side`] calls inside. `upper` is certain because exact arithmetic finds the shapes apart at
    /// the pose with `translation` added.
    ///
    /// For convex shapes of one object and at most 4096 triangles, with a radius or without, the bounds are as near each other as the
    /// options ask for, down to some roundings of the size. For others, `lower` is certain because of convex
    /// pieces of both (up to 1024 triangles) or two balls about one point; it is mostly more than two thirds of the depth, and far less
    /// for shapes that are thin where they cross. Where a shape fits another one without a gap, like a peg in its hole, the depth is not a
    /// continuous function of the pose: then `lower` is about 0, and `upper` how far the peg has to be pulled. All numbers have
    /// the same bits on all backends.
    ///
    /// Cost: some microseconds for convex shapes, once up to 0.2 s to find out that one of 4096 triangles is convex, and 50 bytes of memory for
    /// each of its triangles while the file is open. For others, up to a millisecond for a hundred triangles and some ten for large
    /// meshes. A budget ([`Querier::set_budget`]) ends the search early; the bounds so far are the answer.
    ///
    /// ```
    /// use bvh_query::{Penetration, PenetrationOptions, Pose, Querier};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// let overlapping = Pose::new(*Pose::IDENTITY.rotation(), [1.5, 0.0, 0.0])?;
    /// let Penetration { lower, upper, translation, .. } =
    ///     Querier::new()?.penetration(&block, &block, &overlapping, &PenetrationOptions::new())?;
    /// assert!(lower <= 0.5 && 0.5 <= upper && upper <= 1.01 * lower);
    /// assert!(translation[0] >= 0.5); // the shortest way out
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`QueryError::Number`] if an option is invalid; [`QueryError::NotClosed`] if an object of a shape has no inside;
    /// [`QueryError::NoTopology`] if a file was baked without topology; [`QueryError::Damaged`] if a page that the query
    /// touches is damaged; [`QueryError::Budget`] if the budget does not even suffice to find out whether the shapes are apart.
    pub fn penetration<'a>(
        &mut self,
        a: impl Into<Shape<'a>>,
        b: impl Into<Shape<'a>>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<Penetration, QueryError> {
        options.check()?;
        let (a, b) = (a.into(), b.into());
        self.start();
        check_closed(a, b)?;
        if let Some(found) = self.convex_depth(a, b, pose, options)? {
            return Ok(found.into());
        }
        if self.relation_of(a, b, pose)? == Relation::Apart {
            return Ok(Penetration::APART);
        }
        self.search_depth(a, b, pose, options)
    }

    /// Returns the depth of closed shapes that are not apart.
    pub(crate) fn depth_of_overlap(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<Penetration, QueryError> {
        match self.convex_depth(a, b, pose, options)? {
            Some(found) => Ok(found.into()),
            None => self.search_depth(a, b, pose, options),
        }
    }

    /// Looks for the depth of closed shapes that are not apart.
    pub(super) fn search_depth(
        &mut self,
        a: Shape<'_>,
        b: Shape<'_>,
        pose: &Pose,
        options: &PenetrationOptions,
    ) -> Result<Penetration, QueryError> {
        let mut search = DepthSearch::new(Translation::new(a, b, pose), options);
        let is_spent = match search.run(self) {
            Err(QueryError::Budget { .. }) => true,
            result => result.map(|()| false)?,
        };
        Ok(search.answer(is_spent))
    }
}

/// The points that are looked at before directions are tried, and after.
const FIRST_POINTS: u32 = 48;
const ALL_POINTS: u32 = 256;

/// A way may be longer than the shortest one so far by this factor before it is given up: what it leads to may be shorter.
const WAY_FACTOR: f64 = 2.0;

/// By how much a way has to be shorter to be worth another attempt.
const LEAST_GAIN: f64 = 1e-4;

/// The search tries harder while the upper bound exceeds the lower one by more than this factor. Balls reach no more than two
/// thirds of the depth of most convex shapes.
const GOOD_RATIO: f64 = 1.5;

/// The most planes that a search from one direction collects.
const MAX_PLANES: usize = 10;

/// How far behind the last contact deep points are looked for, as parts of the depth.
const SHARES: [f64; 4] = [1.0 / 2.0, 1.0 / 8.0, 1.0 / 32.0, 1.0 / 256.0];

/// What is known of a depth.
struct DepthSearch<'a> {
    line: Translation<'a>,
    options: PenetrationOptions,
    /// The shortest translation so far.
    translation: Point,
    best: f64,
    /// Whether it is the one that takes B's box out of A's.
    is_of_boxes: bool,
    balls: Balls,
    /// The depth of convex pieces.
    pieces: f64,
}

impl<'a> DepthSearch<'a> {
    /// Begins with the shortest way that takes B's box out of A's.
    fn new(line: Translation<'a>, options: &PenetrationOptions) -> Self {
        let [[lo_a, hi_a], [lo_b, hi_b]] = [line.a.into(), line.b.at(line.pose)].map(|shape| bounds(&shape));
        let spare = 8.0 * line.error;
        let mut search = Self {
            line,
            options: *options,
            translation: [0.0; 3],
            best: f64::INFINITY,
            is_of_boxes: true,
            balls: line.no_balls(),
            pieces: 0.0,
        };
        for k in 0..3 {
            for way in [hi_a[k] - lo_b[k] + spare, lo_a[k] - hi_b[k] - spare] {
                if way.abs() < search.best {
                    (search.best, search.translation) = (way.abs(), [0.0; 3]);
                    search.translation[k] = way;
                }
            }
        }
        search
    }

    fn run(&mut self, querier: &mut Querier) -> Result<(), QueryError> {
        let line = self.line;
        // Where surfaces hardly overlap, the contact that stays the longest on this way mostly tells all that there is to know.
        let direction = self.middle_to_middle();
        self.descend(querier, direction)?;
        if !self.is_done() {
            let line = line.along(direction);
            let leaving = querier.leaving(&line, 0.0)?;
            self.improve(querier.point_at_contact(&line, &leaving)?);
            self.improve(querier.balls(&line, FIRST_POINTS, f64::INFINITY)?);
            self.look_at_pieces(querier)?;
        }
        // Boxes are wider than vertices where offsets leave something out.
        let has_wide_box =
            |shape: Shape<'_>| shape.objects().iter().any(|of| of.vertices().left_out != [0.0; 3]);
        if self.is_of_boxes
            && self.best > 0.0
            && self.is_done()
            && (has_wide_box(line.a) || has_wide_box(line.b))
        {
            self.attempt(querier, unit(self.translation)?, Search::Rough)?;
        }
        for start in self.first_directions() {
            if !self.is_done() {
                self.descend(querier, start)?;
            }
        }
        if !self.is_good() {
            self.relax(querier)?;
        }
        for direction in FACTORS.into_iter().skip(3).flat_map(|d| [d, d.map(|x| -x)]) {
            if !self.is_good() {
                self.descend(querier, unit(direction)?)?;
            }
        }
        if !self.is_done() {
            let enough = self.best / (1.0 + self.options.relative_gap);
            self.improve(querier.balls(&line, ALL_POINTS, enough)?);
            self.look_at_pieces(querier)?;
        }
        Ok(())
    }

    /// Returns the best lower bound.
    fn lower(&self) -> f64 {
        self.balls.lower().max(self.pieces)
    }

    /// Looks for a better lower bound in convex pieces about the centre of the balls.
    fn look_at_pieces(&mut self, querier: &mut Querier) -> Result<(), QueryError> {
        if self.balls.lower() > 0.0 && !self.is_done() {
            self.pieces = self.pieces.max(querier.depth_of_pieces(&self.line, &self.balls.centre)?);
        }
        Ok(())
    }

    /// Returns the direction from the middle of A's box to that of B's.
    fn middle_to_middle(&self) -> Point {
        let [[lo_a, hi_a], [lo_b, hi_b]] =
            [self.line.a.into(), self.line.b.at(self.line.pose)].map(|shape| bounds(&shape));
        let way = [0, 1, 2].map(|k| (lo_b[k] - lo_a[k]) + (hi_b[k] - hi_a[k]));
        unit(way).unwrap_or([1.0, 0.0, 0.0])
    }

    /// Returns the ways on which the balls leave the other shape soonest, and the axes of both frames.
    fn first_directions(&self) -> Vec<Point> {
        let Balls { centre, depths, .. } = self.balls;
        let [out_of_a, out_of_b] = depths.closest;
        let ways = [subtract(out_of_a, centre), subtract(centre, out_of_b)];
        let ways = ways.into_iter().filter(|_| self.balls.lower() > 0.0).filter_map(|way| unit(way).ok());
        let rows = [*Pose::IDENTITY.rotation(), *self.line.pose.rotation()];
        let axes = rows.iter().flat_map(|rows| [0, 1, 2].map(|k| [rows[0][k], rows[1][k], rows[2][k]]));
        ways.chain(axes.flat_map(|axis| [axis, axis.map(|x| -x)])).collect()
    }

    fn is_done(&self) -> bool {
        self.options.is_enough(self.lower(), self.best)
    }

    fn is_good(&self) -> bool {
        self.is_done() || self.best <= GOOD_RATIO * self.lower()
    }

    fn improve(&mut self, balls: Balls) {
        if balls.lower() > self.balls.lower() {
            self.balls = balls;
        }
    }

    /// Moves B out of one contact after the other, the shortest way beyond all of them, and tries the way that this leads to.
    fn relax(&mut self, querier: &mut Querier) -> Result<(), QueryError> {
        let mut planes: Vec<Plane> = Vec::new();
        let (mut shift, mut balls) = ([0.0; 3], self.balls);
        for _ in 0..MAX_PLANES {
            let Depths { a, b, closest } = balls.depths;
            if balls.lower() <= 0.0 {
                break;
            }
            let out =
                if a > b { subtract(closest[0], balls.centre) } else { subtract(balls.centre, closest[1]) };
            let Ok(normal) = unit(out) else { break };
            planes.push(Plane { normal, height: dot(normal, shift) + 1.01 * balls.lower() });
            let Some(next) = shortest_beyond(&planes) else { break };
            shift = next;
            if length(shift) >= self.best {
                return Ok(());
            }
            let pose = moved(self.line.pose, shift);
            let line = Translation { pose: &pose, direction: normal, ..self.line };
            let leaving = querier.leaving(&line, 0.0)?;
            balls = querier.point_at_contact(&line, &leaving)?;
        }
        unit(shift).map_or(Ok(()), |direction| self.descend(querier, direction))
    }

    /// Tries a direction, and then the shortest ways beyond the planes through which ways came free.
    fn descend(&mut self, querier: &mut Querier, start: Point) -> Result<(), QueryError> {
        let mut planes = Vec::new();
        let (mut direction, mut search, mut least) = (start, Search::Rough, f64::INFINITY);
        while planes.len() < MAX_PLANES {
            let Some(free) = self.attempt(querier, direction, search)? else { break };
            let Some(last) = free.last.filter(|_| !self.is_done()) else { break };
            if free.at < (1.0 - LEAST_GAIN) * least {
                planes.clear();
                least = free.at;
            }
            planes.push(Plane { normal: last.normal, height: free.at * dot(last.normal, direction) });
            let Some(shortest) = shortest_beyond(&planes) else { break };
            let way = length(shortest);
            // B is beyond all of them where it is, but for roundings.
            if way == 0.0 {
                break;
            }
            let next = shortest.map(|x| x / way);
            if way >= (1.0 - LEAST_GAIN) * self.best || dot(next, direction) > 1.0 - 1e-9 {
                break;
            }
            (direction, search) = (next, Search::Near(way));
        }
        Ok(())
    }

    /// Goes a way until it comes free or is too long.
    fn attempt(
        &mut self,
        querier: &mut Querier,
        direction: Point,
        search: Search,
    ) -> Result<Option<Free>, QueryError> {
        let line = self.line.along(direction);
        // All moves shorter than the lower bound are covered, in whatever direction.
        let free = querier.free_on(&line, self.lower(), WAY_FACTOR * self.best, search)?;
        if let Some(free) = &free
            && free.at < self.best
        {
            (self.best, self.translation) = (free.at, line.translation_at(free.at));
            self.is_of_boxes = false;
            if let Some(last) = &free.last {
                self.look_behind(querier, &line, free.at, last)?;
            }
        }
        Ok(free)
    }

    /// Looks for a deep point where the triangles were that were the last in contact.
    fn look_behind(
        &mut self,
        querier: &mut Querier,
        line: &Translation<'_>,
        at: f64,
        last: &LastContact,
    ) -> Result<(), QueryError> {
        let (a, b) = (line.a.into(), line.b.at(line.pose));
        let mut best = self.balls;
        let back = |share: f64| [0, 1, 2].map(|k| last.point[k] - share * at * line.direction[k]);
        let ends = [(last.point, &last.triangles[0]), (back(1.0), &last.triangles[1])];
        // Where smooth surfaces overlap, what is between the last contact's points tells all.
        querier.offer(&a, &b, &mut best, back(0.5))?;
        if self.options.is_enough(best.lower(), self.best) {
            self.balls = best;
            return Ok(());
        }
        let behind =
            SHARES.iter().flat_map(|share| ends.map(|(point, triangle)| behind(point, triangle, share * at)));
        for centre in behind {
            querier.offer(&a, &b, &mut best, centre)?;
        }
        if best.lower() > self.balls.lower() {
            querier.ascend(&a, &b, &mut best, ASCENT_STEPS)?;
            self.balls = best;
        }
        Ok(())
    }

    fn answer(&self, is_spent: bool) -> Penetration {
        let are_balls_best = self.balls.lower() >= self.pieces;
        let radii = [self.balls.depths.a, self.balls.depths.b];
        Penetration {
            lower: self.lower().min(self.best),
            upper: length_above(self.translation),
            translation: self.translation,
            point: self.balls.centre,
            radii: if are_balls_best { radii.map(|radius| radius.max(0.0)) } else { [0.0; 2] },
            is_spent,
        }
    }
}

impl Penetration {
    /// Shapes that are apart.
    pub(crate) const APART: Self = Self {
        lower: 0.0,
        upper: 0.0,
        translation: [0.0; 3],
        point: [0.0; 3],
        radii: [0.0; 2],
        is_spent: false,
    };
}

impl From<ConvexDepth> for Penetration {
    fn from(found: ConvexDepth) -> Self {
        let ConvexDepth { lower, upper, translation, common, is_spent, .. } = found;
        Self { lower, upper, translation, point: common, radii: [0.0; 2], is_spent }
    }
}

/// Returns a point near one of a triangle's, some way towards its centre and a quarter of that inwards.
fn behind(point: Point, triangle: &Triangle, way: f64) -> Point {
    let [p, q, r] = *triangle;
    let to_centre = [0, 1, 2].map(|k| (p[k] + q[k] + r[k]) / 3.0 - point[k]);
    let normal = cross(subtract(q, p), subtract(r, p));
    let along = (way / length(to_centre).max(f64::MIN_POSITIVE)).min(0.5);
    let inwards = way / 4.0 / length(normal).max(f64::MIN_POSITIVE);
    [0, 1, 2].map(|k| point[k] + along * to_centre[k] - inwards * normal[k])
}

/// Returns a direction at unit length, or an error if it is zero or not finite.
pub(crate) fn unit(direction: Point) -> Result<Point, QueryError> {
    let larger = |most: f64, x: &f64| if x.abs() > most || x.is_nan() { x.abs() } else { most };
    let largest = direction.iter().fold(0.0, larger);
    if !(2f64.powi(-500)..=2f64.powi(500)).contains(&largest) {
        return Err(NumberError::Direction(largest).into());
    }
    let scaled = direction.map(|x| x / largest);
    let length = length(scaled);
    Ok(scaled.map(|x| x / length))
}
