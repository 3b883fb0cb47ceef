//! Reads URDF files: the kinematic tree, and the shapes of links as the file describes them.
//!
//! Only what is needed is looked at, because files in use have much that strict readers refuse: materials without textures,
//! transmissions, extensions of simulators.

use crate::error::RobotError;
use crate::frame::{Frame, Point, length};
use crate::mimic::{Followed, Follower, followed};
use crate::model::{Kind, Link, Model, Value};
use crate::options::{Base, Geometry};
use crate::schema::{Attribute, Tag};
use crate::xml::Description;
use bvh_bake::input::xml::Number;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The name of the joint between the world and a base that moves.
const BASE: &str = "base";
/// The most shapes, and the most pairs of them that can move against each other.
const MAX_SHAPES: usize = 1 << 15;
const MAX_PAIRS: usize = 1 << 24;
const PLANAR: [&str; 3] = ["x", "y", "theta"];
const FLOATING: [&str; 7] = ["x", "y", "z", "qx", "qy", "qz", "qw"];

/// A shape of a link, as the file describes it.
pub(crate) struct Element {
    pub(crate) link: usize,
    pub(crate) origin: Frame,
    pub(crate) shape: Described,
}

/// A shape. A primitive has its middle at the origin, and its axis along z.
pub(crate) enum Described {
    Mesh { uri: String, scale: Point },
    Block(Point),
    Ball(f64),
    Cylinder { radius: f64, length: f64 },
    Capsule { radius: f64, length: f64 },
}

/// What a URDF describes.
pub(crate) struct Robot {
    pub(crate) model: Model,
    pub(crate) elements: Vec<Element>,
    /// What is passed over.
    pub(crate) warnings: Vec<String>,
}

/// Reads the text of a file about a robot.
pub(crate) fn read(path: &Path, text: &str, geometry: Geometry, base: Base) -> Result<Robot, RobotError> {
    let (shapes, others) = match geometry {
        Geometry::Collision => (Tag::Collision, Tag::Visual),
        Geometry::Visual => (Tag::Visual, Tag::Collision),
    };
    let of = &Description::parse(path, text, others)?;
    let urdf = Urdf { description: of };
    let model = urdf.model(base)?;
    let links: HashMap<&str, usize> =
        model.links.iter().zip(0..).map(|(link, number)| (link.name.as_str(), number)).collect();
    let mut elements = Vec::new();
    for node in of.children(of.root(), Tag::Link) {
        let link = links[of.attribute(node, Attribute::Name)?];
        for node in of.children(node, shapes) {
            let (origin, shape) = (urdf.origin(node)?, urdf.shape(node)?);
            elements.push(Element { link, origin, shape });
        }
    }
    let refuse = |expected, found: usize| Err(of.error(of.root(), expected, format!("{found}")));
    match (elements.len(), count_pairs(&model, &elements)) {
        (shapes, _) if shapes > MAX_SHAPES => return refuse("at most 32768 shapes", shapes),
        (_, pairs) if pairs > MAX_PAIRS => {
            return refuse("at most 16777216 pairs of shapes that move against each other", pairs);
        }
        (0, _) => urdf.warn_of_no_shape(geometry, others),
        _ => {}
    }
    Ok(Robot { model, elements, warnings: of.take_warnings() })
}

/// Returns how many pairs of shapes can move against each other: all but those of one group.
fn count_pairs(model: &Model, elements: &[Element]) -> usize {
    let mut counts = vec![0; model.groups.len()];
    elements.iter().for_each(|element| counts[model.links[element.link].group] += 1);
    let pairs = |count: usize| count * count.saturating_sub(1) / 2;
    pairs(elements.len()) - counts.into_iter().map(pairs).sum::<usize>()
}

struct Urdf<'a> {
    description: &'a Description<'a>,
}

/// A joint in the file.
struct Found<'n> {
    node: Number,
    name: &'n str,
    kind: JointType,
    /// The numbers of both links, in the order of the file.
    parent: usize,
    child: usize,
    /// The first number that sets it.
    by: Value,
}

/// The type of a joint.
#[derive(Clone, Copy, PartialEq)]
enum JointType {
    Revolute,
    Continuous,
    Prismatic,
    Planar,
    Floating,
    Fixed,
}

impl JointType {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "revolute" => Self::Revolute,
            "continuous" => Self::Continuous,
            "prismatic" => Self::Prismatic,
            "planar" => Self::Planar,
            "floating" => Self::Floating,
            "fixed" => Self::Fixed,
            _ => return None,
        })
    }

    /// Returns whether one number sets it.
    fn is_single(self) -> bool {
        matches!(self, Self::Revolute | Self::Continuous | Self::Prismatic)
    }
}

