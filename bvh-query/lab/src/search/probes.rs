//! Asks about points and segments that touch a mesh or almost do, and judges the answers by exact arithmetic.
//!
//! The points are corners of placed stars, which are at most some roundings off A, and the segments are their edges. A
//! point is a triangle whose corners are the same, and a segment one with two such corners.

use super::files::{Layout, bake};
use super::pairs::queriers;
use super::record::{Counts, Finding};
use super::stars::Stars;
use crate::Failure;
use crate::common::placed;
use bvh_query::{Bvh, Pose, Querier, QueryError};
use cbvh_testkit::exact::{Boxed, Decided, Length, intersect};
use cbvh_testkit::{Random, Triangle};

/// Triangles of B from which points and segments are taken in a round.
const PROBES: usize = 200;
/// Points of which one has its distance compared with all triangles, which takes long.
const PROVED: usize = 50;

/// Runs one round. Returns the wrong answers.
pub(super) fn round(seed: u64, counts: &mut Counts) -> Result<Vec<Finding>, Failure> {
    let mut random = Random::new(seed);
    let stars = Stars::new(&mut random);
    let file = Bvh::from_bytes(bake(&stars.a, &Layout::random(&mut random, 2).options())?)?;
    let pose = Pose::new(stars.rotation, stars.translation)?;
    let b = placed(&stars.b, &pose);
    let mut findings = Vec::new();
    for number in 0..PROBES {
        let [p, q, _] = b[random.below(b.len())];
        let is_met = |probe: Triangle| {
            let probe = Boxed::new(probe);
            stars.a.iter().any(|t| intersect(&Boxed::new(*t), &probe, &mut Decided::default()))
        };
        let (on, met) = (is_met([p; 3]), is_met([p, q, q]));
        for querier in &mut queriers() {
            counts.add("queries", 2);
            let is_proved = number % PROVED == 0;
            if let Some(wrong) = wrong(querier, &file, &stars.a, [p, q], [on, met], is_proved)? {
                let wrong = format!("{}, {p:?} to {q:?}: {wrong}", querier.backend());
                findings.push(Finding { kind: "probes".into(), round: seed, wrong, case: None, file: None });
                return Ok(findings);
            }
        }
        counts.add("points on the mesh", u64::from(on));
        counts.add("segments that meet it", u64::from(met));
    }
    Ok(findings)
}

/// Returns the first wrong answer about a point and a segment.
fn wrong(
    querier: &mut Querier,
    file: &Bvh,
    triangles: &[Triangle],
    [p, q]: [[f64; 3]; 2],
    [on, met]: [bool; 2],
    is_proved: bool,
) -> Result<Option<String>, QueryError> {
    if querier.segment_hit(file, p, q)? != met {
        return Ok(Some(format!("segment_hit: {}", !met)));
    }
    let Some(answer) = querier.closest_point(file, p, f64::INFINITY)? else {
        return Ok(Some("closest_point: none".to_owned()));
    };
    let named = Length::between(&[p; 3], &triangles[answer.triangle as usize]);
    if (answer.distance == 0.0) != on
        || named.compare(answer.lower).is_lt()
        || named.compare(answer.upper).is_gt()
    {
        return Ok(Some(format!("{answer:?}, exactly {:e}", named.floor())));
    }
    let nearer = |t: &Triangle| Length::between(&[p; 3], t).compare(answer.lower).is_lt();
    Ok((is_proved && triangles.iter().any(nearer)).then(|| format!("{answer:?}, but another is nearer")))
}
