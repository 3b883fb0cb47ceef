//! Maps files where they are.
//!
//! Mapping is `unsafe`, as in other libraries: [`Bvh::map`] states what its caller has to promise.

use crate::error::OpenError;
use crate::file::bvh::Bvh;
use crate::file::files::Files;
use memmap2::Mmap;
use std::fs::{File, Metadata};
use std::io;
use std::path::Path;

/// How the system reads a mapped file from its disk.
///
/// This is a hint; without it, the system guesses. On systems other than Unix all hints are the same.
///
/// ```
/// use bvh_query::{Bvh, ReadAhead};
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-scene.cbvh");
/// // SAFETY: nobody changes the file while the program runs.
/// let bvh = unsafe { Bvh::map_with(path, ReadAhead::Sparse) }?;
/// assert!(!bvh.objects().is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum ReadAhead {
    /// Reads as the system usually does, which includes other pages around each page that is touched: on Linux 128 KiB,
    /// or the setting of the disk. Best if queries touch most of the file in the end.
    #[default]
    Usual,
    /// Reads only what queries touch: pages of nodes one by one, and each leaf or id block as a whole. Best if the file
    /// is larger than memory, or if queries will touch few of its pages.
    Sparse,
    /// Reads the whole file in the background as soon as it is opened. Best if there is memory for all of it and time
    /// before the first query.
    Whole,
}

impl Bvh {
    /// Maps a file into memory and opens it.
    ///
    /// Cost: microseconds, whatever the size of the file; for memory see [`Bvh`].
    ///
    /// # Safety
    /// Neither this process nor another one may change the bytes of the file while it is open. In detail:
    ///
    /// - *Replaced* by renaming another file over it, or *removed*: allowed. The old content stays, and so do the answers.
    ///   `cbvh bake` replaces its output in this way. Windows may refuse both while the file is mapped.
    /// - *Truncated*, by whatever process: on Unix the first access beyond the new end sends SIGBUS, which ends this process.
    ///   There is no error to catch. Windows refuses to truncate a mapped file.
    /// - *Written into*: the behaviour is undefined, since Rust assumes that bytes behind a shared reference do not
    ///   change. Queries are written so that they do not depend on that assumption. They read file bytes only as
    ///   numbers for which every value is valid. They check each index that they compute from them. Counts that were
    ///   read once bound each walk.
    ///
    /// A file with damaged or forged bytes may be mapped. [`Bvh::read`] copies a file and needs no promise.
    ///
    /// # Errors
    /// [`OpenError::Io`] if the system refuses the file, [`OpenError::Format`] if the header or the object table
    /// break a rule of the format.
    pub unsafe fn map(path: impl AsRef<Path>) -> Result<Self, OpenError> {
        // SAFETY: the caller vouches for the same.
        unsafe { Self::map_with(path, ReadAhead::Usual) }
    }

    /// Maps a file as [`Bvh::map`] does, and tells the system how to read it. Answers do not depend on `read_ahead`.
    ///
    /// # Safety
    /// That of [`Bvh::map`].
    ///
    /// # Errors
    /// The errors of [`Bvh::map`].
    pub unsafe fn map_with(path: impl AsRef<Path>, read_ahead: ReadAhead) -> Result<Self, OpenError> {
        let path = path.as_ref();
        // SAFETY: the caller vouches for the same.
        let map = unsafe { map(path, read_ahead) }
            .map_err(|source| OpenError::Io { path: path.to_owned(), source })?;
        Self::of_map(path, map, read_ahead == ReadAhead::Sparse)
    }
}

impl Files {
    /// Creates a set of files of which at most `most` stay open, and at least one. Files are mapped.
    ///
    /// # Safety
    /// The same as for [`Bvh::map`], for each file given to [`Files::shape`], as long as a shape of it lives. A file
    /// may change while it is closed: the next query that needs it then fails.
    pub unsafe fn mapped(most: usize) -> Self {
        // SAFETY: the caller vouches for each file that is opened in this way.
        Self::opened_by(most, |path| unsafe { Bvh::map(path) })
    }
}

/// Maps a whole file for reading.
///
/// # Safety
/// Nobody changes the file while it is mapped.
#[cfg_attr(not(unix), allow(unused_variables, reason = "other systems take no hint"))]
unsafe fn map(path: &Path, read_ahead: ReadAhead) -> io::Result<Mmap> {
    // Opening a named pipe would wait for its other end, and another file may take the name before it is opened.
    require_mappable(&std::fs::metadata(path)?)?;
    let file = File::open(path)?;
    require_mappable(&file.metadata()?)?;
    // SAFETY: the map is only ever read, as slices of bytes and as types for which any bytes are valid, and the caller
    // vouches that nobody changes the file meanwhile.
    let map = unsafe { Mmap::map(&file) }?;
    // A hint that the system does not know is no error.
    #[cfg(unix)]
    let _ = match read_ahead {
        ReadAhead::Usual => Ok(()),
        ReadAhead::Sparse => map.advise(memmap2::Advice::Random),
        ReadAhead::Whole => map.advise(memmap2::Advice::WillNeed),
    };
    Ok(map)
}

/// Refuses anything but a regular file, such as a directory or a device.
fn require_mappable(metadata: &Metadata) -> io::Result<()> {
    if metadata.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a directory"));
    }
    if metadata.is_file() { Ok(()) } else { Err(io::Error::other("not a regular file")) }
}
