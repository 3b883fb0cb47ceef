//! Groups, which select the pairs of instances that questions are about.

/// The groups that an instance is in, and the groups that it meets, one bit per group. Queries are about two
/// instances if each is in a group that the other meets. By default an instance is in all groups and meets all.
///
/// ```
/// use bvh_query::Groups;
///
/// // Bodies that stand still are tested against moving ones, and not against each other.
/// const STILL: u32 = 1;
/// const MOVING: u32 = 2;
/// let wall = Groups { member: STILL, meets: MOVING };
/// let robot = Groups { member: MOVING, meets: STILL | MOVING };
/// assert!(wall.meet(robot) && robot.meet(robot) && !wall.meet(wall));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Groups {
    /// The groups that the instance is in.
    pub member: u32,
    /// The groups that it meets.
    pub meets: u32,
}

impl Groups {
    /// An instance that is in all groups and meets all.
    pub const ALL: Self = Self { member: u32::MAX, meets: u32::MAX };
    /// In no group.
    pub(super) const NONE: Self = Self { member: 0, meets: 0 };

    /// Returns whether queries are about two instances of these groups.
    pub fn meet(self, other: Self) -> bool {
        self.member & other.meets != 0 && other.member & self.meets != 0
    }

    /// Returns groups that meet whatever one of both meets.
    pub(super) fn union(self, other: Self) -> Self {
        Self { member: self.member | other.member, meets: self.meets | other.meets }
    }
}

impl Default for Groups {
    fn default() -> Self {
        Self::ALL
    }
}
