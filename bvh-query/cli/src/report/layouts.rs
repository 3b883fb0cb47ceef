//! Which layout suits these meshes: how fast each one answers, how many bytes it takes, and how large its errors are.
//!
//! Each pair is baked in every profile with every encoding of triangles. Then it is queried in all its poses, and the
//! answers are compared with those of the reference: the profile of plain floats, with the same triangles. For given
//! triangles, contact and exact distances have one right answer, bit for bit. With an allowed error, the answer lies
//! between the least distance and that much more. Quantised triangles have moved, and so have different answers. Their
//! difference from the answers for the mesh itself is an error that is reported.

use super::inputs::bake_both;
use super::page::{Column, Table, Words, excess, figure, micro, percent};
use super::plot::{Panel, Series};
use super::timing::{median, order, take_turn, times};
use super::{Kind, Measured, Subject, layout_of, made};
use crate::asking::files::read_poses;
use crate::asking::runner::add;
use crate::console::{Failure, Record, record};
use bvh_bake::{BakeReport, Options};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, DistanceOptions, Pose, Querier, QueryError, QueryStats};

pub(super) const KIND: Kind<Pose> = Kind {
    words: Words { title: "Which layout for these meshes?", about: ABOUT, right: RIGHT, methods: METHODS },
    items: "poses",
    read: read_poses,
    make: made::poses,
    made: made::POSES,
    measure,
};

const ABOUT: &str = "\
A layout is how a <code>.cbvh</code> file stores bounding volumes (its profile) and triangles (their encoding). This page \
tells for each pair of meshes how fast each layout answers, how many bytes it takes, and how far its distances are from the \
exact ones.";

const RIGHT: &str = "\
All answers are right: layouts that store the same triangles agree about contact, and about distances to the last bit. \
Distances with an allowed error were within it.";

const METHODS: &str = "\
<li>Times are those of single queries on one thread. All layouts take turns in each round, \
with three untimed queries before each turn, so caches hold what earlier queries left there. A median is taken over the \
poses of a round and then over the rounds; nine tenths of the poses take less than the 90 % time.</li>
<li>A dot marks a layout that no other layout without loss beats in both time and bytes, and a distance that no other beats \
in both time and error. Errors are relative to the exact distance of the mesh, over the poses in which the meshes are apart.</li>
<li>Node tests compare up to 16 pairs of bounding volumes at once, packet tests up to 16 pairs of triangles; what these \
cannot decide goes to exact tests, each of one pair of triangles.</li>
<li>The figures are of one machine on one day. They depend on the mix of poses near contact and far apart, and files that \
are not in memory yet take longer in their first queries.</li>";

/// A question about two meshes in a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Question {
    /// Do they touch?
    Collide,
    /// How far apart are they, with an allowed relative error?
    Distance(f64),
}

/// What is asked.
const QUESTIONS: [Question; 5] = [
    Question::Collide,
    EXACT_DISTANCE,
    Question::Distance(1e-3),
    Question::Distance(1e-2),
    Question::Distance(1e-1),
];
const EXACT_DISTANCE: Question = Question::Distance(0.0);
/// The place of the exact distance in [`QUESTIONS`].
const EXACT: usize = 1;

impl Question {
    /// Returns the name in tables.
    fn name(self) -> &'static str {
        if self == Self::Collide { "collide" } else { "distance" }
    }

    /// Returns the allowed relative error of a distance.
    fn rel_err(self) -> Option<f64> {
        if let Self::Distance(rel_err) = self { Some(rel_err) } else { None }
    }

    /// Returns the answer as a number: 1 for contact, or the distance in mesh units.
    #[inline]
    fn ask(self, querier: &mut Querier, a: &Bvh, b: &Bvh, pose: &Pose) -> Result<f64, QueryError> {
        Ok(match self {
            Self::Collide => f64::from(u8::from(querier.collide(a, b, pose)?)),
            Self::Distance(rel_err) => {
                let options = DistanceOptions::new().rel_err(rel_err);
                querier.distance_with(a, b, pose, &options)?.distance
            }
        })
    }
}

