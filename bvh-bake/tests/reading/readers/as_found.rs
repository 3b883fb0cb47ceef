//! Reads files as other programs write them, and as people have them: with what no specification allows, or with no mesh in them.

use super::{CORNERS, TWO, binary_stl, obj, only, ply, refusal, refused, try_bytes};
use bvh_bake::input::{MeshFormat, read, read_bytes_with};
use bvh_bake::mesh::Mesh;
use bvh_bake::{BakeReport, FileBake, Options, Outcome, VerifyOptions, verify_files};
use std::path::Path;

/// For each file in `testdata/as-found`, the number of triangles or points, or parts of the error message.
const AS_FOUND: &[(&str, Result<u64, &[&str]>)] = &[
    ("ascii-extra-blank-lines.pcd", Ok(2)),
    ("ascii-nan.pcd", Err(&["line 13: expected a finite coordinate", "found NaN; --drop-nan"])),
    ("bom.gltf", Ok(4)),
    ("bom.stl", Ok(4)),
    ("count-line.xyz", Ok(3)),
    ("ctrl-z.stl", Ok(4)),
    ("decimal-commas.xyz", Err(&["line 1: expected a point: three numbers", "not commas"])),
    ("empty-slashes.obj", Ok(4)),
    ("end-solid.stl", Ok(4)),
    ("fortran-exponent.obj", Err(&["line 1: expected three numbers after v, found 0.0D+00"])),
    ("gbk-name.stl", Ok(4)),
    ("gltf-1.gltf", Err(&["asset.version 2.0, found glTF of version 1.0"])),
    ("gz.ply", Err(&["byte 0: expected PLY, found a file packed by gzip; unpack it first"])),
    ("header.xyz", Ok(2)),
    ("html.stl", Err(&["expected STL, found an HTML page; download the file itself"])),
    (
        "index-minus-one.gltf",
        Err(&["line 1: ", "integer `-1`, expected a whole number from 0 at line 1 column 182"]),
    ),
    ("int64.ply", Ok(4)),
    ("leading-blank.stl", Ok(4)),
    ("line-face.ply", Ok(4)),
    ("min-version.gltf", Err(&["asset.minVersion of at most 2.0", "found 2.1 in asset.minVersion"])),
    ("morph-weight-1.gltf", Ok(4)),
    ("nan-ind.obj", Ok(4)),
    ("node-twice.gltf", Err(&["nodes that form trees", "found node 2 twice"])),
    ("organized-nan.pcd", Err(&["byte ", "expected a finite coordinate", "found NaN; --drop-nan"])),
    ("padding-fields.pcd", Ok(2)),
    ("pdf-first.stl", Err(&["expected STL, found a PDF document"])),
    ("range-grid.ply", Ok(4)),
    ("required-animation-pointer.gltf", Ok(4)),
    (
        "required-gpu-instancing.gltf",
        Err(&["expected a node with EXT_mesh_gpu_instancing, which the file requires, found none"]),
    ),
    ("required-structural-metadata.gltf", Ok(4)),
    ("required-xmp.gltf", Ok(4)),
    ("short-last-stride.gltf", Ok(4)),
    ("skinned.gltf", Ok(4)),
    ("slash-after-vt.obj", Ok(4)),
    ("stride-0.gltf", Ok(4)),
    ("three-digit-exponents.stl", Ok(4)),
    ("tristrips.ply", Ok(4)),
    ("unaligned-chunk.glb", Ok(4)),
    (
        "undeclared-colours-faces.ply",
        Err(&["line 10: expected a row of element vertex with", "more, from 0 on"]),
    ),
    ("undeclared-colours.ply", Err(&["line 8: expected a row of element vertex with", "more, from 0 on"])),
    ("used-gpu-instancing.gltf", Ok(12)),
    ("uv-stride-2.gltf", Ok(4)),
    ("v-1qnan-unused.obj", Ok(4)),
    ("vertex-glued-minus.obj", Err(&["line 2: expected three numbers after v, found 2.0-0.0-0.0"])),
];

#[test]
fn files_are_read_or_refused_as_expected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata/as-found");
    for (name, expected) in AS_FOUND {
        match (read(&folder.join(name)), expected) {
            (Ok(mesh), Ok(triangles)) => assert_eq!(mesh.triangle_count(), *triangles, "{name}"),
            (Err(error), Err(parts)) => {
                let said = super::one_line(&error);
                assert!(parts.iter().all(|part| said.contains(part)), "{said}");
            }
            (found, _) => panic!("{name}: {:?}", found.map(|mesh| mesh.triangle_count())),
        }
    }
}

