//! Motions of all joints: a polynomial of time for each joint value, and bounds of them.

use crate::error::RobotError;
use crate::model::{Kind, Model, Value, quaternion_length};

/// A motion of all joints: a polynomial of time, from 0 to 1, for each joint value.
///
/// ```
/// use cbvh_robot::Edge;
///
/// let straight = Edge::straight(&[0.0, 1.0], &[2.0, 1.0])?;
/// assert_eq!(straight.ends(), [vec![0.0, 1.0], vec![2.0, 1.0]]);
/// // 3 t^2 - 2 t^3 starts and ends at rest.
/// let smooth = Edge::polynomials(vec![vec![0.0, 0.0, 3.0, -2.0], vec![1.0]]);
/// assert_eq!(smooth.ends(), [vec![0.0, 1.0], vec![1.0, 1.0]]);
/// # Ok::<(), cbvh_robot::RobotError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Edge {
    /// The coefficients of each, the constant first.
    pub(crate) coefficients: Vec<Vec<f64>>,
}

impl Edge {
    /// Goes straight from one configuration to another, each joint at its constant rate. A floating joint turns about one axis, the
    /// shorter way. Other joints turn by the difference of their values, however long that way is: see
    /// [`Robot::nearest_turns`](crate::Robot::nearest_turns) for the short one.
    ///
    /// # Errors
    /// [`RobotError::Count`] if one has more values than the other.
    pub fn straight(from: &[f64], to: &[f64]) -> Result<Self, RobotError> {
        if from.len() != to.len() {
            return Err(RobotError::Count { expected: from.len(), found: to.len() });
        }
        let coefficients = from.iter().zip(to).map(|(from, to)| vec![*from, to - from]);
        Ok(Self { coefficients: coefficients.collect() })
    }

    /// Follows polynomials of time, from 0 to 1: the coefficients of each joint value, the constant first. Splines and trapezoidal
    /// profiles are some of these, one after the other.
    pub fn polynomials(coefficients: Vec<Vec<f64>>) -> Self {
        Self { coefficients }
    }

    /// Returns the joint values at time 0 and at time 1.
    pub fn ends(&self) -> [Vec<f64>; 2] {
        [0.0, 1.0].map(|t| self.coefficients.iter().map(|of| value(of, t)).collect())
    }

    /// Returns bounds of a joint value on the whole way.
    fn bounds(&self, number: usize) -> Bounds {
        let of = &self.coefficients[number];
        if let [from, way] = of[..] {
            // What the general rule gives.
            let sum = from.abs() + way.abs();
            let most = from.abs().max((from + way).abs()) + sum * ROUNDING_OF_TERMS;
            return Bounds {
                way: most,
                rate: way.abs() + way.abs() * ROUNDING_OF_TERMS,
                acceleration: 0.0,
                terms: 2.0 * sum,
            };
        }
        let first = derivative(of);
        let terms = of.len() as f64 * of.iter().map(|coefficient| coefficient.abs()).sum::<f64>();
        Bounds { way: most(of), rate: most(&first), acceleration: most(&derivative(&first)), terms }
    }

    /// Returns bounds of a joint that turns or slides by a multiple of a value.
    fn bounds_of(&self, by: &Value) -> Bounds {
        let of = self.bounds(by.number);
        let factor = by.factor.abs();
        Bounds {
            way: factor * of.way + by.offset.abs(),
            rate: factor * of.rate,
            acceleration: factor * of.acceleration,
            terms: factor * of.terms + by.offset.abs(),
        }
    }
}

/// Bounds of the magnitude of a value and of its derivatives.
#[derive(Clone, Copy, Default)]
pub(crate) struct Bounds {
    pub(crate) way: f64,
    pub(crate) rate: f64,
    pub(crate) acceleration: f64,
    /// The sum of the magnitudes of the terms that are added up, times their number: what roundings are proportional to.
    pub(crate) terms: f64,
}

impl Bounds {
    /// Returns bounds of the length of a vector of values.
    fn long<const N: usize>(of: [Self; N]) -> Self {
        let norm = |part: fn(&Self) -> f64| of.iter().map(|of| part(of).powi(2)).sum::<f64>().sqrt();
        Self {
            way: norm(|of| of.way),
            rate: norm(|of| of.rate),
            acceleration: norm(|of| of.acceleration),
            terms: norm(|of| of.terms),
        }
    }
}

/// Returns the coefficients of a derivative.
fn derivative(of: &[f64]) -> Vec<f64> {
    of.iter().enumerate().skip(1).map(|(power, coefficient)| power as f64 * coefficient).collect()
}

/// More than the relative error of a sum of terms.
const ROUNDING_OF_TERMS: f64 = 1.0 / (1u64 << 40) as f64;
/// The most coefficients for which Bernstein's are computed. They take the cube of this number of steps, and their binomials are
/// exact up to here.
const MOST_COEFFICIENTS: usize = 32;

