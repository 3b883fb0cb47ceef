//! Lists the extensions that a file may require, because they are read or do not move a triangle.

use super::schema::Document;
use crate::error::{Fault, Place, excerpt};

/// What may move triangles, and is read.
const READ: &[&str] =
    &["EXT_mesh_gpu_instancing", "KHR_mesh_quantization", "KHR_node_visibility", "MSFT_lod"];

/// What moves no triangle, by the beginning of its name: looks, lights and sounds.
const FAMILIES: &[&str] = &[
    "ADOBE_materials_",
    "EXT_lights_",
    "EXT_materials_",
    "EXT_texture_",
    "KHR_audio",
    "KHR_lights_",
    "KHR_materials_",
    "KHR_texture_",
    "MSFT_packing_",
    "MSFT_texture_",
    "NV_materials_",
    "VRMC_materials_",
];

/// What moves no triangle of the file at rest: notes, and what an application does with the scene later.
const HARMLESS: &[&str] = &[
    "AGI_stk_metadata",
    "CESIUM_primitive_outline",
    "EXT_feature_metadata",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_edge_visibility",
    "EXT_structural_metadata",
    "FB_geometry_metadata",
    "GODOT_single_root",
    "KHR_animation_pointer",
    "KHR_collision_shapes",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_physics_rigid_bodies",
    "KHR_techniques_webgl",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_audio_emitter",
    "OMI_collider",
    "OMI_physics_body",
    "OMI_physics_shape",
    "VRM",
    "VRMC_springBone",
    "VRMC_vrm",
];

/// What has triangles packed, and how to unpack them.
const PACKED: &[&str] = &["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Refuses a document that requires an extension that may change triangles in a way that this reader does not know.
pub(super) fn check(document: &Document) -> Result<(), Fault> {
    let required = &document.extensions_required;
    if let Some(name) = required.iter().find(|name| !is_known(name)) {
        let expected = format!(
            "required extensions that are read ({}) or move no triangle, such as those for materials, textures, lights and metadata",
            READ.join(", ")
        );
        let remedy = if PACKED.contains(&name.as_str()) { "; save the file without compression" } else { "" };
        return Err(Fault::new(Place::File, expected, format!("{}{remedy}", excerpt(name.as_bytes()))));
    }
    // A program that did not know the extension may have dropped the instances and kept the name.
    let instancing = READ[0];
    let has_instances = || document.nodes.iter().any(|node| node.instancing().is_some());
    if required.iter().any(|name| name == instancing) && !has_instances() {
        let expected = format!("a node with {instancing}, which the file requires");
        return Err(Fault::new(Place::File, expected, "none; the instances are lost"));
    }
    Ok(())
}

fn is_known(name: &str) -> bool {
    READ.contains(&name) || HARMLESS.contains(&name) || FAMILIES.iter().any(|family| name.starts_with(family))
}
