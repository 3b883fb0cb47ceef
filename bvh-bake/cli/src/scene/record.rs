//! The results of a run as data: the JSON line, the raw lines, the list of pairs and the hash of the answers.

use super::arguments::{Mode, SceneArguments};
use super::asked::{Answer, Question, Run};
use super::file::LoadedScene;
use crate::asking::Times;
use crate::asking::files::stem;
use crate::console::{hex, plural, significant};
use crate::process::resident;
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, InstanceId};
use serde::Serialize;
use std::fmt::Write;

/// The JSON line: the fields that programs of this protocol share, and further ones.
#[derive(Serialize)]
pub(super) struct Record {
    peer: &'static str,
    version: &'static str,
    mode: &'static str,
    scene: String,
    frames: String,
    instances: usize,
    moving: usize,
    triangles: u64,
    build_s: f64,
    #[serde(flatten)]
    times: Times,
    positives: u64,
    sum: f64,
    mesh_pair_tests: u64,
    peak_rss_mb: Option<f64>,
    isa: &'static str,
    answers_xxh3: Option<String>,
    node_tests: u64,
    triangle_tests: u64,
    exact_tests: u64,
    jobs: u16,
}

impl Record {
    pub(super) fn new(
        arguments: &SceneArguments,
        scene: &LoadedScene,
        backend: Backend,
        question: &Question,
        run: &Run,
    ) -> Self {
        let complete = run.answers.len() == run.requested;
        // Without pairs there is no distance to add.
        let values = run.answers.iter().map(|(answer, _)| answer.value()).filter(|value| value.is_finite());
        Self {
            peer: "cbvh",
            version: env!("CARGO_PKG_VERSION"),
            mode: question.mode.name(),
            scene: stem(&arguments.scene),
            frames: arguments.frames.as_deref().map_or(String::new(), stem),
            instances: scene.scene.len(),
            moving: scene.moving.len(),
            triangles: scene.triangles,
            build_s: scene.build_seconds,
            times: Times::new(run.answers.iter().map(|&(_, ns)| ns), run.requested, run.total_seconds),
            positives: run.answers.iter().filter(|(answer, _)| answer.is_positive()).count() as u64,
            sum: values.sum(),
            mesh_pair_tests: run.pairs_asked,
            peak_rss_mb: resident::peak_bytes().map(|bytes| bytes as f64 / 1048576.0),
            isa: backend.name(),
            answers_xxh3: complete.then(|| hex(hash(scene, run))),
            node_tests: run.stats.node_tests,
            triangle_tests: run.stats.packet_tests,
            exact_tests: run.stats.exact_tests,
            jobs: arguments.jobs,
        }
    }

    /// Returns a few lines for a person.
    pub(super) fn summary(&self) -> String {
        let micro = |nanoseconds: u64| format!("{:.1} \u{b5}s", nanoseconds as f64 / 1e3);
        let what = if self.mode == Mode::Within.name() { "with a pair near enough" } else { "with contact" };
        format!(
            "{}: {} {}, {} of them moving; {}: answered {} of {} {}, {} {what}\nper frame, poses included: median {}, \
             90 % below {}, slowest {} ({}, {} {})\n",
            self.scene,
            self.instances,
            plural(self.instances as u64, "instance"),
            self.moving,
            self.mode,
            self.times.queries,
            self.times.requested,
            plural(self.times.requested as u64, "frame"),
            self.positives,
            micro(self.times.ns_median),
            micro(self.times.ns_p90),
            micro(self.times.ns_max),
            self.isa,
            self.jobs,
            plural(u64::from(self.jobs), "thread"),
        )
    }
}

/// Returns XXH3-64 of names and values in order, without times.
fn hash(scene: &LoadedScene, run: &Run) -> u64 {
    let mut hasher = Hasher::default();
    for (answer, _) in &run.answers {
        let mut pair = |a: InstanceId, b: InstanceId| {
            for id in [a, b] {
                hasher.update(scene.name(id).as_bytes());
                hasher.update(&[0]);
            }
        };
        match answer {
            Answer::Flag(flag) => hasher.update(&[u8::from(*flag)]),
            Answer::Pairs(pairs) => {
                pairs.iter().for_each(|of| pair(of.a, of.b));
                hasher.update(&(pairs.len() as u64).to_le_bytes());
            }
            Answer::Nearest(nearest) => {
                if let Some((of, _)) = nearest {
                    pair(of.a, of.b);
                }
                hasher.update(&answer.value().to_bits().to_le_bytes());
            }
        }
    }
    hasher.finish()
}

/// Returns the raw lines: value, space, nanoseconds.
pub(super) fn raw(run: &Run) -> String {
    run.answers.iter().map(|(answer, ns)| format!("{} {ns}\n", significant(answer.value()))).collect()
}

/// Returns the pairs of each frame: one line per frame, one line per pair.
pub(super) fn list(scene: &LoadedScene, question: &Question, run: &Run) -> String {
    let mut text = String::new();
    for (number, (answer, _)) in (1..).zip(&run.answers) {
        // Writing to text in memory cannot fail.
        let _ = match answer {
            Answer::Flag(flag) => {
                writeln!(text, "frame {number}: {}", if *flag { "touching" } else { "not touching" })
            }
            Answer::Pairs(pairs) => {
                let count = pairs.len() as u64;
                let what = if question.mode == Mode::Within { "near enough" } else { "touching" };
                let _ = writeln!(text, "frame {number}: {count} {} {what}", plural(count, "pair"));
                pairs.iter().try_for_each(|of| writeln!(text, "  {} {}", scene.name(of.a), scene.name(of.b)))
            }
            Answer::Nearest(None) => writeln!(text, "frame {number}: no pairs"),
            Answer::Nearest(Some((of, distance))) => writeln!(
                text,
                "frame {number}: {} {} {} mesh units apart",
                scene.name(of.a),
                scene.name(of.b),
                significant(*distance)
            ),
        };
    }
    text
}
