//! The meshes of a question. Each is an opened file, or a mesh baked in memory.

use crate::console::{Failure, tell_line, tell_warning};
use crate::options::LayoutArguments;
use crate::process::map;
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, BakeReport, Options, input, to_bytes};
use bvh_format::header::MAGIC;
use bvh_format::ids::decode_id;
use bvh_format::leaf::VertexBlock;
use bvh_format::page::Page;
use bvh_format::validate::packets;
use bvh_query::{Bvh, Distance, Object, Pose, QueryError, ReadAhead, Shape};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

/// How many times larger one mesh may be than the other before the command points it out. Files in millimetres beside files in
/// metres differ by 1000 times what the objects do.
const MAX_RATIO: f64 = 1000.0;

/// The options for preparing meshes.
#[derive(Clone, Copy)]
pub(crate) struct How<'a> {
    /// The layout of meshes that are baked in memory.
    pub(crate) layout: &'a LayoutArguments,
    /// The object to query.
    pub(crate) object: Option<&'a str>,
    pub(crate) read_ahead: ReadAhead,
}

/// A mesh that is ready to be queried.
pub(crate) struct LoadedMesh {
    pub(crate) path: PathBuf,
    pub(crate) bvh: Bvh,
    /// The object that `--object` names, if this mesh has it.
    pub(crate) object: Option<usize>,
    /// The seconds of baking the mesh, or of opening the file; and of checking it.
    build_seconds: f64,
    check_seconds: OnceLock<f64>,
}

impl LoadedMesh {
    /// Opens a `.cbvh` file or bakes a mesh. All objects of a mesh become one tree, unless `--object` names one of them.
    pub(crate) fn load(path: &Path, how: &How) -> Result<Self, Failure> {
        let start = Instant::now();
        let (bvh, build_seconds) = if is_baked(path)? {
            (map(path, how.read_ahead)?, start.elapsed().as_secs_f64())
        } else {
            bake(path, &how.layout.to_options(), how.object)?
        };
        let object = how.object.and_then(|name| bvh.find(name));
        if object.is_none() {
            refuse_scene(path, &bvh)?;
        }
        let loaded =
            Self { path: path.to_owned(), bvh, object, build_seconds, check_seconds: OnceLock::new() };
        point_out_move(path, loaded.shape());
        Ok(loaded)
    }

    /// Checks all pages before queries are timed, and counts that as building: otherwise the first query that touches a
    /// page would pay for its check.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        let start = Instant::now();
        self.bvh.validate().map_err(|error| Failure::invalid(&self.path, error))?;
        let _ = self.check_seconds.set(start.elapsed().as_secs_f64());
        Ok(())
    }

    /// Returns the seconds until the mesh was ready.
    pub(crate) fn build_seconds(&self) -> f64 {
        self.build_seconds + self.check_seconds.get().unwrap_or(&0.0)
    }

    /// Returns what is queried.
    pub(crate) fn shape(&self) -> Shape<'_> {
        self.object.and_then(|number| self.bvh.object(number)).unwrap_or_else(|| self.bvh.all())
    }

    /// Returns how large the mesh is, in mesh units: the longest side of the box of its largest object.
    pub(crate) fn size(&self) -> f64 {
        let sides = self.shape().objects().iter().flat_map(|object| {
            let record = object.record();
            [0, 1, 2].map(|axis| f64::from(record.box_hi[axis].get()) - f64::from(record.box_lo[axis].get()))
        });
        sides.fold(0.0, f64::max)
    }

    /// Returns the number of triangles of the mesh, including exact duplicates.
    pub(crate) fn triangles(&self) -> u64 {
        triangles_of(self.shape().objects())
    }

    /// Returns the bytes of the file, and the number of triangles stored in it.
    pub(crate) fn bytes_and_stored(&self) -> (u64, u64) {
        (self.bvh.bytes().len() as u64, self.bvh.all().triangles())
    }
}

/// Says that answers are about a mesh as it is stored, if its vertices moved on the way there.
pub(crate) fn point_out_move(path: &Path, shape: Shape<'_>) {
    let (path, most) = (path.display(), shape.max_move());
    if most > 0.0 {
        tell_line(&format!("{path}: vertices moved by up to {most:e}; results are for the mesh as stored"));
    }
}

/// Returns the number of triangles of these objects, including exact duplicates.
pub(crate) fn triangles_of(objects: &[Object]) -> u64 {
    let records = objects.iter().map(|object| object.record());
    // The counts are as the file states them, and those of a forged file may overflow.
    let counts = records.flat_map(|record| [record.triangles.get(), record.duplicates.get()]);
    counts.fold(0, u64::saturating_add)
}

/// Points out two meshes, by size and file, of which one is so much larger that they may be in different units.
pub(crate) fn point_out_units([(size_a, a), (size_b, b)]: [(f64, &Path); 2]) {
    let ratio = (size_a / size_b).max(size_b / size_a);
    if ratio > MAX_RATIO && ratio.is_finite() {
        let [a, b] = [a, b].map(Path::display);
        tell_line(&format!(
            "{a} is about {size_a:.3} mesh units across and {b} about {size_b:.3}; are both in the same unit?"
        ));
    }
}

