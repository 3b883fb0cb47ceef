//! The questions over all pairs of a scene.

use crate::error::QueryError;
use crate::query::contacts::Contact;
use crate::query::depth::clash::{Clash, ClashClass, ClashOptions};
use crate::query::displacement::size;
use crate::query::distance::Distance;
use crate::query::options::check_distance;
use crate::query::probe::relation::Relation;
use crate::scene::candidates::{NearPair, Next, ScenePair, nearest_first};
use crate::scene::{Scene, SceneError};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

/// Two triangles in contact, and their instances.
///
/// [`Scene::contacts`] has an example.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneContact {
    /// The instances.
    pub pair: ScenePair,
    /// The triangles.
    pub contact: Contact,
}

/// The nearest pair of instances, and how far apart they are. Points are in A's frame;
/// `scene.pose(pair.a)?.place(point)` returns a point in the world.
///
/// [`Scene::distance`] has an example.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneDistance {
    /// The instances: of equally near pairs, the first.
    pub pair: ScenePair,
    /// The answer of [`Querier::distance`](crate::Querier::distance).
    pub nearest: Distance,
}

/// A pair of instances that clash, and how. Points and translations are in A's frame, and the box of what they have in common is in that
/// of the world.
///
/// [`Scene::clashes`] has an example.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneClash {
    /// The instances.
    pub pair: ScenePair,
    /// The answer of [`Querier::clash`](crate::Querier::clash).
    pub clash: Clash,
}

impl Scene {
    /// Returns whether any pair touches.
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert!(!scene.collide()?);
    /// scene.set_pose(right, at(2.0)?)?;
    /// assert!(scene.collide()?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Pair`] with a pair whose query has no answer, because a page is damaged or the budget does not
    /// suffice, unless another pair is found to touch.
    pub fn collide(&mut self) -> Result<bool, SceneError> {
        self.any(0.0)
    }

