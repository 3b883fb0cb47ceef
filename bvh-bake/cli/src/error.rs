//! What went wrong, as one line and an exit code.

use bvh_bake::{BakeError, FileError, VerifyError};
use bvh_query::{BackendError, OpenError};
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Why a command stopped. The texts are one line and name the file.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line asks for what there is not. Exit code 1.
    Usage(String),
    /// The system refused. Exit code 2.
    System(String),
    /// A file is not what it should be. Exit code 3.
    Invalid(String),
    /// A limit was reached. Exit code 4.
    Limit(String),
    /// Somebody asked for help, or stopped reading. Exit code 0.
    Nothing,
}

impl Failure {
    /// Usage errors as one line; help and version printed.
    pub(crate) fn from_clap(error: clap::Error) -> Self {
        if !error.use_stderr() {
            return match crate::output::text(&error.render().to_string()) {
                Ok(()) => Self::Nothing,
                Err(failure) => failure,
            };
        }
        if error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            return Self::Usage(
                "expected a command: bake, dump, validate, verify, query or report (see --help)".into(),
            );
        }
        let text = error.render().to_string();
        // What follows is the usage, several lines of it.
        let said = text.split("\n\nUsage:").next().unwrap_or(&text);
        let said = said.split("\n\nFor more").next().unwrap_or(said);
        let words: Vec<&str> = said.split_whitespace().collect();
        let said = words.join(" ");
        Self::Usage(format!("{} (see --help)", said.strip_prefix("error: ").unwrap_or(&said)))
    }

    /// What the system said when standard output was written.
    pub(crate) fn from_output(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::Nothing,
            _ => Self::System(format!("standard output: cannot write: {error}")),
        }
    }

    /// What went wrong with an input file.
    pub(crate) fn from_input(path: &Path, error: &io::Error) -> Self {
        Self::System(format!("{}: expected a readable file, found {error}", path.display()))
    }

    /// What went wrong in a bake of these inputs.
    pub(crate) fn from_bake(inputs: &str, error: &BakeError) -> Self {
        let named = format!("{inputs}: {error}");
        match error {
            BakeError::Read(read) if read.is_system() => Self::System(error.to_string()),
            BakeError::Read(read) if read.is_limit() => Self::Limit(error.to_string()),
            BakeError::Read(_) => Self::Invalid(error.to_string()),
            BakeError::Input(input) if input.is_limit() => Self::Limit(named),
            BakeError::Input(_) => Self::Invalid(named),
            BakeError::Write { .. } | BakeError::Room { .. } => Self::System(error.to_string()),
            BakeError::OutputIsInput { .. } => Self::Usage(error.to_string()),
            BakeError::Memory { .. } => Self::Limit(error.to_string()),
            BakeError::Limit(_) => Self::Limit(named),
            // A defect of the baker; nothing in the environment is to blame, nor the command line.
            BakeError::Unproved(_) | BakeError::NoOutDir => Self::Invalid(named),
        }
    }

    /// The code to exit with, after the line on standard error.
    pub(crate) fn tell(self) -> ExitCode {
        let Some((code, line)) = self.line() else { return ExitCode::SUCCESS };
        tell_line(&line);
        ExitCode::from(code)
    }

    /// The exit code and the line, if there is something to tell.
    pub(crate) fn line(self) -> Option<(u8, String)> {
        let (code, text) = match self {
            Self::Nothing => return None,
            Self::Usage(text) => (1, text),
            Self::System(text) => (2, text),
            Self::Invalid(text) => (3, text),
            Self::Limit(text) => (4, text),
        };
        Some((code, one_line(&text)))
    }
}

impl From<OpenError> for Failure {
    fn from(error: OpenError) -> Self {
        match error {
            OpenError::Io { path, source } => Self::from_input(&path, &source),
            OpenError::Format { .. } => Self::Invalid(error.to_string()),
        }
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Self {
        Self::Usage(error.to_string())
    }
}

impl Failure {
    /// An invalid file, named.
    pub(crate) fn invalid(path: &Path, error: impl Display) -> Self {
        Self::Invalid(format!("{}: {error}", path.display()))
    }

    /// What went wrong with a `.cbvh` file that was read piece by piece.
    pub(crate) fn from_file(path: &Path, error: FileError) -> Self {
        match error {
            FileError::Io { .. } => Self::System(error.to_string()),
            FileError::Memory { .. } => Self::Limit(error.to_string()),
            FileError::Format(error) => Self::invalid(path, error),
        }
    }

    /// What `verify` found.
    pub(crate) fn from_verify(path: &Path, meshes: &str, error: VerifyError) -> Self {
        match error {
            VerifyError::Mesh(error) if error.is_limit() => Self::Limit(format!("{meshes}: {error}")),
            VerifyError::Mesh(error) => Self::Invalid(format!("{meshes}: {error}")),
            VerifyError::Input(error) => Self::from_bake(meshes, &error),
            VerifyError::File(error) => Self::from_file(path, error),
            error => Self::invalid(path, error),
        }
    }
}

/// Writes a line on standard error. If nobody listens there is nobody to tell.
pub(crate) fn tell_line(line: &str) {
    let _ = writeln!(io::stderr().lock(), "cbvh: {line}");
}

/// Writes a JSON object and a line feed on standard error. If nobody listens there is nobody to tell.
pub(crate) fn tell_json(value: &impl Serialize) {
    if let Ok(line) = serde_json::to_string(value) {
        let _ = writeln!(io::stderr().lock(), "{line}");
    }
}

/// A message without line breaks or other control characters, which names of files may hold.
fn one_line(text: &str) -> String {
    let escape = |c: char| if c.is_control() { c.escape_debug().collect() } else { vec![c] };
    text.chars().flat_map(escape).collect()
}
