//! Tables of what handles stand for.
//!
//! A handle is a number and never an address: 8 bits for its kind, and 56 that count the handles of this kind, so that no
//! number is ever given twice. A number that its table lacks is refused, whoever made it up. Nothing is ever read through a
//! handle, so that all of this is sound.
//!
//! A table is divided by the lowest bits of the numbers. Each part has a lock, which is held only while a number is looked
//! up, so that threads that use different handles do not wait for each other.

use crate::status::{Failure, Status};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, TryLockError};

/// What a handle stands for, by the highest byte of its number.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Mesh,
    Querier,
    Tracker,
    Path,
    Scene,
    Robot,
    Stop,
}

/// The highest byte of the first kind.
const FIRST_KIND: u64 = 0xC1;

/// Returns the name of the kind that a handle has, if it is one.
fn name_of_kind(handle: u64) -> Option<&'static str> {
    let kind = (handle >> 56).checked_sub(FIRST_KIND)?;
    ["mesh", "querier", "tracker", "path", "scene", "robot", "stop"].get(kind as usize).copied()
}

const PARTS: usize = 64;

/// A part of a table, on cache lines of its own.
#[repr(align(128))]
struct Part<T>(RwLock<BTreeMap<u64, T>>);

/// Values that many threads may use at the same time. Each gets a copy, which outlives the handle.
pub(crate) struct Table<T> {
    /// The next handle.
    next: AtomicU64,
    /// How many handles were freed.
    removals: AtomicU64,
    parts: [Part<T>; PARTS],
}

impl<T: Clone> Table<T> {
    pub(crate) const fn new(kind: Kind) -> Self {
        let first = (FIRST_KIND + kind as u64) << 56 | 1;
        let parts = [const { Part(RwLock::new(BTreeMap::new())) }; PARTS];
        Self { next: AtomicU64::new(first), removals: AtomicU64::new(0), parts }
    }

    fn part(&self, handle: u64) -> &RwLock<BTreeMap<u64, T>> {
        &self.parts[handle as usize % PARTS].0
    }

    /// Keeps a value, and returns its handle.
    pub(crate) fn insert(&self, value: T) -> u64 {
        let handle = self.next.fetch_add(1, Ordering::Relaxed);
        self.part(handle).write().unwrap_or_else(PoisonError::into_inner).insert(handle, value);
        handle
    }

    /// Returns a copy of the value of a handle, which stays usable when the handle is freed.
    pub(crate) fn share(&self, name: &str, handle: u64) -> Result<T, Failure> {
        let part = self.part(handle).read().unwrap_or_else(PoisonError::into_inner);
        part.get(&handle).cloned().ok_or_else(|| self.stale(name, handle))
    }

    /// Returns whether a handle stands for something.
    pub(crate) fn is_open(&self, handle: u64) -> bool {
        self.part(handle).read().unwrap_or_else(PoisonError::into_inner).contains_key(&handle)
    }

    /// Returns how many handles were freed: a number that is the same as before says that none was meanwhile.
    pub(crate) fn removals(&self) -> u64 {
        self.removals.load(Ordering::Acquire)
    }

    /// Frees a handle, unless it is 0.
    pub(crate) fn free(&self, name: &str, handle: u64) -> Result<(), Failure> {
        if handle == 0 {
            return Ok(());
        }
        let removed = self.part(handle).write().unwrap_or_else(PoisonError::into_inner).remove(&handle);
        // The lock is released before the value is dropped.
        let value = removed.ok_or_else(|| self.stale(name, handle))?;
        self.removals.fetch_add(1, Ordering::Release);
        drop(value);
        Ok(())
    }

    fn kind(&self) -> &'static str {
        name_of_kind(self.next.load(Ordering::Relaxed)).unwrap_or_default()
    }

    #[cold]
    fn stale(&self, name: &str, handle: u64) -> Failure {
        let kind = self.kind();
        let found = match name_of_kind(handle) {
            _ if handle == 0 => "0, no handle".to_owned(),
            Some(other) if other != kind => format!("the handle of a {other}"),
            Some(_) if handle << 8 != 0 && handle < self.next.load(Ordering::Relaxed) => {
                format!("one of a {kind} that was freed")
            }
            _ => format!("{handle:#x}, which this library never gave out"),
        };
        let expected = format!("expected the handle of an open {kind}");
        Failure::new(Status::InvalidHandle, format!("{name}: {expected}, found {found}"))
    }
}

/// A value that one thread at a time may use or free. `None` once it is freed.
pub(crate) struct Exclusive<V>(Arc<Mutex<Option<V>>>);

impl<V> Exclusive<V> {
    pub(crate) fn new(value: V) -> Self {
        Self(Arc::new(Mutex::new(Some(value))))
    }
}

