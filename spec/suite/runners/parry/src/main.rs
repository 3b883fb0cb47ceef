//! parry3d in double precision: two triangle meshes, points, rays and segments.
//!
//! The runner places the corners of B itself, because a pose of parry3d is a quaternion, which rounds. Meshes are oriented,
//! which `contains_local_point` needs, and have half edges, which tell whether a mesh closes. Pairs of triangles are those of
//! `leaf_pairs` that `intersection_test` confirms. Meshes that overlap themselves are not claimed, because the nearest triangle
//! does not tell what is inside them.
//!
//! Timed questions are put as an application would, with a pose, a ray or a point of parry3d.

use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math::{Matrix, Pose, Rotation, Vector};
use parry3d_f64::query::{PointQuery, Ray, RayCast, Unsupported, distance, intersection_test};
use parry3d_f64::shape::{Segment, TriMesh, TriMeshFlags};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::{BufRead, Write, stdin, stdout};
use std::time::Instant;

const AT: Pose = Pose::IDENTITY;

/// Returns the finite numbers of a field.
fn numbers(message: &Value, key: &str) -> Result<Vec<f64>, String> {
    let list = message[key].as_array().ok_or("expected a list")?;
    list.iter().map(|x| x.as_f64().ok_or("expected finite numbers".into())).collect()
}

fn vector(message: &Value, key: &str) -> Result<Vector, String> {
    Ok(Vector::from_slice(&numbers(message, key)?))
}

fn mesh(message: &Value) -> Result<TriMesh, String> {
    let list = |key: &str| message[key].as_array().cloned().unwrap_or_default();
    let corner = |x: &Value| vector(&json!({ "x": x }), "x");
    let corners: Vec<Vector> = list("vertices").iter().map(corner).collect::<Result<_, _>>()?;
    let triangles: Vec<[u32; 3]> =
        serde_json::from_value(message["triangles"].clone()).map_err(|e| e.to_string())?;
    build(corners, triangles)
}

fn build(corners: Vec<Vector>, mut triangles: Vec<[u32; 3]>) -> Result<TriMesh, String> {
    if triangles.iter().flatten().any(|&i| i as usize >= corners.len()) {
        return Err("an index beyond the corners".into());
    }
    // The inside of an oriented mesh is behind its triangles, so a mesh of negative volume is turned inside out.
    let volume: f64 =
        triangles.iter().map(|t| t.map(|i| corners[i as usize])).map(|[p, q, r]| p.dot(q.cross(r))).sum();
    if volume < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
    }
    TriMesh::with_flags(corners, triangles, TriMeshFlags::ORIENTED | TriMeshFlags::HALF_EDGE_TOPOLOGY)
        .map_err(|e| e.to_string())
}

/// Returns the bytes of resident memory, or 0 where that is unknown.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<u64>().ok()).unwrap_or(0) * 1024
}

/// Returns the mesh of a file, and what it cost: seconds, and bytes where these are known.
fn mesh_of_file(message: &Value) -> Result<(TriMesh, Value), String> {
    let bytes = std::fs::read(message["file"].as_str().unwrap_or("")).map_err(|e| e.to_string())?;
    let count = message["corners"].as_u64().ok_or("expected a number of corners")? as usize;
    let (corners, triangles) = bytes.split_at_checked(12 * count).ok_or("expected more corners")?;
    let three = |row: &[u8]| [0, 4, 8].map(|i| [row[i], row[i + 1], row[i + 2], row[i + 3]]);
    let corner = |row: &[u8]| Vector::from_array(three(row).map(|x| f32::from_le_bytes(x).into()));
    let corners = corners.chunks_exact(12).map(corner).collect();
    let triangles = triangles.chunks_exact(12).map(|row| three(row).map(u32::from_le_bytes)).collect();
    let (before, start) = (resident(), Instant::now());
    let mesh = build(corners, triangles)?;
    let seconds = start.elapsed().as_secs_f64();
    let bytes = (before > 0).then(|| resident().saturating_sub(before));
    Ok((mesh, json!({ "seconds": seconds, "bytes": bytes })))
}

