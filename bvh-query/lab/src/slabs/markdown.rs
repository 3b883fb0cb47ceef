//! `slabs.md`: the tables for people.

use super::Report;
use super::census::Census;
use super::row::{Figure, Row, geometric_mean};
use super::share::{PARTS, Share};
use super::variant::Topic;
use cbvh_measure::table::{markdown, whole};

/// Returns the page.
pub(super) fn page(report: &Report) -> String {
    let mut page = format!(
        "# Slabs that turn with the surface\n\n\
         Tests of complete walks, node tests (16 pairs) / packet tests (16 pairs) / pairs of nodes that take the slab \
         test. Up to {} poses per set. Where walks were given up, figures are lower bounds and marked with >. *Cost* is \
         0.151 us per node test and 0.10 us (contact) or 0.17 us (distance) per packet test, relative to the first \
         row of the first table; slab tests are not in it. Counted on {} with cbvh {}, on {}.\n",
        report.poses,
        report.origin.date,
        report.origin.version,
        report.origin.machine.text()
    );
    let mut first = of(report, Topic::Fixed);
    let title_of_first = first.first().map(|row| title(row));
    first.retain(|row| Some(title(row)) == title_of_first);
    for (topic, head) in [
        (Topic::Fixed, "Fixed directions"),
        (Topic::Stored, "Which direction, in how many bits"),
        (Topic::ForContact, "Tested directions for contact, the most useful one first"),
        (Topic::ForDistance, "Tested directions for distance, the most useful one first"),
        (Topic::Factors, "Factors of slabs along other directions, and sides"),
        (Topic::Largest, "The most triangles below a node with a slab"),
        (Topic::Owners, "Packets and treelets"),
        (Topic::Narrow, "Only narrow slabs"),
    ] {
        page += &format!("\n## {head}\n\nGeometric means over the pairs, of medians over the poses.\n\n");
        page += &summary(&of(report, topic), &first, |figure| figure.median);
        page += "\nGeometric means over the pairs, of means over the poses.\n\n";
        page += &summary(&of(report, topic), &first, |figure| figure.mean);
    }
    for (topic, head) in [(Topic::Fixed, "Fixed directions by pair"), (Topic::Growth, "Growth")] {
        for (name, value) in [("medians", (|f: Figure| f.median) as fn(Figure) -> f64), ("means", |f| f.mean)]
        {
            page += &format!("\n## {head}, {name}\n");
            page += &by_pair(&of(report, topic), value);
        }
    }
    page + &shares(report) + &census(report)
}

fn of(report: &Report, topic: Topic) -> Vec<&Row> {
    report.rows.iter().filter(|row| row.topic == topic).collect()
}

/// Returns different values in the order of their first occurrence.
fn distinct<'a, T: PartialEq>(rows: &[&'a Row], value: impl Fn(&'a Row) -> T) -> Vec<T> {
    let mut values = Vec::new();
    for row in rows {
        let value = value(row);
        if !values.contains(&value) {
            values.push(value);
        }
    }
    values
}

fn title(row: &Row) -> (&'static str, &str) {
    (row.base, &row.variant)
}

fn set(row: &Row) -> String {
    format!("{} {}", row.question.name(), row.poses)
}

/// Joins the three counts of rows of one variant.
fn counts(rows: &[&Row], value: fn(Figure) -> f64) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let mean = |figure: fn(&Row) -> Figure| whole(geometric_mean(rows.iter().map(|row| value(figure(row)))));
    let mark = if rows.iter().any(|row| row.given_up > 0) { "> " } else { "" };
    let slabs = rows.iter().any(|row| row.slab_pairs.mean > 0.0);
    let slab_pairs = if slabs { mean(|row| row.slab_pairs) } else { "-".to_owned() };
    format!("{mark}{} / {} / {slab_pairs}", mean(|row| row.node_tests), mean(|row| row.packet_tests))
}

