//! Counts the work of a query.

/// The work of the last query.
///
/// ```
/// use bvh_query::{Pose, Querier};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let mut querier = Querier::new()?;
/// let far = Pose::new(*Pose::IDENTITY.rotation(), [100.0, 0.0, 0.0])?;
/// assert!(!querier.collide(&block, &block, &far)?);
/// assert_eq!(querier.stats().exact_tests, 0); // filters were enough
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
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