/// Refuses the name of an object that none of the meshes has.
pub(crate) fn refuse_unknown_object(
    a: &LoadedMesh,
    b: Option<&LoadedMesh>,
    how: &How,
) -> Result<(), Failure> {
    let meshes: Vec<&LoadedMesh> = std::iter::once(a).chain(b).collect();
    let is_unknown = meshes.iter().all(|mesh| mesh.object.is_none());
    let Some(name) = how.object.filter(|_| is_unknown) else { return Ok(()) };
    let paths: Vec<String> = meshes.iter().map(|mesh| mesh.path.display().to_string()).collect();
    Err(Failure::Usage(format!(
        "--object: expected an object of this name in {}, found none named {name:?}; cbvh dump lists the objects of a file",
        paths.join(" or ")
    )))
}

/// Turns an error of a query into one of the file that caused it.
pub(crate) fn blame(mesh_a: &LoadedMesh, mesh_b: Option<&LoadedMesh>, error: QueryError) -> Failure {
    // The error does not say which of two files it is about.
    let file = |is_at_fault: &dyn Fn(&LoadedMesh) -> bool| {
        let other = mesh_b.filter(|_| !is_at_fault(mesh_a));
        &*other.unwrap_or(mesh_a).path
    };
    match error {
        QueryError::Budget { .. } => Failure::Limit(error.to_string()),
        QueryError::Damaged(breach) => {
            let damaged = |mesh: &LoadedMesh| bvh_format::validate::validate(mesh.bvh.bytes()).is_err();
            Failure::invalid(file(&damaged), breach)
        }
        QueryError::NoTopology => {
            let lacks_it = |mesh: &LoadedMesh| !mesh.bvh.layout().has_topology();
            Failure::invalid(file(&lacks_it), error)
        }
        // A number that the command line has let through.
        error => Failure::Usage(error.to_string()),
    }
}

/// Refuses a scene where a mesh is needed: its objects are in frames of their own, and together no mesh.
pub(crate) fn refuse_scene(path: &Path, bvh: &Bvh) -> Result<(), Failure> {
    if !bvh.layout().has_instances() {
        return Ok(());
    }
    let what = "expected a mesh, or one object of a scene, found a scene; cbvh scene queries it, and cbvh dump lists \
                its objects";
    Err(Failure::invalid(path, what))
}

/// Returns whether a file is a `.cbvh` file by its content or by its name. The name counts too, so that a damaged file is
/// reported as such.
pub(crate) fn is_baked(path: &Path) -> Result<bool, Failure> {
    let failed = |error| Failure::from_input(path, &error);
    let named = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("cbvh"));
    // What is read from a pipe here would be missing later.
    let is_file = std::fs::metadata(path).map_err(failed)?.is_file();
    if named || !is_file {
        return Ok(named);
    }
    let mut head = Vec::new();
    let file = std::fs::File::open(path).map_err(failed)?;
    file.take(MAGIC.len() as u64).read_to_end(&mut head).map_err(failed)?;
    Ok(head == MAGIC)
}

fn bake(path: &Path, options: &Options, object: Option<&str>) -> Result<(Bvh, f64), Failure> {
    let mut mesh = read_mesh(path)?;
    // One tree is faster to query than several, unless the object is to be queried alone.
    let has = object.is_some_and(|name| mesh.objects.iter().any(|object| object.name == name));
    if !has {
        mesh = mesh.merged();
    }
    let start = Instant::now();
    let (bvh, _) = bake_in_memory(path, &mesh, &options.clone().split_objects(has))?;
    Ok((bvh, start.elapsed().as_secs_f64()))
}

/// Reads a mesh file.
pub(crate) fn read_mesh(path: &Path) -> Result<Mesh, Failure> {
    told(input::read(path).map_err(|error| Failure::from_bake(path.display(), &error.into())))
}

/// Tells the warnings of a mesh that has been read.
pub(crate) fn told(read: Result<Mesh, Failure>) -> Result<Mesh, Failure> {
    read.iter().flat_map(|mesh| &mesh.warnings).for_each(|warning| tell_warning(warning));
    read
}

/// Bakes the mesh of a file in memory.
pub(crate) fn bake_in_memory(
    path: &Path,
    mesh: &Mesh,
    options: &Options,
) -> Result<(Bvh, BakeReport), Failure> {
    let failed = |error: BakeError| Failure::from_bake(path.display(), &error);
    let (bytes, report) = to_bytes(mesh, options).map_err(failed)?;
    Ok((Bvh::from_bytes(bytes).map_err(|error| failed(BakeError::Unproved(error)))?, report))
}

