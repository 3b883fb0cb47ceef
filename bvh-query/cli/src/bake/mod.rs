//! `cbvh bake`: bakes meshes into one file.

mod report;
mod screen;

use crate::console::{self, Failure, names, word};
use crate::options::{LayoutArguments, Shard, not_negative, positive, size, threads};
use crate::process;
use bvh_bake::{BakeError, Effort, FileBake, Options, Outcome};
use clap::Args;
pub(crate) use report::Report;
use report::Stages;
use screen::Screen;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Returns whether the command line is about many assets: a manifest, or one folder.
pub(crate) fn are_many(arguments: &BakeArguments) -> bool {
    arguments.manifest.is_some() || matches!(&arguments.inputs[..], [input] if input.is_dir())
}

/// Bakes the inputs into one output.
pub(crate) fn run(arguments: &BakeArguments) -> Result<(), Failure> {
    let options = prepare(arguments)?;
    let Some(output) = &arguments.output else {
        return Err(Failure::usage("expected --output <OUT.cbvh>, found none"));
    };
    if arguments.shard.is_some() || arguments.out_manifest.is_some() {
        return Err(Failure::usage("--shard and --out-manifest require --manifest or one folder"));
    }
    let screen = Screen::new(arguments.json, arguments.quiet);
    process::remove_unfinished_files(&screen.spinner)?;
    let (inputs, max_memory) = (&arguments.inputs, arguments.max_memory);
    let baked = bake(inputs, output, &options, arguments, max_memory, Some(&screen));
    screen.spinner.finish_and_clear();
    let report = baked.map_err(|error| Failure::from_bake(names(&arguments.inputs), &error))?;
    for warning in report.warnings() {
        if screen.tells_stages {
            console::tell_json(&serde_json::json!({ "warning": warning }));
        } else if !arguments.json {
            console::tell_warning(warning);
        }
    }
    if arguments.json {
        console::json(&report.json())
    } else if arguments.quiet {
        Ok(())
    } else {
        console::text(&report.to_text())
    }
}

/// Turns the arguments into options, and applies those that concern the whole process: threads and memory.
pub(crate) fn prepare(arguments: &BakeArguments) -> Result<Options, Failure> {
    if arguments.max_error.is_some() && !arguments.layout.is_quantized() {
        return Err(Failure::usage("--max-error requires --triangles quantized"));
    }
    let output = arguments.output.as_deref();
    if output == Some(Path::new("-")) {
        let what = "-o: expected a file, found -; an output appears whole or not at all, so it cannot be standard output (write \
                    ./- for a file of this name)";
        return Err(Failure::Usage(what.into()));
    }
    if let Some(folder) = output.filter(|output| output.is_dir() && !are_many(arguments)) {
        let bake = format!("cbvh bake DIR -o {}", word(folder));
        let remedy = format!("name a file in it, or bake a folder of meshes into it: {bake}");
        return Err(Failure::system(folder, format_args!("expected a file, found a folder; {remedy}")));
    }
    if let Some(folder) = &arguments.scratch {
        std::fs::read_dir(folder).map_err(|error| Failure::from_folder(folder, &error))?;
    }
    // WebAssembly has one thread, and a pool would start another.
    let has_pool = |jobs: &_| !cfg!(target_family = "wasm") || *jobs > 1;
    if let Some(jobs) = arguments.jobs.filter(has_pool) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build_global();
        pool.map_err(|error| Failure::from_threads(jobs, error))?;
    }
    if arguments.max_memory.is_some() {
        process::give_back();
    }
    let options = arguments
        .layout
        .to_options()
        .max_error(arguments.max_error)
        .weld(arguments.weld)
        .effort(arguments.effort)
        .split_objects(arguments.split_objects)
        .scene(arguments.scene)
        .drop_nan(arguments.drop_nan)
        .ids(!arguments.no_ids)
        .topology(!arguments.no_topology)
        .radius(arguments.radius)
        .solid(arguments.solid);
    Ok(options)
}

/// Bakes meshes into one file within a budget of memory, and reports on it. The arguments say how files are handled, and the
/// screen shows the progress.
pub(crate) fn bake(
    inputs: &[PathBuf],
    output: &Path,
    options: &Options,
    arguments: &BakeArguments,
    max_memory: Option<u64>,
    screen: Option<&Screen>,
) -> Result<Report, BakeError> {
    let start = Instant::now();
    let progress = screen.map(|screen| screen.progress.clone()).unwrap_or_default();
    let mut stages = Stages::new(&progress, screen);
    let BakeArguments { force, scratch, allow_outside, .. } = arguments;
    let bake = FileBake::new(inputs, output).options(options.clone()).force(*force).max_memory(max_memory);
    let bake = bake.allow_outside(*allow_outside).scratch(scratch.clone()).progress(&progress);
    let outcome = bake.on_step(|step| stages.begin(step)).run()?;
    let stages = match outcome {
        Outcome::Baked(_) => stages.finish(),
        Outcome::UpToDate(_) => Vec::new(),
    };
    let seconds = start.elapsed().as_secs_f64();
    Ok(Report::new(inputs, output, options, outcome, stages, seconds))
}

