//! Reads glTF nodes that repeat their mesh (`EXT_mesh_gpu_instancing`).

use super::gltf_model::{Model, PRIMITIVE, Point, corners, near, read, read_scene, told, volume, wrong};
use super::{one_line, only};
use bvh_bake::input::MeshFormat;

/// A node of a tetrahedron with instances, and what is said of them.
fn instanced(attributes: &str, before: &str) -> String {
    format!(
        r#"{{"name":"part","mesh":0,{before}"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{{attributes}}}}}}}}}"#
    )
}

#[test]
fn instances_are_copies_below_their_node() {
    let mut model = Model::new();
    let translations = model.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 10.0, 0.0, 0.0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let rotations = model.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, 0.0, 0.0, 0.0, 1.0]);
    let scales = model.floats("VEC3", &[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 2.0, 3.0, -1.0]);
    let attributes = format!(r#""TRANSLATION":{translations},"ROTATION":{rotations},"SCALE":{scales}"#);
    // The node is at z = 7, has twice the size, and a child that is not repeated.
    model.nodes =
        instanced(&attributes, r#""translation":[0,0,7],"scale":[2,2,2],"children":[1],"#) + r#",{"mesh":0}"#;
    model.fields = r#""scenes":[{"nodes":[0]}],"extensionsRequired":["EXT_mesh_gpu_instancing"],"#.into();
    let mesh = read(&model);
    told(&mesh, &[]);
    assert_eq!((mesh.objects.len(), mesh.triangle_count()), (4, 16));
    let up = |points: [Point; 4]| points.map(|[x, y, z]| [2.0 * x, 2.0 * y, 2.0 * z + 7.0]);
    near(&mesh.objects[0].positions, &up(corners()));
    // A quarter turn takes x to y, and y to -x.
    near(&mesh.objects[1].positions, &up(corners().map(|[x, y, z]| [5.0 - y, x, z])));
    near(&mesh.objects[2].positions, &up(corners().map(|[x, y, z]| [10.0 + 2.0 * x, 3.0 * y, -z])));
    near(&mesh.objects[3].positions, &up(corners()));
    // 8 is six times the volume of the tetrahedron. The mirrored one has its faces turned around.
    assert!((volume(&mesh) - 8.0 * 8.0 * (1.0 + 1.0 + 6.0 + 1.0)).abs() < 1e-3);

    let scene = read_scene(&model);
    let all: Vec<_> = scene.instances.iter().map(|instance| (&instance.name[..], instance.object)).collect();
    assert_eq!(all, [("part", 0), ("part.2", 0), ("part.3", 1), ("", 0)]);
    assert_eq!(scene.objects.len(), 2);
    near(&[scene.instances[1].translation], &[[10.0, 0.0, 7.0]]);
    near(&scene.instances[1].rotation, &[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
}

#[test]
fn rotations_of_instances_may_be_integers() {
    for (component, one) in [(5120, 127), (5122, 32767), (5121, 255), (5123, 65535)] {
        let mut model = Model::new();
        // A third of a turn around (1, 1, 1) takes x to y, y to z and z to x; of equal numbers, any length will do.
        let rotations = model.integers("VEC4", component, true, &[one, one, one, one, 0, 0, 0, one]);
        model.nodes = instanced(&format!(r#""ROTATION":{rotations}"#), "");
        let mesh = read(&model);
        assert_eq!(mesh.objects[0].positions, [corners()[0], corners()[2], corners()[3], corners()[1]]);
        assert_eq!(mesh.objects[1].positions, corners());
        model.edit(rotations, "true", "false");
        wrong(
            &model,
            "expected rotations: VEC4 of f32, or of normalized integers of 8 or 16 bits, found VEC4 of ",
        );
    }
    // The least integer is -1, as the next one is.
    let mut model = Model::new();
    let rotations = model.integers("VEC4", 5120, true, &[0, 0, -128, 127]);
    model.nodes = instanced(&format!(r#""ROTATION":{rotations}"#), "");
    near(&only(&read(&model)).positions, &corners().map(|[x, y, z]| [y, -x, z]));
}

#[test]
fn instances_are_counted_and_checked() {
    let mut model = Model::new();
    let three = model.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 10.0, 0.0, 0.0]);
    let two = model.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let ids = model.integers("SCALAR", 5123, false, &[7, 8]);
    let nan = model.floats("VEC3", &[0.0, f32::NAN, 0.0]);
    let none = model.accessor(r#"{"componentType":5126,"count":4000000000,"type":"VEC3"}"#.into());
    for (attributes, expected) in [
        (
            format!(r#""TRANSLATION":{three},"ROTATION":{two}"#),
            "as many values, 3, in EXT_mesh_gpu_instancing of nodes[0], found 2",
        ),
        (format!(r#""TRANSLATION":{three},"_ID":{ids}"#), "as many values"),
        (String::new(), "how many instances there are, found none in EXT_mesh_gpu_instancing of nodes[0]"),
        (
            format!(r#""TRANSLATION":{nan}"#),
            "finite numbers in EXT_mesh_gpu_instancing of nodes[0], found NaN",
        ),
        (format!(r#""TRANSLATION":{none}"#), "an accessor with a buffer view"),
        (
            format!(r#""TRANSLATION":{two}"#),
            "translations or scales: VEC3 of f32, found VEC4 of f32 in accessors[3]",
        ),
        (r#""SCALE":99"#.into(), "99 in EXT_mesh_gpu_instancing of nodes[0]"),
    ] {
        model.nodes = instanced(&attributes, "");
        wrong(&model, expected);
    }
    // Values of the application's own say how many there are.
    model.nodes = instanced(&format!(r#""_ID":{ids}"#), "");
    assert_eq!(read(&model).objects.len(), 2);
    // What is required is there.
    model.nodes = r#"{"mesh":0}"#.into();
    model.fields = r#""extensionsRequired":["EXT_mesh_gpu_instancing"],"#.into();
    wrong(
        &model,
        "a node with EXT_mesh_gpu_instancing, which the file requires, found none; the instances are lost",
    );
    // Very many are too many for so small a file.
    let mut model = Model::new();
    let many = model.sparse(5_000_000, &[0], &[1.0, 0.0, 0.0]);
    let big = model.view(&vec![0; 5_000_000], "");
    model.edit(many, r#""componentType":5126"#, &format!(r#""bufferView":{big},"componentType":5126"#));
    model.edit(many, r#""count":5000000"#, r#""count":400000"#);
    model.meshes = format!(r#"{{"primitives":[{}]}}"#, vec![format!("{PRIMITIVE}}}"); 40].join(","));
    model.nodes = instanced(&format!(r#""TRANSLATION":{many}"#), "");
    let error = super::try_bytes(&model.glb(), MeshFormat::Gltf).unwrap_err();
    assert!(error.is_limit() && one_line(&error).contains("nodes that share a mesh"), "{error}");
}
