//! Bakes files that readers often mishandle: each gives an output that verifies, or is refused in one line.

use crate::common::{Files as _, cbvh_in, names, place, shared, skip};

#[test]
fn hard_files_bake_or_are_refused() {
    let Some(hard) = shared("hard") else { return skip("no folder of hard files beside the repository") };
    let directory = &place();
    let (mut baked, mut refused) = (0, 0);
    for name in names(&hard).into_iter().filter(|name| name != "HARD.csv") {
        let path = hard.join(&name);
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
                bake.done();
                directory.cbvh("validate o.cbvh").done();
                cbvh_in(directory, &["verify", "o.cbvh", input]).done();
                directory.cbvh("dump o.cbvh").done();
                std::fs::remove_file(directory.join("o.cbvh")).unwrap();
                baked += 1;
            } else {
                bake.failed(3, &[&name, "expected", "found"]);
                refused += 1;
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
    assert!(baked > 0 && refused > 0);
}
