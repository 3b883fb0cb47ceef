//! Questions about points, rays and segments in the world, over all instances of a scene.
//!
//! Instances are tested in the order in which a probe meets their boxes, nearest first, until none can change the
//! answer. The questions are about the vertices as [`Pose::place`](crate::Pose::place) defines them for the pose of an
//! instance in the world. Probes meet all instances, whatever their groups.

use crate::error::QueryError;
use crate::narrow::Point;
use crate::numerics::PROBE_ERROR;
use crate::query::probe::closest::ClosestPoint;
use crate::query::probe::closest::check_within;
use crate::query::probe::line::{Line, LineQuestion, range_in_box};
use crate::query::probe::placed::PlacedShape;
use crate::query::probe::point::{check_point, sum_of_magnitudes};
use crate::query::probe::ray::RayHit;
use crate::query::probe::ray::{All, Any, First, Ray};
use crate::query::probe::segment::{MeetsSegment, check_margin};
use crate::query::probe::side::{Side, SignedPointDistance};
use crate::query::querier::Querier;
use crate::query::stats::QueryStats;
use crate::scene::instance::InstanceId;
use crate::scene::world_box::WorldBox;
use crate::scene::{Scene, SceneError};
use std::ops::ControlFlow;

/// The closest point of a scene to a given one.
///
/// [`Scene::closest_points`] has an example.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneClosestPoint {
    /// The instance: of equally near ones, the first.
    pub instance: InstanceId,
    /// The answer of [`Querier::closest_point`] for it, in the world.
    pub closest: ClosestPoint,
}

/// Where a ray hits a scene.
///
/// [`Scene::first_hits`] has an example.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SceneRayHit {
    /// The instance: of those hit at exactly the same parameter, the first.
    pub instance: InstanceId,
    /// The hit, in the world.
    pub hit: RayHit,
}

impl Scene {
    /// Returns the closest point of all instances to each of many points in the world, or `None` for a point from which
    /// all are farther away than `within`.
    ///
    /// The answer about each instance is that of [`Querier::closest_point`] for the placed instance.
    ///
    /// ```
    /// use bvh_query::SceneClosestPoint;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let found = scene.closest_points(&[[-2.0, 0.0, 0.0], [9.0, 0.0, 0.0]], 3.0)?;
    /// let [Some(SceneClosestPoint { instance, closest, .. }), None] = found[..] else { panic!("{found:?}") };
    /// assert_eq!((instance, closest.distance, closest.point), (left, 1.0, [-1.0, 0.0, 0.0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] for a point or limit that [`Querier::closest_point`] refuses, and [`SceneError::Instance`]
    /// with an instance whose query has no answer. If several points fail, the error is that of the first.
    pub fn closest_points(
        &mut self,
        points: &[[f64; 3]],
        within: f64,
    ) -> Result<Vec<Option<SceneClosestPoint>>, SceneError> {
        check_within(within)?;
        self.each_probe(points, |search, point| search.closest_point(&check_point(point)?, within))
    }

    /// Returns on which side of the instances each of many points in the world is. It is inside if it is inside any
    /// instance; else on a surface if it is on one; else undefined if it is in the box of an instance that has no
    /// inside; else outside.
    ///
    /// ```
    /// use bvh_query::Side;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let sides = scene.sides(&[[0.0, 0.0, 0.0], [1.25, 0.0, 0.0], [1.5, 0.0, 0.0]])?;
    /// assert_eq!(sides, [Side::Inside, Side::Outside, Side::On]); // the second point is in the gap
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Scene::closest_points`] and of [`Querier::side`].
    pub fn sides(&mut self, points: &[[f64; 3]]) -> Result<Vec<Side>, SceneError> {
        self.each_probe(points, |search, point| search.side(&check_point(point)?))
    }

    /// Returns the closest points and the sides of many points: see [`Scene::closest_points`] and [`Scene::sides`].
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let found = scene.signed_point_distances(&[[2.0, 0.0, 0.0]], f64::INFINITY)?;
    /// let [Some((instance, signed))] = found[..] else { panic!("{found:?}") };
    /// assert_eq!((instance, signed.value()), (right, Some(-0.5)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// The errors of both.
    pub fn signed_point_distances(
        &mut self,
        points: &[[f64; 3]],
        within: f64,
    ) -> Result<Vec<Option<(InstanceId, SignedPointDistance)>>, SceneError> {
        check_within(within)?;
        self.each_probe(points, |search, point| {
            let point = check_point(point)?;
            let Some(SceneClosestPoint { instance, closest }) = search.closest_point(&point, within)? else {
                return Ok(None);
            };
            let side = search.side(&point)?;
            Ok(Some((instance, SignedPointDistance { side, closest })))
        })
    }

    /// Returns where each of many rays in the world first hits an instance.
    ///
    /// ```
    /// use bvh_query::{Ray, SceneRayHit};
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let rays = [Ray::new([9.0, 0.0, 0.5], [-1.0, 0.0, 0.0]), Ray::new([9.0, 0.0, 3.0], [-1.0, 0.0, 0.0])];
    /// let found = scene.first_hits(&rays)?;
    /// let [Some(SceneRayHit { instance, hit, .. }), None] = found[..] else { panic!("{found:?}") };
    /// assert_eq!((instance, hit.t, hit.point), (right, 5.5, [3.5, 0.0, 0.5]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] for a ray that [`Querier::first_hit`] refuses, and [`SceneError::Instance`] with an
    /// instance whose query has no answer. If several rays fail, the error is that of the first.
    pub fn first_hits(&mut self, rays: &[Ray]) -> Result<Vec<Option<SceneRayHit>>, SceneError> {
        self.each_probe(rays, |search, ray| {
            let mut first = First::new(ray)?;
            search.line(&mut first)?;
            Ok(first.hit().map(|(instance, hit)| search.hit(instance, hit)))
        })
    }

