//! Queries files with known damage: the frozen bad files, links between pages that were forged, and a damaged page that a
//! query needs or does not need. `mutation.rs` searches for damage that does harm.

use crate::common::asked::ask;
use crate::common::shapes::{soup, sphere};
use crate::common::{baked, mesh, options, queriers, translation};
use bvh_bake::Options;
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::page::Page;
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use bvh_format::{Layout, Rule};
use bvh_query::{Bvh, DistanceOptions, Pose, Querier, QueryError};
use cbvh_testkit::seal::{put, seal, section};
use std::path::Path;

#[test]
fn the_frozen_bad_files_do_no_harm() {
    let good = baked(&sphere(1));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../testdata");
    let mut queriers = queriers();
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let Some(rule) = name.strip_prefix("bad-R").map(|rest| rest[..2].parse::<u32>().unwrap()) else {
            continue;
        };
        let bytes = std::fs::read(&path).unwrap();
        // B is placed around the file's cube, so that the query reaches the leaves.
        for offset in [[0.0; 3], [1e6, -2e6, 0.0]] {
            for querier in &mut queriers {
                let pose = translation(offset[0], offset[1], offset[2]);
                let answers = ask(querier, &bytes, &good, &pose);
                assert_eq!(answers.is_none(), rule < 15 && rule != 10, "{name}: {answers:?}");
            }
        }
        // Some files are refused only when the whole file is checked.
        let bvh = Bvh::read(&path);
        assert_eq!(bvh.is_err(), rule < 15 && rule != 10, "{name}");
        if let Ok(bvh) = bvh {
            let refused = bvh.validate().unwrap_err().to_string();
            // Where a section is damaged in a page, the page is named.
            let rule = if rule == 10 { 15 } else { rule };
            assert!(refused.contains(&format!("R{rule:02}")), "{name}: {refused}");
        }
        seen += 1;
    }
    assert!(seen >= 37, "{seen}");
}

/// Links between pages are forged: a link and the root to which it leads must name each other.
#[test]
fn links_and_roots_have_to_name_each_other() {
    let good = baked(&sphere(1));
    let mesh = mesh(&soup(3000, 5));
    let file = to_bytes(&mesh, &options(Profile::Dop14U8, TriangleEncoding::F32)).unwrap().0;
    let layout = Layout::read(&file).unwrap();
    assert!(layout.page_count() > 2);
    let profile = layout.objects[0].profile();
    let page = Page::new(layout.page_bytes(&file, 0).unwrap(), profile);
    let links_at =
        layout.page_offset(0) as usize + 64 + usize::from(page.header().roots) * profile.anchor_bytes();
    let (first, second) = (page.remote(0), page.remote(1));
    let forged = |edit: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = file.clone();
        edit(&mut bytes);
        seal(&mut bytes);
        bytes
    };
    let parent_at = |page: u32, root: u8| {
        layout.page_offset(page) as usize
            + 64
            + usize::from(root) * profile.anchor_bytes()
            + profile.anchor_bytes()
            - 8
    };
    let twice = forged(&|bytes| put(bytes, links_at + 4, &first.0.to_le_bytes()));
    let backwards = forged(&|bytes| put(bytes, links_at, &0u32.to_le_bytes()));
    let no_such_root = forged(&|bytes| put(bytes, links_at, &(first.0 | 63).to_le_bytes()));
    let other_link = forged(&|bytes| put(bytes, parent_at(second.page(), second.root()) + 4, &[9]));
    let other_page = forged(&|bytes| put(bytes, parent_at(first.page(), first.root()), &7u32.to_le_bytes()));
    for (what, bytes, rule) in [
        ("twice", twice, Rule::AnchorParent),
        ("backwards", backwards, Rule::RemoteLinks),
        ("no such root", no_such_root, Rule::AnchorParent),
        ("other link", other_link, Rule::AnchorParent),
        ("other page", other_page, Rule::AnchorParent),
    ] {
        assert_eq!(validate(&bytes).unwrap_err().rule, rule, "{what}");
        for querier in &mut queriers() {
            // The sphere crosses the whole mesh, so that every page is needed.
            let [answers, _] = ask(querier, &bytes, &good, &Pose::IDENTITY).unwrap();
            assert!(answers.contacts.is_err(), "{what}: {answers:?}");
        }
    }
}

/// Damage in one page does not affect queries that do not need that page.
#[test]
fn far_damage_goes_unnoticed_and_near_damage_does_not() {
    let good = baked(&sphere(1));
    let mut file = to_bytes(&mesh(&soup(20_000, 5)), &Options::default()).unwrap().0;
    let layout = Layout::read(&file).unwrap();
    let last = layout.page_count() - 1;
    let at = layout.page_offset(last) as usize + 100;
    file[at] ^= 1;
    assert!(validate(&file).is_err());
    let bvh = Bvh::from_bytes(file).unwrap();
    let mut querier = Querier::new().unwrap();
    assert_eq!(querier.collide(&bvh, &good, &translation(100.0, 0.0, 0.0)), Ok(false));
    let refused = querier.contacts(&bvh, &bvh, &Pose::IDENTITY);
    assert!(matches!(refused, Err(QueryError::Damaged(error)) if error.rule == Rule::PageChecksum));
    // Ask again: a page must not count as valid because it was checked before.
    assert!(querier.contacts(&bvh, &bvh, &Pose::IDENTITY).is_err());
    let options = DistanceOptions::new().rel_err(0.1);
    assert!(querier.distance_with(&bvh, &bvh, &Pose::IDENTITY, &options).is_ok_and(|d| d.distance == 0.0));
    assert!(section(bvh.bytes(), 2).contains(&at));
}
