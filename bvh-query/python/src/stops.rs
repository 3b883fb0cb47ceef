//! What ends questions early: flags of Python code, times, and signals such as that of Ctrl-C.
//!
//! A question on the thread that asks it looks at the flags of that thread itself, and lets Python handle signals now and then, which
//! only Python's main thread can do. A question on all cores is told to stop by the thread that waits for it.

use crate::arguments::number;
use bvh_query::Stop;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How long questions may run before Python handles signals.
pub(crate) const PATIENCE: Duration = Duration::from_millis(50);

/// How long it should be from one look at the time to the next. How many reads of a flag that takes is known from those so far.
const LOOK: Duration = Duration::from_millis(2);
/// The reads before the first look, so that a short question does without one, and the most between two looks.
const FIRST_READS: u32 = 8;
const MOST_READS: u32 = 64;

/// A flag, and the time that sets it, too.
#[derive(Clone)]
struct Entered {
    flag: Arc<AtomicBool>,
    until: Option<Instant>,
}

impl Entered {
    fn is_set(&self) -> bool {
        // Nothing else is read that depends on it.
        self.flag.load(Ordering::Relaxed) || self.until.is_some_and(|until| Instant::now() >= until)
    }
}

thread_local! {
    /// The flags of the blocks that this thread is in.
    static ENTERED: RefCell<Vec<Entered>> = const { RefCell::new(Vec::new()) };
    /// How long the question of this thread has run.
    static WATCH: Cell<Watch> = const { Cell::new(Watch::NEW) };
    /// What a handler of a signal raised during that question.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

#[derive(Clone, Copy)]
struct Watch {
    /// When Python handled signals, or when the time was looked at first.
    handled: Option<Instant>,
    /// Reads of the flag since then.
    reads: u32,
    /// The number of them at which the time is looked at.
    look_at: u32,
}

impl Watch {
    const NEW: Self = Self { handled: None, reads: 0, look_at: FIRST_READS };

    /// Counts a read, and returns whether Python should handle signals.
    fn is_due(&mut self) -> bool {
        self.reads += 1;
        if self.reads < self.look_at {
            return false;
        }
        let now = Instant::now();
        let passed = self.handled.map(|handled| now.duration_since(handled));
        if let Some(passed) = passed.filter(|&passed| passed <= PATIENCE) {
            let reads = LOOK.as_secs_f64() / passed.as_secs_f64() * f64::from(self.reads);
            self.look_at = self.reads + (reads as u32).clamp(1, MOST_READS);
            return false;
        }
        *self = Self { handled: Some(now), ..Self::NEW };
        passed.is_some()
    }
}

/// Asks a question on this thread, which ends if a handler of a signal raises an exception.
pub(crate) fn watched<T>(ask: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    // Handlers and paths of Python code may ask questions during a question.
    let outer = (WATCH.replace(Watch::NEW), RAISED.take());
    let answer = ask();
    WATCH.set(outer.0);
    RAISED.replace(outer.1).map_or(answer, Err)
}

/// Returns what stops questions on the thread that asks them.
pub(crate) fn of_this_thread() -> Arc<dyn Stop> {
    Arc::new(is_stopped)
}

fn is_stopped() -> bool {
    ENTERED.with_borrow(|entered| entered.iter().any(Entered::is_set)) || is_interrupted()
}

/// Lets Python handle signals if it is time.
fn is_interrupted() -> bool {
    let mut watch = WATCH.get();
    let is_due = watch.is_due();
    WATCH.set(watch);
    if is_due && let Err(raised) = Python::attach(|py| py.check_signals()) {
        RAISED.set(Some(raised));
    }
    RAISED.with_borrow(Option::is_some)
}

/// A question that other threads answer, as the one that waits for them sees it.
pub(crate) struct Elsewhere {
    entered: Vec<Entered>,
    interrupted: Arc<AtomicBool>,
}

impl Elsewhere {
    pub(crate) fn new() -> Self {
        Self { entered: ENTERED.with_borrow(Vec::clone), interrupted: Arc::default() }
    }

    /// Returns what stops the question.
    pub(crate) fn stop(&self) -> Arc<dyn Stop> {
        let (entered, interrupted) = (self.entered.clone(), Arc::clone(&self.interrupted));
        Arc::new(move || interrupted.load(Ordering::Relaxed) || entered.iter().any(Entered::is_set))
    }

    /// Lets Python handle signals, and stops the question if a handler raises an exception.
    pub(crate) fn handle_signals(&self) -> PyResult<()> {
        Python::attach(|py| py.check_signals())
            .inspect_err(|_| self.interrupted.store(true, Ordering::Relaxed))
    }
}

/// A flag that stops questions.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Flag {
    flag: Arc<AtomicBool>,
    after: Option<Duration>,
}

#[pymethods]
impl Flag {
    #[new]
    fn new(after: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let length = |after| {
            let after = number(after, "after")?;
            if after.is_nan() || after < 0.0 {
                let message = format!("after: expected seconds of at least 0, found {after}");
                return Err(PyValueError::new_err(message));
            }
            Ok(Duration::try_from_secs_f64(after).unwrap_or(Duration::MAX))
        };
        Ok(Self { flag: Arc::default(), after: after.map(length).transpose()? })
    }

    fn set(&self, is_set: bool) {
        self.flag.store(is_set, Ordering::Relaxed);
    }

    fn is_set(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }

    /// Begins a block, in which the flag stops questions of this thread.
    fn enter(&self) {
        // A time too far ahead for the clock never comes.
        let until = self.after.and_then(|after| Instant::now().checked_add(after));
        let entered = Entered { flag: Arc::clone(&self.flag), until };
        ENTERED.with_borrow_mut(|all| all.push(entered));
    }

    /// Ends the last block of this thread with the flag.
    fn leave(&self) -> PyResult<()> {
        ENTERED.with_borrow_mut(|all| {
            let last = all.iter().rposition(|entered| Arc::ptr_eq(&entered.flag, &self.flag));
            let last = last.ok_or_else(|| {
                PyRuntimeError::new_err("stop: expected the end of its block on the thread that began it")
            })?;
            all.remove(last);
            Ok(())
        })
    }
}
