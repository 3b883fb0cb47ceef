//! Reads scene files (meshes and other shapes, instances, moving instances, allowed pairs and margins), and opens baked scenes.

use crate::asking::files::{self, POSE_NUMBERS, require_regular};
use crate::asking::mesh::{How, LoadedMesh, is_baked, point_out_units, told, triangles_of};
use crate::console::{Failure, word};
use crate::options::LayoutArguments;
use crate::process::map;
use bvh_bake::input::{MeshFormat, read_bytes};
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, shapes, to_bytes};
use bvh_query::{
    Backend, Bvh, Groups, InstanceId, OwnedShape, Pose, QueryError, ReadAhead, Scene, SceneError,
};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The groups of instances that frames move, and of those that stand still.
const MOVING: u32 = 1;
const STILL: u32 = 2;

/// A scene file, each item with the number of its line.
#[derive(Default)]
pub(crate) struct SceneText {
    shapes: Vec<Described>,
    /// The names of the shapes.
    names: Vec<String>,
    instances: Vec<(usize, String, usize, Pose)>,
    pub(crate) moving: Vec<String>,
    /// Places in `instances`.
    moving_instances: Vec<usize>,
    allowed: Vec<(usize, usize)>,
    margins: Vec<(usize, usize, f64)>,
    /// The places of shapes and of instances by their names.
    shape_of: HashMap<String, usize>,
    instance_of: HashMap<String, usize>,
}

/// A shape that a line describes.
enum Described {
    Mesh(PathBuf),
    /// A core, its radius, whether it is solid, and the line.
    Core(Mesh, f64, bool, usize),
    /// A file of points, each a ball of this radius.
    Cloud(PathBuf, f64),
}

impl Described {
    fn file(&self) -> Option<&Path> {
        match self {
            Self::Mesh(file) | Self::Cloud(file, _) => Some(file),
            Self::Core(..) => None,
        }
    }
}

/// How much larger the prism around a cylinder may be, as a fraction of its radius.
const CYLINDER_ERROR: f64 = 0.002;

/// A scene that is ready to be asked.
pub(crate) struct LoadedScene {
    pub(crate) scene: Scene,
    pub(crate) moving: Vec<InstanceId>,
    /// The triangles of each mesh once, exact duplicates included.
    pub(crate) triangles: u64,
    /// The seconds of baking meshes and opening files.
    pub(crate) build_seconds: f64,
    /// The number of pairs that were asked about, in all timed frames.
    pub(crate) pairs_asked: u64,
}

/// Reads a scene file without opening its meshes.
pub(crate) fn read(path: &Path) -> Result<SceneText, Failure> {
    let bytes = files::read_text(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let mut scene = SceneText::default();
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    for (number, line) in (1..).zip(text.lines()) {
        let added = words(line).and_then(|words| {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            scene.add(number, &words, folder)
        });
        added.map_err(|text| Failure::invalid(path, format_args!("line {number}: {text}")))?;
    }
    if scene.instances.is_empty() {
        let what = "expected at least one line: instance NAME MESH POSE, found none";
        return Err(Failure::invalid(path, what));
    }
    Ok(scene)
}

/// Divides a line into words, up to a comment. A word in quotes may have spaces and `#`; a backslash before a quote or a
/// backslash stands for that character.
fn words(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut rest) = (Vec::new(), line.trim_start());
    while !rest.is_empty() && !rest.starts_with('#') {
        let mut word = String::new();
        if let Some(quoted) = rest.strip_prefix('"') {
            let mut chars = quoted.chars();
            loop {
                match chars.next() {
                    Some('"') => break,
                    Some('\\') if chars.as_str().starts_with(['"', '\\']) => word.extend(chars.next()),
                    Some(c) => word.push(c),
                    None => {
                        return Err(format!(
                            "expected a quote at the end of a name, found none after {word:?}"
                        ));
                    }
                }
            }
            rest = chars.as_str();
        } else {
            let end = rest.find(|c: char| c.is_whitespace() || c == '#').unwrap_or(rest.len());
            (word, rest) = (rest[..end].to_owned(), &rest[end..]);
        }
        words.push(word);
        rest = rest.trim_start();
    }
    Ok(words)
}

