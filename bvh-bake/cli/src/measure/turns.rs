//! Times questions one by one, in turns whose order differs from round to round.
//!
//! A turn is a few untimed questions and then all items in their order. Caches hold what the previous questions left there,
//! which is called warm. Within a round all subjects take their turn, and the next round starts with another subject, so
//! that drift (clock, temperature, neighbours) affects all of them alike.

use bvh_query::QueryError;
use std::time::Instant;

/// Untimed questions before each turn.
const WARM_UP_QUESTIONS: usize = 3;
/// The number of subjects by which the start moves on from round to round. It shares no factor with usual numbers of
/// subjects, so that the order of turns differs from round to round.
const STRIDE: usize = 17;

/// Returns the order in which so many subjects take turns in a round.
pub fn order(round: usize, subjects: usize) -> impl Iterator<Item = usize> {
    (0..subjects).map(move |turn| (turn + STRIDE * round) % subjects)
}

/// Asks about all items, and returns the answers with their nanoseconds.
///
/// # Errors
/// Returns the first error of a question.
#[inline]
pub fn take_turn<T, A>(
    items: &[T],
    mut ask: impl FnMut(&T) -> Result<A, QueryError>,
) -> Result<Vec<(A, u64)>, QueryError> {
    for item in items.iter().rev().take(WARM_UP_QUESTIONS) {
        ask(item)?;
    }
    let mut answers = Vec::with_capacity(items.len());
    for item in items {
        let before = Instant::now();
        let answer = ask(item)?;
        let nanoseconds = before.elapsed().as_nanos() as u64;
        answers.push((answer, nanoseconds));
    }
    Ok(answers)
}
