//! Times the answers to one question at many poses, each by itself, for the timed part of the suite.
//!
//! The clock runs from the call of bvh-query to its answer. Poses are read before. In a field, the clock includes
//! placing the mesh among the instances.

use super::meshes::Meshes;
use super::message::{FieldMessage, TimedQuestion};
use crate::console::{Record, record};
use bvh_query::{Batch, Bvh, Groups, InstanceId, Pose, Querier, Scene};
use std::collections::HashMap;
use std::time::Instant;

/// Still instances, which are asked about moving ones only.
const STILL: Groups = Groups { member: 1, meets: 2 };
const MOVING: Groups = Groups { member: 2, meets: 1 };

/// Fields of instances by name. Each remembers the mesh that moves in it.
#[derive(Default)]
pub(super) struct Fields(HashMap<String, Field>);

struct Field {
    scene: Scene,
    moving: Option<(String, InstanceId)>,
}

impl Fields {
    /// Places instances, and returns how many seconds it took.
    pub(super) fn add(&mut self, message: &FieldMessage, meshes: &Meshes) -> Result<f64, String> {
        let start = Instant::now();
        let mut scene = Scene::new().map_err(text)?;
        for (number, rows) in &message.instances {
            let name = message.meshes.get(*number).ok_or("expected the number of a mesh")?;
            let pose = Pose::from_rows(rows).map_err(text)?;
            let instance = scene.add(meshes.get(name)?.clone(), pose).map_err(text)?;
            scene.set_groups(instance, STILL).map_err(text)?;
        }
        self.0.insert(message.field.clone(), Field { scene, moving: None });
        Ok(start.elapsed().as_secs_f64())
    }
}

impl Field {
    /// Returns the instance of the mesh that moves, in place of the one that moved before.
    fn moving(&mut self, name: &str, mesh: &Bvh) -> Result<InstanceId, String> {
        if let Some((known, instance)) = &self.moving {
            if known == name {
                return Ok(*instance);
            }
            self.scene.remove(*instance).map_err(text)?;
        }
        let instance = self.scene.add(mesh.clone(), Pose::IDENTITY).map_err(text)?;
        self.scene.set_groups(instance, MOVING).map_err(text)?;
        self.moving = Some((name.to_owned(), instance));
        Ok(instance)
    }
}

/// Returns the answers as numbers, and the nanoseconds that each took.
pub(super) fn ask(
    question: &TimedQuestion,
    meshes: &Meshes,
    fields: &mut Fields,
    querier: &mut Querier,
) -> Result<Record, String> {
    let poses: Vec<Pose> =
        question.poses.iter().map(|rows| Pose::from_rows(rows).map_err(text)).collect::<Result<_, _>>()?;
    let (name, b, budget) = (question.b.as_str(), meshes.get(&question.b)?, question.budget);
    let Some(field) = fields.0.get_mut(&question.a) else {
        let a = meshes.get(&question.a)?;
        return match (question.ask.as_str(), question.batch) {
            ("collide", true) => batch(
                &poses,
                |poses| Batch::new(a, b).map_err(text)?.collide(poses).map_err(text),
                |touches| Ok(f64::from(touches)),
            ),
            ("distance", true) => batch(
                &poses,
                |poses| Batch::new(a, b).map_err(text)?.distances(poses).map_err(text),
                |found| Ok(found.distance),
            ),
            ("collide", false) => one_by_one(
                budget,
                &poses,
                |pose| querier.collide(a, b, pose),
                |touches| Ok(f64::from(touches)),
            ),
            ("distance", false) => {
                one_by_one(budget, &poses, |pose| querier.distance(a, b, pose), |found| Ok(found.distance))
            }
            ("contacts", false) => one_by_one(
                budget,
                &poses,
                |pose| querier.contacts(a, b, pose),
                |found| Ok(found.len() as f64),
            ),
            (other, _) => Err(format!("expected collide, distance or contacts, found {other:?}")),
        };
    };
    let instance = field.moving(name, b)?;
    let scene = &mut field.scene;
    let ask = |pose: &Pose| {
        scene.set_pose(instance, *pose).map_err(text)?;
        match question.ask.as_str() {
            "collide" => scene.collide().map(f64::from).map_err(text),
            "touched" => scene.pairs_in_contact().map(|found| found.len() as f64).map_err(text),
            "distance" => {
                Ok(scene.distance().map_err(text)?.map_or(f64::INFINITY, |found| found.nearest.distance))
            }
            other => Err(format!("expected collide, touched or distance, found {other:?}")),
        }
    };
    one_by_one(budget, &poses, ask, Ok)
}

/// Asks about one after another, until all are asked or the budget, in seconds, is spent. `number` makes a number of an answer,
/// which is not timed.
pub(super) fn one_by_one<T, A, E: ToString>(
    budget: f64,
    items: &[T],
    mut ask: impl FnMut(&T) -> Result<A, E>,
    number: impl Fn(A) -> Result<f64, String>,
) -> Result<Record, String> {
    let began = Instant::now();
    let (mut answers, mut nanoseconds) = (Vec::new(), Vec::new());
    for item in items {
        let start = Instant::now();
        let answer = ask(item);
        nanoseconds.push(start.elapsed().as_nanos() as u64);
        answers.push(number(answer.map_err(text)?)?);
        if began.elapsed().as_secs_f64() > budget {
            break;
        }
    }
    Ok(record! { answers: answers, nanoseconds: nanoseconds })
}

/// Asks about all in one call, on all cores. `number` makes a number of an answer, which is not timed.
pub(super) fn batch<T, A>(
    items: &[T],
    ask: impl Fn(&[T]) -> Result<Vec<A>, String>,
    number: impl Fn(A) -> Result<f64, String>,
) -> Result<Record, String> {
    let start = Instant::now();
    let answers = ask(items)?;
    let seconds = start.elapsed().as_secs_f64();
    let answers = answers.into_iter().map(number).collect::<Result<Vec<_>, _>>()?;
    Ok(record! { answers: answers, seconds: seconds, threads: rayon::current_num_threads() })
}

/// Returns the message of an error.
pub(super) fn text(error: impl ToString) -> String {
    error.to_string()
}
