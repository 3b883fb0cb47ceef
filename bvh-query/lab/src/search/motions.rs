//! Asks about ways that end in contact, pass it by a few roundings or slide along it, and judges the answers in poses
//! along the way.
//!
//! A way that is free has no contact in any of these poses, and one that is not has none before the time until which it is
//! said to be free, and one at the time of the hit. All backends must give the same bits. The tests of `bvh-query` compare
//! motions with their slow definition; a search along the way is faster, so that more ways are asked about.

use super::files::{Layout, bake};
use super::pairs::queriers;
use super::pairs::truth;
use super::record::{Counts, Finding};
use super::stars::Stars;
use crate::Failure;
use crate::common::placed;
use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Pose, QueryError, RigidPath};
use cbvh_testkit::Random;

/// Ways of a round.
const WAYS: usize = 8;
/// Poses along a way, besides those at which the answer names times.
const SAMPLES: u32 = 12;
/// Visits of a question. Ways that slide along a mesh need any number.
const BUDGET: u64 = 300_000;

/// Runs one round. Returns the wrong answers.
pub(super) fn round(seed: u64, counts: &mut Counts) -> Result<Vec<Finding>, Failure> {
    let mut random = Random::new(seed);
    let stars = Stars::new(&mut random);
    let open = |triangles: &[_], random: &mut Random| -> Result<Bvh, Failure> {
        Ok(Bvh::from_bytes(bake(triangles, &Layout::random(random, 2).options())?)?)
    };
    let (a, b) = (open(&stars.a, &mut random)?, open(&stars.b, &mut random)?);
    let size = stars.b.iter().flatten().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let mut queriers = queriers();
    queriers.iter_mut().for_each(|querier| querier.set_budget(BUDGET));
    for _ in 0..WAYS {
        // Off the plane between the stars by much, by some roundings or not at all, or through it.
        let end = |random: &mut Random| {
            let off =
                size * [0.3, 1e-3, 4.0 * f64::EPSILON, 0.0, -4.0 * f64::EPSILON, -1e-3][random.below(6)];
            let along = [0.0, 0.0, 0.02 * size][random.below(3)] * random.signed();
            let axis = random.below(3);
            let to =
                |k: usize| stars.translation[k] + off * stars.normal[k] + if k == axis { along } else { 0.0 };
            Pose::new(stars.rotation, [0, 1, 2].map(to))
        };
        let (Ok(from), Ok(to)) = (end(&mut random), end(&mut random)) else { continue };
        let Ok(way) = Motion::between(&from, &to) else { continue };
        let contacts = |t: f64| {
            let b = placed(&stars.b, &way.pose(t));
            !truth(&stars.a, &b, stars.sizes, &mut Counts::default()).is_empty()
        };
        let options = MotionOptions::new().tolerance([None, Some(size * 1e-4)][random.below(2)]);
        let mut first = None;
        for querier in &mut queriers {
            counts.add("queries", 1);
            let answer = match querier.motion(&a, &b, &way, &options) {
                Ok(answer) => answer,
                // Which errors there are may depend on the backend.
                Err(QueryError::Budget { .. } | QueryError::Number(_)) => {
                    counts.add("answers that a budget ended", 1);
                    continue;
                }
                Err(error) => return Err(error.into()),
            };
            let wrong = match first {
                Some(first) if first != answer => {
                    Some(format!("{}: {answer:?}, not {first:?}", querier.backend()))
                }
                Some(_) => None,
                None => wrong(&answer, contacts),
            };
            if let Some(wrong) = wrong {
                let wrong = format!("{from:?} to {to:?}, {options:?}: {wrong}");
                return Ok(vec![Finding {
                    kind: "motions".into(),
                    round: seed,
                    wrong,
                    case: None,
                    file: None,
                }]);
            }
            first = Some(answer);
        }
        counts.add("ways", 1);
    }
    Ok(Vec::new())
}

/// Returns what is wrong with an answer; `contacts` says whether the meshes touch at a time.
fn wrong(answer: &MotionAnswer, contacts: impl Fn(f64) -> bool) -> Option<String> {
    let (free_until, at) = match *answer {
        MotionAnswer::Free => (1.0, None),
        MotionAnswer::Hit { free_until, touching_at, .. } => (free_until, Some((touching_at, true))),
        MotionAnswer::Near { free_until, at, .. } => (free_until, Some((at, false))),
    };
    let times = (0..=SAMPLES).map(|i| free_until * f64::from(i) / f64::from(SAMPLES));
    let is_before = |t: &f64| *t < free_until || *answer == MotionAnswer::Free;
    if let Some(t) = times.filter(is_before).find(|&t| contacts(t)) {
        return Some(format!("{answer:?}, but in contact at {t}"));
    }
    at.filter(|&(t, touching)| contacts(t) != touching)
        .map(|(t, touching)| format!("{answer:?}, contact at {t} is {}", !touching))
}
