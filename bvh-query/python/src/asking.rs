//! Asks questions one after the other or on all cores, without Python's lock and so that Ctrl-C ends them.
//!
//! What uses all cores runs in a pool of threads of this module. A process that was forked has none of the threads of the
//! one it comes from, so that it starts its own.

use crate::arguments::reserved;
use crate::errors::backend_error;
use bvh_query::Querier;
use bvh_query::floats::with_default_floats;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Queriers that are not in use. Their memory is that of the largest questions so far. To move one takes longer than a short
/// question, so they stay where they are.
static QUERIERS: Mutex<Vec<Box<Querier>>> = Mutex::new(Vec::new());

/// Calls `ask` with a querier that no other thread has.
fn with_querier<T>(ask: impl FnOnce(&mut Querier) -> PyResult<T>) -> PyResult<T> {
    let kept = QUERIERS.lock().ok().and_then(|mut queriers| queriers.pop());
    let mut querier = match kept {
        Some(querier) => querier,
        None => Box::new(Querier::new().map_err(backend_error)?),
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

/// Works without Python's lock, and in the default state of floating-point arithmetic: a library that is loaded into
/// Python may have changed that of its threads.
pub(crate) fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(|| with_default_floats(|_| work()))
}

/// How many questions are asked before the time is looked at.
const QUESTIONS: usize = 64;
const QUESTIONS_ON_ALL_CORES: usize = 1024;

/// How long questions may run before Python handles signals, such as that of Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);

/// Asks about all items, one after the other.
pub(crate) fn one_by_one<P: Sync, T: Send>(
    py: Python<'_>,
    items: &[P],
    ask: impl Fn(&mut Querier, &P) -> PyResult<T> + Sync,
) -> PyResult<Vec<T>> {
    detached(py, || {
        with_querier(|querier| {
            in_turns(items, QUESTIONS, |items| items.iter().map(|item| ask(querier, item)).collect())
        })
    })
}

/// Asks about all items by questions about many, which use all cores.
pub(crate) fn on_all_cores<P: Sync, T: Send>(
    py: Python<'_>,
    items: &[P],
    ask: impl Fn(&[P]) -> PyResult<Vec<T>> + Sync,
) -> PyResult<Vec<T>> {
    detached(py, || in_turns(items, QUESTIONS_ON_ALL_CORES, |items| on_pool(|| ask(items))?))
}

/// The pool of a process.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Runs something that uses all cores, or as many as the environment variable `RAYON_NUM_THREADS` says.
pub(crate) fn on_pool<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
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
    Ok(pool.install(work))
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
