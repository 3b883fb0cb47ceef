//! `hard.csv`: one line per order of each case, and two columns per library and mode.

use super::digits;
use super::peers::Other;
use super::record::{Answers, Asked, Record};
use cbvh_measure::table::line;

pub(super) fn table(record: &Record) -> String {
    let mut header: Vec<String> = [
        "kind",
        "case",
        "order",
        "hard",
        "triangles_a",
        "triangles_b",
        "single",
        "touching",
        "contacts",
        "distance",
        "exact",
        "why",
        "cbvh_collide",
        "cbvh_contacts",
        "cbvh_distance",
        "cbvh_lower",
        "cbvh_upper",
        "cbvh_refusal",
        "cbvh_asked",
        "cbvh_differ",
        "cbvh_wrong",
    ]
    .map(str::to_owned)
    .to_vec();
    let columns: Vec<_> = record
        .peers
        .iter()
        .flat_map(|peer| peer.modes.iter().map(move |counts| (peer.name, counts.mode)))
        .collect();
    for (peer, mode) in &columns {
        header.extend([format!("{peer} {mode}"), format!("{peer} {mode} verdict")]);
    }
    let mut text = line(&header);
    for case in &record.cases {
        for answers in &case.orders {
            text.push_str(&line(&fields(case, answers, &columns)));
        }
    }
    text
}

fn fields(case: &Asked, answers: &Answers, columns: &[(&str, &str)]) -> Vec<String> {
    let flag = |flag: Option<bool>| flag.map_or(String::new(), |flag| u8::from(flag).to_string());
    let count = |count: Option<u64>| count.map_or(String::new(), |count| count.to_string());
    let length = |length: Option<f64>| length.map_or(String::new(), digits);
    let (truth, own) = (&case.truth, &answers.own);
    let mut fields = vec![
        case.kind.to_owned(),
        case.name.clone(),
        answers.order.to_owned(),
        case.hard.to_owned(),
        case.triangles_a.to_string(),
        case.triangles_b.to_string(),
        flag(Some(case.single)),
        flag(truth.touching),
        count(truth.contacts),
        length(truth.distance),
        flag(truth.exact),
        truth.why.to_owned(),
        flag(own.collide),
        count(own.contacts),
        length(own.distance),
        length(own.lower),
        length(own.upper),
        own.refusal.clone().unwrap_or_default(),
        own.asked.to_string(),
        own.differ.join("; "),
        own.wrong.join("; "),
    ];
    for (peer, mode) in columns {
        let is_it = |other: &&Other| other.peer == *peer && other.mode == *mode;
        let other = answers.others.iter().find(is_it);
        fields.push(other.map_or(String::new(), |other| length(other.answer)));
        fields.push(other.map_or(String::new(), |other| other.verdict.name().to_owned()));
    }
    fields
}
