//! The XML of robots as people have it: encodings, prefixes that nothing declares, document types, what xacro left, and texts that are
//! made to take long.

use crate::files::{of_texts, row};
use cbvh_robot::{Geometry, Robot, RobotError, RobotOptions};
use std::fs;
use std::time::Instant;

/// A box on link `Größe` and a ball on link `tip`, which touches it below 1.
fn urdf(before: &str, inside: &str) -> String {
    format!(
        "{before}<robot name=\"r\">\n{inside}<link name=\"Größe\"><collision><geometry><box size=\"1 1 1\"/></geometry></collision></link>\
         <link name=\"tip\"><collision><geometry><sphere radius=\"0.5\"/></geometry></collision></link>\
         <joint name=\"j\" type=\"prismatic\"><parent link=\"Größe\"/><child link=\"tip\"/><axis xyz=\"0 0 1\"/></joint></robot>"
    )
}

/// Checks that a robot is the one of the URDF, under the name of its first link.
fn check(robot: Result<Robot, RobotError>, first: &str, case: &str) {
    let mut robot = robot.unwrap_or_else(|error| panic!("{case}: {error}"));
    assert_eq!(robot.links().collect::<Vec<_>>(), [first, "tip"], "{case}");
    assert_eq!((robot.joints(), robot.warnings()), (&["j".to_owned()][..], &[][..]), "{case}");
    assert_eq!([0.99, 1.01].map(|z| robot.collide(&[z]).unwrap()), [true, false], "{case}");
}

fn latin(text: &str) -> Vec<u8> {
    text.chars().map(|character| u8::try_from(u32::from(character)).unwrap()).collect()
}

fn utf_16(text: &str, is_big_endian: bool) -> Vec<u8> {
    let bytes = |unit: u16| if is_big_endian { unit.to_be_bytes() } else { unit.to_le_bytes() };
    text.encode_utf16().flat_map(bytes).collect()
}

/// An SRDF that lets both links touch, and its declaration.
fn srdf(before: &str) -> String {
    format!("{before}<robot name=\"r\"><disable_collisions link1=\"Größe\" link2=\"tip\"/></robot>")
}

#[test]
fn each_encoding_is_read() {
    let declared = |encoding: &str| format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?>\n");
    let mut cases: Vec<(String, Vec<u8>, Vec<u8>)> = Vec::new();
    for encoding in ["ISO-8859-1", "iso-8859-1", "latin1", "windows-1252"] {
        let before = declared(encoding);
        cases.push((encoding.to_owned(), latin(&urdf(&before, "")), latin(&srdf(&before))));
    }
    for encoding in ["UTF-8", "utf-8", "us-ascii"] {
        let before = declared(encoding);
        cases.push((encoding.to_owned(), urdf(&before, "").into(), srdf(&before).into()));
    }
    for mark in ["\u{feff}", ""] {
        for before in
            [declared("UTF-16"), declared("utf-16le"), String::new(), format!("\r\n\n{}", declared("UTF-16"))]
        {
            for is_big_endian in [false, true] {
                let before = mark.to_owned() + &before;
                let bytes = [urdf(&before, ""), srdf(&before)].map(|text| utf_16(&text, is_big_endian));
                let [urdf, srdf] = bytes;
                cases.push((format!("UTF-16, {before:?}, big endian {is_big_endian}"), urdf, srdf));
            }
        }
        cases.push((format!("UTF-8, {mark:?}"), urdf(mark, "").into(), srdf(mark).into()));
    }
    for (case, urdf, srdf) in cases {
        check(of_texts(&urdf, None), "Größe", &case);
        let robot = of_texts(&urdf, Some(&srdf));
        let mut robot = robot.unwrap_or_else(|error| panic!("{case}: {error}"));
        assert!(!robot.collide(&[0.0]).unwrap() && robot.warnings().is_empty(), "{case}");
    }
    // A byte that is no UTF-8, in a name and in a comment.
    let mut bytes = urdf("", "<!-- Gr -->").into_bytes();
    let places: Vec<usize> = (0..bytes.len() - 1).filter(|&at| bytes[at..at + 2] == *b"Gr").collect();
    places.iter().for_each(|&at| bytes[at] = 0xfc);
    check(of_texts(&bytes, None), "\u{fffd}röße", "bad bytes");
    // A text without an end, and no text.
    for bytes in [&utf_16(&urdf("", ""), false)[..101], b"\xff\xfe", b"\0\0", b""] {
        let told = of_texts(bytes, None).unwrap_err().to_string();
        assert!(told.contains("robot.urdf: line ") && told.lines().count() == 1, "{told}");
    }
}

