//! Paths: motions between poses, screws, polylines, and functions of the caller.

use crate::at_hand::MESHES;
use crate::entry::{caller_floats, entry, hand_out, write};
use crate::input::{Plain, reserve, text, value};
use crate::mesh::{Release, call_release};
use crate::poses;
use crate::status::{Failure, Status};
use crate::table::{Kind, Table};
use crate::types::{MeshHandle, PathHandle, PoseRows};
use bvh_query::floats::FloatState;
use bvh_query::{Motion, Polyline, Pose, RigidPath, path_reach};
use std::cell::RefCell;
use std::ffi::{c_char, c_void};
use std::sync::{Arc, Mutex, PoisonError};

/// All paths that are open.
static PATHS: Table<Arc<PathValue>> = Table::new(Kind::Path);

/// Writes the pose at a time.
pub type PoseFunction = Option<unsafe extern "C" fn(user: *mut c_void, t: f64, pose: *mut PoseRows) -> i32>;
/// Returns a bound of the sagitta between two times.
pub type SagittaFunction =
    Option<unsafe extern "C" fn(user: *mut c_void, radius: f64, t0: f64, t1: f64) -> f64>;

/// What the handle of a path stands for.
pub(crate) enum PathValue {
    Known(Box<dyn RigidPath + Send + Sync>),
    Caller(CallerPath),
}

/// Functions of the caller.
pub(crate) struct CallerPath {
    pose: unsafe extern "C" fn(*mut c_void, f64, *mut PoseRows) -> i32,
    sagitta: unsafe extern "C" fn(*mut c_void, f64, f64, f64) -> f64,
    release: Release,
    user: *mut c_void,
}

// SAFETY: the header asks for functions that may be called on any thread, and on several at the same time.
unsafe impl Send for CallerPath {}
// SAFETY: as above.
unsafe impl Sync for CallerPath {}

impl Drop for CallerPath {
    fn drop(&mut self) {
        // SAFETY: the header asks for a function that may be called here.
        unsafe { call_release(self.release, self.user) };
    }
}

