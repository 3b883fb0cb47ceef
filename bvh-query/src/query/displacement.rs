//! Bounds how far the vertices of an object move from one pose to another.

use crate::file::shape::Shape;
use crate::numerics::POSE_ERROR;
use crate::pose::Pose;
use bvh_format::object::Object;

/// Returns the largest side of the boxes of objects, in mesh units.
pub(crate) fn size(objects: &[Object]) -> f64 {
    let of = |object: &Object| half_sides(object).into_iter().fold(0.0, f64::max);
    2.0 * objects.iter().map(of).fold(0.0, f64::max)
}

/// Returns half of each side of an object's box, in mesh units.
fn half_sides(object: &Object) -> [f64; 3] {
    let (lo, hi) = (&object.record().box_lo, &object.record().box_hi);
    [0, 1, 2].map(|axis| (f64::from(hi[axis].get()) - f64::from(lo[axis].get())) / 2.0)
}

/// Returns an upper bound of how far any vertex of B moves from one pose to another, in mesh units. As long as it is
/// below [`Distance::lower`](crate::Distance::lower) of the first pose, the meshes do not touch in the second. One
/// answer about a distance therefore shows how far B may move or turn. The bound is about the two poses and not about
/// the path between them: see [`path_reach`](crate::path_reach).
///
/// ```
/// use bvh_query::{Pose, Querier, displacement};
///
/// # let block = bvh_query::Bvh::from_bytes(bvh_bake::to_bytes(&bvh_bake::shapes::block([2.0; 3])?, &Default::default())?.0)?;
/// let at = |x| Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]);
/// let (from, to) = (at(3.0)?, at(2.5)?);
/// let gap = Querier::new()?.distance(&block, &block, &from)?.lower;
/// assert!(displacement(&block, &from, &to) < gap); // so they do not touch there either
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn displacement<'a>(b: impl Into<Shape<'a>>, from: &Pose, to: &Pose) -> f64 {
    // A vertex is at most the half sides h of its object's box away from the centre c of it, so that along axis i it
    // moves by at most |dR_i c + dt_i| + |dR_i| h, where dR and dt are the changes of rotation and translation.
    //
    // Rounding: let m be the sum, over the axes, of the magnitudes of the origin, of both ends of the box and of both
    // translations; rows of rotations have entries of at most 1 + 2^-20. Each placed vertex is off by at most 8u m along an
    // axis, twice; centre, half sides and the changes by 8u m, the products and sums above by 16u m; u = 2^-53. That is
    // below 2^-47 m, and over the three axes below 2^-46 m, which is charged. Squares underflow below 2^-511, which is
    // charged too.
    let b = b.into();
    let mut change = [[0.0; 3]; 3];
    let mut shift = [0.0; 3];
    let mut translations = 0.0;
    for i in 0..3 {
        let (t_from, t_to) = (from.translation()[i], to.translation()[i]);
        shift[i] = t_to - t_from;
        translations += t_from.abs() + t_to.abs();
        for j in 0..3 {
            change[i][j] = to.rotation()[i][j] - from.rotation()[i][j];
        }
    }
    let of = |object: &Object| {
        let record = object.record();
        let h = half_sides(object);
        let (mut c, mut m) = ([0.0; 3], translations);
        for axis in 0..3 {
            let (lo, hi) = (f64::from(record.box_lo[axis].get()), f64::from(record.box_hi[axis].get()));
            let origin = record.origin[axis].get();
            c[axis] = origin + (lo + hi) / 2.0;
            m += origin.abs() + lo.abs() + hi.abs();
        }
        let mut squared = 0.0;
        for i in 0..3 {
            let d = change[i];
            let centre = d[0] * c[0] + d[1] * c[1] + d[2] * c[2] + shift[i];
            let turn = d[0].abs() * h[0] + d[1].abs() * h[1] + d[2].abs() * h[2];
            squared += (centre.abs() + turn).powi(2);
        }
        let root = f64::sqrt(squared) * (1.0 + 2f64.powi(-50));
        root + 4.0 * POSE_ERROR * m + 2f64.powi(-511)
    };
    b.objects().iter().map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::bvh::Bvh;
    use crate::file::place::LeafPacket;
    use cbvh_testkit::Random;

    /// Of the golden file's vertices, none goes farther than the bound; and the bound is not much farther than the
    /// farthest goes, and what is charged for rounding, of an origin at 2^22.
    #[test]
    fn no_vertex_moves_farther_than_the_bound() {
        let bvh = Bvh::from_static(include_bytes!("../../../testdata/ok-everything.cbvh")).unwrap();
        let mut random = Random::new(7);
        let mut signed = || random.signed();
        for round in 0..200 {
            let scale = 10f64.powi(-(round % 16));
            let angles = [signed() * 3.0, 0.0].map(|angle| angle + scale * signed());
            let translation = [signed(), signed(), signed()].map(|x| 1e3 * x);
            let poses = angles.map(|angle| {
                let (sin, cos) = angle.sin_cos();
                let moved = translation.map(|x| x + scale * signed());
                Pose::new([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], moved).unwrap()
            });
            let [from, to] = if round % 5 == 0 { [poses[0]; 2] } else { poses };
            let bound = displacement(bvh.all(), &from, &to);
            let mut farthest = 0.0f64;
            for object in bvh.objects() {
                let h = half_sides(object);
                for number in object.pages() {
                    let page = bvh.page(object, number).unwrap();
                    for packet in 0..page.header().packets.get() {
                        let origin = object.origin();
                        let leaf = LeafPacket { page: number, packet, triangles: 4 };
                        for v in (0..4).flat_map(|lane| bvh.triangle(object, leaf, lane).unwrap()) {
                            let point = [0, 1, 2].map(|axis| origin[axis] + f64::from(v[axis]));
                            let (p, q) = (from.place(point), to.place(point));
                            let squared: f64 = (0..3).map(|axis| (p[axis] - q[axis]).powi(2)).sum();
                            farthest = farthest.max(squared.sqrt());
                        }
                    }
                }
                assert!(farthest <= bound, "{farthest} beyond {bound}");
                assert!(h.iter().all(|h| *h >= 0.0));
            }
            assert!(round % 5 != 0 || bound < 1e-6, "{bound} on the spot");
            assert!(bound <= 1e-6 + 100.0 * (farthest + scale), "{bound} for {farthest}");
        }
    }
}
