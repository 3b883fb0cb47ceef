//! What threads may ask about while others change it: scenes and robots.
//!
//! A question takes a snapshot, and runs without any lock. So nobody waits for a question. No function of the caller is called
//! with the lock.

use crate::cores;
use crate::input::flag;
use crate::status::{Failure, Status};
use std::sync::{Arc, Mutex, MutexGuard};

/// Something whose copies share what it holds until one of them changes.
pub(crate) trait Snapshot: Clone {
    /// Returns a copy to ask questions of.
    fn snapshot(&mut self) -> Self;
}

/// What a handle stands for.
pub(crate) struct Shared<T, N = ()>(Arc<Mutex<Held<T, N>>>);

impl<T, N> Clone for Shared<T, N> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

pub(crate) struct Held<T, N> {
    pub(crate) now: T,
    /// Whether questions may use all cores, where they are not asked by a function of the caller.
    parallel: bool,
    /// What the question that ended last left.
    pub(crate) note: N,
    /// Those that are asked no question now. They keep what they remember of earlier ones, and hold what `empty` does.
    idle: Vec<T>,
    /// One that holds nothing which a change could let go.
    empty: T,
}

impl<T: Snapshot, N: Copy + Default> Shared<T, N> {
    pub(crate) fn new(now: T, empty: T) -> Self {
        let (parallel, note, idle) = (false, N::default(), Vec::new());
        Self(Arc::new(Mutex::new(Held { now, parallel, note, idle, empty })))
    }

    /// Locks it for a moment. `name` is that of the argument.
    pub(crate) fn lock(&self, name: &str) -> Result<MutexGuard<'_, Held<T, N>>, Failure> {
        let ended = || format!("{name}: a defect of cbvh ended its last use; free it, and make another one");
        self.0.lock().map_err(|_| Failure::new(Status::Internal, ended()))
    }

    /// Returns one like this.
    pub(crate) fn copy(&self, name: &str) -> Result<Self, Failure> {
        let held = self.lock(name)?;
        let copy = Self::new(held.now.clone(), held.empty.clone());
        {
            let mut copied = copy.lock(name)?;
            (copied.parallel, copied.note) = (held.parallel, held.note);
        }
        Ok(copy)
    }

    /// Lets questions use all cores, or not.
    pub(crate) fn set_parallel(&self, name: &str, parallel: i32) -> Result<(), Failure> {
        self.lock(name)?.parallel = flag("parallel", parallel)?;
        Ok(())
    }

    /// Asks a question about this as it is now, which is told whether it uses all cores, and returns a note.
    pub(crate) fn ask<R>(&self, name: &str, ask: impl FnOnce(&mut T, bool) -> (R, N)) -> Result<R, Failure> {
        let (mut own, empty, parallel) = {
            let held = &mut *self.lock(name)?;
            let snapshot = held.now.snapshot();
            let own = match held.idle.pop() {
                Some(mut own) => {
                    own.clone_from(&snapshot);
                    own
                }
                None => snapshot,
            };
            (own, held.empty.clone(), held.parallel && cores::may_use_all())
        };
        let (answer, note) = ask(&mut own, parallel);
        own.clone_from(&empty);
        let mut held = self.lock(name)?;
        held.note = note;
        held.idle.push(own);
        Ok(answer)
    }
}
