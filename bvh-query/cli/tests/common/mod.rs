//! Runs the command and makes small meshes.
#![allow(dead_code, reason = "each test program uses a part of it")]

pub(crate) mod sheet;

pub(crate) use cbvh_testkit::skip;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A folder for the files of one test, which is removed at its end.
pub(crate) struct Place(tempfile::TempDir);

/// Makes a folder for the files of one test.
pub(crate) fn place() -> Place {
    Place(tempfile::tempdir().unwrap())
}

impl std::ops::Deref for Place {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

impl AsRef<Path> for Place {
    fn as_ref(&self) -> &Path {
        self
    }
}

/// Reads and writes files by their names in a folder, and runs the command there.
pub(crate) trait Files {
    /// Runs the command with arguments without blanks.
    fn cbvh(&self, arguments: &str) -> Ended;

    /// Writes a file.
    fn write(&self, name: &str, content: impl AsRef<[u8]>);

    /// Returns the text of a file.
    fn text(&self, name: &str) -> String;
}

impl Files for Path {
    fn cbvh(&self, arguments: &str) -> Ended {
        cbvh_in(self, &arguments.split(' ').collect::<Vec<_>>())
    }

    #[track_caller]
    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.join(name), content).unwrap();
    }

    #[track_caller]
    fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.join(name)).unwrap()
    }
}

/// The outcome of a run of the command.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: i32,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// The longest time that a command may take on these files, even on a busy machine. Wine takes long to open and to flush
/// files.
const PATIENCE: Duration = Duration::from_secs(if cfg!(windows) { 1000 } else { 100 });

/// Runs the command in a directory.
pub(crate) fn cbvh_in(directory: &Path, arguments: &[&str]) -> Ended {
    run(Command::new(env!("CARGO_BIN_EXE_cbvh"))
        .args(arguments)
        .current_dir(directory)
        .env_remove("CBVH_ISA"))
}

/// Runs the command with a forced backend.
pub(crate) fn cbvh_with_isa(directory: &Path, isa: &str, arguments: &[&str]) -> Ended {
    run(Command::new(env!("CARGO_BIN_EXE_cbvh")).args(arguments).current_dir(directory).env("CBVH_ISA", isa))
}

/// Starts a command. Under Wine, a process now and then ends before it runs any code of its own, with the error
/// `ERROR_INTERNAL_ERROR` for its parent, which no program of this project can cause. It is then started again, once.
fn spawn(command: &mut Command) -> std::io::Result<Child> {
    const INTERNAL_ERROR: i32 = 1359;
    match command.spawn() {
        Err(error) if cfg!(windows) && error.raw_os_error() == Some(INTERNAL_ERROR) => command.spawn(),
        started => started,
    }
}

/// Runs a command to its end.
pub(crate) fn run(command: &mut Command) -> Ended {
    // Output goes to files, because a full pipe would stop the command.
    let directory = tempfile::tempdir().unwrap();
    let paths = ["out", "err"].map(|name| directory.path().join(name));
    let [out, err] = paths.each_ref().map(|path| std::fs::File::create(path).unwrap());
    let mut child = spawn(command.stdin(Stdio::null()).stdout(out).stderr(err)).unwrap();
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{command:?} hangs");
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let [out, err] = paths.map(|path| std::fs::read_to_string(path).unwrap());
    Ended { code: status.code().unwrap_or(-1), out, err }
}

impl Ended {
    /// Asserts that the command succeeded and printed nothing on standard error.
    #[track_caller]
    pub(crate) fn done(self) -> Self {
        assert_eq!((self.code, self.err.as_str()), (0, ""), "{self:?}");
        self
    }

    /// Asserts that the command succeeded and said of this many meshes that answers are about them as they are stored.
    #[track_caller]
    pub(crate) fn done_as_stored(self, meshes: usize) -> Self {
        let lines: Vec<&str> = self.err.lines().collect();
        let say_so =
            lines.iter().all(|line| line.contains("vertices moved by up to") && line.ends_with("as stored"));
        assert!(self.code == 0 && lines.len() == meshes && say_so, "{self:?}");
        self
    }

    /// Asserts that the command failed with this exit code and one line that contains all of `words`.
    #[track_caller]
    pub(crate) fn failed(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, code, "{self:?}");
        assert_eq!(self.err.lines().count(), 1, "{self:?}");
        assert!(self.err.starts_with("cbvh: ") && self.err.ends_with('\n'), "{self:?}");
        assert!(words.iter().all(|word| self.err.contains(word)), "{words:?} in {self:?}");
        self
    }

    /// Returns standard output as JSON objects, one per line.
    #[track_caller]
    pub(crate) fn json_lines(&self) -> Vec<Value> {
        self.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }

    /// Returns standard output as one JSON object.
    #[track_caller]
    pub(crate) fn json(&self) -> Value {
        let lines = self.json_lines();
        assert_eq!(lines.len(), 1, "{}", self.out);
        lines.into_iter().next().unwrap()
    }
}

