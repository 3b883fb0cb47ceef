//! `cbvh clash`: finds which parts of an assembly touch, overlap, contain or come near each other.

mod baseline;
mod bcf;
mod found;
mod page;
mod parts;
mod zip;

use crate::asking::{self, files::refuse_overwriting, files::write_file};
use crate::console::{self, Failure, Record, counted, csv, record, shown, spinner};
use crate::options::{Shard, not_negative, rounding, threads, whole};
use crate::process;
use crate::view::output::{self, PageArguments, refuse_standard_output};
use baseline::{Baseline, Old};
use bvh_bake::Rounding;
use bvh_query::{Backend, ClashClass, ClashOptions, FileChange, Querier, QueryError, SceneError};
use clap::Args;
use found::{BY_WEIGHT, Found, Status, both, short};
use parts::{Assembly, Part};
use std::path::{Path, PathBuf};
use std::time::Instant;

const HELP: &str = "\
Examples:
  cbvh clash factory.glb
  cbvh clash parts --clearance 2 --tolerance 0.01 --csv clashes.csv
  cbvh clash base.stl arm.stl cover.cbvh --json > clashes.json
  cbvh clash factory.glb --baseline clashes.json --fail-on overlapping,intersecting
  cbvh clash factory.cbvh --bcf clashes.bcfzip --view clashes.html
  cbvh clash building.glb --sort volume --min-volume 1e-4 --csv clashes.csv
  cbvh clash --manifest parts.jsonl --shard 3/16 --json > clashes.3.json

The parts are the instances of a scene (.glb, .gltf and .dae files, and what cbvh bake --scene made), the objects of a .cbvh file, \
and other mesh files, each as a whole. A mesh file alone is split into its objects, and so are all with --split-objects. All \
parts are in one frame. A part has the name of its instance or object, after the name of its file if several are given; the \
files of a folder have their paths in it, without extensions. #2, #3 and so on are added to a name that occurs again.

Each pair that is not apart is a clash of one class:

  overlapping   they are deeper in each other than the tolerance
  undecided     they have points in common, and the tolerance lies between the bounds found for their depth
  intersecting  they have points in common, and one is not closed, so that they have no depth
  duplicated    they are the same part in the same place, to within the tolerance
  contained     one is wholly inside the other
  near          they are at most the clearance apart, but farther than the tolerance
  touching      they are no farther apart and no deeper in each other than the tolerance

--magnitudes also measures what parts have in common, and divides overlapping ones:

  piercing      one enters the other and leaves it on another side, like a duct through a wall
  protruding    they overlap, and neither passes through the other

It tells the volume, with a certified bound of its error, the area of each surface in it, its box in the world, and how thick a part is \
where another one pierces it: the least distance between where that one enters and leaves. Parts that are not closed or have a margin have no \
magnitudes; near and touching ones share nothing. --fail-on overlapping is about piercing and protruding ones, too. --sort volume lists the \
largest volumes first, and --min-volume leaves out what shares less, but for parts whose volume is unknown.

The list has them in this order, deep ones and near ones first. The depth is the length of the shortest move of the second part \
after which they do not overlap; it is certainly between the two bounds. --visits limits the search for it, for each pair. \
Lengths are in mesh units, which are metres for glTF and COLLADA files.

The tolerance counts from both sides, because flush parts seldom have a face in common to the last bit. A pose that turns by anything \
but right angles rounds each vertex that it places, by about 1e-16 of its coordinates. A file that has few digits rounds them by half \
of the last one. Flush parts then overlap or come apart by as much. Whether placed parts are within the tolerance is decided \
exactly, which takes about as long as whether they touch. With a tolerance of 0, only parts with a common point touch.

A part that is the same as an earlier one, with the same bits of its pose, is reported once, as a duplicate of that one. It is \
not compared with other parts, because they clash with the earlier one in the same way.

--json prints one object: inputs, units, clearance, tolerance, parts, copies (those that are not compared with others), triangles, \
seconds, classes (the number of clashes of each), and clashes. A clash has id, class, a, b, relation (as cbvh query numbers it), \
distance, lower and upper (the bounds of the depth, 0 for parts that touch across a gap), translation (what moves b out of a) and point, both in the world. What \
there is not is null. With --magnitudes, a clash that has them also has volume, volume_error, area (of a's surface and of b's), \
pierced (the thickness of a and of b), box (its corners), and reason (why there are none). --csv writes the same rows; a name that a spreadsheet could take for a formula, or that begins with an \
apostrophe, has an apostrophe before it. The id is a hash of both names, and stays the same while they do.

