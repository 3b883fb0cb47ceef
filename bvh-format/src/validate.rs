//! Checks the structure and the checksums of a whole file by the rules, page by page.

use crate::checksum::checksum;
use crate::checksum::hex;
use crate::error::{FormatError, ensure, require};
use crate::ids::decode_id;
use crate::layout::{ContentHasher, Layout};
use crate::leaf::{PACKET, PackedHead, Packet, TriangleEncoding, decode_packet};
use crate::object::{MAX_COORDINATE, Object};
use crate::page::{Page, check_crossing, check_page};
use crate::rule::Rule;
use crate::treelet::{Child, Links};

/// Checks structure and checksums of the whole file.
///
/// Cost: two passes over the bytes and 48 bytes of memory a page. Its parts are public for those who
/// check pages in parallel.
///
/// # Errors
/// The first rule that does not hold; bounds (rule 35) are [`crate::bounds::check_bounds`]' business.
pub fn validate(bytes: &[u8]) -> Result<Layout, FormatError> {
    let layout = validate_sections(bytes)?;
    for object in &layout.objects {
        let pages = object.pages();
        let checked = pages.clone().map(|number| validate_page(&layout, bytes, object, number));
        let counts = checked.collect::<Result<Vec<_>, _>>()?;
        pages.clone().try_for_each(|number| validate_links(&layout, bytes, object, number))?;
        validate_counts(&layout, object, &counts)?;
    }
    Ok(layout)
}

/// Checks the header, the tables, the checksums of whole sections and the duplicate ids.
///
/// # Errors
/// The first of rules 1 to 14 and 36 that does not hold.
pub fn validate_sections(bytes: &[u8]) -> Result<Layout, FormatError> {
    let layout = Layout::read(bytes)?;
    let mut content = ContentHasher::default();
    for section in &layout.sections {
        let data = &bytes[section.range.clone()];
        let at = section.range.start as u64;
        require(Rule::SectionChecksum, at, hex(section.checksum), hex(checksum(data)))?;
        if section.kind.is_content() {
            content.begin(section.kind, data.len() as u64);
            content.update(data);
        }
    }
    require(Rule::SectionChecksum, 24, hex(layout.content_checksum), hex(content.finish()))?;
    layout.check_duplicates(bytes)?;
    Ok(layout)
}

/// What a page has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    first_packet: u64,
    treelets: u64,
    packets: u64,
    triangles: u64,
    roots: u64,
    remotes: u64,
}

/// Checks a page and its blocks value by value, all but where its links lead.
///
/// # Errors
/// The first of rules 15 to 33, 37 and 38 that does not hold.
pub fn validate_page(
    layout: &Layout,
    bytes: &[u8],
    object: &Object,
    number: u32,
) -> Result<Counts, FormatError> {
    let page = page_of(layout, bytes, object, number)?;
    let blocks = [layout.leaf_block(bytes, page.header()), layout.id_block(bytes, page.header())];
    validate_page_of(layout, object, number, &page, blocks)
}

/// [`validate_page`] of a page with its leaf block and its id block, wherever they are: for those who go through a file
/// piece by piece. A block that is not within its section is given as empty.
///
/// # Errors
/// As [`validate_page`].
pub fn validate_page_of(
    layout: &Layout,
    object: &Object,
    number: u32,
    page: &Page,
    blocks: [&[u8]; 2],
) -> Result<Counts, FormatError> {
    check_page(page.bytes(), number, object, layout.page_offset(number))?;
    let header = page.header();
    Ok(Counts {
        first_packet: header.first_packet.get().into(),
        treelets: header.treelets.into(),
        packets: header.packets.get().into(),
        triangles: check_leaves(layout, object, page, blocks)?,
        roots: header.roots.into(),
        remotes: header.remotes.into(),
    })
}

/// Checks where the links of a page lead, after all pages have been checked.
///
/// # Errors
/// Rule 20.
pub fn validate_links(
    layout: &Layout,
    bytes: &[u8],
    object: &Object,
    number: u32,
) -> Result<(), FormatError> {
    let page = page_of(layout, bytes, object, number)?;
    for link in 0..page.header().remotes {
        let to = page.remote(link);
        let target = page_of(layout, bytes, object, to.page())?;
        check_crossing(&target, to, number, link, layout.page_offset(to.page()))?;
    }
    Ok(())
}

/// Checks the sums of what an object's pages have, in their order, after their links.
///
/// # Errors
/// Rule 34.
pub fn validate_counts(layout: &Layout, object: &Object, pages: &[Counts]) -> Result<(), FormatError> {
    let mut sum = Counts::default();
    for (number, counts) in object.pages().zip(pages) {
        require(Rule::Counts, layout.page_offset(number) + 40, sum.packets, counts.first_packet)?;
        sum.add(counts);
    }
    sum.check(layout, object)
}

/// Checks the same sums for those who go through an object's pages from the last to the first.
#[derive(Debug, Default)]
pub struct CountsFromEnd {
    sum: Counts,
    /// `first_packet` of the page added last, with its number.
    next: Option<(u32, u64)>,
}

