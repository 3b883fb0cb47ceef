//! Counts what was searched: queries, widths of intervals, wrong answers.

use super::note;
use cbvh_testkit::exact::Decided;

/// The most wrong answers that are kept; the search ends when there are as many.
const MANY: usize = 20;

#[derive(Default)]
pub(crate) struct Tally {
    /// The number of poses, each of which is queried on all backends.
    pub(crate) poses: u64,
    /// The number of queries, on all backends together.
    pub(crate) queries: u64,
    /// The number of triangle pairs whose contact was compared, once per pose.
    pub(crate) pairs: u64,
    /// The number of these pairs that are in contact.
    pub(crate) contacts: u64,
    /// The number of poses next to which, within one unit in the last place, the answer changes.
    pub(crate) boundaries: u64,
    /// The ways in which the oracle decided contact.
    pub(crate) decided: Decided,
    /// The number of exact distances, each computed by both oracles.
    pub(crate) lengths: u64,
    /// The number of `within` queries inside the interval of `distance`, and how many of them the computed distance
    /// would have answered wrongly.
    pub(crate) within: [u64; 2],
    /// The widths of intervals, as fractions of the size of both meshes.
    pub(crate) widths: Vec<f64>,
    /// The wrong answers.
    pub(crate) wrong: Vec<String>,
    /// The number of intervals of `distance` that do not contain the true distance.
    pub(crate) missed: u64,
    /// The first of these intervals.
    pub(crate) first_missed: Option<String>,
}

impl Tally {
    pub(crate) fn wrong(&mut self, line: String) {
        note(&format!("WRONG {line}"));
        self.wrong.push(line);
    }

    /// Records an interval without the true distance. It is counted apart, so that the search for wrong answers goes
    /// on.
    pub(crate) fn missed(&mut self, line: String) {
        if self.missed < MANY as u64 {
            note(&format!("MISSED {line}"));
        }
        self.missed += 1;
        self.first_missed.get_or_insert(line);
    }

    /// Returns whether to give up.
    pub(crate) fn is_full(&self) -> bool {
        self.wrong.len() >= MANY
    }

    /// Prints all counts, and fails if anything was wrong.
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
             an interval: {inside}, {other} of them other than the computed distance says; {} intervals without the truth",
            self.missed
        ));
        assert!(poses + pairs > 0, "{name}: expected something to ask about, found nothing");
        assert!(self.wrong.is_empty(), "{} wrong answers, the first: {}", self.wrong.len(), self.wrong[0]);
        assert!(
            self.missed == 0,
            "{} intervals without the truth, the first: {:?}",
            self.missed,
            self.first_missed
        );
    }
}
