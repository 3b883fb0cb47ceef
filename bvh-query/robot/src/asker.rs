//! Asks about one configuration after the other: what a thread needs for itself.

use crate::error::RobotError;
use crate::frame::{Frame, Point};
use crate::robot::{Pair, Setting};
use bvh_query::{BackendError, Distance, Pose, Querier, QueryError};

/// A querier, and where everything is in the configuration in question.
pub(crate) struct Asker {
    pub(crate) querier: Querier,
    /// The frames of groups of links, in the world.
    groups: Vec<Frame>,
    /// The middles of the balls around the parts, in the world.
    centres: Vec<Point>,
    /// The pair that touched last. It is likely to touch again.
    likely: usize,
}

impl std::fmt::Debug for Asker {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Asker").finish_non_exhaustive()
    }
}

impl Clone for Asker {
    /// Returns one that remembers nothing.
    fn clone(&self) -> Self {
        Self::with(Querier::with_backend(self.querier.backend()))
    }
}

impl Asker {
    pub(crate) fn new() -> Result<Self, BackendError> {
        Ok(Self::with(Querier::new()?))
    }

    fn with(querier: Querier) -> Self {
        Self { querier, groups: Vec::new(), centres: Vec::new(), likely: usize::MAX }
    }

    /// Goes to a configuration.
    pub(crate) fn place(&mut self, setting: &Setting, joints: &[f64]) -> Result<(), RobotError> {
        setting.model.check(joints)?;
        setting.model.place(joints, &mut self.groups);
        self.centres.clear();
        let groups = &self.groups;
        self.centres.extend(setting.parts.iter().map(|part| groups[part.group].place(part.centre)));
        Ok(())
    }

    /// Returns how far apart the balls around both parts are; negative where they meet.
    #[inline]
    fn gap(&self, pair: &Pair) -> f64 {
        let squared = squared_distance(&self.centres[pair.a], &self.centres[pair.b]);
        squared.sqrt() - pair.reach
    }

    /// Returns the frame of a part in the world.
    pub(crate) fn frame(&self, setting: &Setting, part: usize) -> Frame {
        let part = &setting.parts[part];
        self.groups[part.group].of(&part.origin)
    }

    /// Returns the pose of B in A's frame.
    fn pose(&self, setting: &Setting, pair: &Pair) -> Result<Pose, RobotError> {
        let relative = self.frame(setting, pair.a).relative(&self.frame(setting, pair.b));
        Ok(relative.pose()?)
    }

    fn touches(&mut self, setting: &Setting, number: usize) -> Result<bool, RobotError> {
        let pair = &setting.pairs[number];
        let squared = squared_distance(&self.centres[pair.a], &self.centres[pair.b]);
        if squared > pair.reach * pair.reach {
            return Ok(false);
        }
        let pose = self.pose(setting, pair)?;
        let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
        self.querier.collide(a, b, &pose).map_err(|source| failed(setting, pair, source))
    }

    /// Returns how far apart a pair is.
    pub(crate) fn distance(&mut self, setting: &Setting, pair: &Pair) -> Result<Distance, RobotError> {
        let pose = self.pose(setting, pair)?;
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
        for number in 0..setting.pairs.len() {
            if number != likely && self.touches(setting, number)? {
                self.likely = number;
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Returns the pairs that touch, by their numbers.
    pub(crate) fn touching(&mut self, setting: &Setting, joints: &[f64]) -> Result<Vec<usize>, RobotError> {
        self.place(setting, joints)?;
        let mut touching = Vec::new();
        for number in 0..setting.pairs.len() {
            if self.touches(setting, number)? {
                touching.push(number);
            }
        }
        Ok(touching)
    }

    /// Returns the nearest pair, its distance, and the nearest points in the world; none if there are no pairs. Of pairs that are
    /// equally near it is the first.
    pub(crate) fn nearest(
        &mut self,
        setting: &Setting,
        joints: &[f64],
    ) -> Result<Option<Nearest>, RobotError> {
        self.place(setting, joints)?;
        let mut order: Vec<(f64, usize)> =
            setting.pairs.iter().enumerate().map(|(number, pair)| (self.gap(pair), number)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut nearest: Option<Nearest> = None;
        for (gap, number) in order {
            let limit = nearest.as_ref().map_or(f64::INFINITY, |held| held.distance.upper);
            if gap > limit {
                break;
            }
            let pair = &setting.pairs[number];
            let failed = |source| failed(setting, pair, source);
            let pose = self.pose(setting, pair)?;
            let [a, b] = [pair.a, pair.b].map(|part| &setting.parts[part].shape);
            if limit.is_finite() && !self.querier.within(a, b, &pose, limit).map_err(failed)? {
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

/// The pair that is nearest.
pub(crate) struct Nearest {
    pub(crate) pair: usize,
    pub(crate) distance: Distance,
    /// In the world.
    pub(crate) points: [Point; 2],
}

/// Names the pair whose question has no answer.
pub(crate) fn failed(setting: &Setting, pair: &Pair, source: QueryError) -> RobotError {
    let [a, b] = [pair.a, pair.b].map(|part| setting.name(part).to_owned());
    RobotError::Pair { a, b, source }
}

fn squared_distance(a: &Point, b: &Point) -> f64 {
    let way = [0, 1, 2].map(|k| b[k] - a[k]);
    way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
}
