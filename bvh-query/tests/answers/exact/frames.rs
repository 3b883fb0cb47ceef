//! Frames against exact arithmetic: inverses, compositions, relative poses, quaternions and nearest rotations.
//!
//! Each identity is evaluated in integers times a power of two, so that nothing but the library rounds.

use crate::common::Random;
use bvh_query::{Pose, PoseError};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::{Dyadic, Number};

type Matrix = [[Dyadic; 3]; 3];

fn matrix(m: &[[f64; 3]; 3]) -> Matrix {
    m.map(|row| row.map(Dyadic::of))
}

fn transposed(m: &Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i].clone()))
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2]
        .map(|i| [0, 1, 2].map(|j| (0..3).fold(Dyadic::ZERO, |sum, k| sum.plus(&a[i][k].times(&b[k][j])))))
}

/// Returns R x + t.
fn place(pose: &Pose, x: &[Dyadic; 3]) -> [Dyadic; 3] {
    let r = matrix(pose.rotation());
    [0, 1, 2].map(|i| {
        let turned = (0..3).fold(Dyadic::ZERO, |sum, k| sum.plus(&r[i][k].times(&x[k])));
        turned.plus(&Dyadic::of(pose.translation()[i]))
    })
}

fn are_near(a: &[Dyadic], b: &[Dyadic], bound: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| a.minus(b).abs() <= Dyadic::of(bound))
}

fn are_equal_matrices(a: &Matrix, b: &Matrix, bound: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| are_near(a, b, bound))
}

/// Returns a pose whose rotation is off by up to `defect`, and whose translation is at most `far` along each axis.
fn random_pose(random: &mut Random, defect: f64, far: f64) -> Pose {
    loop {
        let q = [(); 4].map(|()| random.signed());
        let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        if length < 0.1 {
            continue;
        }
        let turned = *Pose::from_quaternion(q.map(|c| c / length), [0.0; 3]).unwrap().rotation();
        // A change of 0.16 of the defect in each entry moves entries of R R^T by less than the defect.
        let rotation = turned.map(|row| row.map(|entry| entry + 0.16 * defect * random.signed()));
        return Pose::new(rotation, [(); 3].map(|()| far * random.signed())).unwrap();
    }
}

/// Poses of all sizes: rigid ones and ones near the limit, near the origin and far from it.
fn poses(random: &mut Random) -> Pose {
    let defect = [0.0, 2f64.powi(-30), 2f64.powi(-21)][random.below(3)];
    let far = [0.0, 1e-30, 1.0, 1e6, 2f64.powi(100)][random.below(5)];
    random_pose(random, defect, far)
}

fn largest(t: [f64; 3]) -> f64 {
    t.into_iter().map(f64::abs).sum()
}

#[test]
fn inverses_and_compositions_take_points_where_they_should_be() {
    let random = &mut Random::new(41);
    let u = 2f64.powi(-53);
    for _ in 0..rounds(400) {
        let (first, next) = (poses(random), poses(random));
        let both = first.then(&next).unwrap();
        let expected = times(&matrix(next.rotation()), &matrix(first.rotation()));
        assert!(are_equal_matrices(&matrix(both.rotation()), &expected, 5.0 * u), "{first:?} {next:?}");
        let placed = place(&next, &first.translation().map(Dyadic::of));
        let bound = 64.0 * u * (largest(first.translation()) + largest(next.translation()));
        assert!(are_near(&both.translation().map(Dyadic::of), &placed, bound), "{first:?} {next:?}");

        let back = first.inverse().unwrap();
        let one = times(&matrix(back.rotation()), &matrix(first.rotation()));
        assert!(are_equal_matrices(&one, &matrix(Pose::IDENTITY.rotation()), 64.0 * u), "{first:?}");
        let origin = place(&back, &first.translation().map(Dyadic::of));
        let bound = 64.0 * u * largest(first.translation());
        assert!(are_near(&origin, &[Dyadic::ZERO, Dyadic::ZERO, Dyadic::ZERO], bound), "{first:?}");
    }
}

/// A point of B is at the same place whether it goes to the world directly or through A.
#[test]
fn relative_poses_are_those_between_two_poses_of_the_world() {
    let random = &mut Random::new(42);
    let u = 2f64.powi(-53);
    for _ in 0..rounds(400) {
        let (a, b) = (poses(random), poses(random));
        let b_in_a = Pose::relative(&a, &b).unwrap();
        let through = times(&matrix(a.rotation()), &matrix(b_in_a.rotation()));
        assert!(are_equal_matrices(&through, &matrix(b.rotation()), 64.0 * u), "{a:?} {b:?}");
        let origin = place(&a, &b_in_a.translation().map(Dyadic::of));
        let between: f64 = (0..3).map(|i| (b.translation()[i] - a.translation()[i]).abs()).sum();
        assert!(are_near(&origin, &b.translation().map(Dyadic::of), 64.0 * u * between), "{a:?} {b:?}");
        // Far from the world's origin, near to each other.
        let far = |pose: &Pose| Pose::new(*pose.rotation(), [1e9 + 0.5, -3e9, 7e9]).unwrap();
        let near = Pose::relative(&far(&a), &far(&b)).unwrap();
        assert_eq!(near.translation(), [0.0; 3]);
    }
}

