//! The transforms of the nodes of a scene, and their division into a rigid pose and the rest, which is baked into the
//! mesh.

pub(super) use bvh_format::vec3::{cross, dot};
use std::collections::BTreeSet;

/// The first three rows of a 4x4 matrix.
pub(super) type Affine = [[f64; 4]; 3];
/// The rows of a 3x3 matrix.
pub(super) type Linear = [[f64; 3]; 3];

/// The transform of a node, as the document states it.
#[derive(Clone, Copy)]
pub(super) enum Transform {
    /// The columns of a 4x4 matrix.
    Matrix { matrix: [[f32; 4]; 4] },
    /// Scales, then a rotation by a quaternion x, y, z, w, then a translation.
    Decomposed { translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3] },
}

pub(super) const IDENTITY: Affine = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
pub(super) const UNIT: Linear = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// How far the columns of a matrix of f32 numbers may be from a rotation times scales to be taken as one: twice what rounding
/// its entries to f32 does.
pub(super) const MATRIX_ERROR: f64 = 1.0 / (1u32 << 22) as f64;

/// A node's place in the world: a point x of its mesh is at R (S x) + t. The rotation R and the translation t are the
/// pose of an instance. S holds the scales and whatever else is left, and is baked into the mesh. Nodes that differ
/// only in R and t share a mesh, so S has the same bits for them.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub(super) rotation: Linear,
    pub(super) shape: Linear,
    pub(super) translation: [f64; 3],
}

impl Frame {
    /// The frame of the world.
    pub(super) const WORLD: Self = Self { rotation: UNIT, shape: UNIT, translation: [0.0; 3] };

    /// Returns the frame of a child with this transform.
    pub(super) fn of_child(&self, transform: Transform, scales: &mut Scales) -> Self {
        self.then(&Self::local(transform, scales))
    }

    /// Returns the frame of a child whose own frame is `child`: R' = R Rc, S' = (Rc^T S Rc) Sc, t' = R S tc + t. Where S
    /// is a single factor, or Rc is the identity, no rounding of Rc gets into S'.
    pub(super) fn then(&self, child: &Self) -> Self {
        let Self { rotation, shape, translation } = *self;
        let turned = if child.rotation == UNIT || is_one_factor(&shape) {
            shape
        } else {
            times(&times(&transposed(&child.rotation), &shape), &child.rotation)
        };
        let moved = apply_linear(&rotation, apply_linear(&shape, child.translation));
        Self {
            rotation: times(&rotation, &child.rotation),
            shape: times(&turned, &child.shape),
            translation: [0, 1, 2].map(|axis| moved[axis] + translation[axis]),
        }
    }

    /// Divides a node's own transform.
    fn local(transform: Transform, scales: &mut Scales) -> Self {
        match transform {
            Transform::Decomposed { translation, rotation, scale } => {
                Self { rotation: of_quaternion(rotation), shape: diagonal(scale), translation }
            }
            Transform::Matrix { .. } => Self::of_matrix(&local(transform), scales),
        }
    }

    /// Divides a matrix.
    pub(super) fn of_matrix(matrix: &Affine, scales: &mut Scales) -> Self {
        let columns = [0, 1, 2].map(|column| matrix.map(|row| row[column]));
        let (rotation, shape) = divided(columns, scales);
        Self { rotation, shape, translation: matrix.map(|row| row[3]) }
    }

    /// Returns the frame that only scales.
    pub(super) fn of_scales(scales: [f64; 3]) -> Self {
        Self { shape: diagonal(scales), ..Self::WORLD }
    }

    /// Returns whether S turns a mesh inside out.
    pub(super) fn mirrors(&self) -> bool {
        determinant(&self.shape) < 0.0
    }

    /// Returns a point of the mesh as it is baked.
    pub(super) fn shaped(&self, point: [f64; 3]) -> [f64; 3] {
        apply_linear(&self.shape, point)
    }
}

/// The scales that nodes state, and those of all matrices so far. Matrices of f32 numbers that differ by a rotation alone
/// seem to have scales that differ in the last digits; all of them take the nearest one that is known.
pub(super) struct Scales(BTreeSet<u64>);

impl Scales {
    /// Knows the scale 1, and those that nodes of a document state.
    pub(super) fn of(transforms: impl Iterator<Item = Transform>) -> Self {
        Self::stated(transforms.flat_map(|transform| match transform {
            Transform::Decomposed { scale, .. } => scale,
            Transform::Matrix { .. } => [1.0; 3],
        }))
    }

