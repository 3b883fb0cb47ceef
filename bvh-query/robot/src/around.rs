//! A cylinder around a shape, and how full it or the box is: bounds that tell nearly how far away a cylinder or a block is.

use crate::frame::{Point, each};
use bvh_query::Shape;

/// What bounds a shape, beside the box around it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// A cylinder around the core, about an axis through the middle of the box, if it is smaller than the box: which axis, and the
    /// radius.
    pub(crate) cylinder: Option<(usize, f64)>,
    /// Whether the distance from these bounds is nearly that from the shape.
    pub(crate) is_tight: bool,
}

impl Around {
    /// Takes the middle of the box around the core, and half of its sides. Cost: reading the shape once.
    pub(crate) fn new(shape: Shape<'_>, middle: &Point, half: &Point) -> Self {
        let mut radii = [0.0f64; 3];
        let mut volume = 0.0;
        let visited = shape.visit_triangles(|_, corners| {
            let [a, b, c] = corners.map(|corner| each(|k| corner[k] - middle[k]));
            volume += a[0] * (b[1] * c[2] - b[2] * c[1])
                + a[1] * (b[2] * c[0] - b[0] * c[2])
                + a[2] * (b[0] * c[1] - b[1] * c[0]);
            for corner in [a, b, c] {
                for k in 0..3 {
                    radii[k] = radii[k].max(long(corner[(k + 1) % 3], corner[(k + 2) % 3]));
                }
            }
        });
        if visited.is_err() {
            radii = [f64::INFINITY; 3];
        }
        let volume = f64::abs(volume) / 6.0;
        let of_box = 8.0 * half.iter().product::<f64>();
        let of_cylinder = |k: usize| 2.0 * half[k] * std::f64::consts::PI * radii[k] * radii[k];
        let least = |a: &usize, b: &usize| of_cylinder(*a).total_cmp(&of_cylinder(*b));
        let axis = [0, 1, 2].into_iter().min_by(least).unwrap_or(0);
        let cylinder = (of_cylinder(axis) < of_box).then_some((axis, radii[axis] * ROUNDED_UP));
        let of_bounds = if cylinder.is_some() { of_cylinder(axis) } else { of_box };
        // A point, and a segment along an axis. What is left of a box's side without the radius is rounded up by a part of that.
        let is_thin = half.iter().filter(|half| **half > THIN * shape.radius()).count() < 2;
        Self { cylinder, is_tight: is_thin || shape.is_solid() && volume > TIGHT * of_bounds }
    }
}

/// Bounds are nearly as far away as what they bound if so much of them is full.
const TIGHT: f64 = 0.9;
/// More than how much a box is larger than it needs to be, as a part of the radius.
const THIN: f64 = 1.0 / (1u64 << 32) as f64;
/// More than the roundings of a radius.
const ROUNDED_UP: f64 = 1.0 + 1.0 / (1u64 << 40) as f64;

pub(crate) fn long(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use crate::frame::Frame;
    use crate::setting::Part;
    use bvh_bake::mesh::Mesh;
    use bvh_bake::{Options, shapes, to_bytes};
    use bvh_query::{Bvh, OwnedShape};

    #[test]
    fn bounds_of_primitives_are_tight() {
        let shape = |mesh: &Mesh| -> OwnedShape {
            Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap().into()
        };
        let block = shape(&shapes::block([0.1, 0.2, 0.3]).unwrap());
        let cylinder = shape(&shapes::cylinder(0.1, 0.5, 1e-3).unwrap().mesh);
        let segment = |end| shape(&shapes::segment([0.0; 3], end)).rounded(0.1).unwrap();
        let (positions, triangles) = cbvh_testkit::ball::ball(300);
        let ball = shape(&Mesh::from_triangles(positions, triangles)).solid().unwrap();
        let kinds = [
            (shape(&shapes::point([1.0; 3])).rounded(0.1).unwrap(), true),
            (segment([0.0, 0.0, 0.3]), true),
            (segment([0.1, 0.2, 0.3]), false),
            (block.clone().solid().unwrap(), true),
            (block, false),
            (cylinder.clone().solid().unwrap(), true),
            (cylinder, false),
            (ball, false),
        ];
        for (number, (shape, is_tight)) in kinds.into_iter().enumerate() {
            let part = Part::new(0, (0, true), Frame::IDENTITY, shape, 0.0).unwrap();
            assert_eq!(part.around().is_tight, is_tight, "kind {number}");
        }
    }
}