impl SceneText {
    /// Adds what a line says. Files are in `folder`.
    fn add(&mut self, number: usize, words: &[&str], folder: &Path) -> Result<(), String> {
        let find = |names: &HashMap<String, usize>, what: &str, name: &str| {
            let found = names.get(name).copied();
            found.ok_or_else(|| format!("expected {what} of an earlier line, found {name:?}"))
        };
        match *words {
            [] => {}
            ["mesh", name, file] => self.describe(name, Described::Mesh(folder.join(file)))?,
            ["sphere", name, radius] => {
                let core = shapes::point([0.0; 3]);
                self.describe(name, Described::Core(core, length("R", radius)?, false, number))?;
            }
            ["capsule", name, radius, between] => {
                let half = length("LENGTH", between)? / 2.0;
                let core = shapes::segment([0.0, 0.0, -half], [0.0, 0.0, half]);
                self.describe(name, Described::Core(core, length("R", radius)?, false, number))?;
            }
            ["box", name, x, y, z] => {
                let core = shapes::block([length("X", x)?, length("Y", y)?, length("Z", z)?]);
                let core = core.map_err(|error| error.to_string())?;
                self.describe(name, Described::Core(core, 0.0, true, number))?;
            }
            ["cylinder", name, radius, long] => {
                let radius = length("R", radius)?;
                let around = shapes::cylinder(radius, length("LENGTH", long)?, CYLINDER_ERROR * radius);
                let core = around.map_err(|error| error.to_string())?.mesh;
                self.describe(name, Described::Core(core, 0.0, true, number))?;
            }
            ["cloud", name, file, radius] => {
                self.describe(name, Described::Cloud(folder.join(file), length("R", radius)?))?;
            }
            ["margin", instance, margin] => {
                let instance = find(&self.instance_of, "an instance", instance)?;
                self.margins.push((number, instance, length("R", margin)?));
            }
            ["instance", name, shape, ..] => {
                let mesh = find(&self.shape_of, "a shape", shape)?;
                let pose = files::parse_placed(&words[3..].join(" "))?;
                let pose = pose.ok_or("expected 12 numbers, or 7, after the shape, found none")?;
                if self.instance_of.insert(name.to_owned(), self.instances.len()).is_some() {
                    return Err(format!("expected a name of its own, found a second instance {name:?}"));
                }
                self.instances.push((number, name.to_owned(), mesh, pose));
            }
            ["moving"] => return Err("expected the names of instances after moving, found none".into()),
            ["moving", ref names @ ..] => {
                for name in names {
                    let instance = find(&self.instance_of, "an instance", name)?;
                    if self.moving_instances.contains(&instance) {
                        return Err(format!("expected each instance once, found {name:?} again"));
                    }
                    self.moving_instances.push(instance);
                    self.moving.push((*name).to_owned());
                }
            }
            ["allow", a, b] => {
                let find = |name| find(&self.instance_of, "an instance", name);
                let pair = (find(a)?, find(b)?);
                if a == b {
                    return Err(format!("expected two instances, found {a:?} twice"));
                }
                self.allowed.push(pair);
            }
            ["halfspace" | "half-space" | "plane", ..] => {
                let remedy = "write a box that reaches beyond everything it is asked about";
                return Err(format!("expected a shape of finite size, found a half-space; {remedy}"));
            }
            _ => {
                return Err(format!(
                    "expected mesh NAME FILE, sphere NAME R, capsule NAME R LENGTH, box NAME X Y Z, cylinder NAME R LENGTH, \
                     cloud NAME FILE R, instance NAME SHAPE POSE, margin INSTANCE R, moving NAME... or allow NAME NAME, found {:?}",
                    words.join(" ").chars().take(60).collect::<String>()
                ));
            }
        }
        Ok(())
    }

    /// Adds a shape with a name of its own.
    fn describe(&mut self, name: &str, shape: Described) -> Result<(), String> {
        if self.shape_of.insert(name.to_owned(), self.shapes.len()).is_some() {
            return Err(format!("expected a name of its own, found a second shape {name:?}"));
        }
        self.shapes.push(shape);
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Returns the files of all shapes that have one.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.shapes.iter().filter_map(Described::file)
    }

    /// Returns the name of the shape of an instance, and its file if it has one.
    pub(crate) fn source(&self, instance: usize) -> Option<(&str, Option<&Path>)> {
        let (_, _, shape, _) = self.instances.get(instance)?;
        Some((&self.names[*shape], self.shapes[*shape].file()))
    }
}

/// Reads a length, which may be 0.
fn length(name: &str, word: &str) -> Result<f64, String> {
    let length = word.parse().ok().filter(|length: &f64| length.is_finite() && *length >= 0.0);
    length.ok_or_else(|| format!("{name}: expected a finite length of at least 0, found {word:?}"))
}

