//! The convex hull of points, decided exactly.
//!
//! Quickhull (Barber, Dobkin and Huhdanpaa, *The Quickhull Algorithm for Convex Hulls*, 1996), without its tolerance: `robust`
//! decides exactly on which side of a face a point lies. A point replaces the faces that it lies strictly above by a cone over
//! their outline. These faces are connected, and their outline visits a corner once: they are also what one sees from a place
//! slightly nearer to the middle, which is in no face's plane. So cones never have a triangle without area, and a point that
//! is above no face is inside or on the hull. Roundings only affect which point comes next.
//!
//! Refused: `chull`, which has a tolerance or computes with fractions and is not maintained, and `parry3d`, whose hull leaves
//! out points by a tolerance.

use crate::error::ShapeError;
use crate::input::mesh::Mesh;
use crate::triangles::placement::on_unit;
use bvh_format::object::MAX_COORDINATE;
use robust::{Coord, Coord3D};

/// A triangle of the hull.
struct Face {
    /// Numbers of points, counter-clockwise as seen from outside.
    corners: [u32; 3],
    /// For each corner, the face on the other side of the edge from it to the next one.
    beside: [u32; 3],
    /// Points above this face that the hull does not contain yet. The last one is the farthest.
    above: Vec<u32>,
    /// How far that one is, times twice the area of the face.
    farthest: f64,
    /// Whether the hull has grown beyond the face.
    is_gone: bool,
}

impl Face {
    fn new(corners: [u32; 3], beside: [u32; 3]) -> Self {
        Self { corners, beside, above: Vec::new(), farthest: 0.0, is_gone: false }
    }

    /// Returns a number with the exact sign of the height of a point above the plane of the face.
    fn height(&self, points: &[[f64; 3]], point: u32) -> f64 {
        let [a, b, c] = self.corners;
        volume(points, [a, b, c, point])
    }

    /// Keeps a point for later if it is strictly above.
    fn takes(&mut self, points: &[[f64; 3]], point: u32) -> bool {
        let height = self.height(points, point);
        if height <= 0.0 {
            return false;
        }
        self.above.push(point);
        if height > self.farthest {
            self.farthest = height;
        } else {
            let last = self.above.len() - 1;
            self.above.swap(last - 1, last);
        }
        true
    }
}

/// Makes the convex hull of points: closed, looking outwards, and solid with `bvh_query::Shape::solid`. Its vertices are some
/// of the points, of which those in a face may be some, too. Each point is inside the hull or on it, exactly, once its coordinates
/// are multiples of 2^-180, as those of files are.
///
/// A million points take a third of a second, or five seconds if all of them are vertices (AMD EPYC, Zen 5 class, 2026-11-25).
/// At worst the time grows with the square of their number.
///
/// # Errors
/// [`ShapeError::Point`] if a coordinate is not finite or beyond 2^120, and [`ShapeError::Flat`] if all points are in one plane,
/// as fewer than four always are.
pub fn convex_hull(points: &[[f64; 3]]) -> Result<Mesh, ShapeError> {
    if let Some(number) = points.iter().position(|p| p.iter().any(|x| x.is_nan() || x.abs() > MAX_COORDINATE))
    {
        return Err(ShapeError::Point { number, found: points[number] });
    }
    // Products of three differences of these do not underflow.
    let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(on_unit)).collect();
    let [a, b, c, d] = simplex(&points)?;
    // Both sides of a triangle, and then what the fourth point makes of it.
    let mut faces = vec![Face::new([a, b, c], [1; 3]), Face::new([a, c, b], [0; 3])];
    // For each corner of an outline, the new face over the edge that starts there; then the numbers of vertices.
    let mut scratch = vec![u32::MAX; points.len()];
    grow(&points, &mut faces, 1, d, &mut scratch);
    for point in 0..points.len() as u32 {
        faces.iter_mut().any(|face| !face.is_gone && face.takes(&points, point));
    }
    let mut face = 0;
    while face < faces.len() {
        if let (false, Some(&apex)) = (faces[face].is_gone, faces[face].above.last()) {
            grow(&points, &mut faces, face as u32, apex, &mut scratch);
        }
        face += 1;
    }
    scratch.fill(u32::MAX);
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for face in faces.iter().filter(|face| !face.is_gone) {
        triangles.push(face.corners.map(|point| {
            let number = &mut scratch[point as usize];
            if *number == u32::MAX {
                *number = positions.len() as u32;
                positions.push(points[point as usize]);
            }
            *number
        }));
    }
    Ok(Mesh::from_triangles(positions, triangles))
}

