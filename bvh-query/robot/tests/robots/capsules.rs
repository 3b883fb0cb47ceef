//! Capsules that a URDF spells as a cylinder and two spheres.

use bvh_query::{Bvh, OwnedShape, Pose, Querier};
use cbvh_robot::{Robot, RobotOptions};
use cbvh_testkit::Random;

/// A collision element: a shape, its place, and its angles.
type Element = (String, [f64; 3], [f64; 3]);

fn text_of(elements: &[Element]) -> String {
    let collision = |(shape, at, turned): &Element| {
        let [at, turned] = [at, turned].map(|of| format!("{} {} {}", of[0], of[1], of[2]));
        format!("<collision><origin xyz=\"{at}\" rpy=\"{turned}\"/><geometry>{shape}</geometry></collision>")
    };
    let elements: String = elements.iter().map(collision).collect();
    format!("<robot name=\"one\"><link name=\"link\">{elements}</link></robot>")
}

fn robot(elements: &[Element]) -> Robot {
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, text_of(elements)).unwrap();
    Robot::from_urdf(path, &RobotOptions::default()).unwrap()
}

/// Returns the shapes of the link: the triangles of each, its radius, and its pose.
fn shapes(elements: &[Element]) -> Vec<(u64, f64, Pose)> {
    let shapes = robot(elements).shapes(0).unwrap();
    shapes.iter().map(|(shape, pose)| (shape.shape().triangles(), shape.shape().radius(), *pose)).collect()
}

fn sphere(radius: f64, at: [f64; 3]) -> Element {
    (format!("<sphere radius=\"{radius}\"/>"), at, [0.0; 3])
}

