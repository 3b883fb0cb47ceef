//! What can be seen of a bake while it goes on: shares that only grow, and are whole when the next step begins.

use bvh_bake::mesh::Mesh;
use bvh_bake::{FileBake, Options, Outcome, Progress, Stage, Step, Traffic, to_bytes};
use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};

/// A strip of triangles as OBJ, the last of which is twice there.
fn strip(count: u32) -> String {
    let vertices = (0..count + 2).map(|i| format!("v {i} {} {}\n", i % 2, i % 7));
    let faces = (1..=count).map(|i| format!("f {i} {} {}\n", i + 1, i + 2));
    vertices.chain(faces).collect::<String>() + &format!("f {count} {} {}\n", count + 1, count + 2)
}

#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads")]
fn shares_grow_to_the_whole() {
    let directory = cbvh_testkit::folder();
    let (input, output) = (directory.path().join("in.obj"), directory.path().join("out.cbvh"));
    let count = 300_000;
    fs::write(&input, strip(count)).unwrap();
    for max_memory in [None, Some(140 << 20)] {
        let progress = Progress::default();
        assert!(Step::ALL.iter().all(|&step| progress.share(step).is_none()));
        let mut begun = Vec::new();
        let is_done = AtomicBool::new(false);
        let outcome = std::thread::scope(|scope| {
            scope.spawn(|| {
                let mut before = [0.0; Step::ALL.len()];
                while !is_done.load(Ordering::Relaxed) {
                    for (before, step) in before.iter_mut().zip(Step::ALL) {
                        let share = progress.share(step).unwrap_or(0.0);
                        assert!((*before..=1.0).contains(&share), "{step:?}: {before}, then {share}");
                        *before = share;
                    }
                    std::thread::yield_now();
                }
            });
            let bake =
                FileBake::new([&input], &output).force(true).max_memory(max_memory).progress(&progress);
            let bake = bake.on_step(|step| {
                let shares = begun.iter().map(|&step| progress.share(step));
                assert!(shares.into_iter().all(|share| share == Some(1.0)), "{step:?} after {begun:?}");
                assert!(progress.share(step).unwrap_or(0.0) < 1.0, "{step:?}");
                begun.push(step);
            });
            let outcome = bake.run();
            is_done.store(true, Ordering::Relaxed);
            outcome
        });
        assert_eq!(begun, Step::ALL);
        let Ok(Outcome::Baked(report)) = outcome else { panic!("{outcome:?}") };
        assert_eq!(report.traffic, progress.traffic());
        assert_eq!(report.traffic.scratch_written > 0, max_memory.is_some());
        for step in Step::ALL {
            assert_eq!(progress.share(step), Some(1.0), "{step:?}");
            let left_out = u64::from(step > Step::Bake(Stage::Prepare));
            assert_eq!(progress.triangles(step), u64::from(count) + 1 - left_out, "{step:?}");
        }
    }
}

#[test]
fn what_is_up_to_date_is_read_and_not_written() {
    let directory = cbvh_testkit::folder();
    let (input, output) = (directory.path().join("in.obj"), directory.path().join("out.cbvh"));
    fs::write(&input, strip(1000)).unwrap();
    let bake = || {
        let progress = Progress::default();
        FileBake::new([&input], &output).progress(&progress).run().unwrap();
        progress.traffic()
    };
    bake();
    let Traffic { input_read, output_read, .. } = bake();
    assert_eq!(input_read, fs::metadata(&input).unwrap().len());
    assert!(output_read > 0);
    let mut expected = Traffic::default();
    (expected.input_read, expected.output_read) = (input_read, output_read);
    assert_eq!(bake(), expected);
}

#[test]
fn a_bake_in_memory_has_no_traffic() {
    let corners = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let (_, report) = to_bytes(&Mesh::from_triangles(corners, vec![[0, 1, 2]]), &Options::default()).unwrap();
    assert_eq!(report.traffic, Traffic::default());
}