    /// Returns whether any pair is at most `d` apart, in mesh units.
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert!(scene.within(0.5)? && !scene.within(0.4)?);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] if `d` is negative, NaN or infinite, and the errors of [`Scene::collide`].
    pub fn within(&mut self, d: f64) -> Result<bool, SceneError> {
        check_distance(d)?;
        self.any(d)
    }

    /// Returns all pairs that touch.
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert!(scene.pairs_in_contact()?.is_empty());
    /// scene.set_pose(right, at(2.0)?)?;
    /// let [pair] = scene.pairs_in_contact()?[..] else { panic!() };
    /// assert_eq!((pair.a, pair.b), (left, right));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Pair`] with the first pair whose query has no answer.
    pub fn pairs_in_contact(&mut self) -> Result<Vec<ScenePair>, SceneError> {
        self.pairs_within(0.0)
    }

    /// Returns all pairs that are at most `d` apart, in mesh units.
    ///
    /// ```
    /// use bvh_query::ScenePair;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert_eq!(scene.pairs_within(0.5)?, [ScenePair { a: left, b: right }]);
    /// assert_eq!(scene.pairs_within(0.4)?, []);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] if `d` is negative, NaN or infinite, and the errors of [`Scene::pairs_in_contact`].
    pub fn pairs_within(&mut self, d: f64) -> Result<Vec<ScenePair>, SceneError> {
        check_distance(d)?;
        self.each_near(d, true, |querier, pair| Ok(pair.within(querier, d)?.then_some(pair.ids)))
    }

    /// Returns all pairs that touch, or of which one is inside the other, wholly or in part, with their relations.
    /// Pairs that have nothing in common are left out: those whose boxes in the world are apart, and those for which
    /// [`Querier::relation`](crate::Querier::relation) answers [`Relation::Apart`].
    ///
    /// ```
    /// use bvh_query::{Relation, ScenePair};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert_eq!(scene.relations()?, []); // nothing in common
    /// scene.set_pose(right, at(1.5)?)?;
    /// assert_eq!(scene.relations()?, [(ScenePair { a: left, b: right }, Relation::Touching)]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::pairs_in_contact`], and of [`Querier::relation`](crate::Querier::relation).
    pub fn relations(&mut self) -> Result<Vec<(ScenePair, Relation)>, SceneError> {
        self.each_near(0.0, false, |querier, pair| {
            let relation = querier.relation(pair.a, pair.b, &pair.pose)?;
            Ok((relation != Relation::Apart).then_some((pair.ids, relation)))
        })
    }

    /// Returns all pairs that are near each other, touch, overlap, contain each other or are duplicates, with how they lie. Pairs
    /// that are apart are left out.
    ///
    /// ```
    /// use bvh_query::{ClashClass, ClashOptions, SceneClash};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert!(scene.clashes(&ClashOptions::new())?.is_empty());
    /// let found = scene.clashes(&ClashOptions::new().clearance(0.5))?;
    /// let [SceneClash { pair, clash, .. }] = found[..] else { panic!("{found:?}") };
    /// assert_eq!((pair.a, pair.b), (left, right));
    /// assert_eq!((clash.class, clash.distance), (ClashClass::Near, 0.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] if an option is invalid, the errors of [`Scene::pairs_in_contact`], and of [`Querier::relation`](crate::Querier::relation).
    pub fn clashes(&mut self, options: &ClashOptions) -> Result<Vec<SceneClash>, SceneError> {
        self.clashes_among(options, |_| true)
    }

    /// Returns the clashes of those pairs that `is_asked` accepts, as [`Scene::clashes`] does. Several machines can so share the
    /// pairs of one scene. Files of other pairs are not opened ([`Files`](crate::Files)).
    ///
    /// ```
    /// use bvh_query::ClashOptions;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let options = ClashOptions::new().clearance(0.5);
    /// let mut mine = |machine: u64| scene.clashes_among(&options, |pair| pair.a.to_bits() % 2 == machine);
    /// assert_eq!((mine(0)?.len(), mine(1)?.len()), (1, 0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::clashes`].
    pub fn clashes_among(
        &mut self,
        options: &ClashOptions,
        is_asked: impl Fn(ScenePair) -> bool,
    ) -> Result<Vec<SceneClash>, SceneError> {
        options.check()?;
        // Without a tolerance of its own, a pair has that of its larger part.
        let sizes = self.contents.each().map(|(_, instance)| size(instance.shape.objects()));
        let reach = options.clearance.max(options.tolerance_of(sizes.fold(0.0, f64::max)));
        let mut all = Vec::new();
        self.each_piece(reach, &mut |scene, mut near_pairs| {
            near_pairs.retain(|near_pair| is_asked(scene.ids(near_pair.a, near_pair.b)));
            all.extend(scene.each(&near_pairs, |querier, pair| {
                let (world, at) = (pair.world.rotation(), pair.world.translation());
                let mut clash = querier.clash_along(pair.a, pair.b, &pair.pose, options, world)?;
                for corner in
                    clash.magnitudes.iter_mut().filter_map(|shared| shared.bounds.as_mut()).flatten()
                {
                    *corner = [0, 1, 2].map(|k| corner[k] + at[k]);
                }
                Ok((clash.class != ClashClass::Apart).then_some(SceneClash { pair: pair.ids, clash }))
            })?);
            Ok(ControlFlow::Continue(()))
        })?;
        Ok(all)
    }

    /// Returns all pairs of triangles in contact.
    ///
    /// ```
    /// use bvh_query::SceneContact;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// scene.set_pose(right, at(2.0)?)?;
    /// for SceneContact { pair, contact, .. } in scene.contacts()? {
    ///     assert_eq!((pair.a, pair.b), (left, right));
    ///     assert!(contact.triangle_a < 12 && contact.triangle_b < 12);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::pairs_in_contact`].
    pub fn contacts(&mut self) -> Result<Vec<SceneContact>, SceneError> {
        let of_pairs = self.each_near(0.0, false, |querier, pair| {
            let contacts = querier.contacts(pair.a, pair.b, &pair.pose)?;
            Ok((!contacts.is_empty()).then_some((pair.ids, contacts)))
        })?;
        let with_pair = |(pair, contacts): (ScenePair, Vec<Contact>)| {
            contacts.into_iter().map(move |contact| SceneContact { pair, contact })
        };
        Ok(of_pairs.into_iter().flat_map(with_pair).collect())
    }

    /// Calls `visit` with each pair of instances that touch and its pairs of triangles in contact, in ascending order of the
    /// pairs, until it breaks. At any time it holds the contacts of one pair, not of all. It uses one thread.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// scene.set_pose(right, at(2.0)?)?;
    /// let mut most = 0;
    /// scene.visit_contacts(|pair, contacts| {
    ///     println!("instances {} and {}", pair.a, pair.b);
    ///     most = most.max(contacts.len());
    ///     ControlFlow::Continue(())
    /// })?;
    /// assert!(most > 0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::pairs_in_contact`].
    pub fn visit_contacts(
        &mut self,
        mut visit: impl FnMut(ScenePair, &[Contact]) -> ControlFlow<()>,
    ) -> Result<(), SceneError> {
        self.each_piece(0.0, &mut |scene, near_pairs| {
            for near_pair in near_pairs {
                let found = scene.each(&[near_pair], |querier, pair| {
                    Ok(Some((pair.ids, querier.contacts(pair.a, pair.b, &pair.pose)?)))
                })?;
                let mut touching = found.iter().filter(|(_, contacts)| !contacts.is_empty());
                if touching.any(|(pair, contacts)| visit(*pair, contacts).is_break()) {
                    return Ok(ControlFlow::Break(()));
                }
            }
            Ok(ControlFlow::Continue(()))
        })
    }

    /// Returns the nearest pair and its distance; `None` if there are no pairs.
    ///
    /// ```
    /// use bvh_query::SceneDistance;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let Some(SceneDistance { pair, nearest, .. }) = scene.distance()? else { panic!() };
    /// assert_eq!((pair.a, pair.b, nearest.distance), (left, right, 0.5));
    /// let in_the_world = scene.pose(pair.a)?.place(nearest.point_b);
    /// assert_eq!(in_the_world[0], 1.5);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Pair`] with a pair whose query has no answer. Pairs that are certainly farther apart than
    /// another one are not tested.
    pub fn distance(&mut self) -> Result<Option<SceneDistance>, SceneError> {
        self.start();
        self.nearest_pair()
    }

    /// Goes on with a question that asks for the nearest pair.
    pub(super) fn nearest_pair(&mut self) -> Result<Option<SceneDistance>, SceneError> {
        let mut nearest = None;
        // The pair that was nearest in the last question is likely to be near. Else the one with the nearest boxes is, and a
        // distance says how near other boxes have to be.
        let first = match self.likely_pair() {
            None => self.nearest_boxes()?,
            likely => likely,
        };
        if let Some(first) = first {
            self.improve(&mut nearest, &[first])?;
        }
        let mut next = Next::All;
        let limit =
            |nearest: &Option<SceneDistance>| nearest.map_or(f64::INFINITY, |held| held.nearest.upper);
        while let Some(mut near_pairs) = self.next_piece(&mut next, limit(&nearest))? {
            nearest_first(&mut near_pairs);
            for run in near_pairs.chunks(self.workers.threads()) {
                if run[0].squared_gap > (limit(&nearest) + self.contents.reach_of_pairs()).powi(2) {
                    break;
                }
                self.improve(&mut nearest, run)?;
            }
        }
        self.likely = nearest.map(|held| (held.pair.a.place, held.pair.b.place));
        Ok(nearest)
    }

    /// Adopts the least distance of near pairs, if it is less than the one held, or as little and of an earlier pair.
    fn improve(
        &mut self,
        nearest: &mut Option<SceneDistance>,
        near_pairs: &[NearPair],
    ) -> Result<(), SceneError> {
        let limit = nearest.map_or(f64::INFINITY, |held| held.nearest.upper);
        // Where the pair held touches, only an earlier one can take its place.
        let is_beaten = |pair: ScenePair| {
            nearest.is_some_and(|held| held.pair == pair || held.nearest.distance == 0.0 && held.pair < pair)
        };
        let found = self.each(near_pairs, |querier, pair| {
            if is_beaten(pair.ids) {
                return Ok(None);
            }
            let found = querier.distance_below(pair.a, pair.b, &pair.pose, limit)?;
            Ok(found.map(|distance| SceneDistance { pair: pair.ids, nearest: distance }))
        })?;
        for found in found {
            let order = |of: &SceneDistance| (of.nearest.distance, of.pair);
            if nearest.is_none_or(|held| order(&found) < order(&held)) {
                *nearest = Some(found);
            }
        }
        Ok(())
    }

    /// Returns whether any pair is at most `d` apart.
    fn any(&mut self, d: f64) -> Result<bool, SceneError> {
        self.start();
        let squared_limit = (d + self.contents.reach_of_pairs()).powi(2);
        let likely = self.likely_pair().filter(|likely| likely.squared_gap <= squared_limit);
        if let Some(likely) = likely
            && self.any_of(&[likely], d)?
        {
            return Ok(true);
        }
        let (mut next, mut first_error) = (Next::All, None);
        while let Some(mut near_pairs) = self.next_piece(&mut next, d)? {
            near_pairs.retain(|near_pair| likely.is_none_or(|likely| !near_pair.is_of(&likely)));
            // The nearest boxes are the likeliest.
            nearest_first(&mut near_pairs);
            match self.any_of(&near_pairs, d) {
                Ok(false) => {}
                Ok(true) => return Ok(true),
                // Where no visits are left, none of the other pairs has an answer.
                Err(error) if self.workers.rest().left() == 0 => return Err(error),
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        first_error.map_or(Ok(false), Err)
    }

    /// Asks near pairs until one is at most `d` apart. Where one is, an error about another does not matter.
    fn any_of(&mut self, near_pairs: &[NearPair], d: f64) -> Result<bool, SceneError> {
        // By a pair that is, or because no visits are left or the question is stopped.
        let is_decided = AtomicBool::new(false);
        self.remember(near_pairs);
        let answers = self.each(near_pairs, |querier, pair| {
            if is_decided.load(Ordering::Relaxed) {
                return Ok(None);
            }
            let answer = pair.within(querier, d);
            if matches!(answer, Ok(true) | Err(QueryError::Budget { .. } | QueryError::Stopped)) {
                is_decided.store(true, Ordering::Relaxed);
            }
            Ok((answer != Ok(false)).then_some((pair.ids, answer)))
        })?;
        if let Some((pair, _)) = answers.iter().find(|(_, answer)| answer.is_ok()) {
            self.likely = Some((pair.a.place, pair.b.place));
            return Ok(true);
        }
        match answers.into_iter().next() {
            Some((pair, Err(source))) => Err(self.pair_error(pair, source)),
            _ => Ok(false),
        }
    }
}