/// How a file is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Layout {
    profile: Profile,
    triangles: TriangleEncoding,
}

impl Layout {
    /// Returns all layouts.
    fn all() -> impl Iterator<Item = Self> {
        let encodings = |profile| TriangleEncoding::ALL.map(|triangles| Self { profile, triangles });
        Profile::ALL.into_iter().flat_map(encodings)
    }

    /// Returns the name in tables.
    fn name(self) -> String {
        format!("{} {}", self.profile.name(), self.triangles.name())
    }

    /// Returns the place of the layout whose answers all layouts with these triangles must give: bounds in plain floats.
    fn reference(triangles: TriangleEncoding) -> usize {
        Self::all().position(|of| of.profile == Profile::Dop14F32 && of.triangles == triangles).unwrap_or(0)
    }
}

/// Both meshes in one layout.
struct Baked {
    layout: Layout,
    a: Bvh,
    b: Bvh,
    /// Figures that do not depend on the question.
    size: Record,
}

/// The answers and times of one question to one layout.
#[derive(Debug, Default, Clone)]
struct Asked {
    /// The answer in each pose.
    answers: Vec<f64>,
    /// Nanoseconds by round and pose.
    rounds: Vec<Vec<u64>>,
    /// The work of one round, summed over the poses.
    stats: QueryStats,
}

/// Measures all layouts of a pair in the given poses.
fn measure(subject: &Subject<'_>, poses: &[Pose]) -> Result<Measured, Failure> {
    let Subject { pair, meshes, backend, rounds, .. } = *subject;
    let bake = |layout: Layout| -> Result<Baked, Failure> {
        let options = Options::default().profile(layout.profile).triangles(layout.triangles);
        let [(a, report_a), (b, report_b)] = bake_both(pair, meshes, &options)?;
        let weights = [&a, &b].map(|bvh| bvh.objects()[0].record().treelets.get() as f64);
        Ok(Baked { layout, a, b, size: size_of([&report_a, &report_b], weights) })
    };
    let bakes = Layout::all().map(bake).collect::<Result<Vec<_>, _>>()?;
    let asked = ask(&bakes, poses, backend, rounds);
    let asked = asked.map_err(|error| Failure::Invalid(format!("{}: {error}", pair.name)))?;
    let rows = rows(&pair.name, &bakes, &asked);
    let chosen = subject.baked.each_ref().map(|(_, report)| layout_of(report));
    Ok(Measured {
        sentences: sentences(&rows, &chosen),
        panels: panels(&pair.name, &rows),
        tables: tables(&rows),
        rows,
        wrong: judge(&pair.name, &asked),
        seen: poses.get(nearest(&asked[Layout::reference(TriangleEncoding::F32)][EXACT].answers)).copied(),
        ..Measured::default()
    })
}

/// Returns the place of the least distance, the first of several.
fn nearest(distances: &[f64]) -> usize {
    let least = distances.iter().enumerate().min_by(|(_, one), (_, other)| one.total_cmp(other));
    least.map_or(0, |(place, _)| place)
}

/// Asks all layouts all questions. The result is indexed by layout, then by question.
fn ask(
    bakes: &[Baked],
    poses: &[Pose],
    backend: Backend,
    rounds: usize,
) -> Result<Vec<Vec<Asked>>, QueryError> {
    let mut all = vec![vec![Asked::default(); QUESTIONS.len()]; bakes.len()];
    let mut queriers: Vec<Querier> = bakes.iter().map(|_| Querier::with_backend(backend)).collect();
    for round in 0..rounds {
        for (number, question) in QUESTIONS.into_iter().enumerate() {
            for layout in order(round, bakes.len()) {
                let (querier, Baked { a, b, .. }) = (&mut queriers[layout], &bakes[layout]);
                let (answers, nanoseconds) = take_turn(poses, |pose| {
                    let answer = question.ask(querier, a, b, pose)?;
                    Ok((answer, querier.stats()))
                })?;
                let asked = &mut all[layout][number];
                if round == 0 {
                    answers.iter().for_each(|&(_, stats)| add(&mut asked.stats, stats));
                    asked.answers = answers.into_iter().map(|(answer, _)| answer).collect();
                }
                asked.rounds.push(nanoseconds);
            }
        }
    }
    Ok(all)
}

