//! Bakes one pair of meshes in all layouts, asks all questions and judges the answers.

use super::layout::Layout;
use super::row::{Errors, Row, Size};
use super::{EXACT_DISTANCE, Layouts, PairRecord, Poses, QUESTIONS, answers, pareto};
use crate::console::Failure;
use crate::report::baked::{bake_both, layout_of};
use crate::report::document::{Measured, files_of};
use crate::report::kind::Subject;
use bvh_bake::{BakeReport, Options};
use bvh_format::leaf::TriangleEncoding;
use bvh_query::{Bvh, Pose, Querier, QueryError};
use cbvh_measure::pairs::spread_evenly;
use cbvh_measure::pin::pinned;
use cbvh_measure::poses::GAPS;
use cbvh_measure::rounds::{Asked, Question, Subject as Asking, rounds};
use cbvh_measure::spread::Spread;
use std::sync::Arc;

/// The number of poses that are made for a pair without any.
const MADE_POSES: usize = 60;

/// Both meshes in one layout.
struct Baked {
    layout: Layout,
    a: Arc<Bvh>,
    b: Arc<Bvh>,
    size: Size,
}

/// Measures all layouts of a pair in the given poses, or in poses that are made.
pub(super) fn measure(subject: &Subject<'_>, given: Vec<Pose>) -> Result<Measured<Layouts>, Failure> {
    let Subject { pair, settings, backend, tell, .. } = *subject;
    let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", pair.name));
    tell("baking");
    let bakes = Layout::all().map(|layout| baked(subject, layout)).collect::<Result<Vec<_>, _>>()?;
    let (a, b) = (&bakes[0].a, &bakes[0].b);
    let are_made = given.is_empty();
    let all = if are_made {
        tell("making poses");
        let mut querier = Querier::with_backend(backend);
        cbvh_measure::poses::mixed(&mut querier, a, b, MADE_POSES).map_err(failed)?
    } else {
        given
    };
    let poses = spread_evenly(&all, settings.limit());
    tell("measuring");
    let subjects: Vec<_> =
        bakes.iter().map(|bake| Asking { a: &bake.a, b: &bake.b, poses: &poses }).collect();
    let (pinned, asked) = pinned(|| rounds(&subjects, &QUESTIONS, backend, settings.rounds));
    let asked = asked.map_err(failed)?;
    let layouts: Vec<Layout> = bakes.iter().map(|bake| bake.layout).collect();
    let (wrong, errors) = answers::judge(&pair.name, &layouts, &asked);
    let rows = rows(&pair.name, &bakes, &asked, errors);
    let poses_from = if are_made { made() } else { files_of(pair) };
    let items = Poses { poses_from, poses: poses.len() };
    let record = PairRecord::new(pair, [a, b], chosen(subject)?, items, pinned);
    Ok(Measured { record, rows, wrong })
}

/// Says how poses are made.
fn made() -> String {
    let gaps: Vec<String> = GAPS[1..].iter().map(|gap| gap.to_string()).collect();
    format!("made: a fifth overlaps, the others have gaps of {} of A's diagonal", gaps.join(", "))
}

/// Bakes both meshes of a pair in one layout.
fn baked(subject: &Subject<'_>, layout: Layout) -> Result<Baked, Failure> {
    let [(a, report_a), (b, report_b)] = bake_both(subject, &layout.options())?;
    let weights = [&a, &b].map(|bvh| bvh.objects()[0].record().treelets.get() as f64);
    Ok(Baked { layout, a, b, size: size_of([&report_a, &report_b], weights) })
}

/// Returns the layouts that the baker chooses by itself.
fn chosen(subject: &Subject<'_>) -> Result<[String; 2], Failure> {
    Ok(bake_both(subject, &Options::default())?.map(|(_, report)| layout_of(&report)))
}

/// Returns the rows of a pair, with the fronts marked.
fn rows(pair: &str, bakes: &[Baked], asked: &[Vec<Asked>], errors: Vec<Vec<Errors>>) -> Vec<Row> {
    let (mut rows, touching) = (Vec::new(), touching(bakes, asked));
    for ((bake, asked), errors) in bakes.iter().zip(asked).zip(errors) {
        for ((question, asked), errors) in QUESTIONS.into_iter().zip(asked).zip(errors) {
            rows.push(Row {
                pair: pair.to_owned(),
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
    Size {
        node_bytes: per_triangle(|report| report.file.node_bytes),
        triangle_bytes: per_triangle(|report| report.file.triangle_bytes),
        id_bytes: per_triangle(|report| report.file.id_bytes),
        file_bytes: per_triangle(|report| report.file.file_bytes),
        width_inflation: mean(|report| report.width_inflation),
        volume_inflation: mean(|report| report.volume_inflation),
        vertex_error: moved(reports[0]).max(moved(reports[1])),
    }
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
        let by_bytes = |row: &Row| Some((row.size.file_bytes, row.nanoseconds()?));
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
    for (place, flag) in places.into_iter().zip(pareto::front(&points)) {
        set(&mut rows[place], flag);
    }
}
