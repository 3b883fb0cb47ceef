//! Poses: reads, checks and composes them.

use crate::entry::entry;
use crate::input::{array, reserve, triple, value};
use crate::output::One;
use crate::status::Failure;
use crate::types::PoseRows;
use bvh_query::Pose;

/// Makes a pose, and writes it.
///
/// # Safety
/// As for `One::new`.
unsafe fn make(result: *mut PoseRows, make: impl FnOnce() -> Result<Pose, Failure>) -> i32 {
    entry(|| {
        // SAFETY: the caller vouches for it.
        let mut out = unsafe { One::new("result", result) }?;
        out.set(PoseRows::from(&make()?));
        Ok(())
    })
}

/// `cbvh_pose_check`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_check(checked: *const PoseRows) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe { pose("pose", checked) }.map(drop))
}

/// `cbvh_pose_from_quaternion`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_from_quaternion(
    quaternion: *const f64,
    translation: *const f64,
    result: *mut PoseRows,
) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let (quaternion, translation) =
            unsafe { (array("quaternion", quaternion, 4)?, triple("translation", translation)?) };
        let [x, y, z, w] = [0, 1, 2, 3].map(|k| quaternion[k]);
        let made = Pose::from_quaternion([x, y, z, w], translation);
        made.map_err(|error| Failure::from(error).at("quaternion and translation"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(result, made) }
}

/// `cbvh_pose_nearest`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_nearest(rounded: *const PoseRows, result: *mut PoseRows) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let m = unsafe { value("pose", rounded) }?.rows;
        let rotation = [[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]];
        Pose::nearest(rotation, [m[3], m[7], m[11]]).map_err(|error| Failure::from(error).at("pose"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(result, made) }
}

/// `cbvh_pose_inverse`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_inverse(of: *const PoseRows, result: *mut PoseRows) -> i32 {
    // SAFETY: the header asks for it.
    let made =
        || unsafe { pose("pose", of) }?.inverse().map_err(|error| Failure::from(error).at("the inverse"));
    // SAFETY: the header asks for it.
    unsafe { make(result, made) }
}

/// `cbvh_pose_then`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_then(
    first: *const PoseRows,
    next: *const PoseRows,
    result: *mut PoseRows,
) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let (first, next) = unsafe { (pose("first", first)?, pose("next", next)?) };
        first.then(&next).map_err(|error| Failure::from(error).at("both poses"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(result, made) }
}

/// `cbvh_pose_relative`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_relative(
    world_a: *const PoseRows,
    world_b: *const PoseRows,
    result: *mut PoseRows,
) -> i32 {
    let made = || {
        // SAFETY: the header asks for it.
        let (a, b) = unsafe { (pose("world_a", world_a)?, pose("world_b", world_b)?) };
        Pose::relative(&a, &b).map_err(|error| Failure::from(error).at("both poses"))
    };
    // SAFETY: the header asks for it.
    unsafe { make(result, made) }
}

fn pose_of(rows: &PoseRows) -> Result<Pose, Failure> {
    Ok(Pose::from_rows(&rows.rows)?)
}

/// Reads one pose.
///
/// # Safety
/// As for `value`.
pub(crate) unsafe fn pose(name: &str, pointer: *const PoseRows) -> Result<Pose, Failure> {
    // SAFETY: the caller vouches for it.
    let rows = unsafe { value(name, pointer) }?;
    pose_of(&rows).map_err(|failure| failure.at(name))
}

/// Reads one pose, or takes none for the identity.
///
/// # Safety
/// As for `value`.
pub(crate) unsafe fn pose_or_identity(name: &str, pointer: *const PoseRows) -> Result<Pose, Failure> {
    // SAFETY: the caller vouches for it.
    if pointer.is_null() { Ok(Pose::IDENTITY) } else { unsafe { pose(name, pointer) } }
}

/// Reads poses into memory that is used again and again.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn poses(
    name: &str,
    pointer: *const PoseRows,
    count: usize,
    into: &mut Vec<Pose>,
) -> Result<(), Failure> {
    // SAFETY: the caller vouches for it.
    let rows = unsafe { array(name, pointer, count) }?;
    into.clear();
    reserve(name, count, into)?;
    for (number, rows) in rows.iter().enumerate() {
        into.push(pose_of(rows).map_err(|failure| failure.at(format_args!("{name}[{number}]")))?);
    }
    Ok(())
}
