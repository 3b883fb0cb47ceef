//! Checks the topology of an object against its pages, once these have been checked.
//!
//! Places ascend, and so do the packets of pages. A cursor goes through the pages once, and skips those between two
//! places in steps that double, so a short list costs a few pages.

use super::packets;
use crate::error::ensure;
use crate::layout::Layout;
use crate::leaf::{VertexBlock, decode_triangle};
use crate::object::Object;
use crate::rule::Rule;
use crate::source::{Block, PageBytes, Source};
use crate::topology::{LANES, Net, ObjectTopology, boundary_of, visit_list};
use zerocopy::little_endian::U32;

/// Checks that each place in an object's lists is that of a triangle, and that a closed object has no boundary. `sum` is
/// the sum of the boundaries of all triangles stored for a closed object, each counted once.
///
/// # Errors
/// The first of rules 46 and 48 that does not hold, or an error of the source.
pub fn check_in_pages<S: Source + ?Sized>(
    layout: &Layout,
    source: &S,
    object: &Object,
    topology: &ObjectTopology,
    mut sum: u64,
) -> Result<(), S::Error> {
    let mut pages = Cursor { layout, source, object, held: None };
    visit_list(source, &topology.components, |at, place: &U32| {
        pages.triangle(at, place.get())?;
        Ok::<_, S::Error>(())
    })?;
    let mut pages = Cursor { layout, source, object, held: None };
    visit_list(source, &topology.nets, |at, net: &Net| {
        let boundary = pages.triangle(at, net.place.get())?;
        let missing = i64::from(net.net.get()) - 1;
        sum = sum.wrapping_add(boundary.wrapping_mul(missing as u64));
        Ok::<_, S::Error>(())
    })?;
    let at = layout.page_offset(object.pages().start);
    ensure(!topology.closed || sum == 0, Rule::TopologyClosed, at, || {
        ("a closed object without a boundary".into(), "edges that do not cancel".into())
    })?;
    Ok(())
}

/// Reads the triangles at ascending places.
struct Cursor<'a, S: ?Sized> {
    layout: &'a Layout,
    source: &'a S,
    object: &'a Object,
    held: Option<HeldPage<'a>>,
}

/// A page that has been checked, with what it holds.
struct HeldPage<'a> {
    number: u32,
    first_packet: u64,
    /// The number of triangles in each packet.
    triangles: Vec<usize>,
    block: Block<'a>,
}

impl<'a, S: Source + ?Sized> Cursor<'a, S> {
    /// Returns the boundary of the triangle at a place, which the file states at byte `at`.
    ///
    /// # Errors
    /// Rule 46 if there is none, or an error of the source.
    fn triangle(&mut self, at: u64, place: u32) -> Result<u64, S::Error> {
        let (packet, lane) = (u64::from(place) / LANES, u64::from(place) % LANES);
        let page = match self.held.take() {
            Some(held) if packet < held.first_packet + held.triangles.len() as u64 => held,
            held => self.hold(self.page_of(packet, held.map(|held| held.number))?)?,
        };
        let page = self.held.insert(page);
        let packet = packet.checked_sub(page.first_packet).map_or(usize::MAX, |packet| packet as usize);
        let triangles = page.triangles.get(packet).copied().unwrap_or(0);
        ensure(lane < triangles as u64, Rule::TopologyPlace, at, || {
            (
                "the place of a triangle".into(),
                format!("place {place}, of {triangles} triangles in its packet"),
            )
        })?;
        let (encoding, vertices, block) =
            (self.object.triangle_encoding, &self.object.vertices, page.block.bytes());
        let offsets = decode_triangle(encoding, block, packet, lane as usize);
        if !vertices.are_corrected() {
            return Ok(boundary_of(&offsets, None));
        }
        let behind = VertexBlock::new(encoding, vertices, block, page.triangles.len());
        Ok(boundary_of(&offsets, Some(&behind.behind(packet, lane as usize, offsets))))
    }

    /// Returns the last page whose first packet is at most `packet`, from a page on for which this holds.
    fn page_of(&self, packet: u64, from: Option<u32>) -> Result<u32, S::Error> {
        let pages = self.object.pages();
        let (mut low, mut step) = (from.unwrap_or(pages.start), 1);
        let mut high = pages.end;
        // Steps double at first. Once the page is near, each halves what is left.
        while high - low > 1 {
            let middle = low + step.min((high - low) / 2).max(1);
            if u64::from(self.read(middle)?.page(self.object).header().first_packet.get()) <= packet {
                (low, step) = (middle, step.saturating_mul(2));
            } else {
                high = middle;
            }
        }
        Ok(low)
    }

    fn hold(&self, number: u32) -> Result<HeldPage<'a>, S::Error> {
        let bytes = self.read(number)?;
        let page = bytes.page(self.object);
        let mut triangles = vec![0; page.header().packets.get().into()];
        for (packet, count) in packets(&page) {
            if let Some(triangles) = triangles.get_mut(usize::from(packet)) {
                *triangles = count;
            }
        }
        let block = self.layout.read_leaf_block(self.source, page.header())?;
        Ok(HeldPage { number, first_packet: page.header().first_packet.get().into(), triangles, block })
    }

    fn read(&self, number: u32) -> Result<PageBytes<'a>, S::Error> {
        self.layout.read_page(self.source, number)
    }
}
