//! Keeps decoded leaf packets: a packet meets several others in a query, and decoding it takes longer than a test.

use bvh_format::leaf::Packet;

/// Packets kept for each side: a few KiB, so that they stay in the first-level cache beside the memory of the walk.
const PACKETS_PER_CACHE: usize = 64;

/// The packets decoded last. A packet has one place, which follows from its number.
pub(crate) struct PacketCache {
    /// Query, page and number of the packet in each place.
    keys: [u64; PACKETS_PER_CACHE],
    packets: Box<[Packet; PACKETS_PER_CACHE]>,
    query: u64,
}

impl Default for PacketCache {
    fn default() -> Self {
        Self {
            keys: [0; PACKETS_PER_CACHE],
            packets: Box::new([Packet::default(); PACKETS_PER_CACHE]),
            query: 0,
        }
    }
}

impl PacketCache {
    /// Forgets all packets, before a query.
    pub(crate) fn start(&mut self) {
        // The key has 22 bits for the query; 0 stands for none.
        self.query = (self.query + 1) % (1 << 22);
        if self.query == 0 {
            self.keys = [0; PACKETS_PER_CACHE];
            self.query = 1;
        }
    }

    /// Returns the place of a packet, and whether the packet is there. If it is not, the caller puts it there.
    #[inline(always)]
    pub(crate) fn place(&mut self, page: u32, packet: u16) -> (bool, &mut Packet) {
        let key = self.query << 42 | u64::from(page) << 16 | u64::from(packet);
        let place = (page as usize * 37 + usize::from(packet)) % PACKETS_PER_CACHE;
        let known = std::mem::replace(&mut self.keys[place], key) == key;
        (known, &mut self.packets[place])
    }
}
