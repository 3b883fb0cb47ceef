//! Tests that backends agree: they decode every profile and packed packets to the bits of the reference, compare in the same
//! way, find the same least and nearest lane, and compute the same of three corners.

use super::corners::Corners;
use super::doubles::Doubles;
use super::{Backend, Isa, Lanes, Task};
use crate::file::unpack::unpack;
use crate::traverse::decode::{Coding, Parent, decode_group};
use bvh_format::leaf::{Packet, TriangleEncoding, decode_packet, encode_block};
use bvh_format::page::decode::decode_child;
use bvh_format::profile::Profile;
use bvh_format::slabs::row;
use bvh_format::slabs::{Group, NodeSlabs};
use bvh_format::treelet::{SHORT_TREELET_BYTES, child_slabs};
use bvh_format::vertex::Vertices;
use cbvh_testkit::Random;

struct Decode<'a> {
    profile: Profile,
    scale: f32,
    treelet: &'a [u8],
    part: usize,
    parent: &'a Group,
    column: usize,
}

impl Task for Decode<'_> {
    type Output = Group;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Group {
        let mut out = Group::ZERO;
        decode_group(
            isa,
            Coding { profile: self.profile, f16_scale: self.scale },
            (self.treelet, self.part),
            Parent::Node(self.parent, self.column),
            &mut out,
        );
        out
    }
}

#[test]
fn every_backend_decodes_to_the_bits_of_the_reference() {
    let mut random = Random::new(3);
    let mut random = || (random.bits() >> 32) as u32;
    for backend in Backend::ALL {
        if !backend.is_available() {
            cbvh_testkit::skip(&format!("this CPU has no {backend}"));
            continue;
        }
        for profile in Profile::ALL {
            for round in 0..300 {
                // Every third treelet is short.
                let is_short = profile.has_short_treelets() && round % 3 == 0;
                let bytes = if is_short { SHORT_TREELET_BYTES } else { profile.treelet_bytes() };
                let mut treelet: Vec<u8> = (0..bytes).map(|_| random() as u8).collect();
                if profile.encoding() == bvh_format::profile::Encoding::F16 {
                    // Codes are non-negative and finite.
                    treelet.as_chunks_mut::<2>().0.iter_mut().for_each(|code| code[1] &= 0x7b);
                }
                let scale = 2f32.powi(round % 80 - 40);
                let mut parent = Group::ZERO;
                for (lo, hi) in parent.lo.iter_mut().flatten().zip(parent.hi.iter_mut().flatten()) {
                    *lo = (random() as f32 / 1e9 - 2.0) * scale;
                    *hi = *lo + random() as f32 / 1e9 * scale;
                }
                let column = (random() % 4) as usize;
                let above: NodeSlabs = child_slabs(&parent, column);
                for part in 0..profile.groups() {
                    let task = Decode { profile, scale, treelet: &treelet, part, parent: &parent, column };
                    let group = backend.run(task);
                    for child in 0..profile.width().min(4) {
                        let expected = decode_child(profile, scale, &treelet, 4 * part + child, &above);
                        let found = child_slabs(&group, child);
                        for slab in 0..profile.directions().slabs() {
                            let bits = |n: &NodeSlabs| (n.lo[row(slab)].to_bits(), n.hi[row(slab)].to_bits());
                            assert_eq!(bits(&found), bits(&expected), "{backend} {} {slab}", profile.name());
                        }
                    }
                }
            }
        }
    }
}

struct Unpack<'a>(&'a [u8], usize);

impl Task for Unpack<'_> {
    type Output = Packet;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Packet {
        let mut packet = Packet::NONE;
        unpack(isa, self.0, self.1, &mut packet);
        packet
    }
}

