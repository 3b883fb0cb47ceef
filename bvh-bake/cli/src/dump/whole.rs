//! A whole file: its header, sections and objects, and the statistics of their trees.

use super::Contents;
use super::statistics::{Level, Statistics};
use crate::console::{hex, length, plural};
use bvh_bake::FileError;
use bvh_format::header::SectionKind;
use bvh_format::instances::Instance;
use bvh_format::object::Object;
use bvh_format::source::Source;
use bvh_format::topology::ObjectTopology;
use serde::Serialize;
use std::collections::BTreeMap;

/// The object that `dump FILE --json` prints.
#[derive(Serialize)]
pub(super) struct FileDump {
    file: String,
    format_version: String,
    file_bytes: u64,
    content_xxh3: String,
    sections: Vec<SectionDump>,
    /// The lines of the provenance section.
    provenance: BTreeMap<String, String>,
    objects: Vec<ObjectDump>,
    /// Where objects stand in the world, if the file is a scene.
    instances: Vec<InstanceDump>,
    /// Bytes per stored triangle.
    bytes_per_tri: Split,
}

#[derive(Serialize)]
struct SectionDump {
    kind: &'static str,
    required: bool,
    content: bool,
    offset: u64,
    bytes: u64,
    xxh3: String,
}

/// Bytes per stored triangle by purpose.
#[derive(Serialize)]
struct Split {
    total: f64,
    nodes: f64,
    leaves: f64,
    ids: f64,
    other: f64,
}

#[derive(Serialize)]
struct ObjectDump {
    number: usize,
    name: String,
    profile: &'static str,
    triangle_encoding: &'static str,
    origin: [f64; 3],
    box_lo: [f32; 3],
    box_hi: [f32; 3],
    sphere_centre: [f32; 3],
    sphere_radius: f32,
    input_triangles: u64,
    triangles: u64,
    degenerate: u64,
    duplicates: u64,
    /// Whether the surface is closed; this and the next two fields are null if the file does not state it.
    closed: Option<bool>,
    /// The number of components listed; 0 if each triangle counts as one.
    components: Option<usize>,
    /// The number of triangles that count other than once, because of duplicates.
    nets: Option<usize>,
    max_vertex_rounding: f64,
    max_quantization_error: f64,
    treelets: u64,
    packets: u64,
    first_page: u32,
    pages: u32,
    /// The number of treelets on the longest path from the root to a leaf packet.
    depth: usize,
    mean_children: f64,
    mean_triangles_per_packet: f64,
    /// The mean share of a page's lines that is in use.
    page_fill: f64,
    mean_roots_per_page: f64,
    width_inflation: f64,
    levels: Vec<LevelDump>,
}

#[derive(Serialize)]
struct InstanceDump {
    number: usize,
    name: String,
    object: u32,
    member: u32,
    meets: u32,
    rotation: [[f64; 3]; 3],
    translation: [f64; 3],
}

#[derive(Serialize)]
struct LevelDump {
    level: usize,
    treelets: u64,
    mean_children: f64,
    packets: u64,
    mean_triangles_per_packet: f64,
    /// Mean over the children of the level's treelets.
    width_inflation: f64,
}

impl FileDump {
    pub(super) fn new(file: String, contents: &Contents) -> Result<Self, FileError> {
        let layout = &contents.layout;
        let objects = layout.objects.iter().enumerate();
        let topology = layout.check_topology(&contents.file)?;
        let dumps =
            objects.map(|(number, object)| ObjectDump::new(contents, number, object, topology.get(number)));
        let dumps: Vec<_> = dumps.collect::<Result<_, _>>()?;
        let bytes = |kinds: &[SectionKind]| -> u64 {
            let sections = layout.sections.iter().filter(|section| kinds.contains(&section.kind));
            sections.map(|section| section.range.len() as u64).sum()
        };
        let total = contents.file.length();
        let (nodes, leaves) = (bytes(&[SectionKind::Nodes]), bytes(&[SectionKind::Leaves]));
        let ids = bytes(&[SectionKind::Ids, SectionKind::Duplicates]);
        let triangles: u64 = layout.objects.iter().map(|object| object.triangles()).sum();
        let per_triangle = |bytes: u64| bytes as f64 / triangles as f64;
        Ok(Self {
            file,
            format_version: bvh_format::header::version_name(layout.version),
            file_bytes: total,
            content_xxh3: hex(layout.content_checksum),
            sections: layout
                .sections
                .iter()
                .map(|section| SectionDump {
                    kind: section.kind.name(),
                    required: section.kind.required(),
                    content: section.kind.is_content(),
                    offset: section.range.start as u64,
                    bytes: section.range.len() as u64,
                    xxh3: hex(section.checksum),
                })
                .collect(),
            provenance: provenance(contents)?,
            objects: dumps,
            instances: InstanceDump::all(contents)?,
            bytes_per_tri: Split {
                total: per_triangle(total),
                nodes: per_triangle(nodes),
                leaves: per_triangle(leaves),
                ids: per_triangle(ids),
                other: per_triangle(total.saturating_sub(nodes + leaves + ids)),
            },
        })
    }

