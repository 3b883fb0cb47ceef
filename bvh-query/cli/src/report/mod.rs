//! `cbvh report`: speed against error on some meshes, of each layout or of each way to check a motion.
//!
//! `layouts` and `motions` are the two kinds of report. Both make rows of named figures, from which everything else is
//! written: a table, JSON, a drawing and a page for people. They use `inputs`, `made` poses and motions, and `timing`.

mod inputs;
mod layouts;
mod made;
mod motions;
mod page;
mod plot;
mod timing;
mod ways;

use crate::asking::{self, files};
use crate::console::{self, Failure, Record, csv, shown, spinner};
use crate::view::output::{self, name_of};
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeReport, Options};
use bvh_query::{Backend, Bvh, Pose, Querier, QueryError};
use cbvh_measure::Origin;
use cbvh_view::{Named, Page};
use clap::Args;
use inputs::{Baked, Pair, bake_both};
use plot::Panel;
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
too: long motions, short motions, slides and turns on the spot.

The command writes report.html for people, report.svg with its plots, and report.csv and report.json with the same \
figures. view-1.html shows the first pair as cbvh view does, view-2.html the second one, and so on: in the first pose that touches or else \
in the nearest one, with --motions where the first hit touches. Pairs whose files have more than 32 MiB have no such page. If a result is wrong, the exit code is 3 and the files are written nevertheless.

Without --motions, it bakes each pair in every profile with every encoding of triangles, and computes contact and \
distances with allowed errors of 0, 0.1 %, 1 % and 10 %. All results are compared with those of dop14-f32.

With --motions, it bakes each pair as bake does without options, and checks each motion in nine ways: by 10, 30, 100, \
300, 1000, 3000 and 10000 equally spaced poses until one touches, and by certified queries, for the first contact and for \
any. The report says how many of the certified contacts \
the samples miss, how late they find the others, and how long each way takes. A sample that touches where the motion is \
certified free is a wrong result. Each way checks all motions of a pair in one round, and in as many \
further rounds as fit into 10 seconds; report.csv has their number. A pair takes some minutes at most, unless one round of \
10000 samples takes longer.

Queries run on one thread. On a machine that does other work the times include the effects of that work.";

/// What `report` takes.
#[derive(Debug, Args)]
#[command(after_help = REPORT_HELP)]
pub(crate) struct ReportArguments {
    /// The list of the pairs of meshes to report on
    pairs: PathBuf,
    /// The folder to write to; it is created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The folder of the meshes [default: that of PAIRS]
    #[arg(long, value_name = "DIR")]
    meshes: Option<PathBuf>,
    /// Files of poses for each pair, besides those in PAIRS; %s stands for the pair's name
    #[arg(long, value_name = "FILE[,FILE...]")]
    poses: Option<String>,
    /// Report on motions instead of layouts. FILEs are files of motions for each pair, besides those in PAIRS; %s stands for
    /// the pair's name
    #[arg(long, value_name = "FILE[,FILE...]", num_args = 0..=1, require_equals = true, conflicts_with = "poses")]
    motions: Option<Option<String>>,
    /// The largest number of poses or motions per pair, spread evenly over all; 0 takes all
    #[arg(long, value_name = "N", default_value = "100")]
    limit: usize,
    /// Rounds in which all layouts, or all ways to check, take turns
    #[arg(long, value_name = "N", default_value = "7", value_parser = clap::value_parser!(u16).range(1..=1000))]
    rounds: u16,
    /// Backend: auto, scalar, avx2, avx512, neon or simd128; auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    isa: String,
    /// Take only ten poses or motions in two rounds: good for trying the command, too few to quote
    #[arg(long, conflicts_with_all = ["limit", "rounds"])]
    quick: bool,
}

/// Rounds and items of `--quick`.
const QUICK: (usize, usize) = (2, 10);
/// The most bytes of the files of a pair in a page that shows it, so that the folder of a report stays small.
const MAX_VIEW_BYTES: u64 = 32 << 20;
/// The number of items that are made for a pair without any.
const MADE: usize = 60;

/// Makes a number of items for two meshes.
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

