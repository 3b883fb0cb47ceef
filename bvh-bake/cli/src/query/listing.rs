//! The answers about a pose file for a person: one line per pose, then the timing.

use super::arguments::Mode;
use super::question::{Answer, Question, Run};
use super::record::Record;
use crate::console::plural;
use cbvh_measure::spread::quantile;
use std::fmt::Write;

/// Returns one line per answer, and a last line with the counts and times.
pub(super) fn listing(record: &Record, question: &Question, run: &Run) -> String {
    let mut text = String::new();
    for (number, (answer, _)) in (1..).zip(&run.answers) {
        // Writing to text in memory cannot fail.
        let _ = writeln!(text, "pose {number}: {}", in_words(answer, question));
    }
    let (answered, positive) = (run.answers.len(), record.positives());
    let what = if question.mode == Mode::Within { "within the distance" } else { "touching" };
    let mut times: Vec<u64> = run.answers.iter().map(|&(_, nanoseconds)| nanoseconds).collect();
    times.sort_unstable();
    let [median, p90, slowest] = [0.5, 0.9, 1.0].map(|fraction| time(quantile(&times, fraction)));
    let _ = writeln!(
        text,
        "{}: answered {answered} of {} {}, {positive} {what}; per query: median {median}, 90 % below {p90}, slowest \
         {slowest} ({}, {} {})",
        record.poses(),
        run.requested,
        plural(run.requested as u64, "pose"),
        record.isa(),
        run.jobs,
        plural(run.jobs as u64, "thread"),
    );
    text
}

/// Returns an answer in words, with its unit.
fn in_words(answer: &Answer, question: &Question) -> String {
    match *answer {
        Answer::Flag(flag) => match (question.mode, flag) {
            (Mode::Within, true) => format!("at most {:?} mesh units apart", question.within),
            (Mode::Within, false) => format!("more than {:?} mesh units apart", question.within),
            (_, true) => "touching".to_owned(),
            (_, false) => "not touching".to_owned(),
        },
        Answer::Count(count) => format!("{count} {} of triangles in contact", plural(count, "pair")),
        Answer::Length(0.0) => "0 mesh units apart, touching".to_owned(),
        // With an allowed error, the least distance may be shorter.
        Answer::Length(length) if !question.is_exact() => format!("at most {length:?} mesh units apart"),
        Answer::Length(length) => format!("{length:?} mesh units apart"),
    }
}

/// Returns nanoseconds in a unit that gives few digits.
pub(crate) fn time(nanoseconds: u64) -> String {
    match nanoseconds as f64 {
        ns if ns < 1e3 => format!("{ns} ns"),
        ns if ns < 1e6 => format!("{:.1} µs", ns / 1e3),
        ns if ns < 1e9 => format!("{:.1} ms", ns / 1e6),
        ns => format!("{:.1} s", ns / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_query::DistanceOptions;

    #[test]
    fn answers_have_units() {
        let question = |mode| Question { mode, within: 0.5, errors: DistanceOptions::new() };
        let rough = Question { errors: DistanceOptions::new().rel_err(0.1), ..question(Mode::Distance) };
        for (answer, question, words) in [
            (Answer::Flag(true), question(Mode::Collide), "touching"),
            (Answer::Flag(false), question(Mode::Collide), "not touching"),
            (Answer::Flag(true), question(Mode::Within), "at most 0.5 mesh units apart"),
            (Answer::Flag(false), question(Mode::Within), "more than 0.5 mesh units apart"),
            (Answer::Count(1), question(Mode::Contacts), "1 pair of triangles in contact"),
            (Answer::Count(0), question(Mode::Contacts), "0 pairs of triangles in contact"),
            (Answer::Length(0.0), question(Mode::Distance), "0 mesh units apart, touching"),
            (Answer::Length(0.25), question(Mode::Distance), "0.25 mesh units apart"),
            (Answer::Length(0.25), rough, "at most 0.25 mesh units apart"),
        ] {
            assert_eq!(in_words(&answer, &question), words);
        }
        assert_eq!([999, 1_500, 2_000_000, 3_000_000_000].map(time), ["999 ns", "1.5 µs", "2.0 ms", "3.0 s"]);
    }
}
