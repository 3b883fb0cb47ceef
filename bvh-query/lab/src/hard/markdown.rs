//! `hard.md`: the answers as tables for people.

use super::judge::Verdict;
use super::record::{Answers, Asked, Column, Counts, Record};
use bvh_format::profile::Profile;
use std::fmt::Write;

pub(super) fn page(record: &Record) -> String {
    let mut text = head(record);
    if !record.peers.is_empty() {
        text.push_str(&peers(record));
    }
    let mut kind = "";
    for case in &record.cases {
        if case.kind != kind {
            kind = case.kind;
            let others = if record.peers.is_empty() { "" } else { " wrong answers of others |" };
            let rule = if record.peers.is_empty() { "" } else { "---|" };
            // Writing to a string cannot fail.
            let _ = write!(text, "\n## {kind}\n\n| case | truth | cbvh |{others}\n|---|---|---|{rule}\n");
        }
        text.push_str(&row(case, record));
    }
    text
}

fn head(record: &Record) -> String {
    let questions: usize = record.cases.iter().map(|case| case.orders.len()).sum();
    let asked: usize =
        record.cases.iter().flat_map(|case| &case.orders).map(|answers| answers.own.asked).sum();
    let peers = if record.peers.is_empty() { "" } else { " --peers PEERS" };
    format!(
        "# Hard cases\n\n\
         {} pairs of small meshes whose exact answers are known, in {questions} orders of corners, triangles and \
         sides. cbvh {} was asked in {} profiles, two triangle encodings and the backends {}. The order as listed was \
         asked in all of them, each other order in a fifth of the profiles and encodings, which changes from case to \
         case. In {asked} combinations there were **{} wrong answers**. Each combination was asked whether the meshes \
         touch, for the number of contacts, for the distance with its interval, and nine times whether the meshes are \
         within a distance.\n\n\
         Generated on {} on {} by `cargo run --release -p cbvh-lab -- hard --out DIR{peers}`, which writes this page as \
         `hard.md`; `hard.json` beside it contains every answer. The cases are in \
         `bvh-format/testkit/src/hard_cases/`, and `cargo test -p bvh-query --test exact hard_cases` proves what they \
         state by integer arithmetic.\n\n\
         A distance that ends in ... lies between the number shown and the next larger `f64`. The interval of cbvh is \
         the widest of all profiles, encodings and backends, in the order as listed.\n",
        record.cases.len(),
        record.origin.version,
        Profile::ALL.len(),
        record.backends.join(", "),
        record.wrong(),
        record.origin.date,
        record.origin.machine.processor,
    )
}

fn peers(record: &Record) -> String {
    let mut text = "\n## Other libraries\n\n\
        The other libraries read the same meshes from OBJ files that state all digits. Each question runs in a process \
        of its own, which may take 10 seconds. Poses that must be refused are left out. A distance is *wrong* if its \
        error exceeds 1e-6 of the size of both meshes as placed. Otherwise it is *off* if its error exceeds 1e-6 of \
        the distance, which is 0 for meshes that touch, so any error counts. The last two columns count only the cases \
        whose numbers are all numbers of single precision. Margins and tolerances of the libraries are set to 0 where \
        there is such a setting. embree-boxes is Embree's tree of boxes with the program's own triangle test. Some of \
        these libraries require more than the cases give, such as triangles with an area, or sizes far from the limits \
        of their numbers, so a wrong answer here is not necessarily a defect of the library.\n\n\
        | library | version | precision | mode | asked | wrong | off | crashes | over 10 s | asked in single | not right |\n\
        |---|---|---|---|---|---|---|---|---|---|---|\n"
        .to_owned();
    for Column { name, version, precision, modes } in &record.peers {
        for counts in modes {
            let Counts { mode, asked, wrong, off, crashes, timeouts, single_asked, single_not_right } =
                counts;
            let _ = writeln!(
                text,
                "| {name} | {version} | {precision} | {mode} | {asked} | {wrong} | {off} | {crashes} | {timeouts} | \
                 {single_asked} | {single_not_right} |"
            );
        }
    }
    for Column { name, .. } in &record.peers {
        let (all, single) = (crashes(record, name, false), crashes(record, name, true));
        if all > 0 {
            let _ = write!(
                text,
                "\n{name} ended without an answer {all} times, {single} of them with a mesh of one triangle.\n"
            );
        }
    }
    text
}

