//! The answer to "which layout?", in a few sentences per pair.

use super::row::Row;
use super::{PairRecord, Report};
use cbvh_measure::rounds::Question;
use cbvh_measure::table::micro;

/// The answers of one layout of a pair to the two exact questions.
#[derive(Clone, Copy)]
pub(super) struct Candidate<'a> {
    pub(super) collide: &'a Row,
    pub(super) distance: &'a Row,
}

impl Candidate<'_> {
    /// The geometric mean of the median times for contact and distance, nanoseconds. By this mean layouts are ranked.
    pub(super) fn mean_time(&self) -> f64 {
        let time = |row: &Row| row.nanoseconds().unwrap_or(f64::INFINITY);
        (time(self.collide) * time(self.distance)).sqrt()
    }

    pub(super) fn name(&self) -> String {
        self.collide.layout.name()
    }

    fn bytes(&self) -> f64 {
        self.collide.size.file_bytes
    }
}

/// Returns the layouts of a pair, the fastest first: those without loss, or those with quantised triangles.
pub(super) fn ranked<'a>(report: &'a Report, pair: &'a str, is_lossy: bool) -> Vec<Candidate<'a>> {
    let rows = || report.of(pair).filter(|row| row.layout.is_lossy() == is_lossy && row.is_exact());
    let distance = |of: &Row| rows().find(|row| row.layout == of.layout && row.question != Question::Collide);
    let collide = rows().filter(|row| row.question == Question::Collide);
    let mut all: Vec<Candidate<'_>> =
        collide.filter_map(|row| Some(Candidate { collide: row, distance: distance(row)? })).collect();
    all.sort_by(|a, b| a.mean_time().total_cmp(&b.mean_time()));
    all
}

/// Returns the sentences, the most important one first.
pub(super) fn sentences(report: &Report, pair: &PairRecord) -> Vec<String> {
    let all = ranked(report, &pair.name, false);
    let least = |of: fn(&Candidate<'_>) -> f64| all.iter().min_by(|a, b| of(a).total_cmp(&of(b)));
    let (Some(fastest), Some(smallest)) = (all.first(), least(|candidate| candidate.bytes())) else {
        return Vec::new();
    };
    let Some(traded) = least(|candidate| candidate.mean_time() * candidate.bytes()) else {
        return Vec::new();
    };
    let shown = |candidate: &Candidate<'_>| {
        let [collide, distance] =
            [candidate.collide, candidate.distance].map(|row| micro(row.nanoseconds().unwrap_or_default()));
        format!(
            "{}: {collide} \u{b5}s for contact, {distance} \u{b5}s for distance, {:.1} bytes per triangle",
            candidate.name(),
            candidate.bytes()
        )
    };
    let slower = |candidate: &Candidate<'_>| candidate.mean_time() / fastest.mean_time();
    let mut sentences = vec![
        format!("The fastest layout is {}.", shown(fastest)),
        format!("The smallest one is {}; it takes {:.2} times as long.", shown(smallest), slower(smallest)),
    ];
    if traded.name() != fastest.name() && traded.name() != smallest.name() {
        let slower = slower(traded);
        sentences.push(format!(
            "The least product of time and bytes has {}; it takes {slower:.2} times as long.",
            shown(traded)
        ));
    }
    let of = |layout: &str| all.iter().find(|candidate| candidate.name() == layout);
    let [a, b] = [&pair.a.chosen_layout, &pair.b.chosen_layout];
    sentences.push(match of(a).filter(|_| a == b) {
        Some(chosen) if chosen.name() == fastest.name() => {
            "Without options cbvh bake chooses the fastest layout for both meshes.".to_owned()
        }
        Some(chosen) => format!(
            "Without options cbvh bake chooses {}, which takes {:.2} times as long as the fastest.",
            chosen.name(),
            slower(chosen)
        ),
        None => format!("Without options cbvh bake chooses {a} for A and {b} for B."),
    });
    sentences
}
