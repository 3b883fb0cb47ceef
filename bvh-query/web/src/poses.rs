//! Makes poses: from positions and quaternions, of matrices that are not quite rigid, and of one body in the frame of another.

use crate::answers;
use crate::arguments::{Answer, poses, rows, same_count, wrong};
use bvh_query::{Pose, PoseError};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// Makes a pose of each row, and names the row that makes none.
fn each<T>(rows: Vec<T>, name: &str, make: impl Fn(T) -> Result<Pose, PoseError>) -> Answer<Float64Array> {
    let made = rows.into_iter().enumerate();
    let made = made.map(|(place, row)| make(row).map_err(|error| wrong(&format!("{name}[{place}]"), error)));
    Ok(answers::poses(&made.collect::<Answer<Vec<Pose>>>()?))
}

/// Poses of N positions and as many quaternions, whose real part is last.
#[wasm_bindgen(js_name = posesOf)]
pub fn poses_of(positions: &Float64Array, quaternions: &Float64Array) -> Answer<Float64Array> {
    let (positions, quaternions) =
        (rows::<3>(positions, "positions")?, rows::<4>(quaternions, "quaternions")?);
    same_count("quaternions", quaternions.len(), "positions", positions.len())?;
    let both = quaternions.into_iter().zip(positions).collect();
    each(both, "quaternions", |(quaternion, position)| Pose::from_quaternion(quaternion, position))
}

/// The nearest poses of rows of twelve numbers.
#[wasm_bindgen(js_name = nearestPoses)]
pub fn nearest_poses(matrices: &Float64Array) -> Answer<Float64Array> {
    each(rows::<12>(matrices, "matrices")?, "matrices", |m| {
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
