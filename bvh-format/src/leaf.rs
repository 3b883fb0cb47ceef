//! Leaf packets of up to four triangles in lane order, and the block of all packets of a page.
//!
//! A block has one of three forms. `F32` holds plain lanes, 144 bytes per packet: corner by corner, axis by axis, four
//! lanes. `Packed` holds each distinct vertex of the page once, and states for each packet which vertices its corners
//! are; if all packets hold points, it holds their vertices and states nothing: see [`PackedHead`]. `Quantized` has the same
//! forms as `Packed`, after the baker has moved the vertices to a grid. Lanes beyond a packet's triangles repeat its last
//! triangle. A block fills whole lines of 64 bytes.

mod corrections;
mod encode;
mod packed;
mod patterns;

use corrections::AxisCorrections;
pub use corrections::{CORRECTIONS_HEAD_BYTES, Corrections};
pub use packed::{PACKED_HEAD_BYTES, PackedHead, RECORD_HEAD_BITS, Record};
pub use patterns::{PATTERNS, order_of_lanes};

use crate::kdop::Kdop;
use crate::vertex::Vertices;
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
///
/// ```
/// use bvh_format::leaf::{Packet, TriangleEncoding, decode_packet, encode_block};
/// use bvh_format::vertex::Vertices;
///
/// let packets = [Packet::new(&[[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]); 8];
/// for encoding in TriangleEncoding::ALL {
///     let block = encode_block(encoding, &packets, &[0, 1, 2, 3, 4, 5, 6, 7], &Vertices::around([0.0; 3]), &[]);
///     println!("{}: {} bytes", encoding.name(), block.len());
///     assert_eq!(decode_packet(encoding, &block, 7), packets[7]);
/// }
/// ```
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
///
/// ```
/// use bvh_format::leaf::Packet;
///
/// let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
/// let packet = Packet::new(&[triangle]);
/// assert_eq!(packet.triangle(0), triangle);
/// assert_eq!(packet.triangle(3), triangle); // unused lanes repeat the last triangle
/// assert_eq!(packet.corners[2][1], [2.0; 4]); // y of the third corners
/// assert_eq!(packet.kdop(1, 3).hi[..3], [1.0, 2.0, 0.0]);
/// ```
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
        let mut triangle = [[0.0; 3]; 3];
        // Not by nested `map`, which compilers may call instead of writing it out.
        for corner in 0..3 {
            for axis in 0..3 {
                triangle[corner][axis] = self.corners[corner][axis][lane];
            }
        }
        triangle
    }
}

/// The vertices behind the offsets of a packet, in the same order: `corners[corner][axis][lane]`.
///
/// [`VertexBlock`] has an example.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WidePacket {
    /// Coordinates in mesh units.
    pub corners: [[[f64; PACKET]; 3]; 3],
}

impl WidePacket {
    /// Makes a packet of one to four triangles. Lanes beyond them repeat the last triangle.
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let lanes: [_; PACKET] = std::array::from_fn(|lane| triangles[lane.min(triangles.len() - 1)]);
        let lane_of = |corner: usize, axis: usize| lanes.map(|triangle| triangle[corner][axis]);
        Self { corners: [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| lane_of(corner, axis))) }
    }

    /// The corners of the triangle in a lane.
    fn triangle(&self, lane: usize) -> [[f64; 3]; 3] {
        [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| self.corners[corner][axis][lane]))
    }
}

/// Makes the leaf block of a page, in whole lines.
///
/// `order` has the number of each packet once, with neighbours in space near each other. Vertices are stored in the
/// order in which these packets first use them, so that the vertices of a packet are in few lines. Plain packets need no order. If vertices are
/// corrected, `wide` has the vertices of each packet. A coordinate that no correction gives back stays as predicted.
pub fn encode_block(
    encoding: TriangleEncoding,
    packets: &[Packet],
    order: &[u16],
    vertices: &Vertices,
    wide: &[WidePacket],
) -> Vec<u8> {
    debug_assert!(encoding == TriangleEncoding::F32 || packets.len() == order.len());
    debug_assert_eq!(if vertices.are_corrected() { packets.len() } else { 0 }, wide.len());
    let (mut block, corrections) = match encoding {
        TriangleEncoding::F32 => (
            encode_f32(packets),
            vertices.are_corrected().then(|| corrections_of_lanes(packets, wide, vertices)),
        ),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => {
            encode::packed(packets, order, vertices, wide)
        }
    };
    block.resize(block.len().next_multiple_of(LINE), 0);
    if let Some(corrections) = corrections {
        block.extend_from_slice(&corrections::encode(&corrections));
        block.resize(block.len().next_multiple_of(LINE), 0);
    }
    block
}