/// Reads the points of a cloud: a file of a format that has points, or else text with a point per line.
fn read_points(path: &Path) -> Result<Mesh, Failure> {
    require_regular(path)?;
    let known = MeshFormat::from_extension(path);
    let format =
        known.filter(|format| matches!(format, MeshFormat::Ply | MeshFormat::Pcd)).unwrap_or(MeshFormat::Xyz);
    let bytes = std::fs::read(path).map_err(|error| Failure::from_input(path, &error))?;
    let read = read_bytes(&bytes, format, path);
    told(read.map_err(|error| Failure::from_bake(path.display(), &BakeError::from(error))))
}

impl LoadedScene {
    /// Returns the name of an instance as it is printed: in quotes unless it is one plain word, and `#` and the number of an
    /// instance without a name.
    pub(crate) fn name(&self, id: InstanceId) -> String {
        match self.scene.name(id) {
            Ok(Some(name)) if name.chars().all(|c| c.is_ascii_graphic() && !"\"#".contains(c)) => {
                name.to_owned()
            }
            Ok(Some(name)) => format!("{name:?}"),
            _ => format!("#{id}"),
        }
    }

    /// Returns the names of the moving instances.
    pub(crate) fn names_of_moving(&self) -> Vec<String> {
        self.moving.iter().map(|&id| self.name(id)).collect()
    }
}

/// Returns whether a file is a `.cbvh` file rather than a scene file. Refuses glTF and COLLADA, which are neither.
pub(crate) fn is_baked_scene(path: &Path) -> Result<bool, Failure> {
    let is_baked = is_baked(path)?;
    let format = match MeshFormat::from_extension(path) {
        Some(MeshFormat::Gltf) => Some("glTF"),
        Some(MeshFormat::Collada) => Some("COLLADA"),
        _ => None,
    };
    if let Some(format) = format.filter(|_| !is_baked) {
        let remedy = format!("cbvh bake {} --scene -o scene.cbvh", word(path));
        let what = format_args!("expected a scene file, found {format}; bake it first: {remedy}");
        return Err(Failure::invalid(path, what));
    }
    Ok(is_baked)
}

/// Opens a baked scene, all of whose instances move. All pages are checked, so that no frame pays for that.
pub(crate) fn open(path: &Path, backend: Backend) -> Result<LoadedScene, Failure> {
    let start = Instant::now();
    let bvh = map(path, ReadAhead::Usual)?;
    bvh.validate().map_err(|error| Failure::invalid(path, error))?;
    let scene = Scene::of_file_with_backend(bvh.clone(), backend);
    let scene = scene.map_err(|error| match error {
        SceneError::NoInstances => Failure::invalid(path, format_args!("{error}: cbvh bake --scene")),
        error => Failure::invalid(path, error),
    })?;
    Ok(LoadedScene {
        moving: scene.instances().collect(),
        scene,
        triangles: triangles_of(bvh.objects()),
        build_seconds: start.elapsed().as_secs_f64(),
        pairs_asked: 0,
    })
}

