//! Matrices that are not poses and must be refused, because an answer would be about another shape.

use super::case::{Case, question};
use super::shapes::unit_cube;

pub(super) fn cases() -> Vec<Case> {
    let rows = |change: &dyn Fn(&mut [[f64; 3]; 3])| {
        let mut rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        change(&mut rows);
        rows
    };
    let ask =
        |what: &str| question(format!("refused: {what}"), unit_cube(), unit_cube()).moved([3.0, 0.0, 0.0]);
    vec![
        // The product of the row with itself is off by 1.001^2 - 1.
        ask("one axis longer by 0.1 %").turned(rows(&|r| r[0][0] = 1.001)).refused("2.00099"),
        ask("all axes twice as long")
            .turned(rows(&|r| (0..3).for_each(|k| r[k][k] = 2.0)))
            .refused("scaled by 2"),
        ask("sheared by 2^-19")
            .turned(rows(&|r| r[0][1] = 1.0 / 524288.0))
            .refused("1.9073486328125e-6 away"),
        ask("a row of zeros").turned(rows(&|r| r[1] = [0.0; 3])).refused("1e0 away"),
        ask("two rows the same").turned(rows(&|r| r[1] = r[0])).refused("1e0 away"),
        ask("a mirror").turned(rows(&|r| r[2][2] = -1.0)).refused("a reflection"),
        ask("NaN in the rotation")
            .turned(rows(&|r| r[2][0] = f64::NAN))
            .refused("row 3, column 1: expected a finite number, found NaN"),
        ask("infinity in the rotation")
            .turned(rows(&|r| r[2][2] = f64::INFINITY))
            .refused("row 3, column 3: expected a finite number"),
        ask("NaN in the translation")
            .moved([0.0, f64::NAN, 0.0])
            .refused("row 2, column 4: expected a finite number, found NaN"),
        ask("entries whose squares overflow").turned(rows(&|r| r[0][0] = 1e200)).refused("inf away"),
        // The translation is 2^121, and the format ends at 2^120.
        ask("beyond all coordinates").moved([0.0, 0.0, 2f64.powi(121)]).refused("2.658455991569832e36"),
    ]
}
