//! Copies JavaScript arrays, and refuses those of the wrong length.

use crate::time_limit;
use bvh_query::{BackendError, Pose, Querier};
use js_sys::{Float64Array, Uint8Array, Uint32Array};
use std::cell::Cell;
use std::fmt::Display;
use wasm_bindgen::JsError;

pub(crate) type Answer<T> = Result<T, JsError>;

/// Returns an `Error` with a message from the library.
pub(crate) fn refused(error: impl Display) -> JsError {
    JsError::new(&error.to_string())
}

/// Returns an `Error` about an argument.
pub(crate) fn wrong(name: &str, error: impl Display) -> JsError {
    JsError::new(&format!("{name}: {error}"))
}

/// Returns `count` zeros, or an `Error` if memory runs out.
pub(crate) fn room<T: Clone>(name: &str, zero: T, count: usize) -> Answer<Vec<T>> {
    let mut room = Vec::new();
    let bytes = count.saturating_mul(size_of::<T>());
    room.try_reserve_exact(count)
        .map_err(|_| wrong(name, format_args!("expected room in memory, found none for {bytes} bytes")))?;
    room.resize(count, zero);
    Ok(room)
}

/// Copies rows of N numbers.
pub(crate) fn rows<const N: usize>(array: &Float64Array, name: &str) -> Answer<Vec<[f64; N]>> {
    let length = array.length() as usize;
    if !length.is_multiple_of(N) {
        return Err(wrong(
            name,
            format_args!("expected {N} numbers for each, found {length} numbers in all"),
        ));
    }
    let mut rows = room(name, [0.0; N], length / N)?;
    array.copy_to(rows.as_flattened_mut());
    Ok(rows)
}

/// Copies one row of N numbers.
pub(crate) fn row<const N: usize>(array: &Float64Array, name: &str) -> Answer<[f64; N]> {
    let length = array.length() as usize;
    if length != N {
        return Err(wrong(name, format_args!("expected {N} numbers, found {length}")));
    }
    let mut row = [0.0; N];
    array.copy_to(&mut row);
    Ok(row)
}

/// Refuses arrays of different lengths.
pub(crate) fn same_count(name: &str, found: usize, other: &str, expected: usize) -> Answer<()> {
    if found == expected {
        return Ok(());
    }
    Err(wrong(name, format_args!("expected as many as {other}, {expected}, found {found}")))
}

/// Copies numbers of vertices or instances.
pub(crate) fn integers(array: &Uint32Array, name: &str) -> Answer<Vec<u32>> {
    let mut numbers = room(name, 0, array.length() as usize)?;
    array.copy_to(&mut numbers);
    Ok(numbers)
}

/// Copies the bytes of a file.
pub(crate) fn bytes(array: &Uint8Array, name: &str) -> Answer<Vec<u8>> {
    let mut bytes = room(name, 0, array.length() as usize)?;
    array.copy_to(&mut bytes);
    Ok(bytes)
}

/// Makes poses from rows of twelve numbers.
pub(crate) fn poses(array: &Float64Array, name: &str) -> Answer<Vec<Pose>> {
    let rows = rows::<12>(array, name)?;
    let mut poses = room(name, Pose::IDENTITY, rows.len())?;
    for (place, (pose, row)) in poses.iter_mut().zip(&rows).enumerate() {
        *pose = Pose::from_rows(row).map_err(|error| wrong(&format!("{name}[{place}]"), error))?;
    }
    Ok(poses)
}

/// Makes a pose from twelve numbers.
pub(crate) fn pose(array: &Float64Array, name: &str) -> Answer<Pose> {
    Pose::from_rows(&row(array, name)?).map_err(|error| wrong(name, error))
}

/// The pose of a mesh: the identity where none is given.
pub(crate) fn pose_or_identity(array: Option<&Float64Array>) -> Answer<Pose> {
    array.map_or(Ok(Pose::IDENTITY), |array| pose(array, "pose"))
}

thread_local! {
    /// The querier of the last question, with the memory that it has allocated.
    static QUERIER: Cell<Option<Querier>> = const { Cell::new(None) };
}

/// Lends the querier to a question.
pub(crate) fn with_querier<T>(ask: impl FnOnce(&mut Querier) -> Answer<T>) -> Answer<T> {
    let known = QUERIER.take().map_or_else(Querier::new, Ok);
    let mut querier = known.map_err(|error: BackendError| refused(error))?;
    querier.set_stop(time_limit::start());
    let answer = ask(&mut querier);
    QUERIER.set(Some(querier));
    answer
}
