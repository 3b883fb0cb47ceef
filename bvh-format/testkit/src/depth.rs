//! Scales the searches of the tests: random searches, damaged files, long enumerations.
//!
//! Each search states the amount for everyday use. The environment variable `CBVH_TEST_DEPTH` multiplies all amounts:
//! `.ci/full` sets it to 4 for the searches, and a person who hunts for a rare error sets more.

/// Returns the number of rounds to run: `everyday` times `CBVH_TEST_DEPTH`, at least one.
///
/// # Panics
///
/// Panics if the variable is set and is not a positive number.
pub fn rounds(everyday: u64) -> u64 {
    scaled(everyday, factor())
}

/// Returns the step with which a search goes through a list, visiting one element per step: `everyday` divided by
/// `CBVH_TEST_DEPTH`, at least one. With a step of one, the search visits the whole list.
///
/// # Panics
///
/// Panics if the variable is set and is not a positive number.
pub fn step(everyday: u64) -> usize {
    scaled(everyday, 1.0 / factor()) as usize
}

fn factor() -> f64 {
    std::env::var("CBVH_TEST_DEPTH").map_or(1.0, |text| parse(&text))
}

fn parse(text: &str) -> f64 {
    let factor = text.parse().ok().filter(|&factor: &f64| factor > 0.0 && factor.is_finite());
    factor.unwrap_or_else(|| panic!("CBVH_TEST_DEPTH: expected a positive number, found '{text}'"))
}

fn scaled(everyday: u64, factor: f64) -> u64 {
    (everyday as f64 * factor).ceil().max(1.0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_has_at_least_one_round() {
        assert_eq!(scaled(0, 10.0), 1);
        assert_eq!(scaled(10, parse("0.001")), 1);
        assert_eq!(scaled(25, parse("10")), 250);
    }

    #[test]
    #[should_panic(expected = "expected a positive number, found '0'")]
    fn a_depth_of_zero_is_refused() {
        parse("0");
    }
}
