//! Input files, and their bytes in memory, that count what is read of them.

use crate::progress::{Progress, Step, Tally};
use bvh_format::checksum::Hasher;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::OnceLock;

/// Bytes that are read at a time of a file that is read whole.
const BLOCK: u64 = 4 << 20;

/// An input file from its beginning.
pub(crate) struct Input<'a> {
    file: File,
    length: u64,
    progress: &'a Progress,
    tally: Tally<'a>,
    /// Where the checksum of all bytes goes when they have been read in order, if it is asked for.
    checksum: Option<(Hasher, &'a OnceLock<u64>)>,
}

impl<'a> Input<'a> {
    /// Opens a file, whose reading is a pass of this weight.
    pub(crate) fn open(path: &Path, progress: &'a Progress, weight: u64) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let tally = progress.tally(Step::Read, weight, length, length);
        Ok(Self { file, length, progress, tally, checksum: None })
    }

    /// The same file, with a checksum of its bytes when its end has been read.
    pub(crate) fn with_checksum(self, checksum: &'a OnceLock<u64>) -> Self {
        Self { checksum: Some((Hasher::default(), checksum)), ..self }
    }

    /// Bytes of the file.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Whether it is a file as others, with an end.
    pub(crate) fn is_regular(&self) -> io::Result<bool> {
        Ok(self.file.metadata()?.is_file())
    }

    /// The rest of the file, or its next `most` bytes.
    pub(crate) fn read_up_to(&mut self, most: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(self.length.min(most) as usize)?;
        loop {
            let block = BLOCK.min(most - bytes.len() as u64);
            let count = (&self.file).take(block).read_to_end(&mut bytes)?;
            if count == 0 {
                return Ok(bytes);
            }
            self.count(count);
        }
    }

    /// The file as it is from here to its end.
    pub(crate) fn read_all(&mut self) -> io::Result<Vec<u8>> {
        self.read_up_to(u64::MAX)
    }

    fn count(&self, bytes: usize) {
        self.progress.add_input_read(bytes as u64);
        self.tally.add(bytes as u64);
    }
}

impl Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.count(count);
        if let Some((hasher, checksum)) = &mut self.checksum {
            if count > 0 {
                hasher.update(&buffer[..count]);
            } else if !buffer.is_empty() {
                // What is read again at the end changes nothing.
                checksum.get_or_init(|| hasher.finish());
            }
        }
        Ok(count)
    }
}

/// Bytes in memory; what is read of them is counted.
pub(crate) struct Watched<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) tally: &'a Tally<'a>,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.tally.add(count as u64);
        Ok(count)
    }
}
