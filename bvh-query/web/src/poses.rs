//! Makes poses from positions and quaternions, from nearly rigid matrices, and from the poses of two bodies in the world.

use crate::answers;
use crate::arguments::{Answer, poses, rows, same_count, wrong};
use bvh_query::{Pose, PoseError};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// Makes a pose from each row. An error names the row.
fn each<T>(rows: Vec<T>, name: &str, make: impl Fn(T) -> Result<Pose, PoseError>) -> Answer<Float64Array> {
    let made = rows.into_iter().enumerate();
    let made = made.map(|(place, row)| make(row).map_err(|error| wrong(&format!("{name}[{place}]"), error)));
    Ok(answers::poses(&made.collect::<Answer<Vec<Pose>>>()?))
}

/// Poses from N positions and N quaternions, the real part last.
#[wasm_bindgen(js_name = posesOf)]
pub fn poses_of(positions: &Float64Array, quaternions: &Float64Array) -> Answer<Float64Array> {
    let (positions, quaternions) = (rows::<3>(positions, "position")?, rows::<4>(quaternions, "quaternion")?);
    same_count("quaternion", quaternions.len(), "position", positions.len())?;
    let both = quaternions.into_iter().zip(positions).collect();
    each(both, "quaternion", |(quaternion, position)| Pose::from_quaternion(quaternion, position))
}

/// The poses nearest to rows of twelve numbers.
#[wasm_bindgen(js_name = nearestPoses)]
pub fn nearest_poses(matrices: &Float64Array) -> Answer<Float64Array> {
    each(rows::<12>(matrices, "rows")?, "rows", |m| {
        let row = |k: usize| [m[4 * k], m[4 * k + 1], m[4 * k + 2]];
        Pose::nearest([0, 1, 2].map(row), [m[3], m[7], m[11]])
    })
}

/// Poses of B in A's frame, from those of both in the world.
#[wasm_bindgen(js_name = relativePoses)]
pub fn relative_poses(a: &Float64Array, b: &Float64Array) -> Answer<Float64Array> {
    let (a, b) = (poses(a, "a")?, poses(b, "b")?);
    same_count("b", b.len(), "a", a.len())?;
    each(a.into_iter().zip(b).collect(), "b", |(a, b)| Pose::relative(&a, &b))
}
