//! A whole file: its header, sections and objects, and the statistics of their trees.

use super::statistics::{Level, Statistics};
use super::{Contents, Shown};
use crate::console::{Record, hex, length, plural, record};
use bvh_bake::FileError;
use bvh_format::header::{SectionKind, version_name};
use bvh_format::instances::Instance;
use bvh_format::object::Object;
use bvh_format::source::Source;
use bvh_format::topology::ObjectTopology;
use std::collections::BTreeMap;

/// The number of instances that are listed for a person.
const MAX_LISTED: usize = 20;

/// Shows a file of this name.
pub(super) fn file(name: &str, contents: &Contents, as_json: bool) -> Result<Shown, FileError> {
    let layout = &contents.layout;
    let topology = layout.check_topology(&contents.file)?;
    let mut trees = Vec::new();
    for (number, object) in layout.objects.iter().enumerate() {
        let statistics = Statistics::gather(contents, object)?;
        trees.push(Tree { number, object, topology: topology.get(number), statistics });
    }
    let instances = layout.read_instances(&contents.file)?;
    let provenance = provenance(contents)?;
    let bytes = |kinds: &[SectionKind]| -> u64 {
        let sections = layout.sections.iter().filter(|section| kinds.contains(&section.kind));
        sections.map(|section| section.range.len() as u64).sum()
    };
    let total = contents.file.length();
    let (nodes, leaves) = (bytes(&[SectionKind::Nodes]), bytes(&[SectionKind::Leaves]));
    let ids = bytes(&[SectionKind::Ids, SectionKind::Duplicates]);
    let other = total.saturating_sub(nodes + leaves + ids);
    let triangles: u64 = layout.objects.iter().map(|object| object.triangles()).sum();
    // Bytes per stored triangle by purpose.
    let [per_triangle, nodes, leaves, ids, other] =
        [total, nodes, leaves, ids, other].map(|bytes| bytes as f64 / triangles as f64);
    let (version, content) = (version_name(layout.version), hex(layout.content_checksum));
    if as_json {
        let sections = layout.sections.iter().map(|section| {
            record! {
                kind: section.kind.name(),
                required: section.kind.required(),
                content: section.kind.is_content(),
                offset: section.range.start,
                bytes: section.range.len(),
                xxh3: hex(section.checksum),
            }
        });
        let instances = instances.iter().enumerate().map(|(number, of)| {
            record! {
                number: number, name: of.name, object: of.object, member: of.member, meets: of.meets,
                rotation: of.rotation, translation: of.translation,
            }
        });
        return Ok(Shown::Json(record! {
            file: name,
            format_version: version,
            file_bytes: total,
            content_xxh3: content,
            sections: sections.collect::<Vec<_>>(),
            provenance: provenance,
            objects: trees.iter().map(Tree::json).collect::<Vec<_>>(),
            instances: instances.collect::<Vec<_>>(),
            bytes_per_tri: record! { total: per_triangle, nodes: nodes, leaves: leaves, ids: ids, other: other },
        }));
    }
    let mut text = format!("{name}\n  format   {version}\n  bytes    {total}\n  content  {content}\n");
    for (key, value) in &provenance {
        text += &format!("  {key:<10} {value}\n");
    }
    text += "\nsections\n      offset        bytes  xxh3              kind\n";
    for section in &layout.sections {
        let (kind, offset, bytes) = (section.kind.name(), section.range.start, section.range.len());
        text += &format!("{offset:>12} {bytes:>12}  {}  {kind}\n", hex(section.checksum));
    }
    text += &format!(
        "\nbytes per triangle {per_triangle:.2}: nodes {nodes:.2}, leaves {leaves:.2}, ids {ids:.2}, other {other:.2}\n"
    );
    trees.iter().for_each(|tree| text += &tree.text());
    if !instances.is_empty() {
        let count = instances.len();
        text += &format!("\n{count} {}\n", plural(count as u64, "instance"));
        let listed = instances.iter().enumerate().take(MAX_LISTED);
        listed.for_each(|(number, instance)| text += &instance_text(number, instance));
        if count > MAX_LISTED {
            text += &format!("  and {} more: --json lists all\n", count - MAX_LISTED);
        }
    }
    Ok(Shown::Text(text))
}

fn instance_text(number: usize, instance: &Instance) -> String {
    let Instance { object, member, meets, rotation: [x, y, z], translation: [tx, ty, tz], .. } = instance;
    let groups = if *member == u32::MAX && *meets == u32::MAX {
        String::new()
    } else {
        format!(", in groups {member:#x}, meets {meets:#x}")
    };
    let rows = [(x, tx), (y, ty), (z, tz)].map(|([a, b, c], t)| format!("{a} {b} {c} {t}")).join("  ");
    format!("  {number:>5} {:?}, object {object}{groups}, at {rows}\n", shortened(&instance.name))
}

/// Returns the first 60 characters of a name.
fn shortened(name: &str) -> String {
    name.chars().take(60).collect()
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

/// An object and the statistics of its tree.
struct Tree<'a> {
    number: usize,
    object: &'a Object,
    /// `None` if the file does not state which objects are closed.
    topology: Option<&'a ObjectTopology>,
    statistics: Statistics,
}

