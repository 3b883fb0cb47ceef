//! Reads elements of robots' descriptions: attributes, numbers, and where something is wrong.

use crate::error::RobotError;
use crate::schema::{Attribute, Schema, Tag};
use bvh_bake::input::xml::{self, Number, Tree, XmlError};
use std::borrow::Cow;
use std::cell::RefCell;
use std::fmt::Display;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A description in XML, with the element `robot` at its root.
pub(crate) struct Description<'a> {
    path: &'a Path,
    tree: Tree<'a, Schema>,
    warnings: RefCell<Vec<String>>,
    /// The first element that defines something for xacro, if there is one.
    definition: Option<Number>,
}

/// The most bytes of a URDF or SRDF file. The largest that are in use have some MiB.
const MAX_BYTES: u64 = 64 << 20;

/// The most warnings about a file. A reader has no use for thousands, and finding a line takes a pass over the text.
const MAX_WARNINGS: usize = 100;

/// What is expected of a file that was written for xacro.
const NO_MACROS: &str = "a description without macros; run xacro on the file first";

/// Reads a file of at most 64 MiB, in the encoding that it has or declares.
pub(crate) fn text_of(path: &Path) -> Result<String, RobotError> {
    let mut bytes = Vec::new();
    let read = File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes));
    read.map_err(|source| RobotError::Io { path: path.to_owned(), source })?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(RobotError::TooLong { path: path.to_owned(), most: MAX_BYTES });
    }
    // A text without a mark at its beginning is not copied.
    Ok(match xml::text_of(&bytes) {
        Cow::Owned(text) => text,
        Cow::Borrowed(text) if text.len() < bytes.len() => text.to_owned(),
        Cow::Borrowed(_) => String::from_utf8(bytes).expect("the whole file is the text"),
    })
}

impl<'a> Description<'a> {
    /// Parses a text. Elements of the kind `unread` are passed over where xacro is concerned.
    pub(crate) fn parse(path: &'a Path, text: &'a str, unread: Tag) -> Result<Self, RobotError> {
        let tree = Tree::parse(text).map_err(|XmlError { line, column, expected, found }| {
            let program =
                if expected.starts_with("the element <robot>") { other_program(&found) } else { "" };
            let place = format!("line {line}, column {column}");
            RobotError::Description { path: path.to_owned(), place, expected, found: found + program }
        })?;
        let mut description = Self { path, tree, warnings: RefCell::default(), definition: None };
        description.refuse_xacro(unread)?;
        Ok(description)
    }

