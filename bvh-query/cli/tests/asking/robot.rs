//! Tests `cbvh robot` on two boxes whose contact, distance and first hits follow from arithmetic, and that bad inputs are named.

use crate::common::{Ended, Files as _, Place, backends, cbvh_in, cbvh_with_isa, cube, names, place};
use crate::view::page;
use serde_json::{Value, json};
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// An arm that turns about z, from 1 to 2 from the axis and 0.25 thick; and a cart, a cube of side 0.5 that slides along x.
const URDF: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="arm"><collision><origin xyz="1.5 0 0"/><geometry><box size="1 0.25 0.25"/></geometry></collision></link>
  <link name="cart"><collision><geometry><box size="0.5 0.5 0.5"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/></joint>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="1" velocity="1"/></joint>
</robot>"#;

const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// The cube of side 2 around x = 5.
const AT_5: &str = "cube.obj@1 0 0 5  0 1 0 0  0 0 1 0";

fn world() -> Place {
    let place = place();
    place.write("two.urdf", URDF);
    place.write("cube.obj", cube());
    place
}

fn robot(directory: &Path, more: &[&str]) -> Ended {
    cbvh_in(directory, &[&["robot", "two.urdf"], more].concat())
}

/// Configurations, and what each gives without obstacles and with the cube: how far the nearest bodies are apart.
const CONFIGURATIONS: [([f64; 2], f64, f64); 8] = [
    ([0.0, 0.0], 0.75, 0.75),
    ([0.0, 0.5], 0.25, 0.25),
    ([0.0, 0.75], 0.0, 0.0),
    ([0.0, 1.5], 0.0, 0.0),
    ([0.0, -2.25], 3.0, 2.0),
    ([0.0, 3.5], 1.25, 0.25),
    ([0.0, 3.75], 1.5, 0.0),
    ([PI, 3.5], 4.25, 0.25),
];

fn write_configurations(directory: &Path) {
    let line = |([turn, slide], ..): &([f64; 2], f64, f64)| format!("{turn:?} {slide:?}\n");
    let lines: String = CONFIGURATIONS.iter().map(line).collect();
    directory.write("q.txt", format!("# turn slide\n\n{lines}"));
}

#[track_caller]
fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found} is not {expected}");
}

#[test]
fn contact_and_distance_follow_from_arithmetic() {
    let directory = &world();
    write_configurations(directory);
    let cases = [(&[][..], 0), (&["--obstacle", AT_5], 1), (&["--obstacle", "cube.obj@5 0 0 0 0 0 1"], 1)];
    for (more, with_cube) in cases {
        let expected = CONFIGURATIONS.map(|(_, alone, among)| if with_cube == 1 { among } else { alone });
        let ask = |mode: &[&str]| robot(directory, &[&["q.txt"], more, mode].concat()).done();

        let flags: Vec<String> = ask(&[]).out.lines().map(str::to_owned).collect();
        assert_eq!(flags, expected.map(|distance| if distance == 0.0 { "1" } else { "0" }));
        let lines = ask(&["--mode", "distance"]).out;
        assert_eq!(lines.lines().count(), expected.len());
        for (line, expected) in lines.lines().zip(expected) {
            near(line.parse().unwrap(), expected, 1e-12);
        }

        let contacts = ask(&["--json"]).json_lines();
        let distances = ask(&["--mode", "distance", "--json"]).json_lines();
        assert_eq!((contacts.len(), distances.len()), (expected.len(), expected.len()));
        for (number, (contact, distance)) in contacts.iter().zip(&distances).enumerate() {
            let ([_, slide], ..) = CONFIGURATIONS[number];
            assert!(contact["configuration"] == number && distance["configuration"] == number);
            let touches = expected[number] == 0.0;
            assert_eq!(contact["collide"], touches);
            // The cube is at 4, and the cart reaches 0.25 from its middle.
            let pair = if with_cube == 1 && slide > 3.0 { ["cart", "cube"] } else { ["arm", "cart"] };
            assert_eq!(contact.get("a").is_some(), touches);
            if touches {
                let [a, b] = pair;
                assert!(contact["a"] == a && contact["b"] == b, "{contact}");
                assert_eq!(contact["pairs"], serde_json::json!([{ "a": a, "b": b }]));
            }
            if slide > -2.0 {
                assert!(distance["a"] == pair[0] && distance["b"] == pair[1], "{distance}");
            }
            near(distance["distance"].as_f64().unwrap(), expected[number], 1e-12);
            let [a, b] = ["point_a", "point_b"].map(|name| point(&distance[name]));
            let apart = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
            near(apart, expected[number], 1e-12);
            if pair == ["cart", "cube"] {
                near(a[0], slide + 0.25, 1e-12);
                near(b[0], 4.0, 1e-12);
            }
        }
    }
}

