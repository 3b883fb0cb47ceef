//! Reads the elements and attributes of an XML text that a schema knows into a list, which refers to the text.
//!
//! All others are passed over with what is in them. Namespaces are not resolved: an element belongs to the schema if it has the
//! prefix of the root, declared or not. The document type is passed over too, and no entity is followed but the five of XML
//! and those of single characters. Time and memory grow in proportion to the text, whatever is in it, and nothing is recursive.

use crate::error::{Fault, Place, excerpt};
use quick_xml::errors::{Error, IllFormedError};
use quick_xml::escape::EscapeError;
use quick_xml::events::Event;
use quick_xml::events::attributes::Attributes;
use quick_xml::name::QName;
use quick_xml::{Reader, XmlVersion};
use std::borrow::Cow;
use std::ops::Range;

/// The most bytes of a message of the parser.
const MAX_MESSAGE: usize = 200;

/// The elements and attributes that a program knows.
///
/// ```
/// use bvh_bake::input::xml::{Schema, Tree, XmlError};
///
/// /// Points, as in `<points><point x="1"/></points>`.
/// struct Points;
///
/// #[derive(Clone, Copy, PartialEq, Eq)]
/// enum Tag {
///     Points,
///     Point,
/// }
///
/// impl Schema for Points {
///     type Tag = Tag;
///     type Attribute = ();
///
///     const ROOT: &'static str = "points";
///
///     fn root() -> Tag {
///         Tag::Points
///     }
///
///     fn tag(parent: Tag, name: &str) -> Option<Tag> {
///         (parent == Tag::Points && name == "point").then_some(Tag::Point)
///     }
///
///     fn attribute(name: &str) -> Option<()> {
///         (name == "x").then_some(())
///     }
/// }
///
/// let tree = Tree::<Points>::parse("<points>\n<note/><point x=\"1\"/>\n<point x=\"2\"/></points>")?;
/// let values: Vec<_> = tree.children(Tree::<Points>::ROOT).map(|point| tree.attribute(point, ())).collect();
/// assert_eq!(values, [Some("1"), Some("2")]); // the note is passed over
/// assert_eq!(tree.line(2), 3);
///
/// let other: Result<_, XmlError> = Tree::<Points>::parse("<lines/>");
/// assert_eq!(other.err().map(|error| (error.line, error.column)), Some((1, 1)));
/// # Ok::<(), XmlError>(())
/// ```
pub trait Schema {
    /// An element.
    type Tag: Copy + Eq;
    /// An attribute. Elements may share one.
    type Attribute: Copy + Eq;

    /// The name of the root.
    const ROOT: &'static str;

    /// Returns the tag of the root.
    fn root() -> Self::Tag;

    /// Returns the element of a name in a parent, or `None` if it is passed over with what is in it.
    fn tag(parent: Self::Tag, name: &str) -> Option<Self::Tag>;

    /// Returns the element of a name whose prefix is not that of the root. The name includes the prefix.
    fn foreign(_parent: Self::Tag, _name: &str) -> Option<Self::Tag> {
        None
    }

    /// Returns the attribute of a name, or `None` if it is passed over.
    fn attribute(name: &str) -> Option<Self::Attribute>;

    /// Returns whether the text in an element is kept.
    fn has_text(_tag: Self::Tag) -> bool {
        false
    }
}

/// Why a text is no document of a schema.
///
/// [`Schema`] has an example.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct XmlError {
    /// The line, counted from 1.
    pub line: u64,
    /// The column in characters, counted from 1.
    pub column: u64,
    /// What should be there.
    pub expected: Cow<'static, str>,
    /// What is there, shortened and without control characters.
    pub found: String,
}

impl From<XmlError> for Fault {
    fn from(error: XmlError) -> Self {
        Self::new(Place::Line(error.line), error.expected, error.found)
    }
}

/// The number of an element, in the order of the file.
pub type Number = usize;

pub(crate) struct Element<Tag> {
    tag: Tag,
    /// The offset of the element in the text.
    at: usize,
    /// One more than the number of the last element in this one.
    end: Number,
    /// Places in the lists of the tree.
    attributes: Range<usize>,
    pieces: Range<usize>,
}

