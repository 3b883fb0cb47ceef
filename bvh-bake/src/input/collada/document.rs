//! Reads the XML of a COLLADA file into a list of the elements that module `schema` knows. The file is kept in memory as a
//! whole, after it has been charged, and the elements refer to its text.
//!
//! The document type is passed over, and no entity is followed but the five of XML and those of single characters.

use super::schema::{Attribute, Tag};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::polygon::MAX_CORNERS;
use crate::input::xml;
use crate::storage::resources::Allowance;
use quick_xml::errors::{Error, IllFormedError};
use quick_xml::events::Event;
use quick_xml::events::attributes::Attributes;
use quick_xml::name::QName;
use quick_xml::{Reader, XmlVersion};
use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;

/// Bytes of memory per `<` of a file: an element, a piece of its text, and what the scene knows of it. Lists that grow have
/// room for twice as many.
const BYTES_PER_ELEMENT: u64 = 512;
/// Bytes of memory per `=`, which precedes the value of an attribute.
const BYTES_PER_ATTRIBUTE: u64 = 320;

/// Bytes of memory per byte of a file in which polygons have holes: the positions of a mesh, of which each takes 6 bytes of text at
/// least, in a list that grows.
const HOLE_BYTES_PER_BYTE: u64 = 12;

const _: () = assert!(size_of::<Element>() <= BYTES_PER_ELEMENT as usize / 6);

/// The most bytes of a message of the parser.
const MAX_MESSAGE: usize = 200;

/// The number of an element, in the order of the file.
pub(super) type Number = usize;

struct Element {
    tag: Tag,
    /// The offset of the element in the text.
    at: usize,
    /// One more than the number of the last element in this one.
    end: Number,
    /// Places in the lists of the document.
    attributes: Range<usize>,
    pieces: Range<usize>,
}

/// A parsed document.
pub(super) struct Document<'a> {
    text: &'a str,
    elements: Vec<Element>,
    attributes: Vec<(Attribute, Cow<'a, str>)>,
    /// The places in the text of what elements contain, divided by comments.
    pieces: Vec<Range<usize>>,
}

/// Returns the text of a file, if there is memory for it and for its elements.
pub(super) fn text(bytes: &[u8], memory: Allowance) -> Result<Cow<'_, str>, Halt> {
    let is_end = |byte: &u8| matches!(byte, b'<' | b'>' | b'/') || byte.is_ascii_whitespace();
    let name = |at: usize| {
        let rest = &bytes[at + 1..];
        rest.iter().position(is_end).unwrap_or(rest.len()) as u64
    };
    // The parser keeps the names of open elements in a buffer that grows.
    let elements = memchr::memchr_iter(b'<', bytes).map(|at| BYTES_PER_ELEMENT + 3 * name(at)).sum::<u64>();
    let attributes = memchr::memchr_iter(b'=', bytes).count() as u64 * BYTES_PER_ATTRIBUTE;
    let needed = xml::bytes_of_text(bytes) + elements + attributes;
    memory.require(needed)?;
    let text = xml::text_of(bytes);
    let is_hole = |at: usize| {
        let before = at.checked_sub(1).map(|at| text.as_bytes()[at]);
        matches!(before, Some(b'<' | b':')) && text.as_bytes().get(at + 2).is_none_or(is_end)
    };
    let has_holes = memchr::memmem::find_iter(text.as_bytes(), "ph").any(is_hole);
    let positions = if has_holes { text.len() as u64 * HOLE_BYTES_PER_BYTE } else { 0 };
    memory.require(needed + positions)?;
    Ok(text)
}