/// One line per variant, with means over the pairs. Costs are relative to those of the rows `first`.
fn summary(rows: &[&Row], first: &[&Row], value: fn(Figure) -> f64) -> String {
    let sets = distinct(rows, set);
    let mut heads = vec!["fixed directions".to_owned(), "variant".to_owned()];
    heads.extend(sets.iter().flat_map(|set| [set.clone(), "cost".to_owned()]));
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let cost = |rows: &[&Row]| geometric_mean(rows.iter().map(|row| row.cost()));
    let line = |(base, variant): (&str, &str)| {
        let mut cells = vec![base.to_owned(), variant.to_owned()];
        for wanted in &sets {
            let of_set = |title: (&str, &str)| -> Vec<&Row> {
                let same = |row: &&&Row| (row.base, row.variant.as_str()) == title && set(row) == *wanted;
                rows.iter().filter(same).copied().collect()
            };
            let here = of_set((base, variant));
            cells.push(counts(&here, value));
            let of_first: Vec<&Row> = first.iter().filter(|row| set(row) == *wanted).copied().collect();
            cells.push(format!("{:.2}", cost(&here) / cost(&of_first)));
        }
        cells
    };
    markdown(&heads, distinct(rows, title).into_iter().map(line))
}

/// One table per set of poses, one line per variant, one column per pair.
fn by_pair(rows: &[&Row], value: fn(Figure) -> f64) -> String {
    let pairs = distinct(rows, |row| row.pair.as_str());
    let mut text = String::new();
    for wanted in distinct(rows, set) {
        let heads: Vec<&str> =
            ["fixed directions", "variant"].into_iter().chain(pairs.iter().copied()).collect();
        let line = |(base, variant): (&str, &str)| {
            let mut cells = vec![base.to_owned(), variant.to_owned()];
            for pair in &pairs {
                let same = |row: &&&Row| {
                    (row.base, row.variant.as_str()) == (base, variant)
                        && row.pair == *pair
                        && set(row) == wanted
                };
                let here: Vec<&Row> = rows.iter().filter(same).copied().collect();
                cells.push(counts(&here, value));
            }
            cells
        };
        text +=
            &format!("\n### {wanted}\n\n{}", markdown(&heads, distinct(rows, title).into_iter().map(line)));
    }
    text
}

fn percent(part: u64, of: u64) -> String {
    if of == 0 { String::new() } else { format!("{:.0} %", 100.0 * part as f64 / of as f64) }
}

fn shares(report: &Report) -> String {
    let mut meshes: Vec<&str> = report.shares.iter().map(|share| share.mesh.as_str()).collect();
    meshes.dedup();
    let line = |name: &str, (children, narrower): (u64, [u64; 3])| {
        let mut cells = vec![name.to_owned(), whole(children as f64)];
        cells.extend(narrower.map(|count| percent(count, children)));
        cells
    };
    let parts = PARTS.map(|part| format!("narrower than {part}"));
    let heads = |first| [first, "children", &parts[0], &parts[1], &parts[2]];
    let by_mesh = meshes
        .iter()
        .map(|&mesh| line(mesh, Share::sum(report.shares.iter().filter(|share| share.mesh == mesh))));
    let mut sizes: Vec<u32> = report.shares.iter().map(|share| share.most_triangles).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let by_size = sizes.iter().map(|&most| {
        let name = if most == u32::MAX { "more".to_owned() } else { format!("up to {most}") };
        line(&name, Share::sum(report.shares.iter().filter(|share| share.most_triangles == most)))
    });
    format!(
        "\n## Width of slabs as a share of what the box reaches\n\n{}\n{}",
        markdown(&heads("mesh"), by_mesh),
        markdown(&heads("triangles below"), by_size)
    )
}

fn census(report: &Report) -> String {
    let heads: Vec<&str> = ["mesh", "layout"].into_iter().chain(Census::KINDS).collect();
    let bytes = |census: &Census| {
        let mut cells = vec![census.mesh.clone(), census.layout.clone()];
        cells.extend((0..Census::KINDS.len()).map(|kind| format!("{:.2}", census.per_triangle(kind))));
        cells
    };
    let counts = |census: &Census| {
        let per = |part: u64, of: u64| format!("{:.2}", part as f64 / of.max(1) as f64);
        vec![
            census.mesh.clone(),
            census.layout.clone(),
            per(census.children, census.treelets),
            per(census.triangles, census.packets),
            per(census.packet_vertices, census.packets),
            percent(census.parent_planes, census.planes),
            census.entropy().map_or("-".to_owned(), |bits| format!("{bits:.2}")),
        ]
    };
    let count_heads = [
        "mesh",
        "layout",
        "children per treelet",
        "triangles per packet",
        "distinct vertices per packet",
        "planes of the parent",
        "entropy, bits per code",
    ];
    format!(
        "\n## Bytes per triangle\n\n{}\n{}",
        markdown(&heads, report.census.iter().map(bytes)),
        markdown(&count_heads, report.census.iter().map(counts))
    )
}
