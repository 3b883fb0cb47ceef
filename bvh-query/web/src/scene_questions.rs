//! Questions about all instances of a scene: about pairs, at rest and in motion, and about probes in the world.

use crate::answers::{
    clashes, closest_row, contacts, distances, floats, found, hit_row, ids, signed_distances, small,
};
use crate::arguments::{Answer, integers, refused, rows, same_count, with_querier, wrong};
use crate::motions::{FREE, HIT, NEAR, options};
use crate::overlaps::{clash_options, depth_options};
use crate::paths;
use crate::probes::{Rays, segments};
use crate::scene::{Scene, beside};
use crate::time_limit;
use bvh_query::{
    Clash, Contact, Distance, InstanceId, OwnedShape, Pose, Querier, RigidPath, SceneError, SceneMotionAnswer,
};
use js_sys::{Array, Float64Array, Int8Array, Int32Array, Uint8Array, Uint32Array};
use wasm_bindgen::prelude::*;

impl Scene {
    fn ask<T>(&mut self, ask: impl FnOnce(&mut bvh_query::Scene) -> Result<T, SceneError>) -> Answer<T> {
        self.scene.set_stop(time_limit::start());
        ask(&mut self.scene).map_err(|error| self.refused(error))
    }

    /// Reads the paths of instances.
    fn moving(&self, numbers: &Uint32Array, kinds: &[u8], paths: Vec<Float64Array>) -> Answer<Moving> {
        let ids = self.ids(numbers, "paths")?;
        same_count("paths", paths.len(), "instances", ids.len())?;
        let mut moving = Moving::new();
        for ((id, &kind), numbers) in ids.into_iter().zip(kinds).zip(&paths) {
            moving.extend(paths::read(kind, numbers)?.into_iter().map(|path| (id, path)));
        }
        Ok(moving)
    }

    /// The numbers of instances, -1 for `None`.
    fn instances_found(&self, of: impl Iterator<Item = Option<InstanceId>>) -> JsValue {
        let numbers: Vec<i32> = of.map(|id| id.map_or(-1, |id| self.number(id) as i32)).collect();
        Int32Array::from(&numbers[..]).into()
    }
}

#[wasm_bindgen]
impl Scene {
    pub fn collide(&mut self) -> Answer<bool> {
        self.ask(|scene| scene.collide())
    }

    pub fn within(&mut self, d: f64) -> Answer<bool> {
        self.ask(|scene| scene.within(d))
    }

    #[wasm_bindgen(js_name = pairsInContact)]
    pub fn pairs_in_contact(&mut self) -> Answer<JsValue> {
        let found = self.ask(|scene| scene.pairs_in_contact())?;
        Ok(ids(found.into_iter().flat_map(|pair| self.pair(pair))))
    }

    #[wasm_bindgen(js_name = pairsWithin)]
    pub fn pairs_within(&mut self, d: f64) -> Answer<JsValue> {
        let found = self.ask(|scene| scene.pairs_within(d))?;
        Ok(ids(found.into_iter().flat_map(|pair| self.pair(pair))))
    }

    /// Pairs, and the numbers of their relations.
    pub fn relations(&mut self) -> Answer<Array> {
        let found = self.ask(|scene| scene.relations())?;
        let relations = small(found.iter().map(|&(_, relation)| relation as u8));
        Ok(beside(found.iter().map(|&(pair, _)| self.pair(pair)), relations.into()))
    }

    /// Pairs, and their triangles in contact.
    pub fn contacts(&mut self) -> Answer<Array> {
        let found = self.ask(|scene| scene.contacts())?;
        let triangles: Vec<Contact> = found.iter().map(|found| found.contact).collect();
        Ok(beside(found.iter().map(|found| self.pair(found.pair)), contacts(triangles.iter()).into()))
    }

