//! The files of robots: which of them are read, what of them is kept, and what a text from others can make the reader do.

use bvh_query::Pose;
use cbvh_robot::{Base, Geometry, Robot, RobotError, RobotOptions, RobotParts};
use cbvh_testkit::Random;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The text of a glTF file of one triangle in `m.bin` beside it.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
        {"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],
    "buffers":[{"byteLength":42,"uri":"m.bin"}]}"#;

/// Writes a triangle of a size, always with the same text.
fn write_triangle(folder: &Path, size: f32) {
    fs::create_dir_all(folder).unwrap();
    let corners = [0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0].map(f32::to_le_bytes).concat();
    fs::write(folder.join("m.gltf"), GLTF).unwrap();
    fs::write(folder.join("m.bin"), [corners, [0, 1, 2].map(u16::to_le_bytes).concat()].concat()).unwrap();
}

/// A ball on link `a`, at a place that only a large triangle on link `b` reaches, and a triangle of `a` far from both.
fn write_robot(folder: &Path, far: &str) {
    let text = format!(
        r#"<robot name="r"><link name="a">
        <collision><origin xyz="100 0 0"/><geometry><mesh filename="{far}/m.gltf"/></geometry></collision>
        <collision><origin xyz="2 0.1 0"/><geometry><sphere radius="0.05"/></geometry></collision></link>
        <link name="b"><collision><geometry><mesh filename="large/m.gltf"/></geometry></collision></link>
        <joint name="j" type="prismatic"><parent link="a"/><child link="b"/></joint></robot>"#
    );
    fs::write(folder.join("robot.urdf"), text).unwrap();
}

fn touches(folder: &Path, options: &RobotOptions) -> bool {
    Robot::from_urdf(folder.join("robot.urdf"), options).unwrap().collide(&[0.0]).unwrap()
}

#[test]
fn meshes_with_the_same_text_and_other_buffers_are_not_the_same() {
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    write_triangle(&folder.join("small"), 1.0);
    write_triangle(&folder.join("large"), 3.0);
    let cache = folder.join("cache");
    let cached = RobotOptions::default().cache(cache.clone());
    for far in ["large", "small"] {
        write_robot(folder, far);
        // Once to fill the cache, and once out of it.
        for options in [&RobotOptions::default(), &cached, &cached] {
            assert!(touches(folder, options), "{far}");
        }
    }
    assert_eq!(fs::read_dir(&cache).unwrap().count(), 2);
    // A buffer that changes, below a text that does not.
    write_triangle(&folder.join("large"), 1.0);
    assert!(!touches(folder, &cached));
    assert_eq!(fs::read_dir(&cache).unwrap().count(), 2);
    write_triangle(&folder.join("large"), 2.2);
    assert!(touches(folder, &cached));
    assert_eq!(fs::read_dir(&cache).unwrap().count(), 3);
}

#[test]
fn buffers_of_meshes_are_read_elsewhere_if_that_is_allowed() {
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    write_triangle(&folder.join("mesh"), 1.0);
    fs::rename(folder.join("mesh/m.bin"), folder.join("m.bin")).unwrap();
    fs::write(folder.join("mesh/m.gltf"), GLTF.replace("m.bin", "../m.bin")).unwrap();
    write_urdf(&folder.join("robot.urdf"), "mesh/m.gltf");
    let read = |allow_outside: bool| {
        let options = RobotOptions::default().allow_outside(allow_outside);
        Robot::from_urdf(folder.join("robot.urdf"), &options).map(drop)
    };
    assert!(matches!(read(false), Err(RobotError::Mesh { .. })));
    read(true).unwrap();
}

/// Writes a robot of one mesh.
fn write_urdf(path: &Path, uri: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let text = format!(
        r#"<robot name="r"><link name="a"><collision><geometry><mesh filename="{uri}"/></geometry></collision></link></robot>"#
    );
    fs::write(path, text).unwrap();
}

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn write_mesh(path: &Path) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, OBJ).unwrap();
}

