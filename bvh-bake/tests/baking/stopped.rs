//! A bake that is stopped ends with one error, wherever it is, and on all threads. It leaves nothing behind, and an output that
//! was there stays as it was.

use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeError, Effort, FileBake, Options, Stage, Step, Stop, TriangleEncoding, to_bytes};
use cbvh_testkit::ball::ball;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

/// Is set at one call and at no other, so that threads hear of it from each other.
struct AtCall {
    calls: AtomicU64,
    at: u64,
}

impl AtCall {
    fn new(at: u64) -> Arc<Self> {
        Arc::new(Self { calls: AtomicU64::new(0), at })
    }
}

impl Stop for AtCall {
    fn is_set(&self) -> bool {
        self.calls.fetch_add(1, Ordering::Relaxed) == self.at
    }
}

/// Stops a bake at its first calls one by one, and at ever fewer of those behind them, until it is done before. Returns a number of
/// calls that a bake does not reach.
fn stop_at_calls(mut bake: impl FnMut(Arc<AtCall>) -> Result<(), BakeError>) -> u64 {
    let mut at = 0;
    loop {
        match bake(AtCall::new(at)) {
            Ok(()) => return at,
            Err(BakeError::Stopped) => at += 1 + at / 30,
            Err(other) => panic!("at call {at}: {other}"),
        }
    }
}

/// A ball, the first of whose triangles are twice there.
fn with_duplicates(triangles: u64) -> Mesh {
    let (positions, mut faces) = ball(triangles);
    faces.extend_from_within(..triangles as usize / 10);
    Mesh::from_triangles(positions, faces)
}

#[test]
fn a_bake_in_memory_ends_wherever_it_is() {
    // More than what is baked alone.
    let mesh = with_duplicates(2000);
    let (mut two, mut second) = (mesh.clone(), mesh.objects[0].clone());
    let first_id = second.triangle_ids.len() as u32;
    second.triangle_ids.iter_mut().for_each(|id| *id += first_id);
    two.objects.push(second);
    let plain = Options::default;
    for (what, mesh, threads, options) in [
        ("plain", &mesh, 1, plain()),
        ("plain", &mesh, 3, plain()),
        ("quick", &mesh, 3, plain().effort(Effort::Quick)),
        ("welded", &mesh, 1, plain().weld(0.01)),
        ("packed", &mesh, 3, plain().triangles(TriangleEncoding::Packed).topology(false)),
        ("quantised", &mesh, 1, plain().triangles(TriangleEncoding::Quantized)),
        ("two objects", &two, 3, plain().split_objects(true)),
    ] {
        let (expected, _) = to_bytes(mesh, &options).unwrap();
        cbvh_testkit::pool(threads).install(|| {
            let calls = stop_at_calls(|stop| {
                let (bytes, _) = to_bytes(mesh, &options.clone().stop(Some(stop)))?;
                assert!(bytes == expected, "{what}: a flag that is not set changes no byte");
                Ok(())
            });
            assert!(calls > 30, "{what}, {threads} threads: {calls} calls");
        });
    }
    assert_eq!(plain().stop(Some(AtCall::new(0))).stamp(), plain().stamp());
}

fn names(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A folder with some inputs and an output that a bake has to leave alone.
struct Folder {
    folder: cbvh_testkit::TempDir,
    output: PathBuf,
    names: Vec<String>,
}

const OLD: &[u8] = b"old";

impl Folder {
    fn new(files: &[(&str, Vec<u8>)]) -> Self {
        let folder = cbvh_testkit::folder();
        files.iter().for_each(|(name, bytes)| fs::write(folder.path().join(name), bytes).unwrap());
        let output = folder.path().join("out.cbvh");
        fs::write(&output, OLD).unwrap();
        let names = names(folder.path());
        Self { folder, output, names }
    }

    /// Bakes an input, and checks that nothing has changed if that is stopped.
    fn bake(
        &self,
        input: &str,
        max_memory: Option<u64>,
        stop: Arc<AtCall>,
        on_step: impl FnMut(Step),
    ) -> Result<(), BakeError> {
        let bake = FileBake::new([self.folder.path().join(input)], &self.output).force(true);
        let options = Options::default().weld(1e-3).stop(Some(stop));
        let ended = bake.options(options).max_memory(max_memory).on_step(on_step).run();
        assert_eq!(names(self.folder.path()), self.names, "{input}");
        if ended.is_ok() {
            fs::write(&self.output, OLD).unwrap();
        } else {
            assert!(fs::read(&self.output).unwrap() == OLD, "{input}: {ended:?}");
        }
        ended.map(drop)
    }
}

/// A mesh as OBJ.
fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::new();
    for [x, y, z] in &mesh.objects[0].positions {
        writeln!(text, "v {x:?} {y:?} {z:?}").unwrap();
    }
    for [a, b, c] in &mesh.objects[0].triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    text.into_bytes()
}

