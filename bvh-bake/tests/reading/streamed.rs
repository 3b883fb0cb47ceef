//! Meshes that are read piece by piece: the same file, the same counts and the same errors as of meshes in memory.

use bvh_bake::{FileBake, Options, Outcome};
use cbvh_testkit::Random;
use std::fs;
use std::path::{Path, PathBuf};

/// The file's bytes and the number of triangles read, or what is said of the input.
type Told = Result<(Vec<u8>, u64), String>;

fn bake(inputs: &[PathBuf], output: &Path, options: &Options, max_memory: Option<u64>) -> Told {
    match FileBake::new(inputs, output).options(options.clone()).force(true).max_memory(max_memory).run() {
        Ok(Outcome::Baked(report)) => Ok((fs::read(output).unwrap(), report.file.triangles_in)),
        Ok(other) => unreachable!("every bake is forced: {other:?}"),
        Err(error) => Err(error.to_string()),
    }
}

struct Folder(cbvh_testkit::TempDir);

impl Folder {
    fn new() -> Self {
        Self(cbvh_testkit::folder())
    }

    /// Bakes a file both ways, apart and as one, and compares.
    #[track_caller]
    fn compare(&self, name: &str, bytes: &[u8]) -> Told {
        let input = self.0.path().join(name);
        fs::write(&input, bytes).unwrap();
        let mut told = Err(String::new());
        for split_objects in [false, true] {
            let options = Options::default().split_objects(split_objects);
            let output = self.0.path().join("out.cbvh");
            let inputs = std::slice::from_ref(&input);
            let in_memory = bake(inputs, &output, &options, None);
            told = bake(inputs, &output, &options, Some(100 << 20));
            let text = String::from_utf8_lossy(&bytes[..bytes.len().min(300)]).into_owned();
            assert!(told == in_memory, "{name}: {:?} {:?}\n{text}", told.err(), in_memory.err());
        }
        assert_eq!(fs::read_dir(self.0.path()).unwrap().count(), if told.is_ok() { 2 } else { 1 });
        let _ = fs::remove_file(self.0.path().join("out.cbvh"));
        fs::remove_file(input).unwrap();
        told
    }
}

const OBJ: &str = "# a comment\nv 0 0 0\nv 1 0 0 \\\r\n1\nv 1 1 0.1\rv 0 1 -0.0\nv 0.5 3 0\no a\nf 1 2 3 4\nf -5 -4 -2 -1\ng x\n\
    o b\nf 1/2/3 2//1 3/4\no a\nf 1 2 3\nf 1 2 3\n\nv 7 7 7\nf 6 1 2 # end\nf 3 2 1 5 4\n";
const STL: &str = "solid one two\nfacet normal 0 0 1 outer loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e-1 0\nendloop\nendfacet\n\
    facet normal nan outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1e-1 5 endloop endfacet\nendsolid x\n\
    solid\nFACET normal outer loop vertex 9 -0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet endsolid\n";
const PLY: &str = "ply\nformat ascii 1.0\ncomment x\nelement vertex 5\nproperty float x\nproperty double y\nproperty float z\n\
    property uchar red\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 1\n1 0 0 2\n1 1.1 0 3 0 1 0\n4\n0.5 0.5 nan 5\n3 0 1 2\n4 0 1 2 3\n3 0 2 3\n";
const PLY_FACES_FIRST: &str = "ply\nformat ascii 1.0\nelement face 2\nproperty list uchar int vertex_index\n\
    element vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n\
    3 0 1 2\n4 0 1 2 3\n0 0 0\n1 0 0\n1 1 0\n0 1 1e3\n";

