//! `cbvh view`: writes a page that shows meshes, a motion or a scene, or shows it in the browser at once.

#[cfg_attr(target_family = "wasm", path = "no_browser.rs")]
mod browser;
pub(crate) mod output;

use crate::asking;
use crate::asking::files::{self, refuse_overwriting};
use crate::asking::mesh::{self, How, LoadedMesh, is_baked, point_out_units};
use crate::console::{self, Failure, counted, shown, spinner};
use crate::options::{LayoutArguments, not_negative, positive};
use crate::process;
use crate::scene::file::{self as scene, Frame, LoadedScene};
use bvh_query::{InstanceId, OwnedShape, Pose, ReadAhead, RigidPath as _};
use cbvh_view::{Frames, Named, Page};
use clap::Args;
use output::{PageArguments, refuse_standard_output};
use std::path::{Path, PathBuf};

const HELP: &str = "\
Examples:
  cbvh view bunny.obj
  cbvh view room.cbvh robot.cbvh --pose \"1 0 0 2  0 1 0 0  0 0 1 0\" -o page.html
  cbvh view room.cbvh robot.cbvh --motion \"1 0 0 9  0 1 0 0  0 0 1 0   1 0 0 0  0 1 0 0  0 0 1 0\" -o page.html
  cbvh view --scene cell.scene frames.txt -o page.html
  cbvh view --scene factory.cbvh

The page is one HTML file. It needs no network and no server: the files that it shows are in it, and so is cbvh itself, which \
runs the queries. Send it to somebody, and they see what you see.

One FILE is shown alone, and a file made by cbvh bake --scene as a scene. With --pose or --motion, a single FILE is both A and B. Two \
FILEs are A and B, and are in one frame unless --pose or --motion places B. The numbers are those of cbvh query --pose and cbvh motion \
--motion: 12 numbers are the rows of the 3 by 4 matrix that places B in the frame of A, and 24 are two such poses, at the start and at \
the end.

SCENE and FRAMES are those of cbvh scene. Without FRAMES, all instances stand where the file says. cbvh clash --view writes a \
page of the parts that clash.

Without -o, the page is written to the system's temporary folder under a new name, and the browser opens it. Nobody removes it \
afterwards. If there is no browser, the exit code is 2, and the message says where the page is. A browser that may not read the \
temporary folder, such as one in a sandbox, needs -o.

Files are checked as a whole before they are put into the page.";

/// What `view` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ViewArguments {
    /// One mesh or two: .cbvh files, or mesh files that are baked in memory first
    #[arg(value_name = "FILE", required_unless_present = "scene", conflicts_with = "scene")]
    files: Vec<PathBuf>,
    /// Place B in the frame of A by 12 numbers [default: both are in one frame]
    #[arg(long, value_name = "12 NUMBERS", allow_hyphen_values = true, conflicts_with_all = ["motion", "scene"])]
    pose: Option<String>,
    /// Also show whether A and B are at most this far apart, in mesh units
    #[arg(long, value_name = "D", value_parser = not_negative, allow_negative_numbers = true, conflicts_with_all = ["motion", "scene"])]
    within: Option<f64>,
    /// Move B from one pose to another, given as 24 numbers
    #[arg(long, value_name = "24 NUMBERS", allow_hyphen_values = true, conflicts_with = "scene")]
    motion: Option<String>,
    /// With --motion: meshes that are at most this far apart count as a hit, in mesh units [default: 0]
    #[arg(long, value_name = "C", value_parser = not_negative, allow_negative_numbers = true, requires = "motion")]
    clearance: Option<f64>,
    /// With --motion: how far beyond the clearance the result may be near [default: 1e-6 of the smaller diagonal]
    #[arg(long, value_name = "T", value_parser = positive, allow_negative_numbers = true, requires = "motion")]
    tolerance: Option<f64>,
    /// Show a scene file, or a .cbvh file made by cbvh bake --scene, and the frames of a file
    #[arg(long, num_args = 1..=2, value_names = ["SCENE", "FRAMES"])]
    scene: Vec<PathBuf>,
    /// Show only the object of this name, in each mesh that has one
    #[arg(long, value_name = "NAME", conflicts_with = "scene")]
    object: Option<String>,
    #[command(flatten)]
    layout: LayoutArguments,
    /// The page to write; without it, the browser opens a page in the temporary folder
    #[arg(short, long, value_name = "PAGE.html")]
    output: Option<PathBuf>,
    #[command(flatten)]
    page: PageArguments,
}

/// Makes the page, and writes or shows it.
pub(crate) fn run(arguments: &ViewArguments) -> Result<(), Failure> {
    let inputs: Vec<&Path> = arguments.files.iter().chain(&arguments.scene).map(PathBuf::as_path).collect();
    if let Some(output) = &arguments.output {
        refuse_standard_output("-o", output)?;
    }
    refuse_overwriting(&arguments.output, &inputs)?;
    let spinner = spinner(false);
    process::remove_unfinished_files(&spinner)?;
    spinner.set_message("reading");
    let page = arguments.page.limit(page(arguments)?)?;
    spinner.set_message("writing");
    let written = match &arguments.output {
        Some(output) => output::write(&page, output).map(|()| output.clone()),
        None => browser::show(&page),
    };
    spinner.finish_and_clear();
    let names: Vec<String> = inputs.iter().map(|path| path.display().to_string()).collect();
    let told = shown(&format!("{}: shows {}", written?.display(), names.join(", ")));
    console::text(&(told + "\n"))
}

