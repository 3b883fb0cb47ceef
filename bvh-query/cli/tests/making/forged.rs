//! Runs `dump`, `validate` and `verify` on forged files with correct checksums. They end with an exit code, never a
//! panic.

use crate::common::{TESTDATA, cbvh_in, cube};
use cbvh_testkit::Random;
use cbvh_testkit::damage::mislead;
use cbvh_testkit::depth::rounds;
use cbvh_testkit::seal::{put, seal, section};
use std::path::Path;

/// Returns the golden file with a few words replaced.
fn forged(golden: &[u8], seed: u64) -> Vec<u8> {
    let (mut bytes, mut random) = (golden.to_vec(), Random::new(seed));
    mislead(&mut bytes, golden, 1 + seed % 3, &mut random);
    seal(&mut bytes);
    bytes
}

#[test]
fn forged_files_end_with_an_exit_code() {
    let testdata = Path::new(TESTDATA);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cube.obj"), cube()).unwrap();
    let (mut fine, mut invalid) = (0, 0);
    let goldens = ["everything", "profiles"]
        .map(|name| std::fs::read(testdata.join(format!("ok-{name}.cbvh"))).unwrap());
    let files = rounds(12);
    for seed in 0..files {
        std::fs::write(folder.path().join("f.cbvh"), forged(&goldens[seed as usize % 2], seed)).unwrap();
        let (page, treelet) = ((seed % 3).to_string(), (seed % 7).to_string());
        let ways: [&[&str]; 6] = [
            &["dump", "f.cbvh"],
            &["dump", "f.cbvh", "--json"],
            &["dump", "f.cbvh", "--page", &page],
            &["dump", "f.cbvh", "--treelet", &treelet],
            &["validate", "f.cbvh", "--json"],
            &["verify", "f.cbvh", "cube.obj"],
        ];
        for way in ways {
            let ended = cbvh_in(folder.path(), way);
            // The exit code is 1 if there is no such page or treelet.
            assert!([0, 1, 3].contains(&ended.code), "file {seed}, {way:?}: {ended:?}");
            fine += u64::from(ended.code == 0);
            invalid += u64::from(ended.code == 3);
        }
    }
    // Of six ways per file, two to three are fine and three invalid; the rest asks for a page or treelet that is not there.
    assert!(fine > files && invalid > 2 * files, "{fine} fine, {invalid} invalid");
}

/// Only `validate` checks rule 34. The other commands must not add up the numbers that the records state.
#[test]
fn stated_counts_may_have_no_sum() {
    let testdata = Path::new(TESTDATA);
    let mut bytes = std::fs::read(testdata.join("ok-profiles.cbvh")).unwrap();
    let table = section(&bytes, 1).start + 16;
    for record in (0..10).map(|number| table + 192 * number) {
        // These two fields are the numbers of treelets and of duplicates.
        put(&mut bytes, record + 72, &u64::MAX.to_le_bytes());
        put(&mut bytes, record + 120, &u64::MAX.to_le_bytes());
    }
    seal(&mut bytes);
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("f.cbvh"), bytes).unwrap();
    cbvh_in(folder.path(), &["dump", "f.cbvh"]).done();
    cbvh_in(folder.path(), &["dump", "f.cbvh", "--treelet", "1000000"])
        .failed(1, &["expected a treelet below"]);
    cbvh_in(folder.path(), &["validate", "f.cbvh"]).failed(3, &["34"]);
    let pose = "1 0 0 0  0 1 0 0  0 0 1 0";
    cbvh_in(folder.path(), &["query", "f.cbvh", "f.cbvh", "--mode", "collide", "--pose", pose]).done();
}
