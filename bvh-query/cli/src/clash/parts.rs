//! The parts of an assembly: read from files, folders or a manifest, named, and recognised where one is in the place of another.

use super::ClashArguments;
use crate::asking::files::{POSE_NUMBERS, each_json_line, files_below, require_regular, stem};
use crate::asking::mesh::{bake_in_memory, is_baked, point_out_move, read_mesh, told, triangles_of};
use crate::console::{Failure, names};
use crate::process;
use bvh_bake::input::{MeshFormat, read_scene};
use bvh_bake::mesh::{Instance, Mesh, Object};
use bvh_bake::{BakeError, Options};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, Bvh, Files, Groups, OwnedShape, Pose, QueryError, ReadAhead, Scene, SceneShape};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A part of the assembly.
#[derive(Clone)]
pub(super) struct Part {
    /// A name of its own.
    pub(super) name: String,
    /// The file that it is from.
    pub(super) file: Arc<Path>,
    pub(super) shape: SceneShape,
    pub(super) world: Pose,
    pub(super) margin: f64,
    pub(super) groups: Groups,
    is_solid: bool,
    /// The checksum of the content that its shape is from, and the number of its object there.
    content: (u64, usize),
    /// The part that is the same, in the same place, and comes first.
    pub(super) same_as: Option<usize>,
}

/// All parts, in order.
pub(super) struct Assembly {
    pub(super) parts: Vec<Part>,
    /// The triangles of all parts, those of shared meshes each time.
    pub(super) triangles: u64,
    /// The lower and the upper corner of a box that contains all parts.
    pub(super) bounds: [[f64; 3]; 2],
    /// What the inputs are called in messages.
    pub(super) name: String,
    /// Whether all inputs are glTF or COLLADA files, whose lengths are in metres.
    pub(super) is_in_metres: bool,
}

/// A file to read, and how its parts are named and placed.
struct Input {
    path: PathBuf,
    /// The name of the file's only part, or what precedes the names of its parts. The only file needs none.
    prefix: Option<String>,
    pose: Option<Pose>,
}

/// A line of a manifest.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    file: String,
    name: Option<String>,
    pose: Option<Vec<f64>>,
}

impl Assembly {
    /// Reads all inputs. Files are read side by side, and each only once.
    pub(super) fn read(arguments: &ClashArguments) -> Result<Self, Failure> {
        let inputs = inputs(arguments)?;
        let splits = arguments.split_objects || (inputs.len() == 1 && inputs[0].prefix.is_none());
        let mut distinct: Vec<&Path> = Vec::new();
        // The place of each file, and how many inputs still need it.
        let mut uses: HashMap<&Path, (usize, usize)> = HashMap::new();
        for input in &inputs {
            let (_, left) = uses.entry(&input.path).or_insert_with(|| {
                distinct.push(&input.path);
                (distinct.len() - 1, 0)
            });
            *left += 1;
        }
        let files = process::files();
        let options = Options::default().round(arguments.round);
        let read: Vec<_> =
            distinct.par_iter().map(|path| read_file(path, &files, splits, &options)).collect();
        let mut read = read.into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut parts = Vec::new();
        for Input { path, prefix, pose } in &inputs {
            let Some((place, left)) = uses.get_mut(&**path) else { continue };
            *left -= 1;
            let of_file = if *left == 0 { std::mem::take(&mut read[*place]) } else { read[*place].clone() };
            let is_only = of_file.len() == 1;
            for mut part in of_file {
                if let Some(prefix) = prefix {
                    part.name = if is_only { prefix.clone() } else { format!("{prefix}/{}", part.name) };
                }
                if let Some(pose) = pose {
                    let placed = part.world.then(pose).map_err(|error| Failure::invalid(path, error))?;
                    part.world = placed;
                }
                parts.push(part);
            }
        }
        let name = arguments
            .manifest
            .as_ref()
            .map_or_else(|| names(&arguments.files), |path| path.display().to_string());
        if parts.len() < 2 {
            return Err(Failure::Invalid(format!(
                "{name}: expected at least two parts, found {}; name all files of the assembly, or its folder",
                parts.len()
            )));
        }
        tell_apart(&mut parts);
        find_copies(&mut parts);
        let triangles =
            parts.iter().map(|part| triangles_of(part.shape.objects())).fold(0, u64::saturating_add);
        let bounds = parts.iter().map(Part::bounds).fold(EMPTY, join);
        Ok(Self { triangles, bounds, name, is_in_metres: distinct.iter().all(|path| has_nodes(path)), parts })
    }

    /// Returns the length of the diagonal of the box around all parts.
    pub(super) fn diagonal(&self) -> f64 {
        diagonal(&self.bounds)
    }

    /// Returns a scene of all parts that are no copies, and the numbers of its instances' parts.
    pub(super) fn scene(&self, backend: Backend) -> Result<(Scene, Vec<usize>), Failure> {
        let (mut scene, mut numbers) = (Scene::with_backend(backend), Vec::new());
        for (number, part) in self.parts.iter().enumerate().filter(|(_, part)| part.same_as.is_none()) {
            let refused = |error| Failure::invalid(&part.file, format_args!("part {:?}: {error}", part.name));
            let id = scene.add(part.shape.clone(), part.world).map_err(refused)?;
            if part.groups != Groups::ALL {
                scene.set_groups(id, part.groups).map_err(refused)?;
            }
            if part.margin > 0.0 {
                scene.set_margin(id, part.margin).map_err(refused)?;
            }
            numbers.push(number);
        }
        Ok((scene, numbers))
    }
}

