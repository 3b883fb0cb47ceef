//! The signed distance of a scene, which is that of the pair that overlaps most or, where none does, is nearest; and those of all pairs
//! that are near.

use crate::error::NumberError;
use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::signed_distance::SignedDistance;
use crate::query::options::check;
use crate::scene::candidates::ScenePair;
use crate::scene::{Scene, SceneError};

/// Two instances, and their signed distance. Points and directions are in A's frame; `scene.pose(pair.a)?.place(point)` returns a point
/// in the world.
///
/// [`Scene::signed_distance`] has an example.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneSignedDistance {
    /// The instances.
    pub pair: ScenePair,
    /// The answer of [`Querier::signed_distance`](crate::Querier::signed_distance).
    pub nearest: SignedDistance,
}

impl Scene {
    /// Returns the signed distance of the pair that overlaps most, by its lower bound, or else of the nearest pair; `None` if there
    /// are no pairs. That of any other pair is at least that lower bound, but for roundings of distances. Of equal pairs, the answer
    /// is the first.
    ///
    /// Cost: that of [`Scene::relations`], and a depth for each pair that overlaps; where none does, that of [`Scene::distance`].
    ///
    /// ```
    /// use bvh_query::{PenetrationOptions, SceneSignedDistance};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let Some(SceneSignedDistance { pair, nearest, .. }) = scene.signed_distance(&PenetrationOptions::new())?
    /// else { panic!() };
    /// assert_eq!((pair.a, pair.b, nearest.distance), (left, right, 0.5));
    /// scene.set_pose(right, at(1.5)?)?;
    /// let overlapping = scene.signed_distance(&PenetrationOptions::new())?;
    /// assert!(overlapping.is_some_and(|found| found.nearest.upper < -0.49));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] if an option is invalid; the errors of [`Scene::relations`] and [`Scene::distance`].
    pub fn signed_distance(
        &mut self,
        options: &PenetrationOptions,
    ) -> Result<Option<SceneSignedDistance>, SceneError> {
        options.check()?;
        let overlaps = self.each_near(0.0, false, |querier, pair| {
            let found = querier.signed_unless_apart(pair.a, pair.b, &pair.pose, options)?;
            let found = found.filter(|nearest| nearest.lower <= 0.0);
            Ok(found.map(|nearest| SceneSignedDistance { pair: pair.ids, nearest }))
        })?;
        let first_of = |x: SceneSignedDistance, y| if least(&y) < least(&x) { y } else { x };
        if let Some(deepest) = overlaps.into_iter().reduce(first_of) {
            return Ok(Some(deepest));
        }
        let Some(held) = self.nearest_pair()? else { return Ok(None) };
        let found = self.of_pair(held.pair, |querier, pair| {
            querier.signed_distance(pair.a, pair.b, &pair.pose, options)
        })?;
        Ok(found.map(|nearest| SceneSignedDistance { pair: held.pair, nearest }))
    }

    /// Returns all pairs that overlap or are at most `margin` apart, in mesh units, in ascending order, with their signed distances:
    /// those for which [`Querier::signed_distance_within`](crate::Querier::signed_distance_within) has an answer.
    ///
    /// Cost: that query for each pair whose boxes in the world are within the margin.
    ///
    /// ```
    /// use bvh_query::PenetrationOptions;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// assert!(scene.near_pairs(0.4, &PenetrationOptions::new())?.is_empty());
    /// for found in scene.near_pairs(0.6, &PenetrationOptions::new())? {
    ///     assert_eq!((found.pair.b, found.nearest.distance), (right, 0.5));
    ///     assert_eq!(found.nearest.normal, [1.0, 0.0, 0.0]); // in the frame of A
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] if the margin is negative, NaN or infinite, or if an option is invalid; the errors of
    /// [`Scene::pairs_in_contact`], and of [`Querier::signed_distance`](crate::Querier::signed_distance).
    pub fn near_pairs(
        &mut self,
        margin: f64,
        options: &PenetrationOptions,
    ) -> Result<Vec<SceneSignedDistance>, SceneError> {
        check(NumberError::Margin, margin)?;
        options.check()?;
        self.each_near(margin, false, |querier, pair| {
            let found = querier.signed_distance_within(pair.a, pair.b, &pair.pose, margin, options)?;
            Ok(found.map(|nearest| SceneSignedDistance { pair: pair.ids, nearest }))
        })
    }
}

fn least(of: &SceneSignedDistance) -> f64 {
    of.nearest.lower
}
