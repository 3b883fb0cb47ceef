//! The layouts that are compared: each profile with each encoding of triangles and, where it has them, without turning
//! slabs.

use bvh_bake::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// How a file is laid out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Layout {
    pub(super) profile: Profile,
    pub(super) triangles: TriangleEncoding,
    /// Whether turning slabs are left out of a profile that has them.
    pub(super) without_turning_slabs: bool,
}

impl Layout {
    /// Returns all layouts.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        let encodings = |(profile, without_turning_slabs)| {
            TriangleEncoding::ALL.map(|triangles| Self { profile, triangles, without_turning_slabs })
        };
        let without = Profile::ALL.into_iter().filter(|profile| profile.has_turning_slabs());
        let with = Profile::ALL.map(|profile| (profile, false)).into_iter();
        with.chain(without.map(|profile| (profile, true))).flat_map(encodings)
    }

    /// The name in tables.
    pub(super) fn name(self) -> String {
        let without = if self.without_turning_slabs { " without turning slabs" } else { "" };
        format!("{} {}{without}", self.profile.name(), self.triangles.name())
    }

    /// Returns whether it has turning slabs; `None` if its profile has no room for any.
    pub(super) fn has_turning_slabs(self) -> Option<bool> {
        self.profile.has_turning_slabs().then_some(!self.without_turning_slabs)
    }

    /// Returns the options that bake it.
    pub(super) fn options(self) -> Options {
        let options = Options::default().profile(self.profile).triangles(self.triangles);
        options.turning_slabs(!self.without_turning_slabs)
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
