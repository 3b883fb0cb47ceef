//! Files of questions, one per line, and the files that answers are written to.

use super::arguments::AskingArguments;
use crate::console::Failure;
use std::io;
use std::path::{Path, PathBuf};

/// Reads all files of a list, so that a mistake in the last one is told before the first one is asked about. Returns their
/// stems and the questions to ask. `what` names the files in messages.
pub(crate) fn read_all<T>(
    list: Option<&str>,
    what: &str,
    arguments: &AskingArguments,
    read: impl Fn(&Path) -> Result<Vec<T>, Failure>,
) -> Result<Vec<(String, Vec<T>)>, Failure> {
    let names = list.unwrap_or_default().split(',').filter(|name| !name.is_empty());
    let files: Vec<PathBuf> = names.map(PathBuf::from).collect();
    if files.is_empty() {
        return Err(Failure::Usage(format!("expected {what}, found none (see --help)")));
    }
    if files.len() > 1 && arguments.out.as_ref().is_some_and(|out| !out.contains("%s")) {
        return Err(Failure::Usage(format!(
            "--out: expected %s in the name, because there are several {what} (see --help)"
        )));
    }
    let read = |file: PathBuf| {
        let mut questions = read(&file)?;
        if arguments.limit > 0 {
            questions.truncate(arguments.limit);
        }
        Ok((stem(&file), questions))
    };
    files.into_iter().map(read).collect()
}

/// Refuses what is no regular file, without opening it: opening a named pipe would wait for its other end. Files that the
/// command line names may be pipes; those that a text or a folder names may not.
pub(crate) fn regular_file(path: &Path) -> io::Result<()> {
    match std::fs::metadata(path)? {
        metadata if metadata.is_file() => Ok(()),
        metadata if metadata.is_dir() => Err(io::ErrorKind::IsADirectory.into()),
        _ => Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file")),
    }
}

/// Refuses a file that a text names and that is no regular file.
pub(crate) fn require_regular(path: &Path) -> Result<(), Failure> {
    regular_file(path).map_err(|error| Failure::from_input(path, &error))
}

/// Reads a file of one question per line. `#` starts a comment, and blank lines are skipped. `none` is the message for a file
/// without questions.
pub(crate) fn read_lines<T>(
    path: &Path,
    none: &str,
    parse: impl Fn(&str) -> Result<Option<T>, String>,
) -> Result<Vec<T>, Failure> {
    let bytes = std::fs::read(path).map_err(|error| Failure::from_input(path, &error))?;
    let mut questions = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let text = String::from_utf8_lossy(line);
        let question = parse(text.split('#').next().unwrap_or(""));
        questions
            .extend(question.map_err(|text| Failure::invalid(path, format_args!("line {number}: {text}")))?);
    }
    if questions.is_empty() { Err(Failure::invalid(path, none)) } else { Ok(questions) }
}

/// Parses the question of an option. Commas may separate the numbers.
pub(crate) fn parse_one<T>(
    option: &str,
    text: &str,
    expected: &str,
    parse: impl Fn(&str) -> Result<Option<T>, String>,
) -> Result<T, Failure> {
    let invalid = |text: String| Failure::Invalid(format!("{option}: {text}"));
    let question = parse(&text.replace(',', " ")).map_err(invalid)?;
    question.ok_or_else(|| invalid(format!("{expected}, found none")))
}

/// Parses numbers separated by spaces.
pub(crate) fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let number = |word: &str| {
        let shown = || word.chars().take(40).collect::<String>();
        word.parse().map_err(|_| format!("expected a number, found {:?}", shown()))
    };
    text.split_whitespace().map(number).collect()
}

/// Returns the name of a file without its folders and its extension.
pub(crate) fn stem(path: &Path) -> String {
    path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Writes a text file whole or not at all.
pub(crate) fn write_file(path: &Path, text: &str) -> Result<(), Failure> {
    let written = bvh_bake::write_atomically(path, text.as_bytes());
    written.map_err(|error| Failure::from_bake(&path.display().to_string(), &error))
}