/// Returns a glTF document of one mesh whose positions and 32-bit indices are in the buffers named, positions first.
pub(crate) fn gltf(vertices: usize, indices: usize, positions_uri: &str, indices_uri: &str) -> String {
    let (positions_length, indices_length) = (12 * vertices, 4 * indices);
    format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3"}},
            {{"bufferView":1,"componentType":5125,"count":{indices},"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{positions_length}}},{{"buffer":1,"byteLength":{indices_length}}}],
        "buffers":[{{"byteLength":{positions_length},"uri":"{positions_uri}"}},
            {{"byteLength":{indices_length},"uri":"{indices_uri}"}}]}}"#
    )
}

/// Returns the names of all files in a directory, sorted.
pub(crate) fn names(directory: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Returns the cube of side 2 around the origin.
pub(crate) fn cube() -> String {
    format!("o cube\n{}", cube_at(1, 0))
}

/// Returns a cube without a name, around a point of the x axis. Its faces look outwards. The numbers of the vertices count from
/// the last one of the text, so that such cubes may follow each other.
pub(crate) fn cube_at(half_side: i32, x: i32) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let at = |bit: u32| if corner >> bit & 1 == 1 { half_side } else { -half_side };
        text += &format!("v {} {} {}\n", x + at(0), at(1), at(2));
    }
    text + "f -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\nf -7 -5 -1 -3\n"
}

/// Returns a torus around z of 2 * n * m triangles, with radii 2 and 0.5 and with dents.
pub(crate) fn torus(n: usize, m: usize) -> String {
    let mut text = String::from("o torus\n");
    for i in 0..n {
        for j in 0..m {
            let (u, v) = ([i, j].map(|k| k as f64 * std::f64::consts::TAU)).into();
            let (u, v): (f64, f64) = (u / n as f64, v / m as f64);
            let tube = 0.5 + 0.05 * (7.0 * u + 3.0 * v).sin();
            let ring = 2.0 + tube * v.cos();
            text += &format!("v {:?} {:?} {:?}\n", ring * u.cos(), ring * u.sin(), tube * v.sin());
        }
    }
    for i in 0..n {
        for j in 0..m {
            let at = |i: usize, j: usize| i % n * m + j % m + 1;
            text += &format!("f {} {} {}\n", at(i, j), at(i + 1, j), at(i + 1, j + 1));
            text += &format!("f {} {} {}\n", at(i, j), at(i + 1, j + 1), at(i, j + 1));
        }
    }
    text
}

/// Returns poses, each turned about z by 0.1 rad more than the one before, and moved along x.
pub(crate) fn poses(count: usize, from: f64, to: f64) -> String {
    let mut text = String::from("# x y z turned\n\n");
    for i in 0..count {
        let (sin, cos) = (0.1 * i as f64).sin_cos();
        let x = from + (to - from) * i as f64 / count as f64;
        text += &format!("{cos:?} {:?} 0 {x:?} {sin:?} {cos:?} 0 0.25 0 0 1 -0.125 # {i}\n", -sin);
    }
    text
}

/// The folder of small meshes and frozen files.
pub(crate) const TESTDATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata");

/// Returns a folder of `shared/`, a folder beside the repository that not everyone has. Tests that need it are ignored for the
/// reason `needs ../shared`; `.ci/run` runs them where the folder is there.
pub(crate) fn shared(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(name);
    assert!(folder.is_dir(), "{}: expected this folder, found none", folder.display());
    folder
}

/// Returns the backends that this CPU has.
pub(crate) fn backends(directory: &Path) -> Vec<&'static str> {
    std::fs::write(directory.join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let there = |isa: &&str| {
        let pose = "1 0 0 0 0 1 0 0 0 0 1 0";
        let asked = cbvh_in(directory, &["query", "one.obj", "one.obj", "--isa", isa, "--pose", pose]);
        if asked.code != 0 {
            asked.failed(1, &["this CPU lacks", isa]);
            skip(&format!("this CPU has no {isa}"));
            return false;
        }
        true
    };
    ["scalar", "avx2", "avx512"].into_iter().filter(there).collect()
}
