//! Opens input files, which can be read from the beginning any number of times, and counts their bytes as they are
//! read.

use super::byte_reader::ByteReader;
use super::head::{HEAD_BYTES, misnamed};
use super::read_ahead::{BLOCK, ReadAhead};
use super::warnings::Warnings;
use super::{MeshFormat, UpAxis};
use crate::error::{Halt, ReadError};
use crate::options::Options;
use crate::progress::{Progress, Step};
use crate::storage::read_exact_at;
use crate::storage::resources::Allowance;
use bvh_format::checksum::Hasher;
use std::borrow::Cow;
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::sync::OnceLock;
use std::thread::Scope;

/// The number of bytes that are read at a time if a file is read as a whole.
const READ_BYTES: u64 = 4 << 20;
/// The number of bytes that are read at a time for a checksum.
const CHECKSUM_BYTES: usize = 1 << 18;

/// An input with a known format.
pub(crate) struct InputFile<'a> {
    path: Cow<'a, Path>,
    format: MeshFormat,
    length: u64,
    /// Whether the nodes of a glTF or COLLADA file become instances.
    as_scene: bool,
    up_axis: UpAxis,
    /// Whether a glTF file may name files outside its folder.
    allows_outside: bool,
    /// Whether points without a position are left out.
    drops_nan: bool,
    /// The bytes if they are in memory. The bytes of a pipe always are, because a pipe can be read only once.
    bytes: Option<Cow<'a, [u8]>>,
    warnings: Warnings,
}

impl<'a> InputFile<'a> {
    /// Makes an input of the bytes of a file. `path` names it in errors.
    pub(crate) fn of_bytes(bytes: &'a [u8], format: MeshFormat, path: &'a Path) -> Self {
        let length = bytes.len() as u64;
        let bytes = Some(Cow::Borrowed(bytes));
        Self::new(path, format, length, bytes)
    }

    fn new(path: &'a Path, format: MeshFormat, length: u64, bytes: Option<Cow<'a, [u8]>>) -> Self {
        let (path, up_axis, warnings) = (Cow::Borrowed(path), UpAxis::default(), Warnings::default());
        let (as_scene, allows_outside, drops_nan) = (false, false, false);
        Self { path, format, length, as_scene, up_axis, allows_outside, drops_nan, bytes, warnings }
    }

    /// Sets whether the nodes of a glTF or COLLADA file become instances.
    pub(crate) fn for_scene(self, as_scene: bool) -> Self {
        Self { as_scene, ..self }
    }

    pub(crate) fn is_scene(&self) -> bool {
        self.as_scene
    }

    /// Sets what to do with the axis that a COLLADA file declares to point up.
    pub(crate) fn with_up_axis(self, up_axis: UpAxis) -> Self {
        Self { up_axis, ..self }
    }

    pub(crate) fn up_axis(&self) -> UpAxis {
        self.up_axis
    }

    /// Applies the options that concern reading.
    pub(crate) fn with_options(self, options: &Options) -> Self {
        self.for_scene(options.scene).drop_nan(options.drop_nan)
    }

    /// Sets whether points without a position are left out: those with a coordinate that is NaN or infinite.
    pub(crate) fn drop_nan(self, drops_nan: bool) -> Self {
        Self { drops_nan, ..self }
    }

    pub(crate) fn drops_nan(&self) -> bool {
        self.drops_nan
    }

    /// Sets whether a glTF file may name files outside its folder.
    pub(crate) fn allow_outside(self, allows_outside: bool) -> Self {
        Self { allows_outside, ..self }
    }

    pub(crate) fn allows_outside(&self) -> bool {
        self.allows_outside
    }

