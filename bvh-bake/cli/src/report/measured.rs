//! Bakes one pair of meshes in all layouts, asks all questions and judges the answers.

use super::document::{Measured, PairRecord, Settings};
use super::layout::Layout;
use super::row::{Row, Size};
use super::{EXACT_DISTANCE, QUESTIONS, answers, pareto};
use crate::console::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, BakeReport, Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError};
use cbvh_measure::pairs::{Pair, spread_evenly};
use cbvh_measure::pin::pinned;
use cbvh_measure::rounds::{Asked, Question, Subject as Asking, rounds};
use cbvh_measure::spread::Spread;
use std::path::Path;
use std::sync::Arc;

/// The number of poses that are made for a pair without any.
const MADE_POSES: usize = 60;

/// A pair to measure.
pub(super) struct Subject<'a> {
    pub(super) pair: &'a Pair,
    pub(super) settings: &'a Settings,
    pub(super) backend: Backend,
    pub(super) tell: &'a (dyn Fn(&str) + Sync),
}

/// Both meshes in one layout.
pub(super) struct Baked {
    pub(super) layout: Layout,
    pub(super) a: Arc<Bvh>,
    /// The same as `a` if the pair is a mesh and itself.
    pub(super) b: Arc<Bvh>,
    pub(super) size: Size,
}

impl Subject<'_> {
    pub(super) fn measure(&self, meshes: &[Mesh; 2], given: Vec<Pose>) -> Result<Measured, Failure> {
        let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", self.pair.name));
        (self.tell)("baking");
        let bakes = Layout::all().map(|layout| self.bake(meshes, layout)).collect::<Result<Vec<_>, _>>()?;
        let (a, b) = (&bakes[0].a, &bakes[0].b);
        let are_made = given.is_empty();
        let all = if are_made {
            (self.tell)("making poses");
            let mut querier = Querier::with_backend(self.backend);
            cbvh_measure::poses::mixed(&mut querier, a, b, MADE_POSES).map_err(failed)?
        } else {
            given
        };
        let poses = spread_evenly(&all, self.settings.poses);
        (self.tell)("measuring");
        let subjects: Vec<_> =
            bakes.iter().map(|bake| Asking { a: &bake.a, b: &bake.b, poses: &poses }).collect();
        let (pinned, asked) = pinned(|| rounds(&subjects, &QUESTIONS, self.backend, self.settings.rounds));
        let asked = asked.map_err(failed)?;
        let layouts: Vec<Layout> = bakes.iter().map(|bake| bake.layout).collect();
        let (wrong, errors) = answers::judge(&self.pair.name, &layouts, &asked);
        let mut rows = Vec::new();
        let touching = touching(&bakes, &asked);
        for ((bake, asked), errors) in bakes.iter().zip(&asked).zip(errors) {
            for ((question, asked), errors) in QUESTIONS.into_iter().zip(asked).zip(errors) {
                rows.push(Row {
                    pair: self.pair.name.clone(),
                    layout: bake.layout,
                    question,
                    poses: poses.len() as u64,
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
        let chosen = [self.chosen(&self.pair.a, &meshes[0])?, self.chosen(&self.pair.b, &meshes[1])?];
        let record = PairRecord::new(self.pair, [a, b], chosen, poses.len(), are_made, pinned);
        Ok(Measured { record, rows, wrong })
    }

    fn bake(&self, meshes: &[Mesh; 2], layout: Layout) -> Result<Baked, Failure> {
        let (a, report_a) = bake(&self.pair.a, &meshes[0], &layout.options())?;
        let is_same = self.pair.a == self.pair.b;
        let (b, report_b) = if is_same {
            (a.clone(), report_a.clone())
        } else {
            bake(&self.pair.b, &meshes[1], &layout.options())?
        };
        let weights = [&a, &b].map(|bvh| bvh.objects()[0].record().treelets.get() as f64);
        Ok(Baked { layout, a, b, size: size_of([&report_a, &report_b], weights) })
    }

    /// Returns the layout that the baker chooses by itself.
    fn chosen(&self, path: &Path, mesh: &Mesh) -> Result<Layout, Failure> {
        let (_, report) = bake(path, mesh, &Options::default())?;
        let (profile, triangles) = (report.file.profile, report.file.triangle_encoding);
        Ok(Layout { profile, triangles, without_turning_slabs: false })
    }
}

fn bake(path: &Path, mesh: &Mesh, options: &Options) -> Result<(Arc<Bvh>, BakeReport), Failure> {
    let failed = |error: &BakeError| Failure::from_bake(&path.display().to_string(), error);
    let (bytes, report) = to_bytes(mesh, options).map_err(|error| failed(&error))?;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(&BakeError::Unproved(error)))?;
    // No timed query pays for the first touch of a page.
    bvh.check_all().map_err(|error| Failure::invalid(path, error))?;
    Ok((Arc::new(bvh), report))
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
