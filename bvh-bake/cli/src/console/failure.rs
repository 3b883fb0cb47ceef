//! Why a command stops: one line on standard error, and an exit code.

use bvh_bake::input::ReadError;
use bvh_bake::{BakeError, FileError, VerifyError};
use bvh_query::{BackendError, OpenError};
use serde::Serialize;
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

/// Why a command stops. Each text is one line and names the file.
#[derive(Debug)]
pub(crate) enum Failure {
    /// The command line asks for something that cannot be done. Exit code 1.
    Usage(String),
    /// The system refused. Exit code 2.
    System(String),
    /// An input is invalid. Exit code 3.
    Invalid(String),
    /// A limit was reached. Exit code 4.
    Limit(String),
    /// The command printed help, or its reader closed the pipe. Exit code 0.
    Nothing,
}

impl Failure {
    /// Classifies an error of writing to standard output.
    pub(crate) fn from_output(error: &io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self::Nothing,
            _ => Self::System(format!("standard output: cannot write: {error}")),
        }
    }

    /// Describes a file that the system does not let the command read.
    pub(crate) fn from_input(path: &Path, error: &io::Error) -> Self {
        Self::System(format!("{}: expected a readable file, found {}", path.display(), unreadable(error)))
    }

    /// Describes a folder that the system does not let the command read.
    pub(crate) fn from_folder(path: &Path, error: &io::Error) -> Self {
        Self::System(format!("{}: expected a readable folder, found {}", path.display(), unreadable(error)))
    }

    /// Classifies an error of baking these inputs.
    pub(crate) fn from_bake(inputs: &str, error: &BakeError) -> Self {
        let named = format!("{inputs}: {error}");
        match error {
            BakeError::Read(ReadError::Io { path, source }) => Self::from_input(path, source),
            BakeError::Read(read) if read.is_system() => Self::System(error.to_string()),
            BakeError::Read(read) if read.is_limit() => Self::Limit(error.to_string()),
            BakeError::Read(_) => Self::Invalid(error.to_string()),
            BakeError::Input(input) if input.is_limit() => Self::Limit(named),
            BakeError::Input(_) => Self::Invalid(named),
            BakeError::Write { path, action, source } => Self::from_write(path, action, source),
            BakeError::Room { .. } => {
                Self::System(format!("{error}; free some, or name a folder on another disk"))
            }
            BakeError::OutputIsInput { .. } => Self::Usage(error.to_string()),
            // The mesh is valid, and other options bake it.
            BakeError::MaxError { .. } => Self::Usage(named),
            BakeError::Memory { needed, .. } => Self::Limit(format!("{error}: {}", enough(*needed))),
            BakeError::Limit(_) => Self::Limit(named),
            // `Unproved` is a defect of the baker: neither the system nor the command line is to blame.
            BakeError::Unproved(_) | BakeError::NoOutDir => Self::Invalid(named),
            _ => Self::System(error.to_string()),
        }
    }

    /// Describes an output that the system does not let the command write.
    fn from_write(path: &Path, action: &str, error: &io::Error) -> Self {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let why = match folder {
            Some(folder) if error.kind() == io::ErrorKind::NotFound && !folder.exists() => {
                format!("expected the folder {}, found none; create it first", folder.display())
            }
            _ => error.to_string(),
        };
        Self::System(format!("{}: cannot {action}: {why}", path.display()))
    }

    /// Describes an invalid file.
    pub(crate) fn invalid(path: &Path, error: impl Display) -> Self {
        Self::Invalid(format!("{}: {error}", path.display()))
    }

    /// Classifies an error of reading a `.cbvh` file piece by piece.
    pub(crate) fn from_file(path: &Path, error: FileError) -> Self {
        match error {
            FileError::Io { path, source } => Self::from_input(&path, &source),
            FileError::Memory { needed, .. } => Self::Limit(format!("{error}: {}", enough(needed))),
            FileError::Format(error) => Self::invalid(path, error),
            error => Self::System(error.to_string()),
        }
    }

    /// Classifies what `verify` found.
    pub(crate) fn from_verify(path: &Path, meshes: &str, error: VerifyError) -> Self {
        match error {
            VerifyError::Mesh(error) if error.is_limit() => Self::Limit(format!("{meshes}: {error}")),
            VerifyError::Mesh(error) => Self::Invalid(format!("{meshes}: {error}")),
            VerifyError::Input(error) => Self::from_bake(meshes, &error),
            VerifyError::File(error) => Self::from_file(path, error),
            error => Self::invalid(path, error),
        }
    }

    /// Prints the line on standard error and returns the exit code.
    pub(crate) fn tell(self) -> ExitCode {
        let Some((code, line)) = self.line() else { return ExitCode::SUCCESS };
        tell_line(&line);
        ExitCode::from(code)
    }

    /// Returns the exit code and the line, if there is something to tell.
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
            _ => Self::Invalid(error.to_string()),
        }
    }
}

impl From<BackendError> for Failure {
    fn from(error: BackendError) -> Self {
        Self::Usage(error.to_string())
    }
}

/// Says why a file cannot be read.
fn unreadable(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "nothing of this name".to_owned(),
        io::ErrorKind::PermissionDenied => "one that this user may not read".to_owned(),
        io::ErrorKind::IsADirectory => "a folder".to_owned(),
        _ => error.to_string(),
    }
}

/// Says which budget of memory is enough. This completes the remedy that the library's message ends with.
fn enough(needed: u64) -> String {
    format!("give --max-memory {}MiB or more", needed.div_ceil(1 << 20))
}

/// Writes a line to standard error. A failure to do so has nowhere to be told.
pub(crate) fn tell_line(line: &str) {
    let _ = writeln!(io::stderr().lock(), "cbvh: {line}");
}

/// Writes a JSON object and a line feed to standard error. A failure to do so has nowhere to be told.
pub(crate) fn tell_json(value: &impl Serialize) {
    if let Ok(line) = serde_json::to_string(value) {
        let _ = writeln!(io::stderr().lock(), "{line}");
    }
}

/// Escapes line breaks and other control characters, which file names may contain.
fn one_line(text: &str) -> String {
    let escape = |c: char| if c.is_control() { c.escape_debug().collect() } else { vec![c] };
    text.chars().flat_map(escape).collect()
}
