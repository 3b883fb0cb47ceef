//! The predictor: the end of a child's slab is the *decoded* end of its parent's slab, moved inward by a residual.
//!
//! Decoder and encoder stand side by side. The encoder searches for the largest residual whose decoded value, computed
//! by the decoder's own operations, still lies outside the true value. So a decoded slab always contains the true one.
//! Since the prediction starts from the decoded parent, the errors of successive levels do not add up. The method is that
//! of Tan, Weller and Zachmann (arXiv 2012.05348, section 4), with explicit rounding.
//!
//! A quantisation step has 16 significant bits and a code at most 8, so their product is exact in `f32`. A decoder
//! therefore gets the same bits whether it fuses the product with the sum or not.

use crate::profile::Encoding;
use half::f16;

/// The step of a code of 8 bits, as a fraction of the slab's width: `1 / 255`, rounded to `f32`.
pub const STEP_U8: f32 = 1.0 / 255.0;
/// The step of a code of 4 bits, as a fraction of the slab's width: `1 / 15`, rounded to `f32`.
pub const STEP_U4: f32 = 1.0 / 15.0;
/// The largest code of an f16 residual: the largest finite f16.
pub(crate) const F16_MAX_CODE: u16 = 0x7bff;

/// Rounds a non-negative step up to 16 significant bits.
#[inline]
pub fn round_step_up(step: f32) -> f32 {
    f32::from_bits(step.to_bits().wrapping_add(0xff) & !0xff)
}

/// Returns the unit of the residuals of one slab, given the parent's decoded slab. `object_scale` is the object's power
/// of two, which only `F16` uses.
#[inline]
pub fn residual_unit(encoding: Encoding, parent_lo: f32, parent_hi: f32, object_scale: f32) -> f32 {
    match encoding {
        Encoding::U4 => round_step_up((parent_hi - parent_lo) * STEP_U4),
        Encoding::U8 => round_step_up((parent_hi - parent_lo) * STEP_U8),
        Encoding::F16 => object_scale,
        Encoding::F32 => 0.0,
    }
}

/// Returns how far a code moves the parent's end inward, in mesh units along the direction.
#[inline]
fn residual(encoding: Encoding, code: u16, unit: f32) -> f32 {
    match encoding {
        Encoding::U4 | Encoding::U8 => f32::from(code) * unit,
        Encoding::F16 => f16::from_bits(code).to_f32() * unit,
        Encoding::F32 => 0.0,
    }
}

/// Decodes a lower end.
#[inline]
pub fn decode_min(encoding: Encoding, code: u16, parent_lo: f32, unit: f32) -> f32 {
    parent_lo + residual(encoding, code, unit)
}

/// Decodes an upper end.
#[inline]
pub fn decode_max(encoding: Encoding, code: u16, parent_hi: f32, unit: f32) -> f32 {
    parent_hi - residual(encoding, code, unit)
}

/// Returns the largest code whose decoded lower end is at most `true_lo`, which must be at least `parent_lo`.
pub fn encode_min_outward(encoding: Encoding, true_lo: f32, parent_lo: f32, unit: f32) -> u16 {
    largest_code(encoding, true_lo - parent_lo, unit, |code| {
        decode_min(encoding, code, parent_lo, unit) <= true_lo
    })
}

/// Returns the largest code whose decoded upper end is at least `true_hi`, which must be at most `parent_hi`.
pub fn encode_max_outward(encoding: Encoding, true_hi: f32, parent_hi: f32, unit: f32) -> u16 {
    largest_code(encoding, parent_hi - true_hi, unit, |code| {
        decode_max(encoding, code, parent_hi, unit) >= true_hi
    })
}

/// Searches for the last code that fits, from a guess. Codes are in the order of their residuals, and those that fit
/// are a prefix of all codes that includes 0.
fn largest_code(encoding: Encoding, gap: f32, unit: f32, fits: impl Fn(u16) -> bool) -> u16 {
    let (guess, last) = match encoding {
        Encoding::U4 => (saturated(gap / unit, 15), 15),
        Encoding::U8 => (saturated(gap / unit, 255), 255),
        Encoding::F16 => {
            let guess = f16::from_f32(gap / unit);
            let code = if guess > f16::ZERO { guess.to_bits().min(F16_MAX_CODE) } else { 0 };
            (code, F16_MAX_CODE)
        }
        Encoding::F32 => return 0,
    };
    search(guess, last, fits)
}

