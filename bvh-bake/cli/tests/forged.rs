//! `dump`, `validate` and `verify` of files of whatever content, checksums made right: an exit code, never a panic.

mod common;

#[allow(dead_code, reason = "others use the rest")]
#[path = "../../../bvh-format/tests/common/seal.rs"]
mod seal;

use common::{cbvh_in, cube};
use seal::{put, seal, section};
use std::path::Path;

/// Files to make; each is looked at in several ways.
const FILES: u64 = 120;

/// Splitmix64 of a seed and a counter.
fn random(seed: u64, draw: u64) -> usize {
    let mut x = (seed << 8 | draw).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ x >> 31) as usize >> 1
}

/// The golden file with a few words of one section replaced.
fn forged(golden: &[u8], seed: u64) -> Vec<u8> {
    let mut bytes = golden.to_vec();
    // Half of them in the tables and pages; a section that is not there is empty.
    let place = section(golden, [1, 2, 2, 3, 4, 5, 6, 1][random(seed, 0) % 8]);
    let place = if place.len() < 4 { section(golden, 2) } else { place };
    for draw in 0..1 + seed % 3 {
        // Pages have what is in use at their start.
        let most = place.len().min(512);
        let at = place.start + (random(seed, 3 * draw + 1) % most / 4 * 4).min(place.len().saturating_sub(4));
        let values = [0, 1, 0xff, u32::MAX, 0x7fc0_0000, 0x7f80_0000, random(seed, 3 * draw + 2) as u32];
        put(&mut bytes, at, &values[random(seed, 3 * draw + 3) % values.len()].to_le_bytes());
    }
    seal(&mut bytes);
    bytes
}

#[test]
fn forged_files_end_with_an_exit_code() {
    let testdata = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata");
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cube.obj"), cube()).unwrap();
    let (mut fine, mut invalid) = (0, 0);
    let goldens = ["everything", "profiles"]
        .map(|name| std::fs::read(testdata.join(format!("ok-{name}.cbvh"))).unwrap());
    for seed in 0..FILES {
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
            // 1: there is no such page or treelet.
            assert!([0, 1, 3].contains(&ended.code), "file {seed}, {way:?}: {ended:?}");
            fine += usize::from(ended.code == 0);
            invalid += usize::from(ended.code == 3);
        }
    }
    assert!(fine > 100 && invalid > 100, "{fine} fine, {invalid} invalid");
}

/// Rule 34 is for `validate` to check; the others must not add up what the records state.
#[test]
fn stated_counts_may_have_no_sum() {
    let testdata = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata");
    let mut bytes = std::fs::read(testdata.join("ok-profiles.cbvh")).unwrap();
    let table = section(&bytes, 1).start + 16;
    for record in (0..10).map(|number| table + 192 * number) {
        // Treelets and duplicates.
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
