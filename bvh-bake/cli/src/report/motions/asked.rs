//! Asks about all motions in every way, in rounds in which the ways take turns.
//!
//! Ten thousand samples take thousands of times as long as a certified answer. Each way asks in the first round, and then
//! in as many more as fit into its share of time.

use super::method::{Asker, Method, Said};
use bvh_query::{Backend, Bvh, Motion, Querier, QueryError};
use cbvh_measure::turns::{order, take_turn};

/// For how long each way asks about the motions of a pair, in seconds, unless one round takes longer.
pub(super) const MAX_SECONDS: f64 = 10.0;

/// What is said in one way, and how long that takes.
#[derive(Debug, Clone, Default)]
pub(super) struct Asked {
    /// By motion.
    pub(super) said: Vec<Said>,
    /// Nanoseconds by round and motion.
    pub(super) rounds: Vec<Vec<u64>>,
}

impl Asked {
    /// Returns whether one more round like those before fits into the time.
    fn has_time(&self) -> bool {
        let spent: u64 = self.rounds.iter().flatten().sum();
        let count = self.rounds.len() as f64;
        count == 0.0 || spent as f64 * (1.0 + 1.0 / count) <= MAX_SECONDS * 1e9
    }

    fn add(&mut self, answers: Vec<(Said, u64)>) {
        if self.rounds.is_empty() {
            self.said = answers.iter().map(|&(said, _)| said).collect();
        }
        self.rounds.push(answers.into_iter().map(|(_, nanoseconds)| nanoseconds).collect());
    }
}

/// Asks in all ways, in up to so many rounds.
pub(super) fn ask(
    methods: &[Method],
    meshes: [&Bvh; 2],
    motions: &[Motion],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Asked>, QueryError> {
    let askers: Vec<Asker> = methods.iter().map(|&method| Asker::new(method)).collect();
    let mut queriers: Vec<Querier> = methods.iter().map(|_| Querier::with_backend(backend)).collect();
    let mut all = vec![Asked::default(); methods.len()];
    for round in 0..rounds {
        for number in order(round, methods.len()) {
            if !all[number].has_time() {
                continue;
            }
            let querier = &mut queriers[number];
            let answers = take_turn(motions, |motion| askers[number].ask(querier, meshes, motion))?;
            all[number].add(answers);
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_end_with_the_time() {
        let seconds = |seconds: &[u64]| {
            let rounds = seconds.iter().map(|second| vec![second * 1_000_000_000]).collect();
            Asked { said: Vec::new(), rounds }.has_time()
        };
        assert!(seconds(&[]) && seconds(&[5]) && seconds(&[2, 2, 2, 2]));
        assert!(!seconds(&[6]) && !seconds(&[5, 5]) && !seconds(&[100]));
    }
}
