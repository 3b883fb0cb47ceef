//! The nodes of one level, decoded: they cover the mesh, together with the leaf packets above.

use crate::answers::{ids, small};
use crate::arguments::{Answer, refused};
use crate::inspect::tree::{page, visit};
use crate::mesh::Mesh;
use bvh_format::kdop::{DIRECTIONS, Kdop};
use bvh_format::slabs::NodeSlabs;
use bvh_format::turning::TurningSlab;
use js_sys::{Array, Float32Array, Float64Array};
use wasm_bindgen::prelude::*;

/// The numbers of a node: the lower ends of 13 slabs, the upper ends, and its turning slab: its direction and both ends.
const NODE_NUMBERS: usize = 31;

/// Writes a node. Slabs that it does not have are infinite, and a direction that it does not have is 0.
fn write(slabs: &NodeSlabs, count: usize, turning: Option<TurningSlab>) -> [f32; NODE_NUMBERS] {
    let Kdop { lo, hi } = slabs.to_kdop(count);
    let mut numbers = [0.0; NODE_NUMBERS];
    for slab in 0..13 {
        let known = slab < count;
        numbers[slab] = if known { lo[slab] } else { f32::NEG_INFINITY };
        numbers[13 + slab] = if known { hi[slab] } else { f32::INFINITY };
    }
    if let Some(turning) = turning {
        numbers[26..29].copy_from_slice(&turning.direction.vector());
        (numbers[29], numbers[30]) = (turning.lo, turning.hi);
    }
    numbers
}

/// The fixed directions of the format, three numbers for each.
#[wasm_bindgen]
pub fn directions() -> Float64Array {
    Float64Array::from(DIRECTIONS.map(|direction| direction.map(f64::from)).as_flattened())
}

/// The nodes of a level, at most `most` of them: for each, 31 numbers in the frame of its object, the object, the page and the slot
/// or packet, and the number of triangles of a packet, or 0. The origins of all objects of the file come last. Level 0 has the
/// roots.
#[wasm_bindgen(js_name = levelNodes)]
pub fn level_nodes(mesh: &Mesh, level: usize, most: usize) -> Answer<Array> {
    let (shape, bvh) = (mesh.shape.shape(), mesh.shape.bvh());
    let (mut numbers, mut objects, mut places, mut triangles) = (vec![], vec![], vec![], vec![]);
    let mut put = |object: usize, of: [f32; NODE_NUMBERS], at: (u32, u16), count: u8| {
        if objects.len() < most {
            numbers.extend(of);
            objects.push(object as u32);
            places.extend([at.0, at.1.into()]);
            triangles.push(count);
        }
    };
    let slabs = |object: usize| bvh.objects()[object].profile().directions().slabs();
    if level == 0 {
        for (number, object) in shape.object_numbers().zip(shape.objects()) {
            let first = object.pages().start;
            let root = page(bvh, object, first).map_err(refused)?.anchor_slabs(0);
            put(number, write(&root, slabs(number), None), (first, 0), 0);
        }
    } else {
        visit(
            shape,
            |_, _| {},
            |node| {
                let packet = node.triangles();
                if node.level == level || node.level < level && packet.is_some() {
                    let of = write(node.slabs, slabs(node.object), node.turning);
                    put(node.object, of, node.place(), packet.unwrap_or_default());
                }
            },
        )
        .map_err(refused)?;
    }
    let origins: Vec<[f64; 3]> = bvh.objects().iter().map(|object| object.origin()).collect();
    Ok([
        Float32Array::from(&numbers[..]).into(),
        ids(objects.into_iter()),
        ids(places.into_iter()),
        small(triangles.into_iter()).into(),
        Float64Array::from(origins.as_flattened()).into(),
    ]
    .into_iter()
    .collect())
}
