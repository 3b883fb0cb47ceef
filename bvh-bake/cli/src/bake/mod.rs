//! `cbvh bake`: bakes meshes into one file.

mod arguments;
mod report;
mod screen;
mod shard;
mod stages;

pub(crate) use arguments::{BakeArguments, effort};
pub(crate) use report::Report;
pub(crate) use shard::Shard;

use crate::console::{self, Failure, names};
use crate::process::{resident, signals};
use bvh_bake::{BakeError, FileBake, Options, Outcome, Progress, Step};
use screen::Screen;
use stages::{StageLine, Stages};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Bakes the inputs into one output.
pub(crate) fn run(arguments: &BakeArguments) -> Result<(), Failure> {
    let (options, file_options) = prepare(arguments)?;
    let Some(output) = &arguments.output else {
        return Err(Failure::Usage("expected --output <OUT.cbvh>, found none (see --help)".into()));
    };
    if arguments.shard.is_some() || arguments.out_manifest.is_some() {
        return Err(Failure::Usage(
            "--shard and --out-manifest require --manifest or one folder (see --help)".into(),
        ));
    }
    let progress = Progress::default();
    let screen = Screen::new(&progress, arguments.quiet);
    let tells_stages = arguments.json && !arguments.quiet;
    signals::remove_unfinished_files(screen.spinner())?;
    let baked =
        bake(&arguments.inputs, output, &options, &file_options, &progress, &mut |event| match event {
            Event::Begins(step) => screen.begin(step, &progress),
            Event::Ended(line) if tells_stages => screen.suspend(|| console::tell_json(line)),
            Event::Ended(_) => {}
        });
    screen.clear();
    let report = baked.map_err(|error| Failure::from_bake(&names(&arguments.inputs), &error))?;
    match &report.warning {
        Some(warning) if tells_stages => console::tell_json(&serde_json::json!({ "warning": warning })),
        Some(warning) if !arguments.json => console::tell_line(&format!("warning: {warning}")),
        _ => {}
    }
    if arguments.json {
        console::json(&report)
    } else if arguments.quiet {
        Ok(())
    } else {
        console::text(&report.to_text())
    }
}

/// How each bake of the command goes about files.
#[derive(Clone)]
pub(crate) struct FileOptions {
    /// Whether to bake even if the output is up to date.
    pub(crate) force: bool,
    /// The budget of memory, in bytes.
    pub(crate) max_memory: Option<u64>,
    /// The folder for scratch files; `None` for that of the output.
    pub(crate) scratch: Option<PathBuf>,
    /// Whether glTF files may name buffers outside their own folders.
    pub(crate) allow_outside: bool,
}

/// Turns the arguments into options, and applies those that concern the whole process: threads and memory.
pub(crate) fn prepare(arguments: &BakeArguments) -> Result<(Options, FileOptions), Failure> {
    if arguments.max_error.is_some() && !arguments.layout.is_quantized() {
        return Err(Failure::Usage("--max-error requires --triangles quantized (see --help)".into()));
    }
    if arguments.output.as_deref().is_some_and(|output| output == std::path::Path::new("-")) {
        return Err(Failure::Usage(
            "-o: expected a file, found -; an output appears whole or not at all, so it cannot be standard output (write \
             ./- for a file of this name)"
                .into(),
        ));
    }
    if let Some(folder) = &arguments.scratch {
        std::fs::read_dir(folder).map_err(|error| Failure::from_folder(folder, &error))?;
    }
    if let Some(jobs) = arguments.jobs {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build_global();
        pool.map_err(|error| Failure::System(format!("--jobs {jobs}: cannot start threads: {error}")))?;
    }
    if arguments.max_memory.is_some() {
        resident::give_back();
    }
    let options = arguments
        .layout
        .to_options()
        .max_error(arguments.max_error)
        .effort(arguments.effort)
        .split_objects(arguments.split_objects)
        .scene(arguments.scene)
        .ids(!arguments.no_ids)
        .turning_slabs(!arguments.no_turning_slabs)
        .topology(!arguments.no_topology);
    let file_options = FileOptions {
        force: arguments.force,
        max_memory: arguments.max_memory,
        scratch: arguments.scratch.clone(),
        allow_outside: arguments.allow_outside,
    };
    Ok((options, file_options))
}

/// What can be observed of a bake while it runs.
pub(crate) enum Event<'a> {
    /// A step begins.
    Begins(Step),
    /// A stage has ended for all objects.
    Ended(&'a StageLine),
}

/// Bakes meshes into one file and reports on it.
pub(crate) fn bake(
    inputs: &[PathBuf],
    output: &Path,
    options: &Options,
    file_options: &FileOptions,
    progress: &Progress,
    watch: &mut dyn FnMut(Event),
) -> Result<Report, BakeError> {
    let start = Instant::now();
    let mut stages = Stages::new(progress);
    let FileOptions { force, max_memory, scratch, allow_outside } = file_options.clone();
    let bake = FileBake::new(inputs, output).options(options.clone()).force(force).max_memory(max_memory);
    let bake = bake.allow_outside(allow_outside).scratch(scratch).progress(progress).on_step(|step| {
        watch(Event::Begins(step));
        stages.begin(step, &mut |line| watch(Event::Ended(line)));
    });
    let outcome = bake.run()?;
    let stages = match outcome {
        Outcome::Baked(_) => stages.finish(&mut |line| watch(Event::Ended(line))),
        Outcome::UpToDate(_) => Vec::new(),
    };
    let seconds = start.elapsed().as_secs_f64();
    Ok(Report::new(names(inputs), output.display().to_string(), options, &outcome, stages, seconds))
}
