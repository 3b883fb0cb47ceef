//! Bounds the cost of forged files: time by the product of both trees, memory by the number of treelets and the
//! file's bytes.
//!
//! The allocator itself counts the memory. The tests use the worst files that the rules allow: files in which every
//! bound is the same and encloses the whole other mesh, so that nothing is ever pruned, and tables that state numbers
//! of things that are not there.

use crate::allocator::peak;
use crate::common::shapes::soup;
use crate::common::{backends, mesh, options, translation};
use crate::forged::{blown_up, duplicated};
use bvh_bake::to_bytes;
use bvh_format::Layout as FileLayout;
use bvh_format::Rule;
use bvh_format::header::SectionKind;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::page::MAX_PACKETS_PER_PAGE;
use bvh_format::profile::Profile;
use bvh_format::source::MAX_BLOCK_BYTES;
use bvh_format::validate::validate;
use bvh_query::{Bvh, Querier, QueryError};
use cbvh_testkit::damage::overstated;
use cbvh_testkit::seal::{put, put_together, seal_pages, take_apart};
use std::ops::ControlFlow;

/// Returns the numbers of treelets and of leaf packets of the only object.
fn sizes(bvh: &Bvh) -> (u64, u64) {
    let record = bvh.objects()[0].record();
    (record.treelets.get(), record.packets.get())
}

#[test]
fn a_walk_of_all_pairs_ends_in_bounded_memory() {
    for (profile, triangles) in
        [(Profile::Dop6U8, 3000), (Profile::Dop14U8, 1500), (Profile::Dop26U8Wide, 1500)]
    {
        let files = [1, 2].map(|seed| blown_up(triangles, seed, profile));
        for file in &files {
            validate(file).unwrap();
        }
        let [a, b] = files.map(|file| Bvh::from_bytes(file).unwrap());
        let ((treelets_a, packets_a), (treelets_b, packets_b)) = (sizes(&a), sizes(&b));
        // The triangles themselves are far apart, and only their bounds overlap.
        let pose = translation(100.0, 0.0, 0.0);
        for backend in backends() {
            let mut querier = Querier::with_backend(backend);
            let most_memory = 8192 * (treelets_a + treelets_b) + (4 << 20);
            let most_pairs = (treelets_a + packets_a) * (treelets_b + packets_b);
            let (memory, distance) = peak(|| querier.distance(&a, &b, &pose).unwrap().distance);
            let stats = querier.stats();
            assert!(distance > 50.0 && memory as u64 <= most_memory, "{memory} bytes, not {most_memory}");
            // Everything was visited once, except for the leaf pair of the first dive, which was visited twice.
            assert_eq!(stats.packet_tests, packets_a * packets_b + 1, "{profile:?}");
            assert!(stats.node_tests <= 4 * most_pairs, "{stats:?}, not {most_pairs}");
            let (memory, found) = peak(|| querier.collide(&a, &b, &pose).unwrap());
            let stats = querier.stats();
            assert!(!found && memory as u64 <= most_memory);
            assert_eq!(stats.packet_tests, packets_a * packets_b);
            assert!(stats.node_tests <= 4 * most_pairs);
        }
    }
}

/// Queries the same files with a budget: a query fails as soon as the budget is spent, and answers if it suffices.
#[test]
fn a_budget_ends_any_query() {
    let files = [1, 2].map(|seed| blown_up(1500, seed, Profile::Dop14U8));
    let [a, b] = files.map(|file| Bvh::from_bytes(file).unwrap());
    let ((treelets_a, packets_a), (treelets_b, packets_b)) = (sizes(&a), sizes(&b));
    let pose = translation(100.0, 0.0, 0.0);
    let mut querier = Querier::new().unwrap();
    type Ask<'a> = &'a dyn Fn(&mut Querier) -> Result<f64, QueryError>;
    let asks: [Ask; 4] = [
        &|querier| querier.distance(&a, &b, &pose).map(|distance| distance.distance),
        &|querier| querier.collide(&a, &b, &pose).map(f64::from),
        &|querier| querier.contacts(&a, &b, &pose).map(|contacts| contacts.len() as f64),
        &|querier| querier.within(&a, &b, &pose, 50.0).map(f64::from),
    ];
    for ask in asks {
        let free = ask(&mut querier);
        assert!(free.is_ok());
        for budget in [0, 1, 1000] {
            querier.set_budget(budget);
            assert_eq!(ask(&mut querier), Err(QueryError::Budget { visits: budget }));
        }
        // The budget covers every pair of nodes, the first dive a second time, and the pair of objects.
        querier.set_budget((treelets_a + packets_a) * (treelets_b + packets_b) + 100);
        assert_eq!(ask(&mut querier), free);
        querier.set_budget(u64::MAX);
    }
    // A pair of objects whose spheres are apart costs one visit.
    let far = translation(1e6, 0.0, 0.0);
    querier.set_budget(1);
    assert_eq!(querier.collide(&a, &b, &far), Ok(false));
    querier.set_budget(0);
    assert_eq!(querier.collide(&a, &b, &far), Err(QueryError::Budget { visits: 0 }));
}

