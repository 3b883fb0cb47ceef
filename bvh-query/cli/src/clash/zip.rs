//! Writes a ZIP archive whose entries are stored as they are: no reader needs more for small texts, and the bytes depend on
//! nothing else (APPNOTE 6.3.10, sections 4.3.7, 4.3.12 and 4.3.16).

/// The most entries of an archive without ZIP64.
pub(super) const MAX_ENTRIES: usize = u16::MAX as usize;

/// An archive that is being written.
#[derive(Default)]
pub(super) struct Archive {
    bytes: Vec<u8>,
    /// The directory, which follows the entries.
    directory: Vec<u8>,
    entries: u16,
}

/// Midnight on the first of January 1980, the earliest time that the format knows.
const TIME_AND_DATE: [u8; 4] = [0, 0, 0x21, 0];
/// What is needed to read an entry: version 2.0, the first one with folders, UTF-8 names, no compression.
const VERSION: [u8; 2] = [20, 0];
const FLAGS_AND_METHOD: [u8; 4] = [0, 8, 0, 0];

impl Archive {
    /// Adds a file, or a folder, whose name ends with a slash and whose content is empty. There are at most [`MAX_ENTRIES`].
    pub(super) fn add(&mut self, name: &str, content: &[u8]) {
        let offset = (self.bytes.len() as u32).to_le_bytes();
        let length = (content.len() as u32).to_le_bytes();
        let name_length = (name.len() as u16).to_le_bytes();
        let mut crc = flate2::Crc::new();
        crc.update(content);
        let both = [
            &FLAGS_AND_METHOD[..],
            &TIME_AND_DATE,
            &crc.sum().to_le_bytes(),
            &length,
            &length,
            &name_length,
            // No extra field.
            &[0; 2],
        ]
        .concat();
        self.bytes.extend([b"PK\x03\x04", &VERSION[..], &both, name.as_bytes(), content].concat());
        // No comment, the first disk, and no attributes.
        let rest = [&[0; 10][..], &offset, name.as_bytes()].concat();
        self.directory.extend([b"PK\x01\x02", &VERSION[..], &VERSION, &both, &rest].concat());
        self.entries += 1;
    }

    /// Returns the bytes of the archive, or `None` if its offsets exceed 32 bits.
    pub(super) fn finish(mut self) -> Option<Vec<u8>> {
        let start = u32::try_from(self.bytes.len()).ok()?.to_le_bytes();
        let length = u32::try_from(self.directory.len()).ok()?.to_le_bytes();
        let entries = self.entries.to_le_bytes();
        self.bytes.append(&mut self.directory);
        // One disk, and no comment.
        self.bytes
            .extend([b"PK\x05\x06", &[0; 4][..], &entries, &entries, &length, &start, &[0; 2]].concat());
        Some(self.bytes)
    }
}
