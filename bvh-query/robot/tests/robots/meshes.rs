//! Meshes of COLLADA files: their unit counts, and the axis that they declare to point up only if that is asked for.

use cbvh_robot::{Robot, RobotError, RobotOptions, UpAxis};
use std::fs;

/// Reads a robot of one link, whose mesh is a triangle of a COLLADA file in centimetres with y up, with an obstacle at a point.
fn read(nodes: &str, options: RobotOptions, point: [f64; 3]) -> Result<Robot, RobotError> {
    let folder = cbvh_testkit::folder();
    let [x, y, z] = point;
    fs::write(
        folder.path().join("a.dae"),
        format!(
            "<COLLADA><asset><unit meter=\"0.01\"/><up_axis>Y_UP</up_axis></asset><library_geometries><geometry id=\"g\"><mesh><source id=\"s\">\
             <float_array id=\"a\">100 0 200 300 0 200 100 100 200</float_array><technique_common><accessor source=\"#a\"/></technique_common>\
             </source><vertices id=\"v\"><input semantic=\"POSITION\" source=\"#s\"/></vertices><triangles><input semantic=\"VERTEX\" \
             source=\"#v\"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene>\n\
             {nodes}</visual_scene></library_visual_scenes></COLLADA>"
        ),
    )
    .unwrap();
    let text = format!(
        "<robot name=\"r\"><link name=\"base\"><collision><geometry><mesh filename=\"a.dae\"/></geometry></collision></link>\
         <link name=\"ball\"><collision><geometry><sphere radius=\"0.001\"/></geometry></collision></link>\
         <joint name=\"j\" type=\"prismatic\"><parent link=\"base\"/><child link=\"ball\"/><origin xyz=\"{x} {y} {z}\"/></joint></robot>"
    );
    let path = folder.path().join("robot.urdf");
    fs::write(&path, text).unwrap();
    Robot::from_urdf(path, &options)
}

const HERE: &str = "<node><instance_geometry url=\"#g\"/></node>";

#[test]
fn the_axis_counts_only_if_it_is_applied() {
    let turned = || RobotOptions::default().up_axis(UpAxis::Turned);
    let folder = cbvh_testkit::folder();
    let cached = |options: RobotOptions| options.cache(folder.path().to_owned());
    for _ in 0..2 {
        for (options, point, touches) in [
            (RobotOptions::default(), [1.1, 0.1, 2.0], true),
            (RobotOptions::default(), [1.1, -2.0, 0.1], false),
            (turned(), [1.1, 0.1, 2.0], false),
            (turned(), [1.1, -2.0, 0.1], true),
        ] {
            let mut robot = read(HERE, cached(options), point).unwrap();
            assert_eq!(robot.collide(&[0.0]).unwrap(), touches, "{point:?}");
        }
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "the mesh in both ways");
}

#[test]
fn what_is_refused_is_told_with_the_file_and_its_line() {
    let nodes = "<node><instance_controller url=\"#c\"/></node>";
    let said = read(nodes, RobotOptions::default(), [0.0; 3]).map(drop).unwrap_err().to_string();
    assert!(
        said.contains("link base")
            && said.contains(
                "a.dae: line 2: expected an element that this reader knows, found <instance_controller>"
            ),
        "{said}"
    );
}