/// The arm is a box of 1 by 0.25 by 0.25 whose near end is 1 from the axis, and the cart a cube of side 0.5. Both are on the x axis while
/// the arm is not turned, so that the derivatives by the turn and by the slide are known.
#[test]
fn near_pairs_and_their_derivatives_follow_from_arithmetic() {
    let directory = &world();
    write_configurations(directory);
    let ask = |margin: &str, more: &[&str]| {
        let near = ["q.txt", "--mode", "near", "--margin", margin, "--obstacle", AT_5];
        robot(directory, &[&near, more].concat()).done()
    };
    // Along x: how far the cart is from the arm, and from the cube at 4, and how these change as it slides; negative where they overlap.
    let arm_and_cart = |slide: f64| {
        let (before, beyond) = (1.0 - (slide + 0.25), slide - 0.25 - 2.0);
        if before > beyond { (before, -1.0) } else { (beyond, 1.0) }
    };
    let cart_and_cube = |slide: f64| (4.0 - (slide + 0.25), -1.0);
    let records = ask("1.3", &["--json"]).json_lines();
    let lines = ask("1.3", &[]).out;
    assert_eq!((records.len(), lines.lines().count()), (8, 8));
    let mut seen = [0; 2];
    for (number, (record, line)) in records.iter().zip(lines.lines()).enumerate() {
        let ([turn, slide], ..) = CONFIGURATIONS[number];
        assert_eq!(record["configuration"], number);
        let pairs = record["pairs"].as_array().unwrap();
        let mut least = f64::INFINITY;
        let mut expected = Vec::new();
        if turn == 0.0 && arm_and_cart(slide).0 <= 1.3 {
            expected.push(("arm", "cart", arm_and_cart(slide)));
        }
        if cart_and_cube(slide).0 <= 1.3 {
            expected.push(("cart", "cube", cart_and_cube(slide)));
        }
        assert_eq!(pairs.len(), expected.len(), "{record}");
        for (pair, (a, b, (distance, slope))) in pairs.iter().zip(&expected) {
            assert!(pair["a"] == *a && pair["b"] == *b, "{pair}");
            let number = |name: &str| pair[name].as_f64().unwrap();
            // Deep in the arm, the way out is across it.
            let across = -0.125 - 0.25;
            let (distance, slope) = if *distance < across { (across, 0.0) } else { (*distance, *slope) };
            near(number("distance"), distance, 1e-9);
            assert!(number("lower") <= number("distance") && number("distance") <= number("upper"), "{pair}");
            near(number("upper"), distance, 0.01 * distance.abs() + 1e-9);
            let gradient: Vec<f64> =
                pair["gradient"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            assert_eq!(gradient.len(), 2);
            // Faces that touch have no direction that roundings do not choose.
            if distance != 0.0 {
                near(gradient[1], slope, 1e-9);
            }
            if *b == "cube" && distance != 0.0 {
                assert_eq!(gradient[0], 0.0);
                near(point(&pair["normal"])[0], 1.0, 1e-12);
            }
            least = least.min(number("distance"));
            seen[usize::from(*b == "cube")] += 1;
        }
        let (count, found) = line.split_once(' ').unwrap();
        assert_eq!(count.parse::<usize>().unwrap(), pairs.len());
        assert!(found.parse::<f64>().unwrap() == least, "{line} {least}");
    }
    assert!(seen[0] >= 4 && seen[1] >= 3, "{seen:?}");
    // Turned a little, a corner of the arm is nearest to the cart, and the turn counts.
    let one = |turn: f64| {
        let joints = format!("{turn:?} 0.5");
        let record = robot(directory, &["--joints", &joints, "--mode", "near", "--margin", "1", "--json"])
            .done()
            .json();
        let pair = &record["pairs"][0];
        (pair["distance"].as_f64().unwrap(), pair["gradient"][0].as_f64().unwrap())
    };
    let ((before, _), (_, slope), (after, _)) = (one(0.5 - 1e-6), one(0.5), one(0.5 + 1e-6));
    near(slope, (after - before) / 2e-6, 1e-6);
    assert!(slope.abs() > 0.1, "{slope}");

    let bench = ask("1.3", &["--bench"]).json();
    let with_pairs = records.iter().filter(|record| !record["pairs"].as_array().unwrap().is_empty()).count();
    assert!(bench["mode"] == "near" && bench["positives"] == with_pairs, "{bench}");
    // The cart is 1.25 beyond the arm once.
    assert_ne!(bench["answers_xxh3"], ask("1.2", &["--bench"]).json()["answers_xxh3"]);
    assert_eq!(ask("0", &["--limit", "1"]).out, "0 inf\n");
}

fn point(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|k| value[k].as_f64().unwrap())
}