#[test]
fn meshes_are_read_where_robots_have_them() {
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    let read = |urdf: &str, options: &RobotOptions| Robot::from_urdf(folder.join(urdf), options).map(drop);
    let plain = RobotOptions::default();
    fs::create_dir_all(folder.join("ws/arm/urdf")).unwrap();
    for package in ["ws/arm", "ws/hand"] {
        fs::create_dir_all(folder.join(package)).unwrap();
        fs::write(folder.join(package).join("package.xml"), "<package/>").unwrap();
    }
    for mesh in ["ws/arm/meshes/m.obj", "ws/hand/m.obj", "ws/arm/urdf/deep/er/m.obj", "elsewhere/m.obj"] {
        write_mesh(&folder.join(mesh));
    }
    let elsewhere = folder.join("elsewhere/m.obj");
    let elsewhere = elsewhere.display();
    for (urdf, uri, is_inside) in [
        ("ws/arm/urdf/r.urdf", "../meshes/m.obj".to_owned(), true),
        ("ws/arm/urdf/r.urdf", "deep/er/m.obj".to_owned(), true),
        ("ws/arm/urdf/deep/er/r.urdf", "../../../meshes/m.obj".to_owned(), true),
        ("ws/arm/urdf/r.urdf", "package://arm/meshes/m.obj".to_owned(), true),
        ("ws/arm/urdf/r.urdf", "package://hand/m.obj".to_owned(), true),
        ("ws/arm/urdf/r.urdf", "../../hand/m.obj".to_owned(), false),
        ("ws/arm/urdf/r.urdf", "package://hand/../../elsewhere/m.obj".to_owned(), false),
        ("ws/arm/urdf/r.urdf", "../../../elsewhere/m.obj".to_owned(), false),
        // A folder above is no package because a path says so.
        ("ws/arm/urdf/r.urdf", "package://elsewhere/m.obj".to_owned(), false),
        ("ws/arm/urdf/r.urdf", format!("file://{elsewhere}"), false),
        ("ws/arm/urdf/r.urdf", elsewhere.to_string(), false),
    ] {
        write_urdf(&folder.join(urdf), &uri);
        let found = read(urdf, &plain);
        if is_inside {
            found.unwrap_or_else(|error| panic!("{uri}: {error}"));
            continue;
        }
        let error = found.unwrap_err();
        assert!(matches!(error, RobotError::Outside { .. }), "{uri}: {error}");
        let told = error.to_string();
        assert!(told.contains(&uri) && told.contains("or set allow_outside"), "{told}");
        read(urdf, &plain.clone().allow_outside(true)).unwrap();
    }
    // A folder that the reader names.
    write_urdf(&folder.join("ws/arm/urdf/r.urdf"), "package://elsewhere/m.obj");
    read("ws/arm/urdf/r.urdf", &plain.clone().packages(vec![folder.to_owned()])).unwrap();
    write_urdf(&folder.join("ws/arm/urdf/r.urdf"), "../../../elsewhere/m.obj");
    let packages = vec![folder.join("ws/../elsewhere")];
    read("ws/arm/urdf/r.urdf", &plain.clone().packages(packages)).unwrap();
}

#[cfg(unix)]
#[test]
fn links_lead_out_of_a_package_only_where_the_reader_named_the_folder() {
    use std::os::unix::fs::symlink;
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    let plain = RobotOptions::default();
    write_mesh(&folder.join("secret/m.obj"));
    write_urdf(&folder.join("ws/arm/urdf/r.urdf"), "../meshes/m.obj");
    fs::create_dir_all(folder.join("ws/arm/meshes")).unwrap();
    symlink(folder.join("secret/m.obj"), folder.join("ws/arm/meshes/m.obj")).unwrap();
    let read = |urdf: &str, options: &RobotOptions| Robot::from_urdf(folder.join(urdf), options).map(drop);
    assert!(matches!(read("ws/arm/urdf/r.urdf", &plain), Err(RobotError::Outside { .. })));
    read("ws/arm/urdf/r.urdf", &plain.clone().packages(vec![folder.join("ws")])).unwrap();
    // An installed workspace of links to the files of its packages.
    for package in ["src/arm", "src/hand"] {
        write_mesh(&folder.join(package).join("meshes/m.obj"));
        fs::write(folder.join(package).join("package.xml"), "<package/>").unwrap();
    }
    for name in ["arm", "hand"] {
        fs::create_dir_all(folder.join("share").join(name).join("meshes")).unwrap();
        for file in ["package.xml", "meshes/m.obj"] {
            symlink(folder.join("src").join(name).join(file), folder.join("share").join(name).join(file))
                .unwrap();
        }
    }
    for uri in ["package://arm/meshes/m.obj", "../meshes/m.obj", "package://hand/meshes/m.obj"] {
        write_urdf(&folder.join("src/arm/urdf/r.urdf"), uri);
        fs::create_dir_all(folder.join("share/arm/urdf")).unwrap();
        let link = folder.join("share/arm/urdf/r.urdf");
        let _ = fs::remove_file(&link);
        symlink(folder.join("src/arm/urdf/r.urdf"), &link).unwrap();
        read("share/arm/urdf/r.urdf", &plain).unwrap_or_else(|error| panic!("{uri}: {error}"));
    }
}