/// Reads a file that must be accepted, and returns its warnings without the file's name.
#[track_caller]
fn warned(bytes: &[u8], format: MeshFormat) -> (Mesh, Vec<String>) {
    let mesh = try_bytes(bytes, format).unwrap();
    let warnings = mesh.warnings.iter().map(|told| told.strip_prefix("test: ").unwrap().to_owned()).collect();
    (mesh, warnings)
}

#[test]
fn files_that_hold_something_else_are_refused_by_name() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n";
    let xml = "<?xml version=\"1.0\"?>\n<";
    let [text, mesh] = [format!("{CORNERS}f 1 2 3"), ply("ascii").iter().map(|&b| char::from(b)).collect()];
    let pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\n";
    let solid = "solid\nfacet normal 0 0 1\nouter loop\n";
    for format in [
        MeshFormat::Obj,
        MeshFormat::Stl,
        MeshFormat::Ply,
        MeshFormat::Xyz,
        MeshFormat::Pcd,
        MeshFormat::Gltf,
    ] {
        let name = format.name();
        for (bytes, found) in [
            (pointer.as_bytes(), "a pointer of Git LFS; run \"git lfs pull\" to get the file itself"),
            (b"\xef\xbb\xbf\n <!doctype HTML>\n", "an HTML page; download the file itself"),
            (b"%PDF-1.7 v 0 0 0\n", "a PDF document; "),
            (b"\x1f\x8b\x08\0\0", "a file packed by gzip; unpack it first"),
            (b"PK\x03\x04", "a zip archive; unpack it first"),
            (b"\xff\xfev\0 \x000\0", "text in UTF-16; save it as UTF-8"),
            (format!("{xml}COLLADA>").as_bytes(), "COLLADA; give the name of the file the ending .dae"),
            (format!("{xml}x3d>").as_bytes(), "an XML document; "),
        ] {
            let said = refusal(bytes, format);
            assert!(said.contains(&format!("test: byte 0: expected {name}, found {found}")), "{said}");
        }
        for (bytes, other, found) in [
            (&text, MeshFormat::Obj, "OBJ; give the name of the file the ending .obj"),
            (&mesh, MeshFormat::Ply, "PLY; give the name of the file the ending .ply"),
            (&pcd.to_owned(), MeshFormat::Pcd, "PCD; give the name of the file the ending .pcd"),
            (&solid.to_owned(), MeshFormat::Stl, "STL; give the name of the file the ending .stl"),
            (
                &" {\"asset\": 0}".to_owned(),
                MeshFormat::Gltf,
                "JSON, perhaps of glTF; give the name of a glTF file",
            ),
        ] {
            if other != format {
                refused(bytes.as_bytes(), format, &format!("test: byte 0: expected {name}, found {found}"));
            }
        }
    }
    // A name of no format, too.
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("rock.stl.gz");
    std::fs::write(&path, b"\x1f\x8b\x08\0\0").unwrap();
    let said = read(&path).unwrap_err().to_string();
    assert!(
        said.contains("byte 0: expected a mesh in a file named .obj, ") && said.contains("gzip; unpack"),
        "{said}"
    );
    // Comments, and the header of a binary STL, may say anything.
    assert_eq!(obj(&format!("# .PCD\n{text}")).triangle_count(), 1);
    assert_eq!(try_bytes(b"# .PCD\n0 0 0\n", MeshFormat::Xyz).unwrap().triangle_count(), 1);
    for header in ["%PDF-1.7", "{", "<html>", "PK\x03\x04"] {
        assert_eq!(
            try_bytes(&binary_stl(header.as_bytes(), 2, &TWO), MeshFormat::Stl).unwrap().triangle_count(),
            2
        );
    }
}

