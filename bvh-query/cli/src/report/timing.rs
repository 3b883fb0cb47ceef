//! Times single queries in rounds: subjects take turns on one thread, and medians are taken over the rounds.
//!
//! A turn is a few untimed questions and then all items in their order. Caches are warm: they hold what the previous
//! questions left there. Within a round all subjects take their turn. The next round starts with another subject, so
//! that drift (clock, temperature, neighbours) affects all of them alike.

use crate::asking::quantile;
use crate::console::{Record, record};
use bvh_query::QueryError;
use std::time::Instant;

/// Untimed questions before each turn.
const WARM_UP_QUESTIONS: usize = 3;
/// The number of subjects by which the start moves on from round to round. It shares no factor with usual numbers of
/// subjects, so that the order of turns differs from round to round.
const STRIDE: usize = 17;

/// Returns the order in which so many subjects take turns in a round.
pub(super) fn order(round: usize, subjects: usize) -> impl Iterator<Item = usize> {
    (0..subjects).map(move |turn| (turn + STRIDE * round) % subjects)
}

/// Asks about all items, and returns the answers and their nanoseconds.
#[inline]
pub(super) fn take_turn<T, A>(
    items: &[T],
    mut ask: impl FnMut(&T) -> Result<A, QueryError>,
) -> Result<(Vec<A>, Vec<u64>), QueryError> {
    for item in items.iter().rev().take(WARM_UP_QUESTIONS) {
        ask(item)?;
    }
    let timed = items.iter().map(|item| {
        let before = Instant::now();
        let answer = ask(item)?;
        Ok((answer, before.elapsed().as_nanos() as u64))
    });
    timed.collect()
}

/// Returns the spread of nanoseconds over rounds: median and quartiles are those of the rounds' medians, and `ns_p90` is the
/// median of the rounds' ninth deciles. The quartiles therefore tell how far rounds differ, not how far poses do.
pub(super) fn times(rounds: &[Vec<u64>]) -> Record {
    let of_rounds = |share| {
        let each = rounds.iter().map(|round| {
            let mut sorted = round.clone();
            sorted.sort_unstable();
            quantile(&sorted, share)
        });
        let mut each: Vec<u64> = each.collect();
        each.sort_unstable();
        each
    };
    let (medians, tails) = (of_rounds(0.5), of_rounds(0.9));
    record! {
        ns_median: quantile(&medians, 0.5),
        ns_q1: quantile(&medians, 0.25),
        ns_q3: quantile(&medians, 0.75),
        ns_p90: quantile(&tails, 0.5),
    }
}

/// Returns the median of finite values, the upper one of two; `None` if there are none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_and_poses_are_told_apart() {
        let rounds: Vec<Vec<u64>> = (0..4).map(|more| (more..100 + more).rev().collect()).collect();
        let found = ["ns_median", "ns_q1", "ns_q3", "ns_p90"].map(|name| times(&rounds).number(name));
        assert_eq!(found, [52.0, 51.0, 53.0, 92.0].map(Some));
        assert_eq!((median(vec![3.0, 1.0, 2.0]), median(Vec::new())), (Some(2.0), None));
    }
}
