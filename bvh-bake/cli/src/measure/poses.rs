//! Makes poses for pairs without pose files: some overlap, others have given gaps.
//!
//! B is turned at random and moved towards A along a random direction. A step changes the distance by at most its own
//! length, so a step as long as the distance exceeds the gap never goes too far. The random numbers have a constant
//! seed and distances have the same bits everywhere, so the poses are the same everywhere, too.

use bvh_query::{Bvh, Pose, Querier, QueryError};

/// The gaps in turn, as fractions of A's diagonal; 0 stands for overlap.
pub const GAPS: [f64; 5] = [0.0, 1e-6, 0.005, 0.01, 0.05];
/// By which fraction of the gap the distance of a pose may exceed it.
pub const GAP_TOLERANCE: f64 = 0.01;
/// The number of steps after which a pose is taken as it is.
const MAX_STEPS: usize = 100;

/// Returns `count` poses with the gaps of [`GAPS`] in turn.
///
/// # Errors
/// Returns the first error of a query.
pub fn mixed(querier: &mut Querier, a: &Bvh, b: &Bvh, count: usize) -> Result<Vec<Pose>, QueryError> {
    let mut random = Random::default();
    let mut poses = Vec::new();
    for number in 0..count {
        let approach = Approach::new(a, b, random.rotation(), random.direction());
        poses.push(match GAPS[number % GAPS.len()] {
            0.0 => approach.overlapping(),
            gap => approach.at(approach.reach(querier, gap)?),
        });
    }
    Ok(poses)
}

/// A line along which B, turned, approaches A from outside.
#[derive(Debug)]
pub struct Approach<'a> {
    a: &'a Bvh,
    b: &'a Bvh,
    rotation: [[f64; 3]; 3],
    /// From A to B, of length 1.
    away: [f64; 3],
    centre_a: [f64; 3],
    /// The centre of B, turned.
    turned: [f64; 3],
    radii: [f64; 2],
}

impl<'a> Approach<'a> {
    /// The line from A in the direction `away`, which has length 1, for B turned by `rotation`.
    pub fn new(a: &'a Bvh, b: &'a Bvh, rotation: [[f64; 3]; 3], away: [f64; 3]) -> Self {
        let ((centre_a, radius_a), (centre_b, radius_b)) = (sphere(a), sphere(b));
        let turned = rotation.map(|row| dot(row, centre_b));
        Self { a, b, rotation, away, centre_a, turned, radii: [radius_a, radius_b] }
    }

    /// Returns the pose in which the centres are `t` apart, mesh units.
    pub fn at(&self, t: f64) -> Pose {
        let centre = self.centre_of_b(t);
        let translation = [0, 1, 2].map(|i| centre[i] - self.turned[i]);
        Pose::new(self.rotation, translation).unwrap_or(Pose::IDENTITY)
    }

    /// Returns the direction from A to B, of length 1.
    pub fn away(&self) -> [f64; 3] {
        self.away
    }

    /// Returns the centre of B in the frame of A, when the centres are `t` apart, mesh units.
    pub fn centre_of_b(&self, t: f64) -> [f64; 3] {
        [0, 1, 2].map(|i| self.centre_a[i] + t * self.away[i])
    }

    /// Returns a pose in which the smaller sphere lies inside the larger one, or both share much of their space.
    fn overlapping(&self) -> Pose {
        self.at(0.5 * self.radii[0].max(self.radii[1]))
    }

    /// Returns how far apart the centres are, in mesh units, when the gap is this fraction of A's diagonal.
    ///
    /// # Errors
    /// Returns the first error of a query.
    pub fn reach(&self, querier: &mut Querier, gap: f64) -> Result<f64, QueryError> {
        let gap = gap * diagonal(self.a);
        let mut t = self.radii[0] + self.radii[1] + 2.0 * gap;
        for _ in 0..MAX_STEPS {
            let more = querier.distance(self.a, self.b, &self.at(t))?.distance - gap;
            if more <= GAP_TOLERANCE * gap || t < 0.0 {
                break;
            }
            t -= more;
        }
        Ok(t)
    }
}

/// Returns centre and radius of the sphere around the first object, mesh units.
fn sphere(bvh: &Bvh) -> ([f64; 3], f64) {
    let Some(object) = bvh.objects().first() else { return ([0.0; 3], 0.0) };
    let record = object.record();
    let centre = [0, 1, 2].map(|a| record.origin[a].get() + f64::from(record.sphere_centre[a].get()));
    (centre, record.sphere_radius.get().into())
}

/// Returns the diagonal of the first object's box, mesh units.
pub fn diagonal(bvh: &Bvh) -> f64 {
    let Some(object) = bvh.objects().first() else { return 0.0 };
    let (lo, hi) = (object.record().box_lo, object.record().box_hi);
    (0..3).map(|a| (f64::from(hi[a].get()) - f64::from(lo[a].get())).powi(2)).sum::<f64>().sqrt()
}

/// Returns the scalar product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A linear congruential generator: what matters here is that the numbers can be reproduced, not their quality.
#[derive(Debug)]
pub struct Random(u64);

impl Default for Random {
    /// A generator with a constant seed.
    fn default() -> Self {
        Self(0x9e37_79b9_7f4a_7c15)
    }
}

impl Random {
    /// Returns a number from -1 to 1.
    fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    /// Returns a vector of length 1.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let v = [(); 3].map(|()| self.signed());
            let length = dot(v, v).sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|c| c / length);
            }
        }
    }

    /// Returns a rotation.
    pub fn rotation(&mut self) -> [[f64; 3]; 3] {
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
