//! Asks about one configuration after the other: what a thread needs for itself.

use crate::balls::Balls;
use crate::error::RobotError;
use crate::frame::{Frame, Point, each};
use crate::rod::are_within;
use crate::screening::Screening;
use crate::setting::{Pair, Part, Setting};
use bvh_query::{BackendError, Distance, PenetrationOptions, Querier, QueryError, SignedDistance, Stop};
use std::sync::Arc;

/// A pair that may be near: its bodies, how far the balls around its parts are apart, and its number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) bodies: [usize; 2],
    pub(crate) gap: f64,
    pub(crate) number: usize,
}

/// A querier, and where everything is in the configuration in question.
pub(crate) struct Asker {
    pub(crate) querier: Querier,
    /// Stops questions when it is set. The querier has it, too.
    stop: Option<Arc<dyn Stop>>,
    /// The frames of groups of links, in the world.
    pub(crate) groups: Vec<Frame>,
    /// The balls around the parts, in the world.
    pub(crate) balls: Balls,
    /// More than the roundings of these places.
    pub(crate) slack: f64,
    /// The pair that touched last. It is likely to touch again.
    likely: usize,
    /// Memory for the pairs that may be near, and for their numbers.
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) near: Vec<usize>,
    /// What may come near.
    pub(crate) screening: Screening,
}

impl std::fmt::Debug for Asker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Asker").finish_non_exhaustive()
    }
}

impl Clone for Asker {
    /// Returns one that remembers nothing, with the same settings.
    fn clone(&self) -> Self {
        let mut asker = Self::with(Querier::with_backend(self.querier.backend()));
        asker.set_stop(self.stop().cloned());
        asker
    }
}

impl Asker {
    pub(crate) fn new() -> Result<Self, BackendError> {
        Ok(Self::with(Querier::new()?))
    }

    pub(crate) fn with(querier: Querier) -> Self {
        Self {
            querier,
            stop: None,
            groups: Vec::new(),
            balls: Balls::default(),
            slack: 0.0,
            likely: usize::MAX,
            candidates: Vec::new(),
            near: Vec::new(),
            screening: Screening::default(),
        }
    }

    /// Stops questions when a flag is set.
    pub(crate) fn set_stop(&mut self, stop: Option<Arc<dyn Stop>>) {
        self.querier.set_stop(stop.clone());
        self.stop = stop;
    }

    pub(crate) fn stop(&self) -> Option<&Arc<dyn Stop>> {
        self.stop.as_ref()
    }

    /// Returns an error if questions have to stop. What balls and rods decide never asks the querier.
    pub(crate) fn go_on(&self) -> Result<(), QueryError> {
        match &self.stop {
            Some(stop) if stop.is_set() => Err(QueryError::Stopped),
            _ => Ok(()),
        }
    }

    /// Goes to a configuration.
    pub(crate) fn place(&mut self, setting: &Setting, joints: &[f64]) -> Result<(), RobotError> {
        self.go_on()?;
        setting.model.check(joints)?;
        setting.model.place(joints, &mut self.groups);
        self.slack = ROUNDING * self.balls.place(&setting.layout, &self.groups);
        Ok(())
    }

    /// Returns the frame of a part in the world.
    pub(crate) fn frame(&self, setting: &Setting, part: usize) -> Frame {
        let part = &setting.parts[part];
        self.groups[part.group].of(&part.origin)
    }

    /// Returns the frame of B in A's.
    pub(crate) fn relative(&self, setting: &Setting, pair: &Pair) -> Frame {
        self.frame(setting, pair.a).relative(&self.frame(setting, pair.b))
    }

    #[inline]
    pub(crate) fn touches(&mut self, setting: &Setting, number: usize) -> Result<bool, RobotError> {
        let pair = &setting.pairs[number];
        let reach = pair.reach(&setting.parts) + self.slack;
        if self.balls.squared_distance([pair.a, pair.b]) > reach * reach {
            return Ok(false);
        }
        self.shapes_touch(setting, pair)
    }

    #[inline(never)]
    fn shapes_touch(&mut self, setting: &Setting, pair: &Pair) -> Result<bool, RobotError> {
        if let Some(touches) = self.rods_are_within(setting, pair, 0.0) {
            return Ok(touches);
        }
        let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
        if b.is_still && is_off_box(&self.balls.middle(pair.a), a, b, self.slack) {
            return Ok(false);
        }
        let relative = self.relative(setting, pair);
        if boxes_apart(&relative, a, b, self.slack) {
            return Ok(false);
        }
        let pose = relative.pose()?;
        self.querier.collide(&a.shape, &b.shape, &pose).map_err(|source| failed(setting, pair, source))
    }