impl<'a> Document<'a> {
    /// Parses a text.
    pub(super) fn parse(text: &'a str) -> Result<Self, Fault> {
        let mut document = Self { text, elements: Vec::new(), attributes: Vec::new(), pieces: Vec::new() };
        let mut reader = Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        let mut open: Vec<Number> = Vec::new();
        let mut prefix = None;
        loop {
            let at = reader.buffer_position() as usize;
            let event = reader.read_event();
            let event = event.map_err(|error| document.not_xml(reader.error_position(), error))?;
            let range = at..reader.buffer_position() as usize;
            match event {
                Event::Start(start) => {
                    let name = start.name();
                    let of = name.prefix().map(|prefix| prefix.into_inner().to_owned());
                    if open.is_empty() {
                        document.require_root(name, at)?;
                        prefix = of;
                        open.push(document.add(Tag::Collada, range, name.0.len())?);
                        continue;
                    }
                    let parent = document.tag(open[open.len() - 1]);
                    // Elements of other schemas are no part of COLLADA.
                    let tag = Some(parent).filter(|_| of == prefix);
                    match tag.and_then(|parent| Tag::of(parent, name.local_name().into_inner())) {
                        Some(tag) => open.push(document.add(tag, range, name.0.len())?),
                        None => {
                            let skipped = reader.read_to_end(name);
                            skipped.map_err(|error| document.not_xml(reader.error_position(), error))?;
                        }
                    }
                }
                Event::End(_) => {
                    // The reader checks that ends match.
                    let Some(ended) = open.pop() else { continue };
                    let (elements, pieces) = (document.elements.len(), document.pieces.len());
                    let element = &mut document.elements[ended];
                    (element.end, element.pieces.end) = (elements, pieces);
                }
                Event::Text(_) | Event::GeneralRef(_) => document.add_text(open.last().copied(), range)?,
                Event::CData(content) => {
                    let start = at + "<![CDATA[".len();
                    document.add_text(open.last().copied(), start..start + content.len())?;
                }
                Event::Eof if open.is_empty() && !document.elements.is_empty() => return Ok(document),
                Event::Eof => {
                    let expected = match open.last() {
                        Some(&last) => format!("</{}>", document.name(last)),
                        None => "the element <COLLADA>".to_owned(),
                    };
                    return Err(Fault::new(document.line(at), expected, "the end of the file"));
                }
                Event::Empty(_) | Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
            }
        }
    }

    fn not_xml(&self, at: u64, error: Error) -> Fault {
        let line = self.line(at as usize);
        let end = |name: &str| excerpt(format!("</{name}>").as_bytes());
        match error {
            Error::IllFormed(IllFormedError::MismatchedEndTag { expected, found }) => {
                Fault::new(line, end(&expected), end(&found))
            }
            other => Fault::new(line, "XML", whole_words(&other.to_string())),
        }
    }

    fn require_root(&self, name: QName, at: usize) -> Result<(), Fault> {
        let found = format!("<{}>", excerpt(name.0.as_bytes()));
        if !self.elements.is_empty() {
            return Err(Fault::new(self.line(at), "the end of the file", found));
        }
        match name.local_name().into_inner() {
            "COLLADA" => Ok(()),
            _ => Err(Fault::new(self.line(at), "the element <COLLADA>", found)),
        }
    }