/// The results of a pair.
#[derive(Default)]
struct Measured {
    name: String,
    /// The meshes and the items, in sentences.
    about: String,
    /// Its record in `report.json`.
    record: Value,
    /// The number of the pair's first row in `report.csv`. Everything that is said about the pair comes from its rows.
    rows: Vec<Record>,
    first_row: usize,
    /// Wrong answers, one line each.
    wrong: Vec<String>,
    /// Further fields of the pair's record.
    counts: Vec<(&'static str, usize)>,
    /// What is found, the most important sentence first.
    sentences: Vec<String>,
    panels: Vec<Panel>,
    tables: Vec<page::Table>,
    /// The pose that people should see: the first that touches or, if none does, the nearest.
    seen: Option<Pose>,
    /// A page that shows the pair, unless it would be large.
    view: Option<Page>,
}

/// The whole report: where and how it was measured, and the pairs.
struct Report {
    origin: Origin,
    settings: Value,
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
    let inputs = inputs::read(arguments, &kind, files)?;
    let out = &arguments.out;
    let failed = |error| Failure::system(out, format_args!("expected a folder to write to, found {error}"));
    std::fs::create_dir_all(out).map_err(failed)?;
    let quick = arguments.quick;
    let (rounds, limit) = if quick { QUICK } else { (usize::from(arguments.rounds), arguments.limit) };
    let mut report = Report {
        origin: Origin::of("cbvh report"),
        settings: json!({ "quick": quick, "rounds": rounds, kind.items: limit, "isa": backend.name() }),
        sections: Vec::new(),
    };
    let spinner = spinner(false);
    for (pair, given, meshes) in inputs {
        spinner.set_message(shown(&pair.name));
        let baked = bake_both(&pair, &meshes, &Options::default())?;
        let [(a, _), (b, _)] = &baked;
        let (from, all) = if given.is_empty() {
            let made = (kind.make)(&mut Querier::with_backend(backend), a, b, MADE);
            let made = made.map_err(|error| Failure::Invalid(format!("{}: {error}", pair.name)))?;
            (kind.made.to_owned(), made)
        } else {
            (pair.files.iter().map(|file| files::stem(file)).collect::<Vec<_>>().join(", "), given)
        };
        let items = spread_evenly(&all, limit);
        let subject = Subject { pair: &pair, meshes: &meshes, baked: &baked, backend, rounds };
        let mut measured = (kind.measure)(&subject, &items)?;
        if let Some(pose) = &measured.seen {
            let [a, b] = subject.named();
            let page = Page::pair(a, Some(b), pose, None);
            measured.view = page.and_then(|page| page.limited_to(MAX_VIEW_BYTES)).ok();
        }
        report.add(&subject, measured, (kind.items, items.len(), &from));
    }
    spinner.finish_and_clear();
    report.write(&kind.words, out)
}

/// Returns at most `count` items, spread evenly over all; 0 returns all.
fn spread_evenly<T: Clone>(all: &[T], count: usize) -> Vec<T> {
    if count == 0 || all.len() <= count {
        return all.to_vec();
    }
    (0..count).map(|number| all[number * all.len() / count].clone()).collect()
}

/// Returns the name of a bake's layout, as tables have it.
fn layout_of(report: &BakeReport) -> String {
    format!("{} {}", report.file.profile.name(), report.file.triangle_encoding.name())
}

impl Subject<'_> {
    /// Returns what the files of both meshes are called. Reports are passed on, so that they have no paths of a machine.
    fn named(&self) -> [Named; 2] {
        let named = |path: &Path, (bvh, _): &Baked| {
            let name = name_of(path);
            Named { path: name.clone(), name, shape: bvh.clone().into() }
        };
        [named(&self.pair.a, &self.baked[0]), named(&self.pair.b, &self.baked[1])]
    }
}

/// Returns the name of the page that shows a pair, counted from 0.
fn view_name(number: usize) -> String {
    format!("view-{}.html", number + 1)
}

