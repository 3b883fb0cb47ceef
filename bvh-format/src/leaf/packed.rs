//! The packed leaf block: the distinct vertices of a page in a pool of bit fields, and a record for each packet.
//!
//! A record holds the number of a [pattern](super::patterns), the rotation of each triangle, and the places of six
//! vertices in the pool. If a pattern has more than six slots, the last field of the record leads to the others. All
//! records of a block therefore have one size, and a packet is found by its number.
//!
//! A block whose packets hold points alone has no records: the corners of a packet's lane are all the same vertex, and the
//! pool has these vertices in the order of packets and lanes.
//!
//! For each offset, the pool has a difference of a few bits from the block's base. The sum of both stands for a number in
//! one of three ways, whichever takes the fewest bits on its axis. For an *ordered* offset, the sum is the bits of the
//! `f32`, made monotone (`b ^ ((b >> 31) >>> 1)`). A *binary* offset is the sum times a power of 2, and a *decimal* one the
//! sum divided by a power of 10: grids and CAD models are multiples of a power of two, and scans are often printed in
//! decimals. All three are exact.
//!
//! Section 11.2 of `spec/format.md` states the place of each byte.

use super::patterns::{CORNERS, MAX_SLOTS, PATTERNS, RECORD_SLOTS, SLOTS};
use super::{PACKET, Packet};
use crate::bits::{load_wide, read_bits};
use crate::ordered::from_ordered;
use std::ops::Range;

/// Bytes of the head of a packed block, which its records follow.
pub const PACKED_HEAD_BYTES: usize = 32;
/// Bits of a record before its slots.
pub const RECORD_HEAD_BITS: usize = PATTERN_BITS + PACKET * ROTATION_BITS;

/// Bits of the number of a pattern.
pub(crate) const PATTERN_BITS: usize = 6;
/// Bits of the rotation of a lane.
pub(crate) const ROTATION_BITS: usize = 2;
/// The bit of a head's kinds that stands for a block of points.
const POINTS: u8 = 1 << 6;
/// The most bits of a place in the pool.
pub(crate) const MAX_INDEX_BITS: u8 = 16;

const _: () = assert!(PATTERNS == 1 << PATTERN_BITS);

/// How the coordinates of an axis are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Unit {
    /// As bits of `f32`, made monotone.
    Ordered,
    /// In units of a power of two.
    Binary { exponent: i8 },
    /// In units of 10^-digits.
    Decimal { digits: u8 },
}