/// Returns a distance, its bounds and the closest points with their triangles, for meshes of which vertices moved by at most `moves`.
pub(crate) fn describe([mesh_a, mesh_b]: [&LoadedMesh; 2], answer: &Distance, moves: [f64; 2]) -> String {
    let Distance { distance, lower, upper, point_a, point_b, .. } = answer;
    let a = name(mesh_a, answer.object_a, answer.triangle_a);
    let b = name(mesh_b, answer.object_b, answer.triangle_b);
    let touch = if *distance == 0.0 { " (the meshes touch)" } else { "" };
    let given = as_given(moves, answer);
    let given =
        given.map_or(String::new(), |[lower, upper]| format!(", and {lower:?} to {upper:?} as given"));
    format!(
        "distance {distance:?}{touch}\n  certainly {lower:?} to {upper:?}{given}\n  on A {}, {a}\n  on B {}, {b}\n",
        point(*point_a),
        point(*point_b)
    )
}

/// Returns bounds of the distance of the meshes that were given, of which vertices moved by at most `moves` before they were
/// stored; none if no vertex moved.
pub(crate) fn as_given(moves: [f64; 2], answer: &Distance) -> Option<[f64; 2]> {
    // A pose may stretch how far B's vertices moved by 2^-19. Sums are rounded outward.
    let [a, b] = moves;
    let most = (a + b * (1.0 + 1.0 / (1 << 18) as f64)).next_up();
    let widened = [(answer.lower - most).next_down().max(0.0), (answer.upper + most).next_up()];
    (a > 0.0 || b > 0.0).then_some(widened)
}

/// Returns both triangles as faces, and the segment between the closest points as a line, all in the frame of A.
pub(crate) fn obj(
    [mesh_a, mesh_b]: [&LoadedMesh; 2],
    pose: &Pose,
    answer: &Distance,
) -> Result<String, Failure> {
    let a = corners(mesh_a, answer.object_a, answer.triangle_a)?;
    let b = corners(mesh_b, answer.object_b, answer.triangle_b)?.map(|corner| pose.place(corner));
    let mut text = format!("# distance {:?}\n", answer.distance);
    let mut vertices = |points: &[[f64; 3]]| {
        points.iter().for_each(|&p| text.push_str(&format!("v {}\n", point(p))));
    };
    vertices(&a);
    vertices(&b);
    vertices(&[answer.point_a, answer.point_b]);
    text.push_str("o triangle_a\nf 1 2 3\no triangle_b\nf 4 5 6\no segment\nl 7 8\n");
    Ok(text)
}

/// Returns a point as its three coordinates.
pub(crate) fn point(point: [f64; 3]) -> String {
    let [x, y, z] = point;
    format!("{x:?} {y:?} {z:?}")
}

/// Names a triangle for people. The object is named only if there are several.
pub(crate) fn name(mesh: &LoadedMesh, object: u32, triangle: u32) -> String {
    match mesh.bvh.objects() {
        [_] => format!("triangle {triangle}"),
        objects => {
            let name = objects.get(object as usize).map_or("", |object| object.name());
            format!("object {object} {name:?} triangle {triangle}")
        }
    }
}

/// Finds the corners of a triangle by its number, in the frame of its file.
fn corners(mesh: &LoadedMesh, object: u32, triangle: u32) -> Result<[[f64; 3]; 3], Failure> {
    let object = mesh.bvh.objects().get(object as usize);
    // Searches all pages of the object, which is fast enough for one answer.
    let found = object.and_then(|object| triangles(&mesh.bvh, object).find(|&(id, _)| id == triangle));
    found
        .map(|(_, corners)| corners)
        .ok_or_else(|| Failure::invalid(&mesh.path, format_args!("expected triangle {triangle}, found none")))
}

/// Returns the triangles of an object with their numbers, in the order of the file and in its frame. Without ids, they are
/// numbered in that order.
pub(crate) fn triangles<'a>(
    bvh: &'a Bvh,
    object: &'a Object,
) -> impl Iterator<Item = (u32, [[f64; 3]; 3])> + 'a {
    let (layout, bytes) = (bvh.layout(), bvh.bytes());
    let pages = object.pages().filter_map(move |number| layout.page_bytes(bytes, number));
    pages.flat_map(move |page| {
        let page = Page::new(page, object.profile());
        let header = *page.header();
        let (block, ids) = (layout.leaf_block(bytes, &header), layout.id_block(bytes, &header));
        let in_page = header.packets.get().into();
        let vertices = VertexBlock::new(object.triangle_encoding(), object.vertices(), block, in_page);
        let packets: Vec<(u16, usize)> = packets(&page).collect();
        packets.into_iter().flat_map(move |(packet, count)| {
            (0..count).map(move |lane| {
                let id = if layout.has_ids() {
                    decode_id(ids, usize::from(packet), lane)
                } else {
                    let packet = header.first_packet.get().wrapping_add(u32::from(packet));
                    packet.wrapping_mul(4).wrapping_add(lane as u32)
                };
                (id, vertices.triangle(packet.into(), lane))
            })
        })
    })
}
