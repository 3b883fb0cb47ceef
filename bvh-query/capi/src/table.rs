//! Tables of what handles stand for.
//!
//! A handle is a number and never an address: 8 bits for its kind, 24 for its place in the table of that kind, and 32
//! for how often the place was freed before. A number that no table knows is refused, whoever made it up, and a freed
//! handle is refused even after its place is taken again; after 2^32 uses a place is given up. Nothing is ever read
//! through a handle, so that all of this is sound.
//!
//! Places never move. They are found without a lock, and each has a lock of its own: threads that use different handles
//! do not wait for each other.

use crate::status::{Failure, Status};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

/// What a handle stands for, by the highest byte of its number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Kind {
    Mesh = 0xC1,
    Querier = 0xC2,
    Tracker = 0xC3,
    Path = 0xC4,
    Scene = 0xC5,
}

impl Kind {
    const ALL: [Self; 5] = [Self::Mesh, Self::Querier, Self::Tracker, Self::Path, Self::Scene];

    fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Querier => "querier",
            Self::Tracker => "tracker",
            Self::Path => "path",
            Self::Scene => "scene",
        }
    }
}

/// The places of a table come in chunks of 1, 2, 4 and so on, so that the bits of a number tell the chunk.
const CHUNKS: usize = 24;

struct Slot<T> {
    /// How often the place was freed. It changes under the lock only; without it, it tells whether a handle is stale.
    generation: AtomicU32,
    value: RwLock<Option<T>>,
}

pub(crate) struct Table<T> {
    kind: Kind,
    chunks: [OnceLock<Box<[Slot<T>]>>; CHUNKS],
    free: Mutex<Free>,
    /// How many handles were freed.
    removals: AtomicU64,
}

/// Places that can be taken.
struct Free {
    freed: Vec<u32>,
    /// The first place that was never taken.
    next: u32,
}

/// The value of a handle, while nobody else may use or free it.
pub(crate) struct Held<'a, T>(RwLockWriteGuard<'a, Option<T>>);

/// The value of a handle, while nobody may change or free it.
pub(crate) struct Seen<'a, T>(RwLockReadGuard<'a, Option<T>>);

impl<T> Seen<'_, T> {
    /// Returns the value, as `Held` does.
    pub(crate) fn value(&self) -> Result<&T, Failure> {
        self.0.as_ref().ok_or_else(|| Failure::new(Status::Internal, "a handle without a value"))
    }
}

impl<T> Held<'_, T> {
    /// Returns the value. It is there: a place without one has no handle of its generation.
    pub(crate) fn value(&mut self) -> Result<&mut T, Failure> {
        self.0.as_mut().ok_or_else(|| Failure::new(Status::Internal, "a handle without a value"))
    }
}

impl<T> Table<T> {
    pub(crate) const fn new(kind: Kind) -> Self {
        let free = Mutex::new(Free { freed: Vec::new(), next: 0 });
        Self { kind, chunks: [const { OnceLock::new() }; CHUNKS], free, removals: AtomicU64::new(0) }
    }

    fn slot(&self, place: u32) -> Option<&Slot<T>> {
        let number = place + 1;
        let chunk = number.ilog2();
        self.chunks.get(chunk as usize)?.get()?.get((number - (1 << chunk)) as usize)
    }

    /// Keeps a value, and returns its handle.
    pub(crate) fn insert(&self, value: T) -> Result<u64, Failure> {
        self.insert_with(|| value)
    }

    /// Keeps a value that is made only if there is a place for it, and returns its handle.
    pub(crate) fn insert_with(&self, value: impl FnOnce() -> T) -> Result<u64, Failure> {
        let place = {
            let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
            match free.freed.pop() {
                Some(place) => place,
                None => {
                    let place = free.next;
                    let chunk = (place + 1).ilog2();
                    let Some(places) = self.chunks.get(chunk as usize) else {
                        let kind = self.kind.name();
                        let most = (1 << CHUNKS) - 1;
                        let message = format!("expected at most {most} open handles of a {kind}, found more");
                        return Err(Failure::new(Status::Limit, message));
                    };
                    let slot = || Slot { generation: AtomicU32::new(0), value: RwLock::new(None) };
                    places.get_or_init(|| (0..1u32 << chunk).map(|_| slot()).collect());
                    free.next += 1;
                    place
                }
            }
        };
        let Some(slot) = self.slot(place) else {
            return Err(Failure::new(Status::Internal, "a place beyond its table"));
        };
        let mut room = slot.value.write().unwrap_or_else(PoisonError::into_inner);
        *room = Some(value());
        // It changes under the lock only.
        let generation = slot.generation.load(Ordering::Acquire);
        drop(room);
        Ok(u64::from(self.kind as u8) << 56 | u64::from(place) << 32 | u64::from(generation))
    }

