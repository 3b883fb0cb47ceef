//! `cbvh probe`: asks a mesh about files of points, rays or segments, timing each question, or about one.

mod answer;
mod arguments;
mod question;

pub(crate) use arguments::ProbeArguments;

use crate::asking::files::read_all;
use crate::asking::mesh::{blame, load_one};
use crate::asking::{self, Record, runner};
use crate::console::{self, Failure};
use answer::{Answer, nouns};
use bvh_query::Querier;
use question::Question;
use std::path::Path;

/// Answers the question about files of points, rays or segments, or about one.
pub(crate) fn run(arguments: &ProbeArguments) -> Result<(), Failure> {
    let (mode, options) = (arguments.mode, &arguments.asking);
    let backend = asking::backend(&options.isa)?;
    let load = || load_one(&arguments.a, &options.how());
    if let Some(probe) = &arguments.probe {
        let question = question::parse_one(probe, mode)?;
        let mesh = load()?;
        let answer = question.ask(&mut Querier::with_backend(backend), mesh.shape());
        return console::text(&answer.map_err(|error| blame(&mesh, None, error))?.describe(&mesh));
    }
    let (files, read) = (arguments.files.as_deref(), |file: &Path| question::read(file, mode));
    let files = read_all(files, "files of points, rays or segments", options, read)?;
    let mut mesh = load()?;
    mesh.check()?;
    for (stem, questions) in &files {
        let ask = |querier: &mut Querier, question: &Question| question.ask(querier, mesh.shape());
        let run = runner::run(questions, ask, backend, &options.limits());
        let run = run.map_err(|error| blame(&mesh, None, error))?;
        let record = Record::new(&mesh, None, mode.name(), backend, stem, &run);
        asking::tell(options, stem, &run, &record, || {
            let (noun, positive) = nouns(mode);
            record.listing(&run, noun, &format!("{} {positive}", record.positives), Answer::in_words)
        })?;
    }
    Ok(())
}
