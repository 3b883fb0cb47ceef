//! `cbvh validate` and `cbvh verify`: checks a file by itself, and against the mesh from which it was baked.

use crate::console::{self, Failure, Record, counted, hex, length, names, record, shown};
use crate::open_edges;
use crate::options::{size, whole};
use crate::process;
use bvh_bake::{
    FileError, StoredFile, VerifyError, VerifyOptions, open_edges, validate_in_parallel, verify_files,
};
use bvh_format::FormatError;
use bvh_format::header::version_name;
use bvh_format::source::Source;
use bvh_query::{Querier, ReadAhead, SelfContact, SelfContactKind, Shape};
use clap::Args;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// The memory for counting open edges, unless --max-memory says otherwise.
const COUNTING_BYTES: u64 = 256 << 20;

const VALIDATE_HELP: &str = "\
Example:
  cbvh validate rock.cbvh --json
  cbvh validate rock.cbvh --self-contacts --limit 5

An invalid file exits with code 3. With --json, the object then has the fields rule, rule_text, offset, expected and \
found.

--self-contacts also finds all pairs of triangles that meet where they should not. Two triangles may meet in the corners \
and the edge that they have in common, and nowhere else. The kinds are crossing (no common corner), at_corner (one), \
folded (they overlap on the same side of a common edge) and duplicate (the same corners). The result is exact, and is no \
error: the exit code is 0. With --json, the object has the field self_contacts: an object with the numbers of all pairs and \
of each kind (count, crossing, at_corner, folded, duplicate) and with the first pairs (pairs: objects with kind, object_a, \
triangle_a, object_b and triangle_b). A file without ids has lost its exact duplicates, and numbers triangles by place. In \
a scene, each object is checked by itself.

If the file states which objects are closed, open ones are explained: how many edges have one triangle (boundary), two that face \
opposite ways (flipped), or more that do not cancel (crowded); the first edges of each kind, with their triangles and both ends; and \
how near edges of one triangle are to other open ones. The gap of an edge is the distance within which a weld may make it one with \
another open edge. If it is less than a hundredth of the edge, it is a crack, and the weld that should close all of them is proposed: see bake \
--weld. With --json, the object has the fields closed (the number of closed objects) and open_edges (count; boundary, flipped and \
crowded, each with count and first: objects with object, triangles, from, to and gap; nearest_gap, cracks, widest_crack, \
proposed_weld).

The file is read piece by piece, in about 10 MiB of memory whatever its size, and up to 100 MiB if very many edges are open. Those that do not \
fit go to scratch files in the system's folder for temporary files. --max-memory SIZE keeps the process \
within SIZE; a SIZE that is too small exits with code 4.";

