//! The options of all commands that ask about files of questions.

use super::mesh::How;
use super::runner::Limits;
use crate::console::Failure;
use crate::options::{LayoutArguments, not_negative, threads, whole};
use clap::{Args, ValueEnum};

/// The options for asking. Each command has an argument `one`, which asks a single question and excludes what only files
/// need.
#[derive(Debug, Args)]
pub(crate) struct AskingArguments {
    /// The instruction set: auto, scalar, avx2 or avx512. auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    pub(crate) isa: String,
    /// The number of threads that share the questions
    #[arg(long, value_name = "N", default_value = "1", value_parser = threads, allow_negative_numbers = true,
          conflicts_with = "one")]
    jobs: u16,
    #[command(flatten)]
    layout: LayoutArguments,
    /// Query only the object of this name, in each mesh that has one
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Write raw answers and times to this file; %s stands for the name of the file of questions
    #[arg(long, value_name = "raw_%s.txt", conflicts_with = "one")]
    pub(super) out: Option<String>,
    /// Stop each file after this many seconds
    #[arg(long, value_name = "S", value_parser = not_negative, allow_negative_numbers = true, conflicts_with = "one")]
    pub(crate) budget: Option<f64>,
    /// Untimed questions before the timed ones, taken from the end of the file
    #[arg(long, value_name = "N", default_value = "3", value_parser = whole::<usize>, allow_negative_numbers = true,
          conflicts_with = "one")]
    warm: usize,
    /// Ask only the first N questions of each file; 0 asks all
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole::<usize>, allow_negative_numbers = true,
          conflicts_with = "one")]
    pub(super) limit: usize,
    /// How the system reads .cbvh files from the disk
    #[arg(long, value_enum, value_name = "HOW", default_value = "usual")]
    read_ahead: ReadAhead,
    /// Print one JSON object per question, with all that the answer has
    #[arg(long)]
    pub(crate) json: bool,
    /// Print one JSON object per file, with the times of its questions, and no answers
    #[arg(long, conflicts_with_all = ["one", "json"])]
    pub(super) bench: bool,
}

impl AskingArguments {
    /// Refuses what only files of questions need.
    pub(crate) fn require_no_files(&self) -> Result<(), Failure> {
        if self.bench || self.out.is_some() {
            return Err(Failure::Usage("--bench and --out require a file of questions (see --help)".into()));
        }
        Ok(())
    }

    /// Returns how meshes are prepared.
    pub(crate) fn how(&self) -> How<'_> {
        let (layout, object) = (&self.layout, self.object.as_deref());
        How { layout, object, read_ahead: self.read_ahead.into() }
    }

    /// Returns the limits of a run.
    pub(crate) fn limits(&self) -> Limits {
        Limits { jobs: usize::from(self.jobs), warm: self.warm, budget: self.budget }
    }
}

/// How the system reads a file from the disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ReadAhead {
    /// As the system chooses: some pages around each page that is touched
    Usual,
    /// Only the pages that queries touch
    Sparse,
    /// The whole file, in the background
    Whole,
}

impl From<ReadAhead> for bvh_query::ReadAhead {
    fn from(how: ReadAhead) -> Self {
        match how {
            ReadAhead::Usual => Self::Usual,
            ReadAhead::Sparse => Self::Sparse,
            ReadAhead::Whole => Self::Whole,
        }
    }
}
