//! Planes: where three of them meet, and the shortest way beyond some of them.

use crate::narrow::{Point, cross, dot};

/// The points at a height along a unit normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) normal: Point,
    pub(super) height: f64,
}

/// Returns the volume that the normals of three planes span, and the point in which they meet: not finite if that volume is 0.
pub(super) fn meeting([p, q, r]: [&Plane; 3]) -> (f64, Point) {
    let (qr, rp, pq) = (cross(q.normal, r.normal), cross(r.normal, p.normal), cross(p.normal, q.normal));
    let spanned = dot(p.normal, qr);
    let scale = 1.0 / spanned;
    (spanned, [0, 1, 2].map(|k| (p.height * qr[k] + q.height * rp[k] + r.height * pq[k]) * scale))
}

/// By how much of the length of a point it may fall short of a plane.
const SHORTFALL: f64 = 1e-9;

/// Returns the shortest vector that is beyond all of some planes, to within roundings; none if there is no such vector. It is
/// the nearest point of the planes, lines or points in which up to three of them meet. Cost: some nanoseconds for each three.
pub(super) fn shortest_beyond(planes: &[Plane]) -> Option<Point> {
    let mut best: Option<Point> = None;
    let mut offer = |point: Point| {
        let length = dot(point, point).sqrt();
        let is_beyond = |plane: &Plane| dot(plane.normal, point) >= plane.height - SHORTFALL * length;
        if length.is_finite()
            && best.is_none_or(|best| dot(best, best).sqrt() > length)
            && planes.iter().all(is_beyond)
        {
            best = Some(point);
        }
    };
    for (i, p) in planes.iter().enumerate() {
        offer(p.normal.map(|x| p.height * x));
        for (j, q) in planes[..i].iter().enumerate() {
            // With c the cosine between both normals, the nearest point of the line is their combination.
            let c = dot(p.normal, q.normal);
            let scale = 1.0 / (1.0 - c * c);
            let (of_p, of_q) = ((p.height - c * q.height) * scale, (q.height - c * p.height) * scale);
            offer([0, 1, 2].map(|k| of_p * p.normal[k] + of_q * q.normal[k]));
            for r in &planes[..j] {
                offer(meeting([p, q, r]).1);
            }
        }
    }
    best
}
