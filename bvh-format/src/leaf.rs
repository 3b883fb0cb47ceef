//! Leaf packets of up to four triangles in lane order, and the block of all packets of a page.
//!
//! A block has one of two forms. `F32` holds plain lanes, 144 bytes per packet: corner by corner, axis by axis, four
//! lanes. `Packed` (and `Quantized`, which holds the same bytes after the baker has moved the vertices to a grid) holds
//! a [`PackedHead`], one pool of the distinct vertices of the page, and three pool indices per triangle. Each coordinate
//! in the pool is an offset of a few bits from the block's base. Section 11.2 of `spec/format.md` says where each byte
//! stands.
//!
//! A coordinate is *ordered* or *fixed-point*, whichever takes fewer bits on its axis. The bits of an ordered `f32`,
//! made monotone (`b ^ ((b >> 31) >>> 1)`), are base + offset. A fixed-point one is (base + offset) · 2^exponent. Both
//! are exact. Lanes beyond a packet's triangles repeat its last triangle. A block ends with at least 8 spare bytes and
//! fills whole lines of 64 bytes.

use crate::bits::{BitWriter, bit_width, read_bits};
use crate::kdop::Kdop;
use crate::ordered::{from_ordered, to_ordered};
use bytemuck::{Pod, Zeroable};

/// Triangles in a full leaf packet.
pub const PACKET: usize = 4;
/// Bytes of a packet of plain lanes.
pub const F32_PACKET_BYTES: usize = 144;
/// Bytes of the head of a packed block.
pub const PACKED_HEAD_BYTES: usize = 32;
/// Leaf blocks fill whole lines of this many bytes.
pub const LINE: usize = 64;

/// How the triangles of an object are stored.
///
/// The list is part of the major version of the format. It is not marked as non-exhaustive, so that whoever must do
/// something for each encoding does not compile until a new one is dealt with.
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
    /// A packet of zeros: room for another one.
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

    /// The packet with the last of the first `triangles` lanes in all lanes beyond: a file from elsewhere may hold anything
    /// there.
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
pub fn encode_block(encoding: TriangleEncoding, packets: &[Packet]) -> Vec<u8> {
    let mut block = match encoding {
        TriangleEncoding::F32 => encode_f32(packets),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => encode_packed(packets),
    };
    block.resize(block.len().next_multiple_of(LINE), 0);
    block
}

fn encode_f32(packets: &[Packet]) -> Vec<u8> {
    let mut block = Vec::with_capacity(packets.len() * F32_PACKET_BYTES + LINE);
    for packet in packets {
        for value in packet.corners.iter().flatten().flatten() {
            block.extend_from_slice(&value.to_le_bytes());
        }
    }
    block
}

/// Reads packet `index` of an F32 block. Bytes beyond the block read as zero.
#[inline]
fn decode_f32(block: &[u8], index: usize) -> Packet {
    let start = index * F32_PACKET_BYTES;
    let Some(bytes) = block.get(start..start + F32_PACKET_BYTES) else { return Packet::default() };
    // Memory and disk differ in the order of bytes at most.
    let mut packet: Packet = bytemuck::pod_read_unaligned(bytes);
    if cfg!(target_endian = "big") {
        for value in packet.corners.iter_mut().flatten().flatten() {
            *value = f32::from_bits(value.to_bits().swap_bytes());
        }
    }
    packet
}

/// The head of a packed block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PackedHead {
    /// Vertices in the pool.
    pub vertices: u16,
    /// Bits of an index.
    pub index_bits: u8,
    /// Bit `a` is set if axis `a` is fixed-point.
    pub fixed: u8,
    /// Bits of an offset, per axis.
    pub bits: [u8; 3],
    /// The number that offsets count from, per axis.
    pub base: [i32; 3],
    /// The power of two of each fixed-point axis.
    pub exponent: [i8; 3],
    /// Byte offset of the index array in the block.
    pub indices_at: u32,
}