/// Returns the rows of a pair: one question put to one layout, with the fronts marked.
fn rows(pair: &str, bakes: &[Baked], asked: &[Vec<Asked>]) -> Vec<Record> {
    let exact = &asked[Layout::reference(TriangleEncoding::F32)][EXACT].answers;
    let touching = exact.iter().filter(|&&distance| distance == 0.0).count();
    let mut rows = Vec::new();
    for (Baked { layout, size, .. }, asked) in bakes.iter().zip(asked) {
        for (question, asked) in QUESTIONS.into_iter().zip(asked) {
            let mean = |count: u64| count as f64 / asked.answers.len() as f64;
            let [median, max, max_length] = match question {
                Question::Collide => [None; 3],
                Question::Distance(_) => errors_against(exact, &asked.answers),
            };
            let row = record! {
                pair: pair,
                layout: layout.name(),
                profile: layout.profile.name(),
                triangles: layout.triangles.name(),
                question: question.name(),
                rel_err: question.rel_err(),
                poses: asked.answers.len(),
                touching: touching,
            };
            rows.push(
                row.with(times(&asked.rounds))
                    .with(record! {
                        node_tests: mean(asked.stats.node_tests),
                        packet_tests: mean(asked.stats.packet_tests),
                        exact_tests: mean(asked.stats.exact_tests),
                    })
                    .with(size.clone())
                    .with(record! {
                        distance_error_median: median,
                        distance_error_max: max,
                        distance_error_max_length: max_length,
                    }),
            );
        }
    }
    // Of distances, what no other row beats in time and error; of exact questions to layouts without loss, in time and bytes.
    let front = front_of(&rows, "distance_error_max", |row| Some(row.text("question")));
    let rows = rows.into_iter().zip(front).map(|(row, front)| row.with(record! { pareto_error: front }));
    let rows: Vec<Record> = rows.collect();
    // Quantised triangles are smaller because they lose something: they do not compete with the others.
    let exact = |row: &Record| Some(row.text("question")).filter(|_| is_exact(row) && !is_lossy(row));
    let front = front_of(&rows, "file_bytes_per_tri", exact);
    rows.into_iter().zip(front).map(|(row, front)| row.with(record! { pareto_bytes: front })).collect()
}

fn is_exact(row: &Record) -> bool {
    row.number("rel_err").is_none_or(|rel_err| rel_err == 0.0)
}

/// Returns true if vertices may have moved more than rounding to `f32` moves them.
fn is_lossy(row: &Record) -> bool {
    row.text("triangles") == TriangleEncoding::Quantized.name()
}

/// The sizes of both files together; `treelets` weights the means over nodes.
fn size_of(reports: [&BakeReport; 2], treelets: [f64; 2]) -> Record {
    let triangles: u64 = reports.iter().map(|report| report.file.triangles).sum();
    let per_triangle = |of: fn(&BakeReport) -> u64| {
        reports.iter().map(|report| of(report)).sum::<u64>() as f64 / triangles as f64
    };
    let mean = |of: fn(&BakeReport) -> f64| {
        let [a, b] = reports.map(of);
        (a * treelets[0] + b * treelets[1]) / (treelets[0] + treelets[1])
    };
    let moved = |report: &BakeReport| report.file.max_vertex_rounding.max(report.file.max_quantization_error);
    record! {
        node_bytes_per_tri: per_triangle(|report| report.file.node_bytes),
        triangle_bytes_per_tri: per_triangle(|report| report.file.triangle_bytes),
        id_bytes_per_tri: per_triangle(|report| report.file.id_bytes),
        file_bytes_per_tri: per_triangle(|report| report.file.file_bytes),
        // Means over the nodes of decoded width over tight width, and of decoded over tight box volume.
        width_inflation: mean(|report| report.width_inflation),
        volume_inflation: mean(|report| report.volume_inflation),
        // The farthest that a vertex was moved, mesh units.
        vertex_error: moved(reports[0]).max(moved(reports[1])),
    }
}