/// When the arm, turned from pi/2 towards 0, first touches the cart at 1.5: its lower face meets the upper corner next to the axis.
fn angle_of_contact() -> f64 {
    let (x, y) = (1.25_f64, 0.25_f64);
    y.atan2(x) + (0.125 / x.hypot(y)).asin()
}

#[test]
fn edges_have_the_time_and_the_bodies_of_the_first_hit() {
    let directory = &world();
    let edges = format!("0 2.5 0 4.5\n0 2.5 0 8 # past the cube\n-1 2.5 1 2.5\n{FRAC_PI_2:?} 1.5 0 1.5\n");
    directory.write("e.txt", edges);
    let ask =
        |more: &[&str]| robot(directory, &[&["e.txt", "--edges", "--obstacle", AT_5], more].concat()).done();
    let expected = [
        Some((1.25 / 2.0, ["cart", "cube"])),
        Some((1.25 / 5.5, ["cart", "cube"])),
        None,
        Some((1.0 - angle_of_contact() / FRAC_PI_2, ["arm", "cart"])),
    ];
    let lines = ask(&[]).out;
    let records = ask(&["--json"]).json_lines();
    assert_eq!((lines.lines().count(), records.len()), (4, 4));
    for (number, (line, record)) in lines.lines().zip(&records).enumerate() {
        assert_eq!(record["edge"], number);
        let Some((time, [a, b])) = expected[number] else {
            assert!(line == "free" && *record == serde_json::json!({ "edge": number, "answer": "free" }));
            continue;
        };
        let words: Vec<&str> = line.split(' ').collect();
        let ["hit", free_until, touching_at] = words[..] else { panic!("{line}") };
        let times = [free_until, touching_at].map(|word| word.parse::<f64>().unwrap());
        // The time lies between the certified ones, which the tolerance keeps close together.
        assert!(times[0] <= time && time <= times[1] + 1e-15, "{line} {time}");
        near(times[0], time, 1e-5);
        near(times[1], time, 1e-5);
        assert!(record["answer"] == "hit" && record["a"] == a && record["b"] == b, "{record}");
        assert_eq!(["free_until", "touching_at"].map(|name| record[name].as_f64().unwrap()), times);
        assert!(record["distance"] == 0.0 && record["joints"].as_array().unwrap().len() == 2, "{record}");
    }
    // At the first edge, the joint values are those of the time, and the points are where the cart touches the cube.
    near(records[0]["joints"][1].as_f64().unwrap(), 3.75, 1e-4);
    near(point(&records[0]["point_a"])[0], 4.0, 1e-4);

    // The arm passes the cart at a distance between 0.2 and 0.3.
    let third = |more: &[&str]| ask(more).out.lines().nth(2).unwrap().to_owned();
    assert_eq!(third(&["--clearance", "0.2"]), "free");
    assert!(third(&["--clearance", "0.3"]).starts_with("hit "));
    let bench = ask(&["--bench"]).json();
    assert!(bench["hits"] == 3 && bench["near"] == 0 && bench["mode"] == "motion", "{bench}");

    // The arm's corner passes the cart, and is nearest to it when it is on the x axis: 1e-9 away, which is less than the tolerance, a
    // millionth of the cart's diagonal.
    let pass = |gap: f64, more: &[&str]| {
        let slide = 2.0_f64.hypot(0.125) + 0.25 + gap;
        directory.write("e.txt", format!("-1 {slide:?} 1 {slide:?}\n"));
        robot(directory, &[&["e.txt", "--edges"], more].concat()).done()
    };
    let nearest = (1.0 - 0.125_f64.atan2(2.0)) / 2.0;
    let record = pass(1e-9, &["--json"]).json();
    let [free_until, at] = ["free_until", "at"].map(|name| record[name].as_f64().unwrap());
    assert!(record["answer"] == "near" && record["a"] == "arm" && record["b"] == "cart", "{record}");
    assert!(free_until <= at && (1e-9..1e-6).contains(&record["distance"].as_f64().unwrap()), "{record}");
    near(at, nearest, 1e-3);
    let bench = pass(1e-9, &["--bench"]).json();
    assert!(bench["hits"] == 0 && bench["near"] == 1 && bench["positives"] == 0, "{bench}");
    assert!(pass(-1e-3, &[]).out.starts_with("hit 0.4") && pass(1e-3, &[]).out == "free\n");
}

