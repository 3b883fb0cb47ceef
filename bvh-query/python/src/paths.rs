//! Paths: the library's own motions and polylines, and paths that Python code answers for.

use crate::arrays::{array, one_pose, pose_rows, poses};
use crate::errors::path_error;
use bvh_query::{Motion, Path, Polyline, Pose};
use numpy::{PyArray1, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A path of the library.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "nearly all paths are motions, which stand side by side")]
pub(crate) enum Own {
    Motion(Motion),
    Polyline(Arc<Polyline>),
}

impl Own {
    fn path(&self) -> &(dyn Path + Sync) {
        match self {
            Self::Motion(motion) => motion,
            Self::Polyline(polyline) => &**polyline,
        }
    }
}

/// Many paths of the library.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Paths(Vec<Own>);

#[pymethods]
impl Paths {
    /// Motions between as many starts as ends.
    #[staticmethod]
    fn between(starts: PyReadonlyArray3<'_, f64>, ends: PyReadonlyArray3<'_, f64>) -> PyResult<Self> {
        let (starts, ends) = (poses(&starts, "start")?, poses(&ends, "end")?);
        if starts.len() != ends.len() {
            let found = format!("end: expected {} poses as for start, found {}", starts.len(), ends.len());
            return Err(PyValueError::new_err(found));
        }
        let numbered = starts.iter().zip(&ends).enumerate();
        let motion = |(number, (start, end)): (usize, (&Pose, &Pose))| {
            let place = || format!("start[{number}] and end[{number}]");
            Motion::between(start, end).map(Own::Motion).map_err(|error| path_error(&place(), &error))
        };
        Ok(Self(numbered.map(motion).collect::<PyResult<_>>()?))
    }

    /// A screw motion.
    #[staticmethod]
    fn screw(
        start: PyReadonlyArray2<'_, f64>,
        point: [f64; 3],
        direction: [f64; 3],
        angle: f64,
        shift: f64,
    ) -> PyResult<Self> {
        let start = one_pose(&start, "start")?;
        let motion = Motion::screw(&start, point, direction, angle, shift);
        motion.map(|motion| Self(vec![Own::Motion(motion)])).map_err(|error| path_error("screw", &error))
    }

    /// A path through poses.
    #[staticmethod]
    fn through(knots: PyReadonlyArray3<'_, f64>) -> PyResult<Self> {
        let polyline =
            Polyline::new(&poses(&knots, "poses")?).map_err(|error| path_error("poses", &error))?;
        Ok(Self(vec![Own::Polyline(Arc::new(polyline))]))
    }

    /// How many paths there are.
    fn count(&self) -> usize {
        self.0.len()
    }

    /// One of the paths.
    fn one(&self, number: usize) -> PyResult<Self> {
        let found = || format!("motion: expected a number below {}, found {number}", self.0.len());
        Ok(Self(vec![self.0.get(number).ok_or_else(|| PyIndexError::new_err(found()))?.clone()]))
    }

    /// The poses of each path at each time: a row for each path and time.
    fn poses<'py>(
        &self,
        py: Python<'py>,
        times: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let times = times.as_slice()?;
        let of = |path: &Own| times.iter().map(|&t| path.path().pose(t)).collect::<Vec<_>>();
        pose_rows(py, self.0.iter().flat_map(of))
    }

    /// The sagitta of each path.
    fn sagittas<'py>(&self, py: Python<'py>, radius: f64, t0: f64, t1: f64) -> Bound<'py, PyArray1<f64>> {
        array(py, self.0.iter().map(|path| path.path().sagitta(radius, t0, t1)))
    }
}

/// How many poses of a path of Python code are kept, since questions ask for the ends of an interval again and again.
const MOST_KEPT: usize = 1024;

/// A path that Python code answers for: an object with the methods `pose` and `sagitta`. An exception ends the question: a
/// `Path` cannot fail, so the exception is kept here, and the question unwound up to [`until_raised`].
pub(crate) struct Called {
    object: Py<PyAny>,
    /// Never locked while Python code runs.
    known: Mutex<HashMap<u64, Pose>>,
    raised: Mutex<Option<PyErr>>,
}