/// Opens or bakes the meshes and adds the instances.
pub(crate) fn load(
    path: &Path,
    text: &SceneText,
    layout: &LayoutArguments,
    backend: Backend,
) -> Result<LoadedScene, Failure> {
    let how = How { layout, object: None, read_ahead: ReadAhead::Usual };
    let mut loaded = LoadedScene {
        scene: Scene::with_backend(backend),
        moving: Vec::new(),
        triangles: 0,
        build_seconds: 0.0,
        pairs_asked: 0,
    };
    let mut shapes: Vec<OwnedShape> = Vec::new();
    // The smallest and the largest mesh.
    let mut ends: Option<[(f64, &Path); 2]> = None;
    for described in &text.shapes {
        let file = match described {
            Described::Mesh(file) => file,
            Described::Cloud(file, radius) => {
                let cloud = bake_core(&read_points(file)?, layout, file, &mut loaded)?;
                shapes.push(cloud.rounded(*radius).map_err(|error| Failure::invalid(file, error))?);
                continue;
            }
            Described::Core(mesh, radius, is_solid, number) => {
                let at_line =
                    |error: QueryError| Failure::invalid(path, format_args!("line {number}: {error}"));
                let mut core =
                    bake_core(mesh, layout, path, &mut loaded)?.rounded(*radius).map_err(at_line)?;
                if *is_solid {
                    core = core.solid().map_err(at_line)?;
                }
                shapes.push(core);
                continue;
            }
        };
        require_regular(file)?;
        let mesh = LoadedMesh::load(file, &how)?;
        mesh.check()?;
        loaded.triangles = loaded.triangles.saturating_add(mesh.triangles());
        loaded.build_seconds += mesh.build_seconds();
        let this = (mesh.size(), file.as_path());
        let [least, most] = ends.unwrap_or([this; 2]);
        ends = Some([if this.0 < least.0 { this } else { least }, if this.0 > most.0 { this } else { most }]);
        shapes.push(mesh.bvh.into());
    }
    ends.into_iter().for_each(point_out_units);
    let mut ids = Vec::new();
    for (number, name, mesh, pose) in &text.instances {
        let id = loaded.scene.add_named(name.clone(), shapes[*mesh].clone(), *pose);
        ids.push(id.map_err(|error| Failure::invalid(path, format_args!("line {number}: {error}")))?);
    }
    // These are instances of the scene.
    let refused = |error| Failure::invalid(path, error);
    if !text.moving_instances.is_empty() {
        for &id in &ids {
            loaded.scene.set_groups(id, Groups { member: STILL, meets: MOVING }).map_err(refused)?;
        }
        for &place in &text.moving_instances {
            let groups = Groups { member: MOVING, meets: MOVING | STILL };
            loaded.scene.set_groups(ids[place], groups).map_err(refused)?;
            loaded.moving.push(ids[place]);
        }
    }
    for &(a, b) in &text.allowed {
        loaded.scene.set_allowed(ids[a], ids[b], true).map_err(refused)?;
    }
    for &(number, instance, margin) in &text.margins {
        let set = loaded.scene.set_margin(ids[instance], margin);
        set.map_err(|error| Failure::invalid(path, format_args!("line {number}: {error}")))?;
    }
    Ok(loaded)
}

/// Bakes a core in memory.
fn bake_core(
    mesh: &Mesh,
    layout: &LayoutArguments,
    path: &Path,
    loaded: &mut LoadedScene,
) -> Result<OwnedShape, Failure> {
    let start = Instant::now();
    let bytes = to_bytes(mesh, &layout.to_options()).map_err(|error| Failure::invalid(path, error))?.0;
    let bvh = Bvh::from_bytes(bytes).map_err(|error| Failure::invalid(path, error))?;
    loaded.triangles = loaded.triangles.saturating_add(triangles_of(bvh.objects()));
    loaded.build_seconds += start.elapsed().as_secs_f64();
    Ok(bvh.into())
}

/// The poses of the moving instances, their number from 1, and the line that they stand in.
pub(crate) struct Frame {
    pub(crate) number: usize,
    pub(crate) line: usize,
    pub(crate) poses: Vec<Pose>,
}

/// Reads the frames of a scene, each with the poses of the moving instances. A scene in which nothing moves has one frame.
pub(crate) fn read_frames(path: Option<&Path>, moving: &[String]) -> Result<Vec<Frame>, Failure> {
    let path = match (path, moving.is_empty()) {
        (Some(path), false) => path,
        (None, true) => return Ok(vec![Frame { number: 1, line: 0, poses: Vec::new() }]),
        (None, false) => {
            return Err(Failure::usage("expected FRAMES, because instances of the scene move"));
        }
        (Some(_), true) => {
            return Err(Failure::usage("expected no FRAMES, because nothing moves in the scene"));
        }
    };
    let count = POSE_NUMBERS * moving.len();
    let none = "expected at least one line of poses, found none";
    let frames = files::read_lines(path, none, |text| {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.is_empty() {
            return Ok(None);
        }
        if words.len() != count {
            let (many, found) = (moving.len(), words.len());
            return Err(format!(
                "expected {count} numbers, 12 for each of {many} moving instances, found {found}"
            ));
        }
        let poses = moving.iter().zip(words.chunks(POSE_NUMBERS)).map(|(name, words)| {
            let pose = files::parse_pose(&words.join(" "));
            Ok(pose.map_err(|text| format!("instance {name}: {text}"))?.unwrap_or(Pose::IDENTITY))
        });
        poses.collect::<Result<Vec<Pose>, String>>().map(Some)
    })?;
    let numbered = (1..).zip(frames);
    Ok(numbered.map(|(number, (line, poses))| Frame { number, line, poses }).collect())
}
