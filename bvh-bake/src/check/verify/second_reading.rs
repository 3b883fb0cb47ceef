//! Reads OBJ files a second time, with a parser that shares no code with the readers of bakes.
//!
//! The first reading uses the readers of the baker, and a mistake in them would affect both sides of the comparison.
//! `tobj` reads text and numbers by itself; only the triangulation of polygons is shared. It reads some OBJ files
//! differently. It divides a vertex by its fourth number, and takes polylines as faces. It supports neither continued
//! lines nor lines that end in CR alone. It refuses some faces that come before their vertices. Such files, and those
//! that do not fit in memory, are read once.

use super::VerifyError;
use crate::error::Fault;
use crate::input::gather::InputOrder;
use crate::input::polygon::Cutter;
use crate::input::{InputFile, MeshFormat};
use crate::progress::Progress;
use crate::triangles::placement::on_unit;

/// Bytes of memory per byte of a file: text, what the parser makes of it, triangles.
const BYTES_PER_BYTE: u64 = 8;

/// The triangles of all meshes, in the order of their ids.
#[derive(Default)]
pub(super) struct SecondReading {
    triangles: Vec<[[f64; 3]; 3]>,
}

impl SecondReading {
    /// Reads files, or returns `None` if one of them is not an OBJ file, is read differently by `tobj`, or needs more
    /// than `memory` bytes.
    pub(super) fn of(inputs: &[InputFile], memory: u64) -> Option<Self> {
        let length: u64 = inputs.iter().map(InputFile::length).sum();
        if length.saturating_mul(BYTES_PER_BYTE) > memory {
            return None;
        }
        let mut reading = Self::default();
        for input in inputs.iter() {
            if input.format() != MeshFormat::Obj {
                return None;
            }
            reading.add(&input.read_all(&Progress::default()).ok()?)?;
        }
        Some(reading)
    }

    fn add(&mut self, text: &[u8]) -> Option<()> {
        if !is_read_alike(text) {
            return None;
        }
        // No option is set: each corner keeps its own index, and polygons are not triangulated.
        let options = tobj::LoadOptions::default();
        let (models, _) = tobj::load_obj_buf(&mut &text[..], &options, |_| Ok(Default::default())).ok()?;
        let mut cutter = Cutter::default();
        for tobj::Model { mesh, .. } in models {
            let positions = mesh.positions.as_chunks::<3>().0;
            let corners: Vec<[f64; 3]> =
                mesh.indices.iter().map(|&index| positions[index as usize]).collect();
            if mesh.face_arities.is_empty() {
                self.triangles.extend(corners.as_chunks::<3>().0);
                continue;
            }
            let mut rest = &corners[..];
            for &arity in &mesh.face_arities {
                let (polygon, after) = rest.split_at((arity as usize).min(rest.len()));
                rest = after;
                let cut = cutter.cut_polygon(polygon, |triangle| {
                    self.triangles.push(triangle.map(|place| polygon[place]));
                    Ok::<_, Fault>(())
                });
                cut.ok()?;
            }
        }
        Some(())
    }

    /// Compares with the first reading.
    pub(super) fn compare(&self, first: &InputOrder) -> Result<(), VerifyError> {
        let count: u64 = first.counts().iter().sum();
        if count != self.triangles.len() as u64 {
            return Err(VerifyError::differs(
                "triangles of the mesh, read a second time",
                self.triangles.len(),
                count,
            ));
        }
        first.each_triangle(|_, id, corners| {
            let second = &self.triangles[id as usize];
            if second.map(|corner| corner.map(on_unit)) == *corners {
                return Ok(());
            }
            let what = format!("triangle {id} of the mesh, read a second time");
            Err(VerifyError::differs(what, format!("{second:?}"), format!("{corners:?}")))
        })
    }
}

/// Returns whether `tobj` reads all lines of a text as the readers of bakes do, or refuses the text.
fn is_read_alike(text: &[u8]) -> bool {
    let is_plain = |line: &[u8]| {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let numbers_fit = match words.next() {
            Some(b"v") => matches!(words.count(), 3 | 6),
            // Lines are faces to `tobj`.
            Some(b"fo" | b"l") => false,
            // It keeps faces of fewer corners.
            Some(b"f") => words.count() > 2,
            _ => true,
        };
        numbers_fit && !line.ends_with(b"\\") && !line.contains(&b'\r')
    };
    text.is_ascii() && text.split(|&byte| byte == b'\n').all(is_plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Option<Vec<[[f64; 3]; 3]>> {
        let mut reading = SecondReading::default();
        reading.add(text.as_bytes()).map(|()| reading.triangles)
    }

    /// Coordinates that are no multiples of the least unit are rounded by the first reading, and both agree.
    #[test]
    fn what_is_finer_than_the_least_unit_is_read_alike() {
        let folder = cbvh_testkit::folder();
        let path = folder.path().join("tiny.obj");
        std::fs::write(&path, "v 1.4265218366800537e-43 0 0\nv 1 0 0\nv 0 1 -3e-70\nf 1 2 3\n").unwrap();
        let file = folder.path().join("tiny.cbvh");
        crate::FileBake::new([&path], &file).run().unwrap();
        crate::verify_files(&file, &[path], &crate::VerifyOptions::default()).unwrap();
    }

    #[test]
    fn plain_files_are_read_again() {
        let corners = "v 0 0 0\r\nv 1 0 0\r\nv 1 1 0\nv 0 1 0\n";
        let faces = "o a\nf 1 2 3 4\ng b\nf -1 -2 -3\n";
        let [a, b, c, d] = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(read(&format!("{corners}{faces}")).unwrap(), [[a, b, c], [a, c, d], [d, c, b]]);
        for other in [
            "v 0 0 0 2\n",
            "v 0 0 \\\n0\n",
            "v 0 0 0\rv 0 0 0\n",
            "fo 1 2 3\n",
            "l 1 2 3\n",
            "f 1 2\n",
            "f 1 2 9\n",
            "o \u{e9}\n",
        ] {
            assert_eq!(read(&format!("{corners}{other}{faces}")), None, "{other}");
        }
    }
}
