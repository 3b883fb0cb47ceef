//! Reads the provenance text of a finished file: lines `key=value`.

use bvh_format::Layout;
use bvh_format::header::SectionKind;
use bvh_format::source::Source;

/// The most bytes of a provenance text that are read. The texts of this baker are short.
const MAX_TEXT: usize = 1 << 20;

/// Returns the provenance text of a file; `None` if it has none, or one that is no text.
pub(crate) fn text_of<S: Source + ?Sized>(layout: &Layout, source: &S) -> Result<Option<String>, S::Error> {
    let section = layout.sections.iter().find(|section| section.kind == SectionKind::Provenance);
    let Some(section) = section else { return Ok(None) };
    let range = section.range.start..section.range.end.min(section.range.start + MAX_TEXT);
    Ok(String::from_utf8(source.read(range)?.into_owned()).ok())
}

/// Returns the value of a key in such a text.
pub(crate) fn value_of<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.lines().filter_map(|line| line.split_once('=')).find(|(k, _)| *k == key).map(|(_, value)| value)
}
