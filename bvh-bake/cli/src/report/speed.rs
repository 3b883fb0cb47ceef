//! The report on speed against error: bakes each pair in all variants, measures, judges, writes four files.

use super::measure::{self, Asked, Baked, Question};
use super::model::{Counts, Cut, Predictor, Tree, walk};
use super::row::{Errors, Modelled, Row, Size, Work};
use super::spread::Spread;
use super::variant::{self, Group, USUAL, Variant};
use super::{answers, cold, files, html, json, pairs, pareto, pin, plot, row, scatter, source};
use crate::arguments::ReportArguments;
use crate::bake::spinner;
use crate::error::Failure;
use crate::from_disk::FromDisk;
use crate::output;
use crate::query::{self, poses};
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, BakeReport, to_bytes};
use bvh_format::profile::{Encoding, Profile};
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError, ReadAhead};
use json::{PairRecord, Report, Settings};
use pairs::Pair;
use rayon::prelude::*;
use std::path::Path;
use std::sync::Arc;

/// Poses that are made up for a pair that has none.
const MADE_UP: usize = 60;

pub(super) fn run(list: &Path, arguments: &ReportArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    let backend = query::backend(&arguments.isa)?;
    let pairs = pairs::read(list, arguments.meshes.as_deref(), arguments.poses.as_deref())?;
    // What is wrong with the last pair is told before the first is measured.
    let given = pairs.iter().map(|pair| read_poses(&pair.poses)).collect::<Result<Vec<_>, _>>()?;
    let meshes = pairs.iter().map(|pair| Ok([source::mesh(&pair.a)?, source::mesh(&pair.b)?]));
    let meshes = meshes.collect::<Result<Vec<_>, Failure>>()?;
    std::fs::create_dir_all(out).map_err(|error| {
        Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()))
    })?;
    let settings = Settings::new(arguments, backend);
    let spinner = spinner(false);
    let sweep = cold::Sweep::new(settings.sweep_bytes);
    let mut report = Report::new(settings);
    for ((pair, given), meshes) in pairs.iter().zip(given).zip(&meshes) {
        let tell = |what: &str| spinner.set_message(format!("{}: {what}", pair.name));
        let subject = Subject { pair, settings: &report.settings, backend, out, tell: &tell };
        let measured = subject.measure(meshes, given, &sweep)?;
        report.add(measured);
    }
    spinner.finish_and_clear();
    mark_fronts(&mut report.rows);
    for (name, text) in [
        ("report.csv", row::table(&report.rows)),
        ("report.json", json::text(&report)?),
        ("report.svg", plot::standalone(&report)),
        ("report.html", html::page(&report)),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    output::text(&report.summary(&out.join("report.html")))?;
    match report.wrong.first() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("report.json"),
            format!("expected right answers, found {} wrong; the first: {first}", report.wrong.len()),
        )),
    }
}

fn read_poses(files: &[std::path::PathBuf]) -> Result<Vec<Pose>, Failure> {
    let mut all = Vec::new();
    for file in files {
        let read = poses::read(file)?;
        if read.is_empty() {
            return Err(Failure::invalid(file, "expected poses, found none"));
        }
        all.extend(read);
    }
    Ok(all)
}

/// A pair under measurement.
struct Subject<'a> {
    pair: &'a Pair,
    settings: &'a Settings,
    backend: Backend,
    out: &'a Path,
    tell: &'a (dyn Fn(&str) + Sync),
}

/// What came of a pair.
pub(super) struct Measured {
    pub(super) record: PairRecord,
    pub(super) rows: Vec<Row>,
    /// Answers that are wrong, a line each.
    pub(super) wrong: Vec<String>,
}

