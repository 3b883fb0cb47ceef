//! The URIs by which robots name meshes: hosts and percent-encoding.

use bvh_query::Querier;
use cbvh_robot::{Robot, RobotError, RobotOptions};
use std::fs;
use std::path::Path;

/// A triangle at some height, by which it is known.
fn write_mesh(path: &Path, z: u32) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, format!("v 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nf 1 2 3\n")).unwrap();
}

/// Returns the height of the mesh that a URI names.
fn height(urdf: &Path, uri: &str, packages: &[&Path]) -> Result<f64, RobotError> {
    fs::create_dir_all(urdf.parent().unwrap()).unwrap();
    let mesh = format!("<collision><geometry><mesh filename=\"{uri}\"/></geometry></collision>");
    fs::write(urdf, format!("<robot><link name=\"a\">{mesh}</link></robot>")).unwrap();
    let robot = Robot::from_urdf(urdf, &RobotOptions::default().packages(packages.iter().copied()))?;
    let shapes = robot.shapes(0)?;
    let [(shape, _)] = &shapes[..] else { unreachable!("one link with one mesh") };
    let closest = Querier::new().unwrap().closest_point(shape, [0.2, 0.2, 0.0], f64::INFINITY).unwrap();
    Ok(closest.unwrap().point[2])
}

#[test]
fn uris_are_read_as_they_are_and_then_decoded() {
    let folder = cbvh_testkit::folder();
    let folder = folder.path();
    for package in ["ws/arm", "ws/my hand"] {
        fs::create_dir_all(folder.join(package)).unwrap();
        fs::write(folder.join(package).join("package.xml"), "<package/>").unwrap();
    }
    for (z, mesh) in [
        "my mesh.obj",
        "both names.obj",
        "both%20names.obj",
        "real%20name.obj",
        "Größe.obj",
        "100%.obj",
        "a%zz.obj",
    ]
    .iter()
    .enumerate()
    {
        write_mesh(&folder.join("ws/arm/meshes").join(mesh), z as u32);
    }
    write_mesh(&folder.join("ws/my hand/m.obj"), 7);
    write_mesh(&folder.join("elsewhere/m.obj"), 8);
    let urdf = &folder.join("ws/arm/urdf/r.urdf");
    let whole = folder.join("ws/arm/meshes").display().to_string().replace('\\', "/");
    // Before the letter of a drive there is a slash.
    let whole = format!("/{}", whole.trim_start_matches('/'));
    let named = |name: &str| {
        [
            format!("file://{whole}/{name}"),
            format!("file://localhost{whole}/{name}"),
            format!("FILE://{whole}/{name}"),
            format!("file://../meshes/{name}"),
            format!("package://arm/meshes/{name}"),
            format!("model://arm/meshes/{name}"),
            format!("Package:///arm/meshes/{name}"),
        ]
    };
    for (name, z) in [
        ("my mesh.obj", 0.0),
        ("my%20mesh.obj", 0.0),
        ("%6Dy%20mesh%2eobj", 0.0),
        ("both%20names.obj", 2.0),
        ("both names.obj", 1.0),
        ("real%20name.obj", 3.0),
        ("real%2520name.obj", 3.0),
        ("Größe.obj", 4.0),
        ("Gr%C3%B6%c3%9fe.obj", 4.0),
        ("100%.obj", 5.0),
        ("100%25.obj", 5.0),
        ("a%zz.obj", 6.0),
    ] {
        for uri in named(name) {
            assert_eq!(height(urdf, &uri, &[]).unwrap_or_else(|error| panic!("{uri}: {error}")), z, "{uri}");
        }
    }
    // The name of a package may be encoded too.
    for uri in ["package://my%20hand/m.obj", "package://my hand/m.obj"] {
        assert_eq!(height(urdf, uri, &[]).unwrap(), 7.0, "{uri}");
        assert_eq!(height(urdf, uri, &[&folder.join("ws/my hand")]).unwrap(), 7.0, "{uri}");
    }
    // A path is no URI.
    assert_eq!(height(urdf, "../meshes/real%20name.obj", &[]).unwrap(), 3.0);
    for uri in [
        "../meshes/my%20mesh.obj",
        "file://elsewhere/my%20mesh.obj",
        "package://arm/meshes/%ff.obj",
        "file://%00",
        "package://",
        "file://",
        "%",
    ] {
        let error = height(urdf, uri, &[]).unwrap_err();
        assert!(matches!(error, RobotError::NoMesh { .. }), "{uri}: {error}");
    }
    let told = height(urdf, "file:///nowhere/a%20b.obj", &[]).unwrap_err().to_string();
    // Windows names the drive of the current folder.
    let told = told.replace("C:/nowhere", "/nowhere");
    assert!(told.contains("found none at /nowhere/a%20b.obj, /nowhere/a b.obj"), "{told}");
    // What is encoded leads no further than what is not.
    for uri in [
        "file://%2e%2e/../../elsewhere/m.obj",
        "package://arm%2F..%2F../elsewhere/m.obj",
        "package://%2e%2e%2Felsewhere/m.obj",
        "package://arm/%2e%2e/%2e%2e/elsewhere/m.obj",
        "package://elsewhere/m.obj",
    ] {
        let error = height(urdf, uri, &[]).unwrap_err();
        assert!(matches!(error, RobotError::Outside { .. } | RobotError::NoMesh { .. }), "{uri}: {error}");
    }
}