    /// Refuses elements that xacro would have replaced by others. Those that only define something may stay: a value or macro that
    /// is used is found where it is.
    fn refuse_xacro(&mut self, unread: Tag) -> Result<(), RobotError> {
        let mut next = Tree::<Schema>::ROOT;
        while next < self.tree.count() {
            let element = next;
            next += 1;
            match self.tree.tag(element) {
                tag if tag == unread => next = self.tree.end(element),
                Tag::Macro => return Err(self.has_macros(element)),
                Tag::MacroDefinition if self.definition.is_none() => {
                    self.definition = Some(element);
                    self.warn(element, "passed over; was xacro run on this file?");
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the error of an element of xacro.
    fn has_macros(&self, element: Number) -> RobotError {
        self.error(element, NO_MACROS, format!("<{}>", self.tree.name(element)))
    }

    /// Returns the error of a tree of links that is none, or that of macros that would have made one.
    pub(crate) fn no_tree(&self, expected: &'static str, found: String) -> RobotError {
        match self.definition {
            Some(definition) => self.has_macros(definition),
            None => self.error(self.root(), expected, found),
        }
    }

    /// Warns of what is wrong with an element.
    pub(crate) fn warn(&self, element: Number, what: impl Display) {
        let mut warnings = self.warnings.borrow_mut();
        let line =
            || format!("{}: line {}, <{}>", self.path.display(), self.tree.line(element), self.name(element));
        if warnings.len() < MAX_WARNINGS {
            warnings.push(shown(&format!("{}: {what}", line())));
        } else if warnings.len() == MAX_WARNINGS {
            warnings.push(shown(&format!("{}: a warning is left out, and maybe others after it", line())));
        }
    }

    /// Returns whether no more warnings are told.
    pub(crate) fn is_full(&self) -> bool {
        self.warnings.borrow().len() > MAX_WARNINGS
    }

    /// Takes the warnings out.
    pub(crate) fn take_warnings(&self) -> Vec<String> {
        self.warnings.take()
    }

    pub(crate) fn root(&self) -> Number {
        Tree::<Schema>::ROOT
    }

    pub(crate) fn tag(&self, element: Number) -> Tag {
        self.tree.tag(element)
    }

    /// Returns the name of an element as the file has it.
    pub(crate) fn name(&self, element: Number) -> String {
        self.tree.name(element)
    }

    /// Returns the elements directly in an element.
    pub(crate) fn all(&self, element: Number) -> impl Iterator<Item = Number> {
        self.tree.children(element)
    }

    /// Returns the elements of one kind directly in an element.
    pub(crate) fn children(&self, element: Number, tag: Tag) -> impl Iterator<Item = Number> {
        self.tree.children_of(element, tag)
    }

    /// Returns the first element of its kind directly in an element.
    pub(crate) fn child(&self, element: Number, tag: Tag) -> Option<Number> {
        self.children(element, tag).next()
    }

    /// Returns the error of an element, with its line and with the name of the nearest element that has one.
    pub(crate) fn error(
        &self,
        element: Number,
        expected: &'static str,
        found: impl Into<String>,
    ) -> RobotError {
        let around = (0..=element).rev().filter(|&of| self.tree.end(of) > element);
        let mut names = around.filter_map(|of| Some((of, self.tree.attribute(of, Attribute::Name)?)));
        let of = names.next().map_or(String::new(), |(of, name)| format!(", {} {name}", self.name(of)));
        let place = shown(&format!("line {}{of}, <{}>", self.tree.line(element), self.name(element)));
        let (path, found) = (self.path.to_owned(), shown(&found.into()));
        RobotError::Description { path, place, expected: expected.into(), found }
    }

    /// Returns an attribute, if it is there. An expression that xacro would have replaced is an error.
    fn optional(&self, element: Number, key: Attribute) -> Result<Option<&str>, RobotError> {
        let value = self.tree.attribute(element, key);
        match value.filter(|value| value.contains("${") || value.contains("$(")) {
            Some(value) => Err(self.error(element, NO_MACROS, format!("{}=\"{value}\"", key.name()))),
            None => Ok(value),
        }
    }

    /// Returns an attribute that has to be there.
    pub(crate) fn attribute(&self, element: Number, key: Attribute) -> Result<&str, RobotError> {
        self.optional(element, key)?.ok_or_else(|| self.lacks(element, key))
    }

    /// Returns an attribute that is for people alone.
    pub(crate) fn label(&self, element: Number, key: Attribute) -> &str {
        self.tree.attribute(element, key).unwrap_or_default()
    }

    /// Returns the error of an element without an attribute.
    pub(crate) fn lacks(&self, element: Number, key: Attribute) -> RobotError {
        self.error(element, key.name(), "no such attribute")
    }

    /// Returns the numbers of an attribute; none if it is not there.
    pub(crate) fn numbers<const N: usize>(
        &self,
        element: Number,
        key: Attribute,
    ) -> Result<Option<[f64; N]>, RobotError> {
        let expected = if N == 1 { "a finite number" } else { "three finite numbers" };
        self.numbers_that(element, key, expected, |number| number.is_finite())
    }

    /// Returns a number that may be infinite; none if it is not there.
    pub(crate) fn limit(&self, element: Number, key: Attribute) -> Result<Option<f64>, RobotError> {
        let found = self.numbers_that(element, key, "a number", |number| !number.is_nan());
        Ok(found?.map(|[number]| number))
    }

    fn numbers_that<const N: usize>(
        &self,
        element: Number,
        key: Attribute,
        expected: &'static str,
        is_good: impl Fn(f64) -> bool,
    ) -> Result<Option<[f64; N]>, RobotError> {
        let Some(text) = self.optional(element, key)? else { return Ok(None) };
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|word| word.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.iter().all(|&number| is_good(number)));
        let numbers = numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok());
        let found = || format!("{}=\"{text}\"", key.name());
        numbers.map(Some).ok_or_else(|| self.error(element, expected, found()))
    }

    /// Returns the length of an attribute that has to be there.
    pub(crate) fn length(&self, element: Number, key: Attribute) -> Result<f64, RobotError> {
        let [length] = self.numbers(element, key)?.ok_or_else(|| self.lacks(element, key))?;
        if length < 0.0 {
            let found = format!("{}=\"{length}\"", key.name());
            return Err(self.error(element, "a length of at least 0", found));
        }
        Ok(length)
    }
}

/// Says which program a file is for whose root is not `robot`.
fn other_program(found: &str) -> &'static str {
    match found {
        "<sdf>" => ", an SDF file; convert it to URDF",
        "<mujoco>" | "<mujocoinclude>" => ", an MJCF file; convert it to URDF",
        "<html>" | "<HTML>" => ", an HTML page; download the file itself",
        "<COLLADA>" => ", a mesh; name it in a URDF",
        _ if found.starts_with("version https://git-lfs") => {
            ", a pointer of Git LFS; run \"git lfs pull\" to get the file itself"
        }
        _ => "",
    }
}

/// Escapes control characters, so that no name in a file begins a line of a message.
pub(crate) fn shown(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { c.escape_unicode().to_string() } else { c.to_string() })
        .collect()
}
