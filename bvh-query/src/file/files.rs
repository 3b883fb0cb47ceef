//! Files that are opened when a scene first needs them. The number that stay open is limited.

use crate::error::{FileChange, OpenError, QueryError};
use crate::file::bvh::{Bvh, WeakBvh};
use crate::file::owned_shape::OwnedShape;
use crate::file::shape::{Selection, Shape};
use bvh_format::object::Object;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Files for scenes that have more files than should be open at once. Each file is opened when one of its instances is
/// first near another instance, and the number of files that stay open is limited. Cloning it copies a pointer.
///
/// [`Files::shape`] reads the header and the object table of a file and closes it. A query that needs the file opens
/// it again, and fails if it is no longer the same. When too many files are open, the least recently used one is
/// closed. Files in use are not closed, so while a query runs, up to two more files per thread may be open.
///
/// ```no_run
/// use bvh_query::{Files, Pose, Scene};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// // SAFETY: nobody changes the files while the program runs.
/// let files = unsafe { Files::mapped(1000) };
/// let mut scene = Scene::new()?;
/// for part in std::fs::read_dir("parts")? {
///     scene.add(files.shape(part?.path())?, Pose::IDENTITY)?;
/// }
/// println!("{} pairs touch, {} files are open", scene.pairs_in_contact()?.len(), files.open_count());
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Files(Arc<Shelf>);

#[derive(Debug)]
struct Shelf {
    most: usize,
    /// Maps a file or copies it.
    open_file: fn(&Path) -> Result<Bvh, OpenError>,
    /// How often a file was used, which tells when each was used last.
    clock: AtomicU64,
    open: Mutex<Vec<(Arc<Known>, Bvh)>>,
}

/// What is known of a file while it is closed.
#[derive(Debug)]
struct Known {
    path: PathBuf,
    content_checksum: u64,
    objects: Vec<Object>,
    /// The file, while anybody has it open.
    bvh: Mutex<WeakBvh>,
    last_use: AtomicU64,
}

/// A shape in a scene. Either its file is open as long as the shape lives, or [`Files`] opens it only while a query
/// needs it. Every shape whose file is open converts into one.
///
/// ```
/// use bvh_query::{Pose, Scene, SceneShape};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let rounded = SceneShape::from(block.clone()).rounded(0.25)?;
/// assert_eq!(rounded.radius(), 0.25);
/// let mut scene = Scene::new()?;
/// scene.add(rounded, Pose::IDENTITY)?;
/// scene.add(block, Pose::IDENTITY)?; // converts into a shape
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SceneShape {
    file: Held,
    selection: Selection,
}

#[derive(Clone, Debug)]
enum Held {
    Open(Bvh),
    Stored(Files, Arc<Known>),
}

impl Files {
    /// Creates a set of files of which at most `most` stay open, and at least one. Each opening copies the file into
    /// memory; [`Files::mapped`] maps it.
    pub fn new(most: usize) -> Self {
        Self::opened_by(most, |path| Bvh::read(path))
    }

    pub(super) fn opened_by(most: usize, open_file: fn(&Path) -> Result<Bvh, OpenError>) -> Self {
        let most = most.max(1);
        Self(Arc::new(Shelf { most, open_file, clock: AtomicU64::new(0), open: Mutex::default() }))
    }

    /// Reads the header and the object table of a file, and returns all of its objects as one shape. Clone a shape rather
    /// than reading its file again: each reading counts as a file of its own.
    ///
    /// # Errors
    /// The errors of [`Bvh::map`].
    pub fn shape(&self, path: impl AsRef<Path>) -> Result<SceneShape, OpenError> {
        let path = path.as_ref();
        let bvh = (self.0.open_file)(path)?;
        let known = Arc::new(Known {
            path: path.to_owned(),
            content_checksum: bvh.layout().content_checksum,
            objects: bvh.objects().to_vec(),
            bvh: Mutex::default(),
            last_use: AtomicU64::new(0),
        });
        let selection = Selection::all(&known.objects);
        Ok(SceneShape { file: Held::Stored(self.clone(), known), selection })
    }

    /// Returns how many files are open at present.
    pub fn open_count(&self) -> usize {
        locked(&self.0.open).len()
    }
}

impl<T: Into<OwnedShape>> From<T> for SceneShape {
    fn from(shape: T) -> Self {
        let OwnedShape { bvh, selection } = shape.into();
        Self { file: Held::Open(bvh), selection }
    }
}

