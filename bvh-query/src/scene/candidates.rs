//! The pairs that a question of a scene is about: how they are found, in pieces, and asked about, on one thread or on all.

use crate::error::QueryError;
use crate::file::shape::Shape;
use crate::pose::Pose;
use crate::query::querier::Querier;
use crate::query::tracker::Tracker;
use crate::scene::broad_phase::NearestFirst;
use crate::scene::instance::InstanceId;
use crate::scene::{Scene, SceneError};
use crate::traverse::budget::Budget;
use std::ops::ControlFlow;
use std::sync::MutexGuard;
use std::sync::atomic::{AtomicU64, Ordering};

/// A pair of instances. A is the lower one. In answers about motions ([`SceneMotionAnswer`](crate::SceneMotionAnswer)),
/// A is the instance that stands still, if one does.
///
/// [`Scene::pairs_within`] has an example.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ScenePair {
    /// The instance in whose frame answers are given.
    pub a: InstanceId,
    /// The other instance.
    pub b: InstanceId,
}

/// The most pairs of a question that are held at a time, which take 1.5 MiB. If more are near each other, pairs are
/// found instance by instance until this many are held, and are tested before the next ones are found.
pub(super) const MAX_KNOWN_PAIRS: usize = 1 << 16;

/// Which pairs of a question are found next.
pub(super) enum Next {
    /// All of them, unless they are too many.
    All,
    /// Those of which A is in this place or a later one.
    From(u32),
}

/// A pair to ask about: places of instances, and the square of a lower bound of the distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearPair {
    pub(super) a: u32,
    pub(super) b: u32,
    pub(super) squared_gap: f64,
}

/// A pair of instances as questions about two shapes take it.
pub(super) struct InstancePair<'a> {
    pub(super) ids: ScenePair,
    pub(super) a: Shape<'a>,
    pub(super) b: Shape<'a>,
    /// B in A's frame.
    pub(super) pose: Pose,
    /// A in the world.
    pub(super) world: Pose,
    /// What is remembered of the pair, if the scene wants that.
    tracker: Option<MutexGuard<'a, Tracker>>,
}

impl InstancePair<'_> {
    /// Returns whether the pair is at most `d` apart; with 0, whether it touches.
    pub(super) fn within(&mut self, querier: &mut Querier, d: f64) -> Result<bool, QueryError> {
        match &mut self.tracker {
            Some(tracker) => tracker.within(querier, self.a, self.b, &self.pose, d),
            None => querier.within(self.a, self.b, &self.pose, d),
        }
    }
}

/// Takes some near pairs of a scene, and breaks where no more are wanted.
type VisitNearPairs<'a> = &'a mut dyn FnMut(&mut Scene, Vec<NearPair>) -> Result<ControlFlow<()>, SceneError>;

/// Sorts near pairs by the gaps of their boxes.
pub(super) fn nearest_first(near_pairs: &mut [NearPair]) {
    near_pairs
        .sort_unstable_by(|x, y| x.squared_gap.total_cmp(&y.squared_gap).then((x.a, x.b).cmp(&(y.a, y.b))));
}

impl NearPair {
    /// Returns whether both are of the same instances.
    pub(super) fn is_of(&self, other: &Self) -> bool {
        (self.a, self.b) == (other.a, other.b)
    }
}

impl Scene {
    /// Returns the pair asked about whose boxes are nearest, unless finding it takes too much memory.
    pub(super) fn nearest_boxes(&self) -> Result<Option<NearPair>, SceneError> {
        let mut order = NearestFirst::new(&self.contents.broad);
        self.charged(|budget| {
            while let Some((x, y, squared_gap)) = order.next(&self.contents.broad, budget)? {
                if let Some(near_pair) = self.near_pair(x, y, squared_gap) {
                    return Ok(Some(near_pair));
                }
            }
            Ok(None)
        })
    }

