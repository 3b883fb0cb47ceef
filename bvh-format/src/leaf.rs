//! Leaf packets of up to four triangles in lane order, and the block of all packets of a page.
//!
//! A block has one of three forms. `F32` holds plain lanes, 144 bytes per packet: corner by corner, axis by axis, four
//! lanes. `Packed` holds each distinct vertex of the page once, and states for each packet which vertices its corners
//! are; if all packets hold points, it holds their vertices and states nothing: see [`PackedHead`]. `Quantized` has the same
//! forms as `Packed`, after the baker has moved the vertices to a grid. Lanes beyond a packet's triangles repeat its last
//! triangle. A block fills whole lines of 64 bytes.

mod encode;
mod packed;
mod patterns;

pub use packed::{PACKED_HEAD_BYTES, PackedHead, RECORD_HEAD_BITS, Record};
pub use patterns::{PATTERNS, order_of_lanes};

use crate::kdop::Kdop;
use bytemuck::{Pod, Zeroable};

/// Triangles in a full leaf packet.
pub const PACKET: usize = 4;
/// Bytes of a packet of plain lanes.
pub const F32_PACKET_BYTES: usize = 144;
/// Leaf blocks fill whole lines of this many bytes.
pub const LINE: usize = 64;

/// How the triangles of an object are stored.
///
/// The list is part of the major version of the format. It is not marked as non-exhaustive: code that has a case for
/// each encoding does not compile until it has one for a new encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum TriangleEncoding {
    /// Plain `f32` lanes, the fastest to load.
    F32 = 0,
    /// The same values bit for bit in fewer bytes.
    Packed = 1,
    /// Packed, after the baker has moved the vertices to a grid, by no more than a stated error.
    Quantized = 2,
}

impl TriangleEncoding {
    /// All encodings in the order of their numbers on disk.
    pub const ALL: [Self; 3] = [Self::F32, Self::Packed, Self::Quantized];

    /// Returns the encoding of a number on disk.
    pub(crate) fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Packed => "packed",
            Self::Quantized => "quantized",
        }
    }
}

/// Four triangles in lane order: `corners[corner][axis][lane]`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Packet {
    /// Coordinates in mesh units around the object's origin.
    pub corners: [[[f32; PACKET]; 3]; 3],
}

impl Packet {
    /// A packet of zeros, to be overwritten.
    pub const NONE: Self = Self { corners: [[[0.0; PACKET]; 3]; 3] };

    /// Makes a packet of one to four triangles. Lanes beyond them repeat the last triangle.
    pub fn new(triangles: &[[[f32; 3]; 3]]) -> Self {
        let mut packet = Self::default();
        for lane in 0..PACKET {
            let triangle = triangles[lane.min(triangles.len() - 1)];
            for corner in 0..3 {
                for axis in 0..3 {
                    packet.corners[corner][axis][lane] = triangle[corner][axis];
                }
            }
        }
        packet
    }

    /// The first `slabs` slabs of the tight k-DOP of the first `triangles` lanes, as [`Kdop::of_points`] finds them. The
    /// other slabs are empty.
    pub fn kdop(&self, triangles: usize, slabs: usize) -> Kdop {
        Kdop::of_lanes(&self.filled(triangles).corners, slabs)
    }

    /// Returns the packet in which all lanes beyond the first `triangles` repeat the last of these. A file from
    /// elsewhere may hold anything there.
    #[inline]
    pub(crate) fn filled(&self, triangles: usize) -> Self {
        let mut packet = *self;
        if (1..PACKET).contains(&triangles) {
            for lanes in packet.corners.iter_mut().flatten() {
                let last = lanes[triangles - 1];
                lanes[triangles..].fill(last);
            }
        }
        packet
    }

    /// The three corners of the triangle in a lane.
    #[inline]
    pub fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| self.corners[corner][axis][lane]))
    }
}

/// Makes the leaf block of a page, in whole lines.
///
/// `order` has the number of each packet once, with neighbours in space near each other. Vertices are stored in the
/// order in which these packets first use them, so that the vertices of a packet are in few lines.
pub fn encode_block(encoding: TriangleEncoding, packets: &[Packet], order: &[u16]) -> Vec<u8> {
    debug_assert_eq!(packets.len(), order.len());
    let mut block = match encoding {
        TriangleEncoding::F32 => encode_f32(packets),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => encode::packed(packets, order),
    };
    block.resize(block.len().next_multiple_of(LINE), 0);
    block
}

fn encode_f32(packets: &[Packet]) -> Vec<u8> {
    let mut block = Vec::with_capacity(packets.len() * F32_PACKET_BYTES + LINE);
    packets.iter().for_each(|packet| block.extend_from_slice(bytemuck::bytes_of(packet)));
    block
}

/// Reads packet `index` of an F32 block. Bytes beyond the block read as zero.
#[inline]
fn decode_f32(block: &[u8], index: usize) -> Packet {
    let start = index * F32_PACKET_BYTES;
    let Some(bytes) = block.get(start..start + F32_PACKET_BYTES) else { return Packet::default() };
    bytemuck::pod_read_unaligned(bytes)
}

/// Reads packet `index` of a block. Bytes beyond the block read as zero.
#[inline(always)]
pub fn decode_packet(encoding: TriangleEncoding, block: &[u8], index: usize) -> Packet {
    match encoding {
        TriangleEncoding::F32 => decode_f32(block, index),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => packed::decode(block, index),
    }
}

