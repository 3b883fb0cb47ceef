//! Makes packed leaf blocks: collects the vertices of a page, chooses units and widths, and writes records and pool.

use super::packed::{DECIMALS, PATTERN_BITS, PackedHead, ROTATION_BITS, Unit, in_units};
use super::patterns::{Fit, MAX_SLOTS, PLACES, RECORD_SLOTS, SLOTS, labels_of};
use super::{LINE, PACKET, Packet, WidePacket};
use crate::bits::{BitWriter, bit_width};
use crate::ordered::to_ordered;
use crate::vertex::Vertices;
use std::ops::{BitOr, BitXor};

/// Makes a packed block, without the zeros that fill its last line, and the corrections of the vertices of its pool, axis by
/// axis, if there are any.
pub(super) fn packed(
    packets: &[Packet],
    order: &[u16],
    vertices: &Vertices,
    wide: &[WidePacket],
) -> (Vec<u8>, Option<[Vec<i64>; 3]>) {
    if !vertices.are_corrected() {
        let keys = |number: usize, lane: usize| packets[number].triangle(lane).map(|c| c.map(f32::to_bits));
        return (pooled(packets, order, keys).0, None);
    }
    let keys =
        |number: usize, lane: usize| wide[number].triangle(lane).map(|corner| corner.map(f64::to_bits));
    let (block, pool) = pooled(packets, order, keys);
    let correction = |axis: usize, (key, offset): (&[u64; 3], &[f32; 3])| {
        let coordinate = f64::from_bits(key[axis]);
        let wanted = vertices.corrected[axis].then(|| vertices.correction(axis, offset[axis], coordinate));
        wanted.flatten().unwrap_or(0)
    };
    let of_axis = |axis| pool.keys.iter().zip(&pool.offsets).map(|vertex| correction(axis, vertex)).collect();
    (block, Some([0, 1, 2].map(of_axis)))
}

/// Makes a packed block and its pool, in which vertices are the same if their keys are: those of the corners in a lane of a
/// packet.
fn pooled<T: Key>(
    packets: &[Packet],
    order: &[u16],
    keys: impl Fn(usize, usize) -> [[T; 3]; 3],
) -> (Vec<u8>, Pool<T>) {
    let lanes = (0..packets.len()).flat_map(|number| (0..PACKET).map(move |lane| (number, lane)));
    let has_points = lanes.clone().all(|(number, lane)| {
        let [a, b, c] = keys(number, lane);
        a == b && b == c
    });
    if has_points {
        let mut pool = Pool::new(0);
        for (number, lane) in lanes {
            pool.keys.push(keys(number, lane)[0]);
            pool.offsets.push(packets[number].corners[0].map(|lanes| lanes[lane]));
        }
        return (block(&pool.offsets, &[], true), pool);
    }
    let mut pool = Pool::new(packets.len() * MAX_SLOTS);
    let mut records = vec![Record::NONE; packets.len()];
    for number in order.iter().copied().map(usize::from) {
        let corners = [0, 1, 2, 3].map(|lane| keys(number, lane));
        records[number] = Record::new(&packets[number], &corners, &mut pool);
    }
    (block(&pool.offsets, &records, false), pool)
}

/// Makes a block of a pool and of records, or of points, which have none.
fn block(pool: &[[f32; 3]], records: &[Record], has_points: bool) -> Vec<u8> {
    let further = records.iter().map(|record| record.further().len()).sum::<usize>();
    let axes = [0, 1, 2].map(|axis| Axis::fit(pool.iter().map(move |vertex| vertex[axis])));
    let parts = axes.map(|axis| axis.unit.parts());
    let mut head = PackedHead {
        vertices: pool.len() as u16,
        further: further as u16,
        // A slot may also be the number of the first further one.
        index_bits: if has_points { 0 } else { bit_width((pool.len() as u32 - 1).max(further as u32)) as u8 },
        bits: axes.map(|axis| axis.bits),
        base: axes.map(|axis| axis.base),
        kinds: (0..3).map(|axis| parts[axis].0 << (2 * axis)).sum(),
        exponent: parts.map(|(_, exponent)| exponent),
        further_at: 0,
        pool_at: 0,
    };
    if has_points {
        head.set_points();
    }
    head.lay_out(records.len());
    let mut block = Vec::with_capacity(head.block_bytes() + LINE);
    head.write(&mut block);
    let width = u32::from(head.index_bits);
    let (mut writer, mut first) = (BitWriter::default(), 0);
    for record in records {
        record.write(width, first, &mut writer);
        first += record.further().len() as u32;
    }
    block.extend_from_slice(&writer.finish());
    let mut writer = BitWriter::default();
    records.iter().flat_map(Record::further).for_each(|&place| writer.push(place, width));
    block.extend_from_slice(&writer.finish());
    let mut writer = BitWriter::default();
    for vertex in pool {
        for (axis, &value) in axes.iter().zip(vertex) {
            writer.push(axis.difference(value), u32::from(axis.bits));
        }
    }
    block.extend_from_slice(&writer.finish());
    block.extend_from_slice(&[0; 8]);
    debug_assert_eq!(block.len(), head.block_bytes());
    block
}

