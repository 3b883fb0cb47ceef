//! Reads glTF as programs write it: strides, padding, numbers with a point, versions, extensions, and what is told or refused.

use super::gltf_model::{Model, PRIMITIVE};
use super::{only, refusal, refused, try_bytes};
use bvh_bake::input::MeshFormat;
use bvh_bake::mesh::Mesh;

/// Writes base64, to put the buffer into the document.
fn base64(bytes: &[u8]) -> String {
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let of_three = |three: &[u8]| {
        let bits =
            three.iter().fold(0u32, |bits, &byte| bits << 8 | u32::from(byte)) << (8 * (3 - three.len()));
        (0..=three.len()).map(move |place| char::from(letters[(bits >> (18 - 6 * place)) as usize & 63]))
    };
    bytes.chunks(3).flat_map(of_three).collect()
}

/// Returns the text of a file of its own.
fn text(model: &Model) -> String {
    let uri = format!(r#"[{{"uri":"data:;base64,{}","byteLength""#, base64(model.buffer()));
    model.json().replace(r#"[{"byteLength""#, &uri)
}

#[track_caller]
fn read(bytes: &[u8]) -> Mesh {
    try_bytes(bytes, MeshFormat::Gltf).unwrap()
}

#[track_caller]
fn warnings(model: &Model) -> Vec<String> {
    read(&model.glb()).warnings.iter().map(|told| told.strip_prefix("test: ").unwrap().to_owned()).collect()
}

/// Puts bytes between rows.
fn spread(rows: &[&[u8]], stride: usize) -> Vec<u8> {
    let row = |row: &&[u8]| [row, &vec![0xff; stride - row.len()][..]].concat();
    rows.iter().flat_map(row).collect()
}

#[test]
fn strides_are_those_of_what_is_read() {
    let corners = [[0f32, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
    let corners = corners.map(|corner| corner.map(f32::to_le_bytes).as_flattened().to_vec());
    let corners: Vec<&[u8]> = corners.iter().map(|corner| &corner[..]).collect();
    let indices = [0u16, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3].map(u16::to_le_bytes);
    let indices: Vec<&[u8]> = indices.iter().map(|index| &index[..]).collect();
    // Any stride from the size of a value on can be read; 0 stands for it. Nothing follows the last value.
    for (positions, numbers) in [(0, 0), (12, 2), (13, 3), (24, 4), (300, 7), (1000, 252)] {
        for is_short in [false, true] {
            let mut model = Model::new();
            let mut rows = |rows: &[&[u8]], stride: usize, json: &str| {
                let mut bytes = spread(rows, stride.max(rows[0].len()));
                if is_short {
                    bytes.truncate(bytes.len() - stride.max(rows[0].len()) + rows[0].len());
                }
                let view = model.view(&bytes, &format!(r#","byteStride":{stride}"#));
                model.accessor(format!(r#"{{"bufferView":{view},"count":{},{json}}}"#, rows.len()))
            };
            let at = rows(&corners, positions, r#""componentType":5126,"type":"VEC3""#);
            let by = rows(&indices, numbers, r#""componentType":5123,"type":"SCALAR""#);
            model.meshes =
                format!(r#"{{"primitives":[{{"attributes":{{"POSITION":{at}}},"indices":{by}}}]}}"#);
            assert_eq!(read(&model.glb()), read(&Model::new().glb()), "{positions} {numbers}");
        }
    }
    // Sparse values, too.
    let mut model = Model::new();
    let at = model.view(&[3, 9, 9], r#","byteStride":0"#);
    let by = model.view(&spread(&[&[0; 12]], 12), r#","byteStride":1"#);
    let sparse = format!(
        r#","sparse":{{"count":1,"indices":{{"bufferView":{at},"componentType":5121}},"values":{{"bufferView":{by}}}}}}}"#
    );
    model.edit(0, "}", &sparse);
    assert_eq!(only(&read(&model.glb())).positions[3], [0.0; 3]);
}

#[test]
fn what_no_triangle_needs_is_not_judged() {
    let mut model = Model::new();
    let views = [r#","byteStride":2"#, r#","byteStride":9999,"byteOffset":77777777"#].map(|fields| {
        let fields = fields.split_once(r#","byteOffset""#).map_or(fields, |(stride, _)| stride);
        model.view(&[0; 8], fields)
    });
    let odd = model
        .accessor(format!(r#"{{"bufferView":{},"componentType":5121,"count":4,"type":"VEC2"}}"#, views[0]));
    let wrong = [
        model.accessor(format!(
            r#"{{"bufferView":{},"componentType":5130,"count":999,"type":"VEC9"}}"#,
            views[1]
        )),
        model.accessor(r#"{"bufferView":99,"componentType":5126,"count":4,"type":"VEC3"}"#.into()),
    ];
    model.meshes = format!(
        r#"{{"primitives":[{{"attributes":{{"TEXCOORD_0":{odd},"NORMAL":{},"COLOR_0":{},"TANGENT":12345,"POSITION":0,"JOINTS_0":777}},
        "indices":1,"targets":[{{"POSITION":888}}]}}]}}"#,
        wrong[0], wrong[1]
    );
    model.fields = r#""skins":[{"joints":[55],"inverseBindMatrices":66}],"scenes":[{"nodes":[0]}],"#.into();
    model.nodes += r#",{"mesh":0,"skin":8,"weights":[1,2,3]}"#;
    assert_eq!(read(&model.glb()).triangle_count(), 4);
    // A view of a buffer that is not there.
    let json = model.json().replacen(r#"{"buffer":0,"byteOffset":72"#, r#"{"buffer":5,"byteOffset":72"#, 1);
    assert_ne!(json, model.json());
    assert_eq!(read(&crate::glb(&json, model.buffer())).triangle_count(), 4);
}

#[test]
fn text_may_have_a_mark_before_it_and_padding_after_it() {
    let plain = text(&Model::new());
    let whole = read(plain.as_bytes());
    assert_eq!(whole.triangle_count(), 4);
    for (before, after) in [
        ("\u{feff}", ""),
        ("", "\0\0\0"),
        ("\u{feff}\r\n\t ", " \r\n\t\0 \0"),
        ("\n", "\x1a"),
        (" ", "\u{c}"),
    ] {
        let padded = format!("{before}{plain}{after}");
        assert_eq!(read(padded.as_bytes()), whole, "{before:?} {after:?}");
        assert_eq!(MeshFormat::from_content(padded.as_bytes()), Some(MeshFormat::Gltf));
        let model = Model::new();
        let json = format!("{before}{}{after}", model.json());
        assert_eq!(read(&crate::glb(&json, model.buffer())), whole);
    }
    let padded = plain
        .replace(',', " ,\r\n\t")
        .replace(':', "\t: ")
        .replace("base64 ,\r\n\t", "base64,")
        .replace("data\t: ", "data:");
    assert_eq!(read(padded.as_bytes()), whole);
    refused(format!("{plain}\0x").as_bytes(), MeshFormat::Gltf, "trailing characters at line");
    // A chunk whose length is no multiple of four.
    let model = Model::new();
    let (json, buffer) = (model.json(), model.buffer());
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((12 + 16 + json.len() as u32 + 1 + buffer.len() as u32).to_le_bytes());
    let spaces = if json.len() % 4 == 3 { "  " } else { " " };
    bytes[8] += spaces.len() as u8 - 1;
    for (kind, chunk) in [(b"JSON", format!("{json}{spaces}").as_bytes()), (b"BIN\0", buffer)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    assert_eq!(read(&bytes), whole);
}

#[test]
fn whole_numbers_may_have_a_point() {
    let plain = text(&Model::new());
    let whole = read(plain.as_bytes());
    // All of them, but not those within names and data.
    let (mut pointed, mut in_text) = (String::new(), false);
    let letters: Vec<char> = plain.chars().collect();
    for (place, &letter) in letters.iter().enumerate() {
        pointed.push(letter);
        in_text ^= letter == '"';
        let ends = letter.is_ascii_digit() && !letters[place + 1].is_ascii_digit();
        if !in_text && ends {
            pointed += if place % 2 == 0 { ".0" } else { ".00e0" };
        }
    }
    assert!(pointed.contains("\"count\":4.0"));
    assert_eq!(read(pointed.as_bytes()), whole);
    let broken = plain.replace("\"count\":4,", "\"count\":4.5,");
    let said = refusal(broken.as_bytes(), MeshFormat::Gltf);
    assert!(said.contains("line 1: expected a glTF document, found invalid value: floating point `4.5`, expected a whole number"), "{said}");
    // The whole message, with its place.
    let broken = plain.replace("\"indices\":1", "\"indices\":-1");
    let said = refusal(broken.as_bytes(), MeshFormat::Gltf);
    let column = broken.find("-1").unwrap() + 2;
    let expected = "invalid value: integer `-1`, expected a whole number from 0";
    assert_eq!(
        said,
        format!("test: line 1: expected a glTF document, found {expected} at line 1 column {column}")
    );
}

#[test]
fn versions_are_read_as_they_are_meant() {
    let with = |asset: &str| text(&Model::new()).replace(r#""version":"2.0""#, asset);
    for asset in [
        r#""version":"2.1""#,
        r#""version":"2""#,
        r#""version":"2.1","minVersion":"2.0""#,
        r#""version":"2.7","minVersion":"1.9""#,
        r#""minVersion":"2.0","version":"3.0""#,
    ] {
        assert_eq!(read(with(asset).as_bytes()).triangle_count(), 4, "{asset}");
    }
    let least = "asset.minVersion of at most 2.0, the version that is read, found ";
    for (asset, expected) in [
        (r#""version":"2.1","minVersion":"2.1""#, &format!("{least}2.1 in asset.minVersion")),
        (r#""version":"2.0","minVersion":"3.0""#, &format!("{least}3.0")),
        (r#""version":"2.0","minVersion":"new""#, &format!("{least}new")),
        (r#""version":"3.0""#, &"asset.version 2.0, found 3.0".to_owned()),
        (
            r#""version":"1.1""#,
            &"asset.version 2.0, found glTF of version 1.1; convert it to version 2.0".to_owned(),
        ),
        (r#""version":2.0"#, &"invalid type: floating point `2.0`, expected a string".to_owned()),
    ] {
        refused(with(asset).as_bytes(), MeshFormat::Gltf, expected);
    }
    // The lists of version 1.0 have names, and not every file states its version.
    for (text, version) in [
        (r#"{"asset":{"version":"1.0"},"scenes":{"s":{"nodes":["n"]}},"scene":"s"}"#, "1.0"),
        (r#"{"scene":"s","asset":{"version":0.8},"nodes":{}}"#, "0.8"),
        (r#"{"scene":"s","nodes":{"n":{"meshes":["m"]}}}"#, "1.0"),
        (r#"{"asset":{},"meshes":{"m":{"primitives":[]}},"scene":"s"}"#, "1.0"),
    ] {
        let expected =
            format!("asset.version 2.0, found glTF of version {version}; convert it to version 2.0");
        refused(text.as_bytes(), MeshFormat::Gltf, &expected);
    }
    refused(
        b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0",
        MeshFormat::Gltf,
        "binary glTF of version 2, found version 1",
    );
    refused(
        br#"{"asset":{"version":"2.0"},"nodes":"none"}"#,
        MeshFormat::Gltf,
        "invalid type: string \"none\"",
    );
}

#[test]
fn what_changes_triangles_and_is_not_read_is_told_once() {
    let mut model = Model::new();
    assert_eq!(warnings(&model), [""; 0]);
    let channel = |target: &str| {
        format!(
            r#"{{"channels":[{{"sampler":0,"target":{{{target}}}}}],"samplers":[{{"input":5,"output":6}}]}}"#
        )
    };
    let pointer = |to: &str| {
        channel(&format!(r#""path":"pointer","extensions":{{"KHR_animation_pointer":{{"pointer":"{to}"}}}}"#))
    };
    let moves = [
        channel(r#""node":0,"path":"rotation""#),
        channel(r#""node":0,"path":"weights""#),
        pointer("/nodes/0/translation"),
    ];
    model.fields =
        format!(r#""animations":[{}],"#, [pointer("/materials/0/alphaCutoff"), "{}".into()].join(","));
    assert_eq!(warnings(&model), [""; 0]);
    let said = "which are read as the file states them at rest";
    model.fields = format!(r#""animations":[{}],"#, moves[0]);
    assert_eq!(
        warnings(&model),
        [format!("left out an animation that moves nodes or changes weights, {said}")]
    );
    model.fields = format!(r#""animations":[{}],"#, moves.join(","));
    assert_eq!(
        warnings(&model),
        [format!("left out 3 animations that move nodes or change weights, {said}")]
    );

    // Points and lines, in a mesh that many nodes place.
    model.fields.clear();
    let lines = |mode: u32| format!(r#"{{"attributes":{{"POSITION":0}},"mode":{mode}}}"#);
    let empty = r#"{"attributes":{"NORMAL":0}}"#;
    model.nodes = [r#"{"mesh":0}"#; 5].join(",");
    model.meshes = format!(r#"{{"primitives":[{},{PRIMITIVE}}},{},{empty}]}}"#, lines(0), lines(3));
    assert_eq!(
        warnings(&model),
        ["left out 2 primitives of points or lines", "left out a primitive without positions"]
    );

    // Invisible nodes, also those below one, are read like others.
    let mut model = Model::new();
    let hidden = |is: bool| format!(r#""extensions":{{"KHR_node_visibility":{{"visible":{is}}}}}"#);
    model.nodes = format!(
        r#"{{"mesh":0,{}}},{{{},"children":[2,3]}},{{"children":[4]}},{{"mesh":0}},{{"mesh":0,{}}}"#,
        hidden(true),
        hidden(false),
        hidden(true)
    );
    model.fields = r#""extensionsRequired":["KHR_node_visibility"],"#.into();
    assert_eq!(read(&model.glb()).triangle_count(), 12);
    let said = "read the meshes of 2 invisible nodes (KHR_node_visibility), of which nodes[4] is the first, like any other";
    assert_eq!(warnings(&model), [said]);

    // The coarser levels of a node are not read, unless the scene has them, too.
    model.fields = r#""extensionsUsed":["MSFT_lod"],"#.into();
    model.nodes = r#"{"mesh":0,"extensions":{"MSFT_lod":{"ids":[1,2]}}},{"mesh":0},{"mesh":0}"#.into();
    assert_eq!(read(&model.glb()).triangle_count(), 4);
    assert_eq!(warnings(&model), ["left out 2 nodes that show others with less detail (MSFT_lod)"]);
    model.fields = r#""scenes":[{"nodes":[0,2]}],"#.into();
    assert_eq!(read(&model.glb()).triangle_count(), 8);
    assert_eq!(warnings(&model), ["left out a node that shows another with less detail (MSFT_lod)"]);
}
