//! Decodes packed leaf packets in vector registers, to the bits of `bvh_format::leaf`.

use crate::isa::Isa;
use bvh_format::leaf::{PackedHead, Packet};

/// Reads packet `index` of a packed block into `packet`.
#[inline(always)]
pub(crate) fn unpack<I: Isa>(isa: I, block: &[u8], index: usize, packet: &mut Packet) {
    let Some(head) = PackedHead::read(block) else {
        *packet = Packet::NONE;
        return;
    };
    let record = head.record(block, index);
    let integers = head.integers(block, &record);
    let places = record.corners();
    for axis in 0..3 {
        let vertices = isa.coordinates(&integers[axis], head.divisor_of(axis));
        let mut corners = [0.0; 16];
        isa.store(isa.permute(vertices, &places), &mut corners);
        for (corner, lanes) in corners.as_chunks().0.iter().take(3).enumerate() {
            packet.corners[corner][axis] = *lanes;
        }
    }
}