/// What unwinds a question when a path raises an exception.
struct Raised;

/// Asks a question about some paths, and returns the exception that one of them ended it with, if one did.
pub(crate) fn until_raised<'a, T>(
    mut paths: impl Iterator<Item = &'a AnyPath>,
    ask: impl FnOnce() -> T,
) -> Result<T, PyErr> {
    // What is borrowed is thrown away after an exception: queriers and clones of scenes.
    catch_unwind(AssertUnwindSafe(ask)).or_else(|payload| match paths.find_map(AnyPath::raised) {
        Some(error) if payload.is::<Raised>() => Err(error),
        _ => resume_unwind(payload),
    })
}

impl Called {
    fn new(object: Py<PyAny>) -> Self {
        Self { object, known: Mutex::default(), raised: Mutex::default() }
    }

    fn ask_pose(&self, t: f64) -> PyResult<Pose> {
        Python::attach(|py| {
            let found = self.object.bind(py).call_method1("pose", (t,))?;
            let found: PyReadonlyArray2<'_, f64> = found.extract()?;
            one_pose(&found, &format!("path.pose({t:?})"))
        })
    }

    fn ask_sagitta(&self, radius: f64, t0: f64, t1: f64) -> PyResult<f64> {
        Python::attach(|py| self.object.bind(py).call_method1("sagitta", (radius, t0, t1))?.extract())
    }

    /// Ends the question.
    fn end(&self, error: PyErr) -> ! {
        locked(&self.raised).replace(error);
        // Unlike a panic, this prints nothing.
        resume_unwind(Box::new(Raised))
    }
}

/// Locks a mutex. A panic elsewhere leaves what these guard whole.
pub(crate) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Path for Called {
    fn pose(&self, t: f64) -> Pose {
        if let Some(&pose) = locked(&self.known).get(&t.to_bits()) {
            return pose;
        }
        let pose = self.ask_pose(t).unwrap_or_else(|error| self.end(error));
        let mut known = locked(&self.known);
        if known.len() >= MOST_KEPT {
            known.clear();
        }
        known.insert(t.to_bits(), pose);
        pose
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        self.ask_sagitta(radius, t0, t1).unwrap_or_else(|error| self.end(error))
    }
}

/// A path of either kind.
#[expect(clippy::large_enum_variant, reason = "nearly all paths are motions, which stand side by side")]
pub(crate) enum AnyPath {
    Own(Own),
    Called(Called),
}

impl AnyPath {
    /// Reads a list of `Paths`, which may be many each, and of objects of Python code.
    pub(crate) fn read(list: Vec<Bound<'_, PyAny>>) -> Vec<Self> {
        let mut paths = Vec::new();
        for item in list {
            match item.cast::<Paths>() {
                Ok(own) => paths.extend(own.get().0.iter().cloned().map(Self::Own)),
                Err(_) => paths.push(Self::Called(Called::new(item.unbind()))),
            }
        }
        paths
    }

    /// Returns whether Python code answers for the path. It is called on the thread of the question alone: on threads of a
    /// pool, it might wait for what the pool itself has to do.
    pub(crate) fn is_called(&self) -> bool {
        matches!(self, Self::Called(_))
    }

    /// Takes the exception that ended the path.
    fn raised(&self) -> Option<PyErr> {
        match self {
            Self::Own(_) => None,
            Self::Called(called) => locked(&called.raised).take(),
        }
    }

    pub(crate) fn path(&self) -> &(dyn Path + Sync) {
        match self {
            Self::Own(own) => own.path(),
            Self::Called(called) => called,
        }
    }
}

impl Path for AnyPath {
    fn pose(&self, t: f64) -> Pose {
        self.path().pose(t)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        self.path().sagitta(radius, t0, t1)
    }
}