/// Replaces the faces that a point is strictly above, of which one is known, by a cone from their outline to the point.
fn grow(points: &[[f64; 3]], faces: &mut Vec<Face>, known: u32, apex: u32, starting: &mut [u32]) {
    let first = faces.len();
    let mut gone = vec![known];
    faces[known as usize].is_gone = true;
    let mut next = 0;
    while let Some(&face) = gone.get(next) {
        next += 1;
        for edge in 0..3 {
            let Face { corners, beside, .. } = faces[face as usize];
            let (from, to, other) = (corners[edge], corners[(edge + 1) % 3], beside[edge]);
            if faces[other as usize].is_gone {
                continue;
            }
            if faces[other as usize].height(points, apex) > 0.0 {
                faces[other as usize].is_gone = true;
                gone.push(other);
            } else {
                let new = faces.len() as u32;
                faces.push(Face::new([from, to, apex], [other, u32::MAX, u32::MAX]));
                starting[from as usize] = new;
            }
        }
    }
    for new in first..faces.len() {
        let Face { corners: [_, to, _], beside: [other, ..], .. } = faces[new];
        let following = starting[to as usize];
        faces[new].beside[1] = following;
        faces[following as usize].beside[2] = new as u32;
        let other = &mut faces[other as usize];
        for edge in 0..3 {
            if other.corners[edge] == to {
                other.beside[edge] = new as u32;
            }
        }
    }
    // A point that is outside the new hull, and above a face that is gone, is above a new face: see the paper.
    for face in gone {
        for point in std::mem::take(&mut faces[face as usize].above) {
            faces[first..].iter_mut().any(|face| face.takes(points, point));
        }
    }
}

/// Returns four points that are in no plane, of which the last is below the triangle of the others.
fn simplex(points: &[[f64; 3]]) -> Result<[u32; 4], ShapeError> {
    // The point for which a number is greatest, if that is above 0.
    let greatest = |of: &dyn Fn(u32) -> f64| {
        let found = (0..points.len() as u32).map(|point| (of(point), point));
        found.reduce(|best, other| if other.0 > best.0 { other } else { best }).filter(|best| best.0 > 0.0)
    };
    let flat = |dimension| ShapeError::Flat { points: points.len(), dimension };
    let at = |point: u32| points[point as usize];
    let apart =
        |p: [f64; 3], q: [f64; 3]| (0..3).fold(0.0f64, |most, axis| most.max((p[axis] - q[axis]).abs()));
    let (_, a) = greatest(&|point| apart(at(point), at(0))).ok_or(flat(0))?;
    let (_, b) = greatest(&|point| apart(at(point), at(a))).ok_or(flat(0))?;
    let area = |point| {
        let along = |u, v| [a, b, point].map(|point| Coord { x: at(point)[u], y: at(point)[v] });
        let double = |[p, q, r]: [Coord<f64>; 3]| robust::orient2d(p, q, r).abs();
        double(along(0, 1)) + double(along(1, 2)) + double(along(2, 0))
    };
    let (_, c) = greatest(&area).ok_or(flat(1))?;
    let (_, d) = greatest(&|point| volume(points, [a, b, c, point]).abs()).ok_or(flat(2))?;
    Ok(if volume(points, [a, b, c, d]) < 0.0 { [a, b, c, d] } else { [a, c, b, d] })
}

/// Returns six times the volume of a tetrahedron, positive if the last point is on the side from which the first three turn
/// counter-clockwise. The sign is exact.
fn volume(points: &[[f64; 3]], corners: [u32; 4]) -> f64 {
    let [a, b, c, d] = corners.map(|point| points[point as usize]).map(|[x, y, z]| Coord3D { x, y, z });
    -robust::orient3d(a, b, c, d)
}
