//! Reads COLLADA: primitives, sources, transforms, units, encodings, scenes, and what is refused.

use super::{one_line, only, refusal, refused, try_bytes};
use bvh_bake::input::{MeshFormat, ReadError, UpAxis, read, read_scene, read_with};
use bvh_bake::mesh::Mesh;
use std::fs;
use std::path::{Path, PathBuf};

/// Returns a file of the unit square, whose corners are the vertices of the input `VERTEX` at offset 1, with these faces and nodes.
pub(crate) fn square(faces: &str, nodes: &str) -> String {
    format!(
        "<COLLADA version=\"1.4.1\"><asset><unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset><library_geometries><geometry id=\"g\" name=\"square\">\
         <mesh><source id=\"s\"><float_array id=\"a\" count=\"12\">0 0 0 1 0 0 1 1 0 0 1 0</float_array><technique_common>\
         <accessor source=\"#a\" count=\"4\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>\
         <param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"v\"><input semantic=\"POSITION\" \
         source=\"#s\"/></vertices>{faces}</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id=\"w\">\
         {nodes}</visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#w\"/></scene></COLLADA>"
    )
}

const INPUTS: &str = "<input semantic=\"VERTEX\" source=\"#v\" offset=\"1\"/><input semantic=\"NORMAL\" source=\"#n\" offset=\"0\"/>";
pub(crate) const HERE: &str = "<node id=\"n\"><instance_geometry url=\"#g\"/></node>";

/// Returns faces whose vertices are at every second number.
pub(crate) fn faces(kind: &str, content: &str) -> String {
    format!("<{kind}>{INPUTS}{content}</{kind}>")
}

fn quad() -> String {
    faces("polylist", "<vcount>4</vcount><p>9 0 9 1 9 2 9 3</p>")
}

fn dae(text: &str) -> Result<Mesh, ReadError> {
    try_bytes(text.as_bytes(), MeshFormat::Collada)
}

fn area(mesh: &Mesh) -> f64 {
    let of = |[a, b, c]: [[f64; 3]; 3]| {
        let edge = |to: [f64; 3]| [0, 1, 2].map(|axis: usize| to[axis] - a[axis]);
        let ([ux, uy, uz], [vx, vy, vz]) = (edge(b), edge(c));
        let normal = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
        normal.iter().map(|part| part * part).sum::<f64>().sqrt() / 2.0
    };
    let triangles = |object: &bvh_bake::mesh::Object| {
        object
            .triangles
            .iter()
            .map(|corners| of(corners.map(|corner| object.positions[corner as usize])))
            .sum::<f64>()
    };
    mesh.objects.iter().map(triangles).sum()
}

fn bounds(mesh: &Mesh) -> [[f64; 3]; 2] {
    let all = || mesh.objects.iter().flat_map(|object| &object.positions);
    let end = |pick: fn(f64, f64) -> f64| {
        [0, 1, 2].map(|axis| all().map(|position| position[axis]).reduce(pick).unwrap())
    };
    [end(f64::min), end(f64::max)]
}

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/collada").join(name)
}

