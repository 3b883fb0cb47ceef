//! Leaf packets of encoded triangles, decoded about once a query: a packet meets several others.

use bvh_format::leaf::Packet;

/// Packets of one side that are kept: a few KiB, so that they stay in the first cache beside the walk's own memory.
const KEPT: usize = 64;

/// The packets decoded last, each in the one place that its number leads to.
pub(crate) struct Decoded {
    /// Query, page and number of the packet in each place.
    keys: [u64; KEPT],
    packets: Box<[Packet; KEPT]>,
    query: u64,
}

impl Default for Decoded {
    fn default() -> Self {
        Self { keys: [0; KEPT], packets: Box::new([Packet::default(); KEPT]), query: 0 }
    }
}

impl Decoded {
    /// Forgets all packets.
    pub(crate) fn start(&mut self) {
        // 22 bits, of which 0 stands for no query.
        self.query = (self.query + 1) % (1 << 22);
        if self.query == 0 {
            self.keys = [0; KEPT];
            self.query = 1;
        }
    }

    /// The place of a packet, and whether it is there; if not, the caller is to put it there.
    #[inline(always)]
    pub(crate) fn place(&mut self, page: u32, packet: u16) -> (bool, &mut Packet) {
        let key = self.query << 42 | u64::from(page) << 16 | u64::from(packet);
        let place = (page as usize * 37 + usize::from(packet)) % KEPT;
        let known = std::mem::replace(&mut self.keys[place], key) == key;
        (known, &mut self.packets[place])
    }
}
