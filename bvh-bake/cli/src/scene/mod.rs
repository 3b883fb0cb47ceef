//! `cbvh scene`: asks a scene of many placed meshes about frames of moving ones, timing each frame.

mod arguments;
mod asked;
mod file;
mod frames;
mod record;

pub(crate) use arguments::SceneArguments;

use crate::asking;
use crate::asking::mesh::is_baked;
use crate::console::{self, Failure};
use asked::{Question, Run};
use record::Record;
use std::io::{IsTerminal, stdout};

/// Answers the question about each frame.
pub(crate) fn run(arguments: &SceneArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.isa)?;
    let question = Question::new(arguments)?;
    let (mut scene, mut frames) = if is_baked(&arguments.scene)? {
        let mut scene = file::open(&arguments.scene, backend)?;
        let frames = if let Some(path) = &arguments.frames {
            frames::read(Some(path), &scene.names_of_moving())?
        } else {
            scene.moving.clear();
            frames::as_it_stands()
        };
        (scene, frames)
    } else {
        let text = file::read(&arguments.scene)?;
        let frames = frames::read(arguments.frames.as_deref(), &text.moving)?;
        (file::load(&arguments.scene, &text, &arguments.layout, backend)?, frames)
    };
    if arguments.limit > 0 {
        frames.truncate(arguments.limit);
    }
    let run = if arguments.jobs > 1 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(arguments.jobs)).build();
        let pool = pool.map_err(|error| {
            Failure::System(format!("--jobs {}: cannot start threads: {error}", arguments.jobs))
        })?;
        scene.scene.set_parallel(true);
        pool.install(|| Run::new(&mut scene, &frames, &question, arguments))
    } else {
        Run::new(&mut scene, &frames, &question, arguments)
    }?;
    if let Some(out) = &arguments.out {
        let written = bvh_bake::write_atomically(out, record::raw(&run).as_bytes());
        written.map_err(|error| Failure::from_bake(&out.display().to_string(), &error))?;
    }
    if arguments.list {
        return console::text(&record::list(&scene, &question, &run));
    }
    let record = Record::new(arguments, &scene, backend, &question, &run);
    if arguments.json || !stdout().is_terminal() {
        console::json(&record)
    } else {
        console::text(&record.summary())
    }
}
