//! Poses: reads, checks and composes them.

use crate::entry::{entry, write};
use crate::input::{each, value};
use crate::status::Failure;
use crate::types::PoseRows;
use bvh_query::{Pose, PoseError};

/// Makes a pose of what is `at` some arguments, and writes it.
///
/// # Safety
/// As for `write`.
unsafe fn make<G>(
    (result, at): (*mut PoseRows, &str),
    read: impl FnOnce() -> Result<G, Failure>,
    make: impl FnOnce(G) -> Result<Pose, PoseError>,
) -> i32 {
    let made = || {
        let made = make(read()?).map_err(|error| Failure::from(error).at(at))?;
        Ok(PoseRows::from(&made))
    };
    // SAFETY: the caller vouches for it.
    entry(|| unsafe { write("result", result, made) })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_check(pose: *const PoseRows) -> i32 {
    // SAFETY: the header asks for it.
    entry(|| unsafe { read("pose", pose) }.map(drop))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_from_quaternion(
    quaternion: *const f64,
    translation: *const f64,
    result: *mut PoseRows,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = || {
            let quaternion: [f64; 4] = value("quaternion", quaternion.cast())?;
            Ok((quaternion, value("translation", translation.cast())?))
        };
        make((result, "quaternion and translation"), read, |(quaternion, translation)| {
            Pose::from_quaternion(quaternion, translation)
        })
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_nearest(pose: *const PoseRows, result: *mut PoseRows) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        make(
            (result, "pose"),
            || value("pose", pose),
            |PoseRows { rows: m }| {
                Pose::nearest(
                    [[m[0], m[1], m[2]], [m[4], m[5], m[6]], [m[8], m[9], m[10]]],
                    [m[3], m[7], m[11]],
                )
            },
        )
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_inverse(pose: *const PoseRows, result: *mut PoseRows) -> i32 {
    // SAFETY: the header asks for it.
    unsafe { make((result, "the inverse"), || read("pose", pose), |pose| pose.inverse()) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_then(
    first: *const PoseRows,
    next: *const PoseRows,
    result: *mut PoseRows,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = || Ok((read("first", first)?, read("next", next)?));
        make((result, "both poses"), read, |(first, next)| first.then(&next))
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn cbvh_pose_relative(
    world_a: *const PoseRows,
    world_b: *const PoseRows,
    result: *mut PoseRows,
) -> i32 {
    // SAFETY: the header asks for it.
    unsafe {
        let read = || Ok((read("world_a", world_a)?, read("world_b", world_b)?));
        make((result, "both poses"), read, |(a, b)| Pose::relative(&a, &b))
    }
}

/// Reads one pose.
///
/// # Safety
/// As for `value`.
pub(crate) unsafe fn read(name: &str, pose: *const PoseRows) -> Result<Pose, Failure> {
    // SAFETY: the caller vouches for it.
    let rows = unsafe { value(name, pose) }?;
    Pose::from_rows(&rows.rows).map_err(|error| Failure::from(error).at(name))
}

/// Reads poses into memory that is used again and again.
///
/// # Safety
/// As for `array`.
pub(crate) unsafe fn read_many<'a>(
    name: &str,
    poses: *const PoseRows,
    count: usize,
    into: &'a mut Vec<Pose>,
) -> Result<&'a [Pose], Failure> {
    // SAFETY: the caller vouches for it.
    unsafe { each(name, poses, count, into, |pose: &PoseRows| Ok(Pose::from_rows(&pose.rows)?)) }
}