const DAE: &str = "<COLLADA>\n<asset><unit meter=\"0.5\"/></asset><library_geometries>\n<geometry id=\"g\" name=\"one\"><mesh>\
    <source id=\"s\">\n<float_array id=\"a\" count=\"15\">0 0 0\n1.1 0 0\n1 1 0\n0 1 -0\n7 7 7</float_array>\n<technique_common>\
    <accessor source=\"#a\" count=\"5\" stride=\"3\"/></technique_common></source>\n<vertices id=\"v\"><input semantic=\"POSITION\" \
    source=\"#s\"/></vertices>\n<polylist count=\"3\"><input semantic=\"VERTEX\" source=\"#v\"/>\n<vcount>3 4 2</vcount>\n\
    <p>0 1 2\n0 1 2 3\n1 2</p></polylist><triangles><input semantic=\"VERTEX\" source=\"#v\"/><p>2 1 0</p></triangles></mesh></geometry>\n\
    </library_geometries><library_visual_scenes><visual_scene>\n<node name=\"a\"><instance_geometry url=\"#g\"/></node>\n\
    <node name=\"b\"><scale>-1 1 2</scale><instance_geometry url=\"#g\"/></node></visual_scene></library_visual_scenes></COLLADA>\n";
const XYZ: &str = "# points\n0 0 0\n1,.5,1e-3,255\n1 .5 1e-3\n";
const PCD: &str = "VERSION .7\nFIELDS x i y z\nSIZE 4 2 8 4\nTYPE F U F F\nWIDTH 3\nHEIGHT 1\nDATA ascii\n\
    0 1 0 0\n1 2 .5 1e-3\n1 3 .5 1e-3\n";
const PLY_POINTS: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nend_header\n0 0 0\n1 .5 1e-3\n1 .5 1e-3\n";