    pub(super) fn to_text(&self) -> String {
        let mut text = format!("{}\n", self.file);
        text += &format!("  format   {}\n  bytes    {}\n", self.format_version, self.file_bytes);
        text += &format!("  content  {}\n", self.content_xxh3);
        for (key, value) in &self.provenance {
            text += &format!("  {key:<10} {value}\n");
        }
        text += "\nsections\n      offset        bytes  xxh3              kind\n";
        for section in &self.sections {
            let SectionDump { kind, offset, bytes, xxh3, .. } = section;
            text += &format!("{offset:>12} {bytes:>12}  {xxh3}  {kind}\n");
        }
        let Split { total, nodes, leaves, ids, other } = self.bytes_per_tri;
        text += &format!(
            "\nbytes per triangle {total:.2}: nodes {nodes:.2}, leaves {leaves:.2}, ids {ids:.2}, other {other:.2}\n"
        );
        self.objects.iter().for_each(|object| text += &object.to_text());
        if !self.instances.is_empty() {
            text +=
                &format!("\n{} {}\n", self.instances.len(), plural(self.instances.len() as u64, "instance"));
            self.instances.iter().take(MOST_SHOWN).for_each(|instance| text += &instance.to_text());
            if self.instances.len() > MOST_SHOWN {
                text += &format!("  and {} more: --json lists all\n", self.instances.len() - MOST_SHOWN);
            }
        }
        text
    }
}

/// The number of instances that are listed for a person.
const MOST_SHOWN: usize = 20;

impl InstanceDump {
    /// Reads the instances of a scene; none of a file without them.
    fn all(contents: &Contents) -> Result<Vec<Self>, FileError> {
        let instances = contents.layout.read_instances(&contents.file)?;
        let dump = |(number, instance): (usize, Instance)| {
            let Instance { name, object, member, meets, rotation, translation } = instance;
            Self { number, name, object, member, meets, rotation, translation }
        };
        Ok(instances.into_iter().enumerate().map(dump).collect())
    }

    fn to_text(&self) -> String {
        let Self { number, object, rotation: [x, y, z], translation: [tx, ty, tz], .. } = self;
        let name: String = self.name.chars().take(60).collect();
        let groups = if self.member == u32::MAX && self.meets == u32::MAX {
            String::new()
        } else {
            format!(", in groups {:#x}, meets {:#x}", self.member, self.meets)
        };
        let rows = [(x, tx), (y, ty), (z, tz)].map(|([a, b, c], t)| format!("{a} {b} {c} {t}")).join("  ");
        format!("  {number:>5} {name:?}, object {object}{groups}, at {rows}\n")
    }
}

/// Returns the lines of the provenance section. Lines that have no `=` are left out.
fn provenance(contents: &Contents) -> Result<BTreeMap<String, String>, FileError> {
    let mut sections = contents.layout.sections.iter();
    let section = sections.find(|section| section.kind == SectionKind::Provenance);
    let bytes = contents.file.read(section.map_or(0..0, |section| section.range.clone()))?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.lines().filter_map(|line| line.split_once('='));
    // A terminal would obey control characters.
    let plain = |text: &str| text.chars().filter(|c| !c.is_control()).collect();
    Ok(lines.map(|(key, value)| (plain(key), plain(value))).collect())
}