#[test]
fn files_are_read_or_refused_as_expected() {
    for (name, triangles, expected) in [
        ("concave.dae", 4, 3.0),
        ("hole.dae", 8, 12.0),
        ("hole-and-lid.dae", 10, 16.0),
        ("latin1.dae", 4, 9.464_101_615_137_754),
        ("bad-byte.dae", 4, 9.464_101_615_137_754),
        ("doctype.dae", 4, 9.464_101_615_137_754),
        ("lookat.dae", 4, 9.464_101_615_137_754),
        ("column-unnamed.dae", 4, 9.464_101_615_137_754),
        ("columns-xzy.dae", 4, 9.464_101_615_137_754),
        ("equal-ids.dae", 4, 101.0),
        ("id-of-node.dae", 2, 1.0),
        ("centimetres.dae", 4, 9.464_101_615_137_754e-4),
    ] {
        let mesh = read(&file(name)).unwrap();
        assert_eq!(mesh.triangle_count(), triangles, "{name}");
        assert!((area(&mesh) - expected).abs() < 1e-12 * expected, "{name}: {}", area(&mesh));
    }
    assert_eq!(bounds(&read(&file("centimetres.dae")).unwrap()), [[0.0; 3], [0.02; 3]]);
    assert_eq!(bounds(&read(&file("lookat.dae")).unwrap()), [[0.0, 0.0, 5.0], [2.0, 2.0, 7.0]]);
    let columns = read(&file("columns-xzy.dae")).unwrap();
    assert_eq!(only(&columns).positions[1..3], [[0.0, 0.0, 2.0], [2.0, 0.0, 0.0]]);
    assert_eq!(only(&read(&file("latin1.dae")).unwrap()).name, "Gr\u{f6}\u{df}e");
    for (name, expected) in [
        ("controller.dae", "line 5: expected an element that this reader knows, found <instance_controller>"),
        ("convex-mesh.dae", "line 5: expected an element that this reader knows, found <convex_mesh>"),
        ("short-list.dae", "line 4: expected a multiple of 2 numbers, which each corner has, found 1 more"),
    ] {
        let said = one_line(&read(&file(name)).unwrap_err());
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn each_primitive_is_the_same_square() {
    let all = "9 0 9 1 9 2 9 3";
    for (kind, content, expected) in [
        ("triangles", "<p>9 0 9 1 9 2 9 0 9 2 9 3</p>".to_owned(), [[0, 1, 2], [0, 2, 3]]),
        ("polylist", format!("<vcount>4</vcount><p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
        ("polylist", format!("<vcount>2 0 4</vcount><p>9 1 9 0 {all}</p>"), [[0, 1, 2], [0, 2, 3]]),
        ("polygons", format!("<p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
        ("polygons", format!("<p>9 3</p><p/><ph><p>{all}</p></ph>"), [[0, 1, 2], [0, 2, 3]]),
        ("trifans", format!("<p>{all}</p>"), [[0, 1, 2], [0, 2, 3]]),
        ("tristrips", "<p>9 0 9 1 9 3 9 2</p><p>9 2</p>".to_owned(), [[0, 1, 2], [2, 1, 3]]),
        // The triangles without area that join the parts of a strip are left out.
        ("tristrips", "<p>9 0 9 1 9 3 9 3 9 1 9 1 9 2 9 3</p>".to_owned(), [[0, 1, 2], [2, 1, 3]]),
    ] {
        let mesh =
            dae(&square(&faces(kind, &content), HERE)).unwrap_or_else(|error| panic!("{content}: {error}"));
        assert_eq!((only(&mesh).name.as_str(), area(&mesh)), ("n", 1.0), "{kind}");
        if content.contains("9 3 9 3") {
            continue;
        }
        assert_eq!(only(&mesh).triangles, expected, "{kind} {content}");
    }
    let nothing = "<lines count=\"1\"><input semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1</p></lines><triangles count=\"0\"/>";
    assert_eq!(dae(&square(&(quad() + nothing), HERE)).unwrap().triangle_count(), 2);
    refused(
        square(nothing, HERE).as_bytes(),
        MeshFormat::Collada,
        "expected at least one triangle, found none",
    );
}

#[test]
fn nodes_place_what_is_in_them() {
    let place = |node: &str| {
        let mesh = dae(&square(&quad(), node)).unwrap();
        let object = mesh.objects.last().unwrap();
        (object.positions[1], object.triangles[1])
    };
    let instance = "<instance_geometry url=\"#g\"/>";
    for (node, expected) in [
        (HERE.to_owned(), ([1.0, 0.0, 0.0], [0, 2, 3])),
        (
            format!("<node><translate>1 0 0</translate><rotate>0 0 2 90</rotate>{instance}</node>"),
            ([1.0, 1.0, 0.0], [0, 2, 3]),
        ),
        (
            format!("<node><rotate>0 0 2 90</rotate><translate>1 0 0</translate>{instance}</node>"),
            ([0.0, 2.0, 0.0], [0, 2, 3]),
        ),
        // Transforms count wherever they stand among the rest of a node.
        (format!("<node>{instance}<translate>1 0 0</translate></node>"), ([2.0, 0.0, 0.0], [0, 2, 3])),
        (
            format!("<node><scale>2 2 2</scale><node><translate>1 0 0</translate>{instance}</node></node>"),
            ([4.0, 0.0, 0.0], [0, 2, 3]),
        ),
        (
            format!("<node><matrix>0 -1 0 5 1 0 0 0 0 0 1 0 0 0 0 1</matrix>{instance}</node>"),
            ([5.0, 1.0, 0.0], [0, 2, 3]),
        ),
        (
            format!(
                "<node id=\"a\"><translate>0 0 1</translate>{instance}</node><node><translate>1 0 0</translate><instance_node url=\"#a\"/></node>"
            ),
            ([2.0, 0.0, 1.0], [0, 2, 3]),
        ),
    ] {
        assert_eq!(place(&node), expected, "{node}");
    }
    // A mirror turns faces around, so that they keep their outside.
    let mesh = dae(&square(&quad(), &format!("<node><scale>-2 1 1</scale>{instance}</node>"))).unwrap();
    assert_eq!((only(&mesh).positions[1], only(&mesh).triangles[0]), ([0.0, 1.0, 0.0], [0, 1, 2]));
    let mesh = dae(&square(
        &faces("triangles", "<p>9 0 9 1 9 2</p>"),
        &format!("<node><scale>-2 1 1</scale>{instance}</node>"),
    ));
    assert_eq!(only(&mesh.unwrap()).positions, [[0.0, 0.0, 0.0], [-2.0, 1.0, 0.0], [-2.0, 0.0, 0.0]]);
}

#[test]
fn units_and_axes_are_applied() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("a.dae");
    let whole = "<asset><unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset>";
    let place = |asset: &str, up_axis| {
        let nodes = "<node><translate>1 2 3</translate><instance_geometry url=\"#g\"/></node>";
        fs::write(&path, square(&quad(), nodes).replace(whole, asset)).unwrap();
        read_with(&path, up_axis, false).map(|mesh| only(&mesh).positions[0])
    };
    for (asset, turned, kept) in [
        (whole, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
        ("<asset><up_axis> Y_UP\n</up_axis></asset>", [1.0, -3.0, 2.0], [1.0, 2.0, 3.0]),
        ("<asset><unit name=\"inch\"/></asset>", [1.0, -3.0, 2.0], [1.0, 2.0, 3.0]),
        ("", [1.0, -3.0, 2.0], [1.0, 2.0, 3.0]),
        ("<asset><up_axis>X_UP</up_axis></asset>", [-2.0, -3.0, 1.0], [1.0, 2.0, 3.0]),
        ("<asset><unit meter=\"0.5\"/><up_axis>Y_UP</up_axis></asset>", [0.5, -1.5, 1.0], [0.5, 1.0, 1.5]),
    ] {
        assert_eq!(place(asset, UpAxis::Turned).unwrap(), turned, "{asset}");
        assert_eq!(place(asset, UpAxis::Kept).unwrap(), kept, "{asset}");
    }
    for (asset, expected) in [
        (
            "<asset><unit meter=\"0\"/></asset>",
            "expected a unit of a finite number of metres above 0, found meter=\"0\"",
        ),
        ("<asset><unit meter=\"0,01\"/></asset>", "found meter=\"0,01\""),
        ("<asset><unit meter=\"inf\"/></asset>", "found meter=\"inf\""),
        ("<asset><up_axis>W_UP</up_axis></asset>", "expected X_UP, Y_UP or Z_UP, found W_UP"),
        ("<asset><unit meter=\"1\"/><unit meter=\"2\"/></asset>", "expected one <unit>, found another one"),
    ] {
        let said = one_line(&place(asset, UpAxis::Kept).unwrap_err());
        assert!(said.contains(expected), "{said}");
    }
    let part = "<geometry id=\"g\" name=\"square\"><asset><unit meter=\"2\"/></asset>";
    let text = square(&quad(), HERE).replace("<geometry id=\"g\" name=\"square\">", part);
    refused(
        text.as_bytes(),
        MeshFormat::Collada,
        "expected the unit and the axis of the whole file, 1.0 metres and Z_UP",
    );
}

#[test]
fn scenes_are_found_as_the_file_names_them() {
    let with = |from: &str, to: &str| {
        let text = square(&quad(), HERE);
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    };
    let named = "<scene><instance_visual_scene url=\"#w\"/></scene>";
    assert_eq!(dae(&with(named, "")).unwrap().triangle_count(), 2);
    assert_eq!(dae(&with(named, "<scene/>")).unwrap().triangle_count(), 2);
    let two = "<library_visual_scenes><visual_scene id=\"x\"/>";
    assert_eq!(dae(&with("<library_visual_scenes>", two)).unwrap().triangle_count(), 2);
    let text = with("<library_visual_scenes>", two).replace(named, "");
    refused(
        text.as_bytes(),
        MeshFormat::Collada,
        "expected one <visual_scene>, or a <scene> that names one of them",
    );
    // Without a scene, each geometry is where it stands.
    let text = with(named, "");
    let (start, end) = (text.find("<library_visual_scenes>").unwrap(), text.find("</COLLADA>").unwrap());
    let mesh = dae(&(text[..start].to_owned() + &text[end..])).unwrap();
    assert_eq!((only(&mesh).name.as_str(), mesh.triangle_count()), ("square", 2));
}

#[test]
fn ids_are_looked_up_where_they_are_needed() {
    let text = square(&quad(), HERE);
    // An id of another kind hides nothing.
    for other in [
        "<library_materials><material id=\"g\"/></library_materials>",
        "<library_nodes><node id=\"g\"/></library_nodes>",
    ] {
        assert_eq!(dae(&text.replace("<scene>", &format!("{other}<scene>"))).unwrap().triangle_count(), 2);
    }
    // One that stands twice is an error where it is needed.
    let again =
        |element: &str| text.replace("<library_geometries>", &format!("<library_geometries>{element}"));
    assert_eq!(dae(&again("<geometry id=\"h\"/><geometry id=\"h\"/>")).unwrap().triangle_count(), 2);
    for (text, expected) in [
        (
            again("<geometry id=\"g\"/>"),
            "expected one <geometry> with the id that url=\"#g\" in <instance_geometry> needs",
        ),
        (
            text.replace("<vertices", "<source id=\"s\"/><vertices"),
            "expected one <source> of this mesh with the id",
        ),
        (
            text.replace("</vertices>", "</vertices><vertices id=\"v\"/>"),
            "expected one <vertices> of this mesh with the id",
        ),
        (
            text.replace("<visual_scene", "<visual_scene id=\"w\"/><visual_scene"),
            "expected one <visual_scene> with the id",
        ),
        (
            text.replace("url=\"#g\"", "url=\"#h\""),
            "expected the id of a <geometry>, found url=\"#h\" in <instance_geometry>",
        ),
        (text.replace("url=\"#g\"", "url=\"b.dae#g\""), "(other files are not read), found url=\"b.dae#g\""),
        (text.replace("url=\"#w\"", "url=\"b.dae#w\""), "(other files are not read), found url=\"b.dae#w\""),
        (
            text.replace("source=\"#v\"", "source=\"#s\""),
            "expected the id of a <vertices> of this mesh, found source=\"#s\"",
        ),
        (
            text.replace("source=\"#s\"", "source=\"#t\""),
            "expected the id of a <source> of this mesh, found source=\"#t\"",
        ),
        (
            text.replace("source=\"#a\"", "source=\"b.bin\""),
            "expected the id of the <float_array> in this <source>, as #id, found source=\"b.bin\"",
        ),
    ] {
        refused(text.as_bytes(), MeshFormat::Collada, expected);
    }
}

#[test]
fn columns_and_counts_must_fit() {
    let text = square(&quad(), HERE);
    let (x, z) = ("<param name=\"X\" type=\"float\"/>", "<param name=\"Z\" type=\"float\"/>");
    for (from, to) in [
        (x, "<param name=\"x\" type=\"double\"/>"),
        (" stride=\"3\"", ""),
        (" count=\"12\"", ""),
        (" count=\"4\"", ""),
        ("1 0</float_array>", "1 0 nan</float_array>"),
        ("<float_array", "<extra><float_array/></extra><float_array"),
    ] {
        let text = if to.contains("nan") { text.replace(" count=\"12\"", "") } else { text.clone() };
        assert!(text.contains(from), "{from}");
        assert_eq!(area(&dae(&text.replace(from, to)).unwrap()), 1.0, "{to}");
    }
    for (from, to, expected) in [
        (
            "count=\"12\"",
            "count=\"13\"",
            "expected as many numbers in <float_array> as its count, 13, found 12",
        ),
        (
            "count=\"4\"",
            "count=\"5\"",
            "expected 5 vertices in <source>, which is the count of its <accessor>, found 4",
        ),
        ("count=\"4\"", "count=\"18446744073709551615\"", "which is the count of its <accessor>, found 4"),
        ("count=\"4\"", "count=\"-1\"", "expected a whole number, found count=\"-1\""),
        ("stride=\"3\"", "stride=\"2\"", "expected a stride of at least 3, found 2"),
        ("stride=\"3\"", "stride=\"18446744073709551615\"", "expected 4 vertices"),
        ("stride=\"3\"", "stride=\"3\" offset=\"1\"", "expected 4 vertices"),
        (x, "<param type=\"float\"/>", "expected each <param> of positions named: X, Y and Z, found ? Y Z"),
        (x, z, "expected one <param> named Z, found another one"),
        (x, "<param name=\"X\" type=\"float4x4\"/>", "expected a <param> of the type float, found float4x4"),
        ("1 0</float_array>", "1 0,5</float_array>", "expected a number, found 0,5"),
        ("1 0</float_array>", "1 <!-- a -->&#48;</float_array>", "expected a number, found &#48;"),
        (
            "float_array",
            "int_array",
            "expected a <float_array> in the <source> of positions, found <int_array>",
        ),
        ("accessor", "access", "expected an <accessor> in <technique_common>, found <access>"),
        ("\"VERTEX\"", "\"POSITION\"", "expected an input VERTEX in <polylist>, found none"),
        ("\"NORMAL\"", "\"VERTEX\"", "expected one input VERTEX, found another one"),
        ("\"POSITION\"", "\"TEXCOORD\"", "expected an input POSITION in <vertices>, found none"),
        ("offset=\"0\"", "offset=\"1024\"", "expected an offset below 1024, found 1024"),
        ("offset=\"0\"", "offset=\"3\"", "expected 4 more corners in <p>"),
        ("9 3</p>", "9 4</p>", "expected a vertex number below 4, found 4"),
        ("9 3</p>", "9 -1</p>", "expected a vertex number below 4, found -1"),
        ("9 3</p>", "9 3 9</p>", "expected a multiple of 2 numbers, which each corner has, found 1 more"),
        ("9 3</p>", "9 3 9 0</p>", "expected as many corners in <p> as <vcount> counts, found more"),
        ("<vcount>4", "<vcount>4 4", "expected 4 more corners in <p>"),
        ("<vcount>4", "<vcount>x", "expected a number of corners, found x"),
        (
            "<polylist>",
            "<polylist count=\"2\">",
            "expected as many faces or lists in <polylist> as its count, 2, found 1",
        ),
        ("<vcount>", "<vcounts/><vcount>", "expected an element that this reader knows, found <vcounts>"),
        ("<vertices", "<patches/><vertices", "expected an element that this reader knows, found <patches>"),
    ] {
        let text = text.replacen(from, to, if from.contains('_') { 9 } else { 1 });
        let text = if from.starts_with("acc") { text.replace("</accessor>", "</access>") } else { text };
        let said = match dae(&text) {
            Ok(mesh) => panic!("{from} {to}: {} triangles", mesh.triangle_count()),
            Err(error) => one_line(&error),
        };
        assert!(said.contains(expected) && said.starts_with("test: line 1: "), "{said}, not {expected}");
    }
    let triangles = square(&faces("triangles", "<p>9 0 9 1 9 2 9 3</p>"), HERE);
    refused(
        triangles.as_bytes(),
        MeshFormat::Collada,
        "expected a multiple of three corners in a list of triangles, found one more corner",
    );
    let far = square(&quad(), HERE).replace(">0 0 0 ", ">0 1e37 0 ");
    refused(
        far.as_bytes(),
        MeshFormat::Collada,
        "2^120 in magnitude, found 1e37 in vertex 0 of object \"n\"",
    );
}

#[test]
fn nodes_and_polygons_have_limits() {
    let itself = "<node id=\"n\"><node id=\"m\"><instance_node url=\"#n\"/></node></node>";
    refused(
        square(&quad(), itself).as_bytes(),
        MeshFormat::Collada,
        "expected nodes that form trees, found a node in itself",
    );
    let twice = |number: usize| {
        let next = format!("<instance_node url=\"#n{}\"/>", number + 1);
        format!("<node id=\"n{number}\">{next}{next}</node>")
    };
    let again: String =
        (0..40).map(twice).collect::<String>() + "<node id=\"n40\"><instance_geometry url=\"#g\"/></node>";
    // What has no triangles takes time, too.
    let idle = format!(
        "{}<node id=\"n40\">{}</node>",
        (0..40).map(twice).collect::<String>(),
        "<asset/>".repeat(100_000)
    );
    let many = (0..70_000).map(|number| if number % 2 == 0 { "9 0 " } else { "9 1 " }).collect::<String>();
    for (faces, nodes, expected) in [
        (quad(), again.as_str(), "bytes of geometries"),
        (quad(), idle.as_str(), "bytes of geometries"),
        (faces("polylist", "<vcount>70000</vcount><p/>"), HERE, "expected at most 65536 vertices in a face"),
        (faces("polygons", &format!("<p>{many}</p>")), HERE, "expected at most 65536 vertices in a face"),
        (
            faces("polygons", &format!("<ph><p>9 0 9 1 9 2</p><h>{}</h></ph>", &many[..6000])),
            HERE,
            "expected at most 1024 corners of a face with holes",
        ),
    ] {
        let error = dae(&square(&faces, nodes)).unwrap_err();
        assert!(error.is_limit() && one_line(&error).contains(expected), "{error}");
    }
    // Nodes may be as deep as the file has room for.
    let deep = "<node>".repeat(100_000) + HERE + &"</node>".repeat(100_000);
    assert_eq!(dae(&square(&quad(), &deep)).unwrap().triangle_count(), 2);
}

#[test]
fn files_are_known_by_their_content() {
    let text = square(&quad(), HERE);
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for bytes in [text.as_bytes(), format!("\n<?xml version=\"1.0\"?>\n{text}").as_bytes(), &utf16] {
        assert_eq!(MeshFormat::from_content(bytes), Some(MeshFormat::Collada));
        assert_eq!(try_bytes(bytes, MeshFormat::Collada).unwrap().triangle_count(), 2);
    }
    for other in ["<robot/>", "v 0 0 0\n# <COLLADA", "solid <COLLADA"] {
        assert_ne!(MeshFormat::from_content(other.as_bytes()), Some(MeshFormat::Collada));
    }
    assert_eq!(MeshFormat::from_extension(Path::new("a.DAE")), Some(MeshFormat::Collada));
    assert!(
        refusal(b"<robot/>", MeshFormat::Collada).contains("expected the element <COLLADA>, found <robot>")
    );
}

#[test]
fn nodes_share_their_geometries() {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("scene.dae");
    let instance = "<instance_geometry url=\"#g\"/>";
    let nodes = format!(
        "<node name=\"left\"><translate>1 2 3</translate>{instance}</node><node name=\"left\"><rotate>0 0 1 90</rotate>{instance}</node>\
         <node name=\"big\"><scale>2 2 2</scale>{instance}<node><rotate>1 2 3 77</rotate>{instance}</node></node>\
         <node id=\"mirrored\"><scale>-1 1 1</scale>{instance}</node>\
         <node name=\"matrix\"><matrix>0 -2 0 7 2 0 0 8 0 0 2 9 0 0 0 1</matrix>{instance}</node>\
         <node name=\"skewed\"><skew>45 0 1 0 1 0 0</skew>{instance}</node>"
    );
    fs::write(&path, square(&quad(), &nodes).replace("Z_UP", "Y_UP").replace("meter=\"1\"", "meter=\"0.5\""))
        .unwrap();
    let (whole, scene) = (read(&path).unwrap(), read_scene(&path).unwrap());
    let all = scene.instances.iter().map(|instance| (instance.name.as_str(), instance.object));
    let expected = [
        ("left", 0),
        ("left.2", 0),
        ("big", 1),
        ("square", 1),
        ("mirrored", 2),
        ("matrix", 1),
        ("skewed", 3),
    ];
    assert_eq!(all.collect::<Vec<_>>(), expected);
    assert_eq!(scene.objects.len(), 4);
    assert!(scene.objects.iter().all(|object| object.name == "square"));
    assert_eq!(scene.instances[0].translation, [0.5, -1.5, 1.0]);
    // Instances stand where the same file read as a mesh has its triangles.
    for (instance, object) in scene.instances.iter().zip(&whole.objects) {
        let own = &scene.objects[instance.object as usize];
        assert_eq!(own.triangles, object.triangles);
        for (position, expected) in own.positions.iter().zip(&object.positions) {
            for row in 0..3 {
                let turned = (0..3).map(|axis| instance.rotation[row][axis] * position[axis]).sum::<f64>();
                assert!(
                    (turned + instance.translation[row] - expected[row]).abs() < 1e-12,
                    "{}",
                    instance.name
                );
            }
        }
    }
}