    /// Finds a file. The format is that of its extension or, if the extension is unknown or missing, the one that its
    /// content suggests. A pipe or another file without a length is read as a whole, which `memory` must allow.
    pub(crate) fn find(path: &'a Path, memory: Allowance, progress: &Progress) -> Result<Self, Halt> {
        let failed = |source| ReadError::Io { path: path.to_owned(), source };
        let mut reader = InputReader::open(path, progress).map_err(failed)?;
        let is_regular = reader.is_regular().map_err(failed)?;
        let bytes = match is_regular {
            true => None,
            false => Some(reader.read_up_to(memory.free.saturating_add(1)).map_err(failed)?),
        };
        memory.require(bytes.as_ref().map_or(0, |bytes| bytes.len() as u64))?;
        let length = bytes.as_ref().map_or(reader.length, |bytes| bytes.len() as u64);
        let format = match (MeshFormat::from_extension(path), &bytes) {
            (Some(format), _) => format,
            (None, Some(bytes)) => MeshFormat::of_file(path, bytes)?,
            (None, None) => {
                let head = reader.read_up_to(HEAD_BYTES as u64).map_err(failed)?;
                MeshFormat::of_head(path, &head, length)?
            }
        };
        let bytes = bytes.map(Cow::Owned);
        Ok(Self::new(path, format, length, bytes))
    }

    /// Returns where its reader puts warnings.
    pub(crate) fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn format(&self) -> MeshFormat {
        self.format
    }

    /// Returns the number of bytes.
    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// Returns the bytes of memory that the input takes before it is read.
    pub(crate) fn bytes_in_memory(&self) -> u64 {
        if matches!(self.bytes, Some(Cow::Owned(_))) { self.length } else { 0 }
    }

    /// Starts to read the bytes.
    fn reader<'r>(&'r self, progress: &'r Progress) -> io::Result<InputReader<'r>> {
        match &self.bytes {
            None => InputReader::open(&self.path, progress),
            Some(bytes) => {
                let source = Source::Memory(bytes);
                Ok(InputReader { source, length: self.length, progress, checksum: None })
            }
        }
    }

    /// Returns all bytes.
    pub(crate) fn read_all(&self, progress: &Progress) -> Result<Cow<'_, [u8]>, ReadError> {
        if let Some(bytes) = &self.bytes {
            return Ok(Cow::Borrowed(bytes));
        }
        let bytes = self.reader(progress).and_then(|mut reader| reader.read_up_to(u64::MAX));
        bytes.map(Cow::Owned).map_err(|source| self.failed(source))
    }

    /// Opens the input, to read it at stated offsets.
    pub(crate) fn random_access(&self) -> Result<RandomAccess<'_>, ReadError> {
        match &self.bytes {
            Some(bytes) => Ok(RandomAccess::Memory(bytes)),
            None => {
                let open = || {
                    let file = File::open(&self.path)?;
                    let length = file.metadata()?.len();
                    Ok(RandomAccess::File { file, length })
                };
                open().map_err(|source| self.failed(source))
            }
        }
    }

    /// Refuses a file whose first bytes show that it holds no mesh of its format. Files that are read in order are looked at when
    /// they are opened.
    pub(crate) fn look(&self, progress: &Progress) -> Result<(), Halt> {
        let access = self.random_access()?;
        let mut head = vec![0; access.length().min(HEAD_BYTES as u64) as usize];
        access.read_at(&mut head, 0, progress).map_err(Halt::Io)?;
        match misnamed(&head, access.length(), Some(self.format)) {
            Some(fault) => Err(fault.into()),
            None => Ok(()),
        }
    }

    /// Returns the checksum of all bytes.
    pub(crate) fn checksum(&self, progress: &Progress) -> Result<u64, ReadError> {
        let mut hasher = Hasher::default();
        let mut block = vec![0; CHECKSUM_BYTES];
        let mut reader = self.reader(progress).map_err(|source| self.failed(source))?;
        loop {
            match reader.read(&mut block) {
                Ok(0) => return Ok(hasher.finish()),
                Ok(count) => hasher.update(&block[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(self.failed(error)),
            }
        }
    }

    /// Returns the error for an input that the system refused to read.
    pub(crate) fn failed(&self, source: io::Error) -> ReadError {
        ReadError::Io { path: self.path.clone().into_owned(), source }
    }
}

/// An input that is read at stated offsets.
pub(crate) enum RandomAccess<'a> {
    Memory(&'a [u8]),
    File { file: File, length: u64 },
}

impl RandomAccess<'_> {
    /// Returns the number of bytes.
    pub(crate) fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }

    /// Reads bytes from an offset on.
    pub(crate) fn read_at(&self, into: &mut [u8], offset: u64, progress: &Progress) -> io::Result<()> {
        match self {
            Self::Memory(bytes) => {
                let rest = bytes.get(offset as usize..).unwrap_or_default();
                let found = rest.get(..into.len()).ok_or(ErrorKind::UnexpectedEof)?;
                into.copy_from_slice(found);
                Ok(())
            }
            Self::File { file, .. } => {
                progress.go_on_with_io()?;
                progress.add_input_read(into.len() as u64);
                read_exact_at(file, into, offset)
            }
        }
    }
}