    /// Pairs, and the parts of their clashes.
    pub fn clashes(
        &mut self,
        clearance: f64,
        tolerance: Option<f64>,
        relative_gap: Option<f64>,
        visits: Option<u32>,
        magnitudes: bool,
    ) -> Answer<Array> {
        let options = clash_options(clearance, tolerance, relative_gap, visits, magnitudes);
        let found = self.ask(|scene| scene.clashes(&options))?;
        let of_pairs: Vec<Clash> = found.iter().map(|found| found.clash).collect();
        Ok(beside(found.iter().map(|found| self.pair(found.pair)), clashes(&of_pairs, magnitudes).into()))
    }

    /// The nearest pair, if there are pairs, and its distance.
    pub fn distance(&mut self) -> Answer<Array> {
        let nearest = self.ask(|scene| scene.distance())?;
        let pair = nearest.iter().map(|found| self.pair(found.pair));
        Ok(beside(pair, distances(&[nearest.map(|found| found.nearest)]).into()))
    }

    /// The pair with the least signed distance, if there are pairs, and the parts of that.
    #[wasm_bindgen(js_name = signedDistance)]
    pub fn signed_distance(&mut self, relative_gap: Option<f64>, tolerance: Option<f64>) -> Answer<Array> {
        let least = self.ask(|scene| scene.signed_distance(&depth_options(relative_gap, tolerance)))?;
        let pair = least.iter().map(|found| self.pair(found.pair));
        Ok(beside(pair, signed_distances(least.map(|found| found.nearest).as_slice()).into()))
    }

    /// The distances of pairs of instances.
    pub fn distances(&self, pairs: &Uint32Array) -> Answer<Array> {
        let numbers = integers(pairs, "pairs")?;
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() {
            let found = numbers.len();
            return Err(wrong(
                "pairs",
                format_args!("expected two instances for each, found {found} in all"),
            ));
        }
        let distance = |querier: &mut Querier, &[a, b]: &[u32; 2]| {
            // The margin of the pair goes to A.
            let margins = [self.margin(a)? + self.pair_margin(a, b)?, self.margin(b)?];
            let ((pose_a, a), (pose_b, b)) = (self.placed(a, "pairs")?, self.placed(b, "pairs")?);
            let grown = |shape: OwnedShape, margin: f64| {
                let radius = shape.shape().radius() + margin;
                shape.rounded(radius).map_err(refused)
            };
            let (a, b) = (grown(a, margins[0])?, grown(b, margins[1])?);
            let pose = Pose::relative(&pose_a, &pose_b).map_err(refused)?;
            querier.distance(&a, &b, &pose).map(Some).map_err(refused)
        };
        let all = |querier: &mut Querier| {
            pairs.iter().map(|pair| distance(querier, pair)).collect::<Answer<Vec<Option<Distance>>>>()
        };
        Ok(distances(&with_querier(all)?))
    }

    /// Kind, time until which the paths are free, time of the contact or of the first undecided poses, the pair and its
    /// distance. The path of each instance is the element of `kinds` and of `paths` at the same place.
    pub fn motion(
        &mut self,
        numbers: &Uint32Array,
        kinds: &[u8],
        paths: Vec<Float64Array>,
        clearance: f64,
        tolerance: Option<f64>,
    ) -> Answer<Array> {
        let moving = self.moving(numbers, kinds, paths)?;
        let found = self.ask(|scene| scene.motion(&lent(&moving), &options(clearance, tolerance)))?;
        let (kind, until, at, pair) = match found {
            SceneMotionAnswer::Free => (FREE, 1.0, f64::NAN, None),
            SceneMotionAnswer::Hit { free_until, touching_at, pair, nearest } => {
                (HIT, free_until, touching_at, Some((pair, nearest)))
            }
            SceneMotionAnswer::Near { free_until, at, pair, nearest } => {
                (NEAR, free_until, at, Some((pair, nearest)))
            }
        };
        let nearest = distances(&[pair.map(|(_, nearest)| nearest)]);
        let pair = ids(pair.into_iter().flat_map(|(pair, _)| self.pair(pair)));
        let kind = JsValue::from(kind);
        Ok([kind, until.into(), at.into(), pair, nearest.into()].into_iter().collect())
    }

