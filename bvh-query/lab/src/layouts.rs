//! Layouts: queries with cold caches, and how many pairs of nodes the trees let through in vain.
//!
//! Warm times, bytes and errors of all layouts are in `cbvh report`, which takes the same list of pairs.

mod cold;
mod markdown;
mod row;
#[cfg(test)]
mod tests;
mod tree;
mod walk;

use crate::arguments::LayoutArguments;
use crate::{Failure, output};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, Pose, Querier};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::{self, Pair, spread_evenly};
use cbvh_measure::pin::pinned;
use cbvh_measure::rounds::{Question, Subject};
use cbvh_measure::spread::Spread;
use cbvh_measure::{poses, table};
use cold::Sweep;
use rayon::prelude::*;
use row::{Row, Walked};
use serde::Serialize;
use std::fs;
use std::path::Path;
use std::sync::Arc;
use tree::Tree;
use walk::{Counts, walk};

/// The lossless triangle encodings.
const LOSSLESS: [TriangleEncoding; 2] = [TriangleEncoding::F32, TriangleEncoding::Packed];
/// The number of poses that are made for a pair without any.
const MADE_POSES: usize = 60;
/// The bytes to sweep if the system does not report its caches.
const UNKNOWN_CACHE: u64 = 64 << 20;
/// The largest sweep by default.
const MAX_SWEEP: u64 = 2 << 30;

/// The whole report: where and how it was measured, and the rows.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    origin: Origin,
    isa: &'static str,
    sweep_bytes: u64,
    #[serde(serialize_with = "table::objects")]
    rows: Vec<Row>,
}

pub(crate) fn run(arguments: &LayoutArguments) -> Result<String, Failure> {
    let (list, out) = (&arguments.pairs, &arguments.out);
    let backend = arguments.isa.map_or_else(Backend::detect, Ok)?;
    let bytes = fs::read(list).map_err(|error| in_file(list, error))?;
    let pairs = pairs::parse(&bytes, list, arguments.meshes.as_deref(), arguments.poses.as_deref());
    let pairs = pairs.map_err(|error| in_file(list, error))?;
    output::make_folder(out)?;
    let origin = Origin::of("cbvh-lab layouts");
    let largest = origin.machine.caches.iter().map(|cache| cache.bytes).max().unwrap_or(UNKNOWN_CACHE);
    let sweep_bytes =
        arguments.sweep.map_or((largest + largest / 4).min(MAX_SWEEP), |mebibytes| mebibytes << 20);
    let sweep = Sweep::new(sweep_bytes);
    let mut report = Report { origin, isa: backend.name(), sweep_bytes, rows: Vec::new() };
    for pair in &pairs {
        output::tell(&format!("{}: baking and asking", pair.name));
        report.rows.extend(measure(pair, backend, &sweep, usize::from(arguments.limit))?);
    }
    let files = [
        ("layouts.csv", table::csv(&report.rows)),
        ("layouts.json", output::json(&report)?),
        ("layouts.md", markdown::page(&report)),
    ];
    output::write(out, &files)?;
    Ok(format!("{}: {} pairs, {} rows\n", out.join("layouts.md").display(), pairs.len(), report.rows.len()))
}

fn in_file(path: &Path, error: impl std::fmt::Display) -> String {
    format!("{}: {error}", path.display())
}

/// Both meshes of a pair in one layout.
struct Baked {
    profile: Profile,
    triangles: TriangleEncoding,
    a: Arc<Bvh>,
    b: Arc<Bvh>,
}

