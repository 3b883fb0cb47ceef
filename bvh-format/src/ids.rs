//! The id block of a page: the number that each triangle of each packet has in the input.
//!
//! A block holds a base and one offset per lane, bit-packed; the offsets of lanes beyond a packet's triangles are 0.
//! It ends with at least 8 spare bytes and fills whole words of 8 bytes. Section 12 of `spec/format.md` says where each
//! byte stands.

use crate::bits::{BitWriter, bit_width, read_bits};
use crate::leaf::PACKET;

/// Bytes of the head of an id block.
pub const ID_HEAD_BYTES: usize = 8;
/// Id blocks fill whole words of this many bytes.
pub const WORD: usize = 8;

/// Makes the id block of a page from the ids of its packets, one to four per packet.
pub fn encode_ids(packets: &[impl AsRef<[u32]>]) -> Vec<u8> {
    let all = || packets.iter().flat_map(AsRef::as_ref).copied();
    let base = all().min().unwrap_or(0);
    let bits = bit_width(all().max().unwrap_or(0) - base);
    let mut writer = BitWriter::default();
    for packet in packets {
        for lane in 0..PACKET {
            writer.push(packet.as_ref().get(lane).map_or(0, |id| id - base), bits);
        }
    }
    let mut block = Vec::new();
    block.extend_from_slice(&base.to_le_bytes());
    block.extend_from_slice(&[bits as u8, 0, 0, 0]);
    block.extend_from_slice(&writer.finish());
    block.extend_from_slice(&[0; 8]);
    block.resize(block.len().next_multiple_of(WORD), 0);
    block
}

/// The bytes that the id block of `packets` packets needs, if each offset takes `bits` bits.
pub(crate) fn id_block_bytes(packets: usize, bits: u8) -> usize {
    let bytes = ID_HEAD_BYTES + (packets * PACKET * usize::from(bits)).div_ceil(8) + 8;
    bytes.next_multiple_of(WORD)
}

/// Returns the id of the triangle in a lane of a packet, or 0 if the block is shorter than its head.
pub fn decode_id(block: &[u8], packet: usize, lane: usize) -> u32 {
    let Some(head) = block.first_chunk::<ID_HEAD_BYTES>() else { return 0 };
    let base = u32::from_le_bytes([head[0], head[1], head[2], head[3]]);
    let bits = u32::from(head[4]).min(32);
    let at = ID_HEAD_BYTES * 8 + (packet * PACKET + lane) * bits as usize;
    base.wrapping_add(read_bits(block, at, bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_round_trip() {
        for spread in [0u32, 1, 1000, u32::MAX - 1] {
            let packets: Vec<Vec<u32>> = (0..50u32)
                .map(|p| {
                    (0..1 + p % 4).map(|l| (u64::from(p * 4 + l) * u64::from(spread) / 200) as u32).collect()
                })
                .collect();
            let block = encode_ids(&packets);
            assert_eq!(block.len(), id_block_bytes(packets.len(), block[4]));
            for (p, ids) in packets.iter().enumerate() {
                for (lane, &id) in ids.iter().enumerate() {
                    assert_eq!(decode_id(&block, p, lane), id);
                }
            }
        }
    }
}
