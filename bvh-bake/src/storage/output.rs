//! Takes the bytes of an output and lets the proof read them again, in memory or as a file without its final name.
//!
//! If the bytes of the file fit in memory, a thread writes them and waits for the medium while the proof reads the
//! bytes in memory. With a memory budget, the bytes are written at once, and the proof reads them back from the system
//! while a thread waits for the medium. A small file is proved faster than a thread is started, and goes without one.
//!
//! Neither way proves what the medium stores: until the system needs the memory, it returns the bytes that it was
//! given.

use crate::error::BakeError;
use crate::progress::{Progress, Stage, Step};
use crate::storage::atomic::{Temporary, failed};
use crate::storage::{read_exact_at, write_all_at};
use bvh_format::source::Source;
use std::borrow::Cow;
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// The least number of bytes of a file for which a thread is started.
const MIN_THREAD_BYTES: u64 = 1 << 20;

/// Bytes that are written from the first to the last.
pub(crate) enum Output {
    Memory { bytes: Vec<u8>, progress: Progress },
    File(OutputFile),
}

/// A new file that gets its name when it is complete.
pub(crate) struct OutputFile {
    /// Before `file`, which removes what has not got its final name.
    writer: Option<Writer>,
    file: Temporary,
    /// The final name.
    path: PathBuf,
    length: u64,
    progress: Progress,
    /// The bytes, or `None` if they do not stay in memory.
    kept: Option<Pieces>,
}

impl Output {
    /// Keeps the bytes in memory. They are not counted.
    pub(crate) fn in_memory(progress: &Progress) -> Self {
        Self::Memory { bytes: Vec::new(), progress: progress.clone() }
    }

    /// Creates a file beside `path` whose bytes are read back from the system. Bytes written and read are counted.
    pub(crate) fn beside(path: &Path, progress: &Progress) -> Result<Self, BakeError> {
        let (file, path, progress) = (Temporary::beside(path)?, path.to_owned(), progress.clone());
        Ok(Self::File(OutputFile { writer: None, file, path, length: 0, progress, kept: None }))
    }

    /// Creates a file beside `path` whose bytes stay in memory until they are proved. Bytes written are counted.
    pub(crate) fn kept_beside(path: &Path, progress: &Progress) -> Result<Self, BakeError> {
        let mut output = Self::beside(path, progress)?;
        if let Self::File(file) = &mut output {
            file.kept = Some(Pieces::default());
        }
        Ok(output)
    }

    /// Returns the number of bytes written.
    pub(crate) fn length(&self) -> u64 {
        match self {
            Self::Memory { bytes, .. } => bytes.len() as u64,
            Self::File(file) => file.length,
        }
    }

    /// Reserves room for the given number of bytes, and expects them as the work of [`Stage::Encode`].
    pub(crate) fn expect(&mut self, length: u64) {
        match self {
            Self::Memory { bytes, .. } => {
                bytes.reserve_exact((length as usize).saturating_sub(bytes.len()));
            }
            Self::File(file) => file.progress.expect(Step::Bake(Stage::Encode), length),
        }
    }

    /// Adds bytes at the end.
    pub(crate) fn append(&mut self, bytes: Arc<Vec<u8>>) -> Result<(), BakeError> {
        match self {
            Self::Memory { bytes: all, progress } => {
                progress.go_on()?;
                all.extend_from_slice(&bytes);
            }
            Self::File(file) => {
                file.progress.go_on()?;
                let at = file.length;
                file.length += bytes.len() as u64;
                if let Some(kept) = &mut file.kept {
                    kept.push(bytes.clone());
                    file.start_writer()?;
                }
                file.write(at, bytes)?;
            }
        }
        Ok(())
    }

    /// Replaces the first bytes, after all others have been added, and starts writing to the medium.
    pub(crate) fn replace_first(&mut self, bytes: Vec<u8>) -> Result<(), BakeError> {
        match self {
            Self::Memory { bytes: all, .. } => all[..bytes.len()].copy_from_slice(&bytes),
            Self::File(file) => {
                let bytes = Arc::new(bytes);
                if let Some(kept) = &mut file.kept {
                    kept.replace_first(&bytes);
                }
                file.write(0, bytes)?;
                file.start_writer()?;
                file.writer.iter_mut().for_each(Writer::close);
            }
        }
        Ok(())
    }

