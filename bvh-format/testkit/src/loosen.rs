//! Makes bounds of a file looser than they need to be, by any amount: every rule but the one that an edit is about still
//! holds, and so must every answer.

use crate::seal::{put, seal, section};
use bvh_format::Layout;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::page::{PAGE_HEADER_BYTES, Page};
use bvh_format::profile::{Encoding, Profile};
use bvh_format::slabs::row;
use bvh_format::treelet::SHORT_TREELET_BYTES;
use bvh_format::turning::TurningDirection;

/// A file under change. Checksums are corrected at the end.
pub struct Loosened {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    layout: Layout,
}

/// A subtree root: the page and the number of the root in it.
pub type Root = (u32, u8);

impl Loosened {
    /// Starts from a valid file of one object.
    ///
    /// # Panics
    /// Panics if the file breaks a rule that is checked when a file is opened.
    pub fn of(bytes: &[u8]) -> Self {
        Self { bytes: bytes.to_vec(), layout: Layout::read(bytes).expect("a valid file") }
    }

    /// Returns the file with correct checksums.
    pub fn sealed(mut self) -> Vec<u8> {
        seal(&mut self.bytes);
        self.bytes
    }

    /// Returns the object's profile.
    pub fn profile(&self) -> Profile {
        self.layout.objects[0].profile()
    }

    /// Returns the subtree roots that remote links lead to.
    pub fn remote_roots(&self) -> Vec<Root> {
        let roots = |page: u32| (0..self.page(page).header().roots).map(move |root| (page, root));
        (0..self.layout.page_count()).flat_map(roots).skip(1).collect()
    }

    /// Moves an end of a slab of an anchor outward to `end`, if that is further out: the upper one, or the lower one.
    pub fn anchor(&mut self, (page, root): Root, slab: usize, upper: bool, end: f32) {
        let profile = self.profile();
        let number = if upper { profile.directions().slabs() + slab } else { slab };
        let at = PAGE_HEADER_BYTES + usize::from(root) * profile.anchor_bytes() + 4 * number;
        self.outward(self.layout.page_offset(page) as usize + at, upper, end);
    }

    /// Moves the ends of a slab of a subtree root outward to `lo` and `hi`, and lets the slab of each node from the root's page
    /// on reach as far as that of the node's own root. Turning slabs, which are measured from the box, go if that side changes.
    /// Ends that are stored as they are follow no anchor: they change only for the root of the object, all anchors with them.
    pub fn slab(&mut self, from: Root, slab: usize, lo: f32, hi: f32) {
        self.anchor(from, slab, false, lo);
        self.anchor(from, slab, true, hi);
        let profile = self.profile();
        let root = self.page(from.0).anchor_slabs(from.1);
        let (lo, hi) = (root.lo[row(slab)], root.hi[row(slab)]);
        if profile.encoding() == Encoding::F32 {
            if from != (0, 0) {
                return;
            }
            for root in self.remote_roots() {
                self.anchor(root, slab, false, lo);
                self.anchor(root, slab, true, hi);
            }
        }
        for page in from.0..self.layout.page_count() {
            let view = self.page(page);
            let slots: Vec<_> = (0..view.header().treelets)
                .map(|slot| (view.treelet_at(slot), view.treelet(slot).len(), view.links(slot).children()))
                .collect();
            for (at, length, children) in slots {
                let at = self.layout.page_offset(page) as usize + at;
                for child in 0..children {
                    let is_short = length == SHORT_TREELET_BYTES;
                    for (byte, bytes) in code_bytes(profile, is_short, child, slab, [lo, hi]) {
                        put(&mut self.bytes, at + byte, &bytes);
                    }
                    if profile.has_turning_slabs() && slab < 3 && self.turns_towards(at + child, slab) {
                        for byte in [28, 92, 56, 120] {
                            put(&mut self.bytes, at + byte + child, &[0]);
                        }
                    }
                }
            }
        }
    }

    /// Returns whether the turning slab of a child leads along an axis at all; else it does not depend on the box there.
    fn turns_towards(&self, child_at: usize, axis: usize) -> bool {
        let (a, b) = (self.bytes[child_at + 56], self.bytes[child_at + 120]);
        TurningDirection { a, b }.vector()[axis] != 0.0
    }