/// What `validate` accepts.
#[derive(Debug, Args)]
#[command(after_help = VALIDATE_HELP)]
pub(crate) struct ValidateArguments {
    /// The .cbvh file
    file: PathBuf,
    /// Stay within this much memory, such as 64MiB
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    max_memory: Option<u64>,
    /// Find all pairs of triangles that meet where they should not; this maps the file
    #[arg(long, conflicts_with = "max_memory")]
    self_contacts: bool,
    /// How many of these pairs to list, the first ones by object and triangle
    #[arg(long, value_name = "N", default_value = "10", value_parser = whole::<usize>, requires = "self_contacts", allow_negative_numbers = true)]
    limit: usize,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Checks a file, prints what it is, and fails if it is invalid.
pub(crate) fn validate(arguments: &ValidateArguments) -> Result<(), Failure> {
    let path = &arguments.file;
    if arguments.max_memory.is_some() {
        process::give_back();
    }
    let result = StoredFile::open(path, arguments.max_memory).and_then(|file| {
        let layout = validate_in_parallel(&file)?;
        Ok((layout, file))
    });
    let file = path.display().to_string();
    let (layout, stored) = match result {
        Ok(found) => found,
        Err(FileError::Format(error)) => {
            if arguments.json {
                console::json(&record! { file: file, valid: false }.with(breach(&error)))?;
            }
            return Err(Failure::invalid(path, error));
        }
        Err(error) => return Err(Failure::from_file(path, error)),
    };
    let records = || layout.objects.iter().map(|object| object.record());
    let (objects, pages) = (layout.objects.len() as u64, u64::from(layout.page_count()));
    let triangles = records().map(|record| record.triangles.get()).sum::<u64>();
    let (version, content) = (version_name(layout.version), hex(layout.content_checksum));
    let file_bytes = stored.length();
    let topology = layout.read_topology(&stored).map_err(|error| Failure::from_file(path, error))?;
    let closed = layout.has_topology().then(|| topology.iter().filter(|object| object.closed).count() as u64);
    let budget = arguments.max_memory.unwrap_or(COUNTING_BYTES);
    let options = VerifyOptions::default().max_memory(budget);
    let edges = layout.has_topology().then(|| open_edges(&layout, &stored, &options)).transpose();
    let edges = edges.map_err(|error| Failure::from_verify(path, &file, error))?;
    drop(stored);
    let found = arguments.self_contacts.then(|| SelfContacts::find(path, arguments.limit)).transpose()?;
    if arguments.json {
        let record = record! {
            file: file,
            valid: true,
            format_version: version,
            objects: objects,
            pages: pages,
            treelets: records().map(|record| record.treelets.get()).sum::<u64>(),
            triangles: triangles,
            closed: closed,
            open_edges: edges.as_ref().map(open_edges::json),
            file_bytes: file_bytes,
            content_xxh3: content,
            peak_rss_bytes: process::peak_bytes(),
        };
        return console::json(&record.with(found.map(|found| record! { self_contacts: found.json() })));
    }
    console::text(&format!(
        "{}: valid, format {version}, {}, {}, {}, content {content}\n{}{}",
        shown(&file),
        counted(objects, "object"),
        counted(pages, "page"),
        counted(triangles, "triangle"),
        edges.filter(|edges| !edges.is_empty()).map_or_else(String::new, |edges| {
            let open = counted(objects - closed.unwrap_or_default(), "open object");
            let list = open_edges::list(&edges, objects > 1);
            format!("{}: {open}: {edges}\n{list}", shown(&file))
        }),
        found.map_or_else(String::new, |found| found.text(&file))
    ))
}

/// The pairs of triangles of a file that meet where they should not.
#[derive(Default)]
struct SelfContacts {
    /// By kind.
    counts: [u64; SelfContactKind::ALL.len()],
    /// The first ones, as many as are to be listed.
    first: BinaryHeap<SelfContact>,
    has_objects: bool,
}

impl SelfContacts {
    fn find(path: &Path, limit: usize) -> Result<Self, Failure> {
        let bvh = process::map(path, ReadAhead::Usual)?;
        let mut querier = Querier::new().map_err(Failure::usage)?;
        let mut found = Self { has_objects: bvh.objects().len() > 1, ..Self::default() };
        // The objects of a scene have frames of their own.
        let shapes: Vec<Shape<'_>> = match bvh.layout().has_instances() {
            true => (0..bvh.objects().len()).filter_map(|number| bvh.object(number)).collect(),
            false => vec![bvh.all()],
        };
        for shape in shapes {
            let asked = querier.visit_self_contacts(shape, |contact| {
                found.add(contact, limit);
                ControlFlow::Continue(())
            });
            asked.map_err(|error| Failure::invalid(path, error))?;
        }
        Ok(found)
    }

    fn add(&mut self, contact: SelfContact, limit: usize) {
        self.counts[contact.kind as usize] += 1;
        if self.first.len() < limit {
            self.first.push(contact);
        } else if let Some(mut last) = self.first.peek_mut()
            && contact < *last
        {
            *last = contact;
        }
    }

    fn json(self) -> Record {
        let [crossing, at_corner, folded, duplicate] = self.counts;
        let pairs: Vec<Record> = self.first.into_sorted_vec().iter().map(pair_json).collect();
        record! {
            count: self.counts.iter().sum::<u64>(),
            crossing: crossing,
            at_corner: at_corner,
            folded: folded,
            duplicate: duplicate,
            pairs: pairs,
        }
    }

    fn text(self, file: &str) -> String {
        let count = counted(self.counts.iter().sum(), "pair");
        let kinds =
            SelfContactKind::ALL.map(|kind| format!("{} {}", self.counts[kind as usize], kind.name()));
        let mut text = format!(
            "{}: {count} of triangles meet where they should not: {}\n",
            shown(file),
            kinds.join(", ")
        );
        for pair in self.first.into_sorted_vec() {
            let SelfContact { object_a, triangle_a, object_b, triangle_b, kind } = pair;
            let name = |object: u32, triangle: u32| match self.has_objects {
                true => format!("triangle {triangle} of object {object}"),
                false => format!("triangle {triangle}"),
            };
            let (a, b) = (name(object_a, triangle_a), name(object_b, triangle_b));
            text.push_str(&format!("  {a} and {b}: {}\n", kind.name()));
        }
        text
    }
}