/// Returns how often a library crashed; with `single`, only where a mesh is one triangle.
fn crashes(record: &Record, peer: &str, single: bool) -> usize {
    let cases = record.cases.iter().filter(|case| !single || case.triangles_a.min(case.triangles_b) == 1);
    let others = cases.flat_map(|case| &case.orders).flat_map(|answers| &answers.others);
    others.filter(|other| other.peer == peer && other.verdict == Verdict::Crash).count()
}

fn row(case: &Asked, record: &Record) -> String {
    let others = if record.peers.is_empty() { String::new() } else { format!(" {} |", others(case, record)) };
    format!("| **{}**: {} | {} | {} |{others}\n", case.name, case.hard, truth(case), own(case))
}

fn truth(case: &Asked) -> String {
    let truth = &case.truth;
    match (truth.touching, truth.contacts, truth.distance) {
        (Some(true), Some(contacts), _) => {
            let pairs = if contacts == 1 { "pair" } else { "pairs" };
            format!("touching, {contacts} {pairs}")
        }
        (Some(false), _, Some(distance)) => {
            let open = if truth.exact == Some(true) { "" } else { "..." };
            format!("{}{open} apart: {}", short(distance), truth.why)
        }
        _ => "refused".to_owned(),
    }
}

/// Returns the answer of cbvh, and how many of its answers in all orders are wrong.
fn own(case: &Asked) -> String {
    let wrong: usize =
        case.orders.iter().map(|answers| answers.own.wrong.len() + answers.own.differ.len()).sum();
    let first = case.orders.first().map(|answers| &answers.own);
    let said = match first {
        Some(own) => match (&own.refusal, own.collide, own.contacts, own.distance) {
            (Some(refusal), ..) => refusal.clone(),
            (_, Some(true), Some(contacts), Some(distance)) => {
                format!("touching, {contacts}, distance {}", short(distance))
            }
            (_, Some(false), _, Some(distance)) => {
                let end = |end: Option<f64>| end.map_or("?".to_owned(), short);
                format!("{} in [{}, {}]", short(distance), end(own.lower), end(own.upper))
            }
            _ => "no answer".to_owned(),
        },
        None => "not asked".to_owned(),
    };
    if wrong == 0 { said } else { format!("**{wrong} wrong**: {said}") }
}

/// Returns the answers that are not right, library by library: the mode, the answer, and in how many orders.
fn others(case: &Asked, record: &Record) -> String {
    if case.truth.touching.is_none() {
        return "not asked".to_owned();
    }
    let mut parts = Vec::new();
    for peer in &record.peers {
        let modes: Vec<_> =
            peer.modes.iter().filter_map(|counts| mode(case, peer.name, counts.mode)).collect();
        if !modes.is_empty() {
            parts.push(format!("{}: {}", peer.name, modes.join(", ")));
        }
    }
    if parts.is_empty() { "none".to_owned() } else { parts.join("; ") }
}

fn mode(case: &Asked, peer: &str, mode: &str) -> Option<String> {
    let in_orders =
        |answers: &Answers| answers.others.iter().position(|other| other.peer == peer && other.mode == mode);
    let all: Vec<_> =
        case.orders.iter().filter_map(|answers| Some(&answers.others[in_orders(answers)?])).collect();
    let not_right: Vec<_> = all.iter().filter(|other| other.verdict != Verdict::Right).collect();
    let first = not_right.first()?;
    let said = match (first.verdict, first.answer) {
        (Verdict::Crash, _) => "crash".to_owned(),
        (Verdict::Timeout, _) => "over 10 s".to_owned(),
        (_, None) => "not a number".to_owned(),
        (verdict, Some(answer)) => {
            let off = if verdict == Verdict::Off { "off, " } else { "" };
            let answer = if mode == "distance" { format!("{answer:.3e}") } else { format!("{answer}") };
            let by = |error: Option<f64>, of: &str| error.map(|error| format!("{error:.0e} of {of}"));
            let by: Vec<_> =
                [by(first.error_of_distance, "the distance"), by(first.error_of_size, "the size")]
                    .into_iter()
                    .flatten()
                    .collect();
            let by = if by.is_empty() { String::new() } else { format!(" ({off}error {})", by.join(", ")) };
            format!("{answer}{by}")
        }
    };
    let orders = if not_right.len() == all.len() {
        String::new()
    } else {
        format!(" in {} of {} orders", not_right.len(), all.len())
    };
    Some(format!("{mode} {said}{orders}"))
}

/// Writes a number in the fewest digits that give it back.
fn short(x: f64) -> String {
    let (plain, scientific) = (format!("{x}"), format!("{x:e}"));
    if plain.len() <= scientific.len() { plain } else { scientific }
}
