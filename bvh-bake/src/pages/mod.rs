//! Turns a tree of treelets into the pages of a file.

pub(crate) mod assemble;
pub(crate) mod brick;
mod encode;
mod plan;
pub(crate) mod unnumbered;

use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_format::vertex::Vertices;

/// How the pages of an object are written.
#[derive(Clone, Copy)]
pub(crate) struct Style {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) f16_scale: f32,
    pub(crate) ids: bool,
    /// Whether all triangles are points.
    pub(crate) is_cloud: bool,
    /// Whether little time is spent on what makes queries faster.
    pub(crate) is_quick: bool,
    /// How vertices follow from offsets.
    pub(crate) behind: Vertices,
}

impl Style {
    /// Whether triangles of packets are put in the order in which they take the fewest bytes. Plain ones take the same in any order.
    pub(crate) fn orders_lanes(&self) -> bool {
        !(self.is_cloud || self.is_quick && self.encoding == TriangleEncoding::F32)
    }

    /// Whether treelets of nothing but packets are short: where the size of triangles counts more than time, that of
    /// treelets does as well.
    pub(crate) fn has_short_treelets(&self) -> bool {
        self.profile.has_short_treelets() && self.encoding != TriangleEncoding::F32
    }
}
