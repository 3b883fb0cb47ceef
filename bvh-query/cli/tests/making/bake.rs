//! Tests bake, validate, verify and dump on small meshes.

use crate::common::{Files as _, cbvh_in, cube, names, place, torus};
use std::fs;

const PROFILES: [&str; 7] =
    ["auto", "dop14-u8", "dop6-u8", "dop6-f16", "dop14-f32", "dop26-u4", "dop26-u8-wide"];

#[test]
fn every_profile_and_encoding_verifies() {
    let directory = &place();
    directory.write("torus.obj", torus(40, 20));
    for profile in PROFILES {
        for triangles in ["auto", "f32", "packed", "quantized"] {
            let bake = ["bake", "torus.obj", "-o", "t.cbvh", "--profile", profile, "--triangles", triangles];
            cbvh_in(directory, &[&bake[..], &["--force"]].concat()).done();
            assert!(directory.cbvh("validate t.cbvh").done().out.starts_with("t.cbvh: valid"));
            let verified = directory.cbvh("verify t.cbvh torus.obj").done().out;
            assert!(verified.contains("1600 triangles of torus.obj"), "{verified}");
            assert!(directory.cbvh("dump t.cbvh").done().out.contains("level"));
            for what in [&["--page", "0"][..], &["--treelet", "0"], &["--treelet", "7", "--json"]] {
                cbvh_in(directory, &[&["dump", "t.cbvh"][..], what].concat()).done();
            }
            cbvh_in(directory, &[&bake[..], &["--force", "--no-ids", "-q"]].concat()).done();
            directory.cbvh("verify t.cbvh torus.obj").done();
        }
    }
}

#[test]
fn every_effort_verifies_and_is_noted() {
    let directory = &place();
    directory.write("torus.obj", torus(40, 20));
    for effort in ["quick", "default"] {
        let bake = ["bake", "torus.obj", "-o", "t.cbvh", "--json", "-q", "--effort", effort];
        assert_eq!(cbvh_in(directory, &bake).done().json()["skipped"], false);
        assert_eq!(cbvh_in(directory, &bake).done().json()["skipped"], true);
        assert!(directory.cbvh("dump t.cbvh").done().out.contains(&format!("effort={effort}")));
        directory.cbvh("verify t.cbvh torus.obj").done();
    }
    directory
        .cbvh("bake torus.obj -o t.cbvh --effort low")
        .failed(1, &["--effort", "expected quick or default"]);
}

#[test]
fn the_report_has_the_fields_of_the_contract() {
    let directory = &place();
    let twice = cube() + "f 1 3 4 2\n";
    directory.write("cube.obj", twice);
    let baked = directory.cbvh("bake cube.obj -o c.cbvh --json -q").done().json();
    let size = fs::metadata(directory.join("c.cbvh")).unwrap().len();
    assert_eq!(baked["input"], "cube.obj");
    assert_eq!(baked["output"], "c.cbvh");
    assert_eq!(baked["format_version"], "1.0");
    assert_eq!((&baked["triangles_in"], &baked["triangles"]), (&14.into(), &12.into()));
    assert_eq!((&baked["duplicates"], &baked["degenerate"]), (&2.into(), &0.into()));
    assert_eq!(baked["objects"], 1);
    assert_eq!(baked["file_bytes"], size);
    assert_eq!(baked["bytes_per_tri"], size as f64 / 12.0);
    assert_eq!((&baked["skipped"], &baked["max_vertex_rounding"]), (&false.into(), &0.0.into()));
    assert_eq!(baked["content_xxh3"].as_str().map(str::len), Some(16));
    for field in
        ["node_bytes", "triangle_bytes", "id_bytes", "seconds", "width_inflation", "volume_inflation"]
    {
        assert!(baked[field].as_f64().is_some_and(|value| value > 0.0), "{field}: {baked}");
    }
    for field in ["profile", "triangle_encoding", "reason"] {
        assert!(baked[field].is_string(), "{field}: {baked}");
    }
    assert!(baked["max_quantization_error"].is_number());
    assert!(
        !cfg!(target_os = "linux") || baked["peak_rss_bytes"].as_u64().is_some_and(|bytes| bytes > 1 << 20)
    );

    let again = directory.cbvh("bake cube.obj -o c.cbvh --json").done().json();
    assert_eq!(again["skipped"], true);
    for (field, value) in baked.as_object().unwrap() {
        let told = ["skipped", "reason", "seconds", "peak_rss_bytes"].contains(&field.as_str());
        let unknown = again[field].is_null();
        assert!(told || unknown || again[field] == *value, "{field}: {again}");
    }
    assert!(directory.cbvh("bake cube.obj -o c.cbvh").done().out.contains("up to date"));
    assert_eq!(directory.cbvh("bake cube.obj -o c.cbvh -q").done().out, "");
    assert_eq!(names(directory), ["c.cbvh", "cube.obj"]);
}