/// The corrections of all lanes of plain packets, axis by axis, in the order in which their coordinates are stored.
fn corrections_of_lanes(packets: &[Packet], wide: &[WidePacket], vertices: &Vertices) -> [Vec<i64>; 3] {
    [0, 1, 2].map(|axis| {
        let of_packet = |(packet, wide): (&Packet, &WidePacket)| {
            let at = |place: usize| (place / PACKET, place % PACKET);
            std::array::from_fn::<_, LANES, _>(|place| {
                let (corner, lane) = at(place);
                let (offset, vertex) = (packet.corners[corner][axis][lane], wide.corners[corner][axis][lane]);
                if vertices.corrected[axis] {
                    vertices.correction(axis, offset, vertex).unwrap_or(0)
                } else {
                    0
                }
            })
        };
        packets.iter().zip(wide).flat_map(of_packet).collect()
    })
}

/// Corners of a plain packet.
const LANES: usize = 3 * PACKET;

/// The corners that a block of `packets` packets can correct, and the byte at which its corrections start.
fn corrected_corners(encoding: TriangleEncoding, block: &[u8], packets: usize) -> (usize, usize) {
    let (corners, bytes) = match encoding {
        TriangleEncoding::F32 => (LANES * packets, F32_PACKET_BYTES * packets),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => {
            PackedHead::read(block).map_or((0, 0), |head| (head.vertices.into(), head.block_bytes()))
        }
    };
    (corners, bytes.checked_next_multiple_of(LINE).unwrap_or(usize::MAX))
}

/// The corrections of the leaf block of a page of `packets` packets: their head, their bytes and the number of corners; `None`
/// if the block has none.
#[inline]
pub(crate) fn corrections_of(
    encoding: TriangleEncoding,
    block: &[u8],
    packets: usize,
) -> Option<(Corrections, &[u8], usize)> {
    let (corners, start) = corrected_corners(encoding, block, packets);
    let bytes = block.get(start..)?;
    Some((Corrections::read(bytes)?, bytes, corners))
}

/// Reads the vertices behind the packets of a leaf block. Bytes beyond the block read as zero.
///
/// ```
/// use bvh_format::leaf::{Packet, TriangleEncoding, VertexBlock, WidePacket, encode_block};
/// use bvh_format::vertex::Vertices;
///
/// let vertices = Vertices { corrected: [true; 3], left_out: [1e-8; 3], ..Vertices::around([0.0; 3]) };
/// let triangle = [[0.1, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.3]]; // 0.1 and 0.3 are no f32 numbers
/// let offsets = triangle.map(|corner| corner.map(|coordinate: f64| coordinate as f32));
/// let (packet, wide) = (Packet::new(&[offsets]), WidePacket::new(&[triangle]));
/// let block = encode_block(TriangleEncoding::F32, &[packet], &[0], &vertices, &[wide]);
/// assert_eq!(VertexBlock::new(TriangleEncoding::F32, &vertices, &block, 1).triangle(0, 0), triangle);
/// ```
#[derive(Clone, Copy)]
pub struct VertexBlock<'a> {
    encoding: TriangleEncoding,
    vertices: &'a Vertices,
    block: &'a [u8],
    corrections: Option<BlockCorrections<'a>>,
}

/// The corrections of a leaf block.
#[derive(Clone, Copy)]
struct BlockCorrections<'a> {
    head: Corrections,
    axes: [AxisCorrections; 3],
    bytes: &'a [u8],
    corners: usize,
}

impl<'a> VertexBlock<'a> {
    /// Takes the leaf block of a page of `packets` packets.
    #[inline]
    pub fn new(encoding: TriangleEncoding, vertices: &'a Vertices, block: &'a [u8], packets: usize) -> Self {
        let found = if vertices.are_corrected() { corrections_of(encoding, block, packets) } else { None };
        let corrections = found.map(|(head, bytes, corners)| {
            let axes = [0, 1, 2].map(|axis| head.of_axis(axis, corners));
            BlockCorrections { head, axes, bytes, corners }
        });
        Self { encoding, vertices, block, corrections }
    }

    /// Returns true if the lists of corrections have numbers of corners in ascending order.
    pub(crate) fn are_in_order(&self) -> bool {
        self.corrections.is_none_or(|of| of.head.are_in_order(of.bytes, of.corners))
    }

    /// Returns the vertices of the triangle in a lane of a packet.
    #[inline]
    pub fn triangle(&self, packet: usize, lane: usize) -> [[f64; 3]; 3] {
        self.behind(packet, lane, decode_triangle(self.encoding, self.block, packet, lane))
    }