/// Returns for each row whether it is on the Pareto front of its group: no other is at least as good in time and in the
/// figure `x`, of which less is better, and better in one. Returns `None` for rows without a group or a figure.
fn front_of(rows: &[Record], x: &str, group: impl Fn(&Record) -> Option<String>) -> Vec<Option<bool>> {
    let point = |row: &Record| Some((group(row)?, row.number(x)?, row.number("ns_median")?));
    let points: Vec<_> = rows.iter().map(point).collect();
    let is_beaten = |(of, x, y): &(String, f64, f64)| {
        points
            .iter()
            .flatten()
            .any(|other| other.0 == *of && other.1 <= *x && other.2 <= *y && (other.1 < *x || other.2 < *y))
    };
    points.iter().map(|point| point.as_ref().map(|point| !is_beaten(point))).collect()
}

/// The factor that allows for rounding in the product of a distance and 1 + an allowed error: two roundings of 2^-53
/// each are needed, and the factor allows eight.
const ROUNDING: f64 = 1.0 + 4.0 * f64::EPSILON;

/// Returns the wrong answers of all layouts, one line each.
fn judge(pair: &str, asked: &[Vec<Asked>]) -> Vec<String> {
    let mut wrong = Vec::new();
    for (layout, found) in Layout::all().zip(asked) {
        let right = &asked[Layout::reference(layout.triangles)];
        for (number, question) in QUESTIONS.into_iter().enumerate() {
            let expected = if question == Question::Collide { number } else { EXACT };
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
fn sentences(rows: &[Record], [a, b]: &[String; 2]) -> Vec<String> {
    // Layouts without loss, with the geometric mean of their median times for contact and for distance, and their bytes.
    let asked = |question: &'static str| {
        rows.iter().filter(move |row| row.text("question") == question && is_exact(row) && !is_lossy(row))
    };
    let number = |row: &Record, name| row.number(name).unwrap_or(f64::INFINITY);
    let of = |(collide, distance): (&Record, &Record)| {
        let [contact, far] = [collide, distance].map(|row| number(row, "ns_median"));
        let (layout, bytes) = (collide.text("layout"), number(collide, "file_bytes_per_tri"));
        let [a, b] = [contact, far].map(|time| format!("{} \u{b5}s", micro(time)));
        let shown = format!("{layout}: {a} for contact, {b} for distance, {bytes:.1} bytes per triangle");
        (layout, (contact * far).sqrt(), bytes, shown)
    };
    let all: Vec<_> = asked("collide").zip(asked("distance")).map(of).collect();
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
fn panels(pair: &str, rows: &[Record]) -> Vec<Panel> {
    let panel = |title: String, x, field: &str, front: &str, is_in: &dyn Fn(&Record) -> bool| {
        let at = |row: &Record| Some((row.number(field)?, row.number("ns_median")? / 1000.0));
        let shown = || rows.iter().filter(|row| is_in(row)).filter_map(|row| Some((at(row)?, row)));
        let names = ["f32 triangles", "packed: the same values", "quantised: vertices moved"];
        let of = |(triangles, name): (TriangleEncoding, &'static str)| {
            let of = shown().filter(|(_, row)| row.text("triangles") == triangles.name());
            Series { name, is_joined: false, points: of.map(|(at, _)| (at, None)).collect() }
        };
        let mut series: Vec<Series> = TriangleEncoding::ALL.into_iter().zip(names).map(of).collect();
        let label = |row: &Record| match row.number("rel_err") {
            Some(rel_err) if rel_err > 0.0 => format!("{}, {} %", row.text("layout"), 100.0 * rel_err),
            _ => row.text("layout"),
        };
        let best = shown().filter(|(_, row)| row.number(front) == Some(1.0));
        let mut points: Vec<_> = best.map(|(at, row)| (at, Some(label(row)))).collect();
        points.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0));
        series.push(Series { name: "joined: none beats it in both figures", is_joined: true, points });
        Panel { title: format!("{pair}: {title}"), x, y: "median time per query, \u{b5}s", series }
    };
    let by_bytes = |question: Question| {
        let title = format!("{}, time against size", question.name());
        let is_in = |row: &Record| row.text("question") == question.name() && is_exact(row);
        panel(title, "bytes per triangle, whole file", "file_bytes_per_tri", "pareto_bytes", &is_in)
    };
    let title = "distance, time against error".to_owned();
    let by_error =
        panel(title, "largest relative error found", "distance_error_max", "pareto_error", &|_| true);
    vec![by_bytes(Question::Collide), by_bytes(EXACT_DISTANCE), by_error]
}

/// The columns of the tables. `report.csv` has more about the files.
const COLUMNS: [Column; 10] = [
    ("median, \u{b5}s", "ns_median", micro),
    ("90 %, \u{b5}s", "ns_p90", micro),
    ("bytes per triangle", "file_bytes_per_tri", figure),
    ("largest error", "distance_error_max", percent),
    ("median error", "distance_error_median", percent),
    ("node tests", "node_tests", figure),
    ("packet tests", "packet_tests", figure),
    ("exact tests", "exact_tests", figure),
    ("width of bounds, excess", "width_inflation", excess),
    ("vertices moved by, mesh units", "vertex_error", figure),
];

/// Returns the tables of a pair: one for each question, with the fastest layout first.
fn tables(rows: &[Record]) -> Vec<Table> {
    let is_front =
        |row: &Record| ["pareto_bytes", "pareto_error"].iter().any(|name| row.number(name) == Some(1.0));
    let name = |row: &Record| row.text("layout") + if is_front(row) { " \u{2022}" } else { "" };
    let table = |question: Question| {
        let title = match question {
            Question::Collide => "Contact".to_owned(),
            EXACT_DISTANCE => "Exact distance".to_owned(),
            Question::Distance(rel_err) => format!("Distance with an allowed error of {}", percent(rel_err)),
        };
        let is_it = |(_, row): &(usize, &Record)| {
            row.text("question") == question.name() && row.number("rel_err") == question.rel_err()
        };
        let mut found: Vec<_> = rows.iter().enumerate().filter(is_it).collect();
        let time = |row: &Record| row.number("ns_median").unwrap_or(f64::INFINITY);
        found.sort_by(|(_, a), (_, b)| time(a).total_cmp(&time(b)));
        let rows = found.into_iter().map(|(place, row)| (name(row), place)).collect();
        Table { title, columns: &COLUMNS, rows }
    };
    QUESTIONS.into_iter().map(table).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points = [(1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (3.0, 3.0), (4.0, 1.0), (1.0, 5.0)];
        let row = |(x, y): (f64, f64)| record! { x: x, ns_median: y };
        let mut rows = points.map(row).to_vec();
        // A row of another group, and one without a figure.
        rows.extend([row((0.0, 0.0)), record! { ns_median: 0 }]);
        let found = front_of(&rows, "x", |row| (row.number("x") != Some(0.0)).then(String::new));
        let [yes, no] = [Some(true), Some(false)];
        assert_eq!(found, [yes, yes, no, no, yes, yes, None, None]);
        assert!(front_of(&[], "x", |_| None).is_empty());
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
        assert!(judge("pair", &found).is_empty());
        let place = layouts.iter().position(|layout| layout.name() == "dop6-u8 packed").unwrap();
        found[place][0].answers[1] = 1.0;
        assert_eq!(
            judge("pair", &found),
            ["pair, dop6-u8 packed, collide with an allowed error of 0, pose 2: expected 0.0, found 1.0"]
        );
    }
}
