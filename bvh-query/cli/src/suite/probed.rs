//! Times the answers to one question about many rays or points, each by itself or all in one call.
//!
//! The clock runs from the call of bvh-query to its answer. A set of rays or points is read before, once.

use super::meshes::Meshes;
use super::message::{ProbedQuestion, ProbesMessage};
use super::timed::{batch, one_by_one, text};
use crate::console::Record;
use bvh_query::{ProbeBatch, Querier, Ray, RayHit, Side};
use std::collections::HashMap;
use std::fs;

/// The questions about rays and points, singly or in one call.
pub(super) const PROBED: [&str; 4] = ["ray", "hit", "closest", "side"];

/// Sets of rays or points by name.
#[derive(Default)]
pub(super) struct Probes(HashMap<String, Set>);

enum Set {
    Rays(Vec<Ray>),
    Points(Vec<[f64; 3]>),
}

impl Probes {
    /// Reads a set from its file, and returns how many rays or points it has.
    pub(super) fn add(&mut self, message: &ProbesMessage) -> Result<usize, String> {
        let name = message.file.display();
        let bytes = fs::read(&message.file).map_err(|error| format!("{name}: cannot read: {error}"))?;
        let expected = message.count.saturating_mul(message.numbers).saturating_mul(4);
        if bytes.len() != expected {
            return Err(format!("{name}: expected {expected} bytes, found {}", bytes.len()));
        }
        let (numbers, _) = bytes.as_chunks::<4>();
        let (rows, _) = numbers.as_chunks::<3>();
        let rows: Vec<[f64; 3]> = rows.iter().map(|row| row.map(|x| f32::from_le_bytes(x).into())).collect();
        let set = match message.numbers {
            3 => Set::Points(rows),
            6 => {
                let (rays, _) = rows.as_chunks::<2>();
                Set::Rays(rays.iter().map(|[origin, direction]| Ray::new(*origin, *direction)).collect())
            }
            other => {
                return Err(format!("expected 3 numbers for each point or 6 for each ray, found {other}"));
            }
        };
        self.0.insert(message.probes.clone(), set);
        Ok(message.count)
    }
}

/// Returns the answers as numbers, and the nanoseconds that each took, or the seconds of all in one call.
pub(super) fn ask(
    question: &ProbedQuestion,
    meshes: &Meshes,
    probes: &Probes,
    querier: &mut Querier,
) -> Result<Record, String> {
    let (a, budget) = (meshes.get(&question.a)?, question.budget);
    let name = &question.probes;
    let set = probes.0.get(name).ok_or_else(|| format!("expected the name of a set, found {name:?}"))?;
    let all = || ProbeBatch::new(a).map_err(text);
    match (question.ask.as_str(), set, question.batch) {
        ("ray", Set::Rays(rays), false) => {
            one_by_one(budget, rays, |ray| querier.first_hit(a, ray), |hit| Ok(parameter(hit)))
        }
        ("ray", Set::Rays(rays), true) => {
            batch(rays, |rays| all()?.first_hits(rays).map_err(text), |hit| Ok(parameter(hit)))
        }
        ("hit", Set::Rays(rays), false) => {
            one_by_one(budget, rays, |ray| querier.any_hit(a, ray), |hit| Ok(f64::from(hit)))
        }
        ("hit", Set::Rays(rays), true) => {
            batch(rays, |rays| all()?.any_hits(rays).map_err(text), |hit| Ok(f64::from(hit)))
        }
        ("closest", Set::Points(points), false) => one_by_one(
            budget,
            points,
            |point| querier.closest_point(a, *point, f64::INFINITY),
            |found| Ok(found.map_or(f64::INFINITY, |found| found.distance)),
        ),
        ("closest", Set::Points(points), true) => batch(
            points,
            |points| all()?.closest_points(points, f64::INFINITY).map_err(text),
            |found| Ok(found.map_or(f64::INFINITY, |found| found.distance)),
        ),
        ("side", Set::Points(points), false) => {
            one_by_one(budget, points, |point| querier.side(a, *point), side)
        }
        ("side", Set::Points(points), true) => {
            batch(points, |points| all()?.sides(points).map_err(text), side)
        }
        (other, ..) => {
            Err(format!("expected ray or hit about rays, closest or side about points, found {other:?}"))
        }
    }
}

fn parameter(hit: Option<RayHit>) -> f64 {
    hit.map_or(-1.0, |hit| hit.t)
}

fn side(side: Side) -> Result<f64, String> {
    match side {
        Side::Inside => Ok(1.0),
        Side::On => Ok(0.0),
        Side::Outside => Ok(-1.0),
        Side::Undefined => Err("expected a closed mesh, found an open one".to_owned()),
    }
}
