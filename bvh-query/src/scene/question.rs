//! The questions over all pairs of a scene.

use crate::error::QueryError;
use crate::file::owned_shape::OwnedShape;
use crate::pose::Pose;
use crate::query::answers::{Contact, Distance};
use crate::query::options::check_distance;
use crate::query::querier::Querier;
use crate::scene::instance::{Instance, InstanceId};
use crate::scene::{Scene, SceneError};

/// A pair of instances; A is the lower one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct ScenePair {
    /// The lower instance, whose frame answers are in.
    pub a: InstanceId,
    /// The other instance.
    pub b: InstanceId,
}

/// Two triangles in contact, and the instances that they are of.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct SceneContact {
    /// The instances.
    pub pair: ScenePair,
    /// The triangles.
    pub contact: Contact,
}

/// The nearest pair of instances, and how far apart they are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SceneDistance {
    /// The instances. Of pairs that are equally near, the first.
    pub pair: ScenePair,
    /// The answer of [`Querier::distance`]; points are in A's frame.
    pub distance: Distance,
}

/// A pair to ask about: places of instances, and the square of a lower bound of the distance.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    a: u32,
    b: u32,
    squared_gap: f64,
}

/// A pair of instances as questions about two shapes take it.
struct PlacedPair<'a> {
    ids: ScenePair,
    a: &'a OwnedShape,
    b: &'a OwnedShape,
    /// B in A's frame.
    pose: Pose,
}

impl Scene {
    /// Returns whether any pair touches.
    ///
    /// # Errors
    /// [`SceneError::Pair`] with the pair whose question has no answer, because a page is damaged or the budget does not
    /// suffice. Where one pair touches, others may not be looked at.
    pub fn collide(&mut self) -> Result<bool, SceneError> {
        self.any(0.0, |querier, pair| querier.collide(pair.a, pair.b, &pair.pose))
    }

    /// Returns whether any pair is at most `d` apart, in mesh units.
    ///
    /// # Errors
    /// [`SceneError::Query`] if `d` is negative, NaN or infinite, and the errors of [`Scene::collide`].
    pub fn within(&mut self, d: f64) -> Result<bool, SceneError> {
        check_distance(d)?;
        self.any(d, |querier, pair| querier.within(pair.a, pair.b, &pair.pose, d))
    }

    /// Returns all pairs that touch.
    ///
    /// # Errors
    /// [`SceneError::Pair`] with the first pair whose question has no answer.
    pub fn pairs_in_contact(&mut self) -> Result<Vec<ScenePair>, SceneError> {
        self.all(0.0, |querier, pair| querier.collide(pair.a, pair.b, &pair.pose))
    }

    /// Returns all pairs that are at most `d` apart, in mesh units.
    ///
    /// # Errors
    /// [`SceneError::Query`] if `d` is negative, NaN or infinite, and the errors of [`Scene::pairs_in_contact`].
    pub fn pairs_within(&mut self, d: f64) -> Result<Vec<ScenePair>, SceneError> {
        check_distance(d)?;
        self.all(d, |querier, pair| querier.within(pair.a, pair.b, &pair.pose, d))
    }

    /// Returns all pairs of triangles in contact.
    ///
    /// # Errors
    /// The errors of [`Scene::pairs_in_contact`].
    pub fn contacts(&mut self) -> Result<Vec<SceneContact>, SceneError> {
        let candidates = self.near(0.0);
        let of_pairs = self.each(&candidates, |querier, pair| {
            let contacts = querier.contacts(pair.a, pair.b, &pair.pose)?;
            Ok((!contacts.is_empty()).then_some((pair.ids, contacts)))
        })?;
        let with_pair = |(pair, contacts): (ScenePair, Vec<Contact>)| {
            contacts.into_iter().map(move |contact| SceneContact { pair, contact })
        };
        Ok(of_pairs.into_iter().flat_map(with_pair).collect())
    }

    /// Calls `visit` with each pair of instances that touch and its pairs of triangles in contact, in ascending order of the
    /// pairs, until it returns false. At any time it holds the contacts of one pair, not of all.
    ///
    /// # Errors
    /// The errors of [`Scene::pairs_in_contact`].
    pub fn visit_contacts(
        &mut self,
        mut visit: impl FnMut(ScenePair, &[Contact]) -> bool,
    ) -> Result<(), SceneError> {
        let mut goes_on = true;
        for candidate in self.near(0.0) {
            let found = self.each(&[candidate], |querier, pair| {
                Ok(Some((pair.ids, querier.contacts(pair.a, pair.b, &pair.pose)?)))
            })?;
            for (pair, contacts) in found.iter().filter(|(_, contacts)| !contacts.is_empty()) {
                goes_on = visit(*pair, contacts);
            }
            if !goes_on {
                break;
            }
        }
        Ok(())
    }

    /// Returns the nearest pair and its distance; `None` if there are no pairs.
    ///
    /// # Errors
    /// [`SceneError::Pair`] with a pair whose question has no answer. Pairs that are certainly farther apart than another
    /// one are not looked at.
    pub fn distance(&mut self) -> Result<Option<SceneDistance>, SceneError> {
        self.start();
        let mut nearest: Option<SceneDistance> = None;
        if let Some(likely) = self.likely_candidate() {
            self.improve(&mut nearest, &[likely])?;
        }
        // Pairs near enough, the nearest boxes first: they soon tell how near is near enough.
        let mut candidates = self.collect(nearest.map_or(f64::INFINITY, |held| held.distance.distance));
        candidates.sort_unstable_by(|x, y| {
            x.squared_gap.total_cmp(&y.squared_gap).then((x.a, x.b).cmp(&(y.a, y.b)))
        });
        for run in candidates.chunks(self.workers.threads()) {
            if nearest.is_some_and(|held| run[0].squared_gap > held.distance.distance.powi(2)) {
                break;
            }
            self.improve(&mut nearest, run)?;
        }
        self.likely = nearest.map(|held| (held.pair.a.place, held.pair.b.place));
        Ok(nearest)
    }

