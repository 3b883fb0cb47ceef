//! Writes clashes as a BCF 2.1 file (buildingSMART, BIM Collaboration Format), which CAD and BIM tools open as a list of issues.
//!
//! Each clash is a topic in a folder of its own: `markup.bcf` describes it, and `viewpoint.bcfv` selects both parts and looks at
//! the clash from outside the assembly. All identifiers follow from the names of the parts, so that the topic of a clash stays
//! the same from run to run.

use super::found::{Found, short};
use super::parts::{Assembly, centre, diagonal};
use super::zip::{Archive, MAX_ENTRIES};
use crate::console::{Failure, escape};
use bvh_format::checksum::checksum;
use bvh_query::ClashClass;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// The entries of a topic in the archive: its folder and its two files.
const ENTRIES_PER_TOPIC: usize = 3;
const XML: &str = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
/// The vertical angle of view in degrees. The format allows 45 to 60.
const FIELD_OF_VIEW: f64 = 60.0;
/// How far the camera is from the clash, in diagonals of the smaller part.
const DIAGONALS_AWAY: f64 = 2.0;

/// Returns the bytes of the file.
pub(super) fn archive(path: &Path, assembly: &Assembly, found: &[Found<'_>]) -> Result<Vec<u8>, Failure> {
    let too_many = || {
        let path = path.display();
        let (most, count) = ((MAX_ENTRIES - 1) / ENTRIES_PER_TOPIC, found.len());
        Failure::Limit(format!(
            "{path}: expected at most {most} clashes in a BCF file, found {count}; use --csv or --json"
        ))
    };
    if 1 + ENTRIES_PER_TOPIC * found.len() > MAX_ENTRIES {
        return Err(too_many());
    }
    let date = date(seconds_since_1970()?);
    let mut archive = Archive::default();
    let version = "<Version VersionId=\"2.1\"><DetailedVersion>2.1</DetailedVersion></Version>\n";
    archive.add("bcf.version", format!("{XML}{version}").as_bytes());
    for (index, clash) in found.iter().enumerate() {
        let topic = guid(clash, "topic");
        // BCF 2.1 asks for entries of the folders (Implementation Agreements, .BCFZIP encoding guide).
        archive.add(&format!("{topic}/"), b"");
        archive.add(&format!("{topic}/markup.bcf"), markup(assembly, clash, index, &date).as_bytes());
        archive.add(&format!("{topic}/viewpoint.bcfv"), viewpoint(assembly, clash).as_bytes());
    }
    archive.finish().ok_or_else(too_many)
}

fn markup(assembly: &Assembly, clash: &Found<'_>, index: usize, date: &str) -> String {
    let class = clash.class.name();
    let [a, b] = clash.names.map(escape);
    let extent = clash.extent();
    let titled = if extent.is_empty() { String::new() } else { format!(", {extent}") };
    let priority = match clash.class {
        ClashClass::Duplicated | ClashClass::Contained => "Medium",
        ClashClass::Near | ClashClass::Touching | ClashClass::Apart => "Low",
        _ => "High",
    };
    let unit = if assembly.is_in_metres { "metres" } else { "mesh units" };
    let (topic, view, place) = (guid(clash, "topic"), guid(clash, "viewpoint"), clash.place());
    let status = clash.status.map_or(String::new(), |status| format!("<Labels>{}</Labels>", status.name()));
    format!(
        "{XML}<Markup><Topic Guid=\"{topic}\" TopicType=\"Clash\" TopicStatus=\"Open\"><Title>{class}: {a} | {b}{titled}</Title>\
         <Priority>{priority}</Priority><Index>{index}</Index><Labels>{class}</Labels>{status}\
         <CreationDate>{date}</CreationDate><CreationAuthor>cbvh</CreationAuthor>\
         <Description>{a} | {b}: {class}{titled}, at {place}, in {unit}. Clash {id}.</Description></Topic>\
         <Viewpoints Guid=\"{view}\"><Viewpoint>viewpoint.bcfv</Viewpoint></Viewpoints></Markup>\n",
        id = clash.id(),
    )
}

fn viewpoint(assembly: &Assembly, clash: &Found<'_>) -> String {
    let component = |name: &str| {
        let guid = ifc_guid(name).map_or(String::new(), |guid| format!(" IfcGuid=\"{guid}\""));
        let name = escape(name);
        format!(
            "<Component{guid}><OriginatingSystem>cbvh</OriginatingSystem><AuthoringToolId>{name}</AuthoringToolId></Component>"
        )
    };
    let components: String = clash.names.iter().map(|name| component(name)).collect();
    let [position, direction, up] = camera(assembly, clash);
    let xyz =
        |name: &str, [x, y, z]: [f64; 3]| format!("<{name}><X>{x:?}</X><Y>{y:?}</Y><Z>{z:?}</Z></{name}>");
    format!(
        "{XML}<VisualizationInfo Guid=\"{}\"><Components><Selection>{components}</Selection>\
         <Visibility DefaultVisibility=\"true\"/></Components><PerspectiveCamera>{}{}{}\
         <FieldOfView>{}</FieldOfView></PerspectiveCamera></VisualizationInfo>\n",
        guid(clash, "viewpoint"),
        xyz("CameraViewPoint", position),
        xyz("CameraDirection", direction),
        xyz("CameraUpVector", up),
        short(FIELD_OF_VIEW),
    )
}

/// Returns where the camera is, where it looks, and what is up. It looks from the outside towards the middle of the assembly.
fn camera(assembly: &Assembly, clash: &Found<'_>) -> [[f64; 3]; 3] {
    let unit = |v: [f64; 3]| {
        let length = v[0].hypot(v[1]).hypot(v[2]);
        (length > 0.0 && length.is_finite()).then(|| v.map(|c| c / length))
    };
    let middle = centre(&assembly.bounds);
    let out = unit([0, 1, 2].map(|k| clash.point[k] - middle[k])).unwrap_or([1.0, 0.0, 0.0]);
    // Half from outside and half from a corner, so that the view is never along an axis of most parts.
    let corner = [0.5, -0.4, 0.3];
    let out = unit([0, 1, 2].map(|k| out[k] + corner[k])).unwrap_or([1.0, 0.0, 0.0]);
    let sizes = clash.parts.map(|number| diagonal(&assembly.parts[number].bounds()));
    let away = DIAGONALS_AWAY * if sizes[0] < sizes[1] { sizes[0] } else { sizes[1] };
    // z is up, but for its part along the view.
    let up =
        unit([0, 1, 2].map(|k| f64::from(u8::from(k == 2)) - out[2] * out[k])).unwrap_or([0.0, 1.0, 0.0]);
    [[0, 1, 2].map(|k| clash.point[k] + away * out[k]), out.map(|c| -c), up]
}

/// Returns an identifier that follows from that of a clash and from what it is for: a UUID of version 8.
fn guid(clash: &Found<'_>, what: &str) -> String {
    let half = |which: u8| checksum(format!("{} {what} {which}", clash.id()).as_bytes());
    let high = half(0) & !0xF000 | 0x8000;
    let low = half(1) >> 2 | 1 << 63;
    let bits = format!("{high:016x}{low:016x}");
    [&bits[..8], &bits[8..12], &bits[12..16], &bits[16..20], &bits[20..]].join("-")
}

/// Returns the identifier that a part has in an IFC file, if its name, or what follows its last slash, is one.
fn ifc_guid(name: &str) -> Option<&str> {
    let last = name.rsplit('/').next()?;
    let is_one = last.len() == 22
        && last.starts_with(['0', '1', '2', '3'])
        && last.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'$');
    is_one.then_some(last)
}