/// Blocks of ordered, binary and decimal coordinates, with and without further slots, as they are and with bytes changed.
#[test]
fn every_backend_unpacks_to_the_bits_of_the_reference() {
    let mut random = Random::new(7);
    let mut random = move || (random.bits() >> 33) as usize;
    let kinds: [fn(usize) -> f32; 4] = [
        |r| f32::from_bits(r as u32 & 0x7bff_ffff),
        |r| (r % 4096) as f32 / 64.0 - 30.0,
        |r| ((r % 20_000) as f64 / 1e5 - 0.1) as f32,
        |r| (r % 3) as f32,
    ];
    let bits = |packet: &Packet| packet.corners.map(|corner| corner.map(|axis| axis.map(f32::to_bits)));
    for (kind, make) in kinds.into_iter().enumerate() {
        for round in 0..60 {
            let pool: Vec<[f32; 3]> =
                (0..1 + random() % 200).map(|_| [(); 3].map(|()| make(random()))).collect();
            let packets: Vec<Packet> = (0..1 + random() % 100)
                .map(|_| {
                    let near = random();
                    let corner = |reach: usize| pool[(near + reach) % pool.len()];
                    let triangles: Vec<[[f32; 3]; 3]> = (0..1 + random() % 4)
                        .map(|_| [(); 3].map(|()| corner(random() % (4 + round % 9))))
                        .collect();
                    Packet::new(&triangles)
                })
                .collect();
            // The last packet comes first.
            let order: Vec<u16> = (0..packets.len() as u16).rev().collect();
            let block =
                encode_block(TriangleEncoding::Packed, &packets, &order, &Vertices::around([0.0; 3]), &[]);
            let mut changed = block.clone();
            for _ in 0..1 + random() % 4 {
                let at = random() % changed.len();
                changed[at] = random() as u8;
            }
            for (bytes, index) in
                (0..packets.len()).map(|i| (&block, i)).chain((0..packets.len() + 2).map(|i| (&changed, i)))
            {
                let expected = decode_packet(TriangleEncoding::Packed, bytes, index);
                if std::ptr::eq(bytes, &block) {
                    assert_eq!(bits(&expected), bits(&packets[index]), "kind {kind}");
                }
                for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
                    let found = backend.run(Unpack(bytes, index));
                    assert_eq!(bits(&found), bits(&expected), "{backend}, kind {kind}, packet {index}");
                }
            }
        }
    }
}

struct Least<'a>(&'a [f32; 16], u16);

impl Task for Least<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> u32 {
        isa.least(self.0, self.1)
    }
}

#[test]
fn every_backend_finds_the_first_of_the_least_lanes() {
    let mut random = Random::new(5);
    let mut random = || (random.bits() >> 40) as u32;
    for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
        assert!(backend.run(Least(&[0.0; 16], 0)) >= 16);
        for round in 0..5000 {
            // Few different values, so that some are equal; infinities and zeros of both signs among them.
            let values = [f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1.5, -2.5, 1e-40, f32::MAX];
            let lanes: [f32; 16] = std::array::from_fn(|_| values[random() as usize % values.len()]);
            let mask = random() as u16;
            let set = (0..16).filter(|lane| mask >> lane & 1 == 1);
            let expected = set.reduce(|best, lane| if lanes[lane] < lanes[best] { lane } else { best });
            let found = backend.run(Least(&lanes, mask));
            assert_eq!(
                (found < 16).then_some(found as usize),
                expected,
                "{backend}, round {round}: {lanes:?}"
            );
        }
    }
}

struct Nearest<'a>(&'a [f32; 16], u16);

impl Task for Nearest<'_> {
    type Output = i32;

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> i32 {
        isa.nearest(self.0, self.1)
    }
}

#[test]
fn every_backend_finds_the_same_nearest_lane() {
    let mut random = Random::new(6);
    for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
        for round in 0..5000 {
            let values = [f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1.5, -2.5, 1e-40, -1e-40];
            let lanes: [f32; 16] = std::array::from_fn(|_| {
                let value = values[random.below(values.len())];
                if value.is_finite() {
                    f32::from_bits(value.to_bits() ^ random.below(32) as u32)
                } else {
                    value
                }
            });
            let mask = random.bits() as u16;
            let found = backend.run(Nearest(&lanes, mask));
            let expected = (0..16).filter(|lane| mask >> lane & 1 == 1).map(|lane| {
                // The bits of a negative number count backwards.
                let bits = lanes[lane].to_bits() as i32;
                let order = if bits < 0 { i32::MIN - bits - 1 } else { bits };
                order.div_euclid(16) * 16 + lane as i32
            });
            assert_eq!(found, expected.min().unwrap_or(i32::MAX), "{backend}, round {round}: {lanes:?}");
        }
    }
}

