//! Reads glTF whose vertices are not where their positions say: morph targets and skins.
//!
//! All expected places are computed by hand.

use super::gltf_model::{Model, PRIMITIVE, Point, corners, near, read, read_scene, told, volume, wrong};
use super::only;
use bvh_bake::input::MeshFormat;
use bvh_bake::{FileBake, Options, Outcome, VerifyOptions, verify_files};
use std::path::Path;

/// A mesh of the tetrahedron with morph targets, each an accessor.
fn morphed(targets: &[usize], weights: &str) -> String {
    let targets: Vec<_> = targets.iter().map(|target| format!(r#"{{"POSITION":{target}}}"#)).collect();
    format!(r#"{{"primitives":[{PRIMITIVE},"targets":[{}]}}]{weights}}}"#, targets.join(","))
}

#[test]
fn morph_targets_are_read_with_their_weights() {
    let mut model = Model::new();
    let mut tip = [0.0; 12];
    tip[11] = 3.0;
    let mut side = [0.0; 12];
    side[3] = -4.0;
    let (tip, side) = (model.floats("VEC3", &tip), model.floats("VEC3", &side));
    let sparse = model.sparse(4, &[0, 3], &[-1.0, 0.0, 0.0, 0.0, 0.0, 3.0]);
    for (targets, of_mesh, of_node, expected) in [
        (&[tip][..], r#","weights":[1.0]"#, "", [0.0, 2.0, 5.0]),
        (&[tip], r#","weights":[1]"#, r#","weights":[0]"#, [0.0, 2.0, 2.0]),
        (&[tip], "", "", [0.0, 2.0, 2.0]),
        (&[tip], "", r#","weights":[-0.5]"#, [0.0, 2.0, 0.5]),
        (&[tip, side], r#","weights":[0.5,0.25]"#, "", [0.0, 1.0, 3.5]),
        (&[tip, side], r#","weights":[0.5,0.25]"#, r#","weights":[0,2]"#, [0.0, -6.0, 2.0]),
        (&[side, sparse], r#","weights":[0,2]"#, "", [-2.0, 2.0, 8.0]),
        // A weight of 0 costs nothing, so that nobody asks how many there should be.
        (&[tip], r#","weights":[0,0,-0.0]"#, "", [0.0, 2.0, 2.0]),
        (&[tip], r#","weights":[]"#, "", [0.0, 2.0, 2.0]),
    ] {
        model.meshes = morphed(targets, of_mesh);
        model.nodes = format!(r#"{{"mesh":0{of_node}}}"#);
        let mesh = read(&model);
        told(&mesh, &[]);
        let positions = &only(&mesh).positions;
        assert_eq!([positions[0][0], positions[1][0], positions[3][2]], expected, "{of_mesh} {of_node}");
    }
    // An extension of meshopt, for instance, may hold what a target of zeros adds: it is none by the specification.
    let zeros = model.accessor(r#"{"componentType":5126,"count":4,"type":"VEC3"}"#.into());
    let short = model.floats("VEC3", &[0.0; 9]);
    let bytes = model.integers("VEC3", 5120, true, &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127]);
    let shorts = model.integers("VEC3", 5122, false, &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -300]);
    let rotations = model.floats("VEC4", &[0.0; 16]);
    model.nodes = r#"{"mesh":0}"#.into();
    for (target, tip) in [(zeros, 2.0), (bytes, 3.0), (shorts, -298.0)] {
        model.meshes = morphed(&[target], r#","weights":[1]"#);
        assert_eq!(only(&read(&model)).positions[3], [0.0, 0.0, tip]);
    }
    for (targets, weights, expected) in [
        (&[tip][..], "[1,1]", "a weight for each of 1 morph targets, found 2 in meshes[0].weights"),
        (&[tip, side], "[1]", "a weight for each of 2 morph targets, found 1 in meshes[0].weights"),
        (&[], "[1]", "a weight for each of 0 morph targets, found 1 in meshes[0].weights"),
        (
            &[short],
            "[1]",
            "4 values, as many as positions, in accessors[6] of primitive 0 of meshes[0], found 3",
        ),
        (
            &[rotations],
            "[1]",
            "positions: VEC3 of f32, or of integers of 8 or 16 bits, found VEC4 of f32 in accessors[",
        ),
        (&[99], "[1]", "99 in primitive 0 of meshes[0]"),
    ] {
        model.meshes = morphed(targets, &format!(r#","weights":{weights}"#));
        wrong(&model, expected);
    }
    // Targets that are not needed may be wrong.
    model.meshes = morphed(&[99, tip], r#","weights":[0,1]"#);
    assert_eq!(only(&read(&model)).positions[3], [0.0, 0.0, 5.0]);
}

#[test]
fn nodes_of_other_weights_have_other_shapes() {
    let mut model = Model::new();
    let mut tip = [0.0; 12];
    tip[11] = 3.0;
    let tip = model.floats("VEC3", &tip);
    model.meshes = morphed(&[tip], r#","weights":[1]"#);
    model.nodes = r#"{"mesh":0},{"mesh":0,"weights":[2]},{"mesh":0,"weights":[1.0]},{"mesh":0,"weights":[0]},
        {"mesh":0,"weights":[-0.0],"translation":[1,0,0]}"#
        .into();
    let scene = read_scene(&model);
    let objects: Vec<_> = scene.instances.iter().map(|instance| instance.object).collect();
    assert_eq!(objects, [0, 1, 0, 2, 2]);
    let tips: Vec<_> = scene.objects.iter().map(|object| object.positions[3][2]).collect();
    assert_eq!(tips, [5.0, 8.0, 2.0]);
    // Primitives share vertices only if their targets are the same, too.
    model.meshes = format!(
        r#"{{"weights":[1],"primitives":[{PRIMITIVE},"targets":[{{"POSITION":{tip}}}]}},{PRIMITIVE},"targets":[{{}}]}},
        {PRIMITIVE},"targets":[{{"NORMAL":77,"POSITION":{tip}}}]}}]}}"#
    );
    model.nodes = r#"{"mesh":0}"#.into();
    let mesh = read(&model);
    assert_eq!(only(&mesh).positions.len(), 8);
    let tips: Vec<_> =
        [3, 7, 11].map(|at| only(&mesh).triangles[at].map(|v| only(&mesh).positions[v as usize][2])).into();
    assert_eq!(tips, [[0.0, 0.0, 5.0], [0.0, 0.0, 2.0], [0.0, 0.0, 5.0]]);
}

/// Returns a matrix that moves, as a file has it.
fn moving(by: [f32; 3]) -> Vec<f32> {
    let mut matrix = vec![1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    matrix.extend(by);
    matrix.push(1.0);
    matrix
}

/// A tetrahedron with a skin on a node that is far away. The joints are at z = 1 and, below that, at x = 10, turned by a quarter.
fn skinned() -> (Model, [usize; 3]) {
    let mut model = Model::new();
    let joints = model.integers("VEC4", 5121, false, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let weights = [[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.5, 0.5, 0.0, 0.0]];
    let weights = model.floats("VEC4", weights.as_flattened());
    let matrices = model.floats("MAT4", &[moving([0.0; 3]), moving([-10.0, 0.0, -1.0])].concat());
    model.meshes = format!(
        r#"{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},"indices":1}}]}}"#
    );
    model.nodes = r#"{"name":"body","mesh":0,"skin":0,"translation":[100,0,0],"scale":[9,9,9]},
        {"translation":[0,0,1],"children":[2]},
        {"translation":[10,0,0],"rotation":[0,0,0.70710678,0.70710678]}"#
        .into();
    model.fields = format!(r#""skins":[{{"joints":[1,2],"inverseBindMatrices":{matrices}}}],"#);
    (model, [joints, weights, matrices])
}

/// Where the corners are: those of joint 0 are one up. Corner 2 follows joint 1: from (0, 2, 0) to (-10, 2, -1), turned to
/// (-2, -10, -1), and on to (8, -10, 0). Corner 3 is halfway between (0, 0, 3) and, from (-10, 0, 1) and (0, -10, 1), (10, -10, 2).
const SKINNED: [Point; 4] = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [8.0, -10.0, 0.0], [5.0, -5.0, 2.5]];

#[test]
fn skins_are_where_their_joints_are() {
    let (mut model, [joints, weights, matrices]) = skinned();
    let mesh = read(&model);
    told(&mesh, &[]);
    near(&only(&mesh).positions, &SKINNED);
    // In a scene, it stands in the world.
    let plain = model.nodes.clone();
    model.nodes += r#",{"mesh":0,"translation":[0,0,1]},{"mesh":0,"skin":0,"children":[5]},{"mesh":0}"#;
    let scene = read_scene(&model);
    let all: Vec<_> =
        scene.instances.iter().map(|instance| (instance.object, instance.translation)).collect();
    assert_eq!(all, [(0, [0.0; 3]), (1, [0.0, 0.0, 1.0]), (0, [0.0; 3]), (1, [0.0; 3])]);
    near(&scene.objects[0].positions, &SKINNED);
    assert_eq!(scene.objects[1].positions, corners());
    // Joints of another scene, or of none, are where they are.
    model.nodes = plain.clone();
    model.fields += r#""scenes":[{"nodes":[0]},{"nodes":[1]}],"#;
    near(&only(&read(&model)).positions, &SKINNED);
    // A morph target comes first.
    let delta = model.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mesh = model.meshes.clone();
    model.meshes = mesh.replace(
        r#""indices":1}]"#,
        &format!(r#""indices":1,"targets":[{{"POSITION":{delta}}}]}}],"weights":[2]"#),
    );
    near(&only(&read(&model)).positions[2..3], &[[8.0, -8.0, 0.0]]);
    model.meshes = mesh;
    // Without matrices, they are the identity.
    let fields = model.fields.clone();
    model.fields = fields.replace(&format!(r#","inverseBindMatrices":{matrices}"#), "");
    near(&only(&read(&model)).positions[1..3], &[[2.0, 0.0, 1.0], [8.0, 0.0, 1.0]]);
    model.fields = fields;
    // Joints of 16 bits, weights of 8 and 16 bits.
    let shorts = model.integers("VEC4", 5123, false, &[0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0]);
    let [bytes, words] = [(5121, 255), (5123, 65535)].map(|(kind, one)| {
        model.integers(
            "VEC4",
            kind,
            true,
            &[one, 0, 0, 0, one, 0, 0, 0, one, 0, 0, 0, one / 3, one / 3 * 2, 0, 0],
        )
    });
    let mesh = model.meshes.clone();
    for (joints_of, weights_of) in [(shorts, bytes), (joints, words), (shorts, words)] {
        model.meshes = mesh
            .replace(&format!(r#""JOINTS_0":{joints}"#), &format!(r#""JOINTS_0":{joints_of}"#))
            .replace(&format!(r#""WEIGHTS_0":{weights}"#), &format!(r#""WEIGHTS_0":{weights_of}"#));
        let found = read(&model);
        near(&only(&found).positions[..3], &SKINNED[..3]);
        let third = 1.0 / 3.0;
        near(&only(&found).positions[3..], &[[20.0 * third, -20.0 * third, 3.0 - 2.0 * third]]);
    }
}

#[test]
fn skins_may_have_several_sets_of_joints() {
    let (mut model, [joints, weights, _]) = skinned();
    // Corner 3 follows joint 1 with the fifth of its joints. The sets may be in any order.
    let more = model.integers("VEC4", 5121, false, &[9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 1, 9, 9, 9]);
    let halves = model
        .floats("VEC4", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]);
    let one = model
        .floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0]);
    let both = |first: usize, second: usize| {
        format!(
            r#"{{"primitives":[{{"attributes":{{"WEIGHTS_1":{second},"JOINTS_1":{more},"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{first}}},"indices":1}}]}}"#
        )
    };
    model.meshes = both(one, halves);
    let mesh = read(&model);
    told(&mesh, &[]);
    near(&only(&mesh).positions, &SKINNED);
    model.meshes = both(weights, halves).replace(&format!(r#""WEIGHTS_1":{halves},"#), "");
    wrong(&model, "WEIGHTS_1 in primitive 0 of meshes[0], which has JOINTS_1, found none");
}

#[test]
fn weights_that_do_not_add_up_are_mended_and_told() {
    let (mut model, [_, weights, _]) = skinned();
    let mesh = model.meshes.clone();
    let with = |model: &mut Model, values: [f32; 4]| {
        let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], values, [0.5, 0.5, 0.0, 0.0]];
        let changed = model.floats("VEC4", rows.as_flattened());
        model.meshes =
            mesh.replace(&format!(r#""WEIGHTS_0":{weights}"#), &format!(r#""WEIGHTS_0":{changed}"#));
    };
    // Corner 1 has no weights, and follows joint 0, which is its first.
    let weightless = "moved a vertex of a skin that has no weights with its first joint";
    let scaled = "divided the weights of a vertex of a skin by their sum, which is not 1";
    for (values, expected) in [
        ([1.0, 0.0, 0.0, 0.0], &[weightless][..]),
        ([0.996, 0.0, 0.0, 0.0], &[weightless]),
        ([0.5, 0.0, 0.0, 0.0], &[scaled, weightless]),
        ([7.0, 0.0, 0.0, 0.0], &[scaled, weightless]),
    ] {
        with(&mut model, values);
        let mesh = read(&model);
        told(&mesh, expected);
        near(&only(&mesh).positions, &SKINNED);
    }
    // Integers that are not said to be normalized.
    let bytes =
        model.integers("VEC4", 5121, false, &[255, 0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 99, 99, 0, 0]);
    model.meshes = mesh.replace(&format!(r#""WEIGHTS_0":{weights}"#), &format!(r#""WEIGHTS_0":{bytes}"#));
    let found = read(&model);
    told(&found, &["divided the weights of 4 vertices of skins by their sum, which is not 1"]);
    near(&only(&found).positions, &SKINNED);
    for value in [f32::NAN, f32::INFINITY, -0.5] {
        with(&mut model, [value, 0.0, 0.0, 0.0]);
        wrong(&model, &format!("finite weights from 0 of the joints of skins[0], found {value:e}"));
    }
}

#[test]
fn skins_are_checked() {
    let (plain, [joints, _, matrices]) = skinned();
    let refused = |edit: &dyn Fn(&mut Model), expected: &str| {
        let mut model = plain.clone();
        edit(&mut model);
        wrong(&model, expected);
    };
    let fields = |from: &'static str, to: &'static str| {
        move |model: &mut Model| model.fields = model.fields.replace(from, to)
    };
    refused(&fields("[1,2]", "[1]"), "joints below 1, of which skins[0] has so many, found 1");
    refused(&fields("[1,2]", "[1,3]"), "a number below 3 of one of the nodes, found 3 in skins[0].joints");
    refused(
        &fields("[1,2]", "[1,2,1]"),
        "a matrix for each of 3 joints, found 2 in skins[0].inverseBindMatrices",
    );
    refused(
        &fields(r#""skins""#, r#""kins""#),
        "a number below 0 of one of the skins, found 0 in nodes[0].skin",
    );
    refused(&|model| model.edit(matrices, "MAT4", "VEC4"), "matrices: MAT4 of f32, found VEC4 of f32");
    refused(&|model| model.edit(joints, "5121", "5126"), "joints: VEC4 of u8 or u16, found VEC4 of f32");
    refused(
        &|model| model.edit(joints, "false", "true"),
        "joints: VEC4 of u8 or u16, found VEC4 of normalized u8",
    );
    refused(&|model| model.edit(joints, r#""count":4"#, r#""count":3"#), "4 values, as many as positions");
    refused(
        &|model| model.meshes = format!(r#"{{"primitives":[{PRIMITIVE}}}]}}"#),
        "JOINTS_0 in primitive 0 of meshes[0], which a node with a skin has, found none",
    );
    refused(
        &|model| {
            model.nodes = model.nodes.replacen(
                '{',
                r#"{"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}},"#,
                1,
            )
        },
        "a node with a skin or with EXT_mesh_gpu_instancing, found both in nodes[0]",
    );
    // Bones in a circle, or below two others, stand nowhere.
    for (from, to) in [
        (r#""rotation""#, r#""children":[1],"rotation""#),
        (r#""rotation""#, r#""children":[2],"rotation""#),
        (r#""skin":0"#, r#""skin":0,"children":[2]"#),
    ] {
        refused(&|model| model.nodes = model.nodes.replace(from, to), "nodes that form trees");
        // Also where they are not read otherwise.
        refused(
            &|model| {
                model.nodes =
                    model.nodes.replace(from, to).replace(r#""skin":0,"#, "") + r#",{"mesh":0,"skin":0}"#;
                model.fields += r#""scenes":[{"nodes":[3]}],"#;
            },
            "nodes that form trees",
        );
    }
    // A mirrored skeleton turns the surface inside out, and the faces are turned around, so that the volume stays.
    let mut model = plain.clone();
    let before = volume(&read(&model));
    model.nodes = model.nodes.replace(r#""translation":[0,0,1]"#, r#""scale":[-1,1,1]"#);
    let after = volume(&read(&model));
    assert!(before.abs() > 1.0 && (after - before).abs() < 1e-4, "{before} {after}");
}

/// What moves vertices is in the checksum of the mesh, so that an output of other buffers is not up to date.
#[test]
fn moved_vertices_are_baked_verified_and_known_again() {
    let (mut model, _) = skinned();
    let three = model.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 10.0, 0.0, 0.0]);
    let delta = model.floats("VEC3", &[0.5; 12]);
    model.meshes += &format!(",{}", morphed(&[delta], r#","weights":[1]"#));
    model.nodes += &format!(
        r#",{{"mesh":1,"extensions":{{"EXT_mesh_gpu_instancing":{{"attributes":{{"TRANSLATION":{three}}}}}}}}}"#
    );
    let folder = cbvh_testkit::folder();
    let (path, output) = (folder.path().join("a.gltf"), folder.path().join("a.cbvh"));
    let buffer = folder.path().join("a.bin");
    std::fs::write(&path, model.json().replace(r#"[{"byteLength""#, r#"[{"uri":"a.bin","byteLength""#))
        .unwrap();
    for scene in [false, true] {
        let mut bytes = model.buffer().to_vec();
        std::fs::write(&buffer, &bytes).unwrap();
        let options = Options::default().scene(scene);
        let bake = |memory| {
            FileBake::new([&path], &output).options(options.clone()).max_memory(memory).run().unwrap()
        };
        let Outcome::Baked(report) = bake(None) else { panic!("not baked") };
        let counts = (report.file.triangles, report.file.objects, report.file.instances);
        assert_eq!(counts, if scene { (8, 2, 4) } else { (16, 1, 0) });
        verify_files(&output, std::slice::from_ref(&path), &VerifyOptions::default()).unwrap();
        let whole = std::fs::read(&output).unwrap();
        assert!(matches!(bake(None), Outcome::UpToDate(_)));
        std::fs::remove_file(&output).unwrap();
        bake(Some(64 << 20));
        assert!(std::fs::read(&output).unwrap() == whole);
        // The last number of what the morph target adds, of the last translation, and of the last matrix.
        let places = [bytes.len() - 4, bytes.len() - 52, bytes.len() - 84 - 12];
        for place in places {
            bytes[place..][..4].copy_from_slice(&1.5f32.to_le_bytes());
            std::fs::write(&buffer, &bytes).unwrap();
            assert!(matches!(bake(None), Outcome::Baked(_)), "{place}");
            assert!(std::fs::read(&output).unwrap() != whole);
        }
    }
}

#[test]
fn quantised_vertices_are_moved_as_well() {
    let mut model = Model::new();
    let positions = model.integers("VEC3", 5122, false, &[0, 0, 0, 200, 0, 0, 0, 200, 0, 0, 0, 200]);
    let delta = model.integers("VEC3", 5120, false, &[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -100]);
    model.meshes = morphed(&[delta], r#","weights":[0.5]"#)
        .replace(r#""POSITION":0"#, &format!(r#""POSITION":{positions}"#));
    model.nodes = r#"{"mesh":0,"scale":[0.5,0.5,0.5],"translation":[1,1,1]}"#.into();
    model.fields = r#""extensionsRequired":["KHR_mesh_quantization"],"#.into();
    assert_eq!(
        only(&read(&model)).positions,
        [[1.0; 3], [101.0, 1.0, 1.0], [1.0, 101.0, 1.0], [1.0, 1.0, 76.0]]
    );
}

/// The box of a file whose node with a skin is elsewhere, and the tip that a morph target moves.
#[test]
fn found_files_are_moved() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/as-found");
    let positions = |name: &str| only(&bvh_bake::input::read(&folder.join(name)).unwrap()).positions.clone();
    assert_eq!(positions("skinned.gltf"), corners().map(|[x, y, z]| [x, y, z + 1.0]));
    assert_eq!(positions("morph-weight-1.gltf")[1..], [[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 5.0]]);
}

#[test]
fn what_moves_vertices_has_a_limit() {
    let limited = |model: &Model, expected: &str| {
        let error = super::try_bytes(&model.glb(), MeshFormat::Gltf).unwrap_err();
        assert!(error.is_limit(), "{error}");
        assert!(super::one_line(&error).contains(expected), "{error}");
    };
    // Very many targets share what they add.
    let mut model = Model::new();
    let positions = model.floats("VEC3", &[0.5; 60_000]);
    let many = vec![positions; 4000];
    let ones = vec!["1"; many.len()].join(",");
    model.meshes = morphed(&many, &format!(r#","weights":[{ones}]"#));
    model.meshes = model.meshes.replace(r#""POSITION":0}"#, &format!(r#""POSITION":{positions}}}"#));
    limited(&model, "vertices, indices and names");
    // Nodes have one of two skins in turn.
    let (mut model, [_, _, matrices]) = skinned();
    let joints = vec!["1"; 50_000].join(",");
    let skin = format!(r#"{{"joints":[{joints}]}}"#);
    model.fields = format!(r#""skins":[{skin},{skin}],"#);
    let nodes = [r#"{"mesh":0,"skin":0}"#, r#"{"mesh":0,"skin":1}"#].repeat(1000);
    model.nodes = format!("{},{{}}", nodes.join(","));
    limited(&model, "vertices, indices and names");
    assert!(matrices > 0);
    // A long chain of bones takes a time in proportion to its length, and weights without any use none.
    let mut model = Model::new();
    let [joints, weights] =
        [model.integers("VEC4", 5121, false, &[0; 16]), model.floats("VEC4", &[0.25; 16])];
    let long = 100_000;
    let chain: Vec<_> =
        (2..long).map(|child| format!(r#"{{"children":[{child}],"translation":[1,0,0]}}"#)).collect();
    model.nodes = format!(r#"{{"mesh":0,"skin":0}},{},{{}}"#, chain.join(","));
    let all: Vec<_> = (1..long).rev().map(|joint| joint.to_string()).collect();
    model.fields = format!(r#""skins":[{{"joints":[{}]}}],"scenes":[{{"nodes":[0]}}],"#, all.join(","));
    let zeros = vec!["0"; 100_000].join(",");
    model.meshes = format!(
        r#"{{"primitives":[{{"attributes":{{"POSITION":0,"JOINTS_0":{joints},"WEIGHTS_0":{weights}}},"indices":1}}],"weights":[{zeros}]}}"#
    );
    let far = f64::from(long - 2);
    near(&only(&read(&model)).positions, &corners().map(|[x, y, z]| [x + far, y, z]));
}