fn cylinder(radius: f64, length: f64, at: [f64; 3], turned: [f64; 3]) -> Element {
    (format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>"), at, turned)
}

fn block() -> Element {
    ("<box size=\"0.1 0.2 0.3\"/>".to_owned(), [1.0, 0.0, 0.0], [0.0; 3])
}

/// A cylinder along y with spheres at its ends, as a file has them.
fn spelled() -> Vec<Element> {
    let turned = [std::f64::consts::FRAC_PI_2, 0.0, 0.0];
    vec![
        sphere(0.05, [0.1, 0.5, 0.3]),
        block(),
        cylinder(0.05, 0.6, [0.1, 0.2, 0.3], turned),
        sphere(0.05, [0.1, -0.1, 0.3]),
    ]
}

#[test]
fn a_cylinder_and_spheres_at_its_ends_are_a_capsule() {
    let found = shapes(&spelled());
    // The block, and the capsule where the cylinder was.
    assert_eq!(found.iter().map(|shape| (shape.0, shape.1)).collect::<Vec<_>>(), [(12, 0.0), (1, 0.05)]);
    let capsule = ("<capsule radius=\"0.05\" length=\"0.6\"/>".to_owned(), [0.1, 0.2, 0.3], spelled()[2].2);
    assert_eq!(found[1], shapes(&[capsule])[0]);
}

#[test]
fn near_misses_stay_as_they_are() {
    for change in 0..6 {
        let mut elements = spelled();
        match change {
            0 => elements[0] = sphere(0.0502, [0.1, 0.5, 0.3]),
            1 => elements[0] = sphere(0.0498, [0.1, 0.5, 0.3]),
            2 => elements[0].1[0] += 1e-3,
            3 => elements[3].1[1] -= 1e-3,
            4 => elements[2].1[2] += 1e-3,
            _ => elements[3].1 = elements[0].1,
        }
        let found = shapes(&elements);
        assert_eq!(found.len(), 4, "{change}");
        assert!(found[2].0 > 100, "{change}");
    }
    // One sphere alone.
    assert_eq!(shapes(&spelled()[..3]).len(), 3);
    // Those of another link.
    let [one, other] = [&spelled()[..3], &spelled()[3..]].map(text_of);
    let other = other.replace("name=\"link\"", "name=\"other\"");
    let inner = |text: &str| text[text.find("<link").unwrap()..text.find("</robot>").unwrap()].to_owned();
    let joint = "<joint name=\"j\" type=\"fixed\"><parent link=\"link\"/><child link=\"other\"/></joint>";
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("robot.urdf");
    std::fs::write(&path, format!("<robot name=\"two\">{}{}{joint}</robot>", inner(&one), inner(&other)))
        .unwrap();
    let two = Robot::from_urdf(path, &RobotOptions::default()).unwrap();
    assert_eq!([0, 1].map(|link| two.shapes(link).unwrap().len()), [3, 1]);
}

/// Several capsules may end in one sphere.
#[test]
fn a_chain_of_capsules_shares_its_spheres() {
    let at = |x: f64| [x, 0.0, 0.0];
    let turned = [0.0, std::f64::consts::FRAC_PI_2, 0.0];
    let mut elements: Vec<Element> = (0..4).map(|k| sphere(0.1, at(f64::from(k)))).collect();
    elements.extend((0..3).map(|k| cylinder(0.1, 1.0, at(0.5 + f64::from(k)), turned)));
    assert!(shapes(&elements).iter().map(|shape| shape.1).eq([0.1; 3]));
    // Without the last sphere, the last cylinder stays.
    elements.remove(3);
    assert_eq!(shapes(&elements).iter().map(|shape| shape.1).collect::<Vec<_>>(), [0.1, 0.1, 0.0]);
}

/// Numbers with few digits. The capsule contains all that the elements do, and is not much wider.
#[test]
fn rounded_numbers_make_a_capsule_that_contains_the_three() {
    let random = &mut Random::new(17);
    let point = |at: [f64; 3]| -> OwnedShape {
        let mesh = bvh_bake::shapes::point(at);
        let bytes = bvh_bake::to_bytes(&mesh, &bvh_bake::Options::default()).unwrap().0;
        Bvh::from_bytes(bytes).unwrap().into()
    };
    let (mut querier, mut wider) = (Querier::new().unwrap(), 0);
    for round_number in 0..60 {
        let (radius, length) = (0.05 + 0.05 * random.unit(), 0.1 + 0.5 * random.unit());
        let round = |x: f64| (x * 1e5).round() / 1e5;
        let [at, turned] = [random.point(), random.point()].map(|of| of.map(round));
        let along = |height: f64, turned: [f64; 3]| {
            let [(sr, cr), (sp, cp), (sy, cy)] = turned.map(f64::sin_cos);
            let axis = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr];
            [0, 1, 2].map(|k| at[k] + height * axis[k])
        };
        let frame = |height: f64| along(height, turned);
        let (radius, length) = (round(radius), round(length));
        let ends = [-length / 2.0, length / 2.0].map(|height| frame(height).map(round));
        // Angles have fewer digits than lengths in every other file.
        let written = if round_number % 2 == 0 { turned } else { turned.map(|x| x + 4e-4 * random.signed()) };
        let elements =
            [cylinder(radius, length, at, written), sphere(radius, ends[0]), sphere(radius, ends[1])];
        let found = robot(&elements).shapes(0).unwrap();
        let [(capsule, pose)] = found.as_slice() else { panic!("{found:?}") };
        let around = capsule.shape().radius();
        let most = radius + 1e-3 * (radius + length / 2.0);
        assert!((radius..=most).contains(&around), "{around} {radius}");
        wider += usize::from(around > radius);
        // Points of the spheres and of the cylinder are in the capsule.
        let (inverse, inward) = (pose.inverse().unwrap(), radius * (1.0 - 1e-12));
        let frame = |height: f64| along(height, written);
        let axis = [0, 1, 2].map(|k| frame(1.0)[k] - at[k]);
        for _ in 0..50 {
            let direction = random.point();
            let along: f64 = (0..3).map(|k| direction[k] * axis[k]).sum();
            let across = [0, 1, 2].map(|k| direction[k] - along * axis[k]);
            let (end, middle) = (ends[random.below(2)], frame(length / 2.0 * random.signed().signum()));
            for (from, way) in [(end, direction), (middle, across)] {
                let long = way.iter().map(|x| x * x).sum::<f64>().sqrt();
                let at = [0, 1, 2].map(|k| from[k] + inward * way[k] / long);
                assert!(querier.collide(capsule, &point(inverse.place(at)), &Pose::IDENTITY).unwrap());
            }
        }
    }
    assert!(wider > 40, "{wider}");
}

#[test]
fn a_robot_with_capsules_is_stored_and_made_again() {
    let one = robot(&spelled());
    let other = Robot::from_parts(one.to_parts()).unwrap();
    assert_eq!(one.to_parts().links.len(), 2);
    let [one, other] = [one, other].map(|robot| format!("{:?}", robot.shapes(0).unwrap().len()));
    assert_eq!(one, other);
}
