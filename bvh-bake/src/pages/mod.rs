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
    /// How vertices follow from offsets.
    pub(crate) behind: Vertices,
}

impl Style {
    /// Whether treelets of nothing but packets are short: where the size of triangles counts more than time, that of
    /// treelets does as well.
    pub(crate) fn has_short_treelets(&self) -> bool {
        self.profile.has_short_treelets() && self.encoding != TriangleEncoding::F32
    }
}
