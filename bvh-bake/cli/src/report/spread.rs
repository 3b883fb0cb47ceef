//! Medians and how far values spread around them.

use crate::query::record::quantile;

/// A median with its quartiles, and the ninth tenth of what it is the median of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub(super) median: f64,
    pub(super) quartiles: [f64; 2],
    pub(super) p90: f64,
}

impl Spread {
    /// Of the values themselves; `None` if there are none.
    pub(super) fn of(mut values: Vec<u64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        values.sort_unstable();
        let at = |fraction| quantile(&values, fraction) as f64;
        Some(Self { median: at(0.5), quartiles: [at(0.25), at(0.75)], p90: at(0.9) })
    }

    /// Of what each value is the sum of so many of.
    pub(super) fn over(self, count: usize) -> Self {
        let each = |value: f64| value / count as f64;
        Self { median: each(self.median), quartiles: self.quartiles.map(each), p90: each(self.p90) }
    }

    /// Of rounds: median and quartiles are those of the rounds' medians, and `p90` is the median of theirs. So
    /// the quartiles tell how far rounds differ, not how far poses do.
    pub(super) fn of_rounds(rounds: &[Vec<u64>]) -> Option<Self> {
        let each: Vec<Self> = rounds.iter().filter_map(|round| Self::of(round.clone())).collect();
        let medians = Self::of(each.iter().map(|round| round.median as u64).collect())?;
        let tails = Self::of(each.iter().map(|round| round.p90 as u64).collect())?;
        Some(Self { p90: tails.median, ..medians })
    }
}

/// The middle one of finite values, the upper of two; `None` if there are none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_and_poses_are_told_apart() {
        let poses: Vec<u64> = (0..100).collect();
        let of_poses = Spread::of(poses.clone()).unwrap();
        assert_eq!((of_poses.median, of_poses.quartiles, of_poses.p90), (50.0, [25.0, 75.0], 90.0));
        let rounds: Vec<Vec<u64>> =
            (0..4).map(|more| poses.iter().map(|time| time + more).collect()).collect();
        let of_rounds = Spread::of_rounds(&rounds).unwrap();
        assert_eq!((of_rounds.median, of_rounds.quartiles, of_rounds.p90), (52.0, [51.0, 53.0], 92.0));
        assert_eq!(Spread::of_rounds(&[]), None);
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(Vec::new())), (Some(2.0), None));
    }
}
