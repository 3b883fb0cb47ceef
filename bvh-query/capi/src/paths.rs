//! Paths: motions between poses, screws, polylines, and functions of the caller.

use crate::at_hand::MESHES;
use crate::entry::entry;
use crate::input::triple;
use crate::output::One;
use crate::poses::{pose, poses};
use crate::status::{Failure, Status};
use crate::table::{Kind, Table};
use crate::types::{MeshHandle, PathHandle, PoseRows};
use bvh_query::{Motion, Path, Polyline, Pose, motion_reach};
use std::ffi::c_void;
use std::sync::{Arc, Mutex, PoisonError};

/// All paths that are open.
pub(crate) static PATHS: Table<Arc<PathValue>> = Table::new(Kind::Path);

/// `cbvh_pose_function`.
type PoseFunction = unsafe extern "C" fn(user: *mut c_void, t: f64, pose: *mut PoseRows) -> i32;
/// `cbvh_sagitta_function`.
type SagittaFunction = unsafe extern "C" fn(user: *mut c_void, radius: f64, t0: f64, t1: f64) -> f64;

/// What the handle of a path stands for.
pub(crate) enum PathValue {
    Motion(Box<Motion>),
    Polyline(Polyline),
    Caller(CallerPath),
}

/// Functions of the caller.
pub(crate) struct CallerPath {
    pose: PoseFunction,
    sagitta: SagittaFunction,
    user: *mut c_void,
}

// SAFETY: the header asks for functions that may be called on any thread, and on several at the same time.
unsafe impl Send for CallerPath {}
// SAFETY: as above.
unsafe impl Sync for CallerPath {}

impl CallerPath {
    fn pose(&self, t: f64) -> Result<Pose, Failure> {
        // What the function leaves as it is, is no pose.
        let mut found = PoseRows { rows: [f64::NAN; 12] };
        // SAFETY: the header asks for a function that may be called so.
        let code = unsafe { (self.pose)(self.user, t, &mut found) };
        if code != 0 {
            let message = format!("path: expected a pose at t = {t}, found the code {code} of its function");
            return Err(Failure::new(Status::CallbackFailed, message));
        }
        let wrong =
            |error| Failure::new(Status::CallbackFailed, format!("path: the pose at t = {t}: {error}"));
        Pose::from_rows(&found.rows).map_err(wrong)
    }
}

/// A path while a question about it runs: it keeps the first failure, after which it stands still.
pub(crate) struct AskedPath {
    path: Arc<PathValue>,
    failure: Mutex<Option<Failure>>,
}

impl AskedPath {
    pub(crate) fn new(name: &str, path: PathHandle) -> Result<Self, Failure> {
        Ok(Self { path: PATHS.share(name, path.id)?, failure: Mutex::new(None) })
    }

    /// Reads the handles of many paths.
    pub(crate) fn many(name: &str, paths: &[PathHandle]) -> Result<Vec<Self>, Failure> {
        let numbered = paths.iter().enumerate();
        numbered.map(|(number, &path)| Self::new(&format!("{name}[{number}]"), path)).collect()
    }

    /// Returns the failure of a function of the caller, which takes the place of any answer.
    pub(crate) fn failure(&self) -> Result<(), Failure> {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        failure.take().map_or(Ok(()), Err)
    }

    fn has_failed(&self) -> bool {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }
}

impl Path for AskedPath {
    fn pose(&self, t: f64) -> Pose {
        match &*self.path {
            PathValue::Motion(motion) => motion.pose(t),
            PathValue::Polyline(polyline) => polyline.pose(t),
            // After a failure the answer does not matter, only that it comes soon: what stands still is soon decided.
            PathValue::Caller(_) if self.has_failed() => Pose::IDENTITY,
            PathValue::Caller(caller) => caller.pose(t).unwrap_or_else(|failure| {
                let mut kept = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
                kept.get_or_insert(failure);
                Pose::IDENTITY
            }),
        }
    }

    fn sagitta(&self, radius: f64, t0: f64, t1: f64) -> f64 {
        match &*self.path {
            PathValue::Motion(motion) => motion.sagitta(radius, t0, t1),
            PathValue::Polyline(polyline) => polyline.sagitta(radius, t0, t1),
            PathValue::Caller(_) if self.has_failed() => 0.0,
            // SAFETY: the header asks for a function that may be called so.
            PathValue::Caller(caller) => unsafe { (caller.sagitta)(caller.user, radius, t0, t1) },
        }
    }
}

