//! Slabs that turn with the surface: what one more slab per child, along a direction of its own, saves in tests.
//!
//! All counts are of complete walks in memory over trees of one kind, binary trees cut into treelets of four children. The
//! first directions of a 26-DOP are those of smaller k-DOPs, with the same codes.

mod census;
mod direction;
mod markdown;
mod patch;
mod row;
mod scene;
mod separation;
mod share;
mod slab;
mod study;
#[cfg(test)]
mod tests;
mod variant;
mod vector;
mod walk;

use crate::arguments::SlabArguments;
use crate::{Failure, input, output};
use bvh_bake::{Options, Profile, TriangleEncoding};
use cbvh_measure::origin::Origin;
use cbvh_measure::pairs::Pair;
use cbvh_measure::table;
use census::Census;
use row::Row;
use scene::Scene;
use serde::Serialize;
use share::Share;
use slab::Making;
use std::path::Path;

/// Balls have the largest number of triangles divided by these, but not fewer than the least.
const BALL_PARTS: [u64; 3] = [100, 10, 1];
const LEAST_BALL: u64 = 1000;

/// The whole report: where it was counted, and the rows.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    origin: Origin,
    /// The most poses per set.
    poses: u16,
    #[serde(serialize_with = "table::objects")]
    rows: Vec<Row>,
    #[serde(serialize_with = "table::objects")]
    shares: Vec<Share>,
    #[serde(serialize_with = "table::objects")]
    census: Vec<Census>,
}

pub(crate) fn run(arguments: &SlabArguments) -> Result<String, Failure> {
    let out = &arguments.out;
    let pairs = input::pairs(&arguments.pairs, arguments.meshes.as_deref(), None)?;
    output::make_folder(out)?;
    let count = usize::from(arguments.limit);
    let mut report = Report {
        origin: Origin::of("cbvh-lab slabs"),
        poses: arguments.limit,
        rows: Vec::new(),
        shares: Vec::new(),
        census: census(&pairs)?,
    };
    let mut scenes = Vec::new();
    for pair in &pairs {
        output::tell(&format!("{}: baking and asking", pair.name));
        let scene = Scene::of_pair(pair, [&arguments.contact, &arguments.distance], count)?;
        scenes.push(scene);
    }
    report.shares = shares(&pairs, &mut scenes);
    report.rows = study::of_pairs(&mut scenes);
    drop(scenes);
    let mut sizes = BALL_PARTS.map(|part| (arguments.largest / part).max(LEAST_BALL)).to_vec();
    sizes.dedup();
    let ball = |&size: &u64| {
        output::tell(&format!("ball of {size} triangles: baking and asking"));
        Scene::of_ball(size, count)
    };
    let mut balls = sizes.iter().map(ball).collect::<Result<Vec<_>, _>>()?;
    report.rows.extend(study::of_balls(&mut balls));
    let files = [
        ("slabs.csv", table::csv(&report.rows)),
        ("slabs-shares.csv", table::csv(&report.shares)),
        ("slabs-census.csv", table::csv(&report.census)),
        ("slabs.json", output::json(&report)?),
        ("slabs.md", markdown::page(&report)),
    ];
    output::write(out, &files)?;
    Ok(format!("{}: {} pairs, {} rows\n", out.join("slabs.md").display(), pairs.len(), report.rows.len()))
}

fn shares(pairs: &[Pair], scenes: &mut [Scene]) -> Vec<Share> {
    let mut shares: Vec<Share> = Vec::new();
    for (pair, scene) in pairs.iter().zip(scenes) {
        scene.make(Making::USUAL);
        for (path, body) in [&pair.a, &pair.b].into_iter().zip(scene.bodies()) {
            let mesh = name(path);
            if shares.iter().all(|share| share.mesh != mesh) {
                shares.extend(Share::of_mesh(&mesh, body));
            }
        }
    }
    shares
}

/// Counts the bytes of each mesh in three layouts.
fn census(pairs: &[Pair]) -> Result<Vec<Census>, Failure> {
    let mut meshes: Vec<&Path> = pairs.iter().flat_map(|pair| [pair.a.as_path(), &pair.b]).collect();
    meshes.sort_unstable();
    meshes.dedup();
    let packed = |profile| Options::default().profile(profile).triangles(TriangleEncoding::Packed);
    let mut all = Vec::new();
    for path in meshes {
        output::tell(&format!("{}: counting bytes", path.display()));
        let mesh = input::mesh(path)?;
        for (layout, options) in [
            ("chosen", Options::default()),
            ("asked", packed(Profile::Dop14U8)),
            ("asked", packed(Profile::Dop6U8)),
        ] {
            all.push(Census::of_file(&name(path), layout, &input::bake(&mesh, &options)?)?);
        }
    }
    Ok(all)
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
