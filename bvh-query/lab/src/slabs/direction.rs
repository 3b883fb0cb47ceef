//! Directions in a few bits: hemi-octahedral codes.
//!
//! A slab has no front, so half of an octahedron is enough. It is unfolded into a square and two integers a, b from -m to m
//! name a point of the square: n = (a + b, a - b, 2m - 2 max(|a|, |b|)). That is an integer vector whose coordinates'
//! magnitudes add up to 2m; it is never normalised, so decoding rounds nothing. Both signs of a direction at the rim of
//! the square have a code. The map is that of Cigolle et al., "A Survey of Efficient Representations for Independent Unit
//! Vectors" (JCGT 2014), section 3.

use super::vector::{Vector, dot, times, unit};

/// How the direction of a slab is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DirectionCode {
    /// Not at all: as the patch has it.
    Exact,
    /// Two integers of this many bits.
    Octahedral(u32),
}

impl DirectionCode {
    /// Returns the direction that a decoder finds for this one. Its length is arbitrary, and so is its sign.
    pub(super) fn stored(self, direction: Vector) -> Vector {
        match self {
            Self::Exact => unit(direction),
            Self::Octahedral(bits) => decode(encode(direction, bits), bits),
        }
    }
}

/// The largest magnitude of an integer of `bits` bits whose range is symmetric.
fn largest(bits: u32) -> i32 {
    (1 << (bits - 1)) - 1
}

/// Returns the code whose direction is nearest to this one or to its opposite.
fn encode(direction: Vector, bits: u32) -> [i32; 2] {
    let upright = if direction[2] < 0.0 { times(direction, -1.0) } else { direction };
    let sum: f64 = upright.iter().map(|coordinate| coordinate.abs()).sum();
    if sum <= 0.0 {
        return [0, 0];
    }
    let most = largest(bits);
    let [x, y, _] = times(upright, f64::from(most) / sum);
    let around = |value: f64| [value.floor(), value.ceil()].map(|value| (value as i32).clamp(-most, most));
    let near = around(x + y).into_iter().flat_map(|a| around(x - y).into_iter().map(move |b| [a, b]));
    let cosine = |code: &[i32; 2]| dot(unit(decode(*code, bits)), unit(upright));
    near.max_by(|p, q| cosine(p).total_cmp(&cosine(q))).unwrap_or([0, 0])
}

/// Returns the direction of a code.
fn decode([a, b]: [i32; 2], bits: u32) -> Vector {
    [a + b, a - b, 2 * largest(bits) - 2 * a.abs().max(b.abs())].map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cbvh_measure::poses::Random;

    #[test]
    fn every_code_is_that_of_its_direction() {
        for bits in [4, 8] {
            let most = largest(bits);
            for code in (-most..=most).flat_map(|a| (-most..=most).map(move |b| [a, b])) {
                let direction = decode(code, bits);
                let again = decode(encode(direction, bits), bits);
                assert_eq!(direction.map(f64::abs).iter().sum::<f64>(), 2.0 * f64::from(most));
                assert!(
                    again == direction || again == times(direction, -1.0),
                    "{code:?}: {direction:?} {again:?}"
                );
            }
        }
    }

    #[test]
    fn directions_are_stored_to_a_degree_in_16_bits_and_to_twelve_in_8() {
        let mut random = Random::default();
        for (bits, degrees) in [(8, 0.7), (4, 12.0)] {
            for _ in 0..20_000 {
                let direction = random.direction();
                let stored = DirectionCode::Octahedral(bits).stored(direction);
                let angle = dot(unit(stored), direction).abs().min(1.0).acos().to_degrees();
                assert!(angle < degrees, "{bits} bits: {direction:?} is {angle} degrees off");
            }
        }
        assert_eq!(DirectionCode::Octahedral(8).stored([0.0; 3]), [0.0, 0.0, 254.0]);
    }
}