    /// Moves an end of the record's box outward to `end`, if that is further out.
    pub fn bounding_box(&mut self, axis: usize, upper: bool, end: f32) {
        let at = self.record() + 32 + 4 * (3 * usize::from(upper) + axis);
        self.outward(at, upper, end);
    }

    /// Moves the sphere's centre to `by` away along an axis, and makes the sphere larger by so much and a little more.
    pub fn sphere(&mut self, axis: usize, by: f32) {
        let at = [self.record() + 136 + 4 * axis, self.record() + 148];
        let centre = self.f32_at(at[0]) + by;
        put(&mut self.bytes, at[0], &centre.to_le_bytes());
        let radius = (self.f32_at(at[1]) + centre.abs() + by.abs()) * 1.000001;
        put(&mut self.bytes, at[1], &radius.to_le_bytes());
    }

    /// Multiplies the sphere's radius, which does not loosen it.
    pub fn shrink_sphere(&mut self, by: f32) {
        let at = self.record() + 148;
        let radius = self.f32_at(at) * by;
        put(&mut self.bytes, at, &radius.to_le_bytes());
    }

    /// Fills the lanes of leaf packets that hold no triangle with a coordinate. Only plain packets have room for it; returns how
    /// many lanes were filled.
    pub fn unused_lanes(&mut self, coordinate: f32) -> usize {
        if self.layout.objects[0].triangle_encoding() != TriangleEncoding::F32 {
            return 0;
        }
        let mut filled = 0;
        for page in 0..self.layout.page_count() {
            let view = self.page(page);
            let block = self.layout.leaf_block(&self.bytes, view.header());
            let at = block.as_ptr() as usize - self.bytes.as_ptr() as usize;
            let packets: Vec<_> = bvh_format::validate::packets(&view).collect();
            for (packet, triangles) in packets {
                for lane in triangles..4 {
                    for value in 0..9 {
                        let place = at + 144 * usize::from(packet) + 16 * value + 4 * lane;
                        put(&mut self.bytes, place, &coordinate.to_le_bytes());
                    }
                    filled += 1;
                }
            }
        }
        filled
    }

    fn page(&self, number: u32) -> Page<'_> {
        Page::new(self.layout.page_bytes(&self.bytes, number).expect("a page"), self.profile())
    }

    /// The byte at which the object's record starts.
    fn record(&self) -> usize {
        section(&self.bytes, 1).start + 16
    }

    fn f32_at(&self, at: usize) -> f32 {
        f32::from_le_bytes([self.bytes[at], self.bytes[at + 1], self.bytes[at + 2], self.bytes[at + 3]])
    }

    fn outward(&mut self, at: usize, upper: bool, end: f32) {
        let now = self.f32_at(at);
        let end = if upper { now.max(end) } else { now.min(end) };
        put(&mut self.bytes, at, &end.to_le_bytes());
    }
}

/// Returns the bytes of a treelet that make a child's slab as wide as the treelet's, whose ends are `ends`: codes of 0.
fn code_bytes(
    profile: Profile,
    is_short: bool,
    child: usize,
    slab: usize,
    ends: [f32; 2],
) -> Vec<(usize, Vec<u8>)> {
    let (row, width) = (row(slab), profile.width());
    let half = if is_short { SHORT_TREELET_BYTES } else { profile.treelet_bytes() } / 2;
    if is_short || profile.encoding() == Encoding::U4 || width == 8 {
        let column = if width == 8 { (child / 4) * half + child % 4 } else { child };
        let lo = 4 * row + column;
        let has_one_byte = is_short || profile.encoding() == Encoding::U4;
        let hi = if has_one_byte { lo } else { lo + half / 2 };
        return vec![(lo, vec![0]), (hi, vec![0])];
    }
    let size = match profile.encoding() {
        Encoding::F16 => 2,
        Encoding::F32 => 4,
        _ => 1,
    };
    let at = (row * width + child) * size;
    let bytes = |end: f32| if size == 4 { end.to_le_bytes().to_vec() } else { vec![0; size] };
    vec![(at, bytes(ends[0])), (at + half, bytes(ends[1]))]
}