/// The elements of a text that a schema knows.
///
/// [`Schema`] has an example.
pub struct Tree<'a, S: Schema> {
    text: &'a str,
    elements: Vec<Element<S::Tag>>,
    attributes: Vec<(S::Attribute, Cow<'a, str>)>,
    /// The places in the text of what elements contain, divided by comments.
    pieces: Vec<Range<usize>>,
}

impl<'a, S: Schema> Tree<'a, S> {
    /// Parses a text.
    ///
    /// # Errors
    /// [`XmlError`] if it is no XML, or has another root than the schema. What is passed over need not be valid.
    pub fn parse(text: &'a str) -> Result<Self, XmlError> {
        // The parser does not count a byte order mark, so that its places would be others.
        let text = text.trim_start_matches('\u{feff}');
        let mut tree = Self { text, elements: Vec::new(), attributes: Vec::new(), pieces: Vec::new() };
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        reader.config_mut().allow_dangling_amp = true;
        let mut open: Vec<Number> = Vec::new();
        let mut prefix = None;
        loop {
            let at = reader.buffer_position() as usize;
            let event = reader.read_event();
            let event = event.map_err(|error| tree.not_xml(reader.error_position(), error))?;
            let range = at..reader.buffer_position() as usize;
            match event {
                Event::Start(start) => {
                    let name = start.name();
                    let of = name.prefix().map(|prefix| prefix.into_inner().to_owned());
                    let tag = match open.last() {
                        None => {
                            tree.require_root(name, at)?;
                            prefix = of;
                            Some(S::root())
                        }
                        Some(&parent) if of == prefix => {
                            S::tag(tree.tag(parent), name.local_name().into_inner())
                        }
                        Some(&parent) => S::foreign(tree.tag(parent), name.into_inner()),
                    };
                    match tag {
                        Some(tag) => open.push(tree.add(tag, range, name.0.len())?),
                        None => {
                            let skipped = reader.read_to_end(name);
                            skipped.map_err(|error| tree.not_xml(reader.error_position(), error))?;
                        }
                    }
                }
                Event::End(_) => {
                    // The reader checks that ends match.
                    let Some(ended) = open.pop() else { continue };
                    let (elements, pieces) = (tree.elements.len(), tree.pieces.len());
                    let element = &mut tree.elements[ended];
                    (element.end, element.pieces.end) = (elements, pieces);
                }
                Event::Text(_) | Event::GeneralRef(_) => tree.add_text(open.last().copied(), range)?,
                Event::CData(content) => {
                    let start = at + "<![CDATA[".len();
                    tree.add_text(open.last().copied(), start..start + content.len())?;
                }
                Event::Eof if open.is_empty() && !tree.elements.is_empty() => return Ok(tree),
                Event::Eof => {
                    let expected = match open.last() {
                        Some(&last) => format!("</{}>", tree.name(last)),
                        None => format!("the element <{}>", S::ROOT),
                    };
                    return Err(tree.error(at, expected, "the end of the file"));
                }
                Event::Empty(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
            }
        }
    }

    fn not_xml(&self, at: u64, error: Error) -> XmlError {
        let at = at as usize;
        let end = |name: &str| excerpt(format!("</{name}>").as_bytes());
        match error {
            Error::IllFormed(IllFormedError::MismatchedEndTag { expected, found }) => {
                self.error(at, end(&expected), end(&found))
            }
            Error::Escape(EscapeError::UnrecognizedEntity(_, name)) => {
                let found = excerpt(format!("&{name};").as_bytes());
                self.error(at, "a character or one of the five entities of XML", found)
            }
            other => self.error(at, "XML", whole_words(&other.to_string())),
        }
    }

    fn require_root(&self, name: QName, at: usize) -> Result<(), XmlError> {
        let found = format!("<{}>", excerpt(name.0.as_bytes()));
        if !self.elements.is_empty() {
            return Err(self.error(at, "the end of the file", found));
        }
        if name.local_name().into_inner() != S::ROOT {
            return Err(self.error(at, format!("the element <{}>", S::ROOT), found));
        }
        Ok(())
    }

    /// Adds an element: its tag takes a range of the text, and a name of `name` bytes begins there.
    fn add(&mut self, tag: S::Tag, range: Range<usize>, name: usize) -> Result<Number, XmlError> {
        let (at, first) = (range.start, self.attributes.len());
        let content = &self.text[at + 1..range.end - 1];
        let mut attributes = Attributes::new(content.strip_suffix('/').unwrap_or(content), name);
        // That no attribute occurs twice is checked below for those that are read: the time of the parser's check grows with the
        // square of their number.
        for attribute in attributes.with_checks(false) {
            let attribute = attribute.map_err(|error| self.not_xml(at as u64, error.into()))?;
            let Some(key) = S::attribute(attribute.key.0) else { continue };
            if self.attributes[first..].iter().any(|(known, _)| *known == key) {
                let found = format!("two attributes {}", excerpt(attribute.key.0.as_bytes()));
                return Err(self.error(at, "XML", found));
            }
            let value = match attribute.value {
                Cow::Borrowed(value) if !value.contains(['&', '\t', '\r', '\n']) => Cow::Borrowed(value),
                _ => {
                    let value = attribute.normalized_value(XmlVersion::Implicit1_0);
                    value.map_err(|error| self.not_xml(at as u64, error))?.into_owned().into()
                }
            };
            self.attributes.push((key, value));
        }
        let (attributes, pieces) = (first..self.attributes.len(), self.pieces.len());
        self.elements.push(Element { tag, at, end: 0, attributes, pieces: pieces..pieces });
        Ok(self.elements.len() - 1)
    }

    /// Adds a piece of text to an element, or checks that text beside the root is blank.
    fn add_text(&mut self, element: Option<Number>, range: Range<usize>) -> Result<(), XmlError> {
        let Some(element) = element else {
            let text = &self.text[range.clone()];
            // Some programs end text files with NULs or with Ctrl-Z.
            let is_blank = |character: char| {
                character.is_whitespace() || matches!(character, '\0' | '\u{1a}' | '\u{feff}')
            };
            if let Some(other) = text.find(|character| !is_blank(character)) {
                let found = excerpt(&text.as_bytes()[other..]);
                let expected = format!("the element <{}> and no more", S::ROOT);
                return Err(self.error(range.start + other, expected, found));
            }
            return Ok(());
        };
        let first = self.elements[element].pieces.start;
        if S::has_text(self.tag(element)) {
            match self.pieces.get_mut(first..).and_then(<[_]>::last_mut) {
                // A reference divides no word.
                Some(last) if last.end == range.start => last.end = range.end,
                _ => self.pieces.push(range),
            }
        }
        Ok(())
    }

    /// The number of the root.
    pub const ROOT: Number = 0;

    /// Returns the number of elements.
    pub fn count(&self) -> usize {
        self.elements.len()
    }

    /// Returns the whole text.
    pub(crate) fn text(&self) -> &'a str {
        self.text
    }

