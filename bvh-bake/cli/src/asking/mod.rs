//! What commands that ask have in common: meshes, files of questions, the run, and how answers are told.

mod arguments;
pub(crate) mod files;
pub(crate) mod mesh;
pub(crate) mod motions;
pub(crate) mod poses;
mod record;
mod runner;
pub(crate) mod witness;

pub(crate) use arguments::AskingArguments;
pub(crate) use record::{Record, Times};
pub(crate) use runner::Run;

use crate::console::{self, Failure, significant};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Distance, Querier, QueryError};
use files::write_file;
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;

/// What every answer has, whatever the question.
pub(crate) trait Answer {
    /// Returns whether the answer counts among the positives.
    fn is_positive(&self) -> bool;

    /// Returns the answer as a number, of which `--bench` prints the sum.
    fn value(&self) -> f64;

    /// Returns the line that is printed.
    fn line(&self) -> String {
        significant(self.value())
    }

    /// Returns all that the answer has, as a JSON object.
    fn json(&self) -> Value;

    /// Hashes what the line tells.
    fn hash(&self, hasher: &mut Hasher);
}

/// Returns the backend of `--isa`. `auto` leaves the choice to `CBVH_ISA` or to the CPU.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// Asks about all files of questions and tells the answers as the arguments say. A question is called `noun`, `blame` names
/// the file that an error is about, and `bench` makes the line of `--bench` for a file of this stem.
pub(crate) fn ask_files<T: Sync, A: Answer + Clone + Send, R: Serialize>(
    arguments: &AskingArguments,
    backend: Backend,
    noun: &str,
    files: &[(String, Vec<T>)],
    ask: impl Fn(&mut Querier, &T) -> Result<A, QueryError> + Sync,
    blame: impl Fn(QueryError) -> Failure,
    bench: impl Fn(&str, &Run<A>) -> R,
) -> Result<(), Failure> {
    for (stem, questions) in files {
        let run = runner::run(questions, &ask, backend, &arguments.limits()).map_err(&blame)?;
        if let Some(out) = &arguments.out {
            let lines =
                run.answers.iter().map(|(answer, nanoseconds)| format!("{} {nanoseconds}\n", answer.line()));
            write_file(Path::new(&out.replacen("%s", stem, 1)), &lines.collect::<String>())?;
        }
        let answers = || run.answers.iter().map(|(answer, _)| answer);
        if arguments.bench {
            console::json(&bench(stem, &run))?;
        } else if arguments.json {
            let file = (files.len() > 1).then_some((noun, &**stem));
            console::lines((0..).zip(answers()).map(|(number, answer)| {
                let mut record = answer.json();
                record[noun] = json!(number);
                if let Some((noun, stem)) = file {
                    record[format!("{noun}s")] = json!(stem);
                }
                record
            }))?;
        } else {
            console::lines(answers().map(Answer::line))?;
        }
    }
    Ok(())
}

/// Returns all that a distance has, as a JSON object.
pub(crate) fn distance_json(of: &Distance) -> Value {
    json!({
        "distance": of.distance, "lower": of.lower, "upper": of.upper, "point_a": of.point_a, "point_b": of.point_b,
        "object_a": of.object_a, "triangle_a": of.triangle_a, "object_b": of.object_b, "triangle_b": of.triangle_b,
    })
}