fn binary_stl(triangles: u32) -> Vec<u8> {
    let mut bytes = vec![b'x'; 80];
    bytes.extend(triangles.to_le_bytes());
    for i in 0..triangles {
        bytes.extend([0; 12]);
        let at = |k: u32| ((i * 7 + k * 13) % 11) as f32 * 0.37;
        (0..9).for_each(|k| bytes.extend(at(k).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn good_files_bake_alike() {
    let folder = Folder::new();
    for (name, text) in [
        ("a.obj", OBJ),
        ("a.stl", STL),
        ("a.ply", PLY),
        ("b.ply", PLY_FACES_FIRST),
        ("a", PLY),
        ("a.dae", DAE),
        ("a.xyz", XYZ),
        ("a.pcd", PCD),
        ("c.ply", PLY_POINTS),
    ] {
        folder.compare(name, text.as_bytes()).unwrap();
        let crlf = text.replace('\r', "").replace('\n', "\r\n");
        let _ = folder.compare(name, crlf.as_bytes());
        let _ = folder.compare(name, text.replace('\n', "\r").as_bytes());
        let _ = folder.compare(name, format!("\u{feff}{text}").as_bytes());
    }
    // A corner in the place of another, which cutting may leave out.
    let twice = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 2 2 0\nv 1 3 0\nv 0 2 0\nf 1 2 3 4 5 6\n";
    folder.compare("d.obj", twice.as_bytes()).unwrap();
    // Duplicates, too: all 11 kinds of triangles occur many times.
    folder.compare("c.stl", &binary_stl(500)).unwrap();
}

#[test]
fn long_files_bake_alike() {
    let folder = Folder::new();
    // Blocks of the readers end all over it, and vertices of all blocks meet in faces.
    let count = 60_000;
    let mut text = String::new();
    let value = |i: u32| f64::from(i.wrapping_mul(0x9e37_79b9) >> 12) / 1000.0;
    (0..count).for_each(|i| text += &format!("v {} {} {}\r\n", value(i), value(i + 1), value(3 * i)));
    for i in 0..count / 2 {
        if i % 10_000 == 0 {
            text += &format!("o part{}\n", i / 20_000);
        }
        let at = |k: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(k * 77)) % count + 1;
        text += &format!("f {} \\\n {} {}\n", at(0), at(1), -i64::from(at(2)));
    }
    let (_, triangles) = folder.compare("long.obj", text.as_bytes()).unwrap();
    assert_eq!(triangles, u64::from(count) / 2);
    let broken = text + "f 1 2 99999999\n";
    let line = broken.lines().count();
    assert!(folder.compare("long.obj", broken.as_bytes()).unwrap_err().contains(&format!("line {line}:")));
}

#[test]
fn bad_files_are_told_alike() {
    let folder = Folder::new();
    let cases: [(&str, &str); 31] = [
        ("a.obj", ""),
        ("a.obj", "v 0 0 0\n"),
        ("a.obj", "v 0 0\nf 1 1 1"),
        ("a.obj", "v 0 0 x\nf 1 1 1"),
        ("a.obj", "v 0 0 0\nf 1 1"),
        ("a.obj", "v 0 0 0\nf 1 1 2"),
        ("a.obj", "v 0 0 0\nf 1 1 -2"),
        ("a.obj", "v 0 0 0\nf 1 1 a"),
        ("a.obj", "v 0 0 0\n v 1e39 0 0 # far\nv nan 0 0\nf 1 1 1\nf 1 1 3\nf 1 2 7"),
        ("a.obj", "v 0 0 0\nv 1e300 0 0\nf 1 1 2 x"),
        ("a.obj", "v 0 0 0\nv 1e300 0 0\nf 1 2"),
        ("a.obj", "v 0 0 0\nv 1e300 0 0\nf 1 x 2"),
        ("a.stl", ""),
        ("a.stl", "solid\n"),
        ("a.stl", "solid\nendsolid\n"),
        ("a.stl", "solid\nfacet normal 0 0 0 0 outer loop"),
        ("a.stl", "solid\nfacet normal 0 0 0\nouter loop\nvertex 1 2 1e99 vertex"),
        ("a.stl", "solid a\nfacet normal 0 0 0\nouter loop\nvertex 1 2 3 vertex x"),
        ("a.stl", "solid a\nendsolid\nliquid"),
        ("a.ply", ""),
        ("a.ply", "ply\n"),
        ("a.ply", "ply\nformat ascii 1.0\nend_header\n"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 9999999\nproperty float x\nend_header\n"),
        ("a.gltf", "{}"),
        ("a.dae", "<COLLADA>"),
        ("a.dae", "<COLLADA/>"),
        ("a.xyz", "0 0 0\n0 nan 0"),
        ("a.xyz", "#"),
        ("a.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 2\nDATA ascii\n1 2 3"),
        ("a.off", "0 0 0"),
        ("a", "nothing known"),
    ];
    for (name, text) in cases {
        assert!(folder.compare(name, text.as_bytes()).is_err(), "{name}: {text}");
    }
    for (from, to) in
        [("1.1", "1e37"), ("7 7 7", "7 7"), ("2 1 0", "2 1 5"), ("#g", "#h"), ("scale>", "skew>")]
    {
        assert!(folder.compare("a.dae", DAE.replace(from, to).as_bytes()).is_err(), "{to}");
    }
    for (from, to) in [("3 0 2 3", "3 0 2 4"), ("3 0 2 3", "3 0 2 5"), ("nan 5", "nan")] {
        assert!(folder.compare("a.ply", PLY.replace(from, to).as_bytes()).is_err(), "{to}");
    }
    let faces_first = PLY_FACES_FIRST.replace("1 1 0\n", "1 nan inf\n");
    assert!(folder.compare("a.ply", faces_first.as_bytes()).unwrap_err().contains("line 14"));
    assert!(folder.compare("a.ply", PLY_FACES_FIRST.replace("4 0 1 2 3", "4 0 9 2 8").as_bytes()).is_err());
}

/// Files cut short and with changed bytes.
#[test]
fn damaged_files_are_told_alike() {
    let folder = Folder::new();
    let stl = binary_stl(5);
    let files: [(&str, &[u8]); 6] = [
        ("a.dae", DAE.as_bytes()),
        ("a.obj", OBJ.as_bytes()),
        ("a.stl", STL.as_bytes()),
        ("a.ply", PLY.as_bytes()),
        ("b.ply", PLY_FACES_FIRST.as_bytes()),
        ("b.stl", &stl),
    ];
    let mut random = Random::new(1);
    for (name, bytes) in files {
        for _ in 0..30 {
            let _ = folder.compare(name, &bytes[..random.below(bytes.len())]);
            let mut changed = bytes.to_vec();
            for _ in 0..1 + random.below(3) {
                let at = random.below(changed.len());
                changed[at] = b"0 9-\n\r\\.ex\0\xff"[random.below(12)];
            }
            let _ = folder.compare(name, &changed);
        }
    }
}