/// What stands around and in the elements that are read, and does not matter.
#[test]
fn what_does_not_matter_is_passed_over() {
    let declaration = "<?xml version=\"1.0\"?>\n";
    for before in [
        String::new(),
        format!("\n{declaration}"),
        format!("\n\r\n \t\n{declaration}"),
        format!("<!-- made by hand -->\n{declaration}"),
        format!("{declaration}<?xml-stylesheet href='a'?><!-- a -- b -->\n"),
        format!("{declaration}<!DOCTYPE robot>\n"),
        format!("{declaration}<!DOCTYPE robot SYSTEM \"file:///etc/passwd\">\n"),
        format!("{declaration}<!DOCTYPE robot [<!ENTITY a \"1 > 2\"><!ELEMENT robot (link)*>]>\n"),
        format!("<!DOCTYPE robot [\n<!ENTITY a SYSTEM 'b.xml'>\n]>\n{declaration}"),
    ] {
        check(of_texts(urdf(&before, ""), None), "Größe", &before);
    }
    for inside in [
        "<gazebo reference=\"tip\"><sensor name=\"s\" gz:type=\"dvl\"/></gazebo>",
        "<drake:collision_filter_group name=\"g\"><drake:member link=\"tip\"/></drake:collision_filter_group>",
        "<gz:link name=\"other\"/><gz:joint gz:name=\"k\"/>",
        "<gazebo><sensor:contact xmlns:sensor=\"s\"><updateRate>1.0</updateRate></sensor:contact></gazebo>",
        "<transmission name=\"${name}\"><xacro:reduction value=\"$(arg r)\"/><a b=\"&c;\"/>&d;</transmission>",
        "<material name=\"grey & white\"><description>black & white, a &unknown; and &#0;</description></material>",
        "<gazebo><a b=c d d=\"1\" d=\"2\"/></gazebo>",
        "text<![CDATA[ <robot> ]]>",
    ] {
        check(of_texts(urdf("", inside), None), "Größe", inside);
    }
    // At each depth of the elements that are read.
    let text = urdf("", "");
    for (at, _) in text.match_indices('>').filter(|&(at, _)| !text[at..].starts_with("></robot")) {
        let open = text[..at].rfind('<').unwrap();
        if text[open..].starts_with("</") {
            continue;
        }
        let (tag, end) =
            (text[..at].trim_end_matches('/'), if text[..at].ends_with('/') { "/>" } else { ">" });
        let more = format!(
            "{tag} gz:name=\"g\" drake:xyz='1' xacro:link=\"${{x}}\" effort=\"$(arg e)\"{end}{}",
            &text[at + 1..]
        );
        check(of_texts(&more, None), "Größe", &more);
        // Behind the first shape: an unknown one in its place would matter.
        if end == ">" && !text[open..].starts_with("<geometry") {
            let more = format!(
                "{}><gz:pose gz:a=\"1\"><link name=\"n\"/></gz:pose>{}",
                &text[..at],
                &text[at + 1..]
            );
            check(of_texts(&more, None), "Größe", &more);
        }
    }
    // An SRDF is read the same.
    let more = srdf("\n<?xml version='1.0'?><!DOCTYPE robot [<!ENTITY a 'b'>]>")
        .replace("link1", "gz:link1=\"x\" link1")
        .replace("</robot>", "<drake:group name=\"${a}\"/></robot>");
    let mut robot = of_texts(&text, Some(more.as_bytes())).unwrap();
    assert!(!robot.collide(&[0.0]).unwrap() && robot.warnings().is_empty());
}

#[test]
fn references_are_those_of_xml_alone() {
    let named = |name: &str| urdf("<!DOCTYPE robot [<!ENTITY a 'Größe'>]>", "").replace("Größe", name);
    check(of_texts(named("a&#10;b &amp;&lt;&gt;&quot;&apos;&#xdf;"), None), "a\nb &<>\"'ß", "references");
    for (text, expected) in [
        (
            named("&a;"),
            "robot.urdf: line 2, column 1: expected a character or one of the five entities of XML, found &a;",
        ),
        (urdf("", "").replace("1 1 1", "1 1 &one;"), "found &one;"),
        (urdf("", "").replace("1 1 1", "1 1 &#0;"), "expected XML"),
        (urdf("", "<limit/>").replace("tip", "a & b"), "expected XML"),
    ] {
        let told = of_texts(text, None).unwrap_err().to_string();
        assert!(told.contains(expected), "{told}");
    }
    // Each entity is ten of the one before it.
    let mut lols = "<!ENTITY l0 'lol'>".to_owned();
    for level in 1..40 {
        let ten = format!("&l{};", level - 1).repeat(10);
        lols += &format!("<!ENTITY l{level} '{ten}'>");
    }
    let told = of_texts(urdf(&format!("<!DOCTYPE robot [{lols}]>"), "").replace("tip", "&l39;"), None);
    assert!(told.unwrap_err().to_string().contains("found &l39;"));
}

