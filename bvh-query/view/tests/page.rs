//! Tests that a page holds what was put into it, and nothing that a browser would take for something else.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use bvh_bake::mesh::Mesh;
use bvh_bake::{Options, shapes, to_bytes};
use bvh_query::{Bvh, ClashClass, Groups, InstanceId, OwnedShape, Pose, Scene};
use cbvh_robot::{Edge, Robot, RobotError, RobotMotion, RobotOptions};
use cbvh_view::{Frames, Named, Page, PageError, Placed, PlacedClash, RobotLine};
use serde_json::{Value, json};
use std::io::{self, Read as _, Write};

const OPENING: &str = "<script type=\"application/json\" id=\"cbvh-content\">";
const FILE: &str = "<script type=\"text/plain\" class=\"cbvh-file\">";
const CLOSING: &str = "</script>";
const TEMPLATE: &str = include_str!("../page.html");
const IDENTITY: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn bake(mesh: &Mesh) -> Bvh {
    Bvh::from_bytes(to_bytes(mesh, &Options::default()).unwrap().0).unwrap()
}

fn block() -> Bvh {
    bake(&shapes::block([2.0, 1.0, 1.0]).unwrap())
}

fn named(name: &str, shape: impl Into<OwnedShape>) -> Named {
    Named { name: name.to_owned(), path: format!("folder/{name}"), shape: shape.into() }
}

fn shifted(x: f64) -> Pose {
    Pose::new(*Pose::IDENTITY.rotation(), [x, 0.0, 0.0]).unwrap()
}

fn placed(name: &str, of: Named, x: f64) -> Placed {
    Placed::new(name, of, shifted(x))
}

/// Returns two objects in one file.
fn two_objects() -> Bvh {
    let mut mesh = shapes::block([1.0; 3]).unwrap();
    mesh.objects[0].name = "closed".to_owned();
    let open = Mesh::from_triangles(vec![[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]], vec![[0, 1, 2]]);
    mesh.objects.extend(open.objects);
    mesh.objects[1].name = "open".to_owned();
    mesh.objects[1].triangle_ids = vec![1000];
    let (bytes, _) = to_bytes(&mesh, &Options::default().split_objects(true)).unwrap();
    let bvh = Bvh::from_bytes(bytes).unwrap();
    assert_eq!(bvh.objects().len(), 2);
    bvh
}

