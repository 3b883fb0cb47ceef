//! Layouts: queries with cold caches, and how many pairs of nodes the trees let through in vain.
//!
//! Warm times, bytes and errors of all layouts are in `cbvh report`, which takes the same list of pairs.

mod cold;
mod markdown;
mod row;
#[cfg(test)]
mod tests;
mod walk;

use crate::arguments::LayoutArguments;
use crate::tree::Tree;
use crate::{Failure, input, output};
use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Backend, Bvh, Pose, Querier};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::{Pair, spread_evenly};
use cbvh_measure::pin::pinned;
use cbvh_measure::rounds::{Question, Subject};
use cbvh_measure::spread::Spread;
use cbvh_measure::{poses, table};
use cold::Sweep;
use rayon::prelude::*;
use row::{Row, Walked};
use serde::Serialize;
use std::sync::Arc;
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
    let pairs = input::pairs(list, arguments.meshes.as_deref(), arguments.poses.as_deref())?;
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

/// Both meshes of a pair in one layout.
struct Baked {
    profile: Profile,
    triangles: TriangleEncoding,
    a: Arc<Bvh>,
    b: Arc<Bvh>,
}

fn measure(pair: &Pair, backend: Backend, sweep: &Sweep, limit: usize) -> Result<Vec<Row>, Failure> {
    let (mesh_a, mesh_b) = (input::mesh(&pair.a)?, input::mesh(&pair.b)?);
    let mut bakes = Vec::new();
    for profile in Profile::ALL {
        for triangles in LOSSLESS {
            let options = Options::default().profile(profile).triangles(triangles);
            let a = Arc::new(input::bake(&mesh_a, &options)?);
            let b = if pair.a == pair.b { a.clone() } else { Arc::new(input::bake(&mesh_b, &options)?) };
            bakes.push(Baked { profile, triangles, a, b });
        }
    }
    let mut given = Vec::new();
    for file in &pair.files {
        given.extend(input::poses(file)?);
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
