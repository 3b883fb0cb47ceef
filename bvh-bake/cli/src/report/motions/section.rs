//! A pair's section on the page about motions: sentences that answer "how many samples?", plots of time against the share
//! of contacts missed and against how late the others are found, and a table. The words around the sections are here, too.

use super::method::{Method, SAMPLES};
use super::{MAX_SECONDS, Row};
use crate::console::plural;
use crate::report::Section;
use crate::report::page::{Column, Line as TableLine, Words, escape, percent, table};
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};
use cbvh_measure::table::{micro, whole};

/// What the page is about.
const ABOUT: &str = "\
Whether the way of a moving mesh is free is often asked by samples: poses along the way, of which the first that touches \
ends the question. Samples miss contacts between them, and find others late. cbvh certifies its answers for every moment \
between start and end. This page tells for each pair of meshes what samples miss, how late they are, and how long they \
take beside the certified answers.";

/// What is known if no answer is wrong.
const RIGHT: &str = "\
No answer contradicts another: no sample touches where a motion is certified free, or before the time until which it is.";

pub(super) const WORDS: Words =
    Words { title: "How many samples for these motions?", about: ABOUT, right: RIGHT, methods };

/// Returns the section of a pair. `ends` counts the motions that are certified free, and those left undecided.
pub(super) fn section(pair: &str, rows: &[Row], ends: [usize; 2], from: &str) -> Section {
    let motions = rows.first().map_or(0, |row| row.motions);
    Section {
        items: format!("{motions} {} ({from})", plural(motions, "motion")),
        sentences: sentences(rows, ends),
        figure: figure(pair, rows),
        tables: tables(pair, rows),
    }
}

/// The number of samples that the sentences tell of first.
const USUAL_SAMPLES: u32 = 100;