#[test]
fn stl_text_may_end_in_other_ways() {
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nEND Loop\nend facet\n";
    let solid = format!("solid a\n{facet}end solid a\n");
    for (rest, expected) in [
        ("\0\0\0\0", &[][..]),
        ("\x1a\0\0", &[]),
        ("\x1a", &[]),
        ("exported by hand\n", &["line 10: left out the text after the last solid"]),
        ("solid b\nendsolid\nmore\n\0", &["line 12: left out the text after the last solid"]),
    ] {
        let (mesh, told) = warned(format!("{solid}{rest}").as_bytes(), MeshFormat::Stl);
        assert_eq!((mesh.triangle_count(), &told[..]), (1, &expected.map_to_strings()[..]), "{rest:?}");
    }
    let long = format!("{solid}{}", "\0".repeat(5000));
    assert_eq!(warned(long.as_bytes(), MeshFormat::Stl).1, [""; 0]);
    refused(
        format!("{solid}soild b\n{facet}").as_bytes(),
        MeshFormat::Stl,
        "line 10: expected solid, found soild",
    );
    refused(
        solid.replace("end solid", "end loop").as_bytes(),
        MeshFormat::Stl,
        "line 9: expected solid, found loop",
    );
    refused(
        solid.replace("0 1 0", "0,5 1 0").as_bytes(),
        MeshFormat::Stl,
        "line 6: expected a number, found 0,5; write a decimal point",
    );
}

/// Makes strings of literals, to compare lists.
trait MapToStrings {
    fn map_to_strings(&self) -> Vec<String>;
}

impl MapToStrings for [&str] {
    fn map_to_strings(&self) -> Vec<String> {
        self.iter().map(|&text| text.to_owned()).collect()
    }
}

#[test]
fn faces_of_fewer_than_three_corners_are_left_out_and_counted() {
    let (mesh, told) = warned(
        format!("{CORNERS}f 1 2\n\nf 1 2 3\nf -1 # a point\nf 2 3/1/1/ 4//\nf\n").as_bytes(),
        MeshFormat::Obj,
    );
    assert_eq!((mesh.triangle_count(), mesh.objects[0].triangle_ids.len()), (2, 2));
    assert_eq!(told, ["line 5: left out 3 faces of fewer than three corners, of which this is the first"]);
    // Also in blocks that are parsed by themselves.
    let far = format!("{CORNERS}f 1 2 3\n{}f 1 2\n", "# far away\n".repeat(200_000));
    assert_eq!(
        warned(far.as_bytes(), MeshFormat::Obj).1,
        ["line 200006: left out 1 face of fewer than three corners"]
    );
    // Others, that have no triangle either, or have them elsewhere.
    let others =
        "l 1 2\np 1\nsurf 0 1 0 1 1 2 3\ns off\ncurv2 1 2\ncall other.obj\ncsh -rm x\nl 2 3\ncstype bezier\n";
    let (mesh, told) = warned(format!("{CORNERS}{others}f 1 2 3\n").as_bytes(), MeshFormat::Obj);
    assert_eq!(mesh.triangle_count(), 1);
    let expected = [
        "line 5: left out 3 statements of lines or points, of which this is the first",
        "line 7: left out 2 free-form curves or surfaces, of which this is the first",
        "line 10: left out 1 call of another file",
    ];
    assert_eq!(told, expected);
    refused(
        format!("{CORNERS}surf 0 1 0 1 1 2 3\n").as_bytes(),
        MeshFormat::Obj,
        "expected at least one face, found none but 1 free-form curve or surface",
    );
    refused(
        format!("{CORNERS}f 1 2\n").as_bytes(),
        MeshFormat::Obj,
        "found none but 1 face of fewer than three corners",
    );
    refused(
        format!("{CORNERS}f 1 2 3\nf 1 x\n").as_bytes(),
        MeshFormat::Obj,
        "line 6: expected vertex numbers",
    );
    refused(
        format!("{CORNERS}f 1 9\nf 1 0\n").as_bytes(),
        MeshFormat::Obj,
        "line 6: expected a vertex number from 1 to 4, found 0",
    );
    refused(
        format!("{CORNERS}f 1 9\nf 1 2 9\n").as_bytes(),
        MeshFormat::Obj,
        "line 6: expected a vertex number from 1 to 4, found 9",
    );

    let header = String::from_utf8(ply_header("ascii", "list uchar int vertex_indices")).unwrap();
    let (mesh, told) = warned(format!("{header}2 0 9\n3 0 1 2\n0\n1 0\n").as_bytes(), MeshFormat::Ply);
    assert_eq!(only(&mesh).triangles, [[0, 1, 2]]);
    assert_eq!(told, ["line 13: left out 3 faces of fewer than three corners, of which this is the first"]);
    let mut binary = ply_header("binary_little_endian", "list uchar int64 vertex_indices");
    for face in [&[0i64, 1][..], &[0, 1, 2], &[], &[1]] {
        binary.push(face.len() as u8);
        face.iter().for_each(|corner| binary.extend(corner.to_le_bytes()));
    }
    let place = binary.len() - 4 - 6 * 8;
    let (mesh, told) = warned(&binary, MeshFormat::Ply);
    assert_eq!(only(&mesh).triangles, [[0, 1, 2]]);
    assert_eq!(
        told,
        [format!("byte {place}: left out 3 faces of fewer than three corners, of which this is the first")]
    );
}

