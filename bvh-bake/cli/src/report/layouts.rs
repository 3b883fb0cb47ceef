//! Which layout suits these meshes: how fast each one answers, how many bytes it takes, and with what error.
//!
//! Each pair is baked in every profile with every encoding of triangles and, where it has them, without turning slabs. Then
//! it is asked in all its poses, and judged.

mod answers;
mod section;

use super::meshes::{bake_both, layout_of};
use super::{Cells, Kind, Limit, Measured, PairRecord, SideRecord, Subject, files_of};
use crate::asking::poses;
use crate::console::Failure;
use answers::Errors;
use bvh_bake::{BakeReport, Options};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose, Querier, QueryError};
use cbvh_measure::pin::pinned;
use cbvh_measure::poses::{GAPS, mixed};
use cbvh_measure::rounds::{Asked, Question, Subject as Asking, Work, rounds};
use cbvh_measure::spread::Spread;
use cbvh_measure::table::{self, Cell};
use std::sync::Arc;

pub(super) const KIND: Kind<Pose> =
    Kind { words: section::WORDS, limit: Limit::Poses, read: poses::read, measure };

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
/// The number of poses that are made for a pair without any.
const MADE_POSES: usize = 60;

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

    /// Returns whether it has turning slabs; `None` if its profile has no room for any.
    fn has_turning_slabs(self) -> Option<bool> {
        self.profile.has_turning_slabs().then_some(!self.without_turning_slabs)
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

    /// True if vertices may have moved more than rounding to `f32` moves them.
    fn is_lossy(self) -> bool {
        self.triangles == TriangleEncoding::Quantized
    }
}

