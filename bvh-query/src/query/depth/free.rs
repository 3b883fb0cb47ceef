//! The straight ways on which B leaves A.
//!
//! ```text
//! at := 0, or what is known to be covered; while at < limit:
//!     if pairs of triangles certainly cross at `at`: go on to where the last of them has left
//!     else if the shapes are apart a few roundings around where the last contact at `at` leaves: that place is free
//!     else if interiors certainly meet for some way: go on by that
//!     else go on to where the last contact has left, and some roundings more each time
//! ```
//!
//! A search for any free place first steps over fine meshes: while the shapes meet at a place further on, it goes there, and each
//! step is longer than the one before. From the free place that it finds, it goes back by what the distance there allows.
//!
//! A way is covered as far as the first two kinds of steps lead without a gap: interiors meet on all of it. The free place is
//! free because exact arithmetic says so of the pose there, and of nothing else.

use crate::error::QueryError;
use crate::narrow::{Point, Triangle, cross, dot, subtract, triangle_distance};
use crate::numerics::UNIT_ROUNDOFF;
use crate::query::depth::leaving::Leaving;
use crate::query::depth::translation::Translation;
use crate::query::distance::Distance;
use crate::query::probe::relation::Relation;
use crate::query::querier::Querier;

/// Where a way comes free.
#[derive(Clone, Copy, Debug)]
pub(super) struct Free {
    /// Interiors are disjoint at this move.
    pub(super) at: f64,
    /// The contact that was the last to leave, if one was met.
    pub(super) last: Option<LastContact>,
}

/// The contact that was the last to leave on a way.
#[derive(Clone, Copy, Debug)]
pub(super) struct LastContact {
    /// The unit normal of the facet through which the way left it.
    pub(super) normal: Point,
    /// Where the triangles met last, in A's frame.
    pub(super) point: Point,
    /// The triangles of A and of B, with B not moved.
    pub(super) triangles: [Triangle; 2],
}

/// How a free place on a line is looked for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Search {
    /// The first one.
    First,
    /// One that may be behind others which are free for a part of the way to it.
    Rough,
    /// The same, first about as far as this.
    Near(f64),
}

/// The places that are tried: before a contact has certainly left, by parts of what is charged for roundings there, and after it,
/// in errors of placing.
const PARTS: [f64; 2] = [7.0 / 8.0, 1.0 / 2.0];
const STEPS: [f64; 3] = [0.0, 8.0, 64.0];

/// The number of points that are tried to find one that is inside both shapes.
const COMMON_POINTS: u32 = 64;

/// A rough search only looks at places on a way that is longer than so many triangles, each step longer than the last one by a
/// factor. Where it comes free it goes back and divides the step, until that is worth no more than a few crossings.
const MANY_TRIANGLES: f64 = 8.0;
const GROWTH: f64 = 1.5;
const FEW_CROSSINGS: f64 = 4.0;

/// A guess is exceeded by this part of it.
const SPARE: f64 = 1.0 / 4096.0;

/// The steps back to a contact, and when they have reached it: when the gap is this part of the way. They are of no use where the way
/// leads along surfaces, with less than this cosine.
const MAX_STEPS_BACK: u32 = 8;
const TIGHT: f64 = 1e-6;
const LEAST_RATE: f64 = 1.0 / 16.0;

/// The part of the size by which a common point has to bring a way on.
const LEAST_PART: f64 = 2e-7;

/// The most times that common points bring a way on: a small ball that slides along a face comes on by its radius each time.
const MOST_COMMON_WAYS: u32 = 1024;

impl Translation<'_> {
    /// Returns the last of the contacts that were found at a place.
    fn last_contact(&self, at: f64, leaving: &Leaving) -> Option<LastContact> {
        let until = leaving.touches_until?;
        let [a, b] = leaving.last;
        let moved = |by: f64| b.map(|corner| [0, 1, 2].map(|k| corner[k] + by * self.direction[k]));
        let point = triangle_distance(&a, &moved(until)).point_a;
        Some(LastContact { normal: leaving.normal, point, triangles: [a, moved(-at)] })
    }

    /// Returns about what [`stretch`](crate::narrow::stretch) charges for roundings where a contact leaves through a facet.
    fn charge(&self, normal: Point) -> f64 {
        let magnitude = normal[0].abs() + normal[1].abs() + normal[2].abs();
        let rate = dot(normal, self.direction).max(f64::MIN_POSITIVE);
        magnitude * (self.placing + 16.0 * UNIT_ROUNDOFF * self.length) / rate
    }
}

