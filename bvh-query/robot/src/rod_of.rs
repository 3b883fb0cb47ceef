//! Finds the rods of a shape: whether it is a ball, a capsule, a block or a prism, by its triangles alone.
//!
//! It does not matter where a shape comes from, a file of a robot or a program. It is looked at once, when it is added or changed.
//! Cost: reading its triangles, of which few have as many as are looked at, and a question about one point if it is solid.

use crate::frame::{Frame, Point, each, length};
use crate::rod::{Axes, ROUNDED_UP, ROUNDING, Rods, Section, long};
use bvh_query::{Backend, Querier, Shape, Side};

/// The most triangles of a shape that is looked at: those of a prism of 257 sides. Larger meshes are read when they are asked about.
const MAX_TRIANGLES: u64 = 1024;
/// The least part of the outer radius of a prism that the inner one is.
const LEAST_ROUNDNESS: f64 = 0.75;
const UNITS: [Point; 3] = Frame::IDENTITY.rotation;

/// Returns the rods of a ball, a capsule, a block or a prism along an axis of its frame; `None` of any other shape.
pub(crate) fn rods_of(shape: Shape<'_>, origin: &Frame) -> Option<Rods> {
    if shape.objects().len() != 1 || shape.triangles() > MAX_TRIANGLES {
        return None;
    }
    let mut triangles = Vec::new();
    // A file that cannot be read says so when the shape is asked about.
    shape.visit_triangles(|_, corners| triangles.push(corners)).ok()?;
    let mut rods = match triangles.as_slice() {
        [] => return None,
        [triangle] => of_segment(triangle, shape)?,
        _ => of_block(&triangles, shape)
            .or_else(|| (0..3).find_map(|axis| of_prism(&triangles, axis, shape)))?,
    };
    rods.place(origin);
    Some(rods)
}

/// Returns the rods of a point or segment.
fn of_segment(&[a, b, c]: &[Point; 3], shape: Shape<'_>) -> Option<Rods> {
    let end = if b == a { c } else { b };
    if c != a && c != end {
        return None;
    }
    let way = each(|k| (end[k] - a[k]) / 2.0);
    let half = length(way);
    let along = if half > 0.0 { way.map(|x| x / half) } else { UNITS[2] };
    // A segment that is so short that its direction is lost.
    if (length(along) - 1.0).abs() > ROUNDING {
        return None;
    }
    let own = Axes { middle: each(|k| a[k] + way[k]), along, across: [UNITS[0], UNITS[1]] };
    Some(Rods::new(own, half, Section::Bare, shape.radius(), true))
}

/// Returns the box around triangles: its middle, and half of its sides.
fn bounds(triangles: &[[Point; 3]]) -> (Point, Point, [Point; 2]) {
    let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in triangles.iter().flatten() {
        (lo, hi) = (each(|k| lo[k].min(corner[k])), each(|k| hi[k].max(corner[k])));
    }
    let middle = each(|k| lo[k] + (hi[k] - lo[k]) / 2.0);
    (middle, each(|k| (hi[k] - middle[k]).max(middle[k] - lo[k]) * ROUNDED_UP), [lo, hi])
}

/// Returns the rods of a block along the axes of its frame: a mesh whose triangles all are in the six sides of the box around it.
///
/// No triangle enters the box, so that all of it is inside if its middle is.
fn of_block(triangles: &[[Point; 3]], shape: Shape<'_>) -> Option<Rods> {
    let (middle, half, ends) = bounds(triangles);
    let is_in_side = |triangle: &[Point; 3]| {
        (0..3).any(|k| ends.iter().any(|end| triangle.iter().all(|corner| corner[k] == end[k])))
    };
    if half.contains(&0.0) || !triangles.iter().all(is_in_side) {
        return None;
    }
    // The longest side first, which is the axis of the rod.
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|&a, &b| half[b].total_cmp(&half[a]));
    let [along, x, y] = order.map(|k| UNITS[k]);
    let own = Axes { middle, along, across: [x, y] };
    let section = Section::Rectangle([half[order[1]], half[order[2]]]);
    Some(Rods::new(own, half[order[0]], section, shape.radius(), is_solid_at(shape, middle)))
}

