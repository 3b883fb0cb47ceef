//! Maps floats to integers that are in the same order.

/// Maps the bits of a float to an integer. Integers are in the same order as their floats.
#[inline]
pub fn to_ordered(value: f32) -> i32 {
    flip(value.to_bits() as i32)
}

/// Returns the float of an ordered integer.
#[inline]
pub fn from_ordered(ordered: i32) -> f32 {
    f32::from_bits(flip(ordered) as u32)
}

/// Maps the bits of an `f64` to an integer, as [`to_ordered`] does.
#[inline]
pub fn to_ordered_f64(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// Returns the `f64` of an ordered integer.
#[inline]
pub fn from_ordered_f64(ordered: i64) -> f64 {
    f64::from_bits((ordered ^ ((ordered >> 63) as u64 >> 1) as i64) as u64)
}

/// Flips all bits but the sign of a negative number. It is its own inverse.
#[inline]
fn flip(bits: i32) -> i32 {
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordered_integers_keep_the_order() {
        let values = [-1e30f32, -1.0, -1e-40, 0.0, 1e-45, 1e-40, 0.5, 1.0, 1e30];
        for pair in values.windows(2) {
            assert!(to_ordered(pair[0]) < to_ordered(pair[1]));
        }
        for pair in values.map(f64::from).windows(2) {
            assert!(to_ordered_f64(pair[0]) < to_ordered_f64(pair[1]));
        }
        for value in values {
            assert_eq!(from_ordered(to_ordered(value)).to_bits(), value.to_bits());
            let wide = f64::from(value);
            assert_eq!(from_ordered_f64(to_ordered_f64(wide)).to_bits(), wide.to_bits());
        }
    }
}
