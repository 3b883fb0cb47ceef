//! parry3d in double precision: two triangle meshes, points, rays and segments.
//!
//! The runner places the corners of B itself, because a pose of parry3d is a quaternion, which rounds. Meshes are oriented,
//! which `contains_local_point` needs, and have half edges, which tell whether a mesh closes. Pairs of triangles are those of
//! `leaf_pairs` that `intersection_test` confirms. Meshes that overlap themselves are not claimed, because the nearest triangle
//! does not tell what is inside them.

use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{PointQuery, Ray, RayCast, Unsupported, distance, intersection_test};
use parry3d_f64::shape::{Segment, TriMesh, TriMeshFlags};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io::{BufRead, Write, stdin, stdout};

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
    let mut triangles: Vec<[u32; 3]> =
        serde_json::from_value(message["triangles"].clone()).map_err(|e| e.to_string())?;
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

fn side(a: &TriMesh, point: Vector) -> &'static str {
    let closed = a.topology().is_some_and(|found| found.half_edges.iter().all(|edge| edge.twin != u32::MAX));
    match (from_surface(a, point), closed) {
        (0.0, _) => "on",
        (_, false) => "undefined",
        _ if a.contains_local_point(point) => "inside",
        _ => "outside",
    }
}

fn found(answer: Result<impl Into<Value>, Unsupported>) -> Result<Value, String> {
    answer.map(|answer| json!({ "answer": answer.into() })).map_err(|reason| reason.to_string())
}

fn answer(question: &Value, meshes: &HashMap<String, TriMesh>) -> Result<Value, String> {
    let mesh = |key: &str| meshes.get(question[key].as_str().unwrap_or("")).ok_or("a mesh was refused");
    let a = mesh("a")?;
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
    let mut meshes = HashMap::new();
    for line in stdin().lock().lines() {
        let message: Value = serde_json::from_str(&line.expect("a line")).expect("JSON");
        let mut reply = json!({});
        let found = if message.get("hello").is_some() {
            Ok(json!({
                "hello": 1, "name": "parry3d", "version": "0.31.1", "settings": "parry3d-f64, TriMesh, ORIENTED",
                "questions": ["collide", "distance", "contacts", "closest", "side", "ray", "segment"],
                "coordinates": "f64", "placement": "f64", "features": ["open", "concave", "nested", "degenerate", "range"],
                "distance_error": 1e-6, "error_unit": "size",
            }))
        } else if let Some(name) = message["mesh"].as_str() {
            reply["mesh"] = json!(name);
            mesh(&message).map(|mesh| meshes.insert(name.to_owned(), mesh)).map(|_| json!({}))
        } else {
            reply["id"] = message["id"].clone();
            answer(&message, &meshes)
        };
        let found = found.unwrap_or_else(|reason| json!({ "refused": true, "reason": reason }));
        reply.as_object_mut().expect("an object").extend(found.as_object().expect("an object").clone());
        println!("{reply}");
        stdout().flush().expect("an open output");
    }
}
