//! Bakes the ball in all sizes and times single queries of each against itself.
//!
//! Each size is baked with and without turning slabs. Turns and directions of the poses are the same in all sizes. How near B comes is found for each size by itself.

use super::Measured;
use super::row::{Facts, Part, Row};
use crate::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError};
use cbvh_measure::poses::{Approach, Random, diagonal};
use cbvh_measure::rounds::{Asked, Question, Subject, rounds};
use cbvh_measure::spread::Spread;
use cbvh_testkit::ball::ball;

/// Gaps as fractions of the diagonal.
pub(crate) const GAPS: [f64; 3] = [1e-6, 0.01, 0.05];
/// The number of triangles of a ball is about one of these times a power of ten.
const STEPS: [u64; 2] = [1, 3];

/// Returns about how many triangles the balls have: from 1000 on, two sizes per decade.
pub(super) fn targets(largest: u64) -> Vec<u64> {
    let decades = (3..10).map(|decade| 10u64.pow(decade));
    let all = decades.flat_map(|decade| STEPS.map(|step| step * decade));
    all.take_while(|&target| target <= largest).collect()
}

/// A baked ball with poses by gap.
pub(super) struct Size {
    pub(super) bvh: Bvh,
    pub(super) facts: Facts,
    pub(super) poses: Vec<Vec<Pose>>,
    without_slabs: bool,
}

impl Size {
    /// Bakes a ball in the layout that the baker chooses, with and without turning slabs, and finds `count` poses for each
    /// gap.
    pub(super) fn both(target: u64, backend: Backend, count: usize) -> Result<[Self; 2], Failure> {
        let (positions, triangles) = ball(target);
        let mesh = Mesh::from_triangles(positions, triangles);
        let mut with = Self::new(&mesh, false)?;
        let mut without = Self::new(&mesh, true)?;
        let mut querier = Querier::with_backend(backend);
        let poses = GAPS.map(|gap| apart(&mut querier, &with.bvh, &with.bvh, gap, count));
        with.poses = poses.into_iter().collect::<Result<Vec<_>, QueryError>>()?;
        without.poses.clone_from(&with.poses);
        Ok([with, without])
    }

    /// Bakes a ball; it has no poses yet.
    fn new(mesh: &Mesh, without_slabs: bool) -> Result<Self, Failure> {
        let (bytes, report) = to_bytes(mesh, &Options::default().turning_slabs(!without_slabs))?;
        let bvh = Bvh::from_bytes(bytes)?;
        // No timed query pays for the first touch of a page.
        bvh.validate()?;
        let file = &report.file;
        let facts = Facts {
            triangles: file.triangles,
            profile: file.profile.name(),
            encoding: file.triangle_encoding.name(),
            turning_slabs: file.profile.has_turning_slabs().then_some(!without_slabs),
            file_bytes_per_tri: file.file_bytes as f64 / file.triangles as f64,
            bake_seconds: report.seconds,
        };
        Ok(Self { bvh, facts, poses: Vec::new(), without_slabs })
    }

    /// Returns all poses, gap by gap.
    pub(super) fn all_poses(&self) -> Vec<Pose> {
        self.poses.concat()
    }
}

