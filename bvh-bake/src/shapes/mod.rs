//! Meshes of simple shapes: cores of rounded shapes, convex solids, grounds and clouds of points.
//!
//! A core is baked like any mesh. `bvh_query::Shape::rounded` gives it a radius and `bvh_query::Shape::solid` makes it solid:
//!
//! | shape | core | radius | solid |
//! |---|---|---|---|
//! | ball | [`point`] | its radius | |
//! | capsule | [`segment`] | its radius | |
//! | box, rounded box | [`block`], its sides less twice the radius | 0, or that of the rounding | yes |
//! | cylinder, cone | [`cylinder`], [`cone`]: polyhedra around them | 0 | yes |
//! | ground | [`ground`] | 0 | yes |
//! | cloud of points | [`cloud`] | that of each point | |
//! | convex hull of points | [`convex_hull`] | 0 | yes |
//! | voxels, octree | [`voxels`], [`octree`] | 0 | yes |
//!
//! Each function places its shape at the origin of the mesh's frame, with lengths in mesh units, and looks outwards: the
//! corners of a triangle turn counter-clockwise as seen from outside. Bakes keep these numbers as they are.

mod cells;
mod hull;

pub use cells::{OctreeCell, octree, voxels};
pub use hull::convex_hull;

use crate::error::ShapeError;
use crate::input::mesh::Mesh;
use std::f64::consts::{PI, TAU};

/// The most sides of the polygon around a circle.
const MAX_SIDES: f64 = 4096.0;
/// A polygon is larger than one that touches its circle by this factor, 32 roundings, so that those of its corners do not bring a
/// side inside.
const ROUNDING: f64 = 1.0 + 1.0 / (1u64 << 48) as f64;

/// Makes a point: the core of a ball.
pub fn point(at: [f64; 3]) -> Mesh {
    cloud(&[at])
}

/// Makes a segment: the core of a capsule.
pub fn segment(from: [f64; 3], to: [f64; 3]) -> Mesh {
    Mesh::from_triangles(vec![from, to], vec![[0, 1, 1]])
}

/// Makes one point for each of many. Equal points stay, also in the file.
///
/// Baking a cloud takes about 0.3 microseconds per point on two cores, and 13 to 16 bytes of the file without ids.
pub fn cloud(points: &[[f64; 3]]) -> Mesh {
    Mesh::from_triangles(points.to_vec(), (0..points.len()).map(|number| [number as u32; 3]).collect())
}

/// Makes a box with its middle at the origin.
///
/// # Errors
/// [`ShapeError::Length`] if a side is not finite and above 0.
pub fn block(sides: [f64; 3]) -> Result<Mesh, ShapeError> {
    for side in sides {
        check("side", side)?;
    }
    let half = sides.map(|side| side / 2.0);
    Ok(between(half.map(|h| -h), half))
}

/// Makes the solid ground under z = 0: a box of these sides along x and y, and of this thickness.
///
/// # Errors
/// [`ShapeError::HalfSpace`] if a side or the thickness is infinite, because files have finite coordinates, and
/// [`ShapeError::Length`] if one is not above 0.
pub fn ground(sides: [f64; 2], thickness: f64) -> Result<Mesh, ShapeError> {
    for (name, length) in [("side", sides[0]), ("side", sides[1]), ("thickness", thickness)] {
        if length == f64::INFINITY {
            return Err(ShapeError::HalfSpace(name));
        }
        check(name, length)?;
    }
    let [x, y] = sides.map(|side| side / 2.0);
    Ok(between([-x, -y, -thickness], [x, y, 0.0]))
}

/// Makes the box between two corners.
fn between(lo: [f64; 3], hi: [f64; 3]) -> Mesh {
    let corner =
        |number: usize| [0, 1, 2].map(|axis| if number >> axis & 1 == 0 { lo[axis] } else { hi[axis] });
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let halves = faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]);
    Mesh::from_triangles((0..8).map(corner).collect(), halves.collect())
}

/// A polyhedron around a round shape.
///
/// ```
/// use bvh_bake::shapes::{Circumscribed, cylinder};
///
/// let Circumscribed { mesh, error } = cylinder(0.5, 2.0, 0.01)?;
/// assert!(error <= 0.01 * (1.0 + 1e-9));
/// let from_the_axis = |[x, y, _]: &[f64; 3]| (x * x + y * y).sqrt();
/// assert!(mesh.objects[0].positions.iter().all(|corner| (0.5..=0.511).contains(&from_the_axis(corner))));
/// # Ok::<(), bvh_bake::ShapeError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Circumscribed {
    /// The polyhedron, which contains the shape.
    pub mesh: Mesh,
    /// How far its points are at most from the shape, in mesh units: at most the error that was asked for, but for roundings.
    pub error: f64,
}

