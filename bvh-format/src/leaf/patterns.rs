//! Patterns: which corners of a packet's triangles are the same vertex.
//!
//! Neighbours share most of their corners, so the twelve corners of a packet usually are six vertices. A packed packet
//! stores these in *slots*, together with the number of a pattern, which gives the slot of each corner of each lane.
//! Triangles may be rotated to fit a pattern. The record states the rotations, so that corners keep their order.
//!
//! The table has the patterns that occur most in scans and CAD models, in the canonical form that [`Fit::new`] finds:
//! slots are numbered in the order in which they first occur, and rotations make the sequence of slots the least. Where
//! triangles may be rotated and put in any order, the table covers 98 to 100 % of the packets of such meshes. The last
//! pattern has a slot for each corner and fits any packet.

use crate::leaf::PACKET;
use std::collections::HashMap;
use std::ops::{BitOr, BitXor};
use std::sync::LazyLock;

/// The number of patterns.
pub const PATTERNS: usize = 64;
/// The most slots of a pattern.
pub(crate) const MAX_SLOTS: usize = 3 * PACKET;
/// The slots of a record; further ones of its packet stand elsewhere in the block.
pub(crate) const RECORD_SLOTS: usize = 6;

/// Slots by lane and corner.
pub(crate) type Places = [[u8; 3]; PACKET];

/// The patterns in ascending order, and behind them that of four points, which no record states. The hexadecimal digits
/// are the slots of corners 0, 1 and 2 of lane 0, then of lane 1, and so on.
const TABLE: [u64; PATTERNS + 1] = [
    0x012_012_012_012,
    0x012_013_024_034,
    0x012_013_024_035,
    0x012_013_024_043,
    0x012_013_024_045,
    0x012_013_024_152,
    0x012_013_024_153,
    0x012_013_024_156,
    0x012_013_024_254,
    0x012_013_024_256,
    0x012_013_024_567,
    0x012_013_142_153,
    0x012_013_142_154,
    0x012_013_142_245,
    0x012_013_142_253,
    0x012_013_142_456,
    0x012_013_142_567,
    0x012_023_023_023,
    0x012_023_031_132,
    0x012_023_031_134,
    0x012_023_034_034,
    0x012_023_034_041,
    0x012_023_034_045,
    0x012_023_034_056,
    0x012_023_034_145,
    0x012_023_034_152,
    0x012_023_034_156,
    0x012_023_034_253,
    0x012_023_034_254,
    0x012_023_034_256,
    0x012_023_034_354,
    0x012_023_034_356,
    0x012_023_034_456,
    0x012_023_034_567,
    0x012_023_045_045,
    0x012_023_045_056,
    0x012_023_045_067,
    0x012_023_045_156,
    0x012_023_045_167,
    0x012_023_045_267,
    0x012_023_045_364,
    0x012_023_045_367,
    0x012_023_045_465,
    0x012_023_045_467,
    0x012_023_045_567,
    0x012_023_045_678,
    0x012_023_145_145,
    0x012_023_145_167,
    0x012_023_145_354,
    0x012_023_145_367,
    0x012_023_145_465,
    0x012_023_145_467,
    0x012_023_145_567,
    0x012_023_145_678,
    0x012_023_456_456,
    0x012_023_456_467,
    0x012_023_456_478,
    0x012_023_456_789,
    0x012_034_034_034,
    0x012_034_567_589,
    0x012_034_567_89a,
    0x012_345_345_345,
    0x012_345_678_678,
    0x012_345_678_9ab,
    0x000_111_222_333,
];

/// The slots of each pattern's lanes and corners.
pub(crate) const PLACES: [Places; PATTERNS + 1] = {
    let mut places = [[[0; 3]; PACKET]; PATTERNS + 1];
    let mut pattern = 0;
    while pattern <= PATTERNS {
        let mut digit = 0;
        while digit < MAX_SLOTS {
            places[pattern][digit / 3][digit % 3] =
                (TABLE[pattern] >> (4 * (MAX_SLOTS - 1 - digit)) & 15) as u8;
            digit += 1;
        }
        pattern += 1;
    }
    places
};