impl SceneShape {
    /// Returns one object of the file as a shape, or `None` if the file has no object of this number.
    pub fn object(&self, number: usize) -> Option<Self> {
        let selection = Selection::one(self.all_objects(), number)?;
        Some(Self { file: self.file.clone(), selection })
    }

    /// Returns the objects of the shape, as the file had them when it was first read.
    pub fn objects(&self) -> &[Object] {
        self.selection.of(self.all_objects())
    }

    /// Returns the objects of the file.
    fn all_objects(&self) -> &[Object] {
        match &self.file {
            Held::Open(bvh) => bvh.objects(),
            Held::Stored(_, known) => &known.objects,
        }
    }

    /// Returns the shape with a radius: see [`Shape::rounded`].
    ///
    /// # Errors
    /// The errors of [`Shape::rounded`].
    pub fn rounded(self, radius: f64) -> Result<Self, QueryError> {
        Ok(Self { selection: self.selection.rounded(radius)?, ..self })
    }

    /// Returns the shape as a solid, for which its file is opened: see [`Shape::solid`].
    ///
    /// # Errors
    /// The errors of [`Shape::solid`], and [`QueryError::File`].
    pub fn solid(self) -> Result<Self, QueryError> {
        self.in_file(&*self.file()?).check_closed()?;
        Ok(Self { selection: self.selection.solid(), ..self })
    }

    /// Returns the radius, in mesh units.
    pub fn radius(&self) -> f64 {
        self.selection.radius
    }

    /// Opens the file, if it is not open, and returns the shape. The file stays open as long as the shape lives.
    ///
    /// # Errors
    /// [`QueryError::File`] if the file is not there, or is no longer the one that was first read.
    pub fn opened(&self) -> Result<OwnedShape, QueryError> {
        Ok(OwnedShape { bvh: self.file()?.into_owned(), selection: self.selection })
    }

    /// Returns the file for a question. A file that is open is lent, because threads that count its uses would get in each
    /// other's way.
    pub(crate) fn file(&self) -> Result<Cow<'_, Bvh>, QueryError> {
        Ok(match &self.file {
            Held::Open(bvh) => Cow::Borrowed(bvh),
            Held::Stored(files, known) => Cow::Owned(files.open(known)?),
        })
    }

    /// Returns the shape in its file, which has the objects that it had.
    pub(crate) fn in_file<'a>(&self, file: &'a Bvh) -> Shape<'a> {
        self.selection.in_file(file)
    }
}

impl Files {
    /// Returns a file, which it opens if it is not open.
    fn open(&self, known: &Arc<Known>) -> Result<Bvh, QueryError> {
        let shelf = &self.0;
        known.last_use.store(shelf.clock.fetch_add(1, Ordering::Relaxed), Ordering::Relaxed);
        let is_open = || locked(&known.bvh).upgrade();
        if let Some(bvh) = is_open() {
            return Ok(bvh);
        }
        let mut open = locked(&shelf.open);
        // Another thread may have opened it meanwhile.
        if let Some(bvh) = is_open() {
            return Ok(bvh);
        }
        while open.len() >= shelf.most {
            let last_use = |place: &usize| open[*place].0.last_use.load(Ordering::Relaxed);
            let oldest = (0..open.len()).min_by_key(last_use).unwrap_or_default();
            open.swap_remove(oldest);
        }
        let bvh = known.open_again(shelf.open_file)?;
        *locked(&known.bvh) = bvh.downgrade();
        open.push((known.clone(), bvh.clone()));
        Ok(bvh)
    }
}

impl Known {
    fn open_again(&self, open_file: fn(&Path) -> Result<Bvh, OpenError>) -> Result<Bvh, QueryError> {
        let failed = |found| QueryError::File { path: self.path.clone(), found };
        let bvh = open_file(&self.path).map_err(|error| {
            failed(match error {
                OpenError::Io { source, .. } => FileChange::Unreadable(source.kind()),
                OpenError::Format { source, .. } => FileChange::Damaged(source.rule),
            })
        })?;
        let is_same = bvh.layout().content_checksum == self.content_checksum && bvh.objects() == self.objects;
        if is_same { Ok(bvh) } else { Err(failed(FileChange::Replaced)) }
    }
}

/// Locks a mutex. A panic elsewhere leaves what these guard whole.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
