//! Questions whose answers are known from elsewhere: poses with distances by another library's conservative advancement, and pairs in
//! decimal numbers with exact truths.

use crate::common::{Files as _, TESTDATA, cbvh_in, place, shared};
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_query::{Backend, Bvh, PenetrationOptions, Pose, Querier};
use cbvh_testkit::exact::{Dyadic, Number};
use serde_json::Value;
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

/// A fraction of two decimal integers, or an integer.
struct Fraction([Dyadic; 2]);

impl Fraction {
    fn parse(text: &str) -> Self {
        let integer = |text: &str| {
            let ten = Dyadic::of(10.0);
            let digit = |byte: u8| Dyadic::of(f64::from(byte - b'0'));
            text.bytes().fold(Dyadic::ZERO, |number, byte| number.times(&ten).plus(&digit(byte)))
        };
        let (above, below) = text.split_once('/').unwrap_or((text, "1"));
        Self([integer(above), integer(below)])
    }

    /// Whether the fraction lies between two numbers.
    fn is_between(&self, [lower, upper]: [Dyadic; 2]) -> bool {
        let [above, below] = &self.0;
        lower.times(below) <= *above && *above <= upper.times(below)
    }
}

/// Open cases, with truths that are not of this project: collide, distance and depth, of text that is parsed here.
#[test]
#[ignore = "needs ../shared"]
fn labelled_flush_pairs_have_their_answers() {
    let cases = fs::read_to_string(shared("flush").join("cases.jsonl")).unwrap();
    let backends = Backend::ALL.into_iter().filter(|backend| backend.is_available());
    let mut queriers: Vec<_> = backends.map(Querier::with_backend).collect();
    let mut count = 0;
    for (number, line) in cases.lines().enumerate() {
        let case: Value = serde_json::from_str(line).unwrap();
        let faces: Vec<[usize; 3]> = serde_json::from_value(case["triangles"].clone()).unwrap();
        let pose: [f64; 12] = serde_json::from_value(case["pose"].clone()).unwrap();
        let pose = Pose::from_rows(&pose).unwrap();
        let [a, b] = ["a", "b"].map(|side| {
            let corners: Vec<[String; 3]> = serde_json::from_value(case[side].clone()).unwrap();
            let corners: Vec<[f64; 3]> =
                corners.iter().map(|p| p.each_ref().map(|x| x.parse().unwrap())).collect();
            faces.iter().flat_map(|face| face.map(|corner| corners[corner])).collect::<Vec<_>>()
        });
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            let [a, b] = [&a, &b].map(|t| baked(t, encoding));
            for querier in &mut queriers {
                let what = format!("case {number}, {encoding:?}: {line}");
                assert_eq!(querier.collide(&a, &b, &pose).unwrap(), case["touch"] == true, "{what}");
                let found = querier.distance(&a, &b, &pose).unwrap();
                let squares = [found.lower, found.upper].map(|x| Dyadic::of(x).times(&Dyadic::of(x)));
                let truth = Fraction::parse(case["distance2"].as_str().unwrap());
                assert!(truth.is_between(squares), "{found:?}, {what}");
                if let Some(depth) = case["depth"].as_str() {
                    let found = querier.penetration(&a, &b, &pose, &PenetrationOptions::default()).unwrap();
                    let bounds = [found.lower, found.upper].map(Dyadic::of);
                    assert!(Fraction::parse(depth).is_between(bounds), "{found:?}, {what}");
                }
            }
        }
        count += 1;
    }
    assert_eq!(count, 700);
}

/// Bakes triangles of three corners each.
fn baked(corners: &[[f64; 3]], encoding: TriangleEncoding) -> Bvh {
    let count = corners.len() as u32 / 3;
    let mesh =
        Mesh::from_triangles(corners.to_vec(), (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect());
    let (bytes, _) = to_bytes(&mesh, &Options::default().triangles(encoding)).unwrap();
    Bvh::from_bytes(bytes).unwrap()
}
