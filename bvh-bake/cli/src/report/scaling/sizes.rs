//! Bakes the ball in all sizes and times single queries of each against itself.
//!
//! Turns and directions of the poses are the same in all sizes; how near B comes is found in each for itself. Rounds
//! and turns are those of `measure`, with sizes in the place of variants.

use super::Measured;
use super::ball::ball;
use super::row::{Facts, Part, Row};
use crate::error::Failure;
use crate::report::measure::{Asked, Baked, Question, turn_of};
use crate::report::row::Work;
use crate::report::scatter::{self, diagonal};
use crate::report::spread::Spread;
use crate::report::variant::{Group, Variant};
use bvh_bake::{Ablation, BakeError, Options, to_bytes};
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError, QueryStats};
use std::sync::Arc;

/// Gaps in fractions of the diagonal.
pub(super) const GAPS: [f64; 3] = [1e-6, 0.01, 0.05];
/// What is asked.
pub(super) const QUESTIONS: [Question; 2] = [Question::Collide, Question::Distance(0.0)];
/// A mesh has about as many triangles as one of these times a power of ten.
const STEPS: [u64; 2] = [1, 3];

/// About how many triangles the balls have: from 1000 on, two in each decade.
pub(super) fn targets(largest: u64) -> Vec<u64> {
    let decades = (3..10).map(|decade| 10u64.pow(decade));
    let all = decades.flat_map(|decade| STEPS.map(|step| step * decade));
    all.take_while(|&target| target <= largest).collect()
}

/// A ball, baked, with poses by gap.
pub(super) struct Size {
    pub(super) baked: Baked,
    pub(super) facts: Facts,
    pub(super) poses: Vec<Vec<Pose>>,
}

impl Size {
    /// Bakes it in the layout that the baker chooses, and finds so many poses for each gap.
    pub(super) fn new(target: u64, backend: Backend, count: usize) -> Result<Self, Failure> {
        let failed = |error: BakeError| Failure::from_bake(&format!("ball of {target} triangles"), &error);
        let (bytes, report) = to_bytes(&ball(target), &Options::default()).map_err(failed)?;
        let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(BakeError::Unproved(error)))?;
        let broken = |error| Failure::Invalid(format!("ball of {target} triangles: {error}"));
        // No timed query pays for the first touch of a page.
        bvh.check_all().map_err(broken)?;
        let mut querier = Querier::with_backend(backend);
        let poses = GAPS.map(|gap| scatter::apart(&mut querier, &bvh, &bvh, gap, count));
        let poses = poses.into_iter().collect::<Result<Vec<_>, QueryError>>().map_err(broken)?;
        let file = &report.file;
        let (profile, triangles) = (file.profile, file.triangle_encoding);
        let facts = Facts {
            triangles: file.triangles,
            profile: profile.name(),
            encoding: triangles.name(),
            file_bytes_per_tri: file.file_bytes as f64 / file.triangles as f64,
            bake_seconds: report.seconds,
        };
        let variant = Variant {
            group: Group::Layout,
            name: target.to_string(),
            profile,
            triangles,
            ablation: Ablation::default(),
        };
        let a = Arc::new(bvh);
        Ok(Self { baked: Baked { variant, b: a.clone(), a }, facts, poses })
    }

    /// All poses, gap by gap.
    pub(super) fn all_poses(&self) -> Vec<Pose> {
        self.poses.concat()
    }
}

/// Asks; the rows are by question, gap and size.
pub(super) fn measure(sizes: &[Size], backend: Backend, rounds: usize) -> Result<Measured, QueryError> {
    let mut all = vec![vec![Asked::default(); sizes.len()]; QUESTIONS.len() * GAPS.len()];
    let mut queriers: Vec<Querier> = sizes.iter().map(|_| Querier::with_backend(backend)).collect();
    let lines = || QUESTIONS.into_iter().flat_map(|question| (0..GAPS.len()).map(move |gap| (question, gap)));
    for round in 0..rounds {
        for ((question, gap), asked) in lines().zip(&mut all) {
            for turn in 0..sizes.len() {
                let place = (turn + round) % sizes.len();
                let (size, querier) = (&sizes[place], &mut queriers[place]);
                turn_of(question, querier, &size.baked, &size.poses[gap], &mut asked[place])?;
            }
        }
    }
    let mut measured = Measured::default();
    for ((question, gap), asked) in lines().zip(&all) {
        for (size, asked) in sizes.iter().zip(asked) {
            measured.rows.push(row(size, question, gap, asked));
        }
    }
    for gap in 0..GAPS.len() {
        for (place, size) in sizes.iter().enumerate() {
            let [collide, distance] = [gap, GAPS.len() + gap].map(|line| &all[line][place].answers);
            for (pose, (touching, distance)) in collide.iter().zip(distance).enumerate() {
                if (*touching == 1.0) != (*distance == 0.0) {
                    let (name, gap) = (&size.baked.variant.name, GAPS[gap]);
                    measured.wrong.push(format!(
                        "{name} triangles, gap {gap}, pose {pose}: collide {touching}, distance {distance:?}"
                    ));
                }
            }
        }
    }
    Ok(measured)
}

