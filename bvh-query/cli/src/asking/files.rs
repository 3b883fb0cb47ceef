//! Files of questions, one per line: poses, motions and others; manifests and folders; and the files that answers are written
//! to.

use super::AskingArguments;
use crate::console::Failure;
use bvh_bake::BakeError;
use bvh_query::{Motion, Pose};
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// Reads all files of a list before any question is asked, so that a mistake in the last file is reported first.
/// Returns their stems and the questions to ask. `what` names the files in messages. No output may replace a file or a mesh.
pub(crate) fn read_all<T>(
    list: Option<&str>,
    what: &str,
    arguments: &AskingArguments,
    meshes: &[&PathBuf],
    read: impl Fn(&Path) -> Result<Vec<T>, Failure>,
) -> Result<Vec<(String, Vec<T>)>, Failure> {
    let names = list.unwrap_or_default().split(',').filter(|name| !name.is_empty());
    let files: Vec<PathBuf> = names.map(PathBuf::from).collect();
    if files.is_empty() {
        return Err(Failure::usage(format_args!("expected {what}, found none")));
    }
    if files.len() > 1 && arguments.out.as_ref().is_some_and(|out| !out.contains("%s")) {
        let what = format_args!("--out: expected %s in the name, because there are several {what}");
        return Err(Failure::usage(what));
    }
    let outputs = files.iter().filter_map(|file| arguments.raw_file(&stem(file)));
    refuse_overwriting(outputs, files.iter().chain(meshes.iter().copied()))?;
    let read = |file: PathBuf| {
        let mut questions = read(&file)?;
        if arguments.run.limit > 0 {
            questions.truncate(arguments.run.limit);
        }
        Ok((stem(&file), questions))
    };
    files.into_iter().map(read).collect()
}

/// Returns questions without the numbers of their lines.
pub(crate) fn unnumbered<T>(questions: Vec<(usize, T)>) -> Vec<T> {
    questions.into_iter().map(|(_, question)| question).collect()
}

/// Refuses anything but a regular file, without opening it: opening a named pipe would wait for its other end. Files
/// that the command line names may be pipes; those that a text or a folder names may not.
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

/// The mark that some editors, most of them on Windows, write at the beginning of UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Reads a text file, without a byte order mark.
pub(crate) fn read_text(path: &Path) -> Result<Vec<u8>, Failure> {
    // On Windows, a device such as the console has no metadata, and must not make the command wait.
    let read = std::fs::metadata(path).and_then(|_| std::fs::read(path));
    let mut bytes = read.map_err(|error| Failure::from_input(path, &error))?;
    if bytes.starts_with(BYTE_ORDER_MARK) {
        bytes.drain(..BYTE_ORDER_MARK.len());
    }
    Ok(bytes)
}

/// Reads a file of one question per line, and returns the questions with the numbers of their lines. `#` starts a comment, and
/// blank lines are skipped. `none` is the message for a file without questions.
pub(crate) fn read_lines<T>(
    path: &Path,
    none: &str,
    parse: impl Fn(&str) -> Result<Option<T>, String>,
) -> Result<Vec<(usize, T)>, Failure> {
    let bytes = read_text(path)?;
    let mut questions = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|&byte| byte == b'\n')) {
        let text = String::from_utf8_lossy(line);
        let question = parse(text.split('#').next().unwrap_or(""));
        let question =
            question.map_err(|text| Failure::invalid(path, format_args!("line {number}: {text}")))?;
        questions.extend(question.map(|question| (number, question)));
    }
    if questions.is_empty() { Err(Failure::invalid(path, none)) } else { Ok(questions) }
}

/// The most bytes of a line of JSON. Paths that a system opens are much shorter.
const MAX_LINE_BYTES: u64 = 1 << 16;

