//! Frames that follow the triangles below a node, and the rotation that a file could store of them.
//!
//! The rows of a frame are its axes in the coordinates of the object. A stored frame is a quaternion: the number of its
//! largest component, and the other three in ten or twenty bits each, so 4 or 8 bytes.

use super::vector::{IDENTITY, Matrix, Vector, cross, dot, length, minus, plus, times, unit};

/// Sweeps over the three pairs of axes. Jacobi's method converges quadratically, and five are usually enough.
const SWEEPS: usize = 12;
/// The angles about the normal that are tried for the other two axes, within a right angle.
const ANGLES: u32 = 16;
/// At most so many corners decide the angle about the normal: more do not change it by what a quantised frame keeps.
const CORNERS: usize = 512;

/// Returns the axes of the covariance of the surface, each triangle weighted by its area, longest first. The method is that
/// of Gottschalk, Lin and Manocha ("OBBTree", SIGGRAPH 1996), with the surface in place of its convex hull.
pub(super) fn covariance(triangles: &[[Vector; 3]]) -> Matrix {
    let (mut total, mut mean) = (0.0, [0.0; 3]);
    let (mut moments, origin) = ([[0.0; 3]; 3], triangles.first().map_or([0.0; 3], |t| t[0]));
    for t in triangles {
        let [a, b, c] = t.map(|p| minus(p, origin));
        let area = length(cross(minus(b, a), minus(c, a)));
        let sum = plus(a, plus(b, c));
        total += area;
        mean = plus(mean, times(sum, area / 3.0));
        for p in [a, b, c, sum] {
            for (row, factor) in moments.iter_mut().zip(p) {
                *row = plus(*row, times(p, factor * area / 12.0));
            }
        }
    }
    if total <= 0.0 {
        return IDENTITY;
    }
    let mean = times(mean, 1.0 / total);
    for (row, factor) in moments.iter_mut().zip(mean) {
        *row = minus(times(*row, 1.0 / total), times(mean, factor));
    }
    right_handed(principal_axes(moments))
}

/// Returns the frame whose last axis is the mean normal, and whose other axes make the rectangle around the corners least.
pub(super) fn along_normal(triangles: &[[Vector; 3]]) -> Matrix {
    let normals = triangles.iter().map(|[a, b, c]| cross(minus(*b, *a), minus(*c, *a)));
    let n = unit(normals.fold([0.0; 3], plus));
    let other = if n[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let x = unit(cross(n, other));
    let y = cross(n, x);
    let step = triangles.len().div_ceil(CORNERS / 3).max(1);
    let flat: Vec<[f64; 2]> =
        triangles.iter().step_by(step).flatten().map(|&p| [dot(p, x), dot(p, y)]).collect();
    let area = |turn: u32| {
        let (sine, cosine) = angle(turn).sin_cos();
        let width = |u: f64, v: f64| {
            let along = flat.iter().map(|p| u * p[0] + v * p[1]);
            let (lo, hi) =
                along.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (v.min(lo), v.max(hi)));
            hi - lo
        };
        width(cosine, sine) * width(-sine, cosine)
    };
    let best = (0..ANGLES).min_by(|&p, &q| area(p).total_cmp(&area(q))).unwrap_or(0);
    let (sine, cosine) = angle(best).sin_cos();
    let first = plus(times(x, cosine), times(y, sine));
    [first, cross(n, first), n]
}

fn angle(turn: u32) -> f64 {
    std::f64::consts::FRAC_PI_2 * f64::from(turn) / f64::from(ANGLES)
}

