//! The cases that `cbvh report --hard` asks about: every fact they state is proved here, and every answer compared.

use super::ask::Asked;
use super::dyadic::{compare, grid, on_grid, parts};
use super::features::{Fraction, is_less, squared_distance};
use super::length::Length;
use super::meet::meet;
use super::number::Corners;
use super::tally::Tally;
use super::truth::{Surface, Truth};
use crate::common::{bake, mesh, options, queriers, stored};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose};
use cases::{Case, Ordered, Truth as Stated};
use dashu_int::IBig;
use std::collections::BTreeSet;

// What the command prints of a case, a test does not need.
#[allow(dead_code, reason = "a part of it is for the command")]
#[path = "../../../bvh-bake/cli/src/report/hard/cases/mod.rs"]
mod cases;

/// How far a distance with corners placed without rounding may be from the stated one, as a fraction of it: a
/// thousandth of what the report calls right.
const SAME: f64 = 1e-9;

fn file(triangles: &[cases::Triangle], profile: Profile, encoding: TriangleEncoding) -> Bvh {
    bake(&mesh(triangles), &options(profile, encoding))
}

/// Contacts, and the exact distance.
fn truth(surfaces: &[Surface; 2], pose: &Pose, tally: &mut Tally) -> (u64, Length) {
    let truth = Truth::new(&surfaces[0], &surfaces[1], pose);
    let any = Length::between(&surfaces[0].corners[0], &surfaces[1].corners[0].map(|p| pose.place(p)));
    (truth.contacts(tally).len() as u64, truth.distance((any, 0.0), tally).0)
}

/// What differs from what is stated.
fn check(case: &Case, order: &Ordered, tally: &mut Tally) -> Result<(), String> {
    let pose = match (Pose::from_rows(&order.pose), case.truth) {
        (Err(error), Stated::Refused { words }) if error.to_string().contains(words) => return Ok(()),
        (Ok(pose), Stated::Touching { .. } | Stated::Apart(_)) => pose,
        (pose, stated) => return Err(format!("{pose:?}, stated {stated:?}")),
    };
    let surfaces = [&order.a, &order.b]
        .map(|triangles| Surface::new(stored(&file(triangles, Profile::Dop14U8, TriangleEncoding::F32))));
    if surfaces[0].corners != order.a || surfaces[1].corners != order.b {
        return Err("the files hold other corners".into());
    }
    let (contacts, length) = truth(&surfaces, &pose, tally);
    match case.truth {
        Stated::Touching { contacts: stated } if contacts == stated => Ok(()),
        Stated::Apart(stated)
            if contacts == 0
                && length.compare(stated.floor()).is_ge()
                && (length.compare(stated.ceil()).is_lt() || length.compare(stated.floor()).is_eq()) =>
        {
            Ok(())
        }
        stated => Err(format!("{contacts} contacts, {:?} apart, stated {stated:?}", length.floor())),
    }
}

#[test]
fn stated_facts_are_proved() {
    let mut tally = Tally::default();
    let mut names = BTreeSet::new();
    for case in cases::all() {
        assert!(names.insert((case.kind, case.name.clone())), "{} twice", case.name);
        for order in case.orders() {
            if let Err(error) = check(&case, &order, &mut tally) {
                tally.wrong(format!("{}: {}, {}: {error}", case.kind, case.name, order.name));
            }
        }
    }
    tally.report("stated facts");
}

/// Both meshes as integers in units of 2^`grid`, B placed without rounding.
struct Real {
    a: Vec<Corners<IBig>>,
    b: Vec<Corners<IBig>>,
    grid: i32,
}

impl Real {
    fn new(case: &Case) -> Self {
        let numbers = case.a.iter().chain(&case.b).flatten().flatten().chain(&case.pose).copied();
        let unit = grid(numbers).min(0);
        // A product of two is in units of 2^(2 unit), and so all is.
        let single = |x: f64| on_grid(x, unit) << unit.unsigned_abs() as usize;
        let entry = |i: usize, j: usize| on_grid(case.pose[4 * i + j], unit);
        let place = |p: [f64; 3]| {
            let p = p.map(|x| on_grid(x, unit));
            [0, 1, 2]
                .map(|i| (0..3).fold(single(case.pose[4 * i + 3]), |sum, j| sum + entry(i, j) * p[j].clone()))
        };
        let a = case.a.iter().map(|t| t.map(|p| p.map(single))).collect();
        Self { a, b: case.b.iter().map(|t| t.map(place)).collect(), grid: 2 * unit }
    }

