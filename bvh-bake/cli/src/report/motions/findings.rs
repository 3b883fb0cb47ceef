//! The answer to "how many samples?", in a few sentences per pair.

use super::method::{Method, SAMPLES};
use super::row::Row;
use super::{MotionsAsked, PairRecord, Report};
use crate::console::plural;
use crate::report::page::table::percent;
use cbvh_measure::table::{micro, whole};

/// The number of samples that the sentences tell of first.
const USUAL_SAMPLES: u32 = 100;

/// Returns the sentences, the most important one first.
pub(super) fn sentences(report: &Report, pair: &PairRecord) -> Vec<String> {
    let row = |method: Method| report.of(&pair.name).find(|row| row.method == method);
    let (Some(motion), Some(is_free)) = (row(Method::Motion), row(Method::IsFree)) else { return Vec::new() };
    let mut sentences = vec![certified(&pair.items, motion, is_free)];
    if pair.items.hits == 0 {
        sentences.push("There is no contact to miss.".to_owned());
        return sentences;
    }
    sentences.extend(row(Method::Ordered(USUAL_SAMPLES)).map(|usual| missed(usual, motion)));
    let misses_none =
        |&samples: &u32| row(Method::Ordered(samples)).is_some_and(|row| row.errors.missed == 0);
    // The number from which on all miss none.
    let enough = SAMPLES.into_iter().rev().take_while(misses_none).last();
    let samples = enough.unwrap_or(SAMPLES[SAMPLES.len() - 1]);
    if let (Some(ordered), Some(spread)) = (row(Method::Ordered(samples)), row(Method::Spread(samples))) {
        let number = whole(samples.into());
        let lead = match enough {
            Some(_) => format!("From {number} samples on, none is missed: {number} samples"),
            None => format!("Even {number} samples miss {}: they", ordered.errors.missed),
        };
        sentences.push(format!(
            "{lead} take {} \u{b5}s in the order of time, {} times as long as the certified first contact, and {} \u{b5}s \
             in a spread order, {} times as long as the certified yes or no.",
            time(ordered),
            ratio(ordered, motion),
            time(spread),
            ratio(spread, is_free)
        ));
    }
    sentences
}

/// Says how many motions end how, and how long certified answers take.
fn certified(items: &MotionsAsked, motion: &Row, is_free: &Row) -> String {
    let are = |count: usize| if count == 1 { "is" } else { "are" };
    let MotionsAsked { motions, free, hits, undecided, .. } = *items;
    format!(
        "Of {motions} {}, {hits} {}, {free} {} free and {undecided} {} undecided. The median time is {} \u{b5}s for the \
         certified first contact and {} \u{b5}s for the certified yes or no.",
        plural(motions as u64, "motion"),
        if hits == 1 { "hits" } else { "hit" },
        are(free),
        are(undecided),
        time(motion),
        time(is_free)
    )
}

/// Says what samples in the order of time miss.
fn missed(usual: &Row, motion: &Row) -> String {
    let late = match (usual.errors.late_median, usual.errors.late_max) {
        (Some(median), Some(max)) => format!(
            ", find the others late, by {} of the way in the median and {} at worst,",
            percent(median),
            percent(max)
        ),
        _ => String::new(),
    };
    format!(
        "{USUAL_SAMPLES} samples in the order of time miss {} of {} contacts{late} and take {} \u{b5}s, {} times as long \
         as the certified first contact.",
        usual.errors.missed,
        usual.hits,
        time(usual),
        ratio(usual, motion)
    )
}

fn time(row: &Row) -> String {
    micro(row.nanoseconds().unwrap_or_default())
}

/// Returns how many times as long as `other` a way takes, with two digits or more.
fn ratio(row: &Row, other: &Row) -> String {
    let ratio = row.nanoseconds().unwrap_or_default() / other.nanoseconds().unwrap_or(f64::NAN);
    match ratio {
        10.0.. => whole(ratio),
        1.0.. => format!("{ratio:.1}"),
        _ => format!("{ratio:.2}"),
    }
}