/// Gives all triangles the same id, to which all duplicates belong. Each contact would stand for thousands.
#[test]
fn contacts_without_number_are_refused() {
    let forged = Bvh::from_bytes(duplicated(2999)).unwrap();
    let mut querier = Querier::new().unwrap();
    let mut calls = 0u64;
    let asked = querier.visit_contacts(&forged, &forged, &translation(0.5, 0.25, 0.125), |_| {
        calls += 1;
        ControlFlow::Continue(())
    });
    let refused = matches!(&asked, Err(QueryError::Damaged(error)) if error.rule == Rule::DuplicateIds);
    assert!(refused, "{asked:?} after {calls} calls");
    let most = 4 * MAX_PACKETS_PER_PAGE as u64 + 2999;
    assert_eq!(calls, most * most);
    calls = 0;
    let asked = querier.visit_self_contacts(&forged, |_| {
        calls += 1;
        ControlFlow::Continue(())
    });
    let refused = matches!(&asked, Err(QueryError::Damaged(error)) if error.rule == Rule::DuplicateIds);
    assert!(refused, "{asked:?} after {calls} calls");
    assert_eq!(calls, most * most / 2);
}

/// The memory for opening and checking depends on the bytes that are there, not on the numbers that they state.
#[test]
fn stated_numbers_allocate_nothing() {
    let (honest, _) =
        to_bytes(&mesh(&soup(3000, 1)), &options(Profile::Dop14U8, TriangleEncoding::Packed)).unwrap();
    for (stated, bytes) in overstated(&honest) {
        let length = bytes.len();
        let (memory, opened) = peak(|| FileLayout::read(&bytes).is_ok());
        assert!(memory <= 16 << 10, "{stated}: {memory} bytes to open");
        let (memory, _) = peak(|| validate(&bytes).is_ok());
        assert!(memory <= length / 64 + (16 << 10), "{stated}: {memory} bytes to validate");
        let (memory, bvh) = peak(|| Bvh::from_bytes(bytes));
        assert!(memory <= 16 << 10, "{stated}: {memory} bytes beside the file");
        assert_eq!(bvh.is_ok(), opened);
    }
}

/// Copies of names that all share the same bytes would take memory quadratic in the file's size.
#[test]
fn shared_names_are_not_copied() {
    let golden = std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-plain.cbvh")).unwrap();
    let mut sections = take_apart(&golden);
    let (table, page) = (sections[0].2.clone(), sections[1].2[..4096].to_vec());
    let (count, names) = (200u32, vec![b'n'; 100_000]);
    let mut objects = table[..16].to_vec();
    put(&mut objects, 0, &count.to_le_bytes());
    put(&mut objects, 4, &(names.len() as u32).to_le_bytes());
    for number in 0..count {
        let mut record = table[16..16 + 192].to_vec();
        put(&mut record, 0, &0u32.to_le_bytes());
        put(&mut record, 4, &(names.len() as u32).to_le_bytes());
        put(&mut record, 80, &number.to_le_bytes());
        objects.extend(record);
    }
    objects.extend(names);
    let length = objects.len();
    sections[0].2 = objects;
    sections[1].2 = page.repeat(count as usize);
    let bytes = put_together(&sections);
    let (memory, opened) = peak(|| FileLayout::read(&bytes).map(|_| ()));
    assert!(memory <= 2 * length, "{memory} bytes for a table of {length}");
    assert_eq!(opened.unwrap_err().rule, Rule::ObjectTable);
}

/// Whoever claims the whole section as the block of one page would have it read again by each question.
#[test]
fn a_block_too_long_for_any_page_is_not_read() {
    let options = options(Profile::Dop14U8, TriangleEncoding::Packed);
    let mut bytes = to_bytes(&mesh(&soup(80_000, 1)), &options).unwrap().0;
    let layout = FileLayout::read(&bytes).unwrap();
    let leaves = layout.sections.iter().find(|section| section.kind == SectionKind::Leaves).unwrap();
    let lines = (leaves.range.len() / 64) as u32;
    assert!(leaves.range.len() > MAX_BLOCK_BYTES);
    for page in 0..layout.page_count() {
        let at = layout.page_offset(page) as usize;
        put(&mut bytes, at + 24, &0u64.to_le_bytes());
        put(&mut bytes, at + 48, &lines.to_le_bytes());
    }
    seal_pages(&mut bytes);
    let forged = Bvh::from_bytes(bytes).unwrap();
    let refused = Querier::new().unwrap().contacts(&forged, &forged, &translation(0.0, 0.0, 0.0));
    // The checksum is wrong as well, but nobody computes it.
    assert!(matches!(refused, Err(QueryError::Damaged(error)) if error.rule == Rule::LeafPlace));
}
