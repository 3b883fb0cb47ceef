//! The files that a page embeds, each once, whichever shapes use it.

use crate::json::is_false;
use crate::{MAX_FILE_BYTES, PageError};
use bvh_query::{OwnedShape, QueryError};
use serde::Serialize;
use std::collections::HashMap;
use std::ptr;

/// A shape, and what its file is called.
///
/// ```
/// use cbvh_view::{Named, Page};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let size = block.bytes().len() as u64;
/// let page = Page::file(Named { name: "Block".into(), path: "parts/block.cbvh".into(), shape: block.into() })?;
/// assert_eq!(page.bytes(), size);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Named {
    /// The name that people read.
    pub name: String,
    /// The path as the user gave it.
    pub path: String,
    /// The shape: all objects of a file, or one.
    pub shape: OwnedShape,
}

/// A file of the page.
#[derive(Clone, Debug)]
pub(crate) struct File {
    name: String,
    path: String,
    /// All of the file, with the radius and the solidity that the bytes in the page state.
    pub(crate) shape: OwnedShape,
    bytes: u64,
}

/// What the page says about a file.
#[derive(Serialize)]
pub(crate) struct Entry<'a> {
    name: &'a str,
    path: &'a str,
    /// The bytes of the file before they are packed.
    bytes: u64,
    /// What is shown of the file, if that is not all of it.
    #[serde(flatten)]
    part: Part,
}

/// Which part of a file a shape is, apart from what the bytes of the file state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct Part {
    /// The number of one object of several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) object: Option<usize>,
    /// Whether the shape is solid although its file does not say so.
    #[serde(skip_serializing_if = "is_false")]
    pub(crate) solid: bool,
}

/// What files must have in common to be the same: the checksum of the content, the length, the radius and the solidity.
type Key = (u64, usize, u64, bool);

/// The files of a page.
#[derive(Debug, Default)]
pub(crate) struct Files {
    pub(crate) list: Vec<File>,
    /// The numbers of the files with a key. Checksums may agree by chance.
    by_key: HashMap<Key, Vec<usize>>,
}

impl Files {
    /// Finds or adds the file of a shape. Returns its number, and which part of it the shape is.
    pub(crate) fn add(&mut self, named: Named) -> Result<(usize, Part), PageError> {
        let Named { name, path, shape } = named;
        let (whole, part) = whole_and_part(&shape)?;
        let bytes = whole.bvh().bytes();
        let of_whole = whole.shape();
        let checksum = whole.bvh().layout().content_checksum;
        let key = (checksum, bytes.len(), of_whole.radius().to_bits(), of_whole.is_solid());
        let is_same = |&&number: &&usize| {
            let other = self.list[number].shape.bvh().bytes();
            ptr::eq(other, bytes) || other == bytes
        };
        if let Some(&number) = self.by_key.get(&key).and_then(|numbers| numbers.iter().find(is_same)) {
            return Ok((number, part));
        }
        // A copy that states another radius may be longer.
        let bytes = whole.bytes()?.len() as u64;
        if bytes > MAX_FILE_BYTES {
            return Err(PageError::FileTooLarge { name, found: bytes });
        }
        let number = self.list.len();
        self.list.push(File { name, path, shape: whole, bytes });
        self.by_key.entry(key).or_default().push(number);
        Ok((number, part))
    }

    /// Adds a file again under another name or the same one. The page then has it twice.
    pub(crate) fn repeat(&mut self, number: usize, name: String, path: String) {
        let again = self.list.get(number).map(|file| File { name, path, ..file.clone() });
        self.list.extend(again);
    }

    /// Returns the bytes of all files before they are packed.
    pub(crate) fn bytes(&self) -> u64 {
        self.list.iter().map(|file| file.bytes).sum()
    }
}

impl File {
    /// Returns whether the file is called this.
    pub(crate) fn is_called(&self, name: &str, path: &str) -> bool {
        self.name == name && self.path == path
    }

    /// Returns what the page says about the file.
    pub(crate) fn entry(&self, part: Part) -> Entry<'_> {
        Entry { name: &self.name, path: &self.path, bytes: self.bytes, part }
    }
}

/// Returns the shape of all of a file, and which part of that a shape is.
fn whole_and_part(shape: &OwnedShape) -> Result<(OwnedShape, Part), QueryError> {
    let of_shape = shape.shape();
    let numbers = of_shape.object_numbers();
    if numbers.len() == shape.bvh().objects().len() {
        // The file may state what the shape is.
        return Ok((shape.clone(), Part::default()));
    }
    let whole = OwnedShape::from(shape.bvh().clone());
    let is_solid = whole.shape().is_solid();
    let part = Part { object: Some(numbers.start), solid: of_shape.is_solid() && !is_solid };
    let same_radius = whole.shape().radius() == of_shape.radius();
    Ok((if same_radius { whole } else { whole.rounded(of_shape.radius())? }, part))
}
