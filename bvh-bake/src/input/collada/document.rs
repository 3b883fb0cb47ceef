//! A COLLADA file as a tree of the elements that module `schema` knows. The file is kept in memory as a whole, after it has been
//! charged, and the elements refer to its text.

use super::schema::{Attribute, Collada, Tag};
use crate::error::{Fault, Halt, Place, excerpt};
use crate::input::polygon::MAX_CORNERS;
use crate::input::xml::{self, Element, Number, Tree};
use crate::storage::resources::Allowance;
use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;

/// Bytes of memory per `<` of a file: an element, a piece of its text, and what the scene knows of it. Lists that grow have
/// room for twice as many.
const BYTES_PER_ELEMENT: u64 = 512;
/// Bytes of memory per `=`, which precedes the value of an attribute.
const BYTES_PER_ATTRIBUTE: u64 = 320;

/// Bytes of memory per byte of a file in which polygons have holes: the positions of a mesh, of which each takes 6 bytes of text at
/// least, in a list that grows.
const HOLE_BYTES_PER_BYTE: u64 = 12;

const _: () = assert!(size_of::<Element<Tag>>() <= BYTES_PER_ELEMENT as usize / 6);

/// A parsed document.
pub(super) type Document<'a> = Tree<'a, Collada>;

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
    /// Returns the number of bytes of the text.
    pub(super) fn length(&self) -> u64 {
        self.text().len() as u64
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
        (0..self.count()).filter(move |&element| self.tag(element) == tag)
    }

    /// Returns the number of bytes that an element takes in the file, at least.
    pub(super) fn bytes(&self, element: Number) -> u64 {
        let end = self.end(element);
        let next = if end < self.count() { self.at(end) } else { self.text().len() };
        (next - self.at(element)) as u64
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
        Ok(self.pieces(element).flat_map(str::split_ascii_whitespace))
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
        Fault::new(self.place(element), expected, found)
    }

    /// Returns the fault of an element that may change triangles in an unknown way.
    pub(super) fn unknown(&self, element: Number) -> Fault {
        self.fault(element, "an element that this reader knows", self.named(element))
    }

    /// Returns the fault of a polygon with too many corners.
    pub(super) fn too_many_corners(&self, element: Number) -> Fault {
        let place = self.place(element);
        Fault::Limit { place, most: MAX_CORNERS as u64, what: "vertices in a face" }
    }

    /// Returns the fault of a word of the text.
    pub(super) fn fault_at(&self, word: &str, expected: impl Into<Cow<'static, str>>) -> Fault {
        let at = word.as_ptr() as usize - self.text().as_ptr() as usize;
        Fault::new(Place::Line(self.line_at(at)), expected, excerpt(word.as_bytes()))
    }

    fn place(&self, element: Number) -> Place {
        Place::Line(self.line(element))
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

    fn fault(text: &str) -> String {
        let Err(error) = Document::parse(text) else { panic!("{text}") };
        Fault::from(error).in_file("a.dae".as_ref()).to_string()
    }

    #[test]
    fn texts_are_divided_by_comments_alone() {
        let text = "<?xml version='1.0'?>\r\n<!DOCTYPE COLLADA [<!ENTITY a \"1 > 2\">]>\n<!-- a <b> --><c:COLLADA>\
                    <c:library_nodes><c:node id='&amp;a'><c:translate>1 2<!-- 3 -->3 <![CDATA[4]]> &#53;6&a;</c:translate></c:node>\
                    <node/><x><c:node/></x></c:library_nodes></c:COLLADA>\0\x1a\n";
        let document = Document::parse(text).unwrap();
        let tags: Vec<Tag> = (0..document.count()).map(|element| document.tag(element)).collect();
        assert_eq!(tags, [Tag::Collada, Tag::LibraryNodes, Tag::Node, Tag::Translate]);
        assert_eq!(document.words(3).unwrap().collect::<Vec<_>>(), ["1", "2", "3", "4", "&#53;6&a;"]);
        assert_eq!(document.attribute(2, Attribute::Id), Some("&a"));
        assert_eq!((document.name(3), document.line(2)), ("c:translate".to_owned(), 3));
        assert_eq!(document.children(0).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn what_is_no_xml_is_told_with_its_line() {
        for (text, expected) in [
            ("", "line 1: expected the element <COLLADA>, found the end of the file"),
            ("\n<robot/>", "line 2: expected the element <COLLADA>, found <robot>"),
            ("\r<robot/>", "line 2: expected the element <COLLADA>, found <robot>"),
            ("<COLLADA>\r<asset>", "line 2: expected </asset>, found the end of the file"),
            ("<COLLADA>\r\n<asset></a>", "line 2: expected </asset>, found </a>"),
            ("<COLLADA/>\n<COLLADA/>", "line 2: expected the end of the file, found <COLLADA>"),
            ("<COLLADA/>\n 7", "line 2: expected the element <COLLADA> and no more, found 7"),
            ("<COLLADA>\n<scene>\n<a", "line 3: expected XML, found syntax error: "),
            ("<COLLADA><asset><unit meter='1' meter='2'/>", "two attributes meter"),
            ("<COLLADA><asset><unit meter=1/>", "expected XML, found "),
            ("<COLLADA><asset><unit meter='&a;'/>", "one of the five entities of XML, found &a;"),
            (&format!("<COLLADA></{}>", "long".repeat(100)), "expected </COLLADA>, found </longlong"),
        ] {
            let said = fault(text);
            assert!(said.starts_with("a.dae: ") && said.contains(expected), "{said}");
        }
    }
}