impl PackedHead {
    /// Reads the head, or returns `None` if the block is shorter.
    #[inline]
    pub fn read(block: &[u8]) -> Option<Self> {
        let head = block.first_chunk::<PACKED_HEAD_BYTES>()?;
        let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
        Some(Self {
            vertices: u16::from_le_bytes([head[0], head[1]]),
            index_bits: head[2],
            fixed: head[3],
            bits: [head[4], head[5], head[6]],
            base: [8, 12, 16].map(|at| i32::from_le_bytes(word(at))),
            exponent: [head[20] as i8, head[21] as i8, head[22] as i8],
            indices_at: u32::from_le_bytes(word(24)),
        })
    }

    fn write(&self, block: &mut Vec<u8>) {
        block.extend_from_slice(&self.vertices.to_le_bytes());
        block.extend_from_slice(&[self.index_bits, self.fixed]);
        block.extend_from_slice(&self.bits);
        block.push(0);
        self.base.iter().for_each(|base| block.extend_from_slice(&base.to_le_bytes()));
        block.extend(self.exponent.map(|e| e as u8));
        block.push(0);
        block.extend_from_slice(&self.indices_at.to_le_bytes());
        block.extend_from_slice(&[0; 4]);
    }

    /// Bits of one vertex in the pool.
    #[inline]
    pub(crate) fn stride(&self) -> usize {
        self.bits.iter().map(|&b| usize::from(b)).sum()
    }

    /// The bit of the block at which vertex `index` of the pool starts.
    #[inline]
    fn vertex_at(&self, index: u32) -> usize {
        PACKED_HEAD_BYTES * 8 + index as usize * self.stride()
    }

    /// Reads the three offsets that start at bit `at`.
    #[inline]
    fn offsets(&self, block: &[u8], mut at: usize) -> [u32; 3] {
        self.bits.map(|bits| {
            let width = u32::from(bits).min(32);
            let offset = read_bits(block, at, width);
            at += width as usize;
            offset
        })
    }

    /// Reads pool index `place` (4 · corner + lane) of packet `packet`.
    #[inline]
    pub(crate) fn index(&self, block: &[u8], packet: usize, place: usize) -> u32 {
        let width = usize::from(self.index_bits.min(16));
        let at = self.indices_at as usize * 8 + (packet * 12 + place) * width;
        read_bits(block, at, width as u32)
    }

    /// The bytes that a block of `packets` packets needs, before zeros fill its last line.
    pub(crate) fn block_bytes(&self, packets: usize) -> usize {
        self.indices_at as usize + (packets * 12 * usize::from(self.index_bits)).div_ceil(8) + 8
    }
}

/// Reads packet `index` of a packed block. Bytes beyond the block read as zero.
#[inline(always)]
fn decode_packed(block: &[u8], index: usize) -> Packet {
    let mut packet = Packet::default();
    let Some(head) = PackedHead::read(block) else { return packet };
    let offsets = match head.offsets_of_twelve(block, index) {
        Some(offsets) => offsets,
        None => head.offsets_one_by_one(block, index),
    };
    // Compilers turn a loop over the twelve vertices of one axis into vector code.
    for axis in 0..3 {
        let mut values = [0.0; 12];
        for place in 0..12 {
            values[place] = head.coordinate(axis, offsets[axis][place]);
        }
        for corner in 0..3 {
            packet.corners[corner][axis].copy_from_slice(&values[PACKET * corner..PACKET * (corner + 1)]);
        }
    }
    packet
}

/// Reads one triangle of a packet, as `decode_packet(..).triangle(lane)` does but at less cost. Bytes beyond the block
/// read as zero.
#[inline]
pub fn decode_triangle(encoding: TriangleEncoding, block: &[u8], index: usize, lane: usize) -> [[f32; 3]; 3] {
    match (encoding, PackedHead::read(block)) {
        (TriangleEncoding::F32, _) => decode_f32(block, index).triangle(lane),
        (_, None) => [[0.0; 3]; 3],
        (_, Some(head)) => [0, 1, 2].map(|corner| {
            let vertex = head.vertex_at(head.index(block, index, PACKET * corner + lane));
            let offsets = head.offsets(block, vertex);
            [0, 1, 2].map(|axis| head.coordinate(axis, offsets[axis]))
        }),
    }
}

