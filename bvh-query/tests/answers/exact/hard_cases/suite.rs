//! Reads the hard pairs of the public suite, with the truths that the suite states and proves by code of its own.
//!
//! `spec/suite/SCHEMA.json` describes the lines. Those about one pair follow each other: whether it touches, how far apart it is,
//! and its contacts.

use super::case::{Case, Truth};
use cbvh_testkit::Triangle;
use serde_json::Value;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

/// The numbers of contacts where the suite lists none, because they are more than 60, by the first line about the pair.
const MANY: [(&str, u64); 21] = [
    ("hard/0096", 576),
    ("hard/0129", 129),
    ("hard/0255", 62),
    ("hard/0309", 62),
    ("hard/0360", 108),
    ("hard/0366", 298),
    ("hard/0369", 298),
    ("hard/0372", 298),
    ("hard/0390", 104),
    ("hard/0447", 62),
    ("hard/0453", 62),
    ("hard/0462", 62),
    ("hard/0480", 62),
    ("hard/0498", 62),
    ("hard/0516", 62),
    ("hard/0546", 540),
    ("hard/0552", 62),
    ("hard/0561", 62),
    ("hard/0603", 62),
    ("hard/0612", 62),
    ("hard/0621", 62),
];

pub(super) fn cases() -> Vec<Case> {
    let named = |mesh: Value| (mesh["mesh"].as_str().unwrap().to_owned(), triangles(&mesh));
    let is_hard = |mesh: &Value| mesh["mesh"].as_str().unwrap().starts_with("hard-");
    let meshes: HashMap<_, _> = lines("meshes.jsonl").into_iter().filter(is_hard).map(named).collect();
    let lines = lines("hard.jsonl");
    let is_same = |p: &Value, q: &Value| {
        (&p["a"], &p["b"], &p["items"][0]["pose"]) == (&q["a"], &q["b"], &q["items"][0]["pose"])
    };
    lines.chunk_by(is_same).map(|about| case(about, &meshes)).collect()
}

/// Returns the lines of a file of the suite.
fn lines(file: &str) -> Vec<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../spec/suite/cases").join(file);
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn triangles(mesh: &Value) -> Vec<Triangle> {
    let corner = |index: &Value| floats(&mesh["vertices"][index.as_u64().unwrap() as usize]);
    let triangle = |t: &Value| [0, 1, 2].map(|k| corner(&t[k]));
    mesh["triangles"].as_array().unwrap().iter().map(triangle).collect()
}

/// Returns the case that a few lines are about.
fn case(lines: &[Value], meshes: &HashMap<String, Vec<Triangle>>) -> Case {
    let first = &lines[0];
    let (id, reason) = (first["id"].as_str().unwrap(), first["reason"].as_str().unwrap());
    let about = |ask: &str| lines.iter().find(|line| line["ask"] == ask);
    let truth = |ask: &str| {
        about(ask).map(|line| {
            let items = line["items"].as_array().unwrap();
            assert_eq!(items.len(), 1, "{id}: expected one pose");
            &items[0]["truth"]
        })
    };
    let (touching, distance) = (truth("collide").unwrap(), truth("distance").unwrap());
    let many = || MANY.iter().find(|(of, _)| *of == id).unwrap_or_else(|| panic!("{id}: no contacts")).1;
    let contacts = truth("contacts").map_or_else(many, |listed| listed.as_array().unwrap().len() as u64);
    let [lower, upper] = ["lower", "upper"].map(|end| float(&distance[end]));
    let truth = match touching.as_bool().unwrap() {
        true => Truth::Touching { contacts },
        false => Truth::Apart { lower, upper },
    };
    let is_counted = about("contacts").is_some();
    assert_eq!(lines.len(), 2 + usize::from(is_counted), "{id}: expected no other question");
    assert_eq!(contacts > 0, lower == 0.0 && upper == 0.0, "{id}: {contacts} contacts, {distance}");
    let mesh = |of: &str| meshes[first[of].as_str().unwrap()].clone();
    let pose = floats(&first["items"][0]["pose"]);
    Case { name: format!("{id}, {reason}"), a: mesh("a"), b: mesh("b"), pose, truth }
}

fn floats<const N: usize>(texts: &Value) -> [f64; N] {
    let found: Vec<_> = texts.as_array().unwrap().iter().map(float).collect();
    found.try_into().unwrap()
}

/// Returns the number that a C99 hex float states. No number of the hard pairs has leading zeros, as subnormal ones have.
fn float(text: &Value) -> f64 {
    let text = text.as_str().unwrap();
    let (sign, size) = text.strip_prefix('-').map_or((1.0, text), |size| (-1.0, size));
    let (digits, exponent) = size.strip_prefix("0x").and_then(|size| size.split_once('p')).unwrap();
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mantissa = u64::from_str_radix(&format!("{whole}{fraction}"), 16).unwrap();
    let exponent = exponent.parse::<i32>().unwrap() - 4 * fraction.len() as i32;
    sign * mantissa as f64 * 2f64.powi(exponent)
}
