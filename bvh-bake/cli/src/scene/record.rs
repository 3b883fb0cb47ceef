//! The results of a run: the line of `--bench` with the hash of the answers, the raw lines, records and lists of pairs.

use super::file::LoadedScene;
use super::{Answer, Mode, Question, Run, SceneArguments};
use crate::asking::files::stem;
use crate::asking::{distance_json, mode_name, peak_rss_mb, times};
use crate::console::{Record, hex, plural, record, significant};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, InstanceId, Relation, ScenePair};
use serde_json::{Value, json};

/// Returns the line of `--bench`: the fields that programs of this protocol share, and further ones.
pub(super) fn bench(
    arguments: &SceneArguments,
    scene: &LoadedScene,
    backend: Backend,
    question: &Question,
    run: &Run,
) -> Record {
    let complete = run.answers.len() == run.requested;
    // Without pairs there is no distance to add.
    let values = run.answers.iter().map(|(answer, _)| answer.value()).filter(|value| value.is_finite());
    record! {
        peer: "cbvh",
        version: env!("CARGO_PKG_VERSION"),
        mode: mode_name(&question.mode),
        scene: stem(&arguments.scene),
        frames: arguments.frames.as_deref().map_or(String::new(), stem),
        instances: scene.scene.len(),
        moving: scene.moving.len(),
        triangles: scene.triangles,
        build_s: scene.build_seconds,
    }
    .with(times(run.answers.iter().map(|&(_, ns)| ns), run.requested, run.total_seconds))
    .with(record! {
        positives: run.answers.iter().filter(|(answer, _)| answer.is_positive()).count(),
        sum: values.sum::<f64>(),
        mesh_pair_tests: run.pairs_asked,
        peak_rss_mb: peak_rss_mb(),
        isa: backend.name(),
        answers_xxh3: complete.then(|| hex(hash(scene, run))),
        node_tests: run.stats.node_tests,
        triangle_tests: run.stats.packet_tests,
        exact_tests: run.stats.exact_tests,
        jobs: arguments.run.jobs,
    })
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
                pairs.iter().for_each(|(of, _)| pair(of.a, of.b));
                let relations = pairs.iter().filter_map(|(_, relation)| *relation);
                relations.for_each(|relation| hasher.update(&[relation as u8]));
                hasher.update(&(pairs.len() as u64).to_le_bytes());
            }
            Answer::Nearest(nearest, _) => {
                if let Some(of) = nearest {
                    pair(of.pair.a, of.pair.b);
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

/// Returns all that the answer about a frame has, as a JSON object.
pub(super) fn json(scene: &LoadedScene, frame: usize, answer: &Answer) -> Value {
    let name = |id| scene.scene.name(id).ok().flatten().map_or_else(|| scene.name(id), str::to_owned);
    let names = |of: &ScenePair| json!({ "a": name(of.a), "b": name(of.b) });
    let related = |(of, relation): &(ScenePair, Option<Relation>)| {
        let mut pair = names(of);
        if let Some(relation) = relation {
            pair["relation"] = json!(*relation as u8);
        }
        pair
    };
    let mut record = match answer {
        Answer::Flag(flag) => json!({ "collide": flag }),
        Answer::Pairs(pairs) => json!({ "pairs": pairs.iter().map(related).collect::<Vec<_>>() }),
        Answer::Nearest(None, _) => json!({ "distance": null }),
        Answer::Nearest(Some(of), _) => {
            let mut record = distance_json(&of.nearest);
            record["a"] = json!(name(of.pair.a));
            record["b"] = json!(name(of.pair.b));
            record
        }
    };
    record["frame"] = json!(frame);
    record
}

/// Returns what `--list` prints about a frame: a line, and below it one line per pair.
pub(super) fn list(scene: &LoadedScene, question: &Question, number: usize, answer: &Answer) -> String {
    let names = |of: &ScenePair| format!("{} {}", scene.name(of.a), scene.name(of.b));
    let text = match answer {
        Answer::Flag(true) => "touching".to_owned(),
        Answer::Flag(false) => "not touching".to_owned(),
        Answer::Pairs(pairs) => {
            let what = match question.mode {
                Mode::Within => "near enough",
                Mode::Relation => "touching or inside",
                _ => "touching",
            };
            let line = |(of, relation): &(ScenePair, Option<Relation>)| {
                let (a, b) = (scene.name(of.a), scene.name(of.b));
                let words = match relation {
                    None => names(of),
                    Some(Relation::AInB) => format!("{a} inside {b}"),
                    Some(Relation::BInA) => format!("{b} inside {a}"),
                    Some(Relation::Mixed) => format!("{a} {b} not touching, partly inside"),
                    Some(Relation::Undefined) => format!("{a} {b} undefined, because one is not closed"),
                    Some(_) => format!("{a} {b} touching"),
                };
                format!("\n  {words}")
            };
            let (count, lines) = (pairs.len() as u64, pairs.iter().map(line).collect::<String>());
            format!("{count} {} {what}{lines}", plural(count, "pair"))
        }
        Answer::Nearest(None, _) => "no pairs".to_owned(),
        Answer::Nearest(Some(of), others) => {
            let line = |pair, distance| format!("{} {} mesh units apart", names(pair), significant(distance));
            let others = others.iter().map(|(pair, distance)| format!("\n  {}", line(pair, *distance)));
            line(&of.pair, of.nearest.distance) + &others.collect::<String>()
        }
    };
    format!("frame {number}: {text}")
}
