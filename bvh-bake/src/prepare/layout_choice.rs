//! Chooses the profile and the triangle encoding of an object, where the options leave them open: the encoding by the size of
//! the object, and the profile by what the caller said about the encoding.
//!
//! `bvh-query/lab/notebook/bytes.md` has the measurements. They agree on meshes of all kinds, so that no mesh has to be tried.

use crate::options::Options;
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;

/// A layout, and the reason for choosing it.
pub(crate) struct Choice {
    pub(crate) profile: Profile,
    pub(crate) encoding: TriangleEncoding,
    pub(crate) reason: String,
}

/// The bytes of nodes and plain triangles beyond which reading the file costs more than unpacking it. With warm caches,
/// packed triangles take up to 1.21 times as long as plain ones. This also holds where the caches are too small for
/// them, because the vertices of a packed packet take as many lines as a plain packet.
const MAX_PLAIN_BYTES: u64 = 256 << 20;
/// Bytes of nodes and plain lanes per triangle.
const PLAIN_BYTES_PER_TRIANGLE: u64 = 52;

/// Chooses what the options leave open for an object of `count` triangles.
pub(crate) fn choose(count: u64, is_cloud: bool, options: &Options) -> Choice {
    if is_cloud {
        return of_cloud(options);
    }
    let mut reasons = Vec::new();
    let encoding = options.triangles.unwrap_or_else(|| {
        let bytes = count * PLAIN_BYTES_PER_TRIANGLE;
        if bytes <= MAX_PLAIN_BYTES {
            reasons.push("plain triangles are the fastest".to_owned());
            return TriangleEncoding::F32;
        }
        let (size, limit) = (bytes >> 20, MAX_PLAIN_BYTES >> 20);
        reasons.push(format!(
            "packed triangles, because nodes and plain triangles take about {size} MiB without ids \
             ({PLAIN_BYTES_PER_TRIANGLE} bytes per triangle), more than the limit of {limit} MiB"
        ));
        TriangleEncoding::Packed
    });
    let profile = options.profile.unwrap_or_else(|| {
        // A caller who asks for packed triangles wants a small file, and one who asks for quantised triangles wants the
        // smallest.
        let (profile, reason) = match options.triangles {
            None | Some(TriangleEncoding::F32) => (Profile::Dop26U8Wide, "is the fastest"),
            Some(TriangleEncoding::Packed) => (Profile::Dop26U4, "is the fastest with small treelets"),
            Some(TriangleEncoding::Quantized) => (Profile::Dop14U8, "is small and still fast"),
        };
        reasons.push(format!("{} {reason}", profile.name()));
        profile
    });
    Choice { profile, encoding, reason: reasons.join("; ") }
}

/// Chooses what the options leave open for a cloud of points.
fn of_cloud(options: &Options) -> Choice {
    let encoding = options.triangles.unwrap_or(TriangleEncoding::Packed);
    let profile = options.profile.unwrap_or(Profile::Dop14U8);
    let reason = format!("{} and {} for a cloud of points", profile.name(), encoding.name());
    Choice { profile, encoding, reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_and_size_decide() {
        let most_plain = MAX_PLAIN_BYTES / PLAIN_BYTES_PER_TRIANGLE;
        let (plain, packed, quantized) =
            (TriangleEncoding::F32, TriangleEncoding::Packed, TriangleEncoding::Quantized);
        for (asked, count, is_cloud, profile, encoding) in [
            (None, 1, false, Profile::Dop26U8Wide, plain),
            (None, most_plain, false, Profile::Dop26U8Wide, plain),
            (None, most_plain + 1, false, Profile::Dop26U8Wide, packed),
            (Some(plain), most_plain + 1, false, Profile::Dop26U8Wide, plain),
            (Some(packed), 1, false, Profile::Dop26U4, packed),
            (Some(quantized), 1, false, Profile::Dop14U8, quantized),
            (None, 1, true, Profile::Dop14U8, packed),
            (Some(plain), 1, true, Profile::Dop14U8, plain),
        ] {
            let options = Options::default().triangles(asked);
            let choice = choose(count, is_cloud, &options);
            assert_eq!((choice.profile, choice.encoding), (profile, encoding), "{asked:?}, {count}");
            assert!(choice.reason.contains(profile.name()), "{}", choice.reason);
            for asked in Profile::ALL {
                let choice = choose(count, is_cloud, &options.clone().profile(asked));
                assert_eq!((choice.profile, choice.encoding), (asked, encoding));
            }
        }
        let both = Options::default().profile(Profile::Dop6U8).triangles(packed);
        assert_eq!(choose(1, false, &both).reason, "");
    }
}
