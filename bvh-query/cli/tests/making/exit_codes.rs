//! Checks that every failure ends with the right exit code and one line, and leaves nothing behind.

use crate::common::{Files as _, Place, cbvh_in, cbvh_with_isa, cube, names, place};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

fn with_cube() -> Place {
    let place = place();
    fs::write(place.join("cube.obj"), cube()).unwrap();
    place
}

#[test]
fn help_and_version_are_no_errors() {
    let here = Path::new(".");
    assert!(here.cbvh("--version").done().out.starts_with("cbvh "));
    let help = here.cbvh("--help").done().out;
    for command in
        ["bake", "dump", "validate", "verify", "query", "motion", "probe", "scene", "clash", "report"]
    {
        assert!(help.contains(command));
        assert!(cbvh_in(here, &[command, "--help"]).done().out.contains("Example"));
    }
}

#[test]
fn wrong_usage_is_1() {
    let directory = &with_cube();
    let pose = "1 0 0 0 0 1 0 0 0 0 1 0";
    let motion = &format!("{pose} {pose}");
    directory.write("p.txt", format!("{pose}\n"));
    let cases: &[&[&str]] = &[
        &[],
        &["frobnicate"],
        &["bake"],
        &["bake", "cube.obj"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--profile", "dop18"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--triangles", "f64"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--max-error", "1"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--triangles", "packed", "--max-error", "1"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--triangles", "quantized", "--max-error", "-1"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--triangles", "quantized", "--max-error", "nan"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--max-memory", "lots"],
        &["bake", "cube.obj", "-o", "o.cbvh", "--jobs", "0"],
        &["bake", "cube.obj", "-o", "cube.obj"],
        &["bake", "cube.obj", "-o", "./cube.obj", "--force"],
        &["bake", "cube.obj", "-o", "-"],
        &["dump", "cube.cbvh", "--page", "x"],
        &["dump", "cube.cbvh", "--max-memory", "lots"],
        &["validate", "cube.cbvh", "--max-memory", "-1"],
        &["validate", "cube.cbvh", "--limit", "3"],
        &["validate", "cube.cbvh", "--self-contacts", "--limit", "-1"],
        &["validate", "cube.cbvh", "--self-contacts", "--max-memory", "1GiB"],
        &["verify", "cube.cbvh", "cube.obj", "--max-memory", "lots"],
        &["query", "cube.obj", "cube.obj", "--bench"],
        &["query", "cube.obj", "cube.obj", "--out", "raw.txt"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--pose", pose],
        &["query", "cube.obj", "cube.obj", "--pose", pose, "--bench"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--bench", "--json"],
        &["query", "cube.obj", "cube.obj", "--pose", pose, "--jobs", "2"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--jobs", "-1"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--budget", "nan"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--mode", "touch"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--mode", "within"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--within", "1"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--mode", "within", "--within", "-1"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--mode", "collide", "--rel-err", "0.1"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--isa", "neon"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--object", "sphere"],
        &["query", "cube.obj", "cube.obj", "p.txt", "--witness", "w.obj"],
        &["query", "cube.obj", "cube.obj", "--pose", pose, "--witness", "w.obj"],
        &["query", "cube.obj", "cube.obj", "p.txt,p.txt", "--out", "raw.txt"],
        &["query", "cube.obj", "cube.obj", ","],
        &["motion", "cube.obj", "cube.obj", "p.txt,p.txt", "--out", "raw.txt"],
        &["motion", "cube.obj", "cube.obj", "--motion", motion, "--object", "sphere"],
        &["probe"],
        &["probe", "cube.obj"],
        &["probe", "cube.obj", "p.txt", "--mode", "touch"],
        &["probe", "cube.obj", "p.txt", "--probe", "0 0 0"],
        &["probe", "cube.obj", "--probe", "0 0 0", "--bench"],
        &["probe", "cube.obj", "--probe", "0 0 0", "--jobs", "2"],
        &["probe", "cube.obj", "--probe", "0 0 0", "--object", "sphere"],
        &["probe", "cube.obj", "p.txt", "--isa", "neon"],
        &["probe", "cube.obj", "p.txt,p.txt", "--out", "raw.txt"],
        &["probe", "cube.obj", ","],
        &["report"],
        &["report", "--hard"],
        &["report", "--scaling"],
        &["report", "--out", "r"],
    ];
    for case in cases {
        let ended = cbvh_in(directory, case).failed(1, &[]);
        assert_eq!(ended.out, "", "{case:?}");
    }
    cbvh_with_isa(directory, "mmx", &["query", "cube.obj", "cube.obj", "p.txt"]).failed(1, &["mmx"]);
    assert_eq!(names(directory), ["cube.obj", "p.txt"]);
    assert_eq!(directory.text("cube.obj"), cube());
}

#[test]
fn what_the_system_refuses_is_2() {
    let directory = &with_cube();
    fs::create_dir(directory.join("folder")).unwrap();
    let io = |arguments: &[&str], name: &str| {
        cbvh_in(directory, arguments).failed(2, &[name]);
    };
    io(&["bake", "missing.obj", "-o", "o.cbvh"], "missing.obj");
    io(&["bake", "folder", "-o", "o.cbvh"], "folder");
    io(&["bake", "cube.obj", "-o", "missing/o.cbvh"], "missing/o.cbvh");
    io(
        &["bake", "cube.obj", "-o", "missing/o.cbvh"],
        "expected the folder missing, found none; create it first",
    );
    io(&["bake", "cube.obj", "-o", "o.cbvh", "--max-memory", "1GiB", "--scratch", "missing"], "missing");
    io(&["bake", "cube.obj", "-o", "folder"], "folder");
    io(&["bake", "cube.obj", "-o", "cube.obj/o.cbvh"], "cube.obj/o.cbvh");
    for command in ["dump", "validate"] {
        io(&[command, "missing.cbvh"], "missing.cbvh");
        io(&[command, "folder"], "folder");
    }
    io(&["verify", "missing.cbvh", "cube.obj"], "missing.cbvh");
    directory.cbvh("bake cube.obj -o cube.cbvh").done();
    io(&["verify", "cube.cbvh", "missing.obj"], "missing.obj");
    io(&["verify", "cube.cbvh", "folder"], "folder: expected a readable file, found a folder");
    io(&["verify", "cube.cbvh", "cube.obj", "--scratch", "missing"], "missing");
    io(&["query", "cube.cbvh", "missing.cbvh", "p.txt"], "p.txt");
    directory.write("p.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
    io(&["query", "cube.cbvh", "missing.cbvh", "p.txt"], "missing.cbvh");
    io(&["query", "cube.cbvh", "missing.obj", "p.txt"], "missing.obj");
    io(&["query", "cube.cbvh", "cube.cbvh", "p.txt", "--out", "missing/raw.txt"], "missing/raw.txt");
    assert_eq!(names(directory), ["cube.cbvh", "cube.obj", "folder", "p.txt"]);
    assert!(names(&directory.join("folder")).is_empty());
}

#[test]
fn no_output_replaces_an_input_or_another_output() {
    let directory = &with_cube();
    let pose = |x: i32| format!("1,0,0,{x},0,1,0,0,0,0,1,0");
    let pose_line = format!("{}\n", pose(9).replace(',', " "));
    let instance = pose_line.trim();
    fs::create_dir(directory.join("dd")).unwrap();
    directory.cbvh("bake cube.obj -o b.cbvh -q").done();
    directory.write("p.txt", &pose_line);
    directory.write("dd/p.txt", &pose_line);
    directory.write("m.txt", format!("{} {}", pose_line.trim(), pose(0).replace(',', " ")));
    directory.write("pts.txt", "0 0 5\n");
    directory.write(
        "s.scene",
        format!("mesh m cube.obj\ninstance a m {instance}\ninstance b m {instance}\nmoving a\n"),
    );
    directory.write("in.part", "{\"input\": \"cube.obj\", \"output\": \"o.cbvh\"}\n");
    let before = contents(directory);
    let motion = format!("motion cube.obj b.cbvh --motion {},{} --witness", pose(9), pose(0));
    for (command, inputs) in [
        ("query cube.obj b.cbvh --mode distance --witness", &["cube.obj", "dd/../b.cbvh"][..]),
        ("query b.cbvh cube.obj dd/p.txt,m.txt --bench --out", &["./%s.txt", "dd/%s.txt"]),
        ("query b.cbvh cube.obj p.txt --bench --out", &["./p.txt", "cube.obj", "b.cbvh"]),
        (&motion, &["cube.obj", "b.cbvh"]),
        ("motion cube.obj b.cbvh m.txt --bench --out", &["m.txt", "cube.obj"]),
        ("probe b.cbvh pts.txt --mode closest --bench --out", &["pts.txt", "b.cbvh"]),
        ("scene s.scene p.txt --bench --out", &["s.scene", "p.txt", "dd/../cube.obj"]),
        ("bake --manifest in.part --out-manifest", &["cube.obj", "in"]),
    ] {
        for input in inputs {
            directory.cbvh(&format!("{command} {input}")).failed(1, &["found an input"]);
        }
    }
    for (command, output) in [
        ("clash cube.obj b.cbvh --csv x.csv --bcf dd/../x.csv", "x.csv"),
        ("clash cube.obj b.cbvh --csv x.csv --view ./x.csv", "x.csv"),
        ("query cube.obj b.cbvh p.txt,dd/p.txt --bench --out q_%s.txt", "q_p.txt"),
    ] {
        let words = [output, ": expected a different file for each output"];
        directory.cbvh(command).failed(1, &words);
    }
    assert_eq!(contents(directory), before);
}

/// Returns the names and the contents of all files in a folder.
fn contents(directory: &Path) -> Vec<(String, Option<Vec<u8>>)> {
    let with_content = |name: String| (name.clone(), fs::read(directory.join(name)).ok());
    names(directory).into_iter().map(with_content).collect()
}

#[cfg(target_os = "linux")]
#[test]
fn devices_are_no_outputs() {
    let folder = with_cube();
    cbvh_in(&folder, &["bake", "cube.obj", "-o", "/dev/null"]).failed(2, &["/dev/null", "special file"]);
    assert!(!Path::new("/dev/null").is_file());
}

#[test]
fn invalid_input_is_3() {
    let directory = &with_cube();
    let write = |name: &str, text: &str| directory.write(name, text);
    write("bad.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n");
    write("empty.stl", "");
    write("mesh.abc", "what is this\n");
    directory.cbvh("bake bad.obj -o o.cbvh").failed(3, &["bad.obj: line 3: expected", "found 3"]);
    directory.cbvh("bake cube.obj bad.obj -o o.cbvh").failed(3, &["bad.obj: line 3"]);
    directory.cbvh("bake empty.stl -o o.cbvh").failed(3, &["empty.stl"]);
    directory.cbvh("bake mesh.abc -o o.cbvh").failed(3, &["mesh.abc", ".abc"]);
    directory.cbvh("validate cube.obj").failed(3, &["cube.obj: byte 0: R01"]);
    cbvh_in(directory, &["query", "bad.obj", "cube.obj", "--pose", "1 0 0 0 0 1 0 0 0 0 1 0"])
        .failed(3, &["bad.obj: line 3"]);
    let good = "1 0 0 0 0 1 0 0 0 0 1 0";
    for (text, line, word) in [
        (format!("{good}\n1 2 3\n"), 2, "found 3"),
        (format!("# ok\n\n{good} # 13 14\n1 0 0 0 0 1 0 0 0 0 1 # 0\n"), 4, "found 11"),
        (format!("{good} 0 0 0 1\n"), 1, "found 16; a 4 by 4 matrix? write its first three rows"),
        ("0 0 0 1 5 0 0\n".to_owned(), 1, "found 7; a quaternion and a translation? write"),
        ("2 0 0 5 0 2 0 0 0 0 2 0\n".to_owned(), 1, "scaled by 2; bake the mesh at its size"),
        ("0 -0.001 0 5 0.001 0 0 0 0 0 0.001 0\n".to_owned(), 1, "scaled by 0.001;"),
        ("1 0 0 0 1 0 0 0 1\n".to_owned(), 1, "found 9; a rotation alone? write a 0 after each row"),
        ("1 0 0 5 0 2 0 0 0 0 1 0\n".to_owned(), 1, "orthonormal"),
        ("0 0 0 0 0 0 0 0 0 0 0 0\n".to_owned(), 1, "orthonormal"),
        ("1 0 0 0 0 1 0 0 0 0 1.1 0\n".to_owned(), 1, "away from orthonormal"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n".to_owned(), 1, "reflection"),
        ("1 0 0 nan 0 1 0 0 0 0 1 0\n".to_owned(), 1, "finite"),
        ("1 0 0 zero 0 1 0 0 0 0 1 0\n".to_owned(), 1, "zero"),
    ] {
        write("p.txt", &text);
        let place = format!("p.txt: line {line}: ");
        directory.cbvh("query cube.obj cube.obj p.txt").failed(3, &[&place, "expected", word]);
        // A wrong pose has the same exit code on the command line.
        let wrong = text.lines().find(|text| !text.contains('#') && !text.is_empty() && *text != good);
        if let Some(pose) = wrong {
            let query = ["query", "cube.obj", "cube.obj", "--pose", pose];
            cbvh_in(directory, &query).failed(3, &["--pose: ", "expected", word]);
        }
    }
    for none in ["", "\n", "# no pose\n\n"] {
        write("p.txt", none);
        directory
            .cbvh("query cube.obj cube.obj p.txt")
            .failed(3, &["p.txt: expected at least one line of 12 numbers", "found no pose"]);
    }
    assert_eq!(names(directory), ["bad.obj", "cube.obj", "empty.stl", "mesh.abc", "p.txt"]);
}

#[test]
fn limits_are_4() {
    let directory = &with_cube();
    let bake = ["bake", "cube.obj", "-o", "o.cbvh", "--max-memory"];
    for size in ["1", "10kB", "8MiB"] {
        cbvh_in(directory, &[&bake[..], &[size]].concat()).failed(4, &["cube.obj", "memory"]);
    }
    assert_eq!(names(directory), ["cube.obj"]);
    cbvh_in(directory, &[&bake[..], &["512MiB"]].concat()).done();
    for check in [&["dump", "o.cbvh"][..], &["validate", "o.cbvh"], &["verify", "o.cbvh", "cube.obj"]] {
        for size in ["0", "8MiB"] {
            cbvh_in(directory, &[check, &["--max-memory", size]].concat()).failed(4, &["o.cbvh", "memory"]);
        }
        cbvh_in(directory, &[check, &["--max-memory", "512MiB"]].concat()).done();
    }
}

#[test]
fn an_old_output_survives_a_failure() {
    let directory = &with_cube();
    directory.cbvh("bake cube.obj -o o.cbvh").done();
    let before = fs::read(directory.join("o.cbvh")).unwrap();
    directory.write("cube.obj", "v 0 0 0\nf 1 1 2\n");
    directory.cbvh("bake cube.obj -o o.cbvh").failed(3, &["cube.obj: line 2"]);
    assert_eq!(fs::read(directory.join("o.cbvh")).unwrap(), before);
    assert_eq!(names(directory), ["cube.obj", "o.cbvh"]);
}

#[test]
fn a_closed_pipe_is_no_panic() {
    let folder = with_cube();
    cbvh_in(&folder, &["bake", "cube.obj", "-o", "o.cbvh"]).done();
    // More answers than a pipe and all buffers hold.
    folder.write("p.txt", "0.5 0.25 9\n".repeat(100_000));
    for arguments in [
        &["dump", "o.cbvh"][..],
        &["probe", "o.cbvh", "p.txt", "--mode", "closest"],
        &["probe", "o.cbvh", "p.txt", "--mode", "side", "--json"],
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_cbvh"))
            .args(arguments)
            .current_dir(&folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let ended = child.wait_with_output().unwrap();
        assert_eq!((ended.status.code(), ended.stderr.len()), (Some(0), 0), "{arguments:?}");
    }
}
