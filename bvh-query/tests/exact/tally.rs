//! What was searched: counts, widths of intervals, wrong answers.

use super::decide::Decided;
use crate::common::note;

/// Wrong answers kept; the search ends with the last.
const MANY: usize = 20;

#[derive(Default)]
pub(crate) struct Tally {
    /// Poses asked about, each on all backends.
    pub(crate) poses: u64,
    /// Questions to the library, all backends together.
    pub(crate) queries: u64,
    /// Triangle pairs whose contact was compared, once a pose.
    pub(crate) pairs: u64,
    /// Of these in contact.
    pub(crate) contacts: u64,
    /// Poses next to which, within a unit in the last place, the answer changes.
    pub(crate) boundaries: u64,
    /// How the oracle decided contact.
    pub(crate) decided: Decided,
    /// Exact distances, each by both oracles.
    pub(crate) lengths: u64,
    /// `within` inside the interval of `distance`, and of these not as the computed distance has it.
    pub(crate) within: [u64; 2],
    /// Widths of intervals as fractions of the size of both meshes.
    pub(crate) widths: Vec<f64>,
    /// Answers that are wrong.
    pub(crate) wrong: Vec<String>,
    /// Intervals of `distance` that the true distance is not in.
    pub(crate) missed: u64,
    /// The first of these.
    first_missed: Option<String>,
}

impl Tally {
    pub(crate) fn wrong(&mut self, line: String) {
        note(&format!("WRONG {line}"));
        self.wrong.push(line);
    }

    /// An interval without the truth. Apart from wrong answers, so that these are still looked for.
    pub(crate) fn missed(&mut self, line: String) {
        if self.missed < MANY as u64 {
            note(&format!("MISSED {line}"));
        }
        self.missed += 1;
        self.first_missed.get_or_insert(line);
    }

    /// Whether to give up.
    pub(crate) fn is_full(&self) -> bool {
        self.wrong.len() >= MANY
    }

    /// Prints all counts; fails if anything was wrong.
    #[track_caller]
    pub(crate) fn report(mut self, name: &str) {
        self.widths.sort_by(f64::total_cmp);
        let count = self.widths.len();
        let (median, most) = match self.widths.last() {
            Some(&most) => (self.widths[count / 2], most),
            None => (0.0, 0.0),
        };
        let Self { poses, queries, pairs, contacts, boundaries, lengths, .. } = self;
        let Decided { by_boxes, by_balls, by_integers } = self.decided;
        let [inside, other] = self.within;
        note(&format!(
            "{name}: {poses} poses, {boundaries} of them next to a change, {queries} queries; {pairs} triangle \
             pairs, {contacts} in contact; oracle: {by_boxes} by boxes, {by_balls} by balls, {by_integers} by integers, {lengths} exact \
             distances; {count} intervals, width / size: median {median:.2e}, largest {most:.2e}; within inside \
             an interval: {inside}, {other} other than the computed distance has it; {} intervals without the truth",
            self.missed
        ));
        assert!(self.wrong.is_empty(), "{} wrong answers, the first: {}", self.wrong.len(), self.wrong[0]);
        assert!(
            self.missed == 0,
            "{} intervals without the truth, the first: {:?}",
            self.missed,
            self.first_missed
        );
    }
}
