//! Queries poses whose distance is known from another library's conservative advancement.

use crate::common::{Files as _, TESTDATA, cbvh_in, place, shared};
use std::fs;
use std::path::{Path, PathBuf};

const PRESETS: [&str; 7] = ["d0pen", "d0sep", "d0.5", "d1", "d5", "d10", "overlap"];

/// Poses of FCL's test pair, some of each preset.
#[test]
fn answers_about_a_small_pair_are_those_of_the_labels() {
    let directory = &place();
    let labelled = fs::read_to_string(Path::new(TESTDATA).join("labelled/poses.txt")).unwrap();
    let pair =
        Pair::bake(directory, &["fclenv.obj", "fclrob.obj"].map(|name| Path::new(TESTDATA).join(name)));
    for preset in PRESETS {
        let of_preset = labelled.lines().filter_map(|line| line.strip_prefix(preset)?.strip_prefix(' '));
        let poses: Vec<&str> = of_preset.collect();
        directory.write("poses.txt", poses.join("\n") + "\n");
        assert_eq!(pair.check(preset, &directory.join("poses.txt")), 6);
    }
}

#[test]
#[ignore = "needs ../shared"]
fn answers_are_those_of_the_labels() {
    let (poses, meshes) = (shared("poses"), shared("meshes"));
    for [name, a, b] in [["fcl", "fclenv.obj", "fclrob.obj"], ["piano", "apartment.obj", "piano.obj"]] {
        let directory = &place();
        let pair = Pair::bake(directory, &[a, b].map(|mesh| meshes.join(mesh)));
        for preset in PRESETS {
            assert_eq!(pair.check(preset, &poses.join(format!("{name}_{preset}.txt"))), 100);
        }
    }
}

/// Two meshes in a folder, baked.
struct Pair<'a> {
    directory: &'a Path,
    /// The diagonal of the first one's box.
    size: f64,
}

impl<'a> Pair<'a> {
    fn bake(directory: &'a Path, meshes: &[PathBuf; 2]) -> Self {
        for (mesh, name) in meshes.iter().zip(["a.cbvh", "b.cbvh"]) {
            cbvh_in(directory, &["bake", mesh.to_str().unwrap(), "-o", name, "-q"]).done();
        }
        Self { directory, size: diagonal(&fs::read_to_string(&meshes[0]).unwrap()) }
    }

    /// Checks the poses of a file, and returns how many these are.
    fn check(&self, preset: &str, poses: &Path) -> usize {
        let labels: Vec<f64> = fs::read_to_string(poses).unwrap().lines().filter_map(label).collect();
        let touching = ["d0pen", "overlap"].contains(&preset);
        let values = |mode: &str| -> Vec<f64> {
            let query =
                ["query", "a.cbvh", "b.cbvh", poses.to_str().unwrap(), "--mode", mode, "--out", "raw"];
            cbvh_in(self.directory, &query).done();
            let raw = self.directory.text("raw");
            raw.lines().map(|line| line.split_once(' ').unwrap().0.parse().unwrap()).collect()
        };
        let (collide, distances) = (values("collide"), values("distance"));
        assert_eq!((collide.len(), distances.len()), (labels.len(), labels.len()));
        for (index, hit) in collide.iter().enumerate() {
            assert_eq!(*hit, f64::from(u8::from(touching)), "{preset} {index}");
        }
        for (index, (distance, label)) in distances.iter().zip(&labels).enumerate() {
            let what = format!("{preset} {index}: {distance} for {label}");
            assert!((distance - label).abs() <= 1e-6 * self.size, "{what}");
            assert_eq!(*distance == 0.0, touching, "{what}");
        }
        labels.len()
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