/// Makes a prism around a cylinder, whose axis is z and whose middle is at the origin.
///
/// # Errors
/// [`ShapeError::Length`] if a length is not finite and above 0, and [`ShapeError::Sides`] if the error is so small beside the
/// radius that the prism would have more than 4,096 sides.
pub fn cylinder(radius: f64, length: f64, max_error: f64) -> Result<Circumscribed, ShapeError> {
    let (ring, error) = ring(radius, max_error)?;
    check("length", length)?;
    let (sides, half) = (ring.len() as u32, length / 2.0);
    let at = |z: f64| ring.iter().map(move |&[x, y]| [x, y, z]);
    let mut triangles = Vec::new();
    for side in 0..sides {
        let next = (side + 1) % sides;
        triangles.extend([[side, next, sides + next], [side, sides + next, sides + side]]);
        if side > 0 && next > 0 {
            triangles.extend([[0, next, side], [sides, sides + side, sides + next]]);
        }
    }
    Ok(Circumscribed { mesh: Mesh::from_triangles(at(-half).chain(at(half)).collect(), triangles), error })
}

/// Makes a pyramid around a cone, whose base is centred at the origin in the plane z = 0 and whose apex is at z = `height`.
///
/// # Errors
/// The errors of [`cylinder`].
pub fn cone(radius: f64, height: f64, max_error: f64) -> Result<Circumscribed, ShapeError> {
    let (ring, error) = ring(radius, max_error)?;
    check("height", height)?;
    let sides = ring.len() as u32;
    let mut triangles = Vec::new();
    for side in 0..sides {
        let next = (side + 1) % sides;
        triangles.push([side, next, sides]);
        if side > 0 && next > 0 {
            triangles.push([0, next, side]);
        }
    }
    // The slope of the pyramid's sides is that of the cone, if its apex is as much higher as its base is wider.
    let apex = [0.0, 0.0, height * ROUNDING];
    let corners = ring.iter().map(|&[x, y]| [x, y, 0.0]).chain([apex]);
    let mesh = Mesh::from_triangles(corners.collect(), triangles);
    Ok(Circumscribed { mesh, error: error.max(height * (ROUNDING - 1.0)) })
}

/// Returns a regular polygon around a circle, and how far its corners are at most from the circle.
fn ring(radius: f64, max_error: f64) -> Result<(Vec<[f64; 2]>, f64), ShapeError> {
    check("radius", radius)?;
    check("max_error", max_error)?;
    // The same digits on every system.
    let sides = (PI / libm::acos(radius / (radius + max_error))).ceil().max(3.0);
    if sides.is_nan() || sides > MAX_SIDES {
        return Err(ShapeError::Sides(max_error));
    }
    let corner = radius / libm::cos(PI / sides) * ROUNDING;
    let at = |number: u32| {
        let (sin, cos) = libm::sincos(TAU * f64::from(number) / sides);
        [corner * cos, corner * sin]
    };
    Ok(((0..sides as u32).map(at).collect(), corner * ROUNDING - radius))
}

/// Makes a surface over a grid: `heights` has the z of `columns` points along x, row by row along y. Neighbours are `cell` apart.
/// The first point is at x = y = 0.
///
/// # Errors
/// [`ShapeError::Length`] if a side of the cells is not finite and above 0, and [`ShapeError::Grid`] if the heights are not two
/// or more rows of two or more columns.
pub fn height_field(columns: usize, heights: &[f64], cell: [f64; 2]) -> Result<Mesh, ShapeError> {
    for side in cell {
        check("cell", side)?;
    }
    let rows = heights.len().checked_div(columns).unwrap_or(0);
    if columns < 2 || rows < 2 || rows * columns != heights.len() {
        return Err(ShapeError::Grid { columns, heights: heights.len() });
    }
    let position = |(number, &height): (usize, &f64)| {
        [(number % columns) as f64 * cell[0], (number / columns) as f64 * cell[1], height]
    };
    let mut triangles = Vec::with_capacity(2 * (rows - 1) * (columns - 1));
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let a = row * columns + column;
            let [a, b, c, d] = [a, a + 1, a + columns, a + columns + 1].map(|number| number as u32);
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    Ok(Mesh::from_triangles(heights.iter().enumerate().map(position).collect(), triangles))
}

