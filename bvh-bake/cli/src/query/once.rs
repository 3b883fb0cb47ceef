//! Answers the question about one pose for a person, and writes the witness of a distance as OBJ.

use super::arguments::Mode;
use super::question::{Question, relation_in_words};
use crate::asking::files::write_file;
use crate::asking::mesh::{LoadedMesh, blame};
use crate::asking::{triangle, witness};
use crate::console::{self, Failure, plural};
use bvh_query::{Pose, Querier, QueryError};
use std::path::Path;

/// The most contacts that are listed; the others are only counted.
const MAX_LISTED: usize = 10;

/// Asks the question and prints the answer.
pub(super) fn answer(
    [mesh_a, mesh_b]: [&LoadedMesh; 2],
    pose: &Pose,
    question: &Question,
    mut querier: Querier,
    witness_file: Option<&Path>,
) -> Result<(), Failure> {
    let failed = |error: QueryError| blame(mesh_a, Some(mesh_b), error);
    let (a, b) = (mesh_a.shape(), mesh_b.shape());
    let text = match question.mode {
        Mode::Collide => {
            let touch = querier.collide(a, b, pose).map_err(failed)?;
            if touch { "the meshes touch\n".to_owned() } else { "the meshes do not touch\n".to_owned() }
        }
        Mode::Within => {
            let within = querier.within(a, b, pose, question.within).map_err(failed)?;
            let how = if within { "at most" } else { "more than" };
            format!("the meshes are {how} {:?} apart\n", question.within)
        }
        Mode::Contacts => {
            let contacts = querier.contacts(a, b, pose).map_err(failed)?;
            let count = contacts.len() as u64;
            let mut text = format!("{count} {} of triangles in contact\n", plural(count, "pair"));
            for contact in contacts.iter().take(MAX_LISTED) {
                let a = triangle::name(mesh_a, contact.object_a, contact.triangle_a);
                let b = triangle::name(mesh_b, contact.object_b, contact.triangle_b);
                text.push_str(&format!("  A: {a}  B: {b}\n"));
            }
            if contacts.len() > MAX_LISTED {
                text.push_str(&format!("  and {} more\n", contacts.len() - MAX_LISTED));
            }
            text
        }
        Mode::Relation => {
            let relation = querier.relation(a, b, pose).map_err(failed)?;
            format!("{}\n", relation_in_words(relation))
        }
        Mode::Distance => {
            let distance = querier.distance_with(a, b, pose, &question.errors).map_err(failed)?;
            if let Some(path) = witness_file {
                write_file(path, &witness::obj([mesh_a, mesh_b], pose, &distance)?)?;
            }
            witness::describe([mesh_a, mesh_b], &distance)
        }
    };
    console::text(&text)
}
