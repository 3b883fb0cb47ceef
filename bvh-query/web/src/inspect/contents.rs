//! What a file consists of: its sections, its objects, and counts of nodes by level.

use crate::answers::{floats, ids};
use crate::arguments::{Answer, refused};
use crate::inspect::tree::visit;
use crate::mesh::Mesh;
use bvh_format::header::{head_bytes, version_name};
use js_sys::{Array, JsString};
use wasm_bindgen::prelude::*;

fn strings(of: impl Iterator<Item = String>) -> JsValue {
    of.map(|text| JsValue::from(JsString::from(text))).collect::<Array>().into()
}

/// The version of the format and the length of the header, then of each section: its name, its first byte and its length.
#[wasm_bindgen]
pub fn sections(mesh: &Mesh) -> Array {
    let layout = mesh.shape.bvh().layout();
    let sections = || layout.sections.iter();
    [
        JsValue::from(version_name(layout.version)),
        JsValue::from(head_bytes(layout.sections.len()) as f64),
        strings(sections().map(|section| section.kind.name().to_owned())),
        floats(sections().map(|section| section.range.start as f64)),
        floats(sections().map(|section| section.range.len() as f64)),
    ]
    .into_iter()
    .collect()
}

/// Of each object of the file: its profile, the encoding of its triangles, the numbers of its input triangles, triangles, degenerate
/// triangles, duplicates, treelets, packets and pages, its first page, its slabs, and whether it is closed: 1, 0, or -1 if
/// the file does not say so.
#[wasm_bindgen]
pub fn objects(mesh: &Mesh) -> Array {
    let bvh = mesh.shape.bvh();
    let objects = || bvh.objects().iter();
    let numbers = objects().enumerate().flat_map(|(number, object)| {
        let record = object.record();
        let closed = bvh.is_closed(number).map_or(-1.0, |closed| f64::from(u8::from(closed)));
        [
            record.input_triangles.get() as f64,
            record.triangles.get() as f64,
            record.degenerate.get() as f64,
            record.duplicates.get() as f64,
            record.treelets.get() as f64,
            record.packets.get() as f64,
            f64::from(record.pages.get()),
            f64::from(record.first_page.get()),
            object.profile().directions().slabs() as f64,
            closed,
        ]
    });
    [
        strings(objects().map(|object| object.profile().name().to_owned())),
        strings(objects().map(|object| object.triangle_encoding().name().to_owned())),
        floats(numbers),
    ]
    .into_iter()
    .collect()
}

/// The numbers of the first object of the mesh, and of the one after its last.
#[wasm_bindgen(js_name = objectNumbers)]
pub fn object_numbers(mesh: &Mesh) -> JsValue {
    let numbers = mesh.shape.shape().object_numbers();
    ids([numbers.start as u32, numbers.end as u32].into_iter())
}

/// For each object of the file and level, four numbers: treelets, children, leaf packets, triangles in these. The numbers of levels of the
/// objects come first.
#[wasm_bindgen(js_name = levelCounts)]
pub fn level_counts(mesh: &Mesh) -> Answer<Array> {
    let bvh = mesh.shape.bvh();
    let counts = std::cell::RefCell::new(vec![Vec::<[f64; 4]>::new(); bvh.objects().len()]);
    let count = |object: usize, level: usize, add: [f64; 4]| {
        let mut counts = counts.borrow_mut();
        let levels = &mut counts[object];
        if levels.len() <= level {
            levels.resize(level + 1, [0.0; 4]);
        }
        levels[level].iter_mut().zip(add).for_each(|(sum, add)| *sum += add);
    };
    visit(
        bvh.all(),
        |object, level| count(object, level, [1.0, 0.0, 0.0, 0.0]),
        |node| {
            let triangles = node.triangles();
            let packets = f64::from(u8::from(triangles.is_some()));
            let add = [0.0, 1.0, packets, f64::from(triangles.unwrap_or_default())];
            count(node.object, node.level - 1, add);
        },
    )
    .map_err(refused)?;
    let counts = counts.into_inner();
    let lengths = ids(counts.iter().map(|levels| levels.len() as u32));
    Ok([lengths, floats(counts.into_iter().flatten().flatten())].into_iter().collect())
}