    /// Returns whether each of many rays in the world hits any instance.
    ///
    /// ```
    /// use bvh_query::Ray;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let down = |x| Ray::new([x, 0.0, 3.0], [0.0, 0.0, -1.0]);
    /// assert_eq!(scene.any_hits(&[down(0.0), down(1.25), down(2.0)])?, [true, false, true]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Scene::first_hits`].
    pub fn any_hits(&mut self, rays: &[Ray]) -> Result<Vec<bool>, SceneError> {
        self.each_probe(rays, |search, ray| {
            let mut any = Any::new(ray)?;
            search.line(&mut any)?;
            Ok(any.found)
        })
    }

    /// Returns all hits of each of many rays in the world, in the order along the ray: see [`Querier::all_hits`]. Each
    /// parameter occurs once, however many instances are hit at exactly that parameter. An instance with a radius or a margin is a body
    /// of its own: entries and exits of each are hits, also where bodies overlap.
    ///
    /// ```
    /// use bvh_query::Ray;
    ///
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let through_both = Ray::new([9.0, 0.0, 0.5], [-1.0, 0.0, 0.0]);
    /// let hits = &scene.all_hits(&[through_both])?[0];
    /// assert_eq!(hits.iter().map(|hit| hit.instance).collect::<Vec<_>>(), [right, right, left, left]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Scene::first_hits`].
    pub fn all_hits(&mut self, rays: &[Ray]) -> Result<Vec<Vec<SceneRayHit>>, SceneError> {
        self.each_probe(rays, |search, ray| {
            let mut all = All::new(ray)?;
            search.line(&mut all)?;
            Ok(all.hits().into_iter().map(|(instance, hit)| search.hit(instance, hit)).collect())
        })
    }

    /// Returns whether each of many closed segments in the world meets any instance: see [`Querier::segment_hit`].
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let through_the_gap = [[1.25, 0.0, -3.0], [1.25, 0.0, 3.0]];
    /// let through_both = [[-9.0, 0.0, 0.5], [9.0, 0.0, 0.5]];
    /// assert_eq!(scene.segment_hits(&[through_the_gap, through_both])?, [false, true]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] for ends that [`Querier::segment_hit`] refuses, and [`SceneError::Instance`] with an
    /// instance whose query has no answer. If several segments fail, the error is that of the first.
    pub fn segment_hits(&mut self, segments: &[[[f64; 3]; 2]]) -> Result<Vec<bool>, SceneError> {
        self.each_probe(segments, |search, [from, to]| {
            let mut question = MeetsSegment::new(*from, *to)?;
            search.line(&mut question)?;
            Ok(question.met)
        })
    }

    /// Returns whether the two points of each of many pairs in the world see each other past all instances: see [`Querier::visible`].
    ///
    /// ```
    /// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
    /// # let at = |x| bvh_query::Pose::new(*bvh_query::Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
    /// # let mut scene = bvh_query::Scene::new()?;
    /// # let [left, right] = [scene.add(block.clone(), at(0.0)?)?, scene.add(block, at(2.5)?)?];
    /// // The scene has two blocks, left and right, each 2 wide and with half a unit between them.
    /// let [camera, on_the_left, on_the_right] = [[-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [3.5, 0.0, 0.0]];
    /// assert_eq!(scene.visible(&[[camera, on_the_left], [camera, on_the_right]], 1e-6)?, [true, false]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`SceneError::Query`] for a margin or points that [`Querier::visible`] refuses; else those of [`Scene::segment_hits`].
    pub fn visible(&mut self, pairs: &[[[f64; 3]; 2]], margin: f64) -> Result<Vec<bool>, SceneError> {
        check_margin(margin)?;
        self.each_probe(pairs, |search, [from, to]| {
            let mut question = MeetsSegment::without_ends(*from, *to, margin)?;
            search.line(&mut question)?;
            Ok(!question.met)
        })
    }