    /// Waits until the whole file is on the medium, and gives it its final name.
    pub(crate) fn rename(self) -> Result<(), BakeError> {
        match self {
            Self::Memory { .. } => Ok(()),
            Self::File(OutputFile { file, path, writer, progress, .. }) => {
                if let Some(writer) = writer {
                    writer.finish().map_err(failed(&path, "write"))?;
                }
                progress.go_on()?;
                file.rename(&path)
            }
        }
    }

    /// Returns a source that reads the written bytes.
    pub(crate) fn source(&self) -> OutputSource<'_> {
        match self {
            Self::Memory { bytes, progress } => OutputSource::Memory(bytes, progress),
            Self::File(OutputFile { kept: Some(pieces), progress, .. }) => {
                OutputSource::Kept(pieces, progress)
            }
            Self::File(OutputFile { file, path, length, progress, .. }) => {
                OutputSource::File { file: file.file(), path, length: *length, progress }
            }
        }
    }
}

impl OutputFile {
    /// Starts the thread that writes, unless it runs or the file is small. Where there are no threads, bytes are written as
    /// they come.
    fn start_writer(&mut self) -> Result<(), BakeError> {
        if self.writer.is_none() && self.length >= MIN_THREAD_BYTES {
            self.writer = match Writer::start(self.file.file(), &self.progress) {
                Err(error) if error.kind() == io::ErrorKind::Unsupported => None,
                started => Some(started.map_err(failed(&self.path, "create"))?),
            };
        }
        Ok(())
    }

    /// Writes bytes at an offset, or passes them to the writer thread.
    fn write(&self, at: u64, bytes: Arc<Vec<u8>>) -> Result<(), BakeError> {
        self.progress.add_output_written(bytes.len() as u64);
        self.progress.add(Step::Bake(Stage::Encode), bytes.len() as u64);
        match &self.writer {
            Some(writer) => {
                writer.write(at, bytes);
                Ok(())
            }
            None => write_all_at(self.file.file(), &bytes, at).map_err(failed(&self.path, "write")),
        }
    }
}

/// A thread that writes to a file and then waits for the medium. If it is dropped before it has finished, nobody needs the file.
struct Writer {
    /// Bytes and their offset, or `None` after the last bytes.
    sender: Option<Sender<(u64, Arc<Vec<u8>>)>>,
    /// `None` once it has been waited for.
    thread: Option<JoinHandle<io::Result<()>>>,
    is_dropped: Arc<AtomicBool>,
}

impl Writer {
    fn start(file: &File, progress: &Progress) -> io::Result<Self> {
        let (file, progress) = (file.try_clone()?, progress.clone());
        let (sender, receiver) = channel();
        let is_dropped = Arc::new(AtomicBool::new(false));
        let thread = thread::Builder::new().name("output".into()).spawn({
            let is_dropped = is_dropped.clone();
            move || write_all(&file, receiver, &progress, &is_dropped)
        })?;
        Ok(Self { sender: Some(sender), thread: Some(thread), is_dropped })
    }

    /// Passes bytes to the thread. If it has ended, `finish` returns the reason.
    fn write(&self, at: u64, bytes: Arc<Vec<u8>>) {
        if let Some(sender) = &self.sender {
            let _ = sender.send((at, bytes));
        }
    }

    /// Tells the thread that there are no more bytes.
    fn close(&mut self) {
        self.sender = None;
    }

    /// Waits until all is written and on the medium.
    fn finish(mut self) -> io::Result<()> {
        self.close();
        self.join()
    }

    fn join(&mut self) -> io::Result<()> {
        let Some(thread) = self.thread.take() else { return Ok(()) };
        thread.join().unwrap_or_else(|_| Err(io::Error::other("the thread that writes has failed")))
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        self.is_dropped.store(true, Ordering::Relaxed);
        self.close();
        // Windows may keep the name of a removed file until nobody has it open. Elsewhere nobody waits for the medium.
        if cfg!(windows) {
            let _ = self.join();
        }
    }
}

fn write_all(
    file: &File,
    receiver: Receiver<(u64, Arc<Vec<u8>>)>,
    progress: &Progress,
    is_dropped: &AtomicBool,
) -> io::Result<()> {
    for (at, bytes) in receiver {
        progress.go_on_with_io()?;
        if is_dropped.load(Ordering::Relaxed) {
            return Ok(());
        }
        write_all_at(file, &bytes, at)?;
    }
    if is_dropped.load(Ordering::Relaxed) { Ok(()) } else { file.sync_data() }
}

