//! The ways to ask about a motion: samples, as programs without certified answers take them, and the certified answers.

use bvh_query::{Bvh, Motion, MotionAnswer, MotionOptions, Path, Querier, QueryError};

/// How many poses samplers ask about, with both ends.
pub(super) const SAMPLES: [u32; 7] = [10, 30, 100, 300, 1_000, 3_000, 10_000];

/// A way to ask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// Asks about equally spaced poses in the order of time, until one touches.
    Ordered(u32),
    /// Asks about the same poses, but first about some that are spread over the whole way.
    Spread(u32),
    /// [`Querier::motion`], which finds the first hit.
    Motion,
    /// [`Querier::is_free`], which looks for any hit.
    IsFree,
}

/// What is said about a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Said {
    /// No contact.
    Free,
    /// A contact at this time.
    Contact(f64),
    /// Not certified free, without a time.
    NotFree,
    /// Neither free nor a contact.
    Undecided,
}

impl Method {
    /// Returns all ways.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let samplers = [Self::Ordered as fn(u32) -> Self, Self::Spread];
        let sampled = samplers.into_iter().flat_map(|sampler| SAMPLES.map(sampler));
        sampled.chain([Self::Motion, Self::IsFree])
    }

    /// The name in tables.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ordered(_) => "ordered samples",
            Self::Spread(_) => "spread samples",
            Self::Motion => "motion",
            Self::IsFree => "is_free",
        }
    }

    /// Returns the number of samples.
    pub(super) fn samples(self) -> Option<u32> {
        match self {
            Self::Ordered(samples) | Self::Spread(samples) => Some(samples),
            Self::Motion | Self::IsFree => None,
        }
    }

    /// True if the contact that it finds is the first one.
    pub(super) fn finds_the_first(self) -> bool {
        matches!(self, Self::Ordered(_) | Self::Motion)
    }

    /// Returns the times of its samples, in the order in which it asks about them.
    fn times(self) -> Vec<f64> {
        let order: Vec<u32> = match self {
            Self::Ordered(samples) => (0..samples).collect(),
            Self::Spread(samples) => spread(samples),
            Self::Motion | Self::IsFree => Vec::new(),
        };
        let last = order.len().saturating_sub(1) as f64;
        order.into_iter().map(|sample| f64::from(sample) / last).collect()
    }
}

/// Returns the numbers below `count` in an order that is spread evenly from the start: both ends, and then those between in
/// van der Corput's order, which is that of their reversed bits.
fn spread(count: u32) -> Vec<u32> {
    let Some(last) = count.checked_sub(1).filter(|&last| last > 0) else { return (0..count).collect() };
    let bits = u32::BITS - last.leading_zeros();
    let reversed = (0..1u32 << bits).map(|number| number.reverse_bits() >> (u32::BITS - bits));
    [0, last].into_iter().chain(reversed.filter(|number| (1..last).contains(number))).collect()
}

/// A way to ask that is ready to be timed.
pub(super) struct Asker {
    method: Method,
    times: Vec<f64>,
}

impl Asker {
    pub(super) fn new(method: Method) -> Self {
        Self { method, times: method.times() }
    }

    /// Asks about a motion. To make the poses of samples is part of the work.
    pub(super) fn ask(
        &self,
        querier: &mut Querier,
        [a, b]: [&Bvh; 2],
        motion: &Motion,
    ) -> Result<Said, QueryError> {
        let options = MotionOptions::new();
        match self.method {
            Method::Motion => Ok(match querier.motion(a, b, motion, &options)? {
                MotionAnswer::Free => Said::Free,
                MotionAnswer::Hit { touching_at, .. } => Said::Contact(touching_at),
                MotionAnswer::Near { .. } => Said::Undecided,
            }),
            Method::IsFree => {
                Ok(if querier.is_free(a, b, motion, &options)? { Said::Free } else { Said::NotFree })
            }
            Method::Ordered(_) | Method::Spread(_) => {
                for &time in &self.times {
                    if querier.collide(a, b, &motion.pose(time))? {
                        return Ok(Said::Contact(time));
                    }
                }
                Ok(Said::Free)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_the_same_in_either_order() {
        for samples in SAMPLES {
            let ordered = Method::Ordered(samples).times();
            assert_eq!((ordered.len(), ordered[0], *ordered.last().unwrap()), (samples as usize, 0.0, 1.0));
            assert!(ordered.windows(2).all(|pair| pair[0] < pair[1]));
            let mut spread = Method::Spread(samples).times();
            spread.sort_by(f64::total_cmp);
            assert_eq!(spread, ordered);
        }
    }

    #[test]
    fn spread_samples_begin_with_halves_and_quarters() {
        assert_eq!(spread(9), [0, 8, 4, 2, 6, 1, 5, 3, 7]);
        assert_eq!(spread(10), [0, 9, 8, 4, 2, 6, 1, 5, 3, 7]);
        assert_eq!((spread(2), spread(1), spread(0)), (vec![0, 1], vec![0], vec![]));
    }
}
