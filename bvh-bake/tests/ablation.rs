//! Other trees and other orders of pages: valid files of the same triangles, and no part of the usual bake.

use bvh_bake::mesh::Mesh;
use bvh_bake::{Ablation, Options, PageOrder, SplitRule, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// A wavy sheet of 2 n^2 triangles: hundreds of pages on three levels.
fn sheet(n: u32) -> Mesh {
    let at = |i: u32| f64::from(i) / f64::from(n);
    let wave = |x: f64, y: f64| 0.1 * (9.0 * x * y).sin();
    let positions = (0..=n).flat_map(|i| (0..=n).map(move |j| [at(i), at(j), wave(at(i), at(j))])).collect();
    let corner = |i: u32, j: u32| i * (n + 1) + j;
    let quad = |i: u32, j: u32| {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
        [[a, b, d], [a, d, c]]
    };
    let triangles = (0..n).flat_map(|i| (0..n).flat_map(move |j| quad(i, j))).collect();
    Mesh::from_triangles(positions, triangles)
}

fn options(ablation: Ablation) -> Options {
    let triangles = Some(TriangleEncoding::F32);
    Options { profile: Some(Profile::Dop14U8), triangles, ablation, ..Options::default() }
}

/// A bake proves what it made: no error means a valid file whose bounds contain their triangles.
#[test]
fn ablated_files_are_valid_and_differ() {
    let mesh = sheet(300);
    let bake = |ablation| to_bytes(&mesh, &options(ablation)).unwrap();
    let (usual, report) = bake(Ablation::default());
    assert_eq!(report.file.triangles, 2 * 300 * 300);
    let mut contents = vec![report.file.content_xxh3];
    for pages in &PageOrder::ALL[1..] {
        let (bytes, other) = bake(Ablation { pages: *pages, ..Ablation::default() });
        assert_eq!((bytes.len(), other.file.triangles), (usual.len(), report.file.triangles), "{pages:?}");
        // The same tree, its nodes summed up in another order.
        assert!((other.width_inflation - report.width_inflation).abs() < 1e-9, "{pages:?}");
        contents.push(other.file.content_xxh3);
    }
    for splits in &SplitRule::ALL[1..] {
        let (_, other) = bake(Ablation { splits: *splits, ..Ablation::default() });
        assert_eq!(other.file.triangles, report.file.triangles, "{splits:?}");
        contents.push(other.file.content_xxh3);
    }
    contents.sort_unstable();
    contents.dedup();
    // Orders may agree where there are few levels of pages; not all do here.
    assert!(contents.len() > SplitRule::ALL.len(), "{contents:?}");
}

#[test]
fn options_without_ablation_say_nothing_of_it() {
    let usual = options(Ablation::default()).stamp();
    assert!(usual.ends_with("ids=true"), "{usual}");
    let other = options(Ablation { splits: SplitRule::Median, ..Ablation::default() }).stamp();
    assert!(other.starts_with(&usual) && other != usual, "{other}");
}