    /// Returns whether a pair is within a distance, 0 for contact, or `None` if its rods do not tell.
    #[inline(always)]
    pub(crate) fn rods_are_within(&self, setting: &Setting, pair: &Pair, distance: f64) -> Option<bool> {
        let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
        let groups = [a, b].map(|part| &self.groups[part.group]);
        are_within(a.rods.as_ref()?, b.rods.as_ref()?, groups, distance, self.slack)
    }

    /// Returns how far apart a pair is.
    pub(crate) fn distance(&mut self, setting: &Setting, pair: &Pair) -> Result<Distance, RobotError> {
        let pose = self.relative(setting, pair).pose()?;
        let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
        self.querier.distance(a, b, &pose).map_err(|source| failed(setting, pair, source))
    }

    /// Returns whether any pair touches.
    pub(crate) fn collide(&mut self, setting: &Setting, joints: &[f64]) -> Result<bool, RobotError> {
        self.place(setting, joints)?;
        let likely = self.likely;
        if likely < setting.pairs.len() && self.touches(setting, likely)? {
            return Ok(true);
        }
        self.among_near(setting, |asker, near| {
            for &number in near.iter().filter(|&&number| number != likely) {
                if asker.shapes_touch(setting, &setting.pairs[number])? {
                    asker.likely = number;
                    return Ok(true);
                }
            }
            Ok(false)
        })
    }

    /// Asks with the numbers of the pairs whose balls meet, in no order that means anything.
    fn among_near<R>(
        &mut self,
        setting: &Setting,
        ask: impl FnOnce(&mut Self, &mut [usize]) -> Result<R, RobotError>,
    ) -> Result<R, RobotError> {
        let mut near = std::mem::take(&mut self.near);
        self.balls.list_near(&setting.layout, self.slack, &mut near);
        let answer = ask(self, &mut near);
        self.near = near;
        answer
    }

    /// Returns pairs that touch, by their numbers: of each two bodies, the first pair that does.
    pub(crate) fn touching(&mut self, setting: &Setting, joints: &[f64]) -> Result<Vec<usize>, RobotError> {
        self.place(setting, joints)?;
        self.among_near(setting, |asker, near| {
            near.sort_unstable();
            let mut touching: Vec<usize> = Vec::new();
            for &mut number in near {
                let pair = &setting.pairs[number];
                // The others of the same bodies do not matter, and come next.
                let is_known =
                    |&last: &usize| setting.bodies_of(&setting.pairs[last]) == setting.bodies_of(pair);
                if !touching.last().is_some_and(is_known) && asker.shapes_touch(setting, pair)? {
                    touching.push(number);
                }
            }
            Ok(touching)
        })
    }

    /// Returns the parts of which one is inside the other without touching it, the inner one first: those that touch as soon as the
    /// outer one is solid.
    pub(crate) fn inside(
        &mut self,
        setting: &Setting,
        joints: &[f64],
    ) -> Result<Vec<[usize; 2]>, RobotError> {
        self.place(setting, joints)?;
        self.among_near(setting, |asker, near| {
            near.sort_unstable();
            let mut found = Vec::new();
            for &mut number in near {
                let pair = &setting.pairs[number];
                if asker.shapes_touch(setting, pair)? {
                    continue;
                }
                for [inner, outer] in [[pair.b, pair.a], [pair.a, pair.b]] {
                    if asker.touches_solid(setting, pair, outer)? {
                        found.push([inner, outer]);
                    }
                }
            }
            Ok(found)
        })
    }

