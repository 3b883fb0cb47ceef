//! Bodies inside others, solid ones, and margins of what is attached.

use crate::questions::{arm, at, block, cell, random_values};
use bvh_bake::{Options, mesh::Mesh, shapes, to_bytes};
use bvh_query::{Bvh, OwnedShape, Pose, Querier, QueryError, Relation};
use cbvh_robot::{Base, Robot, RobotError};
use cbvh_testkit::Random;

fn baked(mesh: &Mesh, options: &Options) -> OwnedShape {
    Bvh::from_bytes(to_bytes(mesh, options).unwrap().0).unwrap().into()
}

fn surface(sides: [f64; 3]) -> OwnedShape {
    baked(&shapes::block(sides).unwrap(), &Options::default())
}

/// A box without one of its triangles.
fn tent() -> OwnedShape {
    let mut mesh = shapes::block([2.0; 3]).unwrap();
    let triangles = mesh.objects.remove(0);
    let mesh = Mesh::from_triangles(triangles.positions, triangles.triangles[1..].to_vec());
    baked(&mesh, &Options::default())
}

/// Allows all pairs of links, so that questions are about other bodies.
fn without_own_pairs() -> Robot {
    let mut robot = arm(Base::Fixed);
    for [a, b] in robot.pairs() {
        robot.allow(&a, &b).unwrap();
    }
    robot
}

fn named(pairs: &[[&str; 2]]) -> Vec<[String; 2]> {
    pairs.iter().map(|pair| pair.map(str::to_owned)).collect()
}

#[test]
fn a_robot_inside_a_closed_surface_is_told_apart_from_a_free_one() {
    let q = [0.0; 4];
    let inside = named(&["base", "turret", "upper_arm", "forearm", "hand"].map(|link| [link, "room"]));
    let mut robot = without_own_pairs();
    robot.add_obstacle("room", surface([9.0; 3]), &Pose::IDENTITY).unwrap();
    assert!(!robot.collide(&q).unwrap() && robot.is_free(&q, &q).unwrap());
    assert_eq!(robot.pairs_inside(&q).unwrap(), inside);
    // A link that may touch the room is not asked about.
    robot.allow("base", "room").unwrap();
    assert_eq!(robot.pairs_inside(&q).unwrap(), inside[1..]);
    // A room that is full.
    robot.make_solid("room").unwrap();
    assert!(robot.collide(&q).unwrap() && !robot.is_free(&q, &q).unwrap());
    assert!(robot.pairs_inside(&q).unwrap().is_empty());
    // A margin does not undo that, and the room may be added as a solid.
    robot.set_margin("room", 0.5).unwrap();
    assert!(robot.collide(&q).unwrap() && robot.shapes(5).unwrap()[0].0.shape().is_solid());
    robot.remove("room").unwrap();
    robot.add_obstacle("room", block([9.0; 3]), &Pose::IDENTITY).unwrap();
    assert!(robot.collide(&q).unwrap() && robot.pairs_inside(&q).unwrap().is_empty());
}

#[test]
fn what_is_inside_a_link_is_found_as_well() {
    let q = [0.0; 4];
    let mut robot = without_own_pairs();
    let middle = robot.link_poses(&q).unwrap()[2].translation();
    let ball = baked(&shapes::point([0.0; 3]), &Options::default()).rounded(1e-3).unwrap();
    robot.add_obstacle("pea", ball, &at([middle[0], middle[1], middle[2] + 0.1])).unwrap();
    assert!(!robot.collide(&q).unwrap());
    assert_eq!(robot.pairs_inside(&q).unwrap(), named(&[["pea", "upper_arm"]]));
    robot.make_solid("upper_arm").unwrap();
    assert_eq!(robot.pairs_in_contact(&q).unwrap(), named(&[["upper_arm", "pea"]]));
    assert!(robot.pairs_inside(&q).unwrap().is_empty());
}