--baseline compares with an earlier --json. Each clash gets a status: new, changed (another class, or a distance or a bound that \
differs by more than the tolerance) or same; gone has those that are no more. Use the same --clearance for both. --fail-on is then about new and changed ones only.

--bcf writes BCF 2.1 for CAD and BIM tools: a topic for each clash, with a view of it in which both parts are selected. Its \
identifiers follow from the id. Such tools take mesh units for metres, and z for up. SOURCE_DATE_EPOCH sets its date.

--view writes a page that shows all parts and lists the clashes, and needs nothing but a browser. See cbvh help view.

Each line of a manifest is a JSON object such as {\"file\": \"arm.cbvh\", \"name\": \"left arm\", \"pose\": [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, \
1, 0]}. The pose has the rows of the matrix [R | t]; it and the name may be missing. Files are relative to the manifest. With \
--shard I/N, only pairs whose earlier part is among every N-th part are checked, so that the clashes of all shards are those of \
the whole. Each .cbvh file is opened when it is first needed, so that memory stays low; other meshes are baked by each shard.

--fail-on exits with code 5 after everything else is done.";

/// What `clash` accepts.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub(crate) struct ClashArguments {
    /// A scene, the files of parts, or folders of such files
    #[arg(required_unless_present = "manifest", conflicts_with = "manifest", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Read the files of parts, their names and poses from this file, one JSON object per line
    #[arg(long, value_name = "PARTS.jsonl")]
    manifest: Option<PathBuf>,
    /// Check only the pairs whose earlier part is every N-th one, starting with the I-th; I is from 1 to N
    #[arg(long, value_name = "I/N", value_parser = Shard::parse)]
    shard: Option<Shard>,
    /// Also find parts that are at most this far apart, in mesh units
    #[arg(long, value_name = "D", default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    clearance: f64,
    /// How far apart or how deep in each other parts may be and count as touching, in mesh units [default: a millionth of the
    /// assembly's diagonal]
    #[arg(long, value_name = "T", value_parser = not_negative, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// The most visits of the search for the depth of a pair
    #[arg(long, value_name = "N", default_value_t = ClashOptions::default().visits, value_parser = whole::<u64>, allow_negative_numbers = true)]
    visits: u64,
    /// Coordinates of meshes: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal
    #[arg(long, value_name = "R", default_value = "none", value_parser = rounding)]
    round: Rounding,
    /// Also measure what parts have in common: volume, areas, box, and how thick a part is where another one pierces it
    #[arg(long)]
    magnitudes: bool,
    /// The order of the list: class, or volume, which also measures
    #[arg(long, value_name = "ORDER", default_value = "class", value_parser = ["class", "volume"])]
    sort: String,
    /// Leave out clashes of parts that have less than this volume in common, in cubic mesh units; measures as well
    #[arg(long, value_name = "V", value_parser = not_negative, allow_negative_numbers = true)]
    min_volume: Option<f64>,
    /// Make each object of a mesh file a part
    #[arg(long)]
    split_objects: bool,
    /// Compare with what --json printed earlier
    #[arg(long, value_name = "OLD.json", conflicts_with = "shard")]
    baseline: Option<PathBuf>,
    /// Exit with code 5 if there is a clash of these classes, separated by commas; with --baseline, a new or changed one
    #[arg(long, value_name = "CLASS", value_delimiter = ',', value_parser = class)]
    fail_on: Vec<ClashClass>,
    /// Write the clashes to this file as comma-separated values
    #[arg(long, value_name = "F.csv")]
    csv: Option<PathBuf>,
    /// Write the clashes to this file as topics of BCF 2.1
    #[arg(long, value_name = "F.bcfzip")]
    bcf: Option<PathBuf>,
    /// Write a page that shows the parts and their clashes
    #[arg(long, value_name = "PAGE.html")]
    view: Option<PathBuf>,
    #[command(flatten)]
    page: PageArguments,
    /// The most clashes to list for a person; 0 lists all
    #[arg(long, value_name = "N", default_value = "100", value_parser = whole::<usize>, allow_negative_numbers = true)]
    limit: usize,
    /// Print one JSON object with all clashes
    #[arg(long)]
    json: bool,
    /// The instruction set: auto, scalar, avx2, avx512, neon or simd128. auto is the fastest one of this CPU, unless CBVH_ISA names one
    #[arg(long, value_name = "ISA", default_value = "auto")]
    isa: String,
    /// The number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = threads, allow_negative_numbers = true)]
    jobs: Option<u16>,
}