/// Reads a file of one JSON object per line, and calls `add` with the number of each line and what it holds. Empty lines are
/// skipped, but counted. Messages say what an object is `expected` to be.
pub(crate) fn each_json_line<T: DeserializeOwned>(
    path: &Path,
    expected: &str,
    mut add: impl FnMut(u64, T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let failed = |error| Failure::from_input(path, &error);
    let mut lines = BufReader::new(File::open(path).map_err(failed)?);
    for number in 1.. {
        let mut bytes = Vec::new();
        if lines.by_ref().take(MAX_LINE_BYTES + 1).read_until(b'\n', &mut bytes).map_err(failed)? == 0 {
            break;
        }
        bytes.pop_if(|last| *last == b'\n');
        if number == 1 && bytes.starts_with(BYTE_ORDER_MARK) {
            bytes.drain(..BYTE_ORDER_MARK.len());
        }
        if bytes.len() as u64 > MAX_LINE_BYTES {
            return Err(Failure::Limit(format!(
                "{}: line {number}: expected at most {MAX_LINE_BYTES} bytes in a line, found more",
                path.display()
            )));
        }
        if bytes.trim_ascii().is_empty() {
            continue;
        }
        let line = serde_json::from_slice(&bytes).map_err(|error| {
            let (column, text) = (error.column(), error.to_string());
            // The parser sees one line, so that its line number is always 1.
            let text = text.split(" at line ").next().unwrap_or(&text);
            let what = format_args!("line {number}: column {column}: expected {expected}, found: {text}");
            Failure::invalid(path, what)
        })?;
        add(number, line)?;
    }
    Ok(())
}

/// Returns the wanted files in a folder and its subfolders, sorted by path. Links to folders are not followed, because they may
/// form a cycle.
pub(crate) fn files_below(folder: &Path, is_wanted: impl Fn(&Path) -> bool) -> Result<Vec<PathBuf>, Failure> {
    let (mut files, mut folders) = (Vec::new(), vec![folder.to_owned()]);
    while let Some(folder) = folders.pop() {
        let failed = |error| Failure::from_folder(&folder, &error);
        for entry in std::fs::read_dir(&folder).map_err(failed)? {
            let entry = entry.map_err(failed)?;
            let path = entry.path();
            if entry.file_type().map_err(failed)?.is_dir() {
                folders.push(path);
            } else if is_wanted(&path) && !path.is_dir() {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Parses the question of an option. Commas may separate the numbers.
pub(crate) fn parse_option<T>(
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
    written.map_err(|error| Failure::from_bake(path.display(), &error))
}

/// Refuses an output that is an input, which it would replace, and two outputs in one file.
pub(crate) fn refuse_overwriting(
    outputs: impl IntoIterator<Item = impl AsRef<Path>>,
    inputs: impl IntoIterator<Item = impl AsRef<Path>>,
) -> Result<(), Failure> {
    let mut places = HashMap::new();
    for output in outputs {
        let output = output.as_ref().to_owned();
        if let Some(output) = places.insert(place(&output), output) {
            let what = "expected a different file for each output, found the same file for two";
            return Err(Failure::Usage(format!("{}: {what}", output.display())));
        }
    }
    if places.is_empty() {
        return Ok(());
    }
    match inputs.into_iter().find_map(|input| places.remove(&place(input.as_ref()))) {
        Some(path) => {
            Err(Failure::from_bake(path.display(), &BakeError::OutputIsInput { path: path.clone() }))
        }
        None => Ok(()),
    }
}

/// The most links that lead from a name to its file.
const MAX_LINKS: usize = 40;

/// Returns the same path for a file however it is named, whether it exists or not. Folders that do not exist contain no links.
pub(crate) fn place(path: &Path) -> PathBuf {
    let mut path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    // A link may lead to a file that does not exist yet.
    for _ in 0..MAX_LINKS {
        let Ok(target) = std::fs::read_link(&path) else { break };
        path.pop();
        path.push(target);
    }
    let place = resolve(&path);
    // Windows ignores the case of letters in names.
    if cfg!(windows) { place.to_string_lossy().to_lowercase().into() } else { place }
}

/// Returns a path without `.`, `..` and links to folders, whether it exists or not.
fn resolve(path: &Path) -> PathBuf {
    if let Ok(resolved) = std::fs::canonicalize(path) {
        return resolved;
    }
    match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) => resolve(parent).join(name),
        // The path ends in `..`, and the folder above does not exist: drop its last part.
        (Some(parent), None) => resolve(parent).parent().map(Path::to_owned).unwrap_or_default(),
        (None, _) => path.to_owned(),
    }
}

/// The number of numbers of a pose: the entries of a 3 by 4 matrix.
pub(crate) const POSE_NUMBERS: usize = 12;
/// The forms of a pose and of a motion, as messages state them.
const A_POSE: &str = "expected 12 numbers, the rows of the 3 by 4 matrix [R | t]";
const A_MOTION: &str = "expected 24 numbers, two poses of 12 numbers each";

/// Reads a file of poses. Each line has the 12 numbers of a 3 by 4 matrix, row by row.
pub(crate) fn read_poses(path: &Path) -> Result<Vec<Pose>, Failure> {
    let form = "expected at least one line of 12 numbers, the rows of the 3 by 4 matrix [R | t]";
    read_lines(path, &format!("{form}, found no pose"), parse_pose).map(unnumbered)
}

/// Reads a file of motions. Each line has the 24 numbers of two poses.
pub(crate) fn read_motions(path: &Path) -> Result<Vec<Motion>, Failure> {
    read_lines(path, &format!("{A_MOTION}, in at least one line, found none"), parse_motion).map(unnumbered)
}

/// Parses the pose of `--pose`.
pub(crate) fn one_pose(text: &str) -> Result<Pose, Failure> {
    parse_option("--pose", text, A_POSE, parse_pose)
}

/// Parses the motion of `--motion`.
pub(crate) fn one_motion(text: &str) -> Result<Motion, Failure> {
    parse_option("--motion", text, A_MOTION, parse_motion)
}

/// Parses a pose. Returns `None` if the text is blank.
pub(crate) fn parse_pose(text: &str) -> Result<Option<Pose>, String> {
    let numbers = numbers(text)?;
    if let Ok(rows) = <&[f64; POSE_NUMBERS]>::try_from(&numbers[..]) {
        return Pose::from_rows(rows).map(Some).map_err(|error| error.to_string());
    }
    // Guesses what the numbers mean, and says what to write instead.
    let guess = match numbers.len() {
        0 => return Ok(None),
        7 => {
            "; a quaternion and a translation? write the quaternion as a 3 by 3 matrix, and each number of the \
             translation after a row of it"
        }
        9 => "; a rotation alone? write a 0 after each row of it",
        16 => "; a 4 by 4 matrix? write its first three rows only, row by row",
        _ => "",
    };
    Err(format!("{A_POSE}, found {}{guess}", numbers.len()))
}

/// Parses the pose of an instance, which may also be 7 numbers: x, y and z of the position, and x, y, z and w of a unit
/// quaternion. Returns `None` if the text is blank.
pub(crate) fn parse_placed(text: &str) -> Result<Option<Pose>, String> {
    match numbers(text)?[..] {
        [x, y, z, i, j, k, w] => {
            Pose::from_quaternion([i, j, k, w], [x, y, z]).map(Some).map_err(|error| error.to_string())
        }
        _ => parse_pose(text),
    }
}

/// Parses a motion. Returns `None` if the text is blank.
fn parse_motion(text: &str) -> Result<Option<Motion>, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.is_empty() {
        return Ok(None);
    }
    if words.len() != 2 * POSE_NUMBERS {
        return Err(format!("{A_MOTION}, found {}", words.len()));
    }
    let pose = |words: &[&str], which: &str| {
        let pose = parse_pose(&words.join(" ")).map_err(|text| format!("{which}: {text}"))?;
        pose.ok_or_else(|| format!("{which}: {A_MOTION}, found none"))
    };
    let (start, end) = (pose(&words[..POSE_NUMBERS], "start")?, pose(&words[POSE_NUMBERS..], "end")?);
    Motion::between(&start, &end).map(Some).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pose_may_have_commas() {
        let pose = one_pose("1,0,0,2, 0,1,0,-3e1, 0 0 1 .5").unwrap();
        assert_eq!(pose.translation(), [2.0, -30.0, 0.5]);
        for wrong in ["", "1 2 3", "1 0 0 0 0 1 0 0 0 0 1 0 7", "1 0 0 0 0 1 0 0 0 0 2 0", "a"] {
            assert!(matches!(one_pose(wrong), Err(Failure::Invalid(_))), "{wrong}");
        }
    }
}