impl Tree<'_> {
    /// Returns the sum of all levels.
    fn all_levels(&self) -> Level {
        self.statistics.levels.iter().fold(Level::default(), |sum, level| sum.joined(level))
    }

    /// Returns the mean share of a page's lines that is in use, and the mean number of its roots.
    fn per_page(&self) -> [f64; 2] {
        let pages = f64::from(self.object.record().pages.get());
        [self.statistics.lines as f64 / (pages * 64.0), self.statistics.roots as f64 / pages]
    }

    fn json(&self) -> Record {
        let (record, topology, all) = (self.object.record(), self.topology, self.all_levels());
        let [page_fill, mean_roots_per_page] = self.per_page();
        let levels = self.statistics.levels.iter().enumerate().map(|(number, level)| {
            record! {
                level: number,
                treelets: level.treelets,
                mean_children: level.mean_children(),
                packets: level.packets,
                mean_triangles_per_packet: level.mean_triangles(),
                // Mean over the children of the level's treelets.
                width_inflation: level.mean_width(),
            }
        });
        record! {
            number: self.number,
            name: self.object.name(),
            profile: self.object.profile().name(),
            triangle_encoding: self.object.triangle_encoding().name(),
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
            // The number of components listed; 0 if each triangle counts as one.
            components: topology.map(ObjectTopology::component_count),
            // The number of triangles that count other than once, because of duplicates.
            nets: topology.map(ObjectTopology::net_count),
            max_vertex_rounding: record.max_vertex_rounding.get(),
            max_quantization_error: record.max_quantization_error.get(),
            treelets: record.treelets.get(),
            packets: record.packets.get(),
            first_page: record.first_page.get(),
            pages: record.pages.get(),
            // The number of treelets on the longest path from the root to a leaf packet.
            depth: self.statistics.levels.len(),
            mean_children: all.mean_children(),
            mean_triangles_per_packet: all.mean_triangles(),
            page_fill: page_fill,
            mean_roots_per_page: mean_roots_per_page,
            width_inflation: all.mean_width(),
            levels: levels.collect::<Vec<_>>(),
        }
    }

    fn text(&self) -> String {
        let (object, record) = (self.object, self.object.record());
        let mut text = format!("\nobject {} {:?}\n", self.number, shortened(object.name()));
        let mut line = |label: &str, value: String| text += &format!("  {label:<10} {value}\n");
        let (profile, triangles) = (object.profile().name(), object.triangle_encoding().name());
        line("layout", format!("{profile}, triangles {triangles}"));
        let (stored, of) = (record.triangles.get(), record.input_triangles.get());
        let (flat, twice) = (record.degenerate.get(), record.duplicates.get());
        line(
            "triangles",
            format!("{stored} stored of {of}, {flat} of zero area, {twice} exact duplicates left out"),
        );
        if let Some(topology) = self.topology {
            let components = match topology.component_count() {
                0 => "components not listed".to_owned(),
                count => format!("{count} {}", plural(count as u64, "component")),
            };
            let nets = match topology.net_count() {
                0 => String::new(),
                1 => ", 1 triangle counts other than once".to_owned(),
                count => format!(", {count} triangles count other than once"),
            };
            let closed = if topology.closed { "closed" } else { "open" };
            line("surface", format!("{closed}, {components}{nets}"));
        }
        let point = |point: [f32; 3]| format!("{point:?}");
        line("origin", format!("{:?}", record.origin.map(|value| value.get())));
        let [lo, hi, centre] =
            [record.box_lo, record.box_hi, record.sphere_centre].map(|of| point(of.map(|value| value.get())));
        line("box", format!("{lo} to {hi}"));
        line("sphere", format!("{centre}, radius {:?}", record.sphere_radius.get()));
        let (rounded, quantized) = (record.max_vertex_rounding.get(), record.max_quantization_error.get());
        let (rounded, quantized) = (length(rounded), length(quantized));
        line("moved", format!("at most {rounded} by rounding, at most {quantized} by quantisation"));
        let (pages, first, [fill, roots]) = (record.pages.get(), record.first_page.get(), self.per_page());
        let fill = 100.0 * fill;
        line("pages", format!("{pages} from {first}, {fill:.1} % full, {roots:.2} roots per page"));
        let all = self.all_levels();
        line(
            "tree",
            format!(
                "{} treelets, {} levels, {:.3} children per treelet; {} packets of {:.3} triangles; slabs {:.4} times as wide \
                 as tight ones",
                record.treelets.get(),
                self.statistics.levels.len(),
                all.mean_children(),
                record.packets.get(),
                all.mean_triangles(),
                all.mean_width()
            ),
        );
        text += "  level  treelets  children   packets  triangles/packet  width inflation\n";
        for (number, level) in self.statistics.levels.iter().enumerate() {
            text += &format!(
                "  {number:>5} {:>9} {:>9.3} {:>9} {:>17.3} {:>16.4}\n",
                level.treelets,
                level.mean_children(),
                level.packets,
                level.mean_triangles(),
                level.mean_width()
            );
        }
        text
    }
}
