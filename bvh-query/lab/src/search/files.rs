//! Bakes triangles, and reads the triangles of a file by the reference decoder.

use crate::Failure;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Effort, Options, to_bytes};
use bvh_format::ids::decode_id;
use bvh_format::leaf::{TriangleEncoding, decode_packet};
use bvh_format::page::Page;
use bvh_format::profile::Profile;
use bvh_format::validate::packets;
use bvh_query::Bvh;
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
    let numbers = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh::from_triangles(triangles.iter().flatten().copied().collect(), numbers);
    Ok(to_bytes(&mesh, options)?.0)
}

/// Returns the triangles of a file with their objects and ids: the number or, without ids, the place in the order of the
/// leaves. Duplicates that were left out are among them, unless their list is damaged.
pub(super) fn stored(bvh: &Bvh) -> Vec<(u32, u32, Triangle)> {
    let (layout, bytes) = (bvh.layout(), bvh.bytes());
    let mut triangles = Vec::new();
    for (number, object) in (0..).zip(bvh.objects()) {
        let (origin, first) = (object.origin(), object.record().first_page.get());
        for page in first..first + object.record().pages.get() {
            let Some(page) = layout.page_bytes(bytes, page) else { continue };
            let page = Page::new(page, object.profile());
            let (block, ids) =
                (layout.leaf_block(bytes, page.header()), layout.id_block(bytes, page.header()));
            for (packet, count) in packets(&page) {
                let values = decode_packet(object.triangle_encoding(), block, usize::from(packet));
                for lane in 0..count {
                    let corners =
                        values.triangle(lane).map(|v| [0, 1, 2].map(|k| origin[k] + f64::from(v[k])));
                    let place = 4 * (page.header().first_packet.get() + u32::from(packet)) + lane as u32;
                    let id = if layout.has_ids() { decode_id(ids, usize::from(packet), lane) } else { place };
                    triangles.push((number, id, corners));
                    let copies = bvh.duplicates_of(id).into_iter().flatten();
                    triangles.extend(copies.map(|copy| (number, copy, corners)));
                }
            }
        }
    }
    triangles.sort_unstable_by_key(|&(object, id, _)| (object, id));
    triangles
}