    fn truth(&self) -> (u64, Fraction<IBig>) {
        let pairs = || self.a.iter().flat_map(|a| self.b.iter().map(move |b| (a, b)));
        let contacts = pairs().filter(|(a, b)| meet(a, b).unwrap()).count() as u64;
        let squares = pairs().map(|(a, b)| squared_distance(a, b, &[IBig::ZERO, IBig::ONE]).unwrap());
        let nearer = |one, other| if is_less(&other, &one).unwrap() { other } else { one };
        (contacts, squares.reduce(nearer).unwrap())
    }

    /// Whether a squared length in these units is that of a number that is not negative, or how it compares.
    fn compare(&self, square: &Fraction<IBig>, x: f64) -> std::cmp::Ordering {
        let (mantissa, exponent) = parts(x);
        if mantissa == 0 {
            return square.0.cmp(&IBig::ZERO);
        }
        let of_x = IBig::from(mantissa) * IBig::from(mantissa) * &square.1;
        compare(square.0.clone(), 2 * self.grid, of_x, 2 * exponent)
    }
}

/// So that the facts are not only about this library's way of placing corners.
#[test]
fn facts_hold_however_corners_are_placed() {
    let mut tally = Tally::default();
    for case in cases::all() {
        let Ok(pose) = Pose::from_rows(&case.pose) else { continue };
        let real = Real::new(&case);
        let single = |x: f64| on_grid(x, real.grid);
        let rounded: Vec<_> = case.b.iter().map(|t| t.map(|p| pose.place(p).map(single))).collect();
        if rounded == real.b {
            continue;
        }
        tally.poses += 1;
        let (contacts, square) = real.truth();
        let right = match case.truth {
            Stated::Touching { contacts: stated } => contacts == stated,
            Stated::Apart(stated) => {
                let (least, most) = (stated.floor() * (1.0 - SAME), stated.ceil() * (1.0 + SAME));
                contacts == 0 && real.compare(&square, least).is_ge() && real.compare(&square, most).is_le()
            }
            Stated::Refused { .. } => false,
        };
        if !right {
            tally
                .wrong(format!("{}: {}: {contacts} contacts, stated {:?}", case.kind, case.name, case.truth));
        }
    }
    tally.report("placed without rounding");
}

/// All questions in all orders, on all backends; as listed in all profiles and both encodings without loss, in the
/// other orders in four of these, which take turns.
#[test]
fn hard_cases_are_answered_right() {
    let (mut tally, mut queriers) = (Tally::default(), queriers());
    let layouts: Vec<_> = Profile::ALL
        .into_iter()
        .flat_map(|profile| {
            [TriangleEncoding::F32, TriangleEncoding::Packed].map(|encoding| (profile, encoding))
        })
        .collect();
    for (number, case) in cases::all().into_iter().enumerate() {
        for (turn, order) in case.orders().into_iter().enumerate() {
            let Ok(pose) = Pose::from_rows(&order.pose) else { continue };
            let chosen =
                layouts.iter().enumerate().filter(|(k, _)| turn == 0 || (number + turn + k) % 5 == 0);
            for (_, &(profile, encoding)) in chosen {
                let [a, b] = [&order.a, &order.b].map(|triangles| file(triangles, profile, encoding));
                let surfaces = [&a, &b].map(|file| Surface::new(stored(file)));
                let truth = Truth::new(&surfaces[0], &surfaces[1], &pose);
                let mut asked = Asked { a: &a, b: &b, queriers: &mut queriers };
                if let Err(error) = asked.all(&truth, &pose, &mut tally) {
                    let (profile, encoding) = (profile.name(), encoding.name());
                    tally.wrong(format!("{}, {}, {profile}, {encoding}: {error}", case.name, order.name));
                }
            }
        }
        if tally.is_full() {
            break;
        }
    }
    tally.report("hard cases");
}