impl Subject<'_> {
    fn measure(
        &self,
        meshes: &[Mesh; 2],
        given: Vec<Pose>,
        sweep: &cold::Sweep,
    ) -> Result<Measured, Failure> {
        let failed = |error: QueryError| Failure::Invalid(format!("{}: {error}", self.pair.name));
        (self.tell)("baking");
        let (bakes, sizes) = self.bake(meshes)?;
        let made_up = given.is_empty();
        let mut poses = given;
        if made_up {
            (self.tell)("making up poses");
            let mut querier = Querier::with_backend(self.backend);
            poses = scatter::poses(&mut querier, &bakes[0].a, &bakes[0].b, MADE_UP).map_err(failed)?;
        }
        let poses = some_of(&poses, self.settings.poses);
        (self.tell)("measuring");
        // A thread of its own is bound to one processor; bakes and models go on using all.
        let (pinned, asked, cold) = std::thread::scope(|scope| {
            let work = || {
                let pinned = pin::pin();
                let rounds = self.settings.rounds;
                let asked = measure::rounds(&bakes, &poses, self.backend, rounds)?;
                let some = some_of(&poses, self.settings.cold_poses);
                let cold = cold::times(&bakes, &some, self.backend, sweep)?;
                Ok((pinned, asked, cold))
            };
            scope.spawn(work).join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
        .map_err(failed)?;
        (self.tell)("judging and modelling");
        let (wrong, errors) = answers::judge(&self.pair.name, &bakes, &asked);
        let record = PairRecord::new(self.pair, &bakes[0], &poses, made_up, pinned);
        let walks = Walks::new(&bakes, &asked, &poses, self.settings.model_poses);
        let mut rows = Vec::new();
        for (number, bake) in bakes.iter().enumerate() {
            let modelled = walks.of_file(bake);
            for (place, question) in Question::ALL.into_iter().enumerate() {
                let asked = &asked[number][place];
                let mut row = self.row(&bake.variant, question, &poses, &sizes[number]);
                row.touching = walks.touching;
                row.warm = Spread::of_rounds(&asked.rounds);
                row.cold = Spread::of(cold[number][place].clone());
                row.work = mean_work(asked);
                row.errors = errors[number][place];
                if question.rel_err().unwrap_or(0.0) == 0.0 {
                    row.modelled = modelled[usize::from(question != Question::Collide)];
                    if bake.variant.group == Group::Pages {
                        self.ask_disk(bake, question, &poses, &mut row);
                    }
                }
                rows.push(row);
            }
        }
        rows.extend(self.model(&bakes, &walks, &poses, &sizes));
        Ok(Measured { record, rows, wrong })
    }

    /// All variants, and their sizes.
    fn bake(&self, meshes: &[Mesh; 2]) -> Result<(Vec<Baked>, Vec<Size>), Failure> {
        let is_same = self.pair.a == self.pair.b;
        let (mut bakes, mut sizes) = (Vec::new(), Vec::new());
        for variant in variant::all() {
            let (a, report_a) = bake(&self.pair.a, &meshes[0], &variant)?;
            let (b, report_b) = if is_same {
                (a.clone(), report_a.clone())
            } else {
                bake(&self.pair.b, &meshes[1], &variant)?
            };
            let reports = [&report_a, &report_b];
            let inflation = |of: fn(&BakeReport) -> f64| {
                let weights = [&a, &b].map(|bvh| bvh.objects()[0].record.treelets.get() as f64);
                (of(&report_a) * weights[0] + of(&report_b) * weights[1]) / (weights[0] + weights[1])
            };
            let size = size_of(reports, inflation(|r| r.width_inflation), inflation(|r| r.volume_inflation));
            sizes.push(size);
            bakes.push(Baked { variant, a, b });
        }
        Ok((bakes, sizes))
    }

    fn ask_disk(&self, bake: &Baked, question: Question, poses: &[Pose], row: &mut Row) {
        let poses = some_of(poses, self.settings.disk_poses);
        let ask =
            |read_ahead| files::first_queries(bake, question, &poses, (self.backend, read_ahead), self.out);
        let times = |found: &[FromDisk<f64>]| Spread::of(found.iter().map(|one| one.total).collect());
        let mean = |found: &[FromDisk<f64>], of: fn(&FromDisk<f64>) -> Option<u64>| {
            Some(found.iter().map(of).sum::<Option<u64>>()? as f64 / found.len() as f64)
        };
        if let Some(found) = ask(ReadAhead::Usual) {
            row.disk = times(&found);
            row.disk_faults = mean(&found, |one| Some(one.faults));
        }
        if let Some(found) = ask(ReadAhead::Sparse) {
            row.sparse = times(&found);
            row.sparse_faults = mean(&found, |one| Some(one.faults));
            row.resident_bytes = mean(&found, |one| one.resident_bytes);
            row.touched_bytes = mean(&found, |one| one.touched_bytes);
        }
    }

    /// A row without figures but the sizes.
    fn row(&self, variant: &Variant, question: Question, poses: &[Pose], size: &Size) -> Row {
        Row {
            pair: self.pair.name.clone(),
            group: variant.group,
            variant: variant.name.clone(),
            profile: variant.profile.name().to_owned(),
            triangles: variant.triangles.name(),
            question: question.name(),
            rel_err: question.rel_err(),
            poses: poses.len() as u64,
            touching: 0,
            warm: None,
            cold: None,
            disk: None,
            disk_faults: None,
            sparse: None,
            sparse_faults: None,
            resident_bytes: None,
            touched_bytes: None,
            work: Work::default(),
            modelled: Modelled::default(),
            size: size.clone(),
            errors: Errors::default(),
            pareto_error: None,
            pareto_bytes: None,
        }
    }

    /// What no file has, by a model: predictors, branching, leaves.
    fn model(&self, bakes: &[Baked], walks: &Walks, poses: &[Pose], sizes: &[Size]) -> Vec<Row> {
        // The profile of two children has the binary tree itself.
        let is_binary =
            |bake: &Baked| bake.variant.profile == Profile::Dop14F16 && bake.variant.triangles == USUAL.1;
        let Some(place) = bakes.iter().position(is_binary) else { return Vec::new() };
        let (Some(a), Some(b)) = (Tree::of_file(&bakes[place].a), Tree::of_file(&bakes[place].b)) else {
            return Vec::new();
        };
        let rows = shapes().into_par_iter().flat_map_iter(|shape| {
            let cut = Cut { branching: shape.branching, leaf: shape.leaf };
            let [a, b] = [&a, &b].map(|binary| {
                let mut tree = cut.of(binary);
                shape.predictor.apply(shape.encoding, &mut tree);
                tree
            });
            let size = modelled_size(&a, &b, &shape, sizes[place].vertex_error);
            let variant =
                Variant { group: shape.group, name: shape.name.clone(), ..bakes[place].variant.clone() };
            let modelled = walks.of_trees(&a, &b);
            let questions = [Question::Collide, Question::Distance(0.0)];
            questions.into_iter().zip(modelled).map(move |(question, modelled)| {
                let mut row = self.row(&variant, question, poses, &size);
                row.profile = format!("dop14-{}", if shape.encoding == Encoding::U8 { "u8" } else { "u4" });
                (row.poses, row.touching) = (walks.poses.len() as u64, walks.touching_here);
                row.modelled = modelled;
                row
            })
        });
        rows.collect()
    }
}

fn bake(path: &Path, mesh: &Mesh, variant: &Variant) -> Result<(Arc<Bvh>, BakeReport), Failure> {
    let failed = |error: &BakeError| Failure::from_bake(&path.display().to_string(), error);
    let (bytes, report) = to_bytes(mesh, &variant.options()).map_err(|error| failed(&error))?;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(&BakeError::Unproved(error)))?;
    // No timed query pays for the first touch of a page.
    bvh.check_all().map_err(|error| Failure::invalid(path, error))?;
    Ok((Arc::new(bvh), report))
}