/// Returns the header of a PLY file of three vertices, and the vertices. Four faces follow.
fn ply_header(format: &str, list: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n\
         property {list}\nend_header\n"
    )
    .into_bytes();
    for position in [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
        match format {
            "ascii" => bytes.extend(format!("{} {} {}\n", position[0], position[1], position[2]).bytes()),
            _ => position.iter().for_each(|value| bytes.extend(value.to_le_bytes())),
        }
    }
    bytes
}

#[test]
fn ply_strips_turn_every_other_triangle_and_restart() {
    let strips = "element tristrips 2\nproperty list int int vertex_indices\nend_header\n";
    let vertices =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let rows = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n9 0 1 2 3 3 -1 1 2 3\n3 -1 0 1\n";
    let (mesh, told) = warned(format!("{vertices}{strips}{rows}").as_bytes(), MeshFormat::Ply);
    assert_eq!((&only(&mesh).triangles[..], told.len()), (&[[0, 1, 2], [2, 1, 3], [1, 2, 3]][..], 0));
    for (was, is, expected) in [
        ("3 3 -1", "3 4 -1", "line 14: expected a vertex number from 0 to 3, found 4"),
        ("3 3 -1", "3 3 -2", "line 14: expected a vertex number from 0 to 3, found -2"),
        ("3 -1 0 1", "4 -1 0 1", "expected a number, found the end of the file"),
        ("vertex_indices", "corners", "expected an element vertex"),
    ] {
        refused(format!("{vertices}{strips}{rows}").replace(was, is).as_bytes(), MeshFormat::Ply, expected);
    }
}

#[test]
fn ply_rows_with_more_numbers_than_declared_are_refused() {
    let header = String::from_utf8(ply_header("ascii", "list uchar int vertex_indices")).unwrap();
    let faces = "3 0 1 2\n3 0 1 2\n3 0 1 2\n3 0 1 2\n";
    let whole = format!("{header}{faces}");
    let one_line = whole
        .split_once("end_header\n")
        .map(|(head, rows)| format!("{head}end_header\n{}", rows.replace('\n', " ")))
        .unwrap();
    for fine in [&whole, &one_line, &format!("{whole}\n \n\x1a\0\0")] {
        assert_eq!(warned(fine.as_bytes(), MeshFormat::Ply).1, [""; 0]);
    }
    for (wrong, expected) in [
        (
            whole.replace("3 0 1 2\n", "3 0 1 2 255 0 0\n"),
            "line 13: expected a row of element face with as many numbers as the header declares, found more, from 255 on",
        ),
        (whole.replace("1 0 0\n", "1 0 0 7\n"), "line 11: expected a row of element vertex"),
        (
            format!("{whole}3 0 1 2\n"),
            "line 17: expected the end of the file after the last row that the header declares, found 3",
        ),
        (format!("{one_line} 3"), "line 10: expected a row of element vertex"),
        (
            one_line.replace("3 0 1 2 3", "3 0 1 9 3"),
            "line 10: expected a vertex number from 0 to 2, found 9",
        ),
    ] {
        refused(wrong.as_bytes(), MeshFormat::Ply, expected);
    }
    let mut binary = ply("binary_little_endian");
    let end = binary.len();
    binary.extend(b"\n\0\0");
    assert_eq!(warned(&binary, MeshFormat::Ply).1, [""; 0]);
    binary.extend(b"more\n");
    let told = format!("byte {end}: left out 7 bytes after the last row that the header declares");
    assert_eq!(warned(&binary, MeshFormat::Ply).1, [told]);
}