/// Steps from a guess to the last code that fits.
fn search(guess: u16, last: u16, fits: impl Fn(u16) -> bool) -> u16 {
    let mut code = guess;
    while code > 0 && !fits(code) {
        code -= 1;
    }
    while code < last && fits(code + 1) {
        code += 1;
    }
    code
}

/// The integer part of a quotient, at most `last`; 0 for 0 / 0.
fn saturated(quotient: f32, last: u16) -> u16 {
    (quotient as u16).min(last)
}

/// Encodes four lower ends at a time, as `encode_min_outward` does one, with integer codes up to `last`. Each end must
/// be at least the parent's. For upper ends, negate them and those of the parent. `inverse` is 1 / `unit`, rounded.
#[inline(always)]
pub(crate) fn encode_four_outward(
    last: u16,
    ends: [f32; 4],
    parent: [f32; 4],
    unit: [f32; 4],
    inverse: [f32; 4],
) -> [u16; 4] {
    /// 2^23: adding and subtracting it rounds to the nearest whole number.
    const ROUNDER: f32 = 8_388_608.0;
    let max_code = f32::from(last);
    let mut codes = [0; 4];
    let mut unsettled = [0u32; 4];
    // Without branches, compilers turn the lanes into vector code.
    for lane in 0..4 {
        let fits = |code: f32| parent[lane] + code * unit[lane] <= ends[lane];
        let quotient = (ends[lane] - parent[lane]) * inverse[lane];
        // In a flat slab the product of 0 and infinity is NaN, and every code fits.
        let guess = (if quotient < max_code { quotient } else { max_code }) + ROUNDER - ROUNDER;
        let code = if fits(guess) { guess } else { guess - 1.0 };
        let next_fits = u32::from(fits(code + 1.0)) & u32::from(code < max_code);
        unsettled[lane] = u32::from(!fits(code)) | next_fits;
        // The low bits of the sum are the code.
        codes[lane] = (code + ROUNDER).to_bits() as u16;
    }
    if unsettled != [0; 4] {
        // The rounding of large ends has moved a guess by more than one.
        return search_four(last, ends, parent, unit);
    }
    codes
}