#[test]
fn answers_depend_neither_on_the_backend_nor_on_threads() {
    let directory = &world();
    write_configurations(directory);
    directory.write("e.txt", "0 2.5 0 8\n-1 2.5 1 2.5\n");
    let near = ["q.txt", "--mode", "near", "--margin", "1"];
    for more in [&["q.txt"][..], &["q.txt", "--mode", "distance"], &near, &["e.txt", "--edges"]] {
        let mut hashes = Vec::new();
        for isa in backends(directory) {
            for jobs in ["1", "2"] {
                let fixed =
                    ["robot", "two.urdf", "--obstacle", AT_5, "--bench", "--isa", isa, "--jobs", jobs];
                let json = cbvh_with_isa(directory, "scalar", &[&fixed, more].concat()).done().json();
                assert_eq!(json["isa"], isa);
                hashes.push(json["answers_xxh3"].as_str().unwrap().to_owned());
            }
        }
        assert!(hashes.iter().all(|hash| *hash == hashes[0] && hash.len() == 16), "{hashes:?}");
    }
    let bench = ["q.txt", "--obstacle", AT_5, "--bench", "--out", "raw.txt"];
    let json = robot(directory, &bench).done().json();
    for (name, expected) in [("peer", "cbvh"), ("mode", "collide"), ("robot", "two"), ("poses", "q")] {
        assert_eq!(json[name], expected, "{json}");
    }
    let counts =
        [("joints", 2), ("links", 3), ("obstacles", 1), ("pairs", 3), ("queries", 8), ("positives", 3)];
    for (name, expected) in counts {
        assert_eq!(json[name], expected, "{name}: {json}");
    }
    assert!(json["node_tests"].is_null(), "{json}");
    let raw = directory.text("raw.txt");
    let flags: Vec<&str> = raw.lines().map(|line| line.split_once(' ').unwrap().0).collect();
    assert_eq!(flags, ["0", "0", "1", "1", "0", "0", "1", "0"]);
    let few = robot(directory, &["q.txt", "--limit", "2"]).done().out;
    assert_eq!(few, "0\n0\n");
    let cut = robot(directory, &["q.txt", "--budget", "0", "--bench"]).done().json();
    assert!(cut["answers_xxh3"].is_null() && cut["queries"] == 1 && cut["requested"] == 8, "{cut}");
}

