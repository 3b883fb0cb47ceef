//! Counts the work of a query.

/// The work of the last query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct QueryStats {
    /// Tests of up to 16 pairs of nodes each.
    pub node_tests: u64,
    /// Pairs of leaf packets tested, with up to 16 pairs of triangles each.
    pub packet_tests: u64,
    /// Pairs of triangles that went to exact arithmetic.
    pub exact_tests: u64,
}

impl QueryStats {
    /// Adds what a traversal did.
    pub(crate) fn add(&mut self, node_tests: u64, other: Self) {
        self.node_tests += node_tests;
        self.packet_tests += other.packet_tests;
        self.exact_tests += other.exact_tests;
    }
}
