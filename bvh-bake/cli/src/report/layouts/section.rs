//! A pair's section on the page about layouts: sentences that answer "which layout?", plots, and tables with the fastest
//! layout first. The words around the sections are here, too.

use super::{EXACT_DISTANCE, QUESTIONS, Row};
use crate::console::plural;
use crate::report::Section;
use crate::report::page::{Column, Group, Line as TableLine, Words, escape, percent, table};
use bvh_format::leaf::TriangleEncoding;
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};
use cbvh_measure::rounds::Question;
use cbvh_measure::table::micro;
use std::fmt::Write;

/// What the page is about.
const ABOUT: &str = "\
A layout is how a <code>.cbvh</code> file stores bounding volumes (its profile) and triangles (their encoding). This page \
tells for each pair of meshes how fast every layout answers, how many bytes it takes, and how far its distances are from \
the exact ones.";

/// What is known if no answer is wrong.
const RIGHT: &str = "\
All answers are right: layouts that store the same triangles agree about contact, and about distances to the last bit. \
Distances with an allowed error were within it.";

pub(super) const WORDS: Words =
    Words { title: "Which layout for these meshes?", about: ABOUT, right: RIGHT, methods };

/// Returns the section of a pair, of which each mesh has a chosen layout.
pub(super) fn section(pair: &str, rows: &[Row], chosen: &[String; 2], poses: usize, from: &str) -> Section {
    Section {
        items: format!("{poses} {} ({from})", plural(poses as u64, "pose")),
        sentences: sentences(rows, chosen),
        figure: figure(pair, rows),
        tables: tables(pair, rows),
    }
}

/// The answers of one layout of a pair to the two exact questions.
#[derive(Clone, Copy)]
struct Candidate<'a> {
    collide: &'a Row,
    distance: &'a Row,
}

impl Candidate<'_> {
    /// The geometric mean of the median times for contact and distance, nanoseconds. By this mean layouts are ranked.
    fn mean_time(&self) -> f64 {
        let time = |row: &Row| row.nanoseconds().unwrap_or(f64::INFINITY);
        (time(self.collide) * time(self.distance)).sqrt()
    }

    fn name(&self) -> String {
        self.collide.layout.name()
    }

    fn bytes(&self) -> f64 {
        self.collide.file_bytes()
    }
}

/// Returns the layouts of a pair, the fastest first: those without loss, or those with quantised triangles.
fn ranked(rows: &[Row], is_lossy: bool) -> Vec<Candidate<'_>> {
    let is_exact = |row: &&Row| row.question.rel_err().unwrap_or(0.0) == 0.0;
    let rows = || rows.iter().filter(|row| row.layout.is_lossy() == is_lossy).filter(is_exact);
    let distance = |of: &Row| rows().find(|row| row.layout == of.layout && row.question != Question::Collide);
    let collide = rows().filter(|row| row.question == Question::Collide);
    let mut all: Vec<Candidate<'_>> =
        collide.filter_map(|row| Some(Candidate { collide: row, distance: distance(row)? })).collect();
    all.sort_by(|a, b| a.mean_time().total_cmp(&b.mean_time()));
    all
}

/// Returns the sentences, the most important one first.
fn sentences(rows: &[Row], [a, b]: &[String; 2]) -> Vec<String> {
    let all = ranked(rows, false);
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

const TIME: &str = "median time per query, \u{b5}s";

/// Returns the plots of a pair.
fn figure(pair: &str, rows: &[Row]) -> Figure {
    let exact = |question: Question| rows.iter().filter(move |row| row.question == question);
    let by_bytes = |question: Question| {
        let title = format!("{pair}: {}, time against size", question.name());
        let points = exact(question).filter_map(|row| Point::new(row, row.file_bytes(), row.pareto_bytes));
        panel(title, "bytes per triangle, whole file", points.collect())
    };
    let distances = rows.iter().filter(|row| row.question != Question::Collide);
    let by_error = distances.filter_map(|row| Point::new(row, row.errors.max?, row.pareto_error));
    let title = format!("{pair}: distance, time against error");
    let error = panel(title, "largest relative error found", by_error.collect());
    let names = [
        (TriangleEncoding::F32, "f32 triangles"),
        (TriangleEncoding::Packed, "packed: the same values"),
        (TriangleEncoding::Quantized, "quantised: vertices moved"),
    ];
    let mut legend: Vec<_> =
        names.map(|(triangles, name)| (look(triangles, false), name.to_owned())).to_vec();
    legend.push((
        look(TriangleEncoding::F32, true),
        "filled: no lossless layout beats it in both figures".into(),
    ));
    let [collide, distance] = Question::EXACT.map(by_bytes);
    Figure { title: pair.to_owned(), legend, rows: vec![vec![collide, distance], vec![error]] }
}

/// A row as a point of a plot.
struct Point<'a> {
    row: &'a Row,
    at: (f64, f64),
    is_on_front: bool,
}