    /// Returns what an element is.
    pub fn tag(&self, element: Number) -> S::Tag {
        self.elements[element].tag
    }

    /// Returns one more than the number of the last element in an element.
    pub fn end(&self, element: Number) -> Number {
        self.elements[element].end
    }

    /// Returns the elements directly in an element, in order.
    pub fn children(&self, element: Number) -> Children<'_, 'a, S> {
        Children { tree: self, next: element + 1, end: self.elements[element].end }
    }

    /// Returns the elements of one kind directly in an element, in order.
    pub fn children_of(&self, element: Number, tag: S::Tag) -> impl Iterator<Item = Number> {
        self.children(element).filter(move |&child| self.tag(child) == tag)
    }

    /// Returns the value of an attribute, its references resolved.
    pub fn attribute(&self, element: Number, key: S::Attribute) -> Option<&str> {
        let attributes = &self.attributes[self.elements[element].attributes.clone()];
        attributes.iter().find(|(known, _)| *known == key).map(|(_, value)| value.as_ref())
    }

    /// Returns the name of an element as the file has it, shortened and without control characters.
    pub fn name(&self, element: Number) -> String {
        let tag = &self.text[self.elements[element].at + 1..];
        let is_end = |character: char| character.is_whitespace() || matches!(character, '/' | '>');
        excerpt(tag.split(is_end).next().unwrap_or_default().as_bytes())
    }

