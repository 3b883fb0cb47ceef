//! The profiles of treelets. A profile sets the directions, the encoding of residuals, the most children, and the size.

use crate::kdop::DirectionSet;

/// How the slab ends of a child are stored. Like [`Profile`], the list is complete and not marked as non-exhaustive.
///
/// [`Profile`] has an example.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Encoding {
    /// A residual of 4 bits, in units of 1/15 of the parent's slab.
    U4,
    /// A residual of 8 bits, in units of 1/255 of the parent's slab.
    U8,
    /// A floating-point residual of 16 bits, in units of the object's power of two.
    F16,
    /// The slab ends themselves in 32 bits: the uncompressed baseline.
    F32,
}

/// The layout of treelets.
///
/// The list is part of the major version of the format. It is not marked as non-exhaustive: a decoder that has code for
/// each profile does not compile until it has code for a new one.
///
/// ```
/// use bvh_format::kdop::DirectionSet;
/// use bvh_format::profile::{Encoding, Profile};
///
/// let profile = Profile::from_name("dop14-u8").expect("a name of the command line");
/// assert_eq!(profile, Profile::Dop14U8);
/// assert_eq!((profile.directions(), profile.encoding()), (DirectionSet::Dop14, Encoding::U8));
/// assert_eq!((profile.width(), profile.treelet_bytes()), (4, 64));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Profile {
    /// 14-DOP, 8-bit residuals, 4 children, 64 bytes.
    Dop14U8 = 0,
    /// 6-DOP, 8-bit residuals, 8 children, 64 bytes.
    Dop6U8 = 1,
    /// 6-DOP, f16 residuals, 4 children, 64 bytes.
    Dop6F16 = 2,
    /// 14-DOP, f32 slabs, 4 children, 256 bytes: the baseline that others are compared with.
    Dop14F32 = 3,
    /// 26-DOP, 4-bit residuals, 4 children, 64 bytes.
    Dop26U4 = 4,
    /// 26-DOP, 8-bit residuals, turning slabs, 4 children, 128 bytes.
    Dop26U8Wide = 5,
}

impl Profile {
    /// All profiles in the order of their numbers on disk.
    pub const ALL: [Profile; 6] =
        [Self::Dop14U8, Self::Dop6U8, Self::Dop6F16, Self::Dop14F32, Self::Dop26U4, Self::Dop26U8Wide];

    /// Returns the profile of a number on disk.
    pub(crate) fn from_number(number: u8) -> Option<Self> {
        Self::ALL.get(usize::from(number)).copied()
    }

    /// The number on disk.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dop14U8 => "dop14-u8",
            Self::Dop6U8 => "dop6-u8",
            Self::Dop6F16 => "dop6-f16",
            Self::Dop14F32 => "dop14-f32",
            Self::Dop26U4 => "dop26-u4",
            Self::Dop26U8Wide => "dop26-u8-wide",
        }
    }

    /// Returns the profile of a name on the command line.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| profile.name() == name)
    }

    /// The directions of its k-DOPs.
    #[inline]
    pub const fn directions(self) -> DirectionSet {
        match self {
            Self::Dop6U8 | Self::Dop6F16 => DirectionSet::Dop6,
            Self::Dop14U8 | Self::Dop14F32 => DirectionSet::Dop14,
            Self::Dop26U4 | Self::Dop26U8Wide => DirectionSet::Dop26,
        }
    }

    /// How slab ends are stored.
    pub const fn encoding(self) -> Encoding {
        match self {
            Self::Dop26U4 => Encoding::U4,
            Self::Dop14U8 | Self::Dop6U8 | Self::Dop26U8Wide => Encoding::U8,
            Self::Dop6F16 => Encoding::F16,
            Self::Dop14F32 => Encoding::F32,
        }
    }

    /// Whether children have turning slabs, in rows that fixed slabs leave empty.
    #[inline]
    pub const fn has_turning_slabs(self) -> bool {
        matches!(self, Self::Dop26U8Wide)
    }

    /// The most children that a treelet can have: 4 or 8.
    #[inline]
    pub const fn width(self) -> usize {
        const WIDTHS: [u8; 6] = [4, 8, 4, 4, 4, 4];
        WIDTHS[self as usize] as usize
    }

    /// Whether treelets whose children are all leaf packets may be short: see [`treelet`](crate::treelet).
    #[inline]
    pub const fn has_short_treelets(self) -> bool {
        matches!(self, Self::Dop14U8 | Self::Dop6U8)
    }

    /// Bytes of a treelet that is not short: 64, 128 or 256.
    #[inline]
    pub const fn treelet_bytes(self) -> usize {
        // A table is faster than a match, and each node of a traversal asks.
        const BYTES: [u16; 6] = [64, 64, 64, 256, 64, 128];
        BYTES[self as usize] as usize
    }

    /// Bytes of the anchor of a subtree root.
    pub const fn anchor_bytes(self) -> usize {
        match self.directions() {
            DirectionSet::Dop6 => 32,
            DirectionSet::Dop14 => 64,
            DirectionSet::Dop26 => 128,
        }
    }

    /// The number of groups of four children to which a treelet decodes: 2 at width 8, else 1.
    #[inline]
    pub const fn groups(self) -> usize {
        if self.width() == 8 { 2 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_round_trip() {
        for (number, profile) in Profile::ALL.into_iter().enumerate() {
            assert_eq!(Profile::from_number(number as u8), Some(profile));
            assert_eq!(usize::from(profile.number()), number);
            assert_eq!(Profile::from_name(profile.name()), Some(profile));
        }
        assert_eq!(Profile::from_number(6), None);
        assert_eq!(Profile::from_name("dop14-f16"), None);
    }
}
