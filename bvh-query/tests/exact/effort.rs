//! How much to search: `CBVH_TEST_PAIRS` times the usual amount.

/// `usual` times the effort, at least one.
pub(crate) fn rounds(usual: u64) -> u64 {
    let named = std::env::var("CBVH_TEST_PAIRS").ok();
    let effort = named.map_or(1.0, |number| number.parse::<f64>().expect("CBVH_TEST_PAIRS is a number"));
    (usual as f64 * effort).ceil().max(1.0) as u64
}
