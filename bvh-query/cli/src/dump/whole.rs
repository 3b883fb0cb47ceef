//! A whole file: its header, sections and objects, and the statistics of their trees.

use super::Contents;
use super::statistics::{Level, Statistics};
use crate::console::{Record, hex, record};
use bvh_bake::FileError;
use bvh_format::header::{SectionKind, version_name};
use bvh_format::object::Object;
use bvh_format::source::Source;
use bvh_format::topology::ObjectTopology;
use std::collections::BTreeMap;

/// Shows a file of this name.
pub(super) fn file(name: &str, contents: &Contents) -> Result<Record, FileError> {
    let layout = &contents.layout;
    let topology = layout.check_topology(&contents.file)?;
    let mut trees = Vec::new();
    for (number, object) in layout.objects.iter().enumerate() {
        let statistics = Statistics::gather(contents, object)?;
        trees.push(object_json(number, object, topology.get(number), &statistics));
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
            number: number, name: of.name, object: of.object, member: of.member, meets: of.meets, margin: of.margin,
            solid: of.solid, rotation: of.rotation, translation: of.translation,
        }
    });
    Ok(record! {
        file: name,
        format_version: version,
        file_bytes: total,
        content_xxh3: content,
        sections: sections.collect::<Vec<_>>(),
        provenance: provenance,
        objects: trees,
        instances: instances.collect::<Vec<_>>(),
        bytes_per_tri: record! { total: per_triangle, nodes: nodes, leaves: leaves, ids: ids, other: other },
    })
}

/// Returns the lines of the provenance section. Lines that have no `=` are left out.
fn provenance(contents: &Contents) -> Result<BTreeMap<String, String>, FileError> {
    let mut sections = contents.layout.sections.iter();
    let section = sections.find(|section| section.kind == SectionKind::Provenance);
    let bytes = contents.file.read(section.map_or(0..0, |section| section.range.clone()))?;
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.lines().filter_map(|line| line.split_once('='));
    let plain = |text: &str| text.chars().filter(|c| !c.is_control()).collect();
    Ok(lines.map(|(key, value)| (plain(key), plain(value))).collect())
}

/// Returns an object, with its topology if the file states it, and the statistics of its tree.
fn object_json(
    number: usize,
    object: &Object,
    topology: Option<&ObjectTopology>,
    statistics: &Statistics,
) -> Record {
    let record = object.record();
    let all = statistics.levels.iter().fold(Level::default(), |sum, level| sum.joined(level));
    let pages = f64::from(record.pages.get());
    let levels = statistics.levels.iter().enumerate().map(|(number, level)| {
        record! {
            level: number,
            treelets: level.treelets,
            mean_children: level.mean_children(),
            packets: level.packets,
            mean_triangles_per_packet: level.mean_triangles(),
        }
    });
    record! {
        number: number,
        name: object.name(),
        profile: object.profile().name(),
        triangle_encoding: object.triangle_encoding().name(),
        origin: record.origin.map(|value| value.get()),
        box_lo: record.box_lo.map(|value| value.get()),
        box_hi: record.box_hi.map(|value| value.get()),
        sphere_centre: record.sphere_centre.map(|value| value.get()),
        sphere_radius: record.sphere_radius.get(),
        radius: object.radius(),
        solid: object.is_solid(),
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
        depth: statistics.levels.len(),
        mean_children: all.mean_children(),
        mean_triangles_per_packet: all.mean_triangles(),
        // The mean share of a page's lines that is in use.
        page_fill: statistics.lines as f64 / (pages * 64.0),
        mean_roots_per_page: statistics.roots as f64 / pages,
        levels: levels.collect::<Vec<_>>(),
    }
}