const HELP: &str = "\
Examples:
  cbvh bake rock.obj -o rock.cbvh
  cbvh bake part.stl -o part.cbvh --triangles quantized --max-error 0.01
  cbvh bake arm.obj hand.ply -o robot.cbvh --split-objects --json
  cbvh bake factory.glb -o factory.cbvh --scene
  cbvh bake points.pcd -o points.cbvh --radius 0.003 --no-ids

Several inputs are baked as one mesh, and triangle ids run on from file to file. With --split-objects each object keeps \
its own name; an object that its file does not name is called after the file, without the extension.

The output appears whole or not at all. It is left alone if it is up to date, that is, if it is undamaged and was baked \
from the same inputs with the same options by the same version; --force bakes it anyway.

With --scene the output is a scene: it also states where the objects stand in the world. Each node of a glTF or COLLADA file that has a \
mesh becomes an instance. Nodes share their meshes: the file has one object for each mesh and scale. Each object of other \
files becomes an instance where it stands. An instance has the name of its node; .2, .3 and so on are added to a name that \
occurs again. cbvh scene queries such a file.

--round f32 rounds each coordinate to the nearest f32 number, ties to even, as games store them. Numbers that are equal in two \
files then stay equal, so that parts which share a face touch, and the origin of each object is 0. The output states how far \
vertices moved. In a scene, the coordinates of objects are rounded, and poses are not.

--triangles quantized rounds vertices to a grid, so that small triangles may collapse. --max-error must not exceed a \
hundredth of the diagonal of the object's box; an error that is large for the mesh is reported as a warning.

--weld closes seams that are open by rounding errors: each vertex of an object goes to the position of the vertex within LENGTH \
of it that triangles use first. Positions are as given, so that chains of near vertices do not collapse. Triangles that lose \
their area stay. LENGTH must not exceed the diagonal of the object's box, and at the diagonal the object collapses. The distance by which \
vertices move is part of max_vertex_rounding. Without --weld, the report of an open mesh states how near its open edges are to each \
other.

Warnings on standard error, and in the field warnings of --json, say what a reader did that the author of a file may not \
expect, such as bytes that it left out.

An XYZ file has a point per line; what follows its three numbers is ignored. A line with the number of points and one with \
the names of the columns may come first. Each point becomes a triangle whose corners are \
equal, and points that coincide all stay. --radius and --solid are kept in the file, and every query respects them.

A COLLADA file is scaled to metres and turned so that z points up, by the unit and the axis that it declares. What is \
done is reported as a warning.

A glTF file may name files that hold its buffers. They must be in the folder of the glTF file or below it, after symbolic \
links are followed. --allow-outside allows buffers elsewhere: whoever made the glTF file then chooses which files are read.

--max-memory SIZE keeps the whole process within SIZE, however large the mesh is. Files are read piece by piece, and up to \
200 bytes per triangle go to scratch files. These have no names, and they vanish however the process ends. The output has \
the same bytes. Pipes, COLLADA files and the JSON of glTF files are held in memory as a whole, data URIs \
included. A SIZE that is too small \
for the mesh exits with code 4.

On a terminal, a line on standard error shows the stage, the share of it that is done, triangles per second, the bytes \
spilled to scratch files, the elapsed time, and about how long the stage still takes.

--json prints one JSON object on standard output. Unless -q is given, it also prints one JSON object per stage on \
standard error when the stage ends: read, prepare, build, assemble, prove, write. Each has the fields stage, seconds, \
triangles, triangles_per_second, bytes_read, bytes_written, spilled_bytes (written to scratch files), resident_bytes \
and peak_rss_bytes. Their seconds and bytes add up to stage_seconds, bytes_read, bytes_written and \
scratch_written_bytes of the object on standard output. There are no stages if the output is up to date, or for many \
assets.

Many assets:
  cbvh bake meshes -o baked --jobs 8
  cbvh bake --manifest in.jsonl --out-manifest out.jsonl --max-memory 4GiB --shard 3/16