/// Opens an input at its beginning, any number of times. Where there are threads, one of its own reads ahead, unless there
/// is only one block to read.
pub(crate) struct Opener<'scope, 'env> {
    pub(crate) input: &'env InputFile<'env>,
    pub(crate) progress: &'env Progress,
    /// The checksum of all bytes, once a reader has come to the end.
    pub(crate) checksum: &'env OnceLock<u64>,
    pub(crate) scope: &'scope Scope<'scope, 'env>,
}

impl<'scope, 'env> Opener<'scope, 'env> {
    /// Opens the input.
    pub(crate) fn open(&self) -> Result<ByteReader<impl Read + use<'scope, 'env>>, Halt> {
        let mut reader = self.input.reader(self.progress).map_err(Halt::Io)?;
        reader.checksum = Some((Hasher::default(), self.checksum));
        let length = reader.length;
        let reader: Box<dyn Read + Send + 'scope> = if cfg!(target_family = "wasm") || length <= BLOCK as u64
        {
            Box::new(reader)
        } else {
            Box::new(ReadAhead::start(self.scope, reader))
        };
        let mut reader = ByteReader::new(reader, length);
        match misnamed(reader.peek(HEAD_BYTES), length, Some(self.input.format)) {
            Some(fault) => Err(fault.into()),
            None => Ok(reader),
        }
    }
}

/// Reads an input once, from its beginning.
pub(crate) struct InputReader<'a> {
    source: Source<'a>,
    length: u64,
    progress: &'a Progress,
    /// The hasher, and where the checksum goes when all bytes have been read in order; `None` if nobody needs it.
    checksum: Option<(Hasher, &'a OnceLock<u64>)>,
}

enum Source<'a> {
    File(File),
    /// The bytes that have not been read yet.
    Memory(&'a [u8]),
}

impl<'a> InputReader<'a> {
    /// Opens a file.
    pub(crate) fn open(path: &Path, progress: &'a Progress) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { source: Source::File(file), length, progress, checksum: None })
    }

    /// Returns whether this is a regular file, which has an end.
    pub(crate) fn is_regular(&self) -> io::Result<bool> {
        match &self.source {
            Source::File(file) => Ok(file.metadata()?.is_file()),
            Source::Memory(_) => Ok(true),
        }
    }

    /// Returns the remaining bytes, at most `most` of them.
    pub(crate) fn read_up_to(&mut self, most: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(self.length.min(most) as usize)?;
        loop {
            let block = READ_BYTES.min(most - bytes.len() as u64);
            let count = self.by_ref().take(block).read_to_end(&mut bytes)?;
            if count == 0 {
                return Ok(bytes);
            }
        }
    }
}

impl Read for InputReader<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.progress.go_on_with_io()?;
        let count = match &mut self.source {
            Source::File(file) => {
                let count = file.read(buffer)?;
                self.progress.add_input_read(count as u64);
                count
            }
            Source::Memory(rest) => rest.read(buffer)?,
        };
        self.progress.add(Step::Read, count as u64);
        if let Some((hasher, checksum)) = &mut self.checksum {
            if count > 0 {
                hasher.update(&buffer[..count]);
            } else if !buffer.is_empty() {
                // Another read at the end does not change the checksum.
                checksum.get_or_init(|| hasher.finish());
            }
        }
        Ok(count)
    }
}
