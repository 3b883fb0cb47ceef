//! Bakes files that readers often mishandle: each gives an output that verifies, or is refused in one line.

use crate::common::{Files as _, cbvh_in, names, place, shared};
use std::path::PathBuf;

/// What readers mishandle, written here.
fn written() -> Vec<(&'static str, Vec<u8>)> {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    let obj = |rest: &str| format!("{corners}{rest}").into_bytes();
    let binary = |count: u32, triangles: &[[f32; 9]]| {
        let mut bytes = b"solid by name only".to_vec();
        bytes.resize(80, 0);
        bytes.extend(count.to_le_bytes());
        for corners in triangles {
            bytes.extend([0; 12]);
            bytes.extend(corners.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    };
    let triangle = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let row = (0..100).map(|k| format!("v {0:e} 0 0\nv {0:e} 1 0\nv {0:e} 0 1\nf -3 -2 -1\n", 2f64.powi(k)));
    vec![
        ("slivers.obj", obj("v 1 1e-30 0\nv 1e6 1e-6 0\nf 1 2 5\nf 1 6 2\nf 2 3 4\n")),
        ("no_area.obj", obj("v 2 0 0\nf 1 2 5\nf 1 1 1\n")),
        ("same.obj", obj(&"f 1 2 3\n".repeat(1000))),
        ("fan.obj", obj(&(0..64).map(|k| format!("v 0 {k} 1\nf 1 2 -1\n")).collect::<String>())),
        ("row.obj", row.collect::<String>().into_bytes()),
        ("far.obj", obj(&format!("v {0} {0} {0}\nv {0} {0} 16777217.5\nf 1 5 6\n", 16_777_216))),
        ("polygon.obj", obj("v 0.4 0.4 0\nf 1 2 5 3\n")),
        ("bom.obj", [b"\xEF\xBB\xBF".as_slice(), &obj("f 1 2 3")].concat()),
        ("unused.obj", obj("v nan 0 0\nf 1 2 3\n")),
        ("solid.stl", binary(2, &[triangle, triangle.map(|x| -x)])),
        ("nan.obj", obj("v nan 0 0\nf 1 2 5\n")),
        ("too_large.obj", obj("v 1e39 0 0\nf 1 2 5\n")),
        ("beyond.obj", obj("f 1 2 5\n")),
        ("before.obj", obj("f -1 -2 -5\n")),
        ("comma.obj", b"v 0,5 0 0\n".to_vec()),
        ("no_faces.obj", obj("")),
        ("empty.stl", vec![]),
        ("count.stl", binary(u32::MAX, &[triangle])),
        ("cut.stl", binary(2, &[triangle])),
        ("unsupported.off", b"OFF\n0 0 0\n".to_vec()),
    ]
}

#[test]
fn hard_files_bake_or_are_refused() {
    let inputs = place();
    let written = written();
    written.iter().for_each(|(name, bytes)| inputs.write(name, bytes));
    // The first ten bake.
    let (baked, refused) = written.split_at(10);
    for (files, expected) in
        [(baked, Ended { baked: 40, refused: 0 }), (refused, Ended { baked: 0, refused: 40 })]
    {
        let paths = files.iter().map(|(name, _)| inputs.join(name));
        assert_eq!(bake_or_refuse(paths), expected);
    }
}

#[test]
#[ignore = "needs ../shared"]
fn more_hard_files_bake_or_are_refused() {
    let hard = shared("hard");
    let files = names(&hard).into_iter().filter(|name| name != "HARD.csv");
    let ended = bake_or_refuse(files.map(|name| hard.join(name)));
    assert!(ended.baked > 100 && ended.refused > 100, "{ended:?}");
}

/// How many bakes of hard files ended which way.
#[derive(Debug, PartialEq)]
struct Ended {
    baked: u32,
    refused: u32,
}

fn bake_or_refuse(inputs: impl Iterator<Item = PathBuf>) -> Ended {
    let directory = &place();
    let mut ended = Ended { baked: 0, refused: 0 };
    for path in inputs {
        let name = path.file_name().unwrap().to_str().unwrap();
        let input = path.to_str().unwrap();
        for options in [
            &[][..],
            &["--triangles", "packed", "--no-ids", "--profile", "dop6-f16"],
            &["--triangles", "quantized", "--split-objects", "--profile", "dop26-u4"],
            &["--triangles", "quantized", "--no-ids", "--profile", "dop14-f32"],
        ] {
            let bake =
                cbvh_in(directory, &[&["bake", input, "-o", "o.cbvh", "--force"][..], options].concat());
            if bake.code == 0 {
                let is_warning = |line: &str| line.starts_with("cbvh: warning: ") && line.contains(name);
                assert!(bake.err.lines().all(is_warning), "{name}: {bake:?}");
                directory.cbvh("validate o.cbvh").done();
                cbvh_in(directory, &["verify", "o.cbvh", input]).done();
                directory.cbvh("dump o.cbvh").done();
                std::fs::remove_file(directory.join("o.cbvh")).unwrap();
                ended.baked += 1;
            } else {
                bake.failed(3, &[name, "expected", "found"]);
                ended.refused += 1;
            }
            assert!(names(directory).is_empty(), "{name}");
        }
        // The mesh is queried against itself, which must end like any other query.
        let pose = "1 0 0 0.5 0 1 0 0.25 0 0 1 0.125";
        for mode in ["contacts", "distance"] {
            let asked = cbvh_in(directory, &["query", input, input, "--mode", mode, "--pose", pose]);
            assert!([0, 3].contains(&asked.code), "{name}: {asked:?}");
        }
    }
    ended
}
