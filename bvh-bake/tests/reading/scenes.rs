//! Scenes: node trees of glTF files become instances that share their meshes, and stand where the same file read as a mesh
//! has its triangles.

use bvh_bake::input::{read, read_scene};
use bvh_bake::mesh::{Instance, Mesh};
use bvh_bake::{FileBake, Options, Outcome, VerifyError, VerifyOptions, to_bytes, verify, verify_files};
use bvh_format::Layout;
use cbvh_testkit::random::Random;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns a binary glTF file of two meshes, "tetra" and one without a name, and some nodes.
fn glb(nodes: &str) -> Vec<u8> {
    let corners: [[f32; 3]; 5] =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0], [0.5, 0.25, -1.0]];
    let mut blob: Vec<u8> = corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    blob.extend([0u8, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]);
    blob.extend([0u8, 1, 4, 4]);
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[
            {{"name":"tetra","primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}},
            {{"primitives":[{{"attributes":{{"POSITION":0}},"indices":2}}]}},
            {{"name":"points","primitives":[{{"attributes":{{"POSITION":0}},"mode":0}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}},
            {{"bufferView":1,"componentType":5121,"count":12,"type":"SCALAR"}},
            {{"bufferView":2,"componentType":5121,"count":3,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":60}},{{"buffer":0,"byteOffset":60,"byteLength":12}},
            {{"buffer":0,"byteOffset":72,"byteLength":3}}],
        "buffers":[{{"byteLength":76}}]}}"#
    );
    crate::glb(&json, &blob)
}

/// Writes a scene file, and returns its folder and path.
fn file(nodes: &str) -> (cbvh_testkit::TempDir, PathBuf) {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("scene.glb");
    fs::write(&path, glb(nodes)).unwrap();
    (folder, path)
}

/// Returns the triangles of each instance in the world.
fn placed(mesh: &Mesh) -> Vec<Vec<[[f64; 3]; 3]>> {
    let of = |instance: &Instance| {
        let object = &mesh.objects[instance.object as usize];
        let place = |vertex: u32| {
            let x = object.positions[vertex as usize];
            [0, 1, 2].map(|row| {
                (0..3).map(|k| instance.rotation[row][k] * x[k]).sum::<f64>() + instance.translation[row]
            })
        };
        object.triangles.iter().map(|corners| corners.map(place)).collect()
    };
    mesh.instances.iter().map(of).collect()
}

#[test]
fn nodes_share_their_meshes() {
    let nodes = r#"{"name":"left","mesh":0,"translation":[1,2,3]},{"name":"left","mesh":0,"rotation":[0,0,1,0]},
        {"name":"big","mesh":0,"scale":[2,2,2]},{"children":[4,5],"scale":[2,2,2],"rotation":[0.5,0.5,0.5,0.5]},
        {"mesh":0,"rotation":[0.1,0.2,0.3,0.4]},{"mesh":1},{"name":"nothing","mesh":2},
        {"name":"mirrored","mesh":0,"scale":[-1,1,1]},
        {"name":"matrix","mesh":0,"matrix":[0,2,0,0,-2,0,0,0,0,0,2,0,7,8,9,1]}"#;
    let (_folder, path) = file(nodes);
    let mesh = read_scene(&path).unwrap();
    let all = mesh.instances.iter().map(|instance| (instance.name.as_str(), instance.object));
    let expected =
        [("left", 0), ("left.2", 0), ("big", 1), ("tetra", 1), ("", 2), ("mirrored", 3), ("matrix", 1)];
    assert_eq!(all.collect::<Vec<_>>(), expected);
    let names: Vec<_> = mesh.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["tetra", "tetra", "scene", "tetra"]);
    assert_eq!(mesh.objects[1].positions[2], [0.0, 4.0, 0.0]);
    assert_eq!((mesh.objects[0].triangles[0], mesh.objects[3].triangles[0]), ([0, 2, 1], [0, 1, 2]));
    assert_eq!(mesh.instances[6].rotation, [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_eq!(mesh.instances[6].translation, [7.0, 8.0, 9.0]);
}

/// A tree of nodes with transforms of all kinds. If `uniform`, only rotations, translations and single factors occur, and
/// the number of different pairs of a mesh and its factor in the world is returned, too.
fn random_nodes(random: &mut Random, count: usize, uniform: bool) -> (String, usize) {
    let mut parents = vec![None; count];
    for child in 1..count {
        parents[child] = (random.below(4) > 0).then(|| random.below(child));
    }
    let (mut factors, mut pairs) = (Vec::new(), BTreeSet::new());
    let number = |random: &mut Random| (2.0 * random.signed()) as f32;
    let node = |number_of_node: usize| {
        let mut parts = Vec::new();
        let children = (0..count).filter(|&child| parents[child] == Some(number_of_node));
        let children: Vec<usize> = children.collect();
        if !children.is_empty() {
            parts.push(format!("\"children\":{children:?}"));
        }
        let factor: f32 = [1.0, 0.5, 3.0, -1.0][random.below(4)];
        let above = parents[number_of_node].map_or(1.0, |parent: usize| factors[parent]);
        factors.push(above * f64::from(factor));
        if random.below(3) > 0 {
            let mesh = random.below(2);
            parts.push(format!("\"mesh\":{mesh}"));
            pairs.insert((mesh, factors[number_of_node].to_bits()));
        }
        let scale = if uniform { [factor; 3] } else { [factor, 1.0, 0.5] };
        let [x, y, z, w, a, b, c] = [(); 7].map(|()| number(random));
        if random.below(3) == 0 {
            let [x, y, z, w] = [x, y, z, w].map(f64::from);
            let s = 2.0 / (x * x + y * y + z * z + w * w);
            let columns = [
                [1.0 - s * (y * y + z * z), s * (x * y + z * w), s * (x * z - y * w)],
                [s * (x * y - z * w), 1.0 - s * (x * x + z * z), s * (y * z + x * w)],
                [s * (x * z + y * w), s * (y * z - x * w), 1.0 - s * (x * x + y * y)],
            ];
            let columns = [0, 1, 2].map(|k| columns[k].map(|value| (value * f64::from(scale[k])) as f32));
            let [p, q, r] = columns.map(|[x, y, z]| format!("{x},{y},{z},0"));
            parts.push(format!("\"matrix\":[{p},{q},{r},{a},{b},{c},1]"));
        } else {
            let norm = (x * x + y * y + z * z + w * w).sqrt();
            let [x, y, z, w] = [x, y, z, w].map(|value| value / norm);
            parts.push(format!(
                "\"rotation\":[{x},{y},{z},{w}],\"scale\":{scale:?},\"translation\":[{a},{b},{c}]"
            ));
        }
        format!("{{{}}}", parts.join(","))
    };
    let nodes = (0..count).map(node).collect::<Vec<_>>().join(",");
    (nodes, pairs.len())
}

#[test]
fn instances_stand_where_the_mesh_has_its_triangles() {
    let mut random = Random::new(14);
    for round in 0..40 {
        let (nodes, pairs) = random_nodes(&mut random, 24, round % 2 == 0);
        let (_folder, path) = file(&nodes);
        let (flat, scene) = (read(&path).unwrap(), read_scene(&path).unwrap());
        assert_eq!(flat.objects.len(), scene.instances.len());
        if round % 2 == 0 {
            assert_eq!(scene.objects.len(), pairs);
        }
        for (object, placed) in flat.objects.iter().zip(placed(&scene)) {
            assert_eq!(object.triangles.len(), placed.len());
            let size = object.positions.iter().flatten().fold(1.0f64, |most, value| most.max(value.abs()));
            for (corners, placed) in object.triangles.iter().zip(placed) {
                for (corner, placed) in corners.iter().zip(placed) {
                    let expected = object.positions[*corner as usize];
                    let off = (0..3).map(|k| (expected[k] - placed[k]).abs()).fold(0.0, f64::max);
                    // Each matrix may be off by 2^-22.
                    assert!(off <= 1e-5 * size, "{off:e} of {size}: {expected:?} at {placed:?}");
                }
            }
        }
    }
}

fn bake(inputs: &[PathBuf], output: &Path, options: &Options, memory: Option<u64>) -> Outcome {
    FileBake::new(inputs, output).options(options.clone()).max_memory(memory).run().unwrap()
}

/// A scene of several files is baked, verified, left alone when it is up to date, and the same within a budget.
#[test]
fn scenes_of_files_are_baked_and_verified() {
    let (folder, glb) =
        file(r#"{"name":"a","mesh":0,"translation":[5,0,0]},{"name":"b","mesh":0},{"name":"p","mesh":2}"#);
    let obj = folder.path().join("part.obj");
    fs::write(&obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\no empty\no b\nf 1 2 3\no c\nf 3 2 1\n").unwrap();
    let (inputs, output) = ([glb.clone(), obj], folder.path().join("out.cbvh"));
    let options = Options::default().scene(true);
    let Outcome::Baked(report) = bake(&inputs, &output, &options, None) else { panic!("not baked") };
    assert_eq!((report.file.objects, report.file.instances, report.file.triangles), (3, 4, 6));
    let bytes = fs::read(&output).unwrap();
    let instances = Layout::read(&bytes).unwrap().read_instances(&bytes[..]).unwrap();
    let all: Vec<_> = instances.iter().map(|instance| (instance.name.as_str(), instance.object)).collect();
    assert_eq!(all, [("a", 0), ("b", 0), ("b.2", 1), ("c", 2)]);
    assert_eq!(instances[0].translation, [5.0, 0.0, 0.0]);
    assert!(matches!(bake(&inputs, &output, &options, None), Outcome::UpToDate(file) if file.instances == 4));
    let checked = verify_files(&output, &inputs, &VerifyOptions::default()).unwrap();
    assert_eq!((checked.triangles, checked.objects), (6, 3));

    let within = folder.path().join("within.cbvh");
    bake(&inputs, &within, &options, Some(64 << 20));
    assert!(fs::read(&within).unwrap() == bytes);
    // Objects without a name are called after their file, and so are their instances.
    let plain = [folder.path().join("plain.obj"), folder.path().join("solid.stl")];
    fs::write(&plain[0], "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    fs::write(&plain[1], format!("solid\n{facet}endsolid\n")).unwrap();
    bake(&plain, &within, &options, None);
    verify_files(&within, &plain, &VerifyOptions::default()).unwrap();
    let baked = fs::read(&within).unwrap();
    let instances = Layout::read(&baked).unwrap().read_instances(&baked[..]).unwrap();
    assert_eq!(instances.iter().map(|instance| &instance.name[..]).collect::<Vec<_>>(), ["plain", "solid"]);
    assert_eq!(read_scene(&plain[0]).unwrap().instances[0], instances[0]);
    for ids in [true, false] {
        bake(&inputs, &within, &options.clone().ids(ids), None);
        verify_files(&within, &inputs, &VerifyOptions::default()).unwrap();
    }
    // Read as a mesh, the nodes are copies, and nothing says where anything stands.
    let Outcome::Baked(report) = bake(&inputs, &output, &Options::default(), None) else {
        panic!("not baked")
    };
    assert_eq!((report.file.objects, report.file.instances, report.file.triangles), (1, 0, 9));

    fs::write(&glb, self::glb(r#"{"name":"a","mesh":0,"translation":[5,0,1]},{"name":"b","mesh":0}"#))
        .unwrap();
    let said = verify_files(&within, &inputs, &VerifyOptions::default()).unwrap_err().to_string();
    assert_eq!(said, "translation of instance 0: expected [5.0, 0.0, 1.0], found [5.0, 0.0, 0.0]");
    let far = self::glb(r#"{"children":[1],"scale":[1e38,1e38,1e38]},{"mesh":0,"translation":[1e38,0,0]}"#);
    fs::write(&glb, far).unwrap();
    let said = FileBake::new(&inputs, &output).options(options).run().unwrap_err().to_string();
    assert!(said.contains("scene.glb") && said.contains("expected") && !said.contains('\n'), "{said}");
}

/// A mesh in memory may have instances, too.
#[test]
fn instances_of_a_mesh_in_memory_are_baked() {
    let mut mesh = Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    mesh.objects.insert(0, bvh_bake::mesh::Object::default());
    let mut other = mesh.objects[1].clone();
    other.triangle_ids = vec![1];
    mesh.objects.push(other);
    let turned =
        Instance { rotation: [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], ..Instance::of_object(2) };
    // That of the object without triangles is left out with it.
    mesh.instances = vec![Instance::of_object(1), Instance::of_object(0), turned, Instance::of_object(1)];
    let (bytes, report) = to_bytes(&mesh, &Options::default()).unwrap();
    assert_eq!((report.file.objects, report.file.instances), (2, 3));
    let found = Layout::read(&bytes).unwrap().read_instances(&bytes[..]).unwrap();
    assert_eq!(found.iter().map(|instance| instance.object).collect::<Vec<_>>(), [0, 1, 0]);
    verify(&bytes, &mesh).unwrap();
    let differs = |edit: fn(&mut Mesh)| {
        let mut mesh = mesh.clone();
        edit(&mut mesh);
        match verify(&bytes, &mesh) {
            Err(VerifyError::Differs { what, .. }) => what,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(differs(|mesh| mesh.instances[2].name = "x".into()), "name of instance 1");
    assert_eq!(differs(|mesh| mesh.instances[3].translation[0] = 1e-300), "translation of instance 2");
    assert_eq!(differs(|mesh| mesh.instances.clear()), "instances");
    mesh.instances[0].object = 3;
    let said = to_bytes(&mesh, &Options::default()).unwrap_err().to_string();
    assert_eq!(said, "instance 0 \"\": expected an object below 3, found 3");
}