thread_local! {
    /// Why the function of the caller that this thread is in is about to fail.
    static REASON: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// The failure of a function of the caller, with the reason that it gave.
fn callback_failure(message: String) -> Failure {
    let failure = Failure::new(Status::CallbackFailed, message);
    match REASON.with(RefCell::take) {
        Some(reason) => Failure { message: format!("{}: {reason}", failure.message), ..failure },
        None => failure,
    }
}

impl CallerPath {
    /// Calls a function of the caller in the state of floating-point arithmetic that the question was asked in.
    ///
    /// # Safety
    /// `call` does no more than call the function.
    unsafe fn call<R>(floats: FloatState, call: impl FnOnce() -> R) -> R {
        REASON.with(RefCell::take);
        // SAFETY: the caller vouches for it.
        unsafe { floats.run(call) }
    }

    fn pose(&self, floats: FloatState, t: f64) -> Result<Pose, Failure> {
        // What the function leaves as it is, is no pose.
        let mut found = PoseRows::NONE;
        let into = &raw mut found;
        // SAFETY: the header asks for a function that may be called so.
        let code = unsafe { Self::call(floats, || (self.pose)(self.user, t, into)) };
        if code != 0 {
            let what = format!("path: expected a pose at t = {t}, found the code {code} of its function");
            return Err(callback_failure(what));
        }
        let wrong =
            |error| Failure::new(Status::CallbackFailed, format!("path: the pose at t = {t}: {error}"));
        Pose::from_rows(&found.rows).map_err(wrong)
    }

    fn sagitta(&self, floats: FloatState, radius: f64, t0: f64, t1: f64) -> Result<f64, Failure> {
        // SAFETY: the header asks for a function that may be called so.
        let found = unsafe { Self::call(floats, || (self.sagitta)(self.user, radius, t0, t1)) };
        if found >= 0.0 {
            return Ok(found);
        }
        let expected = "sagitta: expected a bound of at least 0";
        Err(callback_failure(format!("{expected} from t = {t0} to t = {t1}, found {found}")))
    }
}

/// A path while a question about it runs: it keeps the first failure, after which it stands still.
pub(crate) struct AskedPath {
    path: Arc<PathValue>,
    failure: Mutex<Option<Failure>>,
    /// The state of who asks, in which functions of the caller are called on every thread.
    floats: FloatState,
}

impl AskedPath {
    pub(crate) fn new(name: &str, path: PathHandle) -> Result<Self, Failure> {
        Ok(Self { path: PATHS.share(name, path.id)?, failure: Mutex::new(None), floats: caller_floats() })
    }

    /// Reads the handles of many paths.
    pub(crate) fn many(name: &str, paths: &[PathHandle]) -> Result<Vec<Self>, Failure> {
        let mut asked = Vec::new();
        reserve(name, paths.len(), &mut asked)?;
        for (number, &path) in paths.iter().enumerate() {
            asked.push(Self::new(&format!("{name}[{number}]"), path)?);
        }
        Ok(asked)
    }

    /// Returns the failure of a function of the caller, which takes the place of any answer.
    pub(crate) fn failure(&self) -> Result<(), Failure> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.take().map_or(Ok(()), Err)
    }

    fn has_failed(&self) -> bool {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// Keeps a failure, and returns what stands for the answer.
    fn fail<R>(&self, failure: Failure, instead: R) -> R {
        let mut kept = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        kept.get_or_insert(failure);
        instead
    }
}

impl RigidPath for AskedPath {
    fn pose(&self, t: f64) -> Pose {
        match &*self.path {
            PathValue::Known(path) => path.pose(t),
            // After a failure the answer does not matter, only that it comes soon: what stands still is soon decided.
            PathValue::Caller(_) if self.has_failed() => Pose::IDENTITY,
            PathValue::Caller(caller) => {
                caller.pose(self.floats, t).unwrap_or_else(|failure| self.fail(failure, Pose::IDENTITY))
            }
        }
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        match &*self.path {
            PathValue::Known(path) => path.sagitta(radius, t0, t1),
            PathValue::Caller(_) if self.has_failed() => 0.0,
            PathValue::Caller(caller) => {
                let found = caller.sagitta(self.floats, radius, t0, t1);
                found.unwrap_or_else(|failure| self.fail(failure, 0.0))
            }
        }
    }

    fn slides(&self, t0: f64, t1: f64) -> bool {
        match &*self.path {
            PathValue::Known(path) => path.slides(t0, t1),
            PathValue::Caller(_) => false,
        }
    }
}

/// Makes a path, and hands it out.
///
/// # Safety
/// As for `hand_out`.
unsafe fn make(path: *mut PathHandle, make: impl FnOnce() -> Result<PathValue, Failure>) -> i32 {
    // SAFETY: the caller vouches for it.
    unsafe { hand_out(("path", path), &PATHS, || Ok(Arc::new(make()?))) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_between(
    start: *const PoseRows,
    end: *const PoseRows,
    path: *mut PathHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        make(path, || {
            let (start, end) = (poses::read("start", start)?, poses::read("end", end)?);
            let made = Motion::between(&start, &end);
            Ok(PathValue::Known(Box::new(made.map_err(|error| Failure::from(error).at("start and end"))?)))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_screw(
    start: *const PoseRows,
    point: *const f64,
    direction: *const f64,
    angle: f64,
    shift: f64,
    path: *mut PathHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        make(path, || {
            let start = poses::read("start", start)?;
            let (point, direction) = (value("point", point.cast())?, value("direction", direction.cast())?);
            Ok(PathValue::Known(Box::new(Motion::screw(&start, point, direction, angle, shift)?)))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_polyline(
    poses: *const PoseRows,
    count: usize,
    path: *mut PathHandle,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        make(path, || {
            let mut knots = Vec::new();
            let made = Polyline::new(poses::read_many("poses", poses, count, &mut knots)?);
            Ok(PathValue::Known(Box::new(made.map_err(|error| Failure::from(error).at("poses"))?)))
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_from_functions(
    pose: PoseFunction,
    sagitta: SagittaFunction,
    release: Option<unsafe extern "C" fn(user: *mut c_void)>,
    user: *mut c_void,
    path: *mut PathHandle,
) -> i32 {
    let missing = |name: &str| Failure::argument(name, "a function", "NULL");
    let made = || {
        let pose = pose.ok_or_else(|| missing("pose"))?;
        let sagitta = sagitta.ok_or_else(|| missing("sagitta"))?;
        // A failure releases nothing: nothing can fail after this.
        Ok(PathValue::Caller(CallerPath { pose, sagitta, release, user }))
    };
    // SAFETY: the header asks for it.
    unsafe { make(path, made) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_callback_message(message: *const c_char) -> i32 {
    entry(|| {
        // SAFETY: the header asks for it.
        let message = unsafe { text("message", message) }?;
        REASON.with(|reason| *reason.borrow_mut() = Some(message.to_owned()));
        Ok(())
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn cbvh_path_free(path: PathHandle) -> i32 {
    entry(|| PATHS.free("path", path.id))
}

fn check_time(name: &str, t: f64, (from, expected): (f64, &str)) -> Result<(), Failure> {
    if (from..=1.0).contains(&t) { Ok(()) } else { Err(Failure::argument(name, expected, t)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_pose(path: PathHandle, t: f64, result: *mut PoseRows) -> i32 {
    entry(|| {
        let asked = AskedPath::new("path", path)?;
        let pose = || {
            check_time("t", t, (0.0, "a time from 0 to 1"))?;
            let pose = asked.pose(t);
            asked.failure()?;
            Ok(PoseRows::from(&pose))
        };
        // SAFETY: the header asks for it.
        unsafe { write("result", result, pose) }
    })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_reach(
    b: MeshHandle,
    path: PathHandle,
    t0: f64,
    t1: f64,
    bound: *mut f64,
) -> i32 {
    entry(|| {
        let (shape, asked) = (MESHES.share("b", b.id)?, AskedPath::new("path", path)?);
        let reach = || {
            check_time("t0", t0, (0.0, "a time from 0 to 1"))?;
            check_time("t1", t1, (t0, "a time from t0 to 1"))?;
            let reach = path_reach(&shape, &asked, t0, t1);
            asked.failure()?;
            Ok(reach)
        };
        // SAFETY: the header asks for it.
        unsafe { write("bound", bound, reach) }
    })
}
