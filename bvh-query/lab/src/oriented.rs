//! Oriented bounds: what slabs in frames of their own subtrees would save in tests, and what they would cost.
//!
//! All counts are of complete walks in memory over one tree, that of dop26-u8-wide, whose distance is known from the start.
//! Only the bounds differ: their directions, the frames in which these stand, and the codes. The page
//! `notebook/oriented.md` has the results.

mod bounds;
mod boxes;
#[path = "../../src/traverse/forms.rs"]
#[allow(dead_code, reason = "queries use all of it, and the study two functions")]
mod forms;
mod frame;
mod report;
mod scene;
mod tree;
mod variant;
mod vector;
mod walk;

use crate::arguments::OrientedArguments;
use crate::{Failure, output};
use scene::Scene;
use std::fs;
use variant::VARIANTS;

/// Balls have the largest number of triangles divided by these.
const BALL_PARTS: [u64; 3] = [100, 10, 1];

pub(crate) fn run(arguments: &OrientedArguments) -> Result<String, Failure> {
    let mut rows = Vec::new();
    let list = fs::read_to_string(&arguments.pairs)?;
    let poses = usize::from(arguments.poses);
    for line in list.lines().filter(|line| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [kind, name, a, b] = words[..] else {
            return Err(format!("expected a kind, a name and two meshes, found {line:?}").into());
        };
        output::tell(&format!("{name}: baking and asking"));
        let [a, b] = [a, b].map(|file| arguments.meshes.join(file));
        let scene = Scene::of_files(kind, name, &a, &b, poses)?;
        rows.extend(scene.rows(&VARIANTS));
    }
    for part in BALL_PARTS.iter().filter(|_| arguments.largest > 0) {
        let size = arguments.largest / part;
        output::tell(&format!("ball of {size} triangles: baking and asking"));
        rows.extend(Scene::of_ball(size, poses)?.rows(&VARIANTS));
    }
    fs::create_dir_all(&arguments.out)?;
    fs::write(arguments.out.join("oriented.csv"), report::csv(&rows))?;
    let page = format!("{}\n{}", report::page(&rows), report::set_up());
    fs::write(arguments.out.join("oriented.md"), &page)?;
    Ok(page)
}
