//! Compares the table of the book, which says what is read, left out and refused, with what readers do.

use super::collada::{HERE, faces, square};
use super::gltf_model::{Model, PRIMITIVE};
use super::{refusal, refused, try_bytes};
use bvh_bake::Options;
use bvh_bake::input::{MeshFormat, read_bytes_with};
use std::path::Path;

/// Returns the cells of a format's row: its name, what is read, what is left out with a warning, and what is refused.
fn row(format: &str) -> [String; 4] {
    let page = include_str!("../../../../spec/book/src/reference/mesh-files.md");
    let row = page.lines().find(|line| line.starts_with(&format!("| {format} |"))).unwrap();
    let cells: Vec<_> = row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect();
    cells.try_into().unwrap()
}

/// Returns what is quoted in a cell.
fn quoted(cell: &str) -> Vec<String> {
    cell.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// A file may require the extensions that the row lists, and each cell has an example.
#[test]
fn the_row_of_gltf_is_true() {
    let [_, is_read, is_told, is_refused] = &row("glTF");
    let quoted =
        |cell: &str| -> Vec<String> { cell.split('`').skip(1).step_by(2).map(str::to_owned).collect() };
    // Names of extensions that a file may require; an asterisk stands for any ending.
    let mut required = 0;
    for name in quoted(is_read).iter().chain(&quoted(is_told)).filter(|name| name.contains('_')) {
        let mut model = Model::new();
        if name.as_str() == "EXT_mesh_gpu_instancing" {
            model.nodes =
                r#"{"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}"#
                    .into();
        }
        model.fields = format!(r#""extensionsRequired":["{}"],"#, name.replace('*', "anything"));
        assert!(try_bytes(&model.glb(), MeshFormat::Gltf).is_ok(), "{name}");
        required += 1;
    }
    assert!(required > 15, "{required}");
    for name in quoted(is_refused).iter().filter(|name| name.contains('_')) {
        let mut model = Model::new();
        model.fields = format!(r#""extensionsRequired":["{name}"],"#);
        let said = refusal(&model.glb(), MeshFormat::Gltf);
        assert!(said.contains(&format!("found {name}")), "{said}");
    }
    let edited = |edit: &dyn Fn(&mut Model)| {
        let mut model = Model::new();
        edit(&mut model);
        let read = |scene| {
            let options = Options::default().scene(scene);
            read_bytes_with(&model.glb(), MeshFormat::Gltf, Path::new("test"), &options)
        };
        let (flat, scene) = (read(false), read(true));
        assert_eq!(flat.is_ok(), scene.is_ok());
        (flat.map(|mesh| mesh.warnings.len()), scene.map(|mesh| mesh.warnings.len()))
    };
    type Edit = fn(&mut Model);
    let examples: [(&str, &[(&str, Edit)]); 2] = [
        (
            is_told,
            &[
                ("animations", |m| {
                    m.fields = r#""animations":[{"channels":[{"target":{"path":"scale"}}]}],"#.into()
                }),
                ("points and lines", |m| {
                    m.meshes = format!(
                        r#"{{"primitives":[{PRIMITIVE}}},{{"attributes":{{"POSITION":0}},"mode":1}}]}}"#
                    )
                }),
                ("without positions", |m| {
                    m.meshes = format!(r#"{{"primitives":[{PRIMITIVE}}},{{"attributes":{{}}}}]}}"#)
                }),
                ("`MSFT_lod`", |m| {
                    m.nodes = r#"{"mesh":0,"extensions":{"MSFT_lod":{"ids":[1]}}},{"mesh":0}"#.into()
                }),
            ],
        ),
        (
            is_refused,
            &[
                ("version 1", |m| m.fields = r#""x":{"version":"1"},"#.into()),
                ("a skin and instances", |m| {
                    m.fields = r#""skins":[{"joints":[0]}],"#.into();
                    m.nodes = r#"{"mesh":0,"skin":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}}}"#.into();
                }),
                ("without joints", |m| {
                    m.fields = r#""skins":[{"joints":[0]}],"#.into();
                    m.nodes = r#"{"mesh":0,"skin":0}"#.into();
                }),
                ("as many weights as targets", |m| {
                    m.meshes = format!(r#"{{"primitives":[{PRIMITIVE}}}],"weights":[1]}}"#)
                }),
            ],
        ),
    ];
    for (cell, (name, edit)) in
        examples.iter().flat_map(|(cell, examples)| examples.iter().map(move |one| (cell, one)))
    {
        assert!(cell.contains(name), "{name} in {cell}");
        if *name == "version 1" {
            refused(br#"{"asset":{"version":"1.0"}}"#, MeshFormat::Gltf, "version 1.0");
            continue;
        }
        match edited(edit) {
            (Ok(1), Ok(1)) => assert!(*cell == is_told, "{name}"),
            (Err(_), Err(_)) => assert!(*cell == is_refused, "{name}"),
            other => panic!("{name}: {other:?}"),
        }
    }
}

/// Each element that the row of COLLADA quotes has an example.
#[test]
fn the_row_of_collada_is_true() {
    let [_, is_read, is_told, is_refused] = &row("COLLADA");
    let quad = || faces("polygons", "<p>9 0 9 1 9 2 9 3</p>");
    let warnings = |text: &str| {
        try_bytes(text.as_bytes(), MeshFormat::Collada)
            .map(|mesh| mesh.warnings.len())
            .map_err(|error| error.to_string())
    };
    let corners = "9 0 9 1 9 2 9 3";
    for name in quoted(is_read) {
        let holed = format!("<ph><p>{corners}</p><h>9 0 9 1 9 2</h></ph>");
        let node = |transform: &str| format!("<node>{transform}<instance_geometry url=\"#g\"/></node>");
        let text = match name.as_str() {
            "<triangles>" => square(&faces("triangles", "<p>9 0 9 1 9 2</p>"), HERE),
            "<polylist>" => square(&faces("polylist", &format!("<vcount>4</vcount><p>{corners}</p>")), HERE),
            "<polygons>" => square(&faces("polygons", &format!("<p>{corners}</p>{holed}")), HERE),
            "<tristrips>" => square(&faces("tristrips", &format!("<p>{corners}</p>")), HERE),
            "<trifans>" => square(&faces("trifans", &format!("<p>{corners}</p>")), HERE),
            "<lookat>" => square(&quad(), &node("<lookat>5 0 0 0 0 0 0 0 1</lookat>")),
            "<skew>" => square(&quad(), &node("<skew>45 0 1 0 1 0 0</skew>")),
            "<instance_node>" => square(&quad(), &format!("{HERE}<node><instance_node url=\"#n\"/></node>")),
            _ => panic!("no example of {name}"),
        };
        assert_eq!(warnings(&text), Ok(0), "{name}");
    }
    for name in quoted(is_told) {
        let plain = square(&quad(), HERE);
        let text = match name.as_str() {
            "<lines>" => square(&(quad() + &faces("lines", "<p>9 0 9 1</p>")), HERE),
            "<linestrips>" => square(&(quad() + &faces("linestrips", "<p>9 0 9 1</p>")), HERE),
            "<spline>" => {
                let spline = "<geometry id=\"h\"><spline/></geometry></library_geometries>";
                let both = format!("{HERE}<node><instance_geometry url=\"#h\"/></node>");
                square(&quad(), &both).replace("</library_geometries>", spline)
            }
            "<unit>" => plain.replace("meter=\"1\"", "meter=\"2\""),
            "<up_axis>" => plain.replace("Z_UP", "Y_UP"),
            _ => panic!("no example of {name}"),
        };
        assert_eq!(warnings(&text), Ok(1), "{name}");
    }
    assert!(is_told.contains("faces of fewer than three corners"));
    let short = square(&(quad() + &faces("polygons", "<p>9 0 9 1</p>")), HERE);
    assert_eq!(warnings(&short), Ok(1));
    for name in quoted(is_refused) {
        let text = match name.as_str() {
            "<instance_controller>" => square(&quad(), "<node><instance_controller url=\"#c\"/></node>"),
            "<convex_mesh>" => square(&quad(), HERE).replace("mesh>", "convex_mesh>"),
            _ => panic!("no example of {name}"),
        };
        refused(text.as_bytes(), MeshFormat::Collada, &format!("found {name}"));
    }
    assert!(is_refused.contains("references to other files"));
    let elsewhere = square(&quad(), HERE).replace("url=\"#g\"", "url=\"b.dae#g\"");
    refused(elsewhere.as_bytes(), MeshFormat::Collada, "other files are not read");
}