/// Parses the name of a class of clashes.
fn class(name: &str) -> Result<ClashClass, String> {
    let names = || BY_WEIGHT.map(ClashClass::name).join(", ");
    BY_WEIGHT
        .into_iter()
        .find(|class| class.name() == name)
        .ok_or_else(|| format!("expected one of {}", names()))
}

/// Finds all clashes, prints and writes them, and fails if `--fail-on` says so.
pub(crate) fn run(arguments: &ClashArguments) -> Result<(), Failure> {
    let backend = asking::backend(&arguments.isa)?;
    // WebAssembly has one thread, and a pool would start another.
    let has_threads = !cfg!(target_family = "wasm");
    match arguments.jobs.filter(|jobs| has_threads || *jobs > 1) {
        None => run_with(arguments, backend, has_threads),
        Some(jobs) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs.into()).build();
            let pool = pool.map_err(|error| Failure::from_threads(jobs, error))?;
            pool.install(|| run_with(arguments, backend, jobs > 1))
        }
    }
}

fn run_with(arguments: &ClashArguments, backend: Backend, is_parallel: bool) -> Result<(), Failure> {
    let start = Instant::now();
    if arguments.page.is_given() && arguments.view.is_none() {
        return Err(Failure::usage("--max-page requires --view"));
    }
    if let Some(view) = &arguments.view {
        refuse_standard_output("--view", view)?;
    }
    let inputs = arguments.files.iter().chain(&arguments.manifest).chain(&arguments.baseline);
    let outputs = || arguments.view.iter().chain(&arguments.csv).chain(&arguments.bcf);
    refuse_overwriting(outputs(), inputs)?;
    let baseline = arguments.baseline.as_deref().map(Baseline::read).transpose()?;
    let spinner = spinner(false);
    process::remove_unfinished_files(&spinner)?;
    spinner.set_message("reading parts");
    let assembly = Assembly::read(arguments)?;
    // Folders and manifests name further inputs.
    let mut files: Vec<&Path> = assembly.parts.iter().map(|part| &*part.file).collect();
    files.dedup();
    refuse_overwriting(outputs(), files)?;
    if arguments.view.is_some() {
        // Clashes do not count: a page that is too large is refused before parts are asked about.
        arguments.page.limit(page::page(&assembly, &[])?)?;
    }
    let tolerance = arguments.tolerance.unwrap_or_else(|| 1e-6 * assembly.diagonal());
    let options =
        ClashOptions::new().clearance(arguments.clearance).tolerance(tolerance).visits(arguments.visits);
    let by_volume = arguments.sort == "volume";
    let options = options.magnitudes(arguments.magnitudes || by_volume || arguments.min_volume.is_some());
    spinner.set_message(format!("checking {} parts", assembly.parts.len()));
    let (mut scene, numbers) = assembly.scene(backend)?;
    scene.set_parallel(is_parallel);
    let part_of = |id: bvh_query::InstanceId| numbers[id.to_bits() as usize];
    let is_asked = |part: usize| arguments.shard.is_none_or(|shard| shard.has(part as u64));
    let clashes = scene
        .clashes_among(&options, |pair| is_asked(part_of(pair.a)))
        .map_err(|error| blame(&assembly, &part_of, error))?;
    let mut found: Vec<Found<'_>> = clashes
        .iter()
        .map(|clash| Found::of(&assembly, [clash.pair.a, clash.pair.b].map(part_of), clash))
        .collect();
    let copies = assembly.parts.iter().enumerate().filter_map(|(number, part)| Some([part.same_as?, number]));
    found.extend(copies.filter(|&[first, _]| is_asked(first)).map(|pair| Found::of_copy(&assembly, pair)));
    if options.magnitudes {
        let mut querier = Querier::with_backend(backend);
        found
            .iter_mut()
            .try_for_each(|clash| clash.complete(&assembly, &mut querier))
            .map_err(|error| of_file(&error))?;
    }
    found.retain(|clash| arguments.min_volume.is_none_or(|volume| clash.may_share(volume)));
    found.sort_by(if by_volume { Found::order_by_volume } else { Found::order });
    let gone = baseline.map(|baseline| baseline.compare(&mut found, tolerance));
    spinner.finish_and_clear();
    let answer = Answer {
        arguments,
        assembly: &assembly,
        tolerance,
        found,
        gone,
        seconds: start.elapsed().as_secs_f64(),
    };
    answer.write_files()?;
    if arguments.json {
        console::json(&answer.json())?
    } else {
        console::text(&answer.text())?
    }
    answer.failure().map_or(Ok(()), Err)
}

