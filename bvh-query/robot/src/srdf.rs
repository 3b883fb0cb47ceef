//! Reads SRDF files: pairs of links that are not asked about, groups of joints, and named configurations.

use crate::error::RobotError;
use crate::frame::Frame;
use crate::model::Model;
use crate::schema::{Attribute, Tag};
use crate::xml::Description;
use bvh_bake::input::xml::Number;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// What an SRDF says.
#[derive(Debug, Default, Clone)]
pub(crate) struct Semantics {
    /// Pairs of links that are not asked about, by number, the lower one first.
    pub(crate) disabled: Vec<[usize; 2]>,
    pub(crate) groups: Vec<Group>,
    pub(crate) states: Vec<State>,
    /// What is passed over.
    pub(crate) warnings: Vec<String>,
}

/// A named group.
///
/// [`State`] has an example.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Group {
    /// Its name.
    pub name: String,
    /// The joints that it moves, by their places in [`Robot::joints`](crate::Robot::joints), ascending.
    pub joints: Vec<usize>,
}

/// A named configuration of a group.
///
/// ```
/// use cbvh_robot::{Robot, RobotOptions};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
/// # let srdf = std::env::temp_dir().join(format!("cbvh-state-{}.srdf", std::process::id()));
/// let text = r#"<robot name="small_arm">
///     <group name="arm"><joint name="shoulder"/><joint name="elbow"/></group>
///     <group_state name="bent" group="arm"><joint name="elbow" value="0.5"/></group_state>
/// </robot>"#;
/// std::fs::write(&srdf, text)?;
/// let robot = Robot::from_urdf(path, &RobotOptions::default().srdf(srdf.clone()))?;
/// # std::fs::remove_file(&srdf)?;
/// assert_eq!((robot.groups()[0].name.as_str(), &robot.groups()[0].joints[..]), ("arm", &[1, 2][..]));
/// assert_eq!((robot.states()[0].name.as_str(), &robot.states()[0].values[..]), ("bent", &[(2, 0.5)][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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

/// The most places that all groups may have together. Groups may contain others again and again.
const MAX_PLACES: usize = 1 << 22;

/// What is read of a file, and the names that it may use.
struct Reader<'a> {
    description: &'a Description<'a>,
    model: &'a Model,
    links: HashMap<&'a str, usize>,
    joints: HashMap<&'a str, usize>,
    /// The places of the numbers that set a joint.
    numbers: HashMap<&'a str, Vec<usize>>,
    semantics: Semantics,
    /// The groups by name.
    groups: HashMap<String, usize>,
    /// How many places all groups have.
    places: usize,
    /// The names that the robot does not have, with what they are of.
    unknown: HashSet<(&'static str, &'a str)>,
}

/// Reads the text of a file about a robot. `has_shape` tells which links have shapes; pairs of others are never asked about. Names of
/// links and joints that the robot does not have are passed over with a warning, because files are often shared by variants of a
/// robot.
pub(crate) fn read(
    path: &Path,
    text: &str,
    model: &Model,
    has_shape: &[bool],
) -> Result<Semantics, RobotError> {
    let description = &Description::parse(path, text, Tag::Visual)?;
    let mut numbers: HashMap<&str, Vec<usize>> = HashMap::new();
    for (place, name) in model.numbers.iter().enumerate() {
        numbers.entry(name).or_default().push(place);
        if let Some((joint, _)) = name.rsplit_once('/') {
            numbers.entry(joint).or_default().push(place);
        }
    }
    let links = model.links.iter().zip(0..).map(|(link, number)| (link.name.as_str(), number)).collect();
    let joints = model.joints.iter().zip(0..).map(|(joint, number)| (joint.name.as_str(), number)).collect();
    let (semantics, groups) = (Semantics::default(), HashMap::new());
    let unknown = HashSet::new();
    let reader = Reader { description, model, links, joints, numbers, semantics, groups, places: 0, unknown };
    reader.read(has_shape)
}

impl<'a> Reader<'a> {
    fn read(mut self, has_shape: &[bool]) -> Result<Semantics, RobotError> {
        let description = self.description;
        let (mut enabled, mut silent) = (HashSet::new(), Vec::new());
        for node in description.all(description.root()) {
            match description.tag(node) {
                Tag::DisableCollisions => {
                    let pair = self.pair(node)?;
                    self.semantics.disabled.extend(pair);
                }
                Tag::EnableCollisions => enabled.extend(self.pair(node)?),
                Tag::DisableDefaultCollisions => silent.extend(self.link(node, Attribute::Link)?),
                Tag::Group => self.group(node)?,
                Tag::GroupState => self.state(node)?,
                _ => {}
            }
        }
        silent.sort_unstable();
        silent.dedup();
        let with_shape: Vec<usize> = (0..has_shape.len()).filter(|&link| has_shape[link]).collect();
        let group = |link: usize| self.model.links[link].group;
        for one in silent.into_iter().filter(|&link| has_shape[link]) {
            // What is rigid is not asked about anyway.
            let others = with_shape.iter().filter(|other| group(**other) != group(one));
            let pairs = others.map(|&other| [one.min(other), one.max(other)]);
            self.semantics.disabled.extend(pairs.filter(|pair| !enabled.contains(pair)));
        }
        self.semantics.warnings = description.take_warnings();
        Ok(self.semantics)
    }