    /// Returns the pieces of the text in an element, which comments divide.
    pub(crate) fn pieces(&self, element: Number) -> impl Iterator<Item = &'a str> + use<'a, '_, S> {
        let pieces = self.pieces[self.elements[element].pieces.clone()].iter();
        pieces.map(|piece| &self.text[piece.clone()])
    }

    /// Returns the offset of an element in the text.
    pub(crate) fn at(&self, element: Number) -> usize {
        self.elements[element].at
    }

    /// Returns the line of an element, counted from 1. Takes one pass over the text before it.
    pub fn line(&self, element: Number) -> u64 {
        self.line_at(self.elements[element].at)
    }

    /// Returns the line of an offset in the text. A line ends at LF, CR LF or a CR alone.
    pub(crate) fn line_at(&self, at: usize) -> u64 {
        let (bytes, before) = (self.text.as_bytes(), &self.text.as_bytes()[..at]);
        let is_lone = |at: &usize| bytes.get(at + 1) != Some(&b'\n');
        let lone = memchr::memchr_iter(b'\r', before).filter(is_lone).count();
        (1 + lone + memchr::memchr_iter(b'\n', before).count()) as u64
    }

    fn error(&self, at: usize, expected: impl Into<Cow<'static, str>>, found: impl Into<String>) -> XmlError {
        let before = &self.text[..at];
        let line = before.rsplit(['\r', '\n']).next().unwrap_or_default();
        let column = 1 + line.chars().count() as u64;
        XmlError { line: self.line_at(at), column, expected: expected.into(), found: found.into() }
    }
}

/// Shortens a message of the parser between two words, and leaves out control characters.
fn whole_words(message: &str) -> String {
    let mut words = String::new();
    for word in message.escape_debug().to_string().split(' ') {
        if words.len() + word.len() > MAX_MESSAGE {
            return words + "…";
        }
        words += word;
        words.push(' ');
    }
    words.truncate(words.len() - 1);
    words
}

/// The elements directly in an element.
///
/// [`Schema`] has an example.
pub struct Children<'d, 'a, S: Schema> {
    tree: &'d Tree<'a, S>,
    next: Number,
    end: Number,
}

impl<S: Schema> Iterator for Children<'_, '_, S> {
    type Item = Number;

    fn next(&mut self) -> Option<Number> {
        let child = Some(self.next).filter(|&next| next < self.end)?;
        self.next = self.tree.elements[child].end;
        Some(child)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Plain;

    impl Schema for Plain {
        type Tag = ();
        type Attribute = ();
        const ROOT: &'static str = "a";
        fn root() {}
        fn tag(_: (), name: &str) -> Option<()> {
            (name == "b").then_some(())
        }
        fn attribute(name: &str) -> Option<()> {
            (name == "n").then_some(())
        }
    }

    #[test]
    fn byte_order_marks_move_no_place() {
        for mark in ["", "\u{feff}", "\u{feff}\u{feff}"] {
            let text = format!("{mark}<a n='1'>\n<b n='2'/></a>");
            let tree = Tree::<Plain>::parse(&text).unwrap();
            assert_eq!((tree.attribute(0, ()), tree.attribute(1, ())), (Some("1"), Some("2")), "{mark:?}");
            assert_eq!((tree.name(0), tree.name(1), tree.line(1)), ("a".into(), "b".into(), 2), "{mark:?}");
            // The start of a root that is cut short, and of another one.
            for (text, column) in [("<a n='1", 1), ("<c/>", 1), ("<a/><a/>", 5)] {
                let error = Tree::<Plain>::parse(&format!("{mark}{text}")).err().unwrap();
                assert_eq!((error.line, error.column), (1, column), "{mark:?}{text}: {error:?}");
            }
        }
    }

    #[test]
    fn messages_end_with_a_word() {
        assert_eq!(whole_words("a bad\ntag"), "a bad\\ntag");
        assert_eq!(whole_words(&format!("a tag {}", "\u{e9}".repeat(200))), "a tag …");
        assert!(whole_words(&"word ".repeat(100)).ends_with("word …"));
    }
}