/// A tree that resolves namespaces and compares attributes took a hundred seconds for half a MiB of these.
#[test]
fn the_time_grows_with_the_text() {
    let many = |count: usize, one: &dyn Fn(usize) -> String| (0..count).map(one).collect::<String>();
    let deep = |count: usize, name: &str| {
        format!("{}{}", format!("<{name}>").repeat(count), format!("</{name}>").repeat(count))
    };
    let start = Instant::now();
    for inside in [
        format!("<gazebo{}/>", many(200_000, &|k| format!(" a{k}='>\"'"))),
        format!("<material{}/>", many(200_000, &|k| format!(" xmlns:a{k}=\"b{k}\""))),
        many(100_000, &|k| format!("<z{k} xmlns:q{k}=\"q\"/>")),
        deep(200_000, "a"),
        deep(200_000, "link").replace("<link>", "<x:link x:name='a'>").replace("</link>", "</x:link>"),
    ] {
        check(of_texts(urdf("", &inside), None), "Größe", &inside[..100]);
    }
    let attributes = many(200_000, &|k| format!(" a{k}='1'"));
    check(
        of_texts(urdf("", "").replace("\"tip\"", &format!("\"tip\"{attributes}")), None),
        "Größe",
        "attributes",
    );
    // Elements that are read, each in the other.
    let robot = of_texts(row(1, 0), Some(format!("<robot>{}</robot>", deep(200_000, "group")).as_bytes()));
    assert!(robot.unwrap_err().to_string().contains("<group>: expected name, found no such attribute"));
    for unfinished in ["<robot>".to_owned() + &"<link>".repeat(200_000), "<robot ".to_owned() + &attributes] {
        assert!(of_texts(unfinished, None).unwrap_err().to_string().contains("robot.urdf: line 1, column "));
    }
    let seconds = start.elapsed().as_secs();
    assert!(seconds < 60, "{seconds} s");
}

#[test]
fn what_is_no_urdf_is_named() {
    for (text, expected) in [
        (
            "<sdf version=\"1.6\"/>",
            "line 1, column 1: expected the element <robot>, found <sdf>, an SDF file",
        ),
        ("<mujoco model=\"m\"/>", "found <mujoco>, an MJCF file"),
        (
            "<!DOCTYPE html>\n<html><p></html>",
            "line 2, column 1: expected the element <robot>, found <html>, an HTML page",
        ),
        ("version https://git-lfs.github.com/spec/v1\noid", "a pointer of Git LFS; run \"git lfs pull\""),
        ("{robot: 1}", "expected the element <robot> and no more, found {robot: 1}"),
        (
            "<robot name=\"r\">\n  <link name=\"a\"></robot>",
            "line 2, column 18: expected </link>, found </robot>",
        ),
        (
            "<robot><link name=\"a\"/></robot>\n<robot/>",
            "line 2, column 1: expected the end of the file, found <robot>",
        ),
        (
            "<robot><link name=\"a\" name=\"b\"/></robot>",
            "line 1, column 8: expected XML, found two attributes name",
        ),
        ("<robot><link name=\"ä\"/><link name=b/></robot>", "line 1, column 24: expected XML"),
    ] {
        let told = of_texts(text, None).unwrap_err().to_string();
        assert!(told.contains(expected), "{told}");
    }
    // A name is no line of its own.
    let told = of_texts("<robot><link name=\"a&#10;b\"/><link name=\"a&#10;b\"/></robot>", None);
    let told = told.unwrap_err().to_string();
    assert!(told.contains("link a\\u{a}b") && told.lines().count() == 1, "{told}");
}

const DECLARED: &str = " xmlns:xacro=\"http://www.ros.org/wiki/xacro\"";

