//! What commands that ask have in common: meshes, files of questions, the run, and how answers are told.

mod answer;
mod arguments;
pub(crate) mod files;
pub(crate) mod mesh;
pub(crate) mod motions;
pub(crate) mod poses;
mod record;
pub(crate) mod runner;
pub(crate) mod triangle;
pub(crate) mod witness;

pub(crate) use answer::Answer;
pub(crate) use arguments::AskingArguments;
pub(crate) use record::{Record, Times};

use crate::console::{self, Failure};
use bvh_query::Backend;
use files::write_file;
use runner::Run;
use serde::Serialize;
use std::io::{IsTerminal, stdout};
use std::path::Path;

/// Returns the backend of `--isa`. `auto` leaves the choice to `CBVH_ISA` or to the CPU.
pub(crate) fn backend(name: &str) -> Result<Backend, Failure> {
    Ok(if name == "auto" { Backend::detect()? } else { Backend::from_name(name)? })
}

/// Writes the raw answers about a file, if asked to, and prints the JSON line, or a listing for a person.
pub(crate) fn tell<A: Answer>(
    arguments: &AskingArguments,
    stem: &str,
    run: &Run<A>,
    json: &impl Serialize,
    listing: impl FnOnce() -> String,
) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        let lines =
            run.answers.iter().map(|(answer, nanoseconds)| format!("{} {nanoseconds}\n", answer.raw()));
        write_file(Path::new(&out.replacen("%s", stem, 1)), &lines.collect::<String>())?;
    }
    if arguments.json || !stdout().is_terminal() { console::json(json) } else { console::text(&listing()) }
}
