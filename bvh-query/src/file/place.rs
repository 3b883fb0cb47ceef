//! Where leaf packets and triangles are stored in a file.

/// A leaf packet: its page, its number in the page, and how many triangles it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LeafPacket {
    pub(crate) page: u32,
    pub(crate) packet: u16,
    pub(crate) triangles: u8,
}

/// Where a triangle is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct TrianglePlace {
    pub(crate) page: u32,
    pub(crate) packet: u16,
    pub(crate) lane: u8,
}
