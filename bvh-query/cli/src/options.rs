//! Options of several commands: the layout of nodes and triangles (`--profile` and `--triangles`), rounding, numbers, and shards.

use bvh_bake::{Options, Rounding};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use clap::Args;
use std::fmt;

/// How coordinates are rounded, and how nodes and triangles are stored.
#[derive(Debug, Args)]
pub(crate) struct LayoutArguments {
    /// Bounding volumes: auto, dop14-u8, dop6-u8, dop6-f16, dop14-f32, dop26-u4 or dop26-u8-wide
    #[arg(long, value_name = "P", default_value = "auto", value_parser = profile)]
    pub(crate) profile: Choice<Profile>,
    /// Triangles: auto, f32 (the fastest), packed (the same values in fewer bytes) or quantized (vertices move a little)
    #[arg(long, value_name = "T", default_value = "auto", value_parser = triangles)]
    pub(crate) triangles: Choice<TriangleEncoding>,
    /// Coordinates: none, or f32, which rounds each to the nearest f32 number on purpose, so that equal ones stay equal
    #[arg(long, value_name = "R", default_value = "none", value_parser = rounding)]
    pub(crate) round: Rounding,
}

impl LayoutArguments {
    /// Returns the default options with this rounding and this layout.
    pub(crate) fn to_options(&self) -> Options {
        Options::default().profile(self.profile).triangles(self.triangles).round(self.round)
    }

    /// Returns whether vertices may move, so that `--max-error` has a meaning.
    pub(crate) fn is_quantized(&self) -> bool {
        self.triangles == Some(TriangleEncoding::Quantized)
    }
}

/// A choice by name; `None` leaves it to the baker. Under the name `Option`, clap would take it for an argument that may be
/// missing.
type Choice<T> = Option<T>;

/// Parses the name of a profile.
pub(crate) fn profile(name: &str) -> Result<Choice<Profile>, String> {
    choice(name, &Profile::ALL, Profile::name)
}

/// Parses the name of a triangle encoding.
pub(crate) fn triangles(name: &str) -> Result<Choice<TriangleEncoding>, String> {
    choice(name, &TriangleEncoding::ALL, TriangleEncoding::name)
}

/// Parses the name of a way to round.
pub(crate) fn rounding(name: &str) -> Result<Rounding, String> {
    Rounding::from_name(name).ok_or_else(|| "expected none or f32".to_owned())
}

/// Finds the choice of this name.
fn choice<T: Copy>(name: &str, all: &[T], name_of: fn(T) -> &'static str) -> Result<Choice<T>, String> {
    if name == "auto" {
        return Ok(None);
    }
    let names = || all.iter().map(|&one| name_of(one)).collect::<Vec<_>>().join(", ");
    let found = all.iter().find(|&&one| name_of(one) == name);
    found.map(|&one| Some(one)).ok_or_else(|| format!("expected auto, {}", names()))
}

/// The most threads that `--jobs` may ask for.
const MAX_THREADS: u16 = 1024;

/// Parses a finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "expected a finite number above 0".to_owned())
}

/// Parses a finite number of at least 0.
pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite() && *value >= 0.0);
    value.ok_or_else(|| "expected a finite number of at least 0".to_owned())
}

/// Parses a whole number of at least 0.
pub(crate) fn whole<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    let bits = 8 * size_of::<T>();
    text.parse().map_err(|_| format!("expected a whole number from 0 to 2^{bits} - 1"))
}

/// Parses a number of threads.
pub(crate) fn threads(text: &str) -> Result<u16, String> {
    let value = text.parse().ok().filter(|threads| (1..=MAX_THREADS).contains(threads));
    value.ok_or_else(|| format!("expected a number of threads from 1 to {MAX_THREADS}"))
}

/// Parses a number of bytes with an optional unit: powers of 1000 are `kB`, `MB`, `GB`, `TB`, and powers of 1024 are
/// `KiB`, `MiB`, `GiB`, `TiB`.
pub(crate) fn size(text: &str) -> Result<u64, String> {
    let expected = || "expected a size such as 512MiB, 2GB or 100000000".to_owned();
    let text = text.trim();
    let digits = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let factor = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "kb" => 1e3,
        "mb" => 1e6,
        "gb" => 1e9,
        "tb" => 1e12,
        "k" | "kib" => 1024.0,
        "m" | "mib" => 1048576.0,
        "g" | "gib" => 1073741824.0,
        "t" | "tib" => 1099511627776.0,
        _ => return Err(expected()),
    };
    let bytes = number.parse::<f64>().map_err(|_| expected())? * factor;
    // Above 2^53 not every number of bytes is an f64, and no machine has so much memory.
    if bytes < 9007199254740992.0 { Ok(bytes as u64) } else { Err(expected()) }
}

/// Every `count`-th of many things, starting with number `index`, which is from 1 to `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) index: u64,
    pub(crate) count: u64,
}

impl Shard {
    /// Returns whether the thing with this number, counted from 0, belongs to the shard.
    pub(crate) fn has(self, number: u64) -> bool {
        number % self.count == self.index - 1
    }

    /// Parses `I/N`.
    pub(crate) fn parse(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('/').and_then(|(index, count)| {
            let shard = Self { index: index.parse().ok()?, count: count.parse().ok()? };
            (1..=shard.count).contains(&shard.index).then_some(shard)
        });
        parsed.ok_or_else(|| "expected I/N with I from 1 to N, such as 1/4".to_owned())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        assert_eq!(size("512MiB"), Ok(512 << 20));
        assert_eq!(size("1.5 GiB"), Ok(3 << 29));
        assert_eq!(size("2GB"), Ok(2_000_000_000));
        assert_eq!(size("7"), Ok(7));
        for wrong in ["", "MiB", "-1", "1XB", "1e3", "1.2.3", "99999999999999999999"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        for wrong in ["nan", "inf", "-inf", "1e400", "-1", "", "one"] {
            assert!(positive(wrong).is_err() && not_negative(wrong).is_err(), "{wrong}");
            assert!(whole::<u32>(wrong).is_err() && threads(wrong).is_err(), "{wrong}");
        }
        assert!(positive("0").is_err() && threads("0").is_err() && threads("1025").is_err());
        assert_eq!(
            (not_negative("0"), whole("4294967295"), threads("1024")),
            (Ok(0.0), Ok(u32::MAX), Ok(1024))
        );
    }

    #[test]
    fn shards_are_numbered_from_one() {
        assert_eq!(Shard::parse("3/16"), Ok(Shard { index: 3, count: 16 }));
        for wrong in ["", "1", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", "1/99999999999999999999"] {
            assert!(Shard::parse(wrong).is_err(), "{wrong}");
        }
        let of = |index| (0..10).filter(move |&number| Shard { index, count: 3 }.has(number));
        assert_eq!(of(1).collect::<Vec<_>>(), [0, 3, 6, 9]);
        assert_eq!((1..=3).map(|index| of(index).count()).sum::<usize>(), 10);
    }
}
