//! `cbvh suite`: runs the queries of the public suite, one line in, one line out.
//!
//! `spec/suite/PROTOCOL.md` defines the lines. [`message`] reads them, [`meshes`] keeps the meshes that were sent, and
//! [`ask`] puts each question to bvh-query. A line that cannot be answered gets a refusal with its reason, and the command
//! goes on with the next line. It ends with its input.

mod ask;
mod meshes;
mod message;
mod probed;
mod timed;

use crate::asking;
use crate::bake;
use crate::console::{Failure, Record, record};
use bvh_bake::Effort;
use bvh_query::Querier;
use clap::Args;
use meshes::Meshes;
use message::{Hello, Message, Numbered};
use probed::{PROBED, Probes};
use std::io::{BufRead as _, Write as _};
use timed::Fields;

const HELP: &str = "\
Examples:
  cbvh suite
  python spec/suite/run.py --runner 'cbvh suite'

spec/suite/PROTOCOL.md defines the lines that the command reads and writes. Meshes are baked in memory with the default \
options, or with --effort quick in less time. Those of timed queries then have no topology, so that sides are refused. What has no result, such as a query about a mesh that has a coordinate NaN, is refused with a reason.";

/// What `suite` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct SuiteArguments {
    /// Instruction set of the queries: auto, scalar, avx2, avx512, neon or simd128
    #[arg(long, value_name = "ISA", default_value = "auto")]
    isa: String,

    /// Time spent on a better tree: quick or default. Results are the same
    #[arg(long, value_name = "EFFORT", default_value = "default", value_parser = bake::effort)]
    effort: Effort,
}

/// The version of the protocol.
const PROTOCOL: u32 = 1;

/// The greatest error of a distance that the command claims, as a fraction of the largest coordinate of the question: 45
/// roundings. bvh-query measures the closest triangles in f64, so a distance far below their size has fewer digits. The bounds
/// that come with each distance are certified, and the suite checks them exactly.
const MAX_DISTANCE_ERROR_OF_SIZE: f64 = 1e-14;

/// Answers each line of standard input with one line on standard output.
pub(crate) fn run(arguments: &SuiteArguments) -> Result<(), Failure> {
    let mut querier = Querier::with_backend(asking::backend(&arguments.isa)?);
    let mut known = Known {
        meshes: Meshes::of_effort(arguments.effort),
        fields: Fields::default(),
        probes: Probes::default(),
    };
    let mut output = std::io::stdout().lock();
    for line in std::io::stdin().lock().split(b'\n') {
        let line = line.map_err(|error| Failure::System(format!("standard input: cannot read: {error}")))?;
        if line.trim_ascii().is_empty() {
            continue;
        }
        let answer = answer(&line, &mut known, &mut querier);
        writeln!(output, "{answer}")
            .and_then(|()| output.flush())
            .map_err(|error| Failure::from_output(&error))?;
    }
    Ok(())
}

/// What later lines name.
struct Known {
    meshes: Meshes,
    fields: Fields,
    probes: Probes,
}

/// Answers one line.
fn answer(line: &[u8], known: &mut Known, querier: &mut Querier) -> Record {
    let Known { meshes, fields, probes } = known;
    match serde_json::from_slice(line) {
        Ok(Message::Hello(Hello { hello: PROTOCOL })) => hello(meshes.settings()),
        Ok(Message::Hello(Hello { hello })) => {
            refusal(&format!("expected version {PROTOCOL} of the protocol, found {hello}"))
        }
        Ok(Message::Mesh(mesh)) => about(
            record! { mesh: mesh.mesh },
            meshes.add(&mesh).map(|triangles| record! { triangles: triangles }),
        ),
        Ok(Message::File(mesh)) => about(record! { mesh: mesh.mesh }, meshes.add_file(&mesh)),
        Ok(Message::Field(field)) => {
            let seconds = fields.add(&field, meshes).map(|seconds| record! { seconds: seconds });
            about(record! { field: field.field }, seconds)
        }
        Ok(Message::Probes(set)) => {
            let count = probes.add(&set).map(|count| record! { count: count });
            about(record! { probes: set.probes }, count)
        }
        Ok(Message::Probed(question)) => {
            about(record! { id: question.id }, probed::ask(&question, meshes, probes, querier))
        }
        Ok(Message::Timed(question)) => {
            about(record! { id: question.id }, timed::ask(&question, meshes, fields, querier))
        }
        Ok(Message::Question(question)) => {
            about(record! { id: question.id }, ask::ask(&question, meshes, querier))
        }
        Err(error) => {
            let refusal = refusal(&format!("expected a line of the protocol, found {error}"));
            match serde_json::from_slice(line) {
                Ok(Numbered { id }) => record! { id: id }.with(refusal),
                Err(_) => refusal,
            }
        }
    }
}

/// Returns what a line is about, with its answer or with a refusal.
fn about(what: Record, answer: Result<Record, String>) -> Record {
    what.with(answer.unwrap_or_else(|reason| refusal(&reason)))
}

/// States what the command claims.
fn hello(settings: &str) -> Record {
    record! {
        hello: PROTOCOL,
        name: "cbvh",
        version: env!("CARGO_PKG_VERSION"),
        settings: settings,
        coordinates: "f64",
        placement: "f64",
        questions: ask::QUESTIONS,
        timed: [["collide", "distance", "contacts", "touched"], PROBED].concat(),
        batch: [&["collide", "distance"][..], &PROBED].concat(),
        features: ["open", "concave", "degenerate", "nested", "overlapping parts", "range", "refuses"],
        distance_error: MAX_DISTANCE_ERROR_OF_SIZE,
        error_unit: "size",
    }
}

/// Refuses to answer, for a reason.
fn refusal(reason: &str) -> Record {
    record! { refused: true, reason: reason }
}
