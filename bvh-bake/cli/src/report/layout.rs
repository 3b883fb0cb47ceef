//! The layouts that are compared: each profile with each encoding of triangles.

use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// How a file is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layout {
    pub(super) profile: Profile,
    pub(super) triangles: TriangleEncoding,
}

impl Layout {
    /// Returns all layouts.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let encodings = |profile| TriangleEncoding::ALL.map(|triangles| Self { profile, triangles });
        Profile::ALL.into_iter().flat_map(encodings)
    }

    /// The name in tables.
    pub(super) fn name(self) -> String {
        format!("{} {}", self.profile.name(), self.triangles.name())
    }

    /// Returns the options that bake it.
    pub(super) fn options(self) -> Options {
        Options::default().profile(self.profile).triangles(self.triangles)
    }

    /// True for the layout whose answers all layouts with these triangles must give: bounds in plain floats.
    pub(super) fn is_reference(self, triangles: TriangleEncoding) -> bool {
        self.profile == Profile::Dop14F32 && self.triangles == triangles
    }

    /// True if vertices may have moved more than rounding to `f32` moves them.
    pub(super) fn is_lossy(self) -> bool {
        self.triangles == TriangleEncoding::Quantized
    }
}
