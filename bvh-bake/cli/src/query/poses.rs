//! Poses: files of 12 numbers a line, and the one of the command line.

use crate::error::Failure;
use bvh_query::Pose;
use std::path::Path;

/// Reads a pose file. The first 12 numbers of a line are the rows of a 3x4 matrix; `#` starts a comment,
/// blank lines are skipped.
pub(crate) fn read(path: &Path) -> Result<Vec<Pose>, Failure> {
    let bytes = std::fs::read(path).map_err(|error| Failure::from_input(path, &error))?;
    let mut poses = Vec::new();
    for (number, line) in bytes.split(|&byte| byte == b'\n').enumerate() {
        let text = String::from_utf8_lossy(line);
        let text = text.split('#').next().unwrap_or("");
        let pose = parse(text.split_whitespace());
        match pose.map_err(|text| Failure::invalid(path, format_args!("line {}: {text}", number + 1)))? {
            Some(pose) => poses.push(pose),
            None => continue,
        }
    }
    Ok(poses)
}

/// The pose of `--pose`; commas may stand between the numbers.
pub(crate) fn parse_one(text: &str) -> Result<Pose, Failure> {
    let separated = text.replace(',', " ");
    let count = separated.split_whitespace().count();
    let pose = if count > 12 {
        Err(format!("expected 12 numbers, found {count}"))
    } else {
        parse(separated.split_whitespace())
    };
    match pose {
        Ok(Some(pose)) => Ok(pose),
        Ok(None) => Err(Failure::Usage("--pose: expected 12 numbers, found none".into())),
        Err(text) => Err(Failure::Usage(format!("--pose: {text}"))),
    }
}

/// `None` if there is no word at all.
fn parse<'a>(words: impl Iterator<Item = &'a str>) -> Result<Option<Pose>, String> {
    let mut numbers = [0.0; 12];
    let mut count = 0;
    for (number, word) in numbers.iter_mut().zip(words) {
        let shown = || word.chars().take(40).collect::<String>();
        *number = word.parse().map_err(|_| format!("expected a number, found {:?}", shown()))?;
        count += 1;
    }
    match count {
        0 => Ok(None),
        12 => Pose::from_rows(&numbers).map(Some).map_err(|error| error.to_string()),
        _ => Err(format!("expected 12 numbers, found {count}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_pose_may_have_commas() {
        let pose = parse_one("1,0,0,2, 0,1,0,-3e1, 0 0 1 .5").unwrap();
        assert_eq!(pose.translation(), [2.0, -30.0, 0.5]);
        for wrong in ["", "1 2 3", "1 0 0 0 0 1 0 0 0 0 1 0 7", "1 0 0 0 0 1 0 0 0 0 2 0", "a"] {
            assert!(matches!(parse_one(wrong), Err(Failure::Usage(_))), "{wrong}");
        }
    }
}
