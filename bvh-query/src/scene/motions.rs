//! Motions in a scene: some instances move on paths, and questions are about all pairs with at least one of these.
//!
//! A pair has one path: that of B in the frame of A. A is the instance that stands still or, if both move, the lower
//! one. Pairs whose boxes never come near each other are left out. To find these, the whole time is divided into
//! slices: during a slice, an instance stays in the box around its places at both ends, except for the sagitta.
//!
//! What is attached to a moving instance moves as well, on the path of that one composed with the pose that is kept. Two
//! instances that follow the same one stand still in each other's frame, which needs one interval instead of many.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::motion::{AttachedPath, RelativePath, RigidPath, TogetherPath};
use crate::query::distance::Distance;
use crate::query::motion::{Earliest, EndedByError, MotionAnswer, MotionOptions, default_tolerance};
use crate::query::querier::Querier;
use crate::scene::attachments::Table;
use crate::scene::candidates::{MAX_KNOWN_PAIRS, ScenePair};
use crate::scene::contents::reach_of;
use crate::scene::instance::{Instance, InstanceId};
use crate::scene::world_box::WorldBox;
use crate::scene::{Scene, SceneError};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// The most slices into which the time is divided, so that boxes follow the paths.
const MOST_SLICES: usize = 16;

/// Whether the motions of all moving instances are free. In the pairs named here, A is the instance that stands still
/// or, if both move, the lower one.
///
/// [`Scene::motion`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum SceneMotionAnswer {
    /// At no time from 0 to 1 is any pair within the clearance.
    Free,
    /// A pair is within the clearance in the poses at `touching_at`.
    Hit {
        /// Before this time certainly no pair is within the clearance. It equals `touching_at` only if both are 0.
        free_until: f64,
        /// A time at which the pair is within the clearance: the earliest one found.
        touching_at: f64,
        /// The pair. If there are several such pairs, it is the first.
        pair: ScenePair,
        /// The distance of the pair at that time.
        nearest: Distance,
    },
    /// A pair comes near, but it is undecided whether it comes within the clearance, as for [`MotionAnswer::Near`].
    Near {
        /// Before this time certainly no pair is within the clearance.
        free_until: f64,
        /// The time of the first undecided poses.
        at: f64,
        /// The pair.
        pair: ScenePair,
        /// The distance of the pair at that time.
        nearest: Distance,
    },
}

/// A path in the world that threads share.
type WorldPath<'a> = &'a (dyn RigidPath + Sync);

/// A pair to ask about: places of instances, and the first slice in which their boxes come near each other.
#[derive(Clone, Copy, Debug)]
struct Encounter {
    slice: usize,
    a: u32,
    b: u32,
}

/// Called with pairs to ask about, until it breaks. Through a reference, because each copy of the search takes 5 KB.
type VisitEncounters<'a> = dyn FnMut(&[Encounter]) -> Result<ControlFlow<()>, SceneError> + 'a;

/// A moving instance, and where it is during each slice.
struct Moving<'a> {
    place: u32,
    instance: &'a Instance,
    /// The girth of its box at the start.
    girth: f64,
    slices: Vec<WorldBox>,
}

impl Moving<'_> {
    /// Returns the number of slices for the whole time: the ratio of the sizes of the box and the instance.
    fn slices_worthwhile(&self) -> usize {
        let times = self.slices[0].girth() / self.girth;
        if times.is_finite() { (times as usize).clamp(1, MOST_SLICES) } else { MOST_SLICES }
    }
}

/// The path of a moving instance.
struct BodyTrack<'a> {
    place: u32,
    /// The place of the instance that the path was given for: its own, or that of one above it.
    given: u32,
    path: AttachedPath<'a>,
}

/// The paths in question, and their numbers by the places of their instances.
struct BodyTracks<'a> {
    tracks: Vec<BodyTrack<'a>>,
    numbers: Table,
    options: &'a MotionOptions,
}