/// Where two cores are that do not touch.
struct Gap {
    distance: f64,
    lower: f64,
    point_a: Point,
    point_b: Point,
    /// From A to B.
    normal: Point,
}

impl Gap {
    /// Returns how far B moves until the two closest points are as far apart as both radii.
    fn way_out(&self, line: &Translation<'_>) -> f64 {
        let along = self.distance * dot(self.normal, line.direction);
        let squared = along * along - self.distance * self.distance + line.radii * line.radii;
        squared.max(0.0).sqrt() - along + 16.0 * line.error
    }

    /// Returns the contact of the closest points, with triangles that face each other there.
    fn contact(&self, line: &Translation<'_>, at: f64) -> LastContact {
        let back = line.translation_at(-at);
        let point_b = [0, 1, 2].map(|k| self.point_b[k] + back[k]);
        let axis = (0..3).fold(0, |k, j| if self.normal[j].abs() < self.normal[k].abs() { j } else { k });
        let mut aside = [0.0; 3];
        aside[axis] = line.size;
        let u = cross(self.normal, aside);
        let v = cross(self.normal, u);
        let around = |p: Point, sign: f64| {
            [[1.0, 0.0], [0.0, sign], [-1.0, -sign]]
                .map(|[i, j]| [0, 1, 2].map(|k| p[k] + i * u[k] + j * v[k]))
        };
        LastContact {
            normal: self.normal,
            point: self.point_a,
            triangles: [around(self.point_a, 1.0), around(point_b, -1.0)],
        }
    }
}

impl Querier {
    /// Returns the first place that is found on a line, before `limit`, where interiors are certainly disjoint. They are known to
    /// meet at all moves shorter than `from`.
    pub(super) fn free_on(
        &mut self,
        line: &Translation<'_>,
        from: f64,
        limit: f64,
        search: Search,
    ) -> Result<Option<Free>, QueryError> {
        let (mut at, mut last, mut stuck) = (from, None, 1.0);
        let mut step = match search {
            Search::Near(guess) if line.radii == 0.0 && line.is_fine => {
                (guess - from).max(0.0) * (1.0 + SPARE) + 64.0 * line.placing
            }
            Search::Rough | Search::Near(_) if limit > MANY_TRIANGLES * line.grain => line.grain / 4.0,
            _ => 0.0,
        };
        let (mut least, mut common_ways) = (0.0, 0);
        while at < limit && at <= line.length {
            while step > least && at < limit {
                if self.relation_of(line.a, line.b, &line.pose_at(at + step))? == Relation::Apart {
                    if let Some(free) = self.tightened(line, from, at + step)? {
                        return Ok(Some(free));
                    }
                    // Beside radii, triangles may be smaller than what a place is rounded by.
                    (step, least) = (step / FEW_CROSSINGS, line.grain.max(line.placing));
                } else if at == from && matches!(search, Search::Near(_)) && line.is_fine {
                    // The guess was too short, but hardly so.
                    (at, step) = (at + step, step / 16.0);
                } else {
                    (at, step) = (at + step, step * GROWTH);
                }
            }
            let leaving = self.leaving(line, at)?;
            let touches = leaving.touches_until.is_some();
            last = if touches { line.last_contact(at, &leaving) } else { last };
            if leaving.crosses_until > line.placing {
                at += leaving.crosses_until;
                least = FEW_CROSSINGS * leaving.crosses_until;
                continue;
            }
            let until = at + leaving.touches_until.unwrap_or(0.0);
            let charge = line.charge(leaving.normal);
            let [near, nearer] = PARTS.map(|part| (until - part * charge).max(at));
            let [first, second, third] = STEPS.map(|step| until + step * stuck * line.placing);
            let mut places = [near, nearer, first, second, third];
            if line.radii > 0.0
                && let Some(gap) = self.gap_of_cores(line, at)?
            {
                last = Some(gap.contact(line, at));
                places[0] = at + gap.way_out(line);
            }
            let mut tried = f64::NAN;
            for place in places.into_iter().filter(|&place| place < limit) {
                if place != std::mem::replace(&mut tried, place)
                    && self.relation_of(line.a, line.b, &line.pose_at(place))? == Relation::Apart
                {
                    return Ok(Some(Free { at: place, last }));
                }
            }
            let way = if common_ways < MOST_COMMON_WAYS { self.common_way(line, at, touches)? } else { 0.0 };
            (at, stuck) = if way > 0.0 {
                common_ways += 1;
                (at + way, 1.0)
            } else {
                (until + STEPS[STEPS.len() - 1] * stuck * line.placing, 4.0 * stuck)
            };
        }
        Ok(None)
    }

