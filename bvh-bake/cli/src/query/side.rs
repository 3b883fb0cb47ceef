//! One side of a query: an opened file, or a mesh baked in memory.

use crate::arguments::LayoutArguments;
use crate::bake::options;
use crate::error::Failure;
use bvh_bake::{BakeError, Options, io, to_bytes};
use bvh_format::header::MAGIC;
use bvh_query::{Bvh, ReadAhead, Shape};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How sides are made ready.
#[derive(Clone, Copy)]
pub(crate) struct How<'a> {
    /// For meshes that are baked.
    pub(crate) layout: &'a LayoutArguments,
    /// The object to ask about.
    pub(crate) object: Option<&'a str>,
    pub(crate) read_ahead: ReadAhead,
}

/// A side, ready to be asked about.
pub(crate) struct Side {
    pub(crate) path: PathBuf,
    pub(crate) bvh: Bvh,
    /// The object that `--object` names, if this side has it.
    pub(crate) object: Option<usize>,
    /// Seconds of baking, or of opening the file.
    pub(crate) build_seconds: f64,
}

impl Side {
    /// Opens a `.cbvh` file or bakes a mesh. The mesh's objects are one tree, unless `object` names one.
    pub(crate) fn load(path: &Path, how: &How) -> Result<Self, Failure> {
        if is_baked(path)? {
            return Self::open(path, how);
        }
        let (bvh, build_seconds) = bake(path, &options(how.layout), how.object)?;
        Ok(Self::new(path, bvh, how, build_seconds))
    }

    /// Opens a `.cbvh` file.
    pub(crate) fn open(path: &Path, how: &How) -> Result<Self, Failure> {
        let start = Instant::now();
        let bvh = Bvh::open_with(path, how.read_ahead)?;
        Ok(Self::new(path, bvh, how, start.elapsed().as_secs_f64()))
    }

    fn new(path: &Path, bvh: Bvh, how: &How, build_seconds: f64) -> Self {
        let object = how.object.and_then(|name| bvh.find(name));
        Self { path: path.to_owned(), bvh, object, build_seconds }
    }

    /// Checks all pages before queries are timed, as a part of building: no query pays for a first
    /// touch that the next one would have for nothing.
    pub(crate) fn check(&mut self) -> Result<(), Failure> {
        let start = Instant::now();
        self.bvh.check_all().map_err(|error| Failure::invalid(&self.path, error))?;
        self.build_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// What is queried.
    pub(crate) fn shape(&self) -> Shape<'_> {
        self.object.and_then(|number| self.bvh.object(number)).unwrap_or_else(|| self.bvh.all())
    }

    /// Triangles of the mesh, exact duplicates too.
    pub(crate) fn triangles(&self) -> u64 {
        let records = self.shape().objects().iter().map(|object| &object.record);
        // As stated: the numbers of a forged file may have no sum.
        let counts = records.flat_map(|record| [record.triangles.get(), record.duplicates.get()]);
        counts.fold(0, u64::saturating_add)
    }

    /// Bytes of the file, and triangles stored in it.
    pub(crate) fn bytes_and_stored(&self) -> (u64, u64) {
        (self.bvh.bytes().len() as u64, self.bvh.all().triangles())
    }
}

/// True for `.cbvh` files, by content or, so that a damaged one is called so, by name.
pub(crate) fn is_baked(path: &Path) -> Result<bool, Failure> {
    let failed = |error| Failure::from_input(path, &error);
    let mut file = std::fs::File::open(path).map_err(failed)?;
    let mut head = Vec::new();
    file.by_ref().take(MAGIC.len() as u64).read_to_end(&mut head).map_err(failed)?;
    let named = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("cbvh"));
    Ok(head == MAGIC || named)
}

fn bake(path: &Path, options: &Options, object: Option<&str>) -> Result<(Bvh, f64), Failure> {
    let failed = |error: &BakeError| Failure::from_bake(&path.display().to_string(), error);
    let mut mesh = io::read(path).map_err(|error| failed(&error.into()))?;
    // A file that lacks the object is one thing to query, and one tree is faster to query than many.
    let has = object.is_some_and(|name| mesh.objects.iter().any(|object| object.name == name));
    if !has {
        mesh = mesh.merged();
    }
    let start = Instant::now();
    let options = Options { split_objects: has, ..options.clone() };
    let (bytes, _) = to_bytes(&mesh, &options).map_err(|error| failed(&error))?;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| failed(&BakeError::Unproved(error)))?;
    Ok((bvh, start.elapsed().as_secs_f64()))
}
