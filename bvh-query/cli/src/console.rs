//! Output and exit of all commands: standard output and error, records in JSON, and exit codes.

use bvh_bake::input::ReadError;
use bvh_bake::{BakeError, FileError, VerifyError};
use bvh_query::{BackendError, OpenError};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::{Serialize, Serializer};
use serde_json::Value;
use serde_json::value::{RawValue, to_raw_value};
use std::fmt::{self, Display};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

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
    /// What `--fail-on` names was found. Exit code 5.
    Found(String),
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
        Self::system(path, format_args!("expected a readable file, found {}", unreadable(path, error)))
    }

    /// Describes a folder that the system does not let the command read.
    pub(crate) fn from_folder(path: &Path, error: &io::Error) -> Self {
        Self::system(path, format_args!("expected a readable folder, found {}", unreadable(path, error)))
    }

    /// Classifies an error of baking these inputs.
    pub(crate) fn from_bake(inputs: impl Display, error: &BakeError) -> Self {
        let named = format!("{inputs}: {error}");
        match error {
            BakeError::Read(ReadError::Io { path, source }) => Self::from_input(path, source),
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
            BakeError::MaxError { .. }
            | BakeError::Weld { .. }
            | BakeError::Radius(_)
            | BakeError::NotClosed { .. } => Self::Usage(named),
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
        Self::system(path, format_args!("cannot {action}: {why}"))
    }

    /// Describes a command line that cannot be obeyed, and points to the help.
    pub(crate) fn usage(text: impl Display) -> Self {
        Self::Usage(format!("{text} (see --help)"))
    }

    /// Describes what the system does not allow with a file or a folder.
    pub(crate) fn system(path: &Path, error: impl Display) -> Self {
        Self::System(format!("{}: {error}", path.display()))
    }

    /// Describes threads that the system does not start.
    pub(crate) fn from_threads(jobs: u16, error: impl Display) -> Self {
        Self::System(format!("--jobs {jobs}: cannot start threads: {error}"))
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
            Self::Found(text) => (5, text),
        };
        Some((code, shown(&text)))
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
fn unreadable(path: &Path, error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "nothing of this name".to_owned(),
        // Windows refuses to open a folder as a file, and has no metadata of what is not a file.
        io::ErrorKind::PermissionDenied if path.is_dir() => "a folder".to_owned(),
        _ if cfg!(windows) && std::fs::metadata(path).is_err() => "a device or a pipe".to_owned(),
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
    let _ = writeln!(io::stderr().lock(), "cbvh: {}", shown(line));
}

/// Writes a warning to standard error.
pub(crate) fn tell_warning(warning: &str) {
    tell_line(&format!("warning: {warning}"));
}

/// Writes a JSON object and a line feed to standard error. A failure to do so has nowhere to be told.
pub(crate) fn tell_json(value: &impl Serialize) {
    if let Ok(line) = serde_json::to_string(value) {
        let _ = writeln!(io::stderr().lock(), "{line}");
    }
}

/// Returns text from a file, or the name of one, as a terminal may show it. Control characters, which a terminal obeys and which
/// begin new lines, are escaped, and so are separators of lines and marks that change the direction of text.
pub(crate) fn shown(text: &str) -> String {
    let is_obeyed = |c: char| {
        c.is_control()
            || matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if is_obeyed(c) {
            shown.extend(c.escape_debug());
        } else {
            shown.push(c);
        }
    }
    shown
}

/// Returns a path as a word of a command that a person may copy into a shell.
pub(crate) fn word(path: &Path) -> String {
    let name = path.display().to_string();
    // Otherwise it would be an option.
    let name = if name.starts_with('-') { format!("./{name}") } else { name };
    let is_plain =
        |c: char| c.is_alphanumeric() || "_./+-".contains(c) || (cfg!(windows) && "\\:".contains(c));
    match name.chars().all(is_plain) {
        true => name,
        false if cfg!(windows) => format!("\"{name}\""),
        false => format!("'{}'", name.replace('\'', r"'\''")),
    }
}

/// Prints text as it is. Names in it must be [`shown`].
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| Failure::from_output(&error))
}

/// Prints many lines through a buffer.
pub(crate) fn lines(lines: impl IntoIterator<Item = impl Display>) -> Result<(), Failure> {
    let mut stdout = BufWriter::new(io::stdout().lock());
    let written = lines.into_iter().try_for_each(|line| writeln!(stdout, "{line}"));
    written.and_then(|()| stdout.flush()).map_err(|error| Failure::from_output(&error))
}

/// Prints one JSON object and a line feed.
pub(crate) fn json(value: &impl Serialize) -> Result<(), Failure> {
    // Serialisation fails only for maps whose keys are not strings, and there are none.
    let line = serde_json::to_string(value).map_err(|error| Failure::System(format!("JSON: {error}")))?;
    text(&format!("{line}\n"))
}