fn row(size: &Size, question: Question, gap: usize, asked: &Asked) -> Row {
    let mut row = Row::new(Part::Size, Some(size.facts.clone()), question.name());
    row.gap = Some(GAPS[gap]);
    row.poses = asked.answers.len() as u64;
    if question == Question::Collide {
        row.touching = asked.answers.iter().filter(|&&answer| answer == 1.0).count() as u64;
    } else {
        row.touching = asked.answers.iter().filter(|&&answer| answer == 0.0).count() as u64;
        row.reached = reached(&size.baked.a, &asked.answers);
    }
    row.warm = Spread::of_rounds(&asked.rounds);
    row.work = mean_work(asked.stats, asked.answers.len());
    row
}

/// The least and the largest distance in fractions of the diagonal.
pub(super) fn reached(bvh: &Bvh, distances: &[f64]) -> Option<[f64; 2]> {
    let least = distances.iter().copied().min_by(f64::total_cmp)?;
    let most = distances.iter().copied().max_by(f64::total_cmp)?;
    Some([least, most].map(|distance| distance / diagonal(bvh)))
}

/// Counts of a query on average.
pub(super) fn mean_work(stats: QueryStats, queries: usize) -> Work {
    let mean = |count: u64| Some(count as f64 / queries as f64);
    Work {
        node_tests: mean(stats.node_tests),
        packet_tests: mean(stats.packet_tests),
        exact_tests: mean(stats.exact_tests),
    }
}

#[cfg(test)]
mod tests {
    use super::super::ball::RADII;
    use super::*;
    use crate::report::scatter::CLOSE;

    #[test]
    fn sizes_are_two_a_decade() {
        assert_eq!(targets(1000), [1000]);
        assert_eq!(targets(99_999), [1000, 3000, 10_000, 30_000]);
        assert_eq!(targets(10_000_000).len(), 9);
    }

    /// The nearest vertices bound the distance from both sides: no point of a triangle is farther from its nearest
    /// corner than the longest edge over the square root of 3.
    #[test]
    fn poses_have_their_gaps_and_distances_are_those_of_the_vertices() {
        let backend = Backend::detect().unwrap();
        let (mesh, size) = (ball(1000), Size::new(1000, backend, 4).unwrap());
        let object = &mesh.objects[0];
        let apart = |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
        let corner = |vertex: u32| object.positions[vertex as usize];
        let edges = object.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let longest = edges.map(|(a, b)| apart(corner(a), corner(b))).fold(0.0, f64::max);
        let mut querier = Querier::with_backend(backend);
        let bvh = &*size.baked.a;
        for (gap, poses) in GAPS.into_iter().zip(&size.poses) {
            for pose in poses {
                let found = querier.distance(bvh, bvh, pose).unwrap().distance;
                let asked = gap * diagonal(bvh);
                assert!((asked * (1.0 - 1e-9)..=asked * (1.0 + CLOSE)).contains(&found), "{gap}: {found}");
                let placed: Vec<[f64; 3]> = object.positions.iter().map(|&p| pose.place(p)).collect();
                let pairs = object.positions.iter().flat_map(|&p| placed.iter().map(move |&q| apart(p, q)));
                let vertices = pairs.fold(f64::INFINITY, f64::min);
                assert!((vertices - longest * 2.0 / 3f64.sqrt()..=vertices).contains(&found), "{found}");
                let centres = apart(pose.place([0.0; 3]), [0.0; 3]);
                assert!(found >= centres - 2.0 * RADII[1] && found <= centres - 2.0 * RADII[0], "{found}");
                assert!(!querier.collide(bvh, bvh, pose).unwrap());
            }
        }
        let measured = measure(&[size], backend, 1).unwrap();
        assert_eq!((measured.rows.len(), measured.wrong.len()), (6, 0));
    }
}