    /// Knows the scale 1 and these.
    pub(super) fn stated(scales: impl Iterator<Item = f64>) -> Self {
        let above_0 = scales.map(f64::abs).filter(|&scale| scale > 0.0 && scale.is_finite());
        Self(above_0.chain([1.0]).map(f64::to_bits).collect())
    }

    /// Returns the known scale that is equal but for rounding, or else adds this one. Scales are above 0.
    fn snap(&mut self, scale: f64) -> f64 {
        // Numbers above 0 are in the order of their bits.
        let range = (scale * (1.0 - MATRIX_ERROR)).to_bits()..=(scale * (1.0 + MATRIX_ERROR)).to_bits();
        let off = |&known: &u64| known.abs_diff(scale.to_bits());
        if let Some(known) = self.0.range(range).copied().min_by_key(off) {
            return f64::from_bits(known);
        }
        self.0.insert(scale.to_bits());
        scale
    }
}

/// Divides a matrix, given by columns, into a rotation and what is left: scales, if the columns are orthogonal but for
/// rounding, and all of it otherwise.
fn divided(columns: [[f64; 3]; 3], known: &mut Scales) -> (Linear, Linear) {
    let whole = (UNIT, transposed(&columns));
    let lengths = columns.map(|column| dot(column, column).sqrt());
    if !lengths.iter().all(|&length| length > 0.0 && length.is_finite()) {
        return whole;
    }
    let [x, y, z] = [0, 1, 2].map(|axis| columns[axis].map(|value| value / lengths[axis]));
    if [dot(x, y), dot(y, z), dot(z, x)].iter().any(|cosine| cosine.abs() > MATRIX_ERROR) {
        return whole;
    }
    let (least, most) = lengths.iter().fold((f64::MAX, 0.0f64), |(l, m), &v| (l.min(v), m.max(v)));
    let is_one_factor = most - least <= MATRIX_ERROR * most;
    let mean = (lengths[0] + lengths[1] + lengths[2]) / 3.0;
    let scales = if is_one_factor { [mean; 3] } else { lengths }.map(|length| known.snap(length));
    // A single factor stays one where the matrix mirrors: all axes are reversed. Else only the last one is.
    let mirrors = dot(cross(x, y), z) < 0.0;
    let (sign, last) =
        if is_one_factor && mirrors { (-1.0, 1.0) } else { (1.0, if mirrors { -1.0 } else { 1.0 }) };
    let scales = [sign * scales[0], sign * scales[1], sign * last * scales[2]];
    // The columns become orthonormal to the digits of f64, the first one as it is.
    let x = normalised(x.map(|value| sign * value));
    let y = y.map(|value| sign * value);
    let y = normalised(minus(y, x, dot(x, y)));
    (transposed(&[x, y, cross(x, y)]), diagonal(scales))
}

fn is_one_factor(shape: &Linear) -> bool {
    *shape == diagonal([shape[0][0]; 3])
}

fn diagonal([x, y, z]: [f64; 3]) -> Linear {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

fn minus(a: [f64; 3], b: [f64; 3], factor: f64) -> [f64; 3] {
    [0, 1, 2].map(|axis| a[axis] - factor * b[axis])
}

pub(super) fn normalised(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|value| value / length)
}

fn transposed(m: &Linear) -> Linear {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| m[column][row]))
}

fn times(a: &Linear, b: &Linear) -> Linear {
    a.map(|row| [0, 1, 2].map(|column| row[0] * b[0][column] + row[1] * b[1][column] + row[2] * b[2][column]))
}

fn apply_linear(m: &Linear, x: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, x))
}

fn determinant(m: &Linear) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

/// Returns a rotation. The quaternion is normalised, because its numbers are inexact; that of length 0 turns nothing.
fn of_quaternion([x, y, z, w]: [f64; 4]) -> Linear {
    let norm = x * x + y * y + z * z + w * w;
    let s = if norm > 0.0 { 2.0 / norm } else { 0.0 };
    [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]
}

/// Returns a node's own transform as one matrix.
pub(super) fn local(transform: Transform) -> Affine {
    match transform {
        Transform::Matrix { matrix } => {
            std::array::from_fn(|row| std::array::from_fn(|column| f64::from(matrix[column][row])))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = of_quaternion(rotation);
            std::array::from_fn(|row| {
                let [a, b, c] = [0, 1, 2].map(|column| rotation[row][column] * scale[column]);
                [a, b, c, translation[row]]
            })
        }
    }
}