    fn attribute(&self, node: Number, key: Attribute) -> Result<&'a str, RobotError> {
        self.description.attribute(node, key)
    }

    /// Warns of a name that the robot does not have, once.
    fn unknown(&mut self, node: Number, what: &'static str, name: &'a str) {
        if !self.description.is_full() && self.unknown.insert((what, name)) {
            self.description.warn(node, format!("the robot has no {what} '{name}', which is passed over"));
        }
    }

    /// Returns the number of the link that an attribute names, if the robot has it.
    fn link(&mut self, node: Number, attribute: Attribute) -> Result<Option<usize>, RobotError> {
        let name = self.attribute(node, attribute)?;
        let link = self.links.get(name).copied();
        if link.is_none() {
            self.unknown(node, "link", name);
        }
        Ok(link)
    }

    /// Returns a pair of links, if the robot has both.
    fn pair(&mut self, node: Number) -> Result<Option<[usize; 2]>, RobotError> {
        let ends = [self.link(node, Attribute::Link1)?, self.link(node, Attribute::Link2)?];
        Ok(if let [Some(a), Some(b)] = ends { Some([a.min(b), a.max(b)]) } else { None })
    }

    /// Reads a group: the joints named, those of links and of chains, and those of other groups.
    fn group(&mut self, group: Number) -> Result<(), RobotError> {
        let (name, model) = (self.attribute(group, Attribute::Name)?.to_owned(), self.model);
        let mut places = Vec::new();
        for child in self.description.all(group) {
            let mut joints = Vec::new();
            match self.description.tag(child) {
                Tag::Joint => {
                    let name = self.attribute(child, Attribute::Name)?;
                    joints.extend(self.joints.get(name));
                    // Fixed joints are not in the model.
                    if joints.is_empty() && !model.fixed.contains(name) {
                        self.unknown(child, "joint", name);
                    }
                }
                // The joint that moves it, if that is not fixed.
                Tag::Link => {
                    let moved = self.link(child, Attribute::Name)?.map(|link| &model.links[link]);
                    let moved = moved.filter(|link| link.origin == Frame::IDENTITY);
                    joints.extend(moved.and_then(|link| model.groups[link.group]));
                }
                Tag::Chain => {
                    let ends =
                        [self.link(child, Attribute::BaseLink)?, self.link(child, Attribute::TipLink)?];
                    let [base, tip] = ends
                        .map(|link| link.into_iter().flat_map(|link| model.above(model.links[link].group)));
                    let base: HashSet<usize> = base.collect();
                    joints.extend(tip.filter(|joint| !base.contains(joint)));
                    self.places += base.len() + joints.len();
                }
                Tag::Group => {
                    let name = self.attribute(child, Attribute::Name)?;
                    match self.groups.get(name) {
                        Some(&other) => places.extend(&self.semantics.groups[other].joints),
                        None => self.unknown(child, "group above this one", name),
                    }
                }
                _ => {}
            }
            let of_joint =
                |joint: usize| self.numbers.get(model.joints[joint].name.as_str()).into_iter().flatten();
            places.extend(joints.into_iter().flat_map(of_joint));
            if self.places + places.len() > MAX_PLACES {
                let found = format!("more, in group {name}");
                return Err(self.description.error(
                    child,
                    "groups of at most 4194304 joints together",
                    found,
                ));
            }
        }
        places.sort_unstable();
        places.dedup();
        self.places += places.len() + 1;
        self.groups.entry(name.clone()).or_insert(self.semantics.groups.len());
        self.semantics.groups.push(Group { name, joints: places });
        Ok(())
    }

    /// Reads a named configuration.
    fn state(&mut self, node: Number) -> Result<(), RobotError> {
        let mut values = Vec::new();
        for joint in self.description.children(node, Tag::Joint) {
            let (name, text) =
                (self.attribute(joint, Attribute::Name)?, self.attribute(joint, Attribute::Value)?);
            let Some(of_joint) = self.numbers.get(name) else {
                // Fixed joints have no numbers, and mimic joints have those of others.
                if !self.model.fixed.contains(name) && !self.joints.contains_key(name) {
                    self.unknown(joint, "joint", name);
                }
                continue;
            };
            for (&place, text) in of_joint.iter().zip(text.split_whitespace()) {
                let value = text.parse().ok().filter(|value: &f64| value.is_finite());
                let value = value.ok_or_else(|| self.description.error(joint, "finite numbers", text))?;
                values.push((place, value));
            }
        }
        let (name, group) = (
            self.attribute(node, Attribute::Name)?.to_owned(),
            self.attribute(node, Attribute::Group)?.to_owned(),
        );
        self.semantics.states.push(State { name, group, values });
        Ok(())
    }
}