/// A JSON object whose fields stay in the order in which they are written; [`record!`] makes one.
#[derive(Debug, Clone)]
pub(crate) struct Record(Vec<(&'static str, Box<RawValue>)>);

impl Record {
    /// Makes a field. The values of this program can all be written as JSON.
    pub(crate) fn field(name: &'static str, value: &impl Serialize) -> (&'static str, Box<RawValue>) {
        (name, to_raw_value(value).unwrap_or_default())
    }

    /// Makes a record of these fields.
    pub(crate) fn new(fields: Vec<(&'static str, Box<RawValue>)>) -> Self {
        Self(fields)
    }

    /// Makes a record of one field.
    pub(crate) fn of(name: &'static str, value: &impl Serialize) -> Self {
        Self(vec![Self::field(name, value)])
    }

    /// Adds the fields of another record, if there is one.
    pub(crate) fn with(mut self, other: impl Into<Option<Self>>) -> Self {
        self.0.extend(other.into().into_iter().flat_map(|other| other.0));
        self
    }

    /// Returns the names of all fields.
    pub(crate) fn names(&self) -> impl Iterator<Item = &'static str> {
        self.0.iter().map(|(name, _)| *name)
    }

    /// Returns a field as JSON, or null if there is none.
    fn value(&self, name: &str) -> Value {
        let found = self.0.iter().find(|(other, _)| *other == name);
        found.and_then(|(_, raw)| serde_json::from_str(raw.get()).ok()).unwrap_or_default()
    }

    /// Returns a number, and 1 for true and 0 for false.
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        let value = self.value(name);
        value.as_f64().or(value.as_bool().map(|flag| f64::from(u8::from(flag))))
    }

    /// Returns a field as text: a string without quotes, 1 for true and 0 for false, nothing for null.
    pub(crate) fn text(&self, name: &str) -> String {
        match self.value(name) {
            Value::Null => String::new(),
            Value::Bool(flag) => u8::from(flag).to_string(),
            Value::String(text) => text,
            value => value.to_string(),
        }
    }
}

impl Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&serde_json::to_string(self).map_err(|_| fmt::Error)?)
    }
}

impl Serialize for Record {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

/// Makes a [`Record`] of named values.
macro_rules! record {
    ($($name:ident: $value:expr),* $(,)?) => {
        $crate::console::Record::new(vec![$($crate::console::Record::field(stringify!($name), &$value)),*])
    };
}
pub(crate) use record;

/// Writes rows as comma-separated values (RFC 4180): a line of the names of fields, then one line per row. A figure that was not
/// taken is absent, never 0 or NaN. A text that a spreadsheet may take for a formula has an apostrophe before it, and so has one
/// that begins with an apostrophe, so that a reader gets every text back by removing the apostrophe with which it begins.
pub(crate) fn csv<'a>(names: &[&'static str], rows: impl IntoIterator<Item = &'a Record>) -> String {
    let line = |fields: Vec<String>| fields.join(",") + "\n";
    let quoted = |field: String| {
        let is_plain = !field.contains([',', '"', '\n', '\r']);
        if is_plain { field } else { format!("\"{}\"", field.replace('"', "\"\"")) }
    };
    let field = |row: &Record, name: &str| {
        let text = row.text(name);
        let is_guarded = row.number(name).is_none() && text.starts_with(may_begin_a_formula);
        if is_guarded { format!("'{text}") } else { text }
    };
    let mut text = line(names.iter().map(|&name| name.to_owned()).collect());
    for row in rows {
        text += &line(names.iter().map(|name| quoted(field(row, name))).collect());
    }
    text
}

/// Returns whether a text with this first character needs an apostrophe: the characters that OWASP lists in "CSV Injection",
/// with their full-width forms, all control characters, and the apostrophe itself.
fn may_begin_a_formula(first: char) -> bool {
    "=+-@\u{ff1d}\u{ff0b}\u{ff0d}\u{ff20}'".contains(first) || first.is_control()
}

/// Escapes text for an element or an attribute of XML.
pub(crate) fn escape(text: &str) -> String {
    let escaped = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        '"' => "&quot;".to_owned(),
        // XML has no way to write most of these (XML 1.0, production 2).
        c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => "\u{fffd}".to_owned(),
        c => c.to_string(),
    };
    text.chars().map(escaped).collect()
}

/// Returns a checksum in the form that scripts compare.
pub(crate) fn hex(sum: u64) -> String {
    format!("{sum:016x}")
}

/// Formats a number. Infinities become `inf` and `-inf`, and NaN becomes `nan`.
pub(crate) fn significant(value: f64) -> String {
    if value.is_nan() {
        return "nan".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "inf" } else { "-inf" }.to_owned();
    }
    let scientific = format!("{value:.16e}");
    let Some((mantissa, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if !(-4..17).contains(&exponent) {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trimmed(mantissa), exponent.abs());
    }
    let decimals = (16 - exponent).max(0) as usize;
    let plain = format!("{value:.decimals$}");
    trimmed(&plain).to_owned()
}

/// Removes trailing zeros of a fraction.
pub(crate) fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Returns a count and its word, with an s unless the count is one.
pub(crate) fn counted(count: u64, word: &str) -> String {
    format!("{count} {word}{}", if count == 1 { "" } else { "s" })
}