/// A mesh as binary STL.
fn stl(mesh: &Mesh) -> Vec<u8> {
    let object = &mesh.objects[0];
    let mut bytes = vec![0; 80];
    bytes.extend((object.triangles.len() as u32).to_le_bytes());
    for triangle in &object.triangles {
        bytes.extend([0; 12]);
        let corners = triangle.map(|vertex| object.positions[vertex as usize]);
        bytes.extend(corners.as_flattened().iter().flat_map(|&value| (value as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A triangle as COLLADA.
const DAE: &str = r##"<COLLADA><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0</float_array>
<technique_common><accessor source="#a" count="3" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"##;

#[test]
fn a_bake_of_each_format_ends_wherever_it_is_and_leaves_nothing() {
    let mesh = with_duplicates(2000);
    let as_found =
        |name: &str| fs::read(format!("{}/../testdata/as-found/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let files = [
        ("ball.obj", obj(&mesh)),
        ("ball.stl", stl(&mesh)),
        ("found.ply", as_found("range-grid.ply")),
        ("found.gltf", as_found("skinned.gltf")),
        ("found.glb", as_found("unaligned-chunk.glb")),
        ("triangle.dae", DAE.into()),
        ("found.xyz", as_found("header.xyz")),
        ("found.pcd", as_found("padding-fields.pcd")),
    ];
    let folder = Folder::new(&files);
    for (input, _) in &files {
        for max_memory in [None, Some(64 << 20)] {
            let calls = stop_at_calls(|stop| folder.bake(input, max_memory, stop, |_| ()));
            assert!(calls > 15, "{input}, {max_memory:?}: {calls} calls");
        }
    }
}

/// The bake of a mesh of two bricks, on several threads, in each step.
#[test]
fn a_large_bake_is_stopped_in_each_step() {
    /// The triangles for which each step that takes long asks at least once.
    const TRIANGLES_PER_CALL: u64 = 1 << 15;
    const TRIANGLES: u64 = 300_000;
    let folder = Folder::new(&[("large.obj", obj(&with_duplicates(TRIANGLES)))]);
    cbvh_testkit::pool(2).install(|| {
        for max_memory in [None, Some(140 << 20)] {
            // One that nothing stops tells how often each step asks.
            let (never, calls) = (AtCall::new(u64::MAX), Mutex::new(Vec::new()));
            let begin = |step| calls.lock().unwrap().push((step, never.calls.load(Ordering::Relaxed)));
            folder.bake("large.obj", max_memory, never.clone(), begin).unwrap();
            let (calls, all) = (calls.into_inner().unwrap(), never.calls.load(Ordering::Relaxed));
            let ends = calls.iter().skip(1).map(|(_, end)| *end).chain([all]);
            let in_step: BTreeMap<Step, u64> =
                calls.iter().zip(ends).map(|((step, start), end)| (*step, end - start)).collect();
            for step in Step::ALL {
                let least = if step == Step::Write { 1 } else { TRIANGLES / TRIANGLES_PER_CALL };
                assert!(in_step[&step] >= least, "{max_memory:?}: {in_step:?}");
            }
            let mut steps = BTreeSet::new();
            for (step, start) in calls {
                let (at, mut last) = (start + in_step[&step] / 2, Step::Read);
                match folder.bake("large.obj", max_memory, AtCall::new(at), |step| last = step) {
                    Err(BakeError::Stopped) => drop(steps.insert(last)),
                    // Threads share their work as they come to it, so that the last calls may not come.
                    Ok(()) => assert!(step == Step::Write, "{step:?}: not stopped at call {at} of {all}"),
                    Err(other) => panic!("{other}"),
                }
            }
            let long = Step::ALL.into_iter().filter(|&step| step != Step::Write);
            assert!(long.into_iter().all(|step| steps.contains(&step)), "{steps:?}");
        }
    });
}

#[test]
#[cfg_attr(target_family = "wasm", ignore = "WebAssembly has no threads")]
fn another_thread_stops_a_bake() {
    let mesh = with_duplicates(300_000);
    let stop = Arc::new(AtomicBool::new(false));
    let options = Options::default().stop(Some(stop.clone()));
    // The flag is set when the bake has begun.
    let ended = bvh_bake::to_bytes_with(&mesh, &options, "", &mut |stage| {
        if stage == Stage::Build {
            let stop = stop.clone();
            std::thread::spawn(move || stop.store(true, Ordering::Relaxed)).join().unwrap();
        }
    });
    assert!(matches!(ended, Err(BakeError::Stopped)));
    // One that is set lets nothing begin, not even the search for the input.
    let bake = FileBake::new(["no such file"], "no such folder/out.cbvh").options(options.clone());
    let ended = bake.run();
    assert!(matches!(ended, Err(BakeError::Stopped)), "{ended:?}");
    assert_eq!(
        ended.unwrap_err().to_string(),
        "expected time for the bake, found it stopped: its flag is set, or its time is over"
    );
    stop.store(false, Ordering::Relaxed);
    assert!(to_bytes(&with_duplicates(100), &options).is_ok());
}
