//! The transforms of nodes (COLLADA 1.4.1 specification, chapter 5): each is read from an element, and those of a node apply in
//! their order, the last one first.

use super::document::Document;
use super::schema::Tag;
use crate::error::Fault;
use crate::input::frame::{Affine, Frame, Linear, MATRIX_ERROR, Scales, UNIT, cross, dot, normalised};
use crate::input::xml::Number;

/// One transform.
#[derive(Clone, Copy, Debug)]
pub(super) enum Transform {
    Translate([f64; 3]),
    Rotate(Linear),
    Scale([f64; 3]),
    Matrix(Affine),
}

impl Transform {
    /// Reads a transform of a node.
    pub(super) fn read(document: &Document, element: Number) -> Result<Self, Fault> {
        let wrong = |expected: &'static str, found: String| document.fault(element, expected, found);
        Ok(match document.tag(element) {
            Tag::Translate => Self::Translate(document.numbers(element)?),
            Tag::Scale => Self::Scale(document.numbers(element)?),
            Tag::Rotate => {
                let [x, y, z, degrees] = document.numbers(element)?;
                // A turn about no axis turns nothing.
                Self::Rotate(if [x, y, z] == [0.0; 3] { UNIT } else { turn([x, y, z], degrees) })
            }
            Tag::Matrix => {
                let all: [f64; 16] = document.numbers(element)?;
                let row = |row: usize| [0, 1, 2, 3].map(|column| all[4 * row + column]);
                let last = row(3);
                if [0.0, 0.0, 0.0, 1.0]
                    .iter()
                    .zip(last)
                    .any(|(expected, found)| (expected - found).abs() > MATRIX_ERROR)
                {
                    return Err(wrong("a matrix whose last row is 0 0 0 1", format!("{last:?}")));
                }
                Self::Matrix([0, 1, 2].map(row))
            }
            Tag::Lookat => {
                let all: [f64; 9] = document.numbers(element)?;
                let [eye, target, up] = [0, 3, 6].map(|first| [all[first], all[first + 1], all[first + 2]]);
                // What looks along -z looks at the target.
                let z = normalised([0, 1, 2].map(|axis| eye[axis] - target[axis]));
                let x = normalised(cross(up, z));
                let y = cross(z, x);
                if !x.iter().chain(&y).all(|value| value.is_finite()) {
                    return Err(wrong("a target and an axis in different directions", format!("{all:?}")));
                }
                Self::Matrix([0, 1, 2].map(|row| [x[row], y[row], z[row], eye[row]]))
            }
            Tag::Skew => {
                let all: [f64; 7] = document.numbers(element)?;
                let skew = skew(all[0], [all[1], all[2], all[3]], [all[4], all[5], all[6]]);
                Self::Matrix(
                    skew.ok_or_else(|| {
                        wrong("a skew by less than the angle of its axes", format!("{all:?}"))
                    })?,
                )
            }
            other => unreachable!("{other:?} is no transform"),
        })
    }

    /// Returns the transform as a matrix.
    pub(super) fn matrix(&self) -> Affine {
        let row = |linear: &Linear, at: usize| [linear[at][0], linear[at][1], linear[at][2], 0.0];
        match self {
            Self::Translate(by) => [0, 1, 2].map(|at| {
                let [x, y, z, _] = row(&UNIT, at);
                [x, y, z, by[at]]
            }),
            Self::Rotate(rotation) => [0, 1, 2].map(|at| row(rotation, at)),
            Self::Scale(by) => [0, 1, 2].map(|at| row(&UNIT, at).map(|value| value * by[at])),
            Self::Matrix(matrix) => *matrix,
        }
    }

    /// Divides the transform into a rigid pose and the rest.
    pub(super) fn frame(&self, scales: &mut Scales) -> Frame {
        match self {
            Self::Translate(translation) => Frame { translation: *translation, ..Frame::WORLD },
            Self::Rotate(rotation) => Frame { rotation: *rotation, ..Frame::WORLD },
            Self::Scale(by) => Frame::of_scales(*by),
            Self::Matrix(matrix) => Frame::of_matrix(matrix, scales),
        }
    }
}

/// Returns the turn about an axis. A quarter of a turn about an axis of coordinates is exact.
fn turn(axis: [f64; 3], degrees: f64) -> Linear {
    let [x, y, z] = normalised(axis);
    let (sin, cos) = match degrees % 360.0 {
        quarters if quarters % 90.0 == 0.0 => {
            let sines = [0.0, 1.0, 0.0, -1.0];
            let number = (quarters / 90.0 + 4.0) as usize % 4;
            (sines[number], sines[(number + 1) % 4])
        }
        degrees => libm::sincos(degrees.to_radians()),
    };
    let versine = 1.0 - cos;
    [
        [cos + versine * x * x, versine * x * y - sin * z, versine * x * z + sin * y],
        [versine * x * y + sin * z, cos + versine * y * y, versine * y * z - sin * x],
        [versine * x * z - sin * y, versine * y * z + sin * x, cos + versine * z * z],
    ]
}