/// A packet as the block states it.
#[derive(Clone, Copy)]
struct Record {
    fit: Fit,
    /// Places in the pool, as many as the pattern has slots.
    slots: [u32; MAX_SLOTS],
}

impl Record {
    /// Room for another one.
    const NONE: Self = Self { fit: Fit { pattern: 0, rotations: [0; PACKET] }, slots: [0; MAX_SLOTS] };

    /// Fits a packet to a pattern, and its vertices into the pool. `corners` has the keys of each lane's corners.
    fn new<T: Key>(packet: &Packet, corners: &[[[T; 3]; 3]; PACKET], pool: &mut Pool<T>) -> Self {
        let fit = Fit::new(&labels_of(corners));
        let mut slots = [u32::MAX; MAX_SLOTS];
        for (lane, places) in PLACES[usize::from(fit.pattern)].iter().enumerate() {
            for (place, &slot) in places.iter().enumerate() {
                let held = &mut slots[usize::from(slot)];
                if *held == u32::MAX {
                    let corner = (place + 3 - usize::from(fit.rotations[lane])) % 3;
                    let offset = packet.corners[corner].map(|lanes| lanes[lane]);
                    *held = pool.place(corners[lane][corner], offset);
                }
            }
        }
        Self { fit, slots }
    }

    /// The slots for which the record has no room.
    fn further(&self) -> &[u32] {
        let slots = usize::from(SLOTS[usize::from(self.fit.pattern)]);
        if slots > RECORD_SLOTS { &self.slots[RECORD_SLOTS - 1..slots] } else { &[] }
    }

    /// Writes the record. `first` is the number of its first further slot.
    fn write(&self, width: u32, first: u32, writer: &mut BitWriter) {
        writer.push(self.fit.pattern.into(), PATTERN_BITS as u32);
        self.fit.rotations.iter().for_each(|&rotation| writer.push(rotation.into(), ROTATION_BITS as u32));
        let slots = usize::from(SLOTS[usize::from(self.fit.pattern)]);
        for slot in 0..RECORD_SLOTS {
            let value = match slot {
                _ if slot == RECORD_SLOTS - 1 && slots > RECORD_SLOTS => first,
                _ if slot < slots => self.slots[slot],
                _ => 0,
            };
            writer.push(value, width);
        }
    }
}

/// The largest magnitude of an integer that stands for a coordinate in units.
const MAX_INTEGER: f64 = 1e9;

/// How the pool stores the coordinates of one axis.
#[derive(Clone, Copy)]
struct Axis {
    unit: Unit,
    base: i32,
    bits: u8,
}

impl Axis {
    /// Picks the unit that takes the fewest bits: of several, the one that is decoded fastest.
    fn fit(values: impl Iterator<Item = f32> + Clone) -> Self {
        let ordered = Self::of_integers(Unit::Ordered, values.clone().map(to_ordered));
        let [binary, decimal] = [Self::fit_binary(values.clone()), Self::fit_decimal(values)];
        let others = [binary, decimal].into_iter().flatten();
        others.fold(ordered, |best, axis| if axis.bits < best.bits { axis } else { best })
    }

    fn of_integers(unit: Unit, integers: impl Iterator<Item = i32>) -> Self {
        let (lo, hi) = integers.fold((i32::MAX, i32::MIN), |(lo, hi), n| (lo.min(n), hi.max(n)));
        Self { unit, base: lo, bits: bit_width(hi.wrapping_sub(lo) as u32) as u8 }
    }

