//! Which layout suits these meshes: how fast each one answers, how many bytes it takes, and with what error.
//!
//! Each pair is baked in every profile with every encoding of triangles and, where it has them, without turning slabs. Then
//! it is asked in all its poses, and the answers are compared with those of the reference: the profile of plain floats, with
//! the same triangles. Contact and exact distances have one right answer for given triangles, bit for bit. With an allowed
//! error the answer lies between the least distance and that much more. Quantised triangles have moved and have answers of
//! their own: their difference from the answers for the mesh itself is an error that is reported.

use super::meshes::{bake_both, layout_of};
use super::page::{Column, Words, excess, percent, scientific, table, tenths};
use super::{Cells, Kind, Measured, Subject, number};
use crate::asking::files::read_poses;
use crate::console::Failure;
use bvh_bake::{BakeReport, Options};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose};
use cbvh_measure::pin::pinned;
use cbvh_measure::plot::{Figure, Line, Look, Mark, Panel};
use cbvh_measure::poses::mixed;
use cbvh_measure::rounds::{Asked, Question, Subject as Asking, rounds};
use cbvh_measure::spread::{Spread, median};
use cbvh_measure::table::{self, Cell, micro};

pub(super) const KIND: Kind<Pose> =
    Kind { words: WORDS, items: "poses", read: read_poses, make: mixed, made: MADE, measure };

const ABOUT: &str = "\
A layout is how a <code>.cbvh</code> file stores bounding volumes (its profile) and triangles (their encoding). This page \
tells for each pair of meshes how fast every layout answers, how many bytes it takes, and how far its distances are from \
the exact ones.";

/// What is known if no answer is wrong.
const RIGHT: &str = "\
All answers are right: layouts that store the same triangles agree about contact, and about distances to the last bit. \
Distances with an allowed error were within it.";

const METHODS: &str = "\
<li>Times are those of single queries on one thread that is bound to one processor. All layouts take turns in each round, \
with three untimed queries before each turn, so caches hold what earlier queries left there. A median is taken over the \
poses of a round and then over the rounds; nine tenths of the poses take less than the 90 % time.</li>
<li>A dot marks what no other layout without loss beats in both time and bytes, and distances that none beats in both time \
and error. Errors are relative to the exact distance of the mesh, over the poses in which the meshes are apart.</li>
<li>Node tests compare up to 16 pairs of bounding volumes at once, packet tests up to 16 pairs of triangles; what these \
cannot decide goes to exact tests of one pair of triangles each.</li>
<li>The figures are of one machine on one day. They depend on the mix of poses near contact and far apart, and files that \
are not in memory yet take longer to answer first.</li>";

const WORDS: Words =
    Words { title: "Which layout for these meshes?", about: ABOUT, right: RIGHT, methods: METHODS };

/// How poses are made, with the gaps of [`cbvh_measure::poses::GAPS`].
const MADE: &str =
    "made: a fifth overlaps, the others have gaps of 0.000001, 0.005, 0.01, 0.05 of A's diagonal";

/// What is asked: contact, the exact distance, and distances with an allowed relative error.
const QUESTIONS: [Question; 5] = [
    Question::Collide,
    Question::Distance(0.0),
    Question::Distance(1e-3),
    Question::Distance(1e-2),
    Question::Distance(1e-1),
];
/// The index of the exact distance in `QUESTIONS`.
const EXACT_DISTANCE: usize = 1;
/// How a file is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    profile: Profile,
    triangles: TriangleEncoding,
    /// Whether turning slabs are left out of a profile that has them.
    without_turning_slabs: bool,
}

impl Layout {
    /// Returns all layouts.
    fn all() -> impl Iterator<Item = Self> {
        let encodings = |(profile, without_turning_slabs)| {
            TriangleEncoding::ALL.map(|triangles| Self { profile, triangles, without_turning_slabs })
        };
        let without = Profile::ALL.into_iter().filter(|profile| profile.has_turning_slabs());
        let with = Profile::ALL.map(|profile| (profile, false)).into_iter();
        with.chain(without.map(|profile| (profile, true))).flat_map(encodings)
    }

