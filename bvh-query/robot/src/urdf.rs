//! Reads URDF files: the kinematic tree, and the shapes of links as the file describes them.
//!
//! Only what is needed is looked at, because files in use have much that strict readers refuse: materials without textures,
//! transmissions, extensions of simulators.

use crate::error::RobotError;
use crate::frame::{Frame, Point, length};
use crate::model::{Kind, Link, Model, Value};
use crate::options::{Base, Geometry};
use crate::xml::{Description, child, children};
use roxmltree::Node;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The name of the joint between the world and a base that moves.
const BASE: &str = "base";
/// The most mimic joints of which each mimics the next one. This bounds the work for each, too.
const MAX_MIMICS: usize = 64;
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

/// Reads the text of a file about a robot.
pub(crate) fn read(
    path: &Path,
    text: &str,
    geometry: Geometry,
    base: Base,
) -> Result<(Model, Vec<Element>), RobotError> {
    let urdf = Urdf { description: &Description::parse(path, text)? };
    let model = urdf.model(base)?;
    let links: HashMap<&str, usize> =
        model.links.iter().zip(0..).map(|(link, number)| (link.name.as_str(), number)).collect();
    let mut elements = Vec::new();
    let name = match geometry {
        Geometry::Collision => "collision",
        Geometry::Visual => "visual",
    };
    for node in children(urdf.description.root(), "link") {
        let link = links[urdf.description.attribute(node, "name")?];
        for node in children(node, name) {
            let (origin, shape) = (urdf.origin(node)?, urdf.shape(node)?);
            elements.push(Element { link, origin, shape });
        }
    }
    let refuse = |expected, found: usize| {
        Err(urdf.description.error(urdf.description.root(), expected, format!("{found}")))
    };
    match (elements.len(), count_pairs(&model, &elements)) {
        (shapes, _) if shapes > MAX_SHAPES => refuse("at most 32768 shapes", shapes),
        (_, pairs) if pairs > MAX_PAIRS => {
            refuse("at most 16777216 pairs of shapes that move against each other", pairs)
        }
        _ => Ok((model, elements)),
    }
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
struct Found<'a, 'n> {
    node: Node<'n, 'a>,
    name: &'n str,
    /// The numbers of both links, in the order of the file.
    parent: usize,
    child: usize,
    /// The place of the first number that sets it.
    number: usize,
}

impl Found<'_, '_> {
    fn is_single(&self) -> bool {
        matches!(self.node.attribute("type"), Some("revolute" | "continuous" | "prismatic"))
    }

    fn mimic(&self) -> Option<Node<'_, '_>> {
        child(self.node, "mimic")
    }
}

impl<'a> Urdf<'a> {
    /// Builds the tree.
    fn model(&self, base: Base) -> Result<Model, RobotError> {
        let (of, root) = (self.description, self.description.root());
        let mut names: HashMap<&str, usize> = HashMap::new();
        let mut links = Vec::new();
        for node in children(root, "link") {
            let name = of.attribute(node, "name")?;
            if names.insert(name, links.len()).is_some() {
                return Err(of.error(node, "a name of its own", "another link that has it"));
            }
            links.push(name);
        }
        let mut model = Model {
            name: root.attribute("name").unwrap_or_default().to_owned(),
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
            return Err(of.error(root, "one link that no joint moves", found));
        };
        let mut group = 0;
        model.groups.push(None);
        if let Some((kind, _)) = moving {
            group = model.add_joint(BASE, 0, Frame::IDENTITY, kind);
        }
        model.links.push(Link { name: links[first].to_owned(), group, origin: Frame::IDENTITY });
        let mut below: Vec<Vec<&Found<'_, '_>>> = vec![Vec::new(); links.len()];
        joints.iter().for_each(|joint| below[joint.parent].push(joint));
        let by_name: HashMap<&str, &Found<'_, '_>> = joints.iter().map(|joint| (joint.name, joint)).collect();
        let mut next = vec![(first, group, Frame::IDENTITY)];
        while let Some((parent, group, place)) = next.pop() {
            for joint in std::mem::take(&mut below[parent]) {
                let origin = place.of(&self.origin(joint.node)?);
                let (group, origin) = match self.kind(joint, &by_name, &origin)? {
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
    fn joints(
        &self,
        names: &HashMap<&str, usize>,
        model: &mut Model,
    ) -> Result<Vec<Found<'a, '_>>, RobotError> {
        let of = self.description;
        let (mut joints, mut seen): (Vec<Found<'_, '_>>, HashSet<&str>) = Default::default();
        for node in children(of.root(), "joint") {
            let name = of.attribute(node, "name")?;
            if !seen.insert(name) {
                return Err(of.error(node, "a name of its own", "another joint that has it"));
            }
            let link = |which: &'static str| {
                let end = child(node, which).ok_or_else(|| of.error(node, which, "no such element"))?;
                let name = of.attribute(end, "link")?;
                names.get(name).copied().ok_or_else(|| of.error(end, "the name of a link", name))
            };
            let (parent, child_link) = (link("parent")?, link("child")?);
            let joint = Found { node, name, parent, child: child_link, number: model.numbers.len() };
            let limit = child(node, "limit");
            let end = |name: &str| match limit {
                Some(limit) => Ok(of.numbers(limit, name)?.map_or(0.0, |[number]| number)),
                None => Ok::<_, RobotError>(0.0),
            };
            match of.attribute(node, "type")? {
                _ if joint.mimic().is_some() => {}
                "planar" => add_numbers(model, name, &PLANAR),
                "floating" => add_numbers(model, name, &FLOATING),
                kind if joint.is_single() => {
                    let limits = [end("lower")?, end("upper")?];
                    let is_limited = kind != "continuous" && limits[0] < limits[1];
                    model.numbers.push(name.to_owned());
                    model.limits.push(if is_limited { limits } else { [f64::NEG_INFINITY, f64::INFINITY] });
                }
                "fixed" => {}
                kind => return Err(of.error(node, "a joint type of URDF", kind)),
            }
            joints.push(joint);
        }
        Ok(joints)
    }

    /// Returns how a joint moves its child; none if it is fixed.
    fn kind(
        &self,
        joint: &Found<'_, '_>,
        joints: &HashMap<&str, &Found<'_, '_>>,
        origin: &Frame,
    ) -> Result<Option<Kind>, RobotError> {
        let of = self.description;
        if !joint.is_single() {
            return match joint.node.attribute("type") {
                Some("fixed") => Ok(None),
                Some(kind) if joint.mimic().is_some() => {
                    Err(of.error(joint.node, "a mimic joint that turns or slides", kind))
                }
                Some("planar") => Ok(Some(Kind::Planar(joint.number))),
                _ => Ok(Some(Kind::Floating(joint.number))),
            };
        }
        // A mimic joint may mimic another one.
        let (mut leader, mut factor, mut offset) = (joint, 1.0, 0.0);
        let mut steps = 0;
        while let Some(mimic) = leader.mimic() {
            let [times] = of.numbers(mimic, "multiplier")?.unwrap_or([1.0]);
            let [plus] = of.numbers(mimic, "offset")?.unwrap_or([0.0]);
            (offset, factor) = (offset + factor * plus, factor * times);
            let name = of.attribute(mimic, "joint")?;
            let next = joints.get(name).filter(|other| other.is_single());
            leader = next.ok_or_else(|| of.error(mimic, "a joint that turns or slides", name))?;
            steps += 1;
            if steps > MAX_MIMICS {
                let expected = "a joint at most 64 mimic joints away from the one that it follows";
                return Err(of.error(mimic, expected, "joints that mimic each other, or more of them"));
            }
        }
        let by = Value { number: leader.number, factor, offset };
        let axis = child(joint.node, "axis");
        let axis = axis.map_or(Ok(None), |axis| of.numbers(axis, "xyz"))?.unwrap_or([1.0, 0.0, 0.0]);
        let long = length(axis);
        if !(1e-6..=1e6).contains(&long) || !factor.is_finite() || !offset.is_finite() {
            let found = format!("axis {axis:?}, factor {factor}, offset {offset}");
            return Err(of.error(joint.node, "an axis of length 1, and finite numbers", found));
        }
        let axis = axis.map(|x| x / long);
        Ok(Some(match joint.node.attribute("type") {
            Some("prismatic") => Kind::Slide { by, axis },
            _ => Kind::turn(by, axis, origin),
        }))
    }

    /// Returns the origin of an element.
    fn origin(&self, node: Node<'_, '_>) -> Result<Frame, RobotError> {
        let Some(origin) = child(node, "origin") else { return Ok(Frame::IDENTITY) };
        let numbers = |name| Ok::<_, RobotError>(self.description.numbers(origin, name)?.unwrap_or([0.0; 3]));
        Ok(Frame::from_angles(numbers("rpy")?, numbers("xyz")?))
    }

    /// Returns the shape of an element.
    fn shape(&self, node: Node<'_, '_>) -> Result<Described, RobotError> {
        let of = self.description;
        let shape = child(node, "geometry").and_then(|geometry| geometry.children().find(Node::is_element));
        let shape = shape.ok_or_else(|| of.error(node, "a geometry", "none"))?;
        let number = |name| of.number(shape, name);
        Ok(match shape.tag_name().name() {
            "mesh" => {
                let scale = of.numbers(shape, "scale")?.unwrap_or([1.0; 3]);
                if scale.contains(&0.0) {
                    return Err(of.error(shape, "a scale of factors other than 0", format!("{scale:?}")));
                }
                Described::Mesh { uri: of.attribute(shape, "filename")?.to_owned(), scale }
            }
            "box" => Described::Block(
                of.numbers(shape, "size")?.ok_or_else(|| of.error(shape, "size", "no such attribute"))?,
            ),
            "sphere" => Described::Ball(number("radius")?),
            "cylinder" => Described::Cylinder { radius: number("radius")?, length: number("length")? },
            "capsule" => Described::Capsule { radius: number("radius")?, length: number("length")? },
            other => return Err(of.error(shape, "a mesh, box, sphere, cylinder or capsule", other)),
        })
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
