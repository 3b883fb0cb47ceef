//! BCF files: their topics are the clashes of the answer, and they can be read back.

use super::{block, parts};
use crate::common::{Files as _, names};
use crate::documents::elements;
use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

/// Returns the files of an archive whose entries are stored as they are.
pub(super) fn unzip(bytes: &[u8]) -> BTreeMap<String, String> {
    let number = |at: usize, length: usize| {
        bytes[at..at + length].iter().rev().fold(0, |sum, &byte| sum << 8 | usize::from(byte))
    };
    let end = bytes.len() - 22;
    assert_eq!(&bytes[end..end + 4], b"PK\x05\x06");
    let (mut at, mut files) = (number(end + 16, 4), BTreeMap::new());
    for _ in 0..number(end + 10, 2) {
        assert_eq!(&bytes[at..at + 4], b"PK\x01\x02");
        assert_eq!((number(at + 10, 2), number(at + 20, 4)), (0, number(at + 24, 4)), "stored");
        let (length, name_length, local) = (number(at + 20, 4), number(at + 28, 2), number(at + 42, 4));
        let name = &bytes[at + 46..at + 46 + name_length];
        assert_eq!(&bytes[local..local + 4], b"PK\x03\x04");
        assert_eq!(bytes[local + 14..local + 26], bytes[at + 16..at + 28], "both headers agree");
        assert_eq!(&bytes[local + 30..local + 30 + name_length], name);
        let content = &bytes[local + 30 + name_length..][..length];
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        assert!(files.insert(text(name), text(content)).is_none());
        at += 46 + name_length;
    }
    assert_eq!(at, end);
    files
}

#[test]
fn topics_of_bcf_can_be_read_back() {
    let directory = &parts();
    std::fs::rename(directory.join("parts/deep.obj"), directory.join("parts/2O2Fr$t4X7Zf8NOew3FLOH.obj"))
        .unwrap();
    directory.write("parts/a & b.obj", block([0.0, 0.0, 0.5], [1.0; 3], false));
    let write = |name: &str, epoch: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cbvh"));
        command
            .args(["clash", "parts", "--json", "--bcf", name])
            .current_dir(directory)
            .env("SOURCE_DATE_EPOCH", epoch);
        command.output().unwrap()
    };
    let answer: Value = serde_json::from_slice(&write("a.bcfzip", "951782400").stdout).unwrap();
    write("b.bcfzip", "951782400");
    let bytes = std::fs::read(directory.join("a.bcfzip")).unwrap();
    assert_eq!(bytes, std::fs::read(directory.join("b.bcfzip")).unwrap());
    let files = unzip(&bytes);
    let clashes = answer["clashes"].as_array().unwrap();
    assert_eq!(files.len(), 1 + 3 * clashes.len());
    let parsed =
        |text: &str| elements(text.strip_prefix("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n").unwrap());
    assert_eq!(parsed(&files["bcf.version"])[0].1["VersionId"], "2.1");
    let mut indices = Vec::new();
    for (name, text) in files.iter().filter(|(name, _)| name.ends_with("/markup.bcf")) {
        let folder = name.strip_suffix("/markup.bcf").unwrap();
        assert_eq!(files[&format!("{folder}/")], "", "an entry of the folder");
        let markup = parsed(text);
        let order: Vec<&str> = markup.iter().map(|(name, _)| &**name).collect();
        let fields =
            ["Markup", "Topic", "Title", "Priority", "Index", "Labels", "CreationDate", "CreationAuthor"];
        assert_eq!(order, [&fields[..], &["Description", "Viewpoints", "Viewpoint"]].concat());
        assert_eq!(markup[1].1["Guid"], folder);
        assert!(text.contains("<CreationDate>2000-02-29T00:00:00Z</CreationDate>"));
        let inner = |tag: &str| text.split(&format!("<{tag}>")).nth(1).unwrap().split('<').next().unwrap();
        let index: usize = inner("Index").parse().unwrap();
        assert!(inner("Title").starts_with(clashes[index]["class"].as_str().unwrap()));
        assert!(
            inner("Description").ends_with(&format!("Clash {}.", clashes[index]["id"].as_str().unwrap()))
        );
        indices.push(index);
        let view = &files[&format!("{folder}/viewpoint.bcfv")];
        let viewpoint = parsed(view);
        assert_eq!(viewpoint[0].1["Guid"], markup[9].1["Guid"]);
        assert_eq!(viewpoint.iter().filter(|(name, _)| name == "Component").count(), 2);
        let has_guid = viewpoint.iter().any(|(_, attributes)| attributes.contains_key("IfcGuid"));
        let named = ["a", "b"].map(|field| clashes[index][field].as_str().unwrap());
        assert_eq!(has_guid, named.contains(&"2O2Fr$t4X7Zf8NOew3FLOH"));
        assert!(
            named
                .iter()
                .all(|name| view.contains(&format!(">{}</AuthoringToolId>", name.replace('&', "&amp;"))))
        );
        let camera: Vec<f64> = ["<X>", "<Y>", "<Z>"]
            .iter()
            .flat_map(|tag| view.split(tag).skip(1))
            .map(|text| text.split('<').next().unwrap().parse().unwrap())
            .collect();
        // The camera looks at the clash: the position and a multiple of the direction lead there.
        let [from, towards, up] = [0, 1, 2].map(|which| [0, 3, 6].map(|axis| camera[axis + which]));
        let point = [0, 1, 2].map(|k| clashes[index]["point"][k].as_f64().unwrap());
        let away = (0..3).map(|k| (point[k] - from[k]) * towards[k]).sum::<f64>();
        assert!(away > 0.0 && (0..3).all(|k| (from[k] + away * towards[k] - point[k]).abs() < 1e-9));
        assert!((0..3).map(|k| up[k] * towards[k]).sum::<f64>().abs() < 1e-9);
    }
    indices.sort_unstable();
    assert_eq!(indices, (0..clashes.len()).collect::<Vec<_>>());
    assert!(
        String::from_utf8(write("c.bcfzip", "soon").stderr)
            .unwrap()
            .starts_with("cbvh: SOURCE_DATE_EPOCH: expected")
    );
    assert_eq!(names(directory), ["a.bcfzip", "b.bcfzip", "parts"]);
}