/// Reads one triangle of a packet, as `decode_packet(..).triangle(lane)` does but at less cost. Bytes beyond the block
/// read as zero.
#[inline]
pub fn decode_triangle(encoding: TriangleEncoding, block: &[u8], index: usize, lane: usize) -> [[f32; 3]; 3] {
    match encoding {
        TriangleEncoding::F32 => decode_f32(block, index).triangle(lane),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => packed::decode_lane(block, index, lane),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    fn packets(seed: u64, count: usize, make: impl Fn(u64) -> f32) -> Vec<Packet> {
        let mut random = Random::new(seed);
        let mut next = || make(random.bits() >> 20);
        (0..count)
            .map(|i| {
                let triangles: Vec<_> =
                    (0..1 + i % 4).map(|_| [(); 3].map(|()| [(); 3].map(|()| next()))).collect();
                Packet::new(&triangles)
            })
            .collect()
    }

    fn in_order(packets: &[Packet]) -> Vec<u16> {
        (0..packets.len() as u16).collect()
    }

    #[test]
    fn both_encodings_return_every_bit() {
        let kinds: [fn(u64) -> f32; 6] = [
            |r| (r & 0xfff) as f32 / 64.0 - 30.0,
            |r| f32::from_bits((r as u32 & 0x7fff_ffff).min(0x7b80_0000) | (r as u32 & 1) << 31),
            |r| (r % 3) as f32,
            |_| 0.0,
            |r| f32::from_bits(r as u32 & 0xff),
            |r| ((r & 0xffff) as f32 - 32768.0) * 1e-3,
        ];
        for (kind, make) in kinds.into_iter().enumerate() {
            for count in [1, 2, 7, 150] {
                let packets = packets(kind as u64 + 1, count, make);
                for encoding in TriangleEncoding::ALL {
                    let block = encode_block(encoding, &packets, &in_order(&packets));
                    assert_eq!(block.len() % LINE, 0);
                    for (index, packet) in packets.iter().enumerate() {
                        let decoded = decode_packet(encoding, &block, index);
                        let bits = |p: &Packet| p.corners.map(|c| c.map(|a| a.map(f32::to_bits)));
                        assert_eq!(bits(&decoded), bits(packet), "kind {kind}, packet {index}");
                        for lane in 0..PACKET {
                            let triangle = decode_triangle(encoding, &block, index, lane);
                            assert_eq!(triangle, packet.triangle(lane), "kind {kind}, packet {index}");
                        }
                    }
                }
            }
        }
    }

    /// Whatever the bytes are, a packet and its triangles are read alike.
    #[test]
    fn all_ways_to_decode_agree_on_any_bytes() {
        let mut random = Random::new(9);
        let mut random = || (random.bits() >> 40) as usize;
        for round in 0..20_000 {
            let mut block: Vec<u8> = (0..random() % 400).map(|_| random() as u8).collect();
            if let Some(head) = block.get_mut(..PACKED_HEAD_BYTES) {
                // Most of these fields lead into the block.
                (head[4], head[5], head[6], head[7]) = ((random() % 18) as u8, 20, (random() % 40) as u8, 30);
                if round % 3 > 0 {
                    head[4] %= 4;
                }
                for at in [24, 28] {
                    head[at..at + 4].copy_from_slice(&(random() as u32 % 400).to_le_bytes());
                }
            }
            let index = random() % 5;
            let packet = decode_packet(TriangleEncoding::Packed, &block, index);
            for lane in 0..PACKET {
                let triangle = decode_triangle(TriangleEncoding::Packed, &block, index, lane);
                let bits = |t: [[f32; 3]; 3]| t.map(|corner| corner.map(f32::to_bits));
                assert_eq!(bits(triangle), bits(packet.triangle(lane)), "round {round}");
            }
        }
    }

    #[test]
    fn a_grid_takes_the_bits_of_its_extent() {
        // 16 steps of 2^-10 far from zero take 4 bits per axis, whatever the magnitude.
        let packets = packets(3, 40, |r| 100.0 + (r % 16) as f32 / 1024.0);
        let head =
            PackedHead::read(&encode_block(TriangleEncoding::Packed, &packets, &in_order(&packets))).unwrap();
        assert_eq!((head.bits, head.kinds, head.exponent), ([4, 4, 4], 0b01_01_01, [-10; 3]));
    }

    #[test]
    fn printed_decimals_take_the_bits_of_their_last_digit() {
        // A thousand steps of 10^-5: as bits of `f32` they take more than twice as many.
        let packets = packets(3, 40, |r| ((r % 1000) as f64 / 1e5 - 0.003) as f32);
        let head =
            PackedHead::read(&encode_block(TriangleEncoding::Packed, &packets, &in_order(&packets))).unwrap();
        assert_eq!((head.bits, head.kinds, head.exponent), ([10; 3], 0b10_10_10, [5; 3]));
    }

    #[test]
    fn neighbours_share_vertices() {
        // A strip of triangles: a packet of four has six vertices, of which two are those of the packet before.
        let corner = |n: u32| [(n / 2) as f32, (n % 2) as f32, 0.0];
        let triangle = |n: u32| [n, n + 1 + n % 2, n + 2 - n % 2].map(corner);
        let packets: Vec<Packet> =
            (0..25).map(|p| Packet::new(&[0, 1, 2, 3].map(|lane| triangle(4 * p + lane)))).collect();
        let block = encode_block(TriangleEncoding::Packed, &packets, &in_order(&packets));
        let head = PackedHead::read(&block).unwrap();
        assert_eq!((head.vertices, head.further, head.index_bits), (102, 0, 7));
        assert_eq!(
            block.len(),
            (32 + (25 * (14 + 6 * 7usize)).div_ceil(8) + (102 * 7usize).div_ceil(8) + 8).next_multiple_of(64)
        );
    }
}