    /// The name in tables.
    fn name(self) -> String {
        let without = if self.without_turning_slabs { " without turning slabs" } else { "" };
        format!("{} {}{without}", self.profile.name(), self.triangles.name())
    }

    /// Returns the options that bake it.
    fn options(self) -> Options {
        let options = Options::default().profile(self.profile).triangles(self.triangles);
        options.turning_slabs(!self.without_turning_slabs)
    }

    /// True for the layout whose answers all layouts with these triangles must give: bounds in plain floats.
    fn is_reference(self, triangles: TriangleEncoding) -> bool {
        self.profile == Profile::Dop14F32 && self.triangles == triangles
    }
}

/// Both meshes in one layout.
struct Baked {
    layout: Layout,
    a: Bvh,
    b: Bvh,
    /// Figures that do not depend on the question, with their names.
    size: [(&'static str, f64); 7],
}

/// Measures all layouts of a pair in the given poses.
fn measure(subject: &Subject<'_>, poses: &[Pose]) -> Result<Measured, Failure> {
    let Subject { pair, meshes, backend, rounds: count, .. } = *subject;
    let bake = |layout: Layout| -> Result<Baked, Failure> {
        let [(a, report_a), (b, report_b)] = bake_both(pair, meshes, &layout.options())?;
        let weights = [&a, &b].map(|bvh| bvh.objects()[0].record().treelets.get() as f64);
        Ok(Baked { layout, a, b, size: size_of([&report_a, &report_b], weights) })
    };
    let bakes = Layout::all().map(bake).collect::<Result<Vec<_>, _>>()?;
    let subjects: Vec<_> = bakes.iter().map(|of| Asking { a: &of.a, b: &of.b, poses }).collect();
    let (pinned, asked) = pinned(|| rounds(&subjects, &QUESTIONS, backend, count));
    let asked = asked.map_err(|error| Failure::Invalid(format!("{}: {error}", pair.name)))?;
    let layouts: Vec<Layout> = bakes.iter().map(|of| of.layout).collect();
    let wrong = judge(&pair.name, &layouts, &asked);
    let rows = rows(&pair.name, &bakes, &asked);
    let chosen = subject.baked.each_ref().map(|(_, report)| layout_of(report));
    Ok(Measured {
        sentences: sentences(&rows, &chosen),
        figure: figure(&pair.name, &rows),
        tables: tables(&rows),
        rows,
        wrong,
        pinned,
        ..Measured::default()
    })
}

/// Returns the rows of a pair: one question put to one layout, with the fronts marked.
fn rows(pair: &str, bakes: &[Baked], asked: &[Vec<Asked>]) -> Vec<Cells> {
    let reference = bakes.iter().position(|of| of.layout.is_reference(TriangleEncoding::F32)).unwrap_or(0);
    let exact = &asked[reference][EXACT_DISTANCE].answers;
    let touching = QUESTIONS[EXACT_DISTANCE].touching(exact);
    let mut rows = Vec::new();
    for (Baked { layout, size, .. }, asked) in bakes.iter().zip(asked) {
        let turning = layout.profile.has_turning_slabs().then_some(!layout.without_turning_slabs);
        for (question, asked) in QUESTIONS.into_iter().zip(asked) {
            let mut cells = vec![
                ("pair", Cell::text(pair)),
                ("layout", Cell::Text(layout.name())),
                ("profile", Cell::text(layout.profile.name())),
                ("triangles", Cell::text(layout.triangles.name())),
                ("turning_slabs", Cell::flag(turning)),
                ("question", Cell::text(question.name())),
                ("rel_err", Cell::number(question.rel_err())),
                ("poses", Cell::Count(asked.answers.len() as u64)),
                ("touching", Cell::Count(touching)),
            ];
            let time = Spread::of_rounds(&asked.rounds);
            cells.extend(table::times(["ns_median", "ns_q1", "ns_q3", "ns_p90"], time));
            cells.extend(table::work(asked.work()));
            cells.extend(size.map(|(name, value)| (name, Cell::number(Some(value)))));
            let errors = match question {
                Question::Collide => [None; 3],
                Question::Distance(_) => errors_against(exact, &asked.answers),
            };
            let names = ["distance_error_median", "distance_error_max", "distance_error_max_length"];
            cells.extend(names.into_iter().zip(errors.map(Cell::number)));
            rows.push(cells);
        }
    }
    // Of distances, what no other row beats in time and error; of exact questions to layouts without loss, in time and bytes.
    mark_front(&mut rows, "pareto_error", "distance_error_max", |row| Some(text(row, "question")));
    // Quantised triangles are smaller because they lose something: they do not compete with the others.
    let exact = |row: &Cells| Some(text(row, "question")).filter(|_| is_exact(row) && !is_lossy(row));
    mark_front(&mut rows, "pareto_bytes", "file_bytes_per_tri", exact);
    rows
}

/// Returns a name in a row.
fn text(row: &Cells, name: &str) -> String {
    row.iter().find(|(other, _)| *other == name).map(|(_, cell)| cell.field()).unwrap_or_default()
}

fn is_exact(row: &Cells) -> bool {
    number(row, "rel_err").is_none_or(|rel_err| rel_err == 0.0)
}

/// True if vertices may have moved more than rounding to `f32` moves them.
fn is_lossy(row: &Cells) -> bool {
    text(row, "triangles") == TriangleEncoding::Quantized.name()
}

/// The sizes of both files together; `treelets` weights the means over nodes.
fn size_of(reports: [&BakeReport; 2], treelets: [f64; 2]) -> [(&'static str, f64); 7] {
    let triangles: u64 = reports.iter().map(|report| report.file.triangles).sum();
    let per_triangle = |of: fn(&BakeReport) -> u64| {
        reports.iter().map(|report| of(report)).sum::<u64>() as f64 / triangles as f64
    };
    let mean = |of: fn(&BakeReport) -> f64| {
        let [a, b] = reports.map(of);
        (a * treelets[0] + b * treelets[1]) / (treelets[0] + treelets[1])
    };
    let moved = |report: &BakeReport| report.file.max_vertex_rounding.max(report.file.max_quantization_error);
    [
        ("node_bytes_per_tri", per_triangle(|report| report.file.node_bytes)),
        ("triangle_bytes_per_tri", per_triangle(|report| report.file.triangle_bytes)),
        ("id_bytes_per_tri", per_triangle(|report| report.file.id_bytes)),
        ("file_bytes_per_tri", per_triangle(|report| report.file.file_bytes)),
        // Means over the nodes of decoded width over tight width, and of decoded over tight box volume.
        ("width_inflation", mean(|report| report.width_inflation)),
        ("volume_inflation", mean(|report| report.volume_inflation)),
        // The farthest that a vertex was moved, mesh units.
        ("vertex_error", moved(reports[0]).max(moved(reports[1]))),
    ]
}

/// Adds a cell of this name that tells whether a row is on the Pareto front of its group: no other is at least as good in
/// time and in the figure `x`, of which less is better, and better in one.
fn mark_front(rows: &mut [Cells], name: &'static str, x: &str, group: impl Fn(&Cells) -> Option<String>) {
    let point = |row: &Cells| Some((group(row)?, number(row, x)?, number(row, "ns_median")?));
    let points: Vec<_> = rows.iter().map(point).collect();
    for (row, point) in rows.iter_mut().zip(&points) {
        let is_beaten = |(of, x, y): &(String, f64, f64)| {
            points.iter().flatten().any(|other| {
                other.0 == *of && other.1 <= *x && other.2 <= *y && (other.1 < *x || other.2 < *y)
            })
        };
        row.push((name, Cell::flag(point.as_ref().map(|point| !is_beaten(point)))));
    }
}

/// The factor that allows for rounding in the product of a distance and 1 + an allowed error: two roundings of 2^-53
/// each are needed, and the factor allows eight.
const ROUNDING: f64 = 1.0 + 4.0 * f64::EPSILON;

/// Returns the wrong answers, one line each.
fn judge(pair: &str, layouts: &[Layout], asked: &[Vec<Asked>]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (layout, found) in layouts.iter().zip(asked) {
        let reference = layouts.iter().position(|of| of.is_reference(layout.triangles));
        let right = &asked[reference.unwrap_or(0)];
        for (number, question) in QUESTIONS.into_iter().enumerate() {
            let expected = if question == Question::Collide { number } else { EXACT_DISTANCE };
            let answers = found[number].answers.iter().zip(&right[expected].answers);
            for (pose, (&found, &expected)) in (1..).zip(answers) {
                if !is_right(question, found, expected) {
                    wrong.push(format!(
                        "{pair}, {}, {} with an allowed error of {}, pose {pose}: expected {expected:?}, found {found:?}",
                        layout.name(),
                        question.name(),
                        question.rel_err().unwrap_or(0.0)
                    ));
                }
            }
        }
    }
    wrong
}

fn is_right(question: Question, found: f64, expected: f64) -> bool {
    match question {
        Question::Collide => found == expected,
        Question::Distance(0.0) => found.to_bits() == expected.to_bits(),
        Question::Distance(rel_err) => expected <= found && found <= expected * (1.0 + rel_err) * ROUNDING,
    }
}

/// Returns how far distances are from the exact ones: the median and the largest relative error, over the poses in which the
/// meshes are apart, and the largest error over all poses, mesh units.
fn errors_against(exact: &[f64], found: &[f64]) -> [Option<f64>; 3] {
    let pairs = || exact.iter().zip(found);
    let apart = pairs().filter(|(exact, _)| **exact > 0.0);
    let relative: Vec<f64> = apart.map(|(exact, found)| (found - exact).abs() / exact).collect();
    let largest = relative.iter().copied().reduce(f64::max);
    [median(relative), largest, pairs().map(|(exact, found)| (found - exact).abs()).reduce(f64::max)]
}

/// Returns the sentences about a pair, of which each mesh has a chosen layout, the most important one first.
fn sentences(rows: &[Cells], [a, b]: &[String; 2]) -> Vec<String> {
    // Layouts without loss, with the median times for contact and for distance, and their geometric mean.
    let asked = |question: &str| {
        let is_it = |row: &&Cells| text(row, "question") == question && is_exact(row) && !is_lossy(row);
        rows.iter().filter(is_it).collect::<Vec<_>>()
    };
    let time = |row: &Cells| number(row, "ns_median").unwrap_or(f64::INFINITY);
    let bytes = |row: &Cells| number(row, "file_bytes_per_tri").unwrap_or(f64::INFINITY);
    let of = |(collide, distance): (&Cells, &Cells)| {
        let [contact, far] = [collide, distance].map(time);
        let shown = format!(
            "{}: {} \u{b5}s for contact, {} \u{b5}s for distance, {:.1} bytes per triangle",
            text(collide, "layout"),
            micro(contact),
            micro(far),
            bytes(collide)
        );
        (text(collide, "layout"), (contact * far).sqrt(), bytes(collide), shown)
    };
    let all: Vec<_> = asked("collide").into_iter().zip(asked("distance")).map(of).collect();
    let fastest = all.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    let smallest = all.iter().min_by(|a, b| a.2.total_cmp(&b.2).then(a.1.total_cmp(&b.1)));
    let (Some(fastest), Some(smallest)) = (fastest, smallest) else { return Vec::new() };
    let chosen = all.iter().find(|of| of.0 == *a && a == b);
    vec![
        format!("The fastest layout is {}.", fastest.3),
        format!("The smallest one is {}; it takes {:.2} times as long.", smallest.3, smallest.1 / fastest.1),
        match chosen {
            Some(chosen) => format!(
                "Without options cbvh bake chooses {a}, which takes {:.2} times as long as the fastest.",
                chosen.1 / fastest.1
            ),
            None => format!("Without options cbvh bake chooses {a} for A and {b} for B."),
        },
    ]
}

/// Returns the plots of a pair: time against size for both exact questions, and time against error for distances.
fn figure(pair: &str, rows: &[Cells]) -> Figure {
    let look = |triangles: usize, is_filled| Look { kind: triangles, is_filled };
    let panel = |title: String, x, (x_field, front): (&str, &str), is_in: &dyn Fn(&Cells) -> bool| {
        let on_front = |row: &Cells| number(row, front) == Some(1.0);
        let mut found: Vec<((f64, f64), &Cells)> = rows
            .iter()
            .filter(|row| is_in(row))
            .filter_map(|row| Some(((number(row, x_field)?, number(row, "ns_median")? / 1000.0), row)))
            .collect();
        // The Pareto front is drawn on top of the other marks, from left to right.
        found.sort_by(|(at_a, a), (at_b, b)| on_front(a).cmp(&on_front(b)).then(at_a.0.total_cmp(&at_b.0)));
        let mark = |&(at, row): &((f64, f64), &Cells)| {
            let kind = TriangleEncoding::ALL.iter().position(|of| of.name() == text(row, "triangles"));
            Mark { at, look: look(kind.unwrap_or(0), on_front(row)) }
        };
        let name = |row| match number(row, "rel_err") {
            Some(rel_err) if rel_err > 0.0 => format!("{}, {} %", text(row, "layout"), 100.0 * rel_err),
            _ => text(row, "layout"),
        };
        let marks = found.iter().map(mark).collect();
        found.retain(|(_, row)| on_front(row));
        let line = Line { points: found.iter().map(|(at, _)| *at).collect(), look: None };
        let labels = found.iter().map(|&(at, row)| (at, name(row))).collect();
        Panel { title, x, y: "median time per query, \u{b5}s", lines: vec![line], marks, labels }
    };
    let by_bytes = |question: Question| {
        let title = format!("{pair}: {}, time against size", question.name());
        let is_in = |row: &Cells| text(row, "question") == question.name() && is_exact(row);
        panel(title, "bytes per triangle, whole file", ("file_bytes_per_tri", "pareto_bytes"), &is_in)
    };
    let by_error = panel(
        format!("{pair}: distance, time against error"),
        "largest relative error found",
        ("distance_error_max", "pareto_error"),
        &|_| true,
    );
    let names = ["f32 triangles", "packed: the same values", "quantised: vertices moved"];
    let mut legend: Vec<_> =
        (0..).zip(names).map(|(kind, name)| (look(kind, false), name.to_owned())).collect();
    legend.push((look(0, true), "filled: none beats it in both figures".into()));
    let [collide, distance] = Question::EXACT.map(by_bytes);
    Figure { title: pair.to_owned(), legend, rows: vec![vec![collide, distance], vec![by_error]] }
}

/// The columns of the tables about a question, and of the table about files.
const ASKED: [Column; 8] = [
    ("median, \u{b5}s", "ns_median", micro),
    ("90 %, \u{b5}s", "ns_p90", micro),
    ("bytes per triangle", "file_bytes_per_tri", tenths),
    ("largest error", "distance_error_max", percent),
    ("median error", "distance_error_median", percent),
    ("node tests", "node_tests", tenths),
    ("packet tests", "packet_tests", tenths),
    ("exact tests", "exact_tests", tenths),
];
const SIZES: [Column; 7] = [
    ("bytes per triangle", "file_bytes_per_tri", tenths),
    ("nodes", "node_bytes_per_tri", tenths),
    ("triangles", "triangle_bytes_per_tri", tenths),
    ("ids", "id_bytes_per_tri", tenths),
    ("width of bounds, excess", "width_inflation", excess),
    ("volume, excess", "volume_inflation", excess),
    ("vertices moved by, mesh units", "vertex_error", scientific),
];

/// Returns the tables of a pair: one for each question with the fastest layout first, and one of the files.
fn tables(rows: &[Cells]) -> String {
    let table_of = |title: &str, question: Question, by: &str, columns: &[Column]| {
        let is_it = |row: &&Cells| {
            text(row, "question") == question.name() && number(row, "rel_err") == question.rel_err()
        };
        let is_on_front =
            |row: &Cells| ["pareto_bytes", "pareto_error"].iter().any(|name| number(row, name) == Some(1.0));
        let name = |row: &Cells| text(row, "layout") + if is_on_front(row) { " \u{2022}" } else { "" };
        let mut found: Vec<_> = rows.iter().filter(is_it).map(|row| (name(row), row)).collect();
        let figure = |row: &Cells| number(row, by).unwrap_or(f64::INFINITY);
        found.sort_by(|(_, a), (_, b)| figure(a).total_cmp(&figure(b)));
        table(title, &["pair", "layout", "question", "rel_err"], &found, columns)
    };
    let mut text = String::new();
    for question in QUESTIONS {
        let title = match question {
            Question::Collide => "Contact".to_owned(),
            Question::Distance(0.0) => "Exact distance".to_owned(),
            Question::Distance(rel_err) => format!("Distance with an allowed error of {}", percent(rel_err)),
        };
        text += &table_of(&title, question, "ns_median", &ASKED);
    }
    text + &table_of("Files, the smallest first", Question::Collide, "file_bytes_per_tri", &SIZES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points = [(1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (3.0, 3.0), (4.0, 1.0), (1.0, 5.0)];
        let row = |(x, y)| vec![("x", Cell::Number(x)), ("ns_median", Cell::Number(y))];
        let mut rows: Vec<Cells> = points.map(row).to_vec();
        // A row of another group, and one without a figure.
        rows.extend([row((0.0, 0.0)), vec![("ns_median", Cell::Number(0.0))]]);
        mark_front(&mut rows, "front", "x", |row| (number(row, "x") != Some(0.0)).then(String::new));
        let found: Vec<Option<f64>> = rows.iter().map(|row| number(row, "front")).collect();
        let [yes, no] = [Some(1.0), Some(0.0)];
        assert_eq!(found, [yes, yes, no, no, yes, yes, None, None]);
        mark_front(&mut [], "front", "x", |_| None);
    }

    #[test]
    fn the_gaps_of_made_poses_are_named() {
        let gaps: Vec<String> = cbvh_measure::poses::GAPS[1..].iter().map(|gap| gap.to_string()).collect();
        assert!(MADE.contains(&gaps.join(", ")));
    }

    #[test]
    fn right_and_wrong_are_told_apart() {
        let exact = Question::Distance(0.0);
        assert!(is_right(exact, 2.0, 2.0) && !is_right(exact, 2.0f64.next_up(), 2.0));
        let loose = Question::Distance(0.1);
        assert!(is_right(loose, 2.2, 2.0) && is_right(loose, 2.0, 2.0) && is_right(loose, 0.0, 0.0));
        assert!(!is_right(loose, 2.21, 2.0) && !is_right(loose, 1.99, 2.0) && !is_right(loose, 0.1, 0.0));
        assert!(!is_right(loose, f64::NAN, 2.0));
        assert!(is_right(Question::Collide, 1.0, 1.0) && !is_right(Question::Collide, 0.0, 1.0));
    }

    #[test]
    fn relative_errors_are_of_poses_that_are_apart() {
        let errors = errors_against(&[0.0, 1.0, 2.0, 4.0], &[0.5, 1.0, 2.5, 3.0]);
        assert_eq!(errors, [Some(0.25), Some(0.25), Some(1.0)]);
        assert_eq!(errors_against(&[0.0], &[0.0]), [None, None, Some(0.0)]);
    }

    #[test]
    fn one_wrong_answer_is_named() {
        let layouts: Vec<Layout> = Layout::all().collect();
        // The answers in two poses, of which the second is 2 apart.
        let asked = |question: Question| {
            let answers = if question == Question::Collide { vec![1.0, 0.0] } else { vec![0.0, 2.0] };
            Asked { answers, ..Asked::default() }
        };
        let mut found = vec![QUESTIONS.map(asked).to_vec(); layouts.len()];
        assert!(judge("pair", &layouts, &found).is_empty());
        let place = layouts.iter().position(|layout| layout.name() == "dop6-u8 packed").unwrap();
        found[place][0].answers[1] = 1.0;
        assert_eq!(
            judge("pair", &layouts, &found),
            ["pair, dop6-u8 packed, collide with an allowed error of 0, pose 2: expected 0.0, found 1.0"]
        );
    }
}