/// Returns the product of two transforms.
pub(super) fn product(a: &Affine, b: &Affine) -> Affine {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let [x, y, z, w] = a[row];
            let sum = x * b[0][column] + y * b[1][column] + z * b[2][column];
            if column == 3 { sum + w } else { sum }
        })
    })
}

/// Returns where a transform takes a point.
pub(super) fn apply(m: &Affine, [x, y, z]: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
}

/// Returns whether a transform turns a mesh inside out.
pub(super) fn mirrors(m: &Affine) -> bool {
    determinant(&m.map(|[a, b, c, _]| [a, b, c])) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parts give the matrix back, the rotation is one, and rotations of one matrix leave the same for the mesh.
    #[test]
    fn matrices_are_divided_into_rotation_and_scales() {
        let turns = [[0.0, 0.0, 0.0, 1.0], [0.5, 0.5, 0.5, 0.5], [0.1, -0.7, 0.3, 0.2], [1.0, 2.0, 3.0, 4.0]];
        for scales in
            [[1.0f32, 1.0, 1.0], [0.01, 0.01, 0.01], [2.0, 3.0, 0.5], [-1.0, 1.0, 1.0], [-2.5, -2.5, -2.5]]
        {
            let (mut shapes, mut known) = (Vec::new(), Scales::of(std::iter::empty()));
            for turn in turns {
                let rotation = of_quaternion(turn);
                let matrix: [[f32; 4]; 4] = std::array::from_fn(|column| {
                    std::array::from_fn(|row| match (row, column) {
                        (3, 3) => 1.0,
                        (3, _) | (_, 3) => 0.0,
                        _ => (rotation[row][column] * f64::from(scales[column])) as f32,
                    })
                });
                let Frame { rotation, shape, .. } =
                    Frame::WORLD.of_child(Transform::Matrix { matrix }, &mut known);
                let back = times(&rotation, &shape);
                let largest = scales.iter().fold(0.0f64, |m, s| m.max(f64::from(s.abs())));
                for row in 0..3 {
                    for column in 0..3 {
                        let off = (back[row][column] - f64::from(matrix[column][row])).abs();
                        assert!(off <= MATRIX_ERROR * largest, "{off:e} of {scales:?}");
                        // A few roundings of f64 numbers below 1.
                        let unit = dot(rotation[row], rotation[column]);
                        assert!((unit - if row == column { 1.0 } else { 0.0 }).abs() < 1e-15);
                    }
                }
                assert!(determinant(&rotation) > 0.0);
                shapes.push(shape);
            }
            assert!(shapes.iter().all(|shape| shape == &shapes[0]), "{shapes:?}");
        }
    }

    #[test]
    fn what_is_no_rotation_stays_with_the_mesh() {
        for columns in [[[1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]], [[0.0; 3]; 3], [[1.0; 3]; 3]] {
            assert_eq!(divided(columns, &mut Scales::of(std::iter::empty())), (UNIT, transposed(&columns)));
        }
    }

    /// Scales above a turn are a shear, and that is baked too.
    #[test]
    fn frames_of_children_are_products() {
        let scale = |scale: [f64; 3]| Transform::Decomposed {
            translation: [1.0, 2.0, 3.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
            scale,
        };
        let turn = Transform::Decomposed {
            translation: [0.5, 0.0, -1.0],
            rotation: [0.1, 0.2, 0.3, 0.9],
            scale: [1.0, 1.0, 2.0],
        };
        let both = [scale([2.0, 2.0, 2.0]), scale([3.0, 1.0, 1.0]), turn];
        let world = |transforms: &[&Transform]| {
            let mut known = Scales::of(std::iter::empty());
            let child = |frame: Frame, transform: &&Transform| frame.of_child(**transform, &mut known);
            transforms.iter().fold(Frame::WORLD, child)
        };
        for (first, second) in both.iter().flat_map(|first| both.iter().map(move |second| (first, second))) {
            let frame = world(&[first, second, &turn]);
            let matrix = product(&product(&local(*first), &local(*second)), &local(turn));
            let point = [0.3, -0.7, 1.9];
            let placed = apply_linear(&frame.rotation, frame.shaped(point));
            let expected = apply(&matrix, point);
            for axis in 0..3 {
                assert!((placed[axis] + frame.translation[axis] - expected[axis]).abs() < 1e-13);
            }
        }
        // A single factor above stays a single factor below, to the bit.
        let frame = world(&[&scale([0.1, 0.1, 0.1]), &turn]);
        assert_eq!(frame.shape, diagonal([1.0, 1.0, 2.0].map(|s| 0.1 * s)));
    }
}
