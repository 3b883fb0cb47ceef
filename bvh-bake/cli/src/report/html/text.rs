//! The words around figures and tables: what was measured, where, how, and what to mind.

use super::escape;
use crate::report::json::{PairRecord, Report};
use crate::report::origin::Machine;

/// What the page is about, and whether answers were right.
pub(super) fn opening(report: &Report) -> String {
    let names: Vec<String> =
        report.pairs.iter().map(|pair| format!("<a href=\"#{0}\">{0}</a>", escape(&pair.name))).collect();
    let mut text = format!(
        "<p>How fast cbvh {} answers queries between triangle meshes, in every layout of its files (format {}), and \
         how exact the answers are. Pairs: {}. Measured on {} with the backend {}.</p>\n{}",
        report.origin.version,
        report.origin.format_version,
        names.join(", "),
        report.origin.date,
        report.settings.isa,
        machine(&report.origin.machine)
    );
    if report.wrong.is_empty() {
        text += "<p>All layouts gave the same answers about contact, and the same distances to the bit for the same \
                 triangles; with an allowed error all distances were within it.</p>\n";
    } else {
        let some: String =
            report.wrong.iter().take(20).map(|line| format!("<li>{}</li>\n", escape(line))).collect();
        text += &format!(
            "<div class=\"wrong\"><p><strong>{} wrong answers.</strong> No figure here means anything until that is \
             understood.</p><ul>\n{some}</ul></div>\n",
            report.wrong.len()
        );
    }
    for (holds, warning) in [
        (
            report.settings.quick,
            "A quick run, to try the command: a few poses and two rounds. Nothing to quote.",
        ),
        (report.origin.unoptimised, "The program was built without optimisation: times say nothing."),
        (!report.is_cold(), "What was swept is no more than the largest cache: cold figures are not cold."),
        (
            report.pairs.iter().any(|pair| pair.pinned.is_none()),
            "The measuring thread was not bound to a processor: the system would not.",
        ),
    ] {
        if holds {
            text += &format!("<p class=\"wrong\">{warning}</p>\n");
        }
    }
    text
}

/// Where it was measured.
pub(in crate::report) fn machine(machine: &Machine) -> String {
    format!(
        "<p>{} ({}{}), {}, {}.</p>\n",
        escape(&machine.processor),
        count(machine.processors, "processor"),
        if machine.is_virtual { " of a virtual machine" } else { "" },
        escape(&machine.system),
        caches(machine)
    )
}

/// A number with what it counts.
pub(in crate::report) fn count(number: usize, what: &str) -> String {
    format!("{number} {what}{}", if number == 1 { "" } else { "s" })
}

fn caches(machine: &Machine) -> String {
    let show = |bytes: u64| {
        if bytes >= 1 << 20 { format!("{} MiB", bytes >> 20) } else { format!("{} KiB", bytes >> 10) }
    };
    let each: Vec<String> =
        machine.caches.iter().map(|cache| format!("L{} {}", cache.level, show(cache.bytes))).collect();
    if each.is_empty() { "caches unknown".to_owned() } else { format!("caches {}", each.join(", ")) }
}

/// What a pair is and where it was put.
pub(super) fn pair(pair: &PairRecord) -> String {
    let pinned = pair.pinned.map_or("not bound to a processor".to_owned(), |pinned| {
        format!("bound to processor {} of {} allowed", pinned.processor, pinned.allowed)
    });
    format!(
        "<p>A: {}, {} triangles, diagonal {:.4}. B: {}, {} triangles, diagonal {:.4}. {} ({}). The measuring thread \
         was {pinned}.</p>\n",
        escape(&pair.a.mesh),
        pair.a.triangles,
        pair.a.diagonal,
        escape(&pair.b.mesh),
        pair.b.triangles,
        pair.b.diagonal,
        count(pair.poses, "pose"),
        escape(&pair.poses_from)
    )
}

/// How it was measured and what to mind.
pub(super) fn methods(report: &Report) -> String {
    let settings = &report.settings;
    let modelled = settings.model_poses;
    format!(
        "<h2 id=\"methods\">How it was measured</h2>\n<ul>\n\
         <li><strong>Times</strong> are those of single queries, on one thread that is bound to one processor. In each \
         of {} all variants take turns at each question, with three untimed queries before each turn. The median is \
         the middle over the rounds of each round's median over the poses, and the range beside it goes from the \
         first to the third quartile over the rounds.</li>\n\
         <li><strong>Warm</strong>: caches hold what the queries before left there. <strong>Cold</strong>: {} MiB of \
         other memory were read through before, once for each of {} and each question; then each variant was asked \
         once. Medians are over poses. Code stays warm, and pages had been checked.</li>\n\
         <li><strong>From disk</strong>: the system was asked to forget both files, which were then opened and asked \
         once, {} each. Reading ahead is the system's: where it reads more than the file at once, the order of pages \
         cannot show. <strong>Sparse</strong>: it was told to read no more than is touched; what a first touch \
         checks is whole pages of nodes and their blocks of triangles.</li>\n\
         <li><strong>Errors</strong> are against the distance that dop14-f32 with f32 triangles and no allowed error \
         gives, over the poses that are apart. That distance is exact to within a few roundings of f64. Quantised \
         triangles have moved by as much as the table says, 1e-5 of the diagonal at most unless told otherwise, and \
         so has their distance; near contact that is much of it.</li>\n\
         <li><strong>In vain</strong> (false positives): both trees are walked in memory as a query walks them, but \
         to the end, pruning at overlap (contact) or at the exact distance. Of all pairs of nodes whose decoded bounds \
         let them through, it is the part whose tight k-DOPs, along the same directions and re-aligned the same way, \
         would have stopped them. Taken from at most {modelled} of the poses.</li>\n\
         <li><strong>Modelled</strong> is what no file has. The binary tree of dop14-f16 is cut into the shape in \
         question, bounds are put through the format's arithmetic relative to what the predictor names, and the \
         same walk counts tests. It knows nothing of pages: no anchors, no heads. Larger leaves are less full than \
         those of a tree that was built for them. Counts are those of walks to the end, with the exact distance \
         known from the start: compare them with each other, not with measured ones. Where there is no figure, a walk \
         was given up after 131072 node tests.</li>\n\
         <li><strong>The usual layout</strong> (dop14-u8, f32 triangles) is measured three times, as a layout, among \
         splits (reach) and among orders (levels): how far these differ is noise.</li>\n</ul>\n\
         <h2 id=\"caveats\">What to mind</h2>\n<ul>\n\
         <li>Figures compare layouts on one machine on one day; they promise nothing about others.</li>\n\
         <li>On a virtual machine neighbours share the last cache and the memory, and nobody tells how much of it \
         there is to have.</li>\n\
         <li>Medians hide what single poses cost: see p90. Poses near contact and far apart are mixed as the list of \
         poses mixes them.</li>\n\
         <li>The table has the errors that were found, not those that could be: with an allowed error of 10 % an \
         answer may be 10 % too large, and for other poses it will be.</li>\n</ul>\n",
        count(settings.rounds, "round"),
        settings.sweep_bytes >> 20,
        count(settings.cold_poses, "pose"),
        count(settings.disk_poses, "pose"),
    )
}
