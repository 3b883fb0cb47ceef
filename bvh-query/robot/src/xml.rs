//! Reads elements of robots' descriptions: attributes, numbers, and where something is wrong.

use crate::error::RobotError;
use roxmltree::{Document, Node};
use std::path::Path;

/// A description in XML, with the element `robot` at its root.
pub(crate) struct Description<'a> {
    path: &'a Path,
    document: Document<'a>,
}

/// Reads a file.
pub(crate) fn text_of(path: &Path) -> Result<String, RobotError> {
    std::fs::read_to_string(path).map_err(|source| RobotError::Io { path: path.to_owned(), source })
}

impl<'a> Description<'a> {
    pub(crate) fn parse(path: &'a Path, text: &'a str) -> Result<Self, RobotError> {
        let description = |expected: &'static str, found: String| RobotError::Description {
            path: path.to_owned(),
            place: "the file".to_owned(),
            expected,
            found,
        };
        let document = Document::parse(text).map_err(|found| description("XML", found.to_string()))?;
        let root = document.root_element();
        if !root.has_tag_name("robot") {
            return Err(description("the element <robot>", format!("<{}>", root.tag_name().name())));
        }
        Ok(Self { path, document })
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
        let place = format!("line {line}{of}, <{}>", node.tag_name().name());
        RobotError::Description { path: self.path.to_owned(), place, expected, found: found.into() }
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
