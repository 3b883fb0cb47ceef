//! Reads frames: a line has the pose of each moving instance.

use crate::asking::poses::{self, NUMBERS};
use crate::console::Failure;
use bvh_query::Pose;
use std::path::Path;

/// The poses of the moving instances, and the line that they stand in.
pub(super) struct Frame {
    pub(super) line: usize,
    pub(super) poses: Vec<Pose>,
}

/// The only frame of a scene as it stands.
pub(super) fn as_it_stands() -> Vec<Frame> {
    vec![Frame { line: 0, poses: Vec::new() }]
}

/// Reads the frames of a scene, each with the poses of the moving instances. A scene in which nothing moves has one frame.
pub(super) fn read(path: Option<&Path>, moving: &[String]) -> Result<Vec<Frame>, Failure> {
    let path = match (path, moving.is_empty()) {
        (Some(path), false) => path,
        (None, true) => return Ok(as_it_stands()),
        (None, false) => {
            return Err(Failure::Usage(
                "expected FRAMES, because instances of the scene move (see --help)".into(),
            ));
        }
        (Some(_), true) => {
            return Err(Failure::Usage(
                "expected no FRAMES, because nothing moves in the scene (see --help)".into(),
            ));
        }
    };
    let bytes = std::fs::read(path).map_err(|error| Failure::from_input(path, &error))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut frames = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let words: Vec<&str> = text.split('#').next().unwrap_or("").split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let wrong = |text: String| Failure::invalid(path, format_args!("line {line}: {text}"));
        if words.len() != NUMBERS * moving.len() {
            return Err(wrong(format!(
                "expected {} numbers, 12 for each of {} moving instances, found {}",
                NUMBERS * moving.len(),
                moving.len(),
                words.len()
            )));
        }
        let mut frame = Frame { line, poses: Vec::with_capacity(moving.len()) };
        for (name, words) in moving.iter().zip(words.chunks(NUMBERS)) {
            let pose =
                poses::parse(&words.join(" ")).map_err(|text| wrong(format!("instance {name}: {text}")))?;
            frame.poses.extend(pose);
        }
        frames.push(frame);
    }
    if frames.is_empty() {
        return Err(Failure::invalid(path, "expected at least one line of poses, found none"));
    }
    Ok(frames)
}
