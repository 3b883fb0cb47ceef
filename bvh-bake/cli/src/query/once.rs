//! Answers the question about one pose for a person, and writes the witness of a distance as OBJ.

use super::arguments::Mode;
use super::question::Question;
use super::side::{Side, Sides};
use super::write_file;
use crate::console::{self, Failure, plural};
use bvh_format::ids::decode_id;
use bvh_format::leaf::decode_packet;
use bvh_format::page::Page;
use bvh_format::validate::packets;
use bvh_query::{Distance, Pose, Querier, QueryError};
use std::path::Path;

/// The most contacts that are listed; the others are only counted.
const MAX_LISTED: usize = 10;

/// Asks the question and prints the answer.
pub(super) fn answer(
    sides: &Sides<'_>,
    pose: &Pose,
    question: &Question,
    mut querier: Querier,
    witness: Option<&Path>,
) -> Result<(), Failure> {
    let failed = |error: QueryError| sides.blame(error);
    let (a, b) = sides.shapes();
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
                let a = name(sides.a, contact.object_a, contact.triangle_a);
                let b = name(sides.b, contact.object_b, contact.triangle_b);
                text.push_str(&format!("  A: {a}  B: {b}\n"));
            }
            if contacts.len() > MAX_LISTED {
                text.push_str(&format!("  and {} more\n", contacts.len() - MAX_LISTED));
            }
            text
        }
        Mode::Distance => {
            let distance = querier.distance_with(a, b, pose, &question.errors).map_err(failed)?;
            if let Some(path) = witness {
                let obj = witness_obj(sides, pose, &distance)?;
                write_file(path, &obj)?;
            }
            describe(sides, &distance)
        }
    };
    console::text(&text)
}

pub(crate) fn describe(sides: &Sides<'_>, answer: &Distance) -> String {
    let Distance { distance, lower, upper, point_a, point_b, .. } = answer;
    let a = name(sides.a, answer.object_a, answer.triangle_a);
    let b = name(sides.b, answer.object_b, answer.triangle_b);
    let touch = if *distance == 0.0 { " (the meshes touch)" } else { "" };
    format!(
        "distance {distance:?}{touch}\n  certainly {lower:?} to {upper:?}\n  on A {}, {a}\n  on B {}, {b}\n",
        point(*point_a),
        point(*point_b)
    )
}

fn point(point: [f64; 3]) -> String {
    let [x, y, z] = point;
    format!("{x:?} {y:?} {z:?}")
}

/// Names a triangle for people. The object is named only if there are several.
fn name(side: &Side, object: u32, triangle: u32) -> String {
    match side.bvh.objects() {
        [_] => format!("triangle {triangle}"),
        objects => {
            let name = objects.get(object as usize).map_or("", |object| object.name());
            format!("object {object} {name:?} triangle {triangle}")
        }
    }
}

/// Returns both triangles as faces, and the segment between the closest points as a line, all in the frame of A.
pub(crate) fn witness_obj(sides: &Sides<'_>, pose: &Pose, answer: &Distance) -> Result<String, Failure> {
    let a = corners(sides.a, answer.object_a, answer.triangle_a)?;
    let b = corners(sides.b, answer.object_b, answer.triangle_b)?.map(|corner| pose.place(corner));
    let mut text = format!("# distance {:?}\n", answer.distance);
    let mut vertices = |points: &[[f64; 3]]| {
        points.iter().for_each(|&p| text.push_str(&format!("v {}\n", point(p))));
    };
    vertices(&a);
    vertices(&b);
    vertices(&[answer.point_a, answer.point_b]);
    text.push_str("o triangle_a\nf 1 2 3\no triangle_b\nf 4 5 6\no segment\nl 7 8\n");
    Ok(text)
}

/// Finds the corners of a triangle by its number, in the frame of its file. Searches all pages of the object, which is
/// fast enough for one answer.
fn corners(side: &Side, object: u32, triangle: u32) -> Result<[[f64; 3]; 3], Failure> {
    let (layout, bytes) = (side.bvh.layout(), side.bvh.bytes());
    let lost =
        || Failure::Invalid(format!("{}: expected triangle {triangle}, found none", side.path.display()));
    let object = side.bvh.objects().get(object as usize).ok_or_else(lost)?;
    let first = object.record().first_page.get();
    for number in first..first + object.record().pages.get() {
        let Some(page) = layout.page_bytes(bytes, number) else { continue };
        let page = Page::new(page, object.profile());
        let header = page.header();
        let ids = layout.id_block(bytes, header);
        for (packet, count) in packets(&page) {
            for lane in 0..count {
                let id = if layout.has_ids() {
                    decode_id(ids, usize::from(packet), lane)
                } else {
                    let packet = header.first_packet.get().wrapping_add(u32::from(packet));
                    packet.wrapping_mul(4).wrapping_add(lane as u32)
                };
                if id == triangle {
                    let block = layout.leaf_block(bytes, header);
                    let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                    let place = |axis: usize, v: f32| object.origin()[axis] + f64::from(v);
                    let corners = values.triangle(lane);
                    return Ok(corners.map(|v| [0, 1, 2].map(|axis| place(axis, v[axis]))));
                }
            }
        }
    }
    Err(lost())
}