#[test]
fn a_bake_is_skipped_only_if_nothing_changed() {
    let directory = &place();
    let input = directory.join("t.obj");
    fs::write(&input, torus(12, 9)).unwrap();
    let skipped = |more: &[&str]| {
        let bake =
            cbvh_in(directory, &[&["bake", "t.obj", "-o", "t.cbvh", "--json", "-q"][..], more].concat());
        bake.done().json()["skipped"] == true
    };
    assert!(!skipped(&[]));
    assert!(skipped(&[]));
    assert!(skipped(&["--jobs", "1"]));
    assert!(!skipped(&["--force"]));
    for options in [
        &["--no-ids"][..],
        &["--profile", "dop6-u8"],
        &["--triangles", "packed"],
        &["--triangles", "quantized"],
        &["--triangles", "quantized", "--max-error", "0.001"],
        &["--split-objects"],
        &["--no-topology"],
        &[],
    ] {
        assert!(!skipped(options), "{options:?}");
        assert!(skipped(options), "{options:?}");
    }
    fs::write(&input, torus(12, 9) + "# changed\n").unwrap();
    assert!(!skipped(&[]));
    assert!(skipped(&[]));
    let mut damaged = fs::read(directory.join("t.cbvh")).unwrap();
    damaged[9000] ^= 1;
    directory.write("t.cbvh", &damaged);
    assert!(!skipped(&[]));
    directory.write("t.cbvh", "not a bake");
    assert!(!skipped(&[]));
    assert_eq!(names(directory), ["t.cbvh", "t.obj"]);
}

#[test]
fn content_depends_on_neither_threads_nor_names() {
    let directory = &place();
    directory.write("a.obj", torus(90, 60));
    directory.write("b.obj", torus(90, 60));
    let content = |input: &str, jobs: &str| {
        directory.cbvh(&format!("bake {input} -o o.cbvh --force --json -q --jobs {jobs}")).done().json()["content_xxh3"].clone()
    };
    let one = content("a.obj", "1");
    assert_eq!(one, content("a.obj", "2"));
    assert_eq!(one, content("a.obj", "5"));
    assert_eq!(one, content("b.obj", "2"));
}

#[test]
fn several_inputs_are_baked_as_one() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.write("torus.obj", torus(10, 8));
    let bake = ["bake", "cube.obj", "torus.obj", "-o", "both.cbvh", "--json", "-q"];
    let one = cbvh_in(directory, &bake).done().json();
    assert_eq!((&one["objects"], &one["triangles"]), (&1.into(), &172.into()));
    directory.cbvh("verify both.cbvh cube.obj torus.obj").done();
    directory.cbvh("verify both.cbvh torus.obj cube.obj").failed(3, &["both.cbvh", "triangle"]);
    let split = cbvh_in(directory, &[&bake[..], &["--split-objects"]].concat()).done().json();
    assert_eq!((&split["objects"], &split["triangles_in"]), (&2.into(), &172.into()));
    let verified = directory.cbvh("verify both.cbvh cube.obj torus.obj --json").done().json();
    assert_eq!((&verified["valid"], &verified["objects"]), (&true.into(), &2.into()));
    let dump = directory.cbvh("dump both.cbvh --json").done().json();
    let names: Vec<_> =
        dump["objects"].as_array().unwrap().iter().map(|object| object["name"].clone()).collect();
    assert_eq!(names, ["cube", "torus"]);
}

