//! Reads SRDF files: pairs of links that are not asked about, groups of joints, and named configurations.

use crate::error::RobotError;
use crate::frame::Frame;
use crate::model::Model;
use crate::xml::{Description, children};
use roxmltree::Node;
use std::path::Path;

/// What an SRDF says.
#[derive(Debug, Default, Clone)]
pub(crate) struct Semantics {
    /// Pairs of links that are not asked about.
    pub(crate) disabled: Vec<[String; 2]>,
    pub(crate) groups: Vec<Group>,
    pub(crate) states: Vec<State>,
}

/// A named group.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Group {
    /// Its name.
    pub name: String,
    /// The joints that it moves, by their places in [`Robot::joints`](crate::Robot::joints), ascending.
    pub joints: Vec<usize>,
}

/// A named configuration of a group.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct State {
    /// Its name.
    pub name: String,
    /// The group.
    pub group: String,
    /// Places in [`Robot::joints`](crate::Robot::joints), and the values there.
    pub values: Vec<(usize, f64)>,
}

/// Reads the text of a file about a robot. Names of links and joints that the robot does not have are passed over, because files are often
/// shared by variants of a robot.
pub(crate) fn read(path: &Path, text: &str, model: &Model) -> Result<Semantics, RobotError> {
    let description = &Description::parse(path, text)?;
    let of = |node, name| description.attribute(node, name).map(str::to_owned);
    let mut semantics = Semantics::default();
    let (mut enabled, mut silent) = (Vec::new(), Vec::new());
    for node in description.root().children().filter(Node::is_element) {
        let pair = || Ok::<_, RobotError>([of(node, "link1")?, of(node, "link2")?]);
        match node.tag_name().name() {
            "disable_collisions" => semantics.disabled.push(pair()?),
            "enable_collisions" => enabled.push(pair()?),
            "disable_default_collisions" => silent.push(of(node, "link")?),
            "group" => {
                let group = Group { name: of(node, "name")?, joints: joints(node, model, &semantics.groups) };
                semantics.groups.push(group);
            }
            "group_state" => {
                let mut values = Vec::new();
                for joint in children(node, "joint") {
                    let (name, text) = (of(joint, "name")?, of(joint, "value")?);
                    let of_joint = numbers_of(model, &name);
                    for (place, text) in of_joint.into_iter().zip(text.split_whitespace()) {
                        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
                        let value = value.ok_or_else(|| description.error(joint, "finite numbers", text))?;
                        values.push((place, value));
                    }
                }
                semantics.states.push(State { name: of(node, "name")?, group: of(node, "group")?, values });
            }
            _ => {}
        }
    }
    for one in &silent {
        for other in model.links.iter().filter(|link| link.name != *one) {
            let is_enabled = |pair: &[String; 2]| pair.contains(one) && pair.contains(&other.name);
            if !enabled.iter().any(is_enabled) {
                semantics.disabled.push([one.clone(), other.name.clone()]);
            }
        }
    }
    Ok(semantics)
}

/// Returns the places of the numbers that set a joint.
fn numbers_of(model: &Model, joint: &str) -> Vec<usize> {
    let is_of =
        |name: &String| name == joint || name.strip_prefix(joint).is_some_and(|rest| rest.starts_with('/'));
    (0..model.numbers.len()).filter(|&place| is_of(&model.numbers[place])).collect()
}

/// Returns the places of the joints of a group: those named, those of links and of chains, and those of other groups.
fn joints(group: Node<'_, '_>, model: &Model, groups: &[Group]) -> Vec<usize> {
    let mut places = Vec::new();
    let mut of_joint = |joint: usize| places.extend(numbers_of(model, &model.joints[joint].name));
    let group_of = |link: &str| model.link(link).ok().map(|link| model.links[link].group);
    let above = |link: &str| group_of(link).into_iter().flat_map(|group| model.above(group));
    let mut others = Vec::new();
    for child in group.children().filter(Node::is_element) {
        let of = |name: &str| child.attribute(name).unwrap_or_default();
        match child.tag_name().name() {
            "joint" => {
                let joint = model.joints.iter().position(|joint| joint.name == of("name"));
                joint.into_iter().for_each(&mut of_joint);
            }
            // The joint that moves it, if that is not fixed.
            "link" => {
                let moved = model.link(of("name")).ok().map(|link| &model.links[link]);
                let moved = moved.filter(|link| link.origin == Frame::IDENTITY);
                moved.and_then(|link| model.groups[link.group]).into_iter().for_each(&mut of_joint);
            }
            "chain" => {
                let base: Vec<usize> = above(of("base_link")).collect();
                above(of("tip_link")).filter(|joint| !base.contains(joint)).for_each(&mut of_joint);
            }
            "group" => others.extend(groups.iter().find(|other| other.name == of("name"))),
            _ => {}
        }
    }
    places.extend(others.iter().flat_map(|other| &other.joints));
    places.sort_unstable();
    places.dedup();
    places
}