#[test]
fn one_configuration_is_answered_for_a_person() {
    let directory = &world();
    let one = |joints: &str, more: &[&str]| robot(directory, &[&["--joints", joints], more].concat()).done();
    assert_eq!(one("0, 0", &[]).out, "no bodies touch\n");
    assert_eq!(one("0 1.5", &[]).out, "1 pair of bodies in contact\n  arm  cart\n");
    let said = one("0 0.5", &["--mode", "distance"]).out;
    assert!(said.starts_with("arm and cart: distance 0.25\n  certainly 0.2"), "{said}");
    let said = one("0 0.5", &["--mode", "near", "--margin", "1"]).out;
    assert_eq!(said, "1 pair of bodies within the margin\n  arm  cart  0.25\n");
    assert_eq!(one("-1 2.5 1 2.5", &["--edges"]).out, "free\n");
    let said = one("0 2.5 0 4.5", &["--edges", "--obstacle", AT_5]).out;
    assert!(said.starts_with("free until 0.62") && said.contains("cart and cube: distance 0.0"), "{said}");
    let json = one("0 1.5", &["--json"]).json();
    assert!(json["configuration"] == 0 && json["collide"] == true && json["a"] == "arm", "{json}");
}

/// A mesh is a surface, obstacles of one file have names of their own, and pairs that an SRDF disables are not asked about.
#[test]
fn obstacles_may_be_solid_and_pairs_disabled() {
    let directory = &world();
    directory.write("inside.txt", "0 5\n");
    assert_eq!(robot(directory, &["inside.txt", "--obstacle", AT_5]).done().out, "0\n");
    assert_eq!(robot(directory, &["inside.txt", "--obstacle", AT_5, "--solid"]).done().out, "1\n");

    // The arm touches the cube around the origin, and the cart is inside it.
    directory.write("q.txt", "0 0\n");
    let twice = ["q.txt", "--obstacle", AT_5, "--obstacle", "cube.obj", "--json"];
    let json = robot(directory, &twice).done().json();
    assert!(json["a"] == "arm" && json["b"] == "cube#2", "{json}");
    assert_eq!(json["pairs"].as_array().unwrap().len(), 1);

    let srdf = r#"<robot name="two"><disable_collisions link1="arm" link2="cart" reason="Never"/></robot>"#;
    directory.write("two.srdf", srdf);
    directory.write("q.txt", "0 1.5\n");
    let disabled =
        |more: &[&str]| robot(directory, &[&["q.txt", "--srdf", "two.srdf"], more].concat()).done();
    assert_eq!(disabled(&[]).out, "0\n");
    assert_eq!(disabled(&["--mode", "distance"]).out, "inf\n");
    let none = disabled(&["--mode", "distance", "--json"]).json();
    assert_eq!(none, serde_json::json!({ "configuration": 0, "distance": null }));
    let one = disabled(&["--mode", "distance", "--obstacle", AT_5]).out;
    near(one.trim().parse().unwrap(), 2.0, 1e-12);
}