impl PackedHead {
    /// Returns the coordinate that an offset stands for.
    #[inline(always)]
    fn coordinate(&self, axis: usize, offset: u32) -> f32 {
        let value = self.base[axis].wrapping_add(offset as i32);
        if self.fixed >> axis & 1 == 1 {
            value as f32 * power_of_two(self.exponent[axis])
        } else {
            from_ordered(value)
        }
    }

    /// Reads the offsets of a packet's twelve vertices, by axis, without a loop over bits: one load takes all indices,
    /// and two loads take each vertex. Returns `None` where the fields are too wide for that, or too near the end of
    /// the block.
    #[inline(always)]
    fn offsets_of_twelve(&self, block: &[u8], packet: usize) -> Option<[[u32; 12]; 3]> {
        let [x, y, z] = self.bits.map(u32::from);
        let width = usize::from(self.index_bits);
        // A load holds a field and the bits before it in its first byte.
        if x + y > 57 || z > 32 || x > 32 || y > 32 || 12 * width > 121 {
            return None;
        }
        let at = self.indices_at as usize * 8 + packet * 12 * width;
        let indices = u128::from_le_bytes(*block.get(at / 8..)?.first_chunk()?) >> (at % 8);
        let (low, middle) = (indices as u64, (indices >> (6 * width)) as u64);
        let mask = (1u64 << width) - 1;
        let mut offsets = [[0; 12]; 3];
        for place in 0..12 {
            let half = if place < 6 { low } else { middle };
            let index = half >> (place % 6 * width) & mask;
            let at = self.vertex_at(index as u32);
            let both = field_at(block, at)?;
            let third = field_at(block, at + (x + y) as usize)?;
            offsets[0][place] = (both & ((1 << x) - 1)) as u32;
            offsets[1][place] = (both >> x & ((1 << y) - 1)) as u32;
            offsets[2][place] = (third & ((1 << z) - 1)) as u32;
        }
        Some(offsets)
    }

    /// Reads the same offsets from fields of any width. Bytes beyond the block read as zero.
    #[cold]
    #[inline(never)]
    fn offsets_one_by_one(&self, block: &[u8], packet: usize) -> [[u32; 12]; 3] {
        let mut offsets = [[0; 12]; 3];
        for place in 0..12 {
            let vertex = self.offsets(block, self.vertex_at(self.index(block, packet, place)));
            for axis in 0..3 {
                offsets[axis][place] = vertex[axis];
            }
        }
        offsets
    }
}

/// Reads at least 57 bits from bit `at` on, if the block has all eight bytes of the load.
#[inline(always)]
fn field_at(block: &[u8], at: usize) -> Option<u64> {
    let bytes = block.get(at / 8..)?.first_chunk()?;
    Some(u64::from_le_bytes(*bytes) >> (at % 8))
}

/// Reads packet `index` of a block. Bytes beyond the block read as zero.
#[inline(always)]
pub fn decode_packet(encoding: TriangleEncoding, block: &[u8], index: usize) -> Packet {
    match encoding {
        TriangleEncoding::F32 => decode_f32(block, index),
        TriangleEncoding::Packed | TriangleEncoding::Quantized => decode_packed(block, index),
    }
}

/// Returns 2^exponent for the exponent of a normal float, and 0 for a smaller one.
#[inline]
fn power_of_two(exponent: i8) -> f32 {
    f32::from_bits(((i32::from(exponent) + 127).max(0) as u32) << 23)
}

/// How the pool stores the coordinates of one axis.
struct Axis {
    fixed: bool,
    base: i32,
    exponent: i8,
    bits: u8,
}