    /// Returns the vertices of the triangle in a lane of a packet, given its offsets.
    #[inline]
    pub fn behind(&self, packet: usize, lane: usize, offsets: [[f32; 3]; 3]) -> [[f64; 3]; 3] {
        let Some(BlockCorrections { axes, bytes, .. }) = &self.corrections else {
            return self.vertices.predicted_triangle(&offsets);
        };
        let places = match self.encoding {
            TriangleEncoding::F32 => [0, 1, 2].map(|corner| LANES * packet + PACKET * corner + lane),
            TriangleEncoding::Packed | TriangleEncoding::Quantized => {
                packed::places_of_lane(self.block, packet, lane)
            }
        };
        // Not by `map`, which is not always compiled in place.
        let mut vertices = [[0.0; 3]; 3];
        for corner in 0..3 {
            for axis in 0..3 {
                let correction = axes[axis].get(bytes, places[corner]);
                vertices[corner][axis] = self.vertices.coordinate(axis, offsets[corner][axis], correction);
            }
        }
        vertices
    }
}

fn encode_f32(packets: &[Packet]) -> Vec<u8> {
    let mut block = Vec::with_capacity(packets.len() * F32_PACKET_BYTES + LINE);
    block.extend_from_slice(bytemuck::cast_slice(packets));
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
    use crate::vertex::Predictor;
    use cbvh_testkit::Random;

    const SUMS: Vertices = Vertices::around([0.0; 3]);

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
                    let block = encode_block(encoding, &packets, &in_order(&packets), &SUMS, &[]);
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

    fn bits_of(corners: [[f64; 3]; 3]) -> [[u64; 3]; 3] {
        corners.map(|corner| corner.map(f64::to_bits))
    }

    /// The vertices of corrected blocks are those that were given, bit for bit, in each encoding and with each predictor.
    #[test]
    fn corrected_vertices_come_back() {
        let predictors = [
            [Predictor::Sum; 3],
            [Predictor::Decimals(3), Predictor::Sum, Predictor::Significant(6)],
            [Predictor::Shortest, Predictor::Significant(9), Predictor::Decimals(0)],
        ];
        let mut random = Random::new(4);
        for (round, predictors) in predictors.into_iter().cycle().take(60).enumerate() {
            let origin =
                predictors.map(|predictor| if predictor.needs_no_origin() { 0.0 } else { 1e6 + 0.1 });
            let corrected = [0, 1, 2].map(|axis| round % 4 != axis);
            let vertices = Vertices { predictors, corrected, ..Vertices::around(origin) };
            // On axes that are not corrected, coordinates are those that are predicted. Every third round has few that are not.
            let mut vertex = || {
                [0, 1, 2].map(|axis| {
                    let offset = random.below(4000) as f32 / 16.0 - 100.0;
                    let predicted = vertices.coordinate(axis, offset, 0);
                    let is_missed = corrected[axis] && (round % 3 > 0 || random.below(20) == 0);
                    let steps = if is_missed { random.bits() >> (round % 2 * 30 + 33) } else { 0 };
                    f64::from_bits(predicted.to_bits() + steps)
                })
            };
            let few: Vec<[f64; 3]> = (0..40).map(|_| vertex()).collect();
            let mut corner = || few[random.below(few.len())];
            let wide: Vec<Vec<[[f64; 3]; 3]>> = (0..1 + 3 * round)
                .map(|packet| (0..1 + packet % 4).map(|_| [(); 3].map(|()| corner())).collect())
                .collect();
            for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
                check_corrected(encoding, &vertices, &wide);
            }
        }
    }

    /// Encodes packets of triangles, and compares what is decoded.
    fn check_corrected(encoding: TriangleEncoding, vertices: &Vertices, triangles: &[Vec<[[f64; 3]; 3]>]) {
        let offset = |axis: usize, value: f64| (value - vertices.origin[axis]) as f32;
        let offsets = |corner: [f64; 3]| [0, 1, 2].map(|axis| offset(axis, corner[axis]));
        let packets: Vec<_> = triangles
            .iter()
            .map(|triangles| {
                Packet::new(&triangles.iter().map(|corners| corners.map(offsets)).collect::<Vec<_>>())
            })
            .collect();
        let wide: Vec<_> = triangles.iter().map(|triangles| WidePacket::new(triangles)).collect();
        let block = encode_block(encoding, &packets, &in_order(&packets), vertices, &wide);
        let behind = VertexBlock::new(encoding, vertices, &block, packets.len());
        assert!(block.len().is_multiple_of(LINE) && behind.are_in_order());
        for (number, triangles) in triangles.iter().enumerate() {
            assert_eq!(decode_packet(encoding, &block, number), packets[number]);
            for lane in 0..PACKET {
                let given = triangles[lane.min(triangles.len() - 1)];
                assert_eq!(
                    bits_of(behind.triangle(number, lane)),
                    bits_of(given),
                    "{encoding:?}, {vertices:?}"
                );
            }
        }
    }

    /// Vertices that are equal as offsets, but not as `f64` numbers, stay apart: three corners in one place as well.
    #[test]
    fn twins_stay_apart() {
        let vertices = Vertices { corrected: [true, false, false], ..Vertices::around([1e6, 0.0, 0.0]) };
        let twin = |steps: u64| [f64::from_bits(1e6f64.to_bits() + steps), 2.0, 3.0];
        let triangles =
            vec![vec![[twin(0), twin(1), twin(2)]; 4], vec![[twin(2), twin(1), twin(7)], [twin(0); 3]]];
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            check_corrected(encoding, &vertices, &triangles);
        }
        // All corners of each lane are equal: a block of points, of which each has its correction.
        let points: Vec<_> =
            (0..5).map(|packet| vec![[twin(packet); 3], [twin(9); 3], [twin(packet + 1); 3]]).collect();
        for encoding in [TriangleEncoding::F32, TriangleEncoding::Packed] {
            check_corrected(encoding, &vertices, &points);
        }
    }

    /// Vertices can be read from any bytes.
    #[test]
    fn vertices_are_read_from_any_bytes_without_a_panic() {
        let mut random = Random::new(10);
        let all = [
            Predictor::Sum,
            Predictor::Significant(9),
            Predictor::Shortest,
            Predictor::Decimals(22),
            Predictor::Scaled,
        ];
        for round in 0..20_000 {
            let mut block: Vec<u8> = (0..random.below(500)).map(|_| random.bits() as u8).collect();
            let encoding = TriangleEncoding::ALL[random.below(3)];
            if encoding != TriangleEncoding::F32
                && round % 4 > 0
                && let Some(head) = block.get_mut(..PACKED_HEAD_BYTES)
            {
                // A small pool, behind which corrections may start within the block.
                (head[0], head[1]) = (random.below(9) as u8, 0);
                head[28..32].copy_from_slice(&(random.below(90) as u32).to_le_bytes());
            }
            let vertices = Vertices {
                predictors: [0, 1, 2].map(|_| all[random.below(5)]),
                scale: f64::from_bits(random.bits()),
                corrected: [random.below(2) == 0, random.below(2) == 0, true],
                ..Vertices::around([0.0; 3])
            };
            let packets = random.below(9);
            let behind = VertexBlock::new(encoding, &vertices, &block, packets);
            let _ = (behind.are_in_order(), behind.triangle(random.below(10), random.below(4)));
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

    fn packed_head(packets: &[Packet]) -> PackedHead {
        let block = encode_block(TriangleEncoding::Packed, packets, &in_order(packets), &SUMS, &[]);
        PackedHead::read(&block).unwrap()
    }

    #[test]
    fn a_grid_takes_the_bits_of_its_extent() {
        // 16 steps of 2^-10 far from zero take 4 bits per axis, whatever the magnitude.
        let packets = packets(3, 40, |r| 100.0 + (r % 16) as f32 / 1024.0);
        let head = packed_head(&packets);
        assert_eq!((head.bits, head.kinds, head.exponent), ([4, 4, 4], 0b01_01_01, [-10; 3]));
    }

    #[test]
    fn printed_decimals_take_the_bits_of_their_last_digit() {
        // A thousand steps of 10^-5: as bits of `f32` they take more than twice as many.
        let packets = packets(3, 40, |r| ((r % 1000) as f64 / 1e5 - 0.003) as f32);
        let head = packed_head(&packets);
        assert_eq!((head.bits, head.kinds, head.exponent), ([10; 3], 0b10_10_10, [5; 3]));
    }

    #[test]
    fn neighbours_share_vertices() {
        // A strip of triangles: a packet of four has six vertices, of which two are those of the packet before.
        let corner = |n: u32| [(n / 2) as f32, (n % 2) as f32, 0.0];
        let triangle = |n: u32| [n, n + 1 + n % 2, n + 2 - n % 2].map(corner);
        let packets: Vec<Packet> =
            (0..25).map(|p| Packet::new(&[0, 1, 2, 3].map(|lane| triangle(4 * p + lane)))).collect();
        let block = encode_block(TriangleEncoding::Packed, &packets, &in_order(&packets), &SUMS, &[]);
        let head = PackedHead::read(&block).unwrap();
        assert_eq!((head.vertices, head.further, head.index_bits), (102, 0, 7));
        assert_eq!(
            block.len(),
            (32 + (25 * (14 + 6 * 7usize)).div_ceil(8) + (102 * 7usize).div_ceil(8) + 8).next_multiple_of(64)
        );
    }
}
