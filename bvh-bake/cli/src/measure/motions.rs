//! Makes motions for pairs without files of motions: long ways, short ways, slides along A, and turns on the spot.
//!
//! Each starts with a gap between the meshes, as [`crate::poses`] makes it. The random numbers have a constant seed, so the
//! motions are the same everywhere.

use crate::poses::{Approach, Random, diagonal, dot};
use bvh_query::{Bvh, Motion, MotionError, Pose, Querier, QueryError};

/// How the motions are made in turn, in a phrase.
pub const MADE: &str = "made: a quarter each long ways, short ways, slides and turns on the spot";

/// The gap at the start of a motion, as a fraction of A's diagonal: of long ways, short ways, slides and turns.
const GAPS: [f64; 4] = [0.05, 0.01, 0.005, 0.01];
/// How far B is shifted on a short way and slides, as a fraction of A's diagonal.
const SHIFT: f64 = 0.02;
/// The angle by which B turns on a short way, in radians.
const SHORT_TURN: f64 = 0.1;
/// The angle by which B turns on the spot, in radians.
const LONG_TURN: f64 = 2.0;
/// The least sine of the angle between two directions whose cross product gives a third one.
const MIN_SINE: f64 = 0.1;

/// A start: B at a gap from A.
struct Start<'a> {
    approach: Approach<'a>,
    /// How far apart the centres are, mesh units.
    reach: f64,
}

/// Returns up to `count` motions. Only one between poses that are half a turn apart is left out.
///
/// # Errors
/// Returns the first error of a query.
pub fn mixed(querier: &mut Querier, a: &Bvh, b: &Bvh, count: usize) -> Result<Vec<Motion>, QueryError> {
    let mut random = Random::default();
    let mut motions = Vec::new();
    for number in 0..count {
        let kind = number % GAPS.len();
        let mut start = || -> Result<Start<'_>, QueryError> {
            let approach = Approach::new(a, b, random.rotation(), random.direction());
            let reach = approach.reach(querier, GAPS[kind])?;
            Ok(Start { approach, reach })
        };
        let from = start()?;
        let shift = SHIFT * diagonal(a);
        let motion = match kind {
            0 => Motion::between(&from.pose(), &start()?.pose()),
            1 => from.turned(random.direction(), SHORT_TURN, shift),
            2 => from.slid(&mut random, shift),
            _ => from.turned(random.direction(), LONG_TURN, 0.0),
        };
        motions.extend(motion.ok());
    }
    Ok(motions)
}

impl Start<'_> {
    fn pose(&self) -> Pose {
        self.approach.at(self.reach)
    }

    /// Turns B about its centre, and shifts it along the axis.
    fn turned(&self, axis: [f64; 3], angle: f64, shift: f64) -> Result<Motion, MotionError> {
        Motion::screw(&self.pose(), self.approach.centre_of_b(self.reach), axis, angle, shift)
    }

    /// Shifts B across the direction in which it approached.
    fn slid(&self, random: &mut Random, shift: f64) -> Result<Motion, MotionError> {
        let across = loop {
            let across = cross(self.approach.away(), random.direction());
            if dot(across, across) >= MIN_SINE * MIN_SINE {
                break across;
            }
        };
        Motion::screw(&self.pose(), [0.0; 3], across, 0.0, shift)
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
