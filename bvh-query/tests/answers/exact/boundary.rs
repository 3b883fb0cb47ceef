//! Searches where answers change: pairs of small meshes of every kind, in poses that just touch or just do not.

use super::ask::Asked;
use super::kinds::{KINDS, turn};
use super::walk::Walk;
use crate::common::tally::Tally;
use crate::common::truth::Surface;
use crate::common::{Random, Triangle, bake, mesh, options, queriers, random_pose, rotation, size, stored};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier};
use cbvh_testkit::depth::rounds;

const ENCODINGS: [TriangleEncoding; 3] =
    [TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized];

/// Walks for `everyday` pairs of meshes of each kind, times the depth of the tests.
fn search(name: &str, everyday: u64, walk: fn(&mut Round<'_>, &mut Tally) -> Result<(), String>) {
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    for round in 0..rounds(everyday) {
        for (number, (kind, make)) in KINDS.iter().enumerate() {
            let seed = 1000 * round + number as u64;
            let mut random = Random::new(seed);
            let meshes = make(&mut random);
            let files = meshes.each_ref().map(|triangles| file(triangles, &mut random));
            let surfaces = files.each_ref().map(|file| Surface::new(stored(file)));
            let round = &mut Round { random, files: &files, surfaces: &surfaces, queriers: &mut queriers };
            if let Err(error) = walk(round, &mut tally) {
                tally.wrong(format!("{kind}, seed {seed}: {error}"));
            }
            if tally.is_full() {
                return tally.report(name);
            }
        }
    }
    tally.report(name);
}

fn file(triangles: &[Triangle], random: &mut Random) -> Bvh {
    let profile = Profile::ALL[random.below(Profile::ALL.len())];
    bake(&mesh(triangles), &options(profile, ENCODINGS[random.below(3)]))
}

struct Round<'a> {
    random: Random,
    files: &'a [Bvh; 2],
    surfaces: &'a [Surface; 2],
    queriers: &'a mut [Querier],
}

impl Round<'_> {
    fn walk<'a>(&'a mut self, pose: &'a dyn Fn(f64) -> Option<Pose>) -> Walk<'a> {
        let [a, b] = self.files;
        let asked = Asked { a, b, queriers: self.queriers };
        Walk { asked, surfaces: self.surfaces.each_ref(), pose, hint: (0, 0) }
    }

    /// Returns a point in a triangle of one side, either any point or a corner.
    fn point(&mut self, side: usize) -> [f64; 3] {
        let corners = &self.surfaces[side].corners;
        let [p, q, r] = corners[self.random.below(corners.len())];
        let x = [0.0, 1.0, 0.25, (self.random.signed() + 1.0) / 2.0][self.random.below(4)];
        let y = [0.0, 1.0, 0.5][self.random.below(3)] * (1.0 - x);
        [0, 1, 2].map(|k| p[k] + x * (q[k] - p[k]) + y * (r[k] - p[k]))
    }

    /// Returns the translation that brings a point of B to a point of A.
    fn meeting(&mut self, turn: [[f64; 3]; 3]) -> [f64; 3] {
        let (to, from) = (self.point(0), self.point(1));
        [0, 1, 2].map(|k| to[k] - (turn[k][0] * from[0] + turn[k][1] * from[1] + turn[k][2] * from[2]))
    }

    fn reach(&self) -> f64 {
        let [a, b] = self.surfaces.each_ref().map(|surface| size(&surface.corners, &surface.corners));
        a.max(b)
    }
}

/// Moves B along an axis, by bisecting one number of the translation.
fn translate(round: &mut Round<'_>, tally: &mut Tally) -> Result<(), String> {
    let (turn, axis) = (turn(&mut round.random), round.random.below(3));
    let start = round.meeting(turn);
    let reach = round.reach() * if round.random.below(2) == 0 { 3.0 } else { -3.0 };
    let slant = [0.0, 0.0, 0.3 * round.random.signed()][round.random.below(3)];
    let pose = |x: f64| {
        let mut translation = start;
        translation[(axis + 1) % 3] += slant * (x - start[axis]);
        translation[axis] = x;
        Pose::new(turn, translation).ok()
    };
    if pose(start[axis]).is_none() || pose(start[axis] + reach).is_none() {
        return Ok(());
    }
    let mut walk = round.walk(&pose);
    walk.all(start[axis], tally)?;
    let far = start[axis] + reach;
    if !walk.collide(start[axis], tally)? || walk.collide(far, tally)? {
        return Ok(());
    }
    let apart = walk.find_boundary(start[axis], far, tally)?;
    for digits in [14, 12, 9, 6, 3] {
        walk.all(apart + reach * 10f64.powi(-digits), tally)?;
    }
    Ok(())
}

/// Turns B about an axis through a point of B that is brought to a point of A, by bisecting the angle.
fn rotate(round: &mut Round<'_>, tally: &mut Tally) -> Result<(), String> {
    let base = *random_pose(&mut round.random, 0.0).rotation();
    let (to, from) = (round.point(0), round.point(1));
    let mut axis = round.random.point();
    if round.random.below(2) == 0 {
        axis = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]][round.random.below(3)];
    }
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let nudge = round.random.point().map(|x| x * round.reach() * 0.1);
    let pose = |angle: f64| {
        let (sine, cosine) = (angle / 2.0).sin_cos();
        let by = rotation([0, 1, 2, 3].map(|k| if k < 3 { axis[k] / length * sine } else { cosine }));
        let turn = by.map(|row| [0, 1, 2].map(|k| (0..3).map(|j| row[j] * base[j][k]).sum()));
        let placed = |k: usize| (0..3).map(|j| turn[k][j] * from[j]).sum::<f64>();
        Pose::new(turn, [0, 1, 2].map(|k| to[k] - placed(k) + nudge[k])).ok()
    };
    let mut walk = round.walk(&pose);
    if (walk.pose)(0.0).is_none() {
        return Ok(());
    }
    let mut before = walk.collide(0.0, tally)?;
    for step in 1..=12 {
        let angle = f64::from(step) * 0.5;
        let now = walk.collide(angle, tally)?;
        if now != before {
            // Starts above 0, near which angles have all exponents.
            walk.find_boundary((angle - 0.5).max(1e-12), angle, tally)?;
            return Ok(());
        }
        before = now;
    }
    Ok(())
}

#[test]
fn translations_around_first_contact() {
    search("translations", 2, translate);
}

#[test]
fn rotations_around_first_contact() {
    search("rotations", 1, rotate);
}