    /// Returns the place of a handle, if it is of this kind and not known to be freed.
    fn find(&self, name: &str, handle: u64) -> Result<(u32, &Slot<T>), Failure> {
        let place = (handle >> 32) as u32 & 0xFF_FFFF;
        if (handle >> 56) as u8 == self.kind as u8
            && let Some(slot) = self.slot(place)
            && slot.generation.load(Ordering::Acquire) == handle as u32
        {
            return Ok((place, slot));
        }
        Err(self.stale(name, handle))
    }

    #[cold]
    fn stale(&self, name: &str, handle: u64) -> Failure {
        let kind = self.kind.name();
        let place = (handle >> 32) as u32 & 0xFF_FFFF;
        let other = Kind::ALL.into_iter().find(|kind| (handle >> 56) as u8 == *kind as u8);
        let found = match other {
            _ if handle == 0 => "0, no handle".to_owned(),
            Some(other) if other != self.kind => format!("the handle of a {}", other.name()),
            Some(_)
                if self
                    .slot(place)
                    .is_some_and(|slot| (handle as u32) < slot.generation.load(Ordering::Acquire)) =>
            {
                format!("one of a {kind} that was freed")
            }
            _ => format!("{handle:#x}, which this library never gave out"),
        };
        Failure::new(
            Status::InvalidHandle,
            format!("{name}: expected the handle of an open {kind}, found {found}"),
        )
    }

    /// Returns whether a handle has not been freed. It is cheap, and threads that ask it do not disturb each other.
    pub(crate) fn is_open(&self, handle: u64) -> bool {
        let place = (handle >> 32) as u32 & 0xFF_FFFF;
        let slot = self.slot(place);
        slot.is_some_and(|slot| slot.generation.load(Ordering::Acquire) == handle as u32)
    }

    /// Returns the value of a handle for use by this thread alone.
    pub(crate) fn hold(&self, name: &str, handle: u64) -> Result<Held<'_, T>, Failure> {
        let (_, slot) = self.find(name, handle)?;
        match slot.value.try_write() {
            // It may have been freed before it was locked.
            Ok(value) if slot.generation.load(Ordering::Acquire) == handle as u32 && value.is_some() => {
                Ok(Held(value))
            }
            Ok(_) => Err(self.stale(name, handle)),
            Err(TryLockError::WouldBlock) => Err(self.busy(name)),
            Err(TryLockError::Poisoned(_)) => Err(defect(name)),
        }
    }

    /// Returns the value of a handle for threads that only look at it, of which there may be many at the same time.
    pub(crate) fn see(&self, name: &str, handle: u64) -> Result<Seen<'_, T>, Failure> {
        let (_, slot) = self.find(name, handle)?;
        match slot.value.try_read() {
            Ok(value) if slot.generation.load(Ordering::Acquire) == handle as u32 && value.is_some() => {
                Ok(Seen(value))
            }
            Ok(_) => Err(self.stale(name, handle)),
            Err(TryLockError::WouldBlock) => Err(self.busy(name)),
            Err(TryLockError::Poisoned(_)) => Err(defect(name)),
        }
    }

    /// Returns how many handles were freed: a number that is the same as before says that none was meanwhile.
    pub(crate) fn removals(&self) -> u64 {
        self.removals.load(Ordering::Acquire)
    }

    #[cold]
    fn busy(&self, name: &str) -> Failure {
        let kind = self.kind.name();
        let message =
            format!("{name}: expected a {kind} that nobody uses, found it in use; make one for each thread");
        Failure::new(Status::Busy, message)
    }

    /// Frees a handle, and returns its value, which is to be dropped.
    pub(crate) fn remove(&self, name: &str, handle: u64) -> Result<T, Failure> {
        let (place, slot) = self.find(name, handle)?;
        let mut value = match slot.value.try_write() {
            Ok(value) => value,
            // Values that are shared are held for moments only.
            Err(TryLockError::WouldBlock) if matches!(self.kind, Kind::Mesh | Kind::Path) => {
                slot.value.write().unwrap_or_else(PoisonError::into_inner)
            }
            Err(TryLockError::WouldBlock) => return Err(self.busy(name)),
            Err(TryLockError::Poisoned(value)) => {
                slot.value.clear_poison();
                value.into_inner()
            }
        };
        if slot.generation.load(Ordering::Acquire) != handle as u32 {
            return Err(self.stale(name, handle));
        }
        let Some(taken) = value.take() else { return Err(self.stale(name, handle)) };
        let next = (handle as u32).wrapping_add(1);
        slot.generation.store(next, Ordering::Release);
        self.removals.fetch_add(1, Ordering::Release);
        drop(value);
        if next != 0 {
            self.free.lock().unwrap_or_else(PoisonError::into_inner).freed.push(place);
        }
        Ok(taken)
    }
}

