//! Lists what Rust makes of the structures and numbers of the header, for `tests/header.py` to compare with C.

use crate::entry::ABI;
use crate::status::Status;
use crate::types::*;
use bvh_query::{Relation, Side};
use std::fmt::Write;
use std::mem::offset_of;

/// Writes a line for a structure, with its size and alignment, and one for each field, with its offset and size.
macro_rules! structure {
    ($lines:ident, $name:literal, $type:ident, $($field:ident)*) => {
        writeln!($lines, "{} {} {}", $name, size_of::<$type>(), align_of::<$type>())?;
        // A field that is missing here does not compile.
        let _ = |of: $type| { let $type { $($field: _),* } = of; };
        $(
            let size = size_of_field(|of: &$type| &of.$field);
            writeln!($lines, "{}.{} {} {size}", $name, stringify!($field), offset_of!($type, $field))?;
        )*
    };
}

fn size_of_field<S, F>(_: impl Fn(&S) -> &F) -> usize {
    size_of::<F>()
}

fn structures(lines: &mut String) -> std::fmt::Result {
    structure!(lines, "cbvh_mesh", MeshHandle, id);
    structure!(lines, "cbvh_querier", QuerierHandle, id);
    structure!(lines, "cbvh_tracker", TrackerHandle, id);
    structure!(lines, "cbvh_path", PathHandle, id);
    structure!(lines, "cbvh_scene", SceneHandle, id);
    structure!(lines, "cbvh_instance", Instance, id);
    structure!(lines, "cbvh_pose", PoseRows, rows);
    structure!(lines, "cbvh_bake_options", BakeChoices, size profile triangles effort scratch max_error max_memory
        split_objects scene no_ids no_turning_slabs no_topology force);
    structure!(lines, "cbvh_stats", StatsRow, node_tests packet_tests exact_tests pairs);
    structure!(lines, "cbvh_distance_answer", DistanceRow, distance lower upper point_a point_b
        object_a triangle_a object_b triangle_b);
    structure!(lines, "cbvh_distance_options", DistanceChoices, size rel_err abs_err);
    structure!(lines, "cbvh_contact", ContactRow, object_a triangle_a object_b triangle_b);
    structure!(lines, "cbvh_motion_options", MotionChoices, size clearance tolerance);
    structure!(lines, "cbvh_motion_answer", MotionRow, outcome reserved free_until at instance_a instance_b nearest);
    structure!(lines, "cbvh_closest_point", ClosestRow, distance lower upper point instance object triangle found side);
    structure!(lines, "cbvh_ray", RayRow, origin direction until);
    structure!(lines, "cbvh_ray_hit", HitRow, t lower upper point instance object triangle found reserved);
    structure!(lines, "cbvh_segment", SegmentRow, from to);
    structure!(lines, "cbvh_scene_pair", PairRow, a b);
    structure!(lines, "cbvh_scene_distance_answer", SceneDistanceRow, pair nearest found reserved);
    structure!(lines, "cbvh_scene_relation", SceneRelationRow, pair relation reserved);
    structure!(lines, "cbvh_scene_contact", SceneContactRow, pair contact);
    Ok(())
}

fn numbers() -> Vec<(&'static str, i32)> {
    vec![
        ("CBVH_ABI", ABI as i32),
        ("CBVH_OK", Status::Ok as i32),
        ("CBVH_INVALID_ARGUMENT", Status::InvalidArgument as i32),
        ("CBVH_INVALID_HANDLE", Status::InvalidHandle as i32),
        ("CBVH_BUSY", Status::Busy as i32),
        ("CBVH_NOT_FOUND", Status::NotFound as i32),
        ("CBVH_BUFFER_TOO_SMALL", Status::BufferTooSmall as i32),
        ("CBVH_SYSTEM", Status::System as i32),
        ("CBVH_DAMAGED", Status::Damaged as i32),
        ("CBVH_LIMIT", Status::Limit as i32),
        ("CBVH_BAKE_FAILED", Status::BakeFailed as i32),
        ("CBVH_CALLBACK_FAILED", Status::CallbackFailed as i32),
        ("CBVH_INTERNAL", Status::Internal as i32),
        ("CBVH_MAP", MAP),
        ("CBVH_MAP_SPARSE", MAP_SPARSE),
        ("CBVH_MAP_WHOLE", MAP_WHOLE),
        ("CBVH_READ", READ),
        ("CBVH_BACKEND_BEST", BACKEND_BEST),
        ("CBVH_BACKEND_SCALAR", BACKEND_SCALAR),
        ("CBVH_BACKEND_AVX2", BACKEND_AVX2),
        ("CBVH_BACKEND_AVX512", BACKEND_AVX512),
        ("CBVH_TOUCHING", relation(Relation::Touching)),
        ("CBVH_APART", relation(Relation::Apart)),
        ("CBVH_A_IN_B", relation(Relation::AInB)),
        ("CBVH_B_IN_A", relation(Relation::BInA)),
        ("CBVH_MIXED", relation(Relation::Mixed)),
        ("CBVH_RELATION_UNDEFINED", relation(Relation::Undefined)),
        ("CBVH_FREE", FREE),
        ("CBVH_HIT", HIT),
        ("CBVH_NEAR", NEAR),
        ("CBVH_SIDE_NOT_ASKED", SIDE_NOT_ASKED),
        ("CBVH_OUTSIDE", side(Side::Outside)),
        ("CBVH_INSIDE", side(Side::Inside)),
        ("CBVH_ON", side(Side::On)),
        ("CBVH_SIDE_UNDEFINED", side(Side::Undefined)),
    ]
}

/// Writes the list to the file that the environment variable `CBVH_LAYOUT` names, if it names one.
#[test]
fn the_layout_is_listed() -> Result<(), Box<dyn std::error::Error>> {
    let mut lines = String::new();
    structures(&mut lines)?;
    for (name, number) in numbers() {
        writeln!(lines, "{name} {number}")?;
    }
    assert!(lines.contains("cbvh_pose.rows 0 96\n"));
    if let Some(file) = std::env::var_os("CBVH_LAYOUT") {
        std::fs::write(file, lines)?;
    }
    Ok(())
}
