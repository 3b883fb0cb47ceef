//! Paths: the motions and polylines of the library, and paths that Python code defines.

use crate::answers::Answers;
use crate::arguments::{many_poses, number, numbers, pose, poses, shape_error, vector};
use crate::asking::{detached, locked};
use crate::errors::value_error;
use bvh_query::floats::with_default_floats;
use bvh_query::{Motion, Polyline, Pose, RigidPath};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::{PyIndexError, PyRecursionError, PyValueError};
use pyo3::prelude::*;
use std::cell::Cell;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex};

/// A path of the library.
#[derive(Clone)]
#[expect(clippy::large_enum_variant, reason = "nearly all paths are motions, which stand side by side")]
pub(crate) enum Own {
    Motion(Motion),
    Polyline(Arc<Polyline>),
}

impl Own {
    fn path(&self) -> &(dyn RigidPath + Sync) {
        match self {
            Self::Motion(motion) => motion,
            Self::Polyline(polyline) => &**polyline,
        }
    }
}

/// Paths of the library: one alone, or many.
#[pyclass(frozen, module = "cbvh._cbvh")]
pub(crate) struct Paths {
    paths: Vec<Own>,
    one: bool,
}

impl Paths {
    fn of(path: Own) -> Self {
        Self { paths: vec![path], one: true }
    }
}

#[pymethods]
impl Paths {
    /// Motions between starts and ends of shape (4, 4) or (N, 4, 4).
    #[staticmethod]
    fn between(start: &Bound<'_, PyAny>, end: &Bound<'_, PyAny>) -> PyResult<Self> {
        let made =
            poses(start, "start")?.with("start", (&poses(end, "end")?, "end"), |start, end, place| {
                Motion::between(start, end).map(Own::Motion).map_err(|error| value_error(&place(), error))
            })?;
        Ok(Self { paths: made.rows, one: made.one })
    }

    /// A screw motion.
    #[staticmethod]
    fn screw(
        start: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        angle: &Bound<'_, PyAny>,
        shift: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (angle, shift) = (number(angle, "angle")?, number(shift, "shift")?);
        let start = pose(start, "start")?;
        let (point, direction) = (vector(point, "point")?, vector(direction, "direction")?);
        let motion = with_default_floats(|_| Motion::screw(&start, point, direction, angle, shift));
        motion.map(|motion| Self::of(Own::Motion(motion))).map_err(|error| value_error("screw", error))
    }

    /// A path through poses.
    #[staticmethod]
    fn through(knots: &Bound<'_, PyAny>) -> PyResult<Self> {
        let knots = many_poses(knots, "poses")?;
        let polyline =
            with_default_floats(|_| Polyline::new(&knots)).map_err(|error| value_error("poses", error))?;
        Ok(Self::of(Own::Polyline(Arc::new(polyline))))
    }

    /// Whether this is one path alone.
    fn is_one(&self) -> bool {
        self.one
    }

    /// How many paths there are.
    fn count(&self) -> usize {
        self.paths.len()
    }

    /// One of the paths.
    fn path(&self, number: usize) -> PyResult<Self> {
        let found = || format!("motion: expected a number below {}, found {number}", self.paths.len());
        let path = self.paths.get(number).ok_or_else(|| PyIndexError::new_err(found()))?;
        Ok(Self::of(path.clone()))
    }

    /// The poses of each path at each time, of shape () or (T,): shape (N * T, 4, 4).
    fn poses<'py>(&self, t: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let times = numbers(t, "t")?;
        if times.ndim() > 1 {
            return Err(shape_error("t", "() or (T,)", times.shape()));
        }
        let times = times.as_slice()?.to_vec();
        let of = |path: &Own| times.iter().map(|&t| path.path().pose(t)).collect::<Vec<_>>();
        let found: Vec<Pose> = detached(t.py(), || self.paths.iter().flat_map(of).collect());
        Answers { py: t.py(), one: false }.poses(&found)
    }

    /// The sagitta of each path.
    fn sagittas<'py>(
        &self,
        radius: &Bound<'py, PyAny>,
        t0: &Bound<'py, PyAny>,
        t1: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = radius.py();
        let (radius, t0, t1) = (number(radius, "radius")?, number(t0, "t0")?, number(t1, "t1")?);
        let of = |path: &Own| path.path().sagitta(radius, t0, t1);
        let found: Vec<f64> = detached(py, || self.paths.iter().map(of).collect());
        Answers { py, one: self.one }.values(found.into_iter())
    }
}

/// How many poses of a path of Python code are kept, since questions ask for the ends of an interval again and again.
const MOST_KEPT: usize = 1024;

/// A path that Python code answers for: an object with the methods `pose` and `sagitta`. An exception ends the question: a
/// `RigidPath` cannot fail, so the exception is kept here, and the question unwound up to [`until_raised`].
pub(crate) struct Called {
    object: Py<PyAny>,
    /// Never locked while Python code runs.
    known: Mutex<HashMap<u64, Pose>>,
    raised: Mutex<Option<PyErr>>,
}

/// How many questions may ask a path that asks a question that asks a path, and so on. Each takes some kilobytes of the
/// stack, which Python does not count.
const MOST_NESTED: u32 = 64;

