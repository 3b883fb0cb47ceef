//! The compiled part of the Python module `cbvh`: meshes, and questions about them, with arrays in and arrays out.
//!
//! What users see is in `python/cbvh/__init__.py`: it names results and documents questions. This module reads what callers
//! give, and lets other threads of Python run while it works.

mod answers;
mod arguments;
mod asking;
mod bake;
mod errors;
mod mesh;
mod motions;
mod pairs;
mod paths;
mod poses;
mod probes;
mod robot;
mod scene;
mod scene_pairs;
mod shapes;
mod stops;
mod view;

use pyo3::prelude::*;

// Arrays are read where they lie. Without the lock, another thread might resize one meanwhile.
#[pymodule(gil_used = true)]
fn _cbvh(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<mesh::Mesh>()?;
    module.add_class::<paths::Paths>()?;
    module.add_class::<robot::Robot>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<stops::Flag>()?;
    module.add_class::<view::Page>()?;
    macro_rules! functions {
        ($($function:path),*) => { $(module.add_function(wrap_pyfunction!($function, module)?)?;)* };
    }
    functions![bake::bake, bake::bake_files];
    functions![shapes::cloud_core, shapes::segment_core, shapes::block_core, shapes::ground_core];
    functions![shapes::cylinder_core, shapes::cone_core, shapes::height_field_core, shapes::voxels_core];
    functions![shapes::octree_core, shapes::convex_hull_core];
    functions![pairs::collide, pairs::within, pairs::relation, pairs::distance, pairs::contacts];
    functions![
        pairs::clash,
        pairs::penetration,
        pairs::signed_distance,
        pairs::separation,
        pairs::intersection,
        pairs::intersection_surface,
        pairs::contact_regions,
        pairs::patches,
        pairs::self_contacts
    ];
    functions![motions::motion, motions::is_free];
    functions![arguments::copied_numbers, arguments::check_pose, arguments::flag, arguments::number];
    functions![poses::poses_of, poses::relative_poses, poses::nearest_poses];
    functions![
        probes::closest_points,
        probes::sides,
        probes::signed_point_distances,
        probes::first_hits,
        probes::any_hits,
        probes::all_hits,
        probes::visible,
        probes::segment_hits
    ];
    functions![
        scene_pairs::scene_collide,
        scene_pairs::scene_within,
        scene_pairs::scene_pairs_in_contact,
        scene_pairs::scene_pairs_within,
        scene_pairs::scene_relations,
        scene_pairs::scene_clashes,
        scene_pairs::scene_contacts,
        scene_pairs::scene_distance,
        scene_pairs::scene_signed_distance,
        scene_pairs::scene_near_pairs,
        scene_pairs::scene_motion,
        scene_pairs::scene_is_free
    ];
    module.add("FormatError", module.py().get_type::<errors::FormatError>())?;
    module.add("StoppedError", module.py().get_type::<errors::StoppedError>())?;
    module.add("BakeError", module.py().get_type::<errors::BakeError>())?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
