//! Asks another library: one process per question, with meshes as OBJ and the answer in a file.

use super::digits;
use super::judge::{Verdict, judge, span};
use crate::Failure;
use cbvh_testkit::Triangle;
use cbvh_testkit::hard_cases::{Ordered, Truth};
use serde::Serialize;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The longest time for a question; the meshes are small.
const MAX_TIME: Duration = Duration::from_secs(10);

/// Name, program, variant, precision and modes of a library.
type Known = (&'static str, &'static str, &'static str, &'static str, &'static [&'static str]);

/// The libraries that can be asked.
const KNOWN: [Known; 10] = [
    ("coal-OBBRSS", "peer_coal", "OBBRSS", "f64", &["collide", "contacts", "distance"]),
    ("coal-OBB", "peer_coal", "OBB", "f64", &["collide", "contacts"]),
    ("fcl-OBBRSS", "peer_fcl", "OBBRSS", "f64", &["collide", "contacts", "distance"]),
    ("fcl-OBB", "peer_fcl", "OBB", "f64", &["collide", "contacts"]),
    ("parry3d", "peer_parry", "api", "f32", &["collide", "distance"]),
    ("parry3d-f64", "peer_parry", "api-f64", "f64", &["collide", "distance"]),
    ("cgal-rigid", "peer_cgal", "", "f64", &["collide"]),
    ("bullet-gimpact", "peer_bullet", "", "f32", &["collide", "contacts"]),
    ("ode-opcode", "peer_ode", "", "f32", &["collide"]),
    // Embree has a tree of boxes; its program tests triangles itself, in f64.
    ("embree-boxes", "peer_embree", "refit", "f32", &["collide", "contacts"]),
];

/// A library in one variant.
pub(super) struct Peer {
    pub(super) name: &'static str,
    pub(super) precision: &'static str,
    pub(super) modes: &'static [&'static str],
    /// The version that its program states; empty before the first answer.
    pub(super) version: String,
    program: PathBuf,
    variant: &'static str,
}

/// The answer of a library to a question.
#[derive(Serialize)]
pub(super) struct Other {
    pub(super) peer: &'static str,
    pub(super) mode: &'static str,
    /// `None` after a crash or a timeout, and for NaN and infinity.
    pub(super) answer: Option<f64>,
    pub(super) verdict: Verdict,
    /// The error of a distance as a fraction of it.
    pub(super) error_of_distance: Option<f64>,
    pub(super) error_of_size: Option<f64>,
}

impl Peer {
    /// Returns all known programs in `build/bin`.
    pub(super) fn find(build: &Path) -> Result<Vec<Self>, Failure> {
        let bin = build.join("bin");
        let there = KNOWN.into_iter().filter(|known| bin.join(known.1).is_file());
        let peer = |(name, program, variant, precision, modes): Known| {
            // The program runs in another folder.
            let program = bin.join(program).canonicalize().unwrap_or_else(|_| bin.join(program));
            Self { name, precision, modes, version: String::new(), program, variant }
        };
        let peers: Vec<_> = there.map(peer).collect();
        if peers.is_empty() {
            return Err(format!("{}: expected programs peer_*, found none", bin.display()).into());
        }
        Ok(peers)
    }

    /// Asks in all modes about the meshes and the pose that `questions` holds.
    pub(super) fn ask(
        &mut self,
        questions: &Questions,
        truth: &Truth,
        order: &Ordered,
    ) -> Result<Vec<Other>, Failure> {
        let scale = span(&order.a, &order.b, &order.pose);
        let mut others = Vec::new();
        for &mode in self.modes {
            let failed = |error: io::Error| {
                format!("{}: expected a program to run, found {error}", self.program.display())
            };
            let ended = questions.run(&self.program, self.variant, mode).map_err(failed)?;
            if let Some(version) = ended.version {
                self.version = version;
            }
            let mut other = Other {
                peer: self.name,
                mode,
                answer: ended.answer.filter(|answer| answer.is_finite()),
                verdict: if ended.late { Verdict::Timeout } else { Verdict::Crash },
                error_of_distance: None,
                error_of_size: None,
            };
            if let Some(answer) = ended.answer {
                let (verdict, errors) = judge(mode, answer, truth, scale);
                let [of_distance, of_size] = errors.map(|error| error.filter(|error| error.is_finite()));
                other = Other { verdict, error_of_distance: of_distance, error_of_size: of_size, ..other };
            }
            others.push(other);
        }
        Ok(others)
    }
}