/// The number of slots of each pattern.
pub(crate) const SLOTS: [u8; PATTERNS + 1] = {
    let mut slots = [0; PATTERNS + 1];
    let mut pattern = 0;
    while pattern <= PATTERNS {
        let mut digit = 0;
        while digit < MAX_SLOTS {
            let slot = PLACES[pattern][digit / 3][digit % 3];
            if slot >= slots[pattern] {
                slots[pattern] = slot + 1;
            }
            digit += 1;
        }
        pattern += 1;
    }
    slots
};

/// The slots of one lane's corners, by pattern, lane and rotation: those of corner c in byte `4 * c + lane` of a
/// little-endian number, whose other bytes are zero. Rotations beyond 2 count as 0.
pub(crate) static CORNERS: [[[u128; 4]; PACKET]; PATTERNS + 1] = {
    let mut corners = [[[0; 4]; PACKET]; PATTERNS + 1];
    let mut at = 0;
    while at < (PATTERNS + 1) * PACKET * 4 * 3 {
        let (corner, rotation, lane, pattern) = (at % 3, at / 3 % 4, at / 12 % PACKET, at / 12 / PACKET);
        let slot = PLACES[pattern][lane][(corner + rotation) % 3];
        corners[pattern][lane][rotation] |= (slot as u128) << (8 * (PACKET * corner + lane));
        at += 1;
    }
    corners
};

/// How a packet fits a pattern of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fit {
    /// The number of the pattern.
    pub(crate) pattern: u8,
    /// By lane, how far the triangle is rotated.
    pub(crate) rotations: [u8; PACKET],
}

impl Fit {
    /// Finds the pattern of a packet, by whose `labels` corners are the same vertex if their labels are equal.
    pub(crate) fn new(labels: &Places) -> Self {
        let found = Canonical::of(labels, PACKET);
        match TABLE[..PATTERNS].binary_search(&found.digits) {
            Ok(pattern) => Self { pattern: pattern as u8, rotations: found.rotations },
            Err(_) => Self { pattern: PATTERNS as u8 - 1, rotations: [0; PACKET] },
        }
    }
}

/// The least sequence of slots to which rotations lead.
#[derive(Clone, Copy)]
struct Canonical {
    /// The sequence as hexadecimal digits.
    digits: u64,
    rotations: [u8; PACKET],
}

impl Canonical {
    /// Finds it for the first `lanes` lanes.
    fn of(labels: &Places, lanes: usize) -> Self {
        let mut best = Self { digits: u64::MAX, rotations: [0; PACKET] };
        Self { digits: 0, ..best }.add_lanes(&labels[..lanes], 0, Slots::NONE, &mut best);
        best
    }

    /// Adds each lane from `first` on in the rotation that makes the least digits. Where there are several, it goes on with
    /// each of them.
    fn add_lanes(mut self, lanes: &[[u8; 3]], first: usize, mut slots: Slots, best: &mut Self) {
        for (lane, &corners) in lanes.iter().enumerate().skip(first) {
            if self.digits > best.digits >> (12 * (lanes.len() - lane)) {
                return;
            }
            let [a, b, c] = corners.map(|label| slots.of(label));
            let least = a.min(b).min(c);
            let several = least == Slots::NO_SLOT
                || corners[0] == corners[1]
                || corners[1] == corners[2]
                || corners[2] == corners[0];
            if !several {
                // The corner with the least slot comes first.
                self.add_lane(
                    lane,
                    corners,
                    if a == least {
                        0
                    } else if b == least {
                        2
                    } else {
                        1
                    },
                    &mut slots,
                );
                continue;
            }
            let digits = [0, 1, 2].map(|rotation| {
                let (mut rotated, mut slots) = (self, slots);
                rotated.add_lane(lane, corners, rotation, &mut slots);
                rotated.digits
            });
            let least = digits[0].min(digits[1]).min(digits[2]);
            for (rotation, _) in (0..).zip(digits).filter(|&(_, digits)| digits == least) {
                let (mut rotated, mut slots) = (self, slots);
                rotated.add_lane(lane, corners, rotation, &mut slots);
                rotated.add_lanes(lanes, lane + 1, slots, best);
            }
            return;
        }
        if self.digits < best.digits {
            *best = self;
        }
    }