/// Bytes in memory, piece by piece.
#[derive(Default)]
pub(crate) struct Pieces {
    pieces: Vec<Arc<Vec<u8>>>,
    /// The offset at which each piece ends.
    ends: Vec<usize>,
}

impl Pieces {
    fn length(&self) -> usize {
        self.ends.last().copied().unwrap_or_default()
    }

    fn push(&mut self, bytes: Arc<Vec<u8>>) {
        if !bytes.is_empty() {
            self.ends.push(self.length() + bytes.len());
            self.pieces.push(bytes);
        }
    }

    /// Replaces the beginning of the first piece.
    fn replace_first(&mut self, bytes: &[u8]) {
        if let Some(first) = self.pieces.first_mut() {
            let mut changed = first.to_vec();
            changed[..bytes.len()].copy_from_slice(bytes);
            *first = Arc::new(changed);
        }
    }

    /// Returns the bytes of a range. A range within one piece is not copied.
    fn read(&self, range: Range<usize>) -> Cow<'_, [u8]> {
        let mut piece = self.ends.partition_point(|&end| end <= range.start);
        let start = |piece: usize| if piece == 0 { 0 } else { self.ends[piece - 1] };
        if let Some(&end) = self.ends.get(piece)
            && range.end <= end
        {
            let start = start(piece);
            return Cow::Borrowed(&self.pieces[piece][range.start - start..range.end - start]);
        }
        let mut bytes = Vec::with_capacity(range.len());
        while bytes.len() < range.len() {
            let (start, from) = (start(piece), range.start + bytes.len());
            let end = self.ends[piece].min(range.end);
            bytes.extend_from_slice(&self.pieces[piece][from - start..end - start]);
            piece += 1;
        }
        Cow::Owned(bytes)
    }
}

/// The bytes of a file, read piece by piece.
#[derive(Clone, Copy)]
pub(crate) enum OutputSource<'a> {
    Memory(&'a [u8], &'a Progress),
    Kept(&'a Pieces, &'a Progress),
    File { file: &'a File, path: &'a Path, length: u64, progress: &'a Progress },
}

impl Source for OutputSource<'_> {
    type Error = BakeError;

    fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes, _) => bytes.len() as u64,
            Self::Kept(pieces, _) => pieces.length() as u64,
            Self::File { length, .. } => *length,
        }
    }

    fn read(&self, range: Range<usize>) -> Result<Cow<'_, [u8]>, BakeError> {
        let (Self::Memory(_, progress) | Self::Kept(_, progress) | Self::File { progress, .. }) = self;
        progress.go_on()?;
        match self {
            Self::Memory(bytes, _) => Ok(Cow::Borrowed(&bytes[range])),
            Self::Kept(pieces, _) => Ok(pieces.read(range)),
            Self::File { file, path, .. } => {
                progress.add_output_read(range.len() as u64);
                let mut bytes = vec![0; range.len()];
                read_exact_at(file, &mut bytes, range.start as u64)
                    .map_err(failed(path, "read back what was written to"))?;
                Ok(Cow::Owned(bytes))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_what_is_written() {
        let directory = cbvh_testkit::folder();
        let path = directory.path().join("out");
        for (keep, length) in [(false, 20_000), (true, 20_000), (false, 2 << 20), (true, 2 << 20)] {
            let mut expected: Vec<u8> = (0..length).map(|i: u32| (i.wrapping_mul(i) >> 5) as u8).collect();
            let length = expected.len();
            let progress = Progress::default();
            let new = if keep { Output::kept_beside } else { Output::beside };
            let mut output = new(&path, &progress).unwrap();
            for piece in expected.chunks(777) {
                output.append(Arc::new(piece.to_vec())).unwrap();
                output.append(Arc::default()).unwrap();
            }
            expected[..100].fill(7);
            output.replace_first(vec![7; 100]).unwrap();
            let source = output.source();
            assert_eq!(source.length(), expected.len() as u64);
            for range in
                [0..0, 0..777, 5..20, 776..778, 700..10_000, length - 1..length, 0..length, length..length]
            {
                assert_eq!(*source.read(range.clone()).unwrap(), expected[range]);
            }
            output.rename().unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), expected);
            let traffic = progress.traffic();
            assert_eq!(traffic.output_written, expected.len() as u64 + 100);
            assert_eq!(traffic.output_read > 0, !keep);
        }
    }
}