#[cold]
fn defect(name: &str) -> Failure {
    let message = format!("{name}: a defect of cbvh ended its last use; free it, and make another one");
    Failure::new(Status::Internal, message)
}

impl<T: Clone> Table<T> {
    /// Returns a copy of the value of a handle, which stays usable when the handle is freed.
    pub(crate) fn share(&self, name: &str, handle: u64) -> Result<T, Failure> {
        let (_, slot) = self.find(name, handle)?;
        let value = slot.value.read().unwrap_or_else(PoisonError::into_inner);
        if slot.generation.load(Ordering::Acquire) != handle as u32 {
            return Err(self.stale(name, handle));
        }
        value.clone().ok_or_else(|| self.stale(name, handle))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails may panic")]
mod tests {
    use super::*;

    #[test]
    fn freed_and_foreign_handles_are_refused() {
        let table = Table::<String>::new(Kind::Mesh);
        let handles: Vec<u64> = (0..100).map(|n| table.insert(n.to_string()).unwrap()).collect();
        for (n, &handle) in handles.iter().enumerate() {
            assert_eq!(table.share("a", handle).unwrap(), n.to_string());
        }
        assert_eq!(table.remove("a", handles[7]).unwrap(), "7");
        for refused in [table.share("a", handles[7]), table.remove("a", handles[7])] {
            let failure = refused.unwrap_err();
            assert_eq!(failure.status, Status::InvalidHandle);
            assert_eq!(
                failure.message,
                "a: expected the handle of an open mesh, found one of a mesh that was freed"
            );
        }
        let again = table.insert("again".to_owned()).unwrap();
        assert_eq!(again >> 32, handles[7] >> 32, "the place is taken again");
        assert!(!table.is_open(handles[7]) && table.is_open(again));
        assert!(table.share("a", handles[7]).is_err());
        let path = u64::from(Kind::Path as u8) << 56;
        for (handle, found) in [
            (0, "0, no handle"),
            (path, "the handle of a path"),
            (again + 1, "never gave out"),
            (u64::MAX, "never gave out"),
            (handles[99] + (1 << 32), "never gave out"),
            (handles[0] | 0xFF_FFFF << 32, "never gave out"),
        ] {
            let failure = table.share("a", handle).unwrap_err();
            assert!(failure.message.contains(found), "{}", failure.message);
        }
    }

    #[test]
    fn what_one_thread_uses_another_one_may_not() {
        let table = Table::new(Kind::Querier);
        let handle = table.insert(1).unwrap();
        let mut held = table.hold("querier", handle).unwrap();
        *held.value().unwrap() += 1;
        assert_eq!(table.hold("querier", handle).err().map(|failure| failure.status), Some(Status::Busy));
        assert_eq!(table.remove("querier", handle).err().map(|failure| failure.status), Some(Status::Busy));
        drop(held);
        // Many may look at it together, but not while one changes it.
        let seen = [(); 2].map(|()| table.see("querier", handle).unwrap());
        assert_eq!(table.hold("querier", handle).err().map(|failure| failure.status), Some(Status::Busy));
        assert_eq!(seen.map(|seen| *seen.value().unwrap()), [2, 2]);
        let held = table.hold("querier", handle).unwrap();
        assert_eq!(table.see("querier", handle).err().map(|failure| failure.status), Some(Status::Busy));
        drop(held);
        assert_eq!(table.removals(), 0);
        assert_eq!(table.remove("querier", handle).unwrap(), 2);
        assert_eq!(table.removals(), 1);
    }

    #[test]
    fn after_a_panic_a_handle_can_only_be_freed() {
        let table = Table::new(Kind::Scene);
        let handle = table.insert(1).unwrap();
        let panicked = std::thread::scope(|scope| {
            let use_it = || {
                let _held = table.hold("scene", handle);
                std::panic::resume_unwind(Box::new(()));
            };
            scope.spawn(use_it).join()
        });
        assert!(panicked.is_err());
        assert_eq!(table.hold("scene", handle).err().map(|failure| failure.status), Some(Status::Internal));
        assert_eq!(table.remove("scene", handle).unwrap(), 1);
        let next = table.insert(2).unwrap();
        assert!(table.hold("scene", next).is_ok());
    }

    #[test]
    fn a_place_is_given_up_after_its_last_generation() {
        let table = Table::new(Kind::Mesh);
        let handle = table.insert(1).unwrap();
        table.slot(0).unwrap().generation.store(u32::MAX, Ordering::Release);
        assert_eq!(table.remove("a", handle | u64::from(u32::MAX)).unwrap(), 1);
        let next = table.insert(2).unwrap();
        assert_eq!((next >> 32) as u32 & 0xFF_FFFF, 1);
    }
}
