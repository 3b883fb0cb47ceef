//! The id block of a page: the number that each triangle of each packet has in the input.
//!
//! Neighbours in the tree often are neighbours in the input. The least id of a packet is therefore stored as an offset
//! from the least id of its group of eight packets. The other ids of the packet are offsets from the packet's least id.
//! Each offset has as few bits as its group or packet needs. A table at the front of the block leads to the groups, so
//! a reader finds an id without reading those before it. Section 12 of `spec/format.md` says where each bit stands.

use crate::bits::{BitWriter, bit_width, load_bits, read_bits};
use crate::leaf::PACKET;

/// Packets in a group.
pub const ID_GROUP: usize = 8;
/// Bytes of a group's entry in the table.
pub const ID_ENTRY_BYTES: usize = 6;
/// Bits of a group before its packets: the width of their least ids, and the width of the offsets of each.
pub const ID_GROUP_HEAD_BITS: usize = LEAST_WIDTH_BITS + ID_GROUP * WIDTH_BITS;
/// Id blocks fill whole words of this many bytes.
pub const WORD: usize = 8;

/// Bits of the width of least ids.
const LEAST_WIDTH_BITS: usize = 6;
/// Bits of the width of a packet's offsets.
const WIDTH_BITS: usize = 6;
/// Bits of the number of the lane that has a packet's least id.
const LANE_BITS: usize = 2;

/// Makes the id block of a page from the ids of its packets, one to four per packet.
pub fn encode_ids(packets: &[impl AsRef<[u32]>]) -> Vec<u8> {
    let (mut table, mut writer) = (Vec::new(), BitWriter::default());
    let first = ID_ENTRY_BYTES * packets.len().div_ceil(ID_GROUP);
    for group in packets.chunks(ID_GROUP) {
        let packets = group.iter().map(|ids| PacketIds::new(ids.as_ref())).collect::<Vec<_>>();
        let base = packets.iter().map(|packet| packet.least).min().unwrap_or(0);
        let largest = packets.iter().map(|packet| packet.least - base).max().unwrap_or(0);
        table.extend_from_slice(&base.to_le_bytes());
        table.extend_from_slice(&((first + writer.bits() / 8) as u16).to_le_bytes());
        let least_width = bit_width(largest);
        writer.push(least_width, LEAST_WIDTH_BITS as u32);
        for place in 0..ID_GROUP {
            writer.push(packets.get(place).map_or(0, |packet| packet.width), WIDTH_BITS as u32);
        }
        for packet in &packets {
            writer.push(packet.least - base, least_width);
            writer.push(packet.lane, LANE_BITS as u32);
            packet.others.iter().for_each(|&offset| writer.push(offset, packet.width));
        }
        writer.push(0, writer.bits().wrapping_neg() as u32 % 8);
    }
    let mut block = table;
    block.extend_from_slice(&writer.finish());
    block.extend_from_slice(&[0; 8]);
    block.resize(block.len().next_multiple_of(WORD), 0);
    block
}

/// The ids of a packet as they are stored.
struct PacketIds {
    least: u32,
    /// The first lane that has the least id.
    lane: u32,
    /// What is added in the other lanes, in their order; 0 in lanes beyond the packet's triangles.
    others: [u32; PACKET - 1],
    /// The width of these.
    width: u32,
}

impl PacketIds {
    fn new(ids: &[u32]) -> Self {
        let least = ids.iter().copied().min().unwrap_or(0);
        let lane = ids.iter().position(|&id| id == least).unwrap_or(0);
        let mut others = [0; PACKET - 1];
        let rest = ids.iter().enumerate().filter(|&(at, _)| at != lane);
        others.iter_mut().zip(rest).for_each(|(offset, (_, id))| *offset = id - least);
        Self { least, lane: lane as u32, others, width: bit_width(others[0] | others[1] | others[2]) }
    }
}

/// Where the packets of a group are.
struct Group {
    base: u32,
    /// The first bit of the group in the block.
    start: usize,
    least_width: u32,
    /// The widths of the packets' offsets, and whatever follows them.
    widths: u64,
}

impl Group {
    /// Reads the entry and the head of a group. Bytes beyond the block read as zero.
    #[inline]
    fn read(block: &[u8], group: usize) -> Self {
        let entry = load_bits(block, group * ID_ENTRY_BYTES * 8);
        let start = usize::from((entry >> 32) as u16) * 8;
        let head = load_bits(block, start);
        let least_width = head as u32 & ((1 << LEAST_WIDTH_BITS) - 1);
        Self { base: entry as u32, start, least_width, widths: head >> LEAST_WIDTH_BITS }
    }

    /// The width of the offsets of a packet of the group.
    #[inline]
    fn width(&self, place: usize) -> u32 {
        (self.widths >> (place * WIDTH_BITS)) as u32 & ((1 << WIDTH_BITS) - 1)
    }