/// Reads a robot with an SRDF, from texts.
pub(crate) fn of_texts(urdf: impl AsRef<[u8]>, srdf: Option<&[u8]>) -> Result<Robot, RobotError> {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    fs::write(&path, urdf).unwrap();
    let srdf = srdf.map(|text| {
        let path = folder.path().join("robot.srdf");
        fs::write(&path, text).unwrap();
        path
    });
    let mut options = RobotOptions::default();
    options.srdf = srdf;
    Robot::from_urdf(path, &options)
}

/// A row of balls, each on a link of its own, and links without shapes.
pub(crate) fn row(balls: usize, bare: usize) -> String {
    let mut text = String::from("<robot name=\"row\"><link name=\"base\"/>");
    for link in 0..balls + bare {
        let ball = "<collision><geometry><sphere radius=\"0.1\"/></geometry></collision>";
        let shape = if link < balls { ball } else { "" };
        write!(
            text,
            "<link name=\"l{link}\">{shape}</link><joint name=\"j{link}\" type=\"prismatic\"><parent link=\"base\"/>\
             <child link=\"l{link}\"/></joint>"
        )
        .unwrap();
    }
    text + "</robot>"
}

/// Every link is silent and every one is enabled, which took a step for each three of them.
#[test]
fn an_srdf_of_many_links_is_read_in_few_steps() {
    let mut srdf = String::from("<robot name=\"row\">");
    for link in 0..20_000 {
        write!(
            srdf,
            "<disable_default_collisions link=\"l{link}\"/><enable_collisions link1=\"l{link}\" link2=\"x{link}\"/>\
             <enable_collisions link1=\"l{link}\" link2=\"l0\"/><group name=\"g{link}\"><link name=\"l{link}\"/></group>\
             <group_state name=\"s{link}\" group=\"g{link}\"><joint name=\"j{link}\" value=\"1\"/></group_state>"
        )
        .unwrap();
    }
    let robot = of_texts(row(3, 19_997), Some((srdf + "</robot>").as_bytes())).unwrap();
    assert_eq!(robot.clone().pairs(), [["l0", "l1"], ["l0", "l2"]].map(|pair| pair.map(str::to_owned)));
    assert_eq!((robot.groups().len(), robot.states().len()), (20_000, 20_000));
    assert_eq!(robot.groups()[19_999].joints, [19_999]);
    assert_eq!(robot.states()[7].values, [(7, 1.0)]);
    // One warning for each name, up to a hundred, and one for the rest.
    let warnings = robot.warnings();
    assert_eq!(warnings.len(), 101);
    assert!(
        warnings[0].contains("robot.srdf: line 1, <enable_collisions>: the robot has no link 'x0'"),
        "{warnings:?}"
    );
    assert!(warnings[100].contains("and maybe others"), "{warnings:?}");
}