    /// Searches the broad phase and charges the question for it.
    pub(super) fn charged<R>(
        &self,
        search: impl FnOnce(&mut Budget) -> Result<R, QueryError>,
    ) -> Result<R, SceneError> {
        let mut budget = self.workers.rest();
        let found = search(&mut budget);
        self.workers.charge(budget.made())?;
        Ok(found?)
    }

    /// Starts a question, and asks about all pairs at most `limit` apart, in ascending order. `remembers` tells that trackers
    /// help with the question.
    pub(super) fn each_near<R: Send>(
        &mut self,
        limit: f64,
        remembers: bool,
        ask: impl Fn(&mut Querier, &mut InstancePair<'_>) -> Result<Option<R>, QueryError> + Sync,
    ) -> Result<Vec<R>, SceneError> {
        let mut all = Vec::new();
        self.each_piece(limit, &mut |scene, near_pairs| {
            if remembers {
                scene.remember(&near_pairs);
            }
            all.extend(scene.each(&near_pairs, &ask)?);
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(all)
    }

    /// Starts a question, and calls `visit` with the tested pairs whose boxes are at most `limit` apart, until `visit`
    /// breaks. The pairs come in ascending order, in several calls if there are many.
    pub(super) fn each_piece(&mut self, limit: f64, visit: VisitNearPairs<'_>) -> Result<(), SceneError> {
        self.start();
        let mut next = Next::All;
        while let Some(mut near_pairs) = self.next_piece(&mut next, limit)? {
            near_pairs.sort_unstable_by_key(|near_pair| (near_pair.a, near_pair.b));
            if visit(self, near_pairs)?.is_break() {
                break;
            }
        }
        Ok(())
    }

    /// Returns the next tested pairs whose boxes are at most `limit` apart, in any order. These are all pairs, unless
    /// there are too many for one piece. All pairs of a piece precede those of the next piece.
    pub(super) fn next_piece(
        &self,
        next: &mut Next,
        limit: f64,
    ) -> Result<Option<Vec<NearPair>>, SceneError> {
        let mut near_pairs = Vec::new();
        let limit = limit + self.contents.reach_of_pairs();
        let places = self.contents.instances.len() as u32;
        self.charged(|budget| {
            if matches!(next, Next::All) {
                let backend = self.workers.backend();
                let all = self.contents.broad.pairs(backend, limit, budget, |x, y, squared_gap| {
                    if near_pairs.len() == MAX_KNOWN_PAIRS {
                        return ControlFlow::Break(());
                    }
                    near_pairs.extend(self.near_pair(x, y, squared_gap));
                    ControlFlow::Continue(())
                })?;
                if all.is_continue() {
                    *next = Next::From(places);
                    return Ok(());
                }
                *next = Next::From(0);
                near_pairs.clear();
            }
            while let Next::From(place) = next
                && *place < places
                && near_pairs.len() < MAX_KNOWN_PAIRS
            {
                let a = *place;
                *place += 1;
                let Some(one) = self.contents.at(a) else { continue };
                self.contents.broad.near(
                    &one.bounds,
                    one.groups,
                    |_| limit,
                    budget,
                    |b, squared_gap| {
                        if b > a {
                            near_pairs.extend(self.near_pair(a, b, squared_gap));
                        }
                    },
                )?;
            }
            Ok(())
        })?;
        Ok((!near_pairs.is_empty()).then_some(near_pairs))
    }

    /// Returns a pair of places in order, unless it may touch.
    fn near_pair(&self, x: u32, y: u32, squared_gap: f64) -> Option<NearPair> {
        let (a, b) = (x.min(y), x.max(y));
        (!self.contents.known(a).allows(b)).then_some(NearPair { a, b, squared_gap })
    }

    /// Returns the pair of the last answer, if it is still asked about.
    pub(super) fn likely_pair(&self) -> Option<NearPair> {
        let (a, b) = self.likely?;
        // They may have been removed since.
        let (first, second) = (self.contents.at(a)?, self.contents.at(b)?);
        let squared_gap = first.bounds.squared_gap(&second.bounds);
        (first.groups.meet(second.groups) && !first.allows(b)).then_some(NearPair { a, b, squared_gap })
    }

    /// Makes a tracker for each candidate, if the scene wants that.
    pub(super) fn remember(&mut self, near_pairs: &[NearPair]) {
        self.trackers.expect(near_pairs.iter().map(|near_pair| (near_pair.a, near_pair.b)));
    }

    /// Goes on with a question that asks about one pair.
    pub(super) fn of_pair<R: Send>(
        &mut self,
        pair: ScenePair,
        ask: impl Fn(&mut Querier, &mut InstancePair<'_>) -> Result<R, QueryError> + Sync,
    ) -> Result<Option<R>, SceneError> {
        let near_pair = NearPair { a: pair.a.place, b: pair.b.place, squared_gap: 0.0 };
        Ok(self.each(&[near_pair], |querier, pair| ask(querier, pair).map(Some))?.pop())
    }

    /// Asks about each near pair, in the order given.
    pub(super) fn each<R: Send>(
        &mut self,
        near_pairs: &[NearPair],
        ask: impl Fn(&mut Querier, &mut InstancePair<'_>) -> Result<Option<R>, QueryError> + Sync,
    ) -> Result<Vec<R>, SceneError> {
        let mut stats = self.stats;
        let asked = AtomicU64::new(self.pairs_asked);
        let scene = &*self;
        let found = scene.workers.each(near_pairs, &mut stats, |querier, near_pair| {
            let mut answer = None;
            scene.ask_pair(querier, near_pair, &asked, &mut |querier, pair| {
                answer = ask(querier, pair)?;
                Ok(())
            })?;
            Ok(answer)
        });
        (self.stats, self.pairs_asked) = (stats, asked.into_inner());
        found.map_err(|(number, source)| self.error_of(near_pairs[number].a, near_pairs[number].b, source))
    }

    /// Asks about a near pair, and counts its questions. It calls `ask` through a pointer, so that it is compiled once, and not
    /// for each question.
    fn ask_pair(
        &self,
        querier: &mut Querier,
        near_pair: &NearPair,
        asked: &AtomicU64,
        ask: &mut dyn FnMut(&mut Querier, &mut InstancePair<'_>) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let &NearPair { a, b, .. } = near_pair;
        let (one, other, ids) = (self.contents.known(a), self.contents.known(b), self.ids(a, b));
        let pose = Pose::relative_of_instances(&one.world, &other.world);
        let before = querier.questions();
        let (file_a, file_b) = (one.shape.file()?, other.shape.file()?);
        let (tracker, margin) = (self.trackers.get((a, b)), one.margin + self.contents.margin_of_pair(a, b));
        let a = one.shape.in_file(&file_a).with_margin(margin);
        let b = other.shape.in_file(&file_b).with_margin(other.margin);
        let pair = &mut InstancePair { ids, a, b, pose, world: one.world, tracker };
        let answer = self.workers.ask_rest(querier, |querier| ask(querier, pair));
        asked.fetch_add(querier.questions() - before, Ordering::Relaxed);
        answer
    }

    /// Names the pair whose question has no answer.
    pub(super) fn pair_error(&self, pair: ScenePair, source: QueryError) -> SceneError {
        SceneError::Pair { a: self.contents.label(pair.a), b: self.contents.label(pair.b), source }
    }

    /// Names the instances in two places, whose question has no answer.
    pub(super) fn error_of(&self, a: u32, b: u32, source: QueryError) -> SceneError {
        self.pair_error(self.ids(a, b), source)
    }

    /// Returns the identifiers of the instances in two places.
    pub(super) fn ids(&self, a: u32, b: u32) -> ScenePair {
        ScenePair { a: self.contents.known(a).id(a), b: self.contents.known(b).id(b) }
    }
}