/// 10^k for k from 0 on.
pub(crate) const DECIMALS: [f64; 16] =
    [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

impl Unit {
    /// Reads an axis of a head: two bits that name the kind, and the exponent. `None` stands for a kind or an exponent
    /// that does not exist.
    #[inline]
    fn read(kind: u8, exponent: i8) -> Option<Self> {
        match kind & 3 {
            0 if exponent == 0 => Some(Self::Ordered),
            1 => Some(Self::Binary { exponent }),
            2 if (0..DECIMALS.len() as i8).contains(&exponent) => {
                Some(Self::Decimal { digits: exponent as u8 })
            }
            _ => None,
        }
    }

    /// The kind and the exponent in a head.
    pub(crate) fn parts(self) -> (u8, i8) {
        match self {
            Self::Ordered => (0, 0),
            Self::Binary { exponent } => (1, exponent),
            Self::Decimal { digits } => (2, digits as i8),
        }
    }

    /// How many units are a mesh unit, unless the integers are ordered bits.
    #[inline(always)]
    pub(crate) fn divisor(self) -> Option<f64> {
        match self {
            Self::Ordered => None,
            Self::Binary { exponent } => Some(f64::from_bits(((1023 - i64::from(exponent)) as u64) << 52)),
            Self::Decimal { digits } => Some(DECIMALS[usize::from(digits) % DECIMALS.len()]),
        }
    }
}

/// Returns the offset that is `integer` units: a quotient of two `f64`, as a parser of decimals finds it, rounded to `f32`.
#[inline(always)]
pub(super) fn in_units(integer: i32, divisor: f64) -> f32 {
    (f64::from(integer) / divisor) as f32
}

/// The head of a packed block.
///
/// ```
/// use bvh_format::leaf::{PackedHead, Packet, Record, TriangleEncoding, encode_block};
/// use bvh_format::vertex::Vertices;
///
/// let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let square = Packet::new(&[[a, b, c], [a, c, d]]);
/// let block = encode_block(TriangleEncoding::Packed, &[square], &[0], &Vertices::around([0.0; 3]), &[]);
/// let head = PackedHead::read(&block).expect("a packed block");
/// assert_eq!(head.vertices, 4); // each is stored once
/// let record: Record = head.record(&block, 0);
/// let of_corner = |corner: usize, lane: usize| record.corners()[4 * corner + lane];
/// assert_eq!(of_corner(0, 0), of_corner(0, 1)); // both triangles begin with the same vertex
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PackedHead {
    /// Vertices in the pool.
    pub vertices: u16,
    /// Slots beyond those in the records.
    pub further: u16,
    /// Bits of a slot: of a place in the pool.
    pub index_bits: u8,
    /// Bits of a difference, per axis.
    pub bits: [u8; 3],
    /// The number to which differences are added, per axis.
    pub base: [i32; 3],
    /// How the coordinates of each axis are stored, two bits each: 0 ordered, 1 binary, 2 decimal. Bit 6 is set if the packets
    /// hold points alone.
    pub kinds: u8,
    /// The exponent of 2 of each binary axis, and the number of decimals of each decimal one.
    pub exponent: [i8; 3],
    /// Byte offset of the further slots in the block.
    pub further_at: u32,
    /// Byte offset of the pool in the block.
    pub pool_at: u32,
}

/// More bytes than a block has: at most 2^16 vertices of 12 bytes, as many slots of 2, and the records.
const BEYOND_ANY_BLOCK: u32 = 1 << 28;

/// Returns the bit at which a byte of the block starts. A head that was not checked may state any byte. All bytes beyond the block
/// read as zero, so any of them may stand for the others; then bits can be counted in a `usize` of 32 bits, too.
#[inline(always)]
fn first_bit(byte: u32) -> usize {
    byte.min(BEYOND_ANY_BLOCK) as usize * 8
}

impl PackedHead {
    /// Reads the head, or returns `None` if the block is shorter.
    #[inline]
    pub fn read(block: &[u8]) -> Option<Self> {
        let head = block.first_chunk::<PACKED_HEAD_BYTES>()?;
        let word = |at: usize| [head[at], head[at + 1], head[at + 2], head[at + 3]];
        Some(Self {
            vertices: u16::from_le_bytes([head[0], head[1]]),
            further: u16::from_le_bytes([head[2], head[3]]),
            index_bits: head[4],
            bits: [head[5], head[6], head[7]],
            base: [8, 12, 16].map(|at| i32::from_le_bytes(word(at))),
            kinds: head[20],
            exponent: [head[21] as i8, head[22] as i8, head[23] as i8],
            further_at: u32::from_le_bytes(word(24)),
            pool_at: u32::from_le_bytes(word(28)),
        })
    }

    pub(super) fn write(&self, block: &mut Vec<u8>) {
        block.extend_from_slice(&self.vertices.to_le_bytes());
        block.extend_from_slice(&self.further.to_le_bytes());
        block.push(self.index_bits);
        block.extend_from_slice(&self.bits);
        self.base.iter().for_each(|base| block.extend_from_slice(&base.to_le_bytes()));
        block.push(self.kinds);
        block.extend(self.exponent.map(|e| e as u8));
        block.extend_from_slice(&self.further_at.to_le_bytes());
        block.extend_from_slice(&self.pool_at.to_le_bytes());
    }

    /// How the coordinates of an axis are stored, or `None` if there is no such way.
    #[inline]
    pub(crate) fn unit(&self, axis: usize) -> Option<Unit> {
        Unit::read(self.kinds >> (2 * axis), self.exponent[axis])
    }

    /// Bits of one vertex in the pool.
    #[inline]
    fn stride(&self) -> usize {
        self.bits.iter().map(|&b| usize::from(b.min(32))).sum()
    }

    #[inline]
    fn index_width(&self) -> usize {
        usize::from(self.index_bits.min(MAX_INDEX_BITS))
    }

    /// Returns true if all corners of each triangle are equal.
    #[inline(always)]
    fn has_points(&self) -> bool {
        self.kinds & POINTS != 0
    }

    /// Makes this the head of a block of points.
    pub(super) fn set_points(&mut self) {
        self.kinds |= POINTS;
    }

    /// Bits of the record of a packet.
    #[inline]
    fn record_bits(&self) -> usize {
        if self.has_points() { 0 } else { RECORD_HEAD_BITS + RECORD_SLOTS * self.index_width() }
    }

    /// The bytes of a block that have the records of some packets.
    #[inline]
    pub fn records(&self, packets: Range<usize>) -> Range<usize> {
        let bit = |packet: usize| PACKED_HEAD_BYTES * 8 + packet * self.record_bits();
        bit(packets.start) / 8..bit(packets.end).div_ceil(8)
    }

    /// Sets the places of the parts of a block of `packets` packets, which the other fields determine.
    pub(super) fn lay_out(&mut self, packets: usize) {
        let further_at = PACKED_HEAD_BYTES + (packets * self.record_bits()).div_ceil(8);
        let further = (usize::from(self.further) * self.index_width()).div_ceil(8);
        (self.further_at, self.pool_at) = (further_at as u32, (further_at + further) as u32);
    }

    /// Returns true if the fields are within their limits and the parts of a block of `packets` packets follow each other.
    pub(crate) fn is_consistent(&self, packets: usize) -> bool {
        let mut again = *self;
        again.lay_out(packets);
        let within = self.bits.iter().all(|&bits| bits <= 32) && self.index_bits <= MAX_INDEX_BITS;
        let known = self.kinds < 1 << 7 && (0..3).all(|axis| self.unit(axis).is_some());
        let points =
            usize::from(self.vertices) == PACKET * packets && self.further == 0 && self.index_bits == 0;
        within && known && self.vertices > 0 && (points || !self.has_points()) && again == *self
    }

    /// The bytes that a block needs, before zeros fill its last line.
    pub(crate) fn block_bytes(&self) -> usize {
        let pool = (usize::from(self.vertices) * self.stride()).div_ceil(8);
        // A head that was not checked may state anything.
        (self.pool_at as usize).saturating_add(pool + 8)
    }

    /// Reads the record of a packet, and its further slots. Bytes beyond the block read as zero.
    #[inline(always)]
    pub fn record(&self, block: &[u8], packet: usize) -> Record {
        if self.has_points() {
            return Record::of_points(packet);
        }
        let width = self.index_width();
        let bits = load_wide(block, PACKED_HEAD_BYTES * 8 + packet * self.record_bits());
        let slots = bits >> RECORD_HEAD_BITS;
        let mut record = Record {
            pattern: bits as u8 & (PATTERNS - 1) as u8,
            rotations: (bits >> PATTERN_BITS) as u8,
            width: width as u8,
            // Three slots take at most 48 bits, and four 64.
            first_words: [slots as u64, (slots >> (3 * width)) as u64],
            further_words: [0; 2],
        };
        if record.count() > RECORD_SLOTS {
            let further = load_wide(block, first_bit(self.further_at) + record.first_further() * width);
            record.further_words = [further as u64, (further >> (4 * width)) as u64];
        }
        record
    }

    /// The integer for which a difference stands.
    #[inline(always)]
    fn integer(&self, axis: usize, difference: u32) -> i32 {
        self.base[axis].wrapping_add(difference as i32)
    }

    /// Reads the integers of the vertex in a place of the pool. Bytes beyond the block read as zero.
    #[inline(always)]
    fn vertex(&self, block: &[u8], place: u32) -> [i32; 3] {
        let mut at = self.vertex_at(place);
        [0, 1, 2].map(|axis| {
            let width = u32::from(self.bits[axis].min(32));
            let difference = read_bits(block, at, width);
            at += width as usize;
            self.integer(axis, difference)
        })
    }

    /// The bit of the block at which the vertex in a place of the pool starts.
    #[inline(always)]
    fn vertex_at(&self, place: u32) -> usize {
        first_bit(self.pool_at) + place as usize * self.stride()
    }

    /// Reads the integers of a packet's vertices, by axis. Bytes beyond the block read as zero.
    #[inline(always)]
    pub fn integers(&self, block: &[u8], record: &Record) -> [[i32; 16]; 3] {
        let mut integers = [[0; 16]; 3];
        let slots = record.slots();
        let places = &slots[..record.count().min(MAX_SLOTS)];
        if !self.with_two_loads(block, places, &mut integers) {
            self.one_by_one(block, places, &mut integers);
        }
        integers
    }

    /// Reads them with two loads per vertex. Returns false where fields are too wide for that, or too near the end of the
    /// block.
    #[inline(always)]
    fn with_two_loads(&self, block: &[u8], places: &[u32], integers: &mut [[i32; 16]; 3]) -> bool {
        let [x, y, z] = self.bits.map(u32::from);
        // A load of eight bytes holds 57 bits, wherever in its first byte they start.
        if x + y > 57 || x.max(y).max(z) > 32 {
            return false;
        }
        let masks = [x, y, z].map(|bits| (1u64 << bits) - 1);
        for (to, &place) in places.iter().enumerate() {
            let at = self.vertex_at(place);
            let (Some(both), Some(third)) = (field_at(block, at), field_at(block, at + (x + y) as usize))
            else {
                return false;
            };
            integers[0][to & 15] = self.integer(0, (both & masks[0]) as u32);
            integers[1][to & 15] = self.integer(1, (both >> x & masks[1]) as u32);
            integers[2][to & 15] = self.integer(2, (third & masks[2]) as u32);
        }
        true
    }

    /// Reads them from fields of any width.
    #[cold]
    #[inline(never)]
    fn one_by_one(&self, block: &[u8], places: &[u32], integers: &mut [[i32; 16]; 3]) {
        for (to, &place) in places.iter().enumerate() {
            let vertex = self.vertex(block, place);
            for axis in 0..3 {
                integers[axis][to & 15] = vertex[axis];
            }
        }
    }

    /// The number by which an axis's integers are divided, or `None` if they are the bits of ordered `f32`.
    #[inline(always)]
    pub fn divisor_of(&self, axis: usize) -> Option<f64> {
        self.unit(axis).and_then(Unit::divisor)
    }
}

/// The record of a packet: its vertices, and which of them its corners are.
///
/// [`PackedHead`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Record {
    pattern: u8,
    /// Two bits per lane.
    rotations: u8,
    /// Bits of a slot.
    width: u8,
    /// Slots 0 to 2 and 3 to 5 as they stand in the record, and whatever follows them.
    first_words: [u64; 2],
    /// Slots 5 to 8 and 9 to 11 as they stand among the further slots, if the pattern has more than six.
    further_words: [u64; 2],
}

