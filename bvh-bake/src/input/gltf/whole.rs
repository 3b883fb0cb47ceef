//! Reads whole numbers, which some programs write as `4.0`.

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};
use std::fmt;
use std::marker::PhantomData;

/// Above this, an f64 may stand for several whole numbers.
const MAX_EXACT: f64 = (1u64 << 53) as f64;

/// A whole number from 0.
struct Whole<T>(T);

/// A whole number of 64 bits.
#[derive(serde::Deserialize)]
#[serde(transparent)]
pub(super) struct Number(#[serde(deserialize_with = "one")] pub(super) u64);

/// Reads a whole number.
pub(super) fn one<'de, D: Deserializer<'de>, T: TryFrom<u64>>(from: D) -> Result<T, D::Error> {
    Whole::deserialize(from).map(|Whole(number)| number)
}

/// Reads a whole number that may be missing.
pub(super) fn maybe<'de, D: Deserializer<'de>, T: TryFrom<u64>>(from: D) -> Result<Option<T>, D::Error> {
    Ok(Option::deserialize(from)?.map(|Whole(number)| number))
}

/// Reads a list of whole numbers.
pub(super) fn list<'de, D: Deserializer<'de>, T: TryFrom<u64>>(from: D) -> Result<Vec<T>, D::Error> {
    Ok(Vec::deserialize(from)?.into_iter().map(|Whole(number)| number).collect())
}

impl<'de, T: TryFrom<u64>> Deserialize<'de> for Whole<T> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        from.deserialize_any(OfAnyKind(PhantomData))
    }
}

struct OfAnyKind<T>(PhantomData<T>);

impl<T: TryFrom<u64>> Visitor<'_> for OfAnyKind<T> {
    type Value = Whole<T>;

    fn expecting(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str("a whole number from 0")
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Self::Value, E> {
        let wrong = || E::invalid_value(Unexpected::Unsigned(number), &"a whole number in its range");
        T::try_from(number).map(Whole).map_err(|_| wrong())
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Self::Value, E> {
        match u64::try_from(number) {
            Ok(number) => self.visit_u64(number),
            Err(_) => Err(E::invalid_value(Unexpected::Signed(number), &self)),
        }
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Self::Value, E> {
        if number.fract() == 0.0 && (0.0..=MAX_EXACT).contains(&number) {
            return self.visit_u64(number as u64);
        }
        Err(E::invalid_value(Unexpected::Float(number), &self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_have_a_point() {
        let read = |text: &str| serde_json::from_str::<Whole<u32>>(text).map(|Whole(number)| number);
        for (text, number) in
            [("4", 4), ("4.0", 4), ("4e0", 4), ("0.0", 0), ("-0.0", 0), ("4294967295.0", u32::MAX)]
        {
            assert_eq!(read(text).unwrap(), number, "{text}");
        }
        for text in
            ["-1", "-1.0", "4.5", "1e300", "4294967296", "4294967296.0", "\"4\"", "null", "true", "[4]"]
        {
            assert!(read(text).is_err(), "{text}");
        }
        assert_eq!(serde_json::from_str::<Whole<u64>>("9007199254740992.0").unwrap().0, 1 << 53);
        assert!(serde_json::from_str::<Whole<u64>>("9007199254740994.0").is_err());
        let said = read("-1").err().unwrap().to_string();
        assert!(said.starts_with("invalid value: integer `-1`, expected a whole number from 0"), "{said}");
    }
}