#[test]
fn poses_of_a_world_always_have_a_relative_pose() {
    let random = &mut Random::new(43);
    for _ in 0..rounds(2000) {
        let [a, b] = [(); 2].map(|()| random_pose(random, 2f64.powi(-23), 2f64.powi(118)));
        assert!(Pose::relative(&a, &b).is_ok(), "{a:?} {b:?}");
    }
    // Two shears that add up.
    let shear = |e: f64| Pose::new([[1.0, e, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]).unwrap();
    let (a, b) = (shear(-0.9 * 2f64.powi(-20)), shear(0.9 * 2f64.powi(-20)));
    assert!(matches!(Pose::relative(&a, &b), Err(PoseError::NotRigid(_))));
    assert!(matches!(b.then(&b), Err(PoseError::NotRigid(_))));
    let far = Pose::new(*Pose::IDENTITY.rotation(), [2f64.powi(120), 0.0, 0.0]).unwrap();
    assert!(matches!(far.then(&far), Err(PoseError::TooFar(_))));
}

/// R |q|^2 is a matrix of polynomials in the components.
#[test]
fn quaternions_turn_as_their_polynomials_do() {
    let random = &mut Random::new(44);
    for _ in 0..rounds(400) {
        let q = [(); 4].map(|()| random.signed());
        let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        // As far from unit length as is allowed.
        let q = q.map(|c| c / length * (1.0 + 0.49 * 2f64.powi(-20) * random.signed()));
        let pose = Pose::from_quaternion(q, [1.0, 2.0, 3.0]).unwrap();
        let [x, y, z, w] = q.map(Dyadic::of);
        let squared = [&x, &y, &z, &w].into_iter().fold(Dyadic::ZERO, |sum, c| sum.plus(&c.times(c)));
        let two = Dyadic::of(2.0);
        let double = |a: Dyadic, b: Dyadic| two.times(&a.plus(&b));
        let minus = |a: Dyadic| Dyadic::ZERO.minus(&a);
        let expected = [
            [
                squared.minus(&double(y.times(&y), z.times(&z))),
                double(x.times(&y), minus(z.times(&w))),
                double(x.times(&z), y.times(&w)),
            ],
            [
                double(x.times(&y), z.times(&w)),
                squared.minus(&double(x.times(&x), z.times(&z))),
                double(y.times(&z), minus(x.times(&w))),
            ],
            [
                double(x.times(&z), minus(y.times(&w))),
                double(y.times(&z), x.times(&w)),
                squared.minus(&double(x.times(&x), y.times(&y))),
            ],
        ];
        let scaled = matrix(pose.rotation()).map(|row| row.map(|entry| entry.times(&squared)));
        assert!(are_equal_matrices(&scaled, &expected, 2f64.powi(-49)), "{q:?}");
        assert_eq!(pose.translation(), [1.0, 2.0, 3.0]);
    }
    // A quarter turn about z takes x to y.
    let half = 0.5f64.sqrt();
    let turned = Pose::from_quaternion([0.0, 0.0, half, half], [0.0; 3]).unwrap().place([1.0, 0.0, 0.0]);
    assert!((turned[1] - 1.0).abs() < 1e-15 && turned[0].abs() < 1e-15, "{turned:?}");
    for wrong in [[0.0; 4], [1.0, 1.0, 0.0, 0.0], [f64::NAN, 0.0, 0.0, 1.0], [1e200, 0.0, 0.0, 1.0]] {
        assert!(matches!(Pose::from_quaternion(wrong, [0.0; 3]), Err(PoseError::Quaternion(_))), "{wrong:?}");
    }
    let refused = Pose::from_quaternion([0.0, 0.0, 0.0, 1.0], [0.0, f64::NAN, 0.0]);
    assert!(matches!(refused, Err(PoseError::NotFinite { row: 2, column: 4, .. })));
}

/// The orthogonal factor U of A = U P is the one for which U^T A is symmetric and positive.
#[test]
fn nearest_rotations_are_polar_factors() {
    let random = &mut Random::new(45);
    for defect in [0.0, 1e-12, 1e-6, 1e-3, 2f64.powi(-7)] {
        for _ in 0..rounds(100) {
            let exact = *random_pose(random, 0.0, 0.0).rotation();
            let rounded = exact.map(|row| row.map(|entry| entry + 0.3 * defect * random.signed()));
            let pose = Pose::nearest(rounded, [1.0, -2.0, 3.0]).unwrap();
            let u = matrix(pose.rotation());
            let one = times(&transposed(&u), &u);
            let bound = 2f64.powi(-49);
            assert!(are_equal_matrices(&one, &matrix(Pose::IDENTITY.rotation()), bound), "{rounded:?}");
            let stretch = times(&transposed(&u), &matrix(&rounded));
            assert!(are_equal_matrices(&stretch, &transposed(&stretch), bound), "{rounded:?}");
            // It is positive, because it is near I.
            assert!(are_equal_matrices(&stretch, &matrix(Pose::IDENTITY.rotation()), 0.1), "{rounded:?}");
            assert_eq!(pose.translation(), [1.0, -2.0, 3.0]);
        }
    }
    let stretched = |s: f64| [[s, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    assert!(Pose::nearest(stretched((1.0f64 + 1.0 / 64.0).sqrt()), [0.0; 3]).is_ok());
    assert!(matches!(Pose::nearest(stretched(1.01), [0.0; 3]), Err(PoseError::NotNearlyRigid(_))));
    let scaled = Pose::IDENTITY.rotation().map(|row| row.map(|entry| 25.4 * entry));
    assert_eq!(Pose::nearest(scaled, [0.0; 3]), Err(PoseError::Scaled(25.4)));
    assert_eq!(Pose::nearest(stretched(-1.0), [0.0; 3]), Err(PoseError::Reflection));
    let refused = Pose::nearest(stretched(f64::NAN), [0.0; 3]);
    assert!(matches!(refused, Err(PoseError::NotFinite { row: 1, column: 1, .. })));
    assert!(matches!(Pose::nearest([[1e200; 3]; 3], [0.0; 3]), Err(PoseError::NotNearlyRigid(_))));
}