/// Returns the rods of a prism along an axis of its frame: a mesh with all corners in two planes.
///
/// The inner cylinder is between the planes, and no triangle enters it: each is in one of the planes, or projects to a segment that is
/// no nearer to the middle than the radius. So all of the cylinder is inside if its middle is.
fn of_prism(triangles: &[[Point; 3]], axis: usize, shape: Shape<'_>) -> Option<Rods> {
    let [x, y] = [(axis + 1) % 3, (axis + 2) % 3];
    let (mut centre, half, [lo, hi]) = bounds(triangles);
    let is_at_end = |corner: &Point| corner[axis] == lo[axis] || corner[axis] == hi[axis];
    if half[axis] == 0.0 || !triangles.iter().flatten().all(is_at_end) {
        return None;
    }
    let mut ring: Vec<[f64; 2]> = triangles.iter().flatten().map(|corner| [corner[x], corner[y]]).collect();
    ring.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    ring.dedup();
    let middle = [0, 1].map(|k| ring.iter().map(|corner| corner[k]).sum::<f64>() / ring.len() as f64);
    (centre[x], centre[y]) = (middle[0], middle[1]);
    let from_middle = |corner: [f64; 2]| [0, 1].map(|k| corner[k] - middle[k]);
    let outer = ring.iter().map(|&corner| long(from_middle(corner))).fold(0.0, f64::max) * ROUNDED_UP;
    let mut inner = outer;
    for triangle in triangles {
        if triangle.iter().all(|corner| corner[axis] == triangle[0][axis]) {
            continue;
        }
        let [a, b, c] = triangle.map(|corner| from_middle([corner[x], corner[y]]));
        let end = if b == a { c } else { b };
        if c != a && c != end {
            return None;
        }
        inner = f64::min(inner, distance_of_origin(a, end));
    }
    // Of a shape that is far from round, the rods tell little.
    if inner < LEAST_ROUNDNESS * outer {
        return None;
    }
    let own = Axes { middle: centre, along: UNITS[axis], across: [UNITS[x], UNITS[y]] };
    let section = Section::Disc { inner, outer };
    Some(Rods::new(own, half[axis], section, shape.radius(), is_solid_at(shape, centre)))
}

/// Returns how far the origin is from a segment.
fn distance_of_origin(a: [f64; 2], b: [f64; 2]) -> f64 {
    let way = [b[0] - a[0], b[1] - a[1]];
    let square = way[0] * way[0] + way[1] * way[1];
    let share = if square > 0.0 { (-(a[0] * way[0] + a[1] * way[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    long([a[0] + share * way[0], a[1] + share * way[1]])
}

/// Returns whether a point is inside the mesh of a solid shape, and not only within its radius.
fn is_solid_at(shape: Shape<'_>, point: Point) -> bool {
    let is_inside = || {
        let mut querier = Querier::with_backend(Backend::Scalar);
        let side = shape.rounded(0.0).and_then(|mesh| querier.side(mesh, point));
        matches!(side, Ok(Side::Inside))
    };
    shape.is_solid() && is_inside()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape};

    fn baked(mesh: &Mesh) -> OwnedShape {
        Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
    }

    #[test]
    fn what_is_no_rod_or_hollow_is_not_taken_for_one() {
        let rods = |shape: &OwnedShape| rods_of(shape.shape(), &Frame::IDENTITY);
        let solid = |mesh: &Mesh| baked(mesh).solid().unwrap();
        let block = shapes::block([1.0, 2.0, 3.0]).unwrap();
        let cylinder = shapes::cylinder(1.0, 3.0, 0.01).unwrap().mesh;
        assert!(rods(&solid(&block)).unwrap().is_solid && rods(&solid(&cylinder)).unwrap().is_solid);
        assert!(!rods(&baked(&block)).unwrap().is_solid && !rods(&baked(&cylinder)).unwrap().is_solid);
        // A pipe, whose axis is not inside, with and without a radius that fills it.
        let (outer, inner) = (cylinder, shapes::cylinder(0.9, 3.0, 0.009).unwrap().mesh);
        let pipe = solid(&pipe(&outer, &inner));
        for pipe in [pipe.clone(), pipe.rounded(2.0).unwrap()] {
            assert!(!rods(&pipe).unwrap().is_solid);
        }
        // A cone, a block that is cut off, a triangle, and a wedge.
        let cut = Mesh::from_triangles(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], vec![[0, 1, 2]]);
        let wedge = shapes::cylinder(1.0, 1.0, 1.0).unwrap().mesh;
        for mesh in [shapes::cone(1.0, 1.0, 0.1).unwrap().mesh, cut, wedge] {
            assert!(rods(&baked(&mesh)).is_none());
        }
        let mut bent = shapes::block([1.0; 3]).unwrap();
        bent.objects[0].positions[0][0] -= 1e-9;
        assert!(rods(&baked(&bent)).is_none());
    }

    /// Returns the mesh between two prisms of the same height and the same number of sides.
    fn pipe(outer: &Mesh, inner: &Mesh) -> Mesh {
        let [outer, inner] = [outer, inner].map(|mesh| &mesh.objects[0]);
        let count = outer.positions.len() as u32;
        assert_eq!(inner.positions.len() as u32, count);
        let sides = count / 2;
        let is_side = |triangle: &&[u32; 3]| {
            triangle.iter().any(|&k| k < sides) && triangle.iter().any(|&k| k >= sides)
        };
        let mut triangles: Vec<[u32; 3]> = outer.triangles.iter().filter(is_side).copied().collect();
        triangles.extend(
            inner.triangles.iter().filter(is_side).map(|&[a, b, c]| [a + count, c + count, b + count]),
        );
        for side in 0..sides {
            let next = (side + 1) % sides;
            let [a, b, c, d] = [side, next, count + side, count + next];
            triangles.extend([[a, c, b], [b, c, d]]);
            let [a, b, c, d] = [a, b, c, d].map(|corner| corner + sides);
            triangles.extend([[a, b, c], [b, d, c]]);
        }
        Mesh::from_triangles([outer.positions.clone(), inner.positions.clone()].concat(), triangles)
    }
}
