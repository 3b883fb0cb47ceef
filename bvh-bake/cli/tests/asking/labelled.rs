//! Queries poses whose distance is known from another library's conservative advancement.

use crate::common::{Files as _, cbvh_in, place, shared, skip};
use std::fs;

/// For each pair, its name, mesh A and mesh B.
const PAIRS: [[&str; 3]; 2] = [["fcl", "fclenv.obj", "fclrob.obj"], ["piano", "apartment.obj", "piano.obj"]];
const PRESETS: [&str; 7] = ["d0pen", "d0sep", "d0.5", "d1", "d5", "d10", "overlap"];

#[test]
fn answers_are_those_of_the_labels() {
    let (Some(poses), Some(meshes)) = (shared("poses"), shared("meshes")) else {
        return skip("no folders of poses and meshes beside the repository");
    };
    let directory = &place();
    for [pair, a, b] in PAIRS {
        let size = diagonal(&fs::read_to_string(meshes.join(a)).unwrap());
        for (mesh, name) in [(a, "a.cbvh"), (b, "b.cbvh")] {
            let mesh = meshes.join(mesh);
            cbvh_in(directory, &["bake", mesh.to_str().unwrap(), "-o", name, "--force", "-q"]).done();
        }
        for preset in PRESETS {
            let file = poses.join(format!("{pair}_{preset}.txt"));
            let labels: Vec<f64> = fs::read_to_string(&file).unwrap().lines().filter_map(label).collect();
            let touching = ["d0pen", "overlap"].contains(&preset);
            let values = |mode: &str| -> Vec<f64> {
                let query =
                    ["query", "a.cbvh", "b.cbvh", file.to_str().unwrap(), "--mode", mode, "--out", "raw"];
                cbvh_in(directory, &query).done();
                let raw = directory.text("raw");
                raw.lines().map(|line| line.split_once(' ').unwrap().0.parse().unwrap()).collect()
            };
            let collide = values("collide");
            assert_eq!(collide.len(), labels.len());
            for (index, hit) in collide.iter().enumerate() {
                assert_eq!(*hit, f64::from(u8::from(touching)), "{pair} {preset} {index}");
            }
            for (index, (distance, label)) in values("distance").iter().zip(&labels).enumerate() {
                let what = format!("{pair} {preset} {index}: {distance} for {label}");
                assert!((distance - label).abs() <= 1e-6 * size, "{what}");
                assert_eq!(*distance == 0.0, touching, "{what}");
            }
        }
    }
}

/// Returns the distance in a line's comment.
fn label(line: &str) -> Option<f64> {
    line.split_once("# dist ")?.1.trim().parse().ok()
}

/// Returns the diagonal of the box of an OBJ file.
fn diagonal(text: &str) -> f64 {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for line in text.lines().filter_map(|line| line.strip_prefix("v ")) {
        for (axis, number) in line.split_whitespace().take(3).enumerate() {
            let value: f64 = number.parse().unwrap();
            lo[axis] = lo[axis].min(value);
            hi[axis] = hi[axis].max(value);
        }
    }
    (0..3).map(|axis| (hi[axis] - lo[axis]).powi(2)).sum::<f64>().sqrt()
}