    /// Returns how far interiors meet without a gap, up to the end of a way.
    pub(super) fn cover(&mut self, line: &Translation<'_>, end: f64) -> Result<f64, QueryError> {
        let (mut covered, mut common_ways) = (0.0, 0);
        while covered < end && common_ways < MOST_COMMON_WAYS {
            let leaving = self.leaving(line, covered)?;
            let way = if leaving.crosses_until > line.placing {
                leaving.crosses_until
            } else {
                common_ways += 1;
                self.common_way(line, covered, leaving.touches_until.is_some())?
            };
            if way <= 0.0 {
                break;
            }
            covered += way;
        }
        Ok(covered.min(end))
    }

    /// Goes back from a free place for as long as distances say that it is free there, too. Where surfaces are convex, each step ends
    /// nearer to their contact and before it (Newton's method). Nothing if contact is not reached.
    fn tightened(
        &mut self,
        line: &Translation<'_>,
        from: f64,
        place: f64,
    ) -> Result<Option<Free>, QueryError> {
        if line.radii > 0.0 || !line.is_fine {
            return Ok(None);
        }
        let (mut at, mut last) = (place, None);
        for _ in 0..MAX_STEPS_BACK {
            let gap = self.gap_of_cores(line, at)?;
            last = gap.as_ref().map(|gap| gap.contact(line, at)).or(last);
            let rate = gap.as_ref().map_or(1.0, |gap| dot(gap.normal, line.direction));
            let Some(gap) = gap.filter(|gap| gap.distance > TIGHT * at * rate) else {
                return Ok(Some(Free { at, last }));
            };
            let next = at - (gap.lower - 4.0 * line.error) / rate;
            if rate < LEAST_RATE
                || next < from
                || next >= at
                || self.relation_of(line.a, line.b, &line.pose_at(next))? != Relation::Apart
            {
                break;
            }
            at = next;
        }
        Ok(None)
    }

    /// Returns where the cores are at a place, unless they touch.
    fn gap_of_cores(&mut self, line: &Translation<'_>, at: f64) -> Result<Option<Gap>, QueryError> {
        let Distance { distance, lower, upper, point_a, point_b, .. } =
            self.distance_of_cores(line.a, line.b, &line.pose_at(at))?;
        if distance <= line.error {
            return Ok(None);
        }
        let normal = subtract(point_b, point_a).map(|x| x / distance);
        Ok(Some(Gap { distance: upper, lower, point_a, point_b, normal }))
    }

    /// Returns how far B moves at least, from a place on where no triangles certainly cross, until interiors do not meet; 0 if that
    /// is not known, or hardly any way. Rounded shapes meet until the gap of their cores is as wide as both radii. If nothing
    /// touches and neither has a radius, one shape or a part of it is inside the other, and stays there until the gap is closed.
    fn common_way(&mut self, line: &Translation<'_>, at: f64, touches: bool) -> Result<f64, QueryError> {
        let pose = line.pose_at(at);
        let is_enough = |way: &f64| *way > LEAST_PART * line.size;
        if !touches && let Some(gap) = self.gap_of_cores(line, at)? {
            let way = if line.radii > 0.0 {
                line.radii - gap.distance
            } else if self.relation_of(line.a, line.b, &pose)? == Relation::Apart {
                return Ok(0.0);
            } else {
                gap.lower
            };
            if let Some(way) = Some(way - 4.0 * line.error).filter(is_enough) {
                return Ok(way);
            }
        }
        let balls = self.balls(&Translation { pose: &pose, ..*line }, COMMON_POINTS, f64::INFINITY)?;
        Ok(Some(balls.lower()).filter(is_enough).unwrap_or(0.0))
    }
}