/// Returns a bound of the magnitude of a polynomial on [0, 1]: the largest of its Bernstein coefficients, of which its values are
/// averages, or the sum of its own coefficients if there are many.
fn most(of: &[f64]) -> f64 {
    let sum: f64 = of.iter().map(|coefficient| coefficient.abs()).sum();
    if of.len() > MOST_COEFFICIENTS {
        return sum * (1.0 + ROUNDING_OF_TERMS);
    }
    let degree = of.len().saturating_sub(1);
    let binomial =
        |n: usize, k: usize| (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64);
    let bernstein = |i: usize| -> f64 {
        (0..=i.min(degree)).map(|k| binomial(i, k) / binomial(degree, k) * of.get(k).unwrap_or(&0.0)).sum()
    };
    // Terms may cancel, and what is left of them is off by a part of their sum.
    (0..=degree).map(|i| bernstein(i).abs()).fold(0.0, f64::max) + sum * (ROUNDING_OF_TERMS)
}

/// How the quaternion of a floating joint turns: about one axis, at a constant rate, the shorter way.
pub(crate) struct Turning {
    from: [f64; 4],
    to: [f64; 4],
    /// The whole angle of the turn.
    angle: f64,
}

impl Turning {
    pub(crate) fn of(edge: &Edge, first: usize) -> Self {
        let unit = |t: f64| {
            let numbers: Vec<f64> =
                edge.coefficients[first..first + 7].iter().map(|of| value(of, t)).collect();
            let long = quaternion_length(&numbers, 0);
            [3, 4, 5, 6].map(|k| numbers[k] / long)
        };
        let (from, to) = (unit(0.0), unit(1.0));
        let cosine: f64 = from.iter().zip(&to).map(|(a, b)| a * b).sum();
        let to = if cosine < 0.0 { to.map(|x| -x) } else { to };
        // From the chord, which is accurate for small angles as well.
        let chord = |to: &[f64; 4]| from.iter().zip(to).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        Self { from, to, angle: 4.0 * libm::asin((chord(&to) / 2.0).min(1.0)) }
    }

    /// Returns the quaternion at a time.
    pub(crate) fn at(&self, t: f64) -> [f64; 4] {
        let half = self.angle / 2.0;
        if half < 1e-9 {
            // Linear to within 1e-19, and the length is divided out.
            return [0, 1, 2, 3].map(|k| (1.0 - t) * self.from[k] + t * self.to[k]);
        }
        let [a, b] = [(1.0 - t) * half, t * half].map(libm::sin);
        let whole = libm::sin(half);
        [0, 1, 2, 3].map(|k| (a * self.from[k] + b * self.to[k]) / whole)
    }
}

/// Returns the value of a polynomial.
pub(crate) fn value(of: &[f64], t: f64) -> f64 {
    match of {
        // Exactly what was given, at the end as well.
        &[from, way] if t == 1.0 => from + way,
        of => of.iter().rev().fold(0.0, |sum, coefficient| sum * t + coefficient),
    }
}

/// Returns the joint values at a time, with quaternions that turn at a constant rate.
pub(crate) fn at(model: &Model, edge: &Edge, t: f64) -> Vec<f64> {
    let mut numbers: Vec<f64> = edge.coefficients.iter().map(|of| value(of, t)).collect();
    for joint in &model.joints {
        if let Kind::Floating(first) = joint.kind {
            numbers[first + 3..first + 7].copy_from_slice(&Turning::of(edge, first).at(t));
        }
    }
    numbers
}

/// Returns bounds of how each joint turns and of how it slides.
pub(crate) fn bounds(model: &Model, edge: &Edge) -> Vec<[Bounds; 2]> {
    model.joints.iter().map(|joint| parts_of(&joint.kind, edge)).collect()
}

fn parts_of(kind: &Kind, edge: &Edge) -> [Bounds; 2] {
    let still = Bounds::default();
    match kind {
        Kind::Turn { by, .. } => [edge.bounds_of(by), still],
        Kind::Slide { by, .. } => [still, edge.bounds_of(by)],
        &Kind::Planar(first) => {
            [edge.bounds(first + 2), Bounds::long([0, 1].map(|k| edge.bounds(first + k)))]
        }
        &Kind::Floating(first) => {
            let angle = Turning::of(edge, first).angle;
            let turn = Bounds { way: angle, rate: angle, acceleration: 0.0, terms: 4.0 };
            [turn, Bounds::long([0, 1, 2].map(|k| edge.bounds(first + k)))]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    #[test]
    fn straight_motions_have_the_bounds_of_polynomials() {
        let random = &mut Random::new(38);
        for _ in 0..500 {
            let of = vec![random.signed(), random.signed()];
            let Bounds { way, rate, acceleration, terms } = Edge::polynomials(vec![of.clone()]).bounds(0);
            let first = derivative(&of);
            let sum: f64 = of.iter().map(|x| x.abs()).sum();
            assert_eq!(
                [way, rate, acceleration, terms],
                [most(&of), most(&first), most(&derivative(&first)), 2.0 * sum]
            );
        }
    }

    #[test]
    fn bounds_of_polynomials_hold() {
        let random = &mut Random::new(37);
        for _ in 0..500 {
            let of: Vec<f64> = (0..1 + random.below(6)).map(|_| random.signed()).collect();
            let bound = most(&of) * (1.0 + 1e-12);
            let largest = (0..=100).map(|k| value(&of, f64::from(k) / 100.0).abs()).fold(0.0, f64::max);
            assert!(largest <= bound && bound <= of.iter().map(|x| x.abs()).sum::<f64>() * (1.0 + 1e-9));
        }
    }
}