    /// Adopts the least distance of candidates, if it is less than the one held, or as little and of an earlier pair.
    fn improve(
        &mut self,
        nearest: &mut Option<SceneDistance>,
        candidates: &[Candidate],
    ) -> Result<(), SceneError> {
        let limit = nearest.map_or(f64::INFINITY, |held| held.distance.distance);
        let held = nearest.map(|held| held.pair);
        let found = self.each(candidates, |querier, pair| {
            if held == Some(pair.ids) {
                return Ok(None);
            }
            let found = querier.distance_below(pair.a, pair.b, &pair.pose, limit)?;
            Ok(found.map(|distance| SceneDistance { pair: pair.ids, distance }))
        })?;
        for found in found {
            let order = |of: &SceneDistance| (of.distance.distance, of.pair);
            if nearest.is_none_or(|held| order(&found) < order(&held)) {
                *nearest = Some(found);
            }
        }
        Ok(())
    }

    /// Asks the pairs at most `limit` apart until one says yes.
    fn any(
        &mut self,
        limit: f64,
        ask: impl Fn(&mut Querier, &PlacedPair<'_>) -> Result<bool, QueryError> + Sync,
    ) -> Result<bool, SceneError> {
        self.start();
        let ask = |querier: &mut Querier, pair: &PlacedPair<'_>| Ok(ask(querier, pair)?.then_some(pair.ids));
        let mut candidates: Vec<Candidate> = self.likely_candidate().into_iter().collect();
        if !self.each(&candidates, ask)?.is_empty() {
            return Ok(true);
        }
        candidates = self.collect(limit);
        // The nearest boxes are the likeliest. Runs grow, so that all threads have work and little of it is in vain.
        candidates.sort_by(|x, y| x.squared_gap.total_cmp(&y.squared_gap));
        let mut rest = &candidates[..];
        let mut size = self.workers.threads();
        while !rest.is_empty() {
            let (run, after) = rest.split_at(size.min(rest.len()));
            if let Some(found) = self.each(run, ask)?.first() {
                self.likely = Some((found.a.place, found.b.place));
                return Ok(true);
            }
            (rest, size) = (after, 2 * size);
        }
        Ok(false)
    }

    /// Asks all pairs at most `limit` apart.
    fn all(
        &mut self,
        limit: f64,
        ask: impl Fn(&mut Querier, &PlacedPair<'_>) -> Result<bool, QueryError> + Sync,
    ) -> Result<Vec<ScenePair>, SceneError> {
        let candidates = self.near(limit);
        self.each(&candidates, |querier, pair| Ok(ask(querier, pair)?.then_some(pair.ids)))
    }

    /// Starts a question, and returns the pairs asked about whose boxes are at most `limit` apart, in ascending order.
    fn near(&mut self, limit: f64) -> Vec<Candidate> {
        self.start();
        let mut candidates = self.collect(limit);
        candidates.sort_unstable_by_key(|candidate| (candidate.a, candidate.b));
        candidates
    }

    /// Returns the pairs asked about whose boxes are at most `limit` apart.
    fn collect(&self, limit: f64) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        self.broad.pairs(limit, |x, y, squared_gap| {
            let (a, b) = (x.min(y), x.max(y));
            if self.instances[a as usize].as_ref().is_some_and(|instance| !instance.allows(b)) {
                candidates.push(Candidate { a, b, squared_gap });
            }
        });
        candidates
    }

    /// Returns the pair of the last answer, if it is still asked about.
    fn likely_candidate(&self) -> Option<Candidate> {
        let (a, b) = self.likely?;
        let candidate = Candidate { a, b, squared_gap: 0.0 };
        let (first, second) = self.both(&candidate)?;
        (first.groups.meet(second.groups) && !first.allows(b)).then_some(candidate)
    }

    /// Asks about each candidate, in the order of the candidates.
    fn each<R: Send>(
        &mut self,
        candidates: &[Candidate],
        ask: impl Fn(&mut Querier, &PlacedPair<'_>) -> Result<Option<R>, QueryError> + Sync,
    ) -> Result<Vec<R>, SceneError> {
        self.pairs_asked += candidates.len() as u64;
        let mut stats = self.stats;
        let scene = &*self;
        let found = scene.workers.each(candidates, &mut stats, |querier, candidate| {
            let Some((a, b)) = scene.both(candidate) else { return Ok(None) };
            let pose = Pose::relative(&a.world, &b.world)?;
            let ids = ScenePair { a: a.id(candidate.a), b: b.id(candidate.b) };
            ask(querier, &PlacedPair { ids, a: &a.shape, b: &b.shape, pose })
        });
        let found = found.map_err(|(number, source)| {
            let name = |place: u32| {
                let instance = scene.instances.get(place as usize).and_then(Option::as_ref);
                instance.map_or(String::new(), |instance| scene.describe(instance.id(place)))
            };
            SceneError::Pair { a: name(candidates[number].a), b: name(candidates[number].b), source }
        });
        self.stats = stats;
        found
    }

    /// Returns both instances of a candidate.
    fn both(&self, candidate: &Candidate) -> Option<(&Instance, &Instance)> {
        let of = |place: u32| self.instances.get(place as usize)?.as_ref();
        Some((of(candidate.a)?, of(candidate.b)?))
    }
}