/// Reads what is to be shown.
fn page(arguments: &ViewArguments) -> Result<Page, Failure> {
    if let [path, frames @ ..] = &arguments.scene[..] {
        return scene_page(path, frames.first().map(PathBuf::as_path), arguments);
    }
    let (path_a, path_b) = match &arguments.files[..] {
        [a] => (a, None),
        [a, b] => (a, Some(b)),
        files => {
            let files = counted(files.len() as u64, "file");
            let remedy = "cbvh view --scene shows a scene, and cbvh clash --view an assembly";
            return Err(Failure::usage(format_args!("expected one FILE or two, found {files}; {remedy}")));
        }
    };
    let pose = arguments.pose.as_deref().map(files::one_pose).transpose()?;
    let motion = arguments.motion.as_deref().map(files::one_motion).transpose()?;
    let is_alone = path_b.is_none() && pose.is_none() && motion.is_none() && arguments.within.is_none();
    if is_alone && arguments.object.is_none() && is_baked(path_a)? {
        let bvh = process::map(path_a, ReadAhead::Usual)?;
        if bvh.layout().has_instances() {
            return scene_page(path_a, None, arguments);
        }
    }
    let how =
        How { layout: &arguments.layout, object: arguments.object.as_deref(), read_ahead: ReadAhead::Whole };
    let a = LoadedMesh::load(path_a, &how)?;
    let b = path_b.map(|path| LoadedMesh::load(path, &how)).transpose()?;
    mesh::refuse_unknown_object(&a, b.as_ref(), &how)?;
    if let Some(b) = &b {
        point_out_units([&a, b].map(|mesh| (mesh.size(), &*mesh.path)));
    }
    for mesh in std::iter::once(&a).chain(&b) {
        mesh.check()?;
    }
    let (a, b) = (named(a), b.map(named));
    let made = match motion {
        _ if is_alone => Page::file(a),
        Some(motion) => {
            let ends = [0.0, 1.0].map(|t| motion.pose(t));
            Page::motion(a, b, ends, arguments.clearance.unwrap_or_default(), arguments.tolerance)
        }
        None => Page::pair(a, b, &pose.unwrap_or(Pose::IDENTITY), arguments.within),
    };
    made.map_err(Failure::from_page)
}

/// Returns the shape of a mesh, named after its file.
fn named(mesh: LoadedMesh) -> Named {
    let LoadedMesh { path, bvh, object, .. } = mesh;
    let shape = object.and_then(|number| OwnedShape::object(bvh.clone(), number));
    Named {
        name: output::name_of(&path),
        path: path.display().to_string(),
        shape: shape.unwrap_or_else(|| bvh.into()),
    }
}

/// Reads a scene and its frames.
fn scene_page(path: &Path, frames: Option<&Path>, arguments: &ViewArguments) -> Result<Page, Failure> {
    let backend = asking::backend("auto")?;
    let (loaded, frames, text) = if scene::is_baked_scene(path)? {
        let mut loaded = scene::open(path, backend)?;
        if frames.is_none() {
            loaded.moving.clear();
        }
        let read = frames.map(|frames| scene::read_frames(Some(frames), &loaded.names_of_moving()));
        (loaded, read.transpose()?, None)
    } else {
        let text = scene::read(path)?;
        refuse_overwriting(&arguments.output, text.files())?;
        // Without frames, what may move stands where the file says.
        let read = frames.map(|frames| scene::read_frames(Some(frames), &text.moving)).transpose()?;
        (scene::load(path, &text, &arguments.layout, backend)?, read, Some(text))
    };
    let frames = frames.unwrap_or_default();
    try_all(&loaded, &frames, arguments.scene.last().map_or(path, PathBuf::as_path))?;
    let LoadedScene { scene, moving, .. } = loaded;
    let poses = frames.into_iter().map(|frame| frame.poses).collect();
    let frames = Frames { moving, poses };
    let file_of = |id: InstanceId| {
        // Nothing was removed from the scene, so that the numbers of instances are their places.
        let source = text.as_ref().and_then(|text| text.source(id.to_bits() as usize));
        let (name, file) =
            source.map_or_else(|| (output::name_of(path), None), |(name, file)| (name.to_owned(), file));
        (name, file.unwrap_or(path).display().to_string())
    };
    Page::of_scene(&scene, &frames, file_of, |id| id).map_err(Failure::from_page)
}

/// Refuses a frame whose poses the scene refuses, so that the page need not.
fn try_all(loaded: &LoadedScene, frames: &[Frame], path: &Path) -> Result<(), Failure> {
    let mut scene = loaded.scene.clone();
    for Frame { line, poses, .. } in frames {
        let set = scene.set_poses(loaded.moving.iter().copied().zip(poses.iter().copied()));
        set.map_err(|error| Failure::invalid(path, format_args!("line {line}: {error}")))?;
    }
    Ok(())
}