impl Report {
    /// Adds the results of a pair for `count` items of this name and origin.
    fn add(&mut self, subject: &Subject<'_>, mut of: Measured, (items, count, from): (&str, usize, &str)) {
        let Subject { pair, baked, .. } = subject;
        let side = |path: &Path, (bvh, report): &Baked| {
            let name = name_of(path);
            let (triangles, diagonal) = (bvh.all().triangles(), made::diagonal(bvh));
            let layout = layout_of(report);
            (
                format!("{name}, {triangles} triangles, diagonal {diagonal:.4} mesh units"),
                json!({ "mesh": name, "triangles": triangles, "diagonal": diagonal, "chosen_layout": layout }),
            )
        };
        let [(about_a, a), (about_b, b)] = [side(&pair.a, &baked[0]), side(&pair.b, &baked[1])];
        of.record = json!({
            "name": pair.name, "a": a, "b": b, items: count, format!("{items}_from"): from,
        });
        of.counts.iter().for_each(|(key, count)| of.record[*key] = json!(count));
        of.name.clone_from(&pair.name);
        of.about = format!("A: {about_a}. B: {about_b}. {count} {items} ({from}).");
        of.first_row = self.sections.iter().map(|section| section.rows.len()).sum();
        self.sections.push(of);
    }

    /// Writes the four files and the pages that show pairs, and prints a summary. Wrong answers are a failure, of which the files tell.
    fn write(&self, words: &page::Words, out: &Path) -> Result<(), Failure> {
        /// The content of `report.json`.
        #[derive(Serialize)]
        struct Json<'a> {
            #[serde(flatten)]
            origin: &'a Origin,
            settings: &'a Value,
            pairs: Vec<&'a Value>,
            wrong: Vec<&'a String>,
            rows: Vec<&'a Record>,
        }
        let sections = &self.sections;
        let json = Json {
            origin: &self.origin,
            settings: &self.settings,
            pairs: sections.iter().map(|section| &section.record).collect(),
            wrong: sections.iter().flat_map(|section| &section.wrong).collect(),
            rows: sections.iter().flat_map(|section| &section.rows).collect(),
        };
        let columns: Vec<&str> = json.rows.iter().take(1).flat_map(|row| row.names()).collect();
        let panels: Vec<&[Panel]> = sections.iter().map(|section| &section.panels[..]).collect();
        let json_text =
            serde_json::to_string_pretty(&json).map_err(|error| Failure::System(error.to_string()))?;
        for (name, text) in [
            ("report.csv", csv(&columns, json.rows.iter().copied())),
            ("report.json", json_text + "\n"),
            ("report.svg", plot::svg(&panels)),
            ("report.html", page::page(self, words)),
        ] {
            files::write_file(&out.join(name), &text)?;
        }
        for (number, section) in sections.iter().enumerate() {
            if let Some(view) = &section.view {
                output::write(view, &out.join(view_name(number)))?;
            }
        }
        let counted = |count: usize, word| console::counted(count as u64, word);
        let (pairs, rows) = (counted(sections.len(), "pair"), counted(json.rows.len(), "row"));
        let wrong = counted(json.wrong.len(), "wrong result");
        let summary = format!("{}: {pairs}, {rows}, {wrong}", out.join("report.html").display());
        let sentences = sections.iter().flat_map(|section| {
            section.sentences.iter().map(|sentence| format!("  {}: {sentence}", section.name))
        });
        console::lines(std::iter::once(summary).chain(sentences).map(|line| shown(&line)))?;
        let Some(first) = json.wrong.first() else { return Ok(()) };
        let what = format!("expected right results, found {} wrong; the first: {first}", json.wrong.len());
        Err(Failure::invalid(&out.join("report.json"), what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::console::record;

    #[test]
    fn csv_and_json_hold_the_same_figures_under_the_same_names() {
        let row = record! { name: "a, \"b\"", none: f64::NAN, of: 0.1, is: true, count: None::<u64> };
        assert_eq!(
            csv(&row.names().collect::<Vec<_>>(), [&row]),
            "name,none,of,is,count\n\"a, \"\"b\"\"\",,0.1,1,\n"
        );
        let json: Value = serde_json::to_value(&row).unwrap();
        assert_eq!(json, json!({ "name": "a, \"b\"", "none": null, "of": 0.1, "is": true, "count": null }));
        assert_eq!((row.number("of"), row.number("is"), row.number("none")), (Some(0.1), Some(1.0), None));
    }
}