struct OfCorners([f64; 3], [f64; 3]);

/// All operations with two operands, `abs`, the choice of where the first is less and of where both comparisons hold, and the largest.
impl Task for OfCorners {
    type Output = ([[f64; 3]; 9], f64);

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let (x, y, two) = (isa.corners(self.0), isa.corners(self.1), isa.corners([2.0; 3]));
        let (less, small) = (x.lt(y), x.lt(two));
        let both = <I::F64x3 as Corners>::and(less, small);
        let all = [x.add(y), x.sub(y), x.mul(y), x.div(y), x.min(y), x.max(y), x.abs()];
        let [add, sub, mul, div, min, max, abs] = all;
        let (less, both) =
            (<I::F64x3 as Corners>::select(less, x, y), <I::F64x3 as Corners>::select(both, x, y));
        let all = [
            add.all(),
            sub.all(),
            mul.all(),
            div.all(),
            min.all(),
            max.all(),
            abs.all(),
            less.all(),
            both.all(),
        ];
        assert_eq!([0, 1, 2].map(|corner| y.of(corner)), y.all());
        (all, x.largest())
    }
}

#[test]
fn every_backend_computes_the_same_of_corners() {
    let mut random = Random::new(7);
    for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
        for _ in 0..2000 {
            let mut number =
                || [0.0, -1.5, 5e-324, f64::MAX, 1e-300, random.signed(), random.signed()][random.below(7)];
            let mut three = || [number(), number(), number()];
            let (x, y) = (three(), three());
            let (all, largest) = backend.run(OfCorners(x, y));
            let each = |f: fn(f64, f64) -> f64| [f(x[0], y[0]), f(x[1], y[1]), f(x[2], y[2])];
            let less = |x, y| if x < y { x } else { y };
            let expected = [
                each(|x, y| x + y),
                each(|x, y| x - y),
                each(|x, y| x * y),
                each(|x, y| x / y),
                each(less),
                each(|x, y| if x > y { x } else { y }),
                x.map(f64::abs),
                each(less),
                each(|x, y| if x < y && x < 2.0 { x } else { y }),
            ];
            let bits = |all: [[f64; 3]; 9]| {
                all.as_flattened().iter().map(|x| (x.to_bits(), x.is_nan())).collect::<Vec<_>>()
            };
            for (found, expected) in bits(all).iter().zip(bits(expected)) {
                // Which NaN it is does not matter.
                assert!(*found == expected || found.1 && expected.1, "{backend}: {x:?} {y:?}");
            }
            assert_eq!(largest, x[0].max(x[1]).max(x[2]));
        }
    }
}

struct Compare<'a>(&'a [f32; 16], &'a [f32; 16], usize);

/// The masks of `le` and `lt`; then the lanes of the minimum, of the maximum, of the maximum of numbers, of one operand where it is
/// less, and of a column.
impl Task for Compare<'_> {
    type Output = ([u16; 2], [[f32; 16]; 5]);

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let (a, b) = (isa.load(self.0), isa.load(self.1));
        let (le, lt) = (a.le(b), a.lt(b));
        let values =
            [a.min(b), a.max(b), a.max_of_numbers(b), I::F32x16::select(lt, a, b), isa.quad_splat(a, self.2)];
        let mut lanes = [[0.0; 16]; 5];
        for (value, lanes) in values.into_iter().zip(&mut lanes) {
            isa.store(value, lanes);
        }
        ([I::F32x16::bits(le), I::F32x16::bits(lt)], lanes)
    }
}

