//! Makes poses and motions for pairs that have none: some poses overlap, others have given gaps, and each motion starts with
//! a gap.
//!
//! B is turned at random and moved towards A along a random direction. A step changes the distance by at most its own
//! length, so a step as long as the distance exceeds the gap never goes too far. The random numbers have a constant
//! seed and distances have the same bits everywhere, so poses and motions are the same everywhere, too.

use bvh_format::vec3::{cross, dot};
use bvh_query::{Bvh, Motion, Pose, Querier, QueryError};

/// How poses are made, with the gaps of [`POSE_GAPS`].
pub(super) const POSES: &str =
    "made: a fifth overlaps, the others have gaps of 0.000001, 0.005, 0.01, 0.05 of A's diagonal";
/// How motions are made in turn.
pub(super) const MOTIONS: &str =
    "made: a quarter each long motions, short motions, slides and turns on the spot";

/// The gaps of poses in turn, as fractions of A's diagonal; 0 stands for overlap.
const POSE_GAPS: [f64; 5] = [0.0, 1e-6, 0.005, 0.01, 0.05];
/// The gap at the start of a motion, as a fraction of A's diagonal: of long motions, short motions, slides and turns.
const MOTION_GAPS: [f64; 4] = [0.05, 0.01, 0.005, 0.01];
/// How far B moves in short motions and slides, as a fraction of A's diagonal.
const SHIFT: f64 = 0.02;
/// The angles by which B turns in short motions and on the spot, in radians.
const SHORT_TURN: f64 = 0.1;
const LONG_TURN: f64 = 2.0;
/// By which fraction of the gap the distance of a pose may exceed it.
const GAP_TOLERANCE: f64 = 0.01;
/// The number of steps after which a pose is taken as it is.
const MAX_STEPS: usize = 100;
/// The least sine of the angle between two directions that span a plane.
const MIN_SINE: f64 = 0.1;

/// Returns `count` poses with the gaps in turn.
pub(super) fn poses(querier: &mut Querier, a: &Bvh, b: &Bvh, count: usize) -> Result<Vec<Pose>, QueryError> {
    let mut random = Random::SEED;
    let gaps = POSE_GAPS.into_iter().cycle().take(count);
    gaps.map(|gap| Ok(Start::new(querier, a, b, &mut random, gap)?.pose)).collect()
}

/// Returns up to `count` motions. Only one between poses that are half a turn apart is left out.
pub(super) fn motions(
    querier: &mut Querier,
    a: &Bvh,
    b: &Bvh,
    count: usize,
) -> Result<Vec<Motion>, QueryError> {
    let (mut random, shift) = (Random::SEED, SHIFT * diagonal(a));
    let mut motions = Vec::new();
    for number in 0..count {
        let kind = number % MOTION_GAPS.len();
        let Start { pose, centre, away } = Start::new(querier, a, b, &mut random, MOTION_GAPS[kind])?;
        let motion = match kind {
            0 => Motion::between(&pose, &Start::new(querier, a, b, &mut random, MOTION_GAPS[kind])?.pose),
            1 => Motion::screw(&pose, centre, random.direction(), SHORT_TURN, shift),
            2 => Motion::screw(&pose, [0.0; 3], cross(away, random.across(away)), 0.0, shift),
            _ => Motion::screw(&pose, centre, random.direction(), LONG_TURN, 0.0),
        };
        motions.extend(motion.ok());
    }
    Ok(motions)
}

/// Returns the diagonal of the first object's box, mesh units.
pub(super) fn diagonal(bvh: &Bvh) -> f64 {
    let Some(object) = bvh.objects().first() else { return 0.0 };
    let (lo, hi) = (object.record().box_lo, object.record().box_hi);
    (0..3).map(|a| (f64::from(hi[a].get()) - f64::from(lo[a].get())).powi(2)).sum::<f64>().sqrt()
}

/// B at a gap from A.
struct Start {
    pose: Pose,
    /// The centre of B in the frame of A.
    centre: [f64; 3],
    /// The direction from A to B, of length 1.
    away: [f64; 3],
}

impl Start {
    /// Turns B at random and puts it at a gap, which is a fraction of A's diagonal. With a gap of 0, the smaller sphere
    /// lies inside the larger one, or both share much of their space.
    fn new(
        querier: &mut Querier,
        a: &Bvh,
        b: &Bvh,
        random: &mut Random,
        gap: f64,
    ) -> Result<Self, QueryError> {
        let ((centre_a, radius_a), (centre_b, radius_b)) = (sphere(a), sphere(b));
        let (rotation, away) = (random.rotation(), random.direction());
        let turned = rotation.map(|row| dot(row, centre_b));
        let at = |apart: f64| {
            let centre = [0, 1, 2].map(|i| centre_a[i] + apart * away[i]);
            let translation = [0, 1, 2].map(|i| centre[i] - turned[i]);
            Self { pose: Pose::new(rotation, translation).unwrap_or(Pose::IDENTITY), centre, away }
        };
        if gap == 0.0 {
            return Ok(at(0.5 * radius_a.max(radius_b)));
        }
        let gap = gap * diagonal(a);
        let mut apart = radius_a + radius_b + 2.0 * gap;
        for _ in 0..MAX_STEPS {
            let more = querier.distance(a, b, &at(apart).pose)?.distance - gap;
            if more <= GAP_TOLERANCE * gap || apart < 0.0 {
                break;
            }
            apart -= more;
        }
        Ok(at(apart))
    }
}

/// Returns centre and radius of the sphere around the first object, mesh units.
fn sphere(bvh: &Bvh) -> ([f64; 3], f64) {
    let Some(object) = bvh.objects().first() else { return ([0.0; 3], 0.0) };
    let record = object.record();
    let centre = [0, 1, 2].map(|a| record.origin[a].get() + f64::from(record.sphere_centre[a].get()));
    (centre, record.sphere_radius.get().into())
}

/// A linear congruential generator: what matters here is that the numbers can be reproduced, not their quality.
struct Random(u64);

impl Random {
    /// The seed, the same for all pairs.
    const SEED: Self = Self(0x9e37_79b9_7f4a_7c15);

    /// Returns a number from -1 to 1.
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    /// Returns a vector of length 1.
    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [(); 3].map(|()| self.signed());
            let length = dot(v, v).sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|c| c / length);
            }
        }
    }

    /// Returns a direction that is not parallel to `other`, which has length 1.
    fn across(&mut self, other: [f64; 3]) -> [f64; 3] {
        loop {
            let direction = self.direction();
            let normal = cross(other, direction);
            if dot(normal, normal) >= MIN_SINE * MIN_SINE {
                return direction;
            }
        }
    }

    /// Returns a rotation.
    fn rotation(&mut self) -> [[f64; 3]; 3] {
        let x = self.direction();
        let other = self.across(x);
        let along = dot(x, other);
        let y = [0, 1, 2].map(|i| other[i] - along * x[i]);
        let length = dot(y, y).sqrt();
        let y = y.map(|c| c / length);
        [x, y, cross(x, y)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gaps_of_made_poses_are_named() {
        let gaps: Vec<String> = POSE_GAPS[1..].iter().map(|gap| gap.to_string()).collect();
        assert!(POSES.contains(&gaps.join(", ")));
    }
}