impl<'a> Point<'a> {
    fn new(row: &'a Row, x: f64, is_on_front: Option<bool>) -> Option<Self> {
        Some(Self { row, at: (x, row.nanoseconds()? / 1000.0), is_on_front: is_on_front == Some(true) })
    }

    fn name(&self) -> String {
        let allowed = self.row.question.rel_err().filter(|&rel_err| rel_err > 0.0);
        let allowed = allowed.map_or(String::new(), |rel_err| format!(", {} %", 100.0 * rel_err));
        format!("{}{allowed}", self.row.layout.name())
    }
}

fn panel(title: String, x: &'static str, mut points: Vec<Point<'_>>) -> Panel {
    // The Pareto front is drawn on top of the other marks, from left to right.
    points.sort_by(|a, b| a.is_on_front.cmp(&b.is_on_front).then(a.at.0.total_cmp(&b.at.0)));
    let front = || points.iter().filter(|point| point.is_on_front);
    Panel {
        title,
        x,
        y: TIME,
        lines: vec![Line { points: front().map(|point| point.at).collect(), look: None }],
        marks: points
            .iter()
            .map(|point| Mark { at: point.at, look: look(point.row.layout.triangles, point.is_on_front) })
            .collect(),
        labels: front().map(|point| (point.at, point.name())).collect(),
    }
}

fn look(triangles: TriangleEncoding, is_filled: bool) -> Look {
    Look { kind: triangles as usize, is_filled }
}

/// The indices of the exact questions in `QUESTIONS`.
const CONTACT: usize = 0;
const DISTANCE: usize = EXACT_DISTANCE;

fn column(head: &'static str, row: usize, field: &'static str, show: fn(f64) -> String) -> Column {
    let (name, rel_err) = (QUESTIONS[row].name(), QUESTIONS[row].rel_err().unwrap_or(0.0));
    let of = format!(" data-question=\"{name}\" data-rel-err=\"{rel_err:?}\"");
    Column { head, row, of, field, show }
}

/// Median and 90 % time of a question.
fn times(row: usize) -> Vec<Column> {
    vec![column("median", row, "ns_median", micro), column("90 %", row, "ns_p90", micro)]
}

/// Time and error of a distance with an allowed error.
fn allowed(head: &'static str, row: usize) -> Group {
    let error = column("largest error", row, "distance_error_max", percent);
    (head, vec![column("\u{b5}s", row, "ns_median", micro), error])
}

/// Returns all tables of a pair.
fn tables(pair: &str, all: &[Row]) -> String {
    let (lossless, lossy) = (ranked(all, false), ranked(all, true));
    let bytes = |field, head| column(head, CONTACT, field, tenths);
    let file = || ("bytes per triangle", vec![bytes("file_bytes_per_tri", "file")]);
    let speed = || vec![("contact, \u{b5}s", times(CONTACT)), ("distance, \u{b5}s", times(DISTANCE)), file()];
    let work = |question| {
        vec![
            column("node tests", question, "node_tests", tenths),
            column("packet tests", question, "packet_tests", tenths),
            column("exact tests", question, "exact_tests", tenths),
        ]
    };
    let mut text = String::new();
    let mut add = |title: &str, caption: &str, candidates: &[Candidate<'_>], columns: &[Group]| {
        let _ = writeln!(text, "<h3>{title}</h3>\n<p>{caption}</p>");
        text += &table_of(pair, all, candidates, columns);
    };
    add(
        "Layouts without loss",
        "Microseconds per query and bytes per triangle, the fastest layout first. The best figure of each column is \
         bold; a dot marks layouts that no other one beats in both time and bytes.",
        &lossless,
        &speed(),
    );
    let mut quantised = speed();
    quantised.push(("vertices moved by", vec![column("mesh units", CONTACT, "vertex_error", scientific)]));
    quantised.push((
        "relative error of the distance",
        vec![
            column("largest", DISTANCE, "distance_error_max", percent),
            column("median", DISTANCE, "distance_error_median", percent),
        ],
    ));
    add(
        "Layouts with quantised triangles",
        "The same for layouts that move vertices a little to save bytes, the fastest first.",
        &lossy,
        &quantised,
    );
    add(
        "Distance with an allowed error",
        "Median microseconds per query and the largest relative error found, for layouts without loss, in the order of \
         the first table. An answer may exceed the exact distance by the allowed error.",
        &lossless,
        &[allowed("exact", 1), allowed("0.1 %", 2), allowed("1 %", 3), allowed("10 %", 4)],
    );
    add(
        "Where bytes and time go",
        "Bytes per triangle by part of the file; by how much bounding volumes are wider and larger than their \
         triangles need; and the mean work per query.",
        &lossless,
        &[
            (
                "bytes per triangle",
                vec![
                    bytes("node_bytes_per_tri", "nodes"),
                    bytes("triangle_bytes_per_tri", "triangles"),
                    bytes("id_bytes_per_tri", "ids"),
                ],
            ),
            (
                "bounds, excess",
                vec![
                    column("width", CONTACT, "width_inflation", excess),
                    column("volume", CONTACT, "volume_inflation", excess),
                ],
            ),
            ("contact, per query", work(CONTACT)),
            ("distance, per query", work(DISTANCE)),
        ],
    );
    text
}