impl<V> Clone for Exclusive<V> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<V> Table<Exclusive<V>> {
    /// Uses the value of a handle, which nobody else may use or free meanwhile.
    pub(crate) fn hold<R>(
        &self,
        name: &str,
        handle: u64,
        act: impl FnOnce(&mut V) -> Result<R, Failure>,
    ) -> Result<R, Failure> {
        let slot = self.share(name, handle)?;
        let mut value = slot.0.try_lock().map_err(|error| self.refuse(name, error))?;
        act(value.as_mut().ok_or_else(|| self.stale(name, handle))?)
    }

    /// Frees a handle that nobody uses, unless it is 0.
    pub(crate) fn free_unused(&self, name: &str, handle: u64) -> Result<(), Failure> {
        if handle == 0 {
            return Ok(());
        }
        let slot = self.share(name, handle)?;
        let value = match slot.0.try_lock() {
            Ok(mut value) => value.take(),
            Err(TryLockError::Poisoned(value)) => value.into_inner().take(),
            Err(error) => return Err(self.refuse(name, error)),
        };
        self.free(name, handle)?;
        drop(value);
        Ok(())
    }

    #[cold]
    fn refuse<G>(&self, name: &str, error: TryLockError<G>) -> Failure {
        let kind = self.kind();
        match error {
            TryLockError::WouldBlock => Failure::new(
                Status::Busy,
                format!(
                    "{name}: expected a {kind} that nobody uses, found it in use; make one for each thread"
                ),
            ),
            TryLockError::Poisoned(_) => Failure::new(
                Status::Internal,
                format!("{name}: a defect of cbvh ended its last use; free it, and make another one"),
            ),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails may panic")]
mod tests {
    use super::*;

    #[test]
    fn freed_and_foreign_handles_are_refused() {
        let table = Table::<String>::new(Kind::Mesh);
        let handles: Vec<u64> = (0..100).map(|n| table.insert(n.to_string())).collect();
        for (n, &handle) in handles.iter().enumerate() {
            assert_eq!(table.share("a", handle).unwrap(), n.to_string());
        }
        assert_eq!(table.removals(), 0);
        table.free("a", handles[7]).unwrap();
        assert_eq!(table.removals(), 1);
        for refused in [table.share("a", handles[7]).map(drop), table.free("a", handles[7])] {
            let failure = refused.unwrap_err();
            assert_eq!(failure.status, Status::InvalidHandle);
            assert_eq!(
                failure.message,
                "a: expected the handle of an open mesh, found one of a mesh that was freed"
            );
        }
        let again = table.insert("again".to_owned());
        assert!(!handles.contains(&again), "no number is given twice");
        assert!(!table.is_open(handles[7]) && table.is_open(again));
        assert_eq!(table.removals(), 1, "what is refused is not freed");
        let path = (FIRST_KIND + Kind::Path as u64) << 56;
        for (handle, found) in [
            (0, "0, no handle"),
            (path, "the handle of a path"),
            (again + 1, "never gave out"),
            (u64::MAX, "never gave out"),
            (handles[0] - 1, "never gave out"),
            (handles[99] + (1 << 32), "never gave out"),
            (handles[0] | 0xFF_FFFF << 32, "never gave out"),
        ] {
            let failure = table.share("a", handle).unwrap_err();
            assert!(failure.message.contains(found), "{}", failure.message);
        }
        assert!(table.free("a", 0).is_ok());
    }

    #[test]
    fn what_one_thread_uses_another_one_may_not() {
        let table = Table::new(Kind::Querier);
        let handle = table.insert(Exclusive::new(1));
        let is_busy = |refused: Result<(), Failure>| refused.unwrap_err().status == Status::Busy;
        let held = table.hold("querier", handle, |value| {
            *value += 1;
            assert!(is_busy(table.hold("querier", handle, |_| Ok(()))));
            assert!(is_busy(table.free_unused("querier", handle)));
            Ok(*value)
        });
        assert_eq!(held.unwrap(), 2);
        // A thread that found the value before it was freed, and locks it only then.
        let slot = table.share("querier", handle).unwrap();
        table.free_unused("querier", handle).unwrap();
        assert!(slot.0.try_lock().unwrap().is_none());
        for refused in [table.hold("querier", handle, |_| Ok(())), table.free_unused("querier", handle)] {
            assert!(refused.unwrap_err().message.ends_with("one of a querier that was freed"));
        }
    }

    #[test]
    fn after_a_panic_a_handle_can_only_be_freed() {
        let table = Table::new(Kind::Tracker);
        let handle = table.insert(Exclusive::new(1));
        let panicked = std::thread::scope(|scope| {
            let use_it = || {
                table
                    .hold("tracker", handle, |_| -> Result<(), _> { std::panic::resume_unwind(Box::new(())) })
            };
            scope.spawn(use_it).join()
        });
        assert!(panicked.is_err());
        assert_eq!(table.hold("tracker", handle, |_| Ok(())).unwrap_err().status, Status::Internal);
        assert!(table.free_unused("tracker", handle).is_ok());
        let next = table.insert(Exclusive::new(2));
        assert!(table.hold("tracker", next, |_| Ok(())).is_ok());
    }
}
