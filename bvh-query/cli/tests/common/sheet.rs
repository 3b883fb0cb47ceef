//! Writes bumpy sheets of any size, in each format that is read piece by piece.

use std::fs;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Returns a bumpy sheet of `side` by `side` squares: vertices that are `f32` numbers, and triangles.
fn sheet(side: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let height = |x: u32, y: u32| (x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)) >> 24;
    let at = |i: u32| {
        let (x, y) = (i % (side + 1), i / (side + 1));
        [x as f32, y as f32, height(x, y) as f32 / 256.0]
    };
    let square = |i: u32| {
        let first = i / side * (side + 1) + i % side;
        let [right, up, across] = [first + 1, first + side + 1, first + side + 2];
        [[first, right, across], [first, across, up]]
    };
    ((0..(side + 1).pow(2)).map(at).collect(), (0..side * side).flat_map(square).collect())
}

/// Writes a sheet in the format of the name's extension.
pub(crate) fn write_sheet(path: &Path, side: u32) {
    let (vertices, triangles) = sheet(side);
    let mut file = BufWriter::new(fs::File::create(path).unwrap());
    let mut put = |bytes: &[u8]| file.write_all(bytes).unwrap();
    match path.extension().unwrap().to_str().unwrap() {
        "stl" => {
            put(&[b' '; 80]);
            put(&(triangles.len() as u32).to_le_bytes());
            for triangle in &triangles {
                put(&[0; 12]);
                triangle.iter().flat_map(|&v| vertices[v as usize]).for_each(|c| put(&c.to_le_bytes()));
                put(&[0; 2]);
            }
        }
        "ply" => {
            let head = format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
                 property float z\nelement face {}\nproperty list uchar uint vertex_indices\nend_header\n",
                vertices.len(),
                triangles.len()
            );
            put(head.as_bytes());
            vertices.iter().flatten().for_each(|c| put(&c.to_le_bytes()));
            for triangle in &triangles {
                put(&[3]);
                triangle.iter().for_each(|v| put(&v.to_le_bytes()));
            }
        }
        _ => {
            vertices.iter().for_each(|[x, y, z]| put(format!("v {x} {y} {z}\n").as_bytes()));
            triangles.iter().map(|t| t.map(|v| v + 1)).for_each(|[a, b, c]| {
                put(format!("f {a} {b} {c}\n").as_bytes());
            });
        }
    }
    file.flush().unwrap();
}
