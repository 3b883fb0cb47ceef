//! Asks the files of one variant that are on disk and nowhere in memory.

use super::measure::{Baked, Question};
use crate::from_disk::{self, FromDisk};
use bvh_bake::write_atomically;
use bvh_query::{Backend, Bvh, Pose, Querier, ReadAhead};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Asks about each pose; `None` where the system cannot forget files or count faults, or has no disk below the folder.
pub(super) fn first_queries(
    bake: &Baked,
    question: Question,
    poses: &[Pose],
    (backend, read_ahead): (Backend, ReadAhead),
    folder: &Path,
) -> Option<Vec<FromDisk<f64>>> {
    let files = [("a", &bake.a), ("b", &bake.b)].map(|(side, bvh)| {
        let path = folder.join(format!(".report-{}-{side}.cbvh", std::process::id()));
        Temporary::write(path, bvh.bytes())
    });
    let [Some(a), Some(b)] = files else { return None };
    let mut querier = Querier::with_backend(backend);
    let mut found = Vec::new();
    for pose in poses {
        let open = |path: &Path| Bvh::open_with(path, read_ahead).map(Arc::new).map_err(drop);
        let ask = |a: &Arc<Bvh>, b: &Arc<Bvh>| {
            let opened = Baked { variant: bake.variant.clone(), a: a.clone(), b: b.clone() };
            question.ask(&mut querier, &opened, pose).map_err(drop)
        };
        found.push(from_disk::ask([&a.path, &b.path], open, ask).ok()??);
    }
    // Files that are in memory whatever one asks have no such faults.
    found.iter().any(|one| one.faults > 0).then_some(found)
}

/// A file that goes when this does.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    /// Writes it to the disk itself: what has not got there cannot be forgotten.
    fn write(path: PathBuf, bytes: &[u8]) -> Option<Self> {
        write_atomically(&path, bytes).ok()?;
        let file = Self { path };
        File::open(&file.path).and_then(|file| file.sync_all()).ok()?;
        Some(file)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // If it is gone already, so much the better.
        let _ = std::fs::remove_file(&self.path);
    }
}