Each line of in.jsonl is a JSON object such as {\"input\": \"rock.obj\", \"output\": \"rock.cbvh\"}. It may also have \
profile, triangles, max_error, round, weld, effort, split_objects, scene, drop_nan, ids, topology, radius and solid; the \
options on the command line are their \
defaults. Paths are relative to the manifest and may lead anywhere. Inputs must be regular files, so that the command never \
waits for a pipe. Missing folders of outputs are created. Assets are baked side by side within --jobs \
and --max-memory, and the failure of one does not stop the others. out.jsonl has one line per asset in the order of the \
input: the number of its line, exit_code, and either the fields of --json or an error. Until all assets are done, the \
lines of finished assets are in out.jsonl.part. --json prints one object with counts and sums, which add up over \
shards.

With many assets, the exit code is 3 if any input is invalid, else 4 if any limit was reached, else 2 if the system \
refused anything, else 1 if the options do not fit an asset, else 0. A manifest with an invalid line, or with two assets \
that have the same output, exits with code 3 before anything is baked.";

/// What `bake` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct BakeArguments {
    /// Meshes: OBJ, STL, PLY, glTF or COLLADA files; clouds of points: XYZ, PCD, or PLY files without faces; or one folder, whose
    /// files are baked to separate files
    #[arg(required_unless_present = "manifest", conflicts_with = "manifest", value_name = "IN")]
    pub(crate) inputs: Vec<PathBuf>,
    /// The file to write; for a folder of meshes, the folder to write to
    #[arg(
        short,
        long,
        value_name = "OUT.cbvh",
        required_unless_present = "manifest",
        conflicts_with = "manifest"
    )]
    pub(crate) output: Option<PathBuf>,
    /// Bake many assets: a file with one JSON object per line, with "input", "output" and options
    #[arg(long, value_name = "IN.jsonl", requires = "out_manifest")]
    pub(crate) manifest: Option<PathBuf>,
    /// With --manifest or a folder: write the result of each asset here, one JSON object per line
    #[arg(long, value_name = "OUT.jsonl")]
    pub(crate) out_manifest: Option<PathBuf>,
    /// With --manifest or a folder: bake only every N-th asset, starting with the I-th; I is from 1 to N
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    pub(crate) shard: Option<Shard>,
    #[command(flatten)]
    pub(crate) layout: LayoutArguments,
    /// Time spent on a better tree: quick or default. Results are the same
    #[arg(long, value_name = "E", default_value = "default", value_parser = effort)]
    pub(crate) effort: Effort,
    /// With --triangles quantized: how far a vertex may move, in mesh units [default: 1e-5 of the diagonal]
    #[arg(long, value_name = "LENGTH", value_parser = positive, allow_negative_numbers = true)]
    pub(crate) max_error: Option<f64>,
    /// Weld the vertices of each object: move each to the first vertex within this distance of it, in mesh units
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0, allow_negative_numbers = true)]
    pub(crate) weld: f64,
    /// Stay within this much memory, such as 512MiB or 2GB; the rest goes to scratch files
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    pub(crate) max_memory: Option<u64>,
    /// With --max-memory: the folder for scratch files [default: the folder of the output]
    #[arg(long, value_name = "DIR", requires = "max_memory")]
    pub(crate) scratch: Option<PathBuf>,
    /// Let glTF files name buffers outside their own folders, which is otherwise refused
    #[arg(long)]
    pub(crate) allow_outside: bool,
    /// The number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    pub(crate) jobs: Option<u16>,
    /// Build one tree per object of the input, so that queries can name an object
    #[arg(long)]
    pub(crate) split_objects: bool,
    /// Bake a scene, with one tree per object: the nodes of glTF and COLLADA files become instances that share their meshes
    #[arg(long)]
    pub(crate) scene: bool,
    /// Leave out points without a position, those with a coordinate that is nan or infinite, which are otherwise refused
    #[arg(long)]
    pub(crate) drop_nan: bool,
    /// Give the mesh a radius, in mesh units: it stands for all points this near to it, as each point of a cloud does for a ball
    #[arg(long, value_name = "LENGTH", default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub(crate) radius: f64,
    /// Make the mesh solid: what is inside touches it. All its objects must be closed
    #[arg(long)]
    pub(crate) solid: bool,
    /// Leave out the original triangle numbers
    #[arg(long)]
    pub(crate) no_ids: bool,
    /// Do not store which objects are closed, which queries about the inside of a mesh need
    #[arg(long)]
    pub(crate) no_topology: bool,
    /// Bake even if the output is up to date
    #[arg(long)]
    pub(crate) force: bool,
    /// Print one JSON object, and one per stage on standard error
    #[arg(long)]
    pub(crate) json: bool,
    /// Print nothing but errors, warnings, and the object of --json
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// Parses the name of an effort.
pub(crate) fn effort(name: &str) -> Result<Effort, String> {
    Effort::from_name(name).ok_or_else(|| "expected quick or default".to_owned())
}