#[test]
fn objects_without_names_are_named_after_their_files() {
    let directory = &place();
    let unnamed = |text: String| text.lines().skip(1).map(|line| format!("{line}\n")).collect::<String>();
    directory.write("left.obj", unnamed(cube()));
    directory.write("right.v2.obj", unnamed(torus(10, 8)));
    directory.write("named.obj", cube());
    let bake = |more: &[&str]| {
        let bake = ["bake", "left.obj", "named.obj", "right.v2.obj", "-o", "all.cbvh", "--json", "-q"];
        let skipped = cbvh_in(directory, &[&bake[..], more].concat()).done().json()["skipped"] == true;
        let dump = directory.cbvh("dump all.cbvh --json").done().json();
        let objects = dump["objects"].as_array().unwrap().iter();
        (skipped, objects.map(|object| object["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>())
    };
    let names = ["left", "cube", "right.v2"].map(str::to_owned).to_vec();
    assert_eq!(bake(&["--split-objects"]), (false, names.clone()));
    assert_eq!(bake(&["--split-objects", "--max-memory", "100MiB"]), (true, names.clone()));
    assert_eq!(bake(&["--split-objects", "--max-memory", "100MiB", "--force"]), (false, names));
    // Objects that were joined have no name.
    assert_eq!(bake(&[]), (false, vec![String::new()]));
    // A file of the same bytes with another name is baked again.
    let is_skipped = |input: &str| {
        directory.cbvh(&format!("bake {input} -o one.cbvh --split-objects --json -q")).done().json()["skipped"]
            == true
    };
    assert_eq!((is_skipped("left.obj"), is_skipped("left.obj")), (false, true));
    fs::rename(directory.join("left.obj"), directory.join("up.obj")).unwrap();
    assert!(!is_skipped("up.obj"));
}

#[test]
fn a_max_error_that_collapses_the_mesh_is_refused_and_a_coarse_one_is_told() {
    let directory = &place();
    directory.write("t.obj", torus(90, 60));
    for budget in [&[][..], &["--max-memory", "100MiB"]] {
        let bake = |max_error: &str, more: &[&str]| {
            let bake =
                ["bake", "t.obj", "-o", "t.cbvh", "--force", "--triangles", "quantized", "--max-error"];
            cbvh_in(directory, &[&bake[..], &[max_error], budget, more].concat())
        };
        // The diagonal is about 7.3, and there are 10,800 triangles.
        bake("1000", &[]).failed(1, &["t.obj: object \"torus\": expected a max error from 0 to 7.", "1e3"]);
        bake("0.08", &[]).failed(1, &["hundredth of the diagonal"]);
        assert_eq!(names(directory), ["t.obj"]);
        let fine = bake("0.005", &["--json", "-q"]).done().json();
        assert!(fine["warning"].is_null(), "{fine}");
        let coarse = bake("0.05", &["--json"]);
        let warning = coarse.json()["warning"].as_str().unwrap().to_owned();
        assert!(warning.contains("is coarse for this mesh: of 10800 triangles"), "{warning}");
        assert!(coarse.err.ends_with(&format!("{{\"warning\":{warning:?}}}\n")), "{}", coarse.err);
        let coarse = bake("0.05", &[]);
        assert_eq!((coarse.code, coarse.err), (0, format!("cbvh: warning: {warning}\n")));
        fs::remove_file(directory.join("t.cbvh")).unwrap();
    }
}

#[test]
fn a_dump_adds_up() {
    let directory = &place();
    directory.write("torus.obj", torus(60, 30));
    let baked = directory.cbvh("bake torus.obj -o t.cbvh --json -q").done().json();
    let dump = directory.cbvh("dump t.cbvh --json").done().json();
    assert_eq!(dump["content_xxh3"], baked["content_xxh3"]);
    assert_eq!(dump["provenance"]["input"], "torus.obj");
    let object = &dump["objects"][0];
    let levels = object["levels"].as_array().unwrap();
    let sum = |field: &str| levels.iter().map(|level| level[field].as_u64().unwrap()).sum::<u64>();
    assert_eq!(sum("treelets"), object["treelets"]);
    assert_eq!(sum("packets"), object["packets"]);
    assert_eq!(levels.len() as u64, object["depth"]);
    let close = |a: &serde_json::Value, b: &serde_json::Value| {
        (a.as_f64().unwrap() - b.as_f64().unwrap()).abs() < 1e-9
    };
    let verified = directory.cbvh("verify t.cbvh torus.obj --json").done().json();
    assert!(close(&verified["width_inflation"], &baked["width_inflation"]), "{verified}");
    assert!(close(&object["mean_children"], &baked["mean_children"]));
    let split = &dump["bytes_per_tri"];
    let parts: f64 =
        ["nodes", "leaves", "ids", "other"].iter().map(|part| split[part].as_f64().unwrap()).sum();
    assert!((parts - split["total"].as_f64().unwrap()).abs() < 1e-9);
    let treelets = object["treelets"].as_u64().unwrap();
    let last =
        cbvh_in(directory, &["dump", "t.cbvh", "--json", "--treelet", &(treelets - 1).to_string()]).done();
    assert_eq!(last.json()["treelet"], treelets - 1);
    cbvh_in(directory, &["dump", "t.cbvh", "--treelet", &treelets.to_string()]).failed(1, &["below"]);
    directory.cbvh("dump t.cbvh --page 100000").failed(1, &["below"]);
}

#[test]
fn damage_is_told_by_rule() {
    let directory = &place();
    directory.write("torus.obj", torus(60, 30));
    directory.cbvh("bake torus.obj -o t.cbvh").done();
    let whole = fs::read(directory.join("t.cbvh")).unwrap();
    let file = directory.join("bad.cbvh");
    for at in [0, 8, 40, 4200, 9000, whole.len() / 2] {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        fs::write(&file, &bytes).unwrap();
        let told = directory.cbvh("validate bad.cbvh --json").failed(3, &["bad.cbvh: byte ", ": R"]);
        let json = told.json();
        assert_eq!((&json["file"], &json["valid"]), (&"bad.cbvh".into(), &false.into()));
        assert!(json["rule"].is_u64() && json["offset"].is_u64(), "{json}");
        assert!(json["expected"].is_string() && json["found"].is_string(), "{json}");
        let told = directory.cbvh("verify bad.cbvh torus.obj --json").failed(3, &["bad.cbvh"]);
        assert_eq!(told.json()["valid"], false);
    }
    for length in [0, 7, 100, 4096, whole.len() - 1] {
        fs::write(&file, &whole[..length]).unwrap();
        directory.cbvh("validate bad.cbvh").failed(3, &["bad.cbvh"]);
        directory.cbvh("dump bad.cbvh").failed(3, &["bad.cbvh"]);
    }
    directory.write("cube.obj", cube());
    let told = directory.cbvh("verify t.cbvh cube.obj --json");
    let json = told.failed(3, &["t.cbvh: triangles of the input: expected 12, found 3600"]).json();
    assert_eq!((&json["expected"], &json["found"]), (&"12".into(), &"3600".into()));
}

#[test]
fn triangles_that_meet_where_they_should_not_are_listed() {
    let directory = &place();
    directory.write("cube.obj", cube());
    directory.cbvh("bake cube.obj -o c.cbvh").done();
    let said = directory.cbvh("validate c.cbvh --self-contacts").done().out;
    let none = "c.cbvh: 0 pairs of triangles meet where they should not: 0 crossing, 0 at_corner, 0 folded, 0 duplicate\n";
    assert!(said.ends_with(none), "{said}");
    // Triangle 1 is folded onto 0, 2 crosses both, 3 crosses them at a corner, and 4 is 0 again.
    let corners = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 1 1 0\nv 1 0.5 -1\nv 1 0.5 1\nv 3 0.5 1\nv 1 2 -1\nv 1 2 1\n";
    directory.write("bad.obj", format!("{corners}f 1 2 3\nf 1 2 4\nf 5 6 7\nf 1 8 9\nf 2 1 3\n"));
    directory.cbvh("bake bad.obj -o b.cbvh").done();
    let json = directory.cbvh("validate b.cbvh --self-contacts --limit 2 --json").done().json();
    let found = &json["self_contacts"];
    let of = |name: &str| found[name].as_u64().unwrap();
    assert_eq!(of("count"), ["crossing", "at_corner", "folded", "duplicate"].map(of).iter().sum::<u64>());
    assert_eq!((of("crossing"), of("at_corner"), of("folded"), of("duplicate")), (3, 2, 2, 1), "{json}");
    let pairs = found["pairs"].as_array().unwrap();
    let pair =
        |at: usize| (&pairs[at]["kind"], pairs[at]["triangle_a"].as_u64(), pairs[at]["triangle_b"].as_u64());
    assert_eq!(pairs.len(), 2);
    assert_eq!(pair(0), (&"folded".into(), Some(0), Some(1)));
    assert_eq!(pair(1), (&"crossing".into(), Some(0), Some(2)));
    let said = directory.cbvh("validate b.cbvh --self-contacts").done().out;
    assert!(said.contains("  triangle 0 and triangle 4: duplicate\n"), "{said}");
    let listed = said.lines().skip_while(|line| !line.contains("meet where they should not"));
    assert_eq!(listed.count(), 1 + 8, "{said}");
}

#[test]
fn a_summary_has_the_size_and_a_folder_is_no_output() {
    let directory = &place();
    directory.write("a.obj", cube());
    directory.write("b.obj", crate::common::cube_at(3, 10));
    fs::create_dir(directory.join("out")).unwrap();
    for inputs in [&["a.obj"][..], &["a.obj", "b.obj"]] {
        cbvh_in(directory, &[&["bake", "-o", "out"], inputs].concat())
            .failed(2, &["out: expected a file, found a folder", "cbvh bake DIR -o out"]);
    }
    let said = directory.cbvh("bake a.obj b.obj -o c.cbvh --split-objects").done().out;
    assert!(
        said.contains("  size         14 by 6 by 6 mesh units\n") && !said.contains("MiB without ids"),
        "{said}"
    );
}

#[test]
fn clouds_radii_and_solids_are_baked() {
    let directory = &place();
    directory.write("points.xyz", "0 0 0\n1 0 0\n1 0 0\n");
    directory.write("cube.obj", cube());
    directory.write("pose.txt", "1 0 0 3 0 1 0 0 0 0 1 0\n");
    let baked = directory.cbvh("bake points.xyz -o p.cbvh --radius 0.5 --json -q").done().json();
    assert_eq!((&baked["triangles"], &baked["duplicates"]), (&3.into(), &0.into()));
    directory.cbvh("verify p.cbvh points.xyz").done();
    let dumped = &directory.cbvh("dump p.cbvh --json").done().json()["objects"][0];
    assert_eq!((&dumped["radius"], &dumped["solid"]), (&0.5.into(), &false.into()));
    assert_eq!(directory.cbvh("query p.cbvh p.cbvh pose.txt --mode distance").done().out, "1\n");
    directory.cbvh("bake cube.obj -o c.cbvh --solid").done();
    assert_eq!(directory.cbvh("dump c.cbvh --json").done().json()["objects"][0]["solid"], true);
    // The same mesh with another radius is another file.
    assert_eq!(directory.cbvh("bake cube.obj -o c.cbvh --json -q").done().json()["skipped"], false);
    directory.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    directory.cbvh("bake sheet.obj -o s.cbvh --solid").failed(1, &["sheet.obj", "closed surface"]);
    directory.cbvh("bake cube.obj -o s.cbvh --radius=-1").failed(1, &["--radius", "at least 0"]);
    directory.cbvh("bake cube.obj -o s.cbvh --radius 1e40").failed(1, &["2^118"]);
    directory.write(
        "in.jsonl",
        "{\"input\": \"cube.obj\", \"output\": \"m.cbvh\", \"radius\": 0.25, \"solid\": true}\n",
    );
    directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl").done();
    let dumped = &directory.cbvh("dump m.cbvh --json").done().json()["objects"][0];
    assert_eq!((&dumped["radius"], &dumped["solid"]), (&0.25.into(), &true.into()));
    assert!(!names(directory).contains(&"s.cbvh".to_owned()));
}

/// Returns a COLLADA file of a box in inches with y up, in two places and sizes, and with a line.
fn inches() -> String {
    let corners = "0 0 0 1 0 0 0 1 0 1 1 0 0 0 2 1 0 2 0 1 2 1 1 2";
    let sides = "0 2 3 1 4 5 7 6 0 1 5 4 2 6 7 3 0 4 6 2 1 3 7 5";
    let input = "<input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/>";
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<COLLADA version=\"1.4.1\"><asset><unit name=\"inch\" meter=\"0.0254\"/>\
         <up_axis>Y_UP</up_axis></asset><library_geometries><geometry id=\"g\" name=\"box\"><mesh><source id=\"s\"><float_array id=\"a\">\
         {corners}</float_array><technique_common><accessor source=\"#a\" count=\"8\" stride=\"3\"/></technique_common></source>\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices><polylist count=\"6\">{input}\
         <vcount>4 4 4 4 4 4</vcount><p>{sides}</p></polylist><lines count=\"1\">{input}<p>0 7</p></lines></mesh></geometry>\
         </library_geometries><library_visual_scenes><visual_scene id=\"w\"><node name=\"one\"><instance_geometry url=\"#g\"/></node>\
         <node name=\"two\"><translate>9 0 0</translate><scale>2 2 2</scale><instance_geometry url=\"#g\"/></node></visual_scene>\
         </library_visual_scenes><scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>\n"
    )
}

#[test]
fn collada_becomes_metres_with_z_up_and_says_so() {
    let directory = &place();
    fs::create_dir(directory.join("parts")).unwrap();
    directory.write("parts/box.dae", inches());
    directory.write("parts/nothing", inches());
    let told = "parts/box.dae: scaled from units of 0.0254 metres to metres and turned from Y_UP to Z_UP";
    for (arguments, objects, instances) in
        [(&[][..], 1, 0), (&["--split-objects"], 2, 0), (&["--scene"], 2, 2)]
    {
        let bake = ["bake", "parts/box.dae", "-o", "box.cbvh", "--json", "-q"];
        let baked = cbvh_in(directory, &[&bake[..], arguments].concat()).done().json();
        assert_eq!((&baked["objects"], &baked["instances"]), (&objects.into(), &instances.into()));
        assert_eq!(baked["triangles_in"], 24);
        assert_eq!(baked["warnings"], serde_json::json!([told, "parts/box.dae: left out 2 lists of lines"]));
        directory.cbvh("verify box.cbvh parts/box.dae").done();
        assert!(directory.cbvh("validate box.cbvh").done().out.contains("valid"));
    }
    // One file is told by its content, and a folder is baked by extensions.
    let said = directory.cbvh("bake parts/nothing -o nothing.cbvh -q");
    assert!(said.code == 0 && said.err.starts_with("cbvh: warning: parts/nothing: scaled"), "{said:?}");
    let said = directory.cbvh("bake parts -o baked");
    let err = said.err.replace('\\', "/");
    assert!(said.code == 0 && err.contains("warning: parts/box.dae: scaled"), "{said:?}");
    assert_eq!(names(&directory.join("baked")), ["box.cbvh"]);
    directory.cbvh("scene parts/box.dae").failed(3, &["parts/box.dae: expected a scene file, found COLLADA"]);
    let clash = directory.cbvh("clash parts/box.dae");
    assert!(clash.code == 0 && clash.out.contains("2 parts") && clash.out.contains("metres"), "{clash:?}");
    directory.write(
        "parts/box.dae",
        inches().replace("<instance_geometry url=\"#g\"/></node></v", "<instance_controller/></node></v"),
    );
    directory.cbvh("bake parts/box.dae -o box.cbvh").failed(
        3,
        &["parts/box.dae: line 2: expected an element that this reader knows, found <instance_controller>"],
    );
}

#[test]
fn warnings_are_told_and_points_without_a_position_left_out() {
    let directory = &place();
    directory.write("holes.xyz", "2\n0 0 0\nnan nan nan\n1 0 0\n");
    let bake = ["bake", "holes.xyz", "-o", "holes.cbvh", "--force"];
    let refused = cbvh_in(directory, &bake);
    refused.failed(3, &["holes.xyz: line 3: expected a finite coordinate", "--drop-nan"]);
    let warnings = [
        "holes.xyz: line 1: 3 points follow this line, which states 2",
        "holes.xyz: line 3: left out 1 point without a position",
    ];
    let lines = warnings.map(|warning| format!("cbvh: warning: {warning}\n")).concat();
    for quiet in [&[][..], &["-q"]] {
        let told = cbvh_in(directory, &[&bake[..], &["--drop-nan"], quiet].concat());
        assert_eq!((told.code, told.err), (0, lines.clone()));
    }
    let baked = cbvh_in(directory, &[&bake[..], &["--drop-nan", "--json"]].concat());
    let json = baked.json();
    assert_eq!(
        (&json["warnings"], &json["triangles"]),
        (&serde_json::json!(warnings), &serde_json::json!(2))
    );
    assert!(
        warnings.iter().all(|warning| baked.err.contains(&format!("{{\"warning\":{warning:?}}}\n"))),
        "{}",
        baked.err
    );
    cbvh_in(directory, &["verify", "holes.cbvh", "holes.xyz"]).done();
    directory.write("in.jsonl", r#"{"input": "holes.xyz", "output": "a.cbvh", "drop_nan": true}"#);
    let many = cbvh_in(directory, &["bake", "--manifest", "in.jsonl", "--out-manifest", "out.jsonl"]);
    assert!(many.err.contains(&lines), "{}", many.err);
    let line = fs::read_to_string(directory.join("out.jsonl")).unwrap();
    let line: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(line["warnings"], serde_json::json!(warnings));
    // Meshes that are baked in memory are told of, too.
    directory.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n");
    let asked = cbvh_in(directory, &["query", "a.obj", "a.cbvh", "--mode", "collide"]);
    assert_eq!(asked.err, "cbvh: warning: a.obj: line 4: left out 1 face of fewer than three corners\n");
}

/// A seam of 1e-15 leaves a tetrahedron open until it is welded. A distance that is no length, or larger than the mesh, is a mistake
/// on the command line, and nothing is written.
#[test]
fn seams_are_welded() {
    let directory = &place();
    directory.write(
        "seam.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 1 0 1e-15\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 5 3 4\n",
    );
    let welded = directory.cbvh("bake seam.obj -o w.cbvh --weld 1e-12 --json -q").done().json();
    assert_eq!(welded["closed"], 1);
    let rounding = welded["max_vertex_rounding"].as_f64().unwrap();
    assert!((1e-15..1.001e-15).contains(&rounding), "{rounding}");
    directory.cbvh("verify w.cbvh seam.obj").done();
    directory.write("point.txt", "0.1 0.1 0.1\n");
    let side = directory.cbvh("probe w.cbvh point.txt --mode side");
    assert!(
        side.code == 0 && side.out.starts_with('1') && side.err.contains("moved by up to 1.0000"),
        "{side:?}"
    );
    let expected = |found: &str| ["seam.obj: ", "expected a weld distance from 0", found].map(str::to_owned);
    for (distance, found) in
        [("-1", "found -1e0"), ("nan", "found NaN"), ("inf", "found inf"), ("2", "found 2e0")]
    {
        let refused = directory.cbvh(&format!("bake seam.obj -o no.cbvh --weld={distance}"));
        refused.failed(1, &expected(found).each_ref().map(String::as_str));
    }
    directory.write("in.jsonl", "{\"input\": \"seam.obj\", \"output\": \"m.cbvh\", \"weld\": 1e-12}\n");
    directory.cbvh("bake --manifest in.jsonl --out-manifest out.jsonl").done();
    assert_eq!(fs::read(directory.join("m.cbvh")).unwrap(), fs::read(directory.join("w.cbvh")).unwrap());
    assert!(!names(directory).contains(&"no.cbvh".to_owned()));
}