    /// Returns whether a pair touches if one of its parts, which is a closed surface, is a solid.
    fn touches_solid(&mut self, setting: &Setting, pair: &Pair, outer: usize) -> Result<bool, RobotError> {
        let shape = &setting.parts[outer].shape;
        if shape.shape().is_solid() {
            return Ok(false);
        }
        let relative = self.relative(setting, pair);
        let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part]);
        if boxes_apart(&relative, a, b, self.slack) {
            return Ok(false);
        }
        let failed = |source| failed(setting, pair, source);
        if !shape.shape().is_closed().map_err(failed)? {
            return Ok(false);
        }
        let solid = shape.clone().solid().map_err(failed)?;
        let [a, b] =
            [pair.a, pair.b].map(|part| if part == outer { &solid } else { &setting.parts[part].shape });
        self.querier.collide(a, b, &relative.pose()?).map_err(failed)
    }

    /// Returns the nearest pair, its distance, and the nearest points in the world; none if there are no pairs. Of pairs that are
    /// equally near it is the first.
    pub(crate) fn nearest(
        &mut self,
        setting: &Setting,
        joints: &[f64],
    ) -> Result<Option<Nearest>, RobotError> {
        self.place(setting, joints)?;
        let mut nearest: Option<Nearest> = None;
        for (gap, number) in self.by_gaps(setting) {
            let limit = nearest.as_ref().map_or(f64::INFINITY, |held| held.distance.upper);
            if gap > limit {
                break;
            }
            let pair = &setting.pairs[number];
            let failed = |source| failed(setting, pair, source);
            let by_rods =
                if limit.is_finite() { self.rods_are_within(setting, pair, limit) } else { Some(true) };
            if by_rods == Some(false) {
                continue;
            }
            let pose = self.relative(setting, pair).pose()?;
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
            if by_rods.is_none() && !self.querier.within(a, b, &pose, limit).map_err(failed)? {
                continue;
            }
            let distance = self.querier.distance(a, b, &pose).map_err(failed)?;
            let order = |of: &Nearest| (of.distance.distance, of.pair);
            let world = self.frame(setting, pair.a);
            let points = [distance.point_a, distance.point_b].map(|point| world.place(point));
            let found = Nearest { pair: number, distance, points };
            if nearest.as_ref().is_none_or(|held| order(&found) < order(held)) {
                nearest = Some(found);
            }
        }
        Ok(nearest)
    }
}

impl Asker {
    /// Returns the pair with the least signed distance, and the answer in the world; none if there are no pairs.
    pub(crate) fn nearest_signed(
        &mut self,
        setting: &Setting,
        joints: &[f64],
        options: &PenetrationOptions,
    ) -> Result<Option<(usize, SignedDistance)>, RobotError> {
        self.place(setting, joints)?;
        // A robot without pairs would not refuse them.
        options.check()?;
        let mut nearest: Option<(usize, SignedDistance)> = None;
        for (gap, number) in self.by_gaps(setting) {
            let [lower, upper] =
                nearest.as_ref().map_or([f64::INFINITY; 2], |(_, held)| [held.lower, held.upper]);
            // Balls that overlap come free after a move as long as the overlap, and so do the parts in them.
            if gap > lower {
                break;
            }
            let pair = &setting.pairs[number];
            let failed = |source| failed(setting, pair, source);
            let pose = self.relative(setting, pair).pose()?;
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
            // A part may be inside another one whose surface is far away, but not if their balls are apart.
            if gap > 0.0 && upper.is_finite() && !self.querier.within(a, b, &pose, upper).map_err(failed)? {
                continue;
            }
            let found = self.querier.signed_distance(a, b, &pose, options).map_err(failed)?;
            if nearest.as_ref().is_none_or(|held| (found.lower, number) < (held.1.lower, held.0)) {
                nearest = Some((number, found));
            }
        }
        Ok(nearest.map(|(number, found)| (number, self.in_world(setting, &setting.pairs[number], found))))
    }

    /// Returns an answer about a pair with points and directions in the world.
    pub(crate) fn in_world(&self, setting: &Setting, pair: &Pair, of: SignedDistance) -> SignedDistance {
        let world = self.frame(setting, pair.a);
        let turned = world.turning();
        let mut found = of;
        for point in [&mut found.point_a, &mut found.point_b] {
            *point = world.place(*point);
        }
        for direction in [&mut found.normal, &mut found.translation] {
            *direction = turned.place(*direction);
        }
        found
    }

    /// Returns the pairs by how far apart the balls around them are at least, the nearest first.
    fn by_gaps(&self, setting: &Setting) -> Vec<(f64, usize)> {
        let mut order = self.balls.gaps(&setting.layout, self.slack);
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order
    }
}

/// The pair that is nearest.
pub(crate) struct Nearest {
    pub(crate) pair: usize,
    pub(crate) distance: Distance,
    /// In the world.
    pub(crate) points: [Point; 2],
}

/// Names the pair whose question has no answer, unless all questions were stopped.
pub(crate) fn failed(setting: &Setting, pair: &Pair, source: QueryError) -> RobotError {
    if source == QueryError::Stopped {
        return source.into();
    }
    let [a, b] = setting.names([pair.a, pair.b]);
    RobotError::Pair { a, b, source }
}