/// Makes a path, and hands it out.
///
/// # Safety
/// As for `One::new`.
unsafe fn make(path: *mut PathHandle, make: impl FnOnce() -> Result<PathValue, Failure>) -> i32 {
    entry(|| {
        // SAFETY: the caller vouches for it.
        let mut out = unsafe { One::new("path", path) }?;
        out.set(PathHandle { id: 0 });
        out.set(PathHandle { id: PATHS.insert(Arc::new(make()?))? });
        Ok(())
    })
}

/// `cbvh_path_between`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_between(
    start: *const PoseRows,
    end: *const PoseRows,
    path: *mut PathHandle,
) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let (start, end) = unsafe { (pose("start", start)?, pose("end", end)?) };
        let made = Motion::between(&start, &end).map_err(|error| Failure::from(error).at("start and end"));
        made.map(|motion| PathValue::Motion(Box::new(motion)))
    };
    // SAFETY: the header asks for it.
    unsafe { make(path, made) }
}

/// `cbvh_path_screw`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_screw(
    start: *const PoseRows,
    point: *const f64,
    direction: *const f64,
    angle: f64,
    shift: f64,
    path: *mut PathHandle,
) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let (start, point, direction) =
            unsafe { (pose("start", start)?, triple("point", point)?, triple("direction", direction)?) };
        Ok(PathValue::Motion(Box::new(Motion::screw(&start, point, direction, angle, shift)?)))
    };
    // SAFETY: the header asks for it.
    unsafe { make(path, made) }
}

/// `cbvh_path_polyline`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_polyline(
    through: *const PoseRows,
    count: usize,
    path: *mut PathHandle,
) -> i32 {
    let made = || {
        let mut knots = Vec::new();
        // SAFETY: the header asks for it.
        unsafe { poses("poses", through, count, &mut knots) }?;
        let made = Polyline::new(&knots).map_err(|error| Failure::from(error).at("poses"));
        made.map(PathValue::Polyline)
    };
    // SAFETY: the header asks for it.
    unsafe { make(path, made) }
}

/// `cbvh_path_from_functions`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_from_functions(
    pose_function: Option<PoseFunction>,
    sagitta_function: Option<SagittaFunction>,
    user: *mut c_void,
    path: *mut PathHandle,
) -> i32 {
    let made = || {
        let missing = |name: &str| Failure::argument(name, "a function", "NULL");
        let pose = pose_function.ok_or_else(|| missing("pose"))?;
        let sagitta = sagitta_function.ok_or_else(|| missing("sagitta"))?;
        Ok(PathValue::Caller(CallerPath { pose, sagitta, user }))
    };
    // SAFETY: the header asks for it.
    unsafe { make(path, made) }
}

/// `cbvh_path_free`.
#[unsafe(no_mangle)]
pub extern "C" fn cbvh_path_free(path: PathHandle) -> i32 {
    entry(|| if path.id == 0 { Ok(()) } else { PATHS.remove("path", path.id).map(drop) })
}

/// `cbvh_path_pose`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_path_pose(path: PathHandle, t: f64, result: *mut PoseRows) -> i32 {
    entry(|| {
        let asked = AskedPath::new("path", path)?;
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("result", result) }?;
        if !(0.0..=1.0).contains(&t) {
            return Err(Failure::argument("t", "a time from 0 to 1", t));
        }
        let pose = asked.pose(t);
        asked.failure()?;
        out.set(PoseRows::from(&pose));
        Ok(())
    })
}

/// `cbvh_path_reach`.
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
        // SAFETY: the header asks for it.
        let mut out = unsafe { One::new("bound", bound) }?;
        if !(0.0..=1.0).contains(&t0) {
            return Err(Failure::argument("t0", "a time from 0 to 1", t0));
        }
        if !(t0..=1.0).contains(&t1) {
            return Err(Failure::argument("t1", "a time from t0 to 1", t1));
        }
        let reach = motion_reach(&shape, &asked, t0, t1);
        asked.failure()?;
        out.set(reach);
        Ok(())
    })
}
