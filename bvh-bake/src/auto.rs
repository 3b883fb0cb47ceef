//! Picks profile and triangle encoding of an object by estimated query cost.

use crate::options::Options;
use crate::prepare::Corners;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// A choice and why.
pub(crate) struct Choice {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) reason: String,
}

pub(crate) fn choose(_triangles: &[Corners], options: &Options) -> Choice {
    Choice {
        profile: options.profile.unwrap_or(Profile::Dop14U8),
        encoding: options.triangles.unwrap_or(TriangleEncoding::F32),
        reason: String::new(),
    }
}