impl Record {
    /// The record that a packet of points would have.
    #[inline(always)]
    fn of_points(packet: usize) -> Self {
        const WIDTH: u32 = MAX_INDEX_BITS as u32;
        let place = |lane: usize| ((PACKET * packet + lane) & 0xffff) as u64;
        let first_words = [place(0) | place(1) << WIDTH | place(2) << (2 * WIDTH), place(3)];
        Self {
            pattern: PATTERNS as u8,
            rotations: 0,
            width: MAX_INDEX_BITS,
            first_words,
            further_words: [0; 2],
        }
    }

    #[inline(always)]
    fn rotation(&self, lane: usize) -> usize {
        usize::from(self.rotations >> (ROTATION_BITS * lane) & 3)
    }

    /// The number of slots: at most twelve.
    #[inline(always)]
    fn count(&self) -> usize {
        usize::from(SLOTS[usize::from(self.pattern).min(PATTERNS)])
    }

    #[inline(always)]
    fn field(&self, word: u64, place: usize) -> u32 {
        (word >> (place * usize::from(self.width)) & ((1 << self.width) - 1)) as u32
    }

    /// The number of the first further slot, if the pattern has more than six.
    #[inline(always)]
    fn first_further(&self) -> usize {
        self.field(self.first_words[1], 2) as usize
    }