impl Part {
    /// Returns a box in the world that contains the part.
    pub(super) fn bounds(&self) -> [[f64; 3]; 2] {
        let radius = self.shape.radius() + self.margin;
        let corners = self.shape.objects().iter().flat_map(|object| {
            let ends = object.bounding_box();
            (0..8).map(move |corner| [0, 1, 2].map(|axis| ends[corner >> axis & 1][axis]))
        });
        let corners = corners.map(|corner| self.world.place(corner));
        corners.map(|at| [at.map(|c| c - radius), at.map(|c| c + radius)]).fold(EMPTY, join)
    }
}

/// A box of nothing.
const EMPTY: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

fn join([lo, hi]: [[f64; 3]; 2], other: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [[0, 1, 2].map(|k| lo[k].min(other[0][k])), [0, 1, 2].map(|k| hi[k].max(other[1][k]))]
}

/// Returns the middle of a box.
pub(super) fn centre([lo, hi]: &[[f64; 3]; 2]) -> [f64; 3] {
    [0, 1, 2].map(|k| lo[k] + (hi[k] - lo[k]) / 2.0)
}

/// Returns the length of the diagonal of a box.
pub(super) fn diagonal([lo, hi]: &[[f64; 3]; 2]) -> f64 {
    (hi[0] - lo[0]).hypot(hi[1] - lo[1]).hypot(hi[2] - lo[2])
}

/// Returns the files that the command line, its folders or its manifest name.
fn inputs(arguments: &ClashArguments) -> Result<Vec<Input>, Failure> {
    let mut inputs = Vec::new();
    if let Some(manifest) = &arguments.manifest {
        let folder = manifest.parent().unwrap_or_else(|| Path::new(""));
        let expected = "a JSON object with file and, if it has them, name and pose";
        each_json_line(manifest, expected, |number, Line { file, name, pose }: Line| {
            let wrong = |what: String| Failure::invalid(manifest, format_args!("line {number}: {what}"));
            let pose = pose.map(|numbers| match <&[f64; POSE_NUMBERS]>::try_from(&numbers[..]) {
                Ok(rows) => Pose::from_rows(rows).map_err(|error| wrong(format!("pose: {error}"))),
                Err(_) => Err(wrong(format!(
                    "pose: expected 12 numbers, the rows of the 3 by 4 matrix [R | t], found {}",
                    numbers.len()
                ))),
            });
            let prefix = name.unwrap_or_else(|| without_extension(Path::new(&file)));
            let path = folder.join(file);
            require_regular(&path)?;
            inputs.push(Input { path, prefix: Some(prefix), pose: pose.transpose()? });
            Ok(())
        })?;
        return Ok(inputs);
    }
    for path in &arguments.files {
        if !path.is_dir() {
            let prefix = (arguments.files.len() > 1).then(|| stem(path));
            inputs.push(Input { path: path.clone(), prefix, pose: None });
            continue;
        }
        let is_part = |path: &Path| {
            let is_baked = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("cbvh"));
            is_baked || MeshFormat::from_extension(path).is_some()
        };
        let files = files_below(path, is_part)?;
        if files.is_empty() {
            let what = "expected a folder with files named .cbvh, .obj, .stl, .ply, .gltf, .glb, .dae, .xyz or .pcd, found none";
            return Err(Failure::system(path, what));
        }
        for file in files {
            require_regular(&file)?;
            let prefix = Some(without_extension(file.strip_prefix(path).unwrap_or(&file)));
            inputs.push(Input { path: file, prefix, pose: None });
        }
    }
    Ok(inputs)
}

/// Returns a path without its extension, written the same on all systems.
fn without_extension(path: &Path) -> String {
    let path = path.with_extension("");
    let names: Vec<_> = path.components().map(|name| name.as_os_str().to_string_lossy()).collect();
    names.join("/")
}

/// Returns the parts of one file: its instances, the objects of a `.cbvh` file, or all of a mesh, unless it is split.
fn read_file(path: &Path, files: &Files, splits: bool, options: &Options) -> Result<Vec<Part>, Failure> {
    if is_baked(path)? {
        let bvh = process::map(path, ReadAhead::Usual)?;
        point_out_move(path, bvh.all());
        if !bvh.layout().has_topology() {
            return Err(Failure::invalid(path, QueryError::NoTopology));
        }
        // The instances of a scene share one open file.
        if bvh.layout().has_instances() {
            return parts_of(path, &bvh, |number| open_object(&bvh, number));
        }
        let whole = files.shape(path)?;
        return parts_of(path, &bvh, |number| whole.object(number).unwrap_or_else(|| whole.clone()));
    }
    let mut mesh = if splits || has_nodes(path) {
        let read = read_scene(path);
        let mut mesh =
            told(read.map_err(|error| Failure::from_bake(path.display(), &BakeError::from(error))))?;
        share_equal_meshes(&mut mesh);
        mesh
    } else {
        read_mesh(path)?.merged()
    };
    if mesh.instances.is_empty() {
        // Equal meshes of several files are then equal files.
        mesh.objects.iter_mut().for_each(|object| object.name.clear());
    }
    let (bvh, _) = bake_in_memory(path, &mesh, options)?;
    point_out_move(path, bvh.all());
    parts_of(path, &bvh, |number| open_object(&bvh, number))
}