impl Urdf<'_> {
    /// Builds the tree.
    fn model(&self, base: Base) -> Result<Model, RobotError> {
        let (of, root) = (self.description, self.description.root());
        let mut names: HashMap<&str, usize> = HashMap::new();
        let mut links = Vec::new();
        for node in of.children(root, Tag::Link) {
            let name = of.attribute(node, Attribute::Name)?;
            if names.insert(name, links.len()).is_some() {
                return Err(of.error(node, "a name of its own", "another link that has it"));
            }
            links.push(name);
        }
        let mut model = Model {
            name: of.label(root, Attribute::Name).to_owned(),
            links: Vec::new(),
            groups: Vec::new(),
            joints: Vec::new(),
            numbers: Vec::new(),
            limits: Vec::new(),
            fixed: HashSet::new(),
        };
        let moving = match base {
            Base::Fixed => None,
            Base::Planar => Some((Kind::Planar(0), &PLANAR[..])),
            Base::Floating => Some((Kind::Floating(0), &FLOATING[..])),
        };
        if let Some((_, numbers)) = &moving {
            add_numbers(&mut model, BASE, numbers);
        }
        // The numbers follow the order of the file, which need not be that of the tree.
        let joints = self.joints(&names, &mut model)?;
        let mut moved_by: Vec<Option<usize>> = vec![None; links.len()];
        for (number, joint) in joints.iter().enumerate() {
            if moved_by[joint.child].replace(number).is_some() {
                let found = format!("{}, which another one moves", links[joint.child]);
                return Err(of.error(joint.node, "a child that no other joint moves", found));
            }
        }
        let roots: Vec<usize> = (0..links.len()).filter(|&link| moved_by[link].is_none()).collect();
        let &[first] = roots.as_slice() else {
            let found = format!("{} of {} links", roots.len(), links.len());
            return Err(of.no_tree("one link that no joint moves", found));
        };
        let mut group = 0;
        model.groups.push(None);
        if let Some((kind, _)) = moving {
            group = model.add_joint(BASE, 0, Frame::IDENTITY, kind);
        }
        model.links.push(Link { name: links[first].to_owned(), group, origin: Frame::IDENTITY });
        let mut below: Vec<Vec<&Found<'_>>> = vec![Vec::new(); links.len()];
        joints.iter().for_each(|joint| below[joint.parent].push(joint));
        let mut next = vec![(first, group, Frame::IDENTITY)];
        while let Some((parent, group, place)) = next.pop() {
            for joint in std::mem::take(&mut below[parent]) {
                let origin = place.of(&self.origin(joint.node)?);
                let (group, origin) = match self.kind(joint, &origin)? {
                    Some(kind) => (model.add_joint(joint.name, group, origin, kind), Frame::IDENTITY),
                    None => {
                        model.fixed.insert(joint.name.to_owned());
                        (group, origin)
                    }
                };
                model.links.push(Link { name: links[joint.child].to_owned(), group, origin });
                next.push((joint.child, group, origin));
            }
        }
        if model.links.len() < links.len() {
            return Err(of.error(root, "a chain of joints from each link to the root", "joints in a circle"));
        }
        Ok(model)
    }

    /// Reads the joints, and adds the numbers that set them.
    fn joints(&self, names: &HashMap<&str, usize>, model: &mut Model) -> Result<Vec<Found<'_>>, RobotError> {
        let of = self.description;
        let (mut joints, mut seen): (Vec<Found<'_>>, HashSet<&str>) = Default::default();
        for node in of.children(of.root(), Tag::Joint) {
            let name = of.attribute(node, Attribute::Name)?;
            if !seen.insert(name) {
                return Err(of.error(node, "a name of its own", "another joint that has it"));
            }
            let link = |which: Tag, lacking: &'static str| {
                let end = of.child(node, which).ok_or_else(|| of.error(node, lacking, "no such element"))?;
                let name = of.attribute(end, Attribute::Link)?;
                names.get(name).copied().ok_or_else(|| of.error(end, "the name of a link", name))
            };
            let (parent, child) = (link(Tag::Parent, "parent")?, link(Tag::Child, "child")?);
            let kind = of.attribute(node, Attribute::Type)?;
            let kind = JointType::of(kind).ok_or_else(|| of.error(node, "a joint type of URDF", kind))?;
            let by = Value { number: 0, factor: 1.0, offset: 0.0 };
            joints.push(Found { node, name, kind, parent, child, by });
        }
        let followers = joints.iter().map(|&Found { node, name, kind, .. }| Follower {
            element: node,
            name,
            is_single: kind.is_single(),
            is_fixed: kind == JointType::Fixed,
        });
        let followed = followed(of, &followers.collect::<Vec<_>>())?;
        for (place, joint) in joints.iter_mut().enumerate() {
            if followed[place].leader != place {
                continue;
            }
            joint.by.number = model.numbers.len();
            match joint.kind {
                JointType::Planar => add_numbers(model, joint.name, &PLANAR),
                JointType::Floating => add_numbers(model, joint.name, &FLOATING),
                JointType::Fixed => {}
                _ => {
                    let limits = self.limits(joint)?;
                    model.numbers.push(joint.name.to_owned());
                    model.limits.push(limits);
                }
            }
        }
        for (place, &Followed { leader, factor, offset }) in followed.iter().enumerate() {
            joints[place].by = Value { number: joints[leader].by.number, factor, offset };
        }
        Ok(joints)
    }

    /// Returns the limits of a joint of one number. Limits that are the wrong way round are none, as in PyBullet; Pinocchio and MoveIt
    /// take them as they are.
    fn limits(&self, joint: &Found<'_>) -> Result<[f64; 2], RobotError> {
        let of = self.description;
        let none = [f64::NEG_INFINITY, f64::INFINITY];
        let limit = of.child(joint.node, Tag::Limit).filter(|_| joint.kind != JointType::Continuous);
        let Some(limit) = limit else { return Ok(none) };
        let end = |key| Ok::<_, RobotError>(of.limit(limit, key)?.unwrap_or(0.0));
        let [lower, upper] = [end(Attribute::Lower)?, end(Attribute::Upper)?];
        if lower > upper {
            let what =
                format!("joint '{}' has the lower limit {lower} above the upper limit {upper}", joint.name);
            of.warn(limit, what + "; it is read without limits");
        }
        Ok(if lower < upper { [lower, upper] } else { none })
    }

    /// Returns how a joint moves its child; none if it is fixed.
    fn kind(&self, joint: &Found<'_>, origin: &Frame) -> Result<Option<Kind>, RobotError> {
        let of = self.description;
        match joint.kind {
            JointType::Fixed => return Ok(None),
            JointType::Planar => return Ok(Some(Kind::Planar(joint.by.number))),
            JointType::Floating => return Ok(Some(Kind::Floating(joint.by.number))),
            _ => {}
        }
        let axis = of.child(joint.node, Tag::Axis);
        let axis = axis.map_or(Ok(None), |axis| of.numbers(axis, Attribute::Xyz))?.unwrap_or([1.0, 0.0, 0.0]);
        let long = length(axis);
        if !(1e-6..=1e6).contains(&long) {
            return Err(of.error(joint.node, "an axis of length 1", format!("{axis:?}")));
        }
        let (by, axis) = (joint.by, axis.map(|x| x / long));
        Ok(Some(match joint.kind {
            JointType::Prismatic => Kind::Slide { by, axis },
            _ => Kind::turn(by, axis, origin),
        }))
    }

    /// Returns the origin of an element.
    fn origin(&self, node: Number) -> Result<Frame, RobotError> {
        let Some(origin) = self.description.child(node, Tag::Origin) else { return Ok(Frame::IDENTITY) };
        let numbers = |key| Ok::<_, RobotError>(self.description.numbers(origin, key)?.unwrap_or([0.0; 3]));
        Ok(Frame::from_angles(numbers(Attribute::Rpy)?, numbers(Attribute::Xyz)?))
    }

    /// Returns the shape of an element.
    fn shape(&self, node: Number) -> Result<Described, RobotError> {
        let of = self.description;
        let shape = of.child(node, Tag::Geometry).and_then(|geometry| of.all(geometry).next());
        let shape = shape.ok_or_else(|| of.error(node, "a geometry", "none"))?;
        let length = |key| of.length(shape, key);
        Ok(match of.tag(shape) {
            Tag::Mesh => {
                let scale = of.numbers(shape, Attribute::Scale)?.unwrap_or([1.0; 3]);
                if scale.contains(&0.0) {
                    return Err(of.error(shape, "a scale of factors other than 0", format!("{scale:?}")));
                }
                Described::Mesh { uri: of.attribute(shape, Attribute::Filename)?.to_owned(), scale }
            }
            Tag::Block => Described::Block(
                of.numbers(shape, Attribute::Size)?.ok_or_else(|| of.lacks(shape, Attribute::Size))?,
            ),
            Tag::Ball => Described::Ball(length(Attribute::Radius)?),
            Tag::Cylinder => {
                Described::Cylinder { radius: length(Attribute::Radius)?, length: length(Attribute::Length)? }
            }
            Tag::Capsule => {
                Described::Capsule { radius: length(Attribute::Radius)?, length: length(Attribute::Length)? }
            }
            _ => return Err(of.error(shape, "a mesh, box, sphere, cylinder or capsule", of.name(shape))),
        })
    }

    /// Warns that no link has a shape of the kind that is read.
    fn warn_of_no_shape(&self, geometry: Geometry, others: Tag) {
        let of = self.description;
        let has_others = of.children(of.root(), Tag::Link).any(|link| of.child(link, others).is_some());
        let remedy = match geometry {
            Geometry::Collision if has_others => {
                "; the option for visual geometry reads its <visual> elements"
            }
            Geometry::Visual if has_others => {
                "; the option for collision geometry reads its <collision> elements"
            }
            _ => "",
        };
        let name = match geometry {
            Geometry::Collision => "collision",
            Geometry::Visual => "visual",
        };
        of.warn(of.root(), format!("no link has a <{name}>, so that the robot touches nothing{remedy}"));
    }
}

/// Adds the numbers of a joint that has several.
fn add_numbers(model: &mut Model, joint: &str, names: &[&str]) {
    for name in names {
        model.numbers.push(format!("{joint}/{name}"));
        let is_quaternion = name.starts_with('q');
        model.limits.push(if is_quaternion { [-1.0, 1.0] } else { [f64::NEG_INFINITY, f64::INFINITY] });
    }
}