    /// Fits the coarsest power of two that divides all values, if the quotients are small enough.
    fn fit_binary(values: impl Iterator<Item = f32> + Clone) -> Option<Self> {
        let exponent = values.clone().filter(|&v| v != 0.0).map(lowest_bit).min().unwrap_or(0);
        let unit = Unit::Binary { exponent: i8::try_from(exponent).ok()? };
        let divisor = unit.divisor()?;
        let is_small = |value: f32| f64::from(value).abs() * divisor <= MAX_INTEGER;
        let mut all = values.clone();
        let fits = all.all(|value| is_small(value) && value.to_bits() != (-0.0f32).to_bits());
        fits.then(|| Self::of_integers(unit, values.map(|value| nearest(value, divisor))))
    }

    /// Fits the fewest decimals in which all values can be printed.
    fn fit_decimal(values: impl Iterator<Item = f32> + Clone) -> Option<Self> {
        let largest = values.clone().fold(0.0, |largest: f32, value| largest.max(value.abs()));
        let mut divisors =
            (0..).zip(DECIMALS).take_while(|&(_, divisor)| f64::from(largest) * divisor <= MAX_INTEGER);
        let is_exact = |value: f32, divisor: f64| {
            in_units(nearest(value, divisor), divisor).to_bits() == value.to_bits()
        };
        let (digits, divisor) =
            divisors.find(|&(_, divisor)| values.clone().all(|value| is_exact(value, divisor)))?;
        Some(Self::of_integers(Unit::Decimal { digits }, values.map(|value| nearest(value, divisor))))
    }

    /// What the pool holds for an offset.
    fn difference(&self, value: f32) -> u32 {
        let integer =
            self.unit.divisor().map_or_else(|| to_ordered(value), |divisor| nearest(value, divisor));
        integer.wrapping_sub(self.base) as u32
    }
}

/// The number of units that is nearest to a value, if it is below 2^31. Units are a mesh unit divided by a number.
fn nearest(value: f32, divisor: f64) -> i32 {
    /// The sum with this has no room for fractions: it is rounded to a whole number, which stands in its low bits.
    const ROUNDER: f64 = (3u64 << 51) as f64;
    (f64::from(value) * divisor + ROUNDER).to_bits() as i32
}

/// The exponent of the lowest set bit of a float that is not zero.
fn lowest_bit(value: f32) -> i32 {
    let bits = value.to_bits();
    let biased = ((bits >> 23) & 0xff) as i32;
    let mantissa = if biased == 0 { bits & 0x7f_ffff } else { bits & 0x7f_ffff | 0x80_0000 };
    biased.max(1) - 150 + mantissa.trailing_zeros() as i32
}

/// What tells vertices apart: the bits of a coordinate, those of its offset where that determines it.
trait Key: Copy + Default + PartialEq + Into<u64> + BitOr<Output = Self> + BitXor<Output = Self> {}

impl Key for u32 {}
impl Key for u64 {}

/// Distinct vertices in the order in which they first come by.
struct Pool<T> {
    keys: Vec<[T; 3]>,
    offsets: Vec<[f32; 3]>,
    /// A table with open addressing: one more than a vertex's place in the pool, 0 where it is free. It has room for
    /// twice the vertices that may come.
    table: Vec<u32>,
}

impl<T: Key> Pool<T> {
    /// Returns an empty pool with room for this number of vertices.
    fn new(vertices: usize) -> Self {
        let table = vec![0; (2 * vertices).next_power_of_two()];
        Self { keys: Vec::new(), offsets: Vec::new(), table }
    }

    /// The place of a vertex, given its key and its offsets.
    fn place(&mut self, key: [T; 3], offset: [f32; 3]) -> u32 {
        // An odd factor for each axis; the upper bits of their sum depend on all bits. A page has few enough vertices
        // for a hash that a hostile mesh can make collide.
        const FACTORS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0xc2b2_ae3d_27d4_eb4f, 0x1656_67b1_9e37_79f9];
        let sum = (0..3)
            .fold(0, |sum: u64, axis| (sum ^ key[axis].into()).wrapping_mul(FACTORS[axis]).rotate_left(29));
        let mut slot = sum as usize;
        loop {
            slot &= self.table.len() - 1;
            match self.table[slot] {
                0 => {
                    self.keys.push(key);
                    self.offsets.push(offset);
                    self.table[slot] = self.keys.len() as u32;
                    return self.keys.len() as u32 - 1;
                }
                held if self.keys[held as usize - 1] == key => return held - 1,
                _ => slot += 1,
            }
        }
    }
}