/// Returns the table of some layouts. The rows of a layout follow each other in the order of `QUESTIONS`.
fn table_of(pair: &str, rows: &[Row], candidates: &[Candidate<'_>], groups: &[Group]) -> String {
    let line = |candidate: &Candidate<'_>| {
        let name = escape(&candidate.name());
        let is_on_front =
            [candidate.collide, candidate.distance].iter().any(|row| row.pareto_bytes == Some(true));
        let dot = if is_on_front { " \u{2022}" } else { "" };
        let rows = rows.iter().filter(|row| row.layout == candidate.collide.layout);
        TableLine {
            of: format!("data-pair=\"{}\" data-layout=\"{name}\"", escape(pair)),
            name: format!("{name}{dot}"),
            rows: rows.map(|row| row.cells(pair)).collect(),
        }
    };
    table("layout", groups, &candidates.iter().map(line).collect::<Vec<_>>())
}

fn tenths(value: f64) -> String {
    format!("{value:.1}")
}

/// Formats a ratio by its excess over 1.
fn excess(value: f64) -> String {
    format!("{:.1} %", 100.0 * (value - 1.0))
}

fn scientific(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// Says how it was measured and what the figures do not tell.
fn methods(rounds: usize) -> String {
    format!(
        "<h2 id=\"methods\">How it was measured</h2>\n<ul>\n\
         <li><strong>Times</strong> are those of single queries on one thread that is bound to one processor. All \
         layouts take turns in each of {rounds} rounds, with three untimed queries before each turn, so caches hold \
         what earlier queries left there. A median is taken over the poses of a round and then over the rounds. Nine \
         tenths of the poses take less than the 90 % time.</li>\n\
         <li><strong>The order of the tables</strong> is by the geometric mean of the median times for contact and \
         for distance. A dot marks layouts that no other one beats in both time and bytes.</li>\n\
         <li><strong>Errors</strong> are relative to the exact distance of the mesh, over the poses in which the \
         meshes are apart. Layouts without loss give that distance exactly unless an error is allowed. The errors in \
         the tables are those found; other poses may come closer to what is allowed.</li>\n\
         <li><strong>Quantised triangles</strong> have moved by up to the length in the table, 1e-5 of the mesh's \
         diagonal by default. Near contact this is a large part of the distance.</li>\n\
         <li><strong>Node tests</strong> compare up to 16 pairs of bounding volumes at once, <strong>packet \
         tests</strong> up to 16 pairs of triangles; what these cannot decide goes to <strong>exact tests</strong> of \
         one pair of triangles each.</li>\n</ul>\n\
         <h2 id=\"limits\">What the figures do not tell</h2>\n<ul>\n\
         <li>They compare layouts on one machine on one day. On a virtual machine neighbours share the last cache and \
         the memory.</li>\n\
         <li>A median hides what single poses cost, and it depends on the mix of poses near contact and far \
         apart.</li>\n\
         <li>Files that are not in memory yet take longer to answer first, because they are read from the disk.</li>\n\
         </ul>\n"
    )
}
