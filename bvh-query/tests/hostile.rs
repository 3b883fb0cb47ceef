//! Queries damaged and forged files: whatever the bytes are, no query panics or hangs, and damage either is refused
//! or leaves the answers as they were.

mod common;

use bvh_bake::Options;
use bvh_bake::to_bytes;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::page::Page;
use bvh_format::profile::Profile;
use bvh_format::validate::validate;
use bvh_format::{Layout, Rule};
use bvh_query::{Bvh, DistanceOptions, Pose, Querier, QueryError};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::seal::{put, seal, seal_header, section};
use common::asked::{Answers, ask, place_in_file, victims};
use common::shapes::{soup, sphere};
use common::{Random, mesh, options, queriers, random_pose, translation};
use std::path::Path;
use std::time::{Duration, Instant};

/// Changes some bytes: flips a bit, sets a byte, writes a number that is often a limit, or copies a stretch.
fn mutate(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..1 + random.below(3) {
        let at = place_in_file(bytes, random);
        match random.below(6) {
            0 | 1 => bytes[at] ^= 1 << random.below(8),
            2 => bytes[at] = random.bits() as u8,
            3 => {
                let values: [u32; 8] =
                    [0, 1, u32::MAX, 0x7f80_0000, 0xff80_0000, 0x7fc0_0000, 0x8000_0000, 0x7f7f_ffff];
                let at = (at & !3).min(bytes.len() - 4);
                put(bytes, at, &values[random.below(8)].to_le_bytes());
            }
            4 => {
                let length = random.below(128).min(bytes.len() - at);
                let from = random.below(bytes.len() - length);
                bytes.copy_within(from..from + length, at);
            }
            _ => bytes[at] = bytes[at].wrapping_add(1),
        }
    }
}

/// Cuts off the end of the file, or appends bytes to it.
fn truncate(bytes: &mut Vec<u8>, random: &mut Random) {
    match random.below(3) {
        0 => bytes.truncate(random.below(bytes.len())),
        1 => bytes.truncate(4096 * random.below(bytes.len() / 4096)),
        _ => bytes.extend((0..random.below(5000)).map(|i| i as u8)),
    }
}

#[test]
fn damage_is_refused_or_does_not_matter() {
    let good = Bvh::from_bytes(to_bytes(&mesh(&sphere(1)), &Options::default()).unwrap().0).unwrap();
    let poses = [Pose::IDENTITY, translation(1.5, 0.25, 0.0), random_pose(&mut Random::new(1), 2.5)];
    let mut queriers = queriers();
    let mut random = Random::new(77);
    let (mut refused, mut slowest) = (0, Duration::ZERO);
    let damaged = rounds(200);
    for victim in victims() {
        let expected = poses.map(|pose| ask(&mut queriers[0], &victim, &good, &pose).unwrap());
        for round in 0..damaged {
            let mut bytes = victim.clone();
            if round % 10 == 9 {
                truncate(&mut bytes, &mut random)
            } else {
                mutate(&mut bytes, &mut random)
            }
            let whole = validate(&bytes);
            let (which, backend) = (random.below(3), random.below(queriers.len()));
            let start = Instant::now();
            let answers = ask(&mut queriers[backend], &bytes, &good, &poses[which]);
            slowest = slowest.max(start.elapsed());
            refused += u64::from(whole.is_err());
            match answers {
                None => assert!(whole.is_err()),
                Some(answers) => {
                    // A query that meets no damage gives the usual answer, whatever the rest of the file contains.
                    for (answers, expected) in answers.iter().zip(&expected[which]) {
                        assert!(whole.is_err() || !answers.is_refused());
                        let holds = answers.are_refused_or(expected);
                        assert!(holds, "round {round}: {answers:?}, not {expected:?}");
                    }
                }
            }
        }
    }
    assert!(refused > 3 * damaged, "{refused}");
    assert!(slowest < Duration::from_secs(20), "{slowest:?}");
}

/// Makes all checksums right, so that only the rules protect the queries from the bytes.
#[test]
fn forgeries_do_no_harm() {
    let good = Bvh::from_bytes(to_bytes(&mesh(&sphere(1)), &Options::default()).unwrap().0).unwrap();
    let poses = [Pose::IDENTITY, translation(1.5, 0.25, 0.0), random_pose(&mut Random::new(2), 2.5)];
    let mut queriers = queriers();
    let mut random = Random::new(78);
    let (mut refused, mut opened, mut slowest) = (0, 0, Duration::ZERO);
    let forged = rounds(150);
    for victim in victims() {
        for round in 0..forged {
            let mut bytes = victim.clone();
            mutate(&mut bytes, &mut random);
            if round % 10 == 9 {
                // A changed table is kept, and only its checksum is corrected.
                seal_header(&mut bytes);
            } else {
                seal(&mut bytes);
            }
            let whole = validate(&bytes);
            refused += u64::from(whole.is_err());
            let start = Instant::now();
            let backend = random.below(queriers.len());
            let answers = ask(&mut queriers[backend], &bytes, &good, &poses[random.below(3)]);
            slowest = slowest.max(start.elapsed());
            opened += u64::from(answers.is_some());
            if let (Ok(_), Some(answers)) = (&whole, &answers) {
                assert!(!answers.iter().any(Answers::is_refused), "valid, but {answers:?}");
            }
        }
    }
    assert!(3 * refused > 4 * forged && opened > 2 * forged, "{refused} refused, {opened} opened");
    assert!(slowest < Duration::from_secs(20), "{slowest:?}");
}

#[test]
fn the_frozen_bad_files_do_no_harm() {
    let good = Bvh::from_bytes(to_bytes(&mesh(&sphere(1)), &Options::default()).unwrap().0).unwrap();
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
        // Files that break rules 10, 33, 34, 36 and 37 are refused only when the whole file is checked.
        let bvh = Bvh::read(&path);
        assert_eq!(bvh.is_err(), rule < 15 && rule != 10, "{name}");
        seen += 1;
    }
    assert!(seen >= 37, "{seen}");
}

/// Links between pages are forged: a link and the root to which it leads must name each other.
#[test]
fn links_and_roots_have_to_name_each_other() {
    let good = Bvh::from_bytes(to_bytes(&mesh(&sphere(1)), &Options::default()).unwrap().0).unwrap();
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
    let good = Bvh::from_bytes(to_bytes(&mesh(&sphere(1)), &Options::default()).unwrap().0).unwrap();
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