    #[wasm_bindgen(js_name = isFree)]
    pub fn is_free(
        &mut self,
        numbers: &Uint32Array,
        kinds: &[u8],
        paths: Vec<Float64Array>,
        clearance: f64,
        tolerance: Option<f64>,
    ) -> Answer<bool> {
        let moving = self.moving(numbers, kinds, paths)?;
        self.ask(|scene| scene.is_free(&lent(&moving), &options(clearance, tolerance)))
    }

    /// Instances, and what is found of each.
    #[wasm_bindgen(js_name = closestPoints)]
    pub fn closest_points(&mut self, points: &Float64Array, within: f64) -> Answer<Array> {
        let points = rows::<3>(points, "points")?;
        let closest = self.ask(|scene| scene.closest_points(&points, within))?;
        let instances = self.instances_found(closest.iter().map(|found| found.map(|found| found.instance)));
        let rows = closest.into_iter().map(|of| of.map(|of| closest_row(of.closest)));
        Ok([instances, found(rows).into()].into_iter().collect())
    }

    pub fn sides(&mut self, points: &Float64Array) -> Answer<Int8Array> {
        let points = rows::<3>(points, "points")?;
        let sides = self.ask(|scene| scene.sides(&points))?;
        Ok(Int8Array::from(&sides.into_iter().map(|side| side as i8).collect::<Vec<i8>>()[..]))
    }

    #[wasm_bindgen(js_name = signedPointDistances)]
    pub fn signed_point_distances(&mut self, points: &Float64Array, within: f64) -> Answer<JsValue> {
        let points = rows::<3>(points, "points")?;
        let distances = self.ask(|scene| scene.signed_point_distances(&points, within))?.into_iter();
        Ok(floats(distances.map(|of| of.and_then(|(_, found)| found.value()).unwrap_or(f64::NAN))))
    }

    #[wasm_bindgen(js_name = firstHits)]
    pub fn first_hits(&mut self, rays: Rays) -> Answer<Array> {
        let hits = self.ask(|scene| scene.first_hits(&rays.rays))?;
        Ok(self.hits(&hits))
    }

    fn hits(&self, hits: &[Option<bvh_query::SceneRayHit>]) -> Array {
        let instances = self.instances_found(hits.iter().map(|hit| hit.map(|hit| hit.instance)));
        let rows = hits.iter().map(|hit| hit.map(|hit| hit_row(hit.hit)));
        [instances, found(rows).into()].into_iter().collect()
    }

    #[wasm_bindgen(js_name = anyHits)]
    pub fn any_hits(&mut self, rays: Rays) -> Answer<Uint8Array> {
        Ok(small(self.ask(|scene| scene.any_hits(&rays.rays))?.into_iter().map(u8::from)))
    }

    /// A list with the hits of each ray.
    #[wasm_bindgen(js_name = allHits)]
    pub fn all_hits(&mut self, rays: Rays) -> Answer<Array> {
        let hits = self.ask(|scene| scene.all_hits(&rays.rays))?.into_iter();
        Ok(hits.map(|of_ray| self.hits(&of_ray.into_iter().map(Some).collect::<Vec<_>>())).collect())
    }

    pub fn visible(&mut self, starts: &Float64Array, ends: &Float64Array, margin: f64) -> Answer<Uint8Array> {
        let segments = segments(starts, ends)?;
        Ok(small(self.ask(|scene| scene.visible(&segments, margin))?.into_iter().map(u8::from)))
    }
}

/// Instances and their paths.
type Moving = Vec<(InstanceId, Box<dyn RigidPath + Sync>)>;

/// Lends the paths.
fn lent(moving: &Moving) -> Vec<(InstanceId, &(dyn RigidPath + Sync))> {
    moving.iter().map(|(id, path)| (*id, path.as_ref())).collect()
}
