//! Groups: which instances are asked about with which.

/// Which groups an instance is in, and which groups it is asked about with, one bit per group. Two instances are asked
/// about if each is in a group that the other meets. By default an instance is in all groups and meets all.
///
/// ```
/// use bvh_query::Groups;
///
/// // What stands still is asked about with what moves, and not with what stands still.
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
    /// In all groups, meets all.
    pub const ALL: Self = Self { member: u32::MAX, meets: u32::MAX };
    /// In no group.
    pub(super) const NONE: Self = Self { member: 0, meets: 0 };

    /// Returns whether instances of these groups are asked about.
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