/// Figures of a layout that do not depend on the question, with their names.
type Size = [(&'static str, f64); 7];

/// A row: one question put to one layout of one pair of meshes.
#[derive(Debug, Clone)]
struct Row {
    layout: Layout,
    question: Question,
    poses: u64,
    touching: u64,
    time: Option<Spread>,
    work: Work,
    size: Size,
    errors: Errors,
    /// For distances: no other row of the pair is at least as fast with at most this error.
    pareto_error: Option<bool>,
    /// For exact questions to layouts without loss: no other one is at least as fast with at most these bytes.
    pareto_bytes: Option<bool>,
}

impl Row {
    /// The median time in nanoseconds.
    fn nanoseconds(&self) -> Option<f64> {
        self.time.map(|time| time.median)
    }

    /// Bytes per triangle of both files together.
    fn file_bytes(&self) -> f64 {
        self.size[3].1
    }

    fn cells(&self, pair: &str) -> Cells {
        let mut cells = vec![
            ("pair", Cell::text(pair)),
            ("layout", Cell::Text(self.layout.name())),
            ("profile", Cell::text(self.layout.profile.name())),
            ("triangles", Cell::text(self.layout.triangles.name())),
            ("turning_slabs", Cell::flag(self.layout.has_turning_slabs())),
            ("question", Cell::text(self.question.name())),
            ("rel_err", Cell::number(self.question.rel_err())),
            ("poses", Cell::Count(self.poses)),
            ("touching", Cell::Count(self.touching)),
        ];
        cells.extend(table::times(["ns_median", "ns_q1", "ns_q3", "ns_p90"], self.time));
        cells.extend(table::work(self.work));
        cells.extend(self.size.map(|(name, value)| (name, Cell::number(Some(value)))));
        cells.extend([
            ("distance_error_median", Cell::number(self.errors.median)),
            ("distance_error_max", Cell::number(self.errors.max)),
            ("distance_error_max_length", Cell::number(self.errors.max_length)),
            ("pareto_error", Cell::flag(self.pareto_error)),
            ("pareto_bytes", Cell::flag(self.pareto_bytes)),
        ]);
        cells
    }
}

/// Both meshes in one layout.
struct Baked {
    layout: Layout,
    a: Arc<Bvh>,
    b: Arc<Bvh>,
    size: Size,
}

/// Measures all layouts of a pair in the given poses, or in poses that are made.
fn measure(subject: &Subject<'_>, given: Vec<Pose>) -> Result<Measured, Failure> {
    let Subject { pair, settings, backend, tell, .. } = *subject;
    let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", pair.name));
    tell("baking");
    let baked = |layout: Layout| -> Result<Baked, Failure> {
        let [(a, report_a), (b, report_b)] = bake_both(subject, &layout.options())?;
        let weights = [&a, &b].map(|bvh| bvh.objects()[0].record().treelets.get() as f64);
        Ok(Baked { layout, a, b, size: size_of([&report_a, &report_b], weights) })
    };
    let bakes = Layout::all().map(baked).collect::<Result<Vec<_>, _>>()?;
    let (a, b) = (&bakes[0].a, &bakes[0].b);
    let (from, all) = if given.is_empty() {
        tell("making poses");
        (made(), mixed(&mut Querier::with_backend(backend), a, b, MADE_POSES).map_err(failed)?)
    } else {
        (files_of(pair), given)
    };
    let poses = settings.some_of(&all);
    tell("measuring");
    let subjects: Vec<_> =
        bakes.iter().map(|bake| Asking { a: &bake.a, b: &bake.b, poses: &poses }).collect();
    let (pinned, asked) = pinned(|| rounds(&subjects, &QUESTIONS, backend, settings.rounds));
    let asked = asked.map_err(failed)?;
    let layouts: Vec<Layout> = bakes.iter().map(|bake| bake.layout).collect();
    let (wrong, errors) = answers::judge(&pair.name, &layouts, &asked);
    let rows = rows(&bakes, &asked, errors);
    let chosen = bake_both(subject, &Options::default())?.map(|(_, report)| layout_of(&report));
    let section = section::section(&pair.name, &rows, &chosen, poses.len(), &from);
    let items = serde_json::json!({ "poses_from": from, "poses": poses.len() });
    let [chosen_a, chosen_b] = chosen;
    let (a, b) = (SideRecord::new(&pair.a, a, chosen_a), SideRecord::new(&pair.b, b, chosen_b));
    let record = PairRecord { name: pair.name.clone(), a, b, items, pinned, section };
    Ok(Measured { record, rows: rows.iter().map(|row| row.cells(&pair.name)).collect(), wrong })
}

/// Says how poses are made.
fn made() -> String {
    let gaps: Vec<String> = GAPS[1..].iter().map(|gap| gap.to_string()).collect();
    format!("made: a fifth overlaps, the others have gaps of {} of A's diagonal", gaps.join(", "))
}

/// Returns the rows of a pair, with the fronts marked.
fn rows(bakes: &[Baked], asked: &[Vec<Asked>], errors: Vec<Vec<Errors>>) -> Vec<Row> {
    let (mut rows, touching) = (Vec::new(), touching(bakes, asked));
    for ((bake, asked), errors) in bakes.iter().zip(asked).zip(errors) {
        for ((question, asked), errors) in QUESTIONS.into_iter().zip(asked).zip(errors) {
            rows.push(Row {
                layout: bake.layout,
                question,
                poses: asked.answers.len() as u64,
                touching,
                time: Spread::of_rounds(&asked.rounds),
                work: asked.work(),
                size: bake.size,
                errors,
                pareto_error: None,
                pareto_bytes: None,
            });
        }
    }
    mark_fronts(&mut rows);
    rows
}

/// The sizes of both files together; `treelets` weights the means over nodes.
fn size_of(reports: [&BakeReport; 2], treelets: [f64; 2]) -> Size {
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

/// The number of poses in which the reference layout finds contact.
fn touching(bakes: &[Baked], asked: &[Vec<Asked>]) -> u64 {
    let reference = bakes.iter().position(|bake| bake.layout.is_reference(TriangleEncoding::F32));
    QUESTIONS[EXACT_DISTANCE].touching(&asked[reference.unwrap_or(0)][EXACT_DISTANCE].answers)
}

/// Marks the rows of a pair that no other row beats.
fn mark_fronts(rows: &mut [Row]) {
    let is_distance = |row: &Row| row.question != Question::Collide;
    let by_error = |row: &Row| Some((row.errors.max?, row.nanoseconds()?));
    mark(rows, is_distance, by_error, |row, flag| row.pareto_error = Some(flag));
    for question in Question::EXACT {
        // Quantised triangles are smaller because they lose something: they do not compete with the others.
        let lossless = |row: &Row| row.question == question && !row.layout.is_lossy();
        let by_bytes = |row: &Row| Some((row.file_bytes(), row.nanoseconds()?));
        mark(rows, lossless, by_bytes, |row, flag| row.pareto_bytes = Some(flag));
    }
}

fn mark(
    rows: &mut [Row],
    is_in: impl Fn(&Row) -> bool,
    figures: impl Fn(&Row) -> Option<(f64, f64)>,
    set: impl Fn(&mut Row, bool),
) {
    let found = rows.iter().enumerate().filter(|(_, row)| is_in(row));
    let (places, points): (Vec<usize>, Vec<_>) =
        found.filter_map(|(place, row)| Some((place, figures(row)?))).unzip();
    for (place, flag) in places.into_iter().zip(front(&points)) {
        set(&mut rows[place], flag);
    }
}

/// Returns for each point whether it is on the Pareto front: no other is at least as good in both figures, of which less is
/// better, and better in one.
fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && (a.0 < b.0 || a.1 < b.1);
    points.iter().map(|point| !points.iter().any(|other| beats(other, point))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats_is_on_the_front() {
        let points = [(1.0, 5.0), (2.0, 3.0), (2.0, 4.0), (3.0, 3.0), (4.0, 1.0), (1.0, 5.0)];
        assert_eq!(front(&points), [true, true, false, false, true, true]);
        assert!(front(&[]).is_empty());
    }
}
