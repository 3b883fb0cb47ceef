//! Loops on the threads of a bake: those of rayon's current pool or, without the feature `parallel`, only the caller's.
//!
//! All parallel loops but sorts are one, whose body is called through a pointer, so that rayon's code is compiled once and not for
//! each of them. An item must therefore take longer than such a call, by far: a run of triangles, and not one of them. Results
//! come in the order of their items.
//!
//! A small bake works [`alone`], because a thread takes longer to wake than it would save.

#[cfg(feature = "parallel")]
pub(crate) use parallel::{
    current_num_threads, current_thread_index, each, enter, first, join, map, sort_unstable,
};
#[cfg(not(feature = "parallel"))]
pub(crate) use sequential::{
    current_num_threads, current_thread_index, each, enter, first, join, map, sort_unstable,
};
use std::cell::Cell;

/// The most triangles of a bake that works alone.
pub(crate) const MAX_ALONE_TRIANGLES: u64 = 1 << 11;

thread_local! {
    static IS_ALONE: Cell<bool> = const { Cell::new(false) };
}

/// Does something on the caller's thread alone if `pays`.
pub(crate) fn alone_if<T>(pays: bool, work: impl FnOnce() -> T) -> T {
    /// Sets back what was set before, also if the work panics.
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            IS_ALONE.set(self.0);
        }
    }
    let _before = Before(IS_ALONE.get());
    IS_ALONE.set(pays || IS_ALONE.get());
    work()
}

/// The number of small items that a thread takes at a time.
const RUN: usize = 1 << 13;

/// Does two things side by side if `pays`, and otherwise one after the other. A thread takes longer to wake than a small
/// mesh takes to bake.
pub(crate) fn join_if<A: Send, B: Send>(
    pays: bool,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    if pays { join(a, b) } else { (a(), b()) }
}

/// Changes each item, given its number.
pub(crate) fn change<T: Send>(items: &mut [T], change: impl Fn(usize, &mut T) + Sync) {
    map(items.chunks_mut(RUN).enumerate(), |(run, items)| {
        items.iter_mut().zip(run * RUN..).for_each(|(item, number)| change(number, item));
    });
}

#[cfg(feature = "parallel")]
mod parallel {
    use super::{IS_ALONE, RUN, sequential};
    pub(crate) use rayon::current_thread_index;
    use rayon::prelude::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::sync::{Mutex, MutexGuard, PoisonError};

    /// Works as a thread of the pool. From outside, each loop would wait for one to wake.
    pub(crate) fn enter<T: Send>(work: impl FnOnce() -> T + Send) -> T {
        if IS_ALONE.get() { work() } else { rayon::join(work, || ()).0 }
    }

    pub(crate) fn current_num_threads() -> usize {
        if IS_ALONE.get() { 1 } else { rayon::current_num_threads() }
    }

    pub(crate) fn join<A: Send, B: Send>(
        a: impl FnOnce() -> A + Send,
        b: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        if IS_ALONE.get() { (a(), b()) } else { rayon::join(a, b) }
    }

    /// Works on each number below `count`.
    pub(crate) fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
        if count <= 1 || IS_ALONE.get() {
            return sequential::each(count, work);
        }
        (0..count).into_par_iter().for_each(work);
    }

    /// Returns what is made of each item.
    pub(crate) fn map<T: Send, R: Send>(
        items: impl IntoIterator<Item = T>,
        make: impl Fn(T) -> R + Sync,
    ) -> Vec<R> {
        if IS_ALONE.get() {
            return sequential::map(items, make);
        }
        let places: Vec<_> = items.into_iter().map(|item| Mutex::new((Some(item), None))).collect();
        each(places.len(), &|number| {
            let item = lock(&places[number]).0.take().expect("each number comes once");
            let made = make(item);
            lock(&places[number]).1 = Some(made);
        });
        let made =
            places.into_iter().map(|place| place.into_inner().unwrap_or_else(PoisonError::into_inner).1);
        made.map(|made| made.expect("each number has come")).collect()
    }

    fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
        place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the first number below `count` for which a condition holds.
    pub(crate) fn first(count: usize, holds: impl Fn(usize) -> bool + Sync) -> Option<usize> {
        let least = AtomicUsize::new(usize::MAX);
        each(count.div_ceil(RUN), &|run| {
            let start = run * RUN;
            if start < least.load(Ordering::Relaxed)
                && let Some(found) = (start..count.min(start + RUN)).find(|&number| holds(number))
            {
                least.fetch_min(found, Ordering::Relaxed);
            }
        });
        Some(least.into_inner()).filter(|&least| least < usize::MAX)
    }

    /// Sorts items, of which equal ones may change places.
    pub(crate) fn sort_unstable<T: Ord + Send>(items: &mut [T]) {
        if IS_ALONE.get() { items.sort_unstable() } else { items.par_sort_unstable() }
    }
}

/// The same on one thread.
#[cfg_attr(feature = "parallel", allow(dead_code, reason = "loops that work alone need some of it"))]
mod sequential {
    pub(crate) fn enter<T>(work: impl FnOnce() -> T) -> T {
        work()
    }

    pub(crate) fn current_num_threads() -> usize {
        1
    }

    pub(crate) fn current_thread_index() -> Option<usize> {
        None
    }

    pub(crate) fn join<A, B>(a: impl FnOnce() -> A, b: impl FnOnce() -> B) -> (A, B) {
        (a(), b())
    }

    pub(crate) fn each(count: usize, work: &dyn Fn(usize)) {
        (0..count).for_each(work);
    }

    pub(crate) fn map<T, R>(items: impl IntoIterator<Item = T>, make: impl Fn(T) -> R) -> Vec<R> {
        items.into_iter().map(make).collect()
    }

    pub(crate) fn first(count: usize, holds: impl Fn(usize) -> bool) -> Option<usize> {
        (0..count).find(|&number| holds(number))
    }

    pub(crate) fn sort_unstable<T: Ord>(items: &mut [T]) {
        items.sort_unstable();
    }
}
