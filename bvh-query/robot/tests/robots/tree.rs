//! Trees of robots: what they say is enough to place all shapes, in a second way, where the library has them.

use crate::kinematics::{ALL_KINDS, Matrix, product, read, shift, turn};
use crate::parts::changed;
use bvh_query::Pose;
use cbvh_robot::{Base, Edge, JointKind, Robot, TreeJoint};
use std::collections::BTreeSet;

fn matrix(pose: &Pose) -> Matrix {
    let ([a, b, c], [x, y, z]) = (pose.rotation(), pose.translation());
    [[a[0], a[1], a[2], x], [b[0], b[1], b[2], y], [c[0], c[1], c[2], z], [0.0, 0.0, 0.0, 1.0]]
}

/// Moves by a joint, by matrices of 4 x 4 numbers.
fn moved(joint: &TreeJoint, values: &[f64]) -> Matrix {
    let at = |k: usize| values[joint.value + k];
    let by = joint.factor * at(0) + joint.offset;
    match joint.kind {
        JointKind::Turn => turn(joint.axis, by),
        JointKind::Slide => shift(joint.axis.map(|x| by * x)),
        JointKind::Planar => product(&shift([at(0), at(1), 0.0]), &turn([0.0, 0.0, 1.0], at(2))),
        _ => {
            let vector = [at(3), at(4), at(5)];
            let long = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
            let turned = turn(vector.map(|x| x / long), 2.0 * long.atan2(at(6)));
            product(&shift([at(0), at(1), at(2)]), &turned)
        }
    }
}

fn near(found: &Pose, expected: &Matrix, what: &str) {
    let worst =
        matrix(found).into_iter().flatten().zip(expected.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(worst.fold(0.0, f64::max) < 1e-13, "{what}: {found:?} {expected:?}");
}

/// Compares the poses of all shapes with those that the tree gives, and with those of the links.
fn check(robot: &mut Robot, values: &[f64]) {
    let tree = robot.tree().unwrap();
    let mut frames = vec![shift([0.0; 3])];
    for joint in &tree.joints {
        let placed = product(&frames[joint.parent], &matrix(&joint.origin));
        frames.push(product(&placed, &moved(joint, values)));
    }
    let poses = robot.shape_poses(values).unwrap();
    assert_eq!(poses.len(), tree.shapes.len());
    for (shape, pose) in tree.shapes.iter().zip(&poses) {
        near(pose, &product(&frames[shape.frame], &matrix(&shape.origin)), &shape.body);
    }
    // Of each body, as its link places it.
    let links: Vec<String> = robot.links().map(str::to_owned).collect();
    let link_poses = robot.link_poses(values).unwrap();
    let mut count = 0;
    for (link, link_pose) in links.iter().zip(&link_poses) {
        let of_link = robot.shapes(robot.body(link).unwrap()).unwrap();
        let in_tree = tree.shapes.iter().zip(&poses).filter(|(shape, _)| shape.body == *link);
        for ((_, inside), (shape, pose)) in of_link.iter().zip(in_tree) {
            near(pose, &product(&matrix(link_pose), &matrix(inside)), link);
            assert!(!shape.is_obstacle);
            count += 1;
        }
    }
    assert!(tree.shapes[..count].iter().all(|shape| links.contains(&shape.body)));
}

#[test]
fn a_tree_places_all_shapes() {
    let block = r#"<collision><origin xyz="0.1 -0.2 0.3" rpy="1 0.2 -0.4"/><geometry><box size="1 2 3"/></geometry></collision>"#;
    let text = ["a", "b", "c", "d", "e", "f"].into_iter().fold(ALL_KINDS.to_owned(), |text, link| {
        text.replace(
            &format!(r#"<link name="{link}"/>"#),
            &format!(r#"<link name="{link}">{block}{block}</link>"#),
        )
    });
    let mut robot = read(&text, Base::Fixed);
    check(&mut robot, &[0.6, -0.7, 0.2, 0.3, 1.1, 4.0, 5.0, 6.0, 0.48, 0.36, 0.0, 0.8]);
    let tree = robot.tree().unwrap();
    assert_eq!(tree.shapes.len(), 12);
    let kinds: Vec<(&str, JointKind)> = tree.joints.iter().map(|joint| (&*joint.name, joint.kind)).collect();
    // Each after those that it hangs from.
    for (name, kind) in [
        ("turn", JointKind::Turn),
        ("slide", JointKind::Slide),
        ("follow", JointKind::Turn),
        ("plane", JointKind::Planar),
        ("free", JointKind::Floating),
    ] {
        assert!(kinds.contains(&(name, kind)), "{kinds:?}");
    }
    assert!(tree.joints.iter().enumerate().all(|(number, joint)| joint.parent <= number));
}

#[test]
fn a_tree_has_the_margins_and_the_pairs_of_a_robot() {
    let mut robot = changed();
    let values: Vec<f64> = (0..robot.joints().len()).map(|k| 0.1 + 0.2 * k as f64).collect();
    check(&mut robot, &values);
    let tree = robot.tree().unwrap();
    let of = |name: &str| tree.shapes.iter().find(|shape| shape.body == name).unwrap();
    assert!(of("shelf").is_obstacle && of("pillar").is_obstacle && !of("tool").is_obstacle);
    assert_eq!((of("hand").margin, of("tool").margin, of("pillar").margin), (0.01, 0.1 / 3.0, 0.0));
    // The margin is not in the radius.
    assert_eq!((of("hand").shape.shape().radius(), of("shelf").shape.shape().radius()), (0.0, 0.01));
    let names = |pairs: &[[usize; 2]]| -> BTreeSet<[String; 2]> {
        pairs.iter().map(|pair| pair.map(|shape| tree.shapes[shape].body.clone())).collect()
    };
    assert_eq!(names(&tree.pairs), robot.pairs().into_iter().collect());
    assert!(robot.shape_poses(&values[1..]).is_err());
}

#[test]
fn an_edge_has_its_ends() {
    let (from, to) = (vec![0.1, -3.0], vec![0.3, 1.0 / 3.0]);
    let [start, goal] = Edge::straight(&from, &to).unwrap().ends();
    assert_eq!(start, from);
    assert!(goal.iter().zip(&to).all(|(found, to)| (found - to).abs() < 1e-15), "{goal:?}");
    let edge = Edge::polynomials(vec![vec![1.0, 2.0, 3.0], vec![]]);
    assert_eq!(edge.ends(), [[1.0, 0.0], [6.0, 0.0]]);
}