/// Returns whether a file is of a format whose nodes are parts.
fn has_nodes(path: &Path) -> bool {
    matches!(MeshFormat::from_extension(path), Some(MeshFormat::Gltf | MeshFormat::Collada))
}

/// Returns an object of a file that stays open.
fn open_object(bvh: &Bvh, number: usize) -> SceneShape {
    OwnedShape::object(bvh.clone(), number).unwrap_or_else(|| bvh.clone().into()).into()
}

/// Returns the parts of a file: its instances, or its objects where they stand.
fn parts_of(path: &Path, bvh: &Bvh, shape: impl Fn(usize) -> SceneShape) -> Result<Vec<Part>, Failure> {
    let mut instances =
        bvh.layout().read_instances(bvh.bytes()).map_err(|error| Failure::invalid(path, error))?;
    if instances.is_empty() {
        instances.extend((0..bvh.objects().len() as u32).map(Instance::of_object));
    }
    let (file, checksum) = (Arc::<Path>::from(path), bvh.layout().content_checksum);
    let part = |instance: Instance| {
        let number = instance.object as usize;
        let of_object = bvh.objects().get(number).map_or("", |object| object.name());
        let name = [&*instance.name, of_object, "part"].into_iter().find(|name| !name.is_empty());
        let mut shape = shape(number);
        if instance.solid {
            shape = shape.solid().map_err(|error| Failure::invalid(path, error))?;
        }
        let world = Pose::new(instance.rotation, instance.translation);
        Ok(Part {
            name: name.unwrap_or_default().to_owned(),
            file: file.clone(),
            shape,
            world: world.map_err(|error| Failure::invalid(path, error))?,
            margin: instance.margin,
            groups: Groups { member: instance.member, meets: instance.meets },
            is_solid: instance.solid,
            content: (checksum, number),
            same_as: None,
        })
    };
    instances.into_iter().map(part).collect()
}

/// Lets the instances of equal meshes share the first of them.
fn share_equal_meshes(mesh: &mut Mesh) {
    let mut alike: HashMap<u64, Vec<usize>> = HashMap::new();
    let shared: Vec<usize> = (0..mesh.objects.len())
        .map(|number| {
            let Object { positions, triangles, .. } = &mesh.objects[number];
            let mut hasher = Hasher::default();
            positions.as_flattened().iter().for_each(|c| hasher.update(&c.to_le_bytes()));
            triangles.as_flattened().iter().for_each(|corner| hasher.update(&corner.to_le_bytes()));
            let alike = alike.entry(hasher.finish()).or_default();
            let is_equal = |other: &usize| {
                let other = &mesh.objects[*other];
                other.positions == *positions && other.triangles == *triangles
            };
            alike.iter().copied().find(is_equal).unwrap_or_else(|| {
                alike.push(number);
                number
            })
        })
        .collect();
    for instance in &mut mesh.instances {
        instance.object = shared[instance.object as usize] as u32;
    }
    // A bake leaves out objects without triangles.
    for (_, object) in mesh.objects.iter_mut().enumerate().filter(|&(number, _)| shared[number] != number) {
        *object = Object { name: std::mem::take(&mut object.name), ..Object::default() };
    }
}

/// Gives parts whose name is taken another one: the name, `#`, and the least number from 2 that makes it new.
fn tell_apart(parts: &mut [Part]) {
    let mut taken: HashSet<String> = parts.iter().map(|part| part.name.clone()).collect();
    let mut met: HashMap<String, u32> = HashMap::new();
    for part in parts {
        let times = met.entry(part.name.clone()).or_insert(0);
        *times += 1;
        while *times > 1 {
            let name = format!("{}#{times}", part.name);
            if taken.insert(name.clone()) {
                part.name = name;
                break;
            }
            *times += 1;
        }
    }
}

/// Finds the parts that are the same as an earlier one, in a pose with the same bits.
fn find_copies(parts: &mut [Part]) {
    let mut firsts = HashMap::new();
    for number in 0..parts.len() {
        let part = &parts[number];
        let pose = (
            part.world.rotation().map(|row| row.map(f64::to_bits)),
            part.world.translation().map(f64::to_bits),
        );
        let key = (part.content, pose, part.margin.to_bits(), part.groups, part.is_solid);
        let first = *firsts.entry(key).or_insert(number);
        // Checksums may agree by chance.
        let is_copy = first != number && parts[first].shape.objects() == part.shape.objects();
        if is_copy && part.groups.meet(part.groups) {
            parts[number].same_as = Some(first);
        }
    }
}
