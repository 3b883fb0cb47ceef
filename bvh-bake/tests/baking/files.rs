//! Bakes from file to file: what is up to date, numbers over several inputs, and what is refused before the work.

use bvh_bake::{BakeError, FileBake, Options, Outcome, least_memory, read_meshes};
use std::fs;
use std::path::{Path, PathBuf};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn bake(inputs: &[PathBuf], output: &Path, options: &Options) -> Result<Outcome, BakeError> {
    FileBake::new(inputs, output).options(options.clone()).run()
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn what_is_up_to_date_is_left_alone() {
    let directory = cbvh_testkit::folder();
    let input = directory.path().join("in.obj");
    let output = directory.path().join("out.cbvh");
    fs::write(&input, TRIANGLE).unwrap();
    let inputs = [input.clone()];
    let options = Options::default();
    let skipped = |options: &Options| match bake(&inputs, &output, options).unwrap() {
        Outcome::UpToDate(_) => true,
        Outcome::Baked(_) => false,
    };
    assert!(!skipped(&options));
    assert!(skipped(&options));
    let other = Options::default().ids(false);
    assert!(!skipped(&other));
    assert!(skipped(&other));
    fs::write(&input, format!("{TRIANGLE}v 5 5 5\n")).unwrap();
    assert!(!skipped(&other));
    let mut damaged = fs::read(&output).unwrap();
    let last = damaged.len() - 1;
    damaged[last / 2] ^= 1;
    fs::write(&output, &damaged).unwrap();
    assert!(!skipped(&other), "a damaged output is no output");
    assert_eq!(names(directory.path()), ["in.obj", "out.cbvh"]);
}

#[test]
fn ids_run_on_over_files() {
    let directory = cbvh_testkit::folder();
    let inputs = ["a.obj", "b.obj"].map(|name| directory.path().join(name));
    inputs.iter().for_each(|input| fs::write(input, TRIANGLE).unwrap());
    let mesh = read_meshes(&inputs).unwrap();
    assert_eq!(mesh.objects.len(), 2);
    assert_eq!(mesh.objects[1].triangle_ids, [1]);
    assert_eq!(mesh.check(), Ok(()));
}

#[test]
fn an_input_is_never_the_output() {
    let directory = cbvh_testkit::folder();
    let input = directory.path().join("in.obj");
    fs::write(&input, TRIANGLE).unwrap();
    let output = directory.path().join(".").join("in.obj");
    let refused = bake(std::slice::from_ref(&input), &output, &Options::default());
    assert!(matches!(refused, Err(BakeError::OutputIsInput { .. })), "{refused:?}");
    let refused = bake(std::slice::from_ref(&input), directory.path(), &Options::default());
    assert!(matches!(refused, Err(BakeError::Write { .. })), "{refused:?}");
    assert_eq!(fs::read_to_string(&input).unwrap(), TRIANGLE);
    assert_eq!(names(directory.path()), ["in.obj"]);
}

#[test]
fn a_small_budget_is_refused_before_the_work() {
    let directory = cbvh_testkit::folder();
    let input = directory.path().join("in.obj");
    fs::write(&input, TRIANGLE).unwrap();
    let output = directory.path().join("out.cbvh");
    for budget in [0, 10, least_memory(1) - 1] {
        let refused = FileBake::new([&input], &output).max_memory(budget).run();
        assert!(matches!(refused, Err(BakeError::Memory { .. })), "{refused:?}");
    }
    assert_eq!(names(directory.path()), ["in.obj"]);
}