/// Returns a length in mesh units as an exponent, and zero as a plain 0.
pub(crate) fn length(length: f64) -> String {
    if length == 0.0 { "0".to_owned() } else { format!("{length:e}") }
}

/// Returns paths separated by commas.
pub(crate) fn names(paths: &[PathBuf]) -> String {
    let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
    names.join(", ")
}

/// The time between two drawings of the line.
const TICK: Duration = Duration::from_millis(100);

/// Returns a line with a message and the elapsed time. It stays hidden if standard error is not a terminal, or if the
/// command is quiet.
pub(crate) fn spinner(quiet: bool) -> ProgressBar {
    let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
    let spinner = ProgressBar::with_draw_target(None, target);
    if !spinner.is_hidden() {
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
            spinner.set_style(style);
        }
        spinner.enable_steady_tick(TICK);
    }
    spinner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_formatted_as_in_c() {
        // From printf("%.17g").
        let cases = [
            (0.0, "0"),
            (-0.0, "-0"),
            (1.0, "1"),
            (0.1, "0.10000000000000001"),
            (100.0, "100"),
            (1e16, "10000000000000000"),
            (1e17, "1e+17"),
            (123456789.125, "123456789.125"),
            (0.0001, "0.0001"),
            (0.00001, "1.0000000000000001e-05"),
            (2.5e-7, "2.4999999999999999e-07"),
            (1e-100, "1e-100"),
            (9.999999999999999e22, "9.9999999999999992e+22"),
            (5e-324, "4.9406564584124654e-324"),
            (1.0 / 3.0, "0.33333333333333331"),
        ];
        for (value, expected) in cases {
            assert_eq!(significant(value), expected);
            assert_eq!(expected.parse::<f64>().map(f64::to_bits), Ok(value.to_bits()));
        }
    }

    #[test]
    fn what_a_terminal_would_obey_is_escaped() {
        let hostile = "a\u{1b}[31m\r\n\t\0\u{7f}\u{9b}0m\u{202e}b\u{2028}\u{2069}\u{61c}";
        let expected = "a\\u{1b}[31m\\r\\n\\t\\0\\u{7f}\\u{9b}0m\\u{202e}b\\u{2028}\\u{2069}\\u{61c}";
        assert_eq!(shown(hostile), expected);
        let harmless = "C:\\teil 1/\u{fc}ber \"a\" | b\u{301} \u{4e00}\u{1f600} \u{939}\u{93f} \u{200d}";
        assert_eq!(shown(harmless), harmless);
    }

    #[test]
    #[cfg(not(windows))]
    fn a_path_is_one_word_for_a_shell() {
        let cases = [
            ("parts/arm-1.glb", "parts/arm-1.glb"),
            ("-o", "./-o"),
            ("--scene x", "'./--scene x'"),
            ("two words", "'two words'"),
            ("it's $(date)", r"'it'\''s $(date)'"),
            ("~", "'~'"),
        ];
        for (path, expected) in cases {
            assert_eq!(word(Path::new(path)), expected);
        }
    }

    #[test]
    fn a_spreadsheet_finds_no_formula() {
        let cases = [
            ("arm", "arm"),
            ("a=1", "a=1"),
            ("", ""),
            ("=1+2", "'=1+2"),
            ("+1", "'+1"),
            ("-1", "'-1"),
            ("@SUM(A1)", "'@SUM(A1)"),
            ("\t=1", "'\t=1"),
            ("\r=1", "\"'\r=1\""),
            ("\n=1", "\"'\n=1\""),
            ("\0=1", "'\0=1"),
            ("\u{ff1d}1", "'\u{ff1d}1"),
            ("'=1", "''=1"),
            ("=cmd|' /C calc'!A0,\"", "\"'=cmd|' /C calc'!A0,\"\"\""),
        ];
        for (text, expected) in cases {
            let row = record! { name: text, number: -1.5, count: -2, flag: true, none: None::<f64> };
            let names: Vec<&str> = row.names().collect();
            assert_eq!(csv(&names, [&row]), format!("name,number,count,flag,none\n{expected},-1.5,-2,1,\n"));
            // What a reader has to do.
            let unquoted = expected.strip_prefix('"').and_then(|rest| rest.strip_suffix('"'));
            let field = unquoted.map_or(expected.to_owned(), |field| field.replace("\"\"", "\""));
            assert_eq!(field.strip_prefix('\'').unwrap_or(&field), text);
        }
    }

    #[test]
    fn characters_that_xml_lacks_are_replaced() {
        // The replacement character itself is the last one before U+FFFE.
        assert_eq!(
            escape("\u{8}\u{b}\u{1f} \u{fffd}\u{fffe}\u{ffff}"),
            "\u{fffd}\u{fffd}\u{fffd} \u{fffd}\u{fffd}\u{fffd}"
        );
        assert_eq!(escape("\u{d7ff}\u{e000}\u{10000}\u{10ffff}"), "\u{d7ff}\u{e000}\u{10000}\u{10ffff}");
        assert_eq!(escape("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;");
    }
}
