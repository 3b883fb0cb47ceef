//! Reads poses: files with 12 numbers per line, and the pose on the command line.

use super::files::{self, numbers, read_lines};
use crate::console::Failure;
use bvh_query::Pose;
use std::path::Path;

/// The number of numbers of a pose: the entries of a 3 by 4 matrix.
pub(crate) const NUMBERS: usize = 12;
/// The form of a pose, as messages state it.
const EXPECTED: &str = "expected 12 numbers, the rows of the 3 by 4 matrix [R | t]";
/// The message for a file without poses.
const NONE: &str =
    "expected at least one line of 12 numbers, the rows of the 3 by 4 matrix [R | t], found no pose";

/// Reads a pose file. Each line has the 12 numbers of a 3 by 4 matrix, row by row. `#` starts a comment, and blank lines
/// are skipped.
pub(crate) fn read(path: &Path) -> Result<Vec<Pose>, Failure> {
    read_lines(path, NONE, parse)
}

/// Parses the pose of `--pose`. Commas may separate the numbers.
pub(crate) fn parse_one(text: &str) -> Result<Pose, Failure> {
    files::parse_one("--pose", text, EXPECTED, parse)
}

/// Parses a pose. Returns `None` if the text is blank.
pub(crate) fn parse(text: &str) -> Result<Option<Pose>, String> {
    let numbers = numbers(text)?;
    match <&[f64; NUMBERS]>::try_from(&numbers[..]) {
        Ok(rows) => Pose::from_rows(rows).map(Some).map_err(|error| error.to_string()),
        Err(_) if numbers.is_empty() => Ok(None),
        Err(_) => Err(wrong_count(numbers.len())),
    }
}

/// Parses the pose of an instance, which may also be 7 numbers: x, y and z of the position, and x, y, z and w of a unit
/// quaternion. Returns `None` if the text is blank.
pub(crate) fn parse_placed(text: &str) -> Result<Option<Pose>, String> {
    match numbers(text)?[..] {
        [x, y, z, i, j, k, w] => {
            Pose::from_quaternion([i, j, k, w], [x, y, z]).map(Some).map_err(|error| error.to_string())
        }
        _ => parse(text),
    }
}

/// Guesses what a line with a wrong number of numbers means, and says what to write instead.
fn wrong_count(count: usize) -> String {
    let guess = match count {
        7 => {
            "; a quaternion and a translation? write the quaternion as a 3 by 3 matrix, and each number of the translation \
              after a row of it"
        }
        9 => "; a rotation alone? write a 0 after each row of it",
        16 => "; a 4 by 4 matrix? write its first three rows only, row by row",
        _ => "",
    };
    format!("{EXPECTED}, found {count}{guess}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pose_may_have_commas() {
        let pose = parse_one("1,0,0,2, 0,1,0,-3e1, 0 0 1 .5").unwrap();
        assert_eq!(pose.translation(), [2.0, -30.0, 0.5]);
        for wrong in ["", "1 2 3", "1 0 0 0 0 1 0 0 0 0 1 0 7", "1 0 0 0 0 1 0 0 0 0 2 0", "a"] {
            assert!(matches!(parse_one(wrong), Err(Failure::Invalid(_))), "{wrong}");
        }
    }

    #[test]
    fn messages_say_what_to_write_instead() {
        for (text, words) in [
            ("0 0 0 1 1 2 3", "a quaternion"),
            ("1 0 0 0 1 0 0 0 1", "a rotation alone"),
            ("1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1", "a 4 by 4 matrix"),
            ("2 0 0 5 0 2 0 0 0 0 2 0", "scaled by 2; bake the mesh at its size"),
            ("0 -0.001 0 5 0.001 0 0 0 0 0 0.001 0", "scaled by 0.001;"),
            ("1 0 0 5 0 2 0 0 0 0 1 0", "orthonormal"),
            ("1 0 0 5 0 1 0 0 0 0 -1 0", "reflection"),
            ("0 0 0 0 0 0 0 0 0 0 0 0", "orthonormal"),
        ] {
            let said = parse(text).unwrap_err();
            assert!(said.starts_with("expected") && said.contains(words), "{text}: {said}");
        }
        assert_eq!(parse("  "), Ok(None));
    }
}
