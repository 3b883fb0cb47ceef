//! Answers about robots against the same questions to a scene, pair by pair, and against many samples of motions.

use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Backend, Bvh, MotionOptions, OwnedShape, PenetrationOptions, Pose, Querier};
use cbvh_robot::{Base, Edge, Robot, RobotMotion, RobotOptions};
use cbvh_testkit::Random;
use std::path::Path;

pub(crate) fn arm(base: Base) -> Robot {
    let mut robot = arm_with_all_pairs(base);
    for (a, b) in [("base", "turret"), ("turret", "upper_arm"), ("upper_arm", "forearm"), ("forearm", "hand")]
    {
        robot.allow(a, b).unwrap();
    }
    robot
}

fn arm_with_all_pairs(base: Base) -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/robot/robot.urdf");
    Robot::from_urdf(path, &RobotOptions::default().base(base)).unwrap()
}

pub(crate) fn block(sides: [f64; 3]) -> OwnedShape {
    let (bytes, _) = to_bytes(&shapes::block(sides).unwrap(), &Options::default()).unwrap();
    OwnedShape::from(Bvh::from_bytes(bytes).unwrap()).solid().unwrap()
}

pub(crate) fn at(translation: [f64; 3]) -> Pose {
    Pose::new(*Pose::IDENTITY.rotation(), translation).unwrap()
}

/// The arm among obstacles, with something in its hand.
pub(crate) fn cell(base: Base) -> Robot {
    let mut robot = arm(base);
    robot.add_obstacle("pillar", block([0.1, 0.1, 1.5]), &at([0.45, 0.0, 0.75])).unwrap();
    robot.add_obstacle("shelf", block([0.4, 1.0, 0.02]), &at([-0.5, 0.0, 0.9])).unwrap();
    robot.attach("tool", block([0.02, 0.02, 0.2]), "hand", &at([0.0, 0.0, 0.2]), &["forearm"]).unwrap();
    robot
}

pub(crate) fn random_values(random: &mut Random, robot: &Robot) -> Vec<f64> {
    let value = |[lower, upper]: &[f64; 2]| match lower.is_finite() {
        true => lower + (upper - lower) * random.unit(),
        false => 0.3 * random.signed(),
    };
    robot.limits().iter().map(value).collect()
}

