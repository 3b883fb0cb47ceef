//! The bytes of a file, in memory or read piece by piece, and the pages and blocks among them.
//!
//! Code that reads a file through a [`Source`] works the same for bytes in memory and for a file of any size, and holds
//! only a few pages at a time.

use crate::checksum::{Hasher, checksum};
use crate::error::FormatError;
use crate::leaf::{F32_PACKET_BYTES, LINE};
use crate::object::Object;
use crate::page::{MAX_PACKETS_PER_PAGE, PAGE, Page};
use std::borrow::Cow;
use std::ops::Range;

/// Bytes per read where there are many: few enough to stay in a cache near the processor.
const CHUNK_BYTES: usize = 1 << 16;

/// The most bytes of a block that keeps the rules.
pub const MAX_BLOCK_BYTES: usize = 1 << 20;

/// The most bytes of a packed block: a head, 110 bits per packet, 65535 further slots of 16 bits, 65535 vertices of 96 bits,
/// spare bytes and the rest of a line.
const MAX_PACKED_BLOCK_BYTES: usize = 32 + MAX_PACKETS_PER_PAGE * 14 + 65535 * 2 + 65535 * 12 + 8 + LINE;
const _: () = assert!(MAX_PACKED_BLOCK_BYTES <= MAX_BLOCK_BYTES);
const _: () = assert!(MAX_PACKETS_PER_PAGE * F32_PACKET_BYTES + LINE <= MAX_BLOCK_BYTES);

/// The bytes of a file, of which several threads may read pieces at a time.
///
/// Bytes in memory are a source. So is what counts how much of them is read:
///
/// ```
/// use bvh_format::source::Source;
/// use bvh_format::{FormatError, Layout};
/// use std::borrow::Cow;
/// use std::ops::Range;
/// use std::sync::atomic::{AtomicUsize, Ordering};
///
/// struct Counted<'a>(&'a [u8], AtomicUsize);
///
/// impl Source for Counted<'_> {
///     type Error = FormatError;
///
///     fn length(&self) -> u64 {
///         self.0.len() as u64
///     }
///
///     fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, FormatError> {
///         self.1.fetch_add(range.len(), Ordering::Relaxed);
///         self.0.read(range)
///     }
/// }
/// # let bytes = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh"))?;
/// let counted = Counted(&bytes, AtomicUsize::new(0));
/// let layout = Layout::read_from(&counted)?;
/// assert_eq!(layout.objects.len(), 1);
/// assert!(counted.1.into_inner() < bytes.len()); // no page
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Source: Sync {
    /// Why a piece cannot be read, or what is wrong with the file.
    type Error: From<FormatError> + Send;

    /// The length of the file in bytes.
    fn length(&self) -> u64;

    /// Reads a range of bytes, which must lie within the length.
    ///
    /// # Errors
    /// The errors of the place where the bytes are. Memory has none.
    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, Self::Error>;
}

/// Reads bytes in memory without copying them.
impl Source for [u8] {
    type Error = FormatError;

    fn length(&self) -> u64 {
        self.len() as u64
    }

    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, FormatError> {
        Ok(Cow::Borrowed(&self[range]))
    }
}

/// Cuts a range of a file into chunks of at most 64 KiB, in order.
pub fn chunks(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let end = range.end;
    range.step_by(CHUNK_BYTES).map(move |start| start..end.min(start.saturating_add(CHUNK_BYTES)))
}

/// The bytes of a page that has not been checked.
///
/// [`validate_page`](crate::validate::validate_page) has an example.
pub struct PageBytes<'a>(Cow<'a, [u8]>);

impl<'a> PageBytes<'a> {
    pub(crate) fn new(bytes: Cow<'a, [u8]>) -> Self {
        Self(bytes)
    }

    /// Views the page as one of this object.
    pub fn page(&self, object: &Object) -> Page<'_> {
        const NONE: &[u8; PAGE] = &[0; PAGE];
        Page::new(self.0.first_chunk().unwrap_or(NONE), object.profile)
    }
}

/// A leaf block or an id block that has not been checked. If it is longer than any block that keeps the rules, this
/// holds only its first bytes, and the checksum of all. A block that does not lie within its section is empty.
///
/// [`validate_page`](crate::validate::validate_page) has an example.
pub struct Block<'a> {
    bytes: Cow<'a, [u8]>,
    /// The length and the checksum of a block that is too long.
    too_long: Option<(usize, u64)>,
}

impl<'a> Block<'a> {
    /// Takes a block in memory.
    pub fn of_bytes(bytes: &'a [u8]) -> Self {
        Self { bytes: Cow::Borrowed(bytes), too_long: None }
    }

    /// Reads a block at its place in the file; without a place it is empty.
    ///
    /// # Errors
    /// The errors of the source.
    pub(crate) fn read<S: Source + ?Sized>(
        source: &'a S,
        range: Option<Range<usize>>,
    ) -> Result<Self, S::Error> {
        let range = range.unwrap_or(0..0);
        if range.len() <= MAX_BLOCK_BYTES {
            return Ok(Self { bytes: source.read(range)?, too_long: None });
        }
        let mut hasher = Hasher::default();
        for chunk in chunks(range.clone()) {
            hasher.update(&source.read(chunk)?);
        }
        let first = source.read(range.start..range.start + PAGE)?;
        Ok(Self { bytes: first, too_long: Some((range.len(), hasher.finish())) })
    }

    /// The bytes of the block: all of them, once the block has been checked.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The length of the block in bytes.
    pub(crate) fn length(&self) -> usize {
        self.too_long.map_or(self.bytes.len(), |(length, _)| length)
    }

    /// The checksum of all bytes of the block.
    pub(crate) fn checksum(&self) -> u64 {
        self.too_long.map_or_else(|| checksum(&self.bytes), |(_, sum)| sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{ID_ENTRY_BYTES, ID_GROUP, ID_GROUP_HEAD_BITS};

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
        let bytes: Vec<u8> = (0..3 * MAX_BLOCK_BYTES).map(|i| (i.wrapping_mul(i) >> 7) as u8).collect();
        for length in [0, 100, MAX_BLOCK_BYTES, MAX_BLOCK_BYTES + 1, bytes.len() - 9] {
            let whole = &bytes[9..9 + length];
            let block = Block::read(&bytes[..], Some(9..9 + length)).unwrap();
            assert_eq!((block.length(), block.checksum()), (length, checksum(whole)));
            assert!(whole.starts_with(block.bytes()) && block.bytes().len() <= MAX_BLOCK_BYTES);
        }
        // Of each packet, the least id, the lane that has it, and three offsets, all as wide as can be.
        let groups = MAX_PACKETS_PER_PAGE.div_ceil(ID_GROUP);
        let group_bits = ID_GROUP_HEAD_BITS + ID_GROUP * (32 + 2 + 3 * 32);
        let bytes = groups * (ID_ENTRY_BYTES + group_bits.div_ceil(8));
        assert!(bytes <= usize::from(u16::MAX) && bytes + 16 <= MAX_BLOCK_BYTES);
    }
}
