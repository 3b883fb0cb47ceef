//! Counts all variants on all scenes, and searches for the directions that are worth a test.

use super::row::{Row, geometric_mean};
use super::scene::Scene;
use super::variant::{Base, EXTREMES, Topic, Variant, is_complete, of_growth, one_more, variants};
use crate::output;
use cbvh_measure::rounds::Question;

/// Returns the rows of all questions about pairs.
pub(super) fn of_pairs(scenes: &mut [Scene]) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut known: Vec<(Variant, Vec<Row>)> = Vec::new();
    for variant in variants() {
        let same =
            known.iter().find(|(other, _)| other.rule == variant.rule && other.making == variant.making);
        let counted = match same {
            Some((_, rows)) => rows.clone(),
            None => {
                let counted = count(scenes, &variant, |_| true);
                known.push((variant.clone(), counted.clone()));
                counted
            }
        };
        rows.extend(counted.into_iter().map(|row| Row {
            topic: variant.topic,
            variant: variant.name.clone(),
            ..row
        }));
    }
    for base in EXTREMES {
        for (topic, question) in [Topic::ForContact, Topic::ForDistance].into_iter().zip(Question::EXACT) {
            rows.extend(search(scenes, base, topic, question));
        }
    }
    rows
}

/// Returns the rows about balls.
pub(super) fn of_balls(scenes: &mut [Scene]) -> Vec<Row> {
    of_growth().iter().flat_map(|variant| count(scenes, variant, |_| true)).collect()
}

fn count(scenes: &mut [Scene], variant: &Variant, asked: impl Fn(Question) -> bool) -> Vec<Row> {
    output::tell(&format!("{}: {}: {}", variant.topic.name(), variant.base, variant.name));
    scenes.iter_mut().flat_map(|scene| scene.rows(variant, &asked)).collect()
}

/// Adds one direction after the other, each time the one that saves most of the tests' cost in the geometric mean.
fn search(scenes: &mut [Scene], base: Base, topic: Topic, question: Question) -> Vec<Row> {
    let asked = |other: Question| other == question;
    let mut rows = count(scenes, &base.plain(topic), asked);
    let mut chosen = 0;
    while !is_complete(chosen) {
        let tried = one_more(chosen).map(|more| (more, count(scenes, &base.tested(topic, more), asked)));
        let mut tried: Vec<(u8, Vec<Row>)> = tried.collect();
        tried.sort_by(|p, q| cost(&p.1).total_cmp(&cost(&q.1)));
        for (place, (more, found)) in tried.into_iter().enumerate() {
            if place == 0 {
                chosen = more;
            }
            let topic = if place == 0 { topic } else { Topic::NotTaken };
            rows.extend(found.into_iter().map(|row| Row { topic, ..row }));
        }
    }
    rows
}

fn cost(rows: &[Row]) -> f64 {
    geometric_mean(rows.iter().map(Row::cost))
}
