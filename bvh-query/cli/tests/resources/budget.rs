//! Bakes and checks within a memory budget: the results are the same, and the memory stays within the budget.

use crate::common::sheet::write_sheet;
use crate::common::{Ended, Files as _, cbvh_in, gltf, names, place, run};
use cbvh_testkit::depth::rounds;
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the command under a hard limit on its address space, in KiB.
fn cbvh_within(directory: &Path, kibibytes: u64, arguments: &[&str]) -> Ended {
    let command = "ulimit -v \"$0\" && exec \"$@\"";
    run(Command::new("sh")
        .args(["-c", command, &kibibytes.to_string(), env!("CARGO_BIN_EXE_cbvh")])
        .args(arguments)
        .current_dir(directory)
        // Each arena of the GNU C library reserves 64 MiB of addresses, which are no memory.
        .env("MALLOC_ARENA_MAX", "1")
        .env_remove("CBVH_ISA"))
}

fn bake(directory: &Path, input: &str, more: &[&str]) -> Value {
    let arguments = [&["bake", input, "-o", "out.cbvh", "--json", "-q", "--force"], more].concat();
    cbvh_in(directory, &arguments).done().json()
}

#[test]
fn budgets_jobs_and_formats_do_not_show() {
    let directory = &place();
    // The mesh has three bricks.
    let side = 500;
    let mut all = Vec::new();
    for input in ["sheet.stl", "sheet.ply", "sheet.obj"] {
        write_sheet(&directory.join(input), side);
        for more in [&[][..], &["--max-memory", "140MiB", "--jobs", "1"], &["--max-memory", "1GiB"]] {
            let baked = bake(directory, input, more);
            all.push((baked["content_xxh3"].clone(), baked["triangles"].clone()));
            if more.contains(&"140MiB") {
                assert!(baked["scratch_written_bytes"].as_u64().unwrap() > 0, "{baked}");
            }
        }
    }
    assert_eq!(all[0].1, 2 * side.pow(2));
    assert!(all.iter().all(|one| *one == all[0]), "{all:?}");
    assert_eq!(names(directory), ["out.cbvh", "sheet.obj", "sheet.ply", "sheet.stl"]);
}

/// Many objects of one triangle each share the files of a budget, and their work: each object had files of its own, and the time
/// grew with the square of their number.
#[test]
fn many_objects_take_few_files() {
    let directory = &place();
    let count = 5000;
    let object = |number: usize| {
        let (x, y) = (number % 100, number / 100);
        format!("o p{number}\nv {x} {y} 0\nv {x}.5 {y} 0\nv {x} {y}.5 0.1\nf -3 -2 -1\n")
    };
    directory.write("many.obj", (0..count).map(object).collect::<String>());
    let bake = |more: &[&str]| {
        let arguments = [&["bake", "many.obj", "-o", "out.cbvh", "--json", "-q", "--force"], more].concat();
        let command = "ulimit -n 64 && exec \"$@\"";
        let ended = run(Command::new("sh")
            .args(["-c", command, "sh", env!("CARGO_BIN_EXE_cbvh")])
            .args(arguments)
            .current_dir(directory));
        ended.done().json()
    };
    for kind in ["--split-objects", "--scene"] {
        let whole = bake(&[kind]);
        assert_eq!((&whole["objects"], &whole["triangles"]), (&count.into(), &count.into()), "{kind}");
        let within = bake(&[kind, "--max-memory", "48MiB"]);
        assert!(within["scratch_written_bytes"].as_u64().unwrap() > 10 << 20, "{within}");
        assert_eq!(within["content_xxh3"], whole["content_xxh3"], "{kind}");
    }
}