/// Elements and expressions of xacro in place of which others were meant, whether the prefix is declared or not.
#[test]
fn macros_are_refused_where_they_matter() {
    for text in [
        urdf("", "<xacro:include filename=\"b\"/>"),
        urdf("", "<xacro:if value=\"1\"><link name=\"n\"/></xacro:if>"),
        urdf("", "<xacro:unless value=\"0\"/>"),
        urdf("", "<xacro:arm prefix=\"left\"/>"),
        urdf("", "<xacro:macro name=\"arm\"><xacro:if value=\"1\"/></xacro:macro>\n<xacro:arm/>"),
        urdf("", "").replace("<collision>", "<xacro:shape/><collision>"),
        urdf("", "").replace("<axis", "<xacro:limits/><axis"),
        urdf("", "").replace("<geometry>", "<geometry><xacro:shape/>"),
        urdf("", "").replace("1 1 1", "${s} 1 1"),
        urdf("", "").replace("0 0 1", "0 0 ${-1}"),
        urdf("", "").replace("\"0.5\"", "\"$(arg r)\""),
        urdf("", "").replace("tip", "${prefix}tip"),
        urdf("", "").replace("\"prismatic\"", "\"${type}\""),
        urdf("", "").replace("<sphere radius=\"0.5\"/>", "<mesh filename=\"$(find p)/m.stl\"/>"),
        urdf("", "").replace("<axis", "<origin xyz=\"$(optenv X 0 0 0)\"/><axis"),
        // A robot that is only defined.
        "<robot><xacro:macro name=\"arm\"><link name=\"a\"/></xacro:macro></robot>".to_owned(),
    ] {
        for text in [text.replace("<robot", &format!("<robot{DECLARED}")), text] {
            let Err(error) = of_texts(&text, None) else { panic!("{text}") };
            let told = error.to_string();
            assert!(told.contains("run xacro on the file first, found "), "{told}");
        }
    }
    let told = |text: &str| of_texts(text, None).unwrap_err().to_string();
    let said = told("<robot>\n<link name=\"a\"><xacro:b/></link></robot>");
    assert!(
        said.contains("robot.urdf: line 2, link a, <xacro:b>: expected a description without macros"),
        "{said}"
    );
    let said = told("<robot><link name=\"${p}a\"/></robot>");
    assert!(said.contains("found name=\"${p}a\""), "{said}");
    // An SRDF is read the same.
    for srdf in [
        "<disable_collisions link1=\"${p}a\" link2=\"b\"/>",
        "<xacro:arm/>",
        "<group name=\"g\"><xacro:arm/></group>",
    ] {
        let told = of_texts(row(2, 0), Some(format!("<robot>{srdf}</robot>").as_bytes())).unwrap_err();
        let told = told.to_string();
        assert!(
            told.contains("robot.srdf: line 1, ") && told.contains("run xacro on the file first"),
            "{told}"
        );
    }
}

#[test]
fn macros_are_passed_over_where_they_do_not_matter() {
    let expressions = [
        urdf("", "").replace("name=\"r\"", "name=\"$(arg name)\""),
        urdf("", "").replace("<axis", "<limit effort=\"${e}\" velocity=\"$(arg v)\"/><axis"),
        urdf("", "").replace(
            "<collision>",
            "<visual><geometry><xacro:b/><box size=\"${s}\"/></geometry></visual><collision>",
        ),
        urdf("", "").replace(
            "<collision>",
            "<inertial><mass value=\"${m}\"/><xacro:box m=\"1\"/></inertial><collision>",
        ),
        urdf("", "<gazebo><plugin name=\"${p}\"/><xacro:if value=\"1\"/></gazebo>"),
    ];
    for text in expressions {
        check(of_texts(&text, None), "Größe", &text);
    }
    // Definitions are used where an expression or a macro is, so that by themselves they are told.
    for inside in [
        "<xacro:property name=\"s\" value=\"${2 * pi}\"/>",
        "<xacro:arg name=\"a\" default=\"1\"/>",
        "<xacro:macro name=\"m\"><link name=\"${a}\"/></xacro:macro>",
    ] {
        for declared in [DECLARED, ""] {
            let text = urdf("", &format!("{inside}<xacro:property name=\"t\"/>"))
                .replace("<robot", &format!("<robot{declared}"));
            let robot = of_texts(&text, None).unwrap();
            assert_eq!(robot.links().count(), 2);
            let [warning] = robot.warnings() else { panic!("{:?}", robot.warnings()) };
            assert!(
                warning.contains("robot.urdf: line 2, <xacro:")
                    && warning.ends_with("was xacro run on this file?"),
                "{warning}"
            );
        }
    }
    // The shapes that are read are those that matter.
    let folder = cbvh_testkit::folder();
    let path = folder.path().join("r.urdf");
    let text = urdf("", "")
        .replace("collision>", "visual>")
        .replace("</link>", "<collision><xacro:a/></collision></link>");
    fs::write(&path, text).unwrap();
    let read = |geometry| Robot::from_urdf(&path, &RobotOptions::default().geometry(geometry));
    check(read(Geometry::Visual), "Größe", "visual");
    assert!(read(Geometry::Collision).unwrap_err().to_string().contains("found <xacro:a>"));
}