impl CountsFromEnd {
    /// Adds the page before the one added last.
    ///
    /// # Errors
    /// Rule 34.
    pub fn add(&mut self, layout: &Layout, number: u32, counts: &Counts) -> Result<(), FormatError> {
        if let Some((page, first)) = self.next {
            let expected = counts.first_packet + counts.packets;
            require(Rule::Counts, layout.page_offset(page) + 40, expected, first)?;
        }
        self.next = Some((number, counts.first_packet));
        self.sum.add(counts);
        Ok(())
    }

    /// After the first page of the object.
    ///
    /// # Errors
    /// Rule 34.
    pub fn finish(self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        if let Some((page, first)) = self.next {
            require(Rule::Counts, layout.page_offset(page) + 40, 0, first)?;
        }
        self.sum.check(layout, object)
    }
}

impl Counts {
    fn add(&mut self, page: &Counts) {
        self.treelets += page.treelets;
        self.packets += page.packets;
        self.triangles += page.triangles;
        self.roots += page.roots;
        self.remotes += page.remotes;
    }

    /// Compares the sum over an object's pages with its record.
    fn check(&self, layout: &Layout, object: &Object) -> Result<(), FormatError> {
        let record = &object.record;
        let at = layout.page_offset(record.first_page.get());
        // Each link has been followed to a root that names it back: no two share a root, so that equal
        // numbers leave no root without a way to it.
        require(Rule::Counts, at, self.remotes + 1, self.roots)?;
        let found = [self.treelets, self.packets, self.triangles];
        let stated = [record.treelets.get(), record.packets.get(), record.triangles.get()];
        ensure(found == stated, Rule::Counts, at, || {
            (format!("treelets, packets, triangles {stated:?}"), format!("{found:?}"))
        })
    }
}

/// A page, not checked.
fn page_of<'a>(
    layout: &Layout,
    bytes: &'a [u8],
    object: &Object,
    number: u32,
) -> Result<Page<'a>, FormatError> {
    let at = layout.page_offset(number);
    let page = layout.page_bytes(bytes, number);
    let missing = || FormatError::new(Rule::ObjectPages, at, "a page", "the end of the section");
    Ok(Page::new(page.ok_or_else(missing)?, object.profile))
}

/// Checks a page's leaf and id blocks value by value; returns the number of its triangles.
fn check_leaves(
    layout: &Layout,
    object: &Object,
    page: &Page,
    [block, ids]: [&[u8]; 2],
) -> Result<u64, FormatError> {
    layout.check_leaf_bytes(block, page, object)?;
    layout.check_id_bytes(ids, page)?;
    let header = page.header();
    let at = layout.page_offset(header.page_number.get());
    let origin = object.record.origin.map(|o| o.get());
    let mut triangles = 0;
    for (packet, count) in packets(page) {
        triangles += count as u64;
        if object.triangle_encoding != TriangleEncoding::F32 {
            check_indices(block, usize::from(packet), at)?;
        }
        let values = decode_packet(object.triangle_encoding, block, usize::from(packet));
        check_vertices(&values, origin, at)?;
        for lane in 0..if ids.is_empty() { 0 } else { count } {
            let id = u64::from(decode_id(ids, usize::from(packet), lane));
            ensure(id < object.record.input_triangles.get(), Rule::IdRange, at + 32, || {
                (format!("below {}", object.record.input_triangles), id.to_string())
            })?;
        }
    }
    Ok(triangles)
}

fn check_indices(block: &[u8], packet: usize, at: u64) -> Result<(), FormatError> {
    let Some(head) = PackedHead::read(block) else { return Ok(()) };
    for place in 0..3 * PACKET {
        let index = head.index(block, packet, place);
        ensure(index < u32::from(head.vertices), Rule::PackedIndex, at + 24, || {
            (format!("below {}", head.vertices), index.to_string())
        })?;
    }
    Ok(())
}

fn check_vertices(packet: &Packet, origin: [f64; 3], at: u64) -> Result<(), FormatError> {
    for corner in &packet.corners {
        for axis in 0..3 {
            for value in corner[axis].map(f64::from) {
                ensure(value.abs() <= MAX_COORDINATE, Rule::VertexFinite, at + 24, || {
                    ("a finite coordinate of at most 2^120".into(), value.to_string())
                })?;
                let sum = origin[axis] + value;
                let exact = sum - origin[axis] == value && sum - value == origin[axis];
                ensure(exact, Rule::VertexOnGrid, at + 24, || {
                    (format!("{} + v exact", origin[axis]), value.to_string())
                })?;
            }
        }
    }
    Ok(())
}

/// The leaf packets of a checked page with their numbers of triangles, in slot order.
pub fn packets<'a>(page: &'a Page<'a>) -> impl Iterator<Item = (u16, usize)> + 'a {
    (0..page.header().treelets).flat_map(|slot| {
        let links = Links::read(page.treelet(slot));
        (0..8).filter_map(move |child| match links.child(child) {
            Child::Leaf { packet, triangles } => Some((packet, usize::from(triangles))),
            _ => None,
        })
    })
}