fn html(page: &Page) -> String {
    let mut bytes = Vec::new();
    page.write(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Returns what a page says, and its files.
fn unpacked(page: &Page) -> (Value, Vec<Vec<u8>>) {
    let html = html(page);
    let (before, rest) = html.split_once(OPENING).unwrap();
    let (content, mut rest) = rest.split_once(CLOSING).unwrap();
    let mut files = Vec::new();
    while let Some(next) = rest.strip_prefix('\n').and_then(|rest| rest.strip_prefix(FILE)) {
        let (text, after) = next.split_once(CLOSING).unwrap();
        let mut bytes = Vec::new();
        let packed = STANDARD.decode(text).unwrap();
        flate2::read::GzDecoder::new(&packed[..]).read_to_end(&mut bytes).unwrap();
        files.push(bytes);
        rest = after;
    }
    assert_eq!(format!("{before}<!--cbvh:content-->{rest}"), TEMPLATE);
    let content: Value = serde_json::from_str(content).unwrap();
    assert_eq!(content["version"], 1);
    let lengths: Vec<u64> = files.iter().map(|file| file.len() as u64).collect();
    let stated: Vec<u64> =
        content["files"].as_array().unwrap().iter().map(|file| file["bytes"].as_u64().unwrap()).collect();
    assert_eq!(lengths, stated);
    (content, files)
}

#[test]
fn the_template_has_one_line_for_the_content() {
    let lines = TEMPLATE.lines().filter(|line| line.trim() == "<!--cbvh:content-->").count();
    assert_eq!((lines, TEMPLATE.matches("<!--cbvh:content-->").count()), (1, 1));
    assert!(TEMPLATE.len() < 1_600_000, "{} bytes", TEMPLATE.len());
    let body = TEMPLATE.find("<body").unwrap();
    assert!(body < TEMPLATE.find("<!--cbvh:content-->").unwrap());
    // Nothing is fetched from anywhere.
    assert!(!TEMPLATE.contains("src=\"http") && !TEMPLATE.contains("href=\"http"));
}

#[test]
fn only_the_code_of_the_template_may_run() {
    let (_, rest) = TEMPLATE.split_once("<meta http-equiv=\"Content-Security-Policy\" content=\"").unwrap();
    let policy: Vec<&str> = rest.split_once("\">").unwrap().0.split("; ").collect();
    assert_eq!(policy[0], "default-src 'none'");
    // The code that unpacks, and what it unpacks. The tests of the viewer compare the hashes.
    let code = policy.iter().find_map(|rule| rule.strip_prefix("script-src 'wasm-unsafe-eval' ")).unwrap();
    assert!(
        code.split(' ').all(|hash| hash.starts_with("'sha256-")) && code.split(' ').count() == 2,
        "{code}"
    );
    assert!(!policy.iter().any(|rule| rule.contains("unsafe-inline") || rule.contains("http")));
    // The policy holds for what stands after it.
    assert!(rest.contains("<style>") && rest.contains("<!--cbvh:content-->"));
}

#[test]
fn what_was_put_in_comes_out() {
    let (a, b) = (block(), bake(&shapes::point([0.1, 0.2, 0.3])));
    let pose =
        Pose::new([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]], [1.0 / 3.0, -0.0, 1e-9]).unwrap();
    let page =
        Page::pair(named("a.cbvh", a.clone()), Some(named("b.cbvh", b.clone())), &pose, Some(0.1)).unwrap();
    let (content, files) = unpacked(&page);
    assert_eq!(files, [a.bytes(), b.bytes()]);
    assert_eq!(page.bytes(), (a.bytes().len() + b.bytes().len()) as u64);
    assert_eq!(
        content,
        json!({
            "version": 1,
            "files": [
                { "name": "a.cbvh", "path": "folder/a.cbvh", "bytes": a.bytes().len() },
                { "name": "b.cbvh", "path": "folder/b.cbvh", "bytes": b.bytes().len() },
            ],
            "show": {
                "kind": "pair",
                "pose": [0.6, -0.8, 0.0, 1.0 / 3.0, 0.8, 0.6, 0.0, -0.0, 0.0, 0.0, 1.0, 1e-9],
                "within": 0.1,
            },
        })
    );
    let (content, files) = unpacked(&Page::file(named("a.cbvh", a.clone())).unwrap());
    assert_eq!((&content["show"], &files[..]), (&json!({ "kind": "file" }), &[a.bytes().to_vec()][..]));
    let ends = [Pose::IDENTITY, shifted(3.0)];
    let page = Page::motion(named("a.cbvh", a.clone()), None, ends, 0.25, None).unwrap();
    let (content, files) = unpacked(&page);
    let mut numbers = [IDENTITY, IDENTITY].concat();
    numbers[15] = 3.0;
    let show =
        json!({ "kind": "motion", "motion": numbers, "clearance": 0.25, "tolerance": null, "same": true });
    assert_eq!((&content["show"], files.len()), (&show, 1));
    assert_eq!(html(&page), html(&page), "the same content gives the same bytes");
}

#[test]
fn hostile_names_end_nothing() {
    for name in [
        "</script><script>alert(1)</script>",
        "<!--<script>",
        "a\"b'c\\d",
        "x\u{2028}y\u{2029}z",
        "\u{0}\n\t&amp;",
    ] {
        let of = Named { name: name.to_owned(), path: name.to_owned(), shape: block().into() };
        let (content, _) = unpacked(&Page::file(of).unwrap());
        assert_eq!(
            (&content["files"][0]["name"], &content["files"][0]["path"]),
            (&name.into(), &name.into())
        );
    }
}

#[test]
fn a_file_is_in_the_page_once() {
    let (block, both) = (block(), two_objects());
    let object = |number| OwnedShape::object(both.clone(), number).unwrap();
    let again = Bvh::from_bytes(block.bytes().to_vec()).unwrap();
    let ball = OwnedShape::from(bake(&shapes::point([0.0; 3])));
    let rounded = |radius| ball.clone().rounded(radius).unwrap();
    let instances = [
        placed("a", named("block", block.clone()), 0.0),
        placed("b", named("block again", again), 1.0),
        placed("c", named("both", object(0)), 2.0),
        placed("d", named("both", object(1)), 3.0),
        placed("e", named("both", both.clone()), 4.0),
        placed("f", named("small", rounded(0.5)), 5.0),
        placed("g", named("large", rounded(1.5)), 6.0),
        placed("h", named("small", rounded(0.5)), 7.0),
        placed("i", named("solid", OwnedShape::from(block.clone()).solid().unwrap()), 8.0),
        placed("j", named("both", object(0).solid().unwrap()), 9.0),
    ];
    let (content, files) = unpacked(&Page::scene(instances, vec![[0, 1]], Vec::new(), Vec::new()).unwrap());
    assert_eq!(files.len(), 5);
    assert_eq!(files[..2], [block.bytes(), both.bytes()]);
    let opened: Vec<Bvh> = files.iter().map(|bytes| Bvh::from_bytes(bytes.clone()).unwrap()).collect();
    let stated = opened.iter().map(|bvh| (bvh.all().radius(), bvh.all().is_solid())).collect::<Vec<_>>();
    assert_eq!(stated, [(0.0, false), (0.0, false), (0.5, false), (1.5, false), (0.0, true)]);
    let instances = content["show"]["instances"].as_array().unwrap();
    let of = |field: &str| instances.iter().map(|instance| instance[field].clone()).collect::<Vec<Value>>();
    assert_eq!(of("file"), [0, 0, 1, 1, 1, 2, 3, 2, 4, 1]);
    let none = Value::Null;
    assert_eq!(of("object")[2..5], [json!(0), json!(1), none.clone()]);
    assert_eq!(of("solid")[8..], [none.clone(), json!(true)]);
    assert_eq!((&content["show"]["allowed"], &content["show"]["frames"]), (&json!([[0, 1]]), &json!([])));
    assert_eq!(content["show"]["pair_margins"], none);
    // Both sides of a pair may be objects of one file.
    let page = Page::pair(named("x", object(0)), Some(named("x", object(1))), &Pose::IDENTITY, None).unwrap();
    let (content, files) = unpacked(&page);
    assert_eq!(files, [both.bytes(), both.bytes()]);
    assert_eq!((&content["files"][0]["object"], &content["files"][1]["object"]), (&0.into(), &1.into()));
    assert_eq!(content["show"]["same"], none);
    // A copy of a file keeps its name.
    for (name, count) in [("x", 1), ("copy of x", 2)] {
        let copy = Bvh::from_bytes(block.bytes().to_vec()).unwrap();
        let page =
            Page::pair(named("x", block.clone()), Some(named(name, copy)), &Pose::IDENTITY, None).unwrap();
        let (content, files) = unpacked(&page);
        assert_eq!((files.len(), &content["files"][count - 1]["name"]), (count, &name.into()));
    }
}

#[test]
fn a_scene_of_the_library_is_shown_as_it_is() {
    let mut scene = Scene::new().unwrap();
    let block = block();
    let first = scene.add_named("first".to_owned(), block.clone(), shifted(1.0)).unwrap();
    let second = scene.add(block.clone(), shifted(2.0)).unwrap();
    let third = scene.add_named("third".to_owned(), block, shifted(3.0)).unwrap();
    scene.set_allowed(first, third, true).unwrap();
    scene.set_margin(second, 0.5).unwrap();
    scene.set_pair_margin(second, third, 0.25).unwrap();
    scene.set_groups(third, Groups { member: 2, meets: 5 }).unwrap();
    // The third instance is named first.
    let frames = Frames { moving: vec![third, first], poses: vec![vec![shifted(30.0), shifted(10.0)]] };
    let page = |frames: &Frames| {
        Page::of_scene(&scene, frames, |_| ("block".into(), "block.obj".into()), |id| 100 + id.to_bits())
    };
    let (content, files) = unpacked(&page(&frames).unwrap());
    assert_eq!(files.len(), 1);
    let at = |x: f64| {
        let mut rows = IDENTITY;
        rows[3] = x;
        rows
    };
    let (one, two, three) = (at(1.0), at(2.0), at(3.0));
    let frame = [at(10.0), at(30.0)].concat();
    let all = u32::MAX;
    assert_eq!(
        content["show"],
        json!({
            "kind": "scene",
            "instances": [
                { "name": "first", "file": 0, "pose": one, "margin": 0.0, "moving": true, "member": all, "meets": all },
                { "name": "#101", "file": 0, "pose": two, "margin": 0.5, "moving": false, "member": all, "meets": all },
                { "name": "third", "file": 0, "pose": three, "margin": 0.0, "moving": true, "member": 2, "meets": 5 },
            ],
            "allowed": [[0, 2]],
            "pair_margins": [[1, 2, 0.25]],
            "frames": [frame],
        })
    );
    for found in [1, 3] {
        let wrong = Frames { poses: vec![vec![Pose::IDENTITY; found]], ..frames.clone() };
        let refused = page(&wrong).unwrap_err();
        assert!(
            matches!(refused, PageError::Frame { frame: 1, expected: 2, found: f } if f == found),
            "{refused}"
        );
    }
    let unknown = Frames { moving: vec![InstanceId::from_bits(9)], ..Frames::default() };
    assert!(matches!(page(&unknown), Err(PageError::NotInScene(_))));
}

#[test]
fn clashes_have_what_is_known() {
    let block = block();
    let instances = || ["a", "b", "c"].map(|name| placed(name, named("block", block.clone()), 0.0));
    let point = [1.0, 2.0, 3.0];
    let mut deep = PlacedClash::new([0, 1], ClashClass::Overlapping, point);
    (deep.depth, deep.translation) = (Some([0.5, 0.75]), Some([0.0, 0.75, 0.0]));
    let mut near = PlacedClash::new([1, 2], ClashClass::Near, point);
    near.distance = Some(0.125);
    let mut protruding = PlacedClash::new([0, 1], ClashClass::Protruding, point);
    protruding.volume = Some(2.5);
    let mut measured = protruding;
    (measured.class, measured.pierced) = (ClashClass::Piercing, [None, Some(0.375)]);
    let all = [deep, near, measured, protruding];
    let (content, _) = unpacked(&Page::clashes(instances(), &all).unwrap());
    assert_eq!(
        content["show"]["clashes"],
        json!([
            { "a": 0, "b": 1, "class": "overlapping", "lower": 0.5, "upper": 0.75, "point": [1.0, 2.0, 3.0],
              "translation": [0.0, 0.75, 0.0] },
            { "a": 1, "b": 2, "class": "near", "distance": 0.125, "point": [1.0, 2.0, 3.0] },
            { "a": 0, "b": 1, "class": "piercing", "point": [1.0, 2.0, 3.0], "volume": 2.5, "pierced": [null, 0.375] },
            { "a": 0, "b": 1, "class": "protruding", "point": [1.0, 2.0, 3.0], "volume": 2.5 },
        ])
    );
    let refused = |change: &dyn Fn(&mut PlacedClash)| {
        let mut clash = deep;
        change(&mut clash);
        Page::clashes(instances(), &[clash]).unwrap_err()
    };
    let missing = refused(&|clash| clash.pair = [0, 3]);
    assert!(matches!(missing, PageError::Instance { count: 3, found: 3 }), "{missing}");
    for wrong in [
        refused(&|clash| clash.point = [f64::NAN; 3]),
        refused(&|clash| clash.volume = Some(f64::INFINITY)),
        refused(&|clash| clash.pierced = [Some(f64::NAN), None]),
    ] {
        assert!(matches!(wrong, PageError::Number { .. }), "{wrong}");
    }
}

/// The robot of the test data: four joints that turn.
fn arm() -> Robot {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../testdata/robot/robot.urdf");
    Robot::from_urdf(path, &RobotOptions::default()).unwrap()
}

#[test]
fn a_robot_stands_where_its_first_line_says() {
    let mut robot = arm();
    robot.allow("forearm", "hand").unwrap();
    robot.add_obstacle("wall", block(), &shifted(9.0)).unwrap();
    robot.add_obstacle("floor", block(), &shifted(-9.0)).unwrap();
    robot.set_margin("wall", 0.25).unwrap();
    let line = |start: &[f64]| RobotLine { start: start.to_vec(), edge: None };
    let [first, second] = [[0.1, 0.2, -0.3, 0.4], [0.0, 3.0, 0.0, 0.0]];
    let page = Page::of_robot(&mut robot, [line(&first), line(&second)]).unwrap();
    let (content, files) = unpacked(&page);
    let show = &content["show"];
    // Both obstacles are one file.
    assert_eq!((files.len(), &show["kind"]), (6, &json!("robot")));
    assert_eq!(page.bytes(), files.iter().map(|file| file.len() as u64).sum::<u64>() + 8 * 8);
    let of = |field: &str| {
        show["instances"].as_array().unwrap().iter().map(|i| i[field].clone()).collect::<Vec<_>>()
    };
    assert_eq!(of("name"), ["base", "turret", "upper_arm", "forearm", "hand", "wall", "floor"]);
    assert_eq!(of("frame"), [0, 1, 2, 3, 4, 0, 0]);
    assert_eq!(of("moving"), [true, true, true, true, true, false, false]);
    assert_eq!(of("margin"), [0.0, 0.0, 0.0, 0.0, 0.0, 0.25, 0.0]);
    assert_eq!(
        (&of("member")[4..6], &of("meets")[4..6]),
        (&[json!(2), json!(1)][..], &[json!(3), json!(2)][..])
    );
    let rows = |pose: &Pose| {
        let (r, t) = (pose.rotation(), pose.translation());
        json!([0, 1, 2].map(|k| [r[k][0], r[k][1], r[k][2], t[k]]).concat())
    };
    let poses = robot.link_poses(&first).unwrap();
    // The shape of the turret has an origin of its own.
    for link in [0, 2, 3, 4] {
        assert_eq!(of("pose")[link], rows(&poses[link]));
    }
    assert_eq!(of("pose")[5..], [rows(&shifted(9.0)), rows(&shifted(-9.0))]);
    assert_eq!(show["allowed"], json!([[3, 4]]));
    let elbow = &show["joints"][2];
    let mut origin = IDENTITY;
    origin[11] = 0.36;
    let expected = json!({ "kind": "turn", "parent": 2, "origin": origin, "axis": [0.0, 1.0, 0.0], "value": 2, "factor": 1.0, "offset": 0.0 });
    assert_eq!(*elbow, expected);
    assert_eq!(show["values"][2], json!({ "name": "elbow", "at": -0.3, "lower": -2.8, "upper": 2.8 }));
    assert_eq!(show["lines"], json!([{ "start": first }, { "start": second }]));

    // Without a line, at 0.
    let (content, _) = unpacked(&Page::of_robot(&mut robot, []).unwrap());
    assert_eq!((&content["show"]["values"][2]["at"], &content["show"]["lines"]), (&json!(0.0), &json!([])));
    for wrong in [line(&first[1..]), line(&[0.0, f64::NAN, 0.0, 0.0])] {
        let refused = Page::of_robot(&mut robot, [line(&first), wrong]).unwrap_err();
        assert!(
            matches!(refused, PageError::Robot(RobotError::Count { .. } | RobotError::Value { .. })),
            "{refused}"
        );
    }
}

#[test]
fn edges_of_a_robot_have_their_answers() {
    let mut robot = arm();
    for (a, b) in [("turret", "upper_arm"), ("upper_arm", "forearm"), ("forearm", "hand"), ("base", "turret")]
    {
        robot.allow(a, b).unwrap();
    }
    robot.add_obstacle("wall", block(), &shifted(1.5)).unwrap();
    let ends = [[0.0; 4], [0.0, 1.5, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]];
    let mut ask =
        |to: usize| robot.motion(&Edge::straight(&ends[0], &ends[to]).unwrap(), &Default::default()).unwrap();
    let [hit, free] = [ask(1), ask(2)];
    let line =
        |to: usize, motion| RobotLine { start: ends[0].to_vec(), edge: Some((ends[to].to_vec(), motion)) };
    let page = Page::of_robot(&mut robot, [line(1, &hit), line(2, &free)]).unwrap();
    let (content, _) = unpacked(&page);
    let lines = &content["show"]["lines"];
    let RobotMotion::Hit { free_until, touching_at, bodies, points, .. } = hit else { panic!("{hit:?}") };
    let end = json!({ "hit": true, "free_until": free_until, "at": touching_at, "bodies": bodies, "points": points });
    assert_eq!(lines[0], json!({ "start": ends[0], "goal": ends[1], "end": end }));
    assert!(free == RobotMotion::Free && lines[1] == json!({ "start": ends[0], "goal": ends[2] }), "{lines}");
    assert_eq!(bodies[1], "wall");
    let wrong = RobotLine { start: ends[0].to_vec(), edge: Some((vec![0.0; 3], &free)) };
    assert!(matches!(Page::of_robot(&mut robot, [wrong]), Err(PageError::Robot(_))));
}

#[test]
fn wrong_numbers_and_sizes_are_refused() {
    let of = || named("block", block());
    for wrong in [f64::NAN, f64::INFINITY, -1.0] {
        let refused = Page::pair(of(), None, &Pose::IDENTITY, Some(wrong)).unwrap_err();
        assert!(matches!(refused, PageError::Number { name: "within", .. }), "{refused}");
        let refused = Page::motion(of(), None, [Pose::IDENTITY; 2], wrong, None).unwrap_err();
        assert!(matches!(refused, PageError::Number { name: "clearance", .. }), "{refused}");
        let refused = Page::motion(of(), None, [Pose::IDENTITY; 2], 0.0, Some(wrong)).unwrap_err();
        assert!(matches!(refused, PageError::Number { name: "tolerance", .. }), "{refused}");
        let mut instance = placed("a", of(), 0.0);
        instance.margin = wrong;
        let refused = Page::scene([instance], Vec::new(), Vec::new(), Vec::new()).unwrap_err();
        assert!(matches!(refused, PageError::Number { name: "margin", .. }), "{refused}");
    }
    assert!(Page::motion(of(), None, [Pose::IDENTITY; 2], 0.0, Some(0.0)).is_err());
    // No way round is the shorter one.
    let half_turn = Pose::new([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 3]).unwrap();
    let refused = Page::motion(of(), None, [Pose::IDENTITY, half_turn], 0.0, None).unwrap_err();
    assert!(matches!(refused, PageError::Motion(_)), "{refused}");
    let bytes = block().bytes().len() as u64;
    assert!(Page::file(of()).unwrap().limited_to(bytes).is_ok());
    let refused = Page::file(of()).unwrap().limited_to(bytes - 1).unwrap_err();
    assert!(matches!(refused, PageError::TooLarge { .. }), "{refused}");
    // Frames count as well.
    let mut moving = placed("a", of(), 0.0);
    moving.moving = true;
    let page = Page::scene([moving], Vec::new(), Vec::new(), vec![vec![Pose::IDENTITY]; 10]).unwrap();
    assert_eq!(page.bytes(), bytes + 10 * 96);
}

#[test]
fn errors_of_the_writer_are_returned() {
    /// Takes so many bytes.
    struct Full(usize);
    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let page = Page::file(named("block", block())).unwrap();
    let length = html(&page).len();
    assert!(page.write(Full(length)).is_ok());
    for room in [0, TEMPLATE.len() / 2, length - 1] {
        assert_eq!(page.write(Full(room)).unwrap_err().kind(), io::ErrorKind::StorageFull);
    }
}