#[test]
fn the_pairs_in_contact_are_those_of_all_shapes_where_the_links_are() {
    let mut robot = cell(Base::Fixed);
    let random = &mut Random::new(1);
    let mut querier = Querier::new().unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../testdata/robot");
    // The shapes of the file, by hand.
    let mesh = |name: &str, scale: [f64; 3]| -> OwnedShape {
        let mut mesh = bvh_bake::input::read(&folder.join(name)).unwrap();
        let object = &mut mesh.objects[0];
        object.positions.iter_mut().for_each(|p| *p = [0, 1, 2].map(|k| p[k] * scale[k]));
        Bvh::from_bytes(to_bytes(&mesh, &Options::default()).unwrap().0).unwrap().into()
    };
    let up = Pose::from_quaternion([0.0, 0.5f64.sqrt(), 0.0, 0.5f64.sqrt()], [0.0, 0.0, 0.07]).unwrap();
    let bodies = [
        ("base", "base", mesh("base.obj", [1.0; 3]), Pose::IDENTITY),
        ("turret", "turret", mesh("link.obj", [0.5, 0.5, 0.3]), up),
        ("upper_arm", "upper_arm", mesh("link.obj", [1.0; 3]), Pose::IDENTITY),
        ("forearm", "forearm", mesh("link.obj", [0.8; 3]), Pose::IDENTITY),
        ("hand", "hand", mesh("hand.obj", [0.001; 3]), Pose::IDENTITY),
        ("pillar", "", block([0.1, 0.1, 1.5]), at([0.45, 0.0, 0.75])),
        ("shelf", "", block([0.4, 1.0, 0.02]), at([-0.5, 0.0, 0.9])),
        ("tool", "hand", block([0.02, 0.02, 0.2]), at([0.0, 0.0, 0.2])),
    ];
    let links: Vec<String> = robot.links().map(str::to_owned).collect();
    let pairs = robot.pairs();
    assert_eq!(pairs.len(), 6 + 10 + 3 + 2);
    let (mut rows, mut hits) = (Vec::new(), 0);
    let (mut answers, mut all_signed, options) = (Vec::new(), Vec::new(), PenetrationOptions::new());
    for _ in 0..200 {
        let q = random_values(random, &robot);
        let poses = robot.link_poses(&q).unwrap();
        let place = |name: &str| {
            let (_, link, shape, pose) = bodies.iter().find(|body| body.0 == name).unwrap();
            let world = links.iter().position(|of| of == link).map_or(Pose::IDENTITY, |place| poses[place]);
            (shape.clone(), pose.then(&world).unwrap())
        };
        let (mut expected, mut least, mut deepest) = (Vec::new(), f64::INFINITY, f64::INFINITY);
        for pair in &pairs {
            let [(a, of_a), (b, of_b)] = [place(&pair[0]), place(&pair[1])];
            let pose = Pose::relative(&of_a, &of_b).unwrap();
            if querier.collide(&a, &b, &pose).unwrap() {
                expected.push(pair.clone());
            }
            least = least.min(querier.distance(&a, &b, &pose).unwrap().distance);
            deepest = deepest.min(querier.signed_distance(&a, &b, &pose, &options).unwrap().lower);
        }
        hits += usize::from(!expected.is_empty());
        assert_eq!(robot.pairs_in_contact(&q).unwrap(), expected);
        assert_eq!(robot.collide(&q).unwrap(), !expected.is_empty());
        let nearest = robot.distance(&q).unwrap().unwrap();
        assert!((nearest.nearest.distance - least).abs() < 1e-12);
        let way: f64 = (0..3).map(|k| (nearest.points[0][k] - nearest.points[1][k]).powi(2)).sum();
        assert!((way.sqrt() - least).abs() < 1e-9);
        let signed = robot.signed_distance(&q, &options).unwrap().unwrap();
        assert!((signed.nearest.lower - deepest).abs() < 1e-9, "{signed:?}, {deepest}");
        let along =
            |k: usize| signed.nearest.normal[k] * (signed.nearest.point_b[k] - signed.nearest.point_a[k]);
        assert!(((0..3).map(along).sum::<f64>() - deepest).abs() < 1e-9 + 0.02 * deepest.abs(), "{signed:?}");
        all_signed.push(Some(signed));
        answers.push((expected, nearest));
        rows.extend(q);
    }
    assert!((20..180).contains(&hits), "{hits}");
    // Many at once, on any number of threads.
    for threads in [1, 3] {
        let pool = cbvh_testkit::pool(threads);
        let touching = pool.install(|| robot.pairs_in_contact_many(&rows)).unwrap();
        assert!(touching.iter().eq(answers.iter().map(|(expected, _)| expected)));
        let nearest = pool.install(|| robot.distance_many(&rows)).unwrap();
        assert!(nearest.iter().flatten().eq(answers.iter().map(|(_, nearest)| nearest)));
        assert_eq!(pool.install(|| robot.signed_distance_many(&rows, &options)).unwrap(), all_signed);
        let colliding = pool.install(|| robot.collide_many(&rows)).unwrap();
        assert!(
            colliding.iter().eq(answers
                .iter()
                .map(|(expected, _)| !expected.is_empty())
                .collect::<Vec<_>>()
                .iter())
        );
    }
}