#[test]
fn names_that_the_robot_does_not_have_are_told() {
    let srdf = "<robot name=\"row\">\n<disable_collisions link1=\"l0\" link2=\"gone\"/>\n\
        <disable_collisions link1=\"l0\" link2=\"l1\"/><disable_collisions link1=\"gone\" link2=\"l1\"/>\n\
        <group name=\"g\"><joint name=\"j0\"/><joint name=\"lost\"/><group name=\"later\"/><joint name=\"glue\"/></group>\n\
        <group_state name=\"s\" group=\"g\"><joint name=\"j0\" value=\"1\"/><joint name=\"astray\" value=\"1\"/>\
        <joint name=\"glue\" value=\"0\"/></group_state></robot>";
    let glue = "<link name=\"e\"/><joint name=\"glue\" type=\"fixed\"><parent link=\"base\"/><child link=\"e\"/></joint></robot>";
    let robot = of_texts(row(2, 0).replace("</robot>", glue), Some(srdf.as_bytes())).unwrap();
    assert_eq!(robot.clone().pairs(), Vec::<[String; 2]>::new());
    let expected = [
        "robot.srdf: line 2, <disable_collisions>: the robot has no link 'gone'",
        "line 4, <joint>: the robot has no joint 'lost'",
        "line 4, <group>: the robot has no group above this one 'later'",
        "line 5, <joint>: the robot has no joint 'astray'",
    ];
    assert_eq!(robot.warnings().len(), expected.len(), "{:?}", robot.warnings());
    for (warning, expected) in robot.warnings().iter().zip(expected) {
        assert!(warning.contains(expected), "{warning}");
    }
    assert!(of_texts(row(2, 0), None).unwrap().warnings().is_empty());
}

/// Each group holds the one before it twice: that is once.
#[test]
fn groups_have_a_limit_together() {
    let all: String = (0..4000).map(|joint| format!("<joint name=\"j{joint}\"/>")).collect();
    let nested = |count: usize| {
        let mut srdf = format!("<robot name=\"row\"><group name=\"g0\">{all}</group>");
        for group in 1..count {
            let other = format!("<group name=\"g{}\"/>", group - 1);
            write!(srdf, "<group name=\"g{group}\">{other}{other}</group>").unwrap();
        }
        of_texts(row(1, 3999), Some((srdf + "</robot>").as_bytes()))
    };
    let robot = nested(100).unwrap();
    assert!(robot.groups().iter().all(|group| group.joints.len() == 4000) && robot.groups().len() == 100);
    let told = nested(2000).unwrap_err().to_string();
    assert!(told.contains("expected groups of at most 4194304 joints together"), "{told}");
}

/// A list of the joints between each two of 1,000 links took 5 GB, and grew with the cube of their number.
#[test]
fn a_long_chain_of_links_takes_the_memory_of_its_pairs() {
    let mut text = row(2000, 0);
    for link in 1..2000 {
        let child = format!("<parent link=\"base\"/><child link=\"l{link}\"/>");
        let below =
            format!("<parent link=\"l{}\"/><origin xyz=\"1 0 0\"/><child link=\"l{link}\"/>", link - 1);
        text = text.replace(&child, &below);
    }
    let mut robot = of_texts(text, None).unwrap();
    let mut q = vec![0.0; 2000];
    assert!(!robot.collide(&q).unwrap());
    // The last link slides back to the first one.
    q[1999] = -1998.9;
    assert!(robot.collide(&q).unwrap());
}

#[test]
fn shapes_and_pairs_of_them_have_a_limit() {
    let told = of_texts(row(5794, 0), None).unwrap_err().to_string();
    assert!(
        told.contains("at most 16777216 pairs of shapes that move against each other, found 16782321"),
        "{told}"
    );
    // Fixed joints make no pairs.
    let told = of_texts(row(32_769, 0).replace("prismatic", "fixed"), None).unwrap_err().to_string();
    assert!(told.contains("at most 32768 shapes, found 32769"), "{told}");
}

#[test]
fn long_texts_are_refused() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("long.urdf");
    for length in [(64 << 20) + 1, 1 << 40] {
        fs::File::create(&path).unwrap().set_len(length).unwrap();
        let error = Robot::from_urdf(&path, &RobotOptions::default()).unwrap_err();
        assert!(matches!(error, RobotError::TooLong { most: 67_108_864, .. }), "{error}");
    }
}

