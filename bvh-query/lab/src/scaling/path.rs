//! Times queries along smooth paths, with and without a tracker.
//!
//! B moves around A in even steps and turns by the same angle about an axis of its own. It stays at a gap, or sways in
//! and out of contact as fast as it moves around. With a tracker, many queries cost almost nothing and some as much as
//! without it, so the mean over a path is what counts. The median is taken over rounds, in which both ways take turns.

use super::Measured;
use super::record::Settings;
use super::row::{Part, Row};
use super::sizes::{GAPS, Size, reached};
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError, QueryStats, Tracker};
use cbvh_measure::poses::{Approach, Random, diagonal, dot};
use cbvh_measure::rounds::{Question, Work, add};
use cbvh_measure::spread::Spread;
use std::hint::black_box;
use std::time::Instant;

/// Steps as fractions of the diagonal.
const STEPS: [f64; 3] = [1e-4, 1e-3, 0.01];
/// How far a swaying path goes in and out, as a fraction of the diagonal.
const SWAY: f64 = 0.01;

/// Asks along all paths.
pub(super) fn measure(size: &Size, backend: Backend, settings: &Settings) -> Result<Measured, QueryError> {
    let mut querier = Querier::with_backend(backend);
    let mut measured = Measured::default();
    for gap in std::iter::once(0.0).chain(GAPS) {
        for step in STEPS {
            let poses = path(&mut querier, &size.bvh, gap, step, settings.path_poses)?;
            for question in Question::EXACT {
                let walk = Walk { bvh: &size.bvh, poses: &poses, question };
                let rows = walk.rows(&mut querier, settings.rounds, &mut measured.wrong)?;
                measured.rows.extend(rows.map(|mut row| {
                    row.mesh = Some(size.facts.clone());
                    (row.gap, row.step) = (Some(gap), Some(step));
                    row
                }));
            }
        }
    }
    Ok(measured)
}

/// Returns a path of `count` poses. Gap and step are fractions of the diagonal, and a gap of 0 stands for swaying.
fn path(
    querier: &mut Querier,
    bvh: &Bvh,
    gap: f64,
    step: f64,
    count: usize,
) -> Result<Vec<Pose>, QueryError> {
    let mut random = Random::default();
    let ([from, to, _], start) = (random.rotation(), random.rotation());
    let axis = random.direction();
    let mut angle = 0.0f64;
    let mut poses = Vec::with_capacity(count);
    for number in 0..count {
        let (sin, cos) = angle.sin_cos();
        let away = [0, 1, 2].map(|i| cos * from[i] + sin * to[i]);
        let approach = Approach::new(bvh, bvh, turned(axis, angle, start), away);
        let mut centres = approach.reach(querier, if gap > 0.0 { gap } else { GAPS[0] })?;
        if gap == 0.0 {
            // By at most one step at a time.
            centres += SWAY * diagonal(bvh) * (number as f64 * step / SWAY).cos();
        }
        poses.push(approach.at(centres));
        // The angle of an arc of this length. A mesh without size, or one that contains the other, has none.
        let more = step * diagonal(bvh) / centres;
        angle += if more.is_finite() { more } else { 0.0 };
    }
    Ok(poses)
}

/// Returns a rotation followed by one about an axis of length 1 (Rodrigues' formula, applied to each column).
fn turned(axis: [f64; 3], angle: f64, rotation: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let (sin, cos) = angle.sin_cos();
    let mut result = rotation;
    for column in 0..3 {
        let v = rotation.map(|row| row[column]);
        let along = dot(axis, v) * (1.0 - cos);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let across = axis[j] * v[k] - axis[k] * v[j];
            result[i][column] = cos * v[i] + sin * across + along * axis[i];
        }
    }
    result
}

/// A question along a path.
struct Walk<'a> {
    bvh: &'a Bvh,
    poses: &'a [Pose],
    question: Question,
}

impl Walk<'_> {
    /// Without a tracker, and with one.
    fn rows(
        &self,
        querier: &mut Querier,
        rounds: usize,
        wrong: &mut Vec<String>,
    ) -> Result<impl Iterator<Item = Row>, QueryError> {
        let ways = [false, true];
        let mut times = [Vec::new(), Vec::new()];
        let mut asked = Vec::new();
        for tracked in ways {
            asked.push(self.answers(querier, tracked)?);
        }
        for (pose, (alone, tracked)) in asked[0].0.iter().zip(&asked[1].0).enumerate() {
            if alone.to_bits() != tracked.to_bits() {
                let name = self.question.name();
                wrong.push(format!("path, {name}, pose {pose}: {alone:?}, with a tracker {tracked:?}"));
            }
        }
        for round in 0..rounds {
            for turn in 0..ways.len() {
                let place = (turn + round) % ways.len();
                let before = Instant::now();
                self.walk(querier, ways[place], |_, answer| _ = black_box(answer))?;
                times[place].push(before.elapsed().as_nanos() as u64);
            }
        }
        let count = self.poses.len();
        let spreads = times.map(|times| Spread::of(times).map(|spread| spread.over(count)));
        let both = ways.map(|tracked| {
            let place = usize::from(tracked);
            let (answers, stats) = &asked[place];
            let mut row = Row::new(Part::Path, None, self.question.name());
            row.tracker = Some(tracked);
            row.poses = count as u64;
            row.touching = self.question.touching(answers);
            if self.question != Question::Collide {
                row.reached = reached(self.bvh, answers);
            }
            row.warm = spreads[place];
            row.work = Work::mean(*stats, count);
            row.speedup = spreads[0].zip(spreads[place]).map(|(alone, this)| alone.median / this.median);
            row
        });
        Ok(both.into_iter())
    }

    fn answers(&self, querier: &mut Querier, tracked: bool) -> Result<(Vec<f64>, QueryStats), QueryError> {
        let (mut answers, mut sum) = (Vec::new(), QueryStats::default());
        self.walk(querier, tracked, |stats, answer| {
            answers.push(answer);
            add(&mut sum, stats);
        })?;
        Ok((answers, sum))
    }

    /// Asks in all poses, in order.
    #[inline]
    fn walk(
        &self,
        querier: &mut Querier,
        tracked: bool,
        mut each: impl FnMut(QueryStats, f64),
    ) -> Result<(), QueryError> {
        let bvh = self.bvh;
        let mut tracker = Tracker::new();
        for pose in self.poses {
            let answer = match self.question {
                question if !tracked => question.ask(querier, bvh, bvh, pose)?,
                Question::Collide => f64::from(u8::from(tracker.collide(querier, bvh, bvh, pose)?)),
                Question::Distance(_) => tracker.distance(querier, bvh, bvh, pose)?.distance,
            };
            each(querier.stats(), answer);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turning_keeps_lengths_and_the_axis() {
        let axis = [2.0 / 3.0, 1.0 / 3.0, -2.0 / 3.0];
        let unit = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let half = turned(axis, 0.5, unit);
        for i in 0..3 {
            assert!(
                (dot(half[i], half[i]) - 1.0).abs() < 1e-15 && (dot(half[i], axis) - axis[i]).abs() < 1e-15
            );
        }
        let quarter = turned([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_2, unit);
        assert!((quarter[1][0] - 1.0).abs() < 1e-15 && (quarter[0][1] + 1.0).abs() < 1e-15);
    }
}