/// How a program ended.
struct Ended {
    answer: Option<f64>,
    version: Option<String>,
    late: bool,
}

/// A temporary folder for meshes, pose and answer, which is removed at the end.
pub(super) struct Questions {
    folder: PathBuf,
}

impl Drop for Questions {
    fn drop(&mut self) {
        // What cannot be removed is in the system's folder for temporary files.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

impl Questions {
    pub(super) fn new() -> Result<Self, Failure> {
        let folder = std::env::temp_dir().join(format!("cbvh-hard-{}", std::process::id()));
        // Not `create_dir_all`: a folder that exists belongs to another process.
        fs::create_dir(&folder).map_err(|error| Self::failed(&folder, &error))?;
        Ok(Self { folder })
    }

    fn failed(folder: &Path, error: &io::Error) -> Failure {
        format!("{}: expected a folder to write to, found {error}", folder.display()).into()
    }

    /// Writes the meshes and the pose of the next questions.
    pub(super) fn write(&self, order: &Ordered) -> Result<(), Failure> {
        let pose: Vec<_> = order.pose.iter().map(|&x| digits(x)).collect();
        for (name, text) in
            [("a.obj", obj(&order.a)), ("b.obj", obj(&order.b)), ("pose.txt", pose.join(" ") + "\n")]
        {
            fs::write(self.folder.join(name), text).map_err(|error| Self::failed(&self.folder, &error))?;
        }
        Ok(())
    }

    fn run(&self, program: &Path, variant: &str, mode: &str) -> io::Result<Ended> {
        let said = self.folder.join("said.json");
        let raw = self.folder.join("raw_pose.txt");
        // A remaining answer must belong to this question.
        if raw.exists() {
            fs::remove_file(&raw)?;
        }
        let mut command = Command::new(program);
        command.args(["a.obj", "b.obj", "pose.txt", "--mode", mode, "--out", "raw_%s.txt", "--warm", "0"]);
        if !variant.is_empty() {
            command.args(["--bv", variant]);
        }
        command.current_dir(&self.folder).stdin(Stdio::null()).stderr(Stdio::null());
        let mut child = command.stdout(fs::File::create(&said)?).spawn()?;
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break Some(status);
            }
            if start.elapsed() > MAX_TIME {
                child.kill()?;
                child.wait()?;
                break None;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        let first = |text: String| text.split_whitespace().next().and_then(|word| word.parse().ok());
        let line: Option<serde_json::Value> =
            fs::read_to_string(&said).ok().and_then(|text| serde_json::from_str(&text).ok());
        let version = line.and_then(|line| Some(line.get("version")?.as_str()?.to_owned()));
        let succeeded = status.is_some_and(|status| status.success());
        let answer = fs::read_to_string(&raw).ok().filter(|_| succeeded).and_then(first);
        Ok(Ended { answer, version, late: status.is_none() })
    }
}

/// Writes three vertices per triangle. No vertex is shared, so the corners of points and segments have different numbers.
fn obj(triangles: &[Triangle]) -> String {
    let mut text = String::new();
    for p in triangles.iter().flatten() {
        let [x, y, z] = p.map(digits);
        text.push_str(&format!("v {x} {y} {z}\n"));
    }
    for k in 0..triangles.len() {
        text.push_str(&format!("f {} {} {}\n", 3 * k + 1, 3 * k + 2, 3 * k + 3));
    }
    text
}
