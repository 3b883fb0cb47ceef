//! Bakes triangles in any layout.

use crate::Failure;
use crate::common::mesh;
use bvh_bake::{Effort, Options, to_bytes};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use cbvh_testkit::{Random, Triangle};
use serde::{Deserialize, Serialize};

/// How a file is baked, by names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Layout {
    pub(super) profile: String,
    pub(super) triangles: String,
    pub(super) turning_slabs: bool,
}

impl Layout {
    /// Returns any layout of the first `encodings` triangle encodings.
    pub(super) fn random(random: &mut Random, encodings: usize) -> Self {
        let encodings =
            &[TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized][..encodings];
        Self {
            profile: Profile::ALL[random.below(Profile::ALL.len())].name().into(),
            triangles: encodings[random.below(encodings.len())].name().into(),
            turning_slabs: random.below(4) != 0,
        }
    }

    pub(super) fn options(&self) -> Options {
        Options::default()
            .profile(Profile::from_name(&self.profile))
            .triangles(TriangleEncoding::ALL.into_iter().find(|encoding| encoding.name() == self.triangles))
            .turning_slabs(self.turning_slabs)
            .effort(Effort::Fast)
            .topology(false)
    }
}

/// Bakes triangles of one object, with their numbers as ids.
pub(super) fn bake(triangles: &[Triangle], options: &Options) -> Result<Vec<u8>, Failure> {
    Ok(to_bytes(&mesh(triangles), options)?.0)
}