/// Returns the sentences, the most important one first.
fn sentences(rows: &[Row], ends: [usize; 2]) -> Vec<String> {
    let row = |method: Method| rows.iter().find(|row| row.method == method);
    let (Some(motion), Some(is_free)) = (row(Method::Motion), row(Method::IsFree)) else { return Vec::new() };
    let mut sentences = vec![certified(ends, motion, is_free)];
    if motion.hits == 0 {
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
fn certified([free, undecided]: [usize; 2], motion: &Row, is_free: &Row) -> String {
    let are = |count: usize| if count == 1 { "is" } else { "are" };
    let Row { motions, hits, .. } = *motion;
    format!(
        "Of {motions} {}, {hits} {}, {free} {} free and {undecided} {} undecided. The median time is {} \u{b5}s for the \
         certified first contact and {} \u{b5}s for the certified yes or no.",
        plural(motions, "motion"),
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

const TIME: &str = "median time per motion, \u{b5}s";

/// Ways to ask that share a line and a look: which ones, and their name.
type WaysToAsk = (fn(Method) -> bool, &'static str);

const KINDS: [WaysToAsk; 4] = [
    (|method| matches!(method, Method::Ordered(_)), "samples in the order of time"),
    (|method| matches!(method, Method::Spread(_)), "samples in a spread order"),
    (|method| method == Method::Motion, "certified: first contact"),
    (|method| method == Method::IsFree, "certified: any contact"),
];

/// Returns the plots of a pair.
fn figure(pair: &str, rows: &[Row]) -> Figure {
    let missed = panel(
        format!("{pair}: time against contacts missed"),
        "contacts missed, % of the certified ones",
        rows,
        |row| row.missed_share(),
    );
    let late = panel(
        format!("{pair}: time against how late contacts are found"),
        "late in the median, % of the way",
        rows,
        |row| row.errors.late_median,
    );
    let legend = KINDS.iter().enumerate().map(|(kind, (_, name))| (look(kind), (*name).to_owned()));
    Figure { title: pair.to_owned(), legend: legend.collect(), rows: vec![vec![missed, late]] }
}

/// Returns a plot of time against an error that is a fraction.
fn panel(title: String, x: &'static str, rows: &[Row], error: fn(&Row) -> Option<f64>) -> Panel {
    let mut panel = Panel { title, x, y: TIME, lines: Vec::new(), marks: Vec::new(), labels: Vec::new() };
    for (kind, (is_of_kind, _)) in KINDS.iter().enumerate() {
        let points: Vec<((f64, f64), &Row)> = rows
            .iter()
            .filter(|row| is_of_kind(row.method))
            .filter_map(|row| Some(((100.0 * error(row)?, row.nanoseconds()? / 1000.0), row)))
            .collect();
        panel.marks.extend(points.iter().map(|&(at, _)| Mark { at, look: look(kind) }));
        panel.labels.extend(points.iter().map(|&(at, row)| (at, label(row.method))));
        let points = points.into_iter().map(|(at, _)| at).collect();
        panel.lines.push(Line { points, look: Some(look(kind)) });
    }
    panel
}

fn label(method: Method) -> String {
    match method {
        Method::Ordered(samples) => whole(samples.into()),
        Method::Spread(samples) => format!("{}, spread", whole(samples.into())),
        Method::Motion => "first contact".to_owned(),
        Method::IsFree => "any contact".to_owned(),
    }
}

fn look(kind: usize) -> Look {
    Look { kind, is_filled: true }
}

/// The head of a column, the field of its figures, and how they are shown.
type Figures = (&'static str, &'static str, fn(f64) -> String);

/// The columns below their common heads.
const COLUMNS: [(&str, &[Figures]); 4] = [
    ("contacts missed", &[("number", "missed", whole), ("share", "missed_share", percent)]),
    ("late, of the way", &[("median", "late_median", percent), ("largest", "late_max", percent)]),
    ("motions", &[("undecided", "undecided", whole)]),
    (
        "per motion, \u{b5}s",
        &[("median", "ns_median", micro), ("90 %", "ns_p90", micro), ("mean", "ns_mean", micro)],
    ),
];

/// Returns the table of a pair with its heading.
fn tables(pair: &str, rows: &[Row]) -> String {
    let column = |&(head, field, show): &Figures| Column { head, row: 0, of: String::new(), field, show };
    let groups = COLUMNS.map(|(head, columns)| (head, columns.iter().map(column).collect()));
    let lines: Vec<TableLine> = rows.iter().map(|row| line(pair, row)).collect();
    let hits = rows.first().map_or(0, |row| row.hits);
    format!(
        "<h3>Errors and times</h3>\n<p>What each way to ask misses of {hits} certified contacts, how late it is with the \
         others, and how long it takes. The best figure of each column is bold.</p>\n{}",
        table("way to ask", &groups, &lines)
    )
}

fn line(pair: &str, row: &Row) -> TableLine {
    let name = match row.method {
        Method::Ordered(samples) => format!("{} samples in the order of time", whole(samples.into())),
        Method::Spread(samples) => format!("{} samples in a spread order", whole(samples.into())),
        Method::Motion => "certified: first contact".to_owned(),
        Method::IsFree => "certified: any contact".to_owned(),
    };
    let samples = row.method.samples().map_or(String::new(), |samples| samples.to_string());
    let (pair_name, method) = (escape(pair), row.method.name());
    TableLine {
        of: format!("data-pair=\"{pair_name}\" data-method=\"{method}\" data-samples=\"{samples}\""),
        name,
        rows: vec![row.cells(pair)],
    }
}

/// Says how it was measured and what the figures do not tell.
fn methods(rounds: usize) -> String {
    format!(
        "<h2 id=\"methods\">How it was measured</h2>\n<ul>\n\
         <li><strong>Samples</strong> are equally spaced poses with both ends, asked about with \
         <code>Querier::collide</code> until one touches. A spread order asks about both ends and then in van der \
         Corput's order: halves, quarters, and so on. It finds some contact sooner, but not the first one.</li>\n\
         <li><strong>Certified answers</strong> are those of <code>Querier::motion</code>, which finds the first contact, \
         and of <code>Querier::is_free</code>, which looks for any. Both may leave a motion undecided that comes nearer \
         than a millionth of the larger mesh's diagonal without a contact.</li>\n\
         <li><strong>Missed</strong> is a certified contact where all samples are free. <strong>Late</strong> is the time \
         between the moment until which the way is certified free and the contact found, as a fraction of the way, \
         over the contacts that are not missed. Where it is much more than the time between two samples, they have \
         missed the first contact and found a later one. For the certified first contact it is the time between the two \
         moments that its answer names.</li>\n\
         <li><strong>Times</strong> are those of single motions on one thread that is bound to one processor, with the \
         poses of samples made on the way. All ways to ask take turns in each of {rounds} rounds, with three untimed \
         motions before each turn. Those that take long take part in as many rounds as fit into {MAX_SECONDS} seconds \
         per pair, but at least in one; <code>report.csv</code> has their number. A median is taken over the motions of \
         a round and then over the rounds. Nine tenths of the motions take less than the 90 % time.</li>\n</ul>\n\
         <h2 id=\"limits\">What the figures do not tell</h2>\n<ul>\n\
         <li>What samples miss depends on the motions: other ones need more samples, or fewer. The motions asked about \
         say nothing of others.</li>\n\
         <li>A median hides what single motions cost, and it depends on how many of them hit, and how soon.</li>\n\
         <li>They are of one machine on one day. On a virtual machine neighbours share the last cache and the \
         memory.</li>\n</ul>\n"
    )
}
