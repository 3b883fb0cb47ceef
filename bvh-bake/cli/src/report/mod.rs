//! `cbvh report`: speed against error on some meshes, of each layout or of each way to ask about a motion.
//!
//! `layouts` and `motions` are the two kinds of report. Both make rows of named figures, from which all else is written: a
//! table, JSON, a drawing and a page for people.

mod layouts;
mod meshes;
mod motions;
mod page;

use crate::asking::{self, files};
use crate::console::{self, Failure, plural, spinner};
use bvh_bake::Options;
use bvh_bake::mesh::Mesh;
use bvh_query::{Backend, Bvh, Querier, QueryError};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::{self, Pair};
use cbvh_measure::pin::Pinned;
use cbvh_measure::plot::{self, Figure};
use cbvh_measure::poses::diagonal;
use cbvh_measure::table::{self, Cell};
use clap::Args;
use meshes::{Baked, bake_both};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

const REPORT_HELP: &str = "\
Examples:
  cbvh report pairs.txt --out report
  cbvh report pairs.txt --meshes meshes --poses poses/%s_d1.txt,poses/%s_d5.txt --out report
  cbvh report pairs.txt --motions --out report
  cbvh report pairs.txt --motions=edges/%s.txt --out report
  cbvh report pairs.txt --quick --out report

PAIRS is a text file with one pair of meshes per line: NAME A B [FILE[,FILE...]]; # starts a comment. Meshes are in any \
format that bake reads, or .cbvh files, whose triangles are baked again. FILEs have poses or, with --motions, motions, as \
query and motion read them. File names are relative to the list. For a pair without poses, 60 are made, always the same \
ones: overlapping, and with gaps of 1e-6, 0.5 %, 1 % and 5 % of A's diagonal. For a pair without motions, 60 are made, \
too: long ways, short ways, slides and turns on the spot.

The command writes report.html for people, report.svg with its plots, and report.csv and report.json with the same \
figures. If an answer is wrong, the exit code is 3 and the files are written nevertheless.

Without --motions, it bakes each pair in every profile with every encoding of triangles, and asks for contact and for \
distances with allowed errors of 0, 0.1 %, 1 % and 10 %. All answers are compared with those of dop14-f32.

With --motions, it bakes each pair as bake does without options, and asks about each motion in 16 ways: by 10, 30, 100, \
300, 1000, 3000 and 10000 equally spaced poses until one touches, in the order of time and in an order that is spread from \
the start, and by certified answers, for the first contact and for any. The report says how many of the certified contacts \
the samples miss, how late they find the others, and how long each way takes. A sample that touches where the motion is \
certified free is a wrong answer. Each way asks about all motions of a pair in one round, and in as many \
further rounds as fit into 10 seconds; report.csv has their number. A pair takes some minutes at most, unless one round of \
10000 samples takes longer.

Queries run on one thread that is bound to one processor. On a machine that does other work the times include the \
effects of that work.";

/// What `report` takes.
#[derive(Debug, Args)]
#[command(after_help = REPORT_HELP)]
pub(crate) struct ReportArguments {
    /// The list of the pairs of meshes to report on
    pub(crate) pairs: PathBuf,
    /// The folder to write to; made if it does not exist
    #[arg(long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// The folder of the meshes [default: that of PAIRS]
    #[arg(long, value_name = "DIR")]
    pub(crate) meshes: Option<PathBuf>,
    /// Files of poses for each pair, besides those in PAIRS; %s stands for the pair's name
    #[arg(long, value_name = "FILE[,FILE...]")]
    pub(crate) poses: Option<String>,
    /// Report on motions instead of layouts. FILEs are files of motions for each pair, besides those in PAIRS; %s stands for
    /// the pair's name
    #[arg(long, value_name = "FILE[,FILE...]", num_args = 0..=1, require_equals = true, conflicts_with = "poses")]
    pub(crate) motions: Option<Option<String>>,
    /// The largest number of poses or motions per pair, spread evenly over all; 0 asks all
    #[arg(long, value_name = "N", default_value = "100")]
    pub(crate) limit: usize,
    /// Rounds in which all layouts, or all ways to ask, take turns
    #[arg(long, value_name = "N", default_value = "7", value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub(crate) rounds: u16,
    /// Backend: auto, scalar, avx2 or avx512; auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// Ask only about ten poses or motions in two rounds: good for trying the command, too few to quote
    #[arg(long, conflicts_with_all = ["limit", "rounds"])]
    pub(crate) quick: bool,
}