impl ObjectDump {
    fn new(
        contents: &Contents,
        number: usize,
        object: &Object,
        topology: Option<&ObjectTopology>,
    ) -> Result<Self, FileError> {
        let statistics = Statistics::gather(contents, object)?;
        let record = object.record();
        let whole = statistics.levels.iter().fold(Level::default(), |sum, level| sum.joined(level));
        let pages = f64::from(record.pages.get());
        Ok(Self {
            number,
            name: object.name().to_owned(),
            profile: object.profile().name(),
            triangle_encoding: object.triangle_encoding().name(),
            origin: record.origin.map(|value| value.get()),
            box_lo: record.box_lo.map(|value| value.get()),
            box_hi: record.box_hi.map(|value| value.get()),
            sphere_centre: record.sphere_centre.map(|value| value.get()),
            sphere_radius: record.sphere_radius.get(),
            input_triangles: record.input_triangles.get(),
            triangles: record.triangles.get(),
            degenerate: record.degenerate.get(),
            duplicates: record.duplicates.get(),
            closed: topology.map(|topology| topology.closed),
            components: topology.map(ObjectTopology::component_count),
            nets: topology.map(ObjectTopology::net_count),
            max_vertex_rounding: record.max_vertex_rounding.get(),
            max_quantization_error: record.max_quantization_error.get(),
            treelets: record.treelets.get(),
            packets: record.packets.get(),
            first_page: record.first_page.get(),
            pages: record.pages.get(),
            depth: statistics.levels.len(),
            mean_children: whole.mean_children(),
            mean_triangles_per_packet: whole.mean_triangles(),
            page_fill: statistics.lines as f64 / (pages * 64.0),
            mean_roots_per_page: statistics.roots as f64 / pages,
            width_inflation: whole.mean_width(),
            levels: statistics
                .levels
                .iter()
                .enumerate()
                .map(|(number, level)| LevelDump {
                    level: number,
                    treelets: level.treelets,
                    mean_children: level.mean_children(),
                    packets: level.packets,
                    mean_triangles_per_packet: level.mean_triangles(),
                    width_inflation: level.mean_width(),
                })
                .collect(),
        })
    }

    fn to_text(&self) -> String {
        let shown: String = self.name.chars().take(60).collect();
        let mut text = format!("\nobject {} {shown:?}\n", self.number);
        let mut line = |label: &str, value: String| text += &format!("  {label:<10} {value}\n");
        line("layout", format!("{}, triangles {}", self.profile, self.triangle_encoding));
        line(
            "triangles",
            format!(
                "{} stored of {}, {} of zero area, {} exact duplicates left out",
                self.triangles, self.input_triangles, self.degenerate, self.duplicates
            ),
        );
        if let (Some(closed), Some(components), Some(nets)) = (self.closed, self.components, self.nets) {
            let components = match components {
                0 => "components not listed".to_owned(),
                count => format!("{count} {}", plural(count as u64, "component")),
            };
            let nets = match nets {
                0 => String::new(),
                1 => ", 1 triangle counts other than once".to_owned(),
                count => format!(", {count} triangles count other than once"),
            };
            line("surface", format!("{}, {components}{nets}", if closed { "closed" } else { "open" }));
        }
        line("origin", format!("{:?}", self.origin));
        line("box", format!("{:?} to {:?}", self.box_lo, self.box_hi));
        line("sphere", format!("{:?}, radius {:?}", self.sphere_centre, self.sphere_radius));
        let (rounded, quantized) = (self.max_vertex_rounding, self.max_quantization_error);
        let (rounded, quantized) = (length(rounded), length(quantized));
        line("moved", format!("at most {rounded} by rounding, at most {quantized} by quantisation"));
        line(
            "pages",
            format!(
                "{} from {}, {:.1} % full, {:.2} roots per page",
                self.pages,
                self.first_page,
                100.0 * self.page_fill,
                self.mean_roots_per_page
            ),
        );
        line(
            "tree",
            format!(
                "{} treelets, {} levels, {:.3} children per treelet; {} packets of {:.3} triangles; slabs {:.4} times as wide \
                 as tight ones",
                self.treelets,
                self.depth,
                self.mean_children,
                self.packets,
                self.mean_triangles_per_packet,
                self.width_inflation
            ),
        );
        text += "  level  treelets  children   packets  triangles/packet  width inflation\n";
        for level in &self.levels {
            text += &format!(
                "  {:>5} {:>9} {:>9.3} {:>9} {:>17.3} {:>16.4}\n",
                level.level,
                level.treelets,
                level.mean_children,
                level.packets,
                level.mean_triangles_per_packet,
                level.width_inflation
            );
        }
        text
    }
}