/// More than what a chain of a hundred joints rounds, as a part of how far it is from the origin.
const ROUNDING: f64 = 1.0 / (1u64 << 42) as f64;

/// Returns whether the ball around a part, which has its middle here in the world, is apart from the box around one that stands still.
fn is_off_box(middle: &Point, a: &Part, b: &Part, slack: f64) -> bool {
    let at = b.origin.find(*middle);
    let way = each(|k| (at[k] - b.middle_of_box[k]).abs());
    let size = way[0] + way[1] + way[2] + b.size_of_box + a.radius;
    let reach = a.radius + slack + (ROUNDING + a.departure + b.departure) * size;
    let off = each(|k| (way[k] - b.half[k]).max(0.0));
    off[0] * off[0] + off[1] * off[1] + off[2] * off[2] > reach * reach
}

/// Returns whether the boxes around two parts are apart along an axis of one, or along one that is across an axis of each (Gottschalk,
/// Lin, Manocha, SIGGRAPH 1996).
pub(crate) fn boxes_apart(b_in_a: &Frame, a: &Part, b: &Part, slack: f64) -> bool {
    let middle = b_in_a.place(b.middle_of_box);
    let way = each(|k| middle[k] - a.middle_of_box[k]);
    let (turn, half_a, half_b) = (&b_in_a.rotation, &a.half, &b.half);
    // Columns of a rotation that is not rigid are not quite unit vectors, nor across each other.
    let off = ROUNDING + a.departure + b.departure;
    let slack = slack + off * (a.size_of_box + b.size_of_box + way[0].abs() + way[1].abs() + way[2].abs());
    let steep = each(|i| each(|j| turn[i][j].abs() + ROUNDING));
    let on_a =
        |i: usize| way[i].abs() > half_a[i] + (0..3).map(|j| steep[i][j] * half_b[j]).sum::<f64>() + slack;
    let on_b = |j: usize| {
        let along: f64 = (0..3).map(|i| turn[i][j] * way[i]).sum();
        along.abs() > half_b[j] + (0..3).map(|i| steep[i][j] * half_a[i]).sum::<f64>() + slack
    };
    let across = |i: usize, j: usize| {
        let [(p, q), (s, t)] = [i, j].map(|k| ((k + 1) % 3, (k + 2) % 3));
        let reach_a = half_a[p] * steep[q][j] + half_a[q] * steep[p][j];
        let reach_b = half_b[s] * steep[i][t] + half_b[t] * steep[i][s];
        (way[q] * turn[p][j] - way[p] * turn[q][j]).abs() > reach_a + reach_b + slack
    };
    (0..3).any(on_a) || (0..3).any(on_b) || (0..9).any(|axes| across(axes / 3, axes % 3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape};
    use cbvh_testkit::Random;

    /// Boxes are apart where solid boxes do not touch, unless they nearly do.
    #[test]
    fn boxes_are_apart_where_they_do_not_touch() {
        let random = &mut Random::new(7);
        let part = |_| {
            let sides = [(); 3].map(|()| 0.05 + random.unit());
            let (bytes, _) = to_bytes(&shapes::block(sides).unwrap(), &Options::default()).unwrap();
            let shape = OwnedShape::from(Bvh::from_bytes(bytes).unwrap()).solid().unwrap();
            Part::new(0, (0, false), Frame::IDENTITY, shape, 0.0).unwrap()
        };
        let parts: Vec<Part> = (0..24).map(part).collect();
        let (mut querier, mut apart, mut off) = (Querier::new().unwrap(), 0, 0);
        for round in 0..2000 {
            let [a, b] = [(); 2].map(|()| &parts[random.below(parts.len())]);
            let frame = Frame::from_quaternion(random.quaternion(), random.point().map(|x| 0.8 * x));
            let pose = frame.pose().unwrap();
            let distance = querier.distance(&a.shape, &b.shape, &pose).unwrap().distance;
            let is_apart = boxes_apart(&frame, a, b, 0.0);
            assert!(!is_apart || distance > 0.0, "round {round}: {distance}");
            assert!(is_apart || distance < 1e-9, "round {round}: {distance}");
            apart += u32::from(is_apart);
            // The ball around B, seen from A.
            let is_off = is_off_box(&frame.place(b.centre), b, a, 0.0);
            assert!(!is_off || distance > 0.0, "round {round}: {distance}");
            off += u32::from(is_off);
        }
        assert!((500..1500).contains(&apart) && off > apart / 3, "{apart} {off}");
    }
}