/// Turns an error about a pair into one of the file that caused it.
fn blame(
    assembly: &Assembly,
    part_of: &impl Fn(bvh_query::InstanceId) -> usize,
    error: SceneError,
) -> Failure {
    let SceneError::Pair { a, b, source } = error else { return Failure::usage(error) };
    let parts = [&a, &b].map(|label| &assembly.parts[part_of(label.id)]);
    let at_fault = match &source {
        QueryError::File { .. } => return of_file(&source),
        _ => {
            // The error does not say which part it is about.
            let is_damaged = |part: &&Part| part.shape.opened().is_ok_and(|of| of.bvh().validate().is_err());
            parts.into_iter().find(is_damaged).unwrap_or(parts[0])
        }
    };
    Failure::invalid(&at_fault.file, format_args!("part {:?}: {source}", at_fault.name))
}

/// Classifies an error about a file that was opened again.
fn of_file(error: &QueryError) -> Failure {
    match error {
        QueryError::File { found: FileChange::Unreadable(_), .. } => Failure::System(error.to_string()),
        _ => Failure::Invalid(error.to_string()),
    }
}

/// All that is known at the end.
struct Answer<'a> {
    arguments: &'a ClashArguments,
    assembly: &'a Assembly,
    tolerance: f64,
    found: Vec<Found<'a>>,
    /// The clashes of the baseline that are no more.
    gone: Option<Vec<Old>>,
    seconds: f64,
}