/// Rounds and items of `--quick`.
const QUICK: (usize, usize) = (2, 10);
/// The number of items that are made for a pair without any.
const MADE: usize = 60;

/// Makes so many items for two meshes.
type Make<T> = fn(&mut Querier, &Bvh, &Bvh, usize) -> Result<Vec<T>, QueryError>;

/// What one kind of report has that the other does not. Its items are poses or motions.
struct Kind<T> {
    words: page::Words,
    /// What its items are called.
    items: &'static str,
    /// Reads a file of items.
    read: fn(&Path) -> Result<Vec<T>, Failure>,
    /// Makes items for a pair without any; and how.
    make: Make<T>,
    made: &'static str,
    /// Measures a pair.
    measure: fn(&Subject<'_>, &[T]) -> Result<Measured, Failure>,
}

/// A pair to measure, and how.
struct Subject<'a> {
    pair: &'a Pair,
    meshes: &'a [Mesh; 2],
    /// Both meshes as `cbvh bake` bakes them without options.
    baked: &'a [Baked; 2],
    backend: Backend,
    rounds: usize,
}

/// A row of `report.csv`: its figures with their names. All that is told of it is taken from here.
type Cells = Vec<(&'static str, Cell)>;

/// Returns a figure of a row, if it was taken.
fn number(row: &Cells, name: &str) -> Option<f64> {
    match row.iter().find(|(other, _)| *other == name)?.1 {
        Cell::Number(value) => Some(value),
        Cell::Count(count) => Some(count as f64),
        Cell::Flag(flag) => Some(f64::from(u8::from(flag))),
        _ => None,
    }
}

/// The results of a pair.
#[derive(Default)]
struct Measured {
    name: String,
    /// The meshes and the items, in sentences.
    about: String,
    rows: Vec<Cells>,
    /// Wrong answers, one line each.
    wrong: Vec<String>,
    /// Further fields of the pair's record.
    counts: Vec<(&'static str, usize)>,
    pinned: Option<Pinned>,
    /// What is found, the most important sentence first.
    sentences: Vec<String>,
    figure: Figure,
    /// The tables, as HTML.
    tables: String,
}

/// The whole report: where and how it was measured, the pairs, and the rows.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    origin: Origin,
    settings: Value,
    pairs: Vec<Value>,
    /// Answers that are not what they must be, one line each.
    wrong: Vec<String>,
    #[serde(serialize_with = "table::objects")]
    rows: Vec<Cells>,
    #[serde(skip)]
    sections: Vec<Measured>,
}

pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    match &arguments.motions {
        None => run_kind(arguments, layouts::KIND, arguments.poses.as_deref()),
        Some(files) => run_kind(arguments, motions::KIND, files.as_deref()),
    }
}

/// Measures one pair after another. `files` are further files of items for all pairs.
fn run_kind<T: Clone>(
    arguments: &ReportArguments,
    kind: Kind<T>,
    files: Option<&str>,
) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.isa)?;
    // All inputs are read before the first pair is measured, so that an error in the last one shows at once.
    let inputs = read(arguments, &kind, files)?;
    let out = &arguments.out;
    std::fs::create_dir_all(out).map_err(|error| {
        Failure::System(format!("{}: expected a folder to write to, found {error}", out.display()))
    })?;
    let quick = arguments.quick;
    let (rounds, limit) = if quick { QUICK } else { (usize::from(arguments.rounds), arguments.limit) };
    let mut report = Report {
        origin: Origin::of("cbvh report"),
        settings: json!({ "quick": quick, "rounds": rounds, kind.items: limit, "isa": backend.name() }),
        pairs: Vec::new(),
        wrong: Vec::new(),
        rows: Vec::new(),
        sections: Vec::new(),
    };
    let spinner = spinner(false);
    for (pair, given, meshes) in inputs {
        spinner.set_message(pair.name.clone());
        let baked = bake_both(&pair, &meshes, &Options::default())?;
        let [(a, _), (b, _)] = &baked;
        let (from, all) = if given.is_empty() {
            let made = (kind.make)(&mut Querier::with_backend(backend), a, b, MADE);
            let made = made.map_err(|error| Failure::Invalid(format!("{}: {error}", pair.name)))?;
            (kind.made.to_owned(), made)
        } else {
            (pair.files.iter().map(|file| files::stem(file)).collect::<Vec<_>>().join(", "), given)
        };
        let items = pairs::spread_evenly(&all, limit);
        let subject = Subject { pair: &pair, meshes: &meshes, baked: &baked, backend, rounds };
        let measured = (kind.measure)(&subject, &items)?;
        report.add(&subject, measured, (kind.items, items.len(), &from));
    }
    spinner.finish_and_clear();
    write(&report, &kind.words, out)
}

