//! Reads elements of robots' descriptions: attributes, numbers, and where something is wrong.

use crate::error::RobotError;
use roxmltree::{Document, Error, Node};
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A description in XML, with the element `robot` at its root.
pub(crate) struct Description<'a> {
    path: &'a Path,
    document: Document<'a>,
}

/// The elements of URDF and SRDF files that are read. Others are extensions of other programs.
const READ: [&str; 7] = [
    "link",
    "joint",
    "group",
    "group_state",
    "disable_collisions",
    "enable_collisions",
    "disable_default_collisions",
];

/// The most bytes of a URDF or SRDF file. The largest that are in use have some MiB.
pub(crate) const MAX_BYTES: u64 = 64 << 20;

/// The most attributes of an element. The parser compares each with all others.
const MAX_ATTRIBUTES: usize = 256;

/// The most declarations of namespaces in a file. The parser searches those that hold for each element, and copies them for each
/// element that adds one.
const MAX_NAMESPACES: usize = 256;

/// What is expected of a file that was written for xacro.
const NO_MACROS: &str = "a description without macros; run xacro on the file first";

/// Reads a file of at most so many bytes.
pub(crate) fn text_of(path: &Path, most: u64) -> Result<String, RobotError> {
    let failed = |source| RobotError::Io { path: path.to_owned(), source };
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(most + 1).read_to_string(&mut text));
    // A character may be cut in two.
    if text.len() as u64 > most || read.as_ref().is_err_and(|_| is_longer(path, most)) {
        return Err(RobotError::TooLong { path: path.to_owned(), most });
    }
    read.map(|_| text).map_err(failed)
}

fn is_longer(path: &Path, most: u64) -> bool {
    std::fs::metadata(path).is_ok_and(|metadata| metadata.len() > most)
}

impl<'a> Description<'a> {
    pub(crate) fn parse(path: &'a Path, text: &'a str) -> Result<Self, RobotError> {
        let description = |expected: &'static str, found: String| RobotError::Description {
            path: path.to_owned(),
            place: "the file".to_owned(),
            expected,
            found,
        };
        // Without these, a parse may take the square of the length in time and in memory.
        if text.matches("xmlns").count() > MAX_NAMESPACES {
            return Err(description("at most 256 declarations of namespaces", "more".to_owned()));
        }
        let mut tags = text.split('<').filter(|tag| !tag.starts_with('!'));
        if let Some(tag) = tags.find(|tag| attributes(tag) > MAX_ATTRIBUTES) {
            let name = tag.split(|c: char| c.is_whitespace()).next().unwrap_or_default();
            return Err(description("at most 256 attributes", shown(&format!("more, of <{name}>"))));
        }
        let document = Document::parse(text).map_err(|found| match found {
            Error::UnknownNamespace(prefix, place) if prefix == "xacro" => {
                description(NO_MACROS, format!("xacro: at {place}"))
            }
            found => description("XML", found.to_string()),
        })?;
        let root = document.root_element();
        let name = root.tag_name().name();
        if name != "robot" {
            let what = match name {
                "sdf" => ", an SDF file; convert it to URDF",
                "mujoco" | "mujocoinclude" => ", an MJCF file; convert it to URDF",
                _ => "",
            };
            return Err(description("the element <robot>", format!("<{name}>{what}")));
        }
        let description = Self { path, document };
        description.refuse_xacro()?;
        Ok(description)
    }

    /// Refuses what xacro would have replaced: its elements, and expressions where they would matter.
    fn refuse_xacro(&self) -> Result<(), RobotError> {
        let is_expression = |text: &str| text.contains("${") || text.contains("$(");
        for part in self.root().children().filter(Node::is_element) {
            let is_read = READ.contains(&part.tag_name().name());
            for node in part.descendants().filter(Node::is_element) {
                if node.tag_name().namespace().is_some_and(|namespace| namespace.contains("xacro")) {
                    return Err(self.error(node, NO_MACROS, format!("<xacro:{}>", node.tag_name().name())));
                }
                let expression = node.attributes().find(|of| is_read && is_expression(of.value()));
                if let Some(attribute) = expression {
                    let found = format!("{}=\"{}\"", attribute.name(), attribute.value());
                    return Err(self.error(node, NO_MACROS, found));
                }
            }
        }
        Ok(())
    }

    /// Returns a warning about an element.
    pub(crate) fn warning(&self, node: Node<'_, '_>, what: impl Display) -> String {
        let row = self.document.text_pos_at(node.range().start).row;
        shown(&format!("{}: line {row}, <{}>: {what}", self.path.display(), node.tag_name().name()))
    }

    pub(crate) fn root(&self) -> Node<'_, 'a> {
        self.document.root_element()
    }

    /// Returns the error of an element, with its line and with the name of the nearest element that has one.
    pub(crate) fn error(
        &self,
        node: Node<'_, '_>,
        expected: &'static str,
        found: impl Into<String>,
    ) -> RobotError {
        let line = self.document.text_pos_at(node.range().start).row;
        let named = node.ancestors().find_map(|of| Some((of.tag_name().name(), of.attribute("name")?)));
        let of = named.map_or(String::new(), |(kind, name)| format!(", {kind} {name}"));
        let place = shown(&format!("line {line}{of}, <{}>", node.tag_name().name()));
        RobotError::Description { path: self.path.to_owned(), place, expected, found: shown(&found.into()) }
    }

    /// Returns an attribute that has to be there.
    pub(crate) fn attribute<'n>(
        &self,
        node: Node<'n, '_>,
        name: &'static str,
    ) -> Result<&'n str, RobotError> {
        node.attribute(name).ok_or_else(|| self.error(node, name, "no such attribute"))
    }

    /// Returns the numbers of an attribute; none if it is not there.
    pub(crate) fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        name: &str,
    ) -> Result<Option<[f64; N]>, RobotError> {
        let Some(text) = node.attribute(name) else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        let expected = if N == 1 { "a finite number" } else { "three finite numbers" };
        numbers.map(Some).ok_or_else(|| self.error(node, expected, format!("{name}=\"{text}\"")))
    }

    /// Returns the number of an attribute that has to be there.
    pub(crate) fn number(&self, node: Node<'_, '_>, name: &'static str) -> Result<f64, RobotError> {
        let found = self.numbers(node, name)?;
        found.map(|[number]| number).ok_or_else(|| self.error(node, name, "no such attribute"))
    }
}

/// Returns how many attributes a tag has, given the text from behind its `<`.
fn attributes(tag: &str) -> usize {
    let (mut quote, mut values) = (None, 0);
    for byte in tag.bytes() {
        match (quote, byte) {
            (Some(open), byte) if byte == open => (quote, values) = (None, values + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            (None, b'>') => break,
            _ => {}
        }
    }
    values
}

/// Escapes control characters, so that no name in a file begins a line of a message.
fn shown(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { c.escape_unicode().to_string() } else { c.to_string() })
        .collect()
}

/// Returns the children of an element that have a name.
pub(crate) fn children<'a, 'n>(
    node: Node<'n, 'a>,
    name: &'static str,
) -> impl Iterator<Item = Node<'n, 'a>> + use<'a, 'n> {
    node.children().filter(move |child| child.has_tag_name(name))
}

/// Returns the first child of an element that has a name.
pub(crate) fn child<'a, 'n>(node: Node<'n, 'a>, name: &'static str) -> Option<Node<'n, 'a>> {
    children(node, name).next()
}
