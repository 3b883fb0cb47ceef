//! `cbvh report`: speed against error on some meshes, of each layout or of each way to ask about a motion.
//!
//! `layouts/` and `motions/` are the two kinds of report. They share what comes before and after the measurement: the list
//! of pairs, the meshes, and four files that hold the same figures: a table, JSON, a drawing and a page for people.

mod arguments;
mod baked;
mod document;
mod files;
mod inputs;
mod kind;
mod layouts;
mod motions;
mod page;
mod source;

pub(crate) use arguments::ReportArguments;

use crate::asking;
use crate::console::{Failure, spinner};
use document::{Report, Settings};
use kind::{Kind, Subject};
use layouts::Layouts;
use motions::Motions;

pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    match &arguments.motions {
        None => run_kind::<Layouts>(arguments, arguments.poses.as_deref()),
        Some(files) => run_kind::<Motions>(arguments, files.as_deref()),
    }
}

/// Measures one pair after another. `files` are further files of items for all pairs.
fn run_kind<K: Kind>(arguments: &ReportArguments, files: Option<&str>) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.isa)?;
    let inputs = inputs::read::<K>(arguments, files)?;
    files::make_folder(&arguments.out)?;
    let spinner = spinner(false);
    let mut report = Report::<K>::new(Settings::new::<K>(arguments, backend));
    for input in inputs {
        let tell = |what: &str| spinner.set_message(format!("{}: {what}", input.pair.name));
        let settings = &report.settings;
        let subject = Subject { pair: &input.pair, meshes: &input.meshes, settings, backend, tell: &tell };
        let measured = K::measure(&subject, input.given)?;
        report.add(measured);
    }
    spinner.finish_and_clear();
    files::write(&report, &arguments.out)
}
