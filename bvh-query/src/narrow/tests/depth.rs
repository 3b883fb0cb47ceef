//! Sets how many rounds a random search runs, like `depth` of cbvh-testkit, which is missing in a packaged crate.

/// Returns the number of rounds to run: `everyday` times the environment variable `CBVH_TEST_DEPTH`, at least one.
pub(super) fn rounds(everyday: u64) -> u64 {
    let factor = std::env::var("CBVH_TEST_DEPTH")
        .map_or(1.0, |text| text.parse::<f64>().expect("CBVH_TEST_DEPTH is a positive number"));
    (everyday as f64 * factor).ceil().max(1.0) as u64
}