fn size_of(reports: [&BakeReport; 2], width_inflation: f64, volume_inflation: f64) -> Size {
    let triangles: u64 = reports.iter().map(|report| report.file.triangles).sum();
    let per_triangle = |of: fn(&BakeReport) -> u64| {
        Some(reports.iter().map(|report| of(report)).sum::<u64>() as f64 / triangles as f64)
    };
    let moved = |report: &BakeReport| report.file.max_vertex_rounding.max(report.file.max_quantization_error);
    Size {
        node_bytes: per_triangle(|report| report.file.node_bytes),
        triangle_bytes: per_triangle(|report| report.file.triangle_bytes),
        id_bytes: per_triangle(|report| report.file.id_bytes),
        file_bytes: per_triangle(|report| report.file.file_bytes),
        width_inflation: Some(width_inflation),
        volume_inflation: Some(volume_inflation),
        vertex_error: Some(moved(reports[0]).max(moved(reports[1]))),
        triangles_per_leaf: None,
    }
}

/// Nodes take as many bytes as their codes; pages would add their heads and anchors.
fn modelled_size(a: &Tree, b: &Tree, shape: &Shape, vertex_error: Option<f64>) -> Size {
    let bits = if shape.encoding == Encoding::U8 { 8 } else { 4 };
    // Both ends of each slab, and a byte or so of links.
    let child = (2 * a.set.slabs() + 2) * bits / 8;
    let ((leaves_a, triangles_a), (leaves_b, triangles_b)) = (a.leaves(), b.leaves());
    let triangles = (triangles_a + triangles_b) as f64;
    let mut inflation = a.inflation();
    inflation.join(&b.inflation());
    Size {
        node_bytes: Some(((a.treelets() + b.treelets()) * shape.branching * child) as f64 / triangles),
        width_inflation: Some(inflation.mean_width()),
        volume_inflation: Some(inflation.mean_volume()),
        vertex_error,
        triangles_per_leaf: Some(triangles / (leaves_a + leaves_b) as f64),
        ..Size::default()
    }
}

/// A modelled tree.
struct Shape {
    group: Group,
    name: String,
    branching: usize,
    leaf: u32,
    predictor: Predictor,
    encoding: Encoding,
}