/// Returns the eigenvectors of a symmetric matrix by falling eigenvalue, by Jacobi rotations.
fn principal_axes(mut m: Matrix) -> Matrix {
    let mut axes = IDENTITY;
    for (p, q) in [(0, 1), (0, 2), (1, 2)].into_iter().cycle().take(3 * SWEEPS) {
        if m[p][q] == 0.0 {
            continue;
        }
        let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
        let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
        let cosine = 1.0 / tangent.hypot(1.0);
        let sine = tangent * cosine;
        let turn = |x: f64, y: f64| [cosine * x - sine * y, sine * x + cosine * y];
        for row in &mut m {
            [row[p], row[q]] = turn(row[p], row[q]);
        }
        let (first, second) = (m[p], m[q]);
        let turned = [0, 1, 2].map(|k| turn(first[k], second[k]));
        (m[p], m[q]) = (turned.map(|pair| pair[0]), turned.map(|pair| pair[1]));
        for row in &mut axes {
            [row[p], row[q]] = turn(row[p], row[q]);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| m[j][j].total_cmp(&m[i][i]));
    order.map(|axis| axes.map(|row| row[axis]))
}

fn right_handed([x, y, z]: Matrix) -> Matrix {
    if dot(cross(x, y), z) < 0.0 { [x, y, times(z, -1.0)] } else { [x, y, z] }
}

/// Returns the rotation that a decoder finds if a frame is stored with this many bits per component.
pub(super) fn stored(frame: &Matrix, bits: u32) -> Matrix {
    let q = quaternion(frame);
    let largest = (0..4).max_by(|&i, &j| q[i].abs().total_cmp(&q[j].abs())).unwrap_or(0);
    let sign = q[largest].signum();
    let most = f64::from((1u32 << (bits - 1)) - 1);
    let scale = most * std::f64::consts::SQRT_2;
    let mut kept = q.map(|c| (c * sign * scale).round().clamp(-most, most) / scale);
    let rest: f64 = (0..4).filter(|&i| i != largest).map(|i| kept[i] * kept[i]).sum();
    kept[largest] = (1.0 - rest).max(0.0).sqrt();
    rotation(kept)
}

fn rotation([w, x, y, z]: [f64; 4]) -> Matrix {
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}

/// Returns a quaternion of a rotation, by Shepperd's method: from its largest component.
fn quaternion(m: &Matrix) -> [f64; 4] {
    let trace = m[0][0] + m[1][1] + m[2][2];
    let squares = [trace, m[0][0], m[1][1], m[2][2]];
    let largest = (0..4).max_by(|&i, &j| squares[i].total_cmp(&squares[j])).unwrap_or(0);
    let q = match largest {
        0 => [1.0 + trace, m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]],
        1 => [m[2][1] - m[1][2], 1.0 + 2.0 * m[0][0] - trace, m[0][1] + m[1][0], m[0][2] + m[2][0]],
        2 => [m[0][2] - m[2][0], m[0][1] + m[1][0], 1.0 + 2.0 * m[1][1] - trace, m[1][2] + m[2][1]],
        _ => [m[1][0] - m[0][1], m[0][2] + m[2][0], m[1][2] + m[2][1], 1.0 + 2.0 * m[2][2] - trace],
    };
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oriented::vector::turned;
    use cbvh_testkit::Random;

    /// Returns the lengths of the sides of the box around triangles in a frame.
    fn sides(frame: &Matrix, triangles: &[[Vector; 3]]) -> Vector {
        let (mut lo, mut hi) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &corner in triangles.as_flattened() {
            let p = turned(frame, corner);
            for axis in 0..3 {
                (lo[axis], hi[axis]) = (lo[axis].min(p[axis]), hi[axis].max(p[axis]));
            }
        }
        minus(hi, lo)
    }

    fn any_rotation(random: &mut Random) -> Matrix {
        let n = unit([(); 3].map(|()| random.signed()));
        let x = unit(cross(n, [random.signed(), random.signed(), 2.0]));
        [x, cross(n, x), n]
    }

    #[test]
    fn stored_frames_are_rotations_near_the_given_ones() {
        let mut random = Random::new(5);
        for (bits, degrees) in [(10, 0.3), (20, 0.0003)] {
            for _ in 0..10_000 {
                let frame = any_rotation(&mut random);
                let again = stored(&frame, bits);
                for i in 0..3 {
                    assert!(dot(again[i], frame[i]) > f64::cos(f64::to_radians(degrees)), "{bits} {frame:?}");
                    let j = (i + 1) % 3;
                    assert!((dot(again[i], again[i]) - 1.0).abs() < 1e-12);
                    assert!(dot(again[i], again[j]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn both_frames_find_the_sides_of_a_turned_plate() {
        let mut random = Random::new(6);
        for _ in 0..200 {
            let frame = any_rotation(&mut random);
            let point = |x: f64, y: f64| plus(times(frame[0], x), times(frame[1], y));
            let (a, b, c, d) = (point(0.0, 0.0), point(5.0, 0.0), point(5.0, 2.0), point(0.0, 2.0));
            let plate = [[a, b, c], [a, c, d]];
            let mut found = sides(&covariance(&plate), &plate);
            found.sort_by(f64::total_cmp);
            assert!((0..3).all(|i| (found[i] - [0.0, 2.0, 5.0][i]).abs() < 1e-9), "{found:?}");
            let [x, y, z] = sides(&along_normal(&plate), &plate);
            assert!(z < 1e-9 && x * y < 12.0, "{x} {y} {z}");
        }
    }
}