    /// The places in the pool of the packet's vertices, as many as `count` tells.
    #[inline(always)]
    fn slots(&self) -> [u32; MAX_SLOTS] {
        let mut slots = [0; MAX_SLOTS];
        for slot in 0..RECORD_SLOTS {
            slots[slot] = self.field(self.first_words[slot / 3], slot % 3);
        }
        if self.count() > RECORD_SLOTS {
            for slot in 0..MAX_SLOTS - RECORD_SLOTS + 1 {
                slots[RECORD_SLOTS - 1 + slot] = self.field(self.further_words[slot / 4], slot % 4);
            }
        }
        slots
    }

    /// The place in the pool of one of the packet's vertices.
    #[inline(always)]
    fn slot(&self, slot: usize) -> u32 {
        match slot.checked_sub(RECORD_SLOTS - 1) {
            Some(further) if self.count() > RECORD_SLOTS => {
                self.field(self.further_words[(further / 4) & 1], further % 4)
            }
            _ => self.field(self.first_words[(slot / 3) & 1], slot % 3),
        }
    }

    /// For each corner of a lane, the number of its vertex among the slots.
    #[inline(always)]
    fn lane(&self, lane: usize) -> [u8; 3] {
        let pattern = &CORNERS[usize::from(self.pattern).min(PATTERNS)];
        let corners = pattern[lane & 3][self.rotation(lane)] >> (8 * lane);
        [0, 1, 2].map(|corner| (corners >> (8 * PACKET * corner)) as u8)
    }