fn shapes() -> Vec<Shape> {
    let usual = |group, name| Shape {
        group,
        name,
        branching: 4,
        leaf: 4,
        predictor: Predictor::Chain,
        encoding: Encoding::U8,
    };
    let mut shapes = Vec::new();
    for (encoding, code) in [(Encoding::U8, "u8"), (Encoding::U4, "u4")] {
        for predictor in Predictor::ALL {
            let name = format!("{} {code}", predictor.name());
            shapes.push(Shape { predictor, encoding, ..usual(Group::Predictor, name) });
        }
    }
    for branching in [2, 4, 8] {
        shapes.push(Shape { branching, ..usual(Group::Branching, branching.to_string()) });
    }
    for leaf in [4, 8, 16] {
        shapes.push(Shape { leaf, ..usual(Group::Leaf, leaf.to_string()) });
    }
    shapes
}

/// Poses to walk trees in, with the exact distances.
struct Walks {
    poses: Vec<(Pose, f64)>,
    /// Poses that touch: of all, and of those here.
    touching: u64,
    touching_here: u64,
}

impl Walks {
    fn new(bakes: &[Baked], asked: &[Vec<Asked>], poses: &[Pose], count: usize) -> Self {
        let is_exact = |bake: &Baked| bake.variant.is_reference(USUAL.1);
        let exact = bakes.iter().position(is_exact).unwrap_or(0);
        let place = Question::ALL.iter().position(|&q| q == Question::Distance(0.0)).unwrap_or(0);
        let distances = &asked[exact][place].answers;
        let both: Vec<(Pose, f64)> = poses.iter().copied().zip(distances.iter().copied()).collect();
        let touching = |poses: &[(Pose, f64)]| poses.iter().filter(|(_, d)| *d == 0.0).count() as u64;
        let some = some_of(&both, count);
        Self { touching: touching(&both), touching_here: touching(&some), poses: some }
    }

    /// For a file: contact, distance.
    fn of_file(&self, bake: &Baked) -> [Modelled; 2] {
        let Some(a) = Tree::of_file(&bake.a) else { return [Modelled::default(); 2] };
        if Arc::ptr_eq(&bake.a, &bake.b) {
            return self.of_trees(&a, &a);
        }
        Tree::of_file(&bake.b).map_or([Modelled::default(); 2], |b| self.of_trees(&a, &b))
    }

    fn of_trees(&self, a: &Tree, b: &Tree) -> [Modelled; 2] {
        [0.0, 1.0].map(|distance| {
            let walks = self.poses.par_iter().map(|(pose, exact)| walk(a, b, pose, distance * exact));
            let Some(walks) = walks.collect::<Option<Vec<Counts>>>() else { return Modelled::default() };
            let sum = walks.into_iter().fold(Counts::default(), Counts::plus);
            let mean = |count: u64| Some(count as f64 / self.poses.len() as f64);
            Modelled {
                node_tests: mean(sum.node_tests),
                packet_tests: mean(sum.packet_tests),
                // Where nothing is let through there is no rate.
                false_positives: (sum.through > 0).then(|| sum.in_vain as f64 / sum.through as f64),
            }
        })
    }
}

/// Mean counts of a query.
fn mean_work(asked: &Asked) -> Work {
    let mean = |count: u64| Some(count as f64 / asked.answers.len() as f64);
    Work {
        node_tests: mean(asked.stats.node_tests),
        packet_tests: mean(asked.stats.packet_tests),
        exact_tests: mean(asked.stats.exact_tests),
    }
}

/// At most so many, spread evenly over all; 0 stands for all.
fn some_of<T: Clone>(all: &[T], most: usize) -> Vec<T> {
    if most == 0 || all.len() <= most {
        return all.to_vec();
    }
    (0..most).map(|number| all[number * all.len() / most].clone()).collect()
}

/// Marks the rows of layouts that nothing beats.
fn mark_fronts(rows: &mut [Row]) {
    let mut names: Vec<String> = rows.iter().map(|row| row.pair.clone()).collect();
    names.dedup();
    for name in names {
        let of_pair = |row: &Row| row.pair == name && row.group == Group::Layout;
        let by_error = |row: &Row| Some((row.errors.max?, row.warm?.median));
        let is_distance = |row: &Row| of_pair(row) && row.question == "distance";
        mark(rows, is_distance, by_error, |row, flag| row.pareto_error = Some(flag));
        for question in ["collide", "distance"] {
            let is_it =
                |row: &Row| of_pair(row) && row.question == question && row.rel_err.unwrap_or(0.0) == 0.0;
            let by_bytes = |row: &Row| Some((row.size.file_bytes?, row.warm?.median));
            // Quantised triangles are smaller because they lose something: not with the others.
            let lossless = |row: &Row| is_it(row) && row.triangles != "quantized";
            mark(rows, lossless, by_bytes, |row, flag| row.pareto_bytes = Some(flag));
        }
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