/// Answers a question at many poses, and times each answer by itself.
fn timed(question: &Value, a: &TriMesh, b: &TriMesh) -> Result<Value, String> {
    let ask = match question["ask"].as_str().unwrap_or("") {
        "collide" => |a: &TriMesh, b: &TriMesh, pose: &Pose| {
            intersection_test(&AT, a, pose, b).map(|found| f64::from(u8::from(found.intersecting)))
        },
        "distance" => {
            |a: &TriMesh, b: &TriMesh, pose: &Pose| distance(&AT, a, pose, b).map(|found| found.distance)
        }
        _ => return Err("not a timed question of this runner".into()),
    };
    let list = question["poses"].as_array().ok_or("expected poses")?;
    let poses: Vec<Vec<f64>> =
        list.iter().map(|x| numbers(&json!({ "x": x }), "x")).collect::<Result<_, _>>()?;
    let poses: Vec<Pose> = poses
        .iter()
        .map(|m| {
            let column = |i: usize| Vector::new(m[i], m[4 + i], m[8 + i]);
            let turn = Rotation::from_mat3(&Matrix::from_cols(column(0), column(1), column(2)));
            Pose::from_parts(column(3), turn)
        })
        .collect();
    one_by_one(question, &poses, |pose| ask(a, b, pose), |answer| answer.map_err(|reason| reason.to_string()))
}

/// Asks about one after another until the budget is spent. What makes a number of an answer is not timed.
fn one_by_one<T, A>(
    question: &Value,
    items: &[T],
    ask: impl Fn(&T) -> A,
    number: impl Fn(A) -> Result<f64, String>,
) -> Result<Value, String> {
    let budget = question["budget"].as_f64().ok_or("expected a budget")?;
    let (began, mut answers, mut nanoseconds) = (Instant::now(), vec![], vec![]);
    for item in items {
        let start = Instant::now();
        let answer = ask(item);
        nanoseconds.push(start.elapsed().as_nanos() as u64);
        answers.push(number(answer)?);
        if began.elapsed().as_secs_f64() > budget {
            break;
        }
    }
    Ok(json!({ "answers": answers, "nanoseconds": nanoseconds }))
}

/// The rays of a set, or points as rays without a direction.
fn set_of_file(message: &Value) -> Result<Vec<Ray>, String> {
    let bytes = std::fs::read(message["file"].as_str().unwrap_or("")).map_err(|e| e.to_string())?;
    let number = |x: &[u8]| f64::from(f32::from_le_bytes([x[0], x[1], x[2], x[3]]));
    let numbers: Vec<f64> = bytes.chunks_exact(4).map(number).collect();
    let columns = message["numbers"].as_u64().ok_or("expected how many numbers a row has")? as usize;
    let ray = |row: &[f64]| match row.len() {
        6 => Ray::new(Vector::from_slice(&row[..3]), Vector::from_slice(&row[3..])),
        _ => Ray::new(Vector::from_slice(&row[..3]), Vector::ZERO),
    };
    Ok(numbers.chunks_exact(columns).map(ray).collect())
}

/// Answers a question about all rays or points of a set, and times each answer by itself.
fn probed(question: &Value, a: &TriMesh, set: &[Ray]) -> Result<Value, String> {
    if question["batch"] == json!(true) {
        return Err("parry3d has no batches".into());
    }
    let yes = |yes: bool| Ok(f64::from(u8::from(yes)));
    match question["ask"].as_str().unwrap_or("") {
        "ray" => {
            one_by_one(question, set, |ray| a.cast_local_ray(ray, f64::MAX, false), |t| Ok(t.unwrap_or(-1.0)))
        }
        "hit" => one_by_one(question, set, |ray| a.intersects_local_ray(ray, f64::MAX), yes),
        "closest" => one_by_one(
            question,
            set,
            |point| a.distance_to_local_point(point.origin, false),
            |signed| Ok(signed.abs()),
        ),
        "side" if !is_closed(a) => Err("not a closed mesh".into()),
        "side" => one_by_one(
            question,
            set,
            |point| a.contains_local_point(point.origin),
            |inside| Ok(if inside { 1.0 } else { -1.0 }),
        ),
        _ => Err("not a timed question of this runner".into()),
    }
}

/// Returns B with its corners at R x + t.
fn placed(b: &TriMesh, pose: &[f64]) -> Result<TriMesh, String> {
    let row = |i: usize, p: &Vector| {
        pose[4 * i] * p.x + pose[4 * i + 1] * p.y + pose[4 * i + 2] * p.z + pose[4 * i + 3]
    };
    let corners = b.vertices().iter().map(|p| Vector::new(row(0, p), row(1, p), row(2, p))).collect();
    TriMesh::new(corners, b.indices().to_vec()).map_err(|e| e.to_string())
}

fn contacts(a: &TriMesh, b: &TriMesh) -> Value {
    let meet = |i, j| {
        intersection_test(&AT, &a.triangle(i), &AT, &b.triangle(j)).is_ok_and(|found| found.intersecting)
    };
    let near = a.bvh().leaf_pairs(b.bvh(), |x, y| x.aabb().intersects(&y.aabb()));
    near.filter(|&(i, j)| meet(i, j)).map(|(i, j)| json!([i, j])).collect()
}