    /// The first bit of a packet of the group, or for `ID_GROUP` the bit behind them.
    #[inline]
    fn packet(&self, place: usize) -> usize {
        // The sum of the widths before it, without a loop: pairs first, and a product that adds up the pairs on top.
        const ONES: u64 = 1 | 1 << (2 * WIDTH_BITS) | 1 << (4 * WIDTH_BITS) | 1 << (6 * WIDTH_BITS);
        const FIRST_OF_PAIRS: u64 = ONES * ((1 << WIDTH_BITS) - 1);
        let before = self.widths & ((1 << (place * WIDTH_BITS)) - 1);
        let pairs = (before & FIRST_OF_PAIRS) + (before >> WIDTH_BITS & FIRST_OF_PAIRS);
        let widths = (pairs.wrapping_mul(ONES) >> (6 * WIDTH_BITS)) as usize & ((1 << (2 * WIDTH_BITS)) - 1);
        let each = self.least_width as usize + LANE_BITS;
        self.start + ID_GROUP_HEAD_BITS + place * each + (PACKET - 1) * widths
    }
}

/// The bytes that the id block of `packets` packets needs, filling zeros included, or `None` if its groups do not follow
/// each other or have widths that do not exist.
pub(crate) fn id_block_bytes(block: &[u8], packets: usize) -> Option<usize> {
    let groups = packets.div_ceil(ID_GROUP);
    let mut end = groups * ID_ENTRY_BYTES;
    for number in 0..groups {
        let group = Group::read(block, number);
        let is_valid = group.least_width <= 32 && (0..ID_GROUP).all(|place| group.width(place) <= 32);
        if group.start != end * 8 || !is_valid {
            return None;
        }
        end = group.packet((packets - number * ID_GROUP).min(ID_GROUP)).div_ceil(8);
    }
    Some((end + 8).next_multiple_of(WORD))
}

/// Returns the id of the triangle in a lane of a packet. Bytes beyond the block read as zero.
pub fn decode_id(block: &[u8], packet: usize, lane: usize) -> u32 {
    let group = Group::read(block, packet / ID_GROUP);
    let place = packet % ID_GROUP;
    let (at, least_width) = (group.packet(place), group.least_width.min(32));
    let fields = load_bits(block, at);
    let least = group.base.wrapping_add((fields & ((1 << least_width) - 1)) as u32);
    let least_lane = (fields >> least_width) as usize & ((1 << LANE_BITS) - 1);
    let (width, other) = (group.width(place).min(32), lane - usize::from(lane > least_lane));
    let at = at + least_width as usize + LANE_BITS + other * width as usize;
    let offset = read_bits(block, at, width);
    least.wrapping_add(if lane == least_lane { 0 } else { offset })
}

/// Returns the ids of all lanes of a packet, as [`decode_id`] does one. Those of unused lanes mean nothing.
pub(crate) fn decode_ids(block: &[u8], packet: usize) -> [u32; PACKET] {
    let group = Group::read(block, packet / ID_GROUP);
    let place = packet % ID_GROUP;
    let (at, least_width, width) =
        (group.packet(place), group.least_width.min(32), group.width(place).min(32));
    let fields = load_bits(block, at);
    let least = group.base.wrapping_add((fields & ((1 << least_width) - 1)) as u32);
    let least_lane = (fields >> least_width) as usize & ((1 << LANE_BITS) - 1);
    let others = at + least_width as usize + LANE_BITS;
    let mut ids = [least; PACKET];
    for other in 0..PACKET - 1 {
        let lane = other + usize::from(other >= least_lane);
        ids[lane] = least.wrapping_add(read_bits(block, others + other * width as usize, width));
    }
    ids
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_round_trip() {
        for spread in [0u64, 1, 1000, 1 << 31, u64::from(u32::MAX) - 1] {
            for count in [1, 7, 8, 9, 50] {
                let packets: Vec<Vec<u32>> = (0..count)
                    .map(|p| (0..1 + p % 4).map(|l| ((p * 13 + l * 7) % 50 * spread / 50) as u32).collect())
                    .collect();
                let block = encode_ids(&packets);
                assert_eq!(id_block_bytes(&block, packets.len()), Some(block.len()));
                for (p, ids) in packets.iter().enumerate() {
                    assert_eq!(decode_ids(&block, p)[..ids.len()], ids[..]);
                    for (lane, &id) in ids.iter().enumerate() {
                        assert_eq!(decode_id(&block, p, lane), id, "spread {spread}, packet {p}");
                    }
                }
            }
        }
        let whole = encode_ids(&[[0, u32::MAX - 1, 5, 1 << 31]]);
        assert_eq!([0, 1, 2, 3].map(|lane| decode_id(&whole, 0, lane)), [0, u32::MAX - 1, 5, 1 << 31]);
    }

    /// A mesh whose triangles are in the order of the leaves takes less than a byte for each.
    #[test]
    fn ids_in_order_take_less_than_a_byte() {
        let packets: Vec<[u32; 4]> =
            (0..150).map(|p| [0, 1, 2, 3].map(|lane| 1_000_000 + 4 * p + lane)).collect();
        assert!(encode_ids(&packets).len() < 4 * packets.len() * 7 / 8);
    }
}
