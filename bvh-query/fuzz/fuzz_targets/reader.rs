//! Checks what every reader promises: any bytes give a mesh that keeps the contract, or an error of one line.

use bvh_bake::input::{MeshFormat, read_bytes};
use bvh_bake::mesh::Mesh;
use std::path::Path;

/// Reads bytes in a format. Returns `None` if they are not a mesh.
pub fn read(bytes: &[u8], format: MeshFormat) -> Option<Mesh> {
    let _ = MeshFormat::from_content(bytes);
    // The folder does not exist, so that no file is found that the input names beside itself.
    let source = Path::new("/nowhere/input");
    match read_bytes(bytes, format, source) {
        Ok(mesh) => {
            assert!(mesh.check().is_ok());
            Some(mesh)
        }
        Err(error) => {
            let line = error.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{line:?}");
            None
        }
    }
}