/// A small COLLADA file may name one mesh again and again, with a list of counts that is read each time.
#[test]
fn a_collada_file_that_repeats_itself_has_a_limit() {
    let folder = cbvh_testkit::folder();
    let (instances, counts) = ("<instance_geometry url=\"#g\"/>".repeat(100_000), "0 ".repeat(1_000_000));
    let text = format!(
        "<COLLADA><library_geometries><geometry id=\"g\"><mesh><source id=\"s\"><float_array id=\"a\">0 0 0 1 0 0 0 1 0</float_array>\
         <technique_common><accessor source=\"#a\"/></technique_common></source>\
         <vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices>\
         <polylist><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><vcount>{counts}</vcount><p/></polylist></mesh>\
         </geometry></library_geometries><library_visual_scenes><visual_scene id=\"w\"><node>{instances}</node></visual_scene>\
         </library_visual_scenes><scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>"
    );
    fs::write(folder.path().join("d.dae"), text).unwrap();
    write_urdf(&folder.path().join("r.urdf"), "d.dae");
    let told =
        Robot::from_urdf(folder.path().join("r.urdf"), &RobotOptions::default()).unwrap_err().to_string();
    assert!(told.contains("d.dae: expected at most") && told.contains("bytes of geometries"), "{told}");
}

/// Whatever the texts hold, reading them ends with a robot or an error.
#[test]
fn damaged_texts_never_panic() {
    let urdf =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf")).unwrap();
    // Balls in place of meshes: parts have no files.
    let urdf = urdf.split("<mesh").map(str::to_owned).collect::<Vec<_>>().join("<sphere radius=\"0.1\"");
    let srdf = "<robot name=\"small_arm\"><group name=\"all\"><chain base_link=\"base\" tip_link=\"hand\"/></group>\
        <group name=\"two\"><group name=\"all\"/><joint name=\"elbow\"/><link name=\"hand\"/></group>\
        <group_state name=\"bent\" group=\"all\"><joint name=\"elbow\" value=\"0.5\"/></group_state>\
        <disable_default_collisions link=\"base\"/><enable_collisions link1=\"base\" link2=\"hand\"/>\
        <disable_collisions link1=\"base\" link2=\"turret\"/></robot>";
    let words = [
        "",
        "0",
        "-1",
        "nan",
        "1e999",
        "<link/>",
        "</link>",
        "<mimic joint=\"elbow\"/>",
        "hand",
        "base",
        "é",
        "${x}",
    ];
    let random = &mut Random::new(11);
    let (mut read, mut refused) = (0, 0);
    for _ in 0..cbvh_testkit::depth::rounds(4_000) {
        let mut texts = [urdf.clone(), srdf.to_owned()];
        for _ in 0..1 + random.below(3) {
            let text = &mut texts[random.below(2)];
            let [from, to] = [(); 2].map(|()| random.below(text.len() + 1));
            let (from, to) = (
                from.min(to),
                if random.below(3) == 0 { from.max(to) } else { from.min(to) + random.below(8) },
            );
            let to = to.min(text.len());
            if text.is_char_boundary(from) && text.is_char_boundary(to) {
                let word = words[random.below(words.len())];
                text.replace_range(from..to, word);
            }
        }
        let [urdf, srdf] = texts;
        let parts = RobotParts {
            urdf: ("damaged.urdf".into(), urdf),
            srdf: Some(("damaged.srdf".into(), srdf)),
            geometry: Geometry::Visual,
            base: Base::Fixed,
            mesh_warnings: Vec::new(),
            links: Vec::new(),
            others: Vec::new(),
            margins: Vec::new(),
            allowed: Vec::new(),
        };
        match Robot::from_parts(parts) {
            Ok(mut robot) => {
                let q = vec![0.1; robot.joints().len()];
                robot.add_obstacle("o", crate::questions::block([1.0; 3]), &Pose::IDENTITY).unwrap();
                let _ = robot.collide(&q);
                read += 1;
            }
            Err(error) => {
                assert!(error.to_string().lines().count() == 1, "{error}");
                refused += 1;
            }
        }
    }
    assert!(read > 100 && refused > 1000, "{read} read, {refused} refused");
}