    /// Adds an element: its tag takes a range of the text, and a name of `name` bytes begins there.
    fn add(&mut self, tag: Tag, range: Range<usize>, name: usize) -> Result<Number, Fault> {
        let (at, first) = (range.start, self.attributes.len());
        let content = &self.text[at + 1..range.end - 1];
        let mut attributes = Attributes::new(content.strip_suffix('/').unwrap_or(content), name);
        // That no attribute occurs twice is checked below for those that are read: the time of the parser's check grows with the
        // square of their number.
        for attribute in attributes.with_checks(false) {
            let attribute = attribute.map_err(|error| self.not_xml(at as u64, error.into()))?;
            let Some(key) = Attribute::of(attribute.key.0) else { continue };
            if self.attributes[first..].iter().any(|(known, _)| *known == key) {
                let found = format!("two attributes {}", key.name());
                return Err(Fault::new(self.line(at), "XML", found));
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
    fn add_text(&mut self, element: Option<Number>, range: Range<usize>) -> Result<(), Fault> {
        let Some(element) = element else {
            let text = &self.text[range.clone()];
            // Some programs end text files with NULs or with Ctrl-Z.
            let is_blank = |character: char| {
                character.is_whitespace() || matches!(character, '\0' | '\u{1a}' | '\u{feff}')
            };
            if let Some(other) = text.find(|character| !is_blank(character)) {
                let found = excerpt(&text.as_bytes()[other..]);
                return Err(Fault::new(
                    self.line(range.start + other),
                    "the element <COLLADA> and no more",
                    found,
                ));
            }
            return Ok(());
        };
        let first = self.elements[element].pieces.start;
        if self.tag(element).has_text() {
            match self.pieces.get_mut(first..).and_then(<[_]>::last_mut) {
                // A reference divides no word.
                Some(last) if last.end == range.start => last.end = range.end,
                _ => self.pieces.push(range),
            }
        }
        Ok(())
    }

    pub(super) const ROOT: Number = 0;

    /// Returns the number of elements.
    pub(super) fn count(&self) -> usize {
        self.elements.len()
    }

    /// Returns the number of bytes of the text.
    pub(super) fn length(&self) -> u64 {
        self.text.len() as u64
    }

    pub(super) fn tag(&self, element: Number) -> Tag {
        self.elements[element].tag
    }

    /// Returns the elements directly in an element, in order.
    pub(super) fn children(&self, element: Number) -> Children<'_, 'a> {
        Children { document: self, next: element + 1, end: self.elements[element].end }
    }

    /// Returns the elements of one kind directly in an element, in order.
    pub(super) fn children_of(&self, element: Number, tag: Tag) -> impl Iterator<Item = Number> {
        self.children(element).filter(move |&child| self.tag(child) == tag)
    }

    /// Returns the only element of its kind in an element, if there is one.
    pub(super) fn only_child(&self, element: Number, tag: Tag) -> Result<Option<Number>, Fault> {
        let mut all = self.children_of(element, tag);
        let first = all.next();
        match all.next() {
            None => Ok(first),
            Some(second) => Err(self.fault(second, format!("one <{}>", self.name(second)), "another one")),
        }
    }

    /// Returns the elements of one kind in the whole file, in order.
    pub(super) fn all(&self, tag: Tag) -> impl Iterator<Item = Number> {
        (0..self.elements.len()).filter(move |&element| self.tag(element) == tag)
    }

    /// Returns the number of bytes that an element takes in the file, at least.
    pub(super) fn bytes(&self, element: Number) -> u64 {
        let Element { at, end, .. } = self.elements[element];
        let next = self.elements.get(end).map_or(self.text.len(), |next| next.at);
        (next - at) as u64
    }

    pub(super) fn attribute(&self, element: Number, key: Attribute) -> Option<&str> {
        let attributes = &self.attributes[self.elements[element].attributes.clone()];
        attributes.iter().find(|(known, _)| *known == key).map(|(_, value)| value.as_ref())
    }

    /// Returns the whole number that an attribute states, if it is there.
    pub(super) fn number(&self, element: Number, key: Attribute) -> Result<Option<u64>, Fault> {
        let Some(value) = self.attribute(element, key) else { return Ok(None) };
        let fault = || {
            let found = format!("{}=\"{}\"", key.name(), excerpt(value.as_bytes()));
            self.fault(element, "a whole number", found)
        };
        value.trim().parse().map(Some).map_err(|_| fault())
    }

    /// Returns the name of an element, as the file has it.
    pub(super) fn name(&self, element: Number) -> String {
        let tag = &self.text[self.elements[element].at + 1..];
        let is_end = |character: char| character.is_whitespace() || matches!(character, '/' | '>');
        excerpt(tag.split(is_end).next().unwrap_or_default().as_bytes())
    }

    /// Returns the words in an element, which contains no other element.
    pub(super) fn words(
        &self,
        element: Number,
    ) -> Result<impl Iterator<Item = &'a str> + use<'a, '_>, Fault> {
        if let Some(child) = self.children(element).next() {
            return Err(self.fault(
                child,
                format!("text alone in <{}>", self.name(element)),
                self.named(child),
            ));
        }
        let pieces = self.pieces[self.elements[element].pieces.clone()].iter();
        Ok(pieces.flat_map(|piece| self.text[piece.clone()].split_ascii_whitespace()))
    }

    /// Returns the numbers in an element, which must be finite and so many.
    pub(super) fn numbers<const N: usize>(&self, element: Number) -> Result<[f64; N], Fault> {
        let mut all = [0.0; N];
        let mut count = 0;
        for word in self.words(element)? {
            let value = word.parse().ok().filter(|value: &f64| value.is_finite());
            let value = value.ok_or_else(|| self.fault_at(word, "a finite number"))?;
            if let Some(slot) = all.get_mut(count) {
                *slot = value;
            }
            count += 1;
        }
        if count == N {
            return Ok(all);
        }
        Err(self.fault(element, format!("{N} numbers in <{}>", self.name(element)), count.to_string()))
    }

    /// Returns an element as messages name it.
    pub(super) fn named(&self, element: Number) -> String {
        format!("<{}>", self.name(element))
    }

    /// Returns the fault of an element.
    pub(super) fn fault(
        &self,
        element: Number,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<String>,
    ) -> Fault {
        Fault::new(self.line(self.elements[element].at), expected, found)
    }

    /// Returns the fault of an element that may change triangles in an unknown way.
    pub(super) fn unknown(&self, element: Number) -> Fault {
        self.fault(element, "an element that this reader knows", self.named(element))
    }

    /// Returns the fault of a polygon with too many corners.
    pub(super) fn too_many_corners(&self, element: Number) -> Fault {
        let place = self.line(self.elements[element].at);
        Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" }
    }

    /// Returns the fault of a word of the text.
    pub(super) fn fault_at(&self, word: &str, expected: impl Into<Cow<'static, str>>) -> Fault {
        let at = word.as_ptr() as usize - self.text.as_ptr() as usize;
        Fault::new(self.line(at), expected, excerpt(word.as_bytes()))
    }

    /// Returns the line of an offset in the text. A line ends at LF, CR LF or a CR alone.
    pub(super) fn line(&self, at: usize) -> Place {
        let before = &self.text.as_bytes()[..at];
        let lone = before.windows(2).filter(|pair| pair[0] == b'\r' && pair[1] != b'\n').count();
        Place::Line((1 + lone + memchr::memchr_iter(b'\n', before).count()) as u64)
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
pub(super) struct Children<'d, 'a> {
    document: &'d Document<'a>,
    next: Number,
    end: Number,
}

impl Iterator for Children<'_, '_> {
    type Item = Number;

    fn next(&mut self) -> Option<Number> {
        let child = Some(self.next).filter(|&next| next < self.end)?;
        self.next = self.document.elements[child].end;
        Some(child)
    }
}

/// Elements by their kinds and ids. An id that occurs again is an error only where it is needed.
#[derive(Default)]
pub(super) struct Ids<'d> {
    known: HashMap<(Tag, &'d str), (Number, Option<Number>)>,
}

impl<'d> Ids<'d> {
    /// Keeps the ids of some elements.
    pub(super) fn of(document: &'d Document, elements: impl Iterator<Item = Number>) -> Self {
        let mut known = HashMap::new();
        for element in elements {
            let Some(id) = document.attribute(element, Attribute::Id) else { continue };
            match known.entry((document.tag(element), id)) {
                Entry::Vacant(free) => drop(free.insert((element, None))),
                Entry::Occupied(mut taken) => taken.get_mut().1 = Some(element),
            }
        }
        Self { known }
    }

    /// Returns the element of a kind that an attribute of another one refers to. `kind` names it in errors.
    pub(super) fn find(
        &self,
        document: &'d Document,
        user: Number,
        key: Attribute,
        tag: Tag,
        kind: &'static str,
    ) -> Result<Number, Fault> {
        let url = document.attribute(user, key).unwrap_or_default();
        let found = || format!("{}=\"{}\" in {}", key.name(), excerpt(url.as_bytes()), document.named(user));
        let Some(id) = url.trim().strip_prefix('#') else {
            let expected = format!("a reference to a {kind} in this file, as #id (other files are not read)");
            return Err(document.fault(user, expected, found()));
        };
        match self.known.get(&(tag, id)) {
            Some(&(element, None)) => Ok(element),
            Some(&(_, Some(again))) => Err(document.fault(
                again,
                format!("one {kind} with the id that {} needs", found()),
                "another one",
            )),
            None => Err(document.fault(user, format!("the id of a {kind}"), found())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_end_with_a_word() {
        assert_eq!(whole_words("a bad\ntag"), "a bad\\ntag");
        assert_eq!(whole_words(&format!("a tag {}", "\u{e9}".repeat(200))), "a tag …");
        assert!(whole_words(&"word ".repeat(100)).ends_with("word …"));
    }

    fn fault(text: &str) -> String {
        let Err(fault) = Document::parse(text) else { panic!("{text}") };
        fault.in_file("a.dae".as_ref()).to_string()
    }

    #[test]
    fn texts_are_divided_by_comments_alone() {
        let text = "<?xml version='1.0'?>\r\n<!DOCTYPE COLLADA [<!ENTITY a \"1 > 2\">]>\n<!-- a <b> --><c:COLLADA>\
                    <c:library_nodes><c:node id='&amp;a'><c:translate>1 2<!-- 3 -->3 <![CDATA[4]]> &#53;6&a;</c:translate></c:node>\
                    <node/><x><c:node/></x></c:library_nodes></c:COLLADA>\0\x1a\n";
        let document = Document::parse(text).unwrap();
        let tags: Vec<Tag> = document.elements.iter().map(|element| element.tag).collect();
        assert_eq!(tags, [Tag::Collada, Tag::LibraryNodes, Tag::Node, Tag::Translate]);
        assert_eq!(document.words(3).unwrap().collect::<Vec<_>>(), ["1", "2", "3", "4", "&#53;6&a;"]);
        assert_eq!(document.attribute(2, Attribute::Id), Some("&a"));
        assert_eq!(
            (document.name(3), document.line(text.find("<c:n").unwrap())),
            ("c:translate".to_owned(), Place::Line(3))
        );
        assert_eq!(document.children(0).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn what_is_no_xml_is_told_with_its_line() {
        for (text, expected) in [
            ("", "line 1: expected the element <COLLADA>, found the end of the file"),
            ("\n<robot/>", "line 2: expected the element <COLLADA>, found <robot>"),
            ("<COLLADA>\r<asset>", "line 2: expected </asset>, found the end of the file"),
            ("<COLLADA>\r\n<asset></a>", "line 2: expected </asset>, found </a>"),
            ("<COLLADA/>\n<COLLADA/>", "line 2: expected the end of the file, found <COLLADA>"),
            ("<COLLADA/>\n 7", "line 2: expected the element <COLLADA> and no more, found 7"),
            ("<COLLADA>\n<scene>\n<a", "line 3: expected XML, found syntax error: "),
            ("<COLLADA><asset><unit meter='1' meter='2'/>", "two attributes meter"),
            ("<COLLADA><asset><unit meter=1/>", "expected XML, found "),
            ("<COLLADA><asset><unit meter='&a;'/>", "expected XML, found "),
            (&format!("<COLLADA></{}>", "long".repeat(100)), "expected </COLLADA>, found </longlong"),
        ] {
            let said = fault(text);
            assert!(said.starts_with("a.dae: ") && said.contains(expected), "{said}");
        }
    }
}
