//! Lists the sections and objects of a `.cbvh` file, and walks each tree from its root to count the triangles.
//!
//! Run it with `cargo run -p bvh-format --example inspect -- FILE.cbvh`. Without a file it reads one of the project's
//! test files.
#![allow(clippy::print_stdout, reason = "an example shows what it finds")]

use bvh_format::Layout;
use bvh_format::header::version_name;
use bvh_format::object::Object;
use bvh_format::page::{Page, check_page, check_parent};
use bvh_format::treelet::Child;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/../testdata/ok-everything.cbvh");
    let path = std::env::args().nth(1).unwrap_or_else(|| default.to_owned());
    let bytes = std::fs::read(path)?;

    // Reads and checks the head of the file and the object table, and nothing else.
    let layout = Layout::read(&bytes)?;
    println!("version {}, {} bytes", version_name(layout.version), bytes.len());
    for section in &layout.sections {
        println!(
            "section {:10} {:8} bytes at {}",
            section.kind.name(),
            section.range.len(),
            section.range.start
        );
    }
    for object in &layout.objects {
        let [lower, upper] = object.bounding_box();
        println!(
            "object {:?}: {} triangles between {lower:?} and {upper:?}, {} with {} triangles",
            object.name(),
            object.triangles(),
            object.profile().name(),
            object.triangle_encoding().name(),
        );
        println!("  counted from the root: {} triangles", count_triangles(&layout, &bytes, object)?);
    }
    Ok(())
}

/// Visits each treelet of an object once. Each page is checked when the walk enters it, and each crossing to another
/// page when the walk takes it, so the walk ends on any bytes.
fn count_triangles(layout: &Layout, bytes: &[u8], object: &Object) -> Result<u64, Box<dyn Error>> {
    let page_of = |number: u32| {
        let page = layout.page_bytes(bytes, number).ok_or("the file has no such page")?;
        check_page(page, number, object, layout.page_offset(number))?;
        Ok::<_, Box<dyn Error>>(Page::new(page, object.profile()))
    };
    let mut triangles = 0;
    // A stack of treelets by page and slot. The root of an object is in slot 0 of the object's first page.
    let mut stack = vec![(object.pages().start, 0)];
    while let Some((number, slot)) = stack.pop() {
        let page = page_of(number)?;
        let links = page.links(slot);
        for child in 0..links.children() {
            match links.child(child) {
                Child::Treelet(slot) => stack.push((number, slot)),
                Child::Remote(link) => {
                    let to = page.remote(link);
                    let target = page_of(to.page())?;
                    check_parent(&target, to, (number, link), layout.page_offset(to.page()))?;
                    stack.push((to.page(), to.root()));
                }
                Child::Leaf { triangles: count, .. } => triangles += u64::from(count),
                Child::Empty => {}
            }
        }
    }
    Ok(triangles)
}