/// Returns the skew that turns a vector along `from` by an angle towards `to`, and moves all points along `to` (RenderMan Interface
/// Specification 3.2, `RiSkew`, to which COLLADA refers). `None` if the axes have one direction, or the angle leads past `to`.
fn skew(degrees: f64, from: [f64; 3], to: [f64; 3]) -> Option<Affine> {
    let (from, to) = (normalised(from), normalised(to));
    let side = normalised(cross(from, to));
    // The direction that is square to `to`, in the plane of both.
    let square = cross(to, side);
    let (along, across) = (dot(from, to), dot(from, square));
    // The angle between `square` and the turned vector.
    let angle = degrees.to_radians() + libm::atan2(along, across);
    if !square.iter().all(|value| value.is_finite()) || angle.abs() >= std::f64::consts::FRAC_PI_2 {
        return None;
    }
    let factor = libm::tan(angle) - along / across;
    Some([0, 1, 2].map(|row| {
        let linear = [0, 1, 2].map(|column| UNIT[row][column] + factor * to[row] * square[column]);
        [linear[0], linear[1], linear[2], 0.0]
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::frame::apply;

    fn read(element: &str) -> Result<Affine, String> {
        let text = format!("<COLLADA><library_nodes><node>{element}</node></library_nodes></COLLADA>");
        let document = Document::parse(&text).unwrap();
        let transform =
            Transform::read(&document, 3).map_err(|fault| fault.in_file("a".as_ref()).to_string())?;
        let matrix = transform.matrix();
        // Both ways to place a mesh agree.
        let frame = transform.frame(&mut Scales::stated([].into_iter()));
        for point in [[1.0, 2.0, 3.0], [-3.0, 0.5, 7.0]] {
            let shaped = frame.shaped(point);
            let placed = [0, 1, 2].map(|row| dot(frame.rotation[row], shaped) + frame.translation[row]);
            let expected = apply(&matrix, point);
            (0..3).for_each(|axis| assert!((placed[axis] - expected[axis]).abs() < 1e-12, "{element}"));
        }
        Ok(matrix)
    }

    fn moved(element: &str, point: [f64; 3]) -> [f64; 3] {
        apply(&read(element).unwrap(), point).map(|value| (value * 1e9).round() / 1e9)
    }

    #[test]
    fn each_transform_moves_points() {
        for (element, point, expected) in [
            ("<translate>1 2 3</translate>", [1.0, 1.0, 1.0], [2.0, 3.0, 4.0]),
            ("<scale>1 -2 3</scale>", [1.0, 1.0, 1.0], [1.0, -2.0, 3.0]),
            ("<rotate>0 0 2 90</rotate>", [1.0, 2.0, 3.0], [-2.0, 1.0, 3.0]),
            ("<rotate>0 0 2 -450</rotate>", [1.0, 2.0, 3.0], [2.0, -1.0, 3.0]),
            ("<rotate>1 1 1 120</rotate>", [1.0, 2.0, 3.0], [3.0, 1.0, 2.0]),
            ("<rotate>0 0 0 30</rotate>", [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
            ("<matrix>0 -1 0 5 1 0 0 6 0 0 1 7 0 0 0 1</matrix>", [1.0, 2.0, 3.0], [3.0, 7.0, 10.0]),
            // A camera at x = 5 that looks at the origin, z up: its axis y is the world's z, its z the world's x.
            ("<lookat>5 0 0 0 0 0 0 0 1</lookat>", [0.0, 1.0, 2.0], [7.0, 0.0, 1.0]),
            ("<lookat>0 0 5 0 0 0 0 1 0</lookat>", [1.0, 2.0, 3.0], [1.0, 2.0, 8.0]),
            // The example of the specification.
            ("<skew>45 0 1 0 1 0 0</skew>", [1.0, 2.0, 3.0], [3.0, 2.0, 3.0]),
            ("<skew>-45 0 2 0 3 0 0</skew>", [1.0, 2.0, 3.0], [-1.0, 2.0, 3.0]),
            // The first axis, 45 degrees from the second, turns to where both are square.
            ("<skew>-45 1 1 0 1 0 0</skew>", [1.0, 1.0, 3.0], [0.0, 1.0, 3.0]),
        ] {
            assert_eq!(moved(element, point), expected, "{element}");
        }
        assert_eq!(read("<rotate>0 1 0 180</rotate>").unwrap()[0], [-1.0, 0.0, 0.0, 0.0], "exact");
    }

    #[test]
    fn transforms_that_are_none_are_refused() {
        for (element, expected) in [
            ("<translate>1 2</translate>", "line 1: expected 3 numbers in <translate>, found 2"),
            ("<scale>1 2 3 4</scale>", "expected 3 numbers in <scale>, found 4"),
            ("<translate>1 2 nan</translate>", "expected a finite number, found nan"),
            ("<translate>1,5 2 3</translate>", "expected a finite number, found 1,5"),
            ("<translate>1 <x/>2 3</translate>", "expected text alone in <translate>, found <x>"),
            (
                "<matrix>1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1</matrix>",
                "expected a matrix whose last row is 0 0 0 1",
            ),
            ("<lookat>1 2 3 1 2 3 0 0 1</lookat>", "expected a target and an axis in different directions"),
            ("<lookat>1 2 3 1 2 5 0 0 1</lookat>", "expected a target and an axis in different directions"),
            ("<skew>45 1 0 0 2 0 0</skew>", "expected a skew by less than the angle of its axes"),
            ("<skew>90 0 1 0 1 0 0</skew>", "expected a skew by less than the angle of its axes"),
        ] {
            let said = read(element).unwrap_err();
            assert!(said.contains(expected), "{said}");
        }
    }
}
