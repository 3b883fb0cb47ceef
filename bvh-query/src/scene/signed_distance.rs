//! The signed distance of a scene: that of the pair which overlaps most or, where none does, which is nearest.

use crate::query::depth::options::PenetrationOptions;
use crate::query::depth::signed_distance::SignedDistance;
use crate::scene::pair_questions::ScenePair;
use crate::scene::{Scene, SceneError};

/// The pair of instances with the least signed distance. Points and directions are in A's frame.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct SceneSignedDistance {
    /// The instances: of equal pairs, the first.
    pub pair: ScenePair,
    /// The answer of [`Querier::signed_distance`](crate::Querier::signed_distance).
    pub nearest: SignedDistance,
}

impl Scene {
    /// Returns the signed distance of the pair that overlaps most, by its lower bound, or else of the nearest pair; `None` if there
    /// are no pairs. That of any other pair is at least that lower bound, but for roundings of distances.
    ///
    /// Cost: that of [`Scene::relations`], and a depth for each pair that overlaps; where none does, that of [`Scene::distance`].
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
}

fn least(of: &SceneSignedDistance) -> f64 {
    of.nearest.lower
}