/// Refuses what is no length.
fn check(name: &'static str, found: f64) -> Result<(), ShapeError> {
    if found.is_finite() && found > 0.0 { Ok(()) } else { Err(ShapeError::Length { name, found }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// Returns the volume of a closed mesh, and checks that each edge has a partner in the other direction.
    pub(super) fn volume(mesh: &Mesh) -> f64 {
        let object = &mesh.objects[0];
        let mut edges = HashMap::new();
        let mut sum = 0.0;
        for &[a, b, c] in &object.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from, to)).or_insert(0) += 1;
            }
            let [p, q, r] = [a, b, c].map(|number| object.positions[number as usize]);
            sum += p[0] * (q[1] * r[2] - q[2] * r[1])
                + p[1] * (q[2] * r[0] - q[0] * r[2])
                + p[2] * (q[0] * r[1] - q[1] * r[0]);
        }
        assert!(edges.iter().all(|(&(from, to), count)| edges.get(&(to, from)) == Some(count)));
        sum / 6.0
    }

    #[test]
    fn solids_are_closed_look_outwards_and_contain_what_they_stand_for() {
        assert!((volume(&block([1.0, 2.0, 3.0]).unwrap()) - 6.0).abs() < 1e-12);
        assert!((volume(&ground([10.0, 4.0], 0.5).unwrap()) - 20.0).abs() < 1e-12);
        for (radius, max_error) in [(1.0, 0.1), (2.0, 0.005), (0.1, 5.0), (1e-6, 1e-9)] {
            let prism = cylinder(radius, 3.0, max_error).unwrap();
            let exact = PI * radius * radius * 3.0;
            let found = volume(&prism.mesh);
            assert!(
                found > exact && found < exact * (1.0 + prism.error / radius).powi(2) * (1.0 + prism.error)
            );
            assert!(prism.error <= max_error + 2e-14 * radius, "{} {max_error}", prism.error);
            // All sides are outside the circle.
            let ring = &prism.mesh.objects[0].positions;
            assert!(ring.iter().all(|p| p[2].abs() == 1.5));
            let sides = ring.len() / 2;
            for side in 0..sides {
                let ([px, py, _], [qx, qy, _]) = (ring[side], ring[(side + 1) % sides]);
                let away = (px * qy - py * qx) / (qx - px).hypot(qy - py);
                assert!(away >= radius, "{away} {radius}");
                assert!(px.hypot(py) <= radius + prism.error);
            }
            let pyramid = cone(radius, 3.0, max_error).unwrap();
            assert!(volume(&pyramid.mesh) > exact / 3.0);
        }
    }

    #[test]
    fn faces_between_full_cells_are_left_out() {
        let two = voxels(&[[0, 0, 0], [1, 0, 0], [0, 0, 0]], 0.5).unwrap();
        assert_eq!(two.triangle_count(), 20);
        assert!((volume(&two) - 0.25).abs() < 1e-12);
        let ends = voxels(&[[i32::MAX, 0, i32::MIN]], 1.0).unwrap();
        assert!(ends.triangle_count() == 12 && volume(&ends) > 0.0);
        assert_eq!(voxels(&[], 1.0).unwrap().triangle_count(), 0);
    }

    #[test]
    fn a_height_field_has_two_triangles_a_cell() {
        let field = height_field(3, &[0.0, 1.0, 0.0, 2.0, 1.0, 0.0], [1.0, 2.0]).unwrap();
        assert_eq!(field.triangle_count(), 4);
        assert_eq!(field.objects[0].positions[3], [0.0, 2.0, 2.0]);
        for (columns, count) in [(0, 0), (1, 4), (4, 4), (3, 7), (0, 5)] {
            assert!(matches!(
                height_field(columns, &vec![0.0; count], [1.0; 2]),
                Err(ShapeError::Grid { .. })
            ));
        }
    }

    #[test]
    fn what_is_no_length_is_refused() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let is_refused = |found: Result<(), ShapeError>| matches!(found, Err(ShapeError::Length { .. }));
            assert!(
                is_refused(block([1.0, wrong, 1.0]).map(drop))
                    && (wrong == f64::INFINITY || is_refused(ground([1.0; 2], wrong).map(drop)))
            );
            assert!(
                is_refused(cylinder(wrong, 1.0, 0.1).map(drop))
                    && is_refused(cone(1.0, wrong, 0.1).map(drop))
            );
            assert!(
                is_refused(cylinder(1.0, 1.0, wrong).map(drop)) && is_refused(voxels(&[], wrong).map(drop))
            );
        }
        assert_eq!(cylinder(1.0, 1.0, 1e-12), Err(ShapeError::Sides(1e-12)));
        for error in [0.0, 1e-12] {
            // The name that the argument has in every language.
            assert!(cone(1.0, 1.0, error).unwrap_err().to_string().starts_with("max_error: "), "{error}");
        }
        assert_eq!(ground([1.0, f64::INFINITY], 1.0), Err(ShapeError::HalfSpace("side")));
        assert_eq!(ground([1.0; 2], f64::INFINITY), Err(ShapeError::HalfSpace("thickness")));
    }
}