#[test]
fn xyz_may_state_its_count_and_its_columns_first() {
    let points = "0 0 1\n\n1 2 3\n";
    for (text, told) in [
        (format!("2\n{points}"), None),
        (format!("\"X\";\"Y\";\"Z\"\n2\n{points}"), None),
        (format!("//X Y Z R G B\n2\nx y z\n{points}\x1a"), None),
        (format!("\n3\n{points}"), Some("line 2: 2 points follow this line, which states 3")),
        ("0, 0, 1\n1,2,3,\n".to_owned(), None),
        ("0,0,1\n  1 2  3 \n".to_owned(), None),
    ] {
        let (mesh, warnings) = warned(text.as_bytes(), MeshFormat::Xyz);
        assert_eq!((mesh.triangle_count(), warnings.first().map(String::as_str)), (2, told), "{text}");
    }
    let commas = "expected a point: three numbers with the same separator between them";
    for (text, expected) in [
        ("0,5 0,25 1,75\n", commas),
        ("0,5;0,25;1,75\n", commas),
        ("0 0 0\n0,5\t0,25\t1,75\n", commas),
        ("0,5, 0,25, 1,75\n", commas),
        ("1.234,5 0,25 1\n", commas),
        ("2\n2\n0 0 0\n", "line 2: expected a point: three numbers, found 2"),
        ("x y z\nx y z\n0 0 0\n", "line 2: expected a point"),
        ("0 0 0\nx y z\n", "line 2: expected a point"),
    ] {
        refused(text.as_bytes(), MeshFormat::Xyz, expected);
    }
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n";
    refused(
        format!("{pcd}0,5 0 0\n").as_bytes(),
        MeshFormat::Pcd,
        "found 0,5; write a decimal point, not a comma",
    );
    let (mesh, told) = warned(format!("{pcd}\n0 0 0\n\n7 7 7\n").as_bytes(), MeshFormat::Pcd);
    assert_eq!(
        (mesh.triangle_count(), &told[..]),
        (1, &["line 11: left out 6 bytes after the last point".to_owned()][..])
    );
}

/// Bakes a file into a folder, and returns the report.
fn bake(path: &Path, options: &Options) -> BakeReport {
    match FileBake::new([path], path.with_extension("cbvh")).options(options.clone()).run().unwrap() {
        Outcome::Baked(report) => *report,
        Outcome::UpToDate(_) => panic!("the file is up to date"),
    }
}

#[test]
fn points_without_a_position_can_be_left_out() {
    let dropping = Options::default().drop_nan(true);
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let rows = "0 0 1\nnan nan nan\n1 -inf 3\n1 2 3\n";
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nPOINTS 4\n";
    let mut binary = format!("{pcd}DATA binary\n").into_bytes();
    for value in [0.0, 0.0, 1.0, f32::NAN, f32::NAN, 0.0, 1.0, f32::NEG_INFINITY, 3.0, 1.0, 2.0, 3.0] {
        binary.extend(value.to_le_bytes());
    }
    let first = binary.len() - 36;
    for (name, bytes, place) in [
        ("a.xyz", rows.as_bytes(), "line 2"),
        ("a.ply", format!("{ply}{rows}").as_bytes(), "line 9"),
        ("a.pcd", format!("{pcd}DATA ascii\n{rows}").as_bytes(), "line 11"),
        ("b.pcd", &binary, &format!("byte {first}")),
    ] {
        let folder = cbvh_testkit::folder();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let refused = FileBake::new([&path], path.with_extension("cbvh")).run().unwrap_err().to_string();
        assert!(refused.contains(place) && refused.contains("--drop-nan (drop_nan)"), "{refused}");
        let told = format!(
            "{}: {place}: left out 2 points without a position, of which this is the first",
            path.display()
        );
        let report = bake(&path, &dropping);
        assert_eq!((report.file.triangles_in, &report.warnings), (2, &vec![told]));
        verify_files(&path.with_extension("cbvh"), std::slice::from_ref(&path), &VerifyOptions::default())
            .unwrap();
        let format = MeshFormat::from_extension(&path).unwrap();
        let mesh = read_bytes_with(bytes, format, &path, &dropping).unwrap();
        assert_eq!(mesh.warnings, report.warnings);
    }
    // Only they are: a vertex of a face must have a position, and a point one that the format can hold.
    let face = String::from_utf8(ply_header("ascii", "list uchar int vertex_indices"))
        .unwrap()
        .replace("1 0 0", "nan 0 0");
    for (bytes, format) in [
        (format!("{face}{}", "3 0 1 2\n".repeat(4)), MeshFormat::Ply),
        ("0 0 1e40\n".to_owned(), MeshFormat::Xyz),
        ("nan nan nan\n".to_owned(), MeshFormat::Xyz),
    ] {
        let said =
            read_bytes_with(bytes.as_bytes(), format, Path::new("test"), &dropping).unwrap_err().to_string();
        assert!(!said.contains("--drop-nan"), "{said}");
    }
}