impl Report {
    /// Adds the results of a pair, which was asked about so many items of this name and origin.
    fn add(&mut self, subject: &Subject<'_>, mut of: Measured, (items, count, from): (&str, usize, &str)) {
        let Subject { pair, baked, .. } = subject;
        let side = |path: &Path, (bvh, report): &Baked| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let (triangles, diagonal) = (bvh.all().triangles(), diagonal(bvh));
            let layout = meshes::layout_of(report);
            (
                format!("{name}, {triangles} triangles, diagonal {diagonal:.4} mesh units"),
                json!({ "mesh": name, "triangles": triangles, "diagonal": diagonal, "chosen_layout": layout }),
            )
        };
        let [(about_a, a), (about_b, b)] = [side(&pair.a, &baked[0]), side(&pair.b, &baked[1])];
        let mut record = json!({
            "name": pair.name, "a": a, "b": b, items: count, format!("{items}_from"): from, "pinned": of.pinned,
        });
        of.counts.iter().for_each(|(key, count)| record[*key] = json!(count));
        self.pairs.push(record);
        self.wrong.append(&mut of.wrong);
        self.rows.append(&mut of.rows);
        of.name.clone_from(&pair.name);
        of.about = format!("A: {about_a}. B: {about_b}. {count} {items} ({from}).");
        self.sections.push(of);
    }
}

/// A pair with its items, of which there may be none, and its meshes.
type Input<T> = (Pair, Vec<T>, [Mesh; 2]);

/// Reads the list, and what it names.
fn read<T>(
    arguments: &ReportArguments,
    kind: &Kind<T>,
    files: Option<&str>,
) -> Result<Vec<Input<T>>, Failure> {
    let list: &Path = &arguments.pairs;
    let bytes = std::fs::read(list).map_err(|error| Failure::from_input(list, &error))?;
    let pairs = pairs::parse(&bytes, list, arguments.meshes.as_deref(), files)
        .map_err(|error| Failure::invalid(list, error))?;
    let items = |pair: &Pair| -> Result<Vec<T>, Failure> {
        let mut items = Vec::new();
        for file in &pair.files {
            files::require_regular(file)?;
            items.extend((kind.read)(file)?);
        }
        Ok(items)
    };
    // Files of items are small, so that they come before the meshes of all pairs.
    let given = pairs.iter().map(items).collect::<Result<Vec<_>, _>>()?;
    let with_meshes = pairs.into_iter().zip(given).map(|(pair, given)| {
        files::require_regular(&pair.a)?;
        files::require_regular(&pair.b)?;
        let meshes = [meshes::read(&pair.a)?, meshes::read(&pair.b)?];
        Ok((pair, given, meshes))
    });
    with_meshes.collect()
}

/// Writes the four files, and prints a summary. Wrong answers are a failure, of which the files tell.
fn write(report: &Report, words: &page::Words, out: &Path) -> Result<(), Failure> {
    let figures: Vec<Figure> = report.sections.iter().map(|section| section.figure.clone()).collect();
    for (name, text) in [
        ("report.csv", table::csv(&report.rows)),
        ("report.json", table::json(report).map_err(|error| Failure::System(error.to_string()))?),
        ("report.svg", plot::svg(&figures)),
        ("report.html", page::page(report, words)),
    ] {
        bvh_bake::write_atomically(&out.join(name), text.as_bytes())
            .map_err(|error| Failure::System(error.to_string()))?;
    }
    let counted = |count: usize, word| format!("{count} {}", plural(count as u64, word));
    let mut text = format!(
        "{}: {}, {}, {}\n",
        out.join("report.html").display(),
        counted(report.pairs.len(), "pair"),
        counted(report.rows.len(), "row"),
        counted(report.wrong.len(), "wrong answer")
    );
    for section in &report.sections {
        for line in &section.sentences {
            text += &format!("  {}: {line}\n", section.name);
        }
    }
    console::text(&text)?;
    match report.wrong.first() {
        None => Ok(()),
        Some(first) => Err(Failure::invalid(
            &out.join("report.json"),
            format!("expected right answers, found {} wrong; the first: {first}", report.wrong.len()),
        )),
    }
}