fn pair_json(pair: &SelfContact) -> Record {
    record! {
        kind: pair.kind.name(),
        object_a: pair.object_a,
        triangle_a: pair.triangle_a,
        object_b: pair.object_b,
        triangle_b: pair.triangle_b,
    }
}

/// Returns the rule that a file breaks, and where.
fn breach(error: &FormatError) -> Record {
    record! {
        rule: error.rule.number(),
        rule_text: error.rule.text(),
        offset: error.offset,
        expected: error.expected,
        found: error.found,
    }
}

const VERIFY_HELP: &str = "\
Example:
  cbvh verify rock.cbvh rock.obj

Give the meshes in the same order as to bake. Any difference exits with code 3.

File and mesh are read piece by piece. What does not fit into 1.5 GiB of memory, or into \
--max-memory, goes to scratch files: up to 350 bytes per triangle. They have no names and vanish however the process \
ends. --max-memory SIZE keeps the whole process within SIZE; a SIZE that is too small exits with code 4.";

/// What `verify` accepts.
#[derive(Debug, Args)]
#[command(after_help = VERIFY_HELP)]
pub(crate) struct VerifyArguments {
    /// The .cbvh file
    file: PathBuf,
    /// The mesh or meshes it was baked from
    #[arg(required = true, value_name = "MESH")]
    meshes: Vec<PathBuf>,
    /// Stay within this much memory, such as 64MiB; the rest goes to scratch files
    #[arg(long, value_name = "SIZE", value_parser = size, allow_negative_numbers = true)]
    max_memory: Option<u64>,
    /// The folder for scratch files [default: the system's folder for temporary files]
    #[arg(long, value_name = "DIR")]
    scratch: Option<PathBuf>,
    /// Let glTF files name buffers outside their own folders, as for bake
    #[arg(long)]
    allow_outside: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Compares a file with its meshes, prints what was compared, and fails if they differ.
pub(crate) fn verify(arguments: &VerifyArguments) -> Result<(), Failure> {
    let (path, mesh) = (&arguments.file, names(&arguments.meshes));
    if let Some(folder) = &arguments.scratch {
        std::fs::read_dir(folder).map_err(|error| Failure::from_folder(folder, &error))?;
    }
    let options = VerifyOptions::default()
        .max_memory(arguments.max_memory)
        .scratch(arguments.scratch.clone())
        .allow_outside(arguments.allow_outside);
    if arguments.max_memory.is_some() {
        process::give_back();
    }
    let file = path.display().to_string();
    let report = match verify_files(path, &arguments.meshes, &options) {
        Ok(report) => report,
        Err(error) => {
            let difference = match &error {
                VerifyError::Format(error) => Some(breach(error)),
                VerifyError::Differs { what, expected, found } => {
                    Some(record! { what: what, expected: expected, found: found })
                }
                _ => None,
            };
            let compared = !matches!(error, VerifyError::Input(_) | VerifyError::File(_));
            if arguments.json && compared {
                let record = record! { file: file, mesh: mesh, valid: false, error: error.to_string() };
                console::json(&record.with(difference))?;
            }
            return Err(Failure::from_verify(path, &mesh, error));
        }
    };
    if arguments.json {
        return console::json(&record! {
            file: file,
            mesh: mesh,
            valid: true,
            triangles: report.triangles,
            duplicates: report.duplicates,
            objects: report.objects,
            by_id: report.by_id,
            max_move: report.max_move,
            nodes: report.inflation.nodes,
            width_inflation: report.inflation.mean_width(),
            volume_inflation: report.inflation.mean_volume(),
            peak_rss_bytes: process::peak_bytes(),
        });
    }
    let duplicates = match report.duplicates {
        0 => String::new(),
        count => format!(" and {}", counted(count, "exact duplicate")),
    };
    let how = if report.by_id { "compared by id" } else { "compared in any order" };
    console::text(&format!(
        "{}: has the {}{duplicates} of {}, {how}, moved by at most {}; every bound contains its triangles\n",
        shown(&file),
        counted(report.triangles, "triangle"),
        shown(&mesh),
        length(report.max_move)
    ))
}
