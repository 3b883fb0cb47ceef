//! Asks questions one after the other or on all cores, without Python's lock and so that Ctrl-C ends them.
//!
//! What uses all cores runs in a pool of threads of this module. A process that was forked has none of the threads of the
//! one it comes from, so that it starts its own.

use crate::arguments::reserved;
use crate::errors::backend_error;
use crate::stops::{Elsewhere, PATIENCE, of_this_thread, watched};
use bvh_query::floats::with_default_floats;
use bvh_query::{Querier, Stop};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Queriers that are not in use. Their memory is that of the largest questions so far. To move one takes longer than a short
/// question, so they stay where they are.
static QUERIERS: Mutex<Vec<Box<Querier>>> = Mutex::new(Vec::new());

/// Calls `ask` with a querier that no other thread has.
fn with_querier<T>(ask: impl FnOnce(&mut Querier) -> PyResult<T>) -> PyResult<T> {
    let kept = QUERIERS.lock().ok().and_then(|mut queriers| queriers.pop());
    let mut querier = match kept {
        Some(querier) => querier,
        None => {
            let mut made = Box::new(Querier::new().map_err(backend_error)?);
            made.set_stop(Some(of_this_thread()));
            made
        }
    };
    let answer = ask(&mut querier);
    // After an error, which is rare, a querier may be in the middle of a question.
    if answer.is_ok()
        && let Ok(mut queriers) = QUERIERS.lock()
    {
        queriers.push(querier);
    }
    answer
}

/// Locks a mutex. A panic elsewhere leaves what these guard whole.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Works without Python's lock, and in the default state of floating-point arithmetic: a library that is loaded into
/// Python may have changed that of its threads.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(|| with_default_floats(|_| work()))
}

/// Asks without Python's lock, as `detached` does. An exception that a handler of a signal raises ends the question.
pub(crate) fn asked<T: Send>(py: Python<'_>, ask: impl FnOnce() -> PyResult<T> + Send) -> PyResult<T> {
    detached(py, || watched(ask))
}

/// How many questions are asked before the time is looked at.
const QUESTIONS: usize = 64;
const QUESTIONS_ON_ALL_CORES: usize = 1024;

/// Asks about all items, one after the other.
pub(crate) fn one_by_one<P: Sync, T: Send>(
    py: Python<'_>,
    items: &[P],
    ask: impl Fn(&mut Querier, &P) -> PyResult<T> + Sync,
) -> PyResult<Vec<T>> {
    asked(py, || {
        with_querier(|querier| {
            in_turns(items, QUESTIONS, |items| items.iter().map(|item| ask(querier, item)).collect())
        })
    })
}

/// Asks about all items by questions about many, which use all cores. `ask` gets what stops them.
pub(crate) fn on_all_cores<P: Sync, T: Send>(
    py: Python<'_>,
    items: &[P],
    ask: impl Fn(Arc<dyn Stop>, &[P]) -> PyResult<Vec<T>> + Sync,
) -> PyResult<Vec<T>> {
    asked(py, || in_turns(items, QUESTIONS_ON_ALL_CORES, |items| on_pool(|stop| ask(stop, items))?))
}

/// The pool of a process.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Asks on all cores or on this thread, with what stops the question.
pub(crate) fn on_threads<T: Send>(
    parallel: bool,
    ask: impl FnOnce(Arc<dyn Stop>) -> T + Send,
) -> PyResult<T> {
    if parallel { on_pool(ask) } else { Ok(ask(of_this_thread())) }
}

/// Runs something that uses all cores, or as many as the environment variable `RAYON_NUM_THREADS` says. While this thread waits for it,
/// Python handles signals.
pub(crate) fn on_pool<T: Send>(work: impl FnOnce(Arc<dyn Stop>) -> T + Send) -> PyResult<T> {
    let own = std::process::id();
    let pool = {
        let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some((process, pool)) if *process == own => Arc::clone(pool),
            _ => {
                let made = ThreadPoolBuilder::new().build();
                let made = made.map_err(|error| PyRuntimeError::new_err(format!("threads: {error}")))?;
                let pool = Arc::new(made);
                // To end the pool of another process would wait for threads that are not here.
                std::mem::forget(kept.replace((own, Arc::clone(&pool))));
                pool
            }
        }
    };
    let (elsewhere, done, is_done) = (Elsewhere::new(), Mutex::new(None), Condvar::new());
    let stop = elsewhere.stop();
    let mut raised = None;
    pool.in_place_scope(|scope| {
        scope.spawn(|_| {
            let found = catch_unwind(AssertUnwindSafe(|| work(stop)));
            *locked(&done) = Some(found);
            is_done.notify_one();
        });
        let mut found = locked(&done);
        while found.is_none() {
            found = is_done.wait_timeout(found, PATIENCE).unwrap_or_else(PoisonError::into_inner).0;
            if found.is_none() && raised.is_none() {
                // Handlers may run for as long as they like.
                drop(found);
                raised = elsewhere.handle_signals().err();
                found = locked(&done);
            }
        }
    });
    let found = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    match (raised, found) {
        (Some(raised), _) => Err(raised),
        (None, Some(Ok(found))) => Ok(found),
        (None, Some(Err(panic))) => resume_unwind(panic),
        (None, None) => unreachable!("this thread has waited for it"),
    }
}

/// Asks about so many items at a time, and lets Python handle signals in between.
pub(crate) fn in_turns<P, T>(
    items: &[P],
    size: usize,
    mut ask: impl FnMut(&[P]) -> PyResult<Vec<T>>,
) -> PyResult<Vec<T>> {
    if items.len() <= size {
        return ask(items);
    }
    let mut answers = reserved(items.len())?;
    let mut handled = Instant::now();
    for turn in items.chunks(size) {
        answers.extend(ask(turn)?);
        if handled.elapsed() > PATIENCE {
            Python::attach(|py| py.check_signals())?;
            handled = Instant::now();
        }
    }
    Ok(answers)
}