/// Returns the joint values at a time of a straight motion. A floating base turns at a constant rate, the shorter way.
fn between(base: Base, from: &[f64], to: &[f64], t: f64) -> Vec<f64> {
    let mut q: Vec<f64> = from.iter().zip(to).map(|(from, to)| from + t * (to - from)).collect();
    if base == Base::Floating {
        let unit = |of: &[f64]| {
            let length = of[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
            [3, 4, 5, 6].map(|k| of[k] / length)
        };
        let (from, to) = (unit(from), unit(to));
        let cosine = from.iter().zip(to).map(|(x, y)| x * y).sum::<f64>();
        let angle = cosine.abs().min(1.0).acos();
        let [of_from, of_to] = [(1.0 - t) * angle, t * angle].map(|share| share.sin() / angle.sin());
        q[3..7].copy_from_slice(&[0, 1, 2, 3].map(|k| of_from * from[k] + cosine.signum() * of_to * to[k]));
    }
    q
}

/// No sample of a free motion touches, and every hit is one.
#[test]
fn free_motions_are_free_at_all_samples() {
    for (base, seed) in [(Base::Fixed, 2), (Base::Planar, 3), (Base::Floating, 4)] {
        let mut robot = cell(base);
        let random = &mut Random::new(seed);
        let (mut free, mut hit, mut samples) = (0, 0, 0);
        for _ in 0..40 {
            let [mut from, mut to] = [(); 2].map(|()| random_values(random, &robot));
            if base == Base::Floating {
                from[3..7].copy_from_slice(&random.quaternion());
                to[3..7].copy_from_slice(&random.quaternion());
            }
            // Short ones as well.
            let share = if hit > free { 0.1 } else { 1.0 };
            to = from.iter().zip(&to).map(|(from, to)| from + share * (to - from)).collect();
            let edge = Edge::straight(&from, &to).unwrap();
            let is_free = robot.is_free(&from, &to).unwrap();
            for step in 0..if is_free { 500 } else { 0 } {
                let q = between(base, &from, &to, f64::from(step) / 500.0);
                assert!(!robot.collide(&q).unwrap(), "{base:?}: {q:?}");
                samples += 1;
            }
            match robot.motion(&edge, &MotionOptions::new()).unwrap() {
                RobotMotion::Free => assert!(is_free),
                RobotMotion::Hit { free_until, touching_at, joints, bodies, nearest, points } => {
                    assert!(!is_free && free_until <= touching_at);
                    assert!(robot.pairs_in_contact(&joints).unwrap().contains(&bodies));
                    let way: f64 = (0..3).map(|k| (points[0][k] - points[1][k]).powi(2)).sum();
                    assert!((way.sqrt() - nearest.distance).abs() < 1e-9);
                    for step in 0..if free_until > 0.0 { 50 } else { 0 } {
                        let q = between(base, &from, &to, free_until * f64::from(step) / 50.0);
                        assert!(!robot.collide(&q).unwrap(), "{base:?}: {q:?}");
                        samples += 1;
                    }
                }
                other => panic!("{other:?}"),
            }
            (free, hit) = (free + u32::from(is_free), hit + u32::from(!is_free));
        }
        assert!(
            free >= 8 && hit >= 8 && samples >= 4000,
            "{base:?}: {free} free, {hit} hit, {samples} samples"
        );
    }
}

/// A thin plate that only touches between samples: a discrete check misses it, a certain one does not.
#[test]
fn what_is_between_samples_is_found() {
    let mut robot = arm(Base::Fixed);
    robot.add_obstacle("sheet", block([0.6, 1e-6, 0.6]), &at([0.3, 0.00213, 0.8])).unwrap();
    let (from, to) = ([-0.5, 1.2, 0.0, 0.0], [0.5, 1.2, 0.0, 0.0]);
    assert!(!robot.is_free(&from, &to).unwrap());
    let found = robot.first_hit([&from[..], &to[..], &from[..]], &MotionOptions::new()).unwrap();
    assert!(matches!(found, Some((0, RobotMotion::Hit { ref bodies, .. })) if bodies[1] == "sheet"));
    robot.remove("sheet").unwrap();
    assert!(robot.is_free(&from, &to).unwrap());
    assert_eq!(robot.first_hit([&from[..], &to[..], &from[..]], &MotionOptions::new()).unwrap(), None);
}

/// Base and turret slide along each other less than the tolerance apart, so that each of their moments is undecided. None of them
/// matters, since turret and upper arm touch from the start.
#[test]
fn a_hit_at_the_start_ends_the_search() {
    let mut robot = arm_with_all_pairs(Base::Fixed);
    let edge = Edge::straight(&[0.0; 4], &[3.0, 2.0, 2.5, 1.0]).unwrap();
    let found = robot.motion(&edge, &MotionOptions::new()).unwrap();
    let RobotMotion::Hit { free_until, touching_at, bodies, .. } = found else { panic!("{found:?}") };
    assert_eq!((free_until, touching_at, bodies), (0.0, 0.0, ["turret", "upper_arm"].map(str::to_string)));
}

/// Binomials of a thousand are beyond all numbers of `f64`, and no bound may be lost with them.
#[test]
fn a_polynomial_of_many_coefficients_is_as_certain() {
    let mut robot = arm(Base::Fixed);
    robot.add_obstacle("pillar", block([0.1, 0.1, 1.5]), &at([0.45, 0.0, 0.75])).unwrap();
    for count in [2, 32, 33, 1100] {
        // The waist turns past the pillar, the later and the faster the more coefficients there are.
        let mut waist = vec![0.0; count];
        (waist[0], waist[count - 1]) = (-1.0, 2.0);
        let edge = Edge::polynomials(vec![waist, vec![1.2], vec![0.0], vec![0.0]]);
        assert!(!robot.is_edge_free(&edge, &MotionOptions::new()).unwrap(), "{count}");
        let found = robot.motions(&[edge], &MotionOptions::new()).unwrap();
        assert!(matches!(found[0], RobotMotion::Hit { .. }), "{count}: {found:?}");
    }
}

#[test]
fn a_radius_makes_up_for_no_negative_margin() {
    let mut robot = arm(Base::Fixed);
    robot.add_obstacle("ball", block([0.1; 3]).rounded(0.5).unwrap(), &at([2.0, 0.0, 0.0])).unwrap();
    assert!(robot.set_margin("ball", -0.25).is_err());
    robot.set_margin("ball", 0.25).unwrap();
}

#[test]
fn bodies_keep_their_numbers() {
    let mut robot = arm(Base::Fixed);
    let links: Vec<String> = robot.links().map(str::to_owned).collect();
    assert!(links.len() > 4 && links.iter().enumerate().all(|(k, link)| robot.body(link).unwrap() == k));
    robot.add_obstacle("one", block([0.1; 3]), &at([2.0, 0.0, 0.0])).unwrap();
    let one = robot.body("one").unwrap();
    assert_eq!(robot.body_name(one), Some("one"));
    robot.attach("two", block([0.1; 3]), "hand", &at([0.0, 0.0, 0.5]), &[]).unwrap();
    robot.set_margin("two", 0.25).unwrap();
    for (name, place, radius) in [("one", [2.0, 0.0, 0.0], 0.0), ("two", [0.0, 0.0, 0.5], 0.25)] {
        let shapes = robot.shapes(robot.body(name).unwrap()).unwrap();
        assert_eq!((shapes.len(), shapes[0].0.shape().radius(), shapes[0].1), (1, radius, at(place)));
    }
    assert_eq!(robot.shapes(1).unwrap()[0].1.translation(), [0.0, 0.0, 0.07]);
    assert!(robot.shapes(99).unwrap().is_empty());
    robot.remove("one").unwrap();
    robot.add_obstacle("one", block([0.1; 3]), &at([2.0, 0.0, 0.0])).unwrap();
    assert!(robot.body("one").unwrap() != one && robot.body_name(one).is_none());
    assert_eq!(robot.body_name(99), None);
}

#[test]
fn margins_allowances_and_changes_count() {
    let mut robot = arm(Base::Fixed);
    let still = [0.0; 4];
    for [a, b] in robot.pairs() {
        robot.allow(&a, &b).unwrap();
    }
    assert_eq!(robot.distance(&still).unwrap(), None);
    robot.add_obstacle("wall", block([0.1, 1.0, 2.0]), &at([0.3, 0.0, 1.0])).unwrap();
    let near = robot.distance(&still).unwrap().unwrap();
    assert!(near.bodies[1] == "wall" && near.nearest.distance > 0.0);
    robot.set_margin("wall", near.nearest.distance * 0.999).unwrap();
    assert!(!robot.collide(&still).unwrap());
    robot.set_margin("wall", near.nearest.distance * 1.001).unwrap();
    assert!(robot.collide(&still).unwrap());
    let touching = robot.pairs_in_contact(&still).unwrap();
    for [a, b] in &touching {
        robot.allow(a, b).unwrap();
    }
    assert!(!robot.collide(&still).unwrap());
    let before = robot.clone();
    robot.set_margin("wall", 0.0).unwrap();
    robot.set_pose("wall", &at([0.05, 0.0, 1.0])).unwrap();
    assert!(robot.collide(&still).unwrap() && !before.clone().collide(&still).unwrap());
    robot.remove("wall").unwrap();
    assert!(!robot.collide(&still).unwrap());
}

#[test]
fn pairs_that_touch_often_are_allowed() {
    let mut robot = arm_with_all_pairs(Base::Fixed);
    let before = robot.pairs();
    let frequent = robot.allow_frequent(50, 0.5).unwrap();
    let allowed: Vec<_> = frequent.iter().map(|(pair, _)| pair.clone()).collect();
    // They touch in every configuration.
    assert!(allowed.contains(&["turret", "upper_arm"].map(str::to_owned)), "{frequent:?}");
    assert!(frequent.iter().all(|(_, share)| (0.5..=1.0).contains(share)), "{frequent:?}");
    // The others are still asked about.
    let rest = before.into_iter().filter(|pair| !allowed.contains(pair));
    assert!(robot.pairs().into_iter().eq(rest) && !robot.pairs().is_empty());
    assert_eq!(robot.allow_frequent(50, 0.5).unwrap(), []);
}

#[test]
fn answers_do_not_depend_on_the_backend() {
    let mut robot = cell(Base::Fixed);
    let mut other = robot.clone();
    other.set_backend(Backend::Scalar);
    assert_eq!([other.backend(), other.clone().backend()], [Backend::Scalar; 2]);
    assert_eq!(robot.backend(), Backend::detect().unwrap());
    let random = &mut Random::new(83);
    for _ in 0..50 {
        let joints = random_values(random, &robot);
        assert_eq!(robot.distance(&joints).unwrap(), other.distance(&joints).unwrap());
        assert_eq!(robot.collide(&joints).unwrap(), other.collide(&joints).unwrap());
        let edge = Edge::straight(&joints, &random_values(random, &robot)).unwrap();
        let options = MotionOptions::new().tolerance(1e-3);
        assert_eq!(robot.motion(&edge, &options).unwrap(), other.motion(&edge, &options).unwrap());
    }
}

/// Of bodies of several shapes, those that touch come in the order of all pairs as well, each once.
#[test]
fn pairs_in_contact_are_in_the_order_of_pairs() {
    let link = |name: &str, places: &[f64]| {
        let shape = "<geometry><sphere radius=\"0.4\"/></geometry>";
        let element = |x: &f64| format!("<collision><origin xyz=\"{x} 0 0\"/>{shape}</collision>");
        let elements: String = places.iter().map(element).collect();
        format!("<link name=\"{name}\">{elements}</link>")
    };
    let joint = |name: &str| {
        format!(
            "<joint name=\"to {name}\" type=\"prismatic\"><parent link=\"a\"/><child link=\"{name}\"/>\
             <axis xyz=\"0 1 0\"/></joint>"
        )
    };
    let links =
        [link("a", &[0.0, 2.0]), link("b", &[2.0, 2.1]), link("c", &[0.1, 2.2]), joint("b"), joint("c")];
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, format!("<robot name=\"one\">{}</robot>", links.concat())).unwrap();
    let mut robot = Robot::from_urdf(path, &RobotOptions::default()).unwrap();
    let all = [["a", "b"], ["a", "c"], ["b", "c"]].map(|pair| pair.map(str::to_owned));
    assert_eq!(robot.pairs(), all);
    // The first sphere of A touches C alone, and the second one B and C.
    assert_eq!(robot.pairs_in_contact(&[0.0, 0.0]).unwrap(), all);
    assert_eq!(robot.pairs_in_contact(&[0.0, 1.0]).unwrap(), all[..1]);
    assert_eq!(robot.pairs_in_contact(&[1.0, 0.0]).unwrap(), all[1..2]);
}
