//! Constructs contacts: two triangles share a corner, or a point of an edge or a face, or just miss it.
//!
//! All coordinates are small integers times a power of two, and poses are exact rotations with such translations.
//! Placed corners are therefore exact, and the construction itself says what is right, even for the oracles.

use super::ask::Asked;
use super::kinds::exact_turns;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{Random, Triangle, baked, queriers, stored};
use bvh_query::{Pose, Querier};
use cbvh_testkit::depth::rounds;
use cbvh_testkit::exact::Length;

type Integer = [i64; 3];

fn float(t: [Integer; 3], unit: f64) -> Triangle {
    t.map(|p| p.map(|x| x as f64 * unit))
}

fn plus(p: Integer, q: Integer) -> Integer {
    [0, 1, 2].map(|k| p[k] + q[k])
}

/// Returns a name, a triangle in the half space z <= 0 and one in z >= 0. They have at least one point in common, and
/// all common points are in z = 0. Corners are multiples of 8 where points between them are needed.
fn touching_at_zero(random: &mut Random) -> (&'static str, [Integer; 3], [Integer; 3]) {
    let mut flat = |z: i64| {
        let mut number = || 8 * (random.below(33) as i64 - 16);
        [number(), number(), z]
    };
    let (p, q, r) = (flat(0), flat(0), flat(0));
    let (below, lower) = (flat(-8), flat(-24));
    let (above, higher) = (flat(8), flat(40));
    let middle = |p: Integer, q: Integer| [0, 1, 2].map(|k| (p[k] + q[k]) / 2);
    match random.below(9) {
        0 => ("corner on corner", [p, below, lower], [p, above, higher]),
        1 => ("corner on edge", [p, q, lower], [middle(p, middle(p, q)), above, higher]),
        2 => ("corner on face", [p, q, r], [middle(p, middle(q, r)), above, higher]),
        3 => {
            let (centre, half) = (middle(p, q), plus(r, middle(p, q).map(|x| -x)));
            ("edge across edge", [p, q, lower], [r, plus(centre, half.map(|x| -x)), above])
        }
        4 => ("the same edge", [p, q, below], [q, p, above]),
        5 => ("edge along edge", [p, q, below], [middle(p, q), q, higher]),
        6 => ("edge in face", [p, q, r], [middle(p, q), middle(p, r), above]),
        7 => ("face on face", [p, q, r], [middle(p, q), middle(q, r), middle(p, r)]),
        _ => ("point on face", [p, q, r], [middle(p, middle(q, r)); 3]),
    }
}

fn apply(turn: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    turn.map(|row| row[0] * p[0] + row[1] * p[1] + row[2] * p[2])
}

/// Applies the inverse rotation, which is exact because these rotations are orthonormal to the bit.
fn apply_back(turn: [[f64; 3]; 3], p: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| turn[0][k] * p[0] + turn[1][k] * p[1] + turn[2][k] * p[2])
}

/// One contact at a place and a scale: the triangles, and the pose that brings B there.
struct Construction {
    name: &'static str,
    /// Multiplies all integers. B is moved up or down by 2^-30 of it.
    unit: f64,
    placed: [Triangle; 2],
    stored_b: Triangle,
    turn_b: [[f64; 3]; 3],
    back: [f64; 3],
    up: [f64; 3],
}

impl Construction {
    /// Rotates both triangles as one. B is moved away in its file, and back by the pose.
    fn new(random: &mut Random, turns: &[[[f64; 3]; 3]]) -> Self {
        let (name, a, b) = touching_at_zero(random);
        let unit = 2f64.powi(random.below(220) as i32 - 130);
        let (turn, turn_b) = (turns[random.below(24)], turns[random.below(24)]);
        let away = [(); 3].map(|()| random.below(1 << 12) as i64 - (1 << 11));
        let placed = [a, b].map(|t| float(t, unit).map(|p| apply(turn, p)));
        let moved = float(b.map(|p| plus(p, away)), unit);
        let stored_b = moved.map(|p| apply_back(turn_b, apply(turn, p)));
        let back = apply(turn, away.map(|x| -(x as f64) * unit));
        Self { name, unit, placed, stored_b, turn_b, back, up: apply(turn, [0.0, 0.0, 1.0]) }
    }

    /// Returns the pose in which B touches A (0), or is off A (1) or in A (-1) by 2^-30 of a unit. The sum takes 42
    /// bits.
    fn pose(&self, side: f64) -> Pose {
        let off = side * self.unit * 2f64.powi(-30);
        Pose::new(self.turn_b, [0, 1, 2].map(|k| self.back[k] + off * self.up[k])).unwrap()
    }

    fn check(&self, queriers: &mut [Querier], tally: &mut Tally) -> Result<(), String> {
        let [a, b] = [self.placed[0], self.stored_b].map(|t| baked(&[t]));
        let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
        let mut asked = Asked { a: &a, b: &b, queriers };
        for side in [0.0, 1.0, -1.0] {
            let pose = self.pose(side);
            let placed = surfaces[1].corners[0].map(|p| pose.place(p));
            if side == 0.0 {
                assert_eq!(sorted(placed), sorted(self.placed[1]), "{}", self.name);
            }
            asked.all(&Truth::new(&surfaces[0], &surfaces[1], &pose), &pose, tally)?;
            if side >= 0.0 {
                asked.collide(side == 0.0, &pose, tally)?;
                // A and B are on different sides of a plane, and the points that they shared are now exactly opposite
                // each other.
                let off = side * self.unit * 2f64.powi(-30);
                let length = Length::between(&surfaces[0].corners[0], &placed);
                assert!(length.compare(off).is_eq(), "{}", self.name);
                tally.boundaries += 1;
            }
        }
        Ok(())
    }
}

fn sorted(mut t: Triangle) -> Triangle {
    t.sort_by(|p, q| p.partial_cmp(q).unwrap());
    t
}

#[test]
fn corners_edges_and_faces_that_touch() {
    let (mut tally, mut queriers, mut random) = (Tally::default(), queriers(), Random::new(21));
    let turns = exact_turns();
    assert_eq!(turns.len(), 24);
    for round in 0..rounds(200) {
        let construction = Construction::new(&mut random, &turns);
        if let Err(error) = construction.check(&mut queriers, &mut tally) {
            tally.wrong(format!(
                "{}, round {round}, unit {:e}: {error}",
                construction.name, construction.unit
            ));
        }
        if tally.is_full() {
            break;
        }
    }
    tally.report("contact by construction");
}
