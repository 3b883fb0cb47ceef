//! Paths, which JavaScript passes as a kind and numbers.

use crate::answers;
use crate::arguments::{Answer, poses, rows, wrong};
use bvh_query::{Motion, Polyline, Pose, RigidPath};
use js_sys::Float64Array;
use wasm_bindgen::prelude::*;

/// The kinds of `Motion` in `ts/motion.ts`.
const BETWEEN: u8 = 0;
const SCREW: u8 = 1;

/// Reads motions, each from the twelve numbers of a start and of an end; or screws, each from a start, a point, a direction,
/// an angle and a shift; or one path through poses.
pub(crate) fn read(kind: u8, numbers: &Float64Array) -> Answer<Vec<Box<dyn RigidPath + Sync>>> {
    let pose = |numbers: &[f64], name: &str, place: usize| {
        let row = numbers.first_chunk().ok_or_else(|| wrong(name, "expected 12 numbers, found fewer"))?;
        Pose::from_rows(row).map_err(|error| wrong(&format!("{name}[{place}]"), error))
    };
    let own = |motion: Motion| Box::new(motion) as Box<dyn RigidPath + Sync>;
    if kind == BETWEEN {
        let between = |(place, row): (usize, &[f64; 24])| {
            let (start, end) = (pose(&row[..12], "start", place)?, pose(&row[12..], "end", place)?);
            Motion::between(&start, &end).map(own).map_err(|error| wrong(&format!("motion[{place}]"), error))
        };
        return rows::<24>(numbers, "motion")?.iter().enumerate().map(between).collect();
    }
    if kind == SCREW {
        let screw = |(place, row): (usize, &[f64; 20])| {
            let start = pose(row, "start", place)?;
            let [.., px, py, pz, dx, dy, dz, angle, shift] = *row;
            let made = Motion::screw(&start, [px, py, pz], [dx, dy, dz], angle, shift);
            made.map(own).map_err(|error| wrong("screw", error))
        };
        return rows::<20>(numbers, "motion")?.iter().enumerate().map(screw).collect();
    }
    let polyline = Polyline::new(&poses(numbers, "poses")?).map_err(|error| wrong("poses", error))?;
    Ok(vec![Box::new(polyline)])
}

/// Returns the number of paths. `Motion` refuses invalid paths by this when it is made.
#[wasm_bindgen(js_name = pathCount)]
pub fn path_count(kind: u8, numbers: &Float64Array) -> Answer<usize> {
    Ok(read(kind, numbers)?.len())
}

/// The pose of each path at each time.
#[wasm_bindgen(js_name = pathPoses)]
pub fn path_poses(kind: u8, numbers: &Float64Array, times: &Float64Array) -> Answer<Float64Array> {
    let (paths, times) = (read(kind, numbers)?, rows::<1>(times, "times")?);
    let found: Vec<Pose> = paths.iter().flat_map(|path| times.iter().map(|&[t]| path.pose(t))).collect();
    Ok(answers::poses(&found))
}
