//! Makes up poses for pairs that come without: some overlapping, others at stated gaps.
//!
//! B is turned at random and moved towards A along a random direction. Moving it by some length changes the
//! distance by no more than that, so steps of what the distance exceeds the gap by never go too far. Random
//! numbers are seeded by constants and distances are the same everywhere: so are the poses.

use bvh_query::{Bvh, Pose, Querier, QueryError};

/// Gaps in fractions of A's diagonal, in turn; 0 stands for overlap.
pub(super) const GAPS: [f64; 5] = [0.0, 1e-6, 0.005, 0.01, 0.05];
/// How much of a gap may be left to go.
const CLOSE: f64 = 0.01;
/// Steps before a pose is taken as it is.
const STEPS: usize = 100;

/// So many poses.
pub(super) fn poses(querier: &mut Querier, a: &Bvh, b: &Bvh, count: usize) -> Result<Vec<Pose>, QueryError> {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (centre_a, radius_a) = sphere(a);
    let (centre_b, radius_b) = sphere(b);
    let mut poses = Vec::new();
    for number in 0..count {
        let (rotation, away) = (random.rotation(), random.direction());
        let turned = rotation.map(|row| dot(row, centre_b));
        let at = |t: f64| {
            let translation = [0, 1, 2].map(|i| centre_a[i] + t * away[i] - turned[i]);
            Pose::new(rotation, translation).unwrap_or(Pose::IDENTITY)
        };
        let gap = GAPS[number % GAPS.len()] * diagonal(a);
        let mut t = radius_a + radius_b + 2.0 * gap;
        if gap == 0.0 {
            // The smaller sphere is then all within the larger, or both share a good part of their space.
            poses.push(at(0.5 * radius_a.max(radius_b)));
            continue;
        }
        for _ in 0..STEPS {
            let more = querier.distance(a, b, &at(t))?.distance - gap;
            if more <= CLOSE * gap || t < 0.0 {
                break;
            }
            t -= more;
        }
        poses.push(at(t));
    }
    Ok(poses)
}

/// The sphere around the first object, mesh units.
fn sphere(bvh: &Bvh) -> ([f64; 3], f64) {
    let Some(object) = bvh.objects().first() else { return ([0.0; 3], 0.0) };
    let record = &object.record;
    let centre = [0, 1, 2].map(|a| record.origin[a].get() + f64::from(record.sphere_centre[a].get()));
    (centre, record.sphere_radius.get().into())
}

/// The diagonal of the first object's box, mesh units.
pub(super) fn diagonal(bvh: &Bvh) -> f64 {
    let Some(object) = bvh.objects().first() else { return 0.0 };
    let (lo, hi) = (object.record.box_lo, object.record.box_hi);
    (0..3).map(|a| (f64::from(hi[a].get()) - f64::from(lo[a].get())).powi(2)).sum::<f64>().sqrt()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A linear congruential generator: quality is no matter here, reproducibility is.
struct Random(u64);

impl Random {
    /// From -1 to 1.
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [(); 3].map(|()| self.signed());
            let length = dot(v, v).sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|c| c / length);
            }
        }
    }

    fn rotation(&mut self) -> [[f64; 3]; 3] {
        let x = self.direction();
        loop {
            let other = self.direction();
            let along = dot(x, other);
            if along.abs() < 0.9 {
                let across = [0, 1, 2].map(|i| other[i] - along * x[i]);
                let length = dot(across, across).sqrt();
                let y = across.map(|c| c / length);
                let z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
                return [x, y, z];
            }
        }
    }
}