/// Asks; the rows are by question, gap and size.
pub(super) fn measure(sizes: &[Size], backend: Backend, count: usize) -> Result<Measured, QueryError> {
    let of_gap = |gap: usize| {
        let subjects: Vec<_> = sizes
            .iter()
            .map(|size| Subject { a: &size.bvh, b: &size.bvh, poses: &size.poses[gap] })
            .collect();
        rounds(&subjects, &Question::EXACT, backend, count)
    };
    let all = (0..GAPS.len()).map(of_gap).collect::<Result<Vec<_>, _>>()?;
    let mut measured = Measured::default();
    for (number, question) in Question::EXACT.into_iter().enumerate() {
        for (gap, of_gap) in all.iter().enumerate() {
            let asked = sizes.iter().zip(of_gap);
            measured.rows.extend(asked.map(|(size, asked)| row(size, question, gap, &asked[number])));
        }
    }
    for (gap, of_gap) in GAPS.into_iter().zip(&all) {
        for (size, asked) in sizes.iter().zip(of_gap) {
            let both = asked[0].answers.iter().zip(&asked[1].answers);
            for (pose, (touching, distance)) in both.enumerate() {
                if (*touching == 1.0) != (*distance == 0.0) {
                    measured.wrong.push(format!(
                        "{} triangles, gap {gap}, pose {pose}: collide {touching}, distance {distance:?}",
                        size.facts.triangles
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
    row.without_slabs = size.without_slabs;
    row.poses = asked.answers.len() as u64;
    row.touching = question.touching(&asked.answers);
    if question != Question::Collide {
        row.reached = reached(&size.bvh, &asked.answers);
    }
    row.warm = Spread::of_rounds(&asked.rounds);
    row.work = asked.work();
    row
}

/// Returns the least and the largest distance as fractions of the diagonal.
pub(super) fn reached(bvh: &Bvh, distances: &[f64]) -> Option<[f64; 2]> {
    let least = distances.iter().copied().min_by(f64::total_cmp)?;
    let most = distances.iter().copied().max_by(f64::total_cmp)?;
    Some([least, most].map(|distance| distance / diagonal(bvh)))
}

/// Returns `count` poses with this gap, a fraction of A's diagonal. Turns and directions are the same for all meshes and
/// gaps.
///
/// # Errors
/// Returns the first error of a query.
fn apart(querier: &mut Querier, a: &Bvh, b: &Bvh, gap: f64, count: usize) -> Result<Vec<Pose>, QueryError> {
    let mut random = Random::default();
    let mut pose = || {
        let approach = Approach::new(a, b, random.rotation(), random.direction());
        Ok(approach.at(approach.reach(querier, gap)?))
    };
    (0..count).map(|_| pose()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_measure::poses::GAP_TOLERANCE;
    use cbvh_testkit::ball::RADII;

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
        let (positions, triangles) = ball(1000);
        let sizes = Size::both(1000, backend, 4).unwrap();
        let size = &sizes[0];
        let apart = |p: [f64; 3], q: [f64; 3]| (0..3).map(|i| (p[i] - q[i]).powi(2)).sum::<f64>().sqrt();
        let corner = |vertex: u32| positions[vertex as usize];
        let edges = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        let longest = edges.map(|(a, b)| apart(corner(a), corner(b))).fold(0.0, f64::max);
        let mut querier = Querier::with_backend(backend);
        let bvh = &size.bvh;
        for (gap, poses) in GAPS.into_iter().zip(&size.poses) {
            for pose in poses {
                let found = querier.distance(bvh, bvh, pose).unwrap().distance;
                let asked = gap * diagonal(bvh);
                assert!(
                    (asked * (1.0 - 1e-9)..=asked * (1.0 + GAP_TOLERANCE)).contains(&found),
                    "{gap}: {found}"
                );
                let placed: Vec<[f64; 3]> = positions.iter().map(|&p| pose.place(p)).collect();
                let pairs = positions.iter().flat_map(|&p| placed.iter().map(move |&q| apart(p, q)));
                let vertices = pairs.fold(f64::INFINITY, f64::min);
                assert!((vertices - longest * 2.0 / 3f64.sqrt()..=vertices).contains(&found), "{found}");
                let centres = apart(pose.place([0.0; 3]), [0.0; 3]);
                assert!(found >= centres - 2.0 * RADII[1] && found <= centres - 2.0 * RADII[0], "{found}");
                assert!(!querier.collide(bvh, bvh, pose).unwrap());
            }
        }
        let measured = measure(&sizes, backend, 1).unwrap();
        assert_eq!((measured.rows.len(), measured.wrong.len()), (12, 0));
        let reached: Vec<_> = measured.rows.iter().map(|row| row.reached).collect();
        assert!(reached.chunks(2).all(|pair| pair[0] == pair[1]), "{reached:?}");
    }
}