fn measure(pair: &Pair, backend: Backend, sweep: &Sweep, limit: usize) -> Result<Vec<Row>, Failure> {
    let read = |path: &Path| bvh_bake::input::read(path).map(|input| input.merged());
    let (mesh_a, mesh_b) = (read(&pair.a)?, read(&pair.b)?);
    let mut bakes = Vec::new();
    for profile in Profile::ALL {
        for triangles in LOSSLESS {
            let a = Arc::new(bake(&mesh_a, profile, triangles)?);
            let b = if pair.a == pair.b { a.clone() } else { Arc::new(bake(&mesh_b, profile, triangles)?) };
            bakes.push(Baked { profile, triangles, a, b });
        }
    }
    let mut given = Vec::new();
    for file in &pair.poses {
        given.extend(read_poses(file)?);
    }
    let mut querier = Querier::with_backend(backend);
    let (a, b) = (&*bakes[0].a, &*bakes[0].b);
    if given.is_empty() {
        given = poses::mixed(&mut querier, a, b, MADE_POSES)?;
    }
    let poses = spread_evenly(&given, limit);
    let distance = |pose| Question::Distance(0.0).ask(&mut querier, a, b, pose);
    let distances = poses.iter().map(distance).collect::<Result<Vec<f64>, _>>()?;
    let subjects: Vec<_> =
        bakes.iter().map(|bake| Subject { a: &bake.a, b: &bake.b, poses: &poses }).collect();
    let (_, times) = pinned(|| cold::times(&subjects, backend, sweep));
    let mut rows = Vec::new();
    for (bake, times) in bakes.iter().zip(times?) {
        let walked = walks(bake, &poses, &distances);
        for ((question, times), walked) in Question::EXACT.into_iter().zip(times).zip(walked) {
            rows.push(Row {
                pair: pair.name.clone(),
                profile: bake.profile.name(),
                triangles: bake.triangles.name(),
                question: question.name(),
                poses: poses.len() as u64,
                cold: Spread::of(times),
                walked,
            });
        }
    }
    Ok(rows)
}

fn bake(mesh: &Mesh, profile: Profile, triangles: TriangleEncoding) -> Result<Bvh, Failure> {
    let options = Options::default().profile(profile).triangles(triangles);
    let bvh = Bvh::from_bytes(to_bytes(mesh, &options)?.0)?;
    bvh.check_all()?;
    Ok(bvh)
}

/// Reads 12 numbers per line, the rows of a 3 by 4 matrix; `#` starts a comment.
fn read_poses(path: &Path) -> Result<Vec<Pose>, Failure> {
    let text = fs::read_to_string(path).map_err(|error| in_file(path, error))?;
    let mut poses = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_whitespace().collect();
        if words.is_empty() {
            continue;
        }
        let numbers = words.iter().map(|word| word.parse()).collect::<Result<Vec<f64>, _>>()?;
        let wrong =
            |found: &str| in_file(path, format!("line {}: expected 12 numbers, found {found}", number + 1));
        let rows: [f64; 12] = numbers.try_into().map_err(|_| wrong(&words.len().to_string()))?;
        poses.push(Pose::from_rows(&rows).map_err(|error| wrong(&error.to_string()))?);
    }
    Ok(poses)
}

/// Walks both trees in all poses, for contact and for distance. Where one walk was given up, there are no figures.
fn walks(bake: &Baked, poses: &[Pose], distances: &[f64]) -> [Option<Walked>; 2] {
    let (Some(a), Some(b)) = (Tree::of_file(&bake.a), Tree::of_file(&bake.b)) else { return [None; 2] };
    [0.0, 1.0].map(|part| {
        let walks =
            poses.par_iter().zip(distances).map(|(pose, distance)| walk(&a, &b, pose, part * distance));
        let sum = walks.collect::<Option<Vec<Counts>>>()?.into_iter().fold(Counts::default(), Counts::plus);
        let mean = |count: u64| count as f64 / poses.len() as f64;
        Some(Walked {
            node_tests: mean(sum.node_tests),
            packet_tests: mean(sum.packet_tests),
            // If no pair is let through, there is no share.
            in_vain: (sum.through > 0).then(|| sum.in_vain as f64 / sum.through as f64),
        })
    })
}
