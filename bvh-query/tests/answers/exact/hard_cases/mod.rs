//! Proves every fact that the hard cases state, and compares every answer of the library with it.
//!
//! A file holds every coordinate of every case without rounding. Most cases are pairs of the public suite; only those that it
//! cannot hold are here.

mod case;
mod order;
mod refused;
mod rounded;
mod shapes;
mod suite;

use super::ask::Asked;
use crate::common::tally::Tally;
use crate::common::truth::{Surface, Truth};
use crate::common::{bake, mesh, options, queriers, stored};
use bvh_format::leaf::TriangleEncoding;
use bvh_format::profile::Profile;
use bvh_query::{Bvh, Pose};
use case::{Case, Truth as Stated};
use cbvh_testkit::Triangle;
use cbvh_testkit::depth::step;
use cbvh_testkit::exact::{Corners, Dyadic, Length, Number, dot, meet};
use order::Ordered;
use std::collections::BTreeSet;

/// The largest error of a distance, as a fraction of the stated one, if corners are placed without rounding. It is a
/// thousandth of the error that the report accepts.
const SAME: f64 = 1e-9;

fn cases() -> Vec<Case> {
    [suite::cases(), rounded::cases(), refused::cases()].concat()
}

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
        (Ok(pose), Stated::Touching { .. } | Stated::Apart { .. }) => pose,
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
        Stated::Apart { lower, upper }
            if contacts == 0
                && length.compare(lower).is_ge()
                && (length.compare(upper).is_lt() || length.compare(lower).is_eq()) =>
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
    for case in cases() {
        assert!(names.insert(case.name.clone()), "{} twice", case.name);
        for order in case.orders() {
            if let Err(error) = check(&case, &order, &mut tally) {
                tally.wrong(format!("{}, {}: {error}", case.name, order.name));
            }
        }
    }
    tally.report("stated facts");
}

/// Places a triangle without rounding.
fn place(case: &Case, t: &Triangle) -> Corners<Dyadic> {
    let entry = |at: usize| Dyadic::of(case.pose[at]);
    let rows = [0, 4, 8].map(|at| ([0, 1, 2].map(|j| entry(at + j)), entry(at + 3)));
    t.map(|p| rows.each_ref().map(|(row, shift)| dot(row, &p.map(Dyadic::of)).plus(shift)))
}

/// Checks that the facts also hold for other ways of placing corners than this library's.
#[test]
fn facts_hold_however_corners_are_placed() {
    let mut tally = Tally::default();
    for case in cases() {
        let Ok(pose) = Pose::from_rows(&case.pose) else { continue };
        let exactly = |t: &Triangle| t.map(|p| p.map(Dyadic::of));
        let a: Vec<_> = case.a.iter().map(exactly).collect();
        let b: Vec<_> = case.b.iter().map(|t| place(&case, t)).collect();
        if case.b.iter().map(|t| exactly(&t.map(|p| pose.place(p)))).eq(b.iter().cloned()) {
            continue;
        }
        tally.poses += 1;
        let pairs = || a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
        let contacts = pairs().filter(|(a, b)| meet(a, b).unwrap()).count() as u64;
        let lengths = pairs().map(|(a, b)| Length::of(a, b));
        let least = lengths.reduce(|one, other| if other.is_less(&one) { other } else { one }).unwrap();
        let right = match case.truth {
            Stated::Touching { contacts: stated } => contacts == stated,
            Stated::Apart { lower, upper } => {
                let (low, high) = (lower * (1.0 - SAME), upper * (1.0 + SAME));
                contacts == 0 && least.compare(low).is_ge() && least.compare(high).is_le()
            }
            Stated::Refused { .. } => false,
        };
        if !right {
            tally.wrong(format!("{}: {contacts} contacts, stated {:?}", case.name, case.truth));
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
    for (number, case) in cases().into_iter().enumerate() {
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