    /// For each corner of each lane, the number of its vertex among the slots: that of corner c is element `4 * c + lane`.
    /// The last four elements have no meaning.
    #[inline(always)]
    pub fn corners(&self) -> [u8; 16] {
        let pattern = &CORNERS[usize::from(self.pattern).min(PATTERNS)];
        let lane = |lane: usize| pattern[lane][self.rotation(lane)];
        (lane(0) | lane(1) | lane(2) | lane(3)).to_le_bytes()
    }

    /// Returns true if rotations are from 0 to 2, slots less than `vertices`, and numbers of further slots less than `further`.
    pub(crate) fn is_valid(&self, vertices: u16, further: u16) -> bool {
        let (slots, count) = (self.slots(), self.count());
        let end = if count > RECORD_SLOTS { self.first_further() + count + 1 - RECORD_SLOTS } else { 0 };
        (0..PACKET).all(|lane| self.rotation(lane) < 3)
            && slots[..count].iter().all(|&place| place < u32::from(vertices))
            && end <= usize::from(further)
    }
}

/// Reads packet `index` of a packed block. Bytes beyond the block read as zero.
#[inline(always)]
pub(super) fn decode(block: &[u8], index: usize) -> Packet {
    let mut packet = Packet::default();
    let Some(head) = PackedHead::read(block) else { return packet };
    let record = head.record(block, index);
    let integers = head.integers(block, &record);
    let corners = record.corners();
    for axis in 0..3 {
        // Compilers turn these loops into vector code.
        let mut values = [0.0; 16];
        match head.divisor_of(axis) {
            None => (0..MAX_SLOTS).for_each(|place| values[place] = from_ordered(integers[axis][place])),
            Some(divisor) => {
                (0..MAX_SLOTS).for_each(|place| values[place] = in_units(integers[axis][place], divisor))
            }
        }
        for corner in 0..3 {
            for lane in 0..PACKET {
                packet.corners[corner][axis][lane] =
                    values[usize::from(corners[PACKET * corner + lane]) & 15];
            }
        }
    }
    packet
}

/// Returns the places in the pool of the corners of a triangle.
#[inline]
pub(super) fn places_of_lane(block: &[u8], index: usize, lane: usize) -> [usize; 3] {
    let Some(head) = PackedHead::read(block) else { return [0; 3] };
    let record = head.record(block, index);
    record.lane(lane).map(|slot| record.slot(slot.into()) as usize)
}

/// Reads one triangle of a packet.
#[inline]
pub(super) fn decode_lane(block: &[u8], index: usize, lane: usize) -> [[f32; 3]; 3] {
    let Some(head) = PackedHead::read(block) else { return [[0.0; 3]; 3] };
    let record = head.record(block, index);
    let slots = record.lane(lane);
    let mut integers = [[0; 16]; 3];
    let places = [record.slot(slots[0].into()), record.slot(slots[1].into()), record.slot(slots[2].into())];
    if !head.with_two_loads(block, &places, &mut integers) {
        head.one_by_one(block, &places, &mut integers);
    }
    let mut triangle = [[0.0; 3]; 3];
    for axis in 0..3 {
        let divisor = head.divisor_of(axis);
        for corner in 0..3 {
            let integer = integers[axis][corner];
            triangle[corner][axis] = match divisor {
                None => from_ordered(integer),
                Some(divisor) => in_units(integer, divisor),
            };
        }
    }
    triangle
}

/// Reads at least 57 bits from bit `at` on, if the block has all eight bytes of the load.
#[inline(always)]
fn field_at(block: &[u8], at: usize) -> Option<u64> {
    let bytes = block.get(at / 8..)?.first_chunk()?;
    Some(u64::from_le_bytes(*bytes) >> (at % 8))
}