    /// Adds a lane in some rotation.
    #[inline(always)]
    fn add_lane(&mut self, lane: usize, corners: [u8; 3], rotation: usize, slots: &mut Slots) {
        self.rotations[lane] = rotation as u8;
        for place in 0..3 {
            // The rotation takes this corner to `place`.
            let label = corners[(place + 3 - rotation) % 3];
            self.digits = self.digits << 4 | slots.find_or_add(label);
        }
    }
}

/// The slot of each label, in hexadecimal digits.
#[derive(Clone, Copy)]
struct Slots {
    by_label: u64,
    used: u64,
}

impl Slots {
    /// Stands for the slot of a label that has none yet.
    const NO_SLOT: u64 = 15;
    const NONE: Self = Self { by_label: u64::MAX, used: 0 };

    #[inline(always)]
    fn of(self, label: u8) -> u64 {
        self.by_label >> (4 * (label & 15)) & 15
    }

    #[inline(always)]
    fn find_or_add(&mut self, label: u8) -> u64 {
        let slot = self.of(label);
        if slot != Self::NO_SLOT {
            return slot;
        }
        // All bits of a digit that is not in use are set.
        self.by_label ^= (Self::NO_SLOT ^ self.used) << (4 * (label & 15));
        self.used += 1;
        self.used - 1
    }
}

/// The orders of lanes with which packets fit a pattern of the table, by number of lanes and canonical digits.
static ORDERS: LazyLock<HashMap<(usize, u64), [u8; PACKET]>> = LazyLock::new(|| {
    let mut orders = HashMap::new();
    for places in &PLACES[..PATTERNS - 1] {
        for lanes in 1..=PACKET {
            if (lanes..PACKET).any(|lane| places[lane] != places[lanes - 1]) {
                continue;
            }
            for order in permutations(lanes) {
                // The lanes in some other order, and the order that leads back.
                let mut labels = *places;
                (0..lanes).for_each(|lane| labels[usize::from(order[lane])] = places[lane]);
                orders.entry((lanes, Canonical::of(&labels, lanes).digits)).or_insert(order);
            }
        }
    }
    orders
});

/// All orders of the first `lanes` lanes; the others stay in place.
fn permutations(lanes: usize) -> impl Iterator<Item = [u8; PACKET]> {
    (0..256usize).filter_map(move |code| {
        let order = [0, 2, 4, 6].map(|shift| (code >> shift & 3) as u8);
        let mut seen = [false; PACKET];
        order.iter().for_each(|&lane| seen[usize::from(lane)] = true);
        let rest_stays = (lanes..PACKET).all(|lane| usize::from(order[lane]) == lane);
        (rest_stays && seen == [true; PACKET]).then_some(order)
    })
}

/// Gives equal numbers to corners of which all bits are equal: the place of the first such corner, `3 * lane + corner`.
pub(crate) fn labels_of<T>(triangles: &[[[T; 3]; 3]; PACKET]) -> Places
where
    T: Copy + Default + PartialEq + BitOr<Output = T> + BitXor<Output = T>,
{
    // One array per axis: compilers turn the comparison of one corner with all into vector code.
    let mut axes = [[T::default(); 16]; 3];
    for place in 0..MAX_SLOTS {
        for axis in 0..3 {
            axes[axis][place] = triangles[place / 3][place % 3][axis];
        }
    }
    let mut labels = [[0; 3]; PACKET];
    for place in 0..MAX_SLOTS {
        let mut equal = 0u32;
        for other in 0..MAX_SLOTS {
            let differs =
                (0..3).fold(T::default(), |bits, axis| bits | axes[axis][other] ^ axes[axis][place]);
            equal |= u32::from(differs == T::default()) << other;
        }
        labels[place / 3][place % 3] = equal.trailing_zeros() as u8;
    }
    labels
}