/// The relation of both meshes tells the same.
#[test]
fn pairs_inside_are_those_that_the_relation_of_meshes_tells() {
    let mut robot = cell(Base::Fixed);
    robot.remove("pillar").unwrap();
    for (name, sides, place) in [
        ("crate", [0.5, 0.6, 0.5], [0.4, 0.1, 0.6]),
        ("tank", [0.9, 0.3, 0.9], [-0.3, 0.3, 0.5]),
        ("nut", [0.004; 3], [0.2, 0.1, 0.5]),
    ] {
        robot.add_obstacle(name, surface(sides), &at(place)).unwrap();
    }
    // What is open holds nothing.
    robot.add_obstacle("tent", tent(), &Pose::IDENTITY).unwrap();
    let random = &mut Random::new(5);
    let (mut querier, mut rows, mut answers) = (Querier::new().unwrap(), Vec::new(), Vec::new());
    let links: Vec<String> = robot.links().map(str::to_owned).collect();
    for _ in 0..300 {
        let q = random_values(random, &robot);
        let poses = robot.link_poses(&q).unwrap();
        let place = |name: &str| {
            let (shape, pose) = robot.shapes(robot.body(name).unwrap()).unwrap().remove(0);
            let link = if name == "tool" { "hand" } else { name };
            let world = links.iter().position(|of| of == link).map_or(Pose::IDENTITY, |place| poses[place]);
            (shape, pose.then(&world).unwrap())
        };
        let mut expected = Vec::new();
        for [name_a, name_b] in robot.clone().pairs() {
            let [(a, of_a), (b, of_b)] = [place(&name_a), place(&name_b)];
            let relative = Pose::relative(&of_a, &of_b).unwrap();
            match querier.relation(&a, &b, &relative).unwrap() {
                Relation::BInA if !a.shape().is_solid() => expected.push([name_b, name_a]),
                Relation::AInB if !b.shape().is_solid() => expected.push([name_a, name_b]),
                other => assert!(other != Relation::Mixed),
            }
        }
        assert_eq!(robot.pairs_inside(&q).unwrap(), expected);
        answers.push(expected);
        rows.extend(q);
    }
    let count = answers.iter().filter(|pairs| !pairs.is_empty()).count();
    assert!((20..280).contains(&count), "{count}");
    for threads in [1, 3] {
        let found = cbvh_testkit::pool(threads).install(|| robot.pairs_inside_many(&rows)).unwrap();
        assert_eq!(found, answers);
    }
}

#[test]
fn a_body_without_an_inside_cannot_be_solid() {
    let mut robot = without_own_pairs();
    robot.add_obstacle("tent", tent(), &Pose::IDENTITY).unwrap();
    let error = robot.make_solid("tent").unwrap_err();
    assert!(
        matches!(error, RobotError::NotSolid { source: QueryError::NotClosed { object: 0, .. }, .. }),
        "{error}"
    );
    assert!(error.to_string().starts_with("tent: expected closed objects"), "{error}");
    assert!(matches!(robot.make_solid("nothing"), Err(RobotError::Unknown { .. })));
    robot.remove("tent").unwrap();
    // A file that does not tell, which matters as soon as a link may be inside.
    let bare = Options::default().topology(false);
    let block = baked(&shapes::block([9.0; 3]).unwrap(), &bare);
    robot.add_obstacle("room", block, &at([90.0, 0.0, 0.0])).unwrap();
    assert!(robot.pairs_inside(&[0.0; 4]).unwrap().is_empty());
    robot.set_pose("room", &Pose::IDENTITY).unwrap();
    let error = robot.pairs_inside(&[0.0; 4]).unwrap_err();
    assert!(matches!(error, RobotError::Pair { source: QueryError::NoTopology, .. }), "{error}");
    assert!(!robot.collide(&[0.0; 4]).unwrap());
}

/// A link's margin is not that of what is attached to it, which has one of its own.
#[test]
fn a_margin_is_that_of_one_body() {
    let q = [0.0; 4];
    let mut robot = without_own_pairs();
    robot.attach("tool", block([0.02, 0.02, 0.2]), "hand", &at([0.0, 0.0, 0.3]), &[]).unwrap();
    for link in ["base", "turret", "upper_arm", "forearm"] {
        robot.allow(link, "tool").unwrap();
    }
    let tip = robot.link_poses(&q).unwrap()[4].translation();
    robot.add_obstacle("lamp", block([0.1; 3]), &at([tip[0], tip[1], tip[2] + 0.55])).unwrap();
    let gap = |robot: &mut Robot| robot.distance(&q).unwrap().unwrap().nearest.distance;
    let bare = gap(&mut robot);
    assert!((bare - 0.1).abs() < 1e-6, "{bare}");
    robot.set_margin("hand", 0.05).unwrap();
    assert_eq!(gap(&mut robot), bare);
    robot.set_margin("tool", 0.05).unwrap();
    assert!((gap(&mut robot) - (bare - 0.05)).abs() < 1e-12);
    for margin in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(robot.set_margin("tool", margin), Err(RobotError::Query(_))));
    }
}