#[test]
fn every_backend_compares_as_the_portable_one_does() {
    let mut random = Random::new(11);
    let mut random = || (random.bits() >> 40) as u32;
    for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
        for round in 0..2000 {
            let values = [f32::INFINITY, f32::NEG_INFINITY, 0.0, -0.0, 1.5, 1e-40, f32::MAX, f32::NAN];
            let mut lanes =
                || -> [f32; 16] { std::array::from_fn(|_| values[random() as usize % values.len()]) };
            let (a, b) = (lanes(), lanes());
            let task = || Compare(&a, &b, round % 4);
            let (expected, found) = (Backend::Scalar.run(task()), backend.run(task()));
            assert_eq!(found.0, expected.0, "{backend}: {a:?}, {b:?}");
            for (at, (found, expected)) in found.1.iter().zip(expected.1).enumerate() {
                for lane in 0..16 {
                    // The maximum of a number and NaN may be either, and so may that of two zeros.
                    let is_free = at == 2 && (a[lane].is_nan() || b[lane].is_nan() || a[lane] == b[lane]);
                    let is_same = found[lane].to_bits() == expected[lane].to_bits()
                        || found[lane].is_nan() && expected[lane].is_nan();
                    let is_either =
                        [a[lane], b[lane]].iter().any(|operand| operand.to_bits() == found[lane].to_bits());
                    assert!(
                        is_same || is_free && is_either,
                        "{backend}, value {at}, lane {lane}: {a:?}, {b:?}, {found:?}"
                    );
                }
            }
        }
    }
}

/// Puts halves together, swaps them, and computes with four wide numbers.
struct HalvesAndDoubles<'a>(&'a [f32; 16], &'a [f32; 4]);

impl Task for HalvesAndDoubles<'_> {
    type Output = ([f32; 16], [f32; 16], [u16; 6]);

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) -> Self::Output {
        let Self(numbers, four) = self;
        let [low, high] = [0, 8].map(|first| std::array::from_fn(|lane| numbers[first + lane]));
        let (mut joined, mut swapped) = ([0.0; 16], [0.0; 16]);
        let value = isa.halves(&low, &high);
        isa.store(value, &mut joined);
        isa.store(isa.swap_halves(value), &mut swapped);
        let first: [f32; 4] = std::array::from_fn(|lane| numbers[lane]);
        let (x, y, one) = (isa.widen(&first), isa.widen(four), isa.splat_wide(1.0));
        let bits = [
            x.bits_below(y),
            x.sub(y).bits_below(one),
            x.mul(y).bits_below(one),
            x.min(y).bits_below(one),
            x.max(y).bits_below(one),
            one.bits_below(x.mul(x).sub(y.mul(y))),
        ];
        (joined, swapped, bits)
    }
}

#[test]
fn every_backend_joins_halves_and_compares_doubles_alike() {
    let mut random = Random::new(12);
    for round in 0..2000 {
        let special = [f32::NAN, f32::INFINITY, 0.0, -0.0, f32::MAX, f32::from_bits(1), 1.0, -1.0];
        let mut number = || {
            let bits = random.bits();
            if bits & 3 == 0 { special[(bits >> 8 & 7) as usize] } else { (bits >> 40) as f32 / 4e6 - 2.0 }
        };
        let numbers: [f32; 16] = std::array::from_fn(|_| number());
        let four: [f32; 4] = std::array::from_fn(|_| number());
        let bits = |(joined, swapped, of): ([f32; 16], [f32; 16], [u16; 6])| {
            (joined.map(f32::to_bits), swapped.map(f32::to_bits), of)
        };
        let expected = bits(Backend::Scalar.run(HalvesAndDoubles(&numbers, &four)));
        assert_eq!(expected.0, numbers.map(f32::to_bits));
        for backend in Backend::ALL.into_iter().filter(|backend| backend.is_available()) {
            let found = bits(backend.run(HalvesAndDoubles(&numbers, &four)));
            assert_eq!(found, expected, "{backend}, round {round}");
        }
    }
}
