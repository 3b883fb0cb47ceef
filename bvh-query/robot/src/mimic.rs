//! Finds which joint each mimic joint follows, and by what factor and offset.
//!
//! A mimic joint may follow another one. A joint that cannot follow, because its leader is not there, does not turn or slide, or
//! follows it in turn, has a value of its own. MoveIt reads such joints so, with a message for each, and so does Pinocchio.

use crate::error::RobotError;
use crate::schema::{Attribute, Tag};
use crate::xml::Description;
use bvh_bake::input::xml::Number;
use std::collections::HashMap;

/// A joint of the file.
pub(crate) struct Follower<'n> {
    pub(crate) element: Number,
    pub(crate) name: &'n str,
    /// Whether the joint has one value, so that it can follow and be followed.
    pub(crate) is_single: bool,
    /// Whether it does not move at all.
    pub(crate) is_fixed: bool,
}

/// What a joint follows: the place of a joint with a value of its own, by which the value is multiplied, and what is added.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Followed {
    pub(crate) leader: usize,
    pub(crate) factor: f64,
    pub(crate) offset: f64,
}

/// Returns what each joint follows, in the order of the joints. A joint with a value of its own follows itself.
pub(crate) fn followed(of: &Description<'_>, joints: &[Follower<'_>]) -> Result<Vec<Followed>, RobotError> {
    let mut steps = steps(of, joints)?;
    break_circles(of, joints, &mut steps);
    let mut found: Vec<Option<Followed>> = vec![None; joints.len()];
    for joint in 0..joints.len() {
        let (mut way, mut last) = (Vec::new(), joint);
        while let (None, Some(step)) = (found[last], steps[last]) {
            way.push((last, step));
            last = step.leader;
        }
        let mut end = found[last].unwrap_or(Followed { leader: last, factor: 1.0, offset: 0.0 });
        found[last] = Some(end);
        for (joint, Followed { factor, offset, .. }) in way.into_iter().rev() {
            end.factor *= factor;
            end.offset = factor * end.offset + offset;
            if !end.factor.is_finite() || !end.offset.is_finite() {
                let found = format!("multiplier {}, offset {}", end.factor, end.offset);
                let expected = "a finite multiplier and offset of the joint that moves by itself";
                return Err(of.error(joints[joint].element, expected, found));
            }
            found[joint] = Some(end);
        }
    }
    Ok(found.into_iter().map(|found| found.expect("each joint was visited")).collect())
}

/// Returns what each joint follows directly.
fn steps(of: &Description<'_>, joints: &[Follower<'_>]) -> Result<Vec<Option<Followed>>, RobotError> {
    let by_name: HashMap<&str, usize> =
        joints.iter().zip(0..).map(|(joint, place)| (joint.name, place)).collect();
    let step = |joint: &Follower<'_>| {
        let Some(mimic) = of.child(joint.element, Tag::Mimic).filter(|_| !joint.is_fixed) else {
            return Ok(None);
        };
        let name = of.attribute(mimic, Attribute::Joint)?;
        let why = match by_name.get(name) {
            _ if !joint.is_single => "and a joint with several values follows none",
            None => "which the robot does not have",
            Some(&leader) if !joints[leader].is_single => "which neither turns nor slides",
            Some(&leader) => {
                let number = |key| of.numbers(mimic, key);
                let [factor] = number(Attribute::Multiplier)?.unwrap_or([1.0]);
                let [offset] = number(Attribute::Offset)?.unwrap_or([0.0]);
                return Ok(Some(Followed { leader, factor, offset }));
            }
        };
        warn(of, joint, mimic, name, why);
        Ok(None)
    };
    joints.iter().map(step).collect()
}

/// Lets joints that follow each other in a circle follow none.
fn break_circles(of: &Description<'_>, joints: &[Follower<'_>], steps: &mut [Option<Followed>]) {
    /// The mark of a joint that no walk has reached.
    const NONE: usize = usize::MAX;
    let mut walks = vec![NONE; joints.len()];
    for walk in 0..joints.len() {
        let mut joint = walk;
        while walks[joint] == NONE {
            walks[joint] = walk;
            joint = steps[joint].map_or(joint, |step| step.leader);
        }
        // Where a walk meets itself, there is a circle, unless it has ended.
        while walks[joint] == walk
            && let Some(step) = steps[joint].take()
        {
            if let Some(mimic) = of.child(joints[joint].element, Tag::Mimic) {
                let name = joints[step.leader].name;
                let why = if step.leader == joint { "itself" } else { "which follows it in turn" };
                warn(of, &joints[joint], mimic, name, why);
            }
            joint = step.leader;
        }
    }
}

fn warn(of: &Description<'_>, joint: &Follower<'_>, mimic: Number, leader: &str, why: &str) {
    of.warn(mimic, format!("joint '{}' mimics '{leader}', {why}; it has a value of its own", joint.name));
}