/// Picks the mode that takes fewer bits, and `ordered` on a tie.
fn fit_axis(values: impl Iterator<Item = f32> + Clone) -> Axis {
    let (mut lo, mut hi) = (i32::MAX, i32::MIN);
    for value in values.clone() {
        lo = lo.min(to_ordered(value));
        hi = hi.max(to_ordered(value));
    }
    let bits = bit_width(hi.wrapping_sub(lo) as u32) as u8;
    let ordered = Axis { fixed: false, base: lo, exponent: 0, bits };
    match fit_fixed(values) {
        Some(fixed) if fixed.bits < ordered.bits => fixed,
        _ => ordered,
    }
}

/// Fits the coarsest power of two that divides all values, if the quotients fit in 31 bits.
fn fit_fixed(values: impl Iterator<Item = f32> + Clone) -> Option<Axis> {
    let exponent = values.clone().filter(|&v| v != 0.0).map(lowest_bit).min().unwrap_or(0);
    let exponent = i8::try_from(exponent).ok().filter(|&e| e >= -126)?;
    let scale = f64::from(power_of_two(exponent));
    let (mut lo, mut hi) = (i32::MAX, i32::MIN);
    for value in values {
        let quotient = f64::from(value) / scale;
        if quotient.abs() > f64::from(1 << 30) {
            return None;
        }
        lo = lo.min(quotient as i32);
        hi = hi.max(quotient as i32);
    }
    let bits = bit_width(hi.wrapping_sub(lo) as u32) as u8;
    Some(Axis { fixed: true, base: lo, exponent, bits })
}

/// The exponent of the lowest set bit of a float that is not zero.
fn lowest_bit(value: f32) -> i32 {
    let bits = value.to_bits();
    let biased = ((bits >> 23) & 0xff) as i32;
    let mantissa = if biased == 0 { bits & 0x7f_ffff } else { bits & 0x7f_ffff | 0x80_0000 };
    biased.max(1) - 150 + mantissa.trailing_zeros() as i32
}

/// Distinct vertices in the order in which they first come by.
struct Pool {
    vertices: Vec<[f32; 3]>,
    /// A table with open addressing: one more than a vertex's place in the pool, 0 where it is free. It has room for
    /// twice the vertices that may come.
    table: Vec<u32>,
}

impl Pool {
    /// A pool to which at most so many vertices are given.
    fn new(vertices: usize) -> Self {
        Self { vertices: Vec::new(), table: vec![0; (2 * vertices).next_power_of_two()] }
    }

    /// The place of a vertex. Vertices are equal if their bits are.
    fn place(&mut self, vertex: [f32; 3]) -> u32 {
        // An odd factor for each axis; the upper bits of their sum depend on all bits. A page has few enough vertices
        // for a hash that a hostile mesh can make collide.
        const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];
        let bits = vertex.map(f32::to_bits);
        let sum = (0..3).fold(0, |sum: u64, axis| {
            (sum ^ u64::from(bits[axis])).wrapping_mul(FACTORS[axis]).rotate_left(29)
        });
        let mut slot = sum as usize;
        loop {
            slot &= self.table.len() - 1;
            match self.table[slot] {
                0 => {
                    self.vertices.push(vertex);
                    self.table[slot] = self.vertices.len() as u32;
                    return self.vertices.len() as u32 - 1;
                }
                held if self.vertices[held as usize - 1].map(f32::to_bits) == bits => return held - 1,
                _ => slot += 1,
            }
        }
    }
}

