//! Matrices that place nothing: an answer would be about another shape.

use super::shapes::unit_cube;
use super::{Case, question};

const RIGID: &str = "the matrix changes lengths or angles, so the answer would be about another shape";
const NUMBERS: &str = "no number comes of it";

pub(super) fn cases() -> Vec<Case> {
    let rows = |change: &dyn Fn(&mut [[f64; 3]; 3])| {
        let mut rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        change(&mut rows);
        rows
    };
    let ask =
        |name: &str, hard| question("refused", name, hard, unit_cube(), unit_cube()).moved([3.0, 0.0, 0.0]);
    vec![
        // Off by 1.001^2 - 1.
        ask("one axis longer by 0.1 %", RIGID).turned(rows(&|r| r[0][0] = 1.001)).refused("2.00099"),
        ask("all twice as large", RIGID)
            .turned(rows(&|r| (0..3).for_each(|k| r[k][k] = 2.0)))
            .refused("3e0 away"),
        ask("sheared by 2^-19", RIGID)
            .turned(rows(&|r| r[0][1] = 1.0 / 524288.0))
            .refused("1.9073486328125e-6 away"),
        ask("a row lost", RIGID).turned(rows(&|r| r[1] = [0.0; 3])).refused("1e0 away"),
        ask("two rows the same", RIGID).turned(rows(&|r| r[1] = r[0])).refused("1e0 away"),
        ask("a mirror", RIGID).turned(rows(&|r| r[2][2] = -1.0)).refused("a reflection"),
        ask("NaN in the rotation", NUMBERS).turned(rows(&|r| r[2][0] = f64::NAN)).refused("NaN or infinity"),
        ask("infinity in the rotation", NUMBERS)
            .turned(rows(&|r| r[2][2] = f64::INFINITY))
            .refused("NaN or infinity"),
        ask("NaN in the translation", NUMBERS).moved([0.0, f64::NAN, 0.0]).refused("NaN or infinity"),
        ask("entries whose squares overflow", RIGID).turned(rows(&|r| r[0][0] = 1e200)).refused("inf away"),
        // 2^121; the format ends at 2^120.
        ask("beyond all coordinates", NUMBERS)
            .moved([0.0, 0.0, 2f64.powi(121)])
            .refused("2.658455991569832e36"),
    ]
}