/// The same for ends that need a search.
#[cold]
#[inline(never)]
fn search_four(last: u16, ends: [f32; 4], parent: [f32; 4], unit: [f32; 4]) -> [u16; 4] {
    let fits = |lane: usize, code: u16| parent[lane] + f32::from(code) * unit[lane] <= ends[lane];
    std::array::from_fn(|lane| {
        let gap = ends[lane] - parent[lane];
        search(saturated(gap / unit[lane], last), last, |code| fits(lane, code))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_testkit::Random;

    #[test]
    fn decoded_ends_contain_the_true_ones_and_are_the_tightest() {
        let mut random = Random::new(7);
        let mut random = move || random.signed() as f32;
        for encoding in [Encoding::U4, Encoding::U8, Encoding::F16] {
            for round in 0..200_000 {
                let scale = 2f32.powi(round % 100 - 50);
                let mut ends = [random(), random(), random(), random()].map(|v| v * scale);
                if round % 7 == 0 {
                    ends[1] = ends[0];
                }
                ends.sort_by(f32::total_cmp);
                let [parent_lo, lo, hi, parent_hi] = ends;
                let unit = residual_unit(encoding, parent_lo, parent_hi, scale * 2f32.powi(-14));
                let code_lo = encode_min_outward(encoding, lo, parent_lo, unit);
                let code_hi = encode_max_outward(encoding, hi, parent_hi, unit);
                if let Encoding::U4 | Encoding::U8 = encoding {
                    let last = if encoding == Encoding::U4 { 15 } else { 255 };
                    let (ends, parent) = ([lo, -hi, hi, parent_hi], [parent_lo, -parent_hi, lo, parent_hi]);
                    let four = encode_four_outward(last, ends, parent, [unit; 4], [1.0 / unit; 4]);
                    let third = encode_min_outward(encoding, hi, lo, unit);
                    let fourth = encode_min_outward(encoding, parent_hi, parent_hi, unit);
                    assert_eq!(four, [code_lo, code_hi, third, fourth]);
                }
                assert!(decode_min(encoding, code_lo, parent_lo, unit) <= lo);
                assert!(decode_max(encoding, code_hi, parent_hi, unit) >= hi);
                // The next code would cut the true slab, unless there is none.
                let last = match encoding {
                    Encoding::U4 => 15,
                    Encoding::U8 => 255,
                    _ => F16_MAX_CODE,
                };
                if code_lo < last {
                    assert!(decode_min(encoding, code_lo + 1, parent_lo, unit) > lo);
                }
                if code_hi < last {
                    assert!(decode_max(encoding, code_hi + 1, parent_hi, unit) < hi);
                }
            }
        }
    }

    #[test]
    fn steps_are_rounded_up_to_sixteen_bits() {
        for bits in (0..0x7f00_0000u32).step_by(99_991) {
            let rounded = round_step_up(f32::from_bits(bits)).to_bits();
            assert!(rounded & 0xff == 0 && (bits..bits + 0x100).contains(&rounded), "{bits:x} {rounded:x}");
        }
    }

    #[test]
    fn codes_reach_from_one_end_to_the_other() {
        for seed in 0..50_000u32 {
            let lo =
                (seed.wrapping_mul(0x9e37_79b9) as f32 - 2f32.powi(31)) * 2f32.powi(seed as i32 % 80 - 70);
            let hi = lo + (seed.wrapping_mul(0x85eb_ca6b) as f32) * 2f32.powi(seed as i32 % 70 - 65);
            for (encoding, last) in [(Encoding::U8, 255u16), (Encoding::U4, 15)] {
                let unit = residual_unit(encoding, lo, hi, 7.0);
                let ends = [0.3, 0.6, 0.999, 1.0].map(|share| (lo + share * (hi - lo)).clamp(lo, hi));
                let one_by_one = ends.map(|end| encode_min_outward(encoding, end, lo, unit));
                let four = encode_four_outward(last, ends, [lo; 4], [unit; 4], [1.0 / unit; 4]);
                assert_eq!(four, one_by_one, "{lo:e} {hi:e}");
                assert_eq!([decode_min(encoding, 0, lo, unit), decode_max(encoding, 0, hi, unit)], [lo, hi]);
                // The last code misses the other end by a few roundings, one of them to 16 bits.
                let width = f64::from(hi) - f64::from(lo);
                let ends = [decode_min(encoding, last, lo, unit), decode_max(encoding, last, hi, unit)];
                for (end, opposite) in ends.into_iter().zip([hi, lo]) {
                    let off = (f64::from(end) - f64::from(opposite)).abs();
                    let rounding = f64::from(lo.abs().max(hi.abs())) * f64::from(f32::EPSILON);
                    assert!(off <= 4e-5 * width + rounding, "{lo:e} {hi:e} {end:e}");
                }
            }
            assert_eq!(residual_unit(Encoding::F16, lo, hi, 0.125), 0.125);
            assert_eq!(residual_unit(Encoding::F32, lo, hi, 0.125), 0.0);
            assert_eq!(residual(Encoding::F16, f16::from_f32(3.0).to_bits(), 0.125), 0.375);
        }
    }

    #[test]
    fn codes_of_a_flat_parent_are_codes() {
        for (encoding, last) in [(Encoding::U8, 255), (Encoding::U4, 15)] {
            let unit = residual_unit(encoding, 3.0, 3.0, 1.0);
            assert!(encode_min_outward(encoding, 3.0, 3.0, unit) <= last);
            assert!(encode_max_outward(encoding, 3.0, 3.0, unit) <= last);
        }
    }

    #[test]
    fn products_of_code_and_step_are_exact() {
        for seed in 0..50_000u32 {
            let width = f32::from_bits(0x2000_0000 + seed.wrapping_mul(0x9e37_79b9) % 0x3000_0000);
            for (step, last) in [(STEP_U8, 255u16), (STEP_U4, 15)] {
                let unit = round_step_up(width * step);
                for code in [1, 7, last / 2, last] {
                    let product = f32::from(code) * unit;
                    assert_eq!(f64::from(product), f64::from(code) * f64::from(unit));
                }
            }
        }
    }
}