fn encode_packed(packets: &[Packet]) -> Vec<u8> {
    let mut pool = Pool::new(packets.len() * 3 * PACKET);
    let mut indices = Vec::with_capacity(packets.len() * 3 * PACKET);
    for packet in packets {
        for corner in &packet.corners {
            for lane in 0..PACKET {
                indices.push(pool.place([0, 1, 2].map(|axis| corner[axis][lane])));
            }
        }
    }
    let pool = pool.vertices;
    let axes = [0, 1, 2].map(|axis| fit_axis(pool.iter().map(move |vertex| vertex[axis])));
    let mut head = PackedHead {
        vertices: pool.len() as u16,
        index_bits: bit_width(pool.len() as u32 - 1) as u8,
        fixed: (0..3).map(|axis| u8::from(axes[axis].fixed) << axis).sum(),
        bits: [0, 1, 2].map(|axis| axes[axis].bits),
        base: [0, 1, 2].map(|axis| axes[axis].base),
        exponent: [0, 1, 2].map(|axis| axes[axis].exponent),
        indices_at: 0,
    };
    let mut writer = BitWriter::default();
    for vertex in &pool {
        for (axis, fit) in axes.iter().enumerate() {
            let value = if fit.fixed {
                (f64::from(vertex[axis]) / f64::from(power_of_two(fit.exponent))) as i32
            } else {
                to_ordered(vertex[axis])
            };
            writer.push(value.wrapping_sub(fit.base) as u32, u32::from(fit.bits));
        }
    }
    let vertices = writer.finish();
    let mut writer = BitWriter::default();
    indices.iter().for_each(|&index| writer.push(index, u32::from(head.index_bits)));
    let indices = writer.finish();
    head.indices_at = (PACKED_HEAD_BYTES + vertices.len()) as u32;
    let mut block = Vec::with_capacity(head.block_bytes(packets.len()) + LINE);
    head.write(&mut block);
    block.extend_from_slice(&vertices);
    block.extend_from_slice(&indices);
    block.extend_from_slice(&[0; 8]);
    block
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packets(seed: u64, count: usize, make: impl Fn(u64) -> f32) -> Vec<Packet> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            make(state >> 20)
        };
        (0..count)
            .map(|i| {
                let triangles: Vec<_> =
                    (0..1 + i % 4).map(|_| [(); 3].map(|()| [(); 3].map(|()| next()))).collect();
                Packet::new(&triangles)
            })
            .collect()
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
                    let block = encode_block(encoding, &packets);
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

    /// Whatever the bytes are, the functions that read several fields at once agree with the one that reads them one by
    /// one.
    #[test]
    fn all_ways_to_decode_agree_on_any_bytes() {
        let mut state = 9u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as usize
        };
        let mut at_once = 0;
        for round in 0..20_000 {
            let mut block: Vec<u8> = (0..random() % 400).map(|_| random() as u8).collect();
            if let Some(head) = block.get_mut(..28) {
                // Most of these fields lead into the block.
                (head[2], head[4], head[5], head[6]) = ((random() % 14) as u8, 20, (random() % 40) as u8, 30);
                head[24..28].copy_from_slice(&(random() as u32 % 400).to_le_bytes());
                if round % 3 > 0 {
                    head[2] %= 4;
                }
            }
            let index = random() % 5;
            let packet = decode_packed(&block, index);
            let head = PackedHead::read(&block);
            at_once += usize::from(head.is_some_and(|head| head.offsets_of_twelve(&block, index).is_some()));
            for lane in 0..PACKET {
                let triangle = decode_triangle(TriangleEncoding::Packed, &block, index, lane);
                let bits = |t: [[f32; 3]; 3]| t.map(|corner| corner.map(f32::to_bits));
                assert_eq!(bits(triangle), bits(packet.triangle(lane)), "round {round}");
            }
        }
        assert!(at_once > 1000, "{at_once} of 20000 at once");
    }

    #[test]
    fn a_grid_takes_the_bits_of_its_extent() {
        // 16 steps of 2^-10 far from zero take 4 bits per axis, whatever the magnitude.
        let packets = packets(3, 40, |r| 100.0 + (r % 16) as f32 / 1024.0);
        let head = PackedHead::read(&encode_block(TriangleEncoding::Packed, &packets)).unwrap();
        assert_eq!(head.bits, [4, 4, 4]);
    }
}