fn from_surface(a: &TriMesh, point: Vector) -> f64 {
    (a.project_local_point(point, false).point - point).length()
}

fn is_closed(a: &TriMesh) -> bool {
    a.topology().is_some_and(|found| found.half_edges.iter().all(|edge| edge.twin != u32::MAX))
}

fn side(a: &TriMesh, point: Vector) -> &'static str {
    match (from_surface(a, point), is_closed(a)) {
        (0.0, _) => "on",
        (_, false) => "undefined",
        _ if a.contains_local_point(point) => "inside",
        _ => "outside",
    }
}

fn found(answer: Result<impl Into<Value>, Unsupported>) -> Result<Value, String> {
    answer.map(|answer| json!({ "answer": answer.into() })).map_err(|reason| reason.to_string())
}

fn answer(
    question: &Value,
    meshes: &HashMap<String, TriMesh>,
    sets: &HashMap<String, Vec<Ray>>,
) -> Result<Value, String> {
    let mesh = |key: &str| meshes.get(question[key].as_str().unwrap_or("")).ok_or("a mesh was refused");
    let a = mesh("a")?;
    if let Some(name) = question["probes"].as_str() {
        return probed(question, a, sets.get(name).ok_or("expected the name of a set")?);
    }
    if question.get("poses").is_some() {
        return timed(question, a, mesh("b")?);
    }
    let b = || placed(mesh("b")?, &numbers(question, "pose")?);
    match question["ask"].as_str().unwrap_or("") {
        "collide" => found(intersection_test(&AT, a, &AT, &b()?).map(|found| found.intersecting)),
        "distance" => found(distance(&AT, a, &AT, &b()?).map(|found| found.distance)),
        "contacts" => found(Ok(contacts(a, &b()?))),
        "closest" => found(Ok(from_surface(a, vector(question, "point")?))),
        "side" => found(Ok(side(a, vector(question, "point")?))),
        "segment" => {
            // As a shape: a ray up to t = 1 often misses the surface where the segment ends on it.
            let segment = Segment::new(vector(question, "from")?, vector(question, "to")?);
            found(intersection_test(&AT, a, &AT, &segment).map(|found| found.intersecting))
        }
        "ray" => {
            let ray = Ray::new(vector(question, "origin")?, vector(question, "direction")?);
            let t = a.cast_local_ray(&ray, f64::MAX, false);
            Ok(json!({ "answer": t.is_some(), "t": t }))
        }
        _ => Err("not a question of this runner".into()),
    }
}

fn main() {
    let (mut meshes, mut sets) = (HashMap::new(), HashMap::new());
    for line in stdin().lock().lines() {
        let message: Value = serde_json::from_str(&line.expect("a line")).expect("JSON");
        let mut reply = json!({});
        let found = if message.get("hello").is_some() {
            Ok(json!({
                "hello": 1, "name": "parry3d", "version": "0.31.1", "settings": "parry3d-f64, TriMesh, ORIENTED",
                "questions": ["collide", "distance", "contacts", "closest", "side", "ray", "segment"],
                "timed": ["collide", "distance", "ray", "hit", "closest", "side"], "coordinates": "f64", "placement": "f64", "features": ["open", "concave", "nested", "degenerate", "range"],
                "distance_error": 1e-6, "error_unit": "size",
            }))
        } else if let Some(name) = message["mesh"].as_str() {
            reply["mesh"] = json!(name);
            let made = match message.get("file") {
                Some(_) => mesh_of_file(&message),
                None => mesh(&message).map(|mesh| (mesh, json!({}))),
            };
            made.map(|(mesh, cost)| {
                meshes.insert(name.to_owned(), mesh);
                cost
            })
        } else if let (Some(name), true) = (message["probes"].as_str(), message.get("file").is_some()) {
            reply["probes"] = json!(name);
            set_of_file(&message).map(|set| {
                let count = set.len();
                sets.insert(name.to_owned(), set);
                json!({ "count": count })
            })
        } else {
            reply["id"] = message["id"].clone();
            answer(&message, &meshes, &sets)
        };
        let found = found.unwrap_or_else(|reason| json!({ "refused": true, "reason": reason }));
        reply.as_object_mut().expect("an object").extend(found.as_object().expect("an object").clone());
        println!("{reply}");
        stdout().flush().expect("an open output");
    }
}