impl Answer<'_> {
    fn write_files(&self) -> Result<(), Failure> {
        let ClashArguments { view, csv, bcf, .. } = self.arguments;
        if let Some(path) = view {
            output::write(&page::page(self.assembly, &self.found)?, path)?;
        }
        if let Some(path) = csv {
            write_file(path, &self.csv())?;
        }
        if let Some(path) = bcf {
            let bytes = bcf::archive(path, self.assembly, &self.found)?;
            let written = bvh_bake::write_atomically(path, &bytes);
            written.map_err(|error| Failure::from_bake(path.display(), &error))?;
        }
        Ok(())
    }

    fn csv(&self) -> String {
        let rows: Vec<Record> = self.found.iter().map(Found::row).collect();
        csv(&Found::COLUMNS, &rows)
    }

    /// Returns the number of clashes of a class.
    fn count(&self, class: ClashClass) -> u64 {
        self.found.iter().filter(|clash| clash.class == class).count() as u64
    }

    /// Returns the number of clashes of a status.
    fn count_of(&self, status: Status) -> u64 {
        self.found.iter().filter(|clash| clash.status == Some(status)).count() as u64
    }

    /// Returns the number of parts that are the same as an earlier one.
    fn copies(&self) -> u64 {
        self.assembly.parts.iter().filter(|part| part.same_as.is_some()).count() as u64
    }

    fn unit(&self) -> &'static str {
        if self.assembly.is_in_metres { "metres" } else { "mesh units" }
    }

    fn json(&self) -> Record {
        let ClashArguments { files, manifest, shard, clearance, .. } = self.arguments;
        let inputs = files.iter().chain(manifest).map(|path| path.display().to_string()).collect::<Vec<_>>();
        let classes = BY_WEIGHT.map(|class| Record::field(class.name(), &self.count(class)));
        record! {
            inputs: inputs,
            shard: shard.map(|shard| shard.to_string()),
            units: self.unit(),
            clearance: clearance,
            tolerance: self.tolerance,
            parts: self.assembly.parts.len(),
            copies: self.copies(),
            triangles: self.assembly.triangles,
            seconds: self.seconds,
            classes: Record::new(classes.to_vec()),
        }
        .with(self.gone.as_ref().map(|gone| {
            let statuses = Status::ALL.map(|status| Record::field(status.name(), &self.count_of(status)));
            let statuses = Record::new(statuses.to_vec()).with(record! { gone: gone.len() });
            record! { statuses: statuses }
        }))
        .with(record! { clashes: self.found.iter().map(Found::json).collect::<Vec<_>>() })
        .with(self.gone.as_ref().map(|gone| record! { gone: gone.iter().map(Old::json).collect::<Vec<_>>() }))
    }

    /// Returns what is told to a person.
    fn text(&self) -> String {
        let Self { arguments, assembly, tolerance, found, gone, .. } = self;
        let mut text = format!(
            "{}: {}, {}; clearance {}, tolerance {}{}, in {}\n",
            shown(&assembly.name),
            counted(assembly.parts.len() as u64, "part"),
            counted(assembly.triangles, "triangle"),
            short(arguments.clearance),
            short(*tolerance),
            if arguments.tolerance.is_none() { " (a millionth of the diagonal)" } else { "" },
            self.unit(),
        );
        let listed = if arguments.limit == 0 { found.len() } else { arguments.limit.min(found.len()) };
        let mut lines: Vec<[String; 5]> = Vec::new();
        if listed > 0 {
            lines.push(["class", "status", "how much", "at", "parts"].map(str::to_owned));
        }
        lines.extend(found[..listed].iter().map(|clash| {
            let status = clash.status.map_or("", Status::name);
            [clash.class.name().to_owned(), status.to_owned(), clash.extent(), clash.place(), clash.both()]
        }));
        for Old { class, a, b, .. } in gone.iter().flatten() {
            lines.push([class.clone(), "gone".to_owned(), String::new(), String::new(), both(a, b)]);
        }
        let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
        let widths = [0, 1, 2, 3, 4].map(width);
        for line in &lines {
            for (column, (cell, width)) in line.iter().zip(widths).enumerate() {
                match column {
                    4 => text += cell,
                    // Without a baseline, there is no status.
                    1 if gone.is_none() => {}
                    _ => text += &format!("{cell:width$}  "),
                }
            }
            text += "\n";
        }
        let rest = found.len() - listed;
        if rest > 0 {
            text += &format!("and {rest} more: --limit 0 lists all\n");
        }
        text += &(self.sum() + "\n");
        if self.copies() > 0 {
            let copies = self.copies();
            text += &format!("copies of earlier parts in their places, not compared with others: {copies}\n");
        }
        text
    }

    /// Returns the numbers of clashes in words.
    fn sum(&self) -> String {
        let classes = BY_WEIGHT.into_iter().filter(|class| self.count(*class) > 0);
        let classes = classes.map(|class| format!("{} {}", self.count(class), class.name()));
        let mut text = match self.found.len() {
            0 => "no clashes".to_owned(),
            1 => "1 clash: ".to_owned(),
            count => format!("{count} clashes: "),
        };
        text += &classes.collect::<Vec<_>>().join(", ");
        if let Some(gone) = &self.gone {
            let counts = Status::ALL.map(|status| format!("{} {}", self.count_of(status), status.name()));
            text += &format!("; {}, {} gone", counts.join(", "), gone.len());
        }
        text
    }

    /// Returns the failure that `--fail-on` asks for.
    fn failure(&self) -> Option<Failure> {
        let classes = &self.arguments.fail_on;
        let is_bad = |clash: &&Found<'_>| clash.is_fresh() && classes.iter().any(|class| clash.is_of(*class));
        let mut bad = self.found.iter().filter(is_bad);
        let first = bad.next()?;
        let classes = classes.iter().map(|class| class.name()).collect::<Vec<_>>().join(",");
        let fresh = if self.gone.is_some() { "new or changed " } else { "" };
        let (count, pair) = (1 + bad.count(), first.both());
        let name = &self.assembly.name;
        Some(Failure::Found(format!(
            "{name}: --fail-on {classes}: expected no {fresh}clash of these classes, found {count}; the first: {pair}"
        )))
    }
}