thread_local! {
    static NESTED: Cell<u32> = const { Cell::new(0) };
}

/// A call of Python code by a question, as long as it runs.
struct Nested;

impl Nested {
    fn new() -> PyResult<Self> {
        let depth = NESTED.get();
        if depth >= MOST_NESTED {
            let found = "path: expected queries in paths that queries call at most 64 deep, found more";
            return Err(PyRecursionError::new_err(found));
        }
        NESTED.set(depth + 1);
        Ok(Self)
    }
}

impl Drop for Nested {
    fn drop(&mut self) {
        NESTED.set(NESTED.get() - 1);
    }
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
        let _nested = Nested::new()?;
        Python::attach(|py| {
            pose(&self.object.bind(py).call_method1("pose", (t,))?, &format!("path.pose({t:?})"))
        })
    }

    fn ask_sagitta(&self, radius: f64, t0: f64, t1: f64) -> PyResult<f64> {
        let _nested = Nested::new()?;
        Python::attach(|py| {
            let found = self.object.bind(py).call_method1("sagitta", (radius, t0, t1))?;
            let place = || format!("path.sagitta({radius:?}, {t0:?}, {t1:?})");
            let length = number(&found, &place())?;
            let refused = |expected: String| {
                Err(PyValueError::new_err(format!("{}: expected {expected}, found {length:?}", place())))
            };
            if length.is_nan() || length < 0.0 {
                return refused("a length of at least 0".to_owned());
            }
            if length == f64::INFINITY && t1 - t0 <= SHORTEST {
                return refused("a finite length, at least where so little time passes".to_owned());
            }
            Ok(length)
        })
    }

    /// Refuses a sagitta that what the path itself says of the middle of the interval contradicts.
    fn check_middle(&self, length: f64, radius: f64, t0: f64, t1: f64) -> PyResult<f64> {
        let [start, middle, end] = [t0, t0 + (t1 - t0) / 2.0, t1].map(|t| self.pose(t));
        let shown = least_departure(&start, &middle, &end, radius);
        if shown <= length {
            return Ok(length);
        }
        let place = format!("path.sagitta({radius:?}, {t0:?}, {t1:?})");
        let shown =
            format!("at least {shown:?}, by which path.pose departs in the middle from a straight path");
        Err(PyValueError::new_err(format!("{place}: expected {shown}, found {length:?}")))
    }

    /// Ends the question.
    fn end(&self, error: PyErr) -> ! {
        locked(&self.raised).replace(error);
        // Unlike a panic, this prints nothing.
        resume_unwind(Box::new(Raised))
    }
}

impl RigidPath for Called {
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
        let length = self.ask_sagitta(radius, t0, t1);
        let checked = length.and_then(|length| self.check_middle(length, radius, t0, t1));
        checked.unwrap_or_else(|error| self.end(error))
    }
}

/// The shortest interval that a question looks at, as a part of the time. Without a finite bound for it, there is no
/// answer.
const SHORTEST: f64 = 1.0 / (1u64 << 46) as f64;

/// The roundings of [`least_departure`], as a fraction of the magnitudes: sums of at most twelve terms, of a few roundings of
/// 2^-53 each.
const ROUNDING: f64 = 1.0 / (1u64 << 47) as f64;

/// Returns how far a point at most `radius` from the origin of the body's frame certainly is, in the middle pose, from the
/// middle of where it is in the other two, in mesh units. It looks at the origin and at six points on the axes.
fn least_departure(start: &Pose, middle: &Pose, end: &Pose, radius: f64) -> f64 {
    let off = |s: f64, m: f64, e: f64| m - (s / 2.0 + e / 2.0);
    let (s, m, e) = (start.translation(), middle.translation(), end.translation());
    let moved = [0, 1, 2].map(|k| off(s[k], m[k], e[k]));
    let (r, q, p) = (start.rotation(), middle.rotation(), end.rotation());
    let length = |side: f64, axis: usize| {
        let along = |k: usize| moved[k] + side * off(r[k][axis], q[k][axis], p[k][axis]);
        [0, 1, 2].map(|k| along(k).powi(2)).iter().sum::<f64>().sqrt()
    };
    let sides = [0.0, radius, -radius];
    let most = sides.iter().flat_map(|&side| (0..3).map(move |axis| length(side, axis))).fold(0.0, f64::max);
    let translations = [s, m, e].as_flattened().iter().map(|x| x.abs()).sum::<f64>();
    (most - ROUNDING * (translations + 3.0 * radius)).max(0.0)
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
                Ok(own) => paths.extend(own.get().paths.iter().cloned().map(Self::Own)),
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

    pub(crate) fn path(&self) -> &(dyn RigidPath + Sync) {
        match self {
            Self::Own(own) => own.path(),
            Self::Called(called) => called,
        }
    }
}

impl RigidPath for AnyPath {
    fn pose(&self, t: f64) -> Pose {
        self.path().pose(t)
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        self.path().sagitta(radius, t0, t1)
    }

    fn slides(&self, t0: f64, t1: f64) -> bool {
        self.path().slides(t0, t1)
    }
}
