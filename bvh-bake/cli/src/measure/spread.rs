//! Medians, and how far values spread around them.

/// A median with its quartiles and the ninth decile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The median.
    pub median: f64,
    /// The first and the third quartile.
    pub quartiles: [f64; 2],
    /// The ninth decile.
    pub p90: f64,
}

impl Spread {
    /// The spread of the values; `None` if there are none.
    pub fn of(mut values: Vec<u64>) -> Option<Self> {
        if values.is_empty() {
            return None;
        }
        values.sort_unstable();
        let at = |fraction| quantile(&values, fraction) as f64;
        Some(Self { median: at(0.5), quartiles: [at(0.25), at(0.75)], p90: at(0.9) })
    }

    /// The spread of the values divided by `count`.
    pub fn over(self, count: usize) -> Self {
        let each = |value: f64| value / count as f64;
        Self { median: each(self.median), quartiles: self.quartiles.map(each), p90: each(self.p90) }
    }

    /// The spread over rounds: median and quartiles are those of the rounds' medians, and `p90` is the median of the
    /// rounds' ninth deciles. The quartiles therefore tell how far rounds differ, not how far poses do.
    pub fn of_rounds(rounds: &[Vec<u64>]) -> Option<Self> {
        let each: Vec<Self> = rounds.iter().filter_map(|round| Self::of(round.clone())).collect();
        let medians = Self::of(each.iter().map(|round| round.median as u64).collect())?;
        let tails = Self::of(each.iter().map(|round| round.p90 as u64).collect())?;
        Some(Self { p90: tails.median, ..medians })
    }
}

/// Returns the median over the rounds of their means; `None` if there are none.
pub fn mean_of_rounds(rounds: &[Vec<u64>]) -> Option<f64> {
    let filled = rounds.iter().filter(|round| !round.is_empty());
    median(filled.map(|round| round.iter().sum::<u64>() as f64 / round.len() as f64).collect())
}

/// Returns the sorted value at a fraction of the way from the least to the largest, by the rule of the protocol of `cbvh
/// query`; 0 if there are none.
pub fn quantile(sorted: &[u64], fraction: f64) -> u64 {
    let index = (fraction * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(0)
}

/// Returns the median of finite values, the upper one of two; `None` if there are none.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_follow_the_protocol() {
        let times: Vec<u64> = (0..10).collect();
        let found = [0.1, 0.5, 0.9, 1.0].map(|fraction| quantile(&times, fraction));
        assert_eq!(found, [1, 5, 9, 9]);
        assert_eq!(quantile(&[], 0.5), 0);
    }

    #[test]
    fn rounds_and_poses_are_told_apart() {
        let poses: Vec<u64> = (0..100).collect();
        let of_poses = Spread::of(poses.clone()).unwrap();
        assert_eq!((of_poses.median, of_poses.quartiles, of_poses.p90), (50.0, [25.0, 75.0], 90.0));
        let rounds: Vec<Vec<u64>> =
            (0..4).map(|more| poses.iter().map(|time| time + more).collect()).collect();
        let of_rounds = Spread::of_rounds(&rounds).unwrap();
        assert_eq!((of_rounds.median, of_rounds.quartiles, of_rounds.p90), (52.0, [51.0, 53.0], 92.0));
        assert_eq!(mean_of_rounds(&rounds), Some(51.5));
        assert_eq!((Spread::of_rounds(&[]), mean_of_rounds(&[Vec::new()])), (None, None));
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(Vec::new())), (Some(2.0), None));
    }
}