    /// Asks about each probe, on one thread or on all.
    fn each_probe<P: Sync, R: Send>(
        &mut self,
        probes: &[P],
        ask: impl Fn(&mut ProbeSearch<'_>, &P) -> Result<R, SceneError> + Sync,
    ) -> Result<Vec<R>, SceneError> {
        self.start();
        let mut stats = QueryStats::default();
        let scene = &*self;
        let answers = scene.workers.each(probes, &mut stats, |querier, probe| {
            querier.start();
            Ok(Some(ask(&mut ProbeSearch { scene, querier }, probe)))
        });
        self.stats = stats;
        answers.map_err(|(_, error)| SceneError::Query(error))?.into_iter().collect()
    }
}

/// The search of a whole scene for the answer about one probe.
struct ProbeSearch<'a> {
    scene: &'a Scene,
    querier: &'a mut Querier,
}

impl ProbeSearch<'_> {
    fn closest_point(&mut self, point: &Point, within: f64) -> Result<Option<SceneClosestPoint>, SceneError> {
        let mut best: Option<SceneClosestPoint> = None;
        let (mut limit, mut lower) = (within, f64::INFINITY);
        let at = WorldBox { lo: *point, hi: *point };
        self.visit(
            |bounds| at.squared_gap(bounds),
            |querier, id, shape, squared_gap| {
                if squared_gap > limit * limit {
                    return Ok(ControlFlow::Break(()));
                }
                let closest = querier.closest_point_of(&shape, point, limit)?;
                if let Some(closest) = closest {
                    lower = lower.min(closest.lower);
                    limit = limit.min(closest.upper);
                    let order = |of: &SceneClosestPoint| (of.closest.distance, of.instance);
                    let found = SceneClosestPoint { instance: id, closest };
                    if best.is_none_or(|best| order(&found) < order(&best)) {
                        best = Some(found);
                    }
                }
                Ok(ControlFlow::Continue(()))
            },
        )?;
        Ok(best.map(|best| {
            let lower = lower.min(best.closest.lower);
            SceneClosestPoint { closest: ClosestPoint { lower, ..best.closest }, ..best }
        }))
    }

    fn side(&mut self, point: &Point) -> Result<Side, SceneError> {
        let order = [Side::Inside, Side::On, Side::Undefined];
        let mut found = [false; 3];
        let at = WorldBox { lo: *point, hi: *point };
        self.visit(
            |bounds| if at.squared_gap(bounds) > 0.0 { f64::INFINITY } else { 0.0 },
            |querier, _, shape, _| {
                let side = querier.side_of_shape(&shape, point)?;
                found.iter_mut().zip(order).for_each(|(found, of)| *found |= side == of);
                Ok(if side == Side::Inside { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
            },
        )?;
        let first = found.iter().position(|&found| found);
        Ok(first.map_or(Side::Outside, |first| order[first]))
    }

    /// Asks a question about a line and all instances that it may matter for.
    fn line(&mut self, question: &mut impl LineQuestion) -> Result<(), SceneError> {
        let (Line { origin, direction, .. }, until) = (question.line(), question.limit());
        let inverse = direction.map(|v| 1.0 / v);
        let entry = |bounds: &WorldBox| {
            let magnitude =
                sum_of_magnitudes(&origin) + sum_of_magnitudes(&bounds.lo) + sum_of_magnitudes(&bounds.hi);
            match range_in_box(
                &origin,
                (&direction, &inverse),
                &[bounds.lo, bounds.hi],
                PROBE_ERROR * magnitude,
            ) {
                Some([near, far]) if far >= 0.0 && near <= until => near.max(0.0),
                _ => f64::INFINITY,
            }
        };
        self.visit(entry, |querier, _, shape, entry| {
            if entry > question.limit() {
                return Ok(ControlFlow::Break(()));
            }
            querier.ask_line(&shape, question)?;
            Ok(ControlFlow::Continue(()))
        })
    }

    /// Calls `visit` with each instance whose box has a finite key, in ascending order of the keys, until it breaks. The key of
    /// a box is at most that of any box in it, but for rounding.
    fn visit(
        &mut self,
        key: impl Fn(&WorldBox) -> f64,
        mut visit: impl FnMut(
            &mut Querier,
            InstanceId,
            PlacedShape<'_>,
            f64,
        ) -> Result<ControlFlow<()>, QueryError>,
    ) -> Result<(), SceneError> {
        let Self { scene, querier } = self;
        let mut order = scene.contents.broad.by_key(&key);
        while let Some((place, key)) = order.next(&scene.contents.broad, || querier.charge_visit())? {
            let instance = scene.contents.known(place);
            let id = instance.id(place);
            let mut ask = || {
                let file = instance.shape.file()?;
                let rounded = instance.shape.in_file(&file).with_margin(instance.margin);
                let placed = PlacedShape { instance: place, ..rounded.at(&instance.world) };
                visit(querier, id, placed, key)
            };
            match ask() {
                Ok(ControlFlow::Continue(())) => {}
                Ok(ControlFlow::Break(())) => break,
                Err(source) => {
                    return Err(SceneError::Instance { instance: scene.contents.label(id), source });
                }
            }
        }
        Ok(())
    }

    fn hit(&self, instance: u32, hit: RayHit) -> SceneRayHit {
        SceneRayHit { instance: self.scene.contents.known(instance).id(instance), hit }
    }
}