/// Returns the order of one to four triangles in which their packet takes the fewest bytes: the number of the triangle
/// that comes first, second and so on. It depends only on which corners are equal. If no order helps, it is the one
/// given.
pub fn order_of_lanes(triangles: &[[[f32; 3]; 3]]) -> [u8; PACKET] {
    let count = triangles.len().min(PACKET);
    let mut bits = [[[0; 3]; 3]; PACKET];
    for (bits, triangle) in bits.iter_mut().zip(triangles) {
        *bits = triangle.map(|corner| corner.map(f32::to_bits));
    }
    let digits = Canonical::of(&labels_of(&bits), count).digits;
    ORDERS.get(&(count, digits)).copied().unwrap_or([0, 1, 2, 3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::leaf::Packet;
    use cbvh_testkit::Random;

    #[test]
    fn the_table_ascends_and_each_pattern_numbers_its_slots_as_they_come_by() {
        assert!(TABLE[..PATTERNS].is_sorted());
        for (places, &slots) in PLACES.iter().zip(&SLOTS) {
            let mut next = 0;
            for &slot in places.iter().flatten() {
                assert!(slot <= next, "{places:?}");
                next = next.max(slot + 1);
            }
            assert_eq!(next, slots);
        }
        assert_eq!(PLACES[PATTERNS - 1], [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]]);
    }

    /// Each pattern fits itself, however its triangles are rotated and its vertices are named.
    #[test]
    fn patterns_fit_however_they_are_rotated() {
        let mut random = Random::new(4);
        for (number, places) in PLACES[..PATTERNS].iter().enumerate() {
            for _ in 0..200 {
                let mut names: Vec<u8> = (0..12).collect();
                (1..12).for_each(|last| names.swap(last, random.below(last + 1)));
                let labels = places.map(|lane| {
                    let rotation = random.below(3);
                    [0, 1, 2].map(|corner| names[usize::from(lane[(corner + rotation) % 3])])
                });
                let fit = Fit::new(&labels);
                assert_eq!(usize::from(fit.pattern), number);
                let mut held = [None; MAX_SLOTS];
                for lane in 0..PACKET {
                    for corner in 0..3 {
                        let corners = CORNERS[number][lane][usize::from(fit.rotations[lane])].to_le_bytes();
                        let slot = usize::from(corners[PACKET * corner + lane]);
                        assert_eq!(*held[slot].get_or_insert(labels[lane][corner]), labels[lane][corner]);
                    }
                }
            }
        }
    }

    /// However the triangles of a pattern are rotated and ordered, `order_of_lanes` finds an order in which they fit it,
    /// or another one.
    #[test]
    fn an_order_of_lanes_leads_to_a_pattern() {
        let mut random = Random::new(9);
        for (number, places) in PLACES[..PATTERNS].iter().enumerate() {
            let repeated = (1..PACKET).rev().take_while(|&lane| places[lane] == places[lane - 1]).count();
            for _ in 0..50 {
                let count = PACKET - random.below(repeated + 1);
                let mut triangles: Vec<[[f32; 3]; 3]> = places[..count]
                    .iter()
                    .map(|lane| {
                        let rotation = random.below(3);
                        [0, 1, 2].map(|corner| [f32::from(lane[(corner + rotation) % 3]), 0.5, 0.0])
                    })
                    .collect();
                (1..count).for_each(|last| triangles.swap(last, random.below(last + 1)));
                let order = order_of_lanes(&triangles);
                let ordered: Vec<_> =
                    order[..count].iter().map(|&lane| triangles[usize::from(lane)]).collect();
                let packet = Packet::new(&ordered);
                let bits = [0, 1, 2, 3].map(|lane| packet.triangle(lane).map(|c| c.map(f32::to_bits)));
                let fit = Fit::new(&labels_of(&bits));
                if number + 1 < PATTERNS {
                    assert!(usize::from(fit.pattern) + 1 < PATTERNS, "{number}: {triangles:?}");
                } else {
                    assert_eq!((usize::from(fit.pattern), order), (number, [0, 1, 2, 3]));
                }
            }
        }
    }

    #[test]
    fn a_packet_of_no_pattern_keeps_all_corners() {
        // Four triangles around an edge, all turned the same way, and a spike.
        let labels = [[0, 1, 2], [0, 1, 0], [3, 3, 3], [4, 4, 5]];
        let fit = Fit::new(&labels);
        assert_eq!(fit, Fit { pattern: PATTERNS as u8 - 1, rotations: [0; PACKET] });
    }
}
