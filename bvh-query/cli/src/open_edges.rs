//! Shows the edges that leave objects open: in words, and as a JSON record.

use crate::console::{Record, record};
use bvh_bake::{EdgesOfKind, OpenEdge, OpenEdges};
use bvh_query::Shape;

/// Returns all that is known of open edges.
pub(crate) fn json(edges: &OpenEdges) -> Record {
    let [(_, boundary), (_, flipped), (_, crowded)] = edges.kinds();
    let gaps = &edges.gaps;
    record! {
        count: edges.count(),
        boundary: kind_json(boundary),
        flipped: kind_json(flipped),
        crowded: kind_json(crowded),
        nearest_gap: gaps.nearest,
        cracks: gaps.cracks,
        widest_crack: gaps.widest_crack,
        proposed_weld: edges.proposed_weld(),
    }
}

fn kind_json(of_kind: &EdgesOfKind) -> Record {
    let edge = |edge: &OpenEdge| {
        let [from, to] = edge.ends;
        record! { object: edge.object, triangles: edge.triangles, from: from, to: to, gap: edge.gap }
    };
    record! { count: of_kind.count, first: of_kind.first.iter().map(edge).collect::<Vec<_>>() }
}

/// Returns why shapes are open, after the words that say so: for each open shape its name, if it has one, and its open edges.
pub(crate) fn why(shapes: &[(&str, Shape<'_>)]) -> String {
    let mut text = String::new();
    for (name, shape) in shapes {
        let Some(edges) = shape.open_edges().ok().filter(|edges| !edges.is_empty()) else { continue };
        let name = if name.is_empty() { String::new() } else { format!("{name}: ") };
        text.push_str(&format!("{} {name}{edges}", if text.is_empty() { ":" } else { ";" }));
    }
    text
}

/// Lists the first edges of each kind, one line each. `has_objects` says whether lines name their objects.
pub(crate) fn list(edges: &OpenEdges, has_objects: bool) -> String {
    let mut text = String::new();
    for (kind, of_kind) in edges.kinds() {
        for edge in &of_kind.first {
            let [from, to] = edge.ends;
            let object = if has_objects { format!(" of object {}", edge.object) } else { String::new() };
            let triangles = edge.triangles.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
            let many = if edge.triangles.len() == 1 { "triangle" } else { "triangles" };
            let gap = edge.gap.map_or(String::new(), |gap| format!(", gap {gap:.2e}"));
            text.push_str(&format!(
                "  {kind} edge{object} from {from:?} to {to:?}, {many} {triangles}{gap}\n"
            ));
        }
        let rest = of_kind.count - of_kind.first.len() as u64;
        if rest > 0 {
            text.push_str(&format!("  and {rest} more {kind} edges\n"));
        }
    }
    text
}
