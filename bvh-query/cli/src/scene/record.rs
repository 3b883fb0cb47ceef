//! The output about a frame: the line of `--bench` with the hash of the answers, records, and lists of pairs.

use super::file::LoadedScene;
use super::{Answer, Mode, SceneArguments};
use crate::asking::files::stem;
use crate::asking::runner::Run;
use crate::asking::{self, distance_json, mode_name};
use crate::console::{Record, counted, record, significant};
use bvh_format::checksum::Hasher;
use bvh_query::{Backend, InstanceId, Relation, ScenePair};

/// An answer with the scene that knows the names of instances.
pub(super) struct Told<'a> {
    pub(super) scene: &'a LoadedScene,
    pub(super) mode: Mode,
    pub(super) answer: Answer,
}

/// Returns the line of `--bench`: the fields that programs of this protocol share, and further ones.
pub(super) fn bench(
    arguments: &SceneArguments,
    scene: &LoadedScene,
    backend: Backend,
    run: &Run<Told<'_>>,
) -> Record {
    record! {
        peer: "cbvh",
        version: env!("CARGO_PKG_VERSION"),
        mode: mode_name(&arguments.mode),
        scene: stem(&arguments.scene),
        frames: arguments.frames.as_deref().map_or(String::new(), stem),
        instances: scene.scene.len(),
        moving: scene.moving.len(),
        triangles: scene.triangles,
        build_s: scene.build_seconds,
        mesh_pair_tests: scene.pairs_asked,
    }
    .with(run.bench(backend, true))
}

impl asking::Answer for Told<'_> {
    /// Returns true if a pair touches, is near enough or has anything in common.
    fn is_positive(&self) -> bool {
        match self.answer {
            Answer::Nearest(..) => self.value() <= 0.0,
            _ => self.value() > 0.0,
        }
    }

    /// Returns the answer as a number: the distance of no pairs is infinite.
    fn value(&self) -> f64 {
        match &self.answer {
            Answer::Flag(flag) => f64::from(u8::from(*flag)),
            Answer::Pairs(pairs) => pairs.len() as f64,
            Answer::Nearest(nearest, _) => nearest.map_or(f64::INFINITY, |of| of.nearest.distance),
        }
    }

    fn json(&self) -> Record {
        let plain =
            |id| self.scene.scene.name(id).ok().flatten().map_or_else(|| self.name(id), str::to_owned);
        let names = |of: &ScenePair| record! { a: plain(of.a), b: plain(of.b) };
        match &self.answer {
            Answer::Flag(flag) => record! { collide: flag },
            Answer::Pairs(pairs) => {
                let related = |(of, relation): &(ScenePair, Option<Relation>)| {
                    names(of).with(relation.map(|relation| record! { relation: relation as u8 }))
                };
                record! { pairs: pairs.iter().map(related).collect::<Vec<_>>() }
            }
            Answer::Nearest(None, _) => record! { distance: None::<f64> },
            Answer::Nearest(Some(of), others) => {
                let others = others.as_ref().map(|others| {
                    let other = |(pair, by): &(ScenePair, f64)| names(pair).with(record! { distance: by });
                    record! { others: others.iter().map(other).collect::<Vec<_>>() }
                });
                names(&of.pair).with(distance_json(&of.nearest)).with(others)
            }
        }
    }

    /// Hashes names and values in order.
    fn hash(&self, hasher: &mut Hasher) {
        let mut pair = |of: &ScenePair| {
            for id in [of.a, of.b] {
                hasher.update(self.name(id).as_bytes());
                hasher.update(&[0]);
            }
        };
        match &self.answer {
            Answer::Flag(flag) => hasher.update(&[u8::from(*flag)]),
            Answer::Pairs(pairs) => {
                pairs.iter().for_each(|(of, _)| pair(of));
                let relations = pairs.iter().filter_map(|(_, relation)| *relation);
                relations.for_each(|relation| hasher.update(&[relation as u8]));
                hasher.update(&(pairs.len() as u64).to_le_bytes());
            }
            Answer::Nearest(nearest, _) => {
                nearest.iter().for_each(|of| pair(&of.pair));
                hasher.update(&self.value().to_bits().to_le_bytes());
            }
        }
    }
}

impl Told<'_> {
    fn name(&self, id: InstanceId) -> String {
        self.scene.name(id)
    }

    /// Returns what `--list` prints about a frame: a line, and below it one line per pair.
    pub(super) fn list(&self, number: usize) -> String {
        let names = |of: &ScenePair| format!("{} {}", self.name(of.a), self.name(of.b));
        let text = match &self.answer {
            Answer::Flag(true) => "touching".to_owned(),
            Answer::Flag(false) => "not touching".to_owned(),
            Answer::Pairs(pairs) => {
                let what = match self.mode {
                    Mode::Within => "near enough",
                    Mode::Relation => "touching or inside",
                    _ => "touching",
                };
                let line = |(of, relation): &(ScenePair, Option<Relation>)| {
                    let (a, b) = (self.name(of.a), self.name(of.b));
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
                let lines: String = pairs.iter().map(line).collect();
                format!("{} {what}{lines}", counted(pairs.len() as u64, "pair"))
            }
            Answer::Nearest(None, _) => "no pairs".to_owned(),
            Answer::Nearest(Some(of), others) => {
                let line = |pair, by| format!("{} {} mesh units apart", names(pair), significant(by));
                let others = others.iter().flatten().map(|(pair, by)| format!("\n  {}", line(pair, *by)));
                line(&of.pair, of.nearest.distance) + &others.collect::<String>()
            }
        };
        format!("frame {number}: {text}")
    }
}
