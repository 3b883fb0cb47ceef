//! Proves every fact that the hard cases state, and compares every answer of the library with it.

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
use cbvh_testkit::Triangle;
use cbvh_testkit::depth::step;
use cbvh_testkit::hard_cases::{self as cases, Case, Ordered, Truth as Stated};
use dashu_int::IBig;
use std::collections::BTreeSet;

/// The largest error of a distance, as a fraction of the stated one, if corners are placed without rounding. It is a
/// thousandth of the error that the report accepts.
const SAME: f64 = 1e-9;

fn file(triangles: &[Triangle], profile: Profile, encoding: TriangleEncoding) -> Bvh {
    bake(&mesh(triangles), &options(profile, encoding))
}

/// Returns the number of contacts and the exact distance.
fn truth(surfaces: &[Surface; 2], pose: &Pose, tally: &mut Tally) -> (u64, Length) {
    let truth = Truth::new(&surfaces[0], &surfaces[1], pose);
    let any = Length::between(&surfaces[0].corners[0], &surfaces[1].corners[0].map(|p| pose.place(p)));
    (truth.contacts(tally).len() as u64, truth.distance((any, 0.0), tally).0)
}

/// Compares the truth of the placed meshes with the stated facts.
fn check(case: &Case, order: &Ordered, tally: &mut Tally) -> Result<(), String> {
    let pose = match (Pose::from_rows(&order.pose), case.truth) {
        (Err(error), Stated::Refused { words }) if error.to_string().contains(words) => return Ok(()),
        (Ok(pose), Stated::Touching { .. } | Stated::Apart(_)) => pose,
        (pose, stated) => return Err(format!("the pose is {pose:?}, stated is {stated:?}")),
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

/// Both meshes as integers in units of 2^`grid`, with B placed without rounding.
struct Real {
    a: Vec<Corners<IBig>>,
    b: Vec<Corners<IBig>>,
    grid: i32,
}

impl Real {
    fn new(case: &Case) -> Self {
        let numbers = case.a.iter().chain(&case.b).flatten().flatten().chain(&case.pose).copied();
        let unit = grid(numbers).min(0);
        // A product of two is in units of 2^(2 unit), and so are all other numbers here.
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

    /// Compares a squared length in these units with the square of a number that is not negative.
    fn compare(&self, square: &Fraction<IBig>, x: f64) -> std::cmp::Ordering {
        let (mantissa, exponent) = parts(x);
        if mantissa == 0 {
            return square.0.cmp(&IBig::ZERO);
        }
        let of_x = IBig::from(mantissa) * IBig::from(mantissa) * &square.1;
        compare(square.0.clone(), 2 * self.grid, of_x, 2 * exponent)
    }
}

/// Checks that the facts also hold for other ways of placing corners than this library's.
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

/// Asks every query in every order, on all backends. The layouts, which are the profiles with both lossless
/// encodings, take turns. An everyday run asks each case as listed in two layouts, and in each other order in one. At
/// depth 10, it is all layouts as listed, and four in each other order.
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
            let share = if turn == 0 { step(10) } else { step(20).max(5) };
            let chosen = layouts.iter().enumerate().filter(|(k, _)| (number + turn + k) % share == 0);
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