/// The answers in a page are those that are printed, and what a page has of the joints follows from the URDF.
#[test]
fn a_page_has_the_joints_and_the_answers() {
    let directory = &world();
    directory.write("e.txt", "0 2.5 0 4.5\n-1 2.5 1 2.5\n");
    let ask = ["e.txt", "--edges", "--obstacle", AT_5, "--json", "--view", "page.html"];
    let records = robot(directory, &ask).done().json_lines();
    let (content, files) = page(directory);
    let show = &content["show"];
    assert_eq!((files.len(), &show["kind"]), (3, &json!("robot")));
    let turn = json!({
        "kind": "turn", "parent": 0, "origin": IDENTITY, "axis": [0.0, 0.0, 1.0], "value": 0, "factor": 1.0, "offset": 0.0
    });
    let slide = json!({
        "kind": "slide", "parent": 0, "origin": IDENTITY, "axis": [1.0, 0.0, 0.0], "value": 1, "factor": 1.0, "offset": 0.0
    });
    assert_eq!(show["joints"], json!([turn, slide]));
    let values = json!([
        { "name": "turn", "at": 0.0, "lower": -PI, "upper": PI }, { "name": "slide", "at": 2.5, "lower": -9.0, "upper": 9.0 }
    ]);
    assert_eq!(show["values"], values);
    let at = |x: f64| {
        let mut rows = IDENTITY;
        rows[3] = x;
        rows
    };
    for (number, name, frame, origin, pose) in
        [(0, "arm", 1, 1.5, 1.5), (1, "cart", 2, 0.0, 2.5), (2, "cube", 0, 5.0, 5.0)]
    {
        let instance = &show["instances"][number];
        assert!(instance["name"] == name && instance["frame"] == frame, "{instance}");
        assert_eq!((&instance["origin"], &instance["pose"]), (&json!(at(origin)), &json!(at(pose))));
    }
    let lines = &show["lines"];
    let end = &lines[0]["end"];
    assert_eq!((&lines[0]["start"], &lines[0]["goal"]), (&json!([0.0, 2.5]), &json!([0.0, 4.5])));
    let told = [("free_until", "free_until"), ("at", "touching_at")]
        .map(|(one, other)| (&end[one], &records[0][other]));
    assert!(told.iter().all(|(shown, told)| shown == told && told.is_f64()), "{end}");
    assert_eq!((&end["hit"], &end["bodies"]), (&json!(true), &json!(["cart", "cube"])));
    assert_eq!(end["points"], json!([records[0]["point_a"], records[0]["point_b"]]));
    assert_eq!(lines[1], json!({ "start": [-1.0, 2.5], "goal": [1.0, 2.5] }));

    // Configurations have no answers: the page asks.
    write_configurations(directory);
    let out = robot(directory, &["q.txt", "--view", "page.html", "--limit", "3"]).done().out;
    assert_eq!(out, "0\n0\n1\n");
    let starts: Vec<Value> =
        CONFIGURATIONS[..3].iter().map(|(start, ..)| json!({ "start": start })).collect();
    assert_eq!(page(directory).0["show"]["lines"], json!(starts));
    assert!(robot(directory, &["--joints", "0 1.5", "--view", "page.html"]).done().out.starts_with("1 pair"));
    assert_eq!(page(directory).0["show"]["lines"], json!([{ "start": [0.0, 1.5] }]));

    // Without questions, a page alone, of a robot without joints as well.
    let out = robot(directory, &["--view", "page.html"]).done().out;
    assert_eq!(out, "page.html: shows two.urdf\n");
    let values = &page(directory).0["show"]["values"];
    assert_eq!((&values[0]["at"], &values[1]["at"]), (&json!(0.0), &json!(0.0)));
    // Within the limits, with a quaternion that does not turn. The page chooses the ends of lengths without limits.
    let joint = |kind: &str, child: &str| {
        format!(
            r#"<link name="{child}"/><joint name="{child}" type="{kind}"><parent link="cart"/><child link="{child}"/></joint>"#
        )
    };
    let more = format!("{}{}</robot>", joint("planar", "p"), joint("floating", "f"));
    directory.write("more.urdf", URDF.replace(r#"lower="-9""#, r#"lower="1""#).replace("</robot>", &more));
    directory.cbvh("robot more.urdf --view page.html").done();
    let (content, _) = page(directory);
    let values = content["show"]["values"].as_array().unwrap();
    let ends = |value: &Value| ["lower", "at", "upper"].map(|name| value[name].as_f64());
    let (none, turn, part) =
        ([None, Some(0.0), None], [Some(-PI), Some(0.0), Some(PI)], [Some(-1.0), Some(0.0), Some(1.0)]);
    let (slide, real) = ([1.0, 1.0, 9.0].map(Some), [-1.0, 1.0, 1.0].map(Some));
    let expected = [turn, slide, none, none, turn, none, none, none, part, part, part, real];
    assert_eq!(values.iter().map(ends).collect::<Vec<_>>(), expected);
    let kinds: Vec<&Value> =
        content["show"]["joints"].as_array().unwrap().iter().map(|joint| &joint["kind"]).collect();
    assert_eq!(kinds, ["turn", "slide", "planar", "floating"]);
    let still = r#"<robot name="s"><link name="base"><collision><geometry><sphere radius="1"/></geometry></collision></link></robot>"#;
    directory.write("still.urdf", still);
    directory.cbvh("robot still.urdf --view page.html").done();
    let show = &page(directory).0["show"];
    assert_eq!([&show["joints"], &show["values"], &show["lines"]], [&json!([]); 3]);
    assert_eq!(show["instances"].as_array().unwrap().len(), 1);
}

#[test]
fn pages_that_cannot_be_written_are_named() {
    let directory = &world();
    write_configurations(directory);
    directory.write("two.srdf", r#"<robot name="two"/>"#);
    let before = names(directory);
    let ask = |more: &[&str]| robot(directory, &[&["q.txt"], more].concat());
    ask(&["--view", "-"]).failed(1, &["--view: expected a file, found -"]);
    ask(&["--view", "none/page.html"]).failed(2, &["the folder none"]);
    ask(&["--view", "."]).failed(2, &["directory"]);
    ask(&["--view", "a.html", "--view", "b.html"]).failed(1, &["--view"]);
    for input in ["two.urdf", "q.txt", "cube.obj", "two.srdf"] {
        let more = ["--srdf", "two.srdf", "--obstacle", AT_5, "--view", &format!("./{input}")];
        ask(&more).failed(1, &[input, "found an input"]);
        let more = ["--srdf", "two.srdf", "--obstacle", AT_5, "--bench", "--out", input];
        ask(&more).failed(1, &[input, "found an input"]);
    }
    ask(&["--view", "page.html", "--out", "./page.html"]).failed(1, &["a different file for each output"]);
    ask(&["--max-page", "1MiB"]).failed(1, &["--max-page requires --view"]);
    let large = ask(&["--view", "page.html", "--max-page", "100"]);
    assert!(large.out.is_empty());
    large.failed(4, &["--max-page 1MiB"]);
    for more in ["--edges", "--json", "--bench"] {
        robot(directory, &["--view", "page.html", more]).failed(1, &["require FILE"]);
    }
    // A mistake in the questions leaves no page.
    directory.write("wrong.txt", "0 0 0\n");
    robot(directory, &["wrong.txt", "--view", "page.html"]).failed(3, &["wrong.txt"]);
    std::fs::remove_file(directory.join("wrong.txt")).unwrap();
    assert_eq!(names(directory), before);
}

#[test]
fn bad_questions_are_named() {
    let directory = &world();
    for (text, more, words) in [
        ("0 1\n0 1 2\n", &[][..], "line 2: expected 2 numbers, the values of turn, slide, found 3"),
        ("0\n", &[], "line 1: expected 2 numbers, the values of turn, slide, found 1"),
        ("0 nan\n", &[], "line 1: joint slide: expected a finite value, found NaN"),
        ("1e999 0\n", &[], "line 1: joint turn: expected a finite value, found inf"),
        ("0 x\n", &[], "line 1: expected a number, found \"x\""),
        ("0 0\n0 1e300\n", &["--mode", "distance"], "line 2: expected a translation of at most"),
        ("# none\n", &[], "in at least one line, found none"),
        ("0 1\n", &["--edges"], "line 1: expected 4 numbers, two configurations of turn, slide, found 2"),
        ("0 0 0 nan\n", &["--edges"], "line 1: end: joint slide: expected a finite value, found NaN"),
        ("0 0 99999 0\n", &["--edges"], "line 1: joint turn: expected a turn at no more than 16,384 radians"),
    ] {
        directory.write("q.txt", text);
        let arguments = [&["q.txt", "--out", "raw.txt"], more].concat();
        robot(directory, &arguments).failed(3, &["q.txt: ", words]);
    }
    assert!(!directory.join("raw.txt").exists());
    robot(directory, &["none.txt"]).failed(2, &["none.txt"]);
    robot(directory, &[]).failed(1, &["FILE"]);
    robot(directory, &["--joints", "0 1 2"]).failed(3, &["--joints: expected 2 numbers", "found 3"]);
    robot(directory, &["--joints", "0 nan"]).failed(3, &["--joints: joint slide: expected a finite value"]);
    directory.write("q.txt", "0 0\n");
    robot(directory, &["q.txt", "--edges", "--mode", "distance"]).failed(1, &["--edges requires"]);
    robot(directory, &["q.txt", "--mode", "near"]).failed(1, &["--mode near requires --margin D"]);
    robot(directory, &["q.txt", "--margin", "1"]).failed(1, &["--margin requires --mode near"]);
    for margin in ["-1", "nan", "inf", "x"] {
        robot(directory, &["q.txt", "--mode", "near", "--margin", margin]).failed(1, &["--margin", margin]);
    }
    robot(directory, &["q.txt", "--edges", "--mode", "near", "--margin", "1"])
        .failed(1, &["--edges requires"]);
    robot(directory, &["q.txt", "--clearance", "1"]).failed(1, &["--edges"]);
    robot(directory, &["q.txt", "--solid"]).failed(1, &["--obstacle"]);
    robot(directory, &["q.txt", "--isa", "mmx"]).failed(1, &["mmx"]);
}

#[test]
fn bad_robots_and_obstacles_are_named() {
    let directory = &world();
    directory.write("q.txt", "0 0\n");
    let obstacle =
        |text: &str, more: &[&str]| robot(directory, &[&["q.txt", "--obstacle", text], more].concat());
    let eleven = "cube.obj@1 0 0 5  0 1 0 0  0 0 1";
    obstacle(eleven, &[]).failed(3, &["--obstacle cube.obj: expected 12 numbers", "found 11"]);
    obstacle("cube.obj@", &[])
        .failed(3, &["--obstacle cube.obj: expected 12 numbers, or 7, after @, found none"]);
    obstacle("cube.obj@2 0 0 5  0 1 0 0  0 0 1 0", &[])
        .failed(3, &["--obstacle cube.obj: expected a rotation"]);
    obstacle("cube.obj@1 0 0 nan  0 1 0 0  0 0 1 0", &[]).failed(3, &["--obstacle cube.obj: "]);
    obstacle("none.obj@0 0 0 0 0 0 1", &[]).failed(2, &["none.obj: expected a readable file"]);
    directory.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    obstacle("open.obj@9 0 0 0 0 0 1", &["--solid"]).failed(3, &["open.obj: "]);
    obstacle("open.obj@9 0 0 0 0 0 1", &[]).done();

    let ask = |arguments: &str| directory.cbvh(arguments);
    ask("robot none.urdf q.txt").failed(2, &["none.urdf: expected a readable file"]);
    ask("robot two.urdf q.txt --srdf none.srdf").failed(2, &["none.srdf: expected a readable file"]);
    directory.write("cut.urdf", &URDF[..300]);
    ask("robot cut.urdf q.txt").failed(3, &["cut.urdf: "]);
    directory.write("still.urdf", r#"<robot name="s"><link name="base"/></robot>"#);
    let still = ask("robot still.urdf q.txt");
    assert!(still.code == 3 && still.err.contains("still.urdf: expected a robot with joints that move"));

    let with_mesh = |uri: &str| {
        URDF.replace(
            r#"<box size="0.5 0.5 0.5"/>"#,
            &format!(r#"<mesh filename="{uri}" scale="0.25 0.25 0.25"/>"#),
        )
    };
    directory.write("lost.urdf", with_mesh("none.obj"));
    let words = ["lost.urdf: link cart: expected the mesh none.obj", "--package-dir"];
    ask("robot lost.urdf q.txt").failed(2, &words);
    directory.write("bad.obj", "v 0 0 0\nf 1 2 3\n");
    directory.write("bad.urdf", with_mesh("bad.obj"));
    ask("robot bad.urdf q.txt").failed(3, &["bad.obj"]);
    directory.write("far.urdf", with_mesh("package://parts/cube.obj"));
    std::fs::create_dir_all(directory.join("ros/parts")).unwrap();
    directory.write("ros/parts/cube.obj", cube());
    ask("robot far.urdf q.txt").failed(2, &["package://parts/cube.obj", "--package-dir"]);
    let found = ask("robot far.urdf q.txt --package-dir ros --mode distance").done().out;
    near(found.trim().parse().unwrap(), 0.75, 1e-12);
    std::fs::create_dir_all(directory.join("a/b")).unwrap();
    directory.write("a/b/up.urdf", with_mesh("../../cube.obj"));
    ask("robot a/b/up.urdf q.txt").failed(3, &["up.urdf: link cart: ", "cube.obj", "--allow-outside"]);
    assert_eq!(ask("robot a/b/up.urdf q.txt --allow-outside").done().out, "0\n");
    assert_eq!(ask("robot a/b/up.urdf q.txt --package-dir .").done().out, "0\n");
}
