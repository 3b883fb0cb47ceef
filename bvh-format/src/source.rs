//! The bytes of a file, in memory or read piece by piece: pages, and the blocks that belong to them.
//!
//! What goes through a file by way of a [`Source`] does the same to bytes in memory and to a file of any size, and holds
//! a few pages of it at a time.

use crate::checksum::{Hasher, checksum};
use crate::error::FormatError;
use crate::layout::Layout;
use crate::leaf::{F32_PACKET_BYTES, LINE};
use crate::object::Object;
use crate::page::{PAGE, Page, PageHeader};
use crate::rule::Rule;
use std::borrow::Cow;
use std::ops::Range;

/// Bytes that are read at a time where there are many: they stay in a cache near the processor.
pub const CHUNK_BYTES: usize = 1 << 16;

/// No block that keeps the rules is longer.
const MOST_BLOCK_BYTES: usize = 1 << 20;

/// By rule 17 a page has at most 62 treelets, of 8 children.
const MOST_PACKETS: usize = 62 * 8;
/// A head, 65535 vertices of 96 bits, 12 indices of 16 bits a packet, the spare bytes and the rest of a line.
const MOST_PACKED_BYTES: usize = 32 + 65535 * 12 + MOST_PACKETS * 24 + 2 * 8 + LINE;
const _: () = assert!(MOST_PACKED_BYTES <= MOST_BLOCK_BYTES);
const _: () = assert!(MOST_PACKETS * F32_PACKET_BYTES + LINE <= MOST_BLOCK_BYTES);

/// The bytes of a file, from which pieces are read, by several threads at a time.
pub trait Source: Sync {
    /// Why a piece may not be there, or what is wrong with the file.
    type Error: From<FormatError> + Send;

    /// Bytes of the file.
    fn length(&self) -> u64;

    /// A range within the length.
    ///
    /// # Errors
    /// Those of where the bytes are; memory has none.
    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, Self::Error>;
}

/// Bytes in memory, which are not copied.
impl Source for [u8] {
    type Error = FormatError;

    fn length(&self) -> u64 {
        self.len() as u64
    }

    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, FormatError> {
        Ok(Cow::Borrowed(&self[range]))
    }
}

/// A range of a file in chunks of at most [`CHUNK_BYTES`], the first of which begins where the range does.
pub fn chunks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range.step_by(CHUNK_BYTES).map(move |start| start..end.min(start.saturating_add(CHUNK_BYTES)))
}

/// The bytes of a page, not checked.
pub struct PageBytes<'a>(Cow<'a, [u8]>);

impl PageBytes<'_> {
    /// The page, as of an object of this profile.
    pub fn page(&self, object: &Object) -> Page<'_> {
        const NONE: &[u8; PAGE] = &[0; PAGE];
        Page::new(self.0.first_chunk().unwrap_or(NONE), object.profile)
    }
}

/// A leaf block or an id block, not checked: all its bytes, or, if it is longer than any may be, the first of them and
/// the checksum of all. One that is not within its section is empty.
pub struct Block<'a> {
    bytes: Cow<'a, [u8]>,
    /// Length and checksum of one that is too long.
    beyond: Option<(usize, u64)>,
}

impl<'a> Block<'a> {
    /// A block in memory.
    pub fn of_bytes(bytes: &'a [u8]) -> Self {
        Self { bytes: Cow::Borrowed(bytes), beyond: None }
    }

    fn read<S: Source + ?Sized>(source: &'a S, range: Option<Range<usize>>) -> Result<Self, S::Error> {
        let range = range.unwrap_or(0..0);
        if range.len() <= MOST_BLOCK_BYTES {
            return Ok(Self { bytes: source.read(range)?, beyond: None });
        }
        let mut hasher = Hasher::default();
        for chunk in chunks(range.clone()) {
            hasher.update(&source.read(chunk)?);
        }
        let first = source.read(range.start..range.start + PAGE)?;
        Ok(Self { bytes: first, beyond: Some((range.len(), hasher.finish())) })
    }

    /// The bytes: all those of a block that has been checked.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Bytes of the block.
    pub(crate) fn length(&self) -> usize {
        self.beyond.map_or(self.bytes.len(), |(length, _)| length)
    }

    /// The checksum of all its bytes.
    pub(crate) fn checksum(&self) -> u64 {
        self.beyond.map_or_else(|| checksum(&self.bytes), |(_, sum)| sum)
    }
}

impl Layout {
    /// Reads a page.
    ///
    /// # Errors
    /// Rule 13 beyond the last page, and those of the source.
    pub fn read_page<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        number: u32,
    ) -> Result<PageBytes<'a>, S::Error> {
        let at = self.page_offset(number);
        let range = self
            .page_range(number)
            .ok_or_else(|| FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section"))?;
        Ok(PageBytes(source.read(range)?))
    }

    /// Reads the leaf block of a page; empty if the page's header is nonsense.
    ///
    /// # Errors
    /// Those of the source.
    pub fn read_leaf_block<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        header: &PageHeader,
    ) -> Result<Block<'a>, S::Error> {
        Block::read(source, self.leaf_range(header))
    }

    /// Reads the id block of a page, empty without ids.
    ///
    /// # Errors
    /// Those of the source.
    pub fn read_id_block<'a, S: Source + ?Sized>(
        &self,
        source: &'a S,
        header: &PageHeader,
    ) -> Result<Block<'a>, S::Error> {
        Block::read(source, self.id_range(header))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::id_block_bytes;

    #[test]
    fn chunks_cover_a_range() {
        for length in [0, 1, CHUNK_BYTES - 1, CHUNK_BYTES, 3 * CHUNK_BYTES + 7] {
            let mut end = 5;
            for chunk in chunks(5..5 + length) {
                assert_eq!(chunk.start, end);
                assert!((1..=CHUNK_BYTES).contains(&chunk.len()));
                end = chunk.end;
            }
            assert_eq!(end, 5 + length);
        }
    }

    #[test]
    fn a_block_too_long_for_any_is_known_by_length_and_checksum() {
        let bytes: Vec<u8> = (0..3 * MOST_BLOCK_BYTES).map(|i| ((i * i) >> 7) as u8).collect();
        for length in [0, 100, MOST_BLOCK_BYTES, MOST_BLOCK_BYTES + 1, bytes.len() - 9] {
            let whole = &bytes[9..9 + length];
            let block = Block::read(&bytes[..], Some(9..9 + length)).unwrap();
            assert_eq!((block.length(), block.checksum()), (length, checksum(whole)));
            assert!(whole.starts_with(block.bytes()) && block.bytes().len() <= MOST_BLOCK_BYTES);
        }
        assert!(id_block_bytes(MOST_PACKETS, u8::MAX) <= MOST_BLOCK_BYTES);
    }
}