/// Returns the time of `SOURCE_DATE_EPOCH` or, without it, of the clock.
fn seconds_since_1970() -> Result<u64, Failure> {
    match std::env::var("SOURCE_DATE_EPOCH") {
        Ok(text) => text.parse().ok().filter(|&seconds| seconds < SECONDS_UNTIL_10000).ok_or_else(|| {
            Failure::Usage(format!(
                "SOURCE_DATE_EPOCH: expected seconds since 1970 as a whole number, found {text:?}"
            ))
        }),
        Err(_) => Ok(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())),
    }
}

/// The year 10000 needs a fifth digit.
const SECONDS_UNTIL_10000: u64 = 253_402_300_800;

/// Writes a time as XML does, in UTC.
fn date(seconds: u64) -> String {
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    format!("{}T{hour:02}:{minute:02}:{second:02}Z", cbvh_measure::date(seconds / 86400))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_clock() {
        // From date -u -d @SECONDS.
        for (seconds, expected) in [(0, "1970-01-01T00:00:00Z"), (951_868_799, "2000-02-29T23:59:59Z")] {
            assert_eq!(date(seconds), expected);
        }
    }

    #[test]
    fn identifiers_of_ifc_are_recognised() {
        assert_eq!(ifc_guid("floor/2O2Fr$t4X7Zf8NOew3FLOH"), Some("2O2Fr$t4X7Zf8NOew3FLOH"));
        assert!(
            ["", "arm", "4O2Fr$t4X7Zf8NOew3FLOH", "2O2Fr-t4X7Zf8NOew3FLOH"]
                .iter()
                .all(|name| ifc_guid(name).is_none())
        );
    }
}