impl Scene {
    /// Returns whether the motions of some instances are free while they move in the world along `paths`, at the same
    /// time, and the other instances stand still. The query is about all pairs with at least one moving instance
    /// whose groups meet and whose contact is not allowed. The present pose of a moving instance does not matter, and
    /// does not change.
    ///
    /// Instances that are attached to a moving one ([`Scene::attach`]) move with it: at each time, they are where
    /// [`Scene::set_pose`] would take them. If an instance has a path of its own, it moves on that path, whatever it is
    /// attached to, and what is attached to it follows it.
    ///
    /// The answer is certain at every moment. It combines the answers of [`Querier::motion`] about each pair along its
    /// [`RelativePath`] to the earliest hit, before which no pair is within the clearance. Each pair has its own
    /// default tolerance. If an instance is named twice, the last path counts. [`Scene::add`] must accept all poses of
    /// a path.
    ///
    /// Cost: that of [`Querier::motion`] for each pair whose boxes come near each other, until the earliest hit. If
    /// both instances of a pair turn, more intervals are needed than if one stands still, unless both follow the same
    /// instance: then a pair takes one query about contact.
    ///
    /// ```
    /// use bvh_query::{Motion, MotionOptions, SceneMotionAnswer, ScenePair};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let path = Motion::between(&at(0.0)?, &at(1.0)?)?;
    /// let answer = scene.motion(&[(left, &path)], &MotionOptions::new())?;
    /// let SceneMotionAnswer::Hit { free_until, touching_at, pair, .. } = answer else { panic!("{answer:?}") };
    /// assert!(free_until <= 0.5 && 0.5 <= touching_at && touching_at - free_until < 1e-5);
    /// assert_eq!(pair, ScenePair { a: right, b: left }); // A stands still
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::NoInstance`] for an identifier of no instance, [`SceneError::Pose`] for a start or an end of a path that
    /// [`Scene::set_pose`] refuses; [`SceneError::Query`] for an invalid clearance or tolerance; and
    /// [`SceneError::Pair`] with the first pair whose query has no answer before the earliest hit.
    pub fn motion(
        &mut self,
        paths: &[(InstanceId, WorldPath<'_>)],
        options: &MotionOptions,
    ) -> Result<SceneMotionAnswer, SceneError> {
        let tracks = self.tracks(paths, options)?;
        let earliest = Earliest::new();
        let mut together = Together::default();
        self.each_way(
            &tracks,
            |querier, pair, a, b, path| {
                let answer = querier.motion_before(a, b, path, options, &earliest);
                Ok((!matches!(answer, Ok(MotionAnswer::Free))).then_some((pair, answer)))
            },
            |answers| {
                together.add(answers);
                ControlFlow::Continue(())
            },
        )?;
        match together.first_error() {
            Some((pair, error)) => Err(self.pair_error(pair, error)),
            None => Ok(together.answer()),
        }
    }

    /// Returns whether the motions are certainly free: whether [`Scene::motion`] would answer
    /// [`SceneMotionAnswer::Free`]. It takes less time than the full answer. Use it in planners. To check many edges on
    /// all cores, clone the scene for each thread.
    ///
    /// ```
    /// use bvh_query::{Motion, MotionOptions};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let closer = Motion::between(&at(0.0)?, &at(1.0)?)?;
    /// let away = Motion::between(&at(2.5)?, &at(3.5)?)?;
    /// assert!(!scene.is_free(&[(left, &closer)], &MotionOptions::new())?);
    /// assert!(scene.is_free(&[(left, &closer), (right, &away)], &MotionOptions::new())?); // at the same time
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::motion`], unless another pair is found not to be free.
    pub fn is_free(
        &mut self,
        paths: &[(InstanceId, WorldPath<'_>)],
        options: &MotionOptions,
    ) -> Result<bool, SceneError> {
        let tracks = self.tracks(paths, options)?;
        let is_hit = AtomicBool::new(false);
        let mut first_error = None;
        self.each_way(
            &tracks,
            |querier, pair, a, b, path| {
                if is_hit.load(Ordering::Relaxed) {
                    return Ok(None);
                }
                match querier.is_free(a, b, path, options) {
                    Ok(true) => Ok(None),
                    Ok(false) => {
                        is_hit.store(true, Ordering::Relaxed);
                        Ok(None)
                    }
                    Err(source) => Ok(Some((pair, source))),
                }
            },
            |errors| {
                first_error = first_error.take().or(errors.into_iter().next());
                if is_hit.load(Ordering::Relaxed) {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            },
        )?;
        match first_error {
            _ if is_hit.into_inner() => Ok(false),
            Some((pair, source)) => Err(self.pair_error(pair, source)),
            None => Ok(true),
        }
    }

    /// Checks what is given.
    fn tracks<'a>(
        &mut self,
        paths: &[(InstanceId, WorldPath<'a>)],
        options: &'a MotionOptions,
    ) -> Result<BodyTracks<'a>, SceneError> {
        options.check()?;
        for &(id, path) in paths {
            self.contents.check_pose(id, &path.pose(0.0))?;
            self.contents.check_pose(id, &path.pose(1.0))?;
        }
        let mut numbers = Table::new(self.contents.instances.len());
        let mut tracks: Vec<BodyTrack<'_>> = Vec::new();
        for &(id, path) in paths {
            let way = BodyTrack { place: id.place, given: id.place, path: AttachedPath::new(path) };
            match numbers.get(id.place) {
                Some(number) => tracks[number] = way,
                None => {
                    numbers.set(id.place, tracks.len());
                    tracks.push(way);
                }
            }
        }
        // What is attached follows, unless it has a path of its own. The list grows on the way.
        let mut next = 0;
        while let Some(&BodyTrack { place, given, .. }) = tracks.get(next) {
            for &child in self.contents.at(place).iter().flat_map(|instance| &instance.children) {
                let (Some(attached), Some(id)) = (self.contents.attached(child), self.contents.id_at(child))
                else {
                    continue;
                };
                if numbers.get(child).is_none() {
                    let path = tracks[next].path.of_child(attached.kept);
                    self.contents.check_pose(id, &path.pose(0.0))?;
                    self.contents.check_pose(id, &path.pose(1.0))?;
                    numbers.set(child, tracks.len());
                    tracks.push(BodyTrack { place: child, given, path });
                }
            }
            next += 1;
        }
        self.start();
        Ok(BodyTracks { tracks, numbers, options })
    }

    /// Calls `visit` with the pairs that may come within the clearance, until `visit` breaks: in several calls if there
    /// are many. The pairs of a call are in the order in which their boxes come near each other.
    fn each_piece_of_encounters(
        &self,
        tracks: &BodyTracks<'_>,
        visit: &mut VisitEncounters<'_>,
    ) -> Result<(), SceneError> {
        let all = |slices: usize| -> Vec<Moving<'_>> {
            tracks.tracks.iter().map(|way| self.moving(way.place, &way.path, slices)).collect()
        };
        let mut moving = all(1);
        let slices = moving.iter().map(Moving::slices_worthwhile).max().unwrap_or(1);
        if slices > 1 {
            moving = all(slices);
        }
        let mut encounters = Vec::new();
        for (number, one) in moving.iter().enumerate() {
            let whole = one.slices.iter().fold(WorldBox::EMPTY, |whole, slice| whole.union(slice));
            let mut near = Vec::new();
            let limit =
                |other: &WorldBox| tracks.limit_by_boxes(&whole, other) + self.contents.reach_of_pairs();
            self.charged(|budget| {
                budget.charge((moving.len() - number) as u64)?;
                self.contents
                    .broad
                    .near(&whole, one.instance.groups, limit, budget, |place, _| near.push(place))
            })?;
            for place in near.into_iter().filter(|place| tracks.of(*place).is_none()) {
                let other = self.contents.known(place);
                let still = vec![other.bounds; slices];
                let pair = [(place, other, still.as_slice()), (one.place, one.instance, &one.slices)];
                encounters.extend(self.encounter(pair, tracks));
            }
            for other in &moving[number + 1..] {
                let (a, b) = if one.place < other.place { (one, other) } else { (other, one) };
                let pair = [a, b].map(|of| (of.place, of.instance, of.slices.as_slice()));
                encounters.extend(self.encounter(pair, tracks));
            }
            if encounters.len() >= MAX_KNOWN_PAIRS || number + 1 == moving.len() {
                encounters.sort_unstable_by_key(|encounter| (encounter.slice, encounter.a, encounter.b));
                if visit(&encounters)?.is_break() {
                    break;
                }
                encounters.clear();
            }
        }
        Ok(())
    }

    /// Returns a moving instance with its boxes.
    fn moving(&self, place: u32, path: WorldPath<'_>, slices: usize) -> Moving<'_> {
        let instance = self.contents.known(place);
        let radius = instance.measures.radius;
        let time = |end: usize| end as f64 / slices as f64;
        let ends: Vec<WorldBox> = (0..=slices).map(|end| instance.bounds_at(&path.pose(time(end)))).collect();
        let slice = |number: usize| {
            let sagitta = path.sagitta(radius, time(number), time(number + 1));
            let sagitta = if sagitta >= 0.0 { sagitta } else { f64::INFINITY };
            ends[number].union(&ends[number + 1]).grown(sagitta)
        };
        let slices = (0..slices).map(slice).collect();
        Moving { place, instance, girth: ends[0].girth(), slices }
    }

    /// Returns when the boxes of two instances first come near each other, if they do and are asked about.
    fn encounter(
        &self,
        [(a, one, slices), (b, other, others)]: [(u32, &Instance, &[WorldBox]); 2],
        tracks: &BodyTracks<'_>,
    ) -> Option<Encounter> {
        if !one.groups.meet(other.groups) || one.allows(b) {
            return None;
        }
        let margin = self.contents.margin_of_pair(a, b);
        let default = || default_tolerance(one.measures_with(margin), other.measures_with(0.0));
        let tolerance = tracks.options.tolerance.unwrap_or_else(default);
        let limit = (tracks.options.clearance + tolerance + reach_of(margin)).powi(2);
        let is_near = |(one, other): (&WorldBox, &WorldBox)| one.squared_gap(other) <= limit;
        let slice = slices.iter().zip(others).position(is_near);
        slice.map(|slice| Encounter { slice, a, b })
    }

    /// Asks about each pair with the path of B in A's frame, and calls `adopt` with the answers about a piece of them, until it
    /// breaks.
    fn each_way<R: Send>(
        &mut self,
        tracks: &BodyTracks<'_>,
        ask: impl Fn(
            &mut Querier,
            ScenePair,
            Shape<'_>,
            Shape<'_>,
            &dyn RigidPath,
        ) -> Result<Option<R>, QueryError>
        + Sync,
        mut adopt: impl FnMut(Vec<R>) -> ControlFlow<()>,
    ) -> Result<(), SceneError> {
        let (mut stats, mut pairs_asked) = (self.stats, 0);
        let scene = &*self;
        let asked = scene.each_piece_of_encounters(tracks, &mut |encounters| {
            pairs_asked += encounters.len() as u64;
            let found = scene.workers.each(encounters, &mut stats, |querier, &Encounter { a, b, .. }| {
                let (one, other) = (scene.contents.known(a), scene.contents.known(b));
                let relative = RelativePath::new(tracks.path(a, one), tracks.path(b, other));
                let together = tracks.together(a, b);
                let path: &dyn RigidPath = together.as_ref().map_or(&relative, |together| together);
                let (file_a, file_b) = (one.shape.file()?, other.shape.file()?);
                let pair = ScenePair { a: one.id(a), b: other.id(b) };
                let margin = one.margin + scene.contents.margin_of_pair(a, b);
                let a = one.shape.in_file(&file_a).with_margin(margin);
                let b = other.shape.in_file(&file_b).with_margin(other.margin);
                scene.workers.ask_rest(querier, |querier| ask(querier, pair, a, b, path))
            });
            let found = found.map_err(|(number, source)| {
                scene.error_of(encounters[number].a, encounters[number].b, source)
            })?;
            Ok(adopt(found))
        });
        (self.stats, self.pairs_asked) = (stats, pairs_asked);
        asked
    }
}

impl<'a> BodyTracks<'a> {
    /// Returns the path of an instance, if it moves.
    fn of(&self, place: u32) -> Option<&BodyTrack<'a>> {
        self.numbers.get(place).map(|number| &self.tracks[number])
    }

    /// Returns the path of an instance, which may be its pose.
    fn path<'b>(&'b self, place: u32, instance: &'b Instance) -> &'b dyn RigidPath {
        match self.of(place) {
            Some(way) => &way.path,
            None => &instance.world,
        }
    }

    /// Returns the path of B in A's frame if both follow the same instance, or one follows the other.
    fn together(&self, a: u32, b: u32) -> Option<TogetherPath<'_>> {
        let (a, b) = (self.of(a)?, self.of(b)?);
        (a.given == b.given).then_some(TogetherPath { a: &a.path, b: &b.path })
    }

    /// Returns how far apart the boxes of two instances may be for a question to matter. The default tolerance is at most a
    /// millionth of the larger size, or what a part of the boxes' own error covers. The diagonal of an object's own box is at most
    /// the square root of 3 times that of any box around it, and no side of the latter is longer than all.
    fn limit_by_boxes(&self, one: &WorldBox, other: &WorldBox) -> f64 {
        let default = 2e-6 * one.girth().max(other.girth());
        self.options.clearance + self.options.tolerance.unwrap_or(default)
    }
}

/// The answers about pairs so far, put together; pairs that are free add nothing.
struct Together {
    free_until: f64,
    /// The earliest, and of equally early ones the first pair.
    hit: Option<(f64, ScenePair, Distance)>,
    near: Option<(f64, ScenePair, Distance)>,
    /// In ascending order of the pairs; each search ended earlier than those of all pairs before.
    errors: Vec<(ScenePair, EndedByError)>,
}

impl Default for Together {
    fn default() -> Self {
        Self { free_until: f64::INFINITY, hit: None, near: None, errors: Vec::new() }
    }
}

impl Together {
    fn add(&mut self, answers: Vec<(ScenePair, Result<MotionAnswer, EndedByError>)>) {
        for (pair, answer) in answers {
            let (free_until, time, nearest, first) = match answer {
                Ok(MotionAnswer::Free) => continue,
                Ok(MotionAnswer::Hit { free_until, touching_at, nearest }) => {
                    (free_until, touching_at, nearest, &mut self.hit)
                }
                Ok(MotionAnswer::Near { free_until, at, nearest }) => {
                    (free_until, at, nearest, &mut self.near)
                }
                Err(ended) => {
                    self.errors.push((pair, ended));
                    continue;
                }
            };
            self.free_until = self.free_until.min(free_until);
            if first.is_none_or(|(first_time, first_pair, _)| (time, pair) < (first_time, first_pair)) {
                *first = Some((time, pair, nearest));
            }
        }
        // Which of the errors is the answer depends on the earliest hit. None is where an earlier pair ended no later.
        self.errors.sort_unstable_by_key(|(pair, _)| *pair);
        let mut ended_at = f64::INFINITY;
        self.errors.retain(|(_, ended)| {
            let is_earlier = ended.decided_until < ended_at;
            ended_at = ended_at.min(ended.decided_until);
            is_earlier
        });
    }

    /// Takes the error of the first pair that has no answer before the earliest hit. Errors after that do not matter: searches
    /// may end there before they meet them.
    fn first_error(&mut self) -> Option<(ScenePair, QueryError)> {
        let last = self.hit.map_or(f64::INFINITY, |(time, ..)| time);
        let first = self.errors.iter().position(|(_, ended)| ended.decided_until <= last)?;
        let (pair, ended) = self.errors.swap_remove(first);
        Some((pair, ended.error))
    }

    fn answer(&self) -> SceneMotionAnswer {
        let free_until = self.free_until;
        match (self.hit, self.near) {
            (Some((touching_at, pair, nearest)), _) => {
                SceneMotionAnswer::Hit { free_until, touching_at, pair, nearest }
            }
            (None, Some((at, pair, nearest))) => SceneMotionAnswer::Near { free_until, at, pair, nearest },
            (None, None) => SceneMotionAnswer::Free,
        }
    }
}