#[test]
fn memory_stays_within_the_budget() {
    let directory = &place();
    write_sheet(&directory.join("sheet.stl"), 1000);
    let (mut contents, mut jobs) = (Vec::new(), ["1", "2"].into_iter().cycle());
    for mebibytes in [128, 512, 200].into_iter().take(rounds(1) as usize) {
        let budget = format!("{mebibytes}MiB");
        let more = ["--max-memory", &budget, "--jobs", jobs.next().unwrap(), "--scratch", "."];
        let baked = bake(directory, "sheet.stl", &more);
        let peak = baked["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= mebibytes << 20, "{peak} bytes, not {budget}");
        contents.push(baked["content_xxh3"].clone());
    }
    assert!(contents.iter().all(|content| *content == contents[0]), "{contents:?}");
    let refused = directory.cbvh("bake sheet.stl -o out.cbvh --force --max-memory 64MiB");
    refused.failed(4, &["sheet.stl", "67108864 bytes of memory", "2000000 triangles", "at least"]);
}

/// A sheet and its back: all triangles have duplicates, and only with them is the surface closed.
#[test]
fn memory_stays_within_the_budget_where_all_triangles_have_duplicates() {
    let directory = &place();
    write_sheet(&directory.join("sheet.stl"), 600);
    let front = fs::read(directory.join("sheet.stl")).unwrap();
    let triangles = front[84..].as_chunks::<50>().0;
    let mut both = front.clone();
    both[80..84].copy_from_slice(&(2 * triangles.len() as u32).to_le_bytes());
    for triangle in triangles {
        both.extend([&triangle[..12], &triangle[24..36], &triangle[12..24], &triangle[36..]].concat());
    }
    directory.write("both.stl", both);
    let free = bake(directory, "both.stl", &[]);
    assert_eq!((&free["closed"], &free["triangles"]), (&1.into(), &triangles.len().into()));
    for jobs in ["2", "1"].into_iter().take(rounds(1) as usize) {
        let baked =
            bake(directory, "both.stl", &["--max-memory", "132MiB", "--jobs", jobs, "--scratch", "."]);
        let peak = baked["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= 132 << 20, "{peak} bytes");
        assert_eq!(baked["content_xxh3"], free["content_xxh3"]);
    }
    assert_eq!(
        directory.cbvh("verify out.cbvh both.stl --json --max-memory 48MiB").done().json()["valid"],
        true
    );
    assert_eq!(bake(directory, "sheet.stl", &[])["closed"], 0);
}

#[test]
fn memory_of_checks_stays_within_the_budget() {
    let directory = &place();
    write_sheet(&directory.join("sheet.stl"), 1000);
    bake(directory, "sheet.stl", &[]);
    let length = fs::metadata(directory.join("out.cbvh")).unwrap().len();
    let threads = std::thread::available_parallelism().unwrap().get() as u64;
    let within = |arguments: &[&str], mebibytes: u64| {
        let budget = format!("{mebibytes}MiB");
        let told =
            cbvh_in(directory, &[arguments, &["--json", "--max-memory", &budget]].concat()).done().json();
        let peak = told["peak_rss_bytes"].as_u64().unwrap();
        assert!(peak <= mebibytes << 20, "{arguments:?}: {peak} bytes, not {budget}");
        let mut usual = cbvh_in(directory, &[arguments, &["--json"]].concat()).done().json();
        usual["peak_rss_bytes"] = peak.into();
        assert_eq!(told, usual);
    };
    let least = 10 + threads;
    assert!(threads > 16 || length > (5 * least) << 20, "{length} bytes");
    within(&["validate", "out.cbvh"], least);
    within(&["verify", "out.cbvh", "sheet.stl"], 46 + threads);
    // A process with a limited address space cannot hold more memory than that. Each further thread needs only its
    // stack.
    for way in ["--json", "--page 7", "--treelet 9999"] {
        let command = format!("ulimit -v 65536; exec {} dump out.cbvh {way}", env!("CARGO_BIN_EXE_cbvh"));
        let ended = Command::new("sh").args(["-c", &command]).current_dir(directory).output().unwrap();
        let told = String::from_utf8(ended.stdout).unwrap();
        assert_eq!(ended.status.code(), Some(0), "{way}: {}", String::from_utf8_lossy(&ended.stderr));
        let arguments: Vec<&str> = ["dump", "out.cbvh"].into_iter().chain(way.split(' ')).collect();
        assert_eq!(told, cbvh_in(directory, &arguments).done().out);
    }
    assert!(length > 64 << 20);
    // A damaged byte near the end of the file is found.
    let mut bytes = fs::read(directory.join("out.cbvh")).unwrap();
    let at = bytes.len() / 20 * 19;
    bytes[at] ^= 1;
    directory.write("out.cbvh", bytes);
    let budget = format!("{least}MiB");
    let damaged = |more: &[&str]| {
        cbvh_in(directory, &[&["validate", "out.cbvh"], more].concat()).failed(3, &["out.cbvh: byte"]).err
    };
    assert_eq!(damaged(&[]), damaged(&["--max-memory", &budget]));
    assert_eq!(names(directory), ["out.cbvh", "sheet.stl"]);
}

/// Addresses that the process takes and that are no memory of the bake, in KiB: the program, its libraries and its stacks.
const ADDRESSES_KIB: u64 = 96 << 10;

/// Bakes at the least budget that is accepted, which the error names, under a hard limit on the address space. Returns that
/// budget in MiB.
#[track_caller]
fn bakes_at_its_limit(directory: &Path, arguments: &[&str]) -> u64 {
    let within = |mebibytes: u64| -> Ended {
        let budget = format!("{mebibytes}MiB");
        let more = ["--force", "--max-memory", &budget, "--jobs", "1", "--scratch", ".", "--json"];
        cbvh_within(directory, (mebibytes << 10) + ADDRESSES_KIB, &[&["bake"], arguments, &more].concat())
    };
    let mut mebibytes = 9;
    for _ in 0..8 {
        let ended = within(mebibytes);
        if ended.code == 0 {
            let told = ended.json();
            let peak = told["peak_rss_bytes"].as_u64().unwrap();
            assert!(peak <= mebibytes << 20, "{arguments:?}: {peak} bytes, not {mebibytes} MiB");
            return mebibytes;
        }
        let remedy = ended.err.split("give --max-memory ").nth(1).and_then(|rest| rest.split("MiB").next());
        assert_eq!(ended.code, 4, "{arguments:?}: {ended:?}");
        mebibytes = remedy.unwrap_or_else(|| panic!("{ended:?}")).parse().unwrap();
    }
    panic!("{arguments:?}: no budget is enough, not even {mebibytes} MiB");
}

#[test]
fn each_format_bakes_at_its_limit() {
    let directory = &place();
    // The mesh has two bricks.
    let side = 400;
    for name in ["sheet.obj", "sheet.stl", "sheet.ply"] {
        write_sheet(&directory.join(name), side);
    }
    // The same sheet as text, and as glTF in each way that buffers can be stored.
    let stl = fs::read(directory.join("sheet.stl")).unwrap();
    let (mut text, mut ply, mut positions, mut faces) =
        (String::from("solid\n"), String::new(), Vec::new(), String::new());
    for (number, triangle) in stl[84..].as_chunks::<50>().0.iter().enumerate() {
        text += "facet normal 0 0 0\nouter loop\n";
        for corner in triangle[12..48].as_chunks::<12>().0 {
            let [x, y, z] = [0, 4, 8].map(|at| f32::from_le_bytes(corner[at..at + 4].try_into().unwrap()));
            text += &format!("vertex {x} {y} {z}\n");
            ply += &format!("{x} {y} {z}\n");
            positions.extend_from_slice(corner);
        }
        text += "endloop\nendfacet\n";
        faces += &format!("3 {} {} {}\n", 3 * number, 3 * number + 1, 3 * number + 2);
    }
    directory.write("text.stl", text + "endsolid\n");
    let count = positions.len() / 12;
    let head = format!(
        "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
        count / 3
    );
    let corners: Vec<String> = (0..count).map(|corner| corner.to_string()).collect();
    let dae = format!(
        "<COLLADA><library_geometries><geometry><mesh><source id=\"s\"><float_array id=\"a\">{ply}</float_array><technique_common>\
         <accessor source=\"#a\"/></technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\
         <triangles><input semantic=\"VERTEX\" source=\"#v\"/><p>{}</p></triangles></mesh></geometry></library_geometries></COLLADA>",
        corners.join(" ")
    );
    directory.write("sheet.dae", dae);
    directory.write("text.ply", head + &ply + &faces);
    let indices: Vec<u8> = (0..count as u32).flat_map(u32::to_le_bytes).collect();
    directory.write("p.bin", &positions);
    directory.write("i.bin", &indices);
    directory.write("beside.gltf", gltf(count, count, "p.bin", "i.bin"));
    let uri = |bytes: &[u8]| format!("data:;base64,{}", base64(bytes));
    let inside = gltf(count, count, &uri(&positions), &uri(&indices));
    directory.write("inside.gltf", inside);
    let mut limits = Vec::new();
    for input in [
        "sheet.obj",
        "sheet.stl",
        "sheet.ply",
        "text.stl",
        "text.ply",
        "beside.gltf",
        "inside.gltf",
        "sheet.dae",
    ] {
        limits.push((input, bakes_at_its_limit(directory, &[input, "-o", "out.cbvh", "-q"])));
    }
    // Formats that are read piece by piece need no more for a longer file.
    let least = limits.iter().map(|(_, limit)| *limit).min().unwrap();
    let piecewise = limits.iter().filter(|(input, _)| !["inside.gltf", "sheet.dae"].contains(input));
    assert!(piecewise.clone().all(|(_, limit)| *limit == least), "{limits:?}");
    // Two inputs are one mesh, and a folder is many.
    bakes_at_its_limit(directory, &["sheet.obj", "beside.gltf", "-o", "out.cbvh", "-q"]);
}

/// Files much larger than the budget, most of whose bytes are vertices that no triangle uses.
#[test]
fn large_buffers_of_small_meshes_take_little_memory() {
    let directory = &place();
    let count = 18 << 20;
    let file = fs::File::create(directory.join("p.bin")).unwrap();
    file.set_len(12 * count as u64).unwrap();
    directory.write("i.bin", [0u32, 1, 2].map(u32::to_le_bytes).concat());
    directory.write("a.gltf", gltf(count, 3, "p.bin", "i.bin"));
    assert!(bakes_at_its_limit(directory, &["a.gltf", "-o", "out.cbvh", "-q"]) <= 128);
    // The same as one binary file.
    let json = gltf(count, 3, "", "i.bin").replace(r#","uri":"""#, "");
    let json = format!("{json:width$}", width = json.len().next_multiple_of(4));
    let length = 12 * count as u32;
    let mut head = [b"glTF".as_slice(), &2u32.to_le_bytes()].concat();
    head.extend((28 + json.len() as u32 + length).to_le_bytes());
    head.extend([&(json.len() as u32).to_le_bytes(), b"JSON".as_slice(), json.as_bytes()].concat());
    head.extend([&length.to_le_bytes(), b"BIN\0".as_slice()].concat());
    directory.write("a.glb", &head);
    let file = fs::File::options().write(true).open(directory.join("a.glb")).unwrap();
    file.set_len(head.len() as u64 + u64::from(length)).unwrap();
    assert!(bakes_at_its_limit(directory, &["a.glb", "-o", "out.cbvh", "-q"]) <= 128);
    // Many buffers name one file.
    let views: Vec<String> = (0..500).map(|i| format!(r#"{{"buffer":{i},"byteLength":36}}"#)).collect();
    let buffers = vec![r#"{"byteLength":36,"uri":"p.bin"}"#; 500].join(",");
    let accessor = |i| format!(r#"{{"bufferView":{i},"componentType":5126,"count":3,"type":"VEC3"}}"#);
    let accessors: Vec<String> = (0..500).map(accessor).collect();
    let primitive = |i| format!(r#"{{"attributes":{{"POSITION":{i}}}}}"#);
    let primitives: Vec<String> = (0..500).map(primitive).collect();
    let many = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}],
        "accessors":[{}],"bufferViews":[{}],"buffers":[{buffers}]}}"#,
        primitives.join(","),
        accessors.join(","),
        views.join(",")
    );
    directory.write("many.gltf", many);
    assert!(bakes_at_its_limit(directory, &["many.gltf", "-o", "out.cbvh", "-q"]) <= 16);
}

/// What a file makes the bake keep in memory counts: JSON, names, objects.
#[test]
fn what_is_kept_counts() {
    let directory = &place();
    let nodes = vec!["{}"; 300_000].join(",");
    let document =
        gltf(3, 3, "p.bin", "i.bin").replacen("[{\"mesh\":0}", &format!("[{{\"mesh\":0}},{nodes}"), 1);
    directory.write("nodes.gltf", document);
    fs::write(
        directory.join("p.bin"),
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat(),
    )
    .unwrap();
    directory.write("i.bin", [0u32, 1, 2].map(u32::to_le_bytes).concat());
    let objects: String = (0..60_000).map(|i| format!("o {i}\nf 1 2 3\n")).collect();
    directory.write("objects.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{objects}"));
    let solids = "solid\nfacet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\nendsolid\n";
    directory.write("solids.stl", solids.repeat(60_000));
    let triangle = "<geometry id=\"g\"><mesh><source id=\"s\"><float_array id=\"a\">0 0 0 1 0 0 0 1 0</float_array><technique_common>\
                    <accessor source=\"#a\"/></technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/>\
                    </vertices><triangles><input semantic=\"VERTEX\" source=\"#v\"/><p>0 1 2</p></triangles></mesh></geometry>";
    let dae = |nodes: &str| {
        format!(
            "<COLLADA><library_geometries>{triangle}</library_geometries><library_visual_scenes><visual_scene>\
             {nodes}</visual_scene></library_visual_scenes></COLLADA>"
        )
    };
    let instance = "<node id=\"n\"><instance_geometry url=\"#g\"/></node>";
    directory.write("nodes.dae", dae(&(instance.to_owned() + &"<node id=\"m\"/>".repeat(300_000))));
    directory.write("deep.dae", dae(&("<node>".repeat(200_000) + instance + &"</node>".repeat(200_000))));
    directory.write("instances.dae", dae(&instance.repeat(60_000)));
    for input in ["nodes.gltf", "objects.obj", "solids.stl", "nodes.dae", "deep.dae", "instances.dae"] {
        bakes_at_its_limit(directory, &[input, "-o", "out.cbvh", "-q"]);
    }
}

/// What a glTF file makes the bake keep to find its vertices counts: joints, weights, morph targets, attributes, and the shapes of
/// instances.
#[test]
fn what_moves_vertices_counts() {
    let directory = &place();
    let mut buffer: Vec<u8> = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat();
    buffer.extend([0; 12]);
    buffer.extend([1.0f32; 12].map(f32::to_le_bytes).as_flattened());
    let scales = 20_000u32;
    (0..scales)
        .for_each(|i| buffer.extend([1.0 + 1e-3 * i as f32, 1.0, 1.0].map(f32::to_le_bytes).as_flattened()));
    directory.write("b.bin", &buffer);
    let document = |nodes: &str, attributes: &str, fields: &str| {
        let view =
            |at: u32, length: u32| format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{length}}}"#);
        let views = [view(0, 36), view(36, 12), view(48, 48), view(96, 12 * scales)].join(",");
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],{fields},
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{attributes}}}}}]}}],"accessors":[
            {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":1,"componentType":5121,"count":3,"type":"VEC4"}},
            {{"bufferView":2,"componentType":5126,"count":3,"type":"VEC4"}},{{"bufferView":3,"componentType":5126,"count":{scales},"type":"VEC3"}}],
            "bufferViews":[{views}],"buffers":[{{"uri":"b.bin","byteLength":{}}}]}}"#,
            buffer.len()
        )
    };
    let many = |what: &str, count: usize| vec![what; count].join(",");
    let plain = r#"{"mesh":0}"#;
    let skin = r#"{"mesh":0,"skin":0}"#;
    let joints = format!(r#""skins":[{{"joints":[{}]}}]"#, many("0", 200_000));
    directory.write("joints.gltf", document(skin, r#","JOINTS_0":1,"WEIGHTS_0":2"#, &joints));
    let targets = format!(r#"}},"targets":[{}],"extras":{{"#, many(r#"{"POSITION":0}"#, 20_000));
    let weighted = format!(r#"{{"mesh":0,"weights":[{}]}}"#, many("1", 20_000));
    directory.write("targets.gltf", document(&weighted, &targets, r#""extras":0"#));
    let weighted = many(&format!(r#"{{"mesh":0,"weights":[{}]}}"#, many("0.5", 1000)), 200);
    let targets = format!(r#"}},"targets":[{}],"extras":{{"#, many("{}", 1000));
    let all: Vec<String> = (0..200).map(|node| node.to_string()).collect();
    let weights = document(&weighted, &targets, r#""extras":0"#)
        .replace("[{\"nodes\":[0]}]", &format!("[{{\"nodes\":[{}]}}]", all.join(",")));
    directory.write("weights.gltf", weights);
    let own: String = (0..200_000).map(|number| format!(r#","_{number}":0"#)).collect();
    directory.write("attributes.gltf", document(plain, &own, r#""extras":0"#));
    let channels = many(r#"{"target":{"node":0,"path":"scale"}}"#, 100_000);
    directory.write(
        "channels.gltf",
        document(plain, "", &format!(r#""animations":[{{"channels":[{channels}]}}]"#)),
    );
    for input in ["joints.gltf", "targets.gltf", "weights.gltf", "attributes.gltf", "channels.gltf"] {
        bakes_at_its_limit(directory, &[input, "-o", "out.cbvh", "-q"]);
    }
    let instanced = r#"{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"SCALE":3}}}}"#;
    directory.write("scales.gltf", document(instanced, "", r#""extras":0"#));
    bakes_at_its_limit(directory, &["scales.gltf", "-o", "out.cbvh", "-q"]);
    bakes_at_its_limit(directory, &["scales.gltf", "-o", "out.cbvh", "-q", "--scene"]);
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |bits: u32, place: u32| char::from(DIGITS[(bits >> (18 - 6 * place) & 63) as usize]);
    let mut text = String::with_capacity(bytes.len() / 3 * 4 + 4);
    for group in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, at| bits << 8 | u32::from(group.get(at).copied().unwrap_or(0)));
        (0..4).for_each(|place| {
            text.push(if place as usize <= group.len() { digit(bits, place) } else { '=' })
        });
    }
    text
}
